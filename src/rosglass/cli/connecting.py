"""What all commands that talk to a robot have in common: where it is, and getting there."""

from __future__ import annotations

import argparse
import os
import sys
import threading
from math import isfinite
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm import Node, Status

__all__ = ["add_connection_options", "connect", "seconds"]

#: Seconds after which a command says what it is waiting for.
_PATIENCE = 2.0


def add_connection_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options that say which robot is meant."""
    group = parser.add_argument_group("connection")
    group.add_argument(
        "--url",
        default="",
        help="address of the robot, e.g. zenoh://192.168.1.5:7447 or dds://?domain=5; default: "
        "ROSGLASS_URL, or what ROS 2's own variables say",
    )
    group.add_argument("--name", default="", help="node name; default: one that nobody else has")
    group.add_argument(
        "--timeout",
        type=seconds,
        default=10.0,
        metavar="SECONDS",
        help="how long to wait for the robot to answer (default: %(default)g)",
    )


def connect(args: argparse.Namespace, command: str, arguments: Sequence[str] = ()) -> Node:
    """Join the graph that the options name, and wait until somebody answers.

    Says on standard error what it waits for, when that takes a while. Over DDS, where nobody has
    to answer, it returns at once.

    Args:
        args: The command's options.
        command: The command's name, for the node's.
        arguments: ``--ros-args`` and what belongs to them.

    Raises:
        Error: As :func:`rosglass.connect`; ConnectionLostError when nobody answers in time.
    """
    import rosglass

    name = args.name or f"rosglass_{command}_{os.getpid()}"
    node = rosglass.connect(args.url or None, name=name, arguments=list(arguments))
    try:
        _wait(node, args.timeout)
    except BaseException:
        node.close()
        raise
    return node


def seconds(text: str) -> float:
    """Read a number of seconds; for options."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not isfinite(value) or not 0 <= value <= 1e9:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds, 0 or more")
    return value


def _wait(node: Node, timeout: float) -> None:
    from rosglass.errors import ConnectionLostError

    connected = threading.Event()

    def look(status: Status) -> None:
        if status.state is ConnectionState.CONNECTED:
            connected.set()

    with node.on_status_change(look):
        look(node.status())
        if connected.wait(min(_PATIENCE, timeout)):
            return
        if timeout > _PATIENCE:
            print(f"rosglass: {node.url}: {node.status().detail}", file=sys.stderr, flush=True)
            if connected.wait(timeout - _PATIENCE):
                return
    raise ConnectionLostError(
        f"{node.url}: {node.status().detail}; nobody answered within {timeout:g} s. Is the robot "
        "on, and the address right? rosglass doctor looks for the reason"
    )
