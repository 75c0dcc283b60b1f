"""Measure what the dashboard of examples/rviz costs each of RViz's frames, with everything live.

    .venv-system/bin/python benchmarks/rviz_dashboard.py [--seconds N] [--rounds N] [--renderer R]

Debian's rosmaster, the simulated robot on its mission (camera at 30 Hz, four more at 10 Hz of which
one is shown, data at 20 Hz and more), and RViz with examples/rviz/figure1.rviz and Dashboard.qml in
a 3D view of 1280x800 pixels, each in a process of its own, on a virtual screen (Xvfb) with software
OpenGL. Figures are what the overlay takes in the GUI thread before a frame in which it is drawn:
Qt Quick's rendering, reading back, comparing, uploading. Exits 1 when the target is missed.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from rosglass.demo.processes import start_robot
from rviz_overlay import ask, environment, ros_master

#: Milliseconds of a frame, in the median.
TARGET = 11.0


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=15, help="of each round (15)")
    parser.add_argument("--rounds", type=int, default=3, help="(3)")
    parser.add_argument(
        "--renderer", default="auto", help="what draws it: auto (default), opengl or software"
    )
    args = parser.parse_args()
    works: list[dict[str, float]] = []
    with tempfile.TemporaryDirectory() as home, ros_master(home) as master:
        url = master.replace("http:", "ros1:")
        robot = start_robot(url, ("--equipped", "--fps", "30", "--mode", "autonomous"))
        try:
            for number in range(args.rounds):
                figures = ask(
                    environment(master, home),
                    120 + 3 * args.seconds,
                    what="dashboard",
                    seconds=args.seconds,
                    url=url,
                    renderer=args.renderer,
                )
                works += figures["works"]
                print(
                    f"round {number + 1}: {figures['frames'] / args.seconds:4.1f} frames/s, "
                    f"dashboard drawn in {len(figures['works']) / args.seconds:4.1f}/s, "
                    f"CPU {figures['cpu']:3.0f} %, renderer {figures['renderer']}",
                    flush=True,
                )
        except subprocess.TimeoutExpired:
            sys.exit("RViz did not end in time")
        finally:
            robot.close()
    if not works:
        sys.exit("the dashboard was never drawn")
    for part in works[0]:
        values = [work[part] for work in works]
        p90 = statistics.quantiles(values, n=10)[-1] if len(values) > 1 else values[0]
        print(f"{part:9} median {statistics.median(values):6.2f} ms   p90 {p90:6.2f} ms")
    total = statistics.median(work["total"] for work in works)
    met = total < TARGET
    print(f"total < {TARGET:g} ms: {'met' if met else 'MISSED'}")
    return int(not met)


if __name__ == "__main__":
    sys.exit(main())
