"""Generates functions that read the values at field paths from bytes, without creating messages.

They step over everything before the last target, and ignore everything after it. Columns
(``poses[*].position.x``) of elements of constant size are numpy views with a stride.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import FieldPathError
from rosglass.messages import layout
from rosglass.messages.emit_read import Reader
from rosglass.messages.layout import START, Cursor
from rosglass.messages.message import column_type, resolve_path
from rosglass.messages.schema import Kind
from rosglass.messages.source import Source, load_numpy, number_type, unpacker

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages.emit_read import EmittedCodec
    from rosglass.messages.layout import Wire
    from rosglass.messages.message import Step
    from rosglass.messages.schema import Member, Schema

    Route = list[tuple[Member, Step | None]]

__all__ = ["path_function"]


def path_function(
    codec: EmittedCodec,
    paths: tuple[str, ...],
    single: bool,
    other: Callable[[Any], Any],
    failed: Callable[[Any, Exception], Any],
) -> Callable[[bytes], Any]:
    """Return the function from a message's bytes to the values at the paths.

    Args:
        codec: Codec of the bytes.
        paths: The paths.
        single: Whether it returns the value of the only path, instead of a tuple.
        other: Called with buffers whose CDR header has another byte order than this codec.
        failed: Called with the buffer and the error after any error.

    Raises:
        FieldPathError: A path does not exist in the type.
    """
    targets = [(f"r{i}", resolve_path(codec.schema, path), path) for i, path in enumerate(paths)]
    source = Source()
    with source.block("try:"):
        if not _constant_offsets(codec, source, targets, other):
            if codec.wire.aligned:
                different = source.bind(other, "other")
                expected = 0 if codec.wire.big else 1
                source.line(f"if b[1] != {expected} or b[0]: return {different}(b)")
            reader = Reader(codec, source, Cursor(codec.wire, "", codec.wire.origin, START))
            _Walk(codec, source).schema(reader, codec.schema, targets, last=True)
        results = ", ".join(name for name, _, _ in targets)
        source.line(f"return {results}" if single else f"return ({results},)")
    with source.block("except Exception as error:"):
        source.line(f"return {source.bind(failed, 'failed')}(b, error)")
    title = f"path {', '.join(paths)} {codec.schema.name} {codec.wire.title}"
    made: Callable[[bytes], Any] = source.compile("path(b)", title)
    return made


def _constant_offsets(
    codec: EmittedCodec, source: Source, targets: list[tuple[str, Route, str]], other: Any
) -> bool:
    """Read numbers at constant offsets, header included, in one call; False if that can't be."""
    wire = codec.wire
    places = []
    for name, route, _ in targets:
        offset = _constant_offset(codec.schema, route, wire)
        if offset is None:
            return False
        number = route[-1][0].number
        assert number is not None
        places.append((offset, name, number))
    fmt, place, names = wire.order, wire.origin, []
    if wire.aligned:
        fmt, names = f"{wire.order}Hxx", ["h"]
    for offset, name, number in sorted(places, key=lambda item: item[0]):
        if offset < place:
            return False
        fmt += "x" * (offset - place) + number.code
        place = offset + number.size
        names.append(name)
    source.line(f"{', '.join(names)}, = {source.bind(unpacker(fmt), 'u')}(b)")
    if wire.aligned:
        # The header's first two bytes, read in the byte order they announce.
        expected = 0x0000 if wire.big else 0x0100
        source.line(f"if h != {expected}: return {source.bind(other, 'other')}(b)")
    return True


def _constant_offset(schema: Schema, route: Route, wire: Wire) -> int | None:
    position = 0
    inside = schema
    for depth, (target, step) in enumerate(route):
        if step is not None or target.is_array:
            return None
        for member in inside.members:
            if member is target:
                break
            after = layout.member_span(member, wire, position)
            if after is None:
                return None
            position = after
        if depth + 1 < len(route):
            assert target.struct is not None
            inside = target.struct
    number = route[-1][0].number
    if number is None:
        return None
    position += -position % number.size if wire.aligned else 0
    return position + wire.origin


class _Walk:
    """Emits the steps to every target."""

    def __init__(self, codec: EmittedCodec, source: Source) -> None:
        self.codec, self.wire, self.source = codec, codec.wire, source

    def _fork(self, reader: Reader) -> Reader:
        """Return a copy of a reader at its present position, which it keeps."""
        reader.flush()
        cursor = reader.cursor.copy()
        if cursor.var:
            name = self.source.fresh("at")
            self.source.line(f"{name} = {cursor.at()}")
            cursor.move(name, cursor.known)
        return Reader(self.codec, self.source, cursor)

    def schema(
        self,
        reader: Reader,
        schema: Schema,
        targets: list[tuple[str, Route, str]],
        last: bool,
    ) -> None:
        """Read the targets inside a message; step over the rest unless nothing follows."""
        wanted = [
            member for member in schema.members if any(r[0][0] is member for _, r, _ in targets)
        ]
        for member in schema.members:
            mine = [target for target in targets if target[1][0][0] is member]
            final = last and bool(wanted) and member is wanted[-1]
            if mine:
                self._member(reader, member, mine, final)
            else:
                reader.skip_member(member)
            if final:
                break
        reader.flush()

    def _member(
        self, reader: Reader, member: Member, targets: list[tuple[str, Route, str]], last: bool
    ) -> None:
        whole = [target for target in targets if len(target[1]) == 1 and target[1][0][1] is None]
        inner = [target for target in targets if target not in whole]
        if whole and not inner:
            first = whole[0][0]
            reader.member(member, first, lazy=True, last=last)
            reader.prove()
            for name, _, _ in whole[1:]:
                self.source.line(f"{name} = {first}")
            return
        if not member.is_array and not whole:
            assert member.struct is not None
            deeper = [(name, route[1:], path) for name, route, path in inner]
            self.schema(reader, member.struct, deeper, last)
            return
        # Read each from the start of the field: indexes can be in any order.
        for target in whole:
            self._member(self._fork(reader), member, [target], last=True)
        if not member.is_array:
            self._member(self._fork(reader), member, inner, last=True)
        else:
            for target in inner:
                self._selected(self._fork(reader), member, target)
        if not last:
            reader.skip_member(member)

    def _selected(self, reader: Reader, member: Member, target: tuple[str, Route, str]) -> None:
        """Read elements of an array: one by its index, or several by a slice."""
        name, route, path = target
        step, rest = route[0][1], route[1:]
        if isinstance(step, slice):
            self._sliced(reader, member, name, step, rest, path)
            return
        assert isinstance(step, int)
        count = reader.count(member)
        index = str(step)
        if not count.isdigit():
            missing = self.source.bind(_out_of_range, "missing")
            limit = f"{count} <= {step}" if step >= 0 else f"{count} < {-step}"
            self.source.line(f"if {limit}: {missing}({path!r}, {step}, {count})")
            index = str(step) if step >= 0 else f"({count} - {-step})"
        elif step < 0:
            index = str(int(count) + step)
        if member.number is not None:
            self._number_at(reader, member, name, index)
            return
        if member.kind is Kind.TEXT:
            reader.check_count(4, count)
            with reader.text_loop(f"for _ in range({index}):", member):
                reader.skip_text(member)
            reader.text(member, name)
            reader.prove()
            return
        schema = member.struct
        assert schema is not None
        reader.check_count(layout.min_size(schema, self.wire), count)
        reader.to_element(schema, index)
        if not rest:
            shell = self.source.bind(self.codec.of(schema).element, "element")
            self.source.line(f"{name} = {shell}(b, {reader.cursor.at()})")
        else:
            self.schema(reader, schema, [(name, rest, path)], last=True)

    def _number_at(self, reader: Reader, member: Member, name: str, index: str) -> None:
        number = member.number
        assert number is not None
        reader.cursor.align(self.source, number.size, reader.var)
        if index.isdigit():
            reader.cursor.advance(int(index) * number.size)
        else:
            start = reader.cursor.at()
            self.source.line(f"{reader.var} = {start} + {index} * {number.size}")
            reader.cursor.move(reader.var, reader.cursor.known.many(number.size))
        reader.number(name, number.code, number.size)
        reader.flush()

    def _sliced(
        self, reader: Reader, member: Member, name: str, cut: slice, rest: Route, path: str
    ) -> None:
        brackets = f"[{_slice_text(cut)}]" if cut != slice(None) else ""
        if not rest:
            reader.member(member, name, lazy=True, last=True)
            reader.prove()
            if brackets or member.kind is Kind.STRUCT:
                self.source.line(f"{name} = {name}{brackets or '[:]'}")
            return
        schema = member.struct
        assert schema is not None
        stride = layout.constant_stride(schema, self.wire)
        inner = _constant_offset(schema, rest, self.wire)
        count = reader.count(member)
        reader.check_count(layout.min_size(schema, self.wire), count)
        numpy = load_numpy()
        if stride is not None and inner is not None:
            number = rest[-1][0].number
            assert number is not None
            reader.to_element(schema, "0")
            array = self.source.bind(numpy.ndarray, "array")
            dtype = self.source.bind(number_type(number.dtype, self.wire.order), number.dtype)
            start = reader.cursor.at(inner - self.wire.origin)
            start = f"{start} if {count} else 0"
            view = f"{array}(({count},), {dtype}, b, {start}, ({stride[0]},)){brackets}"
            self.source.line(f"{name} = {view}" + (" != 0" if number.code == "?" else ""))
            return
        items, value = self.source.fresh("a"), self.source.fresh("v")
        self.source.line(f"{items} = []")
        with reader.schema_loop(f"for _ in range({count}):", schema):
            self.schema(reader, schema, [(value, rest, path)], last=False)
            self.source.line(f"{items}.append({value})")
        reader.prove()
        result = f"{items}{brackets}"
        kind = column_type(rest)
        if kind is not None:
            make = self.source.bind(numpy.array, "make")
            result = f"{make}({result}, {self.source.bind(kind, 'kind')})"
        self.source.line(f"{name} = {result}")


def _slice_text(cut: slice) -> str:
    parts = ["" if part is None else str(part) for part in (cut.start, cut.stop)]
    return ":".join(parts if cut.step is None else [*parts, str(cut.step)])


def _out_of_range(path: str, index: int, count: int) -> None:
    raise FieldPathError(
        f"field path {path!r}: index {index} is out of range, the array holds {count}"
    )
