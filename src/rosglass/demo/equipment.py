"""The equipment that a full operator station needs: model, cloud, cameras, modes."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from rosglass.comm import QoS, Time
from rosglass.demo import telemetry, textures
from rosglass.demo.operation import Operation
from rosglass.demo.scene import MOUNT, faces_of, ramp_faces
from rosglass.demo.telemetry import AXLES
from rosglass.demo.world import LaserScanner

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from rosglass.comm import Node
    from rosglass.demo.camera import Camera
    from rosglass.demo.simulation import RobotState, Simulation
    from rosglass.demo.world import World

    Floats = npt.NDArray[np.float64]
    Pixels = npt.NDArray[np.uint8]

__all__ = ["CAMERAS", "PARTS", "Cloud", "Equipment", "urdf"]

CAMERAS = ("rear", "left", "right", "thermal")
_CLOUD_PERIOD_S, _CAMERA_PERIOD_S = 0.5, 0.1
#: Seconds after which an unchanged cloud is sent again.
_CLOUD_REPEAT_S = 1.4
_WIDTH, _HEIGHT = 320, 240


class Equipment:
    """Additional sensors and cameras of the robot; they cost little without subscribers.

    Args:
        node: Node that offers it.
        simulation: The robot.
        camera: Renders images of its world.
        scanner: Its laser.
        drive: Takes metres and radians per second.
        flippers: Takes four angles.
        mode: The initial mode.
    """

    def __init__(
        self,
        node: Node,
        simulation: Simulation,
        camera: Camera,
        scanner: LaserScanner,
        drive: Callable[[float, float], None],
        flippers: Callable[[Sequence[float]], None],
        mode: str,
    ) -> None:
        self._node, self._simulation, self._camera = node, simulation, camera
        self._scanner, self._cloud = scanner, Cloud(simulation.world)
        dock = simulation.world.dock
        self.operation = Operation(node, lambda: simulation.state, drive, flippers, dock, mode)
        sensor = QoS.sensor_data()
        self._points = node.create_publisher("/points", "sensor_msgs/msg/PointCloud2", sensor)
        self._pictures = {
            name: node.create_publisher(
                f"/{name}_camera/image_raw", "sensor_msgs/msg/Image", sensor
            )
            for name in CAMERAS
        }

    def describe(self) -> None:
        """Publish the robot's model: in ROS 1 a parameter, in ROS 2 a topic."""
        if self._node.wire == "ros1":
            server: Any = self._node
            server.parameter_server.set("/robot_description", urdf())
        else:
            topic = "/robot_description"
            self._node.create_publisher(topic, "std_msgs/msg/String", QoS.latched()).publish(
                data=urdf()
            )

    @staticmethod
    def frames(stamp: Time) -> list[dict[str, Any]]:
        """Return the poses of its parts, for ``/tf_static``."""
        return [telemetry.part(stamp, name, place, turn) for name, place, turn in PARTS]

    def scan(self, ending: Callable[[float], bool]) -> None:
        """Publish the cloud until `ending`, which waits some seconds, returns true."""
        sent, changed = -math.inf, False
        while not ending(_CLOUD_PERIOD_S):
            state, now = self._simulation.state, time.monotonic()
            if abs(state.pitch) + abs(state.roll) < 0.3:
                ranges = self._scanner.scan(state.x, state.y, state.yaw, state.carrier_phase)
                changed |= self._cloud.look(state, ranges)
            # Displays rebuild it for each message.
            due = changed or now - sent >= _CLOUD_REPEAT_S
            if due and self._points.subscription_count():
                self._points.publish(self._cloud.message(Time.now()))
                sent, changed = now, False

    def film(self, ending: Callable[[float], bool]) -> None:
        """Publish the subscribed images until `ending` returns true."""
        while not ending(_CAMERA_PERIOD_S):
            for name, publisher in self._pictures.items():
                if publisher.subscription_count():
                    picture = self._picture(name)
                    publisher.publish(
                        header=telemetry.header(Time.now(), f"{name}_camera_link"),
                        height=_HEIGHT,
                        width=_WIDTH,
                        encoding="rgb8",
                        is_bigendian=0,
                        step=3 * _WIDTH,
                        data=picture.reshape(-1),
                    )

    def _picture(self, name: str) -> Any:
        state = self._simulation.state
        turn = {"rear": math.pi, "left": math.pi / 2, "right": -math.pi / 2}.get(name, 0.0)
        whole = self._camera.render(_turned(state, turn), body=name in ("rear", "thermal"))
        small = cv2.resize(whole, (_WIDTH, _HEIGHT), interpolation=cv2.INTER_AREA)
        if name == "thermal":
            red, _, blue = (small[..., k].astype(np.int16) for k in range(3))
            heat = np.clip(blue // 4 + 2 * np.maximum(red - blue, 0), 0, 255).astype(np.uint8)
            small = cv2.cvtColor(cv2.applyColorMap(heat, cv2.COLORMAP_INFERNO), cv2.COLOR_BGR2RGB)
        clock = time.strftime("%H:%M:%S")
        cv2.putText(small, clock, (6, _HEIGHT - 7), 0, 0.38, (235, 235, 235), 1, cv2.LINE_AA)
        return small


def _turned(state: RobotState, turn: float) -> RobotState:
    """Return a state whose camera looks in the direction of another camera, turned by an angle."""
    c, s = math.cos(turn), math.sin(turn)
    front_left, front_right, rear_left, rear_right = state.flippers
    return replace(
        state,
        yaw=state.yaw + turn,
        roll=c * state.roll + s * state.pitch,
        pitch=c * state.pitch - s * state.roll,
        flippers=(rear_right, rear_left, front_right, front_left) if c < 0 else state.flippers,
        flashlight=state.flashlight and turn == 0.0,
    )


#: Metres between two points of objects, and of the ground.
_SPACING, _GROUND_SPACING = 0.11, 0.12
#: Bare concrete is left to the map: it would need the most points, and show the least.
_COLORED, _RAISED = 30, 0.02
#: Height of the yard's walls in the cloud, metres: a camera behind the robot sees over them.
_PARAPET = 0.85
#: Range in metres at which the robot sees colours.
_REACH = 5.5
#: sensor_msgs/PointField's number of 32-bit floats.
_FLOAT32 = 7


class Cloud:
    """Points on all objects of a world, published once the robot's laser has hit them.

    Args:
        world: The world to scan.
    """

    def __init__(self, world: World) -> None:
        sides = textures.sides()
        parts = [_ground(world)]
        faces = [f for prism in world.prisms for f in faces_of(prism)] + ramp_faces(world)
        for face in faces:
            across = max(2, round(float(np.linalg.norm(face.across)) / _SPACING))
            down = max(2, round(float(np.linalg.norm(face.down)) / _SPACING))
            u, v = (grid.ravel() for grid in np.meshgrid(_middles(across), _middles(down)))
            places = face.origin + u[:, None] * face.across + v[:, None] * face.down
            texture = cv2.resize(sides[face.texture], (across, down), interpolation=cv2.INTER_AREA)
            colors = np.clip(texture.reshape(-1, 3) * face.shade, 0, 255).astype(np.uint8)
            parts.append((places, colors))
        places = np.concatenate([part[0] for part in parts])
        colors = np.concatenate([part[1] for part in parts])
        outer = (np.abs(places[:, :2]) > (world.half_length - 0.05, world.half_width - 0.05)).any(1)
        included = ~outer | (places[:, 2] < _PARAPET)
        places, colors = places[included], colors[included]
        self._places = places[:, :2]
        self._seen = np.zeros(len(places), bool)
        self._rows = np.empty((len(places), 4), np.float32)
        self._rows[:, :3] = places
        red, green, blue = (colors[:, k].astype(np.uint32) for k in range(3))
        self._rows[:, 3] = (red << 16 | green << 8 | blue).view(np.float32)

    def look(self, state: RobotState, ranges: npt.NDArray[np.float32]) -> bool:
        """Record the points in sight; return whether any is new.

        Args:
            state: State of the robot.
            ranges: Ranges of its laser in that state (:meth:`LaserScanner.scan`).
        """
        way = self._places - (state.x, state.y)
        distances = np.hypot(way[:, 0], way[:, 1])
        bearings = np.arctan2(way[:, 1], way[:, 0]) - state.yaw - LaserScanner.angle_min
        beams = np.rint(bearings % math.tau / LaserScanner.angle_increment).astype(int)
        # Tops and far sides of low objects are seen from above.
        free = ranges[beams % LaserScanner.beams] + 0.35
        new = (distances < _REACH) & (distances < free) & ~self._seen
        self._seen |= new
        return bool(new.any())

    def message(self, stamp: Time) -> dict[str, Any]:
        """Return ``sensor_msgs/msg/PointCloud2`` of the points seen so far, with ``rgb``."""
        rows = self._rows[self._seen]
        fields = [
            {"name": name, "offset": 4 * k, "datatype": _FLOAT32, "count": 1}
            for k, name in enumerate(("x", "y", "z", "rgb"))
        ]
        return {
            "header": telemetry.header(stamp, "map"),
            "height": 1,
            "width": len(rows),
            "fields": fields,
            "is_bigendian": False,
            "point_step": 16,
            "row_step": 16 * len(rows),
            "data": rows.reshape(-1).view(np.uint8),
            "is_dense": True,
        }


def _middles(count: int) -> Floats:
    middles: Floats = (np.arange(count) + 0.5) / count
    return middles


def _ground(world: World) -> tuple[Floats, Pixels]:
    picture, _ = textures.ground(world)
    columns = round(2 * world.half_length / _GROUND_SPACING)
    rows = round(2 * world.half_width / _GROUND_SPACING)
    colors = cv2.resize(picture, (columns, rows), interpolation=cv2.INTER_AREA).reshape(-1, 3)
    xs = (2 * _middles(columns) - 1) * world.half_length
    ys = (1 - 2 * _middles(rows)) * world.half_width
    x, y = (grid.ravel() for grid in np.meshgrid(xs, ys))
    inside = np.zeros(len(x), bool)
    for prism in world.prisms:
        covered = np.ones(len(x), bool)
        for x0, y0, x1, y1 in prism.segments():
            covered &= (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) >= 0
        inside |= covered
    places = np.column_stack([x, y, world.ground(x, y)])
    visible = (np.ptp(colors, axis=1) > _COLORED) | (places[:, 2] > _RAISED)
    kept = ~inside & (world.ramp.ground(x, y) == 0) & visible
    return places[kept], colors[kept].astype(np.uint8)


#: Fixed parts: name, position and roll, pitch, yaw on ``base_link``.
PARTS: tuple[tuple[str, tuple[float, float, float], tuple[float, float, float]], ...] = (
    ("rear_camera_link", (-0.36, 0.0, 0.30), (0.0, 0.0, math.pi)),
    ("left_camera_link", (0.0, 0.24, 0.30), (0.0, 0.0, math.pi / 2)),
    ("right_camera_link", (0.0, -0.24, 0.30), (0.0, 0.0, -math.pi / 2)),
    ("thermal_camera_link", (-0.02, 0.0, 0.60), (0.0, MOUNT[2], 0.0)),
)
_COLORS = {
    "hull": "0.17 0.19 0.22",
    "deck": "0.90 0.45 0.12",
    "track": "0.07 0.07 0.08",
    "wheel": "0.33 0.35 0.38",
    "flipper": "0.24 0.26 0.30",
    "metal": "0.62 0.66 0.70",
    "lens": "0.10 0.45 0.60",
}
_TRACK_X, _TRACK_Y, _TRACK_Z = 0.27, 0.255, 0.10


def urdf() -> str:
    """Return the robot's description, of boxes and cylinders only."""
    hull = [
        _box((0.62, 0.40, 0.14), (0, 0, 0.14), "hull"),
        _box((0.50, 0.36, 0.05), (0, 0, 0.235), "deck"),
        _box((0.16, 0.20, 0.03), (-0.18, 0, 0.275), "hull"),
        _cylinder(0.018, 0.24, (MOUNT[0] - 0.02, 0, 0.38), (0, 0, 0), "metal"),
    ]
    for side in (1, -1):
        y = side * _TRACK_Y
        hull.append(_box((2 * _TRACK_X, 0.10, 0.20), (0, y, _TRACK_Z), "track"))
        hull += [
            _cylinder(0.10, 0.10, (x, y, _TRACK_Z), (math.pi / 2, 0, 0), "track")
            for x in (_TRACK_X, -_TRACK_X)
        ]
        for k in range(-2, 3):
            at = (k * 0.13, y + side * 0.002, _TRACK_Z)
            hull.append(_cylinder(0.045, 0.104, at, (math.pi / 2, 0, 0), "wheel"))
    links = [_link("base_link", *hull)]
    for name, axle in AXLES.items():
        forward = 1 if axle[0] > 0 else -1
        links.append(
            _link(
                name,
                _cylinder(0.085, 0.09, (0, 0, 0), (math.pi / 2, 0, 0), "wheel"),
                _box((0.40, 0.08, 0.11), (forward * 0.21, 0, 0), "flipper"),
                _cylinder(0.05, 0.084, (forward * 0.41, 0, 0), (math.pi / 2, 0, 0), "wheel"),
            )
        )
        links.append(_joint(name, "revolute", axle, (0, 0, 0), axis=(0, -forward, 0)))
    scanner = _cylinder(0.055, 0.07, (0, 0, 0), (0, 0, 0), "lens")
    eye = _box((0.07, 0.13, 0.07), (0, 0, 0), "metal")
    glass = _cylinder(0.028, 0.02, (0.04, 0, 0), (0, math.pi / 2, 0), "lens")
    fixed = [
        ("laser", (LaserScanner.mount, 0.0, 0.4), (0.0, 0.0, 0.0), (scanner,)),
        ("camera_link", (MOUNT[0], 0.0, MOUNT[1]), (0.0, MOUNT[2], 0.0), (eye, glass)),
        *(
            (name, place, turn, (_box((0.04, 0.06, 0.04), (0, 0, 0), "metal"),))
            for name, place, turn in PARTS
        ),
    ]
    for name, place, turn, visuals in fixed:
        links += [_link(name, *visuals), _joint(name, "fixed", place, turn)]
    colors = [
        f'<material name="{name}"><color rgba="{rgb} 1"/></material>'
        for name, rgb in _COLORS.items()
    ]
    body = "\n".join([*colors, *links])
    return f'<?xml version="1.0"?>\n<robot name="rosglass_robot">\n{body}\n</robot>\n'


def _numbers(values: Any) -> str:
    return " ".join(f"{value:.6g}" for value in values)


def _visual(shape: str, place: Any, turn: Any, color: str) -> str:
    origin = f'<origin xyz="{_numbers(place)}" rpy="{_numbers(turn)}"/>'
    material = f'<material name="{color}"/>'
    return f"<visual>{origin}<geometry>{shape}</geometry>{material}</visual>"


def _box(size: Any, place: Any, color: str) -> str:
    return _visual(f'<box size="{_numbers(size)}"/>', place, (0, 0, 0), color)


def _cylinder(radius: float, length: float, place: Any, turn: Any, color: str) -> str:
    return _visual(f'<cylinder radius="{radius}" length="{length}"/>', place, turn, color)


def _link(name: str, *visuals: str) -> str:
    return f'<link name="{name}">{"".join(visuals)}</link>'


def _joint(name: str, kind: str, place: Any, turn: Any, axis: Any = None) -> str:
    moving = ""
    if axis is not None:
        limit = '<limit lower="-1.4" upper="1.4" effort="50" velocity="1.2"/>'
        moving = f'<axis xyz="{_numbers(axis)}"/>{limit}'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="base_link"/><child link="{name}"/>'
        f'<origin xyz="{_numbers(place)}" rpy="{_numbers(turn)}"/>{moving}</joint>'
    )
