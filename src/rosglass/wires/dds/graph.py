"""ROS 2's graph, put together from what DDS discovers and what participants say of their nodes.

DDS announces participants and their readers and writers; ``ros_discovery_info`` says which node
they belong to. Either may come first. Everything here is bookkeeping; nothing needs DDS.
"""

from __future__ import annotations

import re
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, NodeName
from rosglass.comm.names import demangle_topic, demangle_type
from rosglass.wires.dds.cyclone_qos import XCDR1
from rosglass.wires.dds.discovery_info import hash_of, is_rosglass

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rosglass.comm.graph import Graph
    from rosglass.wires.dds.cyclone_builtin import Discovered
    from rosglass.wires.dds.discovery_info import ParticipantEntities

__all__ = ["UNKNOWN", "DdsGraph"]

#: Namespace of the nodes that stand for participants which say nothing of nodes; hidden.
UNKNOWN = "/_dds"
#: A participant's readers and writers share the beginning of its GUID (RTPS 2.5, section 8.2.4.1).
_PREFIX = 12
#: What the user data of every participant of rmw_cyclonedds, rmw_fastrtps and rosglass has.
_ENCLAVE = b"enclave="
#: Seconds that endpoints may come later than the nodes that they belong to.
_ARRIVING_S = 1.0
_REQUESTS = {
    ("rq", True): EndpointKind.SERVICE_SERVER,
    ("rq", False): EndpointKind.SERVICE_CLIENT,
    ("rr", False): EndpointKind.SERVICE_SERVER,
    ("rr", True): EndpointKind.SERVICE_CLIENT,
}
#: Participant, kind and name: what a service's requests and replies have in common.
_Call = tuple[bytes, EndpointKind, str]


@dataclass
class _Participant:
    """A participant and what belongs to it."""

    found: Discovered
    unknown: NodeName
    ours: bool
    info: ParticipantEntities | None = None
    #: Its nodes by their keys in the graph.
    nodes: dict[tuple[bytes, NodeName, int], NodeName] = field(default_factory=dict)
    #: When the first of these came, monotonic.
    introduced: float = 0.0
    owners: dict[bytes, NodeName] = field(default_factory=dict)
    only: NodeName | None = None

    def owner(self, guid: bytes) -> NodeName:
        """Return the node that an endpoint belongs to."""
        return self.owners.get(guid) or self.only or self.unknown


class DdsGraph:
    """Fills a graph with what is in a DDS domain; for one thread at a time.

    Endpoints are in it under their GUID; a service's servers and clients under that of the reader
    or writer of requests, once the participant also has the one of replies.

    Args:
        graph: The graph to fill.
        own: GUID of our own participant.

    Attributes:
        moved: Monotonic time when the last of the others' readers and writers was found.
    """

    def __init__(self, graph: Graph, own: bytes) -> None:
        self.moved = 0.0
        self._graph, self._own = graph, own[:_PREFIX]
        self._participants: dict[bytes, _Participant] = {}
        self._endpoints: dict[bytes, EndpointInfo] = {}
        self._of: dict[bytes, set[bytes]] = {}
        self._replies: dict[_Call, set[bytes]] = {}
        self._requests: dict[_Call, set[bytes]] = {}
        self._call_of: dict[bytes, _Call] = {}
        self._foreign: set[bytes] = set()

    @property
    def peers(self) -> int:
        """How many other participants are in the domain."""
        return len(self._participants) - (self._own in self._participants)

    def prefixes(self) -> list[bytes]:
        """Return what the GUIDs of each participant begin with, our own included."""
        return list(self._participants)

    @property
    def unnamed(self) -> int:
        """How many other participants of ROS 2 have not said, or just have, which nodes they have.

        Fast DDS does so 1 to 4 s after it was found; what else it has may come a moment later.
        """
        now = time.monotonic()
        return sum(
            _ENCLAVE in other.found.user_data
            and (other.info is None or now - other.introduced < _ARRIVING_S)
            for prefix, other in list(self._participants.items())
            if prefix != self._own
        )

    @property
    def humble(self) -> bool:
        """Whether those who speak ROS 2 here all use Humble's wide identities."""
        told = [
            participant.info.humble
            for participant in self._participants.values()
            if participant.info is not None and participant.info.nodes and not participant.ours
        ]
        return bool(told) and all(told)

    def participant(self, guid: bytes) -> Discovered | None:
        """Return the participant that a GUID is of, or belongs to; None when it is gone."""
        known = self._participants.get(guid[:_PREFIX])
        return None if known is None else known.found

    def is_foreign(self, guid: bytes) -> bool:
        """Return whether a reader or writer knows no encoding of ours; from any thread."""
        return guid in self._foreign

    def put_participants(self, news: Iterable[Discovered]) -> None:
        """Take in participants that came, changed or went.

        Several news of one participant must be given together: it may have gone and come back.
        """
        for found in {item.guid: item for item in news}.values():
            prefix = found.guid[:_PREFIX]
            known = self._participants.get(prefix)
            if not found.alive:
                if known is not None:
                    self._set_nodes(prefix, known, ())
                    del self._participants[prefix]
                continue
            unknown = _name(found)
            if known is None:
                self._participants[prefix] = _Participant(
                    found, unknown, is_rosglass(found.user_data)
                )
            else:
                known.found, known.unknown = found, unknown
            for guid in self._of.get(prefix, ()):
                self._show(guid)

    def put_entities(self, info: ParticipantEntities) -> bool:
        """Take in what a participant says of its nodes; returns whether it is known here."""
        prefix = info.gid[:_PREFIX]
        known = self._participants.get(prefix)
        if known is None:
            return False
        before, only = known.owners, known.only
        known.owners = {
            guid: entities.node
            for entities in info.nodes
            for guid in (*entities.readers, *entities.writers)
        }
        known.only = info.nodes[0].node if len(info.nodes) == 1 else None
        self._set_nodes(prefix, known, tuple(entities.node for entities in info.nodes))
        if known.info is None:
            known.introduced = time.monotonic()
        known.info = info
        for guid in self._of.get(prefix, ()):
            if known.only != only or before.get(guid) != known.owners.get(guid):
                self._show(guid)
        return True

    def put_own(self, endpoint: EndpointInfo) -> None:
        """Show an endpoint of our own at once, with the profile that it was created with."""
        self._endpoints[endpoint.gid] = endpoint
        self._of.setdefault(endpoint.gid[:_PREFIX], set()).add(endpoint.gid)
        self._put(endpoint.gid)

    def put_endpoint(self, found: Discovered, *, reader: bool) -> None:
        """Take in a reader or writer that came, changed or went."""
        if not found.alive:
            self._drop(found.guid)
            return
        if found.guid[:_PREFIX] == self._own and found.guid in self._endpoints:
            return
        self.moved = time.monotonic()
        carried = demangle_topic(found.topic)
        if carried is None:
            return  # not of ROS 2
        # A writer sends in the first encoding that it names.
        known = found.representations or (XCDR1,)
        if XCDR1 not in (known if reader else known[:1]):
            self._foreign.add(found.guid)
        prefix, name = carried
        if prefix == "rt":
            kind = EndpointKind.SUBSCRIPTION if reader else EndpointKind.PUBLISHER
            type_name = demangle_type(found.type)
        else:
            kind = _REQUESTS[prefix, reader]
            ending = "_Request" if prefix == "rq" else "_Response"
            type_name = demangle_type(found.type).removesuffix(ending)
            call = (found.guid[:_PREFIX], kind, name)
            self._call_of[found.guid] = call
            ends = self._requests if prefix == "rq" else self._replies
            ends.setdefault(call, set()).add(found.guid)
        self._endpoints[found.guid] = EndpointInfo(
            kind,
            name,
            type_name,
            NodeName(UNKNOWN, found.guid[:_PREFIX].hex()),
            found.qos,
            hash_of(found.user_data),
            found.guid,
        )
        self._of.setdefault(found.guid[:_PREFIX], set()).add(found.guid)
        self._show(found.guid)

    def _drop(self, guid: bytes) -> None:
        self._foreign.discard(guid)
        if self._endpoints.pop(guid, None) is None:
            return
        prefix = guid[:_PREFIX]
        self._of[prefix].discard(guid)
        if not self._of[prefix]:
            del self._of[prefix]
        call = self._call_of.pop(guid, None)
        if call is None:
            self._graph.remove(guid)
            return
        for ends in (self._requests, self._replies):
            left = ends.get(call, set())
            left.discard(guid)
            if not left:
                ends.pop(call, None)
        self._graph.remove(guid)
        if call in self._replies:
            self._show(next(iter(self._replies[call])))
        else:
            for request in self._requests.get(call, ()):
                self._graph.remove(request)

    def _show(self, guid: bytes) -> None:
        call = self._call_of.get(guid)
        if call is None:
            self._put(guid)
        elif call in self._replies:
            for request in self._requests.get(call, ()):
                self._put(request)

    def _put(self, guid: bytes) -> None:
        endpoint = self._endpoints[guid]
        participant = self._participants.get(guid[:_PREFIX])
        if participant is not None:
            endpoint = replace(endpoint, node=participant.owner(guid))
        replies = self._replies.get(self._call_of[guid]) if guid in self._call_of else None
        if replies:
            hashes = {self._endpoints[reply].type_hash for reply in replies}
            told = hashes.pop() if len(hashes) == 1 else ""
            if told != endpoint.type_hash:
                endpoint = replace(endpoint, response_hash=told)
        self._graph.put_endpoint(guid, endpoint)

    def _set_nodes(
        self, prefix: bytes, participant: _Participant, nodes: tuple[NodeName, ...]
    ) -> None:
        keys = {}
        counts: Counter[NodeName] = Counter()
        for node in nodes:
            keys[prefix, node, counts[node]] = node
            counts[node] += 1
        for key in participant.nodes.keys() - keys.keys():
            self._graph.remove(key)
        for key in keys.keys() - participant.nodes.keys():
            self._graph.put_node(key, keys[key])
        participant.nodes = keys


def _name(found: Discovered) -> NodeName:
    """Return a name for what belongs to a participant's nodes as long as these are unknown."""
    told = dict(found.properties)
    process = told.get("__ProcessName", "").rpartition("/")[2]
    parts = [part for part in (process, told.get("__Pid", ""), told.get("__Hostname", "")) if part]
    name = re.sub(r"[^A-Za-z0-9_]", "_", "_".join(parts)) if process else ""
    return NodeName(UNKNOWN, name or found.guid[:_PREFIX].hex())
