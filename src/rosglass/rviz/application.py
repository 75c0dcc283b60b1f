"""RViz in this process, with overlays, as in ``rosglass rviz``."""

from __future__ import annotations

import logging
import os
import signal
import threading
from typing import TYPE_CHECKING, Any

from rosglass.comm import Handle
from rosglass.comm.log import warn_on_terminal
from rosglass.comm.names import validate_node_name
from rosglass.errors import ConnectionLostError, Error, UnsupportedError
from rosglass.overlay.rviz_object import ACCESS
from rosglass.overlay.view_controller import ViewKeys, ViewServices
from rosglass.qml.engine.log import LocationFormatter
from rosglass.qml.engine.process import (
    QuitOnSignal,
    close_network,
    end_process_within,
    require_display,
)
from rosglass.qml.engine.session import Session
from rosglass.qml.run.modules import import_folder
from rosglass.qt import QtCore, run_event_loop
from rosglass.ros1.options import Arguments, Ros1Options
from rosglass.rviz import roscpp
from rosglass.rviz.access import RvizAccess
from rosglass.rviz.entries import Entries, OverlayMenu
from rosglass.rviz.host import cpp_function, require_rviz
from rosglass.rviz.lost_screen import LostScreen
from rosglass.rviz.overlay import log_uncaught_errors
from rosglass.rviz.qml_overlay import QmlOverlay
from rosglass.rviz.qt5 import QtGui, QtWidgets
from rosglass.rviz.rendering import choice
from rosglass.rviz.roscpp import (
    MasterWatch,
    connect_beside_rviz,
    name_node,
    shared_arguments,
    wait_for_master,
)
from rosglass.rviz.stack import Stack
from rosglass.rviz.view_entry import ViewEntry
from rosglass.rviz.window import Window, config_file

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.overlay.overlay import Overlay

__all__ = ["Application"]

_log = logging.getLogger("rosglass.rviz")
#: rviz::RenderSystem::disableAntiAliasing(), before the first window.
_NO_ANTI_ALIASING = "_ZN4rviz12RenderSystem19disableAntiAliasingEv"
#: Seconds after a request to quit until the process ends, whatever RViz is doing.
_EXIT_TIMEOUT_S = 1.7
#: Milliseconds within which an overlay may choose the node's name.
_NODE_DELAY_MS = 2000
#: Milliseconds between checks that RViz's node is running.
_CHECK_PERIOD_MS = 300


class Application(Handle):
    """RViz with overlays, and the node of the overlays.

    ::

        with Application("robot.rviz", url="ros1://robot:11311") as app:
            app.add_qml("dashboard.qml")
            sys.exit(app.run())

    Create it in the main thread, once per process, because RViz's renderer cannot be restarted.
    It creates the Qt application unless there is one (of PySide2 or PyQt5), and waits for the ROS
    master, which the log and a window show.

    Args:
        config: The ``.rviz`` file, or ``package://name/path`` for one in a ROS package; empty for
            RViz's default config.
        url: The ROS 1 master of RViz and of the overlays, e.g. ``ros1://robot:11311``; empty for
            ``ROS_MASTER_URI``.
        name: Name of RViz's node; empty for ``rviz`` with a unique suffix, as in RViz itself.
        session: The session of the overlays, instead of a new one; it stays open after
            :meth:`close`.
        fixed_frame: RViz's fixed frame, instead of the config's.
        fullscreen: Whether to fill the screen.
        bare: Whether to show only the 3D view, without menu, tool bar, docked panels and status
            bar.
        splash: Whether to show RViz's splash screen.
        anti_aliasing: Whether to smooth edges in the 3D view. Without a graphics card, this makes
            each frame several times slower.
        renderer: Renderer of QML overlays: ``opengl``, ``software`` (Qt's software renderer,
            without shaders, particles and video), or ``auto`` for the faster one on this machine.
        allow_network: Whether Qt may load images, QML files and modules from other machines;
            otherwise network access is disabled for this process from now on.
        timeout: Seconds to wait for the master; None waits forever.
        import_paths: Additional folders with QML modules, also as ``package://`` URLs.
        arguments: Value of ``Qt.application.arguments`` in QML.
        ros_arguments: Remappings such as ``scan:=/robot/scan``, as on RViz's command line; they
            apply to the overlays' node, too, except for the name.

    Raises:
        UnsupportedError: RViz, its bindings or a display are missing; the message says what to
            install.
        ConnectionLostError: The master does not answer in time.
        RosArgumentError: One of `ros_arguments` is invalid.
        Error: A file is missing or broken, a name or address is invalid, this is not the main
            thread, or this process has created an RViz before.
        KeyboardInterrupt: Ctrl-C was pressed.
    """

    _made = False

    def __init__(
        self,
        config: str | os.PathLike[str] = "",
        *,
        url: str = "",
        name: str = "",
        session: Session | None = None,
        fixed_frame: str = "",
        fullscreen: bool = False,
        bare: bool = False,
        splash: bool = False,
        anti_aliasing: bool = True,
        renderer: str = "auto",
        allow_network: bool = False,
        timeout: float | None = None,
        import_paths: Sequence[str | os.PathLike[str]] = (),
        arguments: Sequence[str] = (),
        ros_arguments: Sequence[str] = (),
    ) -> None:
        if threading.current_thread() is not threading.main_thread():
            raise Error("RViz must be made in the main thread of the program")
        if Application._made:
            raise Error("this process has created an RViz before; its renderer cannot be restarted")
        if url and not url.startswith("ros1:"):
            raise Error(f"RViz is a program of ROS 1: expected its master, ros1://..., got {url}")
        remappings = Arguments.parse(ros_arguments)
        options = Ros1Options.parse(url or "ros1://", os.environ, remappings)
        options.namespace(None)
        if name:
            validate_node_name(name)
        if fixed_frame:
            _check_frame(fixed_frame)
        self._import_paths = [import_folder(path) for path in import_paths]
        require_rviz()
        choice.prefer(renderer)
        if not allow_network:
            close_network()
        if config:
            config_file(config)
        #: The Qt application.
        self.qt: Any = _qt_application(arguments)
        warn_on_terminal(LocationFormatter())
        self._unhook = log_uncaught_errors()
        self._closed = self._running = self._fullscreen = False
        self._fullscreen = fullscreen
        received: list[int] = []
        with QuitOnSignal(received.append, _EXIT_TIMEOUT_S, keep_handlers=True):
            answers = wait_for_master(options.master, timeout, lambda: bool(received))
            if answers:
                name_node(name or remappings.name, options)
                Application._made = True
                if not anti_aliasing:
                    cpp_function("librviz", _NO_ANTI_ALIASING)()
                #: RViz's window.
                self.window = Window(config, splash=splash)
        if received:
            _raise_signal(received[0])
        if not answers:
            raise ConnectionLostError(f"waiting for the master at {options.master} was cancelled")
        self.window.bare.on = bare
        self._owns_session = session is None
        #: The session of the overlays.
        self.session = session or Session(
            url or _master_url(options),
            connect=connect_beside_rviz,
            arguments=shared_arguments(options),
        )
        self.session.killed.connect(self._on_killed)
        self._screen = LostScreen(self.window.ids, [roscpp.shut_down, self._close_node])
        self.window.before_frame.connect(self._screen.check)
        #: Interface to RViz's tools, displays, views and camera.
        self.rviz = RvizAccess(self.window, self.session)
        self.session.shared[ACCESS] = self.rviz
        #: The overlays, lowest first.
        self.overlays = Stack(self.window)
        #: The overlays' entries in RViz's Displays panel.
        self.entries = Entries(
            self.window, self.overlays, self.session, self.rviz.frames, self._import_paths
        )
        self._menu = OverlayMenu(self.window, self.entries)
        #: The view controller of RViz's camera.
        self.view = self.rviz.view
        #: Keyboard navigation.
        self.view_keys = ViewKeys(
            self.window.panel, self.view, self.window.before_frame, self._focus_is_elsewhere
        )
        self.window.closing.connect(self.view_keys.close)
        #: The ROS topics and services of the camera.
        self.view_services = ViewServices(self.view, self.session, self.node_name)
        #: The view controller's entry in the Displays panel.
        self.view_entry = ViewEntry(self.window, self.entries, self.view, self.view_services)
        #: Monitors RViz's ROS master.
        self.master = MasterWatch(options.master)
        self.master.problem_changed.connect(self._show_problem)
        self._problem: Any = None
        self._timer = QtCore.QTimer()
        self._timer.timeout.connect(self._check_node)
        self._timer.start(_CHECK_PERIOD_MS)
        self.window.closing.connect(self._on_closing)
        if fixed_frame:
            self.fixed_frame = fixed_frame

    @property
    def node_name(self) -> str:
        """Full name of RViz's own node."""
        return roscpp.node_name()

    @property
    def fixed_frame(self) -> str:
        """RViz's fixed frame; if it does not exist, RViz's status says so."""
        return str(self.window.manager.getFixedFrame())

    @fixed_frame.setter
    def fixed_frame(self, frame: str) -> None:
        _check_frame(frame)
        self.window.manager.setFixedFrame(frame)

    def load_config(self, config: str | os.PathLike[str]) -> None:
        """Load a ``.rviz`` file; see :meth:`Window.load_config`."""
        self.window.load_config(config)

    def save_config(self, config: str | os.PathLike[str] = "") -> None:
        """Save RViz's config to a ``.rviz`` file; see :meth:`Window.save_config`."""
        self.window.save_config(config)

    def add(self, overlay: Overlay) -> Overlay:
        """Show an overlay.

        Raises:
            Error: The name is taken.
        """
        self.overlays.add(overlay)
        return overlay

    def add_qml(self, file: str | os.PathLike[str], name: str = "", **options: Any) -> QmlOverlay:
        """Show a QML file over the 3D view.

        Args:
            file: The file, or ``package://name/path`` for one in a ROS package.
            name: The overlay's name; empty for the file's, numbered if that is taken.
            options: Options of :class:`QmlOverlay`.

        Raises:
            QmlError: The file is missing, or has errors and is not watched.
            Error: The name is taken.
        """
        paths = [*self._import_paths, *options.pop("import_paths", ())]
        overlay = QmlOverlay(file, self.session, name, import_paths=paths, **options)
        if not name:
            overlay.name = self.overlays.free_name(overlay.name)
        try:
            overlay.load()
            self.add(overlay)
        except Error:
            overlay.close()
            raise
        return overlay

    def show(self) -> None:
        """Show RViz's window; :meth:`run` calls this."""
        self.window.widget.show()
        if self._fullscreen:
            self.window.fullscreen = True
        self._fullscreen = False

    def connect(self) -> None:
        """Create the overlays' node as RViz's node name plus ``_overlays``, unless an overlay did.

        :meth:`run` calls this after two seconds, because the node provides the camera's services.
        """
        if not self._closed and not self.session.is_initialized:
            namespace, _, name = self.node_name.rpartition("/")
            self.session.init(f"{name}_overlays", namespace or "/")

    def run(self, *, end_process: bool = False) -> int:
        """Show RViz until it is closed.

        Args:
            end_process: Whether to end the process soon after, even if threads still run.

        Returns:
            The exit code: 0, the argument of :meth:`quit`, 130 after Ctrl-C, or 143 after SIGTERM.
        """
        self.show()
        QtCore.QTimer.singleShot(_NODE_DELAY_MS, self.connect)
        self._running = True
        with QuitOnSignal(lambda number: self.quit(128 + number), _EXIT_TIMEOUT_S):
            code = run_event_loop(self.qt)
            self._running = False
            if end_process:
                end_process_within(_EXIT_TIMEOUT_S, code)
            self.close()
        return code

    def quit(self, code: int = 0) -> None:
        """Make :meth:`run` return, without asking about unsaved changes; thread-safe."""
        self.session.executor.post(lambda: QtCore.QCoreApplication.exit(code))

    def screenshot(self, file: str | os.PathLike[str]) -> None:
        """Save a screenshot of RViz's window, including 3D view and overlays.

        Args:
            file: The image file; its suffix determines the format, e.g. PNG or JPEG.

        Raises:
            Error: The window is not shown, or the file cannot be written.
        """
        self.rviz.picker.screenshot(file, window=True)

    def close(self) -> None:
        """Close RViz, its overlays and the node; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        steps: list[Callable[[], object]] = [
            self._timer.stop,
            lambda: self.session.killed.disconnect(self._on_killed),
            self.master.close,
            self.window.close,
            self.view_entry.close,
            self.entries.close,
            self.overlays.close,
            self.view_services.close,
            lambda: self.session.shared.pop(ACCESS, None),
            self.rviz.close,
            *([self.session.close] if self._owns_session else []),
            roscpp.shut_down,
            self._screen.close,
            self.window.destroy,
        ]
        for step in steps:
            _attempt(step)
        self._unhook()

    def _focus_is_elsewhere(self) -> bool:
        """Return whether an overlay has the keyboard focus, or is modal."""
        overlays = self.overlays
        return overlays.input.focused is not None or any(
            one.is_modal for one in overlays.topmost_first()
        )

    def _close_node(self) -> None:
        node = self.session.node
        if node is not None:
            node.close()

    def _on_closing(self) -> None:
        if self._running:
            QtCore.QCoreApplication.exit(0)
        elif not self._closed:
            # RViz is still handling the close event.
            QtCore.QTimer.singleShot(0, self.close)

    def _check_node(self) -> None:
        if roscpp.is_running():
            return
        self._timer.stop()
        _log.error(
            "RViz exits: its node %s was shut down, by rosnode kill or a node of the same name",
            self.node_name,
        )
        self.quit()

    def _on_killed(self) -> None:
        _log.error("RViz exits, because the overlays' node was shut down: %s", self.session.detail)
        self.quit(1)

    def _show_problem(self, problem: str) -> None:
        if self._problem is None:
            self._problem = QtWidgets.QLabel()
            self._problem.setObjectName("masterProblem")
            self._problem.setStyleSheet("color: white; background: #a02020; padding: 2px")
            self.window.widget.statusBar().insertWidget(0, self._problem)
        self._problem.setText(self.master.advice)
        self._problem.setToolTip(problem)
        self._problem.setVisible(bool(problem))
        self.window.bare.warn(bool(problem))


def _qt_application(arguments: Sequence[str]) -> Any:
    """Return the Qt application of the process, created if there is none.

    Raises:
        UnsupportedError: No display is available that RViz can draw on.
    """
    existing = QtCore.QCoreApplication.instance()
    if existing is not None:
        if not existing.inherits("QApplication") or QtGui.QGuiApplication.platformName() != "xcb":
            raise UnsupportedError(
                "RViz needs a QApplication on X11: make one, with QT_QPA_PLATFORM=xcb on Wayland"
            )
        return existing
    platform = os.environ.setdefault("QT_QPA_PLATFORM", "xcb")
    if platform != "xcb":
        # On Wayland, RViz needs XWayland.
        raise UnsupportedError(
            f"RViz draws on X11 only, and QT_QPA_PLATFORM is {platform}: unset it; without a "
            "screen, use a virtual one: xvfb-run -s '-screen 0 1280x800x24' rosglass rviz ..."
        )
    connected = require_display()
    made = QtWidgets.QApplication(["rosglass", *arguments])
    connected()
    return made


def _master_url(options: Ros1Options) -> str:
    """Return the master's URL as ``ros1://host:port``; ``ros1://`` if its URI has a path."""
    master = options.master.removeprefix("http://")
    return "ros1://" if "/" in master else f"ros1://{master}"


def _check_frame(frame: str) -> None:
    if not frame or frame != frame.strip() or frame.startswith("/"):
        raise Error(f"fixed_frame: expected the name of a frame, e.g. 'map', got {frame!r}")


def _attempt(step: Callable[[], object]) -> None:
    """Run a step of closing; log its errors, because a half-closed RViz crashes the process."""
    try:
        step()
    except Exception:  # the other steps still have to run
        _log.exception("closing RViz: a step failed, continuing with the next one")


def _raise_signal(number: int) -> None:
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)
