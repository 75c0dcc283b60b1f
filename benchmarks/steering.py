"""Measures how long it takes from an event of the stick to its Twist on the wire.

    python benchmarks/steering.py [--moves N] [--rounds N] [--busy]

A window with a DriveStick and a TwistCommand runs in a process of its own on Xvfb. It gets mouse
moves, each to another place, 20 ms apart, posted to its event queue as Qt's window system does. The
robot is a bare subscriber of the package `zenoh` in this process; it attributes each Twist to its
move by the speed. The peer is a bare publisher of `zenoh` in another process, which sends the same
bytes at the same rate: what the network and this process take. Both go through the same router, and
take turns, round by round. With --busy, both cores are kept busy by other processes. Exits 1 when
the 99th percentile is over 15 ms, or a move has no Twist.
"""

from __future__ import annotations

import argparse
import json
import os
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/helpers"))

import zenoh
from ports import free_port

from letting_go import busy_cores, stays_connected
from rosglass.demo.processes import VirtualScreen
from rosglass.wires.zenoh.router import Router

LIMIT_MS = 15.0
INTERVAL_S = 0.02
#: linear.x behind the encapsulation header.
SPEED = struct.Struct("<4xd")
SCREEN = """import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0
Window {
    width: 1200; height: 1200
    visible: true
    color: Theme.background
    Component.onCompleted: Ros2.init("screen")
    TwistCommand {
        id: drive
        objectName: "drive"
        topic: "cmd_vel"; maxSpeed: 1; acceleration: 0; deceleration: 0; turnAcceleration: 0
    }
    DriveStick { anchors.fill: parent; objectName: "stick"; command: drive; deadZone: 0 }
}
"""


def session(address: str) -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([address]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def bare(address: str, count: int) -> None:
    """Publish `count` speeds, and print when each was."""
    opened = session(address)
    publisher = opened.declare_publisher("0/bare/cmd_vel")
    time.sleep(0.5)
    sent = []
    for number in range(count):
        speed = (number + 1) / (2 * count)
        sent.append((time.monotonic(), speed))
        publisher.put(SPEED.pack(speed) + bytes(40))
        time.sleep(INTERVAL_S)
    print(json.dumps(sent), flush=True)
    opened.close()


def screen(url: str, count: int) -> None:
    """Drag the stick to `count` places, and print when each event was posted, and its speed."""
    from rosglass.qml import Application
    from rosglass.qt import QtCore, QtGui

    file = Path(tempfile.mkdtemp()) / "Main.qml"
    file.write_text(SCREEN)
    app = Application(file, url=url)
    app.load()
    window: Any = app.window
    drive: Any = window.findChild(QtCore.QObject, "drive")
    stick: Any = window.findChild(QtCore.QObject, "stick")
    window.requestActivate()
    kinds, buttons = QtCore.QEvent.Type, QtCore.Qt.MouseButton
    sent: list[tuple[float, float]] = []
    held = buttons.LeftButton

    def post(kind: Any, y: float) -> float:
        at, button = QtCore.QPointF(600, y), held if kind != kinds.MouseMove else buttons.NoButton
        down = buttons.NoButton if kind == kinds.MouseButtonRelease else held
        event = QtGui.QMouseEvent(
            kind, at, at, at, button, down, QtCore.Qt.KeyboardModifier.NoModifier
        )
        now = time.monotonic()
        QtCore.QCoreApplication.postEvent(window, event)
        return now

    def step() -> None:
        sender = drive._endpoint
        if not sent and not (sender and sender.connected and window.isActive()):
            return
        if sent:  # the event of the step before has been handled
            sent[-1] = (sent[-1][0], stick.property("forward"))
        if len(sent) > count:
            timer.stop()
            post(kinds.MouseButtonRelease, 600)
            print(json.dumps(sent[1:]), flush=True)
            QtCore.QTimer.singleShot(1500, lambda: app.quit(0))
            return
        kind = kinds.MouseMove if sent else kinds.MouseButtonPress
        sent.append((post(kind, 599.5 - 300 * len(sent) / count), 0.0))

    timer = QtCore.QTimer()
    timer.setTimerType(QtCore.Qt.TimerType.PreciseTimer)
    timer.timeout.connect(step)
    QtCore.QTimer.singleShot(1500, lambda: timer.start(round(INTERVAL_S * 1000)))
    app.run(end_process=True)


def turn(role: str, where: str, count: int, received: list[tuple[float, float]]) -> list[float]:
    """Return the latencies in ms of one round; infinite if it halted: the screen stood still."""
    received.clear()
    command = [sys.executable, __file__, "--role", role, where, str(count)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    lines = [line for line in result.stdout.splitlines() if line.startswith("[[")]
    if not lines:
        raise SystemExit(f"{role}: {result.stdout}{result.stderr}")
    arrived: dict[int, float] = {}
    for at, speed in received:
        arrived.setdefault(round(1e6 * speed), at)
    found, latest = [], float("inf")
    for at, speed in reversed(json.loads(lines[-1])):
        # A later move may have replaced this one before it was sent.
        latest = min(latest, arrived.get(round(1e6 * speed), float("inf")))
        found.append(1000 * (latest - at))
    return found


def show(name: str, found: list[float]) -> float:
    ordered = sorted(found)
    share = lambda part: ordered[min(len(ordered) - 1, int(part * len(ordered)))]  # noqa: E731
    print(
        f"| {name} | {share(0.5):.2f} | {share(0.9):.2f} | {share(0.99):.2f} | {ordered[-1]:.2f} |"
    )
    return share(0.99)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, default=300)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--busy", action="store_true")
    parser.add_argument("--role", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.role:
        role, where, count = given.role
        (bare if role == "bare" else screen)(where, int(count))
        return 0
    ours: list[float] = []
    theirs: list[float] = []
    with VirtualScreen() as display, Router(f"tcp/127.0.0.1:{free_port()}") as router:
        os.environ |= {"DISPLAY": display.display, "QT_QPA_PLATFORM": "xcb"}
        address = router.url.replace("zenoh://", "tcp/")
        opened, received = session(address), []

        def on_sample(sample: zenoh.Sample) -> None:
            received.append((time.monotonic(), SPEED.unpack_from(sample.payload.to_bytes())[0]))

        kept = [opened.declare_subscriber(key, on_sample) for key in ("0/cmd_vel/**", "0/bare/**")]
        with stays_connected(display.display), busy_cores(given.busy):
            for _ in range(given.rounds):
                theirs += turn("bare", address, given.moves, received)
                ours += turn("screen", router.url, given.moves, received)
        del kept
        opened.close()
    print("ms from the event to the subscriber\n\n| | median | 90 % | 99 % | worst |")
    print("|---|---|---|---|---|")
    show("bare zenoh publisher", theirs)
    late = show("DriveStick and TwistCommand", ours)
    return int(late > LIMIT_MS or max(ours) == float("inf"))


if __name__ == "__main__":
    sys.exit(main())
