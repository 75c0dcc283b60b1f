"""Markers as records of numpy arrays: ``visualization_msgs/Marker`` of ROS 1 and ROS 2, checked."""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rosglass.errors import Error
from rosglass.scene.render.arrays import are_drawable, check_numbers
from rosglass.scene.render.drawing import OPAQUE
from rosglass.scene.render.matrices import poses_matrices
from rosglass.scene.render.mesh_shapes import BOX, CONE, CYLINDER, SPHERE, Shape

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TypeAlias

    from numpy.typing import NDArray

    Matrix: TypeAlias = NDArray[np.float64]
    _Instances: TypeAlias = tuple[tuple[Shape, ...], tuple[Matrix, ...]]

__all__ = [
    "ARROW",
    "ARROW_SHAPES",
    "ARROW_STRIP",
    "CUBE",
    "CUBE_LIST",
    "CYLINDER_TYPE",
    "DELETE",
    "DELETE_ALL",
    "LINE_LIST",
    "LINE_STRIP",
    "MAX_MARKERS",
    "MESH",
    "POINTS",
    "SPHERE_LIST",
    "SPHERE_TYPE",
    "TEXT",
    "TRIANGLE_LIST",
    "MarkerRecord",
    "instances_of",
    "read_marker",
    "read_markers",
    "scale_matrix",
    "triangles_of",
]

# visualization_msgs/Marker: types and actions.
ARROW, CUBE, SPHERE_TYPE, CYLINDER_TYPE, LINE_STRIP, LINE_LIST = range(6)
CUBE_LIST, SPHERE_LIST, POINTS, TEXT, MESH, TRIANGLE_LIST, ARROW_STRIP = range(6, 13)
_ADD, DELETE, DELETE_ALL = 0, 2, 3
_NAMES = [
    *("arrow", "cube", "sphere", "cylinder", "line_strip", "line_list", "cube_list"),
    *("sphere_list", "points", "text_view_facing", "mesh_resource", "triangle_list", "arrow_strip"),
]
_MAX_POINTS, MAX_MARKERS = 2_000_000, 100_000
#: Types whose points may have a colour each.
_COLORED = (LINE_STRIP, LINE_LIST, CUBE_LIST, SPHERE_LIST, POINTS, TRIANGLE_LIST)
#: Share of an arrow between two points that is its head, where no length is given, as in RViz.
_HEAD_SHARE = 0.23
#: Turns z, along which cylinders and cones stand, to x, along which arrows point.
_TO_X = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
#: Shapes of markers that always consist of the same ones.
_SOLIDS: dict[int, tuple[Shape, ...]] = {
    CUBE: (BOX,),
    SPHERE_TYPE: (SPHERE,),
    CYLINDER_TYPE: (CYLINDER,),
}
ARROW_SHAPES = (CYLINDER, CONE)
_NO_POINTS, _NO_COLORS = np.zeros((0, 3), np.float32), np.zeros((0, 4), np.float32)
#: Directions of the scale that count, where not all do.
_SCALED = {LINE_STRIP: "x", LINE_LIST: "x", POINTS: "xy", TEXT: "z", ARROW_STRIP: "xy"}
#: Points that numpy converts at once: for two million, the GUI thread would wait for 0.2 s.
_ROWS_AT_ONCE = 10_000
#: Metres below which a scale is 0.
_LEAST_M = 1e-18
#: Metres that are drawn for a scale of 0: surfaces without thickness have no shade.
_THIN_M = 1e-4


class MarkerRecord(NamedTuple):
    """One marker, read from its message.

    Attributes:
        key: Its namespace and id.
        kind: Its type.
        action: The action, as in the message.
        frame: Its frame.
        stamp: Its time in nanoseconds; 0 for the newest.
        pose: In its frame, 4 x 4.
        scale: x, y, z in metres.
        color: RGBA.
        lifetime: Seconds; 0 for ever.
        locked: Whether it moves with its frame.
        points: (n, 3), metres.
        colors: (n, 4) or (0, 4).
        text: The text of texts.
        resource: URI of a mesh.
        embedded: Whether a mesh has its own colours.
        problem: Why it is not drawn, in words; empty otherwise.
        warning: Why it may not look as it should, in words; empty otherwise.
        instances: Shapes that it consists of, where these are always the same ones, and the matrix
            of each in its frame; None to compute them when it is drawn.
        triangles: Of a triangle list, which may be long: its shape; None to make it when it is
            drawn.
        size: About how many bytes its points, colours and text take.
    """

    key: tuple[str, int]
    kind: int
    action: int
    frame: str = ""
    stamp: int = 0
    pose: NDArray[np.float64] = np.eye(4)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    lifetime: float = 0.0
    locked: bool = False
    points: NDArray[np.float32] = _NO_POINTS
    colors: NDArray[np.float32] = _NO_COLORS
    text: str = ""
    resource: str = ""
    embedded: bool = False
    problem: str = ""
    warning: str = ""
    instances: _Instances | None = None
    triangles: Shape | None = None
    size: int = 0


def read_marker(message: Any, part: tuple[str, int] | None = None) -> MarkerRecord:
    """Return the record of a ``visualization_msgs/Marker`` of ROS 1 or ROS 2.

    What cannot be drawn has the reason in :attr:`MarkerRecord.problem`.

    Args:
        message: The message.
        part: Its key where it is part of an interactive marker: it has no namespace and id of its
            own then, and a scale of 0 is 1 m, as in RViz.
    """
    (record,) = _read_all([message], part)
    return record


def _read_all(messages: Sequence[Any], part: tuple[str, int] | None = None) -> list[MarkerRecord]:
    """Return the records of markers; what numpy computes, it computes for all of them at once."""
    rows = []
    for message in messages:
        p, q = message.pose.position, message.pose.orientation
        s, c = message.scale, message.color
        rows.append((p.x, p.y, p.z, q.x, q.y, q.z, q.w, s.x, s.y, s.z, c.r, c.g, c.b, c.a))
    numbers = np.array(rows, np.float64).reshape(-1, 14)
    finite: NDArray[np.bool_] = np.asarray(are_drawable(numbers).all(axis=1))
    sizes = numbers[:, 7:10]
    sizes[np.abs(sizes) < _LEAST_M] = 0.0
    if part is not None:
        sizes[sizes == 0] = 1.0
    warnings: dict[int, str] = {}
    for at in np.flatnonzero((sizes == 0).any(axis=1)).tolist():
        message, (x, y, z) = messages[at], sizes[at].tolist()
        if finite[at] and 0 <= message.type <= ARROW_STRIP:
            sizes[at], warnings[at] = _without_zeros(message.type, (x, y, z), len(message.points))
    with np.errstate(invalid="ignore", over="ignore"):
        poses = poses_matrices(numbers[:, :3], numbers[:, 3:7])
        scaled = poses.copy()
        scaled[:, :3, :3] *= sizes[:, np.newaxis]
    return [
        _read_one(message, part, row, bool(finite[at]), warnings.get(at, ""), poses[at], scaled[at])
        for at, (message, row) in enumerate(zip(messages, numbers.tolist(), strict=True))
    ]


def _read_one(
    message: Any,
    part: tuple[str, int] | None,
    numbers: list[float],
    is_finite: bool,
    warning: str,
    pose: NDArray[np.float64],
    scaled: NDArray[np.float64],
) -> MarkerRecord:
    """Return the record of a marker.

    Args:
        message: The message.
        part: As for :func:`read_marker`.
        numbers: Pose, scale and colour.
        is_finite: Whether all of these are, and can be drawn.
        warning: The warning about the record.
        pose: Matrix of the pose.
        scaled: The same, multiplied with the scale.
    """
    key, kind, action = (message.ns, message.id), message.type, message.action
    if part is not None:
        key, action = part, _ADD
    if action in (DELETE, DELETE_ALL):
        return MarkerRecord(key, kind, action)
    frame, stamp, lifetime = message.header.frame_id.lstrip("/"), message.header.stamp, 0.0
    if "secs" in stamp:  # hasattr() would look for similar names
        at = stamp.secs * 1_000_000_000 + stamp.nsecs
        lifetime = message.lifetime.secs + message.lifetime.nsecs * 1e-9
    else:
        at = stamp.sec * 1_000_000_000 + stamp.nanosec
        lifetime = message.lifetime.sec + message.lifetime.nanosec * 1e-9
    problem, count, tints = "", len(message.points), len(message.colors)
    if action != _ADD:
        problem = f"action {action}: expected 0 (add), 2 (delete) or 3 (delete all)"
    elif not 0 <= kind <= ARROW_STRIP:
        problem = f"type {kind}: expected 0 to {ARROW_STRIP}"
    elif not frame and part is None:
        problem = "header.frame_id is empty: the publisher has to name the frame"
    elif not is_finite:
        problem = _numbers_problem(numbers)
    elif count > _MAX_POINTS:
        problem = f"points: {count} are more than the {_MAX_POINTS} that are drawn"
    elif count or kind not in _SOLIDS:
        problem = _points_problem(kind, count)
    if problem:
        return MarkerRecord(key, kind, action, frame, at, problem=problem)
    points, colors = _NO_POINTS, _NO_COLORS
    if count:
        points = _rows(message.points, attrgetter("x", "y", "z"), 3)
        try:
            check_numbers("points", points)
        except Error as error:
            return MarkerRecord(key, kind, action, frame, at, problem=str(error))
    if tints:
        colors = _rows(message.colors, attrgetter("r", "g", "b", "a"), 4)
        warning = warning or _colors_warning(kind, count, colors)
        colors = np.clip(np.nan_to_num(colors, nan=0.0, posinf=1.0, neginf=0.0), 0, 1)
    x, y, z, red, green, blue, alpha = numbers[7:]
    shapes = _SOLIDS.get(kind)
    record = MarkerRecord(
        key,
        kind,
        action,
        frame,
        at,
        # Copies: a record must not hold the arrays of all markers of its message.
        pose.copy(),
        (x, y, z),
        (red, green, blue, alpha),
        max(lifetime, 0.0),
        message.frame_locked,
        points,
        colors,
        message.text,
        message.mesh_resource,
        message.mesh_use_embedded_materials,
        "",
        warning,
        None if shapes is None else (shapes, (scaled.copy(),)),
        None,
        points.nbytes + colors.nbytes + len(message.text),
    )
    if shapes is None:
        record = record._replace(instances=instances_of(record))
        if kind == TRIANGLE_LIST:
            try:
                triangles = triangles_of(record)
            except Error as error:
                return MarkerRecord(key, kind, action, frame, at, problem=str(error))
            record = record._replace(triangles=triangles, size=record.size + triangles.size)
    return record


def _without_zeros(
    kind: int, size: tuple[float, float, float], count: int
) -> tuple[tuple[float, float, float], str]:
    """Return a scale without zeros where it counts, and a warning if there was one."""
    axes = "xy" if kind == ARROW and count else _SCALED.get(kind, "xyz")
    x, y, z = (n or _THIN_M if axis in axes else n for axis, n in zip("xyz", size, strict=True))
    # As in RViz, an arrow may be flat.
    if (x, y, z) == size or (kind == ARROW and size[0] and size[1]):
        return (x, y, z), ""
    return (x, y, z), f"scale {size} of a {_NAMES[kind]} is 0 in a direction: drawn as {_THIN_M} m"


def _rows(items: Sequence[Any], read: Callable[[Any], Any], width: int) -> NDArray[np.float32]:
    """Return numbers of each item, (n, width); numpy holds the GIL for some of them at a time."""
    rows = np.empty((len(items), width), np.float32)
    for start in range(0, len(items), _ROWS_AT_ONCE):
        some = items[start : start + _ROWS_AT_ONCE]
        with np.errstate(over="ignore"):
            rows[start : start + len(some)] = [read(item) for item in some]
    return rows


def _numbers_problem(numbers: list[float]) -> str:
    """Return which of pose, scale and colour has a number that cannot be drawn."""
    try:
        for name, part in (
            ("pose", numbers[:7]),
            ("scale", numbers[7:10]),
            ("color", numbers[10:]),
        ):
            check_numbers(name, part)
    except Error as error:
        return str(error)
    return ""


def _colors_warning(kind: int, points: int, colors: NDArray[np.float32]) -> str:
    """Return the problem with the colours of points; empty without one."""
    if kind not in _COLORED:
        return ""
    if len(colors) not in ((0, points, points // 3) if kind == TRIANGLE_LIST else (0, points)):
        return f"colors: {len(colors)} for {points} points: they have the marker's colour"
    return "" if np.isfinite(colors).all() else "colors: a number is not finite: drawn as 0 or 1"


def _points_problem(kind: int, count: int) -> str:
    if kind == LINE_LIST and count % 2:
        return f"points: {count} are not pairs, which a line_list needs"
    if kind == TRIANGLE_LIST and (count % 3 or not count):
        return f"points: {count} are not triples, which a triangle_list needs"
    if kind == ARROW and count == 1:
        return "points: an arrow has none, or start and end"
    if kind == LINE_STRIP and count < 2:
        return f"points: {count}, where a line_strip needs 2"
    return ""


def scale_matrix(x: float, y: float, z: float, along: float = 0.0) -> NDArray[np.float64]:
    """Return the matrix that scales by x, y, z and moves along z, in metres."""
    matrix = np.diag([x, y, z, 1.0])
    matrix[2, 3] = along
    return matrix


def instances_of(marker: MarkerRecord) -> _Instances:
    """Return the shapes that a marker consists of, where these are always the same ones."""
    x, y, z = marker.scale
    if marker.kind in _SOLIDS:
        return _SOLIDS[marker.kind], (marker.pose @ scale_matrix(x, y, z),)
    if marker.kind != ARROW:
        return (), ()
    if not len(marker.points):
        # Proportions of RViz: 77 % shaft, and a head of twice its width.
        place = marker.pose @ _TO_X
        shaft = scale_matrix(y, z, 0.77 * x, 0.385 * x)
        head = scale_matrix(2 * y, 2 * z, 0.23 * x, 0.77 * x)
        return ARROW_SHAPES, (place @ shaft, place @ head)
    start, end = marker.points[0].astype(np.float64), marker.points[1].astype(np.float64)
    way = end - start
    length = float(np.linalg.norm(way))
    if length < 1e-9 or not np.isfinite(length):
        return (), ()
    tip = min(z, length) if z else _HEAD_SHARE * length
    place = marker.pose @ _standing(start, way / length)
    return ARROW_SHAPES, (
        place @ scale_matrix(x, x, length - tip, (length - tip) / 2),
        place @ scale_matrix(y, y, tip, length - tip),
    )


def _standing(origin: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a pose at a point whose z is along a direction of length 1."""
    helper = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = np.cross(z, helper)
    y /= np.linalg.norm(y)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = np.cross(y, z), y, z, origin
    return pose


def triangles_of(marker: MarkerRecord) -> Shape:
    """Return the shape of a triangle list.

    Raises:
        Error: A point times the scale cannot be drawn.
    """
    points = marker.points * np.array(marker.scale, np.float32)
    check_numbers("points times scale", points)
    colors, alpha = marker.colors, marker.color[3]
    # RViz's rules for the opacity of vertices, and of triangles.
    if len(colors) == len(points):
        blended = bool((colors[:, 3] < OPAQUE).any())
    elif len(colors) == len(points) // 3:
        colors, blended = np.repeat(colors, 3, axis=0), alpha < OPAQUE
    else:
        return Shape(points)
    each = colors[:, 3:] * alpha if blended else np.ones((len(points), 1), np.float32)
    return Shape(points, colors=np.hstack([colors[:, :3], each]))


def read_markers(message: Any) -> list[MarkerRecord]:
    """Return the records of a ``Marker`` or ``MarkerArray``.

    Raises:
        Error: There are too many.
    """
    if "markers" not in message:
        return [read_marker(message)]
    count = len(message.markers)
    if count > MAX_MARKERS:
        raise Error(f"markers: {count} are more than the {MAX_MARKERS} that are shown")
    return _read_all(message.markers)
