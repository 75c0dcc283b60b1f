"""The model of controls that show a tree: its visible rows, for a ListView."""
# ruff: noqa: N802 - the names of Qt's virtual functions

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

__all__ = ["Rows"]

#: The first role that a model may use.
_USER = 0x0100


class Rows(QtCore.QAbstractListModel):
    """The visible rows of a tree, from the first to the last.

    Views keep their position and their current row when others appear or disappear. Each row has a
    key of its own; the roles ``key``, ``depth`` (0 for the first level), ``folds`` (whether there
    is something below it) and ``open`` are those that ``ThemeTree`` needs; ``row`` has all of them
    in one object, which delegates can keep while they are removed.

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
        self._keys: list[str] = []
        self._rows: list[Any] = []

    count = QtCore.Property(int, lambda self: len(self._rows), notify=countChanged)

    def show(self, rows: Mapping[str, Any]) -> None:
        """Show other rows.

        Args:
            rows: The rows by key, in order; those that are equal to the shown ones are not drawn
                again.
        """
        keys = list(rows)
        before = len(self._keys)
        if keys != self._keys and not self._move_to(keys, rows):
            self.beginResetModel()
            self._keys, self._rows = keys, list(rows.values())
            self.endResetModel()
        else:
            self._replace(list(rows.values()))
        if len(keys) != before:
            self.countChanged.emit()

    def refresh(self) -> None:
        """Have the visible rows read again."""
        if self._rows:
            self.dataChanged.emit(self.index(0), self.index(len(self._rows) - 1))

    def key(self, row: int) -> str:
        """Return the key of a row; empty if there is no such row."""
        return self._keys[row] if 0 <= row < len(self._keys) else ""

    def at(self, row: int) -> Any:
        """Return a row."""
        return self._rows[row]

    def _move_to(self, keys: list[str], rows: Mapping[str, Any]) -> bool:
        """Remove and insert runs of rows; return False if the order of the others has changed."""
        wanted = {key: place for place, key in enumerate(keys)}
        kept = [wanted[key] for key in self._keys if key in wanted]
        if not kept or any(a >= b for a, b in itertools.pairwise(kept)):
            return False
        nowhere, stop = QtCore.QModelIndex(), len(self._keys)
        while stop:
            start = stop
            while start and self._keys[start - 1] not in wanted:
                start -= 1
            if start < stop:
                self.beginRemoveRows(nowhere, start, stop - 1)
                del self._keys[start:stop], self._rows[start:stop]
                self.endRemoveRows()
            stop = max(0, start - 1)
        there = set(self._keys)
        start = 0
        while start < len(keys):
            stop = start
            while stop < len(keys) and keys[stop] not in there:
                stop += 1
            if start < stop:
                self.beginInsertRows(nowhere, start, stop - 1)
                self._keys[start:start] = keys[start:stop]
                self._rows[start:start] = [rows[key] for key in keys[start:stop]]
                self.endInsertRows()
            start = stop + 1
        return True

    def _replace(self, rows: list[Any]) -> None:
        """Replace rows of the same keys; report each run of different ones."""
        start = -1
        for at, (row, before) in enumerate(zip(rows, self._rows, strict=True)):
            if row != before:
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

    def rowCount(self, parent: Any = None) -> int:
        """Return the number of visible rows."""
        return 0 if parent is not None and parent.isValid() else len(self._rows)

    def roleNames(self) -> dict[int, QtCore.QByteArray]:
        """Return the names of the roles for delegates."""
        return {role: QtCore.QByteArray(name.encode()) for role, name in self._names.items()}

    def data(self, index: Any, role: int = 0) -> Any:
        """Return a role of a row."""
        if not index.isValid() or role not in self._names or index.row() >= len(self._rows):
            return None
        return self._role(index.row(), self._names[role])

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
