"""Showing a QML file in a window, and showing it anew when it changes."""

from __future__ import annotations

import logging
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.errors import QmlError
from rosglass.qml.log import plain_path
from rosglass.qml.modules import install
from rosglass.qml.watcher import Watcher
from rosglass.qt import QtCore, QtGui, QtQml, QtQuick, is_alive, send_deferred_deletes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.qml.session import Session

__all__ = ["Runner", "needs_widgets"]

_log = logging.getLogger("rosglass.qml")
_DEFAULT_SIZE = (1024, 640)
_OVERLAY = Path(__file__).with_name("ErrorOverlay.qml")
_WIDGET_MODULES = re.compile(r"^\s*import\s+(QtCharts|Qt\.labs\.platform)\b", re.MULTILINE)


def needs_widgets(file: Path) -> bool:
    """Return whether an interface imports a module that crashes without a QApplication."""
    return any(_WIDGET_MODULES.search(_text(path)) for path in {file, *file.parent.glob("*.qml")})


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        # Qt says it better, if it is needed at all.
        return ""


class Runner(QtCore.QObject):
    """Holds the engine, the window and the interface in it.

    Args:
        file: The QML file.
        session: The node its QML talks through.
        watch: Show it anew whenever a file in its folder changes.
        fullscreen: Fill the screen.

    Raises:
        QmlError: The file is missing or has errors; the message lists them.
    """

    def __init__(
        self, file: Path, session: Session, *, watch: bool = False, fullscreen: bool = False
    ) -> None:
        super().__init__()
        self.file, self.session = file.absolute(), session
        self._fullscreen = fullscreen
        self.engine = QtQml.QQmlEngine()
        install(self.engine, session)
        self.engine.quit.connect(self._quit)
        self.engine.exit.connect(self._exit)
        #: The window the interface is in; None for an interface that opens its own.
        self.window: QtQuick.QQuickWindow | None = None
        self._root: QtCore.QObject | None = None
        # Must live as long as its root: dropping it destroys the root.
        self._component: QtQml.QQmlComponent | None = None
        self._overlay: tuple[Any, Any] | None = None
        # Before anything is read, so that no change in between goes unnoticed.
        self._watcher = Watcher(self.file.parent) if watch else None
        try:
            self._show(*self._create())
        except QmlError:
            self.close()
            raise
        if self._watcher is not None:
            self._watcher.changed.connect(self.reload)

    def reload(self) -> bool:
        """Show the file as it is now; with errors, keep what is shown and show them over it."""
        started = time.perf_counter()
        self.engine.clearComponentCache()
        try:
            root, component = self._create()
        except QmlError as error:
            _log.error("%s", error)
            self._show_errors(str(error))
            return False
        self._hide_errors()
        # Cleaning up, the old interface may shut Ros2 down, which the new one already uses.
        self.session.holding = True
        old_root, old_component = self._root, self._component
        self._show(root, component)
        if isinstance(old_root, QtQuick.QQuickWindow):
            old_root.close()
        if is_alive(old_root) and old_root is not None:
            # Component.onDestruction runs a little after this signal.
            old_root.destroyed.connect(
                lambda: QtCore.QTimer.singleShot(0, lambda: self._reloaded(old_component))
            )
            old_root.deleteLater()
        _log.info("%s reloaded in %.0f ms", self.file, (time.perf_counter() - started) * 1000)
        return True

    def grab(self) -> QtGui.QImage:
        """Return what the window shows; a null image when there is none."""
        window = self.window
        return QtGui.QImage() if window is None else window.grabWindow()

    def close(self) -> None:
        """Take the interface down; safe to call twice."""
        root, self._root = self._root, None
        window, self.window = self.window, None
        self._hide_errors()
        for item in (root, window, self._component, self.engine):
            if is_alive(item) and item is not None:
                item.deleteLater()
        self._component = None
        send_deferred_deletes()

    def _create(self) -> tuple[QtCore.QObject, QtQml.QQmlComponent]:
        if not self.file.is_file():
            raise QmlError(f"{self.file}: there is no such file")
        component = QtQml.QQmlComponent(self.engine, QtCore.QUrl.fromLocalFile(str(self.file)))
        root: QtCore.QObject | None = None if component.isError() else component.create()
        if root is None:
            raise QmlError(_error_list(component.errors(), self.file))
        return root, component

    def _show(self, root: QtCore.QObject, component: QtQml.QQmlComponent) -> None:
        before = self.window
        if isinstance(root, QtQuick.QQuickItem):
            own = before is not None and before is not self._root
            window = before if own and before is not None else QtQuick.QQuickWindow()
            self._fit(root, window, first=not own)
        elif isinstance(root, QtQuick.QQuickWindow):
            window = root
            if before is not None:
                window.setGeometry(before.geometry())
        else:
            self._root, self._component, self.window = root, component, None
            return
        self._root, self._component, self.window = root, component, window
        if window is before:
            return
        window.sceneGraphError.connect(self._no_graphics)
        if self._fullscreen:
            window.showFullScreen()
        elif not window.isVisible():
            window.show()
        if before is not None and before is not self._root and is_alive(before):
            before.close()

    def _fit(self, item: QtQuick.QQuickItem, window: QtQuick.QQuickWindow, first: bool) -> None:
        """Put an item into a window, which then gives it its size."""
        if first:
            width = item.width() or item.implicitWidth() or _DEFAULT_SIZE[0]
            height = item.height() or item.implicitHeight() or _DEFAULT_SIZE[1]
            window.resize(round(width), round(height))
        title = item.property("title")
        window.setTitle(title if isinstance(title, str) and title else self.file.stem)
        item.setParentItem(window.contentItem())

        def resize() -> None:
            if is_alive(item) and is_alive(window):
                item.setSize(QtCore.QSizeF(window.width(), window.height()))

        window.widthChanged.connect(resize)
        window.heightChanged.connect(resize)
        resize()

    def _reloaded(self, old_component: QtQml.QQmlComponent | None) -> None:
        self.session.holding = False
        if is_alive(old_component) and old_component is not None:
            old_component.deleteLater()
        if is_alive(self.engine):
            # Publishers of the old interface live until they are collected.
            self.engine.collectGarbage()

    def _show_errors(self, text: str) -> None:
        window = self.window
        if window is None:
            return
        if self._overlay is None:
            component = QtQml.QQmlComponent(self.engine, QtCore.QUrl.fromLocalFile(str(_OVERLAY)))
            overlay: Any = component.create()
            overlay.setParentItem(window.contentItem())
            self._overlay = (overlay, component)
        self._overlay[0].setProperty("text", text)

    def _hide_errors(self) -> None:
        overlay, self._overlay = self._overlay, None
        if overlay is not None:
            overlay[0].deleteLater()

    def _no_graphics(self, error: Any, message: str) -> None:  # noqa: ARG002 - Qt's signature
        _log.error("the window cannot be drawn: %s; try QT_QUICK_BACKEND=software", message)
        self._exit(1)

    def _quit(self, *_: Any) -> None:
        self._exit(0)

    def _exit(self, code: int) -> None:
        # Also works when it is asked for before the event loop runs.
        QtCore.QTimer.singleShot(0, lambda: QtCore.QCoreApplication.exit(code))


def _error_list(errors: Sequence[QtQml.QQmlError], file: Path) -> str:
    """Return errors as ``file:line:column: message``, one per line."""
    lines = []
    for error in errors:
        place = plain_path(error.url().toString()) or str(file)
        lines.append(
            f"{place}:{max(error.line(), 0)}:{max(error.column(), 0)}: {error.description()}"
        )
    return "\n".join(lines) or f"{file}:0:0: it could not be created"
