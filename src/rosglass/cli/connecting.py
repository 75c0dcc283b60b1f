"""Joining the robot's graph, and waiting for what is in it; the same in all commands."""

from __future__ import annotations

import os
import signal
import threading
import time
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TypeVar

import rosglass
from rosglass.cli.network import refused
from rosglass.cli.output import note
from rosglass.cli.parser import TIMEOUT_S
from rosglass.comm import ConnectionState, anonymous_name
from rosglass.comm.handle import undo_on_error
from rosglass.comm.names import hidden
from rosglass.connection import default_url
from rosglass.errors import ConnectionLostError, Error, TypeNotFoundError
from rosglass.interfaces.names import spelled_ros1

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterable, Iterator

    from rosglass.comm import Node, Status
    from rosglass.ros1.node import Ros1Node

__all__ = [
    "End",
    "as_ros1",
    "await_graph",
    "await_types",
    "connect",
    "create_typed",
    "explained_wait",
    "find",
    "invalid_names",
    "is_hidden",
    "is_ros1",
    "join",
    "names_ros1",
    "note_invalid_names",
    "other_nodes",
    "spelled",
    "spelled_for",
    "wait",
]

#: Number of names in a hint.
_MAX_EXAMPLES = 3
_T = TypeVar("_T")
#: Seconds that an existing entity may take to appear in the graph, or to announce its type.
_DISCOVERY_S = 3.0
#: Seconds after which a command reports what it waits for, and probes an address without answer.
_REPORT_DELAY_S, _PROBE_DELAY_S = 2.0, 0.5
#: Seconds between two reports of what a command waits for once the robot has answered.
_REPORT_PERIOD_S = 1.0
#: Seconds that programs have to name their nodes: Fast DDS takes 1 to 4; a Zenoh router with 10,000
#: topics 4 to 13.
_INTRODUCTION_S = {"dds": 8.0, "zenoh": 18.0}
#: Seconds without changes after which the graph counts as complete; some are at once.
_QUIET_S = {"zenoh": 0.3, "dds": 0.7, "ros1": 0.0, "replay": 0.0, "local": 0.0}


def connect(args: argparse.Namespace, *, wait_for_start: bool = False) -> Node:
    """Join the graph given by the options, and wait for an answer.

    Reports on standard error what it waits for, if that takes a while. Over DDS, where there may be
    no other node, it returns after a moment.

    Args:
        args: The command's options.
        wait_for_start: Whether to wait even if nothing listens, for a robot that is about to
            start: for commands that run until they are ended. ``--timeout`` requests it for others.

    Raises:
        Error: As :func:`rosglass.connect`; ConnectionLostError if there is no answer in time.
    """
    node = rosglass.connect(
        args.url or None,
        name=args.node_name or anonymous_name(f"rosglass_{args.command}"),
        arguments=args.ros_arguments,
        own_services=False,
    )
    wait_for_start = wait_for_start or getattr(args, "timeout_given", False)
    timeout = TIMEOUT_S if args.timeout is None else args.timeout
    with undo_on_error(node.close):
        _wait_for_connection(node, timeout, wait_for_start)
    return node


def create_typed(
    node: Node, create: Callable[[], _T], type_name: str | None, timeout: float | None
) -> _T:
    """Return the result of `create` for a type that only the robot may have.

    A command's node is new: it may not know yet who uses the type, and would not ask them.

    Raises:
        TypeNotFoundError: No definition is known, nor sent by the robot within the timeout.
    """
    try:
        return create()
    except TypeNotFoundError as missing:
        if type_name is None:
            raise
        try:
            node.fetch_type(type_name, timeout=TIMEOUT_S if timeout is None else timeout)
        except TypeNotFoundError:
            raise missing from None
        return create()


def join(url: str, name: str, timeout: float) -> Node:
    """Join the graph at `url`, and wait for an answer; for commands that have the URL.

    In ROS 2, the node serves its type definitions: they may not exist elsewhere in the graph.

    Raises:
        Error: As for :func:`connect`.
    """
    node = rosglass.connect(url, name=name, own_services=not url.lower().startswith("ros1:"))
    with undo_on_error(node.close):
        _wait_for_connection(node, timeout, wait_for_start=True)
    return node


def await_graph(node: Node, least: float = 0.0) -> None:
    """Wait until the graph is complete: no recent changes, and the nodes of every program named.

    Prints on standard error if programs do not name their nodes, and stops waiting after a while.

    Args:
        node: Node in the graph.
        least: Seconds to wait at least.
    """
    wire = node.url.partition(":")[0]
    began = changed_at = time.monotonic()

    def on_change() -> None:
        nonlocal changed_at
        changed_at = time.monotonic()

    def reason() -> str:
        count = node.unnamed_programs()
        if count and wire == "zenoh":
            return "the router has not sent the whole graph yet"
        programs = "1 program has not named its" if count == 1 else f"{count} have not named their"
        return f"{programs} nodes yet" if count else ""

    def wait_until_quiet(since: float) -> None:
        """Wait until there are no changes; a graph that always changes is used as it is."""
        while time.monotonic() < min(max(changed_at + _QUIET_S[wire], began + least), since + 5.0):
            time.sleep(0.05)

    def awaits_programs() -> bool:
        in_time = time.monotonic() < began + _INTRODUCTION_S.get(wire, 0.0)
        return in_time and node.unnamed_programs() > 0

    with node.on_graph_change(on_change), explained_wait(reason):
        wait_until_quiet(began)
        while awaits_programs():  # again if the router is lost after that
            while awaits_programs():
                time.sleep(0.05)
            on_change()  # the last received data is being handled
            wait_until_quiet(changed_at)
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


def find(node: Node, look: Callable[[], _T], timeout: float, *, whole: bool = True) -> _T:
    """Wait until the graph is complete, and return the result of `look`.

    Waits less for a missing name than for a robot that has not answered yet.

    Args:
        node: Node in the graph.
        look: Called after each change of the graph.
        timeout: Seconds.
        whole: False to return the first true result, without waiting for the rest of the graph.
    """
    within = min(timeout, _DISCOVERY_S if _QUIET_S[node.url.partition(":")[0]] else 0.0)
    if (found := wait(node, look, within)) and not whole:
        return found
    await_graph(node)
    return look()


@contextmanager
def explained_wait(reason: Callable[[], str]) -> Iterator[None]:
    """Print on standard error why the block waits, if it takes longer than a second.

    Args:
        reason: Returns the reason as a text, with similar names; empty for none. It is called every
            second, in another thread; a new reason is printed.
    """
    done = threading.Event()

    def report() -> None:
        reported = ""
        while not done.wait(_REPORT_PERIOD_S):
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


def other_nodes(node: Node) -> list[str]:
    """Return the full names of all nodes except that of this command."""
    me = node.resolve(node.name)
    return [name.full for name in node.nodes() if name.full != me]


def note_invalid_names(node: Node) -> None:
    """Print how many names are left out because they break ROS's rules, and some of them."""
    if text := invalid_names(node):
        note(text)


def invalid_names(node: Node) -> str:
    """Return how many names break ROS's rules, and some of them; empty if none does."""
    names = node.invalid_names()
    if not names:
        return ""
    shown = ", ".join(f"{name!r:.80}" for name in names[:_MAX_EXAMPLES])
    more = ", ..." if len(names) > _MAX_EXAMPLES else ""
    return f"left out, for ROS's rules forbid such names: {len(names)}: {shown}{more}"


def await_types(node: Node, look: Callable[[], Iterable[object]], timeout: float) -> None:
    """Wait until all types that `look` returns are known; ROS 1's servers have to be asked."""
    if node.wire == "ros1":
        wait(node, lambda: all(look()), min(timeout, _DISCOVERY_S))


class End(threading.Event):
    """An event that Ctrl-C and SIGTERM set, so that a command can end in order.

    Create it after everything that it has to end: until then, Ctrl-C is a KeyboardInterrupt, which
    ends any waiting.

    Args:
        once: Whether pressing Ctrl-C again is ignored; otherwise it cuts short whatever the
            command does in order to end.

    Attributes:
        code: The exit code by the signal that ended the command; 0 for none.
    """

    def __init__(self, *, once: bool = False) -> None:
        super().__init__()
        self.code = 0
        self._once = once
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, _: object) -> None:
        if self.is_set() and not self._once:
            raise KeyboardInterrupt
        self.code = 128 + number
        self.set()


def _wait_for_connection(node: Node, timeout: float, wait_for_start: bool) -> None:
    connected, deadline = threading.Event(), time.monotonic() + timeout

    def on_status(status: Status) -> None:
        # Over DDS, a graph without nodes looks the same as a wrong address.
        if status.state is ConnectionState.CONNECTED or node.url.startswith("dds:"):
            connected.set()

    with node.on_status_change(on_status):
        on_status(node.status())
        if connected.wait(min(_PROBE_DELAY_S, timeout)):
            return
        problem = ""
        refusal = refused(node.url)
        if refusal is not None:
            problem = f"{node.url}: {refusal[0]}; {refusal[1]}"
            if not wait_for_start:
                raise ConnectionLostError(problem)
            note(f"{problem}. Waiting for it")
        elif connected.wait(min(_REPORT_DELAY_S, timeout)):
            return
        elif timeout > _REPORT_DELAY_S:
            note(f"{node.url}: {node.status().detail}")
        if connected.wait(max(0.0, deadline - time.monotonic())):
            return
    if problem:
        raise ConnectionLostError(f"{problem}; no answer within {timeout:g} s")
    raise ConnectionLostError(
        f"{node.url}: {node.status().detail}; no answer within {timeout:g} s. Is the robot "
        "on, and the address right? rosglass doctor looks for the reason"
    )


# -- differences of ROS 1 and ROS 2 --------------------------------------------------------------


def names_ros1(args: argparse.Namespace) -> bool:
    """Return whether the options, or else the environment, name a ROS 1 master."""
    url = getattr(args, "url", "")
    with suppress(Error):  # connecting reports it
        url = url or default_url(os.environ)
    return str(url).lower().startswith("ros1:")


def is_ros1(node: Node) -> bool:
    """Return whether a node is in a ROS 1 graph."""
    return node.wire == "ros1"


def as_ros1(node: Node) -> Ros1Node | None:
    """Return a node of a ROS 1 graph with its own class; None for any other node."""
    found: Any = node
    return found if is_ros1(node) else None


def is_hidden(node: Node, name: str) -> bool:
    """Return whether lists leave a name out; ROS 1 hides none."""
    return not is_ros1(node) and hidden(name)


def spelled_for(args: argparse.Namespace, text: str) -> str:
    """Return a text with types' names as the ROS version that the options name spells them."""
    ros1 = getattr(args, "ros1", hasattr(args, "url") and names_ros1(args))
    return spelled_ros1(text) if ros1 else text


def spelled(node: Node, text: str) -> str:
    """Return a type's name, or a text that has some, as the node's ROS version spells them."""
    return spelled_ros1(text) if is_ros1(node) else text
