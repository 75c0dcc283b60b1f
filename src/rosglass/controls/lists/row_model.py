"""The rows of lists and trees, for views in QML."""
# ruff: noqa: N802 - the names of Qt's virtual functions and of slots

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    _Index = QtCore.QModelIndex | QtCore.QPersistentModelIndex

__all__ = ["RowModel"]

#: Value of Qt.ItemDataRole.UserRole: using its name would make PySide load all enumerations.
_USER = 0x0100
#: Rows that are moved one by one; a list with more changes in its order is shown anew.
_MAX_MOVES = 100


class RowModel(QtCore.QAbstractListModel):
    """A list of rows with keys, for a ListView; of a tree, the visible rows.

    Views keep their position and their current row when others appear, disappear or move. The role
    ``key`` is the row's key, and ``row`` has all roles in one object, which delegates can keep
    while they are removed. ``ThemeTree`` needs ``key``, ``depth`` (0 for the first level),
    ``folds`` (whether there is something below it) and ``open``.

    Args:
        parent: The owner.
        roles: Names of the roles.
        read: Returns the value of a role of a row; None reads the row as a dict.
    """

    countChanged = Signal()  # noqa: N815 - QML's name

    def __init__(
        self,
        parent: QtCore.QObject,
        roles: Sequence[str],
        read: Callable[[Any, str], Any] | None = None,
    ) -> None:
        super().__init__(parent)
        self._names = dict(enumerate((*roles, "row"), _USER))
        self._own = roles
        self._read = read or (lambda row, role: row[role])
        self._keys: list[Any] = []
        self._rows: list[Any] = []

    count = QtCore.Property(int, lambda self: len(self._rows), notify=countChanged)

    @property
    def keys(self) -> Sequence[Any]:
        """The keys of the rows, in their order."""
        return self._keys

    @property
    def rows(self) -> Sequence[Any]:
        """The rows, in their order."""
        return self._rows

    def show(self, rows: Mapping[Any, Any]) -> None:
        """Show other rows.

        Args:
            rows: The rows by key, in order. Those that are equal to the shown ones are not drawn
                again; :meth:`refresh` draws rows that were changed in place.
        """
        keys, before = list(rows), len(self._keys)
        if keys == self._keys or (self._remove_missing(rows) and self._move_to(keys, rows)):
            self._replace(list(rows.values()))
        else:
            self.beginResetModel()
            self._keys, self._rows = keys, list(rows.values())
            self.endResetModel()
        if len(keys) != before:
            self.countChanged.emit()

    def slide(self, gone: int, new: Mapping[Any, Any]) -> None:
        """Remove rows at the beginning, and add rows at the end."""
        if gone:
            self._remove(0, gone)
        if new:
            self._insert(len(self._keys), list(new), new)
        if gone != len(new):
            self.countChanged.emit()

    def changed(self, key: Any) -> None:
        """Have a row that was changed in place read again."""
        if key in self._keys:
            index = self.index(self._keys.index(key))
            self.dataChanged.emit(index, index)

    def refresh(self) -> None:
        """Have all rows read again."""
        if self._rows:
            self.dataChanged.emit(self.index(0), self.index(len(self._rows) - 1))

    def _remove(self, start: int, stop: int) -> None:
        self.beginRemoveRows(QtCore.QModelIndex(), start, stop - 1)
        del self._keys[start:stop], self._rows[start:stop]
        self.endRemoveRows()

    def _insert(self, at: int, keys: Sequence[Any], rows: Mapping[Any, Any]) -> None:
        self.beginInsertRows(QtCore.QModelIndex(), at, at + len(keys) - 1)
        self._keys[at:at] = keys
        self._rows[at:at] = [rows[key] for key in keys]
        self.endInsertRows()

    def _move(self, source: int, goal: int) -> None:
        none, below = QtCore.QModelIndex(), goal + (goal > source)
        self.beginMoveRows(none, source, source, none, below)
        for rows in (self._keys, self._rows):
            rows.insert(goal, rows.pop(source))
        self.endMoveRows()

    def _remove_missing(self, wanted: Mapping[Any, Any]) -> bool:
        """Remove runs of rows that are not wanted; return False if none would be left."""
        if not any(key in wanted for key in self._keys):
            return False
        stop = len(self._keys)
        while stop:
            start = stop
            while start and self._keys[start - 1] not in wanted:
                start -= 1
            if start < stop:
                self._remove(start, stop)
            stop = max(0, start - 1)
        return True

    def _move_to(self, keys: list[Any], rows: Mapping[Any, Any]) -> bool:
        """Insert runs of rows, and put all in order; return False if that takes too many moves."""
        known, goals = set(self._keys), {key: at for at, key in enumerate(keys)}
        moves = at = 0
        while at < len(keys):
            now, key = self._keys, keys[at]
            if at < len(now) and now[at] == key:
                at += 1
                continue
            if key not in known:
                stop = at + 1
                while stop < len(keys) and keys[stop] not in known:
                    stop += 1
                self._insert(at, keys[at:stop], rows)
                at = stop
                continue
            moves += 1
            if moves > _MAX_MOVES:
                return False
            if at + 1 < len(now) and now[at + 1] == key:
                # One row has moved down: do not move all others up instead.
                self._move(at, min(goals[now[at]], len(now) - 1))
            else:
                self._move(now.index(key, at), at)
        return True

    def _replace(self, rows: list[Any]) -> None:
        """Replace rows of the same keys; report each run of different ones."""
        start = -1
        for at, (row, before) in enumerate(zip(rows, self._rows, strict=True)):
            if row is not before and row != before:
                start = at if start < 0 else start
            elif start >= 0:
                self._report(start, at, rows)
                start = -1
        if start >= 0:
            self._report(start, len(rows), rows)

    def _report(self, start: int, stop: int, rows: list[Any]) -> None:
        self._rows[start:stop] = rows[start:stop]
        self.dataChanged.emit(self.index(start), self.index(stop - 1))

    # For views.

    def rowCount(self, parent: _Index | None = None) -> int:
        """Return the number of rows."""
        return 0 if parent is not None and parent.isValid() else len(self._rows)

    def roleNames(self) -> dict[int, QtCore.QByteArray]:
        """Return the names of the roles for delegates."""
        return {role: QtCore.QByteArray(name.encode()) for role, name in self._names.items()}

    def data(self, index: _Index, role: int = 0) -> Any:
        """Return a role of a row."""
        at, name = index.row(), self._names.get(role)
        return None if name is None or not 0 <= at < len(self._rows) else self._role(at, name)

    def _role(self, row: int, name: str) -> Any:
        if name == "row":
            return {own: self._role(row, own) for own in self._own}
        return self._keys[row] if name == "key" else self._read(self._rows[row], name)

    @Slot(int, str, result="QVariant")
    def value(self, row: int, role: str) -> Any:
        """Return a role of a row by its name; undefined if there is no such row or role."""
        known = 0 <= row < len(self._rows) and role in self._names.values()
        return self._role(row, role) if known else None

    @Slot(str, result=int)
    def find(self, key: str) -> int:
        """Return the row of a key, or -1."""
        return self._keys.index(key) if key in self._keys else -1

    @Slot(int, result=int)
    def parentOf(self, row: int) -> int:
        """Return the row that a row is below; -1 for the first level."""
        if not 0 <= row < len(self._rows):
            return -1
        depth = self._role(row, "depth")
        above = (at for at in range(row - 1, -1, -1) if self._role(at, "depth") < depth)
        return next(above, -1)
