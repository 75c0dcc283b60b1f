"""``rosglass node ping``, ``kill`` and ``cleanup``, as in ``rosnode``: for ROS 1 only.

API: ROS wiki, "ROS/Slave_API" (getPid, shutdown) and "ROS/Master_API" (lookupNode, unregister...).
"""

from __future__ import annotations

import json
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

from rosglass.cli.completion import complete
from rosglass.cli.connecting import End, add_connection_options, connect, find, natural, wait
from rosglass.cli.output import add_output_options, note, print_json
from rosglass.cli.worlds import as_ros1, names_ros1
from rosglass.comm import EndpointKind
from rosglass.comm.names import similar
from rosglass.errors import ConnectionLostError, Error, MasterError, UnsupportedError

if TYPE_CHECKING:
    import argparse

    from rosglass.cli.subcommands import Subcommands
    from rosglass.comm import EndpointInfo
    from rosglass.ros1.node import Ros1Node

__all__ = ["configure"]

#: Seconds that a node may take to answer, as in rosnode; and between two pings.
_TIMEOUT, _PERIOD = 3.0, 1.0
#: Nodes that are asked at the same time.
_AT_ONCE = 16
_UNREGISTER = {
    EndpointKind.PUBLISHER: "unregisterPublisher",
    EndpointKind.SUBSCRIPTION: "unregisterSubscriber",
    EndpointKind.SERVICE_SERVER: "unregisterService",
}


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


def configure(commands: Subcommands) -> None:
    """Declare the subcommands."""
    sub = commands.add("ping", "ping a node repeatedly (ROS 1)", _ping)
    complete(sub.add_argument("node"), "nodes")
    sub.add_argument(
        "-c", "--count", type=natural, metavar="N", help="exit after this number of pings"
    )
    _finish(sub)
    sub = commands.add("kill", "shut nodes down (ROS 1)", _kill)
    complete(sub.add_argument("node", nargs="+"), "nodes")
    _finish(sub)
    sub = commands.add("cleanup", "unregister nodes that cannot be reached (ROS 1)", _cleanup)
    sub.add_argument("-y", "--yes", action="store_true", help="do not ask for confirmation")
    _finish(sub)


def _finish(parser: argparse.ArgumentParser) -> None:
    add_output_options(parser)
    add_connection_options(parser)


def _connect(args: argparse.Namespace, what: str) -> Ros1Node:
    """Join the graph; raises UnsupportedError if it is not one of ROS 1."""
    if names_ros1(args):
        node = as_ros1(connect(args))
        assert node is not None
        return node
    raise UnsupportedError(
        f"rosglass node {what} is for ROS 1: say --url ros1://robot:11311, or set ROS_MASTER_URI; "
        "ROS 2's nodes cannot be asked for that"
    )


def _others(node: Ros1Node) -> list[str]:
    me = node.resolve(node.name)
    return [name.full for name in node.nodes() if name.full != me]


def _known(node: Ros1Node, given: str, timeout: float) -> str:
    """Return a node's full name; print a note and return an empty text if there is none."""
    name = "/" + given.lstrip("/")
    if find(node, lambda: name in _others(node), timeout):
        return name
    note(f"there is no node {name} on {node.master_uri}{similar(name, _others(node))}")
    return ""


def _visit(node: Ros1Node, name: str, timeout: float) -> _Answer:
    """Ping a node."""
    from rosglass.wires.tcpros.master import call_node

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


# -- ping ----------------------------------------------------------------------------------------


def _ping(args: argparse.Namespace) -> int:
    with _connect(args, "ping") as node:
        name = _known(node, args.node, args.timeout)
        if not name:
            return 1
        end = End()
        times: list[float] = []
        asked, due = 0, time.monotonic()
        while not end.is_set():
            answer = _visit(node, name, min(args.timeout, _TIMEOUT))
            asked += 1
            if not answer.problem:
                times.append(answer.seconds)
            _tell(args, name, answer)
            if asked == args.count:
                break
            due = max(due + _PERIOD, time.monotonic())
            end.wait(due - time.monotonic())
    if times and not args.json:
        print(
            f"{len(times)} of {asked} answered, {1000 * sum(times) / len(times):.2f} ms on average"
        )
    return end.code or (0 if len(times) == asked else 1)


def _tell(args: argparse.Namespace, name: str, answer: _Answer) -> None:
    if args.json:
        took = None if answer.problem else answer.seconds
        found = {"node": name, "uri": answer.uri, "seconds": took, "problem": answer.problem}
        print(json.dumps(found, ensure_ascii=False), flush=True)
    elif answer.problem:
        note(f"{name}: {answer.problem}")
    else:
        print(f"{name} answers at {answer.uri}: time={1000 * answer.seconds:.2f} ms", flush=True)


# -- kill ----------------------------------------------------------------------------------------


def _kill(args: argparse.Namespace) -> int:
    killed: list[str] = []
    kept: list[str] = []
    with _connect(args, "kill") as node:
        for given in dict.fromkeys(args.node):
            name = _known(node, given, args.timeout)
            done = bool(name) and _end(node, name, args.timeout)
            (killed if done else kept).append(name or given)
            if done and not args.json:
                print(f"{name} has ended")
    if args.json:
        print_json({"killed": killed, "failed": kept})
    return 1 if kept else 0


def _end(node: Ros1Node, name: str, timeout: float) -> bool:
    """Ask a node to end, and wait until it has left the graph; returns whether it has."""
    from rosglass.wires.tcpros.master import call_node

    me = node.resolve(node.name)
    answer = _visit(node, name, _TIMEOUT)
    problem = answer.problem
    if not problem:
        with suppress(ConnectionLostError):  # some end before they have answered
            try:
                call_node(answer.uri, "shutdown", me, "user request", timeout=_TIMEOUT)
            except MasterError as error:
                problem = str(error)
    if problem:
        note(f"{name}: {problem}; if it runs no more, rosglass node cleanup removes it")
        return False
    if wait(node, lambda: name not in _others(node), timeout):
        return True
    note(f"{name} was asked to end, but is there after {timeout:g} s still: is it started anew?")
    return False


# -- cleanup -------------------------------------------------------------------------------------


def _cleanup(args: argparse.Namespace) -> int:
    with _connect(args, "cleanup") as node:
        names = _others(node)
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            asked = [pool.submit(_visit, node, name, _TIMEOUT) for name in names]
            answers = zip(names, [one.result() for one in asked], strict=True)
        gone = {name: answer for name, answer in answers if answer.uri and answer.problem}
        removed = []
        if not args.json:
            for name, answer in gone.items():
                print(f"{name}: {answer.problem}")
        if gone and _agreed(args, len(gone)):
            removed = [name for name, answer in gone.items() if _remove(node, name, answer.uri)]
    if args.json:
        print_json({"unreachable": list(gone), "removed": removed})
    elif not gone:
        note("all nodes can be reached")
    elif removed:
        print(f"{node.master_uri} has forgotten {', '.join(removed)}")
    return 0 if len(removed) == len(gone) else 1


def _agreed(args: argparse.Namespace, count: int) -> bool:
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
    from rosglass.wires.tcpros.master import call_node

    place = uri
    if end.kind is EndpointKind.SERVICE_SERVER:
        try:
            place = str(call_node(node.master_uri, "lookupService", end.node.full, end.name))
        except MasterError:
            return  # removed in the meantime
    call_node(node.master_uri, _UNREGISTER[end.kind], end.node.full, end.name, place)
