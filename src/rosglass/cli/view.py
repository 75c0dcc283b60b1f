"""``rosglass view``: open the robot's 3D view, as RViz does, without RViz."""

from __future__ import annotations

import gc
import os
from typing import TYPE_CHECKING

from rosglass.cli.run import load_qt, make_recorder, show_interface
from rosglass.errors import UnsupportedError
from rosglass.extras import install_command

if TYPE_CHECKING:
    import argparse

__all__ = ["run"]


def run(args: argparse.Namespace) -> int:
    """Show the view until it is closed; returns the exit code.

    Raises:
        Error: The config is missing, or is not a config of RViz.
        UnsupportedError: There is no Qt 6, or it would draw without a graphics interface.
    """
    # Threads for products of large matrices, which a view does not have, would delay its window.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Nothing that is loaded becomes garbage.
    gc.disable()
    try:
        return _run(args)
    finally:
        gc.enable()


def _run(args: argparse.Namespace) -> int:
    if args.renderer == "software" or os.environ.get("QT_QUICK_BACKEND") == "software":
        raise UnsupportedError(
            "Qt's software renderer draws no 3D: use --renderer opengl, unset QT_QUICK_BACKEND; "
            "without a graphics card, Mesa's llvmpipe will do"
        )
    try:
        load_qt()
        from rosglass.qml.run.modules import interface_file  # noqa: PLC0415 - loads Qt
        from rosglass.scene.app.program import WINDOW, ViewProgram  # noqa: PLC0415 - loads Qt
    except ModuleNotFoundError as error:
        if not str(error.name).startswith("PySide6"):
            raise
        raise UnsupportedError(
            f"the 3D view needs Qt 6: {install_command('qml')} (inside RViz's Python there is "
            "Qt 5; use another virtual environment)"
        ) from None
    recorder = make_recorder(args)
    program = ViewProgram(
        args.config,
        args.fixed_frame,
        kiosk=args.kiosk,
        overlays=[interface_file(file) for file in args.overlays],
        watch=args.watch,
        import_paths=args.import_paths,
        recorder=recorder,
    )
    return show_interface(
        args,
        str(WINDOW),
        name=args.name or "rosglass_view",
        context={"program": program},
        recorder=recorder,
    )
