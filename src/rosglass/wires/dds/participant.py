"""One node's place in a DDS domain, and what it tells about the nodes and endpoints in it."""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rosglass.errors import NodeClosedError
from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone_qos import Qos
from rosglass.wires.dds.discovery_info import PARTICIPANT_USER_DATA, NodeEntities
from rosglass.wires.dds.domain import Domain
from rosglass.wires.dds.lingering import Lingering
from rosglass.wires.dds.pump import Pump

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.comm import NodeName
    from rosglass.wires.dds.graph import DdsGraph
    from rosglass.wires.dds.options import DdsOptions

__all__ = ["Participant"]

#: Seconds that closing waits for those who are using it, which takes them milliseconds.
_PATIENCE = 5.0


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

    def remove_endpoint(self, guid: bytes) -> None:
        """Remove a reader or writer."""
        with self._lock:
            if self._endpoints.pop(guid, None) is not None:
                self._tell()

    @contextmanager
    def in_use(self) -> Iterator[None]:
        """Keep the participant from being deleted meanwhile.

        What belongs to it goes with it, and with that memory that somebody may be using.

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
            self._use.wait_for(lambda: not self._users, _PATIENCE)
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
