"""Shows a QML file in its windows, and reloads it when it changes."""

from __future__ import annotations

import logging
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.errors import QmlError
from rosglass.qml.elements.image_sinks import grab
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qml.run.live_file import (
    ERRORS,
    ERRORS_BELOW,
    NO_NODE,
    PANEL,
    SCRIPT_ENDED,
    ErrorView,
    LiveFile,
)
from rosglass.qml.run.renderer_choice import choice, need_in_file, need_in_items
from rosglass.qt import QtCore, QtGui, QtQml, QtQuick, Slot, is_alive, send_deferred_deletes

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from rosglass.qml.engine.session import Session


__all__ = ["Kiosk", "Runner", "needs_widgets"]

#: Milliseconds without movement after which the pointer is hidden.
_STILL = 3000


def _screen_of(window: QtGui.QWindow) -> QtGui.QScreen:
    """Return the screen that a window was given, or else that of its place."""
    given, middle = window.screen(), window.geometry().center()
    if given is not QtGui.QGuiApplication.primaryScreen():
        return given
    return QtGui.QGuiApplication.screenAt(middle) or given


class Kiosk(QtCore.QObject):
    """Keeps windows open, and hides an idle pointer.

    Closing a window, as Alt-F4 does, is ignored. ``Qt.quit()``, Ctrl-C and SIGTERM end the program.

    Args:
        app: The application; windows that open later are kept open once they get the focus.
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
        """Keep a window open; safe to call again."""
        if window is not None:
            # Installing the filter again only moves it to the front.
            window.installEventFilter(self)

    def close(self) -> None:
        """Show the pointer, and allow windows to be closed."""
        self._pause.stop()
        self._app.focusWindowChanged.disconnect(self.keep)
        for window in self._app.topLevelWindows():
            window.removeEventFilter(self)
        self._show()

    def eventFilter(self, watched: QtCore.QObject, event: Any) -> bool:  # noqa: ARG002, N802
        """Discard events that would close a window; Qt calls this before each event of a window."""
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


_log = logging.getLogger("rosglass.qml")
_DEFAULT_SIZE = (1024, 640)
_ERRORS = Path(__file__).with_name("ErrorOverlay.qml")
_ROS2_MODULE = re.compile(r"^\s*import\s+Ros2\b", re.MULTILINE)
_WIDGET_MODULES = re.compile(r"^\s*import\s+(QtCharts|Qt\.labs\.platform)\b", re.MULTILINE)


def needs_widgets(file: Path) -> bool:
    """Return whether an interface imports a module that needs a QApplication to avoid a crash."""
    return any(_WIDGET_MODULES.search(_text(path)) for path in {file, *file.parent.glob("*.qml")})


def _line_to_add(file: Path) -> str:
    """Return the lines to add to a file that does not call init()."""
    module = "Ros2" if _ROS2_MODULE.search(_text(file)) else "Ros"
    name = re.sub(r"\W+", "_", file.stem, flags=re.ASCII).strip("_").lower()
    name = name if name[:1].isalpha() else f"ui_{name}".rstrip("_")
    return (
        f"Add this line to the root object of {file}:\n\n"
        f'    Component.onCompleted: {module}.init("{name}")'
    )


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        # Qt's own message is better, if the line is needed at all.
        return ""


class Runner(QtCore.QObject):
    """Owns the engine, the interface and its windows.

    Args:
        file: The QML file.
        session: The node that the QML uses.
        watch: Reload whenever a file in its folder or in `import_paths` changes.
        fullscreen: Fill the screen; with several windows, all screens that they use.
        kiosk: Fill the screen, and prevent closing it by accident.
        import_paths: Further folders with QML modules.

    Raises:
        QmlError: There is no such file or folder.
    """

    def __init__(
        self,
        file: str | os.PathLike[str],
        session: Session,
        *,
        watch: bool = False,
        fullscreen: bool = False,
        kiosk: bool = False,
        import_paths: Sequence[str | os.PathLike[str]] = (),
    ) -> None:
        super().__init__()
        self._live = LiveFile(file, session, watch=watch, import_paths=import_paths)
        self.file, self.session = self._live.path, session
        self._fullscreen = fullscreen or kiosk
        self.prepare(self._follow)
        session.killed.connect(self._on_killed)
        session.forgotten.connect(self._on_forgotten)
        session.initialized.connect(self._on_initialized)
        #: The window around the interface, or the first of its own windows; None before.
        self.window: QtQuick.QQuickWindow | None = None
        #: The window whose first frame is still pending.
        self._awaited: QtQuick.QQuickWindow | None = None
        #: The exit code, once something has requested the end of the program.
        self.exit_code: int | None = None
        #: Whether we created `window`, for an interface that is not a window itself.
        self._own = False
        self._errors = ErrorView(self._live, _ERRORS)
        self._notice = ErrorView(self._live, PANEL)
        #: Whether the interface did not call init(), so that the line to add is shown.
        self._without_node = False
        self._live.script_ended.connect(self._show_script_ended)
        self._kiosk: Kiosk | None = None
        app: Any = QtCore.QCoreApplication.instance()
        if kiosk and app is not None:
            self._kiosk = Kiosk(app)

    @property
    def engine(self) -> QtQml.QQmlEngine:
        """The engine of the interface; a reload makes another one."""
        return self._live.engine

    def prepare(self, job: Callable[[QtQml.QQmlEngine], None]) -> None:
        """Call a function with the engine, and with each later one before it loads the file."""
        self._live.prepare(job)

    def _follow(self, engine: QtQml.QQmlEngine) -> None:
        engine.quit.connect(self._quit)
        engine.exit.connect(self.exit)

    def load(self) -> None:
        """Show the file; if it has errors and is watched, show it as soon as they are fixed.

        Raises:
            QmlError: The file has errors; the message lists them.
        """
        choice.expect(self.file)
        choice.choose(self.engine.importPathList())
        self.session.defer_connecting()
        try:
            made = self._live.create()
            self._live.replace(made, lambda: self._show(made.root))
            self._await_frame()
        except QmlError as error:
            self.session.go_on()
            if not self._live.watch:
                raise
            _log.error("%s", error)
            self._show_empty(str(error))
        self._live.due.connect(self.reload)

    def reload(self) -> bool:
        """Reload the file; if it has errors, keep the current interface and show them over it.

        Deferred while a call from QML waits: it would return into a destroyed interface.

        Returns:
            Whether the file is shown.
        """
        if not self._live.is_ready():
            return False
        started = time.perf_counter()
        before = {id(window): window for window in self.windows()}
        try:
            made = self._live.create()
        except QmlError as error:
            _log.error("%s", error)
            self._show_errors(str(error))
            return False
        self._errors.hide()
        self._notice.hide()

        def show() -> None:
            self._show(made.root, list(before.values()))
            for window in before.values():
                if window is not self.window and is_alive(window):
                    self._let_go(window)

        # While cleaning up, the old interface may shut down the node that the new one uses.
        self._live.replace(made, show)
        if self._without_node:
            self._on_forgotten()
        _log.info("%s reloaded in %.0f ms", self.file, (time.perf_counter() - started) * 1000)
        return True

    def windows(self) -> list[QtQuick.QQuickWindow]:
        """Return the windows of the interface, including hidden ones."""
        app: Any = QtCore.QCoreApplication.instance()
        found = [self.window] if self.window is not None and is_alive(self.window) else []
        mine = runtime_of(self.engine)
        for window in app.topLevelWindows():
            known = window in found or not isinstance(window, QtQuick.QQuickWindow)
            if not known and runtime_of(window) is mine:
                found.append(window)
        return found

    def grab(self) -> QtGui.QImage:
        """Return an image of the window; a null image if there is no window."""
        window = self.window
        return QtGui.QImage() if window is None else grab(window)

    def exit(self, code: int) -> None:
        """End the program; may be called before the event loop runs."""
        self.exit_code = code
        QtCore.QTimer.singleShot(0, lambda: QtCore.QCoreApplication.exit(code))

    def close(self) -> None:
        """Close the interface; safe to call twice."""
        if self._kiosk is not None:
            self._kiosk.close()
            self._kiosk = None
        window, self.window = self.window, None
        self._errors.hide()
        self._notice.hide()
        self._live.close()
        if is_alive(window) and window is not None:
            window.deleteLater()
        send_deferred_deletes()

    def _await_frame(self) -> None:
        if self.window is not None and self.window.isVisible():
            self._awaited = self.window
            self._awaited.frameSwapped.connect(self._on_frame)
        else:
            self.session.go_on()

    @Slot()
    def _on_frame(self) -> None:
        self.session.go_on()
        window, self._awaited = self._awaited, None
        if window is not None and is_alive(window):
            window.frameSwapped.disconnect(self._on_frame)

    def _show(self, root: QtCore.QObject, before: Sequence[QtQuick.QQuickWindow] = ()) -> None:
        old, was_own = self.window, self._own
        self._own = isinstance(root, QtQuick.QQuickItem)
        if isinstance(root, QtQuick.QQuickItem):
            stays = old is not None and was_own
            window = old if stays and old is not None else QtQuick.QQuickWindow()
            self._fit(root, window, first=not stays)
            self.window = window
            others = [w for w in self.windows() if w is not window and w not in before]
            wanted = [] if stays else [window]
        elif isinstance(root, QtQuick.QQuickWindow):
            self.window, wanted = root, [root]
            others = [w for w in self.windows() if w is not root and w not in before]
        else:
            self.window = None
            others = [w for w in self.windows() if w not in before]
            wanted = [w for w in others if w.isVisible()]
            self.window = next(iter(wanted or others), None)
            if not wanted:
                _log.warning("%s shows no window: none in it has `visible: true`", self.file)
        _keep_places([*wanted, *others], before)
        for window in {id(w): w for w in (*wanted, *others)}.values():
            window.sceneGraphError.connect(self._no_graphics)
            if self._kiosk is not None:
                self._kiosk.keep(window)
        if isinstance(root, QtQuick.QQuickItem):
            self._warn_not_drawn([root])
        else:
            windows = {id(w): w for w in (*wanted, *others)}.values()
            self._warn_not_drawn([window.contentItem() for window in windows])
        for window in wanted:
            if self._fullscreen:
                # X11 without a window manager would leave the window as large as it is.
                window.setGeometry(_screen_of(window).geometry())
                window.showFullScreen()
            elif not window.isVisible():
                window.show()

    def _show_empty(self, text: str) -> None:
        """Show errors while there is no interface."""
        window = self.window = QtQuick.QQuickWindow()
        self._own = True
        window.resize(*_DEFAULT_SIZE)
        window.setTitle(self.file.stem)
        window.show()
        self._show_errors(text)

    def _fit(self, item: QtQuick.QQuickItem, window: QtQuick.QQuickWindow, first: bool) -> None:
        """Put an item into a window, and keep it as large as the window."""
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

    def _let_go(self, window: QtQuick.QQuickWindow) -> None:
        """Close a window of the old interface, even if its handlers refuse."""
        if self._kiosk is not None:
            window.removeEventFilter(self._kiosk)
        window.setVisible(False)
        if runtime_of(window) is None:
            # Only our own window: QML destroys its windows with their root.
            window.deleteLater()

    def _show_errors(self, text: str) -> None:
        heading = ERRORS if self._live.made is None else ERRORS_BELOW
        self._errors.show(text, self.windows(), heading)

    @Slot(str)
    def _show_script_ended(self, text: str) -> None:
        self._notice.show(text, self.windows(), SCRIPT_ENDED)

    def _warn_not_drawn(self, items: Sequence[QtQuick.QQuickItem]) -> None:
        """Warn of items that only OpenGL can draw, which a reload may have added."""
        if choice.renderer != "software":
            return
        needs = [need for item in items if (need := need_in_items(item, self.file))]
        # Videos and grabs of items are not items, so search the file, too.
        for need in needs or [need_in_file(self.file, self.engine.importPathList())]:
            if need:
                _log.warning("%s", choice.missing_warning(need))

    def _no_graphics(self, error: Any, message: str) -> None:  # noqa: ARG002 - Qt's signature
        _log.error("the window cannot be drawn: %s; try --renderer software", message)
        self.exit(1)

    @Slot()
    def _on_forgotten(self) -> None:
        self._without_node = not self.session.is_initialized
        if self._without_node:
            self._notice.show(_line_to_add(self.file), self.windows(), NO_NODE)

    @Slot()
    def _on_initialized(self) -> None:
        if self._without_node:
            self._without_node = False
            self._notice.hide()

    @Slot()
    def _on_killed(self) -> None:
        # The interface may have called Qt.quit() when the node was shut down.
        if self.exit_code is None:
            _log.error("the interface ends with its node: %s", self.session.detail)
            self.exit(1)

    def _quit(self, *_: Any) -> None:
        self.exit(0)


def _keep_places(
    windows: Sequence[QtQuick.QQuickWindow], before: Sequence[QtQuick.QQuickWindow]
) -> None:
    """Move windows to the positions of those with the same title; a single one in any case."""
    places = {window.title(): window.geometry() for window in reversed(before)}
    for window in windows:
        if window in before:
            continue
        if window.title() in places:
            window.setGeometry(places[window.title()])
        elif len(windows) == len(before) == 1:
            window.setGeometry(before[0].geometry())
