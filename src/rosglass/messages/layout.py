"""The wire layout of schemas: sizes, alignment, and what is known about offsets in advance.

CDR (XCDR1, OMG DDSI-RTPS 2.3 section 10 and CORBA 3.0 section 15.3) aligns every primitive to its
own size, counted from the byte after the 4-byte encapsulation header. ROS 1 does not align.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd
from typing import TYPE_CHECKING

from rosglass.interfaces.definition import ArrayKind
from rosglass.messages.schema import Kind, Member, Schema

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages.source import Source

__all__ = ["Cursor", "Knowledge", "Wire", "constant_stride", "leaves", "min_size", "span"]


@dataclass(frozen=True, slots=True)
class Wire:
    """A wire format.

    Attributes:
        name: ``cdr`` or ``ros1``.
        big: Whether numbers are big endian.
        wide: Bytes for each UTF-16 unit of a ``wstring``: 4, as in ROS 2's nodes, or 2.
        view: Whether the bytes are in a memoryview; slices of bytes can be decoded directly, which
            is faster.
    """

    name: str
    big: bool = False
    wide: int = 4
    view: bool = False

    @property
    def aligned(self) -> bool:
        """True if primitives are aligned to their size."""
        return self.name == "cdr"

    @property
    def origin(self) -> int:
        """Offset of the first field."""
        return 4 if self.name == "cdr" else 0

    @property
    def order(self) -> str:
        """The byte order as :mod:`struct` and numpy write it."""
        return ">" if self.big else "<"

    @property
    def title(self) -> str:
        """Its name in error texts."""
        return f"{self.name}{' big endian' * self.big}{' view' * self.view}"


def align_of(member: Member, wire: Wire) -> int:
    """Return the alignment of the member's first byte (a schema's is that of its first member)."""
    if not wire.aligned:
        return 1
    if member.kind is Kind.TEXT or (member.is_array and member.fixed_count is None):
        return 4
    if member.number is not None:
        return member.number.size
    assert member.struct is not None
    inner = member.struct.members
    return align_of(inner[0], wire) if inner else 1


def _max_align(schema: Schema, wire: Wire) -> int:
    if not wire.aligned:
        return 1
    largest: int = schema.cached("largest alignment", lambda: _largest_align(schema, wire))
    return largest


def _largest_align(schema: Schema, wire: Wire) -> int:
    found = 1
    for member in schema.members:
        if member.kind is Kind.STRUCT:
            assert member.struct is not None
            found = max(found, _max_align(member.struct, wire))
        elif member.number is not None:
            found = max(found, member.number.size)
    return found


def span(schema: Schema, wire: Wire, position: int) -> int | None:
    """Return the position after a schema that starts at `position`, None if its size varies.

    Positions count from the origin; leading padding belongs to the schema.
    """
    start = position % 8
    end: int | None = schema.cached(
        ("span", wire.aligned, start), lambda: _span(schema, wire, start)
    )
    return None if end is None else position - start + end


def _span(schema: Schema, wire: Wire, position: int) -> int | None:
    if not schema.members:
        return position + (1 if wire.aligned else 0)
    for member in schema.members:
        end = member_span(member, wire, position)
        if end is None:
            return None
        position = end
    return position


def member_span(member: Member, wire: Wire, position: int) -> int | None:
    """Return the position after a field that starts at `position`, None if its size varies."""
    if member.kind is Kind.TEXT or (member.is_array and member.fixed_count is None):
        return None
    count = 1 if member.fixed_count is None else member.fixed_count
    if member.number is not None:
        size = member.number.size
        return position + (-position % size if wire.aligned else 0) + size * count
    assert member.struct is not None
    # An element's size depends on its start modulo 8: soon the sizes repeat.
    before: dict[int, tuple[int, int]] = {}
    left = count
    while left:
        start = position % 8
        if start in before:
            then, place = before[start]
            rounds, left = divmod(left, then - left)
            position += rounds * (position - place)
            before.clear()
            continue
        before[start] = left, position
        end = span(member.struct, wire, position)
        if end is None:
            return None
        position, left = end, left - 1
    return position


def constant_stride(schema: Schema, wire: Wire) -> tuple[int, int] | None:
    """Return (stride, size) of the elements of an array of `schema`, None if they vary.

    With alignment, the stride is constant only if the first member needs the largest alignment of
    all, so that every element starts on it; there is no padding after the last element.
    """
    size = span(schema, wire, 0)
    if size is None:
        return None
    largest = _max_align(schema, wire)
    if schema.members and align_of(schema.members[0], wire) != largest:
        return None
    return size + -size % largest, size


def min_size(schema: Schema, wire: Wire) -> int:
    """Return the smallest size of a value in bytes, without padding."""
    total: int = schema.cached(("min", wire.aligned, wire.wide), lambda: _min_size(schema, wire))
    return total


def _min_size(schema: Schema, wire: Wire) -> int:
    if not schema.members:
        return 1 if wire.aligned else 0
    total = 0
    for member in schema.members:
        if member.is_array and member.fixed_count is None:
            total += 4
            continue
        total += element_size(member, wire) * (
            1 if member.fixed_count is None else member.fixed_count
        )
    return total


def element_size(member: Member, wire: Wire) -> int:
    """Return the smallest size of an element of the member in bytes."""
    if member.kind is Kind.TEXT:
        return 4
    if member.number is not None:
        return member.number.size
    assert member.struct is not None
    return min_size(member.struct, wire)


#: Number of values that an array of messages counts as in :func:`leaves`.
MANY = 1000


def leaves(schema: Schema) -> int:
    """Return how many values the schema holds; arrays of messages count as very many."""
    total: int = schema.cached("leaves", lambda: _leaves(schema))
    return total


def _leaves(schema: Schema) -> int:
    total = 0
    for member in schema.members:
        if member.struct is None:
            total += 1
        elif member.array is ArrayKind.NONE:
            total += leaves(member.struct)
        else:
            total += MANY
    return total


def all_numbers(schema: Schema) -> bool:
    """Return whether a message holds at least one number, no string and no array at any depth."""
    found: bool = schema.cached("all numbers", lambda: _all_numbers(schema))
    return found


def _all_numbers(schema: Schema) -> bool:
    return bool(schema.members) and all(
        not member.is_array
        and (
            member.number is not None or (member.struct is not None and all_numbers(member.struct))
        )
        for member in schema.members
    )


@dataclass(frozen=True, slots=True)
class Knowledge:
    """A position as far as it is known when code is generated: `residue` modulo `modulus`."""

    modulus: int = 1
    residue: int = 0

    def after(self, size: int) -> Knowledge:
        """Return the position `size` bytes later."""
        return Knowledge(self.modulus, (self.residue + size) % self.modulus)

    def to(self, align: int) -> Knowledge:
        """Return the position after padding to a multiple of `align`."""
        if self.modulus >= align:
            return self.after(-self.residue % align)
        return Knowledge(align, 0)

    def repeated(self, step: Callable[[Knowledge], Knowledge]) -> Knowledge:
        """Return the position that holds before and after every iteration of a loop over `step`."""
        known = self
        while (both := known.meet(step(known))) != known:
            known = both
        return known

    def meet(self, other: Knowledge) -> Knowledge:
        """Return the position that holds in both cases."""
        modulus = gcd(self.modulus, other.modulus, abs(self.residue - other.residue) or 8)
        return Knowledge(modulus, self.residue % modulus)

    def many(self, size: int) -> Knowledge:
        """Return the position after an unknown number of steps of `size` bytes."""
        modulus = gcd(self.modulus, size or 8)
        return Knowledge(modulus, self.residue % modulus)


ANYWHERE = Knowledge()
START = Knowledge(8, 0)


def after_text(known: Knowledge, wire: Wire, wide: bool) -> Knowledge:
    """Return the position after a string."""
    return known.to(4).after(4).many(wire.wide if wide else 1)


def after_elements(known: Knowledge, align: int, step: int, size: int) -> Knowledge:
    """Return the position after any number of elements, without padding after the last."""
    return known.meet(known.to(align).many(step).after(size))


def after_schema(known: Knowledge, wire: Wire, schema: Schema) -> Knowledge:
    """Return the position after a message."""
    if not wire.aligned:
        return ANYWHERE
    after: Knowledge = schema.cached(
        ("after", wire.wide, known), lambda: _after_schema(known, wire, schema)
    )
    return after


def _after_schema(known: Knowledge, wire: Wire, schema: Schema) -> Knowledge:
    if not schema.members:
        return known.after(1)
    for member in schema.members:
        known = after_member(known, wire, member)
    return known


def after_member(known: Knowledge, wire: Wire, member: Member) -> Knowledge:
    """Return the position after a field."""

    def one(known: Knowledge) -> Knowledge:
        if member.kind is Kind.TEXT:
            return after_text(known, wire, member.wide)
        if member.number is not None:
            return known.to(member.number.size).after(member.number.size)
        assert member.struct is not None
        return after_schema(known, wire, member.struct)

    if not wire.aligned:
        return ANYWHERE
    if not member.is_array:
        return one(known)
    if member.fixed_count is not None:
        if member.number is not None:
            size = member.number.size
            return known.to(size).after(size * member.fixed_count)
        return known.repeated(one)
    return known.to(4).after(4).repeated(one)


class Cursor:
    """An offset in generated code: a known distance from a variable, or from zero."""

    def __init__(self, wire: Wire, var: str, delta: int, known: Knowledge) -> None:
        self.wire, self.var, self.delta, self.known = wire, var, delta, known
        # Positions count from the origin of alignment, offsets from the start of the buffer.
        self.shift = wire.origin

    def copy(self) -> Cursor:
        """Return an independent cursor at the same position."""
        twin = Cursor(self.wire, self.var, self.delta, self.known)
        twin.shift = self.shift
        return twin

    def at(self, extra: int = 0) -> str:
        """Return the expression for the offset, `extra` bytes further."""
        delta = self.delta + extra
        if not self.var:
            return str(delta)
        return f"{self.var} {'+' if delta > 0 else '-'} {abs(delta)}" if delta else self.var

    def advance(self, size: int) -> None:
        """Move on by a known number of bytes."""
        self.delta += size
        self.known = self.known.after(size)

    def move(self, var: str, known: Knowledge, delta: int = 0) -> None:
        """Move to `delta` bytes after the variable `var`, of which `known` is known."""
        self.var, self.delta, self.known = var, delta, known

    def padding(self, align: int) -> int | None:
        """Return the number of padding bytes before `align`, None if only known at run time."""
        if not self.wire.aligned or align == 1:
            return 0
        if self.known.modulus < align:
            return None
        return -self.known.residue % align

    def aligned(self, align: int) -> str:
        """Return the expression for the offset rounded up to `align`."""
        pad = self.padding(align)
        if pad is not None:
            return self.at(pad)
        origin = self.shift % align
        text = f"({self.at(align - 1 - origin)} & -{align})"
        return f"{text} + {origin}" if origin else text

    def align(self, source: Source, align: int, var: str = "o") -> None:
        """Move to the next multiple of `align`, with a line of code if needed."""
        pad = self.padding(align)
        if pad is None:
            before = source.take_last(f"{self.var} = ") if self.var == var else None
            # Merge with the previous sum, if nothing else uses that.
            at = self.copy()
            if before is not None:
                at.var, _, constant = before.rpartition(" + ")
                if not (at.var and constant.isdigit()):
                    at.var, constant = before, "0"
                at.delta += int(constant)
            source.line(f"{var} = {at.aligned(align)}")
            self.move(var, Knowledge(align, 0))
        elif pad:
            self.advance(pad)
