"""The checks of ``rosglass doctor`` in ROS 1: the master, names and addresses, and every node.

Most faults of ROS 1 networks are names: each node announces one, and all others must be able to
connect to it (ROS wiki, "ROS/NetworkSetup").
"""

from __future__ import annotations

import socket
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosglass.cli.connecting import left_out, wait
from rosglass.cli.finding import Finding
from rosglass.comm import ConnectionState, anonymous_name
from rosglass.errors import ConnectionLostError, ConversionError, Error, MasterError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.ros1.node import Ros1Node
    from rosglass.ros1.options import Ros1Options

__all__ = ["look"]

_CALLER = "/rosglass_doctor"
#: Nodes that are asked at the same time.
_AT_ONCE = 16
#: Seconds that the master may take to notify of a parameter change.
_ECHO = 3.0
#: The fix for names that break ROS's rules.
_RENAME = "rename them where they are made: letters, digits, '_' and '/', a letter first"
_NETWORK = "set ROS_IP (or ROS_HOSTNAME) {where}, and restart the nodes there"


@dataclass(frozen=True)
class _Place:
    """The address that a node announces, and its problem: ``name``, ``gone``, ``silent``."""

    uri: str
    host: str = ""
    fault: str = ""
    text: str = ""


def look(url: str, timeout: float) -> Iterator[Finding]:
    """Yield the findings in the graph of a ROS 1 master.

    Args:
        url: As given to :func:`rosglass.connect`.
        timeout: Seconds that the master, and each node, may take to answer.
    """
    from rosglass.ros1.options import Ros1Options

    try:
        options = Ros1Options.parse(url)
    except Error as error:
        yield Finding("error", url, str(error))
        return
    fault = _master(options.master, timeout)
    if fault is not None:
        yield fault
        return
    node = _join(url, timeout)
    if isinstance(node, Finding):
        yield node
        return
    with node:
        yield Finding("ok", url, f"a master answers at {options.master}")
        own = list(_own_address(node, options))
        yield from own
        yield from _echo(node, options, own)
        yield from _graph(node)
        yield from _nodes(node, options, timeout)
        yield from _time(node)


def _join(url: str, timeout: float) -> Ros1Node | Finding:
    import rosglass

    try:
        made: Any = rosglass.connect(
            url, name=anonymous_name("rosglass_doctor"), own_services=False
        )
    except Error as error:
        return Finding("error", url, str(error))
    wait(made, lambda: made.status().state is ConnectionState.CONNECTED, timeout)
    status = made.status()
    if status.state is not ConnectionState.CONNECTED:
        made.close()
        return Finding("error", url, status.detail)
    found: Ros1Node = made
    return found


def _master(uri: str, timeout: float) -> Finding | None:
    """Check whether the master answers; None if it does."""
    from rosglass.cli.network import roscore
    from rosglass.wires.tcpros.address import parse_uri
    from rosglass.wires.tcpros.master import call_node

    host, port = parse_uri(uri, "master")
    start = roscore(host, port)
    try:
        with socket.create_connection((host, port), timeout):
            pass
        call_node(uri, "getPid", _CALLER, timeout=timeout)
    except (ConnectionLostError, MasterError) as error:
        text = f"something listens at {host}:{port}, but it is no ROS 1 master: {error}"
        return Finding("error", uri, text, f"look what it is (sudo ss -ltnp), and {start}")
    except ConnectionRefusedError:
        text = f"no master runs: {host} is there, but nothing listens on its port {port}"
        return Finding("error", uri, text, start)
    except (socket.gaierror, UnicodeError):
        fix = "correct the name, use the address, or add both to /etc/hosts"
        return Finding("error", uri, f"no computer is called {host}", fix)
    except TimeoutError:
        fix = f"check the address (ping {host}), and let the firewall pass TCP"
        return Finding("error", uri, f"{host} does not answer on port {port}", fix)
    except OSError as error:
        fix = "connect this machine to the robot's network (ip addr shows where it is)"
        return Finding("error", uri, f"{host} cannot be reached: {error.strerror or error}", fix)
    return None


def _own_address(node: Ros1Node, options: Ros1Options) -> Iterator[Finding]:
    """Check whether the address that nodes here announce makes sense."""
    from rosglass.wires.tcpros.address import doubt, parse_uri

    host, _ = parse_uri(options.master, "master")
    address = node.address
    problem = doubt(address, options.source, host)
    if problem:
        yield Finding("warning", "own address", problem)
    else:
        origin = f"from {options.source}" if options.source else "detected; ROS_IP would set it"
        yield Finding("ok", "own address", f"{address} ({origin})")


def _echo(node: Ros1Node, options: Ros1Options, own: list[Finding]) -> Iterator[Finding]:
    """Check that the master can call back: it announces publishers that way."""
    from rosglass.wires.tcpros.master import call_node

    ready, called = threading.Event(), threading.Event()
    name, master = f"/{node.name}_was_here", options.master

    def hear(value: object) -> None:
        (called if value == 1 else ready).set()

    try:
        with node.parameter_server.subscribe(name, hear):
            ready.wait(_ECHO)
            # Another caller has to set it: the node is not notified of its own changes.
            call_node(master, "setParam", _CALLER, name, 1)
            try:
                arrived = called.wait(_ECHO)
            finally:
                call_node(master, "deleteParam", _CALLER, name)
    except Error as error:
        yield Finding("warning", "own address", f"the master cannot be asked to call back: {error}")
        return
    if arrived:
        yield Finding("ok", "own address", "the master reaches this machine under it")
        return
    text = (
        f"the master cannot reach this machine at {node.address}: it cannot announce publishers, "
        "and the robot's nodes get nothing from here"
    )
    doubted = any(finding.level == "warning" for finding in own)
    fix = "see the warning above" if doubted else "let the firewall here pass TCP from the robot"
    yield Finding("error", "own address", text, f"{fix}; ROS_IP says under which address we are")


def _graph(node: Ros1Node) -> Iterator[Finding]:
    me = node.resolve(node.name)
    others = [name.full for name in node.nodes() if name.full != me]
    if not others:
        yield Finding("warning", node.url, "there are no nodes", "start the robot's programs")
        return
    text = f"{len(others)} nodes, {len(node.topics())} topics, {len(node.services())} services"
    yield Finding("ok", node.url, text)
    if text := left_out(node):
        yield Finding("warning", node.url, text, _RENAME)


def _nodes(node: Ros1Node, options: Ros1Options, timeout: float) -> Iterator[Finding]:
    """Check whether every node can be reached at its announced address."""
    from rosglass.wires.tcpros.address import parse_uri

    me = node.resolve(node.name)
    names = [name.full for name in node.nodes() if name.full != me]
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        asked = {name: pool.submit(_visit, options.master, name, timeout) for name in names}
        places = {name: future.result() for name, future in asked.items()}
    unknown: dict[str, list[str]] = {}
    stale = []
    for name, place in places.items():
        if place.fault == "name":
            unknown.setdefault(place.host, []).append(name)
        elif place.fault == "gone":
            stale.append(name)
        elif place.fault:
            fix = _NETWORK.format(where=f"on {place.host}") if place.fault == "silent" else ""
            yield Finding("warning", name, place.text, fix)
    host, _ = parse_uri(options.master, "master")
    for unknown_host, found in unknown.items():
        text = (
            f"{_several(found)} can be reached under the name {unknown_host} only, "
            "which this machine cannot resolve: nothing is received from there"
        )
        address = _address_of(host)
        fix = (
            f"add it to /etc/hosts here, if that is the master's machine: {address} {unknown_host};"
            f" or {_NETWORK.format(where='there')}"
        )
        yield Finding("error", "names", text, fix)
    if stale:
        text = f"{_several(stale)} no longer run, but the master still lists them"
        yield Finding(
            "warning", "nodes", text, f"rosglass node cleanup --url {node.url} takes them off"
        )
    well = len(places) - len(stale) - sum(map(len, unknown.values()))
    if well == len(places) and places:
        yield Finding("ok", "nodes", "all can be reached")


def _visit(master: str, name: str, timeout: float) -> _Place:
    """Check whether a node answers."""
    from rosglass.wires.tcpros.address import parse_uri
    from rosglass.wires.tcpros.master import call_node

    try:
        uri = str(call_node(master, "lookupNode", _CALLER, name, timeout=timeout))
        host, port = parse_uri(uri, f"what {name} announces")
    except (MasterError, ConnectionLostError):
        return _Place("")  # it has just left
    except ConversionError as error:
        return _Place("", "", "odd", str(error))
    try:
        with socket.create_connection((host, port), timeout):
            pass
        call_node(uri, "getPid", _CALLER, timeout=timeout)
    except (socket.gaierror, UnicodeError):
        return _Place(uri, host, "name")
    except ConnectionRefusedError:
        return _Place(uri, host, "gone")
    except OSError as error:
        text = f"{uri} cannot be reached: {error.strerror or error}"
        return _Place(uri, host, "silent", text)
    except MasterError:
        return _Place(uri, host)  # it answers, even if with a refusal
    except ConnectionLostError as error:
        return _Place(uri, host, "hangs", f"it does not answer: {error}")
    return _Place(uri, host)


def _time(node: Ros1Node) -> Iterator[Finding]:
    """Check for a publisher of /clock if /use_sim_time is set."""
    try:
        simulated = node.parameter_server.get("/use_sim_time", False)
    except Error as error:
        yield Finding("warning", "time", f"the parameter server does not answer: {error}")
        return
    if simulated and not node.publishers("/clock"):
        yield Finding(
            "warning",
            "time",
            "/use_sim_time is true, but /clock has no publisher: time stands still for all nodes",
            "start the simulation, play with --clock, or: rosglass param set /use_sim_time false",
        )


def _address_of(host: str) -> str:
    try:
        return socket.gethostbyname(host)
    except OSError:
        return host


def _several(names: list[str]) -> str:
    shown = ", ".join(names[:5])
    return shown if len(names) <= 5 else f"{shown} and {len(names) - 5} more"
