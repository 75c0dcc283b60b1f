"""The 16 bytes that rmw_cyclonedds puts in front of requests and replies.

They come behind the encapsulation header: a number of the client's, and one of the request's; a
server returns them as they are. Being 16, they leave everything behind them aligned.
"""

from __future__ import annotations

import struct

from rosglass.wires.dds.cyclone_samples import COPIED

__all__ = ["Parts", "header_of", "pack", "unpack", "with_header", "without_header"]

#: A payload in one piece or several.
Parts = tuple["bytes | bytearray | memoryview", ...]

_IDS, _IDS_BIG = struct.Struct("<Qq"), struct.Struct(">Qq")
_ENCAPSULATION = 4
_END = _ENCAPSULATION + _IDS.size


def pack(client: int, number: int) -> bytes:
    """Return a header, little endian."""
    return _IDS.pack(client, number)


def unpack(data: bytes | memoryview) -> tuple[int, int] | None:
    """Return the client's number and the request's; None when the payload is too short."""
    if len(data) < _END:
        return None
    client, number = (_IDS if data[1] & 1 else _IDS_BIG).unpack_from(data, _ENCAPSULATION)
    return client, number


def header_of(data: bytes | memoryview) -> bytes:
    """Return the header of a payload that has one."""
    return bytes(data[_ENCAPSULATION:_END])


def with_header(data: bytes | bytearray, header: bytes) -> Parts:
    """Return a payload with a header put in."""
    if len(data) <= COPIED:
        return (b"".join((data[:_ENCAPSULATION], header, data[_ENCAPSULATION:])),)
    view = memoryview(data)
    return view[:_ENCAPSULATION], header, view[_ENCAPSULATION:]


def without_header(data: bytes | memoryview) -> bytes:
    """Return a payload with its header taken out."""
    return b"".join((data[:_ENCAPSULATION], data[_END:]))
