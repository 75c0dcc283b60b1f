"""``rosglass doctor``: find what separates this machine from the robot, and how to fix it."""

from __future__ import annotations

import os
import platform
import shlex
import sys
from dataclasses import asdict, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.cli.connecting import add_connection_options, left_out, settle, wait
from rosglass.cli.endpoints import DUPLICATES_FIX, duplicates, problems
from rosglass.cli.finding import Finding
from rosglass.cli.network import ask, interfaces, is_loopback
from rosglass.cli.output import Style, add_output_options, print_json
from rosglass.errors import Error

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from rosglass.comm import Node

__all__ = ["configure", "run"]

#: Package -> what it is for, and the extra that installs it.
_PACKAGES = {
    "cyclonedds": ("ROS 2 over DDS", "dds"),
    "eclipse-zenoh": ("ROS 2 over Zenoh", "zenoh"),
    "PySide6-Essentials": ("interfaces in QML", "qml"),
    "PySide6-Addons": ("camera pictures in QML", "camera"),
    "opencv-python-headless": ("compressed pictures", "images"),
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
#: Receive buffer in bytes that a camera picture needs.
_BUFFER = 4 * 2**20
_NO_NETWORK = "connect a network, or for this machine alone: sudo ip link set lo up multicast on"
#: The fix for names that break ROS's rules.
_RENAME = "rename them where they are made: letters, digits, '_' and '/', no digit first"
#: Seconds to explore a graph.
_LOOK = 3.0


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "--scan", action="store_true", help="over DDS, look for robots in the domains 0 to 10"
    )
    add_output_options(parser)
    add_connection_options(parser, timeout=5.0)
    parser.set_defaults(looks_nearby=False)  # it reports what it finds


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
    for finding in _look(args):
        found.append(finding)
        if args.json:
            continue
        print(f"{marks[finding.level]} {finding.area}: {finding.text}", flush=True)
        if finding.fix:
            print(f"        {style('-> ' + finding.fix, 'bold')}", flush=True)
    if args.json:
        print_json([asdict(finding) for finding in found])
    return 1 if any(finding.level == "error" for finding in found) else 0


def _look(args: argparse.Namespace) -> Iterator[Finding]:
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
        yield _address(answering)
    if args.scan:
        yield from _scan()


def _programs() -> Iterator[Finding]:
    import rosglass

    yield Finding(
        "ok",
        "rosglass",
        f"{rosglass.__version__} on Python {platform.python_version()} ({sys.executable})",
    )
    for package, (purpose, extra) in _PACKAGES.items():
        try:
            yield Finding("ok", package, f"{version(package)}, for {purpose}")
        except PackageNotFoundError:  # noqa: PERF203 - each package is a finding
            fix = f'pip install "rosglass[{extra}]"'
            yield Finding("note", package, f"not installed; needed for {purpose}", fix)


def _environment() -> Iterator[Finding]:
    shown = [f"{name}={os.environ[name]}" for name in _VARIABLES if os.environ.get(name)]
    yield Finding("ok", "environment", "; ".join(shown) or "no variables of ROS or rosglass")
    for folder in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        if not Path(folder).is_dir():
            fix = "source the workspace anew, or unset AMENT_PREFIX_PATH"
            yield Finding("warning", "environment", f"AMENT_PREFIX_PATH names {folder}: gone", fix)


def _definitions() -> Iterator[Finding]:
    from rosglass.messages import default_library

    counts = [len(default_library().names(ros)) for ros in (1, 2)]
    text = f"{counts[1]} types of ROS 2 and {counts[0]} of ROS 1 are known on this machine"
    yield Finding("ok", "definitions", text)


def _kernel() -> Iterator[Finding]:
    limit = Path("/proc/sys/net/core/rmem_max")
    if not limit.exists():
        return
    size = int(limit.read_text())
    if size < _BUFFER:
        yield Finding(
            "warning",
            "network",
            f"receive buffers are limited to {size} bytes: big pictures get lost over DDS",
            f"sudo sysctl -w net.core.rmem_max={_BUFFER} (and into /etc/sysctl.d to keep it)",
        )
    else:
        yield Finding("ok", "network", f"receive buffers up to {size / 2**20:.0f} MiB")


def _interfaces(ros2: bool) -> Iterator[Finding]:
    found = interfaces()
    if found is None:
        return
    names = ", ".join(interface.name for interface in found)
    if not found:
        yield Finding("error", "network", "no network interface is up", _NO_NETWORK)
    elif ros2 and not any(interface.has_multicast for interface in found):
        yield Finding(
            "warning",
            "network",
            f"no network interface that is up ({names}) takes multicast, by which ROS 2's programs "
            "find each other over DDS",
            "connect a network, or for this machine alone: sudo ip link set lo multicast on && "
            "sudo ip route add 224.0.0.0/4 dev lo",
        )
    elif all(interface.is_loopback for interface in found):
        yield Finding("note", "network", f"only {names} is up: nothing but this machine is reached")
    else:
        yield Finding("ok", "network", f"{names} up")


def _address(answering: list[str]) -> Finding:
    """Return which URL to set if none is set."""
    if not answering:
        text = "no URL is given, and no robot answers on this machine"
        fix = (
            "export ROSGLASS_URL=zenoh://<robot's address> (or dds://, ros1://<its address>), "
            "and see the notes above"
        )
        return Finding("error", "address", text, fix)
    text = f"no URL is given; found: {', '.join(answering)}"
    return Finding("warning", "address", text, f"export ROSGLASS_URL={shlex.quote(answering[0])}")


def _urls(args: argparse.Namespace) -> tuple[list[str], bool]:
    """Return the URLs to check, and whether one was given."""
    from rosglass.connection import default_url

    if args.url:
        return [args.url], True
    try:
        return [default_url(os.environ)], True
    except Error:
        return ["zenoh://127.0.0.1:7447", "dds://", "ros1://127.0.0.1:11311"], False


def _robot(url: str, timeout: float) -> Iterator[Finding]:
    import rosglass
    from rosglass.comm import ConnectionState
    from rosglass.connection import explain_missing

    if url.lower().startswith("ros1:"):
        from rosglass.cli import doctor_ros1

        yield from doctor_ros1.look(url, timeout)
        return
    try:
        node = rosglass.connect(url, name=f"rosglass_doctor_{os.getpid()}", own_services=False)
    except ModuleNotFoundError as error:
        text, _, fix = explain_missing(error).partition("; ")
        yield Finding("error", url, text or str(error), fix)
        return
    except Error as error:
        no_network = url.startswith("dds:") and interfaces() == []
        yield Finding("error", url, str(error), _NO_NETWORK if no_network else "")
        return
    with node:
        wait(node, lambda: node.status().state is ConnectionState.CONNECTED, timeout)
        status = node.status()
        if status.state is not ConnectionState.CONNECTED:
            # A configuration file may name another router.
            asks = url.startswith("zenoh:") and not os.environ.get("ZENOH_SESSION_CONFIG_URI")
            text, fix = ask(url, timeout) if asks else ("", "")
            yield Finding("error", url, text or status.detail, fix or _advice(url))
            return
        yield Finding("ok", url, status.detail or "connected")
        settle(node, _LOOK)
        yield from _graph(node)


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


def _graph(node: Node) -> Iterator[Finding]:
    me = node.resolve(node.name)
    others = [name.full for name in node.nodes() if name.full != me]
    topics = node.topics()
    if not others and not topics:
        yield Finding("warning", node.url, "there are no nodes", _advice(node.url))
        return
    yield Finding(
        "ok",
        node.url,
        f"{len(others)} nodes, {len(topics)} topics, {len(node.services())} services, "
        f"{len(node.actions())} actions",
    )
    if text := left_out(node):
        yield Finding("warning", node.url, text, _RENAME)
    for name, count in node.duplicate_nodes().items():
        yield Finding("warning", node.url, duplicates(name, count), DUPLICATES_FIX)
    for topic in topics:
        ends = [*node.publishers(topic), *node.subscriptions(topic)]
        for problem in problems(ends):
            yield Finding("warning", topic, problem.text, problem.fix)


def _scan() -> Iterator[Finding]:
    import rosglass

    for domain in range(11):
        url = f"dds://?domain={domain}"
        try:
            node = rosglass.connect(url, name=f"rosglass_doctor_{os.getpid()}", own_services=False)
        except (Error, ModuleNotFoundError) as error:
            yield Finding("error", url, str(error))
            return
        with node:
            me = node.resolve(node.name)
            settle(node, 1.5)
            others = [name.full for name in node.nodes() if name.full != me]
        if others:
            shown = ", ".join(others[:5]) + (" ..." if len(others) > 5 else "")
            yield Finding("ok", url, f"{len(others)} nodes: {shown}", f"use --url '{url}'")
        else:
            yield Finding("note", url, "no nodes")
