"""Measure round trips of ROS 1 service calls against rospy's ServiceProxy, in the same run.

    python benchmarks/ros1_services.py [--quick] [--json FILE]

Both call the same servers, one of ours and one of rospy's, each in a process of its own: with a
connection for each call, as ROS 1 usually does, and through one that is kept. rospy runs in
/usr/bin/python3. The callers wait in their main threads; the servers' callbacks run where they do
by default. The ways take turns; printed are the medians, and the median and spread of the turns'
ratios, as other programs disturb. Exits 1 when a ratio is missed.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import statistics
import subprocess
import sys
import time
import xmlrpc.client
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import rosglass

PEER = Path(__file__).parent / "ros1_peers" / "rospy_services.py"
TYPE = "std_srvs/SetBool"
SERVICES, HOWS = ("/ours", "/rospy"), ("each", "persistent")
#: At most so many times rospy's median. Through a kept connection, rospy's caller waits at the
#: socket itself and can do nothing else; ours is woken by the thread that receives for all.
RATIOS = {"each": 1.0, "persistent": 4.0}
#: Calls before a turn is measured, and the pause between calls in seconds.
WARM, PAUSE = 20, 0.001


def serve(url: str) -> None:
    """Offer /ours until standard input closes."""
    with rosglass.connect(url, "our_server") as node:
        node.create_service_server(
            "/ours", TYPE, lambda request: {"success": request.data, "message": "ok"}
        )
        print("ready", flush=True)
        sys.stdin.read()


class Peer:
    """A process that is ready, and answers lines with lines."""

    def __init__(self, command: list[str], env: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            command, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        if self.process.stdout.readline() != "ready\n":
            raise RuntimeError(f"{command} does not start")

    def ask(self, line: str) -> Any:
        """Return the JSON answer to a line."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def close(self) -> None:
        """End it."""
        self.process.kill()
        self.process.wait()


def call(client: Any, count: int) -> list[float]:
    """Return how long each of so many calls took, in microseconds."""
    taken = []
    for _ in range(count):
        begun = time.perf_counter()
        client.call({"data": True})
        taken.append((time.perf_counter() - begun) * 1e6)
        time.sleep(PAUSE)
    return taken


def measure(turns: int, calls: int) -> dict[str, list[float]]:
    """Return each turn's median of each way, in microseconds."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    uri, url = f"http://127.0.0.1:{port}", f"ros1://127.0.0.1:{port}?ip=127.0.0.1"
    env = {
        "PATH": "/usr/bin:/bin",
        "HOME": os.environ.get("HOME", "/"),
        "ROS_MASTER_URI": uri,
        "ROS_IP": "127.0.0.1",
    }
    medians: dict[str, list[float]] = {}
    with ExitStack() as stack:
        master = subprocess.Popen(
            ["/usr/bin/rosmaster", "--core", "-p", str(port)],
            env=env,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        stack.callback(master.wait)
        stack.callback(master.kill)
        for _ in range(200):
            with suppress(OSError), xmlrpc.client.ServerProxy(uri) as api:
                api.getPid("/bench")
                break
            time.sleep(0.05)
        rospy = ["/usr/bin/python3", str(PEER)]
        ours = Peer([sys.executable, __file__, "--serve", url], dict(os.environ))
        stack.callback(ours.close)
        stack.callback(Peer([*rospy, "serve"], env).close)
        theirs = Peer([*rospy, "call"], env)
        stack.callback(theirs.close)
        node = stack.enter_context(rosglass.connect(url, "our_client"))
        ways = [(name, how) for name in SERVICES for how in HOWS]
        clients = {
            (name, how): node.create_service_client(name, TYPE, persistent=how == "persistent")
            for name, how in ways
        }
        for _ in range(turns):
            for name, how in ways:
                found = {
                    "ours": call(clients[name, how], WARM + calls)[WARM:],
                    "rospy": theirs.ask(f"{name} {how} {WARM + calls} {PAUSE}")[WARM:],
                }
                for who, taken in found.items():
                    medians.setdefault(f"{who} {name} {how}", []).append(statistics.median(taken))
    return medians


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="a fifth of the calls")
    parser.add_argument("--json", type=Path, help="write all figures to this file")
    parser.add_argument("--serve", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve(options.serve)
        return 0
    if not Path("/usr/bin/rosmaster").exists():
        print("needs ROS 1: apt install python3-rosmaster python3-rospy python3-std-srvs")
        return 1
    figures = measure(*((3, 100) if options.quick else (7, 200)))
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1))
    failed = False
    print(f"{'server':8}{'connection':13}{'ours':>10}{'rospy':>10}{'ratio':>8}{'of all turns':>14}")
    for name in SERVICES:
        for how in HOWS:
            one, other = figures[f"ours {name} {how}"], figures[f"rospy {name} {how}"]
            ratios = sorted(mine / theirs for mine, theirs in zip(one, other, strict=True))
            ratio = statistics.median(ratios)
            failed |= ratio > RATIOS[how]
            times = "".join(f"{statistics.median(turns):8.0f}us" for turns in (one, other))
            spread = f"{ratios[0]:.2f}-{ratios[-1]:.2f}"
            missed = f"  MISSED: at most {RATIOS[how]}" if ratio > RATIOS[how] else ""
            print(f"{name[1:]:8}{how:13}{times}{ratio:8.2f}{spread:>14}{missed}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
