"""``rosglass rviz``: open RViz with interfaces over its 3D view."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rosglass.cli.completion import complete_files
from rosglass.cli.connecting import add_definitions_option, seconds
from rosglass.cli.run import (
    Picture,
    add_allow_network,
    add_import_paths,
    add_longest_script,
    add_renderer,
    add_screenshot,
    format_log,
)
from rosglass.errors import Error, QmlError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from rosglass.rviz import Application

__all__ = ["configure", "run"]

#: Seconds after a signal until the program ends, whatever RViz is doing.
_QUIT_TIMEOUT_S = 1.7


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    config = parser.add_argument(
        "config",
        metavar="CONFIG.rviz",
        nargs="*",
        help="RViz's config; package://name/path for a file in a package (default: RViz's own "
        "default). Also remappings, as for RViz: scan:=/robot/scan",
    )
    complete_files(config, "rviz")
    overlay = parser.add_argument(
        "--overlay",
        dest="overlays",
        metavar="FILE.qml",
        action="append",
        default=[],
        help="an interface over the 3D view; package://name/path for a file in a package; may be "
        "repeated, the last one is uppermost",
    )
    complete_files(overlay, "qml")
    parser.add_argument(
        "--url",
        default="",
        help="the ROS master of RViz and the interfaces, e.g. ros1://192.168.1.5:11311; default: "
        "ROS_MASTER_URI",
    )
    parser.add_argument("--name", default="", help="name of RViz's node (default: a unique one)")
    parser.add_argument(
        "--timeout",
        metavar="SECONDS",
        type=seconds,
        help="time to wait for the master (default: no limit)",
    )
    parser.add_argument(
        "--watch",
        action="store_true",
        help="reload interfaces when a file in their folders is saved",
    )
    add_import_paths(parser)
    parser.add_argument(
        "--fixed-frame",
        metavar="FRAME",
        default="",
        help="the fixed frame, instead of the one in the config",
    )
    parser.add_argument("--fullscreen", action="store_true", help="fill the screen")
    parser.add_argument(
        "--bare",
        action="store_true",
        help="show only the 3D view, without RViz's menu, tool bar and panels (F10 shows them)",
    )
    parser.add_argument("--splash", action="store_true", help="show RViz's splash screen")
    parser.add_argument(
        "--disable-anti-aliasing",
        action="store_true",
        help="draw the 3D view without anti-aliasing: much faster without a graphics card",
    )
    add_renderer(parser, "interfaces in QML")
    add_allow_network(parser)
    add_longest_script(parser)
    add_screenshot(parser, "RViz's window", after=3.0)
    add_definitions_option(parser)
    parser.set_defaults(arguments=[], ros_arguments=[], ros1=True)
    parser.epilog = (
        "The menu Overlays > View controller configures the camera: keyboard control, and the "
        "namespace of its topics and services (/rviz/hector_view_controller with --name rviz); "
        "the .rviz file stores it. "
        "Needs RViz 1 and the system's own Python: docs/rviz.md. Arguments after --ros-args, and "
        "remappings, are for ROS. Arguments after -- are passed to the interfaces, as "
        "Qt.application.arguments."
    )


def run(args: argparse.Namespace) -> int:
    """Show RViz until it is closed; returns the exit code."""
    remappings = [word for word in args.config if ":=" in word]
    configs = [word for word in args.config if ":=" not in word]
    if len(configs) > 1:
        raise Error(f"RViz shows one config: expected one file, got {', '.join(configs)}")
    from rosglass.rviz.requirements import require_bindings

    require_bindings()
    os.environ["ROSGLASS_QT"] = "pyside2"
    received: list[int] = []
    with _noting_signals(received):
        from rosglass.qml.process import QuitOnSignal

        with QuitOnSignal(received.append, _QUIT_TIMEOUT_S):
            try:
                return _show(args, configs[0] if configs else "", remappings, received)
            except QmlError as error:
                print(error, file=sys.stderr)
                return 1


@contextmanager
def _noting_signals(received: list[int]) -> Iterator[None]:
    """Keep KeyboardInterrupt from modules that would abort or swallow it while they are loaded."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda n, _: received.append(n)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _show(args: argparse.Namespace, config: str, remappings: list[str], received: list[int]) -> int:
    from rosglass.qml.log import install_message_handler
    from rosglass.qml.modules import interface_file

    format_log(verbose=args.verbose > 1)
    for file in args.overlays:
        interface_file(file)
    from rosglass.rviz.application import Application
    from rosglass.rviz.rendering import choice

    install_message_handler()
    if received:
        return 128 + received[0]
    for file in args.overlays:
        choice.expect(file)
    app = Application(
        config,
        url=args.url,
        name=args.name,
        fixed_frame=args.fixed_frame,
        fullscreen=args.fullscreen,
        bare=args.bare,
        splash=args.splash,
        anti_aliasing=not args.disable_anti_aliasing,
        renderer=args.renderer,
        allow_network=args.allow_network,
        timeout=args.timeout,
        import_paths=args.import_paths,
        arguments=args.arguments,
        ros_arguments=[*remappings, *args.ros_arguments],
    )
    app.session.longest_script = args.longest_script
    with app:
        _add_overlays(app, args)
        picture = None if args.screenshot is None else Picture(args.screenshot, args.after)
        if picture is not None:
            picture.take(app.quit, app.screenshot)
        if received:
            return 128 + received[0]
        code = app.run(end_process=True)
        return code if picture is None else picture.check(code)


def _add_overlays(app: Application, args: argparse.Namespace) -> None:
    from rosglass.qml.modules import interface_file

    shown = {getattr(overlay, "file", None) for overlay in app.overlays}
    for file in args.overlays:
        # The config may have it already.
        if interface_file(file) not in shown:
            app.add_qml(file, watch=args.watch)
