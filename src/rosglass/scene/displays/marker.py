"""The displays Marker and MarkerArray: shapes, lines, points, meshes and texts that robots send.

Messages are turned into records of numpy arrays in the node's thread, all markers of one at once.
Those of one namespace are drawn together (:mod:`rosglass.scene.displays.marker_batches`), except
for meshes, lists of points, long lines, and the first triangles and translucent lines.
"""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import logging
import math
import time
from copy import copy
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar, cast
from weakref import WeakKeyDictionary

import numpy as np

from rosglass.errors import Error, TransformException
from rosglass.qml.element import single_shot
from rosglass.qml.properties import ReadOnly, report
from rosglass.qt import Signal, Slot, is_alive
from rosglass.scene.display import OUTDATED_ALPHA, Status, TopicDisplay
from rosglass.scene.displays.marker_batches import (
    MAX_JOINED_POINTS,
    LineBatch,
    SolidBatch,
    TextBatch,
    TriangleBatch,
)
from rosglass.scene.displays.robot_model import STL_ENDINGS, MeshFiles, material_of
from rosglass.scene.displays.shapes import poses_matrices
from rosglass.scene.drawing import (
    BOX,
    CONE,
    CYLINDER,
    OPAQUE,
    SPHERE,
    Drawable,
    Group,
    Labels,
    Lines,
    Mesh,
    Points,
    Shape,
    are_drawable,
    check_numbers,
)
from rosglass.scene.meshes import ending_of
from rosglass.scene.parts import Parts

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence
    from typing import TypeAlias

    from numpy.typing import NDArray

    from rosglass.qml.runtime import Runtime
    from rosglass.qt import QtCore
    from rosglass.scene.resource_retriever import ResourceRetriever
    from rosglass.scene.scene import Scene

    Matrix: TypeAlias = NDArray[np.float64]
    _Instances: TypeAlias = tuple[tuple[Shape, ...], tuple[Matrix, ...]]
    _Joint: TypeAlias = LineBatch | TextBatch | TriangleBatch

__all__ = [
    "MarkerArrayDisplay",
    "MarkerDisplay",
    "MarkerGroup",
    "MarkerMeshes",
    "MarkerRecord",
    "Markers",
    "read_marker",
]

_log = logging.getLogger("rosglass.scene")

# visualization_msgs/Marker: types and actions.
ARROW, CUBE, SPHERE_TYPE, CYLINDER_TYPE, LINE_STRIP, LINE_LIST = range(6)
CUBE_LIST, SPHERE_LIST, POINTS, TEXT, MESH, TRIANGLE_LIST, ARROW_STRIP = range(6, 13)
_ADD, _DELETE, _DELETE_ALL = 0, 2, 3
_NAMES = [
    *("arrow", "cube", "sphere", "cylinder", "line_strip", "line_list", "cube_list"),
    *("sphere_list", "points", "text_view_facing", "mesh_resource", "triangle_list", "arrow_strip"),
]
_MAX_POINTS, _MAX_MARKERS = 2_000_000, 100_000
#: Types whose points may have a color each.
_COLORED = (LINE_STRIP, LINE_LIST, CUBE_LIST, SPHERE_LIST, POINTS, TRIANGLE_LIST)
#: What lists of points are drawn as.
_POINT_STYLES = {CUBE_LIST: "boxes", SPHERE_LIST: "spheres", POINTS: "squares"}
#: Share of an arrow between two points that is its head, where no length is given, as in RViz.
_HEAD_SHARE = 0.23
#: Turns z, along which cylinders and cones stand, to x, along which arrows point.
_TO_X = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
_IDENTITY = np.eye(4)
#: What markers consist of, where these are always the same shapes.
_SOLIDS: dict[int, tuple[Shape, ...]] = {
    CUBE: (BOX,),
    SPHERE_TYPE: (SPHERE,),
    CYLINDER_TYPE: (CYLINDER,),
}
_ARROW_SHAPES = (CYLINDER, CONE)
_NO_POINTS, _NO_COLORS = np.zeros((0, 3), np.float32), np.zeros((0, 4), np.float32)
#: Directions of the scale that count, where not all do.
_SCALED = {LINE_STRIP: "x", LINE_LIST: "x", POINTS: "xy", TEXT: "z", ARROW_STRIP: "xy"}
#: Points that numpy converts at once: for two million, the GUI thread would wait for 0.2 s.
_ROWS_AT_ONCE = 10_000
#: Metres below which a scale is 0.
_LEAST_M = 1e-18
#: Metres that are drawn for a scale of 0: surfaces without thickness have no shade.
_THIN_M = 1e-4
#: Markers that wait for a transform, of which the oldest make room, and their bytes.
_MAX_LATE, _MAX_LATE_BYTES = 1000, 256 << 20
#: Bytes of the points, colors and texts of all markers that are shown.
_MAX_SHOWN_BYTES = 1 << 30
#: Seconds after which no transform of a marker's time will come any more.
_MAX_WAIT_S = 60.0
#: Seconds for which a marker may wait for the transform of its time before that is an error.
_LATE_S = 1.0
#: Lookups that fail until the other waiting markers have to wait for the next transforms.
_MAX_MISSES = 50
#: Namespaces of a topic, each drawn on its own, for each frame that markers are locked to.
_MAX_NAMESPACES = 2000
#: Meshes that are kept for further markers, their bytes, and meshes that are being read.
_MAX_MESHES, _MAX_KEPT_BYTES, _MAX_READING = 200, 256 << 20, 1000
#: Bytes of the meshes and textures of all markers of a display.
_MAX_MESH_BYTES = 2 << 30
#: Lists that are drawn together with others, and the markers of a group that are drawn alone, up to
#: which triangles and translucent lines are, too: these are sorted by distance and selected alone.
_JOINED, _MAX_ALONE = (LINE_STRIP, LINE_LIST, TRIANGLE_LIST), 100
#: Cubes whose markers are drawn together: 32 bits are exact to 0.1 mm there.
_CELL_M = 2000.0
#: Lines of the status, and markers whose problems are known.
_MAX_LINES, _MAX_PROBLEMS = 50, 1000


class MarkerRecord(NamedTuple):
    """One marker, read from its message.

    Attributes:
        key: Its namespace and id.
        kind: Its type.
        action: What to do with it.
        frame: Its frame.
        stamp: Its time in nanoseconds; 0 for the newest.
        pose: In its frame, 4 x 4.
        scale: x, y, z in metres.
        color: RGBA.
        lifetime: Seconds; 0 for ever.
        locked: Whether it moves with its frame.
        points: (n, 3), metres.
        colors: (n, 4) or (0, 4).
        text: Of texts.
        resource: URI of a mesh.
        embedded: Whether a mesh has its own colors.
        problem: Why it is not drawn, in words; empty otherwise.
        warning: Why it may not look as it should, in words; empty otherwise.
        instances: Shapes that it consists of, where these are always the same ones, and the matrix
            of each in its frame; None to compute them when it is drawn.
        triangles: Of a triangle list, which may be long: its shape; None to make it when it is
            drawn.
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

    @property
    def size(self) -> int:
        """About how many bytes it takes."""
        shape = 0 if self.triangles is None else self.triangles.size
        return self.points.nbytes + self.colors.nbytes + len(self.text) + shape


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
        numbers: Pose, scale and color.
        is_finite: Whether all of these are, and can be drawn.
        warning: Of the record.
        pose: Matrix of the pose.
        scaled: The same, multiplied with the scale.
    """
    key, kind, action = (message.ns, message.id), message.type, message.action
    if part is not None:
        key, action = part, _ADD
    if action in (_DELETE, _DELETE_ALL):
        return MarkerRecord(key, kind, action)
    frame, stamp, lifetime = message.header.frame_id.lstrip("/"), message.header.stamp, 0.0
    if hasattr(stamp, "secs"):
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
    )
    if shapes is None:
        triangles = None
        if kind == TRIANGLE_LIST:
            try:
                triangles = _triangles(record)
            except Error as error:
                return MarkerRecord(key, kind, action, frame, at, problem=str(error))
        record = record._replace(instances=_instances(record), triangles=triangles)
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
    """Return which of pose, scale and color has a number that cannot be drawn."""
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
    """Return what is wrong with the colors of points; empty if nothing is."""
    if kind not in _COLORED:
        return ""
    if len(colors) not in ((0, points, points // 3) if kind == TRIANGLE_LIST else (0, points)):
        return f"colors: {len(colors)} for {points} points: they have the marker's color"
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


_B = TypeVar("_B", LineBatch, TextBatch, TriangleBatch)


class MarkerGroup:
    """Markers that are shown and hidden together, such as those of one namespace.

    Args:
        owner: What a pick of them finds; None where they cannot be picked.
    """

    def __init__(self, owner: Any) -> None:
        self.root = Group()
        self._owner = owner
        self._batches: dict[Shape, SolidBatch] = {}
        #: What those that are instances consist of.
        self._solids: dict[tuple[str, int], tuple[Shape, ...]] = {}
        #: Batches of texts, lines and triangles, by what those of one have in common; the last one
        #: takes further markers.
        self._joint: dict[tuple[Any, ...], list[_Joint]] = {}
        #: Those of markers that are in one.
        self._batch_of: dict[tuple[str, int], _Joint] = {}
        #: Drawables of markers that are drawn on their own.
        self._own: dict[tuple[str, int], Group] = {}
        #: What those of meshes look like.
        self._looks: dict[tuple[str, int], tuple[Any, ...]] = {}

    def _batch(self, shape: Shape) -> SolidBatch:
        found = self._batches.get(shape)
        if found is None:
            found = self._batches[shape] = SolidBatch(shape, self._owner)
            self.root.add(found.mesh)
        return found

    def put(self, marker: MarkerRecord, pose: NDArray[np.float64], meshes: MarkerMeshes) -> None:
        """Draw a marker at a pose of its frame in the fixed frame."""
        key = marker.key
        shapes, places = marker.instances or _instances(marker)
        if shapes:
            if self._solids.get(key) is not shapes:
                self.remove(key)
                self._solids[key] = shapes
            for shape, local in zip(shapes, places, strict=True):
                self._batch(shape).put(key, pose, local, marker.color)
            return
        place = pose @ marker.pose
        if self._put_joined(marker, place):
            return
        # Textures are uploaded again only if they changed; a mesh that is read is empty.
        look: tuple[Any, ...] = ()
        if marker.kind == MESH:
            look = (marker.scale, marker.color, marker.resource, marker.embedded)
        own = self._own.get(key)
        if own and look and self._looks.get(key) == look:
            own.pose = place
            return
        self.remove(key)
        group = Group(*_drawables(marker, meshes))
        for item in group:
            if isinstance(item, Drawable):
                item.owner = self._owner
        group.pose = place
        self._own[key] = group
        if look:
            self._looks[key] = look
        self.root.add(group)

    def _put_joined(self, marker: MarkerRecord, pose: NDArray[np.float64]) -> bool:
        """Draw a marker together with others, if it is of a kind that is."""
        key, kind, points, owner = marker.key, marker.kind, marker.points, self._owner
        if kind != TEXT:
            if kind not in _JOINED or not 2 <= len(points) <= MAX_JOINED_POINTS:
                return False
            is_opaque = marker.color[3] >= OPAQUE
            is_alone = len(self._own) < _MAX_ALONE or key in self._own
            if is_alone and not (is_opaque and kind != TRIANGLE_LIST):
                return False
        cell = tuple(_CELL_M * round(at / _CELL_M) for at in pose[:3, 3].tolist())
        look: tuple[Any, ...] = (TEXT, cell)
        if kind == TEXT:
            text = marker.text[: Labels.MAX_LENGTH]
            texts = self._join(key, look, text, lambda: TextBatch(cell, owner))
            texts.put(key, text, pose[:3, 3], abs(marker.scale[2]), marker.color)
        elif kind == TRIANGLE_LIST:
            shape, color, lit = _triangles_look(marker)
            look = (TRIANGLE_LIST, cell, lit, shape.opaque and color[3] >= OPAQUE)
            triangles = self._join(key, look, shape, lambda: TriangleBatch(lit, cell, owner))
            triangles.put(key, pose, shape, color)
        else:
            width = abs(marker.scale[0])
            look = (LINE_LIST, cell, width, is_opaque)
            lines = self._join(key, look, points, lambda: LineBatch(width, cell, owner))
            lines.put(key, pose, points, _line_colors(marker), kind == LINE_STRIP)
        return True

    def _join(
        self, key: tuple[str, int], look: tuple[Any, ...], data: Any, create: Callable[[], _B]
    ) -> _B:
        """Return the batch that a marker is in, or that it comes into.

        Args:
            key: The marker's.
            look: What markers of one batch have in common.
            data: What it must have room for.
            create: Returns a new one.
        """
        batches = cast("list[_B]", self._joint.setdefault(look, []))
        batch = self._batch_of.get(key)
        for one in batches:
            if one is batch and one.has_room(key, data):
                return one
        self.remove(key)
        if not batches or not batches[-1].has_room(key, data):
            batches.append(create())
            self.root.add(batches[-1].drawable)
        self._batch_of[key] = batches[-1]
        return batches[-1]

    def remove(self, key: tuple[str, int]) -> None:
        """Do not draw a marker any more."""
        group = self._own.pop(key, None)
        if group is not None:
            self._looks.pop(key, None)
            group.remove()
            group.clear()  # a group and its items know each other, and would stay in memory
        for shape in self._solids.pop(key, ()):
            self._batches[shape].discard(key)
        batch = self._batch_of.pop(key, None)
        if batch is not None:
            batch.discard(key)

    @property
    def is_empty(self) -> bool:
        """Whether it has no marker."""
        return not (self._own or self._solids or self._batch_of)

    def flush(self) -> None:
        """Draw what has changed since the last call."""
        for solids in self._batches.values():
            solids.flush()
        for look, batches in list(self._joint.items()):
            for batch in list(batches):
                batch.flush()
                if not len(batch):
                    batch.drawable.remove()
                    batches.remove(batch)
            if not batches:
                del self._joint[look]


def _scaled(x: float, y: float, z: float, along: float = 0.0) -> NDArray[np.float64]:
    matrix = np.diag([x, y, z, 1.0])
    matrix[2, 3] = along
    return matrix


def _instances(marker: MarkerRecord) -> _Instances:
    """Return the shapes that a marker consists of, where these are always the same ones."""
    x, y, z = marker.scale
    if marker.kind in _SOLIDS:
        return _SOLIDS[marker.kind], (marker.pose @ _scaled(x, y, z),)
    if marker.kind != ARROW:
        return (), ()
    if not len(marker.points):
        # Proportions of RViz: 77 % shaft, and a head of twice its width.
        place = marker.pose @ _TO_X
        shaft = _scaled(y, z, 0.77 * x, 0.385 * x)
        head = _scaled(2 * y, 2 * z, 0.23 * x, 0.77 * x)
        return _ARROW_SHAPES, (place @ shaft, place @ head)
    start, end = marker.points[0].astype(np.float64), marker.points[1].astype(np.float64)
    way = end - start
    length = float(np.linalg.norm(way))
    if length < 1e-9 or not np.isfinite(length):
        return (), ()
    tip = min(z, length) if z else _HEAD_SHARE * length
    place = marker.pose @ _standing(start, way / length)
    return _ARROW_SHAPES, (
        place @ _scaled(x, x, length - tip, (length - tip) / 2),
        place @ _scaled(y, y, tip, length - tip),
    )


def _standing(origin: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a pose at a point whose z is along a direction of length 1."""
    helper = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = np.cross(z, helper)
    y /= np.linalg.norm(y)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = np.cross(y, z), y, z, origin
    return pose


def _drawables(marker: MarkerRecord, meshes: MarkerMeshes) -> Iterable[Drawable]:
    """Iterate over what a marker draws beside instances, in its own frame."""
    kind, points, (x, y, z) = marker.kind, marker.points, marker.scale
    each = marker.colors if len(marker.colors) == len(points) else marker.color
    if kind in (LINE_STRIP, LINE_LIST):
        lines = Lines(abs(x), in_metres=True)
        tints = _line_colors(marker)
        if kind == LINE_STRIP:
            lines.set_strip(points, tints)
        else:
            colors = tints if isinstance(tints, tuple) else tints.reshape(-1, 2, 4)
            lines.set_segments(points.reshape(-1, 2, 3), colors)
        yield lines
    elif kind in _POINT_STYLES:
        cloud = Points()
        # Their sides are equal: the others come with the pose.
        sides = np.abs([1.0, y / x, z / x]) if kind == CUBE_LIST else np.ones(3)
        cloud.set_points(points / sides, _list_colors(each))
        cloud.pose = np.diag([*sides, 1.0])
        cloud.set_look(style=_POINT_STYLES[kind], size=abs(x))
        yield cloud
    elif kind == TRIANGLE_LIST:
        shape, color, lit = _triangles_look(marker)
        yield Mesh(shape, color, lit=lit)
    elif kind == ARROW_STRIP:
        yield from _arrow_strip(marker)
    elif kind == MESH:
        yield from meshes.of(marker)


def _line_colors(marker: MarkerRecord) -> NDArray[np.float32] | tuple[float, ...]:
    """Return the colours of lines, of all points or for each."""
    if len(marker.colors) != len(marker.points):
        return marker.color
    if marker.color[3] < OPAQUE:
        return marker.colors
    # As in RViz, points are translucent only if the marker is.
    return np.column_stack([marker.colors[:, :3], np.ones(len(marker.colors), np.float32)])


def _list_colors(colors: Any) -> NDArray[np.float32]:
    """Return the colours of a list of points, with RViz's opacity, which draws these twice.

    One colour for all counts for the points and for the list, so that its opacity is squared.
    """
    out = np.clip(np.array(colors, np.float32), 0, 1)
    alpha = out[..., 3] ** 2 if out.ndim == 1 else out[..., 3]
    if (alpha < 1).any():
        out[..., 3] = 1 - (1 - alpha) ** 2
    return out


def _triangles_look(marker: MarkerRecord) -> tuple[Shape, tuple[float, ...], bool]:
    """Return the shape of a triangle list, its color, and whether it is lit."""
    shape = marker.triangles or _triangles(marker)
    # RViz does not light what has colors of its own.
    if len(marker.colors) in (len(marker.points), len(marker.points) // 3):
        return shape, (1.0, 1.0, 1.0, 1.0), False
    return shape, marker.color, True


def _triangles(marker: MarkerRecord) -> Shape:
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


def _arrow_strip(marker: MarkerRecord) -> Iterable[Mesh]:
    arrow = marker._replace(kind=ARROW, pose=_IDENTITY)
    arrows = [
        _instances(arrow._replace(points=marker.points[at : at + 2]))[1]
        for at in range(len(marker.points) - 1)
    ]
    for part, shape in enumerate(_ARROW_SHAPES):
        mesh = Mesh(shape, marker.color)
        mesh.set_instances(np.array([one[part] for one in arrows if one]).reshape(-1, 4, 4))
        yield mesh


class _MeshFile(NamedTuple):
    """A mesh file that was read.

    Attributes:
        parts: For each part a drawable, with its texture, and the color of its material; None in
            STL files, which have none.
        problem: What could not be read, in words; empty otherwise.
    """

    parts: list[tuple[Mesh, tuple[float, ...] | None]]
    problem: str

    @property
    def size(self) -> int:
        """How many bytes it takes."""
        return sum(_size_of(mesh) for mesh, _ in self.parts)


def _size_of(mesh: Mesh) -> int:
    return mesh.shape.size + (0 if mesh.texture is None else mesh.texture.nbytes)


def _read_mesh(uri: str, resources: ResourceRetriever) -> _MeshFile:
    """Read a mesh and its textures; takes seconds for large ones."""
    made: list[tuple[Mesh, tuple[float, ...] | None]] = []
    problem = ""
    is_stl = ending_of(uri) in STL_ENDINGS
    files = MeshFiles(resources)
    for part, shape in files.mesh(uri):
        mesh = Mesh(shape)
        if part.texture is not None:
            try:
                mesh.set_texture(files.texture(part.texture, uri))
            except (Error, OSError) as error:
                problem = str(error)
        made.append((mesh, None if is_stl else material_of(part)))
    return _MeshFile(made, problem)


def _embedded_looks(
    part: Mesh, own: tuple[float, ...] | None, color: tuple[float, ...]
) -> Iterable[tuple[Mesh, tuple[float, ...]]]:
    """Iterate over what is drawn of a part with the materials of its file, and its colours.

    As in RViz, a marker's colour is painted over them, half translucent, unless it is all zeros.
    """
    *rgb, alpha = color
    is_set, tint = any(color), (*rgb, min(alpha, 0.5))
    if own is None:
        plain = color if alpha >= OPAQUE else tint
        yield copy(part), plain if is_set else (1.0, 1.0, 1.0, 1.0)
        return
    yield copy(part), (*own[:3], alpha if is_set else 1.0)
    if is_set:
        yield Mesh(part.shape), tint


class MarkerMeshes:
    """Loads the meshes of markers in the scene's thread; until then they draw nothing.

    Args:
        background: Runs a function in another thread, with what finds files, and one with its
            result in the GUI thread.
        on_loaded: Called in the GUI thread with the URI, and with why it failed or "".
    """

    def __init__(
        self,
        background: Callable[[Callable[[ResourceRetriever], Any], Callable[[Any], None]], None],
        on_loaded: Callable[[str, str], None],
    ) -> None:
        self._background, self._on_loaded = background, on_loaded
        #: By URI, those used last at the end; None while it is being read.
        self._files: dict[str, _MeshFile | None] = {}
        self._reading = 0
        #: Bytes of each part that is kept or drawn.
        self._sizes: WeakKeyDictionary[Shape, int] = WeakKeyDictionary()

    def of(self, marker: MarkerRecord) -> Iterable[Mesh]:
        """Return the drawables of a mesh marker; begin to load it if need be.

        Raises:
            Error: Too many others are being loaded.
        """
        uri = marker.resource
        if uri not in self._files:
            if self._reading >= _MAX_READING:
                raise Error(f"more than {_MAX_READING} meshes are being read; send it again later")
            self._files[uri] = None
            self._reading += 1
            self._background(
                lambda resources: _read_mesh(uri, resources),
                lambda result: self._loaded(uri, result),
            )
        file = self._files[uri] = self._files.pop(uri)
        for part, own in file.parts if file is not None else ():
            looks: Iterable[tuple[Mesh, tuple[float, ...]]] = [(Mesh(part.shape), marker.color)]
            if marker.embedded:
                looks = _embedded_looks(part, own, marker.color)
            for mesh, color in looks:
                if np.prod(marker.scale) < 0:
                    mesh.shape = mesh.shape.mirrored()
                mesh.set_look(color=color)
                mesh.set_instances(_scaled(*marker.scale)[np.newaxis])
                yield mesh

    def problem_of(self, marker: MarkerRecord) -> str:
        """Return what is wrong with the file of a marker, in words; empty for none."""
        file = self._files.get(marker.resource) if marker.kind == MESH else None
        return "" if file is None else file.problem

    def _loaded(self, uri: str, result: Any) -> None:
        self._reading -= 1
        file = result if isinstance(result, _MeshFile) else _MeshFile([], str(result))
        self._files.pop(uri, None)
        self._files[uri] = file
        self._drop_unused()
        if sum(self._sizes.values()) + file.size > _MAX_MESH_BYTES:
            text = f"with its {file.size} bytes, all meshes have more than {_MAX_MESH_BYTES}"
            file = self._files[uri] = _MeshFile([], f"{uri}: {text}; reduce them")
        self._sizes.update((mesh.shape, _size_of(mesh)) for mesh, _ in file.parts)
        self._on_loaded(uri, "" if file.parts else file.problem)

    def _drop_unused(self) -> None:
        """Forget the files that were used longest ago; markers that are shown keep theirs."""
        kept = {uri: file.size for uri, file in self._files.items() if file is not None}
        size = sum(kept.values())
        # Not the last one, which is asked for again as soon as it is there.
        for uri in list(kept)[:-1]:
            if len(kept) <= _MAX_MESHES and size <= _MAX_KEPT_BYTES:
                return
            size -= kept.pop(uri)
            del self._files[uri]

    def forget_failed(self, uris: Collection[str] | None = None) -> set[str]:
        """Forget files that could not be read, so that they are read again.

        Args:
            uris: The files, of meshes and of their textures, that may be there now; None for all.

        Returns:
            The URIs of the meshes.
        """
        failed = {uri: file.problem for uri, file in self._files.items() if file and file.problem}
        if uris is not None:
            failed = {k: text for k, text in failed.items() if any(one in text for one in uris)}
        for uri in failed:
            del self._files[uri]
        return set(failed)


class _Late(NamedTuple):
    """A marker that waits for its transform.

    Attributes:
        marker: Its record.
        since: When it came, by the clock of :func:`time.monotonic`.
        reason: Why it cannot be placed.
        is_known: Whether its frame is, at another time.
    """

    marker: MarkerRecord
    since: float
    reason: str
    is_known: bool


class _Poses:
    """Poses of frames in the fixed frame at one moment, each looked up once.

    Attributes:
        misses: How many lookups have failed.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._found: dict[tuple[str, int], NDArray[np.float64] | str] = {}
        self.misses = 0

    def at(self, frame: str, stamp: int = 0) -> NDArray[np.float64] | str:
        """Return a frame's pose at a time; why it is not known, in words, where it is not."""
        found = self._found.get((frame, stamp))
        if found is None:
            newest = self.at(frame) if stamp else None
            found = newest if isinstance(newest, str) else self._look_up(frame, stamp)
            self._found[frame, stamp] = found
        return found

    def _look_up(self, frame: str, stamp: int) -> NDArray[np.float64] | str:
        scene, buffer = self._scene, self._scene.transforms
        what = f"no transform from [{frame[:100]}]"
        # A look at the names costs much less than a lookup that fails.
        if frame != scene.fixed_frame and buffer and not buffer.has_frame(frame):
            return f"{what}: there is no frame of this name yet"
        try:
            return scene.look_up(frame, stamp)
        except TransformException as error:
            self.misses += 1
            return f"{what}: {error}"


def _time_of(marker: MarkerRecord) -> int:
    return 0 if marker.locked else marker.stamp


class Markers(TopicDisplay):
    """Markers of one topic; the base of both displays."""

    MESSAGES = ("visualization_msgs/Marker", "visualization_msgs/MarkerArray")
    KEEPS_ALL: ClassVar[bool] = True
    HAS_FRAMES: ClassVar[bool] = True
    EAGER: ClassVar[bool] = True

    namespacesChanged = Signal()
    #: Names of the namespaces that there are.
    namespaces: ReadOnly[list[str]] = ReadOnly(cast("type[list[str]]", "QStringList"), [])

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._shown: dict[tuple[str, int], MarkerRecord] = {}
        #: When markers end, by :meth:`Scene.time_s`, and when the first one does.
        self._expires: dict[tuple[str, int], float] = {}
        self._first_end = math.inf
        #: By namespace and, for markers that are locked to one, frame: its pose is the group's.
        self._groups: dict[tuple[str, str], MarkerGroup] = {}
        #: Markers that cannot be placed in this fixed frame, by their frames.
        self._hidden: dict[str, dict[tuple[str, int], None]] = {}
        #: Frames of locked markers that are not known, and why.
        self._lost: dict[str, str] = {}
        #: Those without markers, which make room for new ones.
        self._empty: dict[tuple[str, str], None] = {}
        self._late: dict[tuple[str, int], _Late] = {}
        #: Bytes of all that are shown.
        self._size = 0
        self._problems: dict[tuple[str, int], Status] = {}
        #: Names of the lines of the status that are about markers.
        self._lines: set[str] = set()
        self._meshes = MarkerMeshes(self._in_background, self._on_mesh)
        super().__init__(parent, runtime)
        self.parts: Parts = Parts("Namespaces", lambda: self.namespaces, self._switch_groups)
        self._flush_timer = single_shot(self, self._flush)

    def preparer(self) -> Callable[[Any], list[MarkerRecord]]:
        """Return the function that reads markers."""
        return _read_markers

    @Slot(str, bool)
    def setNamespaceEnabled(self, namespace: str, enabled: bool) -> None:  # noqa: N802 - QML's name
        """Show or hide the markers of a namespace."""
        self.parts.set_enabled(namespace, enabled)

    def _switch_groups(self) -> None:
        for (namespace, frame), group in self._groups.items():
            group.root.visible = self.parts.is_enabled(namespace) and frame not in self._lost

    def load_settings(self, saved: Any) -> list[str]:
        """Take the settings of a file, and which namespaces it shows."""
        return super().load_settings(saved) + self.parts.load(saved)

    def save_settings(self, older: Any = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file, with the namespaces that are shown."""
        kept = super().save_settings(older, ros)
        self.parts.save(kept)
        return kept

    # -- messages --------------------------------------------------------------------------------

    def _show_waiting(self) -> None:
        # Each marker has a frame and time of its own.
        if self.scene is None or not self._waiting:
            return
        poses = _Poses(self.scene)
        while self._waiting:
            item = self._waiting.popleft()
            self._last = item._replace(data=None)
            for marker in item.data:
                self._apply(marker, poses)
        self._drop_late()
        self._show_age()
        self._flush_later()

    def on_transforms(self) -> None:
        """Show what has waited for transforms; move what is locked to its frame."""
        self._show_waiting()
        if self.scene is not None:
            self._follow(_Poses(self.scene))

    def on_fixed_frame(self) -> None:
        """Place all markers anew; hide those that cannot be placed."""
        self._show_waiting()
        if self.scene is None:
            return
        poses = _Poses(self.scene)
        for marker in list(self._shown.values()):
            if not marker.locked:
                self._place_anew(marker, poses)
        self._follow(poses, hide=True)

    def followed_frames(self) -> set[str]:
        """Return the frames to which markers are locked."""
        groups = self._groups.items()
        return {frame for (_, frame), one in groups if one.root.visible and not one.is_empty}

    def _fade(self) -> None:
        self.root.alpha = OUTDATED_ALPHA if self._is_gone else 1.0
        for (_, frame), group in self._groups.items():
            group.root.alpha = OUTDATED_ALPHA if frame in self._outdated_frames else 1.0

    def _follow(self, poses: _Poses, *, hide: bool = False) -> None:
        """Place what has waited, and what is locked to its frame."""
        if self._late or self._hidden or self._lost or hide:
            self._flush_later()
        for frame in list(self._hidden):
            if not isinstance(poses.at(frame), str):
                for key in self._hidden.pop(frame):
                    self._place_anew(self._shown[key], poses)
        for key in list(self._late):
            # The others are the first ones of the next time.
            if poses.misses >= _MAX_MISSES:
                break
            self._try_late(self._late.pop(key), poses)
        for (_, frame), group in self._groups.items():
            pose = poses.at(frame) if frame else group.root.pose
            if not isinstance(pose, str):
                group.root.pose = pose
                self._lost.pop(frame, None)
            elif hide:
                self._lost[frame] = pose
        if self._lost or hide:
            self._switch_groups()

    def _try_late(self, late: _Late, poses: _Poses) -> None:
        marker = late.marker
        pose = poses.at(marker.frame, _time_of(marker))
        if not isinstance(pose, str):
            self._show_marker(marker, pose)
        elif _time_of(marker) and time.monotonic() - late.since > _MAX_WAIT_S:
            text = f"it was dropped after {_MAX_WAIT_S:.0f} s: {pose}"
            self._note_problem(marker.key, "error", text)
        else:
            if pose != late.reason:
                is_known = not isinstance(poses.at(marker.frame), str)
                late = late._replace(reason=pose, is_known=is_known)
            self._late[marker.key] = late

    def _apply(self, marker: MarkerRecord, poses: _Poses) -> None:
        key = marker.key
        if marker.action == _DELETE_ALL:
            # In ROS 1, RViz removes those of all namespaces, whatever the message's is.
            is_ros1 = self.node is not None and self.node.wire == "ros1"
            self._clear("" if is_ros1 else key[0])
            return
        # What waits under its name is older.
        self._late.pop(key, None)
        if marker.action == _DELETE or marker.problem:
            self._remove(key)
            if marker.problem:
                self._note_problem(key, "error", marker.problem)
            return
        pose = poses.at(marker.frame, _time_of(marker))
        if not isinstance(pose, str):
            self._show_marker(marker, pose)
            return
        is_known = not isinstance(poses.at(marker.frame), str)
        self._late[key] = _Late(marker, time.monotonic(), pose, is_known)

    def _drop_late(self) -> None:
        """Drop the oldest of too many markers that wait."""
        size = sum(late.marker.size for late in self._late.values())
        while len(self._late) > _MAX_LATE or (len(self._late) > 1 and size > _MAX_LATE_BYTES):
            oldest = next(iter(self._late))
            size -= self._late.pop(oldest).marker.size
            limit = f"{_MAX_LATE} markers, or {_MAX_LATE_BYTES >> 20} MiB,"
            self._note_problem(
                oldest, "error", f"it was dropped: more than {limit} wait for transforms"
            )

    def _show_marker(self, marker: MarkerRecord, pose: NDArray[np.float64]) -> None:
        """Show a marker that is new, with its frame at a pose in the fixed frame."""
        key = marker.key
        before = self._shown.get(key)
        size = self._size + marker.size - (0 if before is None else before.size)
        if size > _MAX_SHOWN_BYTES:
            self._remove(key)
            text = f"it is not shown: all markers have more than {_MAX_SHOWN_BYTES >> 20} MiB"
            self._note_problem(key, "error", text)
            return
        if before is not None and self._group_key(before) == self._group_key(marker):
            # Its group replaces it, or moves it if nothing else has changed.
            del self._shown[key]
            self._size -= before.size
            self._forget_hidden(before)
            self._problems.pop(key, None)
            self._expires.pop(key, None)
        else:
            self._remove(key)
        if len(self._shown) >= _MAX_MARKERS:
            self._note_problem(key, "error", f"only {_MAX_MARKERS} markers are shown")
            return
        self._shown[key] = marker
        self._size += marker.size
        if marker.warning:
            self._note_problem(key, "warn", marker.warning)
        if marker.lifetime and self.scene is not None:
            self._expires[key] = self.scene.time_s() + marker.lifetime
        self._draw(marker, pose)

    def _draw(self, marker: MarkerRecord, pose: NDArray[np.float64]) -> None:
        try:
            where = self._group_key(marker)
            group = self._groups.get(where)
            if group is None:
                group = self._add_group(marker)
            if marker.locked:
                if group.root.pose is not pose:
                    group.root.pose = pose
                pose = _IDENTITY
            group.put(marker, pose, self._meshes)
            self._empty.pop(where, None)
            problem = self._meshes.problem_of(marker)
            if problem:
                self._note_problem(marker.key, "error", problem)
        except Exception as error:  # one that cannot be drawn does not hide the others
            if not isinstance(error, Error):
                _log.exception("%s: marker %s", self.label, _line_of(marker.key))
            self._remove(marker.key)
            self._note_problem(marker.key, "error", f"it cannot be drawn: {error}")

    def _place_anew(self, marker: MarkerRecord, poses: _Poses) -> None:
        """Draw a marker in another place, or not at all while its frame is not known."""
        pose = poses.at(marker.frame, _time_of(marker))
        if isinstance(pose, str):
            # At its time it is not known any more: rather the newest than a wrong place.
            pose = poses.at(marker.frame)
        if not isinstance(pose, str):
            self._forget_hidden(marker)
            self._draw(marker, pose)
            return
        group = self._group_of(marker)
        if group is not None:
            group.remove(marker.key)
        self._hidden.setdefault(marker.frame, {})[marker.key] = None

    def _forget_hidden(self, marker: MarkerRecord) -> None:
        hidden = self._hidden.get(marker.frame)
        if hidden is not None:
            hidden.pop(marker.key, None)
            if not hidden:
                del self._hidden[marker.frame]

    def _group_of(self, marker: MarkerRecord) -> MarkerGroup | None:
        return self._groups.get(self._group_key(marker))

    @staticmethod
    def _group_key(marker: MarkerRecord) -> tuple[str, str]:
        return marker.key[0], marker.frame if marker.locked else ""

    def _add_group(self, marker: MarkerRecord) -> MarkerGroup:
        key = namespace, _ = self._group_key(marker)
        if len(self._groups) >= _MAX_NAMESPACES:
            if not self._empty:
                raise Error(f"there are more than {_MAX_NAMESPACES} namespaces")
            unused = next(iter(self._empty))
            del self._empty[unused]
            self._groups.pop(unused).root.remove()
        group = self._groups[key] = MarkerGroup(self)
        group.root.visible = self.parts.is_enabled(namespace)
        self.root.add(group.root)
        return group

    def _remove(self, key: tuple[str, int]) -> None:
        self._problems.pop(key, None)
        self._expires.pop(key, None)
        marker = self._shown.pop(key, None)
        if marker is not None:
            self._size -= marker.size
            self._forget_hidden(marker)
            group = self._group_of(marker)
            if group is not None:
                group.remove(key)
                if group.is_empty:
                    self._empty[self._group_key(marker)] = None

    def _clear(self, namespace: str) -> None:
        """Remove the markers of a namespace; all of them for an empty one, as RViz 2 does."""
        for key in [*self._shown, *self._late, *self._problems]:
            if namespace in ("", key[0]):
                self._late.pop(key, None)
                self._remove(key)

    def reset(self) -> None:
        """Drop all markers."""
        super().reset()
        for held in (self._shown, self._expires, self._groups, self._hidden, self._lost):
            held.clear()
        self._size = 0
        self._empty.clear()
        self._late.clear()
        self._meshes.forget_failed()
        self._problems.clear()
        self._flush_later()

    # -- what has changed ------------------------------------------------------------------------

    def _flush_later(self) -> None:
        """Draw and report what has changed, once for all that is received together."""
        self._flush_timer.start(0)

    @Slot()
    def _flush(self) -> None:
        for group in self._groups.values():
            group.flush()
        report(self, namespaces=sorted({namespace for namespace, _ in self._groups}))
        self._report_problems()
        self._first_end = min(self._expires.values(), default=math.inf)

    def _note_problem(self, key: tuple[str, int], level: str, text: str) -> None:
        self._problems[key] = Status(level, text)
        if len(self._problems) > _MAX_PROBLEMS:
            del self._problems[next(iter(self._problems))]

    def _report_problems(self) -> None:
        """Write the lines of the status: one for each frame without a transform, then markers."""
        reasons = dict(self._lost)
        if self.scene is not None:
            poses = _Poses(self.scene)
            found_at = {frame: poses.at(frame) for frame in self._hidden}
            reasons.update({k: v for k, v in found_at.items() if isinstance(v, str)})
        latest = time.monotonic() - _LATE_S
        for late in self._late.values():
            # Transforms of a moment often come after the data: only a delay is an error.
            if not late.is_known or late.since <= latest:
                reasons.setdefault(late.marker.frame, late.reason)
            elif not self._flush_timer.isActive():
                self._flush_timer.start(int(_LATE_S * 1000) + 1)
        found = [(f"Transform [{one[:100]}]", Status("error", reasons[one])) for one in reasons]
        found += [(_line_of(key), status) for key, status in self._problems.items()]
        lines = dict(found[:_MAX_LINES])
        rest = found[_MAX_LINES:]
        if rest:
            level = "error" if any(one.level == "error" for _, one in rest) else "warn"
            lines["Markers"] = Status(level, f"and {len(rest)} more problems like these")
        for name in self._lines - lines.keys():
            self.delete_status(name)
        for name, status in lines.items():
            self.set_status(name, *status)
        self._lines = set(lines)

    # -- lifetimes -------------------------------------------------------------------------------

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        now = math.nan if self.scene is None else self.scene.time_s()
        if now >= self._first_end:
            for key in [key for key, end in self._expires.items() if end <= now]:
                self._remove(key)
            self._flush_later()

    # -- meshes ----------------------------------------------------------------------------------

    def _in_background(
        self, work: Callable[[ResourceRetriever], Any], then: Callable[[Any], None]
    ) -> None:
        if self.scene is not None:
            self.scene.load(work, then)

    def _on_mesh(self, uri: str, _problem: str) -> None:
        if not is_alive(self) or self.scene is None:
            return
        poses = _Poses(self.scene)
        for marker in list(self._shown.values()):
            if marker.kind == MESH and marker.resource == uri:
                self._place_anew(marker, poses)
        self._flush_later()

    def on_files(self, uris: Collection[str]) -> None:
        """Read meshes again that were missing."""
        failed = self._meshes.forget_failed(uris)
        if not failed or self.scene is None:
            return
        poses = _Poses(self.scene)
        for marker in list(self._shown.values()):
            if marker.kind == MESH and marker.resource in failed:
                group = self._group_of(marker)
                if group is not None:
                    group.remove(marker.key)  # it may be drawn without its texture
                self._problems.pop(marker.key, None)
                if marker.warning:
                    self._note_problem(marker.key, "warn", marker.warning)
                self._place_anew(marker, poses)
        self._flush_later()


def _line_of(key: tuple[str, int]) -> str:
    """Return the name of the line of the status about a marker."""
    return f"{key[0][:100]}/{key[1]}"


def _read_markers(message: Any) -> list[MarkerRecord]:
    if "markers" not in message:
        return [read_marker(message)]
    count = len(message.markers)
    if count > _MAX_MARKERS:
        raise Error(f"markers: {count} are more than the {_MAX_MARKERS} that are shown")
    return _read_all(message.markers)


class MarkerDisplay(Markers):
    """Markers of a ``visualization_msgs/Marker`` topic. See its page in ``docs/scene.md``."""

    TYPE = "Marker"

    def further_topics(self, topic: str) -> tuple[str, ...]:
        """Return the topic of arrays that RViz receives beside it."""
        return (f"{topic}_array",)


class MarkerArrayDisplay(Markers):
    """Markers of a ``visualization_msgs/MarkerArray`` topic. See its page in ``docs/scene.md``."""

    TYPE = "MarkerArray"
