"""Generates code that writes bytes, from messages or directly from nested dicts.

The code assumes valid values, checks just enough to detect others, and leaves those (missing
fields, convertible values, errors) to :mod:`.conversion`. Numbers are collected into runs that one
:mod:`struct` call packs; padding and the NUL of a preceding string are part of the next run. After
a string, CDR's padding depends on its length: the run then has prepared layouts, one for each
position modulo its largest alignment.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rosglass.messages import layout
from rosglass.messages.emit_read import is_shared
from rosglass.messages.layout import ANYWHERE, START, Cursor, Knowledge
from rosglass.messages.schema import Kind
from rosglass.messages.sequences import same_bytes
from rosglass.messages.source import MAX_EMPTY, Source, as_list, odd, own, packer, write_wide
from rosglass.messages.values import array_packer, as_bool, as_float, as_int

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.messages.emit_read import EmittedCodec
    from rosglass.messages.schema import Member, Schema

__all__ = ["Writer"]

_ZEROS = tuple(bytes(count) for count in range(17))
_CHECKS = {bool: as_bool, int: as_int, float: as_float}


class Writer:
    """Emits the writing of a message.

    Attributes:
        source: Receives the code.
        from_dict: Whether values come from nested dicts instead of messages.
        joined: Whether the parts are joined in the end.
        lenient: Whether strings may hold bytes that are not UTF-8, as surrogates.
    """

    def __init__(
        self, codec: EmittedCodec, source: Source, from_dict: bool, joined: bool, lenient: bool
    ) -> None:
        self.codec, self.wire, self.source = codec, codec.wire, source
        self.from_dict, self.joined, self.lenient = from_dict, joined, lenient
        # Positions in the body; the header is written with the first run.
        self.cursor = Cursor(self.wire, "", 0, START)
        self.cursor.shift = 0
        self._run: list[tuple[str, str, int]] = []
        #: Locals in the run whose type was not checked yet, by the type they should have.
        self._unchecked: dict[type, list[str]] = {bool: [], int: [], float: []}
        #: Zero bytes still to be written before the next run; already counted in the position.
        self._pending = 0
        self._header = bytes((0, 0 if self.wire.big else 1, 0, 0)) if self.wire.aligned else b""
        #: Locals holding the parts so far; None once there is a list called ``parts``.
        self._parts: list[str] | None = []
        #: Whether nested messages are written here, whatever their size.
        self._inline = False

    def join(self) -> None:
        """Append to the parts of another function: ``add`` adds one, ``o`` is the position."""
        self.cursor.move("o", ANYWHERE)
        self._header, self._parts = b"", None

    def leave(self) -> None:
        """Emit the end of a function with :meth:`join`: it returns the position."""
        self._zeros()
        self.source.line(f"return {self.cursor.at()}")

    # -- output ----------------------------------------------------------------------------------

    def _part(self, expression: str) -> None:
        if self._parts is None:
            self.source.line(f"add({expression})")
            return
        if not expression.isidentifier():
            name = self.source.fresh("p")
            self.source.line(f"{name} = {expression}")
            expression = name
        self._parts.append(expression)

    def _open_list(self) -> None:
        if self._parts is not None:
            self.source.line(f"parts = [{', '.join(self._parts)}]")
            self.source.line("add = parts.append")
            self._parts = None

    def _flush(self) -> None:
        """Pack the numbers collected so far."""
        run, self._run = self._run, []
        if not run:
            return
        largest = max(size for _, _, size in run) if self.wire.aligned else 1
        values = ", ".join(value for value, _, _ in run)
        self._check_types()
        known = self.cursor.known
        if not self.wire.aligned or known.modulus >= largest:
            fmt, size = self._layout(run, known.residue)
            self._part(self._packed(fmt, values))
            self.cursor.advance(size)
            return
        layouts = [self._layout(run, start) for start in range(largest)]
        table = self.source.bind(tuple(packer(fmt) for fmt, _ in layouts), "packs")
        place = self.cursor.at()
        self._part(f"{table}[{place} & {largest - 1}]({values})")
        if run[0][2] == largest:
            # Pad only before the first number, up to its alignment.
            end = f"({self.cursor.aligned(largest)}) + {layouts[0][1]}"
        else:
            sizes = self.source.bind(tuple(size for _, size in layouts), "sizes")
            end = f"{place} + {sizes}[{place} & {largest - 1}]"
        self.source.line(f"o = {end}")
        self.cursor.move("o", Knowledge(largest, layouts[0][1] % largest))
        self._pending = 0

    def _check_types(self) -> None:
        """Convert the numbers of the run that do not have exactly the expected type.

        The check itself is one chain of comparisons: conversion is the exception.
        """
        for kind, names in self._unchecked.items():
            if names:
                chain = " is ".join(f"{name}.__class__" for name in names)
                convert = self.source.bind(_CHECKS[kind], f"as_{kind.__name__}")
                with self.source.block(f"if not ({chain} is {kind.__name__}):"):
                    for name in names:
                        self.source.line(f"{name} = {convert}({name})")
                names.clear()

    def _packed(self, fmt: str, values: str) -> str:
        if self._header:
            header = self.source.bind(self._header, "header")
            fmt, values, self._header = f"{fmt[0]}4s{fmt[1:]}", f"{header}, {values}", b""
        self._pending = 0
        return f"{self.source.bind(packer(fmt), 'pack')}({values})"

    def _layout(self, run: list[tuple[str, str, int]], start: int) -> tuple[str, int]:
        fmt, position = [self.wire.order, "x" * self._pending], start
        for _, code, size in run:
            pad = -position % size if self.wire.aligned else 0
            fmt.append("x" * pad + code)
            position += pad + size
        return "".join(fmt), position - start

    def _zeros(self) -> None:
        """Write the pending zero bytes now."""
        self._flush()
        if self._header:
            self._part(repr(self._header + bytes(self._pending)))
            self._header, self._pending = b"", 0
        while self._pending:
            count = min(self._pending, 16)
            self._part(repr(bytes(count)))
            self._pending -= count

    def _pad(self, align: int, count: str) -> None:
        """Write the padding before the first of `count` elements."""
        pad = self.cursor.padding(align)
        if pad == 0 or count == "0":
            return
        if pad is not None and count.isdigit():
            self._pending += pad
            self.cursor.advance(pad)
            return
        self._zeros()
        zeros = self.source.bind(_ZEROS, "zeros")
        if count.isdigit():
            amount = f"-({self.cursor.at()}) & {align - 1}"
        else:
            amount = f"-({self.cursor.at()}) & {align - 1} if {count} else 0"
        self.source.line(f"k = {amount}")
        self._part(f"{zeros}[k]")
        self.source.line(f"o = {self.cursor.at()} + k")
        known = Knowledge(align, 0)
        if not count.isdigit():
            known = self.cursor.known.meet(known)
        self.cursor.move("o", known)

    def finish(self) -> None:
        """Emit the end of the function: the bytes, or the list of parts."""
        self._zeros()
        self.source.take_last("o = ")  # nothing that follows needs the position
        if not self.joined:
            parts = "parts" if self._parts is None else f"[{', '.join(self._parts)}]"
            self.source.line(f"return {parts}")
        elif self._parts is None:
            self.source.line('return b"".join(parts)')
        elif len(self._parts) == 1 and not self._parts[0].startswith("a"):
            self.source.line(f"return {self._parts[0]}")
        else:
            items = "".join(f"{part}, " for part in self._parts)
            self.source.line(f'return b"".join(({items}))')

    # -- values ----------------------------------------------------------------------------------

    def fields(self, schema: Schema, holder: str) -> None:
        """Write the fields of the message or dict in the local called `holder`."""
        if not schema.members and self.wire.aligned:
            self._run.append(("0", "B", 1))
        for member in schema.members:
            value = f"{holder}[{member.name!r}]" if self.from_dict else f"{holder}.{member.attr}"
            self._member(member, value)

    def check_holder(self, schema: Schema, holder: str) -> None:
        """Emit the check that a local is a complete dict, or a message of the schema."""
        if self.from_dict:
            strange = self.source.bind(odd, "odd")
            count = len(schema.members)
            # With the right number of fields, an unknown or missing one is detected below; without
            # fields, anything empty would pass.
            empty = f"type({holder}) is dict and not {holder}"
            right = f"len({holder}) == {count}" if count else empty
            self.source.line(f"if not ({right}): {strange}()")
        else:
            cls = self.source.bind(self.codec.of(schema).cls, "C")
            mine = self.source.bind(own, "own")
            self.source.line(f"if type({holder}) is not {cls}: {mine}({holder}, {cls})")

    def _member(self, member: Member, value: str) -> None:
        if not member.is_array:
            self._element(member, value)
        elif member.number is not None:
            self._numbers(member, value)
        else:
            self._elements(member, value)

    def _element(self, member: Member, value: str) -> None:
        line = self.source.line
        if member.number is not None:
            name, number = self.source.fresh("v"), member.number
            line(f"{name} = {value}")
            self._unchecked[number.python].append(name)
            self._run.append((name, number.code, number.size))
        elif member.kind is Kind.TEXT:
            self._text(member, value)
        else:
            assert member.struct is not None
            self._struct(member.struct, value)

    def _struct(self, schema: Schema, value: str) -> None:
        if not self._inline and is_shared(schema, self.source):
            self._zeros()
            self._open_list()
            inner = self.codec.of(schema).nested_writer(self.from_dict, self.joined, self.lenient)
            write, end = self.source.bind(inner, "write_one"), self.source.fresh("o")
            self.source.line(f"{end} = {write}({value}, add, {self.cursor.at()})")
            if self.wire.aligned:
                known = layout.after_schema(self.cursor.known, self.wire, schema)
                self.cursor.move(end, known)
            return
        holder = value
        if not value.isidentifier():
            holder = self.source.fresh("d")
            self.source.line(f"{holder} = {value}")
        self.check_holder(schema, holder)
        self.fields(schema, holder)

    def _text(self, member: Member, value: str) -> None:
        line = self.source.line
        text, count = self.source.fresh("t"), self.source.fresh("n")
        limit = member.bound
        width = 1
        if member.wide:
            width = self.wire.wide
            wide = self.source.bind(write_wide, "wide")
            line(f"{text}, {count} = {wide}({value}, {width}, {self.wire.big})")
        else:
            # Strict is faster; what it refuses is left to the conversion.
            how = '"utf-8", "surrogateescape"' if self.lenient else ""
            line(f"{text} = {value}.encode({how})")
            line(f"{count} = len({text})" + (" + 1" if self.wire.aligned else ""))
            limit = None if limit is None else limit + (1 if self.wire.aligned else 0)
        if limit is not None:
            line(f"if {count} > {limit}: {self.source.bind(odd, 'odd')}()")
        self._run.append((count, "I", 4))
        self._flush()
        self._part(text)
        self._pending = 1 if self.wire.aligned and not member.wide else 0
        self._passed(f"{count} * {width}" if width > 1 else count, self.cursor.known.many(width))

    def _passed(self, size: str, known: Knowledge) -> None:
        if self.wire.aligned:
            self.source.line(f"o = {self.cursor.at()} + {size}")
            self.cursor.move("o", known)

    def _numbers(self, member: Member, value: str) -> None:
        number = member.number
        assert number is not None
        data, count = self.source.fresh("a"), self.source.fresh("n")
        pack = self.source.bind(array_packer(member, self.wire), "packed")
        self.source.line(f"{data}, {count} = {pack}({value})")
        if member.fixed_count is None:
            self._run.append((count, "I", 4))
        else:
            count = str(member.fixed_count)
        self._zeros()
        before = self.cursor.known
        self._pad(number.size, count)
        self._zeros()
        if self.joined:
            self._part(data)
        else:
            # Memory views of foreign byte order cannot be cast.
            view = f"bytes({data})" if self.wire.big else f'memoryview({data}).cast("B")'
            self._part(f'{view} if {count} else b""')
        if count.isdigit():
            self.cursor.advance(number.size * int(count))
        else:
            known = layout.after_elements(before, number.size, number.size, number.size)
            self._passed(f"{count} * {number.size}" if number.size > 1 else count, known)

    def _elements(self, member: Member, value: str) -> None:
        items, item = self.source.fresh("a"), self.source.fresh("e")
        line = self.source.line
        line(f"{items} = {value}")
        to_list = self.source.bind(as_list, "as_list")
        block = self._block(member, items)
        if block:
            line(f"if {block} is None and type({items}) is not list: {items} = {to_list}({items})")
        else:
            line(f"if type({items}) is not list: {items} = {to_list}({items})")
        count = str(member.fixed_count)
        strange = self.source.bind(odd, "odd")
        if member.fixed_count is not None:
            line(f"if len({items}) != {count}: {strange}()")
        else:
            count = self.source.fresh("n")
            line(f"{count} = len({items})")
            limit = member.size
            if member.struct is not None and not layout.min_size(member.struct, self.wire):
                limit = min(limit or MAX_EMPTY, MAX_EMPTY)
            if limit is not None:
                line(f"if {count} > {limit}: {strange}()")
            self._run.append((count, "I", 4))
        head = f"for {item} in {items}:"
        schema = member.struct
        if schema is None:
            with self._loop(head, lambda known: layout.after_text(known, self.wire, member.wide)):
                self._text(member, item)
            return
        stride = layout.constant_stride(schema, self.wire)
        simple = layout.leaves(schema) < layout.MANY and not is_shared(schema, self.source)
        if stride is not None and stride[0] == stride[1] and schema.members and simple:
            self._records(schema, stride[0], head, item, count, block)
            return
        with self._loop(head, lambda known: layout.after_schema(known, self.wire, schema)):
            self._struct(schema, item)

    def _block(self, member: Member, items: str) -> str:
        """Emit the search for elements whose bytes can be written as they are.

        Returns the local for them, which may hold None; empty if elements have gaps.
        """
        schema = member.struct
        stride = None if schema is None else layout.constant_stride(schema, self.wire)
        if schema is None or stride is None or not layout.all_numbers(schema):
            return ""
        size = layout.min_size(schema, self.wire)
        if stride != (size, size):
            return ""
        block, same = self.source.fresh("k"), self.source.bind(same_bytes, "same_bytes")
        kept = self.source.bind(schema, "schema")
        self.source.line(
            f"{block} = None if type({items}) is list else "
            f"{same}({items}, {kept}, {size}, {self.wire.big})"
        )
        return block

    def _records(
        self, schema: Schema, size: int, head: str, item: str, count: str, block: str
    ) -> None:
        """Write messages of one size, without gaps between them."""
        self._zeros()
        self._open_list()
        before = self.cursor.known
        align = layout.align_of(schema.members[0], self.wire)
        self._pad(align, count)
        self._zeros()
        after = self.cursor.copy()
        if block:
            items = head.removesuffix(":").rpartition(" ")[2]
            self.source.line(f"if {block} is not None: add({block})")
            head = f"for {item} in () if {block} is not None else {items}:"
        with self.source.block(head):
            self.check_holder(schema, item)
            self.cursor.known = Knowledge(align, 0) if self.wire.aligned else START
            outer, self._inline = self._inline, True
            self.fields(schema, item)
            self._inline = outer
            self._zeros()
        self.cursor = after
        if count.isdigit():
            self.cursor.advance(size * int(count))
        else:
            self._passed(f"{count} * {size}", layout.after_elements(before, align, size, size))

    @contextmanager
    def _loop(self, head: str, step: Callable[[Knowledge], Knowledge]) -> Iterator[None]:
        """Emit a loop; `step` returns what is known of the position after its body."""
        self._zeros()
        self._open_list()
        known = START
        if self.wire.aligned:
            known = self.cursor.known.repeated(step)
            self._settle(known)
        with self.source.block(head):
            yield
            self._zeros()
            if self.wire.aligned:
                self._settle(known)

    def _settle(self, known: Knowledge) -> None:
        if self.cursor.at() != "o":
            self.source.line(f"o = {self.cursor.at()}")
        self.cursor.move("o", known)


def nested_write_function(codec: EmittedCodec, from_dict: bool, joined: bool, lenient: bool) -> Any:
    """Return ``write(value, add, o) -> o``, which other write functions call.

    ``add`` takes the parts, ``o`` is the position in the message (0 on wires that do not align).
    """
    source = Source()
    writer = Writer(codec, source, from_dict, joined, lenient)
    writer.join()
    writer.check_holder(codec.schema, "m")
    writer.fields(codec.schema, "m")
    writer.leave()
    what = f"encode nested {'dict' if from_dict else 'message'}{'' if joined else ' parts'}"
    return source.compile("write(m, add, o)", f"{what} {codec.schema.name} {codec.wire.title}")


def write_function(
    codec: EmittedCodec,
    from_dict: bool,
    joined: bool,
    convert: Callable[[Any, Exception], Any] | None,
) -> Any:
    """Return ``write(value)``: the bytes of a message or dict, or their parts.

    Args:
        codec: The codec.
        from_dict: Whether it takes dicts, otherwise messages.
        joined: Whether it returns bytes, otherwise a list of buffers.
        convert: Called with the value and the error if the generated code fails; its result is
            returned. None for values that are converted already.
    """
    source = Source()
    writer = Writer(codec, source, from_dict, joined, lenient=convert is None)
    if convert is None:
        writer.fields(codec.schema, "m")
        writer.finish()
    else:
        with source.block("try:"):
            writer.check_holder(codec.schema, "m")
            writer.fields(codec.schema, "m")
            writer.finish()
        with source.block("except Exception as error:"):  # of a user's objects; converted slowly
            source.line(f"return {source.bind(convert, 'convert')}(m, error)")
    what = f"encode {'dict' if from_dict else 'message'}{'' if joined else ' parts'}"
    return source.compile("write(m)", f"{what} {codec.schema.name} {codec.wire.title}")
