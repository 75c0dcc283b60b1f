"""The displays Marker and MarkerArray: shapes, lines, points, meshes and texts that robots send.

Messages are turned into records of numpy arrays in the node's thread. Boxes, spheres, cylinders and
arrows of one namespace are instances of one mesh, so that ten thousand of them are drawn at once.
"""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import time
from collections import deque
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, cast

import numpy as np

from rosglass.errors import Error, TransformException
from rosglass.qml.element import single_shot
from rosglass.qml.properties import ReadOnly, report
from rosglass.qt import Signal, Slot, is_alive
from rosglass.scene.display import TopicDisplay
from rosglass.scene.displays.shapes import poses_matrices
from rosglass.scene.drawing import (
    BOX,
    CONE,
    CYLINDER,
    SPHERE,
    Drawable,
    Group,
    Labels,
    Lines,
    Mesh,
    Points,
    Shape,
)
from rosglass.scene.meshes import load_mesh_cached
from rosglass.scene.resources import locate_resource

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from rosglass.qml.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = [
    "MarkerArrayDisplay",
    "MarkerDisplay",
    "MarkerGroup",
    "MarkerMeshes",
    "MarkerRecord",
    "Markers",
    "read_marker",
]

# visualization_msgs/Marker: types and actions.
ARROW, CUBE, SPHERE_TYPE, CYLINDER_TYPE, LINE_STRIP, LINE_LIST = range(6)
CUBE_LIST, SPHERE_LIST, POINTS, TEXT, MESH, TRIANGLE_LIST, ARROW_STRIP = range(6, 13)
_ADD, _DELETE, _DELETE_ALL = 0, 2, 3
_NAMES = [
    *("arrow", "cube", "sphere", "cylinder", "line_strip", "line_list", "cube_list"),
    *("sphere_list", "points", "text_view_facing", "mesh_resource", "triangle_list", "arrow_strip"),
]
_MAX_POINTS, _MAX_MARKERS = 2_000_000, 100_000
#: What lists of points are drawn as.
_POINT_STYLES = {CUBE_LIST: "boxes", SPHERE_LIST: "spheres", POINTS: "squares"}
#: Share of an arrow between two points that is its head, where no length is given, as in RViz.
_HEAD_SHARE = 0.23
#: Turns z, along which cylinders and cones stand, to x, along which arrows point.
_TO_X = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
_WAITING = 1000


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
        colour: RGBA.
        lifetime: Seconds; 0 for ever.
        locked: Whether it moves with its frame.
        points: (n, 3), metres.
        colours: (n, 4) or (0, 4).
        text: Of texts.
        resource: URI of a mesh.
        embedded: Whether a mesh has its own colours.
        problem: Why it is not drawn as it should be, in words; empty otherwise.
    """

    key: tuple[str, int]
    kind: int
    action: int
    frame: str = ""
    stamp: int = 0
    pose: NDArray[np.float64] = np.eye(4)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    colour: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    lifetime: float = 0.0
    locked: bool = False
    points: NDArray[np.float32] = np.zeros((0, 3), np.float32)
    colours: NDArray[np.float32] = np.zeros((0, 4), np.float32)
    text: str = ""
    resource: str = ""
    embedded: bool = False
    problem: str = ""


def _seconds(duration: Any) -> float:
    if hasattr(duration, "secs"):
        return float(duration.secs + duration.nsecs * 1e-9)
    return float(duration.sec + duration.nanosec * 1e-9)


def read_marker(message: Any, part: tuple[str, int] | None = None) -> MarkerRecord:
    """Return the record of a ``visualization_msgs/Marker`` of ROS 1 or ROS 2.

    What cannot be drawn has the reason in :attr:`MarkerRecord.problem`.

    Args:
        message: The message.
        part: Its key where it is part of an interactive marker: it has no namespace and id of its
            own then, and a scale of 0 is 1 m, as in RViz.
    """
    key, kind, action = (message.ns, message.id), message.type, message.action
    if part is not None:
        key, action = part, _ADD
    if action in (_DELETE, _DELETE_ALL):
        return MarkerRecord(key, kind, action)
    header, p, q = message.header, message.pose.position, message.pose.orientation
    stamp = header.stamp
    if hasattr(stamp, "secs"):
        at = stamp.secs * 1_000_000_000 + stamp.nsecs
    else:
        at = stamp.sec * 1_000_000_000 + stamp.nanosec
    scale, tint = message.scale, message.color
    numbers = (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
    size = (scale.x, scale.y, scale.z)
    if part is not None:
        size = (size[0] or 1.0, size[1] or 1.0, size[2] or 1.0)
    colour = (tint.r, tint.g, tint.b, tint.a)
    problem = ""
    if action != _ADD:
        problem = f"action {action}: expected 0 (add), 2 (delete) or 3 (delete all)"
    elif not 0 <= kind <= ARROW_STRIP:
        problem = f"type {kind}: expected 0 to {ARROW_STRIP}"
    elif not np.isfinite([*numbers, *size, *colour]).all():
        problem = "pose, scale or color has a number that is not finite"
    count = len(message.points)
    if count > _MAX_POINTS:
        problem = f"points: {count} are more than the {_MAX_POINTS} that are drawn"
    if not problem:
        problem = _scale_problem(kind, size, count)
    if problem:
        return MarkerRecord(key, kind, action, header.frame_id.lstrip("/"), at, problem=problem)
    points = np.array([(o.x, o.y, o.z) for o in message.points], np.float32).reshape(-1, 3)
    colours = np.array([(c.r, c.g, c.b, c.a) for c in message.colors], np.float32).reshape(-1, 4)
    return MarkerRecord(
        key,
        kind,
        action,
        header.frame_id.lstrip("/"),
        at,
        poses_matrices(numbers[:3], numbers[3:])[0],
        size,
        colour,
        max(_seconds(message.lifetime), 0.0),
        message.frame_locked,
        points,
        colours,
        message.text,
        message.mesh_resource,
        message.mesh_use_embedded_materials,
    )


def _scale_problem(kind: int, size: tuple[float, float, float], count: int) -> str:
    x, y, z = size
    needs = {
        ARROW: (x, y) if count else (x, y, z),
        LINE_STRIP: (x,),
        LINE_LIST: (x,),
        POINTS: (x, y),
        TEXT: (z,),
        ARROW_STRIP: (x, y),
    }.get(kind, (x, y, z))
    if 0 in needs:
        return f"scale {size} of a {_NAMES[kind]} is 0 in a direction that it needs"
    if kind == LINE_LIST and count % 2:
        return f"points: {count} are not pairs, which a line_list needs"
    if kind == TRIANGLE_LIST and (count % 3 or not count):
        return f"points: {count} are not triples, which a triangle_list needs"
    if kind == ARROW and count == 1:
        return "points: an arrow has none, or start and end"
    if kind == LINE_STRIP and count < 2:
        return f"points: {count}, where a line_strip needs 2"
    return ""


class _Batch:
    """Shapes of one kind in one namespace: instances of one mesh, with a slot for each marker."""

    def __init__(self, shape: Shape, owner: Any) -> None:
        self.mesh = Mesh(shape)
        self.mesh.owner = owner
        self._slots: dict[tuple[str, int], int] = {}
        self._keys: list[tuple[str, int]] = []
        self._matrices = np.zeros((16, 4, 4), np.float32)
        self._colours = np.zeros((16, 4), np.float32)
        self.dirty = True

    def put(
        self, key: tuple[str, int], matrix: NDArray[np.float64], colour: tuple[float, ...]
    ) -> None:
        """Draw a marker, in place of the one of the same key."""
        slot = self._slots.get(key)
        if slot is None:
            slot = self._slots[key] = len(self._keys)
            self._keys.append(key)
            if slot == len(self._matrices):
                self._matrices = np.concatenate([self._matrices, np.zeros_like(self._matrices)])
                self._colours = np.concatenate([self._colours, np.zeros_like(self._colours)])
        self._matrices[slot], self._colours[slot] = matrix, colour
        self.dirty = True

    def discard(self, key: tuple[str, int]) -> None:
        """Do not draw a marker any more."""
        slot = self._slots.pop(key, None)
        if slot is not None:
            # The last one takes its place.
            last = self._keys.pop()
            if last != key:
                self._keys[slot] = last
                self._slots[last] = slot
                end = len(self._keys)
                self._matrices[slot], self._colours[slot] = self._matrices[end], self._colours[end]
            self.dirty = True

    def key_of(self, index: int) -> tuple[str, int]:
        """Return the marker of an instance."""
        return self._keys[index]

    def flush(self) -> None:
        """Give the mesh what has changed."""
        if self.dirty:
            self.dirty = False
            count = len(self._keys)
            self.mesh.set_instances(
                self._matrices[:count].copy(), self._colours[:count].copy() if count else (1,) * 4
            )


class MarkerGroup:
    """Markers that are shown and hidden together, such as those of one namespace.

    Args:
        owner: What a pick of them finds; None where they cannot be picked.
    """

    def __init__(self, owner: Any) -> None:
        self.root = Group()
        self._owner = owner
        self._batches: dict[Shape, _Batch] = {}
        #: Drawables of markers that are not instances.
        self._own: dict[tuple[str, int], Group] = {}

    def _batch(self, shape: Shape) -> _Batch:
        found = self._batches.get(shape)
        if found is None:
            found = self._batches[shape] = _Batch(shape, self._owner)
            self.root.add(found.mesh)
        return found

    def put(self, marker: MarkerRecord, pose: NDArray[np.float64], meshes: MarkerMeshes) -> None:
        """Draw a marker at a pose of its frame in the fixed frame."""
        self.remove(marker.key)
        place = pose @ marker.pose
        shapes = list(_instances(marker))
        if shapes:
            for shape, local, colour in shapes:
                self._batch(shape).put(marker.key, place @ local, colour)
            return
        group = Group(*_drawables(marker, meshes))
        for item in group:
            if isinstance(item, Drawable):
                item.owner = self._owner
        group.pose = place
        self._own[marker.key] = group
        self.root.add(group)

    def remove(self, key: tuple[str, int]) -> None:
        """Do not draw a marker any more."""
        group = self._own.pop(key, None)
        if group is not None:
            group.remove()
        for batch in self._batches.values():
            batch.discard(key)

    def flush(self) -> None:
        """Draw what has changed since the last call."""
        for batch in self._batches.values():
            batch.flush()


def _scaled(x: float, y: float, z: float, along: float = 0.0) -> NDArray[np.float64]:
    matrix = np.diag([x, y, z, 1.0])
    matrix[2, 3] = along
    return matrix


def _instances(
    marker: MarkerRecord,
) -> Iterable[tuple[Shape, NDArray[np.float64], tuple[float, ...]]]:
    """Iterate over the shapes that a marker consists of, where these are always the same ones."""
    x, y, z = marker.scale
    if marker.kind == CUBE:
        yield BOX, _scaled(x, y, z), marker.colour
    elif marker.kind == SPHERE_TYPE:
        yield SPHERE, _scaled(x, y, z), marker.colour
    elif marker.kind == CYLINDER_TYPE:
        yield CYLINDER, _scaled(x, y, z), marker.colour
    elif marker.kind == ARROW and not len(marker.points):
        # Proportions of RViz: 77 % shaft, and a head of twice its width.
        shaft = _TO_X @ _scaled(y, z, 0.77 * x, 0.385 * x)
        head = _TO_X @ _scaled(2 * y, 2 * z, 0.23 * x, 0.77 * x)
        yield CYLINDER, shaft, marker.colour
        yield CONE, head, marker.colour
    elif marker.kind == ARROW:
        start, end = marker.points[0].astype(np.float64), marker.points[1].astype(np.float64)
        way = end - start
        length = float(np.linalg.norm(way))
        if length < 1e-9 or not np.isfinite(length):
            return
        tip = min(z, length) if z else _HEAD_SHARE * length
        place = _standing(start, way / length)
        yield CYLINDER, place @ _scaled(x, x, length - tip, (length - tip) / 2), marker.colour
        yield CONE, place @ _scaled(y, y, tip, length - tip), marker.colour


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
    each = marker.colours if len(marker.colours) == len(points) else marker.colour
    if kind in (LINE_STRIP, LINE_LIST):
        lines = Lines(abs(x), in_metres=True)
        if kind == LINE_STRIP:
            lines.set_strip(points, each)
        else:
            colours = each if isinstance(each, tuple) else each.reshape(-1, 2, 4)
            lines.set_segments(points.reshape(-1, 2, 3), colours)
        yield lines
    elif kind in _POINT_STYLES:
        cloud = Points()
        # Their sides are equal: the others come with the pose.
        sides = np.array([1.0, y / x, z / x]) if kind == CUBE_LIST else np.ones(3)
        cloud.set_points(points / sides, each)
        cloud.pose = np.diag([*sides, 1.0])
        cloud.set_look(style=_POINT_STYLES[kind], size=abs(x))
        yield cloud
    elif kind == TEXT:
        labels = Labels()
        labels.set_texts([marker.text], [[0, 0, 0]], abs(z), marker.colour)
        yield labels
    elif kind == TRIANGLE_LIST:
        yield _triangles(marker)
    elif kind == ARROW_STRIP:
        yield from _arrow_strip(marker)
    elif kind == MESH:
        yield from meshes.of(marker)


def _triangles(marker: MarkerRecord) -> Mesh:
    points = marker.points * np.array(marker.scale, np.float32)
    colours: NDArray[np.float32] | None = None
    if len(marker.colours) == len(points):
        colours = marker.colours
    elif len(marker.colours) == len(points) // 3:
        colours = np.repeat(marker.colours, 3, axis=0)
    if colours is None:
        return Mesh(Shape(points), marker.colour)
    return Mesh(Shape(points, colours=colours))


def _arrow_strip(marker: MarkerRecord) -> Iterable[Mesh]:
    arrows = [
        list(_instances(marker._replace(kind=ARROW, points=marker.points[at : at + 2])))
        for at in range(len(marker.points) - 1)
    ]
    for part, shape in ((0, CYLINDER), (1, CONE)):
        mesh = Mesh(shape, marker.colour)
        mesh.set_instances(np.array([one[part][1] for one in arrows if one]).reshape(-1, 4, 4))
        yield mesh


class MarkerMeshes:
    """Loads the meshes of markers in the session's worker; until then they draw nothing.

    Args:
        background: Runs a function in another thread, and one with its result in the GUI thread.
        on_loaded: Called in the GUI thread with the URI, and with why it failed or "".
    """

    def __init__(
        self,
        background: Callable[[Callable[[], Any], Callable[[Any], None]], None],
        on_loaded: Callable[[str, str], None],
    ) -> None:
        self._background, self._on_loaded = background, on_loaded
        self._parts: dict[str, list[Any] | None] = {}

    def of(self, marker: MarkerRecord) -> Iterable[Mesh]:
        """Return the drawables of a mesh marker; begin to load it if need be."""
        uri = marker.resource
        if uri not in self._parts:
            self._parts[uri] = None
            self._background(
                lambda: load_mesh_cached(locate_resource(uri), uri),
                lambda result: self._loaded(uri, result),
            )
        for part in self._parts[uri] or ():
            colour = marker.colour
            if marker.embedded and colour[:3] == (0.0, 0.0, 0.0):
                colour = (1.0, 1.0, 1.0, colour[3] or 1.0)
            shape, own = part
            if marker.embedded and own is not None:
                colour = tuple(a * b for a, b in zip(own, colour, strict=True))
            mesh = Mesh(shape, colour)
            mesh.set_instances(_scaled(*marker.scale)[np.newaxis])
            yield mesh

    def _loaded(self, uri: str, result: Any) -> None:
        if isinstance(result, Exception):
            self._on_loaded(uri, str(result))
            return
        self._parts[uri] = [
            (Shape(part.positions, part.normals, part.indices, uv=part.uv), part.colour)
            for part in result
        ]
        self._on_loaded(uri, "")


class _Shown(NamedTuple):
    """A marker that is shown.

    Attributes:
        marker: Its record.
        expires: When it ends, by the clock of :func:`time.monotonic`; inf for never.
    """

    marker: MarkerRecord
    expires: float


class Markers(TopicDisplay):
    """Markers of one topic; the base of both displays."""

    MESSAGES = ("visualization_msgs/Marker", "visualization_msgs/MarkerArray")
    KEEPS_ALL: ClassVar[bool] = True
    EAGER: ClassVar[bool] = True

    namespacesChanged = Signal()
    #: Names of the namespaces that there are.
    namespaces: ReadOnly[list[str]] = ReadOnly(cast("type[list[str]]", "QStringList"), [])

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._shown: dict[tuple[str, int], _Shown] = {}
        self._spaces: dict[str, MarkerGroup] = {}
        #: Whether namespaces are shown, of those that were switched.
        self._switched: dict[str, bool] = {}
        self._late: deque[MarkerRecord] = deque(maxlen=_WAITING)
        self._flushing = False
        self._meshes = MarkerMeshes(self._in_background, self._on_mesh)
        super().__init__(parent, runtime)
        self._expiry = single_shot(self, self._expire)

    def preparer(self) -> Callable[[Any], list[MarkerRecord]]:
        """Return the function that reads markers."""
        return _read_markers

    @Slot(str, bool)
    def setNamespaceEnabled(self, namespace: str, enabled: bool) -> None:  # noqa: N802 - QML's name
        """Show or hide the markers of a namespace."""
        self._switched[namespace] = enabled
        if namespace in self._spaces:
            self._spaces[namespace].root.visible = enabled

    def is_namespace_enabled(self, namespace: str) -> bool:
        """Return whether the markers of a namespace are shown."""
        return self._switched.get(namespace, True)

    def load_settings(self, saved: Any) -> list[str]:
        """Take the settings of a file, and which namespaces it shows."""
        spaces = saved.get("Namespaces")
        if isinstance(spaces, dict):
            for name, shown in spaces.items():
                if isinstance(shown, bool):
                    self.setNamespaceEnabled(str(name), shown)
        return super().load_settings(saved)

    def save_settings(self, older: Any = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file, with the namespaces that are shown."""
        kept = super().save_settings(older, ros)
        names = sorted({*self._spaces, *self._switched})
        kept["Namespaces"] = {name: self.is_namespace_enabled(name) for name in names}
        return kept

    # -- messages --------------------------------------------------------------------------------

    def _show_waiting(self) -> None:
        # Each marker has a frame and time of its own.
        while self._waiting:
            self._late.extend(self._waiting.popleft().data)
        for _ in range(len(self._late)):
            self._apply(self._late.popleft())

    def on_transforms(self) -> None:
        """Show what has waited for transforms; move what is locked to its frame."""
        self._show_waiting()
        if self._late:
            return
        locked = [one.marker for one in self._shown.values() if one.marker.locked]
        for marker in locked:
            self._place_marker(marker, 0)

    def on_fixed_frame(self) -> None:
        """Place all markers anew."""
        for one in list(self._shown.values()):
            self._place_marker(one.marker, 0 if one.marker.locked else one.marker.stamp)
        self._show_waiting()

    def _apply(self, marker: MarkerRecord) -> None:
        name = f"{marker.key[0]}/{marker.key[1]}"
        if marker.action == _DELETE_ALL:
            self._clear(marker.key[0])
            return
        if marker.action == _DELETE:
            self._remove(marker.key)
            return
        if marker.problem:
            self._remove(marker.key)
            self.set_status(name, "error", marker.problem)
            return
        if marker.key not in self._shown and len(self._shown) >= _MAX_MARKERS:
            self.set_status("Markers", "error", f"only {_MAX_MARKERS} markers are shown")
            return
        if not self._place_marker(marker, 0 if marker.locked else marker.stamp):
            # It may come later: the first ones that wait for too long make room.
            self._late.append(marker)
            return
        self.delete_status(name)
        expires = time.monotonic() + marker.lifetime if marker.lifetime else np.inf
        self._shown[marker.key] = _Shown(marker, expires)
        if marker.lifetime:
            self._schedule_expiry()

    def _place_marker(self, marker: MarkerRecord, stamp: int) -> bool:
        scene = self.scene
        if scene is None:
            return False
        try:
            pose = scene.look_up(marker.frame or scene.fixed_frame, stamp)
        except TransformException as error:
            self.set_status("Transform", "error", f"no transform from [{marker.frame}]: {error}")
            return False
        self.delete_status("Transform")
        space = self._spaces.get(marker.key[0])
        if space is None:
            space = self._spaces[marker.key[0]] = MarkerGroup(self)
            space.root.visible = self.is_namespace_enabled(marker.key[0])
            self.root.add(space.root)
            report(self, namespaces=sorted(self._spaces))
        space.put(marker, pose, self._meshes)
        self._flush_later()
        return True

    def _flush_later(self) -> None:
        if not self._flushing:
            self._flushing = True
            single_shot(self, self._flush).start(0)

    def _flush(self) -> None:
        self._flushing = False
        if is_alive(self):
            for space in self._spaces.values():
                space.flush()

    def _remove(self, key: tuple[str, int]) -> None:
        self._shown.pop(key, None)
        space = self._spaces.get(key[0])
        if space is not None:
            space.remove(key)
            self._flush_later()
        self.delete_status(f"{key[0]}/{key[1]}")
        if self._late:
            kept = [one for one in self._late if one.key != key]
            self._late = deque(kept, maxlen=_WAITING)

    def _clear(self, namespace: str) -> None:
        """Remove the markers of a namespace; all of them for an empty one, as RViz does."""
        for key in [key for key in self._shown if namespace in ("", key[0])]:
            self._remove(key)
        self._late.clear()

    def reset(self) -> None:
        """Drop all markers."""
        super().reset()
        self._shown.clear()
        self._spaces.clear()
        self._late.clear()
        report(self, namespaces=[])

    # -- lifetimes -------------------------------------------------------------------------------

    def _schedule_expiry(self) -> None:
        first = min((one.expires for one in self._shown.values()), default=np.inf)
        if np.isfinite(first):
            self._expiry.start(max(int((first - time.monotonic()) * 1000) + 1, 1))

    def _expire(self) -> None:
        now = time.monotonic()
        for key in [key for key, one in self._shown.items() if one.expires <= now]:
            self._remove(key)
        self._schedule_expiry()

    # -- meshes ----------------------------------------------------------------------------------

    def _in_background(self, work: Callable[[], Any], then: Callable[[Any], None]) -> None:
        if self.scene is not None:
            self.scene.load(work, then)

    def _on_mesh(self, uri: str, problem: str) -> None:
        if not is_alive(self):
            return
        if problem:
            self.set_status("Mesh", "error", f"{uri}: {problem}")
            return
        for one in list(self._shown.values()):
            if one.marker.kind == MESH and one.marker.resource == uri:
                self._place_marker(one.marker, 0 if one.marker.locked else one.marker.stamp)


def _read_markers(message: Any) -> list[MarkerRecord]:
    if "markers" not in message:
        return [read_marker(message)]
    count = len(message.markers)
    if count > _MAX_MARKERS:
        raise Error(f"markers: {count} are more than the {_MAX_MARKERS} that are shown")
    return [read_marker(marker) for marker in message.markers]


class MarkerDisplay(Markers):
    """Markers of a ``visualization_msgs/Marker`` topic. See its page in ``docs/scene.md``."""

    TYPE = "Marker"


class MarkerArrayDisplay(Markers):
    """Markers of a ``visualization_msgs/MarkerArray`` topic. See its page in ``docs/scene.md``."""

    TYPE = "MarkerArray"
