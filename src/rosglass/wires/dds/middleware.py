"""ROS 2 over DDS, by Cyclone DDS: speaks with every rmw implementation that speaks DDS."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState, EndpointKind, Handle, Status
from rosglass.errors import NodeClosedError
from rosglass.wires.base import Middleware, Reader, Replier, Requester, Writer
from rosglass.wires.dds.discovery import DdsDiscovery
from rosglass.wires.dds.endpoints import DdsReader, DdsWriter
from rosglass.wires.dds.participant import Participant
from rosglass.wires.dds.services import DdsReplier, DdsRequester

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm import EndpointInfo, NodeName
    from rosglass.comm.graph import Graph
    from rosglass.interfaces import Definition
    from rosglass.wires.base import OnReply, OnRequest, OnSample
    from rosglass.wires.dds.options import DdsOptions

__all__ = ["DdsMiddleware"]


class DdsMiddleware(Middleware):
    """A participant in a DDS domain."""

    matches_qos = True
    matches_hashes = False
    # Cyclone labels every payload as little endian, but knows no types whose bytes to swap.
    keeps_byte_order = False
    announces_requests = True
    describes_types = True

    def __init__(self, options: DdsOptions) -> None:
        self._options = options
        self._lock = threading.Lock()
        self._participant: Participant | None = None
        self._discovery: DdsDiscovery | None = None
        self._closed = False
        self._graph: Graph
        self._changed: Callable[[], None] = lambda: None

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        """Join the domain."""
        self._graph, self._changed = graph, changed
        self._participant = participant = Participant(self._options)
        self._discovery = DdsDiscovery(participant, graph, self._options.humble, changed)
        changed()

    def status(self) -> Status:
        """Return whether anyone else is in the domain."""
        where = f"DDS domain {self._options.domain}"
        discovery = self._discovery
        if self._closed:
            return Status(ConnectionState.CLOSED, "closed")
        if discovery is not None and (peers := discovery.peers):
            participants = "1 other participant" if peers == 1 else f"{peers} other participants"
            return Status(ConnectionState.CONNECTED, f"{where}, {participants}")
        if discovery is not None and discovery.had_peers:
            return Status(ConnectionState.LOST, f"everyone has left {where}, waiting for them")
        return Status(ConnectionState.CONNECTING, f"nobody else is in {where}, waiting for them")

    def unnamed(self) -> int:
        """Return how many participants of ROS 2 have not said which nodes they have."""
        return 0 if self._discovery is None else self._discovery.unnamed

    def announce(self, node: NodeName) -> Handle:
        """Show a node in the graph until the handle is closed."""
        return _Announcement(self._joined(), node)

    def create_writer(self, endpoint: EndpointInfo) -> Writer:
        """Create a DDS writer."""
        writer = DdsWriter(self._joined(), endpoint)
        self._show(endpoint, writer.gid)
        return writer

    def create_reader(self, endpoint: EndpointInfo, on_sample: OnSample) -> Reader:
        """Create a DDS reader."""
        reader = DdsReader(self._joined(), endpoint, on_sample)
        self._show(endpoint, reader.gid)
        return reader

    def create_requester(self, endpoint: EndpointInfo, on_reply: OnReply) -> Requester:
        """Create a service client's DDS writer and reader."""
        requester = DdsRequester(self._joined(), self._graph, endpoint, on_reply)
        self._show(endpoint, requester.gid)
        return requester

    def create_replier(self, endpoint: EndpointInfo, on_request: OnRequest) -> Replier:
        """Create a service server's DDS reader and writer."""
        replier = DdsReplier(self._joined(), self._graph, endpoint, on_request)
        self._show(endpoint, replier.gid)
        return replier

    def conflicts(self, endpoint: EndpointInfo) -> Mapping[str, str]:
        """Say so when it is another encoding that an endpoint offers or requests."""
        if self._discovery is None or not self._discovery.is_foreign(endpoint.gid):
            return {}
        verb = "offered" if endpoint.kind is EndpointKind.PUBLISHER else "requested"
        return {"data representation": f"XCDR2 alone {verb}, but ROS 2's messages are XCDR1"}

    def describe_type(self, endpoint: EndpointInfo, timeout: float) -> Definition | None:
        """Return the definition that an endpoint announces by XTypes."""
        from rosglass.wires.dds.types import announced_definition  # noqa: PLC0415 - rarely needed

        provider = f"wire {endpoint.node} (TypeLookup)"
        entity = self._joined().entity
        return announced_definition(entity, endpoint.gid, provider, timeout)

    def poll(self) -> None:
        """Do nothing: everything has events."""

    def close(self) -> None:
        """Leave the domain with everything created here."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            participant = self._participant
        if participant is not None:
            participant.close()
        self._changed()

    def _show(self, endpoint: EndpointInfo, gid: bytes) -> None:
        """Show an endpoint of ours in our graph at once; discovery hides it when it is gone."""
        if self._discovery is not None:
            self._discovery.show(replace(endpoint, gid=gid))

    def _joined(self) -> Participant:
        if self._participant is None or self._closed:
            raise NodeClosedError("the node is closed; connect again")
        return self._participant


class _Announcement(Handle):
    """A node in the graph."""

    def __init__(self, participant: Participant, node: NodeName) -> None:
        self._participant, self._node = participant, node
        self._closed = False
        participant.add_node(node)

    def close(self) -> None:
        """Take it out of the graph."""
        if not self._closed:
            self._closed = True
            self._participant.remove_node(self._node)
