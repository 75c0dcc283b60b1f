"""Says where and why bytes are no message, by reading them slowly and with care.

Generated code only notices that something is wrong; this walk over the same bytes finds the field.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NoReturn

from rosglass.errors import DecodeError
from rosglass.messages import layout
from rosglass.messages.runtime import MAX_EMPTY
from rosglass.messages.schema import Kind

if TYPE_CHECKING:
    from rosglass.messages.layout import Wire
    from rosglass.messages.schema import Member, Schema

__all__ = ["Walk", "encapsulation_error", "explain"]

# OMG DDS-XTypes 1.3, table 59.
_ENCAPSULATIONS = {
    0x0000: "CDR_BE",
    0x0001: "CDR_LE",
    0x0002: "PL_CDR_BE",
    0x0003: "PL_CDR_LE",
    0x0004: "XML",
    0x0006: "CDR2_BE",
    0x0007: "CDR2_LE",
    0x0008: "D_CDR2_BE",
    0x0009: "D_CDR2_LE",
    0x000A: "PL_CDR2_BE",
    0x000B: "PL_CDR2_LE",
}


class Walk:
    """Steps over a message field by field; raises DecodeError with path and offset.

    Attributes:
        offset: Where in the buffer the walk has got to.
    """

    def __init__(self, schema: Schema, wire: Wire, buffer: bytes | memoryview, offset: int) -> None:
        self.schema, self.wire, self.buffer, self.offset = schema, wire, buffer, offset

    def run(self) -> int:
        """Walk to the end of the message and return its offset."""
        self._schema(self.schema, "")
        return self.offset

    def _fail(self, path: str, message: str) -> NoReturn:
        raise DecodeError(self.schema.name, message, path, self.offset)

    def _take(self, size: int, path: str, what: str) -> int:
        left = len(self.buffer) - self.offset
        if size > left:
            self._fail(path, f"{what} needs {size} bytes, the buffer has {max(left, 0)} left")
        start = self.offset
        self.offset += size
        return start

    def _align(self, size: int) -> None:
        if self.wire.aligned:
            self.offset += -(self.offset - self.wire.origin) % size

    def _count(self, path: str, what: str, least: int) -> int:
        self._align(4)
        start = self._take(4, path, f"the length of {what}")
        (count,) = struct.unpack_from(self.wire.order + "I", self.buffer, start)
        left = len(self.buffer) - self.offset
        if (least and count * least > left) or (not least and count > MAX_EMPTY):
            self.offset = start
            self._fail(
                path, f"{what} claims {count} elements, the remaining {left} bytes hold fewer"
            )
        return int(count)

    def _schema(self, schema: Schema, path: str) -> None:
        if not schema.members and self.wire.aligned:
            self._take(1, path, "an empty message")
        for member in schema.members:
            self._member(member, f"{path}.{member.name}" if path else member.name)

    def _member(self, member: Member, path: str) -> None:
        if not member.is_array:
            self._element(member, path)
            return
        count = member.fixed_count
        if count is None:
            least = layout.element_size(member, self.wire)
            count = self._count(path, f"the {member.field.type}", least)
        if member.number is not None:
            if count:
                self._align(member.number.size)
            self._take(count * member.number.size, path, f"{count} elements")
            return
        if member.struct is not None and not layout.element_size(member, self.wire):
            return
        for index in range(count):
            self._element(member, f"{path}[{index}]")

    def _element(self, member: Member, path: str) -> None:
        if member.number is not None:
            self._align(member.number.size)
            self._take(member.number.size, path, f"a {member.number.name}")
        elif member.kind is Kind.TEXT:
            width = self.wire.wide if member.wide else 1
            count = self._count(path, f"a {member.field.type.name}", width)
            start = self._take(count * width, path, f"a {member.field.type.name}")
            if member.wide and width == 4:
                try:
                    order = "be" if self.wire.big else "le"
                    str(self.buffer[start : self.offset], f"utf-32-{order}", "surrogatepass")
                except UnicodeDecodeError as error:
                    self.offset = start + error.start
                    self._fail(path, "a wstring holds a unit beyond U+10FFFF")
        else:
            assert member.struct is not None
            self._schema(member.struct, path)


def explain(
    schema: Schema, wire: Wire, buffer: bytes | memoryview, offset: int, error: Exception
) -> DecodeError:
    """Return the error to raise for a buffer that generated code failed on."""
    if isinstance(error, DecodeError):
        return error
    try:
        if wire.name == "cdr" and offset == wire.origin and len(buffer) < wire.origin:
            return encapsulation_error(schema.name, buffer)
        Walk(schema, wire, buffer, offset).run()
    except DecodeError as found:
        return found
    return DecodeError(schema.name, f"{type(error).__name__}: {error}")


def encapsulation_error(type_name: str, buffer: bytes | memoryview) -> DecodeError:
    """Return the error for a CDR header that is missing or names another representation."""
    if len(buffer) < 4:
        return DecodeError(
            type_name, f"a CDR message starts with a 4-byte header, got {len(buffer)} bytes", "", 0
        )
    code = buffer[0] << 8 | buffer[1]
    name = _ENCAPSULATIONS.get(code, "unknown")
    return DecodeError(
        type_name,
        f"encapsulation {name} (0x{code:04x}) is not supported; have the writer send plain CDR "
        "(XCDR1)",
        "",
        0,
    )
