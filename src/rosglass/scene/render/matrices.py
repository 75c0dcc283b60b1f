"""Poses as matrices of 4 x 4, one or many at once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import Error
from rosglass.scene.render.arrays import check_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray


__all__ = [
    "instance_matrix",
    "matrix_of",
    "pose_along",
    "poses_matrices",
    "rotation_of_z_to",
    "stack_poses",
]


def instance_matrix(
    position: Sequence[float] = (0.0, 0.0, 0.0),
    rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
    scale: Sequence[float] | float = 1.0,
) -> NDArray[np.float64]:
    """Return the matrix of a position, a quaternion (x, y, z, w) and a scale.

    A quaternion of length 0 counts as the identity; others are normalised, as in RViz.
    """
    x, y, z, w = (float(number) for number in rotation)
    most = max(abs(x), abs(y), abs(z), abs(w))
    if 0 < most < math.inf:
        # Squares of very small numbers are 0, or so coarse that their sum is.
        x, y, z, w = x / most, y / most, z / most, w / most
    n = x * x + y * y + z * z + w * w
    m = np.eye(4)
    if n > 0 and math.isfinite(n):
        s = 2.0 / n
        m[0, 0], m[0, 1], m[0, 2] = (
            1 - s * (y * y + z * z),
            s * (x * y - z * w),
            s * (x * z + y * w),
        )
        m[1, 0], m[1, 1], m[1, 2] = (
            s * (x * y + z * w),
            1 - s * (x * x + z * z),
            s * (y * z - x * w),
        )
        m[2, 0], m[2, 1], m[2, 2] = (
            s * (x * z - y * w),
            s * (y * z + x * w),
            1 - s * (x * x + y * y),
        )
    m[:3, :3] *= np.broadcast_to(np.asarray(scale, np.float64), 3)
    m[:3, 3] = position
    return m


def matrix_of(pose: Any) -> NDArray[np.float64]:
    """Return the matrix of a ``geometry_msgs/Pose``.

    Raises:
        Error: It has numbers that cannot be drawn, or an invalid quaternion.
    """
    at, turn = pose.position, pose.orientation
    position, rotation = (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)
    check_numbers("pose.position", position)
    check_numbers("pose.orientation", rotation)
    length = sum(number * number for number in rotation)
    if length and abs(length - 1.0) > 0.1:
        raise Error(f"pose: the quaternion {rotation} is not normalised")
    return instance_matrix(position, rotation)


def stack_poses(poses: Any) -> NDArray[np.float64]:
    """Return matrices as one array of shape (n, 4, 4), which may be empty."""
    return np.asarray(poses, np.float64).reshape(-1, 4, 4)


def poses_matrices(positions: Any, rotations: Any) -> NDArray[np.float64]:
    """Return matrices (n, 4, 4) of positions (n, 3) and quaternions x, y, z, w (n, 4).

    A quaternion of length 0 counts as the identity; others are normalised, as in RViz.
    """
    at = np.asarray(positions, np.float64).reshape(-1, 3)
    q = np.asarray(rotations, np.float64).reshape(-1, 4)
    length = (q**2).sum(axis=1)
    q = np.where(length[:, np.newaxis] > 0, q, (0.0, 0.0, 0.0, 1.0))
    x, y, z, w = (q / np.sqrt(np.where(length > 0, length, 1.0))[:, np.newaxis]).T
    out = np.zeros((len(at), 4, 4))
    out[:, 0, 0], out[:, 0, 1] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w)
    out[:, 0, 2], out[:, 1, 0] = 2 * (x * z + y * w), 2 * (x * y + z * w)
    out[:, 1, 1], out[:, 1, 2] = 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    out[:, 2, 0], out[:, 2, 1] = 2 * (x * z - y * w), 2 * (y * z + x * w)
    out[:, 2, 2], out[:, :3, 3], out[:, 3, 3] = 1 - 2 * (x * x + y * y), at, 1
    return out


def rotation_of_z_to(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shortest rotation, 3 x 3, from z to a direction of length 1."""
    x, y, z = axis.tolist()
    if z < -1 + 1e-9:
        return np.diag([1.0, -1.0, -1.0])
    u, v = x / (1 + z), y / (1 + z)
    return np.array([[1 - x * u, -x * v, x], [-y * u, 1 - y * v, y], [-x, -y, z]])


def pose_along(x: NDArray[np.float64], origin: ArrayLike = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
    """Return a pose at a point whose x is along a direction of length 1, 4 x 4."""
    helper = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = np.cross(helper, x)
    y /= np.linalg.norm(y)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = x, y, np.cross(x, y), origin
    return pose
