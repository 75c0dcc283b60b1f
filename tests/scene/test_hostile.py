"""Data of broken robots or attackers for displays: fields of messages that lie, one by one."""

from __future__ import annotations

import logging
import math
import os
import random
import sys
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from inside import image_of, queue_of
from waiting import eventually

from rosglass.qt import QtCore, is_alive

if TYPE_CHECKING:
    from collections.abc import Iterator

    from conftest import SceneBench

#: Numbers that overflow in numpy are refused before, with the field's name.
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

# -- messages that are right -----------------------------------------------------------------------

HEADER = {"frame_id": "odom", "stamp": {"sec": 0, "nanosec": 0}}
POINT = {"x": 1.0, "y": 2.0, "z": 0.5}
TURN = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
POSE = {"position": POINT, "orientation": TURN}
COLOR = {"r": 1.0, "g": 0.5, "b": 0.0, "a": 1.0}
COVARIANCE = [0.1 if at % 7 == 0 else 0.0 for at in range(36)]
CLOUD = {
    "width": 10,
    "height": 1,
    "point_step": 16,
    "row_step": 160,
    "fields": [
        {"name": name, "offset": 4 * at, "datatype": 7, "count": 1}
        for at, name in enumerate(("x", "y", "z", "intensity"))
    ],
    "data": np.arange(40, dtype=np.float32).tobytes(),
}
DEPTH = {
    "height": 4,
    "width": 4,
    "encoding": "32FC1",
    "step": 16,
    "data": np.ones(16, np.float32).tobytes(),
}
GRID = {"info": {"resolution": 0.1, "width": 3, "height": 2, "origin": POSE}, "data": [0] * 6}
SCAN = {
    "angle_min": -1.0,
    "angle_increment": 0.5,
    "time_increment": 0.0,
    "range_min": 0.1,
    "range_max": 10.0,
    "ranges": [1.0] * 5,
    "intensities": [1.0] * 5,
}
CAMERA = {
    "header": HEADER,
    "width": 4,
    "height": 4,
    "p": [10.0, 0.0, 2.0, 0.0, 0.0, 10.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    "binning_x": 1,
    "binning_y": 1,
    "roi": {"x_offset": 0, "y_offset": 0},
}


def marker(kind: int, **fields: Any) -> dict[str, Any]:
    count = 6 if kind in (4, 5, 6, 7, 8, 11, 12) else 2 if kind == 0 else 0
    made = {
        "header": HEADER,
        "ns": "shapes",
        "id": 1,
        "type": kind,
        "action": 0,
        "pose": POSE,
        "scale": {"x": 1.0, "y": 1.0, "z": 1.0},
        "color": COLOR,
        "lifetime": {"sec": 0, "nanosec": 0},
        "frame_locked": False,
        "points": [{"x": float(at), "y": 0.0, "z": 0.0} for at in range(count)],
        "colors": [COLOR] * (0 if kind in (0, 12) else count),
        "text": "robot",
    }
    return {**made, **fields}


def control(mode: int, **fields: Any) -> dict[str, Any]:
    made = {"name": "turn", "orientation": TURN, "interaction_mode": mode, "always_visible": True}
    return {**made, **fields}


INTERACTIVE = {
    "header": HEADER,
    "name": "handle",
    "description": "Drag me",
    "scale": 1.0,
    "pose": POSE,
    "menu_entries": [{"id": 1, "parent_id": 0, "title": "Go", "command": "", "command_type": 0}],
    "controls": [control(3, orientation_mode=0), control(7, markers=[marker(1)])],
}


class Case(NamedTuple):
    """A display, and a message that it shows.

    Attributes:
        display: Its type.
        type: The message's.
        message: Its fields, beside the header.
        settings: Of the display.
    """

    display: str
    type: str
    message: dict[str, Any]
    settings: dict[str, Any] = {}  # noqa: RUF012 - never written


STAMPED_POSES = [{"header": HEADER, "pose": POSE}] * 3
WITH_COVARIANCE = {"pose": {"pose": POSE, "covariance": COVARIANCE}}
CASES = [
    Case("Pose", "geometry_msgs/PoseStamped", {"pose": POSE}),
    Case("PoseArray", "geometry_msgs/PoseArray", {"poses": [POSE, POSE]}),
    Case("PoseWithCovariance", "geometry_msgs/PoseWithCovarianceStamped", WITH_COVARIANCE),
    Case("Odometry", "nav_msgs/Odometry", WITH_COVARIANCE),
    Case("Path", "nav_msgs/Path", {"poses": STAMPED_POSES}, {"poseStyle": "Axes"}),
    Case("Map", "nav_msgs/OccupancyGrid", GRID),
    Case("GridCells", "nav_msgs/GridCells", {"cell_width": 0.1, "cell_height": 0.1,
         "cells": [POINT, POINT]}),
    Case("PointStamped", "geometry_msgs/PointStamped", {"point": POINT}),
    Case("Polygon", "geometry_msgs/PolygonStamped", {"polygon": {"points": [POINT] * 3}}),
    Case("Range", "sensor_msgs/Range", {"field_of_view": 0.5, "min_range": 0.1, "max_range": 5.0,
         "range": 2.0}),
    Case("WrenchStamped", "geometry_msgs/WrenchStamped", {"wrench": {"force": POINT,
         "torque": POINT}}),
    Case("TwistStamped", "geometry_msgs/TwistStamped", {"twist": {"linear": POINT,
         "angular": POINT}}),
    Case("AccelStamped", "geometry_msgs/AccelStamped", {"accel": {"linear": POINT,
         "angular": POINT}}),
    Case("PointCloud2", "sensor_msgs/PointCloud2", CLOUD),
    Case("PointCloud", "sensor_msgs/PointCloud", {"points": [POINT, POINT],
         "channels": [{"name": "intensity", "values": [1.0, 2.0]}]}),
    Case("LaserScan", "sensor_msgs/LaserScan", SCAN),
    Case("Temperature", "sensor_msgs/Temperature", {"temperature": 20.0}),
    Case("DepthCloud", "sensor_msgs/Image", DEPTH),
    Case("Effort", "sensor_msgs/JointState", {"name": ["arm", "tool"], "effort": [1.0, 2.0]}),
    *(Case("Marker", "visualization_msgs/Marker", marker(kind)) for kind in range(10)),
    *(Case("Marker", "visualization_msgs/Marker", marker(kind)) for kind in (11, 12)),
    Case("InteractiveMarkers", "visualization_msgs/InteractiveMarkerUpdate", {"type": 1,
         "seq_num": 1, "markers": [INTERACTIVE],
         "poses": [{"header": HEADER, "pose": POSE, "name": "handle"}], "erases": []}),
]  # fmt: skip

# -- and what is wrong with them -------------------------------------------------------------------

FLOATS = [math.nan, math.inf, -1.0, 0.0, 1e308, 3e38, 1e-160, 1e-45]
INTEGERS = [0, -1, 7, 255, 65536, -(2**31), 2**31 - 1, 2**32 - 1]
TEXTS = ["", "/", "long" * 100_000, "ü\u202e\n\0<b>", "nowhere"]
VECTORS = [math.nan, 1e308, 3e38, 1e-160, 0.0]


def mutations(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Iterate over the paths of fields, and over values of the same type that are wrong there."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from mutations(inner, (*path, key))
        if len(value) > 2 and all(isinstance(part, float) for part in value.values()):
            yield from ((path, dict.fromkeys(value, number)) for number in VECTORS)
    elif isinstance(value, float) and path[-1] not in ("y", "z", "g", "b"):
        yield from ((path, number) for number in FLOATS)
    elif isinstance(value, int) and not isinstance(value, bool):
        yield from ((path, number) for number in INTEGERS)
    elif isinstance(value, str):
        yield from ((path, text) for text in TEXTS)
    elif isinstance(value, bytes):
        yield from ((path, data) for data in (b"", value[:-1], value * 2, b"\xff" * len(value)))
    elif isinstance(value, list):
        yield from ((path, some) for some in ([], value[:-1], value * 200))
        if value:
            yield from mutations(value[0], (*path, 0))
        if value and isinstance(value[0], float):
            yield from ((path, [number] * len(value)) for number in (math.nan, 1e308, -1.0))


def changed(value: Any, path: tuple[Any, ...], new: Any) -> Any:
    """Return a message in which a field has another value."""
    if not path:
        return new
    copy = list(value) if isinstance(value, list) else dict(value)
    copy[path[0]] = changed(value[path[0]], path[1:], new)
    return copy


#: Messages of each type with random fields; HOSTILE_MESSAGES=1000 for a search by hand.
RANDOM_COUNT = int(os.environ.get("HOSTILE_MESSAGES", "25"))
SEED = os.environ.get("HOSTILE_SEED", "1")
ANY_FLOATS = [*FLOATS, -math.inf, -0.0, 1.0, -1e18, 1e18, 1e19, 1e-30, 1e30, 5e-324]
WIDTHS = (7, 8, 15, 16, 31, 32, 63)


def randomised(value: Any, rng: random.Random, share: float) -> Any:
    """Return a value of the same type, of which a share is random."""
    if isinstance(value, dict):
        return {key: randomised(inner, rng, share) for key, inner in value.items()}
    is_kept = rng.random() >= share
    if isinstance(value, list):
        if not is_kept:
            count = rng.choice([0, 1, 2, 3, 5, len(value) - 1, len(value) + 1, 3 * len(value)])
            value = [rng.choice(value) for _ in range(max(count, 0))] if value else []
        return [randomised(inner, rng, share) for inner in value]
    if is_kept or isinstance(value, bool):
        return value if is_kept else not value
    if isinstance(value, float):
        wide = rng.choice([-1, 1]) * 10 ** rng.uniform(-320, 308)
        return rng.choice([*ANY_FLOATS, rng.uniform(-10, 10), wide])
    if isinstance(value, int):
        wide = (1 << rng.choice(WIDTHS)) - rng.choice([0, 1])
        return rng.choice([0, 1, 2, 3, 4, 5, 12, -1, wide, -wide, value + 1])
    if isinstance(value, str):
        return rng.choice([*TEXTS, "map", "odom", "x", "rgb", value * 2])
    data = bytes(value)
    return rng.choice([b"", data[:-1], data * 2, rng.randbytes(len(data)), b"\xff" * len(data)])


class Watch(logging.Handler):
    """Keeps what must not happen: tracebacks, exceptions in Qt's loop, warnings of Qt."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.seen: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.seen.append(self.format(record))


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> Iterator[Watch]:
    made = Watch()
    logger = logging.getLogger("rosglass")
    logger.addHandler(made)
    monkeypatch.setattr(sys, "excepthook", lambda *error: made.seen.append(repr(error)))

    def on_qt_message(_kind: Any, _about: Any, text: str) -> None:
        if "pipewire" not in text:  # which QtMultimedia looks for
            made.seen.append(text)

    before = QtCore.qInstallMessageHandler(on_qt_message)
    yield made
    QtCore.qInstallMessageHandler(before)
    logger.removeHandler(made)
    assert not made.seen, "\n".join(made.seen)


ROBOT = """<robot name="r"><link name="odom"/><link name="body"/>
<joint name="arm" type="revolute"><parent link="body"/><child link="odom"/>
<limit effort="5" velocity="1"/></joint></robot>"""


class Robot:
    """A robot whose messages are wrong, beside a display whose messages are right."""

    def __init__(self, bench: SceneBench, watch: Watch, body: str = "") -> None:
        self.bench, self._watch, self.node = bench, watch, bench.robot
        #: The number of the last update of interactive markers.
        self._number = 0
        self.view = bench.load(body)
        bench.place("odom", at=(1, 0, 0))
        self.good = self.view.scene.add("Pose", topic="/good")
        self._good = self.node.create_publisher("/good", "geometry_msgs/PoseStamped")
        bench.wait(lambda: self._good.subscription_count() and self.view.scene.frames())

    def show(self, case: Case) -> None:
        """Show a case, prepared as far as it needs other messages."""
        node, kind = self.node, case.display
        self.topic = "/hostile/update" if kind == "InteractiveMarkers" else "/hostile/topic"
        if kind == "InteractiveMarkers":
            node.create_service_server(
                "/hostile/get_interactive_markers",
                "visualization_msgs/GetInteractiveMarkers",
                lambda _: {
                    "sequence_number": self._number,
                    "markers": [INTERACTIVE] if self._number else [],
                },
            )
        elif kind == "Effort":
            self.bench.latch("/robot_description", "std_msgs/String", {"data": ROBOT})
        elif kind == "DepthCloud":
            self.bench.latch("/hostile/camera_info", "sensor_msgs/CameraInfo", CAMERA)
        self.display = self.view.scene.add(kind, topic=self.topic, **case.settings)
        self.publisher = node.create_publisher(self.topic, case.type)
        self.message = {**case.message, "header": HEADER}
        if kind == "InteractiveMarkers":
            del self.message["header"]
        self.bench.wait(self.publisher.subscription_count)
        if kind == "DepthCloud":
            self.bench.wait(lambda: self.display.received)  # the calibration
        self.send(self.message)
        self.bench.wait(lambda: self.display.statusLevel == "ok", lambda: self.display.statusText)

    def send(self, message: dict[str, Any]) -> bool:
        """Send a message, and wait until it is received; return False if it cannot be built."""
        from rosglass import Error

        display = self.display
        before = display.received
        if display.TYPE == "InteractiveMarkers":
            # A number that does not follow the last one makes the display request all markers.
            servers = display._servers
            self.bench.wait(lambda: not servers or servers[""].number is not None)
            self._number = servers[""].number + 1 if servers else 1
            message = {**message, "seq_num": self._number}
        try:
            self.publisher.publish(self._translated(message))
        except Error:
            return False  # no such message exists, e.g. with a negative width
        self.bench.wait(lambda: display.received > before)
        return True

    def _translated(self, value: Any) -> Any:
        """Return a message with the names that ROS 1 has for the fields of a time."""
        if self.node.wire != "ros1":
            return value
        if isinstance(value, dict):
            names = {"sec": "secs", "nanosec": "nsecs"}
            return {names.get(k, k): self._translated(inner) for k, inner in value.items()}
        if isinstance(value, list):
            return [self._translated(inner) for inner in value]
        return value

    def check(self) -> None:
        """Check that nothing is broken, and that the other display still shows what it receives."""
        before, drawn = self.good.received, self.bench.drawn()
        good = {"header": HEADER, "pose": changed(POSE, ("position", "x"), float(drawn))}
        self._good.publish(self._translated(good))
        self.bench.wait(lambda: self.good.received > before and self.bench.drawn() > drawn)
        assert self.good.statusLevel == "ok", self.good.statusText
        assert not self.view.problem
        assert not self._watch.seen, "\n".join(self._watch.seen)


@pytest.fixture
def robot(bench: SceneBench, watch: Watch) -> Robot:
    return Robot(bench, watch)


#: Fields in which infinite numbers have a meaning, or change nothing.
MAY_BE_ANYTHING = {
    *("range", "range_min", "range_max", "ranges", "intensities", "temperature", "values"),
}
#: Angles, of which any finite number is one, limits, and colours that are cut off at 1.
MAY_BE_LARGE = {
    "colors",
    *("angle_min", "angle_increment", "field_of_view", "min_range", "max_range", "time_increment"),
}


def is_not_drawn(value: Any) -> bool:
    return isinstance(value, float) and not abs(value) <= 1e18


@pytest.mark.parametrize(
    "case", CASES, ids=lambda case: f"{case.display}{case.message.get('type', '')}"
)
def test_every_field_may_be_wrong(robot: Robot, watch: Watch, case: Case) -> None:
    robot.show(case)
    display = robot.display
    for path, value in mutations(robot.message):
        where = f"{'.'.join(map(str, path))} = {value!r:.60}"
        sent = robot.send(changed(robot.message, path, value))
        assert not watch.seen, f"{where}: {watch.seen}"
        assert len(display.statusText) < 5000, where
        numbers = value.values() if isinstance(value, dict) else [value]
        if not sent or MAY_BE_ANYTHING & set(path) or not any(map(is_not_drawn, numbers)):
            continue
        if MAY_BE_LARGE & set(path) and all(map(math.isfinite, numbers)):
            continue
        names = [str(part) for part in path] + ["finite"]
        robot.bench.wait(
            lambda names=names: any(name in display.statusText for name in names),
            lambda where=where: (where, display.statusText),
            timeout=5.0,
        )
    robot.send(robot.message)
    robot.bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)
    robot.check()


@pytest.mark.parametrize(
    "case", CASES, ids=lambda case: f"{case.display}{case.message.get('type', '')}"
)
def test_all_fields_may_be_random(robot: Robot, watch: Watch, case: Case) -> None:
    robot.show(case)
    display, rng = robot.display, random.Random(f"{SEED} {case.display}")
    for number in range(RANDOM_COUNT):
        message = randomised(robot.message, rng, rng.choice([0.02, 0.1, 0.3]))
        robot.send(message)
        if number % 5 == 0:
            robot.bench.picture()
        assert not watch.seen, f"{message!r:.3000}: {watch.seen}"
        assert not robot.view.problem, f"{message!r:.3000}: {robot.view.problem}"
        assert len(display.statusText) < 30_000, f"{message!r:.3000}: {display.statusText}"
    # What is random may be far away, in a namespace of its own, or ahead of time.
    display.reset()
    robot.send(robot.message)
    robot.bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText, timeout=10.0)
    robot.check()


def with_info(**fields: Any) -> dict[str, Any]:
    return {"info": {**GRID["info"], **fields}}


def with_field(**fields: Any) -> dict[str, Any]:
    return {"fields": [{"name": "x", "offset": 0, "datatype": 7, "count": 1, **fields}]}


def second_handle(**fields: Any) -> dict[str, Any]:
    return {"markers": [{**INTERACTIVE, "name": "bad", **fields}], "poses": []}


#: A second marker or handle, for displays that show several.
SECOND = {"Marker": {"id": 2}, "InteractiveMarkers": second_handle()}
NAN, INF = math.nan, math.inf
#: Displays, the fields of a wrong message, and what the status says.
WRONG: list[tuple[str, dict[str, Any], str]] = [
    ("Pose", {"pose": {"orientation": {"w": 3.0}}}, "quaternion (0.0, 0.0, 0.0, 3.0) is not norm"),
    ("Pose", {"pose": {"orientation": {"w": NAN}}}, "is not finite"),
    ("Map", with_info(width=30), "data: 6 cells; expected 30 x 2 = 60"),
    ("Map", with_info(width=0), "width 0, height 2: expected 1 to 16384 cells"),
    ("Map", with_info(width=4_000_000_000), "width 4000000000"),
    ("Map", with_info(resolution=NAN), "info.resolution: expected metres above 0"),
    ("Map", with_info(origin={"position": {"x": INF}}), "is not finite"),
    ("GridCells", {"cell_width": 0.0}, "cell_width 0.0, cell_height 0.1"),
    ("PointCloud2", {"width": 30}, "row_step"),
    ("PointCloud2", {"width": 4_000_000_000, "row_step": 4_000_000_000}, "row_step"),
    ("PointCloud2", {"data": b""}, "data"),
    ("PointCloud2", {"point_step": 0, "row_step": 0}, "point_step is 0"),
    ("PointCloud2", {"fields": []}, "no field 'x'"),
    ("PointCloud2", with_field(offset=13), "ends at byte 17"),
    ("PointCloud2", with_field(datatype=99), "'x' has datatype"),
    ("DepthCloud", {"encoding": "rgb8"}, "32FC1, compressedDepth, got 'rgb8'"),
    ("DepthCloud", {"data": b"12"}, "needs 64 bytes, data has 2"),
    ("DepthCloud", {"width": 3_000_000}, "3000000x4 pixels, the camera info 4x4"),
    ("Effort", {"name": ["arm"], "effort": []}, "1 entries, effort 0; the publisher measures none"),
    ("Effort", {"name": ["arm"], "effort": [1.0, 2.0]}, "name has 1 entries, effort 2"),
    ("Effort", {"name": ["j"] * 10_001, "effort": np.zeros(10_001)},
     "name: 10001 joints are more than the 10000 that are read"),
    ("Marker", {"type": 99}, "type 99: expected 0 to 12"),
    ("Marker", {"action": 7}, "action 7: expected"),
    ("Marker", {"pose": {"position": {"x": NAN}}}, "is not finite"),
    ("Marker", {"type": 5, "points": [POINT]}, "points: 1 are not pairs"),
    ("Marker", {"type": 11, "points": [POINT]}, "are not triples"),
    ("Marker", {"type": 0, "points": [POINT]}, "has none, or start and end"),
    ("InteractiveMarkers", second_handle(scale=NAN), "Marker bad: scale nan"),
    ("InteractiveMarkers", second_handle(pose={"orientation": {"w": INF}}), "is not finite"),
    ("InteractiveMarkers", second_handle(controls=[control(77, name="up")]),
     "control 'up': interaction_mode 77 is invalid"),
    ("InteractiveMarkers", second_handle(controls=[control(3, orientation_mode=9)]),
     "orientation_mode 9 is invalid"),
    ("InteractiveMarkers", second_handle(controls=[]), "it has no controls"),
    ("InteractiveMarkers", second_handle(menu_entries=[{"id": 7, "parent_id": 7}]),
     "menu entry 7: its parent 7 is not above it"),
    ("InteractiveMarkers",
     second_handle(menu_entries=[{"id": at + 1, "parent_id": at} for at in range(400)]),
     "menu entry 11 is deeper than 10 menus"),
    ("InteractiveMarkers", second_handle(controls=[control(2, markers=[marker(55)])]),
     "type 55: expected 0 to 12"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "fields", "error"), WRONG)
def test_a_wrong_message_is_an_error_and_what_was_right_stays(
    robot: Robot, monkeypatch: Any, kind: str, fields: dict[str, Any], error: str
) -> None:
    monkeypatch.setattr("rosglass.scene.displays.effort._COMBINED_S", 0.0)
    robot.show(next(case for case in CASES if case.display == kind))
    display, bench = robot.display, robot.bench
    bench.wait.settled(bench.session)
    before = bench.picture()
    right = {**robot.message, **SECOND.get(kind, {})}
    robot.send({**right, **fields})
    bench.wait(lambda: display.statusLevel == "error", lambda: display.statusText)
    assert error in display.statusText
    if kind == "InteractiveMarkers":
        # What is right of a marker is shown.
        assert "handle" in display.markers
    else:
        assert list(display.root.drawables())
        assert (bench.picture() == before).all()
    robot.send(right)
    bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)
    robot.check()


#: Displays that need panels, or several topics.
DISPLAYS = """
CameraDisplay { id: camera; topic: "/hostile/image" }
ImageDisplay { id: image; topic: "/hostile/image" }
ImagePanel { display: camera; width: 200; height: 150 }
ImagePanel { display: image; x: 200; width: 200; height: 150 }
MapDisplay { topic: "/hostile/map" }
MarkerArrayDisplay { topic: "/hostile/markers" }
RobotModelDisplay { }
TFDisplay { whitelist: "^(.*_?)*[a-z]$" }
"""
TRANSFORM = {"header": HEADER, "child_frame_id": "arm",
             "transform": {"translation": POINT, "rotation": TURN}}  # fmt: skip
STREAMS = {
    "/hostile/camera_info": ("sensor_msgs/CameraInfo", CAMERA),
    "/hostile/image": ("sensor_msgs/Image", {**DEPTH, "header": HEADER}),
    "/hostile/map": ("nav_msgs/OccupancyGrid", {**GRID, "header": HEADER}),
    "/hostile/map_updates": ("map_msgs/OccupancyGridUpdate", {"header": HEADER, "x": 1, "y": 0,
                             "width": 2, "height": 1, "data": [1, 2]}),
    "/hostile/markers": ("visualization_msgs/MarkerArray", {"markers": [
                         marker(kind, id=kind) for kind in range(13) if kind != 10]}),
    "/robot_description": ("std_msgs/String", {"data": ""}),
    "/tf": ("tf2_msgs/TFMessage", {"transforms": [TRANSFORM, TRANSFORM]}),
}  # fmt: skip
BODY = """<robot name="r"><material name="red"><color rgba="1 0 0 1"/></material><link name="odom">
<visual><origin xyz="1 0 0" rpy="0 1 0"/><geometry><box size="1 1 1"/></geometry>
<material name="red"/></visual><collision><geometry><sphere radius="0.5"/></geometry></collision>
</link><link name="body"><visual><geometry><cylinder radius="0.2" length="0.5"/></geometry>
</visual></link><joint name="arm" type="revolute"><parent link="odom"/><child link="body"/>
<axis xyz="0 0 1"/><limit effort="5" velocity="1" lower="-1" upper="1"/></joint></robot>"""


def edited(text: str, rng: random.Random) -> str:
    """Return a text with random changes."""
    for _ in range(rng.choice([1, 2, 5])):
        start = rng.randrange(len(text))
        end = min(start + rng.choice([1, 3, 20]), len(text))
        new = rng.choice(["", text[start:end] * 2, "1e999", "nan", "-1", '"', "<", "/>", "\0", "é"])
        text = text[:start] + new + text[end:]
    return text


def test_all_topics_of_a_robot_may_be_random(bench: SceneBench, watch: Watch) -> None:
    from rosglass import Error
    from rosglass.comm.qos import QoS

    robot = Robot(bench, watch, DISPLAYS)
    rng = random.Random(f"{SEED} robot")
    publishers = {
        topic: robot.node.create_publisher(topic, kind, QoS.latched())
        for topic, (kind, _) in STREAMS.items()
    }
    bench.wait(
        lambda: all(one.subscription_count() for one in publishers.values()),
        lambda: [one.topic for one in publishers.values() if not one.subscription_count()],
    )
    for number in range(RANDOM_COUNT):
        for topic, (_, fields) in STREAMS.items():
            message = randomised(fields, rng, rng.choice([0.0, 0.02, 0.1, 0.3]))
            if topic == "/robot_description":
                message = {"data": edited(BODY, rng)}
            for one in message.get("transforms", ()):
                # The good display stays in its place.
                if one["child_frame_id"].lstrip("/") in ("map", "odom"):
                    one["child_frame_id"] = "tool"
            try:
                publishers[topic].publish(message)
            except Error:
                continue  # no such message exists
        bench.wait.settled(bench.session)
        if number % 3 == 0:
            bench.picture()
        assert not watch.seen, "\n".join(watch.seen)
        assert not robot.view.problem, robot.view.problem
        for display in robot.view.scene.displays:
            assert len(display.statusText) < 50_000, display.statusText
    model = robot.view.scene.find("RobotModel")
    publishers["/robot_description"].publish({"data": BODY})
    bench.wait(lambda: model.links == ["body", "odom"], lambda: model.statusText)
    robot.check()


REQUESTS = {
    "move_eye": ("MoveEye", {"header": HEADER, "eye": POINT, "disable_animation": False,
                 "stop_tracking": False, "switch_to_3d_mode": True}),
    "move_eye_and_focus": ("MoveEyeAndFocus", {"header": HEADER, "eye": POINT, "focus": POINT,
                           "disable_animation": False, "stop_tracking": False}),
    "set_view_mode": ("SetViewMode", {"mode": {"mode": 0}, "disable_animation": True}),
    "set_tracked_frame": ("TrackFrame", {"frame": "odom"}),
}  # fmt: skip


def test_requests_that_move_the_camera_may_be_random(bench: SceneBench, watch: Watch) -> None:
    from rosglass import Error

    robot = Robot(bench, watch, "ViewControllerDisplay { animationDuration: 0.01 }")
    rng = random.Random(f"{SEED} camera")
    package, above = "hector_rviz_plugins_msgs", "/hector_view_controller"
    clients = {
        name: robot.node.create_service_client(f"{above}/{name}", f"{package}/srv/{kind}")
        for name, (kind, _) in REQUESTS.items()
    }
    bench.wait(lambda: all(one.ready for one in clients.values()))
    for number in range(RANDOM_COUNT):
        for name, (_, fields) in REQUESTS.items():
            try:
                call = clients[name].call_async(randomised(fields, rng, rng.choice([0.05, 0.3])))
            except Error:
                continue  # no such request exists
            bench.wait(call.done)
        if number % 3 == 0:
            bench.picture()
        assert not watch.seen, "\n".join(watch.seen)
        assert not robot.view.problem, robot.view.problem
    clients["set_tracked_frame"].call_async({"frame": ""})
    eye, focus = {"x": 1.0, "y": 2.0, "z": 3.0}, {"x": 0.0, "y": 0.0, "z": 0.0}
    clients["move_eye_and_focus"].call_async(
        {"header": {"frame_id": "map"}, "eye": eye, "focus": focus, "disable_animation": True}
    )
    bench.wait(
        lambda: np.allclose(robot.view.camera().eye, (1, 2, 3), atol=0.01),
        lambda: robot.view.camera().eye,
    )
    robot.check()


@pytest.mark.parametrize("kind", ["PoseWithCovariance", "Odometry"])
@pytest.mark.parametrize("number", [math.nan, sys.float_info.max])
def test_pose_is_shown_without_an_invalid_covariance(
    robot: Robot, kind: str, number: float
) -> None:
    robot.show(next(case for case in CASES if case.display == kind))
    display = robot.display
    display.reset()
    shown = {"pose": {"pose": POSE, "covariance": [number, *COVARIANCE[1:]]}}
    robot.send({"header": HEADER, **shown})
    assert display.statusLevel == "warn"
    assert "Covariance: pose.covariance: " in display.statusText
    assert list(display.root.drawables()), "the pose"


def test_colors_that_do_not_fit_are_named(robot: Robot) -> None:
    robot.show(Case("Marker", "visualization_msgs/Marker", marker(4)))
    robot.send(marker(4, colors=[COLOR] * 4))
    robot.bench.wait(lambda: robot.display.statusLevel == "warn")
    assert "shapes/1: colors: 4 for 6 points: they have the marker's colour" in (
        robot.display.statusText
    )


def test_lines_of_the_status_have_an_end(robot: Robot) -> None:
    robot.show(CASES[0])
    display, name = robot.display, "x" * 100_000
    for number in range(3):
        display.set_status(name, "error", f"{number}{name}")
    assert len(display.statusText) < 2000
    assert "... (100001 characters)" in display.statusText
    display.delete_status(name)
    assert display.statusLevel == "ok"


def test_messages_on_their_way_to_a_destroyed_display_are_dropped(robot: Robot) -> None:
    robot.show(CASES[0])
    display = robot.display
    queue = queue_of(display)
    received = queue.received
    robot.publisher.publish(robot.message)
    # The GUI thread has not seen it yet.
    eventually(lambda: queue.received > received)
    robot.view.scene.remove(display)
    robot.bench.wait(lambda: not is_alive(display))
    robot.check()


def test_paths_beside_each_other_are_bounded(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rosglass.scene.displays.pose._MAX_PATH_POSES", 7)
    case = next(case for case in CASES if case.display == "Path")
    robot.show(case._replace(settings={"bufferLength": 100}))
    for _ in range(5):
        robot.send(robot.message)
    text = "Buffer Length: only the latest 2 paths are shown, which have 6 poses; reduce it"
    assert text in robot.display.statusText
    assert len(list(robot.display.root.drawables())) == 2
    robot.send({**robot.message, "poses": STAMPED_POSES * 3})
    assert "poses: 9 are more than the 7" in robot.display.statusText


def test_a_map_is_copied_once_for_many_updates(robot: Robot) -> None:
    case = next(case for case in CASES if case.display == "Map")
    robot.show(case)
    display, bench = robot.display, robot.bench
    updates = robot.node.create_publisher("/hostile/topic_updates", "map_msgs/OccupancyGridUpdate")
    bench.wait(updates.subscription_count)
    before, queue = image_of(display).geometry, queue_of(display)
    received = queue.received + 4
    for at in (0, 1, 9, 2):
        updates.publish({"header": HEADER, "x": at, "width": 1, "height": 1, "data": [100]})
    # All of them have come when the GUI thread takes the first one.
    eventually(lambda: queue.received == received)
    bench.wait(lambda: display.received == received)
    assert display.cells.tolist() == [[100, 100, 100], [0, 0, 0]]
    assert image_of(display).geometry == before + 1
    assert display.statusLevel == "ok"


def test_frames_without_a_transform_are_counted(robot: Robot) -> None:
    display = robot.view.scene.add("TF")
    tf = robot.node.create_publisher("/tf", "tf2_msgs/TFMessage")
    robot.bench.wait(tf.subscription_count)
    stamped = {"stamp": {"sec": 5}}
    still = {"rotation": TURN}
    pairs = [{"header": {**stamped, "frame_id": f"from{at}"}, "child_frame_id": f"to{at}",
              "transform": still} for at in range(3000)]  # fmt: skip
    tf.publish({"transforms": pairs})
    robot.bench.wait(lambda: "of 6002 frames are shown" in display.statusText)
    assert "Transforms: 2000 frames have no transform" in display.statusText
    assert len(display.status_lines) == 22
    robot.view.scene.reset()
    robot.bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)
    robot.check()


def test_chains_of_many_frames_are_looked_up_once(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = robot.view.scene
    display = scene.add("TF")
    tf = robot.node.create_publisher("/tf", "tf2_msgs/TFMessage")
    robot.bench.wait(tf.subscription_count)
    for chain in "xyz":
        names = [f"{chain}{at}" for at in range(1501)]
        links = [
            {
                "header": {"stamp": {"sec": 5}, "frame_id": parent},
                "child_frame_id": child,
                "transform": {"rotation": TURN},
            }
            for parent, child in pairwise(names)
        ]
        tf.publish({"transforms": links})
    robot.bench.wait(lambda: "only 2000 of 4505 frames" in display.statusText)
    assert "Transforms: 1998 frames have no transform" in display.statusText
    assert set(display.frames) == {"map", "odom"}
    looks: list[Any] = []
    look_up_all = scene.look_up_all
    monkeypatch.setattr(scene, "look_up_all", lambda names: looks.append(0) or look_up_all(names))
    checks: list[Any] = []
    monkeypatch.setattr(display, "check_frames", lambda: checks.append(0))
    robot.bench.wait(lambda: len(checks) >= 2)
    assert not looks, "nothing has come in the meantime"
    robot.check()


def test_names_of_frames_that_are_not_kept_are_reported(robot: Robot) -> None:
    display = robot.view.scene.add("TF")
    tf = robot.node.create_publisher("/tf", "tf2_msgs/TFMessage")
    robot.bench.wait(tf.subscription_count)
    move = {"header": {"frame_id": "odom"}, "transform": {"rotation": TURN}}
    tf.publish({"transforms": [{**move, "child_frame_id": "x" * 100_000}]})
    text = f"ignoring the transform of '{'x' * 50}...' in 'odom'"
    robot.bench.wait(lambda: text in display.statusText, lambda: display.statusText)
    assert "at most 255 letters (from /robot)" in display.statusText
    names = [f"frame{at}" for at in range(10_001)]
    tf.publish({"transforms": [{**move, "child_frame_id": name} for name in names]})
    text = "at most 10000 names of frames are kept for each publisher"
    robot.bench.wait(lambda: text in display.statusText, lambda: display.statusText)
    robot.check()


def test_filters_do_not_take_long_whatever_the_names_are(robot: Robot) -> None:
    display, bench = robot.view.scene.add("TF"), robot.bench
    # Python's re would need 2^60 steps for the second one.
    names = ["arm", "a" * 60 + "!", "b" * 201, "tool"]
    bench.place(*names, at=(1, 0, 0), parent="odom")
    bench.wait(lambda: len(display.frames) == 6)
    display.whitelist = "^(a+)+$|^[artm]{3}$"
    bench.wait(lambda: len(display.frames) == 3, lambda: display.frames)
    assert set(display.frames) == set(names[:3])
    text = display.status_lines["Filter (whitelist)"].text
    assert text == (
        f"it takes too long for [{names[1]}] and 1 more, to which it is not applied; write a "
        "simpler expression"
    )
    display.whitelist, display.blacklist = "", "^a|map"
    bench.wait(lambda: set(display.frames) == {*names[2:], "odom"}, lambda: display.frames)
    assert "Filter (whitelist)" not in display.status_lines
    display.blacklist = "a("
    bench.wait(lambda: len(display.frames) == 6)
    text = display.status_lines["Filter (blacklist)"].text
    assert text.startswith("this is not a regular expression: ")
    assert text.endswith(", at letter 3")
    robot.check()


def test_all_interactive_markers_are_bounded(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    robot.show(next(case for case in CASES if case.display == "InteractiveMarkers"))
    monkeypatch.setattr("rosglass.scene.displays.interactive_marker.MAX_PARTS", 10)
    display, update = robot.display, {"type": 1}

    def made(name: str, count: int) -> dict[str, Any]:
        controls = [control(7, name=str(at), markers=[marker(1)]) for at in range(count)]
        return {**INTERACTIVE, "name": name, "controls": controls}

    # Each of their controls counts twice, with what it looks like; "handle" has 5 parts.
    many = {**update, "markers": [made("small", 2), made("large", 2), made("tiny", 0)]}
    text = "Marker large: it is not shown: all have more than 10 controls and shapes"
    # Again, should the display have requested all markers before.
    robot.bench.wait(lambda: robot.send(many) and text in display.statusText)
    assert display.markers == ["handle", "small"]
    robot.send({**update, "markers": [made("handle", 1), made("large", 2)]})
    assert display.markers == ["handle", "large", "small"]
    assert "Marker large" not in display.statusText


def test_invalid_second_topic_is_named_and_the_first_is_shown(robot: Robot) -> None:
    robot.show(next(case for case in CASES if case.display == "Map"))
    display, bench = robot.display, robot.bench
    display.reset()
    display.updateTopic = "~updates"
    bench.wait(lambda: "Update Topic: " in display.statusText, lambda: display.statusText)
    bench.wait(lambda: robot.publisher.publish(robot.message) or display.columns == 3)
    display.updateTopic = ""
    bench.wait(lambda: "Update Topic" not in display.statusText, lambda: display.statusText)


def test_invalid_description_topic_is_among_the_refused_settings(robot: Robot) -> None:
    display = robot.view.scene.add("RobotModel")
    (refused,) = display.load_settings({"Description Topic": {"Value": "not a topic"}})
    assert "Description Topic: expected the name of a topic" in refused
    assert display.descriptionTopic == "/robot_description"


@pytest.fixture
def ros1_robot(ros1_bench: SceneBench, watch: Watch) -> Robot:
    return Robot(ros1_bench, watch)


@pytest.mark.parametrize("kind", ["Marker", "PointCloud2"])
def test_robots_of_ros_1_may_be_wrong_as_well(ros1_robot: Robot, kind: str) -> None:
    robot = ros1_robot
    robot.show(next(case for case in CASES if case.display == kind))
    for path, value in mutations(robot.message):
        robot.send(changed(robot.message, path, value))
        assert len(robot.display.statusText) < 5000
    robot.send(robot.message)
    robot.bench.wait(lambda: robot.display.statusLevel == "ok", lambda: robot.display.statusText)
    robot.check()


def test_transforms_that_are_refused_are_named(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    display = robot.view.scene.add("TF")
    tf = robot.node.create_publisher("/tf", "tf2_msgs/TFMessage")
    robot.bench.wait(tf.subscription_count)

    def send(parent: str, child: str, x: float = 0.0) -> None:
        move = {"translation": {"x": x}, "rotation": TURN}
        header = {"frame_id": parent, "stamp": {"sec": 5}}
        tf.publish({"transforms": [{"header": header, "child_frame_id": child, "transform": move}]})

    def is_reported(text: str) -> None:
        robot.bench.wait(lambda: text in display.statusText, lambda: display.statusText)

    send("odom", "base")
    send("base", "base")
    is_reported(
        "Refused: 1 were refused; the last one: TF_SELF_TRANSFORM ignoring the transform of"
    )
    send("odom", "arm", math.nan)
    is_reported(
        "Refused: 2 were refused; the last one: TF_NAN_INPUT ignoring the transform of 'arm'"
    )
    send("base", "map")
    is_reported("the last one: TF_LOOP ignoring the transform of 'map' in 'base'")
    monkeypatch.setattr("rosglass.scene.displays.tf._REFUSED_S", 0.0)
    robot.bench.wait(lambda: display.statusLevel == "ok", lambda: display.statusText)
    robot.check()


def test_frames_that_are_too_far_away_are_named(robot: Robot) -> None:
    frames = robot.view.scene.add("TF")
    robot.show(CASES[0])
    robot.bench.place("far", at=(1e30, 0, 0), parent="odom")
    robot.bench.place("near", at=(1, 0, 0), parent="odom")
    text = "[far] is more than 1e18 m away from [map]"
    robot.bench.wait(lambda: f"far: no transform: {text}" in frames.statusText)
    assert set(frames.frames) == {"map", "near", "odom"}
    robot.send({**robot.message, "header": {**HEADER, "frame_id": "far"}})
    assert f"Transform: no transform from [far]: {text}" in robot.display.statusText
    robot.check()


def test_triangles_and_colors_that_are_too_large(robot: Robot) -> None:
    robot.show(Case("Marker", "visualization_msgs/Marker", marker(11)))
    far = [{"x": 1e18, "y": float(at), "z": 0.0} for at in range(3)]
    robot.send(marker(11, points=far, colors=[{**COLOR, "r": 1e30}] * 3))
    assert robot.display.statusLevel == "ok", robot.display.statusText
    robot.send(marker(11, points=far, scale={"x": 1e9, "y": 1.0, "z": 1.0}))
    text = "points times scale[0]: 1e+27 is beyond the 1e+18 that is drawn"
    robot.bench.wait(lambda: text in robot.display.statusText)
    robot.send(marker(7, colors=[{**COLOR, "a": 1e30}] * 6))
    robot.bench.wait(lambda: robot.display.statusLevel == "ok", lambda: robot.display.statusText)
    robot.check()


def test_points_are_read_some_at_a_time(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rosglass.scene.displays.marker_messages._ROWS_AT_ONCE", 4)
    robot.show(Case("Marker", "visualization_msgs/Marker", marker(8)))
    (points,) = [one for one, _, _ in robot.display.root.drawables()]
    assert points.xyz().tolist() == [[float(at), 0.0, 0.0] for at in range(6)]
