"""Measures how soon a robot is halted, for each way to let go of it.

    scripts/private_network.sh python benchmarks/letting_go.py [--times N] [--only WAY ...]
        [--wire zenoh|dds|ros1] [--busy]

A screen with a DriveStick, DriveKeys and an input made of code runs in a process of its own, in a
real window on Xvfb; mouse and keys come from xdotool. The robot is a subscriber in this process,
over Zenoh with a router, over DDS, or over ROS 1. For each way: how long after the event the robot
received the last motion (negative: the last one was sent before it; while held, they are at most
50 ms apart), the zeros that followed, and motions after the first zero. The event is timed before
it is requested, so xdotool's own start counts. With --busy, both cores are kept busy by other
processes.
Exits 1 when a limit is missed: 50 ms, 200 ms for a frozen screen; three zeros; no motion after.
"""

from __future__ import annotations

import argparse
import contextlib
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/helpers"))

from ports import free_port

import rosglass
from letting_go import WAYS, Outcome, Robot, Screen, busy_cores, let_go, stays_connected
from rosglass.demo.processes import VirtualScreen
from rosglass.wires.zenoh.router import Router

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextlib.contextmanager
def router() -> Iterator[str]:
    with Router(f"tcp/127.0.0.1:{free_port()}") as made:
        yield made.url


@contextlib.contextmanager
def domain() -> Iterator[str]:
    yield "dds://127.0.0.1?domain=77"


@contextlib.contextmanager
def master() -> Iterator[str]:
    port = free_port()
    with tempfile.TemporaryDirectory() as home:
        env = {"PATH": "/usr/bin:/bin", "HOME": home, "ROS_HOME": home}
        command = ["/usr/bin/rosmaster", "--core", "-p", str(port)]
        output = subprocess.DEVNULL
        made = subprocess.Popen(command, env=env, stdout=output, stderr=output)
        try:
            yield f"ros1://127.0.0.1:{port}?ip=127.0.0.1"
        finally:
            made.kill()
            made.wait()


WIRES = {"zenoh": router, "dds": domain, "ros1": master}


def measure(names: list[str], times: int, url: str, display: str) -> dict[str, list[Outcome]]:
    found: dict[str, list[Outcome]] = {name: [] for name in names}
    node = rosglass.connect(url, "robot")
    robot, screen = Robot(node), None
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            for _ in range(times):
                screen = screen or Screen(url, display, Path(folder))
                found[name].append(let_go(screen, robot, WAYS[name]))
                if "Traceback" in screen.text:
                    raise SystemExit(f"{name}: {screen.text}")
                if WAYS[name].ends:
                    screen.close()
                    screen = None
            show(name, found[name])
        if screen is not None:
            screen.close()
    node.close()
    return found


def is_missed(name: str, outcomes: list[Outcome]) -> bool:
    limit = WAYS[name].limit_s
    return any(one.late_s > limit or one.zeros < 3 or one.moved_after for one in outcomes)


def show(name: str, outcomes: list[Outcome]) -> None:
    late = sorted(1000 * one.late_s for one in outcomes)
    print(
        f"| {name} | {late[len(late) // 2]:.0f} | {late[-1]:.0f} | {WAYS[name].limit_s * 1000:.0f} "
        f"| {min(one.zeros for one in outcomes)} | {sum(one.moved_after for one in outcomes)} "
        f"| {'MISSED' if is_missed(name, outcomes) else ''} |",
        flush=True,
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--only", nargs="*", choices=list(WAYS), default=list(WAYS))
    parser.add_argument("--wire", choices=list(WIRES), default="zenoh")
    parser.add_argument("--busy", action="store_true")
    given = parser.parse_args()
    with VirtualScreen() as screen, WIRES[given.wire]() as url:
        print(f"{given.times} times each, over {given.wire}; ms after the event\n")
        print("| way | median | worst | limit | least zeros | motions after | |")
        print("|---|---|---|---|---|---|---|")
        with stays_connected(screen.display), busy_cores(given.busy):
            found = measure(given.only, given.times, url, screen.display)
    return int(any(is_missed(name, outcomes) for name, outcomes in found.items()))


if __name__ == "__main__":
    sys.exit(main())
