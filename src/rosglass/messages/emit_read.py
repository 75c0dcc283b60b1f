"""Generates code that steps through bytes: the common part of decoding and of field paths.

Read :meth:`Skipper.skip_member` as the specification of both formats: numbers are collected into
runs that one :mod:`struct` call unpacks, strings are a count and that many bytes (CDR counts and
sends a final NUL), sequences are a count and their elements.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.messages import layout
from rosglass.messages.layout import Cursor, Knowledge
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

    from rosglass.messages.message import Message
    from rosglass.messages.schema import Member, Schema
    from rosglass.messages.sequences import MessageSequence

__all__ = ["EmittedCodec", "Reader", "Skipper", "is_shared"]


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
