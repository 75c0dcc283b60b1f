"""Measure what the 3D view costs, beside RViz with the same config on the same data.

    .venv/bin/python benchmarks/scene.py [--quick] [--seconds N] [--turns N] [--only NAME]

RViz 1.14 (in .venv-system) and a view of rosglass, each in a process and on a virtual screen
(Xvfb) of its own, 1280x800 with software OpenGL and hard edges, show one `.rviz` file and get the
same messages over ROS 1 (Debian's rosmaster): 200,000 points of 3 pixels, a map of 1000x1000 cells,
a mesh of 51,200 triangles, 30 boxes, 9,800 line segments, 40 texts and a grid. Our view has a panel
of QML above it.

Both take turns, and a figure is the median of the ratios of the turns. CPU is that of all threads
of a process for each frame of the 3D view; the camera turns with each frame, and both draw as fast
as they can. `adaptive` is as users have it, fewer points while the camera moves; `all` draws all.
GUI thread: what messages take there, uploads to OpenGL included. A robot's CPU is without that of
the threads in which Mesa fills in pixels, which stand for a graphics card. Exits 1 when a target is
missed.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).parent))

import rosglass
from rosglass.comm.qos import QoS
from rosglass.demo.processes import VirtualScreen, start_robot
from rviz_overlay import Verdicts, ros_master

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[1]
DASHBOARD = ROOT / "examples/rviz"
PEERS = str(Path(__file__).with_name("scene_peers.py"))
RVIZ_PYTHON = ROOT / ".venv-system/bin/python"
HEADER = {"frame_id": "map"}
TRIANGLES_AROUND = 160
#: Links of a robot.
LINKS = 60
_TF = "tf2_msgs/TFMessage"
#: Seconds in which a config and its data are shown.
_SETTLE_S = 4.0


class Peer:
    """One measured process."""

    def __init__(self, what: str, master: str, home: str) -> None:
        self.what, self._screen = what, VirtualScreen(1400, 1000)
        port = master.rpartition(":")[2]
        env = {k: v for k, v in os.environ.items() if k not in ("QT_QPA_PLATFORM", "PYTHONPATH")}
        env.pop("XDG_CACHE_HOME", None)
        env |= {"HOME": home, "XDG_RUNTIME_DIR": home, "DISPLAY": self._screen.display}
        env |= {"ROS_MASTER_URI": master, "ROS_IP": "127.0.0.1", "QT_QPA_PLATFORM": "xcb"}
        python = sys.executable
        if what == "rviz":
            python = str(RVIZ_PYTHON)
            env["ROSGLASS_QT"] = "pyside2"
        url = f"ros1://127.0.0.1:{port}?ip=127.0.0.1" if master else "local://benchmark"
        self._process = subprocess.Popen(
            [python, PEERS, what, url],
            env=env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=None if "--verbose" in sys.argv else subprocess.DEVNULL,
            text=True,
        )
        self._answer()

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith(("{", "null", "[")) or line[:1].isdigit():
                return json.loads(line)
        raise SystemExit(f"{self.what} ended with {self._process.wait()}")

    def __call__(self, do: str, **order: Any) -> Any:
        """Have it do something, and return the figures."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": do, **order}) + "\n")
        self._process.stdin.flush()
        return self._answer()

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Let it use no CPU."""
        self._process.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self._process.send_signal(signal.SIGCONT)

    def close(self) -> None:
        """End it."""
        self._process.kill()
        self._process.wait()
        self._screen.close()


def display(kind: str, topic: str, **settings: Any) -> dict[str, Any]:
    key = "Marker Topic" if kind.startswith("Marker") else "Topic"
    found = {"Class": f"rviz/{kind}", "Name": f"{kind} {topic}", "Enabled": True, key: topic}
    return found | {name.replace("_", " "): value for name, value in settings.items()}


def save_config(file: Path, *displays: dict[str, Any], distance: float = 14.0) -> str:
    view = {
        "Class": "rviz/Orbit", "Distance": distance, "Pitch": 0.6, "Yaw": 0.8,
        "Focal Point": {"X": 0, "Y": 0, "Z": 0}, "Target Frame": "<Fixed Frame>",
    }  # fmt: skip
    manager = {
        "Displays": [{"Class": "rviz/Grid", "Name": "Grid", "Enabled": True}, *displays],
        "Global Options": {"Fixed Frame": "map", "Background Color": "48; 48; 48"},
        "Tools": [{"Class": "rviz/MoveCamera"}],
        "Views": {"Current": view, "Saved": None},
    }
    file.write_text(yaml.safe_dump({"Visualization Manager": manager}), encoding="utf-8")
    return str(file)


def cloud(count: int, seed: int = 1) -> dict[str, Any]:
    """Return random coloured points in a box of 10 x 10 x 3 m."""
    random = np.random.default_rng(seed)
    rows = np.zeros(count, [("xyz", "<f4", 3), ("rgb", "<u4")])
    rows["xyz"] = random.uniform((-5, -5, 0), (5, 5, 3), (count, 3))
    rows["rgb"] = random.integers(0, 1 << 24, count)
    fields = [
        {"name": name, "offset": 4 * at, "datatype": 7, "count": 1}
        for at, name in enumerate(("x", "y", "z", "rgb"))
    ]
    return {
        "header": HEADER, "height": 1, "width": count, "fields": fields, "point_step": 16,
        "row_step": 16 * count, "data": rows.tobytes(), "is_dense": True,
    }  # fmt: skip


def save_mesh(file: Path) -> None:
    """Save a sphere of 51,200 triangles as STL."""
    n = TRIANGLES_AROUND
    turn, tilt = np.meshgrid(np.linspace(0, 2 * np.pi, n + 1), np.linspace(-1.57, 1.57, n + 1))
    at = np.stack([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)], -1)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], 2), np.stack([a, c, d], 2)]).reshape(-1, 3, 3)
    rows = np.zeros(len(faces), [("normal", "<f4", 3), ("at", "<f4", (3, 3)), ("extra", "<u2")])
    rows["normal"], rows["at"] = faces.mean(axis=1), faces
    file.write_bytes(bytes(80) + np.uint32(len(faces)).tobytes() + rows.tobytes())


def marker(number: int, kind: int, x: float, y: float, z: float, **fields: Any) -> dict[str, Any]:
    pose = {"position": {"x": x, "y": y, "z": z}, "orientation": {"w": 1.0}}
    tint = {"r": number % 7 / 7, "g": number % 5 / 5, "b": 0.7, "a": 1.0}
    size = {"x": 0.2, "y": 0.2, "z": 0.2}
    made = {"header": HEADER, "ns": "scene", "id": number, "type": kind, "pose": pose}
    return {**made, "scale": size, "color": tint, **fields}


def things(mesh: Path) -> list[dict[str, Any]]:
    """Return the markers of the scene: boxes, lines, texts and the mesh."""
    boxes = [marker(n, 1, n % 6 - 2.5, n // 6 - 2.5, 0.5) for n in range(30)]
    turn = np.linspace(0, 200, 9801)
    places = np.stack([np.cos(turn) * 5, np.sin(turn) * 5, turn / 70], axis=1).tolist()
    points = [{"x": x, "y": y, "z": z} for x, y, z in places]
    line = marker(100, 4, 0, 0, 0, points=points, scale={"x": 0.02})
    texts = [
        marker(200 + n, 9, n % 8 - 4, n // 8 - 2, 2, text=f"place {n}", scale={"z": 0.2})
        for n in range(40)
    ]
    ball = marker(300, 10, 0, 0, 1, mesh_resource=mesh.as_uri(), scale={"x": 1, "y": 1, "z": 1})
    return [*boxes, line, *texts, ball]


def save_collada(file: Path, radius: float) -> None:
    """Save a sphere of 18,432 triangles as COLLADA: a megabyte of text, as exporters write it."""
    n = 96
    turn, tilt = np.meshgrid(np.linspace(0, 2 * np.pi, n + 1), np.linspace(-1.57, 1.57, n + 1))
    unit = [np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)]
    normals = np.stack(unit, -1).reshape(-1, 3)
    first = (np.arange(n)[:, np.newaxis] * (n + 1) + np.arange(n)).reshape(-1, 1)
    faces = first + np.array([0, 1, n + 2, 0, n + 2, n + 1])
    texts = [
        " ".join(f"{number:.6f}" for number in (values * size).reshape(-1).tolist())
        for values, size in ((normals, radius), (normals, 1.0))
    ]
    sources = "".join(
        f'<source id="{name}"><float_array id="{name}-array" count="{normals.size}">{text}'
        f'</float_array><technique_common><accessor source="#{name}-array" count="{len(normals)}" '
        'stride="3"><param name="X" type="float"/><param name="Y" type="float"/>'
        '<param name="Z" type="float"/></accessor></technique_common></source>'
        for name, text in zip(("positions", "normals"), texts, strict=True)
    )
    corners = " ".join(f"{at} {at}" for at in faces.reshape(-1).tolist())
    file.write_text(
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" '
        'version="1.4.1"><asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>'
        f'<library_geometries><geometry id="ball"><mesh>{sources}<vertices id="vertices">'
        '<input semantic="POSITION" source="#positions"/></vertices>'
        f'<triangles count="{len(faces) * 2}"><input semantic="VERTEX" source="#vertices" '
        'offset="0"/><input semantic="NORMAL" source="#normals" offset="1"/>'
        f"<p>{corners}</p></triangles></mesh></geometry></library_geometries>"
        '<library_visual_scenes><visual_scene id="scene"><node id="node">'
        '<instance_geometry url="#ball"/></node></visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#scene"/></scene></COLLADA>'
    )


def parent_of(link: int) -> int:
    """Return the link that one of six limbs of ten links hangs on."""
    return max(link - 6, 0)


def describe_robot(meshes: list[Path]) -> str:
    """Return the URDF of a robot of 60 links, the first of which have meshes."""
    parts = []
    for link in range(LINKS):
        shape = (
            f'<mesh filename="{meshes[link].as_uri()}"/>'
            if link < len(meshes)
            else '<cylinder radius="0.05" length="0.2"/>'
        )
        parts.append(
            f'<link name="link{link}"><visual><geometry>{shape}</geometry><material name="m">'
            '<color rgba="0.5 0.6 0.8 1"/></material></visual></link>'
        )
        if link:
            parts.append(
                f'<joint name="joint{link}" type="continuous"><axis xyz="0 0 1"/>'
                f'<parent link="link{parent_of(link)}"/><child link="link{link}"/></joint>'
            )
    return f'<robot name="benchmark">{"".join(parts)}</robot>'


def joint_transforms(angle: float) -> dict[str, Any]:
    """Return what robot_state_publisher sends for one message of joint states, in radians."""
    now = time.time()
    stamp = {"secs": int(now), "nsecs": int(now % 1 * 1e9)}
    transforms = []
    for link in range(1, LINKS):
        limb = link * math.pi / 3
        turn, out = (angle + limb, 0.5) if link <= 6 else (angle, 0.25)
        x, y = (out * math.cos(limb), out * math.sin(limb)) if link <= 6 else (out, 0.0)
        transforms.append(
            {
                "header": {"frame_id": f"link{parent_of(link)}", "stamp": stamp},
                "child_frame_id": f"link{link}",
                "transform": {
                    "translation": {"x": x, "y": y, "z": 0.05},
                    "rotation": {"z": math.sin(turn / 2), "w": math.cos(turn / 2)},
                },
            }
        )
    return {"transforms": transforms}


class Robot:
    """Publishes the data, in this process, whose CPU is not measured."""

    def __init__(self, master: str, folder: Path) -> None:
        port = master.rpartition(":")[2]
        self.node = rosglass.connect(f"ros1://127.0.0.1:{port}?ip=127.0.0.1", "robot")
        mesh = folder / "ball.stl"
        save_mesh(mesh)
        grid = np.random.default_rng(0).integers(0, 101, (1000, 1000)).astype(np.int8).reshape(-1)
        origin = {"position": {"x": -5.0, "y": -5.0}, "orientation": {"w": 1.0}}
        info = {"resolution": 0.01, "width": 1000, "height": 1000, "origin": origin}
        self._latched = []
        base = {"header": HEADER, "child_frame_id": "link0", "transform": {"rotation": {"w": 1.0}}}
        boxes = [
            marker(n, 1, n % 100 * 0.1 - 5, n // 100 * 0.1 - 5, n % 9 * 0.1,
                   scale={"x": 0.08, "y": 0.08, "z": 0.08})
            for n in range(10_000)
        ]  # fmt: skip
        for topic, kind, message in (
            ("/cloud", "sensor_msgs/PointCloud2", cloud(200_000)),
            ("/large", "sensor_msgs/PointCloud2", cloud(1_000_000)),
            ("/map", "nav_msgs/OccupancyGrid", {"header": HEADER, "info": info, "data": grid}),
            ("/things", "visualization_msgs/MarkerArray", {"markers": things(mesh)}),
            ("/boxes", "visualization_msgs/MarkerArray", {"markers": boxes}),
            ("/tf_static", _TF, {"transforms": [base]}),
        ):
            self._latched.append(self.node.create_publisher(topic, kind, QoS.latched()))
            self._latched[-1].publish(message)

    @contextlib.contextmanager
    def sending(self, topic: str, kind: str, messages: list[Any], rate: float) -> Iterator[None]:
        """Publish messages by turns, at a rate in Hz; functions return them."""
        publisher = self.node.create_publisher(topic, kind, 2)
        ended = threading.Event()

        def send() -> None:
            number, due = 0, time.monotonic()
            while not ended.wait(max(0.0, due - time.monotonic())):
                message = messages[number % len(messages)]
                publisher.publish(message() if callable(message) else message)
                number, due = number + 1, due + 1 / rate

        thread = threading.Thread(target=send)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()
            publisher.close()

    def joints(self, *angles: float) -> contextlib.AbstractContextManager[None]:
        """Publish the transforms of 60 links 30 times a second."""
        messages = [partial(joint_transforms, angle) for angle in angles]
        return self.sending("/tf", _TF, messages, 30)

    def describe(self, meshes: list[Path]) -> None:
        """Set the robot's description."""
        server: Any = self.node.parameter_server
        server.set("robot_description", describe_robot(meshes))


class Bench:
    """Both, and what is found."""

    def __init__(self, master: str, folder: Path, args: argparse.Namespace) -> None:
        self.folder, self.args, self.verdicts = folder, args, Verdicts()
        self.robot = Robot(master, folder)
        self.rviz = Peer("rviz", master, str(folder))
        self.view = Peer("view", master, str(folder))

    def load(self, *displays: dict[str, Any], distance: float = 14.0) -> None:
        """Have both show a config and its data."""
        file = save_config(self.folder / "scene.rviz", *displays, distance=distance)
        for peer in (self.rviz, self.view):
            peer("load", config=file)
        until = time.monotonic() + 60
        while self.view("received") < len(displays) + 1 and time.monotonic() < until:
            self.view("wait", seconds=0.3)
        for peer in (self.rviz, self.view):
            peer("wait", seconds=_SETTLE_S)

    def line(self, name: str, figure: str, value: float, target: float) -> None:
        """Print a figure against its target, which it must not exceed."""
        self.verdicts.line(name, figure, value, target, False)

    def compare(self, name: str, targets: dict[str, float]) -> None:
        """Measure both while the camera moves, by turns: `all` and `adaptive`."""
        found: dict[str, list[tuple[dict[str, float], dict[str, float]]]] = {}
        for _ in range(self.args.turns):
            theirs = self.rviz("move", seconds=self.args.seconds)
            for what in targets:
                ours = self.view("move", seconds=self.args.seconds, all=what == "all")
                found.setdefault(what, []).append((ours, theirs))
        for what, pairs in found.items():
            ratio = statistics.median(one["ms"] / other["ms"] for one, other in pairs)
            ms = [statistics.median(pair[at]["ms"] for pair in pairs) for at in (0, 1)]
            fps = [statistics.median(pair[at]["fps"] for pair in pairs) for at in (0, 1)]
            figure = f"{ms[0]:.0f} of {ms[1]:.0f} ms, {fps[0]:.0f} of {fps[1]:.0f}/s"
            self.line(f"{name}: {what}", figure, ratio, targets[what])

    def close(self) -> None:
        """End everything."""
        self.rviz.close()
        self.view.close()
        self.robot.node.close()


def points(topic: str, style: str = "Points") -> dict[str, Any]:
    sizes = {"Size (Pixels)": 3, "Size (m)": 0.03}
    return display("PointCloud2", topic, Style=style, Color_Transformer="RGB8", **sizes)


def still(bench: Bench) -> None:
    """Nothing changes; QML is animated above; picks."""
    bench.load(points("/cloud"), display("Map", "/map"), display("MarkerArray", "/things"))
    ours = bench.view("wait", seconds=bench.args.seconds)
    theirs = bench.rviz("wait", seconds=bench.args.seconds)
    figure = f"{ours['frames']:.0f} frames; RViz {theirs['percent']:.0f} %"
    bench.line("still scene: percent of a core", figure, ours["percent"], 1)
    ours = bench.view("animate", seconds=bench.args.seconds)
    figure = f"{ours['fps']:.0f} frames/s, {ours['redrawn']:.0f} of the scene"
    bench.line("QML animates above it: ms a frame", figure, ours["ms"], 14)
    picks(bench.view, "200,000 points", bench.verdicts)


def picks(view: Peer, among: str, verdicts: Verdicts) -> None:
    """Pick in what is shown."""
    ours = view("pick", times=20)
    figure = f"{ours['hits']} hits of 20, longest {ours['longest']:.1f}"
    verdicts.line(f"pick among {among}: ms", figure, ours["ms"], 10, False)
    ours = view("click", times=20)
    figure = f"{ours['clicks']} clicks, the camera moves"
    verdicts.line("the same: frames until the answer", figure, ours["pictures"], 2, False)


def moving(bench: Bench) -> None:
    """The camera moves over the whole scene."""
    bench.load(points("/cloud"), display("Map", "/map"), display("MarkerArray", "/things"))
    bench.compare("200,000 points, camera moves", {"all": 0.7, "adaptive": 0.45})


def squares(bench: Bench) -> None:
    """The same with RViz's default style."""
    bench.load(points("/cloud", "Flat Squares"), display("Map", "/map"))
    bench.compare("200,000 flat squares, camera moves", {"all": 0.75})


def million(bench: Bench) -> None:
    """A million points."""
    bench.load(points("/large"))
    bench.compare("1,000,000 points, camera moves", {"all": 0.55, "adaptive": 0.2})


def clouds(bench: Bench) -> None:
    """A new cloud of 200,000 points ten times a second."""
    bench.load()
    save = save_config(bench.folder / "clouds.rviz", points("/clouds"))
    for peer in (bench.rviz, bench.view):
        peer("load", config=save)
    messages = [cloud(200_000, seed) for seed in range(3)]
    with bench.robot.sending("/clouds", "sensor_msgs/PointCloud2", messages, 10):
        for peer in (bench.rviz, bench.view):
            peer("wait", seconds=2)
        theirs = bench.rviz("wait", seconds=bench.args.seconds)
        ours = bench.view("wait", seconds=bench.args.seconds)
    count = f"{ours['messages']:.0f} clouds"
    bench.line("cloud of 200,000 at 10 Hz: ms of the GUI thread", count, ours["gui_ms"], 1)
    bench.line("the same: ms in all", "decoding and order", ours["gui_ms"] + ours["node_ms"], 8)
    ratio = ours["ms"] / theirs["ms"]
    figure = f"{ours['ms']:.0f} of {theirs['ms']:.0f} ms"
    bench.line("the same: CPU for each frame", figure, ratio, 1)


def boxes(bench: Bench) -> None:
    """Ten thousand boxes; a thousand markers that are updated."""
    bench.load(display("MarkerArray", "/boxes"))
    bench.compare("10,000 boxes, camera moves", {"all": 1.0})
    bench.load()
    file = save_config(bench.folder / "updates.rviz", display("MarkerArray", "/updates"))
    messages = [
        {"markers": [marker(n, 1, n % 40 * 0.2 - 4, n // 40 * 0.2, turn) for n in range(1000)]}
        for turn in (0.0, 0.2, 0.4)
    ]
    for peer in (bench.rviz, bench.view):
        peer("load", config=file)
    with bench.robot.sending("/updates", "visualization_msgs/MarkerArray", messages, 5):
        for peer in (bench.rviz, bench.view):
            peer("wait", seconds=2)
        theirs = bench.rviz("wait", seconds=bench.args.seconds)
        ours = bench.view("wait", seconds=bench.args.seconds)
    figure = f"{ours['messages']:.0f} messages, {ours['node_ms']:.0f} ms in the node"
    bench.line("1,000 markers updated: ms of the GUI thread", figure, ours["gui_ms"], 10)
    figure = f"{ours['percent']:.0f} of {theirs['percent']:.0f} %"
    bench.line("the same: CPU at 5 Hz", figure, ours["percent"] / theirs["percent"], 1)


ROBOT = {"Class": "rviz/RobotModel", "Name": "Robot", "Enabled": True, "Value": True}
FRAMES = {"Class": "rviz/TF", "Name": "TF", "Enabled": True, "Value": True}


def robot(bench: Bench) -> None:
    """A robot of 60 links that moves, and that stands still beside its frames."""
    bench.robot.describe([])
    with bench.robot.joints(*np.linspace(-0.5, 0.5, 30).tolist()):
        bench.load(ROBOT, distance=6)
        ours = bench.view("wait", seconds=bench.args.seconds)
        theirs = bench.rviz("wait", seconds=bench.args.seconds)
    # Without what stands for a graphics card.
    used = ours["percent"] - ours["filling_percent"]
    figure = f"{ours['fps']:.0f}/s; {ours['percent']:.0f} with pixels, RViz {theirs['percent']:.0f}"
    bench.line("60 links at 30 Hz: percent of a core", figure, used, 15)
    with bench.robot.joints(0.3):
        bench.load(ROBOT, FRAMES, distance=6)
        ours = bench.view("wait", seconds=bench.args.seconds)
        theirs = bench.rviz("wait", seconds=bench.args.seconds)
    figure = f"{ours['frames']:.0f} frames; RViz {theirs['percent']:.0f} %"
    bench.line("the same, which do not move, and TF", figure, ours["percent"], 5)


def meshes(args: argparse.Namespace, home: str, verdicts: Verdicts) -> None:
    """A robot with 20 MB of meshes, in processes that start anew."""
    folder = Path(home)
    files = [folder / f"link{number}.dae" for number in range(20)]
    for number, file in enumerate(files):
        save_collada(file, 0.1 + 0.002 * number)
    megabytes = sum(file.stat().st_size for file in files) / 1e6
    bare = save_config(folder / "bare.rviz")
    config = save_config(folder / "robot.rviz", ROBOT, distance=6)
    found: dict[str, list[dict[str, float]]] = {"view": [], "rviz": []}
    with ros_master(home) as master:
        robot = Robot(master, folder)
        robot.describe(files)
        with robot.joints(0.3):
            for number in range(args.turns + 1):
                for what, figures in found.items():
                    peer = Peer(what, master, home)
                    peer("load", config=bare)
                    peer("wait", seconds=2)
                    figures.append(peer("open_robot", config=config))
                    if what == "view" and number == args.turns:
                        picks(peer, f"{megabytes:.0f} MB of meshes", verdicts)
                    peer.close()
        robot.node.close()
    (first, *again), (_, *theirs) = found.values()

    def median(name: str, figures: list[dict[str, float]]) -> float:
        return statistics.median(one[name] for one in figures)

    for name, title, target in (
        ("seconds", f"robot of {megabytes:.0f} MB, second start: s", 0.3),
        ("blocked", "the same: longest block of the GUI thread, s", 0.1),
    ):
        cpu = {"seconds": "cpu", "blocked": "blocked_cpu"}[name]
        figure = f"CPU {median(cpu, again):.2f}, first {first[name]:.2f}, RViz "
        figure += f"{median(name, theirs):.2f}"
        verdicts.line(title, figure, median(name, again), target, False)


def dashboard(args: argparse.Namespace, home: str, verdicts: Verdicts) -> None:
    """Figure 1's dashboard over both, on the live robot of benchmarks/rviz_dashboard.py."""
    found: dict[str, list[dict[str, float]]] = {"view": [], "rviz": []}
    with ros_master(home) as master:
        url = master.replace("http:", "ros1:")
        live = start_robot(url, ("--equipped", "--fps", "30", "--mode", "autonomous"))
        peers = {what: Peer(what, master, home) for what in ("view", "rviz")}
        view, rviz = peers.values()
        try:
            for peer in peers.values():
                peer("load", config=str(DASHBOARD / "figure1.rviz"))
                peer("overlay", file=str(DASHBOARD / "Dashboard.qml"))
            for number in range(args.turns + 1):
                turn = {}
                with rviz.paused():
                    view("wait", seconds=_SETTLE_S)
                    turn["view"] = view("wait", seconds=args.seconds)
                with view.paused():
                    rviz("wait", seconds=_SETTLE_S)
                    turn["rviz"] = rviz("wait", seconds=args.seconds)
                # The first turn warms up.
                for what, figures in turn.items():
                    found[what] += [figures] * (number > 0)
        finally:
            for peer in peers.values():
                peer.close()
            live.close()

    def median(name: str, what: str = "view") -> float:
        return statistics.median(one[name] for one in found[what])

    rates = median("window_fps"), median("fps"), median("fps", "rviz")
    pairs = zip(found["view"], found["rviz"], strict=True)
    ratio = statistics.median(ours["window_fps"] / theirs["fps"] for ours, theirs in pairs)
    figure = f"{rates[0]:.1f} (3D {rates[1]:.1f}) of {rates[2]:.1f}/s"
    verdicts.line("Figure 1: frames per second, to RViz's", figure, ratio, 2, True)
    figure = f"frame {median('both_ms'):.0f} ms, without 3D {median('plain_ms'):.0f}"
    verdicts.line("the same: percent of the time for QML", figure, median("qml_percent"), 50, True)


def first(args: argparse.Namespace, home: str) -> tuple[str, float]:
    """Return times from start to first frame, as text, and their ratio."""
    took: dict[str, list[float]] = {"program": [], "bare": []}
    for number in range(args.turns + 1):
        for what, times in took.items():
            # Xvfb ends with its last window.
            with contextlib.closing(VirtualScreen(1400, 1000)) as screen:
                env = {**os.environ, "HOME": home, "DISPLAY": screen.display}
                env |= {"QT_QPA_PLATFORM": "xcb"}
                # An installed program has its modules compiled; the first round does that.
                env.pop("PYTHONDONTWRITEBYTECODE", None)
                started = time.perf_counter()
                with subprocess.Popen(
                    [sys.executable, PEERS, what, "-"],
                    env=env,
                    stdout=subprocess.PIPE,
                    stderr=None if args.verbose else subprocess.DEVNULL,
                    text=True,
                ) as process:
                    assert process.stdout is not None
                    if not any("FIRST FRAME" in line for line in process.stdout):
                        raise SystemExit(f"{what} showed nothing")
                    if number:
                        times.append(time.perf_counter() - started)
    ours, bare = (statistics.median(times) for times in took.values())
    pairs = zip(took["program"], took["bare"], strict=True)
    return f"{ours:.2f} of {bare:.2f} s", statistics.median(a / b for a, b in pairs)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=5, help="of each figure (5)")
    parser.add_argument("--turns", type=int, default=5, help="of each comparison (5)")
    parser.add_argument("--quick", action="store_true", help="2 turns of 3 s, 20 of 100 cycles")
    parser.add_argument("--only", default="", help="a part: still, moving, clouds, first ...")
    parser.add_argument("--verbose", action="store_true", help="show what the processes print")
    args = parser.parse_args()
    if args.quick:
        args.seconds, args.turns = 3, 2
    measured = (still, moving, squares, million, clouds, boxes, robot)
    parts = {one.__name__: one for one in measured}
    print(f"load {os.getloadavg()[0]:.1f} before the start; ratio of RViz's where it has one")
    verdicts = Verdicts()
    chosen = [one for name, one in parts.items() if args.only in ("", name)]
    with tempfile.TemporaryDirectory() as home:
        if chosen:
            with ros_master(home) as master:
                bench = Bench(master, Path(home), args)
                bench.verdicts = verdicts
                try:
                    for measure in chosen:
                        measure(bench)
                finally:
                    bench.close()
        for part in (meshes, dashboard):
            if args.only in ("", part.__name__):
                part(args, home, verdicts)
        if args.only in ("", "first"):
            figure, ratio = first(args, home)
            verdicts.line("first frame of rosglass view, to a bare item", figure, ratio, 1.5, False)
        if args.only in ("", "cycles"):
            peer = Peer("cycles", "", home)
            peer("repeat", times=10)
            count = 20 if args.quick else 100
            found = peer("repeat", times=count)
            peer.close()
            figure = f"{found['memory']:.0f} MiB, {found['ms']:.0f} ms each"
            grown = found["grown"] * 100 / count
            verdicts.line("MiB after 100 times made and destroyed", figure, grown, 5, False)
    print(f"load {os.getloadavg()[0]:.1f} at the end")
    return int(verdicts.missed > 0)


if __name__ == "__main__":
    sys.exit(main())
