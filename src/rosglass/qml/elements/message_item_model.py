"""``MessageItemModel``: a message as an item model that views show and edit."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import itertools
import logging
from typing import TYPE_CHECKING, Any

import rosglass
from rosglass.errors import ConversionError, Error, InvalidNameError, TypeNotFoundError
from rosglass.qml.engine.from_js import fields_from_js, scalar_from_python
from rosglass.qml.engine.js_values import integral
from rosglass.qml.engine.log import Caller, log_from_qml
from rosglass.qml.engine.properties import Writable
from rosglass.qml.engine.runtime import Runtime, runtime_of
from rosglass.qml.engine.to_js import exact, is_duration
from rosglass.qt import QJSValue, QtCore, Signal, Slot

if TYPE_CHECKING:
    from rosglass.messages import Message, MessageType
    from rosglass.messages.schema import Member, Schema

    _Index = QtCore.QModelIndex | QtCore.QPersistentModelIndex

__all__ = ["MessageItemModel", "TreeItem", "check_leaf", "default_element", "plain_tree"]

_numbers = itertools.count(1)
#: Names of some primitive types in the plugins.
_NAMES = {"float32": "float", "float64": "double", "byte": "octet"}


def plain_tree(message: Message) -> dict[str, Any]:
    """Return a message as nested dicts, lists, numpy arrays and plain values."""
    return message.to_dict()


class TreeItem:
    """A message, an array, or a single value.

    Args:
        parent: The enclosing item; None for the message itself.
        row: Its row in the parent.
        schema: The type, for messages.
        member: The field that it is, or is an element of; None for the message itself.
        value: The fields, for the message itself; other values are in the parent's.

    Attributes:
        number: Unique identifier for its lifetime.
        children: The child items that have been accessed, by row.
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
        """True for an array of fixed length."""
        return self.member is not None and self.member.fixed_count is not None

    @property
    def bound(self) -> int | None:
        """Maximum number of elements; None for no limit."""
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
        """Its type: compound, array, or a primitive."""
        if self.is_array:
            return "array"
        if self.schema is not None or self.member is None:
            return "compound"
        name = self.member.number.name if self.member.number is not None else ""
        return _NAMES.get(name, name) or ("wstring" if self.member.wide else "string")

    @property
    def value(self) -> Any:
        """Its value, in the form of :func:`plain_tree`."""
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
        """Number of fields or elements."""
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
        """Insert elements into an array."""
        self._own_list()[row:row] = values
        self._move(row, len(values))

    def remove(self, row: int, count: int) -> list[TreeItem]:
        """Remove elements of an array; return those items that had been accessed."""
        del self._own_list()[row : row + count]
        gone = [self.children.pop(at) for at in range(row, row + count) if at in self.children]
        self._move(row + count, -count)
        return gone

    def cut(self, count: int) -> list[TreeItem]:
        """Drop the items from row `count` on; return those that had been accessed."""
        return [self.children.pop(row) for row in list(self.children) if row >= count]

    def _move(self, row: int, by: int) -> None:
        moved = {}
        for at, child in self.children.items():
            child.row = at + by if at >= row else at
            moved[child.row] = child
        self.children = moved

    def _own_list(self) -> list[Any]:
        """Return the elements as a list that can be changed, unlike those of a received message."""
        values: Any = self.value
        if isinstance(values, list):
            return values
        made: list[Any] = values.tolist()
        self.value = made
        return made


def default_element(item: TreeItem) -> Any:
    """Return a new element with default value for an array."""
    member = item.member
    assert member is not None
    if member.struct is not None:
        return plain_tree(member.struct.type.create())
    return member.number.python() if member.number is not None else ""


def check_leaf(item: TreeItem, value: Any) -> Any:
    """Return a value converted to the type of its field.

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


# Values of Qt.ItemDataRole: using its names would make PySide load all of Qt's enumerations.
_DISPLAY, _EDIT, _USER = 0, 2, 0x0100
_TYPE, _INDEX, _ELEMENT = _USER + 1, _USER + 2, _USER + 3
_ROLES = {
    _DISPLAY: b"display",
    _EDIT: b"edit",
    _TYPE: b"type",
    _INDEX: b"treeIndex",
    _ELEMENT: b"isArrayElement",
}
_NAME, _VALUE = 0, 1
#: Inserting more rows at once is a mistake that would freeze the screen.
_MOST_ROWS = 100_000


class MessageItemModel(QtCore.QAbstractItemModel):
    """The fields of a message as rows, with names in column 0 and values in column 1.

    Setting a new message keeps the rows that both messages have, so that views stay expanded while
    messages arrive.
    """

    messageChanged = Signal()
    messageTypeChanged = Signal()
    #: The message was edited in a view.
    modified = Signal()

    message = Writable(QJSValue, read="_get_message", write="_set_message")
    messageType = Writable(str, read=lambda self: self._type_name, write="_set_type")

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._type_name = ""
        self._type: MessageType | None = None
        self._root: TreeItem | None = None
        self._items: dict[int, TreeItem] = {}
        self._waiting: QJSValue | None = None
        self._value: QJSValue | None = None
        # PySide 6.11 never frees the Python half of what QML has made.
        state = self.__dict__
        self.destroyed.connect(
            lambda: state.update(_root=None, _items={}, _waiting=None, _value=None)
        )

    # Properties.

    def _runtime(self) -> Runtime | None:
        return runtime_of(self)

    def _get_message(self) -> QJSValue:
        runtime, root, kind = self._runtime(), self._root, self._type
        if runtime is None or root is None or kind is None:
            return QJSValue()
        if self._value is None:
            self._value = runtime.message(kind.create(root.value))
        return self._value

    def _set_message(self, value: QJSValue | None) -> None:
        self._waiting = None
        if value is None or value.isUndefined() or value.isNull():
            self._clear()
            return
        try:
            marked = value.property("#messageType")
            name = marked.toString() if marked.isString() else self._type_name
            if not name:
                # The type may be set after the message.
                self._waiting = value
                return
            kind = self._find(name)
            fields = fields_from_js(value, kind)
            self._show(kind, plain_tree(kind.create(fields)))
        except Error as error:
            self._complain(f"the message is not shown: {error}")
            return
        if name != self._type_name:
            self._type_name = name
            self.messageTypeChanged.emit()
        self.messageChanged.emit()

    def _set_type(self, name: str) -> None:
        if name == self._type_name:
            return
        self._type_name = name
        waiting = self._waiting
        self._clear()
        self.messageTypeChanged.emit()
        if waiting is not None:
            self._set_message(waiting)

    def _find(self, name: str) -> MessageType:
        if self._type is not None and name in {self._type.name, self._type_name}:
            return self._type
        runtime = self._runtime()
        node = runtime.session.node if runtime is not None else None
        try:
            kind = rosglass.load(name, ros=2)
        except TypeNotFoundError:
            if node is None or node.wire != "ros1":
                raise
            kind = rosglass.load(name, ros=1)  # such as a request that only ROS 1 has
        if not isinstance(kind, rosglass.MessageType):
            raise InvalidNameError(f"{name} is not a message type")
        return kind

    def _clear(self) -> None:
        had = self._root is not None
        self.beginResetModel()
        self._root, self._type, self._value = None, None, None
        self._items.clear()
        self.endResetModel()
        if had:
            self.messageChanged.emit()

    def _show(self, kind: MessageType, value: dict[str, Any]) -> None:
        self._value = None
        if self._root is not None and kind is self._type:
            self._merge(self._root, value)
            return
        self.beginResetModel()
        self._items.clear()
        self._type = kind
        self._root = TreeItem(None, 0, kind.create()._schema__, None, value)
        self.endResetModel()

    def _merge(self, item: TreeItem, value: Any) -> None:
        """Replace an item's value, and notify views of the changes."""
        index = self._index_of(item)
        before, after = (len(item.value), len(value)) if item.is_array else (0, 0)
        if after < before:
            self.beginRemoveRows(index, after, before - 1)
            self._forget(item.cut(after))
            item.value = list(item.value)[:after]
            self.endRemoveRows()
        elif after > before:
            self.beginInsertRows(index, before, after - 1)
            item.value = [*item.value, *value[before:]]
            self.endInsertRows()
        for child in list(item.children.values()):
            if not child.is_leaf:
                self._merge(child, value[child.name])
        item.value = value
        if item.children:
            last = item.count - 1
            first = self.index(0, _VALUE, index)
            self.dataChanged.emit(first, self.index(last, _VALUE, index))

    # The tree, for views.

    def _item(self, index: _Index | None) -> TreeItem | None:
        if index is None or not index.isValid():
            return self._root
        return self._items.get(index.internalId())

    def _index_of(self, item: TreeItem, column: int = 0) -> QtCore.QModelIndex:
        if item.parent is None:
            return QtCore.QModelIndex()
        return self.createIndex(item.row, column, item.number)

    def index(self, row: int, column: int, parent: _Index | None = None) -> QtCore.QModelIndex:
        """Return the index of a child."""
        item = self._item(parent)
        inside = parent is None or not parent.isValid() or parent.column() == _NAME
        if item is None or not inside or not 0 <= row < item.count or not 0 <= column <= 1:
            return QtCore.QModelIndex()
        child = item.child(row)
        self._items[child.number] = child
        return self.createIndex(row, column, child.number)

    def parent(self, index: _Index | None = None) -> Any:
        """Return the index of an item's parent; without an index, the object's parent."""
        if index is None:
            return super().parent()
        item = self._items.get(index.internalId()) if index.isValid() else None
        if item is None or item.parent is None:
            return QtCore.QModelIndex()
        return self._index_of(item.parent)

    def rowCount(self, parent: _Index | None = None) -> int:
        """Return the number of fields or elements of an item."""
        item = self._item(parent)
        if item is None or (parent is not None and parent.isValid() and parent.column() != _NAME):
            return 0
        return item.count

    def columnCount(self, parent: _Index | None = None) -> int:  # noqa: ARG002 - Qt's signature
        """Return 2: names and values."""
        return 2

    def roleNames(self) -> dict[int, QtCore.QByteArray]:
        """Return the names of the roles for delegates."""
        return {role: QtCore.QByteArray(name) for role, name in _ROLES.items()}

    def headerData(self, section: int, orientation: Any, role: int = _DISPLAY) -> Any:
        """Return the column titles."""
        if orientation != QtCore.Qt.Orientation.Horizontal or role != _DISPLAY:
            return None
        return ("Name", "Value")[section] if section in {0, 1} else None

    def data(self, index: _Index, role: int = _DISPLAY) -> Any:
        """Return the content of a cell."""
        item = self._item(index) if index.isValid() else None
        if item is None:
            return None
        if role == _TYPE:
            return item.type_name
        if role == _INDEX:
            return self._index_of(item)
        if role == _ELEMENT:
            return item.is_element
        if role not in {_DISPLAY, _EDIT}:
            return None
        if index.column() == _NAME:
            # Editors show a field for what has an edit role.
            return item.name if role == _DISPLAY else None
        if not item.is_leaf:
            # Qt's own delegates warn about undefined. Editors for qml6_ros2_plugin offer to add an
            # element where an array has an edit role.
            may_grow = item.is_array and not item.is_fixed
            return "" if role == _DISPLAY or may_grow else None
        value = item.value
        return exact(value) if type(value) is int else value

    def flags(self, index: _Index) -> Any:
        """Return a cell's flags; only values of leaves can be edited."""
        item = self._item(index) if index.isValid() else None
        if item is None:
            return QtCore.Qt.ItemFlag.NoItemFlags
        flags = QtCore.Qt.ItemFlag.ItemIsEnabled | QtCore.Qt.ItemFlag.ItemIsSelectable
        if index.column() == _VALUE and item.is_leaf:
            flags |= QtCore.Qt.ItemFlag.ItemIsEditable
        return flags

    # Editing.

    def setData(self, index: _Index, value: Any, role: int = _EDIT) -> bool:
        """Set a leaf; if the value does not fit, log why and return false."""
        item = self._item(index) if index.isValid() else None
        if item is None or not item.is_leaf or index.column() != _VALUE or role != _EDIT:
            return False
        try:
            assert item.member is not None
            found = value.toVariant() if isinstance(value, QJSValue) else value
            item.set(check_leaf(item, scalar_from_python(found, item.member)))
        except ConversionError as error:
            self._complain(f"{item.path} was not changed: {error}")
            return False
        # Not the edit role: it would replace what is being typed.
        self.dataChanged.emit(index, index, [_DISPLAY])
        self._edited()
        return True

    @Slot("QVariant", "QVariant", result=bool)
    @Slot("QVariant", "QVariant", "QVariant", result=bool)
    def insertRows(self, row: Any, count: Any, parent: Any = None) -> bool:
        """Insert default elements into an array; return false if the type does not allow it."""
        row, count = integral(row), integral(count)
        item = self._array(parent, "insertRows", row, count)
        if item is None or not 0 <= row <= item.count:
            return False
        bound = item.bound
        if count > _MOST_ROWS or (bound is not None and item.count + count > bound):
            most = _MOST_ROWS if bound is None else bound
            self._complain(f"{item.path}: {item.count + count} elements are too many; {most} fit")
            return False
        self.beginInsertRows(self._index_of(item), row, row + count - 1)
        item.insert(row, [default_element(item) for _ in range(count)])
        self.endInsertRows()
        self._renumbered(item, row + count)
        self._edited()
        return True

    @Slot("QVariant", "QVariant", result=bool)
    @Slot("QVariant", "QVariant", "QVariant", result=bool)
    def removeRows(self, row: Any, count: Any, parent: Any = None) -> bool:
        """Remove elements of an array; return false if the type does not allow it."""
        row, count = integral(row), integral(count)
        item = self._array(parent, "removeRows", row, count)
        if item is None or row < 0 or row + count > item.count:
            return False
        self.beginRemoveRows(self._index_of(item), row, row + count - 1)
        self._forget(item.remove(row, count))
        self.endRemoveRows()
        self._renumbered(item, row)
        self._edited()
        return True

    def _array(self, parent: Any, what: str, row: Any, count: Any) -> TreeItem | None:
        """Return the array if its length may be changed; otherwise log why and return None."""
        known = isinstance(parent, (QtCore.QModelIndex, QtCore.QPersistentModelIndex))
        item = self._item(parent) if known else self._root
        if type(row) is not int or type(count) is not int or count < 1 or item is None:
            return None
        if not item.is_array or item.is_fixed:
            kind = "has a fixed length" if item.is_array else "is not an array"
            self._complain(f"{what}: {item.path or 'the message'} {kind}")
            return None
        return item

    def _renumbered(self, item: TreeItem, row: int) -> None:
        """Notify views that element indices, which are the elements' names, have changed."""
        if row < item.count:
            index = self._index_of(item)
            first, last = self.index(row, _NAME, index), self.index(item.count - 1, _NAME, index)
            self.dataChanged.emit(first, last)

    def _edited(self) -> None:
        self._value = None
        self.modified.emit()
        self.messageChanged.emit()

    def _forget(self, items: list[TreeItem]) -> None:
        for item in items:
            self._items.pop(item.number, None)
            self._forget(list(item.children.values()))

    def _complain(self, problem: str) -> None:
        runtime = self._runtime()
        caller = runtime.caller() if runtime is not None else Caller("<unknown>", 0, "")
        log_from_qml("", logging.ERROR, f"MessageItemModel: {problem}", caller)
