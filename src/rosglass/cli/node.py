"""``rosglass node``: inspect nodes; in ROS 1 also ping, end and unregister them.

The latter as in ``rosnode``. API: ROS wiki, "ROS/Slave_API" (getPid, shutdown) and "ROS/Master_API"
(lookupNode, unregister...).
"""

from __future__ import annotations

import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

from rosglass.cli.connecting import (
    End,
    as_ros1,
    await_graph,
    await_types,
    connect,
    find,
    is_hidden,
    names_ros1,
    note_invalid_names,
    other_nodes,
    spelled,
    wait,
)
from rosglass.cli.endpoints import DUPLICATES_FIX, describe, duplicates
from rosglass.cli.messages import print_json, to_json
from rosglass.cli.output import Style, note
from rosglass.comm import EndpointKind
from rosglass.comm.names import similar
from rosglass.errors import (
    ConnectionLostError,
    Error,
    MasterError,
    UnsupportedError,
    close_matches,
)
from rosglass.wires.tcpros.master import call_node

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import EndpointInfo, Node
    from rosglass.ros1.node import Ros1Node

__all__ = ["cleanup", "info", "kill", "list_nodes", "ping"]

#: Seconds that a node may take to answer, as in rosnode; and between two pings.
_PING_TIMEOUT_S, _PING_PERIOD_S = 3.0, 1.0
#: Nodes that are pinged at the same time.
_MAX_CONCURRENT = 16
_UNREGISTER = {
    EndpointKind.PUBLISHER: "unregisterPublisher",
    EndpointKind.SUBSCRIPTION: "unregisterSubscriber",
    EndpointKind.SERVICE_SERVER: "unregisterService",
}


def list_nodes(args: argparse.Namespace) -> int:
    """Print the nodes."""
    with connect(args) as node:
        await_graph(node)
        note_invalid_names(node)
        found = other_nodes(node)
        shared = node.duplicate_nodes()
    for name, count in shared.items():
        note(f"{duplicates(name, count)}; {DUPLICATES_FIX}")
    if args.json:
        print_json(found)
        return 0
    for name in found:
        print(name)
    if not found:
        note("there are no other nodes here; rosglass doctor finds out why")
    return 0


def info(args: argparse.Namespace) -> int:
    """Print the topics, services and actions of a node."""
    style = Style(args)
    with connect(args) as node:
        name = "/" + args.node.lstrip("/")
        if not find(node, lambda: name in other_nodes(node), args.timeout):
            return _unknown(node, name)
        await_types(node, lambda: [end.type for end in node.endpoints(name)], args.timeout)
        ends = [end for end in node.endpoints(name) if args.hidden or not is_hidden(node, end.name)]
    if args.json:
        print_json({"node": name, "endpoints": [describe(node, end) for end in ends]})
        return 0
    print(style(name, "bold"))
    groups: dict[str, list[str]] = {}
    for end in ends:
        shown = f" [{spelled(node, end.type)}]" if end.type else ""
        groups.setdefault(end.kind.value, []).append(end.name + shown)
    for kind, lines in groups.items():
        print(style(f"  {kind}s:", "cyan"))
        for line in sorted(set(lines)):
            print(f"    {line}")
    return 0


def _unknown(node: Node, name: str) -> int:
    names = other_nodes(node)
    close = close_matches(name, names, 3, 0.5)
    hint = f"Did you mean {' or '.join(close)}?" if close else f"There are: {', '.join(names)}"
    note(f"there is no node {name}. {hint}")
    return 1


# -- ROS 1 ---------------------------------------------------------------------------------------


class _Answer(NamedTuple):
    """The result of a ping.

    Attributes:
        uri: The node's API; empty if the master does not list the node.
        seconds: Time until the answer.
        problem: Why it did not answer; empty if it did.
    """

    uri: str
    seconds: float = 0.0
    problem: str = ""


def _connect_ros1(args: argparse.Namespace, what: str) -> Ros1Node:
    """Join the graph; raises UnsupportedError if it is not one of ROS 1."""
    if names_ros1(args):
        node = as_ros1(connect(args))
        assert node is not None
        return node
    raise UnsupportedError(
        f"rosglass node {what} is for ROS 1: say --url ros1://robot:11311, or set ROS_MASTER_URI; "
        "ROS 2's nodes cannot be asked for that"
    )


def _full_name(node: Ros1Node, given: str, timeout: float) -> str:
    """Return a node's full name; print a note and return an empty text if there is none."""
    name = "/" + given.lstrip("/")
    if find(node, lambda: name in other_nodes(node), timeout):
        return name
    note(f"there is no node {name} on {node.master_uri}{similar(name, other_nodes(node))}")
    return ""


def _ping_once(node: Ros1Node, name: str, timeout: float) -> _Answer:
    """Ping a node."""
    me = node.resolve(node.name)
    try:
        uri = str(call_node(node.master_uri, "lookupNode", me, name, timeout=timeout))
    except MasterError:
        return _Answer("", problem=f"{node.master_uri} does not know it any more")
    began = time.monotonic()
    try:
        with suppress(MasterError):  # a refusal is an answer, too
            call_node(uri, "getPid", me, timeout=timeout)
    except ConnectionLostError as error:
        return _Answer(uri, problem=str(error))
    return _Answer(uri, time.monotonic() - began)


def ping(args: argparse.Namespace) -> int:
    """Ping a node until Ctrl-C, or up to the requested number."""
    with _connect_ros1(args, "ping") as node:
        name = _full_name(node, args.node, args.timeout)
        if not name:
            return 1
        end = End()
        times: list[float] = []
        asked, due = 0, time.monotonic()
        while not end.is_set():
            answer = _ping_once(node, name, min(args.timeout, _PING_TIMEOUT_S))
            asked += 1
            if not answer.problem:
                times.append(answer.seconds)
            _print_answer(args, name, answer)
            if asked == args.count:
                break
            due = max(due + _PING_PERIOD_S, time.monotonic())
            end.wait(due - time.monotonic())
    if times and not args.json:
        print(
            f"{len(times)} of {asked} answered, {1000 * sum(times) / len(times):.2f} ms on average"
        )
    return end.code or (0 if len(times) == asked else 1)


def _print_answer(args: argparse.Namespace, name: str, answer: _Answer) -> None:
    if args.json:
        took = None if answer.problem else answer.seconds
        found = {"node": name, "uri": answer.uri, "seconds": took, "problem": answer.problem}
        print(to_json(found), flush=True)
    elif answer.problem:
        note(f"{name}: {answer.problem}")
    else:
        print(f"{name} answers at {answer.uri}: time={1000 * answer.seconds:.2f} ms", flush=True)


def kill(args: argparse.Namespace) -> int:
    """Shut nodes down, and wait until they have left the graph."""
    killed: list[str] = []
    kept: list[str] = []
    with _connect_ros1(args, "kill") as node:
        for given in dict.fromkeys(args.node):
            name = _full_name(node, given, args.timeout)
            done = bool(name) and _shut_down(node, name, args.timeout)
            (killed if done else kept).append(name or given)
            if done and not args.json:
                print(f"{name} has ended")
    if args.json:
        print_json({"killed": killed, "failed": kept})
    return 1 if kept else 0


def _shut_down(node: Ros1Node, name: str, timeout: float) -> bool:
    """Ask a node to end, and wait until it has left the graph; returns whether it has."""
    me = node.resolve(node.name)
    answer = _ping_once(node, name, _PING_TIMEOUT_S)
    problem = answer.problem
    if not problem:
        with suppress(ConnectionLostError):  # some end before they have answered
            try:
                call_node(answer.uri, "shutdown", me, "user request", timeout=_PING_TIMEOUT_S)
            except MasterError as error:
                problem = str(error)
    if problem:
        note(f"{name}: {problem}; if it runs no more, rosglass node cleanup removes it")
        return False
    if wait(node, lambda: name not in other_nodes(node), timeout):
        return True
    note(f"{name} was asked to end, but is there after {timeout:g} s still: is it started anew?")
    return False


def cleanup(args: argparse.Namespace) -> int:
    """Unregister nodes that cannot be reached."""
    with _connect_ros1(args, "cleanup") as node:
        names = other_nodes(node)
        with ThreadPoolExecutor(_MAX_CONCURRENT) as pool:
            asked = [pool.submit(_ping_once, node, name, _PING_TIMEOUT_S) for name in names]
            answers = zip(names, [one.result() for one in asked], strict=True)
        gone = {name: answer for name, answer in answers if answer.uri and answer.problem}
        removed = []
        if not args.json:
            for name, answer in gone.items():
                print(f"{name}: {answer.problem}")
        if gone and _confirm(args, len(gone)):
            removed = [name for name, answer in gone.items() if _remove(node, name, answer.uri)]
    if args.json:
        print_json({"unreachable": list(gone), "removed": removed})
    elif not gone:
        note("all nodes can be reached")
    elif removed:
        print(f"{node.master_uri} has forgotten {', '.join(removed)}")
    return 0 if len(removed) == len(gone) else 1


def _confirm(args: argparse.Namespace, count: int) -> bool:
    """Ask for confirmation: nodes that are only out of reach would have to be restarted."""
    if args.yes:
        return True
    if args.json:
        return False
    print(
        "A node that is only out of reach for now would have to be restarted afterwards.\n"
        f"Let the master forget {'it' if count == 1 else f'these {count}'}? [y/N] ",
        end="",
        file=sys.stderr,
        flush=True,
    )
    try:
        agreed = input().strip().lower() in ("y", "yes")
    except EOFError:
        agreed = False
        print(file=sys.stderr)
    if not agreed:
        note("nothing was changed; --yes skips the question")
    return agreed


def _remove(node: Ros1Node, name: str, uri: str) -> bool:
    """Unregister everything of a node, in its name; return whether the master accepted it."""
    try:
        for end in node.endpoints(name):
            _unregister(node, end, uri)
    except Error as error:
        note(f"{name}: {error}")
        return False
    return True


def _unregister(node: Ros1Node, end: EndpointInfo, uri: str) -> None:
    registered = uri
    if end.kind is EndpointKind.SERVICE_SERVER:
        try:
            registered = str(call_node(node.master_uri, "lookupService", end.node.full, end.name))
        except MasterError:
            return  # removed in the meantime
    call_node(node.master_uri, _UNREGISTER[end.kind], end.node.full, end.name, registered)
