"""``rosglass doctor``: look for what keeps this machine and the robot apart, and how to mend it."""

from __future__ import annotations

import os
import platform
import sys
from collections import Counter
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.cli.connecting import add_connection_options, settle, wait
from rosglass.cli.endpoints import problems
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
    "mcap": ("recordings", "bags"),
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
)
#: Receive buffer in bytes that a camera picture needs.
_BUFFER = 4 * 2**20
#: Seconds to look around in a graph.
_LOOK = 3.0


@dataclass(frozen=True)
class Finding:
    """Something that was looked at.

    Attributes:
        level: ``ok``, ``note``, ``warning`` or ``error``.
        area: What was looked at.
        text: What was found.
        fix: What to do about it.
    """

    level: str
    area: str
    text: str
    fix: str = ""


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    parser.add_argument(
        "--scan", action="store_true", help="over DDS, look for robots in the domains 0 to 10"
    )
    add_output_options(parser)
    add_connection_options(parser, timeout=5.0)


def run(args: argparse.Namespace) -> int:
    """Look at everything; returns 1 when something is broken."""
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
    yield from _programs()
    yield from _environment()
    yield from _definitions()
    yield from _kernel()
    for url in _urls(args):
        yield from _robot(url, args.timeout)
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
    told = [f"{name}={os.environ[name]}" for name in _VARIABLES if os.environ.get(name)]
    yield Finding("ok", "environment", "; ".join(told) or "no variables of ROS 2 or rosglass")
    for folder in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        if not Path(folder).is_dir():
            fix = "source the workspace anew, or unset AMENT_PREFIX_PATH"
            yield Finding("warning", "environment", f"AMENT_PREFIX_PATH names {folder}: gone", fix)


def _definitions() -> Iterator[Finding]:
    from rosglass.messages import default_library

    names = default_library().names(2)
    yield Finding("ok", "definitions", f"{len(names)} types of ROS 2 are known on this machine")


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


def _urls(args: argparse.Namespace) -> list[str]:
    from rosglass.connection import default_url

    if args.url:
        return [args.url]
    try:
        return [default_url(os.environ)]
    except Error:
        return ["zenoh://127.0.0.1:7447", "dds://"]


def _robot(url: str, timeout: float) -> Iterator[Finding]:
    import rosglass
    from rosglass.comm import ConnectionState

    try:
        node = rosglass.connect(url, name=f"rosglass_doctor_{os.getpid()}", own_services=False)
    except Error as error:
        yield Finding("error", url, str(error))
        return
    with node:
        wait(node, lambda: node.status().state is ConnectionState.CONNECTED, timeout)
        status = node.status()
        if status.state is not ConnectionState.CONNECTED:
            yield Finding("error", url, status.detail, _advice(url))
            return
        yield Finding("ok", url, status.detail or "connected")
        settle(node, _LOOK)
        yield from _graph(node)


def _advice(url: str) -> str:
    if url.startswith("zenoh:"):
        return (
            "start a router on the robot (ros2 run rmw_zenoh_cpp rmw_zenohd, or rosglass router), "
            "and check the address, the port and the firewall (TCP)"
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
    for name, count in Counter(others).items():
        if count > 1:
            fix = "give each a name of its own, e.g. with -r __node:=name"
            yield Finding("warning", node.url, f"{count} nodes are called {name}", fix)
    for topic in topics:
        ends = [*node.publishers(topic), *node.subscriptions(topic)]
        for problem in problems(ends):
            yield Finding(
                "warning", topic, problem, "ask for no more than is offered, of the same type"
            )


def _scan() -> Iterator[Finding]:
    import rosglass

    for domain in range(11):
        url = f"dds://?domain={domain}"
        try:
            node = rosglass.connect(url, name=f"rosglass_doctor_{os.getpid()}", own_services=False)
        except Error as error:
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
            yield Finding("note", url, "nobody")
