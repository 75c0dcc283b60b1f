"""The codec of one schema on one wire: its generated functions, each made on first demand."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn

from rosglass.errors import ConversionError, DecodeError
from rosglass.messages import diagnosis, layout
from rosglass.messages.conversion import complete, convert
from rosglass.messages.emit_read import Reader
from rosglass.messages.emit_write import nested_write_function, write_function
from rosglass.messages.layout import ANYWHERE, START, Cursor, Wire
from rosglass.messages.message import await_fill, plain_class, shell_class
from rosglass.messages.runtime import MAX_EMPTY, OddValueError
from rosglass.messages.sequences import MessageSequence
from rosglass.messages.source import Source

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages.layout import Knowledge
    from rosglass.messages.message import Message
    from rosglass.messages.schema import Schema

__all__ = ["Codec", "codec_of"]


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
        plain: The codec of the same wire in bytes; itself unless it is of views.
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
        """Return what was made for `key`, making it once."""
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
            lambda: shell_class(self, True, lambda shell, attr: self._fill(shell, True, attr)),
        )
        return found

    @property
    def shell(self) -> type[Message]:
        """The class of shells around a message inside another."""
        found: type[Message] = self.made(
            "shell",
            lambda: shell_class(self, False, lambda shell, attr: self._fill(shell, False, attr)),
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
            raise diagnosis.explain(self.schema, self.wire, buffer, offset, error) from None

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
        with source.block("except Exception as error:"):
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
        """The function ``read(buffer, offset) -> (message, end)``, which others call."""
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
        """Return ``read(buffer, offset, count) -> (list, end)`` for what is known of the offset."""
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
        except Exception as error:
            self._explain_many(buffer, offset, count, error)
        return items  # type: ignore[no-any-return]

    def _explain_many(
        self, buffer: bytes | memoryview, offset: int, count: int, error: Exception
    ) -> NoReturn:
        for _ in range(count):
            offset = diagnosis.Walk(self.schema, self.wire, buffer, offset).run()
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
        except Exception as error:
            raise diagnosis.explain(self.schema, self.wire, buffer, offset, error) from None
        return end

    @property
    def skipper(self) -> Callable[[Any, int], int]:
        """The function ``skip(buffer, offset) -> end``, which raises anything for damaged bytes."""
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
        except Exception as error:
            raise self.explain(buffer, error) from None

    @property
    def reader(self) -> Callable[[bytes | memoryview], Message]:
        """The function that decodes everything at once, and raises anything for damaged bytes."""
        return self.made("eager", self._eager)  # type: ignore[no-any-return]

    def _eager(self) -> Any:
        source = Source()
        reader = Reader(self, source, self._start())
        source.line(f"m = {source.bind(self.cls, 'C')}()")
        reader.fields(self.schema, "m")
        reader.prove()
        source.line("return m")
        return source.compile("decode(b)", self._title("decode"))

    def end(self, buffer: bytes | memoryview) -> int:
        """Return the offset after the last field, having checked every length on the way."""
        scan = self.made("scan", self._scan)
        try:
            end: int = scan(buffer)
        except Exception as error:
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
                except Exception:
                    pass  # the careful way finds out what it was
            message = convert(self.schema, value)
            try:
                return self._converted_writer(False, joined)(message)
            except OddValueError:
                limit = f"no array of more than {MAX_EMPTY} messages that take no bytes"
                raise ConversionError("", value, limit, self.schema.name) from None

        return write_function(self, from_dict, joined, slowly)

    def nested_writer(self, from_dict: bool, joined: bool, lenient: bool) -> Callable[..., int]:
        """Return the function that other writers call for a message inside theirs."""
        return self.made(  # type: ignore[no-any-return]
            ("write nested", from_dict, joined, lenient),
            lambda: nested_write_function(self, from_dict, joined, lenient),
        )

    def _converted_writer(self, from_dict: bool, joined: bool) -> Callable[[Any], Any]:
        """Return the writer for values that were converted already."""
        return self.made(  # type: ignore[no-any-return]
            ("write converted", from_dict, joined),
            lambda: write_function(self, from_dict, joined, None),
        )

    def explain(self, buffer: bytes | memoryview, error: Exception) -> DecodeError:
        """Return the error to raise for a whole message that generated code failed on."""
        return diagnosis.explain(self.schema, self.wire, buffer, self.wire.origin, error)
