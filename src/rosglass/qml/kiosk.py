"""A screen that an operator cannot leave by accident."""

from __future__ import annotations

from typing import Any

from rosglass.qt import QtCore, QtGui

__all__ = ["Kiosk"]

#: Milliseconds without a movement after which the pointer disappears.
_STILL = 3000


class Kiosk(QtCore.QObject):
    """Keeps windows open, and hides the pointer while nobody moves it.

    Closing a window, as Alt-F4 does, is ignored. ``Qt.quit()``, Ctrl-C and SIGTERM end the program.

    Args:
        app: The application; windows that open later are kept open once they have the focus.
    """

    def __init__(self, app: QtGui.QGuiApplication) -> None:
        super().__init__()
        self._app = app
        self._kinds = QtCore.QEvent.Type
        self._moves = {
            self._kinds.MouseMove,
            self._kinds.MouseButtonPress,
            self._kinds.Wheel,
            self._kinds.TabletMove,
        }
        #: Whether the pointer is hidden.
        self.hidden = False
        self._pause = QtCore.QTimer(self)
        self._pause.setSingleShot(True)
        self._pause.setInterval(_STILL)
        self._pause.timeout.connect(self._hide)
        self._pause.start()
        app.focusWindowChanged.connect(self.keep)

    def keep(self, window: QtGui.QWindow | None) -> None:
        """Keep a window open; it may be given again."""
        if window is not None:
            # Installing a filter again moves it to the front.
            window.installEventFilter(self)

    def close(self) -> None:
        """Show the pointer, and let windows be closed."""
        self._pause.stop()
        self._app.focusWindowChanged.disconnect(self.keep)
        for window in self._app.topLevelWindows():
            window.removeEventFilter(self)
        self._show()

    def eventFilter(self, watched: QtCore.QObject, event: Any) -> bool:  # noqa: ARG002, N802
        """Take what would close a window; Qt calls this before every event of a window."""
        kind = event.type()
        if kind == self._kinds.Close:
            event.ignore()
            return True
        if kind in self._moves:
            self._show()
            self._pause.start()
        return False

    def _hide(self) -> None:
        if not self.hidden:
            self.hidden = True
            self._app.setOverrideCursor(QtGui.QCursor(QtCore.Qt.CursorShape.BlankCursor))

    def _show(self) -> None:
        if self.hidden:
            self.hidden = False
            self._app.restoreOverrideCursor()
