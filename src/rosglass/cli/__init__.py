"""The ``rosglass`` command: one module per subcommand, imported only when it is used."""

from __future__ import annotations

import argparse
import logging
import sys
from importlib import import_module
from typing import TYPE_CHECKING

import rosglass
from rosglass.cli.completion import is_completing, offer

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["main"]

#: Subcommand -> (module, one-line help). Modules have ``configure(parser)``, ``run(args) -> int``.
COMMANDS = {
    "run": ("rosglass.cli.run", "open an interface written in QML"),
    "demo": ("rosglass.cli.demo", "open the demo cockpit on a simulated robot"),
    "robot": ("rosglass.cli.robot", "run the simulated robot"),
    "topic": ("rosglass.cli.topic", "look at topics, listen to them, publish on them"),
    "service": ("rosglass.cli.service", "look at services, call them"),
    "action": ("rosglass.cli.action", "look at actions, send goals"),
    "param": ("rosglass.cli.param", "read and set the parameters of nodes"),
    "node": ("rosglass.cli.node", "look at nodes"),
    "interface": ("rosglass.cli.interface", "look at types of messages, services and actions"),
    "record": ("rosglass.cli.record", "record topics into an MCAP file"),
    "play": ("rosglass.cli.play", "play a recording: MCAP, ROS 2 bag or ROS 1 bag"),
    "doctor": ("rosglass.cli.doctor", "find what keeps this machine and the robot apart"),
    "router": ("rosglass.cli.router", "run a Zenoh router for ROS 2 (rmw_zenoh)"),
    "completion": ("rosglass.cli.completion_command", "let Tab complete commands and names"),
}


#: Stands for all commands at once.
_ALL = "*"


def build_parser(command: str | None = None) -> argparse.ArgumentParser:
    """Return the parser; only `command`'s own options are filled in, to keep start-up quick.

    ``*`` fills in everything.
    """
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
        if command in (name, _ALL):
            import_module(module).configure(sub)
    return parser


def _split(arguments: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
    """Return what is for the command, for ROS (``--ros-args ... --``), and for others (``--``).

    argparse must not see the latter two: it would look for options in them.
    """
    ours: list[str] = []
    told: list[str] = []
    place = 0
    while place < len(arguments):
        argument = arguments[place]
        if argument == "--":
            return ours, told, list(arguments[place + 1 :])
        if argument == "--ros-args":
            end = place + 1
            while end < len(arguments) and arguments[end] != "--":
                end += 1
            told += arguments[place : end + 1]
            place = end
        else:
            ours.append(argument)
        place += 1
    return ours, told, []


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code (0 done, 1 failed, 2 wrong usage, 130 Ctrl-C)."""
    if is_completing():
        offer(build_parser(_ALL))
    arguments = list(sys.argv[1:] if argv is None else argv)
    arguments, told, rest = _split(arguments)
    command = next((a for a in arguments if not a.startswith("-")), None)
    try:
        parser = build_parser(command)
        args = parser.parse_args(arguments)
        if rest and not hasattr(args, "arguments"):
            parser.error(f"{args.command} takes no arguments after --")
        if told and not hasattr(args, "ros_arguments"):
            parser.error(f"{args.command} takes no --ros-args: it is no node of its own")
        args.arguments, args.ros_arguments = rest, told
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
    "argcomplete": "completion",
}
