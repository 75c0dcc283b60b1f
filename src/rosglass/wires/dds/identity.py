"""Which request a reply answers, as DDS implementations other than Cyclone put it on the wire.

They do not touch the payload: a reply carries the identity of its request among the inline QoS
parameters of its RTPS submessage (OMG DDS-RPC 1.0, section 7.8.2; RTPS 2.5, sections 8.3.8.2,
9.4.2.11 and 9.6.3). Bytes in, bytes out; nothing here needs DDS.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

__all__ = ["UNKNOWN_GUID", "UNKNOWN_SEQUENCE", "Identity", "Origin", "inline_qos", "read_origin"]

#: The GUID of nobody.
UNKNOWN_GUID = bytes(16)
#: The sequence number of nothing (RTPS 2.5, section 8.3.5.4).
UNKNOWN_SEQUENCE = -(2**32)

_DATA, _DATA_FRAG = 0x15, 0x16
_LITTLE_ENDIAN, _INLINE_QOS = 0x01, 0x02
#: Bytes from a submessage's beginning to where octetsToInlineQos counts from.
_COUNTED_FROM = 8
#: flags, octetsToInlineQos, writerId, writerSN of a DATA or DATA_FRAG submessage.
_HEADER = struct.Struct("=xB4xH4xIiI")
_SENTINEL = 0x0001
#: PID_RELATED_SAMPLE_IDENTITY: the standard's number, and the one eProsima uses.
_RELATED = (0x0083, 0x800F)
_IDENTITY_SIZE = 24


class Identity(NamedTuple):
    """The identity of a sample.

    Attributes:
        guid: Of its writer (a client may put its reader of replies in that place), 16 bytes.
        sequence: Its number there.
    """

    guid: bytes
    sequence: int


class Origin(NamedTuple):
    """Where a received sample comes from.

    Attributes:
        entity: The last 4 bytes of its writer's GUID.
        sequence: Its number there.
        related: The request that it answers, or what a client tells of itself in a request; None
            when it carries no such identity.
        prefix: What its writer's GUID begins with, empty where that is not known.
        taken: Whether it was handed on already, while it was received.
    """

    entity: bytes
    sequence: int
    related: Identity | None
    prefix: bytes = b""
    taken: bool = False

    @property
    def guid(self) -> bytes:
        """Its writer's GUID, empty where that is not known."""
        return self.prefix + self.entity if self.prefix else b""

    def may_be_of(self, guid: bytes) -> bool:
        """Return whether its writer may be the one with a GUID."""
        return guid.startswith(self.prefix) and guid.endswith(self.entity)


def inline_qos(identity: Identity) -> bytes:
    """Return inline QoS, little endian, that relates a sample to another; always 60 bytes."""
    sequence = identity.sequence
    value = identity.guid + struct.pack("<iI", sequence >> 32, sequence & 0xFFFFFFFF)
    parameters = [struct.pack("<HH", pid, _IDENTITY_SIZE) + value for pid in _RELATED]
    return b"".join((*parameters, struct.pack("<HH", _SENTINEL, 0)))


def read_origin(submessage: bytes) -> Origin | None:
    """Return what a submessage tells of the sample in it; None when it carries no sample.

    Args:
        submessage: A DATA or DATA_FRAG submessage up to its payload, as Cyclone DDS leaves it once
            it has looked at it: the numbers of its fixed part in the machine's byte order, its
            parameters as they came.
    """
    if len(submessage) < _HEADER.size or submessage[0] not in (_DATA, _DATA_FRAG):
        return None
    flags, to_qos, entity, high, low = _HEADER.unpack_from(submessage)
    related = None
    if flags & _INLINE_QOS:
        order = "<" if flags & _LITTLE_ENDIAN else ">"
        related = _find_related(submessage, _COUNTED_FROM + to_qos, order)
    sequence = (high << 32) + low
    return Origin(entity.to_bytes(4, "big"), sequence, related)


def _find_related(data: bytes, at: int, order: str) -> Identity | None:
    """Return the identity in a parameter list, which may be any bytes."""
    parameter = struct.Struct(f"{order}HH")
    while at + parameter.size <= len(data):
        pid, size = parameter.unpack_from(data, at)
        at += parameter.size
        if pid == _SENTINEL or at + size > len(data):
            return None
        if pid in _RELATED and size >= _IDENTITY_SIZE:
            guid, high, low = struct.unpack_from(f"{order}16siI", data, at)
            return Identity(guid, (high << 32) + low)
        at += size + -size % 4
    return None
