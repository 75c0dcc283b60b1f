"""``rosglass run``: open an interface written in QML."""

from __future__ import annotations

import argparse
import gc
import logging
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosglass.cli.connecting import add_definitions_option, seconds
from rosglass.cli.output import note
from rosglass.errors import Error, QmlError, UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.qml.application import Application

__all__ = [
    "Picture",
    "add_allow_network",
    "add_import_paths",
    "add_longest_script",
    "add_renderer",
    "add_screenshot",
    "configure",
    "format_log",
    "point_in_time",
    "run",
    "show",
]

#: Qt's messages that are of no use to users of an interface.
_QUIET = "qt.multimedia.symbolsresolver=false;qt.multimedia.ffmpeg*=false;qt.qpa.theme*=false"


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "file",
        metavar="FILE.qml",
        help="the interface; package://name/path for a file in a package",
    )
    parser.add_argument(
        "--url",
        default="",
        help="URL of the robot, e.g. zenoh://192.168.1.5:7447, or replay:FILE for a "
        "recording; default: ROSGLASS_URL, or ROS's own variables, or the Zenoh router "
        "or ROS 1 master of this machine",
    )
    parser.add_argument("--name", default="", help="node name, instead of the one in the file")
    parser.add_argument(
        "--watch",
        action="store_true",
        help="reload the interface when a file in its folder is saved",
    )
    parser.add_argument(
        "--no-watch", dest="watch", action="store_false", help="do not reload (default)"
    )
    add_import_paths(parser)
    parser.add_argument("--fullscreen", action="store_true", help="fill the screen")
    parser.add_argument(
        "--kiosk",
        action="store_true",
        help="fill the screen, ignore attempts to close the window (Alt-F4), and hide an idle "
        "pointer; Ctrl-C, SIGTERM and Qt.quit() end it",
    )
    add_renderer(parser, "the interface")
    add_allow_network(parser)
    add_longest_script(parser)
    add_screenshot(parser, "the window", after=2.0)
    add_definitions_option(parser)
    parser.set_defaults(arguments=[], ros_arguments=[], looks_nearby=True)
    parser.epilog = (
        "Arguments after --ros-args are for ROS, as with ros2 run, e.g. -r chatter:=talk, "
        "-p speed:=1.5. Arguments after -- are passed to the interface, as "
        "Qt.application.arguments."
    )


def point_in_time(text: str) -> float:
    """Parse seconds from now, a day at most; for options."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 86_400:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds from 0 to 86400")
    return value


def add_import_paths(parser: argparse.ArgumentParser) -> None:
    """Declare the option for QML modules in unusual places."""
    parser.add_argument(
        "-I",
        dest="import_paths",
        metavar="FOLDER",
        action="append",
        default=[],
        help="a folder with QML modules, in addition to QML_IMPORT_PATH; may be repeated",
    )


def add_renderer(parser: argparse.ArgumentParser, what: str) -> None:
    """Declare the option that selects Qt's renderer."""
    parser.add_argument(
        "--renderer",
        choices=("auto", "opengl", "software"),
        default="auto",
        help=f"what draws {what}: OpenGL, Qt's software renderer (no shaders, particles and "
        "videos), or the faster one (auto, the default)",
    )


def add_allow_network(parser: argparse.ArgumentParser) -> None:
    """Declare the option that lets Qt load files of QML from other machines."""
    parser.add_argument(
        "--allow-network",
        action="store_true",
        help="let the interface load images, QML files and modules from other machines (http:)",
    )


def add_longest_script(parser: argparse.ArgumentParser) -> None:
    """Declare the option that limits how long JavaScript may block the interface."""
    parser.add_argument(
        "--longest-script",
        metavar="SECONDS",
        type=seconds,
        default=5.0,
        help="how long JavaScript may run at a time before it is interrupted, because it blocks "
        "the interface; 0 for no limit (default: %(default)g)",
    )


def add_screenshot(parser: argparse.ArgumentParser, what: str, after: float) -> None:
    """Declare the options that save a picture.

    Args:
        parser: Parser of the command.
        what: Content of the picture.
        after: Default of --after, in seconds.
    """
    parser.add_argument(
        "--screenshot",
        metavar="PICTURE",
        type=Path,
        help=f"save a screenshot of {what} (PNG, JPEG) and exit",
    )
    parser.add_argument(
        "--after",
        metavar="SECONDS",
        type=point_in_time,
        default=after,
        help="when to take the screenshot (default: %(default)s)",
    )


def run(args: argparse.Namespace) -> int:
    """Show the interface until it is closed; returns the exit code."""
    try:
        return show(
            args.file,
            screenshot=args.screenshot,
            after=args.after,
            verbose=args.verbose > 1,
            end_process=True,
            longest_script=args.longest_script,
            url=args.url,
            name=args.name,
            import_paths=args.import_paths,
            watch=args.watch,
            fullscreen=args.fullscreen,
            kiosk=args.kiosk,
            renderer=args.renderer,
            allow_network=args.allow_network,
            arguments=args.arguments,
            ros_arguments=args.ros_arguments,
        )
    except QmlError as error:
        print(error, file=sys.stderr)
        return 1


def show(
    file: str,
    *,
    screenshot: Path | None = None,
    after: float = 2.0,
    verbose: bool = False,
    end_process: bool = False,
    longest_script: float = 5.0,
    **options: Any,
) -> int:
    """Show a QML file in a window until it is closed.

    Args:
        file: The file.
        screenshot: Where to save a picture of the window, after which the program ends.
        after: Seconds until the screenshot.
        verbose: Show what is logged for developers, too.
        end_process: End the process soon after the interface, whatever still runs in it.
        longest_script: As for :class:`rosglass.qml.Session`.
        options: As for :class:`rosglass.qml.Application`.

    Returns:
        The exit code: 0, what QML gave to ``Qt.exit()``, 130 after Ctrl-C.

    Raises:
        QmlError: The file is missing or has errors.
        UnsupportedError: There is no display.
        RosArgumentError: One of the arguments for ROS is not valid.
    """
    # Qt reads these when it is loaded.
    os.environ["QT_LOGGING_RULES"] = ";".join(
        filter(None, [_QUIET, os.environ.get("QT_LOGGING_RULES", "")])
    )
    if screenshot is not None:
        # Grabbing waits for the renderer, which may wait for Python.
        os.environ["QSG_RENDER_LOOP"] = "basic"

    # Nothing created until the window is shown becomes garbage.
    gc.disable()
    try:
        return _show(file, screenshot, after, verbose, end_process, longest_script, options)
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
    options: dict[str, Any],
) -> int:
    from rosglass.qml.application import Application
    from rosglass.qml.log import install_message_handler
    from rosglass.qt import QtCore

    format_log(verbose)
    install_message_handler()
    app = Application(file, **options)
    app.session.longest_script = longest_script
    picture = None if screenshot is None else Picture(screenshot, after)

    def shown() -> None:
        gc.enable()
        if picture is not None:
            picture.take(app.quit, lambda target: _save(app, target))

    QtCore.QTimer.singleShot(0, shown)
    code = app.run(end_process=end_process)
    return code if picture is None else picture.check(code)


class Picture:
    """The picture of ``--screenshot``, and whether it was taken.

    Args:
        target: The file.
        after: Seconds until it is taken.
    """

    def __init__(self, target: Path, after: float) -> None:
        self._target, self._after = target, after
        self._taken = False

    def take(self, end: Callable[[int], None], save: Callable[[Path], None]) -> None:
        """Take it after the given time.

        Args:
            end: Ends the program with an exit code.
            save: Writes the file; raises Error.
        """
        from rosglass.qt import QtCore

        def take() -> None:
            self._taken = True
            try:
                save(self._target)
            except Error as error:
                note(str(error))
                end(1)
            else:
                end(0)

        QtCore.QTimer.singleShot(round(self._after * 1000), take)

    def check(self, code: int) -> int:
        """Return the program's exit code, which is an error if no picture was taken."""
        if code == 0 and not self._taken:
            note(
                f"{self._target} was not written: the program was ended before {self._after:g} s "
                "were over (--after)"
            )
            return 1
        return code


def _save(app: Application, target: Path) -> None:
    if app.window is None:
        raise UnsupportedError("the interface has no window to take a picture of")
    image = app.grab()
    if image.isNull():
        raise UnsupportedError(
            "Qt gave no picture of the window, as Qt 5 does offscreen; use a virtual screen: "
            "xvfb-run -s '-screen 0 1280x800x24' rosglass run ..."
        )
    if not image.save(str(target)):
        raise UnsupportedError(
            f"the picture could not be written to {target}; "
            "its folder must exist and its name end in .png or .jpg"
        )


def format_log(verbose: bool) -> None:
    """Print messages of QML with file and line, from their logger's level on."""
    from rosglass.qml.log import LocationFormatter

    for handler in logging.getLogger().handlers:
        handler.setFormatter(LocationFormatter())
    logging.getLogger("rosglass.qml").setLevel(logging.DEBUG if verbose else logging.INFO)
