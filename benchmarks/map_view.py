"""Frames of a map of 4000 x 4000 cells while it is moved and zoomed, beside a plain Image.

    python benchmarks/map_view.py [--seconds N] [--only RENDERER]

`MapView`, 800x600 on a virtual screen, shows the map, which a robot in a process of its own sends
whole once a second over Zenoh, with some changed cells, a scan of 720 rays ten times a second, and
transforms thirty times a second. It is moved in every frame for some seconds, and then zoomed
between the whole map and 2 m. The peer is an `Image` of the same map, of the same size, moved and
scaled in the same way, without a robot. Both run without a limit of frames, drawn by OpenGL
(llvmpipe) and by Qt's software renderer, one after another.

The time from frame to frame is that between two `frameSwapped` of the window. The longest stall is
the longest such time; beside it is the longest processor time of the GUI thread for a frame, which
other programs and the threads of llvmpipe do not lengthen. Exits 1 when MapView shows fewer than 60
frames a second, or stalls for more than 20 ms.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

SIDE, RESOLUTION = 4000, 0.05
WIDTH, HEIGHT = 800, 600
FRAMES_PER_SECOND, STALL_MS = 60.0, 20.0
RENDERERS = {
    "opengl": {"QT_QUICK_BACKEND": "", "QSG_RHI_BACKEND": "opengl", "LIBGL_ALWAYS_SOFTWARE": "1"},
    "software": {"QT_QUICK_BACKEND": "software"},
}
MAP = """
import QtQuick 2.15
import QtQuick.Window 2.15
import RosControls 1.0
Window {
    width: 800; height: 600; visible: true
    function move(x, y, zoom) {
        map.camera.panBy(x, y)
        map.camera.zoomBy(zoom, 400, 300)
    }
    readonly property bool ready: map.scene.hasMap && !map.stale
    MapView { id: map; anchors.fill: parent; framed: false }
}
"""
IMAGE = """
import QtQuick 2.15
import QtQuick.Window 2.15
Window {
    width: 800; height: 600; visible: true
    property real zoomed: 1
    function move(x, y, zoom) {
        map.x += x
        map.y += y
        zoomed *= zoom
    }
    readonly property bool ready: map.status === Image.Ready
    Image {
        id: map
        source: "IMAGE"
        width: 600; height: 600; x: 100
        scale: zoomed
        smooth: true
    }
}
"""


def cells() -> np.ndarray:
    """Return a map of rooms, as bytes."""
    out = np.zeros((SIDE, SIDE), np.int8)
    out[::200] = out[:, ::200] = 100
    out[40::200, ::200] = out[::200, 70::200] = 0
    rng = np.random.default_rng(1)
    x, y = rng.integers(0, SIDE - 12, (2, 4000))
    for dx in range(8):
        out[y, x + dx] = out[y + dx, x] = 100
    out[:, :300] = -1
    return out


def robot(url: str) -> None:
    """Publish until the process is killed."""
    import rosglass
    from rosglass.comm import QoS

    node = rosglass.connect(url, "robot")
    grid = node.create_publisher("/map", "nav_msgs/msg/OccupancyGrid", QoS.latched())
    laser = node.create_publisher("/scan", "sensor_msgs/msg/LaserScan")
    frames = node.create_publisher("/tf", "tf2_msgs/msg/TFMessage", 100)
    data, rng, count = cells(), np.random.default_rng(2), 0
    half = SIDE * RESOLUTION / 2
    begun = time.monotonic()
    while True:
        now = {"sec": int(time.time()), "nanosec": int(time.time() % 1 * 1e9)}
        angle = count / 100
        links = [
            ("map", "base_link", 5 * math.cos(angle), 5 * math.sin(angle)),
            ("base_link", "laser", 0.2, 0.0),
        ]
        frames.publish(
            transforms=[
                {
                    "header": {"frame_id": parent, "stamp": now},
                    "child_frame_id": child,
                    "transform": {"translation": {"x": x, "y": y}, "rotation": {"w": 1.0}},
                }
                for parent, child, x, y in links
            ]
        )
        if count % 3 == 0:
            laser.publish(
                header={"frame_id": "laser", "stamp": now},
                angle_min=-math.pi,
                angle_increment=math.tau / 720,
                range_max=30.0,
                ranges=rng.uniform(2, 12, 720).astype(np.float32),
            )
        if count % 30 == 0:
            x, y = rng.integers(0, SIDE - 100, 2)
            data[y : y + 100, x : x + 100] = rng.integers(0, 100, (100, 100))
            origin = {"position": {"x": -half, "y": -half}, "orientation": {"w": 1.0}}
            info = {"resolution": RESOLUTION, "width": SIDE, "height": SIDE, "origin": origin}
            grid.publish(header={"frame_id": "map"}, info=info, data=data.ravel())
        count += 1
        time.sleep(max(0.0, begun + count / 30 - time.monotonic()))


def show(url: str, file: str, seconds: float) -> None:
    """Move what a file shows; print the times between frames."""
    from rosglass.controls import register
    from rosglass.qml import Session, install
    from rosglass.qt import QtCore, QtGui, QtQml, run_event_loop

    app = QtGui.QGuiApplication([])
    session, engine = Session(url or "local://none"), QtQml.QQmlEngine()
    install(engine, session)
    register()
    session.init("operator")
    component = QtQml.QQmlComponent(engine, QtCore.QUrl.fromLocalFile(file))
    window: Any = component.create()
    assert window is not None, component.errorString()
    times: dict[str, list[tuple[float, float]]] = {"pan": [], "zoom": []}
    state: dict[str, Any] = {"phase": "wait", "until": time.perf_counter() + 3, "count": 0}
    state.update(last=0.0, used=0.0)

    def on_frame() -> None:
        now, used = time.perf_counter(), time.thread_time()
        phase = state["phase"]
        if phase in times and state["last"]:
            times[phase].append((now - state["last"], used - state["used"]))
        state.update(last=now, used=used)
        step()

    def step() -> None:
        now = time.perf_counter()
        phase, count = state["phase"], state["count"]
        if phase == "wait":
            if now < state["until"] or not window.property("ready"):
                QtCore.QTimer.singleShot(50, step)
                return
            state.update(phase="pan", until=now + seconds, last=0.0, count=0)
            window.move(0, 0, 6.0)
        elif now > state["until"]:
            if phase == "zoom":
                QtCore.QTimer.singleShot(0, app.quit)
                return
            window.move(0, 0, 1 / 6.0)
            state.update(phase="zoom", until=now + seconds, last=0.0, count=0)
        state["count"] = count + 1
        if state["phase"] == "pan":
            angle = count / 60
            window.move(8 * math.cos(angle), 8 * math.sin(angle), 1.0)
        else:
            window.move(0, 0, 1.02 if count // 200 % 2 == 0 else 1 / 1.02)

    window.frameSwapped.connect(on_frame)
    QtCore.QTimer.singleShot(100, step)
    run_event_loop(app)
    print(json.dumps(times), flush=True)
    session.close()
    os._exit(0)


def measure(url: str, text: str, renderer: str, seconds: float) -> dict[str, Any]:
    """Return the times between frames, and the GUI thread's, while it is moved and zoomed."""
    from rosglass.demo.processes import VirtualScreen

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "Show.qml"
        if "IMAGE" in text:
            from PIL import Image

            grey = np.where(cells() < 0, 128, 255 - cells().astype(np.int16) * 2).astype(np.uint8)
            Image.fromarray(grey[::-1]).save(Path(folder) / "map.png")
        file.write_text(text.replace("IMAGE", "map.png"), encoding="utf-8")
        command = [sys.executable, __file__, "--show", str(file), "--url", url]
        env = {**os.environ, **RENDERERS[renderer], "QSG_RENDER_LOOP": "basic"}
        with VirtualScreen() as screen:
            out = subprocess.run(
                [*command, "--seconds", str(seconds)],
                env={**env, "DISPLAY": screen.display},
                check=True,
                stdout=subprocess.PIPE,
            )
    found: dict[str, Any] = json.loads(out.stdout.decode().splitlines()[-1])
    return found


def main() -> int:
    """Measure both, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--only", choices=RENDERERS)
    parser.add_argument("--show", help=argparse.SUPPRESS)
    parser.add_argument("--robot", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--url", default="", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.robot:
        robot(given.url)
    if given.show:
        show(given.url, given.show, given.seconds)
    from rosglass.wires.zenoh.router import Router

    failed = False
    with Router("tcp/127.0.0.1:0") as router:
        print(f"{'renderer':10} {'':12} frames/s  median ms   stall ms  GUI thread's longest ms")
        for renderer in [given.only] if given.only else RENDERERS:
            rates: dict[tuple[str, str], float] = {}
            for name, text in (("Image", IMAGE), ("MapView", MAP)):
                process = None
                if name == "MapView":
                    process = subprocess.Popen(
                        [sys.executable, __file__, "--robot", "--url", router.url]
                    )
                try:
                    found = measure(router.url if process else "", text, renderer, given.seconds)
                finally:
                    if process is not None:
                        process.kill()
                        process.wait()
                for phase, frames in found.items():
                    times, used = zip(*frames, strict=True)
                    rate, stall, own = len(times) / sum(times), max(times) * 1000, max(used) * 1000
                    rates[name, phase] = rate
                    middle = 1000 * float(np.median(times))
                    what = f"{name} {phase}"
                    figures = f"{rate:8.0f} {middle:10.1f} {stall:10.1f} {own:10.1f}"
                    print(f"{renderer:10} {what:12} {figures}", flush=True)
                    if name == "MapView":
                        ratio = rate / rates["Image", phase]
                        print(f"{'':10} {'':12} {ratio:8.2f} of the Image's")
                        failed |= rate < FRAMES_PER_SECOND or stall > STALL_MS
    return int(failed)


if __name__ == "__main__":
    raise SystemExit(main())
