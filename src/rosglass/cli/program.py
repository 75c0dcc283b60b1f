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
from rosglass.cli.arguments import COMMANDS
from rosglass.cli.output import EscapingStream, note
from rosglass.cli.parser import Parser, add_verbose, is_completing
from rosglass.interrupts import end_at_once, is_interrupt

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence

__all__ = ["build_parser", "parse", "run"]

#: Commands that load Qt: Ctrl-C ends the process until they handle it themselves.
_WITH_QT = ("run", "cockpit", "rviz", "view", "demo", "plot")
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
    for name, (declare_arguments, summary) in COMMANDS.items():
        sub = subparsers.add_parser(
            name, help=summary, description=f"{summary[0].upper()}{summary[1:]}."
        )
        sub.set_defaults(handler="run")
        add_verbose(sub)
        if command in (name, _ALL):
            declare_arguments(sub)
    return parser


def _split(arguments: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
    """Return the arguments of the command, of ROS (``--ros-args ... --``), and of others (``--``).

    argparse must not see the latter two: it would look for options in them.
    """
    ours: list[str] = []
    ros: list[str] = []
    index = 0
    while index < len(arguments):
        argument = arguments[index]
        if argument == "--":
            return ours, ros, list(arguments[index + 1 :])
        if argument == "--ros-args":
            end = index + 1
            while end < len(arguments) and arguments[end] != "--":
                end += 1
            ros += arguments[index : end + 1]
            index = end
        else:
            ours.append(argument)
        index += 1
    return ours, ros, []


def run(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code of :func:`rosglass.cli.main`."""
    if is_completing():
        _complete()
    _prepare_output()
    try:
        code = _run(list(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except Exception as error:  # explained to the user, or Ctrl-C in C code
        if is_interrupt(error):
            raise KeyboardInterrupt from error
        return _explain(error)
    return code


def _complete() -> None:
    """Print the completions of the line that is being typed, and end the program."""
    try:
        from rosglass.cli.completion import offer  # noqa: PLC0415 - argcomplete is an extra
    except ModuleNotFoundError:
        sys.exit(1)  # nothing may be printed into that line
    offer(build_parser(_ALL))


def _explain(error: Exception) -> int:
    """Print an error for users; return the exit code. Bugs of rosglass are raised again."""
    if isinstance(error, rosglass.Error):
        return _fail(str(error))
    if isinstance(error, ModuleNotFoundError):
        from rosglass.extras import explain_missing  # noqa: PLC0415 - only needed to explain an error

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


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the parsed command line; exits with 2 after a usage error, as argparse does."""
    arguments, ros, rest = _split(arguments)
    arguments = _AS_IN_ROS2.get(tuple(arguments[:2]), arguments[:2]) + arguments[2:]
    command = next((a for a in arguments if not a.startswith("-")), None)
    parser = build_parser(command)
    args = parser.parse_args(arguments)
    if rest and not hasattr(args, "arguments"):
        parser.error(f"{args.command} takes no arguments after --")
    if ros and not hasattr(args, "ros_arguments"):
        parser.error(f"{args.command} takes no --ros-args: it is not a node of its own")
    args.arguments, args.ros_arguments = rest, ros
    return args


def _run(arguments: list[str]) -> int:
    args = parse(arguments)
    level = {0: logging.WARNING, 1: logging.INFO}.get(args.verbose, logging.DEBUG)
    logging.basicConfig(level=level, format="%(levelname)s %(name)s: %(message)s")
    if getattr(args, "looks_nearby", False) and not args.url:
        args.url = _nearby_url()
    for folder in getattr(args, "definitions", ()):
        import_module("rosglass.messages").default_library().add_path(folder)
    module = import_module(f"rosglass.cli.{args.command.replace('-', '_')}")
    if args.command not in _WITH_QT and signal.getsignal(signal.SIGINT) is end_at_once:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return int(getattr(module, args.handler)(args))
    except rosglass.Error as error:
        if is_interrupt(error):
            raise
        from rosglass.cli.connecting import spelled_for  # noqa: PLC0415 - only needed to explain an error

        return _fail(spelled_for(args, str(error)))


def _nearby_url() -> str:
    from rosglass.cli.network import nearby_url  # noqa: PLC0415 - not for every command

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
    with suppress(OSError, ValueError):  # closed, or no file
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())
        os.close(null)


def _fail(reason: str) -> int:
    print(f"rosglass: {reason}", file=sys.stderr)
    return 1
