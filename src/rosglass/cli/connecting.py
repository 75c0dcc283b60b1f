"""Connecting to the robot, as in all commands: options, and waiting for the graph."""

from __future__ import annotations

import argparse
import signal
import threading
import time
from contextlib import contextmanager, suppress
from math import isfinite
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.cli.output import note
from rosglass.comm import ConnectionState, anonymous_name
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rosglass.comm import Node, Status

__all__ = [
    "TIMEOUT",
    "End",
    "add_connection_options",
    "add_definitions_option",
    "await_types",
    "connect",
    "find",
    "join",
    "left_out",
    "natural",
    "note_invalid_names",
    "seconds",
    "settle",
    "telling",
    "wait",
]

#: Number of names in a hint.
_EXAMPLES = 3
_T = TypeVar("_T")
#: Default of --timeout, in seconds.
TIMEOUT = 10.0
#: Seconds that an existing entity may take to appear in the graph, or to announce its type.
_DISCOVERY = 3.0
#: Seconds after which a command reports what it waits for, and probes an address without answer.
_REPORT_DELAY_S, _PROBE_DELAY_S = 2.0, 0.5
#: The same once the robot has answered.
_SOON = 1.0
#: Seconds that programs have to name their nodes: Fast DDS takes 1 to 4; a Zenoh router with 10,000
#: topics 4 to 13.
_INTRODUCTION_S = {"dds": 8.0, "zenoh": 18.0}
#: Seconds without changes after which the graph counts as complete; some are at once.
_QUIET = {"zenoh": 0.3, "dds": 0.7, "ros1": 0.0, "replay": 0.0}


def add_connection_options(
    parser: argparse.ArgumentParser, *, timeout: float | None = TIMEOUT
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
            else f"(default: {TIMEOUT:g}), and for each message (default: for ever)"
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


def connect(args: argparse.Namespace, *, patient: bool = False) -> Node:
    """Join the graph given by the options, and wait for an answer.

    Reports on standard error what it waits for, if that takes a while. Over DDS, where there may be
    no other node, it returns after a moment.

    Args:
        args: The command's options.
        patient: Whether to wait even if nothing listens, for a robot that is about to start: for
            commands that run until they are ended. ``--timeout`` requests it for others.

    Raises:
        Error: As :func:`rosglass.connect`; ConnectionLostError if there is no answer in time.
    """
    import rosglass

    node = rosglass.connect(
        args.url or None,
        name=args.node_name or anonymous_name(f"rosglass_{args.command}"),
        arguments=args.ros_arguments,
        own_services=False,
    )
    waits = patient or getattr(args, "timeout_given", False)
    try:
        _wait_for_connection(node, TIMEOUT if args.timeout is None else args.timeout, waits)
    except BaseException:
        node.close()
        raise
    return node


def join(url: str, name: str, timeout: float) -> Node:
    """Join the graph at `url`, and wait for an answer; for commands that have the URL.

    In ROS 2, the node serves its type definitions: they may not exist elsewhere in the graph.

    Raises:
        Error: As for :func:`connect`.
    """
    import rosglass

    node = rosglass.connect(url, name=name, own_services=not url.lower().startswith("ros1:"))
    try:
        _wait_for_connection(node, timeout, patient=True)
    except BaseException:
        node.close()
        raise
    return node


def settle(node: Node, least: float = 0.0) -> None:
    """Wait until the graph is complete: no recent changes, and the nodes of every program named.

    Prints on standard error if programs do not name their nodes, and stops waiting after a while.

    Args:
        node: Node in the graph.
        least: Seconds to wait at least.
    """
    wire = node.url.partition(":")[0]
    began = moved = time.monotonic()

    def touch() -> None:
        nonlocal moved
        moved = time.monotonic()

    def reason() -> str:
        count = node.unnamed_programs()
        if count and wire == "zenoh":
            return "the router has not sent the whole graph yet"
        programs = "1 program has not named its" if count == 1 else f"{count} have not named their"
        return f"{programs} nodes yet" if count else ""

    def rest(since: float) -> None:
        """Wait until there are no changes; a graph that always changes is used as it is."""
        while time.monotonic() < min(max(moved + _QUIET[wire], began + least), since + 5.0):
            time.sleep(0.05)

    with node.on_graph_change(touch), telling(reason):
        rest(began)
        if node.unnamed_programs():
            while node.unnamed_programs() and time.monotonic() < began + _INTRODUCTION_S[wire]:
                time.sleep(0.05)
            touch()  # the last received data is being handled
            rest(moved)
    if unnamed := reason():
        note(f"{unnamed}; there may be more than is shown")


def wait(node: Node, look: Callable[[], _T], timeout: float) -> _T:
    """Return the first true value of `look`, called after each change of the graph.

    After `timeout` seconds its last value is returned, true or not.
    """
    changed = threading.Event()
    deadline = time.monotonic() + timeout
    with node.on_graph_change(changed.set):
        while True:
            value = look()
            left = deadline - time.monotonic()
            if value or left <= 0:
                return value
            changed.wait(min(left, 0.2))
            changed.clear()


def find(node: Node, look: Callable[[], _T], timeout: float) -> _T:
    """Wait until the graph is complete, and return the result of `look`.

    Waits less for a missing name than for a robot that has not answered yet.
    """
    wait(node, look, min(timeout, _DISCOVERY if _QUIET[node.url.partition(":")[0]] else 0.0))
    settle(node)
    return look()


@contextmanager
def telling(reason: Callable[[], str]) -> Iterator[None]:
    """Print on standard error why the block waits, if it takes longer than a second.

    Args:
        reason: Returns the reason as a text, with similar names; empty for none. It is called every
            second, in another thread; a new reason is printed.
    """
    done = threading.Event()

    def report() -> None:
        reported = ""
        while not done.wait(_SOON):
            text = ""
            with suppress(Error):  # the caller reports errors
                text = reason()
            if text and text != reported and not done.is_set():
                reported = text
                note(f"waiting: {text}")

    thread = threading.Thread(target=report, name="waiting", daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def note_invalid_names(node: Node) -> None:
    """Print how many names are left out because they break ROS's rules, and some of them."""
    text = left_out(node)
    if text:
        note(text)


def left_out(node: Node) -> str:
    """Return how many names break ROS's rules, and some of them; empty if none does."""
    names = node.invalid_names()
    if not names:
        return ""
    shown = ", ".join(f"{name!r:.80}" for name in names[:_EXAMPLES])
    more = ", ..." if len(names) > _EXAMPLES else ""
    return f"left out, for ROS's rules forbid such names: {len(names)}: {shown}{more}"


def await_types(node: Node, look: Callable[[], Iterable[object]], timeout: float) -> None:
    """Wait until all types that `look` returns are known; ROS 1's servers have to be asked."""
    if node.wire == "ros1":
        wait(node, lambda: all(look()), min(timeout, _DISCOVERY))


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


class End(threading.Event):
    """An event that Ctrl-C and SIGTERM set, so that a command can end in order.

    Create it after everything that it has to end: until then, Ctrl-C is a KeyboardInterrupt, which
    ends any waiting.

    Args:
        patient: Whether pressing Ctrl-C again is ignored; otherwise it cuts short whatever the
            command does in order to end.

    Attributes:
        code: The exit code by the signal that ended the command; 0 for none.
    """

    def __init__(self, *, patient: bool = False) -> None:
        super().__init__()
        self.code = 0
        self._patient = patient
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._receive)

    def _receive(self, number: int, _: object) -> None:
        if self.is_set() and not self._patient:
            raise KeyboardInterrupt
        self.code = 128 + number
        self.set()


def seconds(text: str) -> float:
    """Parse a number of seconds; for options."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not isfinite(value) or not 0 <= value <= 1e9:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds, 0 or more")
    return value


def natural(text: str) -> int:
    """Parse a count of 1 or more; for options."""
    if not (text.isascii() and text.isdigit() and 0 < int(text[:10]) < 2**31):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of 1 or more")
    return int(text)


def _wait_for_connection(node: Node, timeout: float, patient: bool) -> None:
    from rosglass.cli.network import refused
    from rosglass.errors import ConnectionLostError

    connected, deadline = threading.Event(), time.monotonic() + timeout

    def look(status: Status) -> None:
        # Over DDS, a graph without nodes looks the same as a wrong address.
        if status.state is ConnectionState.CONNECTED or node.url.startswith("dds:"):
            connected.set()

    with node.on_status_change(look):
        look(node.status())
        if connected.wait(min(_PROBE_DELAY_S, timeout)):
            return
        refusal = refused(node.url)
        if refusal is not None:
            problem = f"{node.url}: {refusal[0]}; {refusal[1]}"
            if not patient:
                raise ConnectionLostError(problem)
            note(f"{problem}. Waiting for it")
        elif connected.wait(min(_REPORT_DELAY_S, timeout)):
            return
        elif timeout > _REPORT_DELAY_S:
            note(f"{node.url}: {node.status().detail}")
        if connected.wait(max(0.0, deadline - time.monotonic())):
            return
    raise ConnectionLostError(
        f"{node.url}: {node.status().detail}; no answer within {timeout:g} s. Is the robot "
        "on, and the address right? rosglass doctor looks for the reason"
    )
