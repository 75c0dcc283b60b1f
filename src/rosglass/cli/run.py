"""``rosglass run``: open an interface written in QML."""

from __future__ import annotations

import gc
import logging
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.cli.output import note
from rosglass.errors import Error, QmlError, UnsupportedError
from rosglass.extras import install_command

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from rosglass.qml.run.application import Application
    from rosglass.scene.app.window_recorder import WindowRecorder

__all__ = [
    "Screenshot",
    "format_log",
    "load_qt",
    "make_recorder",
    "run",
    "show",
    "show_interface",
]

#: Seconds that a screenshot waits for meshes that are being read, and between two looks.
_LOADING_TIMEOUT_S, _LOADING_POLL_S = 30.0, 0.1
#: Seconds after which garbage is collected, which takes some 20 ms: not before the first frame.
_FIRST_COLLECTION_S = 1.0


def run(args: argparse.Namespace) -> int:
    """Show the interface until it is closed; returns the exit code.

    Raises:
        UnsupportedError: It is to be recorded by Qt 5, or without a graphics interface.
    """
    recorder = make_recorder(args)
    if recorder is not None:
        # Not the software renderer, which may be the faster one.
        args.renderer = "opengl"
    options = {"name": args.name, "import_paths": args.import_paths, "watch": args.watch}
    return show_interface(args, args.file, recorder=recorder, **options)


def make_recorder(args: argparse.Namespace) -> WindowRecorder | None:
    """Return the recorder of the window, by the command line; None without one.

    Raises:
        Error: The video cannot be written.
        UnsupportedError: It cannot be recorded by this Qt, or its renderer; or PyAV is missing.
    """
    if args.record is None:
        return None
    if args.renderer == "software" or os.environ.get("QT_QUICK_BACKEND") == "software":
        raise UnsupportedError(
            "--record: Qt's software renderer cannot be recorded: use --renderer opengl, unset "
            "QT_QUICK_BACKEND; without a graphics card, Mesa's llvmpipe will do"
        )
    try:
        load_qt()
        # Not all programs need numpy and PyAV.
        from rosglass.scene.app.window_recorder import WindowRecorder  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if not str(error.name).startswith("PySide6"):
            raise
        raise UnsupportedError(f"--record needs Qt 6: {install_command('qml')}") from None
    return WindowRecorder(args.record)


def show_interface(args: argparse.Namespace, file: str, **options: Any) -> int:
    """Show a QML file as the command line says; returns the exit code.

    Args:
        args: Arguments of a command with the options of interfaces.
        file: The file.
        options: Further options of :func:`show`.
    """
    try:
        return show(
            file,
            screenshot=None if args.screenshot is None else Path(args.screenshot),
            after=args.after,
            verbose=args.verbose > 1,
            end_process=True,
            longest_script=args.longest_script,
            url=args.url,
            fullscreen=args.fullscreen,
            kiosk=args.kiosk,
            renderer=args.renderer,
            allow_network=args.allow_network,
            arguments=args.arguments,
            ros_arguments=args.ros_arguments,
            **options,
        )
    except QmlError as error:
        print(error, file=sys.stderr)
        return 1


def load_qt() -> None:
    """Load Qt for a program of rosglass itself."""
    from rosglass.qt import import_plainly  # noqa: PLC0415 - loads Qt

    import_plainly()


def show(
    file: str,
    *,
    screenshot: Path | None = None,
    after: float = 2.0,
    verbose: bool = False,
    end_process: bool = False,
    longest_script: float = 5.0,
    recorder: WindowRecorder | None = None,
    **options: Any,
) -> int:
    """Show a QML file in a window until it is closed.

    Args:
        file: The file.
        screenshot: File for a screenshot of the window, after which the program ends.
        after: Seconds until the screenshot.
        verbose: Show what is logged for developers, too.
        end_process: End the process with the interface, whatever still runs in it.
        longest_script: As for :class:`rosglass.qml.Session`.
        recorder: The recorder of the window, while it is shown.
        options: As for :class:`rosglass.qml.Application`.

    Returns:
        The exit code: 0, what QML gave to ``Qt.exit()``, 130 after Ctrl-C.

    Raises:
        QmlError: The file is missing or has errors.
        UnsupportedError: There is no display.
        RosArgumentError: One of the arguments for ROS is not valid.
    """
    if screenshot is not None or recorder is not None:
        # Grabbing waits for the renderer, which may wait for Python.
        os.environ["QSG_RENDER_LOOP"] = "basic"

    # Nothing created until the first frame becomes garbage.
    gc.disable()
    try:
        code = _show(
            file, screenshot, after, verbose, end_process, longest_script, recorder, options
        )
        if end_process:
            from rosglass.qml.engine.process import end_process as end_now  # noqa: PLC0415 - with Qt

            end_now(code)
        return code
    except SystemExit as end:
        # A signal before anything was shown: objects would be deleted in any order.
        if end_process and isinstance(end.code, int):
            os._exit(end.code)
        raise
    finally:
        gc.enable()
        # At the end of the program, PySide deletes remaining objects in any order, and may crash.
        gc.collect()


def _show(
    file: str,
    screenshot: Path | None,
    after: float,
    verbose: bool,
    end_process: bool,
    longest_script: float,
    recorder: WindowRecorder | None,
    options: dict[str, Any],
) -> int:
    load_qt()
    from rosglass.qml.engine.log import install_message_handler  # noqa: PLC0415
    from rosglass.qml.run.application import Application  # noqa: PLC0415

    format_log(verbose)
    install_message_handler()
    app = Application(file, **options)
    app.session.longest_script = longest_script
    url = app.session.url

    def on_connection() -> None:
        # The URL can never work. Not if QML has set another one, or the file may be corrected.
        if app.session.state == "failed" and app.session.url == url and not options.get("watch"):
            app.quit(1)

    app.session.connection_changed.connect(on_connection)
    shot = None if screenshot is None else Screenshot(screenshot, after)

    def shown() -> None:
        if recorder is not None and app.window is not None:
            recorder.start(app.window)
            # What the window shows is in the video: a kiosk has no mark of it.
            note(f"recording to {recorder.path}")
        if shot is not None:
            shot.take(app.quit, lambda target: _save_connected(app, target), lambda: app.is_loading)

    _call_later(0.0, shown)
    _call_later(_FIRST_COLLECTION_S, gc.enable)
    if recorder is not None:
        # While the window exists, and the program may still take some seconds.
        app.qt.aboutToQuit.connect(recorder.close)
    code = app.run(end_process=end_process)
    if recorder is not None:
        code = _check_recording(recorder, code)
    return code if shot is None else shot.check(code)


def _check_recording(recorder: WindowRecorder, code: int) -> int:
    """Report the recording; return the program's exit code."""
    status = recorder.close()
    if not status.frames:
        note(status.problem or f"{recorder.path} was not written: the window was not drawn")
        return code or 1
    size = recorder.path.stat().st_size / 1e6
    lost = f", {status.dropped} DROPPED: the encoder is too slow" if status.dropped else ""
    note(f"{recorder.path}: {status.frames} frames, {status.duration:.1f} s, {size:.1f} MB{lost}")
    if status.problem:
        note(status.problem)
        return code or 1
    return code


class Screenshot:
    """The screenshot of ``--screenshot``, and whether it was taken.

    Args:
        target: The file.
        after: Seconds until it is taken.
    """

    def __init__(self, target: Path, after: float) -> None:
        self._target, self._after = target, after
        self._taken = False

    def take(
        self,
        end: Callable[[int], None],
        save: Callable[[Path], None],
        is_loading: Callable[[], bool] = lambda: False,
    ) -> None:
        """Take the screenshot after the given time.

        Args:
            end: Ends the program with an exit code.
            save: Writes the file; raises Error.
            is_loading: Whether to wait for what is still being read, for 30 s at most.
        """
        waits = iter(range(round(_LOADING_TIMEOUT_S / _LOADING_POLL_S)))

        def take() -> None:
            if is_loading():
                if next(waits, None) is not None:
                    _call_later(_LOADING_POLL_S, take)
                    return
                note(f"{self._target} does not show all: files are still being read")
            self._taken = True
            try:
                save(self._target)
            except Error as error:
                note(str(error))
                end(1)
            else:
                end(0)

        _call_later(self._after, take)

    def check(self, code: int) -> int:
        """Return the program's exit code, which is an error if no screenshot was taken."""
        if code == 0 and not self._taken:
            note(
                f"{self._target} was not written: the program was ended before {self._after:g} s "
                "were over (--after)"
            )
            return 1
        return code


def _save_connected(app: Application, target: Path) -> None:
    """Save a screenshot; raise Error, too, if a connection is impossible, as with a wrong --url."""
    _save(app, target)
    state = app.session.state
    text = f"{target} shows no robot: {app.session.detail or state}"
    if state == "failed":
        raise Error(text)
    if state in ("connecting", "lost"):
        note(text)


def _save(app: Application, target: Path) -> None:
    if app.window is None:
        raise UnsupportedError("the interface has no window to take a screenshot of")
    image = app.grab()
    if image.isNull():
        raise UnsupportedError(
            "Qt returned no image of the window, as Qt 5 does offscreen; use a virtual screen: "
            "xvfb-run -s '-screen 0 1280x800x24' rosglass run ..."
        )
    if not image.save(str(target)):
        raise UnsupportedError(
            f"the image could not be written to {target}; "
            "its folder must exist and its name end in .png or .jpg"
        )


def _call_later(delay_s: float, job: Callable[[], None]) -> None:
    from rosglass.qt import QtCore  # noqa: PLC0415

    QtCore.QTimer.singleShot(round(delay_s * 1000), job)


def format_log(verbose: bool) -> None:
    """Print messages of QML with file and line, from their logger's level on."""
    from rosglass.qml.engine.log import LocationFormatter  # noqa: PLC0415

    for handler in logging.getLogger().handlers:
        handler.setFormatter(LocationFormatter())
    logging.getLogger("rosglass.qml").setLevel(logging.DEBUG if verbose else logging.INFO)
