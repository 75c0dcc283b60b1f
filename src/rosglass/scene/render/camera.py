"""The camera of a scene: from where it is seen, where a point appears, what is under a pixel."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from rosglass.errors import Error, shown
from rosglass.overlay.orbit import Point
from rosglass.tf.transform import rotate, slerp

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "FOV_RAD",
    "Camera",
    "Matrix",
    "PinholeCamera",
    "Seen",
    "Size",
    "interpolate",
    "inverse",
    "point_of",
    "pose_matrix",
    "quaternion_of",
    "three_numbers",
    "unit",
]

Matrix: TypeAlias = "NDArray[np.float64]"
#: Width and height.
Size: TypeAlias = tuple[float, float]

#: RViz's vertical field of view.
FOV_RAD = math.pi / 4
#: Far plane of an orthographic camera: RViz's 100 km would leave 6 mm of depth resolution.
_ORTHO_FAR_M = 10_000.0
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Seen(NamedTuple):
    """The position of a point in the image.

    Attributes:
        x: In units of the item, from its left edge; NaN behind the camera.
        y: The same, from its upper edge.
        depth: Metres from the camera; NaN behind it.
    """

    x: float
    y: float
    depth: float


_NOWHERE = Seen(math.nan, math.nan, math.nan)


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera, by OpenGL's conventions: it looks along its -z axis, its y axis points up.

    Attributes:
        pose: Its pose in the fixed frame, 4 x 4.
        size: Width and height of the image, in units of the item (pixels where its scale is 1).
        fov: Vertical field of view in radians; None for an orthographic camera.
        scale: Units of the item per metre; of an orthographic camera only.
        near: Metres to the near plane. A perspective camera has no far plane.
        focus_distance: Metres to what it looks at, about which :func:`interpolate` turns it.

    Raises:
        Error: The pose is not a finite matrix of 4 x 4, or a number is out of range.
    """

    pose: Matrix
    size: Size
    fov: float | None = FOV_RAD
    scale: float = 10.0
    near: float = 0.01
    focus_distance: float = 10.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", pose_matrix(self.pose, "the camera's pose"))
        width, height = self.size
        for name, value in (
            ("the camera's width", width),
            ("the camera's height", height),
            ("the camera's scale", self.scale),
            ("the camera's near plane", self.near),
            ("the camera's focus distance", self.focus_distance),
        ):
            if not (math.isfinite(value) and value > 0):
                raise Error(f"{name} must be a finite number above 0, not {shown(value)}")
        if self.fov is not None and not 0 < self.fov < math.pi:
            raise Error(
                f"the camera's field of view must be between 0 and pi rad, not {shown(self.fov)}"
            )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Camera):
            return NotImplemented
        return bool(
            np.array_equal(self.pose, other.pose)
            and self.size == other.size
            and self.fov == other.fov
            and self.scale == other.scale
            and self.near == other.near
        )

    __hash__ = None  # type: ignore[assignment]

    @property
    def is_orthographic(self) -> bool:
        """True if the projection is orthographic: distant objects look as large as near ones."""
        return self.fov is None

    @property
    def eye(self) -> Point:
        """The position of the camera, in the fixed frame."""
        return point_of(self.pose[:3, 3])

    @property
    def focus(self) -> Point:
        """The point that it looks at, in the fixed frame."""
        return point_of(self.pose[:3, 3] - self.pose[:3, 2] * self.focus_distance)

    @cached_property
    def view(self) -> Matrix:
        """The matrix from the fixed frame to the eye's."""
        return inverse(self.pose)

    @cached_property
    def projection(self) -> Matrix:
        """The matrix from the eye's frame to OpenGL's clip space, depths -1 (near) to 1.

        For another graphics interface, multiply it with ``QRhi.clipSpaceCorrMatrix()`` from the
        left.
        """
        width, height = self.size
        matrix = np.zeros((4, 4))
        if self.fov is None:
            far = max(_ORTHO_FAR_M, 2 * self.near)
            matrix[0, 0], matrix[1, 1] = 2 * self.scale / width, 2 * self.scale / height
            matrix[2, 2] = -2 / (far - self.near)
            matrix[2, 3] = -(far + self.near) / (far - self.near)
            matrix[3, 3] = 1.0
        else:
            matrix[1, 1] = 1 / math.tan(self.fov / 2)
            matrix[0, 0] = matrix[1, 1] * height / width
            matrix[2, 2] = matrix[3, 2] = -1.0
            matrix[2, 3] = -2 * self.near
        return matrix

    def project(self, point: Sequence[float]) -> Seen:
        """Return where a point is seen.

        Args:
            point: x, y, z in the fixed frame, metres.

        Raises:
            Error: It is not three numbers.
        """
        at = np.append(three_numbers(point, "a point"), 1.0)
        if not np.isfinite(at).all():
            return _NOWHERE
        from_eye = self.view @ at
        if from_eye[2] >= 0:
            return _NOWHERE
        clip = self.projection @ from_eye
        width, height = self.size
        x, y = clip[:2] / clip[3]
        depth = float(np.linalg.norm(from_eye[:3]))
        return Seen(float((x + 1) / 2 * width), float((1 - y) / 2 * height), depth)

    def ray(self, x: float, y: float) -> tuple[Point, Point]:
        """Return the ray from the camera through a point of the image, in the fixed frame.

        Args:
            x: Units of the item, from its left edge.
            y: The same, from its upper edge.

        Returns:
            Its origin in metres, and its direction, of length 1.
        """
        width, height = self.size
        right, up = x - width / 2, height / 2 - y
        turn, origin = self.pose[:3, :3], self.pose[:3, 3]
        if self.fov is None:
            across = turn @ np.array([right / self.scale, up / self.scale, 0.0])
            return point_of(origin + across), point_of(-turn[:, 2])
        ahead = height / 2 / math.tan(self.fov / 2)
        return point_of(origin), point_of(unit(turn @ np.array([right, up, -ahead])))


@dataclass(frozen=True, eq=False)
class PinholeCamera(Camera):
    """A camera of the robot, whose optical axis may miss the middle of the image.

    Attributes:
        focal: Focal lengths to the right and downwards, in units of the item.
        centre: Position of the optical axis, in units of the item from its upper left corner.

    Raises:
        Error: A number is not finite, or a focal length is not above 0.
    """

    focal: Size = (1.0, 1.0)
    centre: Size = (0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        numbers = (*self.focal, *self.centre)
        if not (all(map(math.isfinite, numbers)) and min(self.focal) > 0):
            raise Error(
                f"a camera needs focal lengths above 0 and a finite centre, not {self.focal} and "
                f"{self.centre}"
            )

    def __eq__(self, other: object) -> bool:
        same = super().__eq__(other)
        if same is not True or not isinstance(other, PinholeCamera):
            return NotImplemented if same is NotImplemented else False
        return (self.focal, self.centre) == (other.focal, other.centre)

    __hash__ = None

    @cached_property
    def projection(self) -> Matrix:
        """The matrix from the eye's frame to OpenGL's clip space, depths -1 (near) to 1."""
        width, height = self.size
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[1, 1] = 2 * self.focal[0] / width, 2 * self.focal[1] / height
        matrix[0, 2] = 1 - 2 * self.centre[0] / width
        matrix[1, 2] = 2 * self.centre[1] / height - 1
        matrix[2, 2] = matrix[3, 2] = -1.0
        matrix[2, 3] = -2 * self.near
        return matrix

    def ray(self, x: float, y: float) -> tuple[Point, Point]:
        """Return the ray from the camera through a point of the image, in the fixed frame."""
        right = (x - self.centre[0]) / self.focal[0]
        down = (y - self.centre[1]) / self.focal[1]
        turn, origin = self.pose[:3, :3], self.pose[:3, 3]
        return point_of(origin), point_of(unit(turn @ np.array([right, -down, -1.0])))


def interpolate(start: Camera, goal: Camera, share: float) -> Camera:
    """Return the camera between two, as for the animation from one view to another.

    What the cameras look at moves on a line, the camera turns about it the short way, and its
    distance changes in equal ratios. Between a perspective and an orthographic camera, all cameras
    are perspective ones; the last one shows as much as the orthographic one does.

    Args:
        start: Returned for a share of 0 and below.
        goal: Returned for a share of 1 and above; the size is always this one's.
        share: Progress, 0 to 1; see :func:`rosglass.overlay.orbit.ease`.
    """
    if share >= 1:
        return goal
    if share <= 0 or not math.isfinite(share):
        return replace(start, size=goal.size)
    near = goal.near
    if start.fov is not None or goal.fov is not None:
        start, goal = _as_perspective(start, goal.fov), _as_perspective(goal, start.fov)
    distance = start.focus_distance * (goal.focus_distance / start.focus_distance) ** share
    turn = slerp(quaternion_of(start.pose), quaternion_of(goal.pose), share)
    pose = np.eye(4)
    pose[:3, :3] = np.transpose([rotate(turn, axis) for axis in _AXES])
    focus = np.array(start.focus.towards(goal.focus, share))
    pose[:3, 3] = focus + pose[:3, 2] * distance
    fov = None
    if start.fov is not None and goal.fov is not None:
        fov = start.fov + (goal.fov - start.fov) * share
    scale = start.scale * (goal.scale / start.scale) ** share
    return Camera(pose, goal.size, fov, scale, near, distance)


def _as_perspective(camera: Camera, fov: float | None) -> Camera:
    """Return the perspective camera that shows as much of its focus as an orthographic one."""
    if camera.fov is not None or fov is None:
        return camera
    distance = camera.size[1] / camera.scale / 2 / math.tan(fov / 2)
    pose = camera.pose.copy()
    pose[:3, 3] = np.array(camera.focus) + pose[:3, 2] * distance
    return replace(camera, pose=pose, fov=fov, focus_distance=distance)


def pose_matrix(pose: ArrayLike, what: str) -> Matrix:
    """Return a pose as a matrix of its own.

    Raises:
        Error: It is not a finite matrix of 4 x 4; the error begins with `what`.
    """
    try:
        matrix = np.array(pose, np.float64)
    except (TypeError, ValueError):
        matrix = np.zeros(0)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise Error(f"{what} must be a finite matrix of 4 x 4, got {shown(pose)}")
    return matrix


def inverse(pose: Matrix) -> Matrix:
    """Return the inverse of a rotation and translation."""
    inverse = np.eye(4)
    inverse[:3, :3] = pose[:3, :3].T
    inverse[:3, 3] = -inverse[:3, :3] @ pose[:3, 3]
    return inverse


def unit(vector: Matrix) -> Matrix:
    """Return a vector of length 1; of a zero vector, itself."""
    found: Matrix = vector / max(float(np.linalg.norm(vector)), 1e-300)
    return found


def point_of(vector: Matrix) -> Point:
    """Return an array of three numbers as a point."""
    x, y, z = vector.tolist()
    return Point(x, y, z)


def three_numbers(point: Sequence[float] | Matrix, what: str, *, finite: bool = False) -> Matrix:
    """Return a point as an array.

    Raises:
        Error: It is not three numbers, or not finite ones; the error begins with `what`.
    """
    try:
        at = np.array([float(number) for number in point])
    except (TypeError, ValueError, OverflowError):
        at = np.zeros(0)
    if at.shape != (3,) or (finite and not np.isfinite(at).all()):
        numbers = "three finite numbers" if finite else "three numbers"
        raise Error(f"{what} must be {numbers}, x, y and z in metres, not {shown(point)}")
    return at


def quaternion_of(pose: Matrix) -> tuple[float, float, float, float]:
    """Return a pose's rotation as x, y, z, w (Bar-Itzhack's method)."""
    r = pose[:3, :3]
    symmetric = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
            [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], 0],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)],
        ]
    )
    # The lower triangle alone is read; the largest eigenvalue comes last.
    x, y, z, w = np.linalg.eigh(symmetric)[1][:, -1].tolist()
    return x, y, z, w
