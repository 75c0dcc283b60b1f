"""Measure the frames of the 3D view on this machine's graphics card, without ROS and without RViz.

    .venv/bin/python benchmarks/scene_frames.py [--seconds N] [--points N ...] [--style NAME ...]

A view of 1280x800 shows clouds of random points while the camera turns with each frame, as fast as
it can, and then a new cloud ten times a second. Where software draws, fewer points are drawn while
the camera moves, as users have it. Printed are milliseconds from frame to frame, milliseconds of
the graphics card, by its own clock, and CPU of all threads for each frame. A virtual screen (Xvfb)
is used where DISPLAY is not set. NVIDIA's OpenGL waits by using CPU unless __GL_YIELD=USLEEP.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

os.environ |= {
    "QSG_RENDER_LOOP": "basic",
    # As fast as it can, with the clock of the graphics card.
    "QSG_NO_VSYNC": "1",
    "QT_QPA_UPDATE_IDLE_TIME": "0",
    "QSG_RHI_PROFILE": "1",
}
sys.path.insert(0, str(Path(__file__).parent))

import rosglass
import scene
import scene_peers
from rosglass.comm.qos import QoS
from rosglass.demo.processes import VirtualScreen

URL = "local://frames"
TYPE = "sensor_msgs/PointCloud2"
#: New clouds per second.
RATE_HZ = 10.0
_ARRIVAL_TIMEOUT_S = 60.0


def watch_gpu() -> list[float]:
    """Return the seconds that the graphics card takes for each frame, from now on."""
    from rosglass.scene.render.renderer import SceneRenderer

    seconds: list[float] = []
    draw = SceneRenderer.render

    def timed(renderer: SceneRenderer, commands: Any) -> None:
        seconds.append(commands.lastCompletedGpuTime())
        draw(renderer, commands)

    SceneRenderer.render = timed  # type: ignore[method-assign]
    return seconds


def show(name: str, found: dict[str, float], gpu: list[float]) -> None:
    """Print the figures of one measurement."""
    known = [one for one in gpu if one > 0]
    card = f"{1000 * statistics.median(known):6.2f}" if known else "     -"
    frame = 1000 / found["fps"] if found["fps"] else float("inf")
    print(f"{name:42} {frame:8.2f} {card} {found['ms']:8.2f}", flush=True)
    gpu.clear()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--points", type=int, nargs="+", default=[200_000, 1_000_000, 5_000_000])
    styles = ["Points", "Flat Squares", "Squares", "Spheres", "Boxes"]
    parser.add_argument("--style", choices=styles, nargs="+", default=styles)
    args = parser.parse_args()
    screen = None if "DISPLAY" in os.environ else VirtualScreen(1400, 1000)
    if screen is not None:
        os.environ |= {"DISPLAY": screen.display, "QT_QPA_PLATFORM": "xcb"}
    folder = Path(tempfile.mkdtemp())
    os.environ["HOME"] = str(folder)
    robot = rosglass.connect(URL, "robot")
    view, gpu = scene_peers.View(URL), watch_gpu()

    def load(topic: str, style: str, count: int) -> None:
        view.load(scene.save_config(folder / "frames.rviz", scene.points(topic, style)))
        until = time.monotonic() + _ARRIVAL_TIMEOUT_S
        while view.points() < count and time.monotonic() < until:
            view.wait(0.1)
        view.move(0.3, all=False)
        gpu.clear()

    view.wait(1.0)
    print(f"drawn by {view.device()}")
    print(f"{'milliseconds':42} {'frame':>8} {'card':>6} {'CPU':>8}")
    gpu.clear()
    show("nothing, the camera moves", view.move(args.seconds, all=False), gpu)
    for count in args.points:
        publisher = robot.create_publisher("/cloud", TYPE, QoS.latched())
        publisher.publish(scene.cloud(count))
        for style in args.style:
            load("/cloud", style, count)
            name = f"{count:,} {style}, the camera moves"
            show(name, view.move(args.seconds, all=False), gpu)
        publisher.close()
    count = args.points[0]
    publisher, ended = robot.create_publisher("/new", TYPE, 2), threading.Event()
    clouds = [scene.cloud(count, seed) for seed in (1, 2)]

    def send() -> None:
        number = 0
        while not ended.wait(1 / RATE_HZ):
            publisher.publish(clouds[number % 2])
            number += 1

    thread = threading.Thread(target=send)
    thread.start()
    try:
        for style in args.style[:2]:
            load("/new", style, count)
            name = f"{count:,} {style}, new {RATE_HZ:g} times a second"
            show(name, view.wait(args.seconds), gpu)
    finally:
        ended.set()
        thread.join()
    if screen is not None:
        screen.close()
    os._exit(0)


if __name__ == "__main__":
    main()
