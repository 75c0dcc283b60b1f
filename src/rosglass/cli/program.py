"""The ``rosglass`` command: finds the subcommand, runs it, and reports errors."""

from __future__ import annotations

import io
import logging
import os
import signal
import sys
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING

import rosglass
from rosglass.cli import end_at_once, is_interrupt
from rosglass.cli.completion import is_completing, offer
from rosglass.cli.output import EscapingStream
from rosglass.cli.subcommands import Parser, add_verbose
from rosglass.cli.worlds import names_ros1

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

__all__ = ["COMMANDS", "run"]

#: Subcommand -> (module, one-line help). Modules have ``configure(parser)``, ``run(args) -> int``.
COMMANDS = {
    "run": ("rosglass.cli.run", "open an interface written in QML"),
    "rviz": ("rosglass.cli.rviz", "open RViz with interfaces over its 3D view"),
    "qml-path": ("rosglass.cli.qml_path", "print the folders of the QML modules, for editors"),
    "demo": ("rosglass.cli.demo", "open the demo cockpit on a simulated robot"),
    "robot": ("rosglass.cli.robot", "run the simulated robot"),
    "topic": ("rosglass.cli.topic", "inspect topics, receive and publish messages"),
    "service": ("rosglass.cli.service", "inspect and call services"),
    "action": ("rosglass.cli.action", "inspect actions and send goals"),
    "param": ("rosglass.cli.param", "read and set the parameters of nodes"),
    "node": ("rosglass.cli.node", "inspect nodes"),
    "interface": ("rosglass.cli.interface", "show message, service and action types"),
    "record": ("rosglass.cli.record", "record topics to an MCAP file or a ROS 1 bag"),
    "play": ("rosglass.cli.play", "play a recording: MCAP, ROS 2 bag or ROS 1 bag"),
    "bridge": ("rosglass.cli.bridge", "relay topics, services and actions between two graphs"),
    "doctor": ("rosglass.cli.doctor", "find what blocks the connection to the robot"),
    "router": ("rosglass.cli.router", "run a Zenoh router for ROS 2 (rmw_zenoh)"),
    "completion": ("rosglass.cli.completion_command", "print the shell code for Tab completion"),
}


#: Commands that load Qt: Ctrl-C ends the process until they handle it themselves.
_WITH_QT = ("run", "rviz", "demo")
#: Commands of ``ros2`` -> their counterparts here.
_AS_IN_ROS2: dict[tuple[str, ...], list[str]] = {
    ("bag", "record"): ["record"],
    ("bag", "play"): ["play"],
    ("bag", "info"): ["play", "--list"],
}
#: Stands for all commands.
_ALL = "*"


def build_parser(command: str | None = None) -> argparse.ArgumentParser:
    """Return the parser; only `command`'s own options are filled in, to keep start-up quick.

    ``*`` fills in everything.
    """
    parser = Parser(
        prog="rosglass",
        description="Operator screens and tools for ROS 1 and ROS 2 robots, without ROS installed.",
        epilog="Every command has its own --help. The guide is docs/index.md in the source.",
    )
    parser.add_argument("--version", action="version", version=f"rosglass {rosglass.__version__}")
    add_verbose(parser)
    parser.set_defaults(verbose=0)
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, (module, summary) in COMMANDS.items():
        sub = subparsers.add_parser(
            name, help=summary, description=f"{summary[0].upper()}{summary[1:]}."
        )
        add_verbose(sub)
        if command in (name, _ALL):
            import_module(module).configure(sub)
    return parser


def _split(arguments: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
    """Return the arguments of the command, of ROS (``--ros-args ... --``), and of others (``--``).

    argparse must not see the latter two: it would look for options in them.
    """
    ours: list[str] = []
    ros: list[str] = []
    place = 0
    while place < len(arguments):
        argument = arguments[place]
        if argument == "--":
            return ours, ros, list(arguments[place + 1 :])
        if argument == "--ros-args":
            end = place + 1
            while end < len(arguments) and arguments[end] != "--":
                end += 1
            ros += arguments[place : end + 1]
            place = end
        else:
            ours.append(argument)
        place += 1
    return ours, ros, []


def run(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code of :func:`rosglass.cli.main`."""
    if is_completing():
        offer(build_parser(_ALL))
    _prepare_output()
    try:
        code = _run(list(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except Exception as error:
        if is_interrupt(error):
            raise KeyboardInterrupt from error
        return _explain(error)
    return code


def _explain(error: Exception) -> int:
    """Print an error for users; return the exit code. Bugs of rosglass are raised again."""
    if isinstance(error, rosglass.Error):
        return _fail(str(error))
    if isinstance(error, ModuleNotFoundError):
        from rosglass.connection import explain_missing

        missing = explain_missing(error)
        if missing:
            return _fail(f"this command needs a package: {missing}")
    if isinstance(error, BrokenPipeError):
        _drop_output()
        return 141  # as for programs that SIGPIPE ends
    if isinstance(error, OSError):
        _drop_output()
        where = f"{error.filename}: " if error.filename else ""
        return _fail(f"{where}{error.strerror or error}")
    raise error


def _run(arguments: list[str]) -> int:
    arguments, ros, rest = _split(arguments)
    arguments = _AS_IN_ROS2.get(tuple(arguments[:2]), arguments[:2]) + arguments[2:]
    command = next((a for a in arguments if not a.startswith("-")), None)
    parser = build_parser(command)
    args = parser.parse_args(arguments)
    if rest and not hasattr(args, "arguments"):
        parser.error(f"{args.command} takes no arguments after --")
    if ros and not hasattr(args, "ros_arguments"):
        parser.error(f"{args.command} takes no --ros-args: it is no node of its own")
    args.arguments, args.ros_arguments = rest, ros
    level = {0: logging.WARNING, 1: logging.INFO}.get(args.verbose, logging.DEBUG)
    logging.basicConfig(level=level, format="%(levelname)s %(name)s: %(message)s")
    if getattr(args, "looks_nearby", False) and not args.url:
        args.url = _nearby_url()
    for folder in getattr(args, "definitions", ()):
        import_module("rosglass.messages").default_library().add_path(folder)
    command_run = import_module(COMMANDS[args.command][0]).run
    if args.command not in _WITH_QT and signal.getsignal(signal.SIGINT) is end_at_once:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return int(command_run(args))
    except rosglass.Error as error:
        if getattr(args, "ros1", hasattr(args, "url") and names_ros1(args)):
            from rosglass.interfaces.names import spelled_ros1

            return _fail(spelled_ros1(str(error)))
        raise


def _nearby_url() -> str:
    from rosglass.cli.network import nearby_url
    from rosglass.cli.output import note

    url = nearby_url()
    if url:
        note(f"no URL is given: using {url} (export ROSGLASS_URL={url} to select it)")
    return url


def _prepare_output() -> None:
    """Ensure that received text can be printed, and does nothing to the terminal."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:  # closed by the parent process
            setattr(sys, name, io.StringIO())
            continue
        if isinstance(stream, EscapingStream):
            continue
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
        setattr(sys, name, EscapingStream(stream))


def _drop_output() -> None:
    """Drop unwritten output, which would make Python's exit fail."""
    with suppress(OSError, ValueError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())
        os.close(null)


def _fail(reason: str) -> int:
    print(f"rosglass: {reason}", file=sys.stderr)
    return 1
