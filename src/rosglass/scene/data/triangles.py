"""The triangles of meshes: what every reader of a format makes."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Floats: TypeAlias = NDArray[np.float32]
    Integers: TypeAlias = NDArray[np.int64]
    Matrix: TypeAlias = NDArray[np.float64]

__all__ = [
    "MAX_TRIANGLES",
    "Color",
    "MeshError",
    "MeshPart",
    "assemble",
    "check_count",
    "checked",
    "face_normals",
    "flat_part",
    "from_top",
    "merged",
    "moved",
    "relative",
    "triangulate",
    "unit_vectors",
]

Color: TypeAlias = tuple[float, float, float, float]

#: Meshes with more triangles are refused.
MAX_TRIANGLES = 10_000_000
#: Corners that are compared, in all, when polygons that are not convex are cut: about a second.
_MAX_COMPARISONS = 2_000_000


class MeshError(Error):
    """A mesh can't be read; the message has the file and what is wrong in it."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshPart:
    """The triangles of a mesh that have one colour and texture.

    Attributes:
        positions: Vertices in metres, (n, 3) float32.
        normals: Unit normals of the vertices, (n, 3) float32.
        uv: Coordinates in the texture, (n, 2) float32, from its top left corner; None for none.
        indices: Three vertices for each triangle, (m,) uint32; None if they are in order.
        color: Red, green, blue and opacity, 0 to 1; None if the file has none. RViz draws an STL
            file in the colour of the robot description or marker, and other files without a
            material in grey (0.6).
        texture: Path or URI of an image, or its bytes if the file contains it; None without one.
    """

    positions: Floats
    normals: Floats
    uv: Floats | None = None
    indices: NDArray[np.uint32] | None = None
    color: Color | None = None
    texture: str | bytes | None = None

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return len(self.positions if self.indices is None else self.indices) // 3


def checked(part: MeshPart, name: str) -> MeshPart:
    """Return a part whose numbers are finite; raise MeshError if its vertices are not."""
    if not np.isfinite(part.positions).all():
        bad = int(np.flatnonzero(~np.isfinite(part.positions).all(axis=1))[0])
        raise MeshError(f"{name}: vertex {bad} is not finite: {part.positions[bad].tolist()}")
    if part.uv is not None and not np.isfinite(part.uv).all():
        return replace(part, uv=np.nan_to_num(part.uv, posinf=0.0, neginf=0.0))
    return part


def check_count(name: str, triangles: int) -> None:
    """Raise MeshError for more triangles than the limit."""
    if triangles > MAX_TRIANGLES:
        raise MeshError(
            f"{name}: more than {MAX_TRIANGLES} triangles; reduce the mesh, such as with Blender's "
            "Decimate or MeshLab's Quadric Edge Collapse"
        )


def face_normals(corners: Floats) -> Floats:
    """Return the unit normals of triangles, (n, 3, 3) -> (n, 3)."""
    corners = corners.astype(np.float64)  # millimetres in metres, squared twice
    with np.errstate(all="ignore"):  # of what is not finite, which checked() refuses
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return unit_vectors(normals)[0]


def unit_vectors(vectors: NDArray[Any]) -> tuple[Floats, NDArray[np.bool_]]:
    """Return vectors at length 1, and which of them have no direction: these become z."""
    vectors = vectors.astype(np.float64)
    with np.errstate(all="ignore"):
        lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
        bad = ~((lengths > 1e-30) & (lengths < 1e30))
        lengths[bad] = 1.0
        vectors /= lengths[:, None]
    vectors[bad] = (0.0, 0.0, 1.0)
    return vectors.astype(np.float32), bad


def flat_part(positions: Floats, uv: Floats | None = None) -> MeshPart:
    """Return triangles of vertices in order, each with its own normal."""
    normals = face_normals(positions.reshape(-1, 3, 3)).repeat(3, axis=0)
    return MeshPart(np.ascontiguousarray(positions), normals, uv)


def assemble(
    positions: Floats,
    normals: Floats | None,
    uv: Floats | None,
    corners: tuple[Integers, Integers | None, Integers | None],
) -> MeshPart:
    """Return the triangles whose corners have indices into positions, normals and uv."""
    at, at_normal, at_uv = corners
    if normals is None or at_normal is None:
        return flat_part(positions[at], None if uv is None else uv[at_uv])
    key = at
    for array, index in ((normals, at_normal), (uv, at_uv)):
        if array is not None and index is not None and index is not at:
            key = key * len(array) + index
    # One index for all. A file may have many small parts of the same large arrays.
    if key is at and 8 * len(at) >= len(positions):
        used = np.zeros(len(positions), bool)
        used[at] = True
        first = np.flatnonzero(used)
        indices = (np.cumsum(used) - 1)[at]
        at = at_normal = at_uv = first
    else:
        _, first, indices = np.unique(key, return_index=True, return_inverse=True)
        at, at_normal, at_uv = at[first], at_normal[first], None if at_uv is None else at_uv[first]
    directions, bad = unit_vectors(normals[at_normal])
    part = MeshPart(
        np.ascontiguousarray(positions[at]),
        directions,
        None if uv is None else np.ascontiguousarray(uv[at_uv]),
        indices.reshape(-1).astype(np.uint32),
    )
    if bad.any():  # a corner without a direction gets that of its triangle
        faces = face_normals(part.positions[part.indices].reshape(-1, 3, 3)).repeat(3, axis=0)
        wrong = bad[part.indices]
        directions[part.indices[wrong]] = faces[wrong]  # type: ignore[index]
    return part


def triangulate(counts: Integers, points: Floats) -> Integers:
    """Cut polygons into triangles.

    Args:
        counts: Number of corners of each polygon.
        points: Position of each corner, of one polygon after the other.

    Returns:
        The corner of each corner of the triangles.
    """
    budget = _MAX_COMPARISONS
    starts = np.cumsum(counts) - counts
    fans = np.maximum(counts - 2, 0)
    firsts = np.cumsum(fans) - fans
    start = starts.repeat(fans)
    step = np.arange(len(start)) - firsts.repeat(fans) + 1
    triangles = np.stack((start, start + step, start + step + 1), axis=1)
    for polygon in _dented(counts, starts, points):
        count, at = int(counts[polygon]), int(starts[polygon])
        budget -= count
        if budget < 0:
            break  # the rest are fans: a hostile file has millions
        ears, tests = _ears(points[at : at + count], budget)
        budget -= tests
        first = int(firsts[polygon])
        triangles[first : first + len(ears)] = np.array(ears) + at
    return triangles.reshape(-1)


def _dented(counts: Integers, starts: Integers, points: Floats) -> Integers:
    """Return the polygons that are not convex."""
    many = np.flatnonzero(counts > 3)
    if not len(many):
        return many
    # The corners of these polygons, and the ones before and after them.
    sizes = counts[many]
    ends = np.cumsum(sizes)
    owner = np.arange(len(many)).repeat(sizes)
    step = np.arange(len(owner)) - (ends - sizes)[owner]
    start = starts[many][owner]
    here, after = points[start + step], points[start + (step + 1) % sizes[owner]]
    before = points[start + (step - 1) % sizes[owner]]
    with np.errstate(all="ignore"):  # of what is not finite, which checked() refuses
        turns = np.cross(here - before, after - here).astype(np.float64)
        normals = np.add.reduceat(
            np.cross(here - points[start], after - points[start]), ends - sizes
        )
        inward = np.einsum("ij,ij->i", turns, normals[owner]) < 0
    dented: Integers = many[np.unique(owner[inward])]
    return dented


def _ears(points: Floats, budget: int) -> tuple[list[tuple[int, int, int]], int]:
    """Cut the ears off a polygon that is not convex.

    Returns:
        Its triangles, and how many corners were compared.
    """
    around = np.roll(points, -1, axis=0)
    normal = np.cross(points - points[0], around - points[0]).sum(axis=0)
    axis = int(np.abs(normal).argmax())
    x, y = (points[:, (axis + side) % 3].astype(np.float64).tolist() for side in (1, 2))
    if normal[axis] < 0:
        y = [-value for value in y]
    left = list(range(len(points)))
    ears: list[tuple[int, int, int]] = []
    tests, misses, at = 0, 0, 0
    while len(left) > 3 and misses < len(left) and tests < budget:
        tests += len(left)
        a, b, c = left[at - 1], left[at], left[(at + 1) % len(left)]
        if _is_ear(a, b, c, left, x, y):
            ears.append((a, b, c))
            del left[at]
            misses = 0
            at = at - 1 if at else 0
        else:
            misses += 1
            at += 1
        at %= len(left)
    # What crosses itself has no ears: the rest is a fan.
    ears.extend((left[0], left[i], left[i + 1]) for i in range(1, len(left) - 1))
    return ears, tests


def _is_ear(a: int, b: int, c: int, left: list[int], x: list[float], y: list[float]) -> bool:
    """Return whether a corner points outwards, with no other corner in its triangle."""
    ax, ay, bx, by, cx, cy = x[a], y[a], x[b], y[b], x[c], y[c]
    if (bx - ax) * (cy - by) - (by - ay) * (cx - bx) <= 0:
        return False
    corners = {(ax, ay), (bx, by), (cx, cy)}
    for i in left:
        px, py = x[i], y[i]
        if (
            (bx - ax) * (py - ay) - (by - ay) * (px - ax) >= 0
            and (cx - bx) * (py - by) - (cy - by) * (px - bx) >= 0
            and (ax - cx) * (py - cy) - (ay - cy) * (px - cx) >= 0
            and (px, py) not in corners
        ):
            return False
    return True


def from_top(uv: Floats) -> Floats:
    """Return texture coordinates from the top left corner in place of the bottom left one."""
    turned: Floats = uv * np.array((1, -1), np.float32) + np.array((0, 1), np.float32)
    return turned


def moved(part: MeshPart, matrix: Matrix) -> MeshPart:
    """Return a part transformed by a 4x4 matrix."""
    if np.array_equal(matrix, np.eye(4)):
        return part
    with np.errstate(all="ignore"):
        a = matrix[:3, :3]
        positions = (part.positions @ a.T + matrix[:3, 3]).astype(np.float32)
        # The cofactors are the inverse transposed, also of a matrix that has no inverse.
        cofactors = np.stack((np.cross(a[1], a[2]), np.cross(a[2], a[0]), np.cross(a[0], a[1])))
        mirrored = bool(np.linalg.det(a) < 0)
        normals = unit_vectors(part.normals @ (-cofactors if mirrored else cofactors).T)[0]
    moved = replace(part, positions=positions, normals=normals)
    if not mirrored:
        return moved
    indices = part.indices
    if indices is None:
        indices = np.arange(len(positions), dtype=np.uint32)
    # A mirror turns triangles inside out.
    turned = np.ascontiguousarray(indices.reshape(-1, 3)[:, ::-1]).reshape(-1)
    return replace(moved, indices=turned)


def merged(parts: Sequence[MeshPart]) -> list[MeshPart]:
    """Join the parts that are drawn alike: exporters write hundreds."""
    groups: dict[Any, list[MeshPart]] = {}
    for part in parts:
        groups.setdefault((part.color, part.texture, part.uv is None), []).append(part)
    return [group[0] if len(group) == 1 else _joined(group) for group in groups.values()]


def _joined(parts: Sequence[MeshPart]) -> MeshPart:
    indices = None
    if any(part.indices is not None for part in parts):
        start, shifted = 0, []
        for part in parts:
            own = part.indices
            if own is None:
                own = np.arange(len(part.positions), dtype=np.uint32)
            shifted.append(own + np.uint32(start))
            start += len(part.positions)
        indices = np.concatenate(shifted)
    uvs = [part.uv for part in parts if part.uv is not None]
    return MeshPart(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate(uvs) if uvs else None,
        indices,
        parts[0].color,
        parts[0].texture,
    )


def relative(base: str, reference: str) -> str:
    """Return the path or URI of a file that a mesh file names."""
    reference = reference.strip().replace("\\", "/")
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]+://", reference) or reference.startswith("/"):
        return reference
    folder, slash, _ = base.replace(os.sep, "/").rpartition("/")
    return f"{folder}{slash}{reference.removeprefix('./')}"
