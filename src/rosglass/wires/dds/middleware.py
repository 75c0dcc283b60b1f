"""ROS 2 over Cyclone DDS; interoperates with every rmw implementation that uses DDS."""

from __future__ import annotations

import logging
import threading
from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState, EndpointKind, Handle, Status
from rosglass.comm.handle import guarded
from rosglass.comm.wire import Middleware, Reader, Replier, Requester, Writer
from rosglass.errors import DecodeError, Error, NodeClosedError
from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone import BuiltinTopic, Discovered, Event, matched_publication, take
from rosglass.wires.dds.domain import DdsOptions
from rosglass.wires.dds.endpoints import DdsReader, DdsWriter, SampleReader, SampleWriter, Taken
from rosglass.wires.dds.graph import (
    PARTICIPANT_USER_DATA,
    READER_QOS,
    TOPIC,
    TYPE,
    USER_DATA,
    WRITER_QOS,
    DdsGraph,
    NodeEntities,
    ParticipantEntities,
)
from rosglass.wires.dds.participant import Participant
from rosglass.wires.dds.services import DdsReplier, DdsRequester
from rosglass.wires.dds.type_lookup import announced_definition

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm import EndpointInfo, NodeName
    from rosglass.comm.graph import Graph
    from rosglass.comm.wire import OnRequest, OnSample
    from rosglass.interfaces import Definition

__all__ = ["DdsDiscovery", "DdsMiddleware"]

_log = logging.getLogger("rosglass.ros2")
_PLACE = f"topic {TOPIC}"
#: Participants whose malformed samples are logged, once each.
_MAX_LOGGED = 100


class DdsDiscovery:
    """The discovery of a domain: fills a graph and announces the nodes of a participant.

    It runs on the participant's pump, and ends with the participant.

    Args:
        participant: The participant.
        graph: The graph to fill.
        humble: Whether to announce its nodes as ROS 2 Humble does; None follows the others.
        changed: Called when other participants have appeared or left.

    Attributes:
        had_peers: Whether other participants have been in the domain.
    """

    def __init__(
        self,
        participant: Participant,
        graph: Graph,
        humble: bool | None,
        changed: Callable[[], None],
    ) -> None:
        self._participant, self._humble, self._changed = participant, humble, changed
        #: Guards the graph and the nodes: both also change on users' threads.
        self._lock = threading.Lock()
        self._seen = DdsGraph(graph, participant.guid)
        own = participant.guid
        self._seen.put_participants([Discovered(True, own, 0, own, PARTICIPANT_USER_DATA)])
        self._nodes: tuple[NodeEntities, ...] = ()
        self._announced: ParticipantEntities | None = None
        self._scheduled = False
        self.had_peers = False
        self._logged: set[int] = set()
        self._readers: dict[BuiltinTopic, int] = {}
        self._writer = SampleWriter(participant, TOPIC, TYPE, WRITER_QOS, USER_DATA, _PLACE)
        for topic in BuiltinTopic:
            place = f"discovery of each {topic.name.lower()}"
            self._readers[topic] = cyclone.create_reader(participant.entity, topic, None, place)
        for reader in self._readers.values():
            participant.pump.watch(reader, Event.DATA_AVAILABLE, self._take)
        self._reader = SampleReader(
            participant, TOPIC, TYPE, READER_QOS, USER_DATA, _PLACE, self._on_entities
        )
        self._reader.start()
        participant.seen = self._seen
        participant.on_nodes = self._on_nodes
        self._on_nodes(participant.nodes())

    @property
    def peers(self) -> int:
        """Number of other participants in the domain."""
        return self._seen.peers

    @property
    def unnamed(self) -> int:
        """Number of other participants that have not announced their nodes."""
        return self._seen.unnamed

    def show(self, endpoint: EndpointInfo) -> None:
        """Add one of our endpoints to the graph; it is removed with its reader or writer.

        A service's server or client has the GUID of its request reader or writer.
        """
        with self._lock:
            self._seen.put_own(endpoint)

    def is_foreign(self, guid: bytes) -> bool:
        """Return whether a reader or writer shares no encoding with ours."""
        return self._seen.is_foreign(guid)

    def participant(self, guid: bytes) -> Discovered | None:
        """Return the participant that a GUID belongs to; None if it has left."""
        return self._seen.participant(guid)

    def _take(self) -> bool:
        """Take some discovered endpoints; return whether more may wait, after other events."""
        self._take_participants()
        more = False
        for topic in (BuiltinTopic.PUBLICATION, BuiltinTopic.SUBSCRIPTION):
            news = take(self._readers[topic], topic, _PLACE)
            more = more or bool(news)
            with self._lock:
                for found in news:
                    self._put_endpoint(found, reader=topic is BuiltinTopic.SUBSCRIPTION)
        return more

    def _put_endpoint(self, found: Discovered, *, reader: bool) -> None:
        with guarded(_log, "the discovered DDS endpoint %s is not understood", found.guid.hex()):
            self._seen.put_endpoint(found, reader=reader)

    def _take_participants(self) -> None:
        """Take participants, always before their endpoints."""
        news: list[Discovered] = []
        topic = BuiltinTopic.PARTICIPANT
        while found := take(self._readers[topic], topic, _PLACE):
            news += found
        if not news:
            return
        with self._lock:
            peers = self._seen.peers
            self._seen.put_participants(news)
            changed = self._seen.peers != peers
            self.had_peers = self.had_peers or self._seen.peers > 0
        if changed:
            self._changed()
        self._announce()

    def _on_entities(self, taken: list[Taken]) -> None:
        # Each sample replaces its participant's earlier ones.
        newest = {(writer, bytes(data[4:20])): data for data, _, writer, _ in taken}
        for (writer, _), data in newest.items():
            info = self._decode(writer, data)
            if info is None or info.gid == self._participant.guid:
                continue
            if not self._put(info):
                self._take_participants()
                self._put(info)
        self._announce()

    def _decode(self, writer: int, data: bytes | memoryview) -> ParticipantEntities | None:
        try:
            return ParticipantEntities.decode(data)
        except DecodeError as error:
            if writer not in self._logged and len(self._logged) < _MAX_LOGGED:
                self._logged.add(writer)
                found = matched_publication(self._reader.entity, writer)
                sender = "that left" if found is None else found.participant.hex()
                _log.warning("ignoring the nodes of DDS participant %s: %s", sender, error)
            return None

    def _put(self, info: ParticipantEntities) -> bool:
        with self._lock:
            return self._seen.put_entities(info)

    def _on_nodes(self, nodes: tuple[NodeEntities, ...]) -> None:
        """Schedule an announcement; simultaneous changes share one."""
        with self._lock:
            self._nodes, self._scheduled = nodes, True
            self._seen.put_entities(ParticipantEntities(self._participant.guid, nodes))
            self._participant.pump.poll(self._writer.entity, self._announce)

    def _announce(self) -> None:
        """Announce our nodes if they have changed; on the pump's thread."""
        with self._lock:
            if self._scheduled:
                self._scheduled = False
                self._participant.pump.poll(self._writer.entity, None)
            humble = self._seen.humble if self._humble is None else self._humble
            info = ParticipantEntities(self._participant.guid, self._nodes, humble)
        if info != self._announced:
            self._announced = info
            try:
                self._writer.write_parts([info.encode()])
            except Error as error:
                _log.warning("%s: the nodes of this process cannot be announced: %s", _PLACE, error)


class DdsMiddleware(Middleware):
    """A participant in a DDS domain."""

    matches_qos = True
    matches_hashes = False
    # Cyclone DDS labels every payload as little endian, but does not swap the bytes.
    keeps_byte_order = False
    announces_requests = True
    describes_types = True

    def __init__(self, options: DdsOptions) -> None:
        self._options = options
        self._participant: Participant | None = None
        self._discovery: DdsDiscovery | None = None
        self._closed = False
        self.graph: Graph
        self._changed: Callable[[], None] = lambda: None

    @classmethod
    def from_url(cls, url: str, env: Mapping[str, str]) -> DdsMiddleware:
        """Return the participant for a ``dds://`` URL; see :meth:`DdsOptions.parse`."""
        return cls(DdsOptions.parse(url, env))

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        """Join the domain."""
        self.graph, self._changed = graph, changed
        self._participant = participant = Participant(self._options)
        self._discovery = DdsDiscovery(participant, graph, self._options.humble, changed)
        changed()

    def status(self) -> Status:
        """Return whether other participants are in the domain."""
        where = f"DDS domain {self._options.domain}"
        discovery = self._discovery
        if self._closed:
            return Status(ConnectionState.CLOSED, "closed")
        if discovery is not None and (peers := discovery.peers):
            participants = "1 other participant" if peers == 1 else f"{peers} other participants"
            return Status(ConnectionState.CONNECTED, f"{where}, {participants}")
        if discovery is not None and discovery.had_peers:
            return Status(
                ConnectionState.LOST, f"all other participants have left {where}, waiting for one"
            )
        return Status(
            ConnectionState.CONNECTING, f"no other participant in {where}, waiting for one"
        )

    def unnamed(self) -> int:
        """Return how many ROS 2 participants have not announced their nodes."""
        return 0 if self._discovery is None else self._discovery.unnamed

    def announce(self, node: NodeName) -> Handle:
        """Announce a node until the handle is closed."""
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

    def create_requester(self, endpoint: EndpointInfo) -> Requester:
        """Create the DDS writer and reader of a service client."""
        requester = DdsRequester(self._joined(), self.graph, endpoint)
        self._show(endpoint, requester.gid)
        return requester

    def create_replier(self, endpoint: EndpointInfo, on_request: OnRequest) -> Replier:
        """Create the DDS reader and writer of a service server."""
        replier = DdsReplier(self._joined(), self.graph, endpoint, on_request)
        self._show(endpoint, replier.gid)
        return replier

    def endpoint_conflicts(self, endpoint: EndpointInfo) -> Mapping[str, str]:
        """Return the conflict with an endpoint that shares no encoding with ours."""
        if self._discovery is None or not self._discovery.is_foreign(endpoint.gid):
            return {}
        verb = "offered" if endpoint.kind is EndpointKind.PUBLISHER else "requested"
        return {"data representation": f"XCDR2 alone {verb}, but ROS 2's messages are XCDR1"}

    def describe_type(self, endpoint: EndpointInfo, timeout: float) -> Definition | None:
        """Return the definition that an endpoint announces through XTypes."""
        provider = f"wire {endpoint.node} (TypeLookup)"
        entity = self._joined().entity
        return announced_definition(entity, endpoint.gid, provider, timeout)

    def poll(self) -> None:
        """Do nothing: events report every change."""

    def close(self) -> None:
        """Leave the domain and close everything created here."""
        if self._closed:
            return
        self._closed = True
        if self._participant is not None:
            self._participant.close()
        self._changed()

    def _show(self, endpoint: EndpointInfo, gid: bytes) -> None:
        """Add one of our endpoints to our graph; discovery removes it."""
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
        """Remove the node from the graph."""
        if not self._closed:
            self._closed = True
            self._participant.remove_node(self._node)
