"""Generates code that steps through bytes: for decoding, and to read field paths alone.

Read :meth:`Skipper.skip_member` as the specification of both formats: numbers are collected into
runs that one :mod:`struct` call unpacks, strings are a count and that many bytes (CDR counts and
sends a final NUL), sequences are a count and their elements.

Functions for field paths step over everything before the last target, and ignore everything after
it. Columns (``poses[*].position.x``) of elements of constant size are numpy views with a stride.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.errors import FieldPathError
from rosglass.messages import layout
from rosglass.messages.layout import START, Cursor, Knowledge
from rosglass.messages.message import column_type, resolve_path
from rosglass.messages.schema import Kind
from rosglass.messages.sequences import ElementCodec
from rosglass.messages.source import (
    MAX_EMPTY,
    Source,
    iterator,
    load_numpy,
    number_type,
    read_wide,
    too_short,
    unpacker,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from rosglass.messages.layout import Wire
    from rosglass.messages.message import Message, Step
    from rosglass.messages.schema import Member, Schema
    from rosglass.messages.sequences import MessageSequence

    Route = list[tuple[Member, Step | None]]

__all__ = ["EmittedCodec", "Reader", "Skipper", "is_shared", "path_function"]


class EmittedCodec(ElementCodec, Protocol):
    """The classes and functions that generated code uses for a message and for those inside it.

    A :class:`~rosglass.messages.codec.Codec`, which has them generated when they are first used.
    """

    cls: type[Message]

    def of(self, schema: Schema) -> EmittedCodec:
        """Return the codec of another schema on the same wire."""

    @property
    def shell(self) -> type[Message]:
        """The class of shells around a message inside another."""

    @property
    def sequence(self) -> type[MessageSequence]:
        """The class of lazy arrays of this schema."""

    @property
    def skipper(self) -> Callable[[Any, int], int]:
        """The function ``skip(buffer, offset) -> end``."""

    @property
    def reader_of_one(self) -> Callable[[Any, int], tuple[Message, int]]:
        """The function ``read(buffer, offset) -> (message, end)``."""

    def reader_of_many(self, known: Knowledge) -> Callable[[Any, int, int], tuple[Any, int]]:
        """Return ``read(buffer, offset, count) -> (list, end)`` for offsets that match `known`."""

    def nested_writer(self, from_dict: bool, joined: bool, lenient: bool) -> Callable[..., int]:
        """Return the function by which other writers write a nested message."""


_NEAR = 256
#: Limit of fields, at every depth, for repeating a nested message's code in each function that
#: needs it: this is faster than a call.
_MOST_INLINE = 200


def is_shared(schema: Schema, source: Source) -> bool:
    """Return whether a nested message has a function of its own, which all others call.

    The code of a type then grows with its definition, not with its messages.
    """
    return bool(schema.members) and (schema.extent.fields > _MOST_INLINE or source.is_full)


class Skipper:
    """Emits steps through a buffer called ``b``.

    Attributes:
        source: Receives the code.
        cursor: Position of the code in the buffer.
    """

    def __init__(self, codec: EmittedCodec, source: Source, cursor: Cursor) -> None:
        self.codec, self.wire = codec, codec.wire
        self.source, self.cursor = source, cursor
        #: Numbers to be unpacked together: target, format character, size.
        self.run: list[tuple[str, str, int]] = []
        #: Whether the end is not yet proved to lie within the buffer.
        self.unproved = False

    def number(self, target: str, code: str, size: int) -> None:
        """Unpack one number into `target` ('' for none); it joins the current run."""
        self.run.append((target, code, size))

    def flush(self) -> None:
        """Unpack the numbers collected so far."""
        while self.run:
            if self.wire.aligned:
                self.cursor.align(self.source, self.run[0][2], self.var)
            taken, layouts = self.plan_run()
            run, self.run = self.run[:taken], self.run[taken:]
            targets = ", ".join(target for target, _, _ in run if target)
            if len(layouts) == 1:
                fmt, size = layouts[0]
                if targets:
                    self._unpack(targets, fmt, self.cursor.at())
                self.cursor.advance(size)
                self.unproved = not targets
                continue
            # Known modulo 4 only, with 8-byte numbers ahead: one prepared layout for each case.
            var, offset = self.var, self.cursor.at()
            residue = self.cursor.known.residue
            case = f"({offset} - {residue}) & 4" if residue else f"({offset}) & 4"
            for head, (fmt, size) in zip((f"if {case}:", "else:"), layouts, strict=True):
                with self.source.block(head):
                    if targets:
                        self._unpack(targets, fmt, offset)
                    self.source.line(f"{var} = {self.cursor.at(size)}")
            end = Knowledge(8, (residue + layouts[0][1]) % 8)
            self.cursor.move(var, end)
            self.unproved = not targets

    def _unpack(self, targets: str, fmt: str, offset: str) -> None:
        if offset.isdigit() and int(offset) <= _NEAR:
            # Padding at the start of the layout is quicker than an argument.
            fmt, offset = f"{fmt[0]}{offset}x{fmt[1:]}", ""
        function = self.source.bind(unpacker(fmt), "u")
        comma = "" if "," in targets else ","
        at = f", {offset}" if offset else ""
        self.source.line(f"{targets}{comma} = {function}(b{at})")

    def plan_run(self) -> tuple[int, list[tuple[str, int]]]:
        """Return how many numbers fit one call, and the layout for each possible residue."""
        known = self.cursor.known
        starts = [known.residue]
        if not self.wire.aligned:
            modulus = 1
        else:
            modulus = known.modulus
            if modulus == 4 and any(size == 8 for _, _, size in self.run):
                modulus, starts = 8, [known.residue, known.residue + 4]
        taken = len(self.run)
        if self.wire.aligned:
            for index, (_, _, size) in enumerate(self.run):
                if size > modulus:
                    taken = index
                    break
        layouts = []
        for start in starts:
            fmt, position = [self.wire.order], start
            for target, code, size in self.run[:taken]:
                pad = -position % size if self.wire.aligned else 0
                fmt.append("x" * pad + (code if target else "x" * size))
                position += pad + size
            layouts.append(("".join(fmt), position - start))
        return taken, layouts

    @property
    def var(self) -> str:
        """The local variable of the offset, once that is not constant."""
        return self.cursor.var or "o"

    # -- arrays ----------------------------------------------------------------------------------

    def count(self, member: Member) -> str:
        """Read the element count of an array, or return the fixed one."""
        if member.fixed_count is not None:
            self.flush()
            return str(member.fixed_count)
        count = self.source.fresh("n")
        self.number(count, "I", 4)
        self.flush()
        return count

    def check_count(self, least: int, count: str) -> None:
        """Refuse counts that the rest of the buffer cannot hold, before looping or allocating."""
        if count.isdigit():
            return
        short = self.source.bind(too_short, "short")
        if least:
            times = f"{count} * {least}" if least > 1 else count
            self.source.line(f"if {times} > len(b) - ({self.cursor.at()}): {short}()")
        else:
            self.source.line(f"if {count} > {MAX_EMPTY}: {short}()")

    def elements_start(self, size: int, count: str) -> str:
        """Return the offset of the first element; CDR pads only if there is one."""
        pad = self.cursor.padding(size)
        if pad == 0:
            return self.cursor.at()
        if count.isdigit():
            self.cursor.align(self.source, size, self.var)
            return self.cursor.at()
        start = self.source.fresh("s")
        self.source.line(
            f"{start} = {self.cursor.aligned(size)} if {count} else {self.cursor.at()}"
        )
        return start

    def pass_elements(self, step: int, size: int, align: int, count: str, start: str) -> None:
        """Move past `count` elements, `step` bytes apart, the last one `size` bytes long."""
        if count.isdigit():
            self.cursor.advance(step * (int(count) - 1) + size)
            return
        known = layout.after_elements(self.cursor.known, align, step, size)
        var = self.var
        times = f" * {step}" if step != 1 else ""
        # No padding after the last element.
        tail = f" - ({step - size} if {count} else 0)" if step != size else ""
        self.source.line(f"{var} = {start} + {count}{times}{tail}")
        self.cursor.move(var, known)

    def first_align(self, schema: Schema) -> int:
        """Return the alignment of an element's first byte."""
        return layout.align_of(schema.members[0], self.wire) if schema.members else 1

    def pass_stride(self, schema: Schema, stride: tuple[int, int], count: str, start: str) -> None:
        """Move past `count` messages of constant (stride, size)."""
        step, size = stride
        self.pass_elements(step, size, self.first_align(schema), count, start)
        self.unproved = True

    @contextmanager
    def loop(self, head: str, step: Callable[[Knowledge], Knowledge]) -> Iterator[None]:
        """Emit a loop; `step` returns what is known of the position after its body."""
        self.flush()
        var = self.var
        self.settle(var)
        known = self.cursor.known.repeated(step) if self.wire.aligned else layout.ANYWHERE
        self.cursor.move(var, known)
        unproved = self.unproved
        with self.source.block(head):
            yield
            self.settle(var)
        self.cursor.move(var, known)
        self.unproved = self.unproved or unproved

    def text_loop(self, head: str, member: Member) -> AbstractContextManager[None]:
        """Emit a loop whose body passes one string."""
        return self.loop(head, lambda known: layout.after_text(known, self.wire, member.wide))

    def schema_loop(self, head: str, schema: Schema) -> AbstractContextManager[None]:
        """Emit a loop whose body passes one message."""
        return self.loop(head, lambda known: layout.after_schema(known, self.wire, schema))

    def settle(self, var: str) -> None:
        """Assign the current offset to the variable."""
        self.flush()
        if self.cursor.at() != var:
            self.source.line(f"{var} = {self.cursor.at()}")
            self.cursor.move(var, self.cursor.known)

    # -- stepping over ---------------------------------------------------------------------------

    def skip(self, schema: Schema) -> None:
        """Step over a message."""
        self.flush()
        if is_shared(schema, self.source):
            passed = self.source.bind(self.codec.of(schema).skipper, "pass_one")
            var, known = self.var, self.cursor.known
            self.source.line(f"{var} = {passed}(b, {self.cursor.at()})")
            self.cursor.move(var, layout.after_schema(known, self.wire, schema))
        else:
            self.skip_members(schema)
        self.unproved = True

    def skip_members(self, schema: Schema) -> None:
        """Step over the fields of a message."""
        if not schema.members and self.wire.aligned:
            self.cursor.advance(1)
        for member in schema.members:
            self.skip_member(member)

    def skip_member(self, member: Member) -> None:
        """Step over a field."""
        self.flush()
        self.unproved = True
        if not member.is_array:
            if member.number is not None:
                if self.wire.aligned:
                    self.cursor.align(self.source, member.number.size, self.var)
                self.cursor.advance(member.number.size)
            elif member.kind is Kind.TEXT:
                self.skip_text(member)
            else:
                assert member.struct is not None
                self.skip(member.struct)
            return
        count = self.count(member)
        self.unproved = True
        if member.number is not None:
            start = self.elements_start(member.number.size, count)
            size = member.number.size
            self.pass_elements(size, size, size, count, start)
        elif member.kind is Kind.TEXT:
            self.check_count(4, count)
            with self.text_loop(f"for _ in range({count}):", member):
                self.skip_text(member)
        else:
            assert member.struct is not None
            self.check_count(layout.min_size(member.struct, self.wire), count)
            self.skip_elements(member.struct, count)

    def skip_text(self, member: Member) -> None:
        """Step over one string."""
        self.number("n", "I", 4)
        self.flush()
        var = self.var
        width = self.wire.wide if member.wide else 1
        times = f" * {width}" if width != 1 else ""
        if width == 4:
            # Not every four bytes are a character: reading would refuse them.
            self.source.line(f"s = {self.cursor.at()}")
            self.source.line(f"{var} = s + n{times}")
            check = self.source.bind(read_wide, "wide")
            self.source.line(f"{check}(b, s, {var}, {width}, {self.wire.big})")
        else:
            self.source.line(f"{var} = n{times} + {self.cursor.at()}")
        self.cursor.move(var, self.cursor.known.many(width))
        self.unproved = True

    def skip_elements(self, schema: Schema, count: str) -> None:
        """Step over the elements of an array of messages."""
        stride = layout.constant_stride(schema, self.wire)
        if stride is not None:
            start = self.elements_start(self.first_align(schema), count)
            self.pass_stride(schema, stride, count, start)
        elif layout.min_size(schema, self.wire):
            with self.schema_loop(f"for _ in range({count}):", schema):
                self.skip(schema)
        self.unproved = True

    def to_element(self, schema: Schema, index: str) -> None:
        """Move from the start of an array to its element `index`."""
        stride = layout.constant_stride(schema, self.wire)
        if stride is None:
            if index != "0":
                with self.schema_loop(f"for _ in range({index}):", schema):
                    self.skip(schema)
            return
        # Align even before an empty array: an index was checked before.
        self.cursor.align(self.source, self.first_align(schema), self.var)
        step = stride[0]
        if index.isdigit():
            self.cursor.advance(step * int(index))
        else:
            var = self.var
            self.source.line(f"{var} = {self.cursor.at()} + {index} * {step}")
            self.cursor.move(var, self.cursor.known.many(step))

    def prove(self) -> None:
        """Emit the check, if needed, that everything read so far lay within the buffer."""
        self.flush()
        if self.unproved:
            short = self.source.bind(too_short, "short")
            self.source.line(f"if {self.cursor.at()} > len(b): {short}()")
            self.unproved = False


#: Nested messages of up to this many values are decoded with their parent, bigger ones on demand.
INLINE_LEAVES = 16

#: Arrays of up to this many messages of varying size are decoded with the fields around them.
_FEW = 8


class Reader(Skipper):
    """Emits the decoding of a buffer called ``b``."""

    def fields(self, schema: Schema, target: str, lazy: bool = False) -> None:
        """Decode the fields of `schema` into attributes of the local called `target`."""
        if not schema.members:
            self.placeholder()
        for member in schema.members:
            self.member(member, f"{target}.{member.attr}", lazy)

    def placeholder(self) -> None:
        """Read the placeholder of a message without fields."""
        # IDL has no empty structs: rosidl gives them one uint8.
        if self.wire.aligned:
            self.number("", "x", 1)

    def member(self, member: Member, target: str, lazy: bool = False, last: bool = False) -> None:
        """Decode one field into `target`.

        Args:
            member: The field.
            target: Assignment target: a local or an attribute of one.
            lazy: Leave big messages and arrays of messages as shells.
            last: Nothing follows, so a shell's end need not be found.
        """
        if not member.is_array:
            if member.number is not None:
                self.number(target, member.number.code, member.number.size)
            elif member.kind is Kind.TEXT:
                self.text(member, target)
            else:
                assert member.struct is not None
                self.struct(member.struct, target, lazy, last)
            return
        count = self.count(member)
        if member.number is not None:
            self._numbers(member, target, count)
        elif member.kind is Kind.TEXT:
            self._texts(member, target, count)
        else:
            assert member.struct is not None
            self._structs(member, target, count, lazy, last)

    def struct(self, schema: Schema, target: str, lazy: bool = False, last: bool = False) -> None:
        """Decode a nested message."""
        if lazy and layout.leaves(schema) > INLINE_LEAVES:
            self.flush()
            shell = self.source.bind(self.codec.of(schema).shell, "K")
            name = self.source.fresh("t")
            self.source.line(f"{target} = {name} = {shell}()")
            self.source.line(f"{name}._buffer__ = b")
            self.source.line(f"{name}._offset__ = {self.cursor.at()}")
            if not last:
                self.skip(schema)
            return
        if is_shared(schema, self.source):
            self.flush()
            read = self.source.bind(self.codec.of(schema).reader_of_one, "one")
            var, known = self.var, self.cursor.known
            self.source.line(f"{target}, {var} = {read}(b, {self.cursor.at()})")
            self.cursor.move(var, layout.after_schema(known, self.wire, schema))
            self.unproved = True
            return
        cls = self.source.bind(self.codec.of(schema).cls, "C")
        if target.isidentifier():
            self.source.line(f"{target} = {cls}()")
            self.fields(schema, target)
        else:
            name = self.source.fresh("t")
            self.source.line(f"{target} = {name} = {cls}()")
            self.fields(schema, name)

    def text(self, member: Member, target: str) -> None:
        """Decode one string."""
        self.number("n", "I", 4)
        self.flush()
        var, line = self.var, self.source.line
        start = self.cursor.at()
        known = self.cursor.known.many(self.wire.wide if member.wide else 1)
        if member.wide:
            line(f"s = {start}")
            line(f"{var} = s + n * {self.wire.wide}")
            wide = self.source.bind(read_wide, "wide")
            line(f"{target} = {wide}(b, s, {var}, {self.wire.wide}, {self.wire.big})")
            self.cursor.move(var, known)
        elif self.wire.aligned:
            last = self._other_var(var)
            line(f"{last} = {self.cursor.at(-1)} + n")
            line(f"{target} = {self._decoded(f'b[{start}:{last}]')}")
            # Reading the last byte is the bounds check, too. Some writers send no NUL.
            whole = self._decoded(f"b[{start}:{last} + 1]")
            line(f"if b[{last}]: {target} = {whole}")
            self.cursor.move(last, known, 1)
        else:
            last = self._other_var(var)
            line(f"{last} = {start} + n")
            line(f"{target} = {self._decoded(f'b[{start}:{last}]')}")
            self.cursor.move(last, known)
        self.unproved = not self.wire.aligned

    def _decoded(self, part: str) -> str:
        """Return the expression for the text in a part of the buffer."""
        how = '"utf-8", "surrogateescape"'
        return f"str({part}, {how})" if self.wire.view else f"{part}.decode({how})"

    def _other_var(self, var: str) -> str:
        """Return the other one of the two locals that hold the offset alternately."""
        return var[:-1] if var.endswith("_") else f"{var}_"

    def _numbers(self, member: Member, target: str, count: str) -> None:
        number = member.number
        assert number is not None
        start = self.elements_start(number.size, count)
        numpy = load_numpy()
        array = self.source.bind(numpy.ndarray, "array")
        dtype = self.source.bind(number_type(number.dtype, self.wire.order), number.dtype)
        view = f"{array}(({count},), {dtype}, b, {start})"
        self.source.line(f"{target} = {view} != 0" if number.code == "?" else f"{target} = {view}")
        self.pass_elements(number.size, number.size, number.size, count, start)
        self.unproved = False

    def _texts(self, member: Member, target: str, count: str) -> None:
        self.check_count(4, count)
        line = self.source.line
        items, add = self.source.fresh("a"), self.source.fresh("add")
        line(f"{target} = {items} = []")
        line(f"{add} = {items}.append")

        with self.text_loop(f"for _ in range({count}):", member):
            self.text(member, "v")
            line(f"{add}(v)")

    def _structs(self, member: Member, target: str, count: str, lazy: bool, last: bool) -> None:
        schema = member.struct
        assert schema is not None
        least = layout.min_size(schema, self.wire)
        self.check_count(least, count)
        codec = self.codec.of(schema)
        stride = layout.constant_stride(schema, self.wire)
        if not lazy:
            self._list(schema, target, count)
        elif stride is None and not last:
            # Skipping a few elements takes hardly less time than decoding them.
            before, var = self.cursor.copy(), self.var
            with self.source.block(f"if {count} <= {_FEW}:"):
                self._list(schema, target, count)
                self.settle(var)
            known = self.cursor.known
            self.cursor = before
            with self.source.block("else:"):
                self._sequence(codec, target, count, self.cursor.at())
                self.skip_elements(schema, count)
                self.settle(var)
            self.cursor.move(var, known)
            self.unproved = True
        elif stride is None:
            self._sequence(codec, target, count, self.cursor.at())
        else:
            start = self.elements_start(self.first_align(schema), count)
            self._sequence(codec, target, count, start)
            self.pass_stride(schema, stride, count, start)

    def _sequence(self, codec: EmittedCodec, target: str, count: str, start: str) -> None:
        """Create a lazy array."""
        name, cls = self.source.fresh("q"), self.source.bind(codec.sequence, "S")
        self.source.line(f"{target} = {name} = {cls}()")
        self.source.line(f"{name}._items = None")
        self.source.line(f"{name}._buffer = b")
        self.source.line(f"{name}._start = {start}")
        self.source.line(f"{name}._count = {count}")

    def _list(self, schema: Schema, target: str, count: str) -> None:
        """Decode elements into a list."""
        known = self.cursor.known if self.wire.aligned else layout.ANYWHERE
        many = self.source.bind(self.codec.of(schema).reader_of_many(known), "many")
        var = self.var
        self.source.line(f"{target}, {var} = {many}(b, {self.cursor.at()}, {count})")
        self.cursor.move(
            var, known.repeated(lambda known: layout.after_schema(known, self.wire, schema))
        )
        self.unproved = True

    def many(self, schema: Schema, count: str) -> None:
        """Decode elements into a list called ``out``."""
        cls = self.source.bind(self.codec.of(schema).cls, "C")
        line = self.source.line
        if not layout.min_size(schema, self.wire):
            # Messages without content are all alike: share one.
            line(f"m = {cls}()")
            self.fields(schema, "m")
            line(f"out = [m] * {count}")
            return
        line("out = []")
        line("add = out.append")
        stride = layout.constant_stride(schema, self.wire)
        together = stride is not None and stride[0] == stride[1] and layout.all_numbers(schema)
        if stride is not None and together and not is_shared(schema, self.source):
            self._records(schema, stride[0], count, cls)
            return
        with self.schema_loop(f"for _ in range({count}):", schema):
            line(f"m = {cls}()")
            self.fields(schema, "m")
            self.flush()
            line("add(m)")

    def _records(self, schema: Schema, size: int, count: str, cls: str) -> None:
        """Decode messages of only numbers, without gaps between them, in one pass."""
        start = self.elements_start(self.first_align(schema), count)
        if start != "o":
            self.source.line(f"o = {start}")
        known = layout.after_elements(self.cursor.known, self.first_align(schema), size, size)
        # Elements start on their largest alignment, so any such position gives their layout.
        self.cursor.move("o", layout.START)
        body = Source()
        body.globals = self.source.globals
        body.names = self.source.names
        sweep = Reader(self.codec, body, self.cursor.copy())
        sweep.fields(schema, "m")
        fields = [(f"v{i}", target) for i, (target, _, _) in enumerate(sweep.run) if target]
        taken, layouts = sweep.plan_run()
        assert taken == len(sweep.run)
        each = self.source.bind(iterator(layouts[0][0]), "each")
        line = self.source.line
        line(f"end = o + {count} * {size}")
        names = ", ".join(name for name, _ in fields)
        with self.source.block(f"for {names}, in {each}(b[o:end]):"):
            line(f"m = {cls}()")
            for text in body.lines:
                line(text.strip())
            for name, target in fields:
                line(f"{target} = {name}")
            line("add(m)")
        line("o = end")
        self.cursor.move("o", known)
        self.unproved = True


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
        other: Called with buffers of another type, or whose CDR header has another byte order, than
            this codec.
        failed: Called with the buffer and the error after any error.

    Raises:
        FieldPathError: A path does not exist in the type.
    """
    targets = [(f"r{i}", resolve_path(codec.schema, path), path) for i, path in enumerate(paths)]
    source = Source()
    with source.block("try:"):
        if not all(_is_value(route) for _, route, _ in targets):
            # What is returned keeps the buffer, and is made for its type.
            kind = source.bind(memoryview if codec.wire.view else bytes, "kind")
            source.line(f"if type(b) is not {kind}: return {source.bind(other, 'other')}(b)")
        if not _constant_offsets(codec, source, targets, other):
            if codec.wire.aligned:
                different = source.bind(other, "other")
                expected = 0 if codec.wire.big else 1
                source.line(f"if b[1] != {expected} or b[0]: return {different}(b)")
            reader = Reader(codec, source, Cursor(codec.wire, "", codec.wire.origin, START))
            _Walk(codec, source).schema(reader, codec.schema, targets, last=True)
        results = ", ".join(name for name, _, _ in targets)
        source.line(f"return {results}" if single else f"return ({results},)")
    with source.block("except Exception as error:"):  # of a peer's bytes; explained
        source.line(f"return {source.bind(failed, 'failed')}(b, error)")
    title = f"path {', '.join(paths)} {codec.schema.name} {codec.wire.title}"
    made: Callable[[bytes], Any] = source.compile("path(b)", title)
    return made


def _is_value(route: Route) -> bool:
    """Return whether a path leads to one number or text."""
    member = route[-1][0]
    return member.struct is None and all(
        not step.is_array or isinstance(index, int) for step, index in route
    )


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
