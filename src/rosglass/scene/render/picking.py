"""Finds drawables under a pixel or in a rectangle, without the GPU.

The answer is available at once, on every graphics interface; 200,000 points take a few
milliseconds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.scene.render.drawing import Labels, Lines, MapImage, Mesh, Points

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import TypeAlias

    from numpy.typing import NDArray

    from rosglass.scene.render.camera import Camera
    from rosglass.scene.render.scene_tree import Drawable

    _Placed: TypeAlias = tuple[Drawable, NDArray[np.float64], float]

__all__ = ["Hit", "Selected", "pick", "select"]

#: How far beside a triangle counts as on it, as a share of its sides.
_EDGE = 1e-6
_Place = tuple[float, float]


class Hit(NamedTuple):
    """A found point, line or instance.

    Attributes:
        drawable: The drawable; its `owner` is the display or part of one.
        number: Index of the point, line or instance.
        point: The hit point in the fixed frame, metres.
        distance: Metres from the camera.
    """

    drawable: Drawable
    number: int
    point: tuple[float, float, float]
    distance: float


class Selected(NamedTuple):
    """The part of one drawable that is in a rectangle.

    Attributes:
        drawable: The drawable.
        indices: Indices of its points, lines or instances.
    """

    drawable: Drawable
    indices: NDArray[np.intp]


def pick(
    drawables: Iterable[_Placed], camera: Camera, x: float, y: float, radius: float = 2.0
) -> Hit | None:
    """Return the hit nearest to the camera under a point of the image.

    Args:
        drawables: From :meth:`rosglass.scene.render.scene_tree.Group.drawables`.
        camera: The camera of the image.
        x: Units of the item, from its left edge.
        y: The same, from its upper edge.
        radius: How far from there points and lines may be, beside their own size.
    """
    origin, direction = (np.array(part) for part in camera.ray(x, y))
    best: Hit | None = None
    for drawable, pose, alpha in drawables:
        if drawable.owner is None or alpha <= 0:
            continue
        if isinstance(drawable, Points):
            found = _pick_points(drawable, pose, camera, x, y, radius)
        elif isinstance(drawable, Lines):
            found = _pick_lines(drawable, pose, camera, x, y, radius)
        elif isinstance(drawable, Mesh):
            found = _pick_mesh(drawable, pose, origin, direction)
        elif isinstance(drawable, MapImage):
            found = _pick_map(drawable, pose, origin, direction)
        elif isinstance(drawable, Labels):
            found = _pick_labels(drawable, pose, camera, x, y)
        else:
            continue
        if found is not None:
            index, point = found
            far = float(np.linalg.norm(point - np.array(camera.eye)))
            if best is None or far < best.distance:
                place = (float(point[0]), float(point[1]), float(point[2]))
                best = Hit(drawable, index, place, far)
    return best


def select(
    drawables: Iterable[_Placed], camera: Camera, corner: _Place, opposite: _Place
) -> Iterator[Selected]:
    """Iterate over everything in a rectangle, hidden or not; meshes count by their middle.

    Args:
        drawables: From :meth:`rosglass.scene.render.scene_tree.Group.drawables`.
        camera: The camera of the image.
        corner: x and y, units of the item, from its left and upper edge.
        opposite: The opposite corner.
    """
    (left, right), (top, bottom) = (sorted(pair) for pair in zip(corner, opposite, strict=True))
    for drawable, pose, alpha in drawables:
        if drawable.owner is None or alpha <= 0:
            continue
        if isinstance(drawable, Points):
            at: NDArray[Any] = drawable.xyz()
        elif isinstance(drawable, Lines):
            at = (drawable.rows["start"] + drawable.rows["end"]) / 2
        elif isinstance(drawable, Mesh) and drawable.shape.box is not None:
            middle = np.append(sum(drawable.shape.box) / 2, 1.0)
            at = (_matrices(drawable) @ middle)[:, :3]
        else:
            continue
        seen, far = _project(at, pose, camera)
        with np.errstate(invalid="ignore"):
            inside = (far > 0) & (seen[:, 0] >= left) & (seen[:, 0] <= right)
            inside &= (seen[:, 1] >= top) & (seen[:, 1] <= bottom)
        indices = np.flatnonzero(inside)
        if len(indices):
            yield Selected(drawable, indices)


def _matrices(mesh: Mesh) -> NDArray[np.float64]:
    matrices: NDArray[np.float64] = (
        mesh.instances["matrix"].reshape(-1, 4, 4).transpose(0, 2, 1).astype(np.float64)
    )
    return matrices


def _project(
    points: NDArray[Any], pose: NDArray[np.float64], camera: Camera
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return where points are seen, and how far ahead of the camera they are, metres."""
    to_eye = camera.view @ pose
    whole = (camera.projection @ to_eye).astype(np.float32)
    width, height = camera.size
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        clip = points @ whole[(0, 1, 3), :3].T + whole[(0, 1, 3), 3]
        seen = clip[:, :2] / clip[:, 2:]
        half = np.array((width / 2, -height / 2), np.float32)
        seen = seen * half + np.abs(half)
        far = -(points @ to_eye[2, :3].astype(np.float32) + np.float32(to_eye[2, 3]))
    return seen, far


def _units_per_metre(camera: Camera, far: Any) -> Any:
    scale = camera.projection[1, 1] * camera.size[1] / 2
    return scale if camera.is_orthographic else scale / np.maximum(far, 1e-6)


def _pick_points(
    points: Points, pose: NDArray[np.float64], camera: Camera, x: float, y: float, radius: float
) -> tuple[int, NDArray[np.float64]] | None:
    xyz = points.xyz()
    to_eye = camera.view @ pose
    clip = camera.projection @ to_eye
    width, height = camera.size
    # Pixels from the place in x and y, both times w; w; and metres ahead of the camera.
    rows = np.stack(
        [
            (clip[0] - (2 * x / width - 1) * clip[3]) * width / 2,
            (clip[1] - (1 - 2 * y / height) * clip[3]) * height / 2,
            clip[3],
            -to_eye[2],
        ]
    ).astype(np.float32)
    with np.errstate(invalid="ignore", over="ignore"):
        right, down, w, far = rows[:, :3] @ np.ascontiguousarray(xyz).T + rows[:, 3:]
        if points.style == "points":
            reach = (radius + points.size / 2) * w
        else:
            metres = points.sizes(xyz) / 2
            reach = radius * w + metres * (camera.projection[1, 1] * height / 2)
        near = (far > 0) & (np.abs(right) <= reach) & (np.abs(down) <= reach)
    indices = np.flatnonzero(near)
    if not len(indices):
        return None
    index = int(indices[np.argmin(far[indices])])
    return index, (pose @ np.append(xyz[index].astype(np.float64), 1.0))[:3]


def _pick_lines(
    lines: Lines, pose: NDArray[np.float64], camera: Camera, x: float, y: float, radius: float
) -> tuple[int, NDArray[np.float64]] | None:
    start, end = lines.rows["start"], lines.rows["end"]
    a, far_a = _project(start, pose, camera)
    b, far_b = _project(end, pose, camera)
    with np.errstate(invalid="ignore", divide="ignore"):
        way = b - a
        length = np.maximum((way**2).sum(axis=1), 1e-9)
        share = np.clip((((x, y) - a) * way).sum(axis=1) / length, 0, 1)
        off = np.hypot(*((x, y) - (a + share[:, np.newaxis] * way)).T)
        far = far_a + (far_b - far_a) * share
        width = lines.width * (_units_per_metre(camera, far) if lines.in_metres else 1)
        near = (far_a > 0) & (far_b > 0) & (off <= radius + width / 2)
    indices = np.flatnonzero(near)
    if not len(indices):
        return None
    index = int(indices[np.argmin(far[indices])])
    # The share on the screen is not that in space: by the depths of the ends.
    s, depth_a, depth_b = float(share[index]), float(far_a[index]), float(far_b[index])
    if not camera.is_orthographic:
        s = s * depth_a / (depth_b + s * (depth_a - depth_b))
    at = start[index].astype(np.float64) * (1 - s) + end[index].astype(np.float64) * s
    return index, (pose @ np.append(at, 1.0))[:3]


def _pick_mesh(
    mesh: Mesh,
    pose: NDArray[np.float64],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
) -> tuple[int, NDArray[np.float64]] | None:
    if mesh.shape.box is None:
        return None
    matrices = pose @ _matrices(mesh)
    turn = matrices[:, :3, :3]
    good = np.abs(np.linalg.det(turn)) > 1e-18
    numbers = np.flatnonzero(good)
    if not len(numbers):
        return None
    back = np.linalg.inv(turn[numbers])
    starts = np.einsum("nij,nj->ni", back, origin - matrices[numbers, :3, 3])
    ways = back @ direction
    low, high = mesh.shape.box
    with np.errstate(invalid="ignore", divide="ignore"):
        one, two = (low - 1e-9 - starts) / ways, (high + 1e-9 - starts) / ways
        enter = np.nanmax(np.minimum(one, two), axis=1)
        leave = np.nanmin(np.maximum(one, two), axis=1)
    hit = np.flatnonzero((enter <= leave) & (leave >= 0))
    best, found = np.inf, -1
    for at in hit[np.argsort(enter[hit])]:
        if enter[at] > best:
            break
        share = _meet_triangles(mesh, starts[at], ways[at])
        if share < best:
            best, found = share, int(numbers[at])
    return None if found < 0 else (found, origin + best * direction)


def _meet_triangles(mesh: Mesh, start: NDArray[np.float64], way: NDArray[np.float64]) -> float:
    """Return how far along a ray the first triangle is (Moeller and Trumbore); inf for none."""
    at, faces = mesh.shape.rows["position"], mesh.shape.faces
    a = at[faces[:, 0]]
    ab, ac = at[faces[:, 1]] - a, at[faces[:, 2]] - a
    with np.errstate(invalid="ignore", divide="ignore"):
        p = np.cross(way, ac)
        scale = 1.0 / (ab * p).sum(axis=1)
        s = start - a
        u = (s * p).sum(axis=1) * scale
        q = np.cross(s, ab)
        v = (q @ way) * scale
        far = (ac * q).sum(axis=1) * scale
        # A ray along the edge of two triangles must not pass between them.
        met = (u >= -_EDGE) & (v >= -_EDGE) & (u + v <= 1 + _EDGE) & (far >= 0)
    return float(far[met].min()) if met.any() else np.inf


def _pick_map(
    image: MapImage,
    pose: NDArray[np.float64],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
) -> tuple[int, NDArray[np.float64]] | None:
    back = np.linalg.inv(pose)
    start, way = (back @ np.append(origin, 1.0))[:3], back[:3, :3] @ direction
    if abs(way[2]) < 1e-12 or (share := -start[2] / way[2]) < 0:
        return None
    x, y = start[:2] + share * way[:2]
    rows, columns = image.cells.shape
    column, row = int(x / image.size[0] * columns), int(y / image.size[1] * rows)
    if not (x >= 0 and y >= 0 and column < columns and row < rows):
        return None
    if not image.palette[image.cells[row, column], 3]:
        return None
    return row * columns + column, origin + share * direction


def _pick_labels(
    labels: Labels, pose: NDArray[np.float64], camera: Camera, x: float, y: float
) -> tuple[int, NDArray[np.float64]] | None:
    seen, far = _project(labels.positions, pose, camera)
    heights = labels.heights * (1 if labels.in_pixels else _units_per_metre(camera, far))
    # Only the renderer knows the letters; on average they are half as wide as a line is high.
    width, height = (labels.extents * (0.5, 1)).T * heights
    with np.errstate(invalid="ignore"):
        right = x - seen[:, 0] + (0 if labels.align == "left" else width / 2)
        down = y - seen[:, 1] + (0 if labels.align == "below" else height / 2)
        near = (far > 0) & (right >= 0) & (right <= width) & (down >= 0) & (down <= height)
    numbers = np.flatnonzero(near)
    if not len(numbers):
        return None
    number = int(numbers[np.argmin(far[numbers])])
    return number, (pose @ np.append(labels.positions[number].astype(np.float64), 1.0))[:3]
