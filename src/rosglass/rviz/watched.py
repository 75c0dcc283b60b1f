"""What RViz has several of, and Python follows: which came, which went, which changed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Signal
from rosglass.rviz.watch import Hook

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.rviz.window import Window

__all__ = ["Watched"]


class Watched(QtCore.QObject):
    """All tools, or all displays, of an RViz.

    Derived from: :meth:`_match` brings :attr:`_items` up to date, and :meth:`_rest` says what else
    there is to tell. Signals are sent when RViz has done with what it was doing, so that whoever
    hears them may add and remove items again.

    Args:
        window: RViz.
    """

    #: One came: itself.
    added = Signal(object)
    #: One went: itself.
    removed = Signal(object)
    #: One is another way than before: itself.
    changed = Signal(object)

    def __init__(self, window: Window) -> None:
        super().__init__()
        self._window = window
        #: Each has `handle`, None once it is gone, `exists`, and `refresh()`.
        self._items: list[Any] = []
        self._told: list[Any] = []
        self._scheduled = False
        self._hook = Hook(self._on_change)

    def settle(self) -> None:
        """Tell what has changed since it was told last."""
        self._scheduled = False
        self._match()
        before, self._told = self._told, list(self._items)
        tell_rest = self._rest()
        for item in before:
            if not item.exists:
                self.removed.emit(item)
        for item in self._told:
            if item not in before:
                self.added.emit(item)
            elif item.refresh():
                self.changed.emit(item)
        tell_rest()

    def _match(self) -> None:
        """Drop at once what RViz is about to delete, before its place goes to another object."""
        raise NotImplementedError(f"{type(self).__name__} has to give _match()")

    def _rest(self) -> Callable[[], None]:
        """Take note of what has changed beside the items; return what tells it."""
        raise NotImplementedError(f"{type(self).__name__} has to give _rest()")

    def _on_change(self) -> None:
        self._match()
        if not self._scheduled:
            self._scheduled = True
            QtCore.QTimer.singleShot(0, self.settle)
