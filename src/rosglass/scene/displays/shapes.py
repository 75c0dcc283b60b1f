"""Axes and arrows made of cylinders and cones, many at once; what several displays draw."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.scene.render.drawing import Mesh
from rosglass.scene.render.matrices import stack_poses
from rosglass.scene.render.mesh_shapes import CONE, CYLINDER
from rosglass.scene.render.scene_tree import Group

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


__all__ = ["ALONG", "ArrowShapes", "AxesShapes"]

#: Turns z, along which cylinders and cones stand, to x, y and z.
ALONG = np.array(
    [
        [[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]],
        [[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]],
        np.eye(4),
    ]
)
_COLORS = np.array([[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1]], np.float32)


def _along(
    length: ArrayLike, diameter: ArrayLike, start: ArrayLike, count: int
) -> NDArray[np.float64]:
    """Return matrices that scale a shape of height 1 along z, and move it to a start."""
    out = np.zeros((count, 4, 4))
    out[:, 0, 0] = out[:, 1, 1] = diameter
    out[:, 2, 2] = length
    out[:, 2, 3] = start
    out[:, 3, 3] = 1
    return out


class AxesShapes(Group):
    """Red, green and blue cylinders along x, y and z of any number of poses.

    Args:
        owner: The result of picking them.
    """

    def __init__(self, owner: Any = None) -> None:
        super().__init__()
        self._mesh = Mesh(CYLINDER)
        self._mesh.owner = owner
        self._mesh.set_instances([])
        self.add(self._mesh)

    def set_axes(
        self, poses: Any, length: ArrayLike, radius: ArrayLike, alpha: ArrayLike = 1.0
    ) -> None:
        """Draw axes.

        Args:
            poses: (n, 4, 4).
            length: Metres, for each or all.
            radius: Metres, for each or all; across an axis, as RViz takes what it calls radius.
            alpha: Opacity, for each or all.
        """
        at = stack_poses(poses)
        length = np.broadcast_to(np.asarray(length, np.float64), len(at))
        local = _along(length, radius, length / 2, len(at))
        matrices = at[:, np.newaxis] @ (ALONG @ local[:, np.newaxis])
        colors = np.tile(_COLORS, (len(at), 1))
        colors[:, 3] = np.repeat(np.broadcast_to(np.asarray(alpha), len(at)), 3)
        self._mesh.set_instances(matrices.reshape(-1, 4, 4), colors if len(at) else (1, 1, 1, 1))


class ArrowShapes(Group):
    """Arrows along x of any number of poses: a shaft from their origin, then a head.

    Args:
        owner: The result of picking them.
    """

    def __init__(self, owner: Any = None) -> None:
        super().__init__()
        self._shafts, self._heads = Mesh(CYLINDER), Mesh(CONE)
        for mesh in (self._shafts, self._heads):
            mesh.owner = owner
            mesh.set_instances([])
            self.add(mesh)

    def set_arrows(
        self,
        poses: Any,
        shaft: tuple[ArrayLike, ArrayLike],
        head: tuple[ArrayLike, ArrayLike],
        colors: ArrayLike,
        head_colors: ArrayLike | None = None,
    ) -> None:
        """Draw arrows.

        Args:
            poses: (n, 4, 4).
            shaft: Length and diameter in metres, for each or all.
            head: Length and diameter in metres, for each or all.
            colors: RGBA from 0 to 1, for each or all.
            head_colors: Those of the heads, if they are others.
        """
        at = stack_poses(poses) @ ALONG[0]
        count = len(at)
        length = np.broadcast_to(np.asarray(shaft[0], np.float64), count)
        middle = _along(length, shaft[1], length / 2, count)
        tip = _along(head[0], head[1], length, count)
        self._shafts.set_instances(at @ middle, colors)
        self._heads.set_instances(at @ tip, colors if head_colors is None else head_colors)
