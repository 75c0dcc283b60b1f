"""Following a DDS domain: who is in it, and telling the others which nodes are ours."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

from rosglass.errors import DecodeError, Error
from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone_builtin import BuiltinTopic, Discovered, matched_publication, take
from rosglass.wires.dds.cyclone_events import Event
from rosglass.wires.dds.discovery_info import (
    PARTICIPANT_USER_DATA,
    READER_QOS,
    TOPIC,
    TYPE,
    USER_DATA,
    WRITER_QOS,
    NodeEntities,
    ParticipantEntities,
)
from rosglass.wires.dds.endpoints import SampleReader, SampleWriter, Taken
from rosglass.wires.dds.graph import DdsGraph

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import EndpointInfo
    from rosglass.comm.graph import Graph
    from rosglass.wires.dds.participant import Participant

__all__ = ["DdsDiscovery"]

_log = logging.getLogger("rosglass.ros2")
_PLACE = f"topic {TOPIC}"
#: Participants whose rubbish is logged, once each.
_MAX_STRANGE = 100


class DdsDiscovery:
    """Keeps a graph up to date, on the participant's pump; ends with the participant.

    Args:
        participant: Our participant; its nodes are announced.
        graph: The graph to fill.
        humble: Whether to announce them as ROS 2 Humble does; None does as the others do.
        changed: Called when other participants came or went.

    Attributes:
        had_peers: Whether there ever were other participants in the domain.
    """

    def __init__(
        self,
        participant: Participant,
        graph: Graph,
        humble: bool | None,
        changed: Callable[[], None],
    ) -> None:
        self._participant, self._humble, self._changed = participant, humble, changed
        self._lock = threading.Lock()
        self._seen = DdsGraph(graph, participant.guid)
        own = participant.guid
        self._seen.put_participants([Discovered(True, own, 0, own, PARTICIPANT_USER_DATA)])
        self._nodes: tuple[NodeEntities, ...] = ()
        self._told: ParticipantEntities | None = None
        self._late = False
        self.had_peers = False
        self._strange: set[int] = set()
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
        participant.seen = self._seen
        participant.on_nodes = self._on_nodes
        self._on_nodes(participant.nodes())

    @property
    def peers(self) -> int:
        """How many other participants are in the domain."""
        return self._seen.peers

    @property
    def unnamed(self) -> int:
        """How many other participants have not said which nodes they have."""
        return self._seen.unnamed

    def show(self, endpoint: EndpointInfo) -> None:
        """Show an endpoint of ours in the graph at once; it goes when its reader or writer does.

        A service's server or client shows under the GUID of its reader or writer of requests.
        """
        with self._lock:
            self._seen.put_own(endpoint)

    def is_foreign(self, guid: bytes) -> bool:
        """Return whether a reader or writer knows no encoding of ours."""
        return self._seen.is_foreign(guid)

    def participant(self, guid: bytes) -> Discovered | None:
        """Return the participant that a GUID is of, or belongs to; None when it is gone."""
        return self._seen.participant(guid)

    def _take(self) -> bool:
        """Take in some news; returns whether there may be more, as samples want their turn, too."""
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
        try:
            self._seen.put_endpoint(found, reader=reader)
        except Exception:  # the others' news must not go with it
            _log.exception("what DDS tells of endpoint %s is not understood", found.guid.hex())

    def _take_participants(self) -> None:
        """Take them first, always: they are what the others belong to."""
        news: list[Discovered] = []
        topic = BuiltinTopic.PARTICIPANT
        while found := take(self._readers[topic], topic, _PLACE):
            news += found
        if not news:
            return
        with self._lock:
            peers = self._seen.peers
            self._seen.put_participants(news)
            moved = self._seen.peers != peers
            self.had_peers = self.had_peers or self._seen.peers > 0
        if moved:
            self._changed()
        self._tell()

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
        self._tell()

    def _decode(self, writer: int, data: bytes | memoryview) -> ParticipantEntities | None:
        try:
            return ParticipantEntities.decode(data)
        except DecodeError as error:
            if writer not in self._strange and len(self._strange) < _MAX_STRANGE:
                self._strange.add(writer)
                found = matched_publication(self._reader.entity, writer)
                sender = "that left" if found is None else found.participant.hex()
                _log.warning(
                    "ignoring what DDS participant %s says of its nodes: %s", sender, error
                )
            return None

    def _put(self, info: ParticipantEntities) -> bool:
        with self._lock:
            return self._seen.put_entities(info)

    def _on_nodes(self, nodes: tuple[NodeEntities, ...]) -> None:
        """Tell the others soon: many changes at once are told together."""
        with self._lock:
            self._nodes, self._late = nodes, True
            self._seen.put_entities(ParticipantEntities(self._participant.guid, nodes))
            self._participant.pump.visit(self._writer.entity, self._tell)

    def _tell(self) -> None:
        """Tell the others of our nodes, if there is anything new; on the pump's thread."""
        with self._lock:
            if self._late:
                self._late = False
                self._participant.pump.visit(self._writer.entity, None)
            humble = self._seen.humble if self._humble is None else self._humble
            info = ParticipantEntities(self._participant.guid, self._nodes, humble)
        if info != self._told:
            self._told = info
            try:
                self._writer.write([info.encode()])
            except Error as error:
                _log.warning("cannot tell the others of the nodes here: %s", error)
