"""rmw_zenoh's key expressions, liveliness tokens and attachments.

Formats: ``docs/design.md`` of rmw_zenoh (https://github.com/ros2/rmw_zenoh) and its released
behaviour. Nothing here needs a session.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import NamedTuple

import xxhash

from rosglass.comm import (
    Durability,
    Duration,
    EndpointInfo,
    EndpointKind,
    History,
    Liveliness,
    NodeName,
    QoS,
    Reliability,
)
from rosglass.comm.names import demangle_type, mangle_type

__all__ = [
    "ATTACHMENT",
    "ATTACHMENT_FULL",
    "HUMBLE_HASH",
    "NO_ATTACHMENT",
    "Attachment",
    "Token",
    "decode_qos",
    "encode_qos",
    "gid_of",
    "graph_key",
    "topic_key",
    "without_hash",
]

#: Stands for the type hash in Humble, which has no type hashes.
HUMBLE_HASH = "TypeHashNotSupported"

_SPACE = "@ros2_lv"
_NODE_KIND = "NN"
_KINDS = {
    "MP": EndpointKind.PUBLISHER,
    "MS": EndpointKind.SUBSCRIPTION,
    "SS": EndpointKind.SERVICE_SERVER,
    "SC": EndpointKind.SERVICE_CLIENT,
}
_CODES = {kind: code for code, kind in _KINDS.items()}

# Values of rmw's enums (rmw/types.h).
_RELIABILITY = {"1": Reliability.RELIABLE, "2": Reliability.BEST_EFFORT}
_DURABILITY = {"1": Durability.TRANSIENT_LOCAL, "2": Durability.VOLATILE}
_HISTORY = {"1": History.KEEP_LAST, "2": History.KEEP_ALL}
_LIVELINESS = {"1": Liveliness.AUTOMATIC, "3": Liveliness.MANUAL_BY_TOPIC}
_NUMBER_OF: dict[object, str] = {
    value: number
    for table in (_RELIABILITY, _DURABILITY, _HISTORY, _LIVELINESS)
    for number, value in table.items()
}
_DEFAULTS = (
    Reliability.RELIABLE,
    Durability.VOLATILE,
    History.KEEP_LAST,
    Liveliness.AUTOMATIC,
)
#: Depth for an empty field (RMW_ZENOH_DEFAULT_HISTORY_DEPTH).
_DEFAULT_DEPTH = 42
_NS = 1_000_000_000
#: Durations from this one on mean "infinite": rmw writes INT64_MAX or UINT64_MAX nanoseconds.
_INFINITE = 100 * 365 * 86400 * _NS


def topic_key(domain: int, topic: str, type_name: str, type_hash: str) -> str:
    """Return the key of a topic's data; `type_hash` may be the wildcard ``*``."""
    return f"{domain}/{topic.strip('/')}/{mangle_type(type_name)}/{type_hash}"


def graph_key(domain: int) -> str:
    """Return the key expression that matches all tokens of a domain."""
    return f"{_SPACE}/{domain}/**"


@dataclass(frozen=True)
class Token:
    """The liveliness token of a node or endpoint.

    Attributes:
        domain: ROS domain.
        session: The session's Zenoh id, hexadecimal.
        node_id: The node's number in its session; a text, as some peers use names.
        entity_id: The entity's number in its session.
        node: Name of the node.
        endpoint: The endpoint; None for the token of a node.
    """

    domain: int
    session: str
    node_id: str
    entity_id: str
    node: NodeName
    endpoint: EndpointInfo | None = None

    def key(self) -> str:
        """Return the token's key expression."""
        kind = _NODE_KIND if self.endpoint is None else _CODES[self.endpoint.kind]
        parts = [
            _SPACE,
            str(self.domain),
            self.session,
            self.node_id,
            self.entity_id,
            kind,
            _mangle(""),
            _mangle("" if self.node.namespace == "/" else self.node.namespace),
            self.node.name,
        ]
        if self.endpoint is not None:
            parts += [
                _mangle(self.endpoint.name),
                mangle_type(self.endpoint.type),
                self.endpoint.type_hash or HUMBLE_HASH,
                encode_qos(self.endpoint.qos),
            ]
        return "/".join(parts)

    @classmethod
    def parse(cls, key: str) -> Token:
        """Parse a token's key; raises ValueError with the reason.

        Additional parts at the end, of newer versions, are ignored.
        """
        parts = key.split("/")
        if len(parts) < 9 or parts[0] != _SPACE:
            raise ValueError(f"expected at least 9 parts beginning with {_SPACE}")
        node = NodeName(_demangle(parts[7]) or "/", _demangle(parts[8]))
        head = (int(parts[1]), parts[2], parts[3], parts[4], node)
        if parts[5] == _NODE_KIND:
            return cls(*head)
        if parts[5] not in _KINDS:
            raise ValueError(f"unknown kind of entity {parts[5]!r}")
        if len(parts) < 13:
            raise ValueError(f"expected at least 13 parts for an endpoint, got {len(parts)}")
        name, dds_type, type_hash, qos = parts[9:13]
        endpoint = EndpointInfo(
            _KINDS[parts[5]],
            # Some peers omit the leading slash.
            "/" + _demangle(name).lstrip("/"),
            demangle_type(_demangle(dds_type)),
            node,
            decode_qos(qos),
            "" if type_hash == HUMBLE_HASH or not type_hash.isprintable() else type_hash,
            gid_of(key),
        )
        return cls(*head, endpoint)


def gid_of(key: str) -> bytes:
    """Return the 16-byte identity of the endpoint with token `key` (XXH3-128, low half first).

    Peers other than rmw_zenoh may attach another identity to their samples.
    """
    return xxhash.xxh3_128_intdigest(key.encode()).to_bytes(16, "little")


def without_hash(key: str, type_hash: str) -> str:
    """Return the key of a token as in Humble, which has no type hashes."""
    return key.replace(f"/{type_hash}/", f"/{HUMBLE_HASH}/")


def encode_qos(qos: QoS) -> str:
    """Return the QoS part of a token as in released rmw_zenoh.

    Defaults are left out: dora-rs finds services and actions by the whole token.
    """

    def number(policy: object) -> str:
        return "" if policy in _DEFAULTS else _NUMBER_OF[policy]

    return ":".join(
        (
            number(qos.reliability),
            number(qos.durability),
            f"{number(qos.history)},{qos.depth}",
            _encode_duration(qos.deadline),
            _encode_duration(qos.lifespan),
            f"{number(qos.liveliness)},{_encode_duration(qos.lease_duration)}",
        )
    )


def decode_qos(text: str) -> QoS:
    """Parse the QoS part of a token; raises ValueError.

    Values without a counterpart here (system default, best available) become the default.
    """
    fields = text.split(":")
    if len(fields) < 6:
        raise ValueError(f"expected 6 QoS fields separated by ':', got {text!r}")
    history, _, depth = fields[2].partition(",")
    liveliness, _, lease = fields[5].partition(",")
    return QoS(
        # Keep-all announces a depth of 0.
        depth=max(1, int(depth)) if depth else _DEFAULT_DEPTH,
        reliability=_RELIABILITY.get(fields[0], Reliability.RELIABLE),
        durability=_DURABILITY.get(fields[1], Durability.VOLATILE),
        history=_HISTORY.get(history, History.KEEP_LAST),
        deadline=_decode_duration(fields[3]),
        lifespan=_decode_duration(fields[4]),
        liveliness=_LIVELINESS.get(liveliness, Liveliness.AUTOMATIC),
        lease_duration=_decode_duration(lease),
    )


class Attachment(NamedTuple):
    """The attachment of a sample.

    Attributes:
        sequence: Sequence number of the publisher, -1 if unknown.
        sent: Time of publication in nanoseconds since the Unix epoch, None if unknown.
        gid: Identity of the publisher, empty if unknown.
    """

    sequence: int
    sent: int | None
    gid: bytes

    def encode(self) -> bytes:
        """Return rmw_zenoh's 33 bytes: two integers, and the identity with its length."""
        return ATTACHMENT_FULL.pack(self.sequence, self.sent or 0, len(self.gid), self.gid)

    @classmethod
    def decode(cls, data: bytes) -> Attachment:
        """Parse an attachment; those of other programs become :data:`NO_ATTACHMENT`."""
        if len(data) != ATTACHMENT.size or data[16] != 16:
            return NO_ATTACHMENT
        return cls(*ATTACHMENT.unpack(data))


#: The layout that :meth:`Attachment.decode` reads, for hot paths; byte 16 must be 16.
ATTACHMENT = struct.Struct("<qqx16s")
#: The layout that :meth:`Attachment.encode` writes: number, time of sending, 16, identity.
ATTACHMENT_FULL = struct.Struct("<qqB16s")
NO_ATTACHMENT = Attachment(-1, None, b"")


def _mangle(name: str) -> str:
    return name.replace("/", "%") or "%"


def _demangle(part: str) -> str:
    return "" if part == "%" else part.replace("%", "/")


def _encode_duration(duration: Duration | None) -> str:
    if duration is None:
        return ","
    return "{},{}".format(*divmod(duration.nanoseconds, _NS))


def _decode_duration(text: str) -> Duration | None:
    seconds, _, nanoseconds = text.partition(",")
    total = int(seconds or 0) * _NS + int(nanoseconds or 0)
    # An empty field and zero both mean "not limited", as in rmw's profiles.
    return Duration(total) if 0 < total < _INFINITE else None
