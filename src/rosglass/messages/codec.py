"""Codecs, which read and write the messages of a schema, and the diagnosis of invalid bytes.

Generated code only detects that bytes are invalid; :class:`Walk` finds the field.
"""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn

from rosglass.errors import ConversionError, DecodeError
from rosglass.messages import layout
from rosglass.messages.emit_read import Reader
from rosglass.messages.emit_write import nested_write_function, write_function
from rosglass.messages.layout import ANYWHERE, START, Cursor, Wire
from rosglass.messages.message import await_fill, complete, convert, plain_class, shell_class
from rosglass.messages.schema import Kind
from rosglass.messages.sequences import MessageSequence
from rosglass.messages.source import MAX_EMPTY, OddValueError, Source, TooShortError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages.layout import Knowledge, Wire
    from rosglass.messages.message import Message
    from rosglass.messages.schema import Member, Schema

__all__ = ["UNREADABLE", "Codec", "Walk", "codec_of", "encapsulation_error", "explain"]

#: Errors of generated code for bytes that are not the message: too few, or invalid lengths, texts
#: and numbers; of struct, of memoryviews and arrays, and of NumPy. Others are defects.
UNREADABLE = (
    DecodeError, TooShortError, struct.error,
    IndexError, OverflowError, MemoryError, TypeError, ValueError,
)  # fmt: skip


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
        offset: Current position in the buffer.
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
    """Create the error for a buffer that generated code failed on."""
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
    """Create the error for a CDR header that is missing or of another representation."""
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


def codec_of(schema: Schema, wire: Wire) -> Codec:
    """Return the codec of a schema on a wire."""
    codec: Codec = schema.cached(("codec", wire), lambda: Codec(schema, wire))
    return codec


class Codec:
    """Reads and writes the messages of one schema on one wire.

    Attributes:
        schema: The schema.
        wire: The wire.
        cls: The class of plain messages.
        stride: (stride, size) of its elements in arrays if constant, otherwise None.
        plain: The codec of the same wire for bytes; itself unless it is for views.
    """

    def __init__(self, schema: Schema, wire: Wire) -> None:
        self.schema, self.wire = schema, wire
        self.cls = plain_class(schema)
        self.stride = layout.constant_stride(schema, wire)
        self.plain = codec_of(schema, replace(wire, view=False)) if wire.view else self
        self._made: dict[object, Any] = {}
        self._read_many: Callable[[Any, int, int], tuple[Any, int]] | None = None

    def of(self, schema: Schema) -> Codec:
        """Return the codec of another schema on the same wire."""
        return codec_of(schema, self.wire)

    def made(self, key: object, make: Callable[[], Any]) -> Any:
        """Return the cached object for `key`, created when it is first used."""
        try:
            return self._made[key]
        except KeyError:
            with self.schema.lock:
                if key not in self._made:
                    self._made[key] = make()
                return self._made[key]

    def _title(self, what: str) -> str:
        return f"{what} {self.schema.name} {self.wire.title}"

    def _start(self) -> Cursor:
        return Cursor(self.wire, "", self.wire.origin, START)

    # -- lazy ------------------------------------------------------------------------------------

    @property
    def root(self) -> type[Message]:
        """The class of shells around a whole message."""
        found: type[Message] = self.made(
            "root",
            lambda: shell_class(
                self.schema, self.plain, lambda shell, attr: self._fill(shell, True, attr)
            ),
        )
        return found

    @property
    def shell(self) -> type[Message]:
        """The class of shells around a message inside another."""
        found: type[Message] = self.made(
            "shell",
            lambda: shell_class(
                self.schema, None, lambda shell, attr: self._fill(shell, False, attr)
            ),
        )
        return found

    def _fill(self, shell: type[Message], root: bool, attr: str) -> Callable[[Message], Any]:
        """Return the function that decodes a shell's level, and returns the attribute if any."""
        source = Source()
        cursor = self._start() if root else Cursor(self.wire, "o", 0, ANYWHERE)
        reader = Reader(self, source, cursor)

        def failed(message: Message, error: Exception) -> Any:
            try:
                buffer = message._buffer__
                offset = self.wire.origin if root else message._offset__
            except AttributeError:
                await_fill(message, shell)
                return getattr(message, attr) if attr else None
            raise explain(self.schema, self.wire, buffer, offset, error) from None

        with source.block("try:"):
            source.line("b = m._buffer__")
            if not root:
                source.line("o = m._offset__")
            names = []
            for index, member in enumerate(self.schema.members):
                names.append((member.attr, f"v{index}"))
                last = index == len(self.schema.members) - 1
                reader.member(member, f"v{index}", lazy=True, last=last)
            reader.prove()
            # Deleting succeeds once: only one thread gets past this line.
            source.line("del m._buffer__")
        with source.block("except Exception as error:"):  # of a peer's bytes; explained
            source.line(f"return {source.bind(failed, 'failed')}(m, error)")
        source.line(f"m.__class__ = {source.bind(self.cls, 'C')}")
        for field, name in names:
            source.line(f"m.{field} = {name}")
        if attr:
            source.line(f"return {dict(names)[attr]}")
        filled: Callable[[Message], Any] = source.compile("fill(m)", self._title(f"fill {attr}"))
        return filled

    # -- arrays of messages ----------------------------------------------------------------------

    @property
    def sequence(self) -> type[MessageSequence]:
        """The class of lazy arrays of this schema."""
        found: type[MessageSequence] = self.made(
            "sequence",
            lambda: type("MessageSequence", (MessageSequence,), {"__slots__": (), "_codec": self}),
        )
        return found

    @property
    def reader_of_one(self) -> Callable[[Any, int], tuple[Message, int]]:
        """The function ``read(buffer, offset) -> (message, end)``, called by other functions."""
        return self.made("one", self._one)  # type: ignore[no-any-return]

    def _one(self) -> Any:
        source = Source()
        reader = Reader(self, source, Cursor(self.wire, "o", 0, ANYWHERE))
        source.line(f"m = {source.bind(self.cls, 'C')}()")
        reader.fields(self.schema, "m")
        reader.settle("o")
        source.line("return m, o")
        return source.compile("read_one(b, o)", self._title("nested"))

    def reader_of_many(self, known: Knowledge) -> Callable[[Any, int, int], tuple[Any, int]]:
        """Return ``read(buffer, offset, count) -> (list, end)`` for offsets that match `known`."""
        return self.made(("many", known), lambda: self._many(known))  # type: ignore[no-any-return]

    def _many(self, known: Knowledge) -> Any:
        source = Source()
        reader = Reader(self, source, Cursor(self.wire, "o", 0, known))
        reader.many(self.schema, "count")
        source.line("return out, o")
        return source.compile("read_list(b, o, count)", self._title("list"))

    def read_many(self, buffer: bytes | memoryview, offset: int, count: int) -> list[Message]:
        """Decode `count` elements from `offset` on."""
        read = self._read_many
        if read is None:
            read = self._read_many = self.reader_of_many(ANYWHERE)
        try:
            items, end = read(buffer, offset, count)
            if end > len(buffer):
                raise DecodeError(self.schema.name, "the buffer ends early", "", len(buffer))
        except UNREADABLE as error:
            self._explain_many(buffer, offset, count, error)
        return items  # type: ignore[no-any-return]

    def _explain_many(
        self, buffer: bytes | memoryview, offset: int, count: int, error: Exception
    ) -> NoReturn:
        for _ in range(count):
            offset = Walk(self.schema, self.wire, buffer, offset).run()
        raise DecodeError(self.schema.name, f"{type(error).__name__}: {error}") from None

    def element(self, buffer: bytes | memoryview, offset: int) -> Message:
        """Return the shell of an element."""
        message = self.shell()
        message._buffer__ = buffer
        message._offset__ = offset
        return message

    def skip(self, buffer: bytes | memoryview, offset: int) -> int:
        """Return the offset after the message at `offset`."""
        try:
            end: int = self.skipper(buffer, offset)
        except UNREADABLE as error:
            raise explain(self.schema, self.wire, buffer, offset, error) from None
        return end

    @property
    def skipper(self) -> Callable[[Any, int], int]:
        """The function ``skip(buffer, offset) -> end``; damaged bytes may raise any error."""
        return self.made("skip", self._skip)  # type: ignore[no-any-return]

    def _skip(self) -> Any:
        source = Source()
        reader = Reader(self, source, Cursor(self.wire, "o", 0, ANYWHERE))
        reader.skip_members(self.schema)
        reader.prove()
        source.line(f"return {reader.cursor.at()}")
        return source.compile("skip(b, o)", self._title("skip"))

    # -- whole messages --------------------------------------------------------------------------

    def decode_all(self, buffer: bytes | memoryview) -> Message:
        """Decode everything at once."""
        try:
            return self.reader(buffer)
        except UNREADABLE as error:
            raise self.explain(buffer, error) from None

    @property
    def reader(self) -> Callable[[bytes | memoryview], Message]:
        """The function that decodes everything at once; damaged bytes may raise any error."""
        return self.made("eager", self._eager)  # type: ignore[no-any-return]

    def _eager(self) -> Any:
        source = Source()
        reader = Reader(self, source, self._start())
        source.line(f"m = {source.bind(self.cls, 'C')}()")
        reader.fields(self.schema, "m")
        reader.prove()
        source.line("return m")
        return source.compile("decode(b)", self._title("decode"))

    def decode_checked(self, buffer: bytes | memoryview) -> tuple[Message, int]:
        """Decode a message's own level and check all others; return it with its end."""
        read = self.made("checked", self._checked)
        try:
            found: tuple[Message, int] = read(buffer)
        except UNREADABLE as error:
            raise self.explain(buffer, error) from None
        return found

    def _checked(self) -> Any:
        source = Source()
        reader = Reader(self, source, self._start())
        source.line(f"m = {source.bind(self.cls, 'C')}()")
        reader.fields(self.schema, "m", lazy=True)
        reader.prove()
        source.line(f"return m, {reader.cursor.at()}")
        return source.compile("check(b)", self._title("check"))

    def end(self, buffer: bytes | memoryview) -> int:
        """Check every length, and return the offset after the last field."""
        scan = self.made("scan", self._scan)
        try:
            end: int = scan(buffer)
        except UNREADABLE as error:
            raise self.explain(buffer, error) from None
        return end

    def _scan(self) -> Any:
        source = Source()
        reader = Reader(self, source, self._start())
        reader.skip_members(self.schema)
        reader.prove()
        source.line(f"return {reader.cursor.at()}")
        return source.compile("scan(b)", self._title("scan"))

    # -- writing ---------------------------------------------------------------------------------

    def writer(self, from_dict: bool, joined: bool) -> Callable[..., Any]:
        """Return the function from a dict or a message to its bytes, or to their parts."""
        return self.made(  # type: ignore[no-any-return]
            ("write", from_dict, joined), lambda: self._writer(from_dict, joined)
        )

    def _writer(self, from_dict: bool, joined: bool) -> Any:
        def slowly(value: Any, error: Exception) -> Any:  # noqa: ARG001 - raised again if real
            if from_dict:
                try:
                    return self._converted_writer(True, joined)(complete(self.schema, value))
                except Exception:  # noqa: BLE001 - whatever objects of the user raise; see below
                    pass  # converting field by field finds it again, and names the field
            message = convert(self.schema, value)
            try:
                return self._converted_writer(False, joined)(message)
            except OddValueError:
                limit = f"no array of more than {MAX_EMPTY} messages that take no bytes"
                raise ConversionError("", value, limit, self.schema.name) from None

        return write_function(self, from_dict, joined, slowly)

    def nested_writer(self, from_dict: bool, joined: bool, lenient: bool) -> Callable[..., int]:
        """Return the function by which other writers write a nested message."""
        return self.made(  # type: ignore[no-any-return]
            ("write nested", from_dict, joined, lenient),
            lambda: nested_write_function(self, from_dict, joined, lenient),
        )

    def _converted_writer(self, from_dict: bool, joined: bool) -> Callable[[Any], Any]:
        """Return the writer for converted values."""
        return self.made(  # type: ignore[no-any-return]
            ("write converted", from_dict, joined),
            lambda: write_function(self, from_dict, joined, None),
        )

    def explain(self, buffer: bytes | memoryview, error: Exception) -> DecodeError:
        """Return the error to raise for a whole message that generated code failed on."""
        return explain(self.schema, self.wire, buffer, self.wire.origin, error)
