"""One node's place in a DDS domain: its participant, and the one thread that hands things on."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rosglass.errors import NodeClosedError
from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone import Event, Qos, Waitset, set_events
from rosglass.wires.dds.domain import Domain
from rosglass.wires.dds.graph import PARTICIPANT_USER_DATA, NodeEntities

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import NodeName
    from rosglass.wires.dds.domain import DdsOptions
    from rosglass.wires.dds.graph import DdsGraph

__all__ = ["Participant"]

_log = logging.getLogger("rosglass.ros2")
#: Time that closing waits for users of the participant, which take milliseconds, and for its pump.
_CLOSE_TIMEOUT_S = 5.0
#: Time between two looks at readers that are polled: usually, and when much comes.
_IDLE_POLL_S, _BUSY_POLL_S = 0.03, 0.005
#: Time until an act of the pump that failed is repeated.
_BACKOFF_S = 0.1
#: Time that readers have to acknowledge what was sent last, as long as Cyclone DDS gives them.
_ACKNOWLEDGE_TIMEOUT_S = 1.0
#: Time between two looks at lingering writers while a participant is closed.
_LINGER_POLL_S = 0.002
#: Writers that are remembered; older ones are known as long as they are matched.
_MAX_WRITERS = 1000
#: What the pump knows the lingering writers by; no entity has that number.
_LINGERING = 0


class Participant:
    """A DDS participant with its pump and the list of its nodes.

    Args:
        options: Which domain, and how to join it.

    Attributes:
        entity: Cyclone's number for it.
        guid: Its 16 bytes of identity.
        born: Monotonic time when it joined the domain.
        pump: Where everything that arrives is handed on.
        lingering: Where closed writers wait until what they sent has arrived.
        on_nodes: Called with all nodes whenever they or their endpoints change, never twice at a
            time; what announces them sets it.
        writers: GUIDs and type hashes of the last writers of topics, by their handles.
        seen: What is seen of the others; what follows them sets it.

    Raises:
        ConnectionLostError: This machine has no network interface to use, or no free port.
        ConversionError: The configuration is wrong.
        UnsupportedError: The process is in the domain already with another configuration.
    """

    def __init__(self, options: DdsOptions) -> None:
        self.on_nodes: Callable[[tuple[NodeEntities, ...]], None] = lambda _: None
        self.seen: DdsGraph | None = None
        self._nodes: dict[NodeName, int] = {}
        self._endpoints: dict[bytes, tuple[NodeName, bool]] = {}
        self.writers: dict[int, tuple[bytes, str]] = {}
        self._lock = threading.Lock()
        self._use = threading.Condition()
        self._users = 0
        self._leaving: dict[int, Callable[[], None]] = {}
        self._closed = False
        self._domain = Domain(options)
        try:
            qos = Qos()
            qos.set_user_data(PARTICIPANT_USER_DATA)
            self.entity = cyclone.create_participant(options.domain, qos)
            self.born = time.monotonic()
            self.guid = cyclone.guid(self.entity)
            self.pump = Pump(self.entity, f"DDS domain {options.domain}")
            self.lingering = Lingering(self.pump)
        except BaseException:
            self._domain.close()
            raise

    def nodes(self) -> tuple[NodeEntities, ...]:
        """Return its nodes with the identities of their readers and writers."""
        with self._lock:
            return self._entities()

    def add_node(self, node: NodeName) -> None:
        """Add a node; one that is added twice has to be removed twice."""
        with self._lock:
            self._nodes[node] = self._nodes.get(node, 0) + 1
            self._tell()

    def remove_node(self, node: NodeName) -> None:
        """Remove a node."""
        with self._lock:
            self._nodes[node] -= 1
            if not self._nodes[node]:
                del self._nodes[node]
            self._tell()

    def add_endpoint(self, node: NodeName, guid: bytes, *, writer: bool) -> None:
        """Add a reader or writer of a node."""
        with self._lock:
            self._endpoints[guid] = (node, writer)
            self._tell()

    def add_writer(self, handle: int, guid: bytes, type_hash: str) -> None:
        """Remember a topic's writer, whose samples may be read after it was deleted."""
        with self._lock:
            if len(self.writers) >= _MAX_WRITERS:
                del self.writers[next(iter(self.writers))]
            self.writers[handle] = guid, type_hash

    def remove_endpoint(self, guid: bytes) -> None:
        """Remove a reader or writer."""
        with self._lock:
            if self._endpoints.pop(guid, None) is not None:
                self._tell()

    @contextmanager
    def in_use(self) -> Iterator[None]:
        """Keep the participant from being deleted meanwhile.

        What belongs to it goes with it, and with that memory that another thread may be using.

        Raises:
            NodeClosedError: It is being closed.
        """
        with self._use:
            if self._closed:
                raise NodeClosedError("the node is closed; connect again")
            self._users += 1
        try:
            yield
        finally:
            with self._use:
                self._users -= 1
                self._use.notify_all()

    def before_leaving(self, entity: int, end: Callable[[], None] | None) -> None:
        """Have `end` called before what belongs to the participant is deleted; None ends that."""
        with self._use:
            if end is None:
                self._leaving.pop(entity, None)
            else:
                self._leaving[entity] = end

    def close(self) -> None:
        """Leave the domain with all that belongs to it; nothing is handed on afterwards."""
        with self._lock, self._use:
            if self._closed:
                return
            self._closed = True
            self.on_nodes = lambda _: None
        with self._use:
            self._use.wait_for(lambda: not self._users, _CLOSE_TIMEOUT_S)
        self.pump.close()
        for end in list(self._leaving.values()):
            end()
        self.lingering.close()
        cyclone.delete(self.entity)
        self._domain.close()

    def _tell(self) -> None:
        self.on_nodes(self._entities())

    def _entities(self) -> tuple[NodeEntities, ...]:
        readers: dict[NodeName, list[bytes]] = {node: [] for node in self._nodes}
        writers: dict[NodeName, list[bytes]] = {node: [] for node in self._nodes}
        for guid, (node, writer) in self._endpoints.items():
            (writers if writer else readers).setdefault(node, []).append(guid)
        return tuple(
            NodeEntities(node, tuple(readers.get(node, ())), tuple(writers.get(node, ())))
            for node in {**readers, **writers}
        )


class Pump:
    """Waits for a participant's readers and writers, and acts on one after the other.

    A waitset instead of callbacks: those run on the threads that receive, where waiting for the
    interpreter would let the socket's buffer overflow and hold up every acknowledgement.

    Args:
        participant: Whose entities it waits for.
        name: The thread's name.
    """

    def __init__(self, participant: int, name: str) -> None:
        self._waitset = Waitset(participant)
        self._acts: dict[int, Callable[[], bool | None]] = {}
        self._again: deque[int] = deque()
        self._idle: dict[int, Callable[[], object]] = {}
        self._closed = False
        self._due, self._interval = 0.0, _IDLE_POLL_S
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def watch(self, entity: int, events: Event, act: Callable[[], bool | None]) -> None:
        """Call `act`, on the pump's thread, when one of `events` happens to an entity.

        New data is reported once, and then only after some was taken: `act` returns whether there
        may be more, and is called again after the others had their turn. A status is reported until
        it is read. Deleting the entity ends it; :meth:`forget` lets go of `act`.
        """
        set_events(entity, events)
        self._acts[entity] = act
        self._waitset.attach(entity, entity)

    def visit(self, entity: int, act: Callable[[], object] | None) -> None:
        """Call `act` some thirty times a second, whatever happens; more often when it says so.

        None ends that, and lets what :meth:`watch` was given look for data at once.
        """
        if act is None:
            self._idle.pop(entity, None)
            self._again.append(entity)
        else:
            self._idle[entity] = act
        self._waitset.wake()

    def forget(self, entity: int) -> None:
        """Let go of what was to be done for an entity that was deleted."""
        self._acts.pop(entity, None)
        self._idle.pop(entity, None)

    @property
    def current(self) -> bool:
        """Whether the calling thread is the pump's."""
        return threading.current_thread() is self._thread

    def close(self) -> None:
        """End the thread; nothing is done afterwards, except what called this."""
        self._closed = True
        if self.current:
            return
        self._waitset.wake()
        self._thread.join(_CLOSE_TIMEOUT_S)
        self._waitset.close()

    def _run(self) -> None:
        while not self._closed:
            self._do(self._turn)

    def _turn(self) -> None:
        again = [self._again.popleft() for _ in range(len(self._again))] if self._again else None
        woken = self._waitset.wait(0.0 if again else self._interval if self._idle else None)
        for entity in dict.fromkeys((*woken, *again)) if again else woken:
            act = self._acts.get(entity)
            if act is not None and self._do(act):
                self._again.append(entity)
        if self._idle and (now := time.monotonic()) >= self._due:
            busy = [visit for visit in list(self._idle.values()) if self._do(visit)]
            self._interval = _BUSY_POLL_S if busy else _IDLE_POLL_S
            self._due = now + self._interval

    def _do(self, act: Callable[[], object]) -> object:
        if self._closed:
            return None
        try:
            return act()
        except BaseException:  # whatever a callback raises, the others' messages must go on
            if not self._closed:
                _log.exception("%s: what arrived cannot be handed on", self._thread.name)
                time.sleep(_BACKOFF_S)
            return True  # there may be more, which is not reported again


class Lingering:
    """Keeps a participant's closed writers until their readers have everything, a second at most.

    Cyclone DDS can do that, too (``WriterLingerDuration``), but holds up who deletes a writer:
    where a peer was killed, for a second, and one writer after the other. Here all wait together.

    Args:
        pump: What looks after them, some thirty times a second.
    """

    def __init__(self, pump: Pump) -> None:
        self._pump = pump
        self._lock = threading.Lock()
        self._waiting: dict[int, tuple[float, Callable[[], None]]] = {}

    def add(self, writer: int, delete: Callable[[], None]) -> None:
        """Call `delete` once what a writer sent has arrived, or will not; returns at once."""
        set_events(writer, Event.NONE)  # no thread reads them any more
        with self._lock:
            self._waiting[writer] = time.monotonic() + _ACKNOWLEDGE_TIMEOUT_S, delete
            self._pump.visit(_LINGERING, self._look)

    def close(self) -> None:
        """Wait until all are deleted; for the thread that has closed the pump."""
        while self._waiting:
            self._look()
            time.sleep(_LINGER_POLL_S)

    def _look(self) -> None:
        """Delete those that are done."""
        with self._lock:
            waiting = list(self._waiting.items())
        now = time.monotonic()
        for writer, (deadline, delete) in waiting:
            if now >= deadline or cyclone.acknowledged(writer):
                delete()
                with self._lock:
                    self._waiting.pop(writer, None)
        with self._lock:
            if not self._waiting:
                self._pump.forget(_LINGERING)
