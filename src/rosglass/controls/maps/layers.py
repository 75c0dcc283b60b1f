"""The layers of a map: occupancy grids in tiles, and scans, paths, outlines and particles.

A worker thread reads the messages into numpy arrays; the GUI thread places them by their transforms
and paints them. :class:`~rosglass.controls.maps.scene.MapScene` creates the layers.
"""
# ruff: noqa: N815 - the names of properties are QML's

from __future__ import annotations

import math
import time
from collections import deque
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from rosglass.comm.qos import Durability, QoS, Reliability
from rosglass.comm.time import Time
from rosglass.controls.maps.camera import Plane
from rosglass.controls.maps.geo_tiles import to_mercator
from rosglass.controls.maps.grid import GridReader, theme_colors
from rosglass.controls.maps.tiles import TileLayer
from rosglass.errors import Error, TransformException
from rosglass.images.grid_colors import grid_colors
from rosglass.messages import read_columns
from rosglass.qml.elements.element import TopicElement
from rosglass.qml.elements.message_queue import MessageQueue, QueuedMessage, Subscriptions
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import Property, QtCore, QtGui, Signal, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from rosglass.controls.maps.grid import GridChange
    from rosglass.tf import TransformBuffer

__all__ = ["LAYERS", "Canvas", "GridLayer", "MapLayer", "VectorLayer"]

_QOS = QoS(depth=10, reliability=Reliability.BEST_AVAILABLE, durability=Durability.BEST_AVAILABLE)
#: For updates of a map: a kept one may be older than the map.
_UPDATES = QoS(depth=100, reliability=Reliability.BEST_AVAILABLE)
#: Points and poses of a message that are shown.
_MOST_POINTS, _MOST_POSES = 200_000, 20_000
#: Seconds that a scan waits for its transform before that is a problem.
_TRANSFORM_WAIT_S = 1.0
#: Opacity of what is out of date.
_OLD_ALPHA = 0.35


class MapLayer(TopicElement):
    """One topic on a map; created by a ``MapScene``, whose QML lists it.

    Args:
        scene: The ``MapScene``, whose module imports this one.
        topic: Absolute name.

    Attributes:
        TYPES: Names of the message types, as in ROS 1.
        FOUND: Those by which its topic is found.
        TIMEOUT_S: Seconds without a message after which it is old; 0 if it stays valid.
        frame: The frame of what is shown; empty for nothing.
    """

    KIND: ClassVar[str] = ""
    TYPES: ClassVar[tuple[str, ...]] = ()
    FOUND: ClassVar[tuple[str, ...]] = ()
    TIMEOUT_S: ClassVar[float] = 0.0
    DEPTH: ClassVar[int] = 1
    NEEDS_FRAME: ClassVar[bool] = True
    _HOLDS = ("_queue",)

    topicChanged = Signal()
    topic = Writable(str, read="_get_topic", write="_set_topic")
    kind = Property(str, lambda self: self.KIND, constant=True)
    #: Whether it is received and drawn.
    shown = Writable(bool, True, then="_on_shown")
    age = ReadOnly(float, -1.0)

    def __init__(self, scene: Any, topic: str) -> None:
        super().__init__(scene, scene._find_runtime())
        self._scene = scene
        self._topic = topic
        self._queue: MessageQueue | None = None
        self._arrived_at = self._late = 0.0
        #: Why the last message cannot be shown, is odd, or has no place.
        self._error = self._warning = self._lost = self._described = ""
        self.frame = ""
        self.pose: Plane | None = None

    # Receiving.

    def _reader(self) -> Callable[[Any], Any]:
        """Return the function that reads messages, for the worker thread."""
        raise NotImplementedError

    def _profiles(self, topic: str) -> dict[str, QoS]:
        return {topic: _QOS}

    def _wanted(self) -> tuple[Any, ...] | None:
        node, topic = self.node, self._resolve(self._topic)
        return (node, topic) if node is not None and topic and self.shown else None

    def _factory(self, *wanted: Any) -> Callable[[], Subscriptions]:
        node, topic = wanted
        self._set_resolved(topic)
        self._publishers = self._count_publishers()
        queue = self._queue = MessageQueue(
            self._reader(),
            self.TYPES,
            self._executor,
            weak_callback(self._on_items),
            self.DEPTH,
            needs_frame=self.NEEDS_FRAME,
        )
        profiles, worker = self._profiles(topic), self._scene.worker
        return lambda: Subscriptions(node, profiles, queue, worker)

    def _on_created(self, endpoint: Any) -> None:  # noqa: ARG002 - the base's
        self._set_problem("")
        self._expect_publishers()

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base's
        self._no_publisher.stop()
        self._queue = None
        self.clear()

    def _on_shown(self) -> None:
        if not self.shown:
            self._close_endpoint()
        self._schedule()
        self._scene.changed()

    def _on_items(self) -> None:
        queue = self._queue if is_alive(self) else None
        if queue is None:
            return
        items, self._error = queue.drain()
        if items:
            self._arrived_at, self._late = self._steady(), queue.late
            self._judge_publisher(queue.publisher)
            self.take(items)
            self._scene.changed()
        self._update_stale()

    def take(self, items: list[QueuedMessage]) -> None:
        """Show what has been read, the newest last."""
        raise NotImplementedError

    def clear(self) -> None:
        """Show nothing."""
        self.frame, self.pose = "", None
        self._error = self._warning = self._lost = ""
        self._arrived_at = 0.0
        self._described = ""
        if report(self, age=-1.0):
            self._announce_problem()

    # Judging.

    def _recheck_outdated(self) -> None:
        # The publisher that latched the message still exists and would have sent a newer one.
        session, queue, node = self._session, self._queue, self.node
        if session is None or queue is None or node is None or session.state != "connected":
            return
        try:
            publishers = node.publishers(self._resolved)
        except Error:
            return
        known = any(one.gid for one in publishers)
        if any(
            one.qos.durability is Durability.TRANSIENT_LOCAL
            and (one.gid == queue.publisher or not known)
            for one in publishers
        ):
            self._outdated = False

    def _is_old(self) -> bool:
        if not self._arrived_at:
            return True
        age = self._steady() - self._arrived_at + self._late
        return 0 < self.TIMEOUT_S < age

    def _update_stale(self) -> None:
        if self._arrived_at:
            report(self, age=self._steady() - self._arrived_at)
        super()._update_stale()
        self._described = self._describe()
        if is_alive(self):
            self._announce_problem()

    def _get_problem(self) -> str:
        return self._problem or self._described

    def _describe(self) -> str:
        wrong = self._problem or self._error or self._lost
        if wrong or not self.shown:
            return wrong
        endpoint = self._endpoint
        if endpoint is not None and endpoint.problem:
            return str(endpoint.problem)
        if not self._arrived_at:
            # Paths and particles are sent when there are any.
            return "no data yet" if self.TIMEOUT_S or self.KIND == "map" else ""
        if self._outdated:
            return f"its publisher is gone; {self.age:.0f} s old"
        return f"{self.age:.1f} s old" if self.stale else self._warning

    # Placing.

    @property
    def waits(self) -> bool:
        """True while something waits for its transform."""
        return False

    def place(self, buffer: TransformBuffer, fixed: str) -> None:
        """Set the pose of the frame in the fixed one; None while it is unknown."""
        self.pose, self._lost = None, ""
        if self.frame:
            self.pose, self._lost = place_of(buffer, fixed, self.frame, 0)


def place_of(
    buffer: TransformBuffer, fixed: str, frame: str, stamp: int
) -> tuple[Plane | None, str]:
    """Return the pose of a frame seen from above, and why it is unknown.

    Args:
        buffer: The transforms.
        fixed: The frame of the map.
        frame: The other one.
        stamp: Nanoseconds; 0 for the newest.
    """
    if frame == fixed:
        return Plane(1.0, 0.0, 0.0, 1.0, 0.0, 0.0), ""
    try:
        found = buffer.lookup_transform(fixed, frame, Time(stamp) if stamp else None)
    except TransformException as error:
        return None, f"no transform from {frame} to {fixed}: {error}"
    (x, y, _), (qx, qy, qz, qw) = found.translation, found.rotation
    # Where its x and y axes point: a scanner may be mounted upside down.
    a, b = 1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw)
    c, d = 2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz)
    return Plane(a, b, c, d, x, y), ""


# -- grids ---------------------------------------------------------------------------------------


class GridLayer(MapLayer):
    """A map or costmap. Its `tiles` are shown by QML."""

    KIND = "map"
    TYPES = ("nav_msgs/OccupancyGrid", "map_msgs/OccupancyGridUpdate")
    FOUND = TYPES[:1]

    tilesChanged = Signal()
    tiles = Property(QtCore.QObject, lambda self: self.layer, notify=tilesChanged)
    opacity = Writable(float, 1.0, then="")
    resolution = ReadOnly(float, 0.0)

    def __init__(self, scene: Any, topic: str) -> None:
        super().__init__(scene, topic)
        self.layer = TileLayer(self, scene.images, scene.worker, scene.gui)
        self._grid: GridChange | None = None
        self._own_reader = GridReader(self._colors_wanted())

    @property
    def grid(self) -> GridChange | None:
        """The map that is shown; None for nothing."""
        return self._grid

    def _profiles(self, topic: str) -> dict[str, QoS]:
        return {topic: _QOS.with_depth(1), f"{topic}_updates": _UPDATES}

    def _reader(self) -> Callable[[Any], Any]:
        self._own_reader = GridReader(self._colors_wanted())
        return self._own_reader.read

    def _colors_wanted(self) -> NDArray[np.uint8]:
        scheme = self._scene.colorScheme
        if scheme != "theme":
            return grid_colors(scheme)
        # PySide's hints do not say what these tuples hold.
        free: Any = self._scene.freeColor
        occupied: Any = self._scene.occupiedColor
        return theme_colors(free.getRgb()[:3], occupied.getRgb()[:3])

    def recolor(self) -> None:
        """Use the map's present colours."""
        reader, colors = self._own_reader, self._colors_wanted()
        executor, done = self._scene.gui, weak_callback(self._on_recolored)

        def work() -> None:
            reader.set_colors(colors)
            executor.post(done)

        self._scene.worker.post(work)

    def _on_recolored(self) -> None:
        if is_alive(self):
            self.layer.refresh()

    def take(self, items: list[QueuedMessage]) -> None:
        """Show the newest map."""
        item = items[-1]
        self._grid, self.frame = item.data, item.frame
        self._warning = item.data.warning
        report(self, resolution=item.data.tiles.resolution)
        self.layer.set_source(item.data.tiles)
        self.layer.refresh()

    def clear(self) -> None:
        """Show nothing."""
        super().clear()
        self._grid = None
        self.layer.set_source(None)

    def place(self, buffer: TransformBuffer, fixed: str) -> None:
        """Place the lower left corner, and follow the camera."""
        super().place(buffer, fixed)
        grid, pose = self._grid, self.pose
        whole = None if pose is None or grid is None else pose.after(Plane.pose(*grid.pose))
        self.layer.set_view(self._scene.camera, whole)

    def bounds(self) -> tuple[float, float, float, float] | None:
        """Return left, bottom, right and top in the fixed frame; None while unknown."""
        if self._grid is None or self.pose is None:
            return None
        tiles, pose = self._grid.tiles, self.pose.after(Plane.pose(*self._grid.pose))
        return pose.box(tiles.width, tiles.height)


class CostmapLayer(GridLayer):
    """A costmap: RViz's colours, and translucent."""

    KIND = "costmap"
    opacity = Writable(float, 0.6, then="")

    def _colors_wanted(self) -> NDArray[np.uint8]:
        return grid_colors("costmap")


# -- points and lines ----------------------------------------------------------------------------


class Shape(NamedTuple):
    """The drawing of a message.

    Attributes:
        points: (n, 2) metres in its frame.
        warning: What is odd about it; empty for nothing.
    """

    points: NDArray[np.float64]
    warning: str = ""


def _finite(points: NDArray[np.float64], what: str) -> Shape:
    good = np.isfinite(points).all(axis=1) & (np.abs(points) < 1e9).all(axis=1)
    bad = int(len(points) - good.sum())
    warning = f"{bad} of {len(points)} {what} are not finite and left out" if bad else ""
    return Shape(points[good] if bad else points, warning)


def _check_count(count: int, most: int, what: str) -> None:
    if count > most:
        raise Error(f"{count} {what} are more than the {most} that are shown")


def read_scan(message: Any) -> Shape:
    """Read a ``sensor_msgs/LaserScan``: the ends of its rays between the limits."""
    ranges = np.asarray(message.ranges, np.float64)
    _check_count(len(ranges), _MOST_POINTS, "ranges")
    start, step = float(message.angle_min), float(message.angle_increment)
    if not (math.isfinite(start) and math.isfinite(step)):
        raise Error(f"angle_min is {start:g}, angle_increment is {step:g}: expected radians")
    low, high = float(message.range_min), float(message.range_max)
    if math.isnan(low) or math.isnan(high):
        raise Error(f"range_min is {low:g}, range_max is {high:g}: expected metres")
    # Publishers that leave range_max at 0 set no limit.
    with np.errstate(invalid="ignore"):
        hit = np.flatnonzero(
            np.isfinite(ranges) & (ranges > max(low, 0.0)) & (ranges < (high or 1e6))
        )
    angles = start + step * hit
    kept = ranges[hit]
    return Shape(np.stack([kept * np.cos(angles), kept * np.sin(angles)], axis=1))


def read_path(message: Any) -> Shape:
    """Read a ``nav_msgs/Path``."""
    _check_count(len(message.poses), _MOST_POSES, "poses")
    points = np.empty((len(message.poses), 2))
    for at, stamped in enumerate(message.poses):
        position = stamped.pose.position
        points[at] = position.x, position.y
    return _finite(points, "poses")


def read_outline(message: Any) -> Shape:
    """Read a ``geometry_msgs/PolygonStamped``."""
    _check_count(len(message.polygon.points), _MOST_POSES, "points")
    return _finite(read_columns(message.polygon.points, "x", "y"), "points")


def read_particles(message: Any) -> Shape:
    """Read a ``geometry_msgs/PoseArray`` or a ``nav2_msgs/ParticleCloud``."""
    is_cloud = "particles" in message
    elements, path = (message.particles, "pose.") if is_cloud else (message.poses, "")
    _check_count(len(elements), _MOST_POINTS, "poses")
    return _finite(read_columns(elements, f"{path}position.x", f"{path}position.y"), "poses")


def read_geo_path(message: Any) -> Shape:
    """Read a ``geographic_msgs/GeoPath``, in Mercator metres."""
    _check_count(len(message.poses), _MOST_POSES, "poses")
    points = np.full((len(message.poses), 2), np.nan)
    for at, stamped in enumerate(message.poses):
        position = stamped.pose.position
        if abs(position.latitude) <= 90 and abs(position.longitude) <= 180:
            points[at] = to_mercator(position.latitude, position.longitude)
    return _finite(points, "poses")


class Canvas:
    """The pixels into which points are drawn, of the size of the map.

    Attributes:
        width, height: Pixels.
    """

    def __init__(self) -> None:
        self.width = self.height = 0
        self._pixels = np.zeros(0, np.uint32)
        self._dirty: list[NDArray[np.int64]] = []

    def begin(self, width: int, height: int) -> None:
        """Make everything transparent."""
        if (width, height) != (self.width, self.height):
            self.width, self.height = width, height
            self._pixels = np.zeros(width * height, np.uint32)
        else:
            for places in self._dirty:
                self._pixels[places] = 0
        self._dirty.clear()

    def dots(
        self,
        plane: Plane,
        points: NDArray[np.float64],
        color: QtGui.QColor,
        side: int,
        alpha: float,
    ) -> None:
        """Draw squares of `side` pixels."""
        half, wide, high = side // 2, self.width, self.height
        with np.errstate(invalid="ignore", over="ignore"):
            x = plane.a * points[:, 0] + plane.b * points[:, 1] + (plane.e - half)
            y = plane.c * points[:, 0] + plane.d * points[:, 1] + (plane.f - half)
        seen = (x >= 0) & (x < wide - side) & (y >= 0) & (y < high - side)
        at = np.unique(y[seen].astype(np.int64) * wide + x[seen].astype(np.int64))
        places = (
            at + (np.arange(side) + np.arange(side)[:, np.newaxis] * wide).reshape(-1, 1)
        ).ravel()
        alpha *= color.alphaF()
        levels: Any = color.getRgbF()
        red, green, blue = (round(255 * alpha * v) for v in levels[:3])
        self._pixels[places] = (round(255 * alpha) << 24) | (red << 16) | (green << 8) | blue
        self._dirty.append(places)

    def show(self, painter: QtGui.QPainter) -> None:
        """Paint the points."""
        if any(len(places) for places in self._dirty):
            kind = QtGui.QImage.Format.Format_ARGB32_Premultiplied
            pixels = self._pixels.data
            image = QtGui.QImage(pixels, self.width, self.height, 4 * self.width, kind)
            painter.drawImage(0, 0, image)


class VectorLayer(MapLayer):
    """Points or lines that :class:`~rosglass.controls.maps.marks.MapMarks` paints.

    Attributes:
        READ: Reads a message.
        COLOR: The property of ``MapMarks`` that has its colour.
        DOT: Pixels of a point's side; 0 for lines.
        IS_CLOSED: Whether the line ends where it begins.
        IS_STAMPED: Whether a message is placed where its frame was at its time.
    """

    READ: ClassVar[Any]
    COLOR: ClassVar[str]
    DOT: ClassVar[int] = 0
    IS_CLOSED: ClassVar[bool] = False
    IS_STAMPED: ClassVar[bool] = False

    def __init__(self, scene: Any, topic: str) -> None:
        super().__init__(scene, topic)
        self._shape: Shape | None = None
        self._line: QtGui.QPolygonF | None = None
        #: Messages that wait for their transforms, with the time since when.
        self._waiting: deque[tuple[QueuedMessage, float]] = deque(maxlen=10)

    @property
    def shape(self) -> Shape | None:
        """The drawing that is shown; None for nothing."""
        return self._shape

    @property
    def waits(self) -> bool:
        """True while a message waits for its transform."""
        return bool(self._waiting)

    def _reader(self) -> Callable[[Any], Any]:
        reader: Callable[[Any], Shape] = type(self).READ
        return reader

    def take(self, items: list[QueuedMessage]) -> None:
        """Show the newest message, or have it wait for its transform."""
        now = time.monotonic()
        if self.IS_STAMPED:
            self._waiting.extend((item, now) for item in items)
        else:
            self._show(items[-1])

    def _show(self, item: QueuedMessage) -> None:
        self._shape, self.frame, self._line = item.data, item.frame, None
        self._warning = item.data.warning

    def clear(self) -> None:
        """Show nothing."""
        super().clear()
        self._shape = self._line = None
        self._waiting.clear()

    def place(self, buffer: TransformBuffer, fixed: str) -> None:
        """Place the message; one with a stamp where its frame was at that time."""
        if not self.IS_STAMPED:
            super().place(buffer, fixed)
            return
        if not self._waiting and self.pose is not None:
            return
        for item, _ in reversed([*self._waiting]):
            pose, why = place_of(buffer, fixed, item.frame, item.stamp)
            if pose is not None:
                self._show(item)
                self.pose, self._lost = pose, ""
                while self._waiting and self._waiting.popleft()[0] is not item:
                    pass
                return
            late = time.monotonic() - self._waiting[0][1] > _TRANSFORM_WAIT_S
            self._lost = why if late else self._lost
        if self._lost:
            self._shape = self._line = None

    def on_fixed_frame(self) -> None:
        """Forget a pose in another frame."""
        self.pose = None

    def paint(self, painter: QtGui.QPainter, canvas: Canvas, view: Plane, color: Any) -> None:
        """Paint what is shown into the map's pixels."""
        shape, pose = self._shape, self.pose
        if shape is None or pose is None or not self.shown or not len(shape.points):
            return
        whole, alpha = view.after(pose), _OLD_ALPHA if self.stale else 1.0
        if self.DOT:
            canvas.dots(whole, shape.points, color, self.DOT, alpha)
            return
        if self._line is None:
            points = [QtCore.QPointF(x, y) for x, y in shape.points.tolist()]
            self._line = QtGui.QPolygonF(points)
        paint_line(painter, self._line, whole, color, alpha, is_closed=self.IS_CLOSED)


def paint_line(
    painter: QtGui.QPainter,
    line: QtGui.QPolygonF,
    view: Plane,
    color: QtGui.QColor,
    alpha: float = 1.0,
    *,
    is_closed: bool = False,
    width: float = 2.0,
) -> None:
    """Paint a line of metres, `width` pixels wide."""
    pen = QtGui.QPen(color, width)
    pen.setCosmetic(True)
    pen.setJoinStyle(QtCore.Qt.PenJoinStyle.BevelJoin)
    painter.save()
    painter.setOpacity(alpha)
    painter.setPen(pen)
    painter.setTransform(QtGui.QTransform(view.a, view.c, view.b, view.d, view.e, view.f), True)
    if is_closed:
        painter.drawPolygon(line)
    else:
        painter.drawPolyline(line)
    painter.restore()


class ScanLayer(VectorLayer):
    """A laser scan, at the place of the scanner at its time."""

    KIND, TYPES, TIMEOUT_S, DEPTH = "scan", ("sensor_msgs/LaserScan",), 1.5, 10
    FOUND = TYPES
    READ, COLOR, DOT, IS_STAMPED = staticmethod(read_scan), "scanColor", 3, True


class PathLayer(VectorLayer):
    """A planned path."""

    KIND, TYPES = "path", ("nav_msgs/Path",)
    FOUND = TYPES
    READ, COLOR = staticmethod(read_path), "pathColor"


class OutlineLayer(VectorLayer):
    """A footprint or another outline."""

    KIND, TYPES, TIMEOUT_S = "footprint", ("geometry_msgs/PolygonStamped",), 5.0
    FOUND = TYPES
    READ, COLOR, IS_CLOSED = staticmethod(read_outline), "footprintColor", True


class ParticleLayer(VectorLayer):
    """The particles of a localization."""

    KIND, TYPES = "particles", ("geometry_msgs/PoseArray", "nav2_msgs/ParticleCloud")
    FOUND = TYPES
    READ, COLOR, DOT = staticmethod(read_particles), "particleColor", 2


class GeoPathLayer(VectorLayer):
    """A path of degrees, on a ``GeoScene``."""

    KIND, TYPES = "path", ("geographic_msgs/GeoPath",)
    FOUND = TYPES
    READ, COLOR = staticmethod(read_geo_path), "pathColor"
    NEEDS_FRAME = False

    def take(self, items: list[QueuedMessage]) -> None:
        """Show the newest path where it is on the Earth."""
        super().take(items)
        self.pose = Plane(1.0, 0.0, 0.0, 1.0, 0.0, 0.0)


#: The layers by their kind, those at the bottom first.
LAYERS: dict[str, type[MapLayer]] = {
    kind.KIND: kind
    for kind in (GridLayer, CostmapLayer, ParticleLayer, PathLayer, OutlineLayer, ScanLayer)
}
