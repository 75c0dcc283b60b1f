"""Parses command lines: the parser, and the options and types that commands share.

Imports nothing slow: ``--help`` and Tab completion wait for it.
"""

from __future__ import annotations

import argparse
import os
from math import isfinite
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = [
    "EXAMPLES",
    "TIMEOUT_S",
    "Parser",
    "Subcommands",
    "add_connection_options",
    "add_definitions_option",
    "add_output_options",
    "add_verbose",
    "complete",
    "is_completing",
    "number",
    "pair",
    "positive_int",
    "screenshot_file",
    "seconds",
]

#: Default of --timeout.
TIMEOUT_S = 10.0
#: Command -> the examples that end its --help.
EXAMPLES = {
    "action info": ("/dock",),
    "action list": ("-t",),
    "action send": ("/dock '{station: 3}' --feedback",),
    "bridge": ("ros1://robot:11311 zenoh://127.0.0.1:7447 -t '/camera/*->' -t '/cmd_vel<-'",),
    "cockpit": ("", "drive.qml --url zenoh://robot.local:7447", "--panels ~/panels"),
    "demo": ("", "--no-robot --url zenoh://robot.local:7447"),
    "doctor": ("--url zenoh://robot.local:7447", "--scan"),
    "examples": ("", "remote_control", "--all mine"),
    "interface list": ("Pose --kind msg",),
    "interface show": ("geometry_msgs/msg/Twist", "my_robot_msgs/msg/State --template"),
    "lifecycle get": ("", "/camera"),
    "lifecycle list": ("/camera", "/camera --all"),
    "lifecycle nodes": ("",),
    "lifecycle set": ("/camera configure", "/camera activate --timeout 60"),
    "new": ("cockpit.qml", "drive.qml --template teleop"),
    "node cleanup": ("--url ros1://robot:11311",),
    "node info": ("/camera",),
    "node kill": ("/camera /lidar",),
    "node list": ("--url ros1://robot:11311",),
    "node ping": ("/camera -n 3",),
    "param delete": ("/camera exposure",),
    "param describe": ("/camera exposure",),
    "param dump": ("/camera -o camera.yaml",),
    "param get": ("/camera exposure",),
    "param list": ("/camera",),
    "param load": ("/camera camera.yaml",),
    "param set": ("/camera exposure 0.02",),
    "play": ("drive.mcap --clock --rate 2", "drive.mcap --topics /odom /scan --start 30"),
    "plot": (
        "/odom:twist.twist.linear.x /odom:twist.twist.angular.z",
        "'/joint_states:position[*]' --window 60",
        "/battery_state:voltage --terminal",
    ),
    "qml-path": ("--qmlls-ini",),
    "record": ("-o drive.mcap", "/odom /scan -d 60"),
    "robot": ("--url zenoh://127.0.0.1:7447",),
    "router": ("", "--listen tcp/192.168.1.5:7447", "--config router.json5"),
    "run": ("cockpit.qml --url zenoh://robot.local:7447 --watch", "panel.qml --kiosk"),
    "rviz": ("robot.rviz --overlay dashboard.qml --watch",),
    "service call": ("/reset '{}'", "/add '{a: 1, b: 2}'"),
    "service info": ("/reset",),
    "service list": ("-t",),
    "topic bw": ("/camera/image_raw -n 100",),
    "topic delay": ("/scan",),
    "topic echo": ("/odom -f pose.pose.position", "/battery_state -n 1 --json"),
    "topic hz": ("/scan", "/scan -n 100"),
    "topic info": ("/scan",),
    "topic list": ("-t",),
    "topic pub": (
        "/cmd_vel '{linear: {x: 0.2}}' --rate 10",
        "/chat std_msgs/msg/String '{data: hi}' -1",
    ),
    "view": ("robot.rviz --url dds://", "--overlay dashboard.qml --watch"),
}


class Parser(argparse.ArgumentParser):
    """Accepts options before, after and between arguments, as ``ros2`` commands are written.

    argparse alone rejects ``pub --once /topic TYPE``, and ``echo /topic --once TYPE``.
    """

    _mixing = False

    def format_help(self) -> str:
        """Return the help, which ends with the examples of the command."""
        examples = EXAMPLES.get(self.prog.removeprefix("rosglass "), ())
        lines = "".join(f"  {self.prog} {example}".rstrip() + "\n" for example in examples)
        noun = "examples" if len(examples) > 1 else "example"
        return super().format_help() + (f"\n{noun}:\n{lines}" if lines else "")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """See argparse."""
        has_commands = any(action.nargs == argparse.PARSER for action in self._actions)
        if self._mixing or is_completing():
            return super().parse_known_args(args, namespace)
        if has_commands:
            found, unknown = super().parse_known_args(args, namespace)
        else:
            self._mixing = True
            try:
                found, unknown = self.parse_known_intermixed_args(args, namespace)
            finally:
                self._mixing = False
        if unknown:
            self._refuse(unknown)
        return found, unknown

    def _refuse(self, unknown: list[str]) -> NoReturn:
        """End with this command's own usage; argparse alone shows that of ``rosglass``."""
        from rosglass.comm.names import similar  # noqa: PLC0415 - only needed to explain an error

        options = [one for action in self._actions for one in action.option_strings]
        hints = (similar(one.partition("=")[0], options) for one in unknown if one[:1] == "-")
        self.error(f"unrecognized arguments: {' '.join(unknown)}{next(filter(None, hints), '')}")


class Subcommands:
    """The subcommands of a command, such as ``rosglass topic list``.

    Args:
        parser: Parser of the command.
    """

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        self._commands = parser.add_subparsers(metavar="WHAT", required=True)

    def add(
        self, name: str, summary: str, handler: str, aliases: tuple[str, ...] = ()
    ) -> argparse.ArgumentParser:
        """Add a subcommand, and return the parser of its options.

        Args:
            name: Name of the subcommand.
            summary: Its help, in one line.
            handler: The function of the command's module that runs it.
            aliases: Other names.
        """
        parser = self._commands.add_parser(
            name,
            aliases=aliases,
            help=summary,
            description=f"{summary[0].upper()}{summary[1:]}.",
        )
        parser.set_defaults(handler=handler, what=name)
        add_verbose(parser)
        return parser


# -- options -------------------------------------------------------------------------------------


def add_verbose(parser: argparse.ArgumentParser) -> None:
    """Declare ``-v``, which may stand after each word of a command."""
    parser.add_argument(
        "-v",
        "--verbose",
        action="count",
        default=argparse.SUPPRESS,
        help="log more; -vv logs everything",
    )


def add_output_options(parser: argparse.ArgumentParser) -> None:
    """Declare ``--json`` and ``--color``."""
    group = parser.add_argument_group("output")
    group.add_argument("--json", action="store_true", help="print JSON")
    group.add_argument(
        "--color",
        choices=("auto", "always", "never"),
        default="auto",
        help="auto: on a terminal, unless NO_COLOR is set (default: %(default)s)",
    )


def add_connection_options(
    parser: argparse.ArgumentParser, *, timeout: float | None = TIMEOUT_S
) -> None:
    """Declare the options that select the robot."""
    group = parser.add_argument_group("connection")
    group.add_argument(
        "--url",
        default="",
        help="URL of the robot, e.g. zenoh://192.168.1.5:7447, dds://?domain=5 or "
        "ros1://192.168.1.5:11311; default: ROSGLASS_URL, or ROS's own variables, or the "
        "Zenoh router or ROS 1 master of this machine",
    )
    group.add_argument(
        "--node-name", default="", metavar="NAME", help="name of this node (default: a unique one)"
    )
    add_definitions_option(group)
    group.add_argument(
        "--timeout",
        type=seconds,
        action=_Given,
        default=timeout,
        metavar="SECONDS",
        help="time to wait for the robot to answer "
        + (
            f"(default: {timeout:g})"
            if timeout is not None
            else f"(default: {TIMEOUT_S:g}), and for each message (default: no limit)"
        ),
    )
    parser.set_defaults(ros_arguments=[], looks_nearby=True)


def add_definitions_option(parser: argparse._ActionsContainer) -> None:
    """Declare the option for type definitions in unusual places."""
    parser.add_argument(
        "--definitions",
        action="append",
        default=[],
        metavar="FOLDER",
        help="a package or workspace with definitions that the robot does not send; may "
        "be repeated",
    )


class _Given(argparse.Action):
    """Stores a value, and records that it was given."""

    def __call__(
        self,
        _parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        _option: str | None = None,
    ) -> None:
        setattr(namespace, self.dest, values)
        setattr(namespace, f"{self.dest}_given", True)


# -- types of arguments --------------------------------------------------------------------------


def number(
    least: float, most: float, expected: str, *, above: bool = False
) -> Callable[[str], float]:
    """Return the type of options that take a number from `least` to `most`.

    Args:
        least: The smallest number.
        most: The largest number.
        expected: What the option expects, for the error.
        above: Whether `least` itself is too small.
    """

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not (isfinite(value) and least <= value <= most) or (above and value == least):
            raise argparse.ArgumentTypeError(f"{text!r} is not {expected}")
        return value

    return parse


#: Seconds from 0 on.
seconds = number(0, 1e9, "a number of seconds, 0 or more")


def positive_int(text: str) -> int:
    """Parse a count of 1 or more; a type of options."""
    if not (text.isascii() and text.isdigit() and 0 < int(text[:10]) < 2**31):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of 1 or more")
    return int(text)


def screenshot_file(text: str) -> str:
    """Parse the file name of a screenshot; a type of options."""
    folder = os.path.dirname(text) or "."  # noqa: PTH120 - pathlib would take time here
    if not text.lower().endswith((".png", ".jpg", ".jpeg")):
        raise argparse.ArgumentTypeError(f"{text!r}: the name of a screenshot ends in .png or .jpg")
    if not os.path.isdir(folder):  # noqa: PTH112
        raise argparse.ArgumentTypeError(f"{text!r}: there is no folder {folder!r}")
    return text


def pair(form: str) -> Callable[[str], tuple[str, str]]:
    """Return the type of options that take two names with ``:=`` between them.

    Args:
        form: What is expected, for the error, such as ``/old:=/new``.
    """

    def parse(text: str) -> tuple[str, str]:
        first, separator, second = text.partition(":=")
        if not (separator and first and second):
            raise argparse.ArgumentTypeError(f"{text!r} is not of the form {form}")
        return first, second

    return parse


# -- Tab completion ------------------------------------------------------------------------------


def is_completing() -> bool:
    """Return whether the shell requests completions, instead of running a command."""
    return "_ARGCOMPLETE" in os.environ


def complete(argument: argparse.Action, what: str) -> None:
    """Enable Tab completion of an argument.

    Args:
        argument: As returned by ``add_argument``.
        what: ``topics``, ``services``, ``actions``, ``nodes``, ``messages``, ``interfaces`` (all
            kinds of types), ``service_types``, ``action_types`` or ``examples``; or, for files,
            ``*.qml *.mcap``.
    """
    argument.completes = what  # type: ignore[attr-defined]
