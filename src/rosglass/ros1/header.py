"""TCPROS connection headers: what two ends tell each other before the first message.

Format: ROS wiki, "ROS/Connection Header" and "ROS/TCPROS": fields ``name=value``, each with its
length in front, all together with theirs (32-bit, little-endian).
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from rosglass.errors import DecodeError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["MAX_HEADER", "encode_header", "parse_header"]

#: Longest header taken in bytes; the definition of the largest message type is far below it.
MAX_HEADER = 10_000_000
_length = struct.Struct("<I")


def encode_header(fields: Mapping[str, str]) -> bytes:
    """Return a header with its length in front."""
    lines = [f"{name}={value}".encode() for name, value in fields.items()]
    body = b"".join(_length.pack(len(line)) + line for line in lines)
    return _length.pack(len(body)) + body


def parse_header(data: bytes | memoryview) -> dict[str, str]:
    """Return the fields of a header, which comes without its own length.

    Raises:
        DecodeError: A field reaches beyond the end, or has no ``=``.
    """
    data = bytes(data)
    fields: dict[str, str] = {}
    position = 0
    while position < len(data):
        start = position + _length.size
        size = _length.unpack_from(data, position)[0] if start <= len(data) else len(data)
        if start + size > len(data):
            raise DecodeError("connection header", "a field is cut off", offset=position)
        # Definitions of old types are in whatever encoding their authors' editors had.
        line = data[start : start + size].decode("utf-8", "surrogateescape")
        name, separator, value = line.partition("=")
        if not separator:
            raise DecodeError("connection header", f"{line[:40]!r} has no '='", offset=position)
        fields[name] = value
        position = start + size
    return fields
