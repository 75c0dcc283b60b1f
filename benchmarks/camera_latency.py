"""Measure how long a camera picture takes from the robot's process to pixels on the X server.

    python benchmarks/camera_latency.py [--seconds N] [--ui listing|cockpit|both] [--transport raw]

A router, the simulated robot (640x480 at 30 Hz) and an interface run as processes of their own;
the interface draws on Xvfb with software OpenGL. The robot paints the moment of publishing and the
picture's number into each picture, as a line of black and white squares. This program asks the X
server about a thousand times a second for the pixels of that line: the first time a new number is
there, the picture has arrived, whatever software believes. A figure can be too high by one such
interval (printed), never too low.

`listing` is the paper's Listing 1 (picture, drag area, button) in a 640x480 window, the interface
that the C++ plugin for ROS 1 was measured with on the same kind of machine; `cockpit` is the
demo's whole screen, 1340x800. Exits 1 when the listing's median is 25 ms or more or a picture is
missing.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rosglass.demo import framecode
from rosglass.demo.camera import CODE_POSITION, HEIGHT, WIDTH
from rosglass.demo.processes import VirtualScreen
from rosglass.ros2.zenoh.router import Router

TARGET = 25.0
#: The C++ plugin (qml_ros_plugin 1.0.0, ROS 1, qmlscene, same interface, same pictures).
CPLUSPLUS = {"median": 10.3, "p90": 12.1, "worst": 15.0, "cpu": 21, "memory": 153}
SCREEN = (1340, 800)
LISTING = """
import QtQuick
import QtQuick.Controls
import Ros2 1.0

Item {
    width: 640; height: 480
    Component.onCompleted: Ros2.init("listing")
    ImageTransportSubscription { id: camera; topic: "/camera/image_raw"; defaultTransport: "%s" }
    VideoOutput { anchors.fill: parent; source: camera }
    Rectangle {
        anchors.horizontalCenter: parent.horizontalCenter
        width: 120; height: 120; radius: 60; color: "#aaaaaa"
        MouseArea {
            anchors.fill: parent
            property var pub: Ros2.createPublisher("/cmd_vel", "geometry_msgs/msg/Twist", 1)
            onPositionChanged: pub.publish({ linear: { x: -mouseY }, angular: { z: -mouseX } })
        }
    }
    Button { text: "Flashlight" }
}
"""


class _Image(ctypes.Structure):
    """The beginning of Xlib's ``XImage``."""

    _fields_ = (
        *((name, ctypes.c_int) for name in ("width", "height", "xoffset", "format")),
        ("data", ctypes.c_void_p),
        *((name, ctypes.c_int) for name in ("byte_order", "unit", "bit_order", "pad", "depth")),
        *((name, ctypes.c_int) for name in ("bytes_per_line", "bits_per_pixel")),
    )


class Pixels:
    """One row of pixels of an X server's screen, read again and again."""

    def __init__(self, display: str, x: int, y: int, width: int) -> None:
        self._x11 = x11 = ctypes.CDLL("libX11.so.6")
        x11.XOpenDisplay.restype = ctypes.c_void_p
        x11.XGetImage.restype = ctypes.POINTER(_Image)
        self._display = ctypes.c_void_p(x11.XOpenDisplay(display.encode()))
        self._root = ctypes.c_ulong(x11.XDefaultRootWindow(self._display))
        self._all = ctypes.c_ulong(0xFFFFFFFF)
        self._place = (x, y, width)
        self._image = x11.XGetImage(self._display, self._root, x, y, width, 1, self._all, 2)
        size = self._image.contents.bytes_per_line
        memory = (ctypes.c_uint8 * size).from_address(self._image.contents.data)
        self._row = np.frombuffer(memory, np.uint8).reshape(-1, 4)[:, 1]

    def read(self) -> np.ndarray:
        """Return the brightness of the pixels as they are now; overwritten by the next call."""
        x, y, width = self._place
        self._x11.XGetSubImage(
            *(self._display, self._root, x, y, width, 1, self._all, 2, self._image, 0, 0)
        )
        return self._row


@dataclass
class Result:
    """What was seen of one interface."""

    latencies: list[float] = field(default_factory=list)
    missing: int = 0
    seconds: float = 0.0
    polls: int = 0
    cpu: float = 0.0
    memory: float = 0.0

    def percentile(self, share: float) -> float:
        """Return the latency that `share` percent of the pictures stayed below, ms."""
        return 1000 * float(np.percentile(self.latencies, share)) if self.latencies else np.nan


def watch(pixels: Pixels, seconds: float) -> Result:
    """Follow the pictures on the screen."""
    result = Result()
    last = None
    begin = time.monotonic()
    while (now := time.monotonic()) - begin < seconds:
        row = pixels.read()
        seen = time.time_ns()
        result.polls += 1
        # A line that is half replaced does not count: its picture is not there yet.
        with contextlib.suppress(framecode.FrameCodeError):
            code = framecode.read(row)
            if last is not None and code.number != last:
                result.latencies.append(code.age(seen))
                result.missing += (code.number - last) % 65536 - 1
            last = code.number
        result.seconds = now - begin
        time.sleep(0.0007)
    return result


def processor_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident(pid: int) -> float:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def find_code(display: str) -> tuple[int, int, int]:
    """Return where the line of squares is on the screen: x, y, width."""
    for x, y, scale in [(0, 0, 1.0), *cockpit_places()]:
        at = (
            round(x + CODE_POSITION[0] * scale),
            round(y + (CODE_POSITION[1] + framecode.SQUARE / 2) * scale),
            round(framecode.BITS * framecode.SQUARE * scale),
        )
        with contextlib.suppress(framecode.FrameCodeError):
            framecode.read(Pixels(display, *at).read())
            return at
    raise SystemExit("no frame code on the screen: is the interface showing the camera?")


def cockpit_places() -> list[tuple[float, float, float]]:
    """Where the cockpit's picture can be: beside the panels, as high as the window allows."""
    gap, bar = 10, 44
    height = SCREEN[1] - bar - 2 * gap
    width = SCREEN[0] - 3 * gap - max(280, min(420, SCREEN[0] - 3 * gap - height * 4 / 3))
    scale = min(width / WIDTH, height / HEIGHT)
    x = gap + (width - WIDTH * scale) / 2
    y = bar + gap + (height - HEIGHT * scale) / 2
    return [(x + dx, y + dy, scale) for dx in (0, -1, 1) for dy in (0, -1, 1)]


def measure(ui: str, transport: str, seconds: float, loop: str, options: str) -> Result:
    """Run router, robot and interface, and watch the screen."""
    rosglass = [sys.executable, "-m", "rosglass"]
    with (
        tempfile.TemporaryDirectory() as folder,
        VirtualScreen(*SCREEN) as screen,
        Router("tcp/127.0.0.1:0") as router,
        contextlib.ExitStack() as stack,
    ):
        url = router.url + options
        # Keeps the screen, which ends with its last client.
        Pixels(screen.display, 0, 0, 8)
        environment = {**os.environ, "DISPLAY": screen.display, "QT_QPA_PLATFORM": "xcb"}
        environment["QT_LOGGING_RULES"] = "qt.multimedia.*=false"
        if loop:
            environment["QSG_RENDER_LOOP"] = loop

        def start(*command: str) -> subprocess.Popen[bytes]:
            process = subprocess.Popen(
                [*rosglass, *command],
                env=environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
            return process

        start("robot", "--url", url)
        if ui == "listing":
            file = Path(folder, "listing.qml")
            file.write_text(LISTING % transport)
            interface = start("run", str(file), "--url", url)
        else:
            interface = start("demo", "--no-robot", "--url", url)
        time.sleep(4.0)
        place = find_code(screen.display)
        pixels = Pixels(screen.display, *place)
        watch(pixels, 2.0)
        begin, cpu = time.monotonic(), processor_seconds(interface.pid)
        result = watch(pixels, seconds)
        result.cpu = (processor_seconds(interface.pid) - cpu) / (time.monotonic() - begin)
        result.memory = resident(interface.pid)
        return result


def report(name: str, result: Result) -> None:
    shown = len(result.latencies)
    print(
        f"{name:28}  {result.percentile(50):6.1f}  {result.percentile(90):6.1f}  "
        f"{result.percentile(100):6.1f}  {shown / result.seconds:5.1f}  {result.missing:7d}  "
        f"{100 * result.cpu:4.0f} %  {result.memory:6.0f}  "
        f"{1000 * result.seconds / max(1, result.polls):5.1f}"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--ui", choices=["listing", "cockpit", "both"], default="both")
    parser.add_argument("--transport", choices=["raw", "compressed"], default="raw")
    parser.add_argument("--loop", choices=["", "basic", "threaded"], default="")
    parser.add_argument("--shm", action="store_true", help="let Zenoh use shared memory")
    args = parser.parse_args()
    processors = os.cpu_count()
    model = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    print(f"{WIDTH}x{HEIGHT} at 30 Hz, {args.transport}; Xvfb, software OpenGL, {processors} cores")
    print(model[1] if model else "", f"load {os.getloadavg()[0]:.1f} before the start")
    heading = "median     p90   worst  per s  missing     CPU     MiB   poll"
    print(f"\n{'stamp -> pixel (ms)':28}  {heading}")
    interfaces = ["listing", "cockpit"] if args.ui == "both" else [args.ui]
    results = {}
    options = "?shm=true" if args.shm else ""
    for ui in interfaces:
        results[ui] = measure(ui, args.transport, args.seconds, args.loop, options)
        report(f"rosglass, {ui}", results[ui])
    fixed = CPLUSPLUS
    print(
        f"{'C++ plugin, listing (fixed)':28}  {fixed['median']:6.1f}  {fixed['p90']:6.1f}  "
        f"{fixed['worst']:6.1f}   30.0        0  {fixed['cpu']:4.0f} %  {fixed['memory']:6.0f}"
    )
    judged = results.get("listing")
    if judged is None:
        return 0
    median = judged.percentile(50)
    print(f"\nlisting: {median / CPLUSPLUS['median']:.2f} times the C++ plugin's median")
    missed = not median < TARGET or judged.missing > 0
    print(f"target: median below {TARGET:.0f} ms, nothing missing: {'MISSED' if missed else 'met'}")
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
