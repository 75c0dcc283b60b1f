"""How soon a layout of 40 panels is on the screen, and what its panels cost while they live.

    python benchmarks/layouts.py [--rounds N]

`layout` is a Cockpit with 40 panels on one page, eight in each of five rows; `grid` shows the same
40 controls in a plain Grid, as large as they are in the panels; `pages` has the same panels on five
pages, of which one is shown. A robot in a process of its own publishes for them, over Zenoh by way
of a router: 20 topics at 10 Hz, odometry and IMU at 30 Hz, two cameras 320x240 at 15 Hz.

The first frame is the time from the start of the process (`rosglass run FILE`) until the X server
(Xvfb, software renderer) shows the pattern that the interface paints from then on. CPU is the
process's time over 9 s, from 3 s after the first frame on. Contenders take turns, round by round;
the first round fills the caches of files and does not count. Figures are medians. Exits 1 when one
misses its target.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from camera_latency import Pixels
from rosglass.demo.processes import VirtualScreen
from rosglass.wires.zenoh.router import Router

#: Seconds until the first frame, and CPU as a multiple of the plain Grid's.
FIRST_TARGET, CPU_TARGET = 2.5, 1.3
SCREEN = (1600, 900)
ROWS, COLUMNS = 5, 8
_TIMEOUT_S = 60.0
_SETTLE_S, _MEASURE_S = 3.0, 9.0
_SQUARE, SHOWN = 8, (255, 0, 255, 0)
_TOPICS = 20


def controls() -> list[str]:
    """Return the 40 controls."""
    made = [f'Gauge {{ path: "/value_{n}:data"; title: "Value {n}"; to: 100 }}' for n in range(12)]
    made += [f'Battery {{ topic: "/battery_{n}" }}' for n in range(8)]
    made += ['Compass { topic: "/imu" }'] * 4 + ['Attitude { topic: "/imu" }'] * 4
    made += ['Speed { topic: "/odom" }'] * 4
    made += [f'CameraView {{ topic: "/camera_{n}/image_raw" }}' for n in range(2)]
    made += [f'Plot {{ paths: ["/value_{n}:data"] }}' for n in range(2)]
    made += ["LogView {}", "DiagnosticsView {}"]
    made += [f'MessageView {{ topic: "/battery_{n}" }}' for n in range(2)]
    assert len(made) == ROWS * COLUMNS
    # Alike in each row.
    return [made[(n * 7) % len(made)] for n in range(len(made))]


def interface(kind: str) -> str:
    """Return the source of an interface: ``layout``, ``pages`` or ``grid``."""
    squares = "".join(
        f"Rectangle {{ x: {_SQUARE * i}; width: {_SQUARE}; height: {_SQUARE}; "
        f'color: "#{level:02x}{level:02x}{level:02x}" }}\n'
        for i, level in enumerate(SHOWN)
    )
    rows = [controls()[COLUMNS * row : COLUMNS * (row + 1)] for row in range(ROWS)]
    head = "import QtQuick 2.15\nimport Ros2 1.0\nimport RosControls 1.0\nimport RosCockpit 1.0\n"
    size = f"width: {SCREEN[0]}; height: {SCREEN[1]}"
    if kind == "grid":
        width, height = SCREEN[0] // COLUMNS - 6, SCREEN[1] // ROWS - 30
        items = "".join(
            f"Item {{ width: {width}; height: {height}\n"
            f"{one[:-1].rstrip()}{'' if one.endswith('{}') else ';'} anchors.fill: parent }} }}\n"
            for row in rows
            for one in row
        )
        return (
            f"{head}Rectangle {{ {size}; color: Theme.background\n"
            f'Component.onCompleted: Ros2.init("ui")\n'
            f"Grid {{ y: 20; columns: {COLUMNS}; spacing: 6\n{items} }}\n{squares} }}\n"
        )
    panels = [
        [f'Panel {{ title: "{r}.{c}"; {one} }}' for c, one in enumerate(row)]
        for r, row in enumerate(rows)
    ]
    if kind == "pages":
        pages = "".join("Page {\n" + "\n".join(row) + "\n}\n" for row in panels)
    else:
        splits = "".join("Split {\n" + "\n".join(row) + "\n}\n" for row in panels)
        pages = f"Page {{ orientation: Qt.Vertical\n{splits} }}\n"
    return f"{head}Cockpit {{ {size}\n{pages}Item {{ y: -parent.y\n{squares} }} }}\n"


def publish(url: str) -> None:
    """Publish what the interfaces show, until killed; in a process of its own."""
    import math

    import rosglass
    from rosglass.comm import Time

    node = rosglass.connect(url, "robot")
    values = [node.create_publisher(f"/value_{n}", "std_msgs/msg/Float64", 1) for n in range(12)]
    battery_type = "sensor_msgs/msg/BatteryState"
    batteries = [node.create_publisher(f"/battery_{n}", battery_type, 1) for n in range(8)]
    imu = node.create_publisher("/imu", "sensor_msgs/msg/Imu", 1)
    odometry = node.create_publisher("/odom", "nav_msgs/msg/Odometry", 1)
    image_type = "sensor_msgs/msg/Image"
    cameras = [node.create_publisher(f"/camera_{n}/image_raw", image_type, 1) for n in range(2)]
    log = node.create_publisher("/rosout", "rcl_interfaces/msg/Log", 10)
    health = node.create_publisher("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", 10)
    pixels = bytearray(320 * 240 * 3)
    due, number = time.monotonic(), 0
    while True:
        number += 1
        header = {"stamp": Time.now()}
        if number % 3 == 0:
            for at, sender in enumerate(values):
                sender.publish(data=50 + 50 * math.sin(number / 30 + at))
            for sender in batteries:
                sender.publish(header=header, percentage=0.5 + number % 50 / 100, voltage=24.0)
        if number % 2 == 0:
            pixels[:] = bytes([number % 256]) * len(pixels)
            for camera in cameras:
                camera.publish(
                    header=header, width=320, height=240, encoding="rgb8", step=960, data=pixels
                )
        if number % 30 == 0:
            log.publish(stamp=header["stamp"], level=20, name="robot", msg=f"second {number // 30}")
            rows = [{"name": f"part {n}", "message": str(number)} for n in range(10)]
            health.publish(header=header, status=rows)
        turn = number / 60
        orientation = {"z": math.sin(turn / 2), "w": math.cos(turn / 2)}
        imu.publish(header=header, orientation=orientation)
        odometry.publish(header=header, twist={"twist": {"linear": {"x": math.sin(turn)}}})
        due += 1 / 30
        time.sleep(max(0.0, due - time.monotonic()))


@dataclass
class Result:
    """Seconds until the first frame, and the CPU afterwards, in shares of a core."""

    first: float
    cpu: float


def measure(command: list[str], screen: VirtualScreen) -> Result:
    """Start an interface, and watch the screen and its CPU."""
    environment = {**os.environ, "DISPLAY": screen.display, "QT_QPA_PLATFORM": "xcb"}
    pixels = Pixels(screen.display, 0, _SQUARE // 2, _SQUARE * len(SHOWN))
    while _is_shown(pixels):
        time.sleep(0.05)  # the window of before
    begin = time.monotonic()
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, env=environment, stdout=output, stderr=output)
        try:
            while not _is_shown(pixels):
                if time.monotonic() - begin > _TIMEOUT_S or process.poll() is not None:
                    output.seek(0)
                    sys.exit(f"{command}: no frame: {output.read()}")
                time.sleep(0.001)
            first = time.monotonic() - begin
            time.sleep(_SETTLE_S)
            before, since = _cpu_s(process.pid), time.monotonic()
            time.sleep(_MEASURE_S)
            cpu = (_cpu_s(process.pid) - before) / (time.monotonic() - since)
            return Result(first, cpu)
        finally:
            process.terminate()
            process.wait()


def _is_shown(pixels: Pixels) -> bool:
    return tuple(int(level) for level in pixels.read()[_SQUARE // 2 :: _SQUARE]) == SHOWN


def _cpu_s(pid: int) -> float:
    """Return the CPU time of a process in seconds."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run(rounds: int, only: list[str]) -> dict[str, list[Result]]:
    """Measure every contender in each round."""
    results: dict[str, list[Result]] = {}
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        screen = stack.enter_context(VirtualScreen(*SCREEN))
        Pixels(screen.display, 0, 0, 8)  # keeps the screen, which ends with its last client
        url = stack.enter_context(Router("tcp/127.0.0.1:0")).url
        robot = subprocess.Popen(
            [sys.executable, __file__, "publish", url], stdout=subprocess.DEVNULL
        )
        stack.callback(robot.wait)
        stack.callback(robot.terminate)
        for kind in only:
            Path(folder, f"{kind}.qml").write_text(interface(kind))
        time.sleep(2.0)
        for round_ in range(rounds + 1):
            for kind in only:
                file = str(Path(folder, f"{kind}.qml"))
                command = [sys.executable, "-m", "rosglass.cli", "run", file, "--url", url]
                result = measure(command, screen)
                if round_:
                    results.setdefault(kind, []).append(result)
    return results


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", nargs="*", default=["grid", "layout", "pages"])
    args = parser.parse_args()
    print(f"40 controls, {SCREEN[0]}x{SCREEN[1]}, Xvfb, load {os.getloadavg()[0]:.1f}", flush=True)
    results = run(args.rounds, args.only)
    grid = results.get("grid")
    base = statistics.median(one.cpu for one in grid) if grid else 0.0
    missed = False
    print(f"{'':10}{'first frame':>12}{'worst':>8}{'CPU':>8}")
    for kind, rounds in results.items():
        first = statistics.median(one.first for one in rounds)
        cpu = statistics.median(one.cpu for one in rounds)
        worst = max(one.first for one in rounds)
        line = f"{kind:10}{first:10.2f} s{worst:6.2f} s{cpu:8.1%}"
        if kind != "grid" and base:
            is_missed = first > FIRST_TARGET or cpu > CPU_TARGET * base
            missed |= is_missed
            line += f"   {cpu / base:.2f}x the grid's CPU, targets {FIRST_TARGET:g} s and "
            line += f"{CPU_TARGET:g}x: {'MISSED' if is_missed else 'met'}"
        print(line)
    return int(missed)


if __name__ == "__main__":
    if sys.argv[1:2] == ["publish"]:
        publish(sys.argv[2])
    else:
        sys.exit(main())
