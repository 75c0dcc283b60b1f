"""``rosglass doctor``: find what separates this machine from the robot, and how to fix it.

Most faults of ROS 1 networks are names: each node announces one, and all others must be able to
connect to it (ROS wiki, "ROS/NetworkSetup").
"""

from __future__ import annotations

import os
import platform
import shlex
import socket
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rosglass
from rosglass.cli.connecting import await_graph, invalid_names, other_nodes, wait
from rosglass.cli.endpoints import DUPLICATES_FIX, duplicates, problems
from rosglass.cli.messages import print_json
from rosglass.cli.network import (
    interfaces,
    is_loopback,
    refused,
    ros1_options,
    router_problem,
    start_master,
)
from rosglass.cli.output import Style
from rosglass.comm import ConnectionState, anonymous_name
from rosglass.connection import default_url
from rosglass.errors import ConnectionLostError, ConversionError, Error, MasterError
from rosglass.extras import explain_missing, install_command
from rosglass.messages import default_library
from rosglass.wires.tcpros.address import explain_unreachable, parse_uri
from rosglass.wires.tcpros.master import call_node
from rosglass.wires.zenoh.options import shown_url

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from rosglass.comm import Node
    from rosglass.ros1.node import Ros1Node
    from rosglass.ros1.options import Ros1Options

__all__ = ["run"]

#: Package -> what it is for, and the extra that installs it.
_PACKAGES = {
    "cyclonedds": ("ROS 2 over DDS", "dds"),
    "eclipse-zenoh": ("ROS 2 over Zenoh", "zenoh"),
    "PySide6-Essentials": ("interfaces in QML", "qml"),
    "PySide6-Addons": ("camera images in QML", "camera"),
    "opencv-python-headless": ("compressed images", "images"),
    "av": ("H.264, HEVC, AV1 and Theora videos", "video"),
    "mcap": ("recordings", "bags"),
    "rosbags": ("ROS 1 bags and SQLite bags", "bags"),
    "argcomplete": ("Tab completion", "completion"),
}
_VARIABLES = (
    "ROSGLASS_URL",
    "RMW_IMPLEMENTATION",
    "ROS_DISTRO",
    "ROS_DOMAIN_ID",
    "ROS_LOCALHOST_ONLY",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS",
    "CYCLONEDDS_URI",
    "ZENOH_SESSION_CONFIG_URI",
    "AMENT_PREFIX_PATH",
    "ROS_MASTER_URI",
    "ROS_IP",
    "ROS_HOSTNAME",
    "ROS_PACKAGE_PATH",
)
#: Receive buffer in bytes that a camera image needs.
_BUFFER_BYTES = 4 * 2**20
#: Memory for IP fragments, in bytes, and seconds that they may stay, as ROS 2's guide recommends.
_FRAGMENTS_BYTES, _FRAGMENTS_S = 128 * 2**20, 3
_NO_NETWORK = "connect a network, or for this machine alone: sudo ip link set lo up multicast on"
#: The fix for names that break ROS's rules.
_RENAME = "rename them where they are made: letters, digits, '_' and '/', no digit first"
#: Types of messages that may be megabytes.
_LARGE_TYPES = {"sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2"}
#: Seconds to explore a graph, and a domain of ``--scan``.
_EXPLORE_S, _SCAN_S = 3.0, 1.5


@dataclass(frozen=True)
class _Finding:
    """The result of a check.

    Attributes:
        level: ``ok``, ``note``, ``warning`` or ``error``.
        area: The checked area.
        text: The result.
        fix: How to fix it.
    """

    level: str
    area: str
    text: str
    fix: str = ""


def run(args: argparse.Namespace) -> int:
    """Check everything; returns 1 if something is broken."""
    style = Style(args)
    marks = {
        "ok": style("ok     ", "green"),
        "note": style("note   ", "cyan"),
        "warning": style("warning", "yellow"),
        "error": style("error  ", "red", "bold"),
    }
    found = []
    for result in _findings(args):
        finding = replace(result, area=shown_url(result.area))
        found.append(finding)
        if args.json:
            continue
        print(f"{marks[finding.level]} {finding.area}: {finding.text}", flush=True)
        if finding.fix:
            print(f"        {style('-> ' + finding.fix, 'bold')}", flush=True)
    if args.json:
        print_json([asdict(finding) for finding in found])
    return 1 if any(finding.level == "error" for finding in found) else 0


def _findings(args: argparse.Namespace) -> Iterator[_Finding]:
    urls, given = _urls(args)
    ros2 = any(not url.lower().startswith("ros1:") for url in urls)
    yield from _programs()
    yield from _environment()
    yield from _definitions()
    if ros2:
        yield from _kernel()
    yield from _interfaces(ros2)
    answering = []
    for url in urls:
        findings = list(_robot(url, args.timeout))
        if any(finding.level == "error" for finding in findings):
            # Without a given URL, a missing robot is not an error yet.
            findings = [replace(f, level=f.level if given else "note") for f in findings]
        else:
            answering.append(url)
        yield from findings
    if not given:
        yield _unset_url(answering)
    if args.scan:
        yield from _scan()


def _programs() -> Iterator[_Finding]:
    yield _Finding(
        "ok",
        "rosglass",
        f"{rosglass.__version__} on Python {platform.python_version()} ({sys.executable})",
    )
    for package, (purpose, extra) in _PACKAGES.items():
        try:
            yield _Finding("ok", package, f"{version(package)}, for {purpose}")
        except PackageNotFoundError:  # noqa: PERF203 - each package is a finding
            fix = install_command(extra)
            yield _Finding("note", package, f"not installed; needed for {purpose}", fix)


def _environment() -> Iterator[_Finding]:
    shown = [f"{name}={os.environ[name]}" for name in _VARIABLES if os.environ.get(name)]
    yield _Finding("ok", "environment", "; ".join(shown) or "no variables of ROS or rosglass")
    for folder in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        if not Path(folder).is_dir():
            fix = "source the workspace anew, or unset AMENT_PREFIX_PATH"
            yield _Finding("warning", "environment", f"AMENT_PREFIX_PATH names {folder}: gone", fix)


def _definitions() -> Iterator[_Finding]:
    counts = [len(default_library().names(ros)) for ros in (1, 2)]
    text = f"{counts[1]} types of ROS 2 and {counts[0]} of ROS 1 are known on this machine"
    yield _Finding("ok", "definitions", text)


def _kernel() -> Iterator[_Finding]:
    limit = Path("/proc/sys/net/core/rmem_max")
    if not limit.exists():
        return
    size = int(limit.read_text())
    if size < _BUFFER_BYTES:
        yield _Finding(
            "warning",
            "network",
            f"receive buffers are limited to {size} bytes: large images get lost over DDS",
            f"sudo sysctl -w net.core.rmem_max={_BUFFER_BYTES} (and into /etc/sysctl.d to keep it)",
        )
    else:
        yield _Finding("ok", "network", f"receive buffers up to {size / 2**20:.0f} MiB")
    yield from _fragments()


def _fragments(folder: Path = Path("/proc/sys/net/ipv4")) -> Iterator[_Finding]:
    """Yield whether the kernel has room for the IP fragments of large datagrams.

    ROS 2 nodes on Fast DDS and Cyclone DDS send datagrams of up to 64 kB. What is left of one that
    lost a packet stays for a while, and if it fills the memory, none arrives.
    """
    try:
        size = int((folder / "ipfrag_high_thresh").read_text())
        seconds = int((folder / "ipfrag_time").read_text())
    except (OSError, ValueError):
        return
    text = f"IP fragments may take {size / 2**20:.0f} MiB, and {seconds} s each"
    if size >= _FRAGMENTS_BYTES or seconds <= _FRAGMENTS_S:
        yield _Finding("ok", "network", text)
    else:
        yield _Finding(
            "note",
            "network",
            f"{text}: after packets were lost, no large message arrives over DDS for that long",
            f"sudo sysctl -w net.ipv4.ipfrag_time={_FRAGMENTS_S} "
            f"net.ipv4.ipfrag_high_thresh={_FRAGMENTS_BYTES} (and into /etc/sysctl.d to keep it)",
        )


def _interfaces(ros2: bool) -> Iterator[_Finding]:
    found = interfaces()
    if found is None:
        return
    names = ", ".join(interface.name for interface in found)
    if not found:
        yield _Finding("error", "network", "no network interface is up", _NO_NETWORK)
    elif ros2 and not any(interface.has_multicast for interface in found):
        yield _Finding(
            "warning",
            "network",
            f"no network interface that is up ({names}) takes multicast, by which ROS 2's programs "
            "find each other over DDS",
            "connect a network, or for this machine alone: sudo ip link set lo multicast on && "
            "sudo ip route add 224.0.0.0/4 dev lo",
        )
    elif all(interface.is_loopback for interface in found):
        yield _Finding(
            "note", "network", f"only {names} is up: nothing but this machine is reached"
        )
    else:
        yield _Finding("ok", "network", f"{names} up")


def _unset_url(answering: list[str]) -> _Finding:
    """Return which URL to set if none is set."""
    if not answering:
        text = "no URL is given, and no robot answers on this machine"
        fix = (
            "export ROSGLASS_URL=zenoh://<robot's address> (or dds://, ros1://<its address>), "
            "and see the notes above"
        )
        return _Finding("error", "address", text, fix)
    text = f"no URL is given; found: {', '.join(answering)}"
    return _Finding("warning", "address", text, f"export ROSGLASS_URL={shlex.quote(answering[0])}")


def _urls(args: argparse.Namespace) -> tuple[list[str], bool]:
    """Return the URLs to check, and whether one was given."""
    if args.url:
        return [args.url], True
    try:
        return [default_url(os.environ)], True
    except Error:
        return ["zenoh://127.0.0.1:7447", "dds://", "ros1://127.0.0.1:11311"], False


def _robot(url: str, timeout: float) -> Iterator[_Finding]:
    if url.lower().startswith("ros1:"):
        yield from _robot_ros1(url, timeout)
        return
    try:
        node = rosglass.connect(url, name=f"rosglass_doctor_{os.getpid()}", own_services=False)
    except ModuleNotFoundError as error:
        text, _, fix = explain_missing(error).partition("; ")
        yield _Finding("error", url, text or str(error), fix)
        return
    except Error as error:
        no_network = url.startswith("dds:") and interfaces() == []
        yield _Finding("error", url, str(error), _NO_NETWORK if no_network else "")
        return
    with node:
        wait(node, lambda: node.status().state is ConnectionState.CONNECTED, timeout)
        status = node.status()
        if status.state is not ConnectionState.CONNECTED:
            # A configuration file may name another router.
            asks = url.startswith("zenoh:") and not os.environ.get("ZENOH_SESSION_CONFIG_URI")
            text, fix = refused(url) or (router_problem(url, timeout) if asks else ("", ""))
            yield _Finding("error", url, text or status.detail, fix or _advice(url))
            return
        yield _Finding("ok", url, status.detail or "connected")
        await_graph(node, _EXPLORE_S)
        yield from _graph(node)
        if url.lower().startswith("dds:"):
            yield from _large_messages(node)


def _large_messages(node: Node) -> Iterator[_Finding]:
    """Yield whether programs on Fast DDS subscribe to what rosglass sends them too slowly."""
    from rosglass.wires.dds.domain import DdsOptions, large_sample_advice  # noqa: PLC0415 - an extra
    from rosglass.wires.dds.flow_control import is_fast_dds  # noqa: PLC0415

    fix = large_sample_advice(DdsOptions.parse(node.url, os.environ))
    topics = [
        topic
        for topic, types in node.topics().items()
        if _LARGE_TYPES & set(types) and any(is_fast_dds(s.gid) for s in node.subscriptions(topic))
    ]
    if fix and topics:
        text = (
            f"programs on Fast DDS subscribe to {_several(topics)}: what rosglass publishes there "
            "reaches them at 40 MB/s at most, in datagrams of one packet"
        )
        yield _Finding("note", node.url, text, fix)


def _advice(url: str) -> str:
    if url.startswith("zenoh:"):
        router = "rosglass router" if is_loopback(url) else "rosglass router --open"
        return (
            f"start the robot's programs, with RMW_IMPLEMENTATION=rmw_zenoh_cpp, and a router for "
            f"them: ros2 run rmw_zenoh_cpp rmw_zenohd (or: {router})"
        )
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return (
            "ROS_LOCALHOST_ONLY=1 keeps this machine to itself. To reach a robot elsewhere: "
            "unset ROS_LOCALHOST_ONLY"
        )
    if os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() in ("LOCALHOST", "OFF"):
        return (
            "ROS_AUTOMATIC_DISCOVERY_RANGE keeps this machine to itself. To reach a robot "
            "elsewhere: export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"
        )
    return (
        "check that the robot is on, in the same network and ROS_DOMAIN_ID (--scan looks in "
        "others), and that the network lets multicast through; if not: dds://<robot's address>"
    )


def _graph(node: Node) -> Iterator[_Finding]:
    others = other_nodes(node)
    topics = node.topics()
    if not others and not topics:
        yield _Finding("warning", node.url, "there are no nodes", _advice(node.url))
        return
    yield _Finding(
        "ok",
        node.url,
        f"{len(others)} nodes, {len(topics)} topics, {len(node.services())} services, "
        f"{len(node.actions())} actions",
    )
    if text := invalid_names(node):
        yield _Finding("warning", node.url, text, _RENAME)
    for name, count in node.duplicate_nodes().items():
        yield _Finding("warning", node.url, duplicates(name, count), DUPLICATES_FIX)
    for topic in topics:
        ends = [*node.publishers(topic), *node.subscriptions(topic)]
        for problem in problems(ends):
            yield _Finding("warning", topic, problem.text, problem.fix)


def _scan() -> Iterator[_Finding]:
    for domain in range(11):
        url = f"dds://?domain={domain}"
        try:
            node = rosglass.connect(url, name=f"rosglass_doctor_{os.getpid()}", own_services=False)
        except (Error, ModuleNotFoundError) as error:
            yield _Finding("error", url, str(error))
            return
        with node:
            await_graph(node, _SCAN_S)
            others = other_nodes(node)
        if others:
            shown = ", ".join(others[:5]) + (" ..." if len(others) > 5 else "")
            yield _Finding("ok", url, f"{len(others)} nodes: {shown}", f"use --url '{url}'")
        else:
            yield _Finding("note", url, "no nodes")


# -- ROS 1 ---------------------------------------------------------------------------------------

_CALLER = "/rosglass_doctor"
#: Nodes that are asked at the same time.
_MAX_CONCURRENT = 16
#: Seconds that the master may take to notify of a parameter change.
_CALL_BACK_TIMEOUT_S = 3.0
#: The fix for names that break ROS's rules.
_RENAME_ROS1 = "rename them where they are made: letters, digits, '_' and '/', a letter first"
_SET_ROS_IP = "set ROS_IP (or ROS_HOSTNAME) {where}, and restart the nodes there"


@dataclass(frozen=True)
class _NodeAddress:
    """The address that a node announces, and its problem: ``name``, ``gone``, ``silent``."""

    uri: str
    host: str = ""
    fault: str = ""
    text: str = ""


def _robot_ros1(url: str, timeout: float) -> Iterator[_Finding]:
    """Yield the findings in the graph of a ROS 1 master.

    Args:
        url: As given to :func:`rosglass.connect`.
        timeout: Seconds that the master, and each node, may take to answer.
    """
    try:
        options = ros1_options(url)
    except Error as error:
        yield _Finding("error", url, str(error))
        return
    fault = _master(options.master, timeout)
    if fault is not None:
        yield fault
        return
    node = _join_ros1(url, timeout)
    if isinstance(node, _Finding):
        yield node
        return
    with node:
        yield _Finding("ok", url, f"a master answers at {options.master}")
        own = list(_own_address(node, options))
        yield from own
        yield from _call_back(node, options, own)
        yield from _graph_ros1(node)
        yield from _nodes_ros1(node, options, timeout)
        yield from _simulated_time(node)


def _join_ros1(url: str, timeout: float) -> Ros1Node | _Finding:
    try:
        made: Any = rosglass.connect(
            url, name=anonymous_name("rosglass_doctor"), own_services=False
        )
    except Error as error:
        return _Finding("error", url, str(error))
    wait(made, lambda: made.status().state is ConnectionState.CONNECTED, timeout)
    status = made.status()
    if status.state is not ConnectionState.CONNECTED:
        made.close()
        return _Finding("error", url, status.detail)
    found: Ros1Node = made
    return found


def _master(uri: str, timeout: float) -> _Finding | None:
    """Check whether the master answers; None if it does."""
    host, port = parse_uri(uri, "master")
    start = start_master(host, port)
    try:
        with socket.create_connection((host, port), timeout):
            pass
        call_node(uri, "getPid", _CALLER, timeout=timeout)
    except (ConnectionLostError, MasterError) as error:
        text = f"something listens at {host}:{port}, but it is not a ROS 1 master: {error}"
        return _Finding("error", uri, text, f"find out what it is (sudo ss -ltnp), and {start}")
    except ConnectionRefusedError:
        text = f"no master runs: {host} is there, but nothing listens on its port {port}"
        return _Finding("error", uri, text, start)
    except (socket.gaierror, UnicodeError):
        fix = "correct the name, use the address, or add both to /etc/hosts"
        return _Finding("error", uri, f"no computer is called {host}", fix)
    except TimeoutError:
        fix = f"check the address (ping {host}), and let the firewall pass TCP"
        return _Finding("error", uri, f"{host} does not answer on port {port}", fix)
    except OSError as error:
        fix = "connect this machine to the robot's network (ip addr shows where it is)"
        return _Finding("error", uri, f"{host} cannot be reached: {error.strerror or error}", fix)
    return None


def _own_address(node: Ros1Node, options: Ros1Options) -> Iterator[_Finding]:
    """Check whether the address that nodes here announce makes sense."""
    host, _ = parse_uri(options.master, "master")
    address = node.address
    problem = explain_unreachable(address, options.source, host)
    if problem:
        yield _Finding("warning", "own address", problem)
    else:
        origin = f"from {options.source}" if options.source else "detected; ROS_IP would set it"
        yield _Finding("ok", "own address", f"{address} ({origin})")


def _call_back(node: Ros1Node, options: Ros1Options, own: list[_Finding]) -> Iterator[_Finding]:
    """Check that the master can call back: it announces publishers that way."""
    ready, called = threading.Event(), threading.Event()
    name, master = f"/{node.name}_was_here", options.master

    def on_value(value: object) -> None:
        (called if value == 1 else ready).set()

    try:
        with node.parameter_server.subscribe(name, on_value):
            ready.wait(_CALL_BACK_TIMEOUT_S)
            # Another caller has to set it: the node is not notified of its own changes.
            call_node(master, "setParam", _CALLER, name, 1)
            try:
                arrived = called.wait(_CALL_BACK_TIMEOUT_S)
            finally:
                call_node(master, "deleteParam", _CALLER, name)
    except Error as error:
        yield _Finding(
            "warning", "own address", f"the master cannot be asked to call back: {error}"
        )
        return
    if arrived:
        yield _Finding("ok", "own address", "the master reaches this machine under it")
        return
    text = (
        f"the master cannot reach this machine at {node.address}: it cannot announce publishers, "
        "and the robot's nodes get nothing from here"
    )
    doubted = any(finding.level == "warning" for finding in own)
    fix = "see the warning above" if doubted else "let the firewall here pass TCP from the robot"
    yield _Finding("error", "own address", text, f"{fix}; ROS_IP says under which address we are")


def _graph_ros1(node: Ros1Node) -> Iterator[_Finding]:
    others = other_nodes(node)
    if not others:
        yield _Finding("warning", node.url, "there are no nodes", "start the robot's programs")
        return
    text = f"{len(others)} nodes, {len(node.topics())} topics, {len(node.services())} services"
    yield _Finding("ok", node.url, text)
    if text := invalid_names(node):
        yield _Finding("warning", node.url, text, _RENAME_ROS1)


def _nodes_ros1(node: Ros1Node, options: Ros1Options, timeout: float) -> Iterator[_Finding]:
    """Check whether every node can be reached at its announced address."""
    names = other_nodes(node)
    with ThreadPoolExecutor(_MAX_CONCURRENT) as pool:
        asked = {name: pool.submit(_check_node, options.master, name, timeout) for name in names}
        addresses = {name: future.result() for name, future in asked.items()}
    unknown: dict[str, list[str]] = {}
    stale = []
    for name, address in addresses.items():
        if address.fault == "name":
            unknown.setdefault(address.host, []).append(name)
        elif address.fault == "gone":
            stale.append(name)
        elif address.fault:
            fix = (
                _SET_ROS_IP.format(where=f"on {address.host}") if address.fault == "silent" else ""
            )
            yield _Finding("warning", name, address.text, fix)
    host, _ = parse_uri(options.master, "master")
    for unknown_host, found in unknown.items():
        text = (
            f"{_several(found)} can be reached under the name {unknown_host} only, "
            "which this machine cannot resolve: nothing is received from there"
        )
        master_address = _address_of(host)
        fix = (
            "add it to /etc/hosts here, if that is the master's machine: "
            f"{master_address} {unknown_host}; or {_SET_ROS_IP.format(where='there')}"
        )
        yield _Finding("error", "names", text, fix)
    if stale:
        text = f"{_several(stale)} no longer run, but the master still lists them"
        yield _Finding(
            "warning", "nodes", text, f"rosglass node cleanup --url {node.url} takes them off"
        )
    well = len(addresses) - len(stale) - sum(map(len, unknown.values()))
    if well == len(addresses) and addresses:
        yield _Finding("ok", "nodes", "all can be reached")


def _check_node(master: str, name: str, timeout: float) -> _NodeAddress:
    """Check whether a node answers."""
    try:
        uri = str(call_node(master, "lookupNode", _CALLER, name, timeout=timeout))
        host, port = parse_uri(uri, f"what {name} announces")
    except (MasterError, ConnectionLostError):
        return _NodeAddress("")  # it has just left
    except ConversionError as error:
        return _NodeAddress("", "", "odd", str(error))
    try:
        with socket.create_connection((host, port), timeout):
            pass
        call_node(uri, "getPid", _CALLER, timeout=timeout)
    except (socket.gaierror, UnicodeError):
        return _NodeAddress(uri, host, "name")
    except ConnectionRefusedError:
        return _NodeAddress(uri, host, "gone")
    except OSError as error:
        text = f"{uri} cannot be reached: {error.strerror or error}"
        return _NodeAddress(uri, host, "silent", text)
    except MasterError:
        return _NodeAddress(uri, host)  # it answers, even if with a refusal
    except ConnectionLostError as error:
        return _NodeAddress(uri, host, "hangs", f"it does not answer: {error}")
    return _NodeAddress(uri, host)


def _simulated_time(node: Ros1Node) -> Iterator[_Finding]:
    """Check for a publisher of /clock if /use_sim_time is set."""
    try:
        simulated = node.parameter_server.get("/use_sim_time", False)
    except Error as error:
        yield _Finding("warning", "time", f"the parameter server does not answer: {error}")
        return
    if simulated and not node.publishers("/clock"):
        yield _Finding(
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
