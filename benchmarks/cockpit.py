"""How soon a cockpit with 30 subscriptions is on the screen, and when all of them show a value.

    python benchmarks/cockpit.py [--rounds N] [--only NAME ...]

The interface is 24 texts bound to `Subscription` elements of twelve types, four bound to
`TfTransform` elements and two cameras, 640x480 raw. A robot in a process of its own publishes all
that: texts' topics at 10 Hz, transforms at 30 Hz, cameras at 15 Hz, over Zenoh by way of a router,
and over ROS 1 with Debian's rosmaster. `plain` shows the same items in plain PySide6, without robot
and values.

The time is from the start of the process (`rosglass run FILE`) until the X server (Xvfb, software
OpenGL) shows it, whatever software believes: this program reads a line of its pixels about a
thousand times a second, where the interface paints a pattern from the first frame on, and a second
one when every text and image has had a value. Contenders take turns, round by round; the first
round fills the caches of files and does not count. Figures are medians. Exits 1 when a first frame
takes longer than the target.
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
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from camera_latency import Pixels, master
from first_frame import PLAIN
from rosglass.demo.processes import VirtualScreen
from rosglass.wires.zenoh.router import Router

#: Seconds until the first frame.
TARGET = 1.0
SCREEN = (1280, 800)
_TIMEOUT_S = 30.0
#: Type, what the text shows of a message `m`, and a value of the field that changes.
VALUES: tuple[tuple[str, str, str], ...] = (
    ("std_msgs/msg/String", "m.data", "data"),
    ("std_msgs/msg/Float64", "m.data.toFixed(2)", "data"),
    ("std_msgs/msg/Int32", "m.data", "data"),
    ("sensor_msgs/msg/Imu", "m.angular_velocity.z.toFixed(2)", "angular_velocity.z"),
    ("sensor_msgs/msg/BatteryState", "m.voltage.toFixed(1)", "voltage"),
    ("sensor_msgs/msg/JointState", "m.position.length", "position"),
    ("sensor_msgs/msg/LaserScan", "m.ranges.length", "ranges"),
    ("sensor_msgs/msg/NavSatFix", "m.latitude.toFixed(5)", "latitude"),
    ("nav_msgs/msg/Odometry", "m.pose.pose.position.x.toFixed(2)", "pose.pose.position.x"),
    ("geometry_msgs/msg/PoseStamped", "m.pose.position.y.toFixed(2)", "pose.position.y"),
    ("geometry_msgs/msg/TwistStamped", "m.twist.linear.x.toFixed(2)", "twist.linear.x"),
    ("diagnostic_msgs/msg/DiagnosticArray", "m.status.length", "status"),
)
FRAMES = ("base_link", "arm", "gripper", "camera_link")
CAMERAS = ("/front/image_raw", "/rear/image_raw")
COPIES = 2
COUNT = COPIES * len(VALUES) + len(FRAMES) + len(CAMERAS)
#: Brightness of the squares of eight pixels, top left: from the first frame on, and when complete.
_SQUARE = 8
SHOWN, COMPLETE = (255, 0, 255, 0), (0, 255, 0, 255)


def topics() -> list[tuple[str, str, str, str]]:
    """Return topic, type, what is shown, and which field changes."""
    return [
        (f"/{type_name.rpartition('/')[2].lower()}_{copy}", type_name, shown, changed)
        for copy in range(COPIES)
        for type_name, shown, changed in VALUES
    ]


def interface(plain: bool) -> str:
    """Return the interface's source, with rosglass's elements or with what replaces them."""
    squares = "".join(
        f"Rectangle {{ x: {_SQUARE * i}; width: {_SQUARE}; height: {_SQUARE}; "
        f'color: all.count === {COUNT} ? "{_gray(done)}" : "{_gray(first)}" }}\n'
        for i, (first, done) in enumerate(zip(SHOWN, COMPLETE, strict=True))
    )
    texts = []
    for topic, _, shown, _ in topics():
        source = f'property var source: Subscription {{ topic: "{topic}" }}'
        if plain:
            source = "property var source: QtObject { property var message }"
        texts.append((topic, source, "source.message", f"(m => {shown})(source.message)"))
    for frame in FRAMES:
        source = (
            f'property var source: TfTransform {{ targetFrame: "odom"; sourceFrame: "{frame}" }}'
        )
        if plain:
            source = "property var source: QtObject { property bool valid; property var transform }"
        texts.append((frame, source, "source.valid", "source.translation.x.toFixed(3)"))
    items = "".join(
        f"""Row {{
            {source}
            property bool seen: !!{has}
            onSeenChanged: if (seen) all.saw({number})
            spacing: 6
            Label {{ text: "{name}"; width: 190 }}
            Label {{ text: parent.seen ? {text.replace("source.", "parent.source.")} : "-" }}
        }}
        """
        for number, (name, source, has, text) in enumerate(texts)
    )
    videos = ""
    for number, camera in enumerate(CAMERAS, start=len(texts)):
        source = (
            ""
            if plain
            else f"""
            property var source: ImageTransportSubscription {{
                topic: "{camera}"; defaultTransport: "raw"; videoSink: output{number}.videoSink
            }}"""
        )
        videos += f"""VideoOutput {{
            id: output{number}
            width: 400; height: 300{source}
            Connections {{
                target: output{number}.videoSink
                function onVideoFrameChanged() {{ all.saw({number}) }}
            }}
        }}
        """
    start = "" if plain else 'Component.onCompleted: Ros2.init("cockpit")'
    return f"""import QtQuick
import QtQuick.Controls
import QtMultimedia
{"" if plain else "import Ros2 1.0"}
Rectangle {{
    id: all
    width: {SCREEN[0]}; height: {SCREEN[1]}; color: "#303030"
    property var known: ({{}})
    property int count: 0
    function saw(number) {{
        if (!known[number]) {{
            known[number] = true
            count += 1
        }}
    }}
    {start}
    {squares}
    Row {{
        y: 40; spacing: 20
        Grid {{
            columns: 2; spacing: 8
            {items}
        }}
        Column {{
            spacing: 10
            {videos}
        }}
    }}
}}
"""


def _gray(brightness: int) -> str:
    return f"#{brightness:02x}{brightness:02x}{brightness:02x}"


def publish(url: str) -> None:
    """Publish what the interface shows, until killed; in a process of its own."""
    import numpy as np

    import rosglass
    from rosglass.comm import Time
    from rosglass.tf import Transform, TransformBroadcaster

    node = rosglass.connect(url, "robot")
    senders = []
    arrays = {"position": [0.5] * 12, "ranges": [1.5] * 720, "status": [{}] * 10}
    for topic, type_name, _, changed in topics():
        sender = node.create_publisher(topic, type_name, 1)
        senders.append((sender, changed, type_name))
    cameras = [node.create_publisher(topic, "sensor_msgs/msg/Image", 1) for topic in CAMERAS]
    tf = TransformBroadcaster(node)
    pixels = np.zeros(640 * 480 * 3, np.uint8)
    due, number = time.monotonic(), 0
    while True:
        number += 1
        now = Time.now()
        if number % 3 == 0:
            for sender, changed, type_name in senders:
                value: Any = arrays.get(changed, float(number))
                if type_name.endswith("String"):
                    value = f"number {number}"
                elif type_name.endswith("Int32"):
                    value = number
                for part in reversed(changed.split(".")):
                    value = {part: value}
                sender.publish(value)
        if number % 2 == 0:
            pixels[:] = number % 256
            for camera in cameras:
                camera.publish(
                    header={"stamp": now},
                    width=640,
                    height=480,
                    encoding="rgb8",
                    step=1920,
                    data=pixels,
                )
        tf.send_transform(
            [
                Transform(
                    (number / 1000, 0.0, 0.0), stamp=now, frame_id=parent, child_frame_id=frame
                )
                for parent, frame in zip(("odom", *FRAMES), FRAMES, strict=False)
            ]
        )
        due += 1 / 30
        time.sleep(max(0.0, due - time.monotonic()))


@dataclass
class Result:
    """Seconds from the start of the process to what was seen."""

    first: float
    complete: float


def measure(command: list[str], screen: VirtualScreen, complete: bool) -> Result:
    """Start an interface and watch the screen until it is complete, or shown."""
    environment = {**os.environ, "DISPLAY": screen.display, "QT_QPA_PLATFORM": "xcb"}
    environment["QT_LOGGING_RULES"] = "qt.multimedia.*=false"
    pixels = Pixels(screen.display, 0, _SQUARE // 2, _SQUARE * len(SHOWN))
    while _pattern(pixels):
        time.sleep(0.05)  # the window of before
    begin = time.monotonic()
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, env=environment, stdout=output, stderr=output)
        try:
            first = 0.0
            while True:
                seen, now = _pattern(pixels), time.monotonic() - begin
                if seen and not first:
                    first = now
                if seen == COMPLETE or (first and not complete):
                    return Result(first, now)
                if now > _TIMEOUT_S or process.poll() is not None:
                    output.seek(0)
                    sys.exit(f"{command}: first frame {first:.2f} s, then: {output.read()}")
                time.sleep(0.0007)
        finally:
            process.terminate()
            process.wait()


def _pattern(pixels: Pixels) -> tuple[int, ...]:
    """Return which of the two patterns is on the screen; empty for none."""
    found = tuple(int(level) for level in pixels.read()[_SQUARE // 2 :: _SQUARE])
    return found if found in (SHOWN, COMPLETE) else ()


def run(rounds: int, only: list[str]) -> dict[str, list[Result]]:
    """Measure every contender in each round."""
    results: dict[str, list[Result]] = {}
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        screen = stack.enter_context(VirtualScreen(*SCREEN))
        Pixels(screen.display, 0, 0, 8)  # keeps the screen, which ends with its last client
        ours, plain = Path(folder, "ours.qml"), Path(folder, "plain.qml")
        ours.write_text(interface(plain=False))
        plain.write_text(interface(plain=True))
        rosglass = [sys.executable, "-m", "rosglass.cli", "run", str(ours), "--url"]
        commands = {"plain": [sys.executable, "-c", PLAIN, str(plain)]}

        def robot(name: str, url: str) -> None:
            process = subprocess.Popen(
                [sys.executable, __file__, "publish", url], stdout=subprocess.DEVNULL
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
            commands[name] = [*rosglass, url]

        if not only or "zenoh" in only:
            robot("zenoh", stack.enter_context(Router("tcp/127.0.0.1:0")).url)
        if not only or "ros1" in only:
            if Path("/usr/bin/rosmaster").exists():
                robot("ros1", stack.enter_context(master()))
            else:
                print("without ROS 1, which needs: apt install python3-rosmaster")
        time.sleep(5.0)
        for round_ in range(rounds + 1):
            for name, command in commands.items():
                result = measure(command, screen, complete=name != "plain")
                if round_:
                    results.setdefault(name, []).append(result)
    return results


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--only", nargs="*", default=[], choices=["zenoh", "ros1"])
    args = parser.parse_args()
    print(
        f"{COUNT} subscriptions, Xvfb, software OpenGL, load {os.getloadavg()[0]:.1f}", flush=True
    )
    results = run(args.rounds, args.only)
    missed = False
    base = statistics.median(one.first for one in results["plain"])
    print(f"{'seconds from start':20}{'first frame':>12}{'best':>7}{'worst':>7}{'all values':>12}")
    for name, rounds in results.items():
        firsts = [one.first for one in rounds]
        first = statistics.median(firsts)
        verdict = ""
        if name != "plain":
            missed |= first > TARGET
            verdict = f"{statistics.median(one.complete for one in rounds):12.2f}"
            verdict += f"   {first / base:.2f}x plain PySide6, target {TARGET:g} s: "
            verdict += "MISSED" if first > TARGET else "met"
        print(f"{name:20}{first:12.2f}{min(firsts):7.2f}{max(firsts):7.2f}{verdict}")
    return int(missed)


if __name__ == "__main__":
    if sys.argv[1:2] == ["publish"]:
        publish(sys.argv[2])
    else:
        sys.exit(main())
