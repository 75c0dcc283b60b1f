"""The element ``MessageRows``: the message of a topic as a tree of fields, to read and to edit."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.qos import QoS
from rosglass.controls.lists.row_model import RowModel
from rosglass.controls.lists.texts import bounded, copy_text
from rosglass.controls.topics.live_topic import LiveTopic
from rosglass.errors import ConversionError, Error
from rosglass.qml.elements.message_item_model import TreeItem, check_leaf, plain_tree
from rosglass.qml.engine.from_js import scalar_from_python
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qt import QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.comm.inbox import Sample

__all__ = ["MessageRows"]

#: Elements of an array that are shown below it; longer ones are divided into ranges.
_MAX_ELEMENTS = 100
#: Rows that may be unfolded at once, each with up to 100 rows below it.
_MAX_OPEN = 100
#: Numbers of an array that its summary shows.
_FIRST = 4
#: Characters of a text that can be edited in a line.
_MAX_EDITED = 20_000
_ROLES = ("key", "name", "depth", "folds", "open", "path", "type", "value", "text", "unit",
          "comment", "isLeaf", "editable")  # fmt: skip
_FLOAT = struct.Struct("f")
_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


class _Field(NamedTuple):
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


class MessageRows(LiveTopic):
    """The message of a topic as the rows of a tree. See its page in ``docs/controls``."""

    _DEFAULT_QOS = QoS.best_available(depth=1)
    _HOLDS: tuple[str, ...] = (*LiveTopic._HOLDS, "_model", "_root", "_kind")

    #: The rows, for a ListView.
    rows = ReadOnly(QtCore.QObject, read=lambda self: self._model)
    #: Whether the message is a copy that is being edited, instead of the last one received.
    editing = ReadOnly(bool, False)
    #: Why the last edit was refused, or rows were not unfolded; empty for no reason.
    refusal = ReadOnly(str, "")

    _editing: bool

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._model = RowModel(self, _ROLES, self._read)
        self._root: TreeItem | None = None
        #: Type of the root.
        self._kind: Any = None
        self._open: set[str] = set()
        #: Lengths of the arrays whose rows are visible.
        self._lengths: dict[str, int] = {}

    # -- receiving -------------------------------------------------------------------------------

    def _show(self, sample: Sample, held: float) -> None:
        super()._show(sample, held)
        if self._sample is sample and not self._editing:
            self._show_rows()

    def _clear_shown(self) -> None:
        super()._clear_shown()
        self._root, self._kind = None, None
        report(self, editing=False, refusal="")
        self._model.show({})

    def _show_rows(self) -> None:
        message = self._message
        if message is None:
            return
        schema = message._schema__
        if self._root is None or self._root.schema is not schema:
            self._root = TreeItem(None, 0, schema, None, message)
            self._lengths = {"": -1}
        else:
            self._root.value = message
        self._kind = schema.type
        try:
            self._update_rows()
        except Error as error:
            self._set_problem(f"{self._resolved}: the message cannot be shown: {error}")

    def _update_rows(self) -> None:
        """Read the visible rows again; find them again only if an array has another length."""
        assert self._root is not None
        lengths = {field.key: field.item.count for field in self._arrays()}
        if lengths == self._lengths:
            self._model.refresh()
            return
        rows: dict[str, _Field] = {}
        self._collect(_Field(self._root, -1, None, True), rows)
        self._model.show(rows)
        self._model.refresh()
        self._lengths = {field.key: field.item.count for field in self._arrays()}

    def _arrays(self) -> list[_Field]:
        """Return the visible arrays."""
        return [field for field in self._model.rows if field.item.is_array]

    def _collect(self, above: _Field, rows: dict[str, _Field]) -> None:
        for item, span in above.below():
            field = _Field(item, above.depth + 1, span, False)
            field = field._replace(open=field.key in self._open)
            rows[field.key] = field
            if field.open and field.folds:
                self._collect(field, rows)

    # -- the rows --------------------------------------------------------------------------------

    def _read(self, field: _Field, role: str) -> Any:
        item, member = field.item, field.item.member
        assert member is not None
        if role in ("name", "depth", "open", "folds"):
            return getattr(field, role)
        if role == "isLeaf":
            return item.is_leaf
        if role == "editable":
            return self._editing and item.is_leaf and _fits_line(item.value)
        if role == "path":
            return self._path(field)
        if field.span is not None:
            return ""
        if role == "value":
            return self._text(item)
        if role == "text":
            return self._text_to_edit(item)
        if role == "type":
            return str(member.field.type) if item.is_array else member.field.type.name
        if role == "comment":
            return bounded(" ".join(member.field.comment.split()))
        return member.field.unit

    def _path(self, field: _Field) -> str:
        """Return the path of the values of a number, or of an array of numbers; else empty."""
        item = field.item
        numeric = item.member is not None and item.member.number is not None
        if not numeric or not (item.is_leaf or (item.is_array and field.span is None)):
            return ""
        return f"{self._resolved}:{item.path}{'[*]' * item.is_array}"

    def _text(self, item: TreeItem) -> str:
        """Return a value in one line."""
        value = item.value
        if item.is_leaf:
            return bounded(value) if isinstance(value, str) else _number(item, value)
        if item.is_array:
            count = len(value)
            member = item.member
            assert member is not None
            if count == 0:
                return "empty"
            if member.number is None:
                return f"{count:,} element{'s' * (count > 1)}"
            shown = ", ".join(_number(item, one) for one in value[:_FIRST])
            return shown if count <= _FIRST else f"{shown} and {count - _FIRST:,} more"
        if item.schema is not None and item.schema.is_time:
            seconds, nanoseconds = (item.child(row).value for row in (0, 1))
            return f"{seconds}.{nanoseconds:09d} s"
        return ""

    def _text_to_edit(self, item: TreeItem) -> str:
        """Return a value as it is edited: `_text` escapes texts, and shortens long ones."""
        if not self._editing or not _fits_line(item.value):
            return ""
        return item.value if isinstance(item.value, str) else self._text(item)

    @Slot(str)
    def toggle(self, key: str) -> None:
        """Fold or unfold a row."""
        if key not in self._open and len(self._open) >= _MAX_OPEN:
            # Rows that are no longer in the message do not count.
            self._open.intersection_update(self._model.keys)
            if len(self._open) >= _MAX_OPEN:
                report(self, refusal=f"{_MAX_OPEN} rows are unfolded: fold others first")
                return
        self._open.symmetric_difference_update({key})
        report(self, refusal="")
        self._lengths = {"": -1}
        if self._root is not None:
            self._update_rows()

    @Slot(str)
    def copy(self, key: str) -> None:
        """Copy the path of a row, as plots take it; without a number, topic and field path."""
        row = self._model.find(key)
        if row >= 0:
            copy_text(self._path(self._model.rows[row]) or f"{self._resolved}:{key}")

    # -- editing ---------------------------------------------------------------------------------

    @Slot(result=bool)
    def edit(self) -> bool:
        """Begin to edit a copy of the last message; return false before the first message.

        Until :meth:`cancel`, received messages are not shown.
        """
        message = self._message
        if message is None or self._root is None:
            return False
        self._root.value = plain_tree(message.copy())
        report(self, editing=True, refusal="")
        self._model.refresh()
        return True

    @Slot()
    def cancel(self) -> None:
        """Show received messages again; the edited one is dropped."""
        report(self, editing=False, refusal="")
        self._show_rows()

    @Slot(str, str, result=bool)
    def setText(self, key: str, text: str) -> bool:
        """Set a leaf of the edited message; if the text does not fit, `refusal` says why."""
        row = self._model.find(key)
        field = self._model.rows[row] if row >= 0 else None
        if not self._editing or field is None or not field.item.is_leaf:
            return False
        item = field.item
        try:
            item.set(check_leaf(item, scalar_from_python(_parsed(text, item), item.member)))
        except ConversionError as error:
            report(self, refusal=str(error))
            return False
        report(self, refusal="")
        self._model.refresh()
        return True

    @Slot(result=QJSValue)
    def edited(self) -> QJSValue:
        """Return the edited message; undefined if none is edited, or it does not fit its type."""
        runtime, root = self._find_runtime(), self._root
        if runtime is None or root is None or not self._editing:
            return QJSValue()
        try:
            return runtime.message(self._kind.create(root.value), self.DIALECT)
        except Error as error:
            report(self, refusal=str(error))
            return QJSValue()


def _fits_line(value: Any) -> bool:
    """Return whether a text keeps all of its characters when it is edited in a line."""
    return not isinstance(value, str) or (len(value) <= _MAX_EDITED and value.isprintable())


def _number(item: TreeItem, value: Any) -> str:
    """Return a number with all the digits that its type has."""
    number = item.member.number if item.member is not None else None
    value = value if number is None else number.python(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if number is None or number.name != "float32" or not math.isfinite(value):
        return str(value)
    texts = (f"{value:.{digits}g}" for digits in range(6, 10))
    return next((text for text in texts if _FLOAT.unpack(_FLOAT.pack(float(text)))[0] == value), "")


def _parsed(text: str, item: TreeItem) -> Any:
    """Return the value that was typed for a leaf.

    Raises:
        ConversionError: It is neither a number nor a bool, where the field is one.
    """
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
