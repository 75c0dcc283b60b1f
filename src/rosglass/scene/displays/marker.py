"""The displays Marker and MarkerArray: shapes, lines, points, meshes and texts that robots send.

Messages are turned into records (:mod:`rosglass.scene.displays.marker_messages`) in the node's
thread.
Those of one namespace are drawn together (:mod:`rosglass.scene.displays.marker_batches`), except
for meshes, lists of points, long lines, and the first triangles and translucent lines.
"""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import logging
import math
import time
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar, cast

import numpy as np

from rosglass.errors import Error, TransformException
from rosglass.qml.elements.element import single_shot
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qt import Signal, Slot, is_alive
from rosglass.scene.displays.display import OUTDATED_ALPHA, Status
from rosglass.scene.displays.marker_batches import (
    MAX_JOINED_POINTS,
    LineBatch,
    SolidBatch,
    TextBatch,
    TriangleBatch,
)
from rosglass.scene.displays.marker_meshes import MarkerMeshes
from rosglass.scene.displays.marker_messages import (
    ARROW,
    ARROW_SHAPES,
    ARROW_STRIP,
    CUBE_LIST,
    DELETE,
    DELETE_ALL,
    LINE_LIST,
    LINE_STRIP,
    MAX_MARKERS,
    MESH,
    POINTS,
    SPHERE_LIST,
    TEXT,
    TRIANGLE_LIST,
    MarkerRecord,
    instances_of,
    read_markers,
    triangles_of,
)
from rosglass.scene.displays.parts import Parts
from rosglass.scene.displays.topic_display import TopicDisplay
from rosglass.scene.render.drawing import OPAQUE, Labels, Lines, Mesh, Points
from rosglass.scene.render.scene_tree import Drawable, Group

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable
    from typing import TypeAlias

    from numpy.typing import NDArray

    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore
    from rosglass.scene.data.resource_retriever import ResourceRetriever
    from rosglass.scene.displays.scene_frames import SceneFrames
    from rosglass.scene.render.mesh_shapes import Shape

    Matrix: TypeAlias = NDArray[np.float64]
    _Joint: TypeAlias = LineBatch | TextBatch | TriangleBatch

__all__ = [
    "MarkerArrayDisplay",
    "MarkerDisplay",
    "MarkerGroup",
    "Markers",
]

_log = logging.getLogger("rosglass.scene")

#: Point styles of lists of points.
_POINT_STYLES = {CUBE_LIST: "boxes", SPHERE_LIST: "spheres", POINTS: "squares"}
_IDENTITY = np.eye(4)
#: Markers that wait for a transform, of which the oldest make room, and their bytes.
_MAX_LATE, _MAX_LATE_BYTES = 1000, 256 << 20
#: Bytes of the points, colours and texts of all markers that are shown.
_MAX_SHOWN_BYTES = 1 << 30
#: Seconds after which no transform of a marker's time will come any more.
_MAX_WAIT_S = 60.0
#: Seconds for which a marker may wait for the transform of its time before that is an error.
_LATE_S = 1.0
#: Lookups that fail until the other waiting markers have to wait for the next transforms.
_MAX_MISSES = 50
#: Namespaces of a topic, each drawn on its own, for each frame that markers are locked to.
_MAX_NAMESPACES = 2000
#: Lists that are drawn together with others, and the markers of a group that are drawn alone, up to
#: which triangles and translucent lines are, too: these are sorted by distance and selected alone.
_JOINED, _MAX_ALONE = (LINE_STRIP, LINE_LIST, TRIANGLE_LIST), 100
#: Cubes whose markers are drawn together: 32 bits are exact to 0.1 mm there.
_CELL_M = 2000.0
#: Lines of the status, and markers whose problems are known.
_MAX_LINES, _MAX_PROBLEMS = 50, 1000


_B = TypeVar("_B", LineBatch, TextBatch, TriangleBatch)


class MarkerGroup:
    """Markers that are shown and hidden together, such as those of one namespace.

    Args:
        owner: The result of picking them; None if they cannot be picked.
    """

    def __init__(self, owner: Any) -> None:
        self.root = Group()
        self._owner = owner
        self._batches: dict[Shape, SolidBatch] = {}
        #: Shapes of markers that are drawn as instances.
        self._solids: dict[tuple[str, int], tuple[Shape, ...]] = {}
        #: Batches of texts, lines and triangles, by their common properties; the last one
        #: takes further markers.
        self._joint: dict[tuple[Any, ...], list[_Joint]] = {}
        #: The batches of markers that are in one.
        self._batch_of: dict[tuple[str, int], _Joint] = {}
        #: Drawables of markers that are drawn on their own.
        self._own: dict[tuple[str, int], Group] = {}
        #: The look of mesh markers.
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
        shapes, places = marker.instances or instances_of(marker)
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
        cloud = next(iter(own)) if own and marker.kind in _POINT_STYLES else None
        if own and isinstance(cloud, Points):
            # New data is uploaded over several frames: until then, it would be missing.
            _set_list(cloud, marker)
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
            look: The common properties of the markers of one batch.
            data: The data that must fit.
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
        """True if it has no marker."""
        return not (self._own or self._solids or self._batch_of)

    def flush(self) -> None:
        """Draw the changes since the last call."""
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


def _drawables(marker: MarkerRecord, meshes: MarkerMeshes) -> Iterable[Drawable]:
    """Iterate over what a marker draws beside instances, in its own frame."""
    kind, points = marker.kind, marker.points
    if kind in (LINE_STRIP, LINE_LIST):
        lines = Lines(abs(marker.scale[0]), in_metres=True)
        tints = _line_colors(marker)
        if kind == LINE_STRIP:
            lines.set_strip(points, tints)
        else:
            colors = tints if isinstance(tints, tuple) else tints.reshape(-1, 2, 4)
            lines.set_segments(points.reshape(-1, 2, 3), colors)
        yield lines
    elif kind in _POINT_STYLES:
        cloud = Points()
        _set_list(cloud, marker)
        yield cloud
    elif kind == TRIANGLE_LIST:
        shape, color, lit = _triangles_look(marker)
        yield Mesh(shape, color, lit=lit)
    elif kind == ARROW_STRIP:
        yield from _arrow_strip(marker)
    elif kind == MESH:
        yield from meshes.of(marker)


def _set_list(cloud: Points, marker: MarkerRecord) -> None:
    """Set `cloud` to a list of cubes, spheres or points."""
    kind, points, (x, y, z) = marker.kind, marker.points, marker.scale
    each = marker.colors if len(marker.colors) == len(points) else marker.color
    # Their sides are equal: the others come with the pose.
    sides = np.abs([1.0, y / x, z / x]) if kind == CUBE_LIST else np.ones(3)
    cloud.set_points(points / sides, _list_colors(each))
    cloud.pose = np.diag([*sides, 1.0])
    cloud.set_look(style=_POINT_STYLES[kind], size=abs(x))


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
    """Return the shape of a triangle list, its colour, and whether it is lit."""
    shape = marker.triangles or triangles_of(marker)
    # RViz does not light what has colours of its own.
    if len(marker.colors) in (len(marker.points), len(marker.points) // 3):
        return shape, (1.0, 1.0, 1.0, 1.0), False
    return shape, marker.color, True


def _arrow_strip(marker: MarkerRecord) -> Iterable[Mesh]:
    arrow = marker._replace(kind=ARROW, pose=_IDENTITY)
    arrows = [
        instances_of(arrow._replace(points=marker.points[at : at + 2]))[1]
        for at in range(len(marker.points) - 1)
    ]
    for part, shape in enumerate(ARROW_SHAPES):
        mesh = Mesh(shape, marker.color)
        mesh.set_instances(np.array([one[part] for one in arrows if one]).reshape(-1, 4, 4))
        yield mesh


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

    def __init__(self, scene: SceneFrames) -> None:
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
        return read_markers

    @Slot(str, bool)
    def setNamespaceEnabled(self, namespace: str, enabled: bool) -> None:  # noqa: N802 - QML's name
        """Show or hide the markers of a namespace."""
        self.parts.set_enabled(namespace, enabled)

    def _switch_groups(self) -> None:
        for (namespace, frame), group in self._groups.items():
            group.root.visible = self.parts.is_enabled(namespace) and frame not in self._lost

    def load_settings(self, saved: Any) -> list[str]:
        """Apply the settings in a file, and the visibility of namespaces."""
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
        """Show markers that waited for transforms; move the ones locked to their frame."""
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
        """Place markers that waited, and the ones locked to their frame."""
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
        if marker.action == DELETE_ALL:
            # In ROS 1, RViz removes those of all namespaces, whatever the message's is.
            is_ros1 = self.node is not None and self.node.wire == "ros1"
            self._clear("" if is_ros1 else key[0])
            return
        # What waits under its name is older.
        self._late.pop(key, None)
        if marker.action == DELETE or marker.problem:
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
            if self._hidden:
                self._forget_hidden(before)
            self._problems.pop(key, None)
            self._expires.pop(key, None)
        else:
            self._remove(key)
            size = self._size + marker.size
        if key not in self._shown and len(self._shown) >= MAX_MARKERS:
            self._note_problem(key, "error", f"only {MAX_MARKERS} markers are shown")
            return
        self._shown[key] = marker
        self._size = size
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
            problem = self._meshes.problem_of(marker) if marker.kind == MESH else ""
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


class MarkerDisplay(Markers):
    """Markers of a ``visualization_msgs/Marker`` topic. See its page in ``docs/scene.md``."""

    TYPE = "Marker"
    SUGGESTED = Markers.MESSAGES[:1]

    def further_topics(self, topic: str) -> tuple[str, ...]:
        """Return the topic of arrays that RViz receives beside it."""
        return (f"{topic}_array",)


class MarkerArrayDisplay(Markers):
    """Markers of a ``visualization_msgs/MarkerArray`` topic. See its page in ``docs/scene.md``."""

    TYPE = "MarkerArray"
    SUGGESTED = Markers.MESSAGES[1:]
