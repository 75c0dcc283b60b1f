"""The coloured point cloud: all parts of the world that the robot has seen so far."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from rosglass.demo import textures
from rosglass.demo.scan import LaserScanner
from rosglass.demo.scene import faces_of, ramp_faces
from rosglass.demo.telemetry import header

if TYPE_CHECKING:
    import numpy.typing as npt

    from rosglass.comm import Time
    from rosglass.demo.simulation import RobotState
    from rosglass.demo.world import World

    Floats = npt.NDArray[np.float64]
    Pixels = npt.NDArray[np.uint8]

__all__ = ["Cloud"]

#: Metres between two points of objects, and of the ground.
_SPACING, _GROUND_SPACING = 0.11, 0.12
#: Bare concrete is left to the map: it would need the most points, and show the least.
_COLOURED, _RAISED = 30, 0.02
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
            colours = np.clip(texture.reshape(-1, 3) * face.shade, 0, 255).astype(np.uint8)
            parts.append((places, colours))
        places = np.concatenate([part[0] for part in parts])
        colours = np.concatenate([part[1] for part in parts])
        outer = (np.abs(places[:, :2]) > (world.half_length - 0.05, world.half_width - 0.05)).any(1)
        included = ~outer | (places[:, 2] < _PARAPET)
        places, colours = places[included], colours[included]
        self._places = places[:, :2]
        self._seen = np.zeros(len(places), bool)
        self._rows = np.empty((len(places), 4), np.float32)
        self._rows[:, :3] = places
        red, green, blue = (colours[:, k].astype(np.uint32) for k in range(3))
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
            "header": header(stamp, "map"),
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
    colours = cv2.resize(picture, (columns, rows), interpolation=cv2.INTER_AREA).reshape(-1, 3)
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
    telling = (np.ptp(colours, axis=1) > _COLOURED) | (places[:, 2] > _RAISED)
    kept = ~inside & (world.ramp.ground(x, y) == 0) & telling
    return places[kept], colours[kept].astype(np.uint8)
