"""The ``rosglass`` command: one module per subcommand, imported only when it is used."""

from __future__ import annotations

import argparse
import logging
import sys
from importlib import import_module
from typing import TYPE_CHECKING

import rosglass

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]

#: Subcommand -> (module, one-line help). Modules have ``configure(parser)``, ``run(args) -> int``.
COMMANDS = {
    "run": ("rosglass.cli.run", "open an interface written in QML"),
    "demo": ("rosglass.cli.demo", "open the demo cockpit on a simulated robot"),
    "robot": ("rosglass.cli.robot", "run the simulated robot"),
    "record": ("rosglass.cli.record", "record topics into an MCAP file"),
    "play": ("rosglass.cli.play", "play a recording: MCAP, ROS 2 bag or ROS 1 bag"),
    "router": ("rosglass.cli.router", "run a Zenoh router for ROS 2 (rmw_zenoh)"),
}


def build_parser(command: str | None = None) -> argparse.ArgumentParser:
    """Return the parser; only `command`'s own options are filled in, to keep start-up quick."""
    parser = argparse.ArgumentParser(
        prog="rosglass",
        description="A glass cockpit for robots: operator screens for ROS, without ROS installed.",
        epilog="Every command has its own --help. The guide: docs/index.md in the source.",
    )
    parser.add_argument("--version", action="version", version=f"rosglass {rosglass.__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, (module, summary) in COMMANDS.items():
        sub = subparsers.add_parser(
            name, help=summary, description=f"{summary[0].upper()}{summary[1:]}."
        )
        sub.add_argument(
            "-v", "--verbose", action="count", default=0, help="show more; -vv shows everything"
        )
        if name == command:
            import_module(module).configure(sub)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code (0 done, 1 failed, 2 wrong usage, 130 Ctrl-C)."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    # What follows -- is not ours: argparse would look for options in it.
    end = arguments.index("--") if "--" in arguments else len(arguments)
    arguments, rest = arguments[:end], arguments[end + 1 :]
    command = next((a for a in arguments if not a.startswith("-")), None)
    try:
        parser = build_parser(command)
        args = parser.parse_args(arguments)
        if rest and not hasattr(args, "arguments"):
            parser.error(f"{args.command} takes no arguments after --")
        args.arguments = rest
        level = {0: logging.WARNING, 1: logging.INFO}.get(args.verbose, logging.DEBUG)
        logging.basicConfig(level=level, format="%(levelname)s %(name)s: %(message)s")
        return int(import_module(COMMANDS[args.command][0]).run(args))
    except rosglass.Error as error:
        print(f"rosglass: {error}", file=sys.stderr)
        return 1
    except ModuleNotFoundError as error:
        extra = _EXTRA_OF.get((error.name or "").partition(".")[0])
        if extra is None:
            raise
        print(
            f"rosglass: this command needs the package {error.name}, which is not installed; "
            f'install it with: pip install "rosglass[{extra}]"',
            file=sys.stderr,
        )
        return 1
    except KeyboardInterrupt:
        return 130


_EXTRA_OF = {
    "PySide6": "qml",
    "zenoh": "zenoh",
    "xxhash": "zenoh",
    "cyclonedds": "dds",
    "cv2": "images",
    "mcap": "bags",
    "rosbags": "bags",
}
