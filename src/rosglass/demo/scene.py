"""The camera's view as geometry: flat faces and their positions on the screen."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rosglass.demo import textures

if TYPE_CHECKING:
    import numpy.typing as npt

    from rosglass.demo.simulation import RobotState
    from rosglass.demo.world import Prism, World

    Floats = npt.NDArray[np.float64]
    Pixels = npt.NDArray[np.int32]

__all__ = [
    "FOCAL",
    "HEIGHT",
    "MOUNT",
    "PIECE",
    "PROJECT",
    "WIDTH",
    "Face",
    "Surfaces",
    "View",
    "faces_of",
    "from_body",
    "outline_of",
    "pose_of",
    "ramp_faces",
]

WIDTH, HEIGHT = 640, 480
#: Position of the camera on the robot: metres forward, metres up, radians nose down.
MOUNT = (-0.04, 0.52, 0.11)
#: Focal length in pixels: 78 degrees from the left to the right edge.
FOCAL = WIDTH / 2 / math.tan(math.radians(78) / 2)
#: From camera coordinates to pixels.
PROJECT = np.array([[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2], [0, 0, 1.0]])
#: Longest piece of a wall that can be sorted by distance with others, metres.
PIECE = 1.2
_NEAR = 0.06
#: From the robot's axes (x forward, y left, z up) to the camera's (x right, y down, z forward).
_OPTICAL = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class Face:
    """A flat piece of surface: `origin` + u * `across` + v * `down`, u and v from 0 to 1.

    `part` is the part of the texture's width and height that it shows; a width above 1 repeats it.
    """

    origin: Floats
    across: Floats
    down: Floats
    texture: str
    part: tuple[float, float]
    shade: float

    @property
    def corners(self) -> Floats:
        """The four corners, around the face."""
        return np.array(
            [
                self.origin,
                self.origin + self.across,
                self.origin + self.across + self.down,
                self.origin + self.down,
            ]
        )


@dataclass(frozen=True)
class View:
    """A face in view: its outline in pixels, and the mapping from pixels to its u and v."""

    face: Face
    distance: float
    outline: Pixels
    inverse: Floats


class Surfaces:
    """Many faces, with data to find the visible ones quickly."""

    def __init__(self, faces: list[Face]) -> None:
        self._faces = faces
        corners = np.array([f.corners for f in faces])
        self._corners = corners
        self._origins = corners[:, 0]
        self._basis = np.array([np.column_stack([f.across, f.down, f.origin]) for f in faces])
        self._centres = corners.mean(axis=1)
        self._reaches = np.linalg.norm(corners - self._centres[:, None], axis=2).max(axis=1)
        self._normals = np.array([np.cross(f.down, f.across) for f in faces])

    def views(self, rotation: Floats, position: Floats) -> list[View]:
        """Return the faces that are turned towards the camera and lie in its field of view."""
        towards = ((position - self._origins) * self._normals).sum(axis=1) > 1e-6
        middle = (self._centres - position) @ rotation.T
        margin = self._reaches * 1.3
        wide = np.abs(middle[:, 0]) - margin <= (WIDTH / 2 / FOCAL) * (middle[:, 2] + margin)
        ahead = middle[:, 2] > _NEAR - self._reaches
        seen = np.flatnonzero(towards & wide & ahead)
        if not seen.size:
            return []
        corners = (self._corners[seen] - position) @ rotation.T
        # Columns: one step across, one step down and the origin, projected to the screen.
        basis = self._basis[seen].copy()
        basis[:, :, 2] -= position
        inverses = np.linalg.inv(PROJECT @ rotation @ basis)
        whole = (corners[:, :, 2] > _NEAR).all(axis=1)
        outlines = _pixels(np.where(whole[:, None, None], corners, 1.0))
        distances = np.sqrt((middle[seen] ** 2).sum(axis=1)).tolist()
        views = []
        for k, index in enumerate(seen):
            outline = outlines[k] if whole[k] else outline_of(corners[k])
            if outline is not None:
                views.append(View(self._faces[index], distances[k], outline, inverses[k]))
        return views


def _turn_y(angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1.0, 0], [-s, 0, c]])


def from_body(points: Floats) -> Floats:
    """Return points on the robot (x forward, y left, z up) in camera coordinates."""
    turned: Floats = (points - (MOUNT[0], 0.0, MOUNT[1])) @ (_OPTICAL @ _turn_y(MOUNT[2]).T).T
    return turned


def pose_of(state: RobotState) -> tuple[Floats, Floats]:
    """Return the rotation from the world into the camera, and the camera's position."""
    cy, sy = math.cos(state.yaw), math.sin(state.yaw)
    cr, sr = math.cos(state.roll), math.sin(state.roll)
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1.0]])
    roll = np.array([[1.0, 0, 0], [0, cr, -sr], [0, sr, cr]])
    body = yaw @ _turn_y(state.pitch) @ roll
    mount = np.array([MOUNT[0], 0.0, MOUNT[1]])
    position = np.array([state.x, state.y, state.z]) + body @ mount
    rotation: Floats = _OPTICAL @ (body @ _turn_y(MOUNT[2])).T
    return rotation, position


def outline_of(points: Floats) -> Pixels | None:
    """Return the pixels that a polygon in camera coordinates covers; None if it is out of sight."""
    if not (points[:, 2] > _NEAR).all():
        kept = []
        for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
            if a[2] > _NEAR:
                kept.append(a)
            if (a[2] > _NEAR) != (b[2] > _NEAR):
                kept.append(a + (b - a) * ((_NEAR - a[2]) / (b[2] - a[2])))
        if len(kept) < 3:
            return None
        points = np.array(kept)
    return _pixels(points)


def _pixels(points: Floats) -> Pixels:
    pixels = points[..., :2] / points[..., 2:] * FOCAL + (WIDTH / 2, HEIGHT / 2)
    # Limited far outside of the screen: OpenCV draws with small integers.
    return np.rint(np.minimum(np.maximum(pixels, -20000), 20000)).astype(np.int32)


def _lit(normal: Floats) -> float:
    """Return the brightness of a surface: sky light, and sun where it shines."""
    sun = np.array(textures.SUN)
    return 0.66 + 0.5 * max(0.0, float(normal @ sun / np.linalg.norm(sun)))


def faces_of(prism: Prism, piece: float = PIECE) -> list[Face]:
    """Return the prism's sides in pieces short enough to sort, and its top."""
    faces = []
    for x0, y0, x1, y1 in prism.segments():
        length = math.hypot(x1 - x0, y1 - y0)
        count = max(1, math.ceil(length / piece - 1e-6))
        normal = np.array([y1 - y0, x0 - x1, 0.0]) / length
        part = (1.0, 1.0)
        if prism.texture in textures.TILED:
            part = (length / count / PIECE, min(1.0, prism.top / 1.7))
        # Seen from outside, a counter-clockwise outline runs from left to right.
        across = np.array([x1 - x0, y1 - y0, 0.0]) / count
        down = np.array([0.0, 0.0, -prism.top])
        for k in range(count):
            origin = np.array([x0, y0, prism.top]) + across * k
            faces.append(Face(origin, across, down, prism.texture, part, _lit(normal)))
    xs, ys = zip(*prism.corners, strict=True)
    if len(prism.corners) == 4:
        a, b, _, d = (np.array([x, y, prism.top]) for x, y in prism.corners)
        down, across = a - d, b - a
        faces.append(Face(d, across, down, prism.top_texture, (1.0, 1.0), 1.05))
    else:
        origin = np.array([min(xs), max(ys), prism.top])
        size = max(xs) - min(xs)
        across, down = np.array([size, 0.0, 0.0]), np.array([0.0, -size, 0.0])
        faces.append(Face(origin, across, down, prism.top_texture, (1.0, 1.0), 1.05))
    return faces


def ramp_faces(world: World) -> list[Face]:
    """Return the ramp's two slopes and the level part between them."""
    ramp = world.ramp
    north, width = ramp.y + ramp.width / 2, np.array([0.0, -ramp.width, 0.0])
    knots = [
        (ramp.start, 0.0),
        (ramp.start + ramp.slope_length, ramp.height),
        (ramp.end - ramp.slope_length, ramp.height),
        (ramp.end, 0.0),
    ]
    faces = []
    for (x0, z0), (x1, z1) in itertools.pairwise(knots):
        # Across the ramp is `across`, against the way of driving is `down`.
        origin = np.array([x1, north, z1])
        down = np.array([x0 - x1, 0.0, z0 - z1])
        normal = np.cross(down, width)
        shade = _lit(normal / np.linalg.norm(normal))
        faces.append(Face(origin, width, down, "ramp", (1.0, 1.0), shade))
    return faces
