"""Watch the memory of the demo for half an hour: does it stay flat?

    python benchmarks/memory.py [--minutes N] [--every SECONDS] [--csv FILE]

Router, simulated robot and cockpit run as processes of their own, the cockpit on Xvfb with software
OpenGL, steered in circles. Beside it, on a screen of its own, the peer: a plain PySide6 program
that shows images of the same size at the same rate and has no robot, to measure what Qt and its
software OpenGL keep for themselves. The first third of the time is the warm-up: code is imported
when first used, caches fill, and the cockpit remembers the last five minutes, the way that the
robot drove and the latencies of images.

Own memory (USS) is what ending the process would give back: neither libraries that others use, nor
images in memory shared with the X server. The slope is the median of the slopes between all pairs
of samples after the warm-up (Theil-Sen): neither a garbage collection nor a step that happens once
decides, a leak does. The growth is the difference of the medians of the first and the last fifth.
Exits 1 when the memory of one of our processes rose faster than the target, or a process ended.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from camera_latency import PEERS, PLAIN, SCREEN
from rosglass.demo.processes import VirtualScreen
from rosglass.wires.zenoh.router import is_router_reachable

#: KiB per minute; a hundredth of the cockpit's memory in an hour would be about 30.
TARGET = 30.0
#: Seconds of a round: so long the stick is pulled, then let go.
_ROUND, _PULL = 20.0, 12.0
_TIMEOUT_S = 30.0


@dataclass
class Watched:
    """A process and its memory over time: seconds, own and resident KiB."""

    name: str
    process: subprocess.Popen[bytes]
    ours: bool = True
    times: list[float] = field(default_factory=list)
    own: list[float] = field(default_factory=list)
    resident: list[float] = field(default_factory=list)

    def sample(self, now: float) -> None:
        """Read its memory.

        Raises:
            SystemExit: It has ended.
        """
        if self.process.poll() is not None:
            sys.exit(f"{self.name} ended after {now:.0f} s with code {self.process.poll()}")
        sizes: dict[str, int] = {}
        for line in Path(f"/proc/{self.process.pid}/smaps_rollup").read_text().splitlines()[1:]:
            name, value = line.split()[:2]
            sizes[name] = int(value)
        self.times.append(now)
        self.own.append(sizes["Private_Clean:"] + sizes["Private_Dirty:"])
        self.resident.append(sizes["Rss:"])


def slope(times: list[float], values: list[float]) -> float:
    """Return the rise per minute: the median of the slopes between all pairs (Theil and Sen)."""
    pairs = itertools.combinations(zip(times, values, strict=True), 2)
    slopes = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in pairs]
    return 60 * statistics.median(slopes) if slopes else 0.0


def growth(values: list[float]) -> float:
    """Return by how much the last fifth is above the first."""
    part = max(1, len(values) // 5)
    return statistics.median(values[-part:]) - statistics.median(values[:part])


def cockpit(url: str, seconds: float) -> int:
    """Show the demo's cockpit and steer the robot in circles; in a process of its own."""
    from rosglass.demo.app import Cockpit

    shown = Cockpit(url, SCREEN)
    begin = 3.0
    while begin < seconds:
        shown.fly([(begin, -0.5 if begin // _ROUND % 2 else 0.5, -0.6)])
        shown.at(begin + _PULL, lambda: shown.call("stick", "letGo"))
        begin += _ROUND
    code = shown.run(seconds)
    print(shown.report(), flush=True)
    shown.close()
    return code


def watch(minutes: float, every: float) -> tuple[list[Watched], str]:
    """Run everything and take samples; returns what was seen, and what the cockpit reports."""
    rosglass = [sys.executable, "-m", "rosglass"]
    with (
        tempfile.TemporaryDirectory() as folder,
        VirtualScreen(*SCREEN) as screen,
        VirtualScreen(*SCREEN) as other,
        contextlib.ExitStack() as stack,
    ):
        report = stack.enter_context(Path(folder, "report.txt").open("w+"))

        def start(name: str, *command: str, display: str = "", ours: bool = True) -> Watched:
            environment = {**os.environ, "DISPLAY": display, "QT_QPA_PLATFORM": "xcb"}
            environment["QT_LOGGING_RULES"] = "qt.multimedia.*=false"
            process = subprocess.Popen(
                command,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=report if name == "cockpit" else subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
            return Watched(name, process, ours)

        port = free_port()
        router = start("router", *rosglass, "router", "--listen", f"tcp/127.0.0.1:{port}")
        url = f"zenoh://127.0.0.1:{port}"
        until = time.monotonic() + _TIMEOUT_S
        while not is_router_reachable(url):
            if time.monotonic() > until:
                sys.exit("the router does not answer")
            time.sleep(0.1)
        file = Path(folder, "plain.qml")
        file.write_text(PLAIN)
        length = str(60 * minutes + 600)
        programs = [
            start(
                "cockpit", sys.executable, __file__, "cockpit", url, length, display=screen.display
            ),
            start("robot", *rosglass, "robot", "--url", url),
            router,
            start(
                "plain PySide6",
                *(sys.executable, PEERS, "plain", "640", "480", str(file)),
                display=other.display,
                ours=False,
            ),
        ]
        begin = time.monotonic()
        while (now := time.monotonic() - begin) < 60 * minutes:
            for program in programs:
                program.sample(now)
            time.sleep(max(0.0, begin + now + every - time.monotonic()))
        shown = programs[0].process
        shown.terminate()
        shown.wait(_TIMEOUT_S)
        report.seek(0)
        return programs, report.read()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def judge(programs: list[Watched], warm: float) -> bool:
    """Print what was seen after `warm` seconds against the target; returns whether one missed."""
    missed = False
    print(f"{'':14}{'own MiB, first':>16}{'last':>8}{'KiB/min':>9}{'growth KiB':>12}", end="")
    print(f"{'resident KiB/min':>18}")
    for one in programs:
        kept = [number for number, when in enumerate(one.times) if when >= warm]
        times = [one.times[number] for number in kept]
        own = [one.own[number] for number in kept]
        verdict = ""
        if one.ours:
            good = slope(times, own) <= TARGET
            missed |= not good
            verdict = f"  target {TARGET:g} KiB/min: {'met' if good else 'MISSED'}"
        print(
            f"{one.name:14}{own[0] / 1024:16.1f}{own[-1] / 1024:8.1f}{slope(times, own):9.1f}"
            f"{growth(own):12.0f}{slope(times, [one.resident[i] for i in kept]):18.1f}{verdict}"
        )
    return missed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--minutes", type=float, default=30.0, help="default: 30")
    parser.add_argument("--every", type=float, default=10.0, metavar="SECONDS", help="default: 10")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write every sample there")
    args = parser.parse_args()
    print(f"{args.minutes:g} minutes, load {os.getloadavg()[0]:.1f} before the start", flush=True)
    programs, report = watch(args.minutes, args.every)
    if args.csv:
        lines = ["program,seconds,own KiB,resident KiB"]
        for one in programs:
            rows = zip(one.times, one.own, one.resident, strict=True)
            lines += [f"{one.name},{a:.1f},{b:.0f},{c:.0f}" for a, b, c in rows]
        args.csv.write_text("\n".join(lines) + "\n")
    print(report)
    return int(judge(programs, 60 * args.minutes / 3))


if __name__ == "__main__":
    if sys.argv[1:2] == ["cockpit"]:
        sys.exit(cockpit(sys.argv[2], float(sys.argv[3])))
    sys.exit(main())
