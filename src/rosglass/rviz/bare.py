"""RViz's window with nothing but the 3D view in it, for cockpits."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rosglass.qt import QtCore, Signal, is_alive
from rosglass.rviz.qt5 import QtWidgets

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["BareView"]

_KEY = "F10"


class BareView(QtCore.QObject):
    """Hides menu bar, tool bars, docked panels and status bar, and brings them back.

    The status bar stays while it says what is wrong (:meth:`warn`). Full screen of RViz itself
    leaves the docked panels.

    Args:
        window: RViz's main window.
    """

    changed = Signal()

    def __init__(self, window: Any) -> None:
        super().__init__()
        self._window = window
        self._on = self._warning = False
        self._hidden: list[Any] = []
        #: Also of the window itself: actions of a menu that is hidden have no keys.
        self._action = QtWidgets.QAction("&Bare 3D view", window)
        self._action.setShortcut(_KEY)
        self._action.setCheckable(True)
        self._action.toggled.connect(self._set)
        window.addAction(self._action)

    @property
    def action(self) -> Any:
        """What a menu shows for it."""
        return self._action

    @property
    def on(self) -> bool:
        """Whether there is nothing but the 3D view."""
        return self._on

    @on.setter
    def on(self, on: bool) -> None:
        self._action.setChecked(on)

    def warn(self, warning: bool) -> None:
        """Show the status bar, or no longer, whatever else is hidden."""
        self._warning = warning
        hidden = self._on or self._window.isFullScreen()
        self._window.statusBar().setVisible(warning or not hidden)

    def again(self) -> None:
        """Hide what RViz has brought back, now and once it is done with what it does."""
        self._hide()
        QtCore.QTimer.singleShot(0, self._hide)

    @contextmanager
    def lifted(self) -> Iterator[None]:
        """Show everything for a moment: RViz saves what is shown."""
        on = self.on
        self.on = False
        try:
            yield
        finally:
            if is_alive(self._window):
                self.on = on

    @QtCore.Slot(bool)
    def _set(self, on: bool) -> None:
        self._on = on
        if on:
            self._hide()
        else:
            hidden, self._hidden = self._hidden, []
            # RViz itself brings its bars back at the end of full screen.
            bars = (QtWidgets.QMenuBar, QtWidgets.QToolBar, QtWidgets.QStatusBar)
            full = self._window.isFullScreen()
            for part in hidden:
                if is_alive(part) and not (full and isinstance(part, bars)):
                    part.show()
        self.changed.emit()

    @QtCore.Slot()
    def _hide(self) -> None:
        if not self._on or not is_alive(self._window):
            return
        for part in self._parts():
            if not part.isHidden():
                part.hide()
                if part not in self._hidden:
                    self._hidden.append(part)
        if self._warning:
            self._window.statusBar().show()

    def _parts(self) -> list[Any]:
        window = self._window
        docks = [d for d in window.findChildren(QtWidgets.QDockWidget) if not d.isFloating()]
        # The only buttons beside the 3D view are those that fold the docks.
        folds = window.centralWidget().findChildren(QtWidgets.QToolButton)
        bars = window.findChildren(QtWidgets.QToolBar)
        return [window.menuBar(), window.statusBar(), *bars, *docks, *folds]
