"""``rosglass rviz``: open RViz with interfaces over its 3D view."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.cli.run import Screenshot, format_log
from rosglass.errors import Error, QmlError
from rosglass.rviz.requirements import require_bindings

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

__all__ = ["run"]

#: Seconds after a signal until the program ends, whatever RViz is doing.
_QUIT_TIMEOUT_S = 1.7


def run(args: argparse.Namespace) -> int:
    """Show RViz until it is closed; returns the exit code."""
    remappings = [word for word in args.config if ":=" in word]
    configs = [word for word in args.config if ":=" not in word]
    if len(configs) > 1:
        raise Error(f"RViz shows one config: expected one file, got {', '.join(configs)}")
    require_bindings()
    os.environ["ROSGLASS_QT"] = "pyside2"
    received: list[int] = []
    with _noting_signals(received):
        from rosglass.qml.engine.process import QuitOnSignal  # noqa: PLC0415

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
    from rosglass.qml.engine.log import install_message_handler  # noqa: PLC0415
    from rosglass.qml.run.modules import interface_file  # noqa: PLC0415

    format_log(verbose=args.verbose > 1)
    # Files that are missing are reported before RViz is loaded, which takes a while.
    files = [(file, interface_file(file)) for file in args.overlays]
    from rosglass.rviz.application import Application  # noqa: PLC0415
    from rosglass.rviz.rendering import choice  # noqa: PLC0415

    install_message_handler()
    if received:
        return 128 + received[0]
    for file, _ in files:
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
        shown = {getattr(overlay, "file", None) for overlay in app.overlays}
        for file, path in files:
            # The config may have it already.
            if path not in shown:
                app.add_qml(file, watch=args.watch)
        target = args.screenshot
        shot = None if target is None else Screenshot(Path(target), args.after)
        if shot is not None:
            shot.take(app.quit, app.screenshot)
        if received:
            return 128 + received[0]
        code = app.run(end_process=True)
        return code if shot is None else shot.check(code)
