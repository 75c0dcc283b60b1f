"""The shapes of meshes: vertices and triangles, and boxes, spheres, cylinders and cones."""

from __future__ import annotations

import math
from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.errors import Error
from rosglass.scene.render.arrays import box_of, rgba_bytes, rows_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray


__all__ = ["BOX", "CONE", "CYLINDER", "SPHERE", "Shape"]

#: Largest number whose fourth power is a float32.
_MAX_FOR_NORMALS = 1e9


class Shape:
    """Vertices and triangles that meshes share, uploaded once for each.

    Args:
        positions: (n, 3), metres.
        normals: (n, 3); made from the triangles if None.
        indices: (m, 3) or (m * 3) numbers of vertices; if None, each three vertices are a triangle.
        colors: RGBA for each vertex; white if None.
        uv: (n, 2) places in the texture, from its upper left corner; 0 if None.
        one_sided: Whether triangles are seen only from the side where their corners are in
            counter-clockwise order.
        closed: Whether it is one-sided, and symmetric to x = 0: mirrored, it is still seen from
            outside.

    Raises:
        Error: The shapes of the arrays don't fit, or an index is beyond the vertices.
    """

    ROW = np.dtype(
        [("position", "<f4", 3), ("normal", "<f4", 3), ("uv", "<f4", 2), ("rgba", "u1", 4)]
    )

    def __init__(
        self,
        positions: ArrayLike,
        normals: ArrayLike | None = None,
        indices: ArrayLike | None = None,
        *,
        colors: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        one_sided: bool = False,
        closed: bool = False,
    ) -> None:
        self.one_sided, self.closed = one_sided or closed, closed
        at = rows_of("positions", positions, (3,))
        if indices is None:
            faces = np.arange(len(at) // 3 * 3, dtype=np.uint32).reshape(-1, 3)
        else:
            given = np.asarray(indices)
            if given.size % 3 or (given.size and (given.min() < 0 or given.max() >= len(at))):
                raise Error(f"indices: expected triangles of {len(at)} vertices")
            faces = np.ascontiguousarray(given, np.uint32).reshape(-1, 3)
        good: NDArray[np.bool_] = np.asarray(np.isfinite(at).all(axis=1))
        if not good.all():
            faces = faces[good[faces].all(axis=1)]
            at = np.where(good[:, np.newaxis], at, np.float32(0))
        rows = np.zeros(len(at), self.ROW)
        rows["position"] = at
        rows["normal"] = (
            _normals(at, faces) if normals is None else _fitting("normals", normals, at, 3)
        )
        rows["rgba"] = 255 if colors is None else rgba_bytes(colors, len(at))
        if uv is not None:
            rows["uv"] = _fitting("uv", uv, at, 2)
        #: A row for each vertex.
        self.rows: NDArray[Any] = rows
        #: Numbers of vertices, three for each triangle.
        self.faces: NDArray[np.uint32] = faces
        #: Whether no vertex is translucent.
        self.opaque = bool((rows["rgba"][:, 3] == 255).all())
        #: Corners of the box around it.
        used = np.zeros(len(at), bool)
        used[faces] = True
        self.box = box_of(at[used])
        self._mirrored: Shape | None = None

    @property
    def size(self) -> int:
        """Its size in bytes."""
        return self.rows.nbytes + self.faces.nbytes

    def mirrored(self) -> Shape:
        """Return the same shape with its triangles turned, to be seen from the other side."""
        if self._mirrored is None:
            other = copy(self)
            other.faces = np.ascontiguousarray(self.faces[:, ::-1])
            self._mirrored = other
        return self._mirrored


def _fitting(name: str, given: ArrayLike, at: NDArray[Any], width: int) -> NDArray[np.float32]:
    array = rows_of(name, given, (width,))
    if len(array) != len(at):
        raise Error(f"{name}: expected {len(at)}, one for each vertex, got {len(array)}")
    return np.nan_to_num(array, nan=0.0, posinf=0.0, neginf=0.0)


def _normals(at: NDArray[np.float32], faces: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Return the normals of vertices: the mean of their triangles', by area."""
    most = np.abs(at).max(initial=0.0)
    if most > _MAX_FOR_NORMALS:
        at = at / most
    a, b, c = at[faces[:, 0]], at[faces[:, 1]], at[faces[:, 2]]
    flat = np.cross(b - a, c - a)
    out = np.zeros_like(at)
    for corner in range(3):
        np.add.at(out, faces[:, corner], flat)
    length = np.linalg.norm(out, axis=1, keepdims=True)
    unit: NDArray[np.float32] = np.divide(out, length, out=np.zeros_like(out), where=length > 0)
    return unit


def _box_shape() -> Shape:
    corners, normals, uv = [], [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            normal = [side * (n == axis) for n in range(3)]
            # Each side has the whole image, as in RViz.
            up = np.array([0.0, 0.0, 1.0] if axis < 2 else [0.0, 1.0, 0.0])
            right = np.cross(up, normal)
            quad = [(-side, -1), (side, -1), (side, 1), (-side, 1)]
            for a, b in quad:
                at = [0.0, 0.0, 0.0]
                at[axis], at[u], at[v] = side * 0.5, a * 0.5, b * 0.5
                corners.append(at)
                normals.append(normal)
                uv.append([0.5 + right @ at, 0.5 - up @ at])
    first = 4 * np.arange(6)[:, np.newaxis]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return Shape(corners, normals, faces, uv=uv, closed=True)


def _turned(
    profile: list[tuple[float, float, float, float]],
    around: int = 32,
    uv: Callable[[NDArray[Any], float], NDArray[Any]] | None = None,
) -> Shape:
    """Return a shape turned around z.

    Args:
        profile: (radius, z, normal outward, normal along z) of each ring.
        around: Sides of a ring.
        uv: Places in a texture, (n, 2), of n shares of a turn and a z.
    """
    turns = np.linspace(0, 1, around + 1)
    angles = 2 * np.pi * turns
    c, s = np.cos(angles), np.sin(angles)
    at = [np.stack([r * c, r * s, np.full_like(c, z)], axis=1) for r, z, _, _ in profile]
    normal = [np.stack([n * c, n * s, np.full_like(c, m)], axis=1) for _, _, n, m in profile]
    faces = []
    for ring in range(len(profile) - 1):
        if profile[ring][:2] == profile[ring + 1][:2]:
            continue  # a sharp edge: the same ring twice, with two normals
        a = ring * (around + 1) + np.arange(around)
        b = a + around + 1
        faces += [np.stack([a, a + 1, b + 1], axis=1), np.stack([a, b + 1, b], axis=1)]
    places = None if uv is None else np.concatenate([uv(turns, z) for _, z, _, _ in profile])
    corners, normals = np.concatenate(at), np.concatenate(normal)
    return Shape(corners, normals, np.concatenate(faces), uv=places, closed=True)


def _sphere_shape(rings: int = 16) -> Shape:
    tilt = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    return _turned(
        [(0.5 * math.cos(t), 0.5 * math.sin(t), math.cos(t), math.sin(t)) for t in tilt],
        2 * rings,
        # Mapped like an image of the earth, as in RViz.
        lambda turns, z: _places(turns + 0.5, math.acos(min(max(2 * z, -1.0), 1.0)) / math.pi),
    )


def _places(across: NDArray[Any], down: float) -> NDArray[Any]:
    return np.stack([across, np.full_like(across, down)], axis=1)


#: One metre in every direction, around the origin.
BOX = _box_shape()
#: One metre in diameter, around the origin.
SPHERE = _sphere_shape()
#: One metre in diameter and height, around the origin, along z.
CYLINDER = _turned(
    [
        (0, -0.5, 0, -1),
        (0.5, -0.5, 0, -1),
        (0.5, -0.5, 1, 0),
        (0.5, 0.5, 1, 0),
        (0.5, 0.5, 0, 1),
        (0, 0.5, 0, 1),
    ],
    uv=lambda turns, z: _places(0.75 - turns, z + 0.5),
)
_SLOPE = math.hypot(1, 0.5)
#: One metre in diameter and height, from z = 0 to its tip at z = 1.
CONE = _turned(
    [
        (0, 0, 0, -1),
        (0.5, 0, 0, -1),
        (0.5, 0, 1 / _SLOPE, 0.5 / _SLOPE),
        (0, 1, 1 / _SLOPE, 0.5 / _SLOPE),
    ]
)
