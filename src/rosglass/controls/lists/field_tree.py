"""The fields of a message as the visible rows of a tree, and texts for their values."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.controls.lists.row_model import RowModel
from rosglass.controls.lists.texts import bounded
from rosglass.errors import ConversionError
from rosglass.qml.elements.message_item_model import TreeItem, check_leaf
from rosglass.qml.engine.from_js import scalar_from_python

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rosglass.messages.schema import Schema
    from rosglass.qt import QtCore

__all__ = ["FieldRow", "FieldTree", "entered_value", "fits_line", "number_text", "value_text"]

#: Elements of an array that are shown below it; longer ones are divided into ranges.
_MAX_ELEMENTS = 100
#: Rows that may be unfolded at once, each with up to 100 rows below it.
MAX_OPEN = 100
#: Numbers of an array that its summary shows.
_FIRST = 4
#: Characters of a text that can be edited in a line.
_MAX_EDITED = 20_000
_FLOAT = struct.Struct("f")
_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


class FieldRow(NamedTuple):
    """A visible field, element, or range of elements.

    Attributes:
        item: The field or element; the array of a range.
        depth: Number of rows that it is below.
        span: First element of a range and the one behind its last; None for no range.
        open: Whether what is below it is shown.
    """

    item: TreeItem
    depth: int
    span: tuple[int, int] | None
    open: bool

    @property
    def key(self) -> str:
        """Field path, with the range: ``ranges[0:100]``."""
        return self.item.path if self.span is None else f"{self.item.path}[{self._range}]"

    @property
    def name(self) -> str:
        """Name of the field, index of the element, or the range."""
        if self.span is not None:
            return f"{self.span[0]:,} … {self.span[1] - 1:,}"
        return f"[{self.item.row}]" if self.item.is_element else str(self.item.name)

    @property
    def folds(self) -> bool:
        """True if there is something below it."""
        return not self.item.is_leaf and self.item.count > 0

    def below(self) -> Iterator[tuple[TreeItem, tuple[int, int] | None]]:
        """Return fields, elements or ranges one level below."""
        start, stop = self.span or (0, self.item.count)
        if not self.item.is_array or stop - start <= _MAX_ELEMENTS:
            for row in range(start, stop):
                yield self.item.child(row), None
            return
        step = _MAX_ELEMENTS
        while (stop - start) / step > _MAX_ELEMENTS:
            step *= _MAX_ELEMENTS
        for first in range(start, stop, step):
            yield self.item, (first, min(stop, first + step))

    @property
    def _range(self) -> str:
        assert self.span is not None
        return f"{self.span[0]}:{self.span[1]}"


class FieldTree:
    """The visible rows of a message: its fields, and those below what is unfolded.

    Args:
        owner: The owner of the model.
        roles: Names of the model's roles.
        read: Returns the value of a role of a row.
        folds: Returns whether a row is unfolded to show what is below it.

    Attributes:
        model: The rows, for views.
        root: The message; None without one.
        open: Keys of the unfolded rows.
    """

    def __init__(
        self,
        owner: QtCore.QObject,
        roles: Sequence[str],
        read: Callable[[FieldRow, str], Any],
        folds: Callable[[FieldRow], bool] = lambda row: row.folds,
    ) -> None:
        self.model = RowModel(owner, roles, read)
        self.root: TreeItem | None = None
        self.open: set[str] = set()
        self._folds = folds
        #: Lengths of the arrays whose rows are visible.
        self._lengths: dict[str, int] = {}

    def clear(self) -> None:
        """Show no message."""
        self.root = None
        self.model.show({})

    def show(self, schema: Schema, value: Any) -> None:
        """Show a message, or its values as nested dicts."""
        if self.root is None or self.root.schema is not schema:
            self.root = TreeItem(None, 0, schema, None, value)
            self._lengths = {"": -1}
        else:
            self.root.value = value
        self.update()

    def update(self) -> None:
        """Read the visible rows again; find them again only if an array has another length."""
        assert self.root is not None
        lengths = {row.key: row.item.count for row in self._arrays()}
        if lengths == self._lengths:
            self.model.refresh()
        else:
            self.rebuild()

    def rebuild(self) -> None:
        """Find all visible rows."""
        assert self.root is not None
        rows: dict[str, FieldRow] = {}
        self._collect(FieldRow(self.root, -1, None, True), rows)
        self.model.show(rows)
        self.model.refresh()
        self._lengths = {row.key: row.item.count for row in self._arrays()}

    def row(self, key: str) -> FieldRow | None:
        """Return the visible row of a key; None if there is none."""
        at = self.model.find(key)
        found: FieldRow | None = self.model.rows[at] if at >= 0 else None
        return found

    def toggle(self, key: str) -> str:
        """Fold or unfold a row; return why it was not unfolded, or an empty text."""
        if key not in self.open and len(self.open) >= MAX_OPEN:
            # Rows that are no longer in the message do not count.
            self.open &= set(self.model.keys)
            if len(self.open) >= MAX_OPEN:
                return f"{MAX_OPEN} rows are unfolded: fold others first"
        self.open.symmetric_difference_update({key})
        if self.root is not None:
            self.rebuild()
        return ""

    def _arrays(self) -> list[FieldRow]:
        """Return the visible arrays."""
        return [row for row in self.model.rows if row.item.is_array]

    def _collect(self, above: FieldRow, rows: dict[str, FieldRow]) -> None:
        for item, span in above.below():
            row = FieldRow(item, above.depth + 1, span, False)
            row = row._replace(open=row.key in self.open)
            rows[row.key] = row
            if row.open and self._folds(row):
                self._collect(row, rows)


def fits_line(value: Any) -> bool:
    """Return whether a text keeps all of its characters when it is edited in a line."""
    return not isinstance(value, str) or (len(value) <= _MAX_EDITED and value.isprintable())


def value_text(item: TreeItem) -> str:
    """Return a value in one line."""
    value = item.value
    if item.is_leaf:
        return bounded(value) if isinstance(value, str) else number_text(item, value)
    if item.is_array:
        count = len(value)
        member = item.member
        assert member is not None
        if count == 0:
            return "empty"
        if member.number is None:
            return f"{count:,} element{'s' * (count > 1)}"
        shown = ", ".join(number_text(item, one) for one in value[:_FIRST])
        return shown if count <= _FIRST else f"{shown} and {count - _FIRST:,} more"
    if item.schema is not None and item.schema.is_time:
        seconds, nanoseconds = (item.child(row).value for row in (0, 1))
        return f"{seconds}.{nanoseconds:09d} s"
    return ""


def number_text(item: TreeItem, value: Any) -> str:
    """Return a number with all the digits that its type has."""
    number = item.member.number if item.member is not None else None
    value = value if number is None else number.python(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if number is None or number.name != "float32" or not math.isfinite(value):
        return str(value)
    # A value that was entered is not rounded to the type yet.
    rounded = _FLOAT.pack(value)
    texts = (f"{value:.{digits}g}" for digits in range(6, 10))
    return next((text for text in texts if _FLOAT.pack(float(text)) == rounded), str(value))


def entered_value(text: str, item: TreeItem) -> Any:
    """Return the value that was typed for a leaf, in the type of its field.

    Raises:
        ConversionError: It does not fit.
    """
    assert item.member is not None
    return check_leaf(item, scalar_from_python(_parsed(text, item), item.member))


def _parsed(text: str, item: TreeItem) -> Any:
    member = item.member
    assert member is not None
    if member.number is None:
        return text
    word = text.strip().lower()
    if member.number.python is bool:
        if word not in (*_TRUE, *_FALSE):
            raise ConversionError(item.path, text, "true or false")
        return word in _TRUE
    try:
        return int(word, 0) if member.number.python is int else float(word)
    except ValueError:
        expected = "a whole number" if member.number.python is int else "a number"
        raise ConversionError(item.path, text, f"{expected} ({member.number.name})") from None
