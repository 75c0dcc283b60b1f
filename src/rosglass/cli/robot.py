"""``rosglass robot``: the simulated robot, in a process of its own."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from typing import TYPE_CHECKING

import rosglass
from rosglass.cli.network import refused
from rosglass.cli.output import note
from rosglass.comm import ConnectionState
from rosglass.demo.operation import BEHAVIOR_EXECUTION
from rosglass.demo.processes import DUPLICATE_EXIT
from rosglass.demo.robot import Robot, RobotOptions
from rosglass.interfaces import Library

if TYPE_CHECKING:
    import argparse

    from rosglass.comm import Sample, Status

__all__ = ["run"]

#: Seconds after the start in which another robot, whose odometry has 30 Hz, ends this one.
_DUPLICATE_WATCH_S = 5.0
#: Seconds in which one of two robots has to leave.
_YIELD_S = 2.0


def run(args: argparse.Namespace) -> int:
    """Run the robot until SIGINT or SIGTERM."""
    options = RobotOptions(
        fps=args.fps,
        raw=not args.no_raw,
        compressed=not args.no_compressed,
        jpeg_quality=args.jpeg_quality,
        equipped=args.equipped,
        mode=args.mode,
    )
    end = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: end.set())
    if args.leash:
        threading.Thread(target=_watch_parent, args=(end,), daemon=True).start()
    library = Library()
    library.add_text("flexbe_msgs/action/BehaviorExecution", BEHAVIOR_EXECUTION, source="FlexBE")
    node = rosglass.connect(args.url, name=args.name, library=library, arguments=args.ros_arguments)
    try:
        robot = Robot(node, options)
        try:
            node.on_status_change(_print_status)
            full = f"{node.namespace.rstrip('/')}/{node.name}"
            print(
                f"robot: simulated, node {full} on {node.url}; Ctrl-C ends it",
                flush=True,
            )
            _print_status(node.status())
            refusal = refused(args.url)
            if refusal is not None:
                note(f"{node.url}: {refusal[0]}; {refusal[1]}. Waiting for it")
            duplicate = threading.Event()
            last_seen: dict[bytes, float] = {}

            def on_odometry(sample: Sample) -> None:
                # A robot that was killed may still be in the graph, but sends nothing.
                if full not in node.duplicate_nodes():
                    return
                now, other = time.monotonic(), sample.publisher
                since = last_seen.setdefault(other, now)
                own = {end.gid for end in node.publishers("/odom") if end.node.full == full}
                # Of two that start at the same time, one stays: the other leaves at once.
                if min(own - last_seen.keys(), default=b"") < other and now - since < _YIELD_S:
                    return
                duplicate.set()

            watch = node.create_subscription(
                "/odom", "nav_msgs/msg/Odometry", raw_callback=on_odometry, ignore_local=True
            )
            watched_until = time.monotonic() + _DUPLICATE_WATCH_S
            robot.start()
            while not end.is_set() and not duplicate.is_set() and not robot.wait(0.1):
                if time.monotonic() > watched_until + _YIELD_S * bool(last_seen):
                    watch.close()
            if duplicate.is_set():
                print(
                    f"rosglass: {_duplicate(full, node.url)}",
                    file=sys.stderr,
                    flush=True,
                )
                return DUPLICATE_EXIT
            failed = not end.is_set()
        finally:
            robot.close()
    finally:
        node.close()
    return 1 if failed else 0


def _duplicate(name: str, url: str) -> str:
    """Return the message for a robot whose name exists already."""
    other = "dds://?domain=1" if url.startswith("dds:") else "zenoh://127.0.0.1:7448"
    return (
        f"a robot called {name} is on {url} already, and what both publish would be mixed. To look "
        f"at that one: rosglass demo --no-robot --url '{url}'; to have one of your own: "
        f"rosglass demo --url '{other}'"
    )


def _print_status(status: Status) -> None:
    if status.state is not ConnectionState.CLOSED:
        print(": ".join(filter(None, ("robot", status.state.value, status.detail))), flush=True)


def _watch_parent(end: threading.Event) -> None:
    # The parent process holds the other end, which closes however it ends, SIGKILL included.
    # Not by sys.stdin, whose lock would have Python abort if the robot ends by itself.
    while os.read(sys.stdin.fileno(), 4096):
        pass
    end.set()
