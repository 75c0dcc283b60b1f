"""RViz's views: the kinds there are, which one is shown, and those that are saved."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm.names import similar
from rosglass.errors import Error
from rosglass.qt import QtCore, Signal
from rosglass.rviz.plugins import VIEW, declared
from rosglass.rviz.shown import shown
from rosglass.rviz.watch import Hook

if TYPE_CHECKING:
    from rosglass.rviz.window import Window

__all__ = ["Views"]

_LONGEST = 1000


class Views(QtCore.QObject):
    """The views of an RViz.

    Args:
        window: RViz.
    """

    #: Another kind of view is shown.
    kind_changed = Signal()
    #: Views were saved, removed or renamed.
    saved_changed = Signal()

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._manager = window.manager.getViewManager()
        self._told = (self.kind, self.saved)
        self._scheduled = False
        self._hook = Hook(self._on_change)
        self._hook.watch(self._manager, "currentChanged()", "configChanged()")

    @property
    def kinds(self) -> list[str]:
        """Ids of the kinds that there are, e.g. ``rviz/Orbit``."""
        return list(declared(VIEW))

    @property
    def kind(self) -> str:
        """Id of the kind that is shown."""
        return str(self._manager.getCurrent().getClassId())

    @kind.setter
    def kind(self, kind: str) -> None:
        # RViz crashes at one that it does not know.
        if kind not in declared(VIEW):
            raise Error(
                f"there is no kind of view {shown(kind)}{self._hint(kind)}; "
                f"there are {', '.join(self.kinds)}"
            )
        if kind != self.kind:
            self._manager.setCurrentViewControllerType(kind)
        self.settle()

    @property
    def saved(self) -> list[str]:
        """Names of the saved views, as in the Views panel; several may have the same."""
        manager = self._manager
        return [str(manager.getViewAt(at).getName()) for at in range(manager.getNumViews())]

    def save(self, name: str) -> None:
        """Save the view that is shown, in place of one of this name.

        Raises:
            Error: It is no name.
        """
        if not (isinstance(name, str) and name.strip() and name.isprintable()):
            raise Error(f"expected a name for the view, a text of one line, got {shown(name)}")
        if len(name) > _LONGEST:
            raise Error(f"expected a name of at most {_LONGEST} characters")
        if name in self.saved:
            self._manager.takeAt(self.saved.index(name)).deleteLater()
        self._manager.copyCurrentToList()
        self._manager.getViewAt(self._manager.getNumViews() - 1).setName(name)
        self.settle()

    def show(self, name: str | int) -> None:
        """Show a saved view.

        Args:
            name: Its name, or its place among the saved ones.

        Raises:
            Error: There is none of this name.
        """
        self._manager.setCurrentFrom(self._manager.getViewAt(self._index(name)))
        self.settle()

    def remove(self, name: str | int) -> None:
        """Remove a saved view; see :meth:`show`.

        Raises:
            Error: There is none of this name.
        """
        self._manager.takeAt(self._index(name)).deleteLater()
        self.settle()

    def settle(self) -> None:
        """Tell what has changed since it was told last."""
        self._scheduled = False
        (kind, saved), self._told = self._told, (self.kind, self.saved)
        if kind != self._told[0]:
            self.kind_changed.emit()
        if saved != self._told[1]:
            self.saved_changed.emit()

    def _hint(self, kind: object) -> str:
        if not isinstance(kind, str) or not kind:
            return ""
        base = kind.lower().rpartition("/")[2]
        like = [one for one in self.kinds if one.lower().endswith("/" + base)]
        return f"; did you mean {like[0]}?" if like else similar(kind, self.kinds)

    def _index(self, name: Any) -> int:
        saved = self.saved
        if isinstance(name, str) and name in saved:
            return saved.index(name)
        if isinstance(name, int) and not isinstance(name, bool) and 0 <= name < len(saved):
            return name
        there = f"saved are {', '.join(map(repr, saved))}" if saved else "none is saved yet"
        raise Error(f"there is no saved view {shown(name)}; {there}")

    def _on_change(self) -> None:
        if not self._scheduled:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self.settle)
