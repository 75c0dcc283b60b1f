"""A message as a tree of items that are made when they are looked at."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConversionError
from rosglass.qml.to_js import is_duration

if TYPE_CHECKING:
    from rosglass.messages import Message
    from rosglass.messages.schema import Member, Schema

__all__ = ["TreeItem", "check_leaf", "default_element", "plain_tree"]

_numbers = itertools.count(1)
#: What the plugins call some primitives.
_NAMES = {"float32": "float", "float64": "double", "byte": "octet"}


def plain_tree(message: Message) -> dict[str, Any]:
    """Return a message as dicts, lists, numpy arrays and plain values."""
    return message.to_dict()


class TreeItem:
    """A message, an array, or a single value.

    Args:
        parent: The item it is in; None for the message itself.
        row: Its place there.
        schema: For messages, their type.
        member: The field it is, or is an element of; None for the message itself.
        value: For the message itself, its fields; others are in their parent's.

    Attributes:
        number: What tells it from all others, for as long as it exists.
        children: The items inside that were looked at, by row.
        is_element: Whether it is an element of an array.
        is_array: Whether it is an array.
        is_leaf: Whether it is a single value.
    """

    def __init__(
        self,
        parent: TreeItem | None,
        row: int,
        schema: Schema | None,
        member: Member | None,
        value: Any = None,
    ) -> None:
        self.parent, self.row, self.schema, self.member = parent, row, schema, member
        self.number = next(_numbers)
        self.children: dict[int, TreeItem] = {}
        self._own = value
        self.is_element: bool = parent is not None and parent.is_array
        self.is_array: bool = member is not None and member.is_array and not self.is_element
        self.is_leaf: bool = schema is None and not self.is_array

    @property
    def is_fixed(self) -> bool:
        """Whether it is an array whose length its type says."""
        return self.member is not None and self.member.fixed_count is not None

    @property
    def bound(self) -> int | None:
        """How many elements fit into it; None for no limit."""
        return self.member.size if self.member is not None else None

    @property
    def name(self) -> str | int:
        """Name of the field, or index of the element."""
        if self.is_element or self.member is None:
            return self.row
        return self.member.name

    @property
    def path(self) -> str:
        """Field path from the message's root."""
        if self.parent is None:
            return ""
        before = self.parent.path
        if self.is_element:
            return f"{before}[{self.row}]"
        return f"{before}.{self.name}" if before else str(self.name)

    @property
    def type_name(self) -> str:
        """What it is: compound, array, or a primitive."""
        if self.is_array:
            return "array"
        if self.schema is not None or self.member is None:
            return "compound"
        name = self.member.number.name if self.member.number is not None else ""
        return _NAMES.get(name, name) or ("wstring" if self.member.wide else "string")

    @property
    def value(self) -> Any:
        """Its value, as :func:`plain_tree` has it."""
        if self.parent is None:
            return self._own
        found = self.parent.value[self.name]
        if not self.is_leaf:
            return found
        if self.member is not None and self.member.number is not None:
            return self.member.number.python(found)
        return found

    @value.setter
    def value(self, value: Any) -> None:
        if self.parent is None:
            self._own = value
        else:
            self.parent.value[self.name] = value

    @property
    def count(self) -> int:
        """How many fields or elements it has."""
        if self.is_array:
            return len(self.value)
        return len(self.schema.members) if self.schema is not None else 0

    def child(self, row: int) -> TreeItem:
        """Return the field or element at a row."""
        found = self.children.get(row)
        if found is None:
            if self.is_array:
                member = self.member
                assert member is not None
                schema = member.struct
            else:
                assert self.schema is not None
                member = self.schema.members[row]
                schema = None if member.is_array else member.struct
            found = self.children[row] = TreeItem(self, row, schema, member)
        return found

    def set(self, value: Any) -> None:
        """Set a single value."""
        parent = self.parent
        assert parent is not None
        if parent.is_array:
            parent._own_list()
        parent.value[self.name] = value

    def insert(self, row: int, values: list[Any]) -> None:
        """Put elements into an array."""
        self._own_list()[row:row] = values
        self._move(row, len(values))

    def remove(self, row: int, count: int) -> list[TreeItem]:
        """Take elements out of an array; return the items that were looked at."""
        del self._own_list()[row : row + count]
        gone = [self.children.pop(at) for at in range(row, row + count) if at in self.children]
        self._move(row + count, -count)
        return gone

    def cut(self, count: int) -> list[TreeItem]:
        """Forget the items from a row on; return those that were looked at."""
        return [self.children.pop(row) for row in list(self.children) if row >= count]

    def _move(self, row: int, by: int) -> None:
        moved = {}
        for at, child in self.children.items():
            child.row = at + by if at >= row else at
            moved[child.row] = child
        self.children = moved

    def _own_list(self) -> list[Any]:
        """Return the elements as a list: those of a received message cannot be changed."""
        values: Any = self.value
        if isinstance(values, list):
            return values
        made: list[Any] = values.tolist()
        self.value = made
        return made


def default_element(item: TreeItem) -> Any:
    """Return a new element of an array."""
    member = item.member
    assert member is not None
    if member.struct is not None:
        return plain_tree(member.struct.type.create())
    return member.number.python() if member.number is not None else ""


def check_leaf(item: TreeItem, value: Any) -> Any:
    """Return a value as a field holds it.

    Raises:
        ConversionError: It does not fit.
    """
    member, parent = item.member, item.parent
    assert member is not None
    assert parent is not None
    owner = parent.parent if item.is_element else parent
    assert owner is not None
    assert owner.schema is not None
    is_seconds = owner.schema.is_time and not is_duration(owner.schema) and item.row == 0
    if is_seconds and isinstance(value, (int, float)) and value < 0:
        raise ConversionError(item.path, value, "seconds from 0 on")
    given = [value] * (member.fixed_count or 1) if item.is_element else value
    try:
        made = getattr(owner.schema.type.create({member.name: given}), member.attr)
    except ConversionError as error:
        raise ConversionError(item.path, error.value, error.expected) from None
    first = made[0] if item.is_element else made
    return first.item() if hasattr(first, "item") else first
