"""Measures how long a camera image takes from the robot's process to pixels on the X server.

    python benchmarks/camera_latency.py [--seconds N] [--rounds N] [--only NAME ...]

A router, a camera at 30 Hz and an interface run as processes of their own; the interface draws on
Xvfb with software OpenGL. The camera paints the moment of publishing and the image's number into
each image, as a line of black and white squares. This program asks the X server about a thousand
times a second for the pixels of that line: the first time a new number is there, the image has
arrived, whatever software believes. A figure can be too high by one such interval (printed), never
too low.

`listing` is the paper's Listing 1 (image, drag area, button) in a 640x480 window, the interface
that the C++ plugin for ROS 1 was measured with on the same kind of machine. `plain` is a PySide6
program with the same items that makes the same images itself, in a thread, and pushes them into
a QVideoSink: no robot, no network. Images travel over TCP once, from node to node, as those of
ROS 2 do on one machine; with `ros1` they do so as ROS 1 has it, with Debian's rosmaster. With
`shm`, Zenoh hands them over in shared memory, which both sides have to ask for. `one preview` and
`eight previews` show one camera once, and eight times (three by three, less one), in a 640x480
window. `cockpit` is the demo's whole screen, 1340x800, with the simulated robot. Contenders take
turns, round by round; figures are medians of the rounds. Exits 1 when a target is missed or an
image is missing.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import os
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from camera_peers import TOPIC, code_place
from rosglass.demo import framecode
from rosglass.demo.camera import CODE_POSITION, HEIGHT, WIDTH
from rosglass.demo.processes import VirtualScreen
from rosglass.wires.zenoh.router import Router

if TYPE_CHECKING:
    from collections.abc import Iterator

SCREEN = (1340, 800)
PEERS = str(Path(__file__).with_name("camera_peers.py"))
#: The C++ plugin (qml_ros_plugin 1.0.0, ROS 1, qmlscene, same interface): median, 90 %, worst
#: (ms), CPU (% of a core), memory (MiB).
CPLUSPLUS = {(640, 480): (10.3, 12.1, 15.0, 21, 153), (1920, 1080): (15.8, 18.4, 42.9, 35, 201)}
#: Median latency to reach, ms.
TARGETS = {
    "listing 640x480": 12.0,
    "listing 640x480 ros1": 12.0,
    "listing 1920x1080": 18.0,
    "listing 1920x1080 shm": 18.0,
    "listing 1920x1080 ros1": 18.0,
}
#: CPU to reach, as ratios: to the plain program, and of eight previews to one.
CPU_TARGET = 1.3
CONTROLS = """
    Rectangle {
        anchors.horizontalCenter: parent.horizontalCenter
        width: 120; height: 120; radius: 60; color: "#aaaaaa"
        MouseArea {
            anchors.fill: parent
            PUBLISH
        }
    }
    Button { text: "Flashlight" }
"""
PUBLISH = """
            property var pub: Ros2.createPublisher("/cmd_vel", "geometry_msgs/msg/Twist", 1)
            onPositionChanged: pub.publish({ linear: { x: -mouseY }, angular: { z: -mouseX } })
"""
LISTING = (
    """
import QtQuick
import QtQuick.Controls
import Ros2 1.0

Item {
    width: 640; height: 480
    Component.onCompleted: Ros2.init("listing")
    ImageTransportSubscription { id: camera; topic: "TOPIC"; defaultTransport: "raw" }
    VideoOutput { anchors.fill: parent; source: camera }
"""
    + CONTROLS.replace("PUBLISH", PUBLISH)
    + "}"
)
PLAIN = (
    """
import QtQuick
import QtQuick.Controls
import QtMultimedia

Item {
    width: 640; height: 480
    property var sink: output.videoSink
    VideoOutput { id: output; anchors.fill: parent }
"""
    + CONTROLS.replace("PUBLISH", "")
    + "}"
)
PREVIEWS = """
import QtQuick
import QtMultimedia
import Ros2 1.0

Item {
    width: 640; height: 480
    Component.onCompleted: Ros2.init("previews")
    Grid {
        columns: COLUMNS
        Repeater {
            model: COUNT
            VideoOutput {
                id: output
                width: 640 / COLUMNS; height: 480 / COLUMNS
                property QtObject camera: ImageTransportSubscription {
                    topic: "TOPIC"; defaultTransport: "raw"; videoSink: output.videoSink
                }
            }
        }
    }
}
"""


@dataclass(frozen=True)
class Contender:
    """An interface to measure.

    Attributes:
        name: Its name.
        qml: Its source; empty for the demo's cockpit.
        size: Width and height of the camera's images.
        shown: Width and height of the first image's item, whose top left corner is the screen's.
        plain: Whether it runs without rosglass.
        options: What the address of the robot ends with.
        ros1: Whether camera and interface speak ROS 1 instead of Zenoh.
    """

    name: str
    qml: str
    size: tuple[int, int] = (640, 480)
    shown: tuple[int, int] = (640, 480)
    plain: bool = False
    options: str = ""
    ros1: bool = False


VGA, HD = (640, 480), (1920, 1080)
CONTENDERS = (
    Contender("listing 640x480", LISTING),
    Contender("listing 640x480 ros1", LISTING, ros1=True),
    Contender("plain 640x480", PLAIN, plain=True),
    Contender("listing 1920x1080", LISTING, HD),
    Contender("listing 1920x1080 shm", LISTING, HD, options="?shm=true"),
    Contender("listing 1920x1080 ros1", LISTING, HD, ros1=True),
    Contender("plain 1920x1080", PLAIN, HD, plain=True),
    Contender("one preview", PREVIEWS.replace("COUNT", "1").replace("COLUMNS", "1")),
    Contender(
        "eight previews", PREVIEWS.replace("COUNT", "8").replace("COLUMNS", "3"), shown=(213, 160)
    ),
    Contender("cockpit", ""),
)


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
    """The measurements of one interface."""

    latencies: list[float] = field(default_factory=list)
    missing: int = 0
    seconds: float = 0.0
    polls: int = 0
    cpu: float = 0.0
    memory: float = 0.0

    def percentile(self, share: float) -> float:
        """Return the latency that `share` percent of the images stayed below, ms."""
        return 1000 * float(np.percentile(self.latencies, share)) if self.latencies else np.nan


def watch(pixels: Pixels, seconds: float) -> Result:
    """Follow the images on the screen."""
    result = Result()
    last = None
    begin = time.monotonic()
    while (now := time.monotonic()) - begin < seconds:
        row = pixels.read()
        seen = time.time_ns()
        result.polls += 1
        # A line that is half replaced does not count: its image is not there yet.
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


def find_code(display: str, contender: Contender) -> tuple[int, int, int]:
    """Return where the line of squares is on the screen: x, y, width."""
    if contender.qml:
        (width, height), (room, space) = contender.size, contender.shown
        scale = min(room / width, space / height)
        x, y, square = code_place(width, height)
        left, top = (room - width * scale) / 2, (space - height * scale) / 2
        places = [(left + x * scale, top + (y + square / 2) * scale, square * scale)]
    else:
        places = [
            (
                x + CODE_POSITION[0] * scale,
                y + (CODE_POSITION[1] + framecode.SQUARE / 2) * scale,
                framecode.SQUARE * scale,
            )
            for x, y, scale in cockpit_places()
        ]
    until = time.monotonic() + 20
    while time.monotonic() < until:
        for x, y, square in places:
            at = (round(x), round(y), round(framecode.BITS * square))
            with contextlib.suppress(framecode.FrameCodeError):
                framecode.read(Pixels(display, *at).read())
                return at
        time.sleep(0.2)
    raise SystemExit(f"{contender.name}: no image of the camera on the screen")


def cockpit_places() -> list[tuple[float, float, float]]:
    """Return where the cockpit's image can be: beside the panels, as high as the window allows."""
    gap, bar = 10, 44
    height = SCREEN[1] - bar - 2 * gap
    width = SCREEN[0] - 3 * gap - max(280, min(420, SCREEN[0] - 3 * gap - height * 4 / 3))
    scale = min(width / WIDTH, height / HEIGHT)
    x = gap + (width - WIDTH * scale) / 2
    y = bar + gap + (height - HEIGHT * scale) / 2
    return [(x + dx, y + dy, scale) for dx in (0, -1, 1) for dy in (0, -1, 1)]


@contextlib.contextmanager
def master() -> Iterator[str]:
    """Run a ROS 1 master; gives its address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    process = subprocess.Popen(
        ["/usr/bin/rosmaster", "--core", "-p", str(port)],
        env=environment | {"PATH": "/usr/bin:/bin", "ROS_MASTER_URI": f"http://127.0.0.1:{port}"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        until = time.monotonic() + 20
        while time.monotonic() < until:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
                break
            time.sleep(0.1)
        yield f"ros1://127.0.0.1:{port}?ip=127.0.0.1"
    finally:
        process.terminate()
        process.wait()


def measure(contender: Contender, seconds: float) -> Result:
    """Run router, camera and interface, and watch the screen."""
    rosglass = [sys.executable, "-m", "rosglass"]
    with (
        tempfile.TemporaryDirectory() as folder,
        VirtualScreen(*SCREEN) as screen,
        contextlib.ExitStack() as stack,
    ):
        if contender.ros1:
            url = stack.enter_context(master())
        else:
            url = stack.enter_context(Router("tcp/127.0.0.1:0")).url + contender.options
        # Keeps the screen, which ends with its last client.
        Pixels(screen.display, 0, 0, 8)
        environment = {**os.environ, "DISPLAY": screen.display, "QT_QPA_PLATFORM": "xcb"}
        environment["QT_LOGGING_RULES"] = "qt.multimedia.*=false"

        def start(*command: str) -> subprocess.Popen[bytes]:
            process = subprocess.Popen(
                command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
            return process

        file = Path(folder, "view.qml")
        file.write_text(contender.qml.replace("TOPIC", TOPIC))
        size = [str(number) for number in contender.size]
        if contender.plain:
            interface = start(sys.executable, PEERS, "plain", *size, str(file))
        elif contender.qml:
            start(sys.executable, PEERS, "camera", url, *size)
            interface = start(*rosglass, "run", str(file), "--url", url)
        else:
            start(*rosglass, "robot", "--url", url)
            interface = start(*rosglass, "demo", "--no-robot", "--url", url)
        time.sleep(2.0)
        pixels = Pixels(screen.display, *find_code(screen.display, contender))
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
        f"{1000 * result.seconds / max(1, result.polls):5.1f}  {os.getloadavg()[0]:5.1f}",
        flush=True,
    )


def judge(results: dict[str, list[Result]]) -> bool:
    """Print the figures against their targets; returns whether one was missed."""
    missed = False

    def line(what: str, value: float, target: float, unit: str) -> None:
        nonlocal missed
        good = value <= target
        missed |= not good
        print(
            f"{what:44} {value:6.2f}{unit} (target {target}{unit}: {'met' if good else 'MISSED'})"
        )

    def ratio(ours: str, theirs: str) -> float:
        pairs = zip(results[ours], results[theirs], strict=True)
        return statistics.median(a.cpu / b.cpu for a, b in pairs)

    print()
    for name, target in TARGETS.items():
        if name in results:
            median = statistics.median(result.percentile(50) for result in results[name])
            line(f"{name}: median", median, target, " ms")
        plain = " ".join(name.replace("listing", "plain").split()[:2])
        if {name, plain} <= results.keys():
            line(f"{name}: CPU against plain", ratio(name, plain), CPU_TARGET, "x")
    if {"one preview", "eight previews"} <= results.keys():
        line("eight previews: CPU against one", ratio("eight previews", "one preview"), 1.3, "x")
    for name, rounds in results.items():
        missing = sum(result.missing for result in rounds)
        if missing and not name.startswith("plain"):
            missed = True
            print(f"{name}: {missing} images MISSING")
    return missed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", nargs="*", default=[], metavar="NAME", help="parts of names")
    args = parser.parse_args()
    chosen = [c for c in CONTENDERS if not args.only or any(n in c.name for n in args.only)]
    if not Path("/usr/bin/rosmaster").exists():
        print("without ROS 1, which needs: apt install python3-rosmaster")
        chosen = [contender for contender in chosen if not contender.ros1]
    model = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    print(f"30 Hz, raw; Xvfb, software OpenGL, {os.cpu_count()} cores")
    print(model[1] if model else "", f"load {os.getloadavg()[0]:.1f} before the start")
    heading = "median     p90   worst  per s  missing     CPU     MiB   poll   load"
    print(f"\n{'stamp -> pixel (ms)':28}  {heading}", flush=True)
    results: dict[str, list[Result]] = {}
    for _ in range(args.rounds):
        for contender in chosen:
            result = measure(contender, args.seconds)
            results.setdefault(contender.name, []).append(result)
            report(contender.name, result)
    for (width, height), fixed in CPLUSPLUS.items():
        median, most, worst, cpu, memory = fixed
        print(
            f"{f'C++ plugin {width}x{height} (fixed)':28}  {median:6.1f}  {most:6.1f}  {worst:6.1f}"
            f"   30.0        0  {cpu:4.0f} %  {memory:6.0f}"
        )
    return int(judge(results))


if __name__ == "__main__":
    sys.exit(main())
