"""A program that shows an interface written in QML; ``rosglass run`` is one."""

from __future__ import annotations

import os
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rosglass.comm import Handle
from rosglass.comm.log import warn_on_terminal
from rosglass.errors import Error
from rosglass.qml.elements.image_sinks import is_loading
from rosglass.qml.engine.language import translate_qt
from rosglass.qml.engine.log import LocationFormatter
from rosglass.qml.engine.process import (
    QuitOnSignal,
    close_network,
    end_process_within,
    quiet_qt,
    require_display,
)
from rosglass.qml.engine.session import Session
from rosglass.qml.run.modules import interface_file
from rosglass.qml.run.renderer_choice import choice
from rosglass.qml.run.runner import Runner, needs_widgets
from rosglass.qt import QtCore, QtGui, QtQml, QtQuick, optional, run_event_loop

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

__all__ = ["Application"]

#: Seconds after a signal by which the program ends, even if the robot does not respond.
_QUIT_TIMEOUT_S = 1.7


class Application(Handle):
    """A QML interface with its window and its node.

    :meth:`load` or :meth:`run` reads the file; objects that QML uses must be passed before::

        app = Application("cockpit.qml", url="ros1://robot:11311", context={"arm": arm})
        sys.exit(app.run())

    Must be created in the main thread. Creates the Qt application unless one exists.

    Args:
        file: The QML file; ``package://name/path`` for one in a ROS package.
        url: Address of the robot; empty for ``ROSGLASS_URL``.
        name: Node name, instead of the one in the file.
        session: The node to use instead of creating one; it stays open at the end.
        context: Objects that QML can use by name: QObjects, or plain values.
        import_paths: Further folders with QML modules; ``package://`` as well.
        arguments: The contents of ``Qt.application.arguments``.
        ros_arguments: Arguments of the node, ``--ros-args`` included; see :func:`rosglass.connect`.
        watch: Reload the interface whenever a file in its folder is saved.
        fullscreen: Fill the screen.
        kiosk: Fill the screen, and prevent closing it by accident: Alt-F4 is ignored, and an idle
            pointer is hidden. ``Qt.quit()``, Ctrl-C and SIGTERM end the program.
        renderer: "opengl", "software" (Qt's own renderer, without shaders), or "auto" for the
            software renderer if there is no graphics card and the file needs none.
        allow_network: Let Qt fetch images, QML files and modules from other machines, as QML and
            rich text may ask for. Otherwise network access is blocked in this process from now on.

    Raises:
        QmlError: The file or folder does not exist, or is not QML.
        UnsupportedError: There is no display.
        RosArgumentError: One of `ros_arguments` is not valid.
        Error: This is not the main thread; the Qt application cannot show windows; `session` is
            given together with arguments that describe one; a name in `context` is not a valid
            QML name; `renderer` is unknown, or another window has chosen a different one.
        SystemExit: Ctrl-C (130) or SIGTERM (143) arrived during construction; if the program has
            its own handler for the signal, that is called instead.
    """

    def __init__(
        self,
        file: str | os.PathLike[str],
        *,
        url: str = "",
        name: str = "",
        session: Session | None = None,
        context: Mapping[str, Any] | None = None,
        import_paths: Sequence[str | os.PathLike[str]] = (),
        arguments: Sequence[str] = (),
        ros_arguments: Sequence[str] = (),
        watch: bool = False,
        fullscreen: bool = False,
        kiosk: bool = False,
        renderer: str = "auto",
        allow_network: bool = False,
    ) -> None:
        if threading.current_thread() is not threading.main_thread():
            raise Error("a user interface must be made in the main thread of the program")
        if session is not None and (url or name or ros_arguments):
            raise Error("give either a session, or url, name and ros_arguments to make one of")
        for word in context or ():
            if not word.isidentifier() or word[0].isupper():
                raise Error(f"context: QML cannot use the name {word!r}: expected e.g. {'arm'!r}")
        # Qt would swallow a KeyboardInterrupt raised in a function that it calls.
        with _signals_deferred():
            path = interface_file(file)
            warn_on_terminal(LocationFormatter())
            #: The Qt application.
            self.qt: Any = QtCore.QCoreApplication.instance() or _qt_application(path, arguments)
            if not isinstance(self.qt, QtGui.QGuiApplication):
                raise Error(
                    "the program's Qt application can open no window: make a QGuiApplication"
                )
            self._owns_session = session is None
            #: The node that QML uses.
            self.session = session or Session(
                url or os.environ.get("ROSGLASS_URL", ""), name, arguments=ros_arguments
            )
            try:
                choice.prefer(renderer)
                if not allow_network:
                    close_network()
                self._runner = Runner(
                    path,
                    self.session,
                    watch=watch,
                    fullscreen=fullscreen,
                    kiosk=kiosk,
                    import_paths=import_paths,
                )
            except Error:
                self._close_session()
                raise
            # QML does not keep them alive.
            self._context = dict(context or {})
            self.prepare(self._set_context)
            self._loaded = self._closed = False

    @property
    def engine(self) -> QtQml.QQmlEngine:
        """The QML engine of the interface; a reload makes another one: see :meth:`prepare`."""
        return self._runner.engine

    def prepare(self, job: Callable[[QtQml.QQmlEngine], None]) -> None:
        """Call a function with the engine, and with that of each reload before it loads the file.

        Args:
            job: E.g. ``lambda engine: engine.addImageProvider("plots", Plots())``.

        Raises:
            Error: The job cannot be called.
        """
        self._runner.prepare(job)

    def _set_context(self, engine: QtQml.QQmlEngine) -> None:
        for word, value in self._context.items():
            engine.rootContext().setContextProperty(word, value)

    @property
    def window(self) -> QtQuick.QQuickWindow | None:
        """The window, or the first of several; None before it is loaded."""
        return self._runner.window

    @property
    def windows(self) -> list[QtQuick.QQuickWindow]:
        """All windows of the interface, including hidden ones."""
        return self._runner.windows()

    def load(self) -> None:
        """Show the interface; :meth:`run` calls this if it has not been called.

        If the file has errors and is watched, it is shown as soon as they are fixed.

        Raises:
            QmlError: The file has errors; the message lists them as ``file:line:column: text``.
        """
        with _signals_deferred():
            self._load()

    def _load(self) -> None:
        if not self._loaded:
            self._loaded = True
            self._runner.load()

    def reload(self) -> bool:
        """Reload the file; if it has errors, keep the current interface and show them over it."""
        self.load()
        return self._runner.reload()

    def grab(self) -> QtGui.QImage:
        """Return an image of the window; a null image if there is no window."""
        return self._runner.grab()

    @property
    def is_loading(self) -> bool:
        """True while a 3D view in the window reads files, such as the robot's meshes."""
        return self.window is not None and is_loading(self.window)

    def quit(self, code: int = 0) -> None:
        """Make :meth:`run` return; thread-safe."""
        self.session.executor.post(lambda: self._runner.exit(code))

    def run(self, *, end_process: bool = False) -> int:
        """Show the interface until it is closed, then close everything.

        Args:
            end_process: End the whole process within 2 s of the interface's end, even if a thread
                hangs; for programs that do nothing afterwards.

        Returns:
            The exit code: 0, the argument of ``Qt.exit()``, or 128 plus the signal's number after
            Ctrl-C (130) or SIGTERM (143).

        Raises:
            QmlError: The file has errors.
            Error: The application was closed, or Qt's event loop is already running.
        """
        if self._closed:
            raise Error("this application has been closed; make another one")
        if QtCore.QThread.currentThread().loopLevel():
            raise Error("Qt's event loop runs already: call load() and leave the rest to it")
        signals: list[int] = []

        def interrupted(number: int) -> None:
            signals.append(number)
            self.quit(128 + number)

        with QuitOnSignal(interrupted, _QUIT_TIMEOUT_S):
            try:
                self._load()
                code = self._runner.exit_code
                # A waiting call may have been asked to end before the event loop started.
                if code is None:
                    code = run_event_loop(self.qt)
                if signals:
                    code = 128 + signals[0]
                if end_process:
                    end_process_within(_QUIT_TIMEOUT_S, code)
            finally:
                self.close()
        return code

    def close(self) -> None:
        """Close the interface and its node; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._runner.close()
        self._close_session()

    def _close_session(self) -> None:
        if self._owns_session:
            self.session.close()


@contextmanager
def _signals_deferred() -> Iterator[None]:
    """Defer Ctrl-C and SIGTERM to the end of the block, for at most :data:`_QUIT_TIMEOUT_S`.

    The program's own signal handlers stay installed and run immediately.

    Raises:
        SystemExit: A signal arrived; with its exit code from :meth:`Application.run`.
    """
    received: list[int] = []
    with QuitOnSignal(received.append, _QUIT_TIMEOUT_S, keep_handlers=True):
        yield
    if received:
        raise SystemExit(128 + received[0])


def _qt_application(file: Path, arguments: Sequence[str]) -> QtGui.QGuiApplication:
    quiet_qt()
    connected = require_display()
    widgets = optional("QtWidgets") if needs_widgets(file) else None
    kind: Any = QtGui.QGuiApplication if widgets is None else widgets.QApplication
    app: QtGui.QGuiApplication = kind([str(file), *arguments])
    connected()
    translate_qt()
    app.setApplicationName(file.stem)
    app.setApplicationDisplayName(file.stem)
    return app
