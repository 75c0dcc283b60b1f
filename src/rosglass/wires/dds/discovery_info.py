"""What ROS 2's participants tell each other over DDS, beyond what DDS itself announces.

``ros_discovery_info`` says which readers and writers belong to which node
(``rmw_dds_common/msg/ParticipantEntitiesInfo``, DDS type
``rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_``); user data carries the enclave of a
participant and the type hash of an endpoint. Bytes in, bytes out; nothing here needs DDS.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.comm import NodeName, QoS
from rosglass.comm.qos import Durability, History
from rosglass.errors import DecodeError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = [
    "PARTICIPANT_USER_DATA",
    "READER_QOS",
    "TOPIC",
    "TYPE",
    "USER_DATA",
    "WRITER_QOS",
    "NodeEntities",
    "ParticipantEntities",
    "format_user_data",
    "hash_of",
    "is_rosglass",
    "parse_user_data",
]

#: Its DDS topic; without prefix, as it is none of ROS 2's own.
TOPIC = "ros_discovery_info"
#: Its DDS type, the same for both widths.
TYPE = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
#: User data of its writers and readers since Iron: the hash of its type. rmw_cyclonedds logs a
#: warning for an endpoint without one.
USER_DATA = b"typehash=RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e;"
#: Profiles that rmw's implementations use for it.
WRITER_QOS = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL)
READER_QOS = QoS(depth=1, durability=Durability.TRANSIENT_LOCAL, history=History.KEEP_ALL)
#: Without an enclave, rmw's graphs leave a participant out. By the rest our participants know each
#: other: they follow the width of identities that others use, and must not follow one another.
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
    """A node and the identities of what belongs to it.

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
        """Return what a sample says.

        Which width it has shows by its length: only one of the two leaves at most padding over.

        Raises:
            DecodeError: It is no such sample.
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
        """Return the whole sample; raises DecodeError, also when bytes are left over."""
        gid = self._gid()
        nodes = tuple(
            NodeEntities(self._node(), self._gids(), self._gids())
            # A node takes 18 bytes at least.
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
            raise DecodeError(_NAME, f"{text!r} is no name", offset=self._at - size) from None

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
    """Return the keys and values of ``key=value;`` user data; what is none is left out.

    Format: rmw's ``parse_key_value``. Values may have any bytes but ``;``.
    """
    pairs: dict[str, str] = {}
    for item in data.split(b";"):
        key, separator, value = item.partition(b"=")
        if separator and key.isalnum():
            pairs.setdefault(key.decode("ascii"), value.decode("ascii", "replace"))
    return pairs


def format_user_data(pairs: Mapping[str, str]) -> bytes:
    """Return user data with these keys and values; those without a value are left out."""
    return "".join(f"{key}={value};" for key, value in pairs.items() if value).encode()


def hash_of(user_data: bytes) -> str:
    """Return the type hash that an endpoint's user data announces, empty when it has none."""
    found = parse_user_data(user_data).get("typehash", "")
    return found if found.isprintable() else ""


def is_rosglass(user_data: bytes) -> bool:
    """Return whether a participant's user data says that it is one of ours."""
    return parse_user_data(user_data).get("client") == "rosglass"
