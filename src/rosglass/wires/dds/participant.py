"""The DDS participant of a node, and its pump, the thread that handles all its events."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rosglass.comm.handle import undo_on_error
from rosglass.errors import NodeClosedError
from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone import Event, Qos, Waitset, set_events
from rosglass.wires.dds.domain import Domain, fragment_size, large_sample_advice
from rosglass.wires.dds.graph import PARTICIPANT_USER_DATA, NodeEntities

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import NodeName
    from rosglass.wires.dds.domain import DdsOptions
    from rosglass.wires.dds.graph import DdsGraph

__all__ = ["Participant"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that closing waits for the participant's pump, and its users, which take milliseconds.
_CLOSE_TIMEOUT_S = 5.0
#: Poll interval of the pump in seconds: normally, and at high sample rates.
_IDLE_POLL_S, _BUSY_POLL_S = 0.03, 0.005
#: Seconds until the pump calls a handler again that raised an exception.
_BACKOFF_S = 0.1
#: Seconds that readers have to acknowledge the last samples, as in Cyclone DDS.
_ACKNOWLEDGE_TIMEOUT_S = 1.0
#: Poll interval of lingering writers in seconds, while a participant is closing.
_LINGER_POLL_S = 0.002
#: Number of writers to remember; older ones are available while they are matched.
_MAX_WRITERS = 1000
#: Key of the lingering writers in the pump; no entity has that number.
_LINGERING = 0


class Participant:
    """A DDS participant with its pump and the list of its nodes.

    Args:
        options: The domain and its configuration.

    Attributes:
        entity: Cyclone's number for it.
        guid: Its 16 bytes of identity.
        fragment_size: Size in bytes of the largest sample that is sent in one piece.
        large_sample_advice: What to do if readers on Fast DDS are too slow for larger ones; may be
            empty.
        born: Monotonic time when it joined the domain.
        pump: Handles the events of its entities.
        lingering: The closed writers whose samples are not acknowledged yet.
        on_nodes: Called with all nodes when they or their endpoints change, one call at a time;
            set by discovery.
        writers: GUIDs and type hashes of the most recent topic writers, by handle.
        seen: The graph of the domain; set by discovery.

    Raises:
        ConnectionLostError: This machine has no network interface to use, or no free port.
        ConversionError: The configuration is wrong.
        UnsupportedError: The process is already in the domain with another configuration.
    """

    def __init__(self, options: DdsOptions) -> None:
        self.on_nodes: Callable[[tuple[NodeEntities, ...]], None] = lambda _: None
        self.seen: DdsGraph | None = None
        self._nodes: dict[NodeName, int] = {}
        self._endpoints: dict[bytes, tuple[NodeName, bool]] = {}
        self.writers: dict[int, tuple[bytes, str]] = {}
        #: Guards all of its state; notified when :meth:`in_use` ends.
        self._lock = threading.Condition()
        self._users = 0
        self._leaving: dict[int, Callable[[], None]] = {}
        self._closed = False
        self._domain = Domain(options)
        self.fragment_size = fragment_size(options)
        self.large_sample_advice = large_sample_advice(options)
        with undo_on_error(self._domain.close):
            qos = Qos()
            qos.set_user_data(PARTICIPANT_USER_DATA)
            self.entity = cyclone.create_participant(options.domain, qos)
            self.born = time.monotonic()
            self.guid = cyclone.guid(self.entity)
            self.pump = Pump(self.entity, f"DDS domain {options.domain}")
            self.lingering = LingeringWriters(self.pump)

    def nodes(self) -> tuple[NodeEntities, ...]:
        """Return its nodes with the GUIDs of their readers and writers."""
        with self._lock:
            return self._entities()

    def add_node(self, node: NodeName) -> None:
        """Add a node; a node added twice must be removed twice."""
        with self._lock:
            self._nodes[node] = self._nodes.get(node, 0) + 1
            self._notify()

    def remove_node(self, node: NodeName) -> None:
        """Remove a node."""
        with self._lock:
            self._nodes[node] -= 1
            if not self._nodes[node]:
                del self._nodes[node]
            self._notify()

    def add_endpoint(self, node: NodeName, guid: bytes, *, writer: bool) -> None:
        """Add a reader or writer of a node."""
        with self._lock:
            self._endpoints[guid] = (node, writer)
            self._notify()

    def add_writer(self, handle: int, guid: bytes, type_hash: str) -> None:
        """Remember a topic's writer: its samples may be read after its deletion."""
        with self._lock:
            if len(self.writers) >= _MAX_WRITERS:
                del self.writers[next(iter(self.writers))]
            self.writers[handle] = guid, type_hash

    def remove_endpoint(self, guid: bytes) -> None:
        """Remove a reader or writer."""
        with self._lock:
            if self._endpoints.pop(guid, None) is not None:
                self._notify()

    @contextmanager
    def in_use(self) -> Iterator[None]:
        """Keep the participant and the memory of its entities from being deleted.

        Raises:
            NodeClosedError: It is being closed.
        """
        with self._lock:
            if self._closed:
                raise NodeClosedError("the node is closed; connect again")
            self._users += 1
        try:
            yield
        finally:
            with self._lock:
                self._users -= 1
                self._lock.notify_all()

    def call_before_close(self, entity: int, end: Callable[[], None] | None) -> None:
        """Register a function to call before the entities are deleted; None removes it."""
        with self._lock:
            if end is None:
                self._leaving.pop(entity, None)
            else:
                self._leaving[entity] = end

    def close(self) -> None:
        """Delete the participant with its entities; no callback runs afterwards."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self.on_nodes = lambda _: None
            self._lock.wait_for(lambda: not self._users, _CLOSE_TIMEOUT_S)
        self.pump.close()
        for end in list(self._leaving.values()):
            end()
        self.lingering.close()
        cyclone.delete(self.entity)
        self._domain.close()

    def _notify(self) -> None:
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
    """The thread that waits for events of a participant's entities and calls their handlers.

    It uses a waitset instead of Cyclone DDS's listeners: those run on the receiving threads, where
    waiting for the GIL would let the socket's buffer overflow and delay every acknowledgement.

    Args:
        participant: The participant.
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
        """Call `act`, on the pump's thread, at each of `events` of an entity.

        New data is reported once, and again only after some was taken: `act` returns whether more
        may wait, and is then called again after the other handlers. A status is reported until it
        is read. Deleting the entity ends this; :meth:`forget` releases `act`.
        """
        set_events(entity, events)
        self._acts[entity] = act
        self._waitset.attach(entity, entity)

    def poll(self, entity: int, act: Callable[[], object] | None) -> None:
        """Call `act` about thirty times a second, more often while it returns True.

        None ends this, and calls the entity's handler once, for data that is already waiting.
        """
        if act is None:
            self._idle.pop(entity, None)
            self._again.append(entity)
        else:
            self._idle[entity] = act
        self._waitset.wake()

    def forget(self, entity: int) -> None:
        """Release the handlers of a deleted entity."""
        self._acts.pop(entity, None)
        self._idle.pop(entity, None)

    @property
    def current(self) -> bool:
        """True in the pump's own thread."""
        return threading.current_thread() is self._thread

    def close(self) -> None:
        """End the thread; no handler runs afterwards, except one that called this."""
        self._closed = True
        if self.current:
            return
        self._waitset.wake()
        self._thread.join(_CLOSE_TIMEOUT_S)
        self._waitset.close()

    def _run(self) -> None:
        while not self._closed:
            self._run_handler(self._run_once)

    def _run_once(self) -> None:
        again = [self._again.popleft() for _ in range(len(self._again))] if self._again else None
        woken = self._waitset.wait(0.0 if again else self._interval if self._idle else None)
        for entity in dict.fromkeys((*woken, *again)) if again else woken:
            act = self._acts.get(entity)
            if act is not None and self._run_handler(act):
                self._again.append(entity)
        if self._idle and (now := time.monotonic()) >= self._due:
            busy = [visit for visit in list(self._idle.values()) if self._run_handler(visit)]
            self._interval = _BUSY_POLL_S if busy else _IDLE_POLL_S
            self._due = now + self._interval

    def _run_handler(self, act: Callable[[], object]) -> object:
        if self._closed:
            return None
        try:
            return act()
        except BaseException:  # noqa: BLE001 - the other handlers must go on, whatever this one raises
            if not self._closed:
                _log.exception("%s: what arrived cannot be handed on", self._thread.name)
                time.sleep(_BACKOFF_S)
            return True  # there may be more data, which is not reported again


class LingeringWriters:
    """The closed writers of a participant that linger until their samples are acknowledged.

    Cyclone DDS can do this itself (``WriterLingerDuration``), but blocks the thread that deletes a
    writer: for a second if a peer was killed, and for one writer after the other.

    Args:
        pump: Polls them, about thirty times a second.
    """

    def __init__(self, pump: Pump) -> None:
        self._pump = pump
        #: Deadlines, conditions and deleters, by writer; any thread may add some.
        self._waiting: dict[int, tuple[float, Callable[[], bool], Callable[[], None]]] = {}

    def add(self, writer: int, is_done: Callable[[], bool], delete: Callable[[], None]) -> None:
        """Call `delete` once a writer's samples are acknowledged, or after a second."""
        set_events(writer, Event.NONE)  # no thread handles them any more
        self._waiting[writer] = time.monotonic() + _ACKNOWLEDGE_TIMEOUT_S, is_done, delete
        self._pump.poll(_LINGERING, self._poll)

    def close(self) -> None:
        """Wait until all are deleted; called by the thread that has closed the pump."""
        while self._waiting:
            self._poll()
            time.sleep(_LINGER_POLL_S)

    def _poll(self) -> None:
        now = time.monotonic()
        for writer, (deadline, is_done, delete) in self._waiting.copy().items():
            if now >= deadline or is_done():
                delete()
                self._waiting.pop(writer, None)
        if not self._waiting:
            self._pump.forget(_LINGERING)
            if self._waiting:  # another thread has just added one
                self._pump.poll(_LINGERING, self._poll)
