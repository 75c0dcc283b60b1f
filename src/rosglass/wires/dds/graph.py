"""The ROS 2 graph of a DDS domain, assembled from the announcements of its participants.

DDS announces participants and their readers and writers. ``ros_discovery_info`` assigns these to
nodes (``rmw_dds_common/msg/ParticipantEntitiesInfo``, DDS type
``rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_``); user data carries the enclave of a
participant and the type hash of an endpoint. They may arrive in any order. Nothing here calls DDS.
"""

from __future__ import annotations

import re
import struct
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, NodeName, QoS
from rosglass.comm.names import demangle_topic, demangle_type
from rosglass.comm.qos import Durability, History
from rosglass.errors import DecodeError
from rosglass.wires.dds.cyclone import XCDR1

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rosglass.comm.graph import Graph
    from rosglass.wires.dds.cyclone import Discovered

__all__ = [
    "PARTICIPANT_USER_DATA",
    "READER_QOS",
    "TOPIC",
    "TYPE",
    "UNKNOWN",
    "USER_DATA",
    "WRITER_QOS",
    "DdsGraph",
    "NodeEntities",
    "ParticipantEntities",
    "format_user_data",
    "hash_of",
    "is_rosglass",
    "parse_user_data",
]

#: Its DDS topic; without prefix, as it is not a ROS 2 topic.
TOPIC = "ros_discovery_info"
#: Its DDS type, the same for both widths.
TYPE = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
#: User data of its writers and readers since Iron: the type's hash. rmw_cyclonedds logs a
#: warning for an endpoint without one.
USER_DATA = b"typehash=RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e;"
#: Profiles that the rmw implementations use for it.
WRITER_QOS = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)
READER_QOS = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL, history=History.KEEP_ALL)
#: rmw's graphs leave out a participant without enclave. The rest identifies rosglass participants
#: to each other: they adopt the width of others' identities, and must not adopt one another's.
PARTICIPANT_USER_DATA = b"enclave=/;client=rosglass;"

_NAME = "rmw_dds_common/msg/ParticipantEntitiesInfo"
_GID = 16
#: Width on the wire up to Humble, where rmw_gid_t's storage was sent whole.
_HUMBLE_GID = 24
#: Bounds of the strings in NodeEntitiesInfo.
_MAX_NAME = 256
#: RTPS pads payloads to four bytes.
_PADDING = 3
_LITTLE_ENDIAN = b"\x00\x01\x00\x00"


@dataclass(frozen=True)
class NodeEntities:
    """A node and the identities of its readers and writers.

    Attributes:
        node: Its name.
        readers: 16-byte GUIDs of its readers.
        writers: 16-byte GUIDs of its writers.
    """

    node: NodeName
    readers: tuple[bytes, ...] = ()
    writers: tuple[bytes, ...] = ()


@dataclass(frozen=True)
class ParticipantEntities:
    """The nodes of one participant, as it announces them.

    Attributes:
        gid: The participant's 16-byte GUID.
        nodes: Its nodes.
        humble: Whether identities have the 24 bytes of ROS 2 Humble on the wire.
    """

    gid: bytes
    nodes: tuple[NodeEntities, ...] = ()
    humble: bool = False

    def encode(self) -> bytes:
        """Return the sample, with its encapsulation header."""
        width = _HUMBLE_GID if self.humble else _GID
        body = bytearray(self.gid.ljust(width, b"\0"))
        _put_count(body, len(self.nodes))
        for entities in self.nodes:
            _put_string(body, entities.node.namespace)
            _put_string(body, entities.node.name)
            for gids in (entities.readers, entities.writers):
                _put_count(body, len(gids))
                for gid in gids:
                    body += gid.ljust(width, b"\0")
        return _LITTLE_ENDIAN + bytes(body)

    @classmethod
    def decode(cls, data: bytes | memoryview) -> ParticipantEntities:
        """Decode a sample.

        Its length shows the width of identities: only with the right one is no more than padding
        left over.

        Raises:
            DecodeError: It is not such a sample.
        """
        data = bytes(data)
        if len(data) < 4 or data[:2] not in (b"\x00\x00", b"\x00\x01"):
            raise DecodeError(_NAME, f"no plain CDR (header {data[:4].hex(' ') or 'missing'})")
        order = "<" if data[1] else ">"
        try:
            return _Reader(data, order, _GID).read()
        except DecodeError as error:
            try:
                return _Reader(data, order, _HUMBLE_GID).read()
            except DecodeError:
                raise error from None


class _Reader:
    """Reads one sample with one width of identities."""

    def __init__(self, data: bytes, order: str, width: int) -> None:
        self._data, self._width = data, width
        self._at = 4
        self._number = struct.Struct(f"{order}I")

    def read(self) -> ParticipantEntities:
        """Return the whole sample; raises DecodeError, also if bytes are left over."""
        gid = self._gid()
        nodes = tuple(
            NodeEntities(self._node(), self._gids(), self._gids())
            # A node takes at least 18 bytes.
            for _ in range(self._count(18))
        )
        left = len(self._data) - self._at
        if left > _PADDING:
            raise DecodeError(_NAME, f"{left} bytes left over", offset=self._at)
        return ParticipantEntities(gid, nodes, self._width == _HUMBLE_GID)

    def _node(self) -> NodeName:
        namespace, name = self._string(), self._string()
        return NodeName(namespace or "/", name)

    def _gids(self) -> tuple[bytes, ...]:
        width = self._width
        data = self._take(self._count(width) * width)
        return tuple(data[at : at + _GID] for at in range(0, len(data), width))

    def _gid(self) -> bytes:
        return self._take(self._width)[:_GID]

    def _count(self, size: int) -> int:
        self._at += -self._at % 4
        count: int = self._number.unpack(self._take(4))[0]
        if count * size > len(self._data) - self._at:
            raise DecodeError(_NAME, f"{count} items in too few bytes", offset=self._at - 4)
        return count

    def _string(self) -> str:
        size = self._count(1)
        if size > _MAX_NAME + 1:
            raise DecodeError(_NAME, f"a name of {size} bytes", offset=self._at - 4)
        text = self._take(size).removesuffix(b"\0")
        try:
            return text.decode("ascii")
        except UnicodeDecodeError:
            raise DecodeError(
                _NAME, f"{text!r} is not an ASCII name", offset=self._at - size
            ) from None

    def _take(self, size: int) -> bytes:
        start, self._at = self._at, self._at + size
        if self._at > len(self._data):
            raise DecodeError(_NAME, "it ends too early", offset=start)
        return self._data[start : self._at]


def _put_count(body: bytearray, count: int) -> None:
    body += bytes(-len(body) % 4)
    body += count.to_bytes(4, "little")


def _put_string(body: bytearray, text: str) -> None:
    data = text.encode() + b"\0"
    _put_count(body, len(data))
    body += data


def parse_user_data(data: bytes) -> dict[str, str]:
    """Return the keys and values of ``key=value;`` user data; other parts are ignored.

    Format: rmw's ``parse_key_value``. Values may contain any bytes but ``;``.
    """
    pairs: dict[str, str] = {}
    for item in data.split(b";"):
        key, separator, value = item.partition(b"=")
        if separator and key.isalnum():
            pairs.setdefault(key.decode("ascii"), value.decode("ascii", "replace"))
    return pairs


def format_user_data(pairs: Mapping[str, str]) -> bytes:
    """Return user data with these keys and values, except those with an empty value."""
    return "".join(f"{key}={value};" for key, value in pairs.items() if value).encode()


def hash_of(user_data: bytes) -> str:
    """Return the type hash that an endpoint's user data announces, empty if it has none."""
    found = parse_user_data(user_data).get("typehash", "")
    return found if found.isprintable() else ""


def is_rosglass(user_data: bytes) -> bool:
    """Return whether a participant's user data identifies it as a rosglass participant."""
    return parse_user_data(user_data).get("client") == "rosglass"


#: Hidden namespace of the nodes that stand for participants which announce no nodes.
UNKNOWN = "/_dds"
#: A participant's readers and writers share the beginning of its GUID (RTPS 2.5, section 8.2.4.1).
_PREFIX = 12
#: Part of the user data of every participant of rmw_cyclonedds, rmw_fastrtps and rosglass.
_ENCLAVE = b"enclave="
#: Seconds by which endpoints may arrive later than the nodes that they belong to.
_ARRIVING_S = 1.0
_REQUESTS = {
    ("rq", True): EndpointKind.SERVICE_SERVER,
    ("rq", False): EndpointKind.SERVICE_CLIENT,
    ("rr", False): EndpointKind.SERVICE_SERVER,
    ("rr", True): EndpointKind.SERVICE_CLIENT,
}
#: Participant, kind and name, which a service's request and reply endpoints share.
_Call = tuple[bytes, EndpointKind, str]


@dataclass
class _Participant:
    """A participant with its nodes and endpoints."""

    found: Discovered
    unknown: NodeName
    ours: bool
    info: ParticipantEntities | None = None
    #: Its nodes by their keys in the graph.
    nodes: dict[tuple[bytes, NodeName, int], NodeName] = field(default_factory=dict)
    #: Monotonic time when the first of these arrived.
    introduced: float = 0.0
    owners: dict[bytes, NodeName] = field(default_factory=dict)
    only: NodeName | None = None

    def owner(self, guid: bytes) -> NodeName:
        """Return the node that an endpoint belongs to."""
        return self.owners.get(guid) or self.only or self.unknown


class DdsGraph:
    """Fills a graph with the endpoints of a DDS domain; for one thread at a time.

    The key of an endpoint is its GUID. A service's server or client has that of its request reader
    or writer, and is added once its participant also has the one of replies.

    Args:
        graph: The graph to fill.
        own: GUID of our own participant.

    Attributes:
        moved: Monotonic time of the latest discovery of another participant's reader or writer.
        vendors: The vendors of all participants, our own included: two bytes of their GUIDs.
    """

    def __init__(self, graph: Graph, own: bytes) -> None:
        self.moved = 0.0
        self.vendors: frozenset[bytes] = frozenset()
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
        """Number of other participants in the domain."""
        return len(self._participants) - (self._own in self._participants)

    @property
    def unnamed(self) -> int:
        """Number of other ROS 2 participants that have not announced their nodes, or only just did.

        Fast DDS announces them 1 to 4 s after its discovery; endpoints may follow a moment later.
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
        """True if all other ROS 2 participants use Humble's wide identities."""
        widths = [
            participant.info.humble
            for participant in self._participants.values()
            if participant.info is not None and participant.info.nodes and not participant.ours
        ]
        return bool(widths) and all(widths)

    def participant(self, guid: bytes) -> Discovered | None:
        """Return the participant that a GUID belongs to; None if it has left."""
        known = self._participants.get(guid[:_PREFIX])
        return None if known is None else known.found

    def is_foreign(self, guid: bytes) -> bool:
        """Return whether a reader or writer shares no encoding with ours; thread-safe."""
        return guid in self._foreign

    def put_participants(self, news: Iterable[Discovered]) -> None:
        """Update participants that appeared, changed or left.

        Pass all changes of a participant in one call: it may have left and returned.
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
        self.vendors = frozenset(prefix[:2] for prefix in self._participants)

    def put_entities(self, info: ParticipantEntities) -> bool:
        """Update the nodes of a participant; return whether the participant is known."""
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
        """Add an endpoint of our own, with the profile that it was created with."""
        self._endpoints[endpoint.gid] = endpoint
        self._of.setdefault(endpoint.gid[:_PREFIX], set()).add(endpoint.gid)
        self._put(endpoint.gid)

    def put_endpoint(self, found: Discovered, *, reader: bool) -> None:
        """Update a reader or writer that appeared, changed or left."""
        if not found.alive:
            self._drop(found.guid)
            return
        if found.guid[:_PREFIX] == self._own and found.guid in self._endpoints:
            return
        self.moved = time.monotonic()
        carried = demangle_topic(found.topic)
        if carried is None:
            return  # not from ROS 2
        # A writer sends in the first encoding that it announces.
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
            response = hashes.pop() if len(hashes) == 1 else ""
            if response != endpoint.type_hash:
                endpoint = replace(endpoint, response_hash=response)
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
    """Return a node name for the endpoints of a participant whose nodes are unknown."""
    known = dict(found.properties)
    process = known.get("__ProcessName", "").rpartition("/")[2]
    parts = [p for p in (process, known.get("__Pid", ""), known.get("__Hostname", "")) if p]
    name = re.sub(r"[^A-Za-z0-9_]", "_", "_".join(parts)) if process else ""
    return NodeName(UNKNOWN, name or found.guid[:_PREFIX].hex())
