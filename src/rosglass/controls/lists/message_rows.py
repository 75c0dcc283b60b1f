"""The element ``MessageRows``: the message of a topic as a tree of fields, to read and to edit."""
# ruff: noqa: N802 - the names of slots are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm.qos import QoS
from rosglass.controls.lists.field_tree import FieldTree, entered_value, fits_line, value_text
from rosglass.controls.lists.texts import bounded, copy_text
from rosglass.controls.topics.live_topic import LiveTopic
from rosglass.errors import ConversionError, Error
from rosglass.qml.elements.message_item_model import plain_tree
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qt import QJSValue, QtCore, Slot

if TYPE_CHECKING:
    from rosglass.comm.inbox import Sample
    from rosglass.controls.lists.field_tree import FieldRow
    from rosglass.qml.elements.message_item_model import TreeItem

__all__ = ["MessageRows"]

_ROLES = ("key", "name", "depth", "folds", "open", "path", "type", "value", "text", "unit",
          "comment", "isLeaf", "editable")  # fmt: skip


class MessageRows(LiveTopic):
    """The message of a topic as the rows of a tree. See its page in ``docs/controls``."""

    _DEFAULT_QOS = QoS.best_available(depth=1)
    _HOLDS: tuple[str, ...] = (*LiveTopic._HOLDS, "_tree", "_kind")

    #: The rows, for a ListView.
    rows = ReadOnly(QtCore.QObject, read=lambda self: self._tree.model)
    #: Whether the message is a copy that is being edited, instead of the last one received.
    editing = ReadOnly(bool, False)
    #: Why the last edit was refused, or rows were not unfolded; empty for no reason.
    refusal = ReadOnly(str, "")

    _editing: bool

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._tree = FieldTree(self, _ROLES, self._read)
        #: Type of the message.
        self._kind: Any = None

    # -- receiving -------------------------------------------------------------------------------

    def _show(self, sample: Sample, held: float) -> None:
        super()._show(sample, held)
        if self._sample is sample and not self._editing:
            self._show_rows()

    def _clear_shown(self) -> None:
        super()._clear_shown()
        self._kind = None
        report(self, editing=False, refusal="")
        self._tree.clear()

    def _show_rows(self) -> None:
        message = self._message
        if message is None:
            return
        schema = message._schema__
        self._kind = schema.type
        try:
            self._tree.show(schema, message)
        except Error as error:
            self._set_problem(f"{self._resolved}: the message cannot be shown: {error}")

    # -- the rows --------------------------------------------------------------------------------

    def _read(self, field: FieldRow, role: str) -> Any:
        item, member = field.item, field.item.member
        assert member is not None
        if role in ("name", "depth", "open", "folds"):
            return getattr(field, role)
        if role == "isLeaf":
            return item.is_leaf
        if role == "editable":
            return self._editing and item.is_leaf and fits_line(item.value)
        if role == "path":
            return self._path(field)
        if field.span is not None:
            return ""
        if role == "value":
            return value_text(item)
        if role == "text":
            return self._text_to_edit(item)
        if role == "type":
            return str(member.field.type) if item.is_array else member.field.type.name
        if role == "comment":
            return bounded(" ".join(member.field.comment.split()))
        return member.field.unit

    def _path(self, field: FieldRow) -> str:
        """Return the path of the values of a number, or of an array of numbers; else empty."""
        item = field.item
        numeric = item.member is not None and item.member.number is not None
        if not numeric or not (item.is_leaf or (item.is_array and field.span is None)):
            return ""
        return f"{self._resolved}:{item.path}{'[*]' * item.is_array}"

    def _text_to_edit(self, item: TreeItem) -> str:
        """Return a value as it is edited: `value_text` escapes texts, and shortens long ones."""
        if not self._editing or not fits_line(item.value):
            return ""
        return item.value if isinstance(item.value, str) else value_text(item)

    @Slot(str)
    def toggle(self, key: str) -> None:
        """Fold or unfold a row."""
        report(self, refusal=self._tree.toggle(key))

    @Slot(str)
    def copy(self, key: str) -> None:
        """Copy the path of a row, as plots take it; without a number, topic and field path."""
        row = self._tree.row(key)
        if row is not None:
            copy_text(self._path(row) or f"{self._resolved}:{key}")

    # -- editing ---------------------------------------------------------------------------------

    @Slot(result=bool)
    def edit(self) -> bool:
        """Begin to edit a copy of the last message; return false before the first message.

        Until :meth:`cancel`, received messages are not shown.
        """
        message = self._message
        root = self._tree.root
        if message is None or root is None:
            return False
        root.value = plain_tree(message.copy())
        report(self, editing=True, refusal="")
        self._tree.model.refresh()
        return True

    @Slot()
    def cancel(self) -> None:
        """Show received messages again; the edited one is dropped."""
        report(self, editing=False, refusal="")
        self._show_rows()

    @Slot(str, str, result=bool)
    def setText(self, key: str, text: str) -> bool:
        """Set a leaf of the edited message; if the text does not fit, `refusal` says why."""
        field = self._tree.row(key)
        if not self._editing or field is None or not field.item.is_leaf:
            return False
        item = field.item
        try:
            item.set(entered_value(text, item))
        except ConversionError as error:
            report(self, refusal=str(error))
            return False
        report(self, refusal="")
        self._tree.model.refresh()
        return True

    @Slot(result=QJSValue)
    def edited(self) -> QJSValue:
        """Return the edited message; undefined if none is edited, or it does not fit its type."""
        runtime, root = self._find_runtime(), self._tree.root
        if runtime is None or root is None or not self._editing:
            return QJSValue()
        try:
            return runtime.message(self._kind.create(root.value), self.DIALECT)
        except Error as error:
            report(self, refusal=str(error))
            return QJSValue()
