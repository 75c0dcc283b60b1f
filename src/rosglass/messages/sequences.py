"""Arrays of messages: lists that decode their elements when they are used."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, MutableSequence
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, overload

from rosglass.errors import UnsupportedError
from rosglass.messages import layout
from rosglass.messages.schema import Kind
from rosglass.messages.source import load_numpy

if TYPE_CHECKING:
    import numpy as np

    from rosglass.messages.layout import Wire
    from rosglass.messages.message import Message
    from rosglass.messages.schema import Schema

__all__ = ["ElementCodec", "MessageSequence", "read_columns", "record_type", "same_bytes"]


class ElementCodec(Protocol):
    """Decodes the elements of an array; a :class:`~rosglass.messages.codec.Codec`."""

    schema: Schema
    wire: Wire
    stride: tuple[int, int] | None

    def read_many(self, buffer: bytes | memoryview, offset: int, count: int) -> list[Message]:
        """Decode `count` elements from `offset` on."""

    def element(self, buffer: bytes | memoryview, offset: int) -> Message:
        """Return the shell of an element."""

    def skip(self, buffer: bytes | memoryview, offset: int) -> int:
        """Return the offset after the element at `offset`."""


class MessageSequence(MutableSequence["Message"]):
    """The elements of an array field, as received; behaves as a list.

    Access by index finds and decodes that element alone (directly if all have the same size);
    iterating and changing the sequence decodes them all.
    """

    __slots__ = ("_buffer", "_count", "_items", "_offsets", "_start")
    _codec: ClassVar[ElementCodec]
    #: All elements; until they are decoded, those accessed by index, or None.
    _items: list[Message] | dict[int, Message] | None
    _buffer: bytes | memoryview
    _start: int
    _count: int

    def _all(self) -> list[Message]:
        with self._codec.schema.lock:
            items = self._items
            if items.__class__ is list:
                return items
            found = self._codec.read_many(self._buffer, self._start, self._count)
            if items:
                for index, element in items.items():  # type: ignore[union-attr]
                    found[index] = element
            self._items = found
            self._buffer = b""
            return found

    def _one(self, index: int) -> Message:
        with self._codec.schema.lock:
            items = self._items
            if items is None:
                items = self._items = {}
                self._offsets = [self._start]
            elif index in items or items.__class__ is list:
                return items[index]
            element = items[index] = self._codec.element(self._buffer, self._offset(index))
            return element

    def _offset(self, index: int) -> int:
        codec, offsets = self._codec, self._offsets
        if codec.stride is not None:
            return self._start + index * codec.stride[0]
        while len(offsets) <= index:
            offsets.append(codec.skip(self._buffer, offsets[-1]))
        return offsets[index]

    def __len__(self) -> int:
        items = self._items
        return len(items) if items.__class__ is list else self._count

    @overload
    def __getitem__(self, index: int) -> Message: ...
    @overload
    def __getitem__(self, index: slice) -> list[Message]: ...
    def __getitem__(self, index: int | slice) -> Message | list[Message]:
        items = self._items
        if items.__class__ is list:
            return items[index]
        if isinstance(index, slice):
            return self._all()[index]
        place = index + self._count if index < 0 else index
        if not 0 <= place < self._count:
            raise IndexError(f"index {index} of an array of {self._count} messages")
        return self._one(place)

    def __setitem__(self, index: Any, value: Any) -> None:
        self._all()[index] = value

    def __delitem__(self, index: Any) -> None:
        del self._all()[index]

    def insert(self, index: int, value: Message) -> None:
        """Insert `value` before `index`."""
        self._all().insert(index, value)

    def __iter__(self) -> Iterator[Message]:
        items = self._items
        return iter(items if items.__class__ is list else self._all())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, (MessageSequence, list, tuple)):
            return NotImplemented
        return self._all() == list(other)

    __hash__ = None  # type: ignore[assignment]

    def __add__(self, other: Iterable[Message]) -> list[Message]:
        return [*self._all(), *other]

    def __repr__(self) -> str:
        return repr(self._all())

    def __reduce__(self) -> tuple[Any, ...]:
        return list, (list(self._all()),)

    @property
    def array(self) -> np.ndarray:
        """All elements as one structured numpy array, without decoding them one by one.

        Raises:
            UnsupportedError: The elements hold strings or sequences, or vary in size.
        """
        codec = self._codec
        dtype = record_type(codec.schema, codec.wire)
        if dtype is None or codec.stride is None:
            raise UnsupportedError(f"{codec.schema.name}: its elements are not of constant size")
        numpy = load_numpy()
        with codec.schema.lock:
            if self._items is None:
                made = numpy.ndarray(
                    (self._count,), dtype, self._buffer, self._start, codec.stride[:1]
                )
            else:
                made = numpy.array([_row(item) for item in self._all()], dtype)
        return made  # type: ignore[no-any-return]


def same_bytes(value: Any, schema: Schema, size: int, big: bool) -> memoryview | None:
    """Return the received bytes of untouched elements, if they can be written unchanged.

    Args:
        value: The array.
        schema: Expected schema of its elements.
        size: Bytes of each, without gaps.
        big: Whether they are big endian.
    """
    if not isinstance(value, MessageSequence) or value._items is not None:
        return None
    codec = value._codec
    if codec.schema is not schema or codec.stride != (size, size) or codec.wire.big != big:
        return None
    end = value._start + value._count * size
    if end > len(value._buffer):
        return None  # decoding reports the error
    return memoryview(value._buffer)[value._start : end]


def _row(message: Message) -> tuple[Any, ...]:
    return tuple(
        _row(value) if member.kind is Kind.STRUCT and not member.is_array else value
        for member in message._schema__.members
        for value in (getattr(message, member.attr),)
    )


def read_columns(elements: MessageSequence, *paths: str) -> np.ndarray:
    """Return fields of all elements as numbers, (elements, fields), without decoding them.

    Args:
        elements: The elements, of constant size.
        paths: Paths of the fields, e.g. ``position.x``.
    """
    rows = elements.array
    out: np.ndarray = load_numpy().empty((len(rows), len(paths)))
    for number, path in enumerate(paths):
        column = rows
        for name in path.split("."):
            column = column[name]
        out[:, number] = column
    return out


def record_type(schema: Schema, wire: Wire) -> np.dtype | None:
    """Return the structured numpy type of a schema of constant layout, None if it has none."""
    return _record_at(schema, wire, 0)


def _record_at(schema: Schema, wire: Wire, position: int) -> np.dtype | None:
    """Return the structured numpy type of a schema that starts at a position."""
    start = position % 8 if wire.aligned else 0
    found: np.dtype | None = schema.cached(
        ("record", wire.aligned, wire.big, start), lambda: _record_type(schema, wire, start)
    )
    return found


def _record_type(schema: Schema, wire: Wire, start: int) -> np.dtype | None:
    numpy = load_numpy()
    names, formats, offsets, position = [], [], [], start
    for member in schema.members:
        count = 1 if member.fixed_count is None else member.fixed_count
        if member.kind is Kind.TEXT or (member.is_array and member.fixed_count is None):
            return None
        inner: Any
        if member.number is not None:
            size = member.number.size
            position += -position % size if wire.aligned else 0
            inner, end = wire.order + member.number.dtype, position + size * count
            if member.number.code == "?":
                inner = "?"
        else:
            assert member.struct is not None
            if member.is_array:
                return None
            after = layout.span(member.struct, wire, position)
            inner = _record_at(member.struct, wire, position)
            if after is None or inner is None:
                return None
            end = after
        names.append(member.name)
        formats.append((inner, (count,)) if member.is_array else inner)
        offsets.append(position - start)
        position = end
    dtype: np.dtype = numpy.dtype(
        {"names": names, "formats": formats, "offsets": offsets, "itemsize": position - start}
    )
    return dtype
