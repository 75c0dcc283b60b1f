"""Rows for lists in QML."""
# ruff: noqa: N802 - the names of Qt's methods

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Signal

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    _Index = QtCore.QModelIndex | QtCore.QPersistentModelIndex

__all__ = ["RowModel"]

#: Value of Qt.ItemDataRole.UserRole: using its name would make PySide load all enumerations.
_USER = 0x0100
#: Rows that are moved, added or removed one by one; a list with more changes is shown anew.
_MOST_STEPS = 100


class RowModel(QtCore.QAbstractListModel):
    """A list of rows, each with a key and a dict of the values of its roles.

    Args:
        roles: Names of the roles.
        rows: The rows by key, which the owner changes; :meth:`arrange` shows the changes.
        parent: The owner.
    """

    countChanged = Signal()  # noqa: N815 - QML's name

    def __init__(
        self, roles: Sequence[str], rows: Mapping[Any, Mapping[str, Any]], parent: QtCore.QObject
    ) -> None:
        super().__init__(parent)
        self._names = dict(enumerate(roles, _USER))
        self._rows = rows
        self._keys: list[Any] = []

    @property
    def keys(self) -> Sequence[Any]:
        """The keys of the rows, in their order."""
        return self._keys

    def rowCount(self, parent: _Index | None = None) -> int:
        """Return the number of rows."""
        return 0 if parent is not None and parent.isValid() else len(self._keys)

    def roleNames(self) -> dict[int, QtCore.QByteArray]:
        """Return the names of the roles for delegates."""
        return {role: QtCore.QByteArray(name.encode()) for role, name in self._names.items()}

    def data(self, index: _Index, role: int = 0) -> Any:
        """Return the value of a role of a row."""
        at, name = index.row(), self._names.get(role)
        if name is None or not 0 <= at < len(self._keys):
            return None
        row = self._rows.get(self._keys[at])
        return None if row is None else row[name]

    def changed(self, key: Hashable) -> None:
        """Show the changed values of a row."""
        if key in self._keys:
            index = self.index(self._keys.index(key), 0)
            self.dataChanged.emit(index, index)

    def arrange(self, keys: Sequence[Hashable]) -> None:
        """Show the rows of these keys in this order, and all changed values.

        Views keep their place, and what is unfolded, unless very many rows change.
        """
        before = len(self._keys)
        if list(keys) != self._keys and not (self._remove(set(keys)) and self._move(list(keys))):
            self.beginResetModel()
            self._keys = list(keys)
            self.endResetModel()
        if self._keys:
            self.dataChanged.emit(self.index(0, 0), self.index(len(self._keys) - 1, 0))
        if len(self._keys) != before:
            self.countChanged.emit()

    def slide(self, gone: int, new: Sequence[Hashable]) -> None:
        """Remove rows at the beginning, and add rows at the end."""
        none, keys = QtCore.QModelIndex(), self._keys
        if gone:
            self.beginRemoveRows(none, 0, gone - 1)
            del keys[:gone]
            self.endRemoveRows()
        if new:
            self.beginInsertRows(none, len(keys), len(keys) + len(new) - 1)
            keys += new
            self.endInsertRows()
        if gone != len(new):
            self.countChanged.emit()

    def _remove(self, wanted: set[Any]) -> bool:
        """Remove rows that are not wanted; return False if there are too many."""
        gone = [at for at, key in enumerate(self._keys) if key not in wanted]
        if len(gone) > _MOST_STEPS:
            return False
        for at in reversed(gone):
            self.beginRemoveRows(QtCore.QModelIndex(), at, at)
            del self._keys[at]
            self.endRemoveRows()
        return True

    def _move(self, keys: list[Any]) -> bool:
        """Add rows and put all in order; return False if that takes too many steps."""
        now, none = self._keys, QtCore.QModelIndex()
        known, goals = set(now), {key: at for at, key in enumerate(keys)}
        if len(keys) - len(known) > _MOST_STEPS:
            return False
        steps = 0
        at = 0
        while at < len(keys):
            key = keys[at]
            if at < len(now) and now[at] == key:
                at += 1
                continue
            steps += 1
            if steps > _MOST_STEPS:
                return False
            if key not in known:
                self.beginInsertRows(none, at, at)
                now.insert(at, key)
                self.endInsertRows()
                known.add(key)
            elif at + 1 < len(now) and now[at + 1] == key:
                # One row has moved down: do not move all others up instead.
                goal = min(goals[now[at]], len(now) - 1)
                self.beginMoveRows(none, at, at, none, goal + 1)
                now.insert(goal, now.pop(at))
                self.endMoveRows()
            else:
                source = now.index(key, at)
                self.beginMoveRows(none, source, source, none, at)
                now.insert(at, now.pop(source))
                self.endMoveRows()
        return True
