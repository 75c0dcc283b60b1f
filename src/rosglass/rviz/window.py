"""RViz's main window and its config files."""

from __future__ import annotations

import math
import os
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from rosglass.comm.text_files import check_yaml
from rosglass.errors import Error
from rosglass.qml.run.modules import locate, near
from rosglass.qt import QtCore, Signal, is_alive
from rosglass.rviz.host import AfterEvent, as_pyside, pyqt, rviz
from rosglass.rviz.qt5 import QtCore as Qt5Core
from rosglass.rviz.qt5 import QtWidgets

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["BareView", "Window", "config_file"]


_BARE_VIEW_KEY = "F10"


class BareView(QtCore.QObject):
    """Hides menu bar, tool bars, docked panels and status bar, and shows them again.

    The status bar stays visible while it shows a problem (:meth:`warn`). RViz's own full screen
    mode does not hide docked panels.
    """

    changed = Signal()

    def __init__(self, window: Any) -> None:
        super().__init__()
        self._window = window
        self._on = self._warning = False
        self._hidden: list[Any] = []
        #: Also added to the window, because shortcuts of a hidden menu do not work.
        self._action = QtWidgets.QAction("&Bare 3D view", window)
        self._action.setShortcut(_BARE_VIEW_KEY)
        self._action.setCheckable(True)
        self._action.toggled.connect(self._set)
        window.addAction(self._action)

    @property
    def action(self) -> Any:
        """The action for the menu."""
        return self._action

    @property
    def on(self) -> bool:
        """True while only the 3D view is shown."""
        return self._on

    @on.setter
    def on(self, on: bool) -> None:
        self._action.setChecked(on)

    def warn(self, warning: bool) -> None:
        """Keep the status bar visible, or let it be hidden again."""
        self._warning = warning
        hidden = self._on or self._window.isFullScreen()
        self._window.statusBar().setVisible(warning or not hidden)

    def hide_again(self) -> None:
        """Hide parts that RViz has shown again, now and after the current event."""
        self._hide()
        QtCore.QTimer.singleShot(0, self._hide)

    @contextmanager
    def showing_everything(self) -> Iterator[None]:
        """Show everything temporarily, because RViz's config includes what is visible."""
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
            # RViz itself shows its bars again at the end of full screen.
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
        # The only tool buttons in the central widget hide the docked panels.
        folds = window.centralWidget().findChildren(QtWidgets.QToolButton)
        bars = window.findChildren(QtWidgets.QToolBar)
        return [window.menuBar(), window.statusBar(), *bars, *docks, *folds]


#: RViz's status message right before it creates the displays of a config file.
_LOADING_STATUS = "Creating displays"
#: Milliseconds that a window manager may take to resize a window to the screen.
_RESIZE_DELAY_MS = 300
_PACKAGE_PATH = "ROS_PACKAGE_PATH"
#: Key of the displays in a config file.
_DISPLAYS_KEY = "Visualization Manager"


class Window(QtCore.QObject):
    """RViz's main window in this process; once, because RViz's renderer cannot be restarted.

    Creating it waits for the ROS master without a timeout, so check first that the master answers.

    Args:
        config: The ``.rviz`` file; empty for RViz's default config.
        splash: Whether to show RViz's splash screen.

    Raises:
        Error: The file is missing or is not an RViz config.
    """

    #: RViz is about to draw a frame.
    before_frame = Signal()
    #: RViz is about to replace all its displays by those of a config file.
    config_loading = Signal()
    #: A config file was loaded, which replaces all displays, views and tools. Argument: its path.
    config_loaded = Signal(str)
    #: RViz enters or leaves full screen. Argument: whether it enters.
    fullscreen_changed = Signal(bool)
    #: The window was closed or is about to be destroyed: release all RViz objects.
    closing = Signal()

    def __init__(self, config: str | os.PathLike[str] = "", *, splash: bool = False) -> None:
        super().__init__()
        file = str(config_file(config)) if config else ""
        self._closing = False
        bindings = rviz()
        #: RViz's ``VisualizationFrame``, an object of its bindings.
        self.frame: Any = bindings.VisualizationFrame()
        if not splash:
            self.frame.setSplashPath("")
        with _with_stand_in_package():
            self.frame.initialize(file)
        #: RViz's ``VisualizationManager``.
        self.manager: Any = self.frame.getManager()
        #: The same window, an object of PySide2.
        self.widget = as_pyside(self.frame, QtWidgets.QMainWindow)
        #: The widget with the 3D view.
        self.panel = self._find_panel(QtWidgets.QWidget)
        self._wrapped = as_pyside(self.manager, QtCore.QObject)
        self._loading = self._resized_to_screen = False
        self._after_loading = AfterEvent(self._end_loading)
        self._normal_geometry: Any = None
        self._config = file
        self._menus: dict[str, Any] = {}
        #: Shows only the 3D view in the window.
        self.bare = BareView(self.widget)
        self.menu("&Panels").addAction(self.bare.action)
        self._close_watch = _CloseWatch(self.bare, self._emit_closing)
        self.widget.installEventFilter(self._close_watch)
        self._connect(self._wrapped, "preUpdate()", self.before_frame.emit)
        self._connect(self._wrapped, "statusUpdate(QString)", self._on_status)
        self._connect(self.widget, "displayConfigFileChanged(QString)", self._on_config)
        self._connect(self.widget, "fullScreenChange(bool)", self._on_fullscreen)

    @staticmethod
    def _connect(sender: Any, signal: str, slot: Any) -> None:
        Qt5Core.QObject.connect(sender, Qt5Core.SIGNAL(signal), slot)

    def _find_panel(self, kind: Any) -> Any:
        found = self.widget.findChildren(kind)
        return next(w for w in found if w.metaObject().className() == "rviz::RenderPanel")

    @property
    def ids(self) -> list[int]:
        """X window ids of the window and of the 3D view."""
        return [int(widget.winId()) for widget in (self.widget, self.panel)]

    def view_size(self) -> tuple[int, int, float]:
        """Return width and height of the 3D view in physical pixels, and its pixel ratio."""
        ratio = self.panel.devicePixelRatioF()
        # Round halves up, like Qt.
        width, height = self.panel.width() * ratio, self.panel.height() * ratio
        return math.floor(width + 0.5), math.floor(height + 0.5), ratio

    @property
    def config(self) -> str:
        """Path of the loaded config file; empty for RViz's default config."""
        return self._config

    @property
    def modified(self) -> bool:
        """True while there are unsaved changes."""
        return bool(self.widget.isWindowModified())

    def load_config(self, config: str | os.PathLike[str]) -> None:
        """Load a config file, discarding unsaved changes.

        Args:
            config: A path, or ``package://name/path``.

        Raises:
            Error: The file is missing or is not an RViz config.
        """
        file = str(config_file(config))
        self.widget.setWindowModified(False)
        self.frame.loadDisplayConfig(file)

    def save_config(self, config: str | os.PathLike[str] = "") -> None:
        """Save displays, views, tools and panels.

        Args:
            config: The file to write; empty for the loaded file.

        Raises:
            Error: The folder does not exist, or writing failed.
        """
        file = str(Path(config).absolute() if config else self._config)
        folder = Path(file).parent
        if not folder.is_dir():
            raise Error(f"{file}: RViz could not save its config: there is no folder {folder}")
        with self.bare.showing_everything():
            saved = self.frame.saveDisplayConfig(file)
        if not saved:
            raise Error(f"{file}: RViz could not save its config: {self.frame.getErrorMessage()}")

    def flush_panels(self) -> None:
        """Deliver the calls that are queued for RViz's panels, before properties are deleted.

        They show and hide properties by their addresses, and crash if these are deleted first.
        """
        for tree in self.widget.findChildren(QtWidgets.QTreeView):
            Qt5Core.QCoreApplication.sendPostedEvents(tree, Qt5Core.QEvent.MetaCall)

    @property
    def fullscreen(self) -> bool:
        """True while RViz fills the screen, without its menus and tool bars."""
        return bool(self.widget.isFullScreen())

    @fullscreen.setter
    def fullscreen(self, fullscreen: bool) -> None:
        if fullscreen != self.fullscreen:
            core = pyqt()
            core.QMetaObject.invokeMethod(
                self.frame, "setFullScreen", core.Qt.DirectConnection, core.Q_ARG(bool, fullscreen)
            )

    def menu(self, title: str) -> Any:
        """Return a menu of RViz's menu bar by its title, created if there is none.

        Args:
            title: The title; ``&`` marks the shortcut key.
        """
        bar, name = self.widget.menuBar(), _without_shortcut(title)
        menus = {_without_shortcut(m.title()): m for m in bar.findChildren(QtWidgets.QMenu)}
        found = self._menus.get(name) or menus.get(name)
        if found is None:
            found = QtWidgets.QMenu(title, bar)
            help_menu = menus.get("Help")
            if help_menu is None:
                bar.addMenu(found)
            else:
                bar.insertMenu(help_menu.menuAction(), found)
        # PySide2 deletes the menu when Python has no reference to it.
        self._menus[name] = found
        return found

    def close(self) -> None:
        """Hide the window, without asking about unsaved changes; safe to call twice."""
        self._emit_closing()
        self.widget.hide()

    def destroy(self) -> None:
        """Delete RViz; none of its objects may be used afterwards."""
        sip = pyqt("sip")
        if not sip.isdeleted(self.frame):
            sip.delete(self.frame)

    def _emit_closing(self) -> None:
        before, self._closing = self._closing, True
        if not before:
            self.closing.emit()

    def _on_fullscreen(self, fullscreen: bool) -> None:
        if fullscreen:
            self._normal_geometry = self.widget.geometry()
            QtCore.QTimer.singleShot(_RESIZE_DELAY_MS, self._fill_screen)
        elif self._resized_to_screen:
            self._resized_to_screen = False
            self.widget.setGeometry(self._normal_geometry)
        self.bare.hide_again()
        self.fullscreen_changed.emit(fullscreen)

    def _fill_screen(self) -> None:
        """Resize the window to the screen if no window manager has done so."""
        screen = self.widget.windowHandle().screen().geometry()
        if self.fullscreen and self.widget.size() != screen.size():
            self._resized_to_screen = True
            self.widget.setGeometry(screen)

    def _on_status(self, status: str) -> None:
        if status == _LOADING_STATUS:
            self._loading = True
            # RViz does not report failure to load a config.
            self._after_loading.schedule()
            self.config_loading.emit()

    def _end_loading(self) -> None:
        self._loading = False

    def _on_config(self, path: str) -> None:
        self._config = path
        loading, self._loading = self._loading, False
        self.bare.hide_again()
        if loading:
            self.config_loaded.emit(path)


@contextmanager
def _with_stand_in_package() -> Iterator[None]:
    """Provide a stand-in for the package media_export, which RViz searches for without need."""
    before = os.environ.get(_PACKAGE_PATH)
    stand_in = str(Path(__file__).with_name("media_export"))
    os.environ[_PACKAGE_PATH] = os.pathsep.join(filter(None, [before, stand_in]))
    try:
        yield
    finally:
        if before is None:
            del os.environ[_PACKAGE_PATH]
        else:
            os.environ[_PACKAGE_PATH] = before


def _without_shortcut(title: str) -> str:
    return title.replace("&", "")


class _CloseWatch(QtCore.QObject):
    """Event filter that calls a function when RViz's window was closed.

    Args:
        bare: The hidden parts, which RViz must see when it saves its config.
        closed: Called when RViz has accepted the close event; the user may cancel it.
    """

    def __init__(self, bare: BareView, closed: Callable[[], None]) -> None:
        super().__init__()
        self._bare, self._closed, self._handling_close = bare, closed, False

    def eventFilter(self, watched: QtCore.QObject, event: QtCore.QEvent) -> bool:  # noqa: N802
        """Send a close event to RViz with all parts shown; RViz may ask the user, and cancel it."""
        if event.type() != QtCore.QEvent.Type.Close or self._handling_close:
            return False
        self._handling_close = True
        with self._bare.showing_everything():
            QtCore.QCoreApplication.sendEvent(watched, event)
        self._handling_close = False
        if event.isAccepted():
            self._closed()
        return True


def config_file(source: str | os.PathLike[str]) -> Path:
    """Return the path of an RViz config file, after checking it.

    Args:
        source: A path, or ``package://name/path``.

    Raises:
        Error: The file does not exist, cannot be read, or is not an RViz config.
    """
    path = locate(source)
    if not path.is_file():
        wrong = "is a folder" if path.is_dir() else "does not exist"
        raise Error(f"{path} {wrong}; expected an RViz config file (.rviz){near(path)}")
    if path.suffix == ".qml":
        raise Error(f"{path} is a QML file, not an RViz config: use rosglass rviz --overlay {path}")
    try:
        # RViz expands aliases, and recurses into nested values.
        check_yaml(path.read_text(encoding="utf-8", errors="replace"))
    except (OSError, yaml.YAMLError) as error:
        raise Error(f"{path}: RViz cannot read it: {error}") from None
    bindings = rviz()
    reader, config = bindings.YamlConfigReader(), bindings.Config()
    reader.readFile(config, str(path))
    if reader.error():
        raise Error(f"{path}: RViz cannot read it: {reader.errorMessage()}")
    if not config.mapGetChild(_DISPLAYS_KEY).isValid():
        raise Error(f"{path} is not an RViz config: it has no {_DISPLAYS_KEY!r}")
    return path
