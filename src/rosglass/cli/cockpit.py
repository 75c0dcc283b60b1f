"""``rosglass cockpit``: arrange a robot's panels on a screen, without a line of code."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.cli.run import load_qt, show_interface
from rosglass.errors import UnsupportedError
from rosglass.extras import install_command

if TYPE_CHECKING:
    import argparse

__all__ = ["run"]


def run(args: argparse.Namespace) -> int:
    """Show the cockpit until it is closed; returns the exit code.

    Raises:
        Error: The layout or a folder of panels cannot be read.
        UnsupportedError: There is no Qt 6.
    """
    try:
        load_qt()
        from rosglass.cockpit.program import WINDOW, CockpitProgram  # noqa: PLC0415 - loads Qt
    except ModuleNotFoundError as error:
        if not str(error.name).startswith("PySide6"):
            raise
        raise UnsupportedError(
            f"the cockpit needs Qt 6: {install_command('qml')} (inside RViz's Python there is "
            "Qt 5, in which `rosglass run` shows the saved layout)"
        ) from None
    program = CockpitProgram(
        args.layout,
        url=args.url or "",
        panels=args.panels,
        import_paths=args.import_paths,
    )
    try:
        return show_interface(
            args, str(WINDOW), name="rosglass_cockpit", context={"program": program}
        )
    finally:
        program.close()
