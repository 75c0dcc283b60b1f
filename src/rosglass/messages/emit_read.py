"""Generates code that decodes bytes into messages."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from rosglass.messages import layout
from rosglass.messages.emit_skip import Skipper, is_shared
from rosglass.messages.runtime import number_type, read_wide
from rosglass.messages.schema import Kind
from rosglass.messages.source import Source, iterator

if TYPE_CHECKING:
    from rosglass.messages.codec import Codec
    from rosglass.messages.schema import Member, Schema

__all__ = ["Reader"]

#: Nested messages of up to this many values are filled with their parent, bigger ones on demand.
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
        """Read what stands for a message without fields."""
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
            # The look at the last byte is the bounds check, too. Some writers send no NUL.
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
        """Return the other of the two locals that take turns in holding the offset."""
        return var[:-1] if var.endswith("_") else f"{var}_"

    def _numbers(self, member: Member, target: str, count: str) -> None:
        number = member.number
        assert number is not None
        start = self.elements_start(number.size, count)
        numpy = import_module("numpy")
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
            # To get past a few elements takes hardly less than to decode them.
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

    def _sequence(self, codec: Codec, target: str, count: str, start: str) -> None:
        """Make a lazy array."""
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
            # Without anything in them, one is as good as another.
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
        """Decode messages of nothing but numbers, without a gap between them, in one sweep."""
        start = self.elements_start(self.first_align(schema), count)
        if start != "o":
            self.source.line(f"o = {start}")
        known = layout.after_elements(self.cursor.known, self.first_align(schema), size, size)
        # Elements start on their largest alignment, so any such position will do to lay them out.
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
