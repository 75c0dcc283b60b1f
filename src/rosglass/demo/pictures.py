"""The map and the laser scan as images, painted outside the GUI thread.

QML types ``MapPicture`` and ``ScanPicture`` of the module ``RosglassDemo 1.0``. Both have a topic
and provide a `source` for a QML ``Image``; cells and points never pass through JavaScript.
"""

from __future__ import annotations

import itertools
import math
import time
from abc import abstractmethod
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.comm import Dispatcher, QoS
from rosglass.errors import Error
from rosglass.qml.elements.element import TopicElement
from rosglass.qml.engine.session import result_of
from rosglass.qt import Property, QtCore, QtGui, QtQml, QtQuick, Signal, Slot

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from rosglass.comm import Node, Subscription
    from rosglass.messages import Message

__all__ = ["MapPicture", "ScanPicture", "paint_map", "paint_scan", "register"]

#: Largest number of cells of a map; a larger one is refused, as it would exhaust the memory.
_MOST_CELLS = 100_000_000
_numbers = itertools.count(1)


def paint_map(cells: npt.NDArray[np.int8], width: int, height: int) -> QtGui.QImage:
    """Return an occupancy grid as an image in the cockpit's colours, north up.

    Args:
        cells: Rows from south to north, -1 unknown, 0 free to 100 occupied.
        width: Columns.
        height: Rows.

    Raises:
        Error: The number of cells is not `width` times `height`.
    """
    if width * height != cells.size or not cells.size:
        raise Error(f"the map says {width} x {height} cells but brings {cells.size}")
    colors = np.empty((256, 4), np.uint8)
    share = np.linspace(0.0, 1.0, 101)[:, None] ** 0.8
    free, taken = np.array([27, 38, 49, 255]), np.array([126, 151, 173, 255])
    colors[:101] = (free + (taken - free) * share).astype(np.uint8)
    # Unknown and invalid values stay transparent: the panel shows through.
    colors[101:] = 0
    pixels = np.ascontiguousarray(colors[cells.view(np.uint8).reshape(height, width)[::-1]])
    kind = QtGui.QImage.Format.Format_RGBA8888
    return QtGui.QImage(pixels.data, width, height, 4 * width, kind).copy()


def paint_scan(
    ranges: npt.NDArray[np.float32], start: float, step: float, size: int, metres: float
) -> QtGui.QImage:
    """Return a laser scan as an image, with the scanner in the middle, facing right.

    Args:
        ranges: Distances in metres; non-finite ones are left out.
        start: Direction of the first beam, radians, counter-clockwise from ahead.
        step: Angle between two beams, radians.
        size: Side of the image, pixels.
        metres: Side of the image, metres.
    """
    picture = QtGui.QImage(size, size, QtGui.QImage.Format.Format_ARGB32_Premultiplied)
    picture.fill(QtCore.Qt.GlobalColor.transparent)
    angles = start + step * np.arange(ranges.size)
    hit = np.isfinite(ranges) & (ranges > 0)
    reach = np.where(hit, ranges, metres / 2)
    scale, middle = size / metres, size / 2
    xs = middle + np.cos(angles) * reach * scale
    ys = middle - np.sin(angles) * reach * scale
    points = [QtCore.QPointF(x, y) for x, y in zip(xs.tolist(), ys.tolist(), strict=True)]
    painter = QtGui.QPainter(picture)
    try:
        painter.setRenderHint(QtGui.QPainter.RenderHint.Antialiasing)
        glow = QtGui.QRadialGradient(middle, middle, 7 * scale)
        glow.setColorAt(0.0, QtGui.QColor(63, 210, 232, 74))
        glow.setColorAt(1.0, QtGui.QColor(63, 210, 232, 16))
        painter.setPen(QtCore.Qt.PenStyle.NoPen)
        painter.setBrush(glow)
        painter.drawPolygon(QtGui.QPolygonF(points))
        pen = QtGui.QPen(QtGui.QColor(255, 92, 108, 235), 0.09 * scale)
        pen.setCapStyle(QtCore.Qt.PenCapStyle.RoundCap)
        painter.setPen(pen)
        seen = [point for point, good in zip(points, hit.tolist(), strict=True) if good]
        if seen:
            painter.drawPoints(seen)
    finally:
        painter.end()
    return picture


class _Provider(QtQuick.QQuickImageProvider):
    """Provides the newest image of one element to QML's ``Image``."""

    def __init__(self) -> None:
        super().__init__(QtQuick.QQuickImageProvider.ImageType.Image)
        self.picture = QtGui.QImage()

    def requestImage(self, name: str, size: QtCore.QSize, _: QtCore.QSize) -> QtGui.QImage:  # noqa: ARG002, N802 - Qt's
        """Return the image; called by Qt."""
        picture = self.picture
        size.setWidth(picture.width())
        size.setHeight(picture.height())
        return picture


class _Picture(TopicElement):
    """A topic displayed as an image; subclasses paint it."""

    #: Type of the messages, and profile of the subscription.
    kind: str
    qos: QoS

    topicChanged, limitChanged = Signal(), Signal()  # noqa: N815 - Qt's
    changed, ageChanged = Signal(), Signal()  # noqa: N815 - Qt's
    _painted = Signal(object)

    _HOLDS = ("_provider",)
    _endpoint: Subscription | None

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._stale_after_s, self._age = 0.0, -1.0
        self._name, self._version = f"rosglass-picture-{next(_numbers)}", 0
        self._stamp = 0.0
        self._provider: _Provider | None = None
        self._painter = Dispatcher(self._name)
        self._painted.connect(self._show, QtCore.Qt.ConnectionType.QueuedConnection)
        self.destroyed.connect(self._painter.close)

    @abstractmethod
    def paint(self, message: Message) -> tuple[QtGui.QImage, tuple[float, ...]]:
        """Paint a message, on the painting thread; the numbers are passed to :meth:`take`."""

    @abstractmethod
    def take(self, numbers: tuple[float, ...]) -> None:
        """Set the values of the image that is displayed from now on; on the GUI thread."""

    def _wanted(self) -> tuple[Node, str] | None:
        node, topic = self.node, self._resolve(self._topic)
        return (node, topic) if node is not None and topic else None

    def _factory(self, node: Node, topic: str) -> Callable[[], Subscription]:
        self._set_problem("")  # not later: the first message may have one
        engine = QtQml.qjsEngine(self)
        if self._provider is None and isinstance(engine, QtQml.QQmlEngine):
            self._provider = _Provider()
            engine.addImageProvider(self._name, self._provider)
        return lambda: node.create_subscription(
            topic, self.kind, self._on_message, self.qos, executor=self._painter
        )

    def _on_message(self, message: Message) -> None:
        result = result_of(lambda: self.paint(message), f"painting {self._topic}")
        with suppress(RuntimeError):  # the QML object was destroyed while its image was painted
            self._painted.emit(result)

    # Slots: QML elements with properties of their own hide methods that are not declared.
    @Slot(object)
    def _show(self, result: object) -> None:
        if isinstance(result, Error):
            self._set_problem(f"{self._topic}: {result}")
            return
        assert isinstance(result, tuple)
        picture, numbers = result
        if self._provider is None:
            return
        self._provider.picture = picture
        self._version += 1
        self._stamp, self._age = time.monotonic(), 0.0
        self._outdated = False
        self.take(numbers)
        self._set_problem("")
        self.changed.emit()
        self.ageChanged.emit()
        self._update_stale()

    @Slot()
    def _on_tick(self) -> None:
        if self._version:
            self._age = time.monotonic() - self._stamp
            self.ageChanged.emit()
        super()._on_tick()

    def _is_old(self) -> bool:
        if not self._version:
            return True
        return 0 < self._stale_after_s < time.monotonic() - self._stamp

    def _set_topic(self, topic: str) -> None:
        if topic != self._topic:
            self._topic = topic
            self.topicChanged.emit()
            self._schedule()

    def _set_limit(self, limit: float) -> None:
        if limit != self._stale_after_s:
            self._stale_after_s = limit
            self.limitChanged.emit()
            self._update_stale()

    def _frequency(self) -> float:
        return 0.0 if self._endpoint is None else self._endpoint.statistics().frequency

    def _source(self) -> QtCore.QUrl:
        return QtCore.QUrl(f"image://{self._name}/{self._version}" if self._version else "")

    topic = Property(str, lambda self: self._topic, _set_topic, notify=topicChanged)
    #: Seconds without a message after which the image is outdated; 0 for never.
    limit = Property(float, lambda self: self._stale_after_s, _set_limit, notify=limitChanged)
    source = Property(QtCore.QUrl, _source, notify=changed)
    received = Property(bool, lambda self: self._version > 0, notify=changed)
    #: Seconds since the newest message, -1 before the first.
    age = Property(float, lambda self: self._age, notify=ageChanged)
    #: Messages per second.
    frequency = Property(float, _frequency, notify=ageChanged)
    messageType = Property(str, lambda self: self.kind, constant=True)  # noqa: N815


class MapPicture(_Picture):
    """A ``nav_msgs/msg/OccupancyGrid`` as an image, north up.

    `left` and `bottom` are the position of its lower left corner in the map, `metresWide` and
    `metresHigh` its size. The map's own rotation is not supported and reported as a problem.
    """

    kind, qos = "nav_msgs/msg/OccupancyGrid", QoS.latched()
    placed = Signal()

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._numbers: tuple[float, ...] = (0.0, 0.0, 1.0, 1.0)

    def paint(self, message: Message) -> tuple[QtGui.QImage, tuple[float, ...]]:
        """Paint the grid."""
        info = message.info
        if info.width * info.height > _MOST_CELLS:
            raise Error(f"{info.width} x {info.height} cells are too many to be shown")
        if abs(info.origin.orientation.z) > 1e-3:
            raise Error("the map is rotated, which is not supported")
        resolution = info.resolution
        if not (math.isfinite(resolution) and resolution > 0):
            raise Error(f"the map's resolution is {resolution} m per cell")
        cells = np.asarray(message.data, dtype=np.int8)
        corner = info.origin.position
        size = (info.width * resolution, info.height * resolution)
        return paint_map(cells, info.width, info.height), (corner.x, corner.y, *size)

    def take(self, numbers: tuple[float, ...]) -> None:
        """Store the position and size of the map."""
        if numbers != self._numbers:
            self._numbers = numbers
            self.placed.emit()

    left = Property(float, lambda self: self._numbers[0], notify=placed)
    bottom = Property(float, lambda self: self._numbers[1], notify=placed)
    metresWide = Property(float, lambda self: self._numbers[2], notify=placed)  # noqa: N815
    metresHigh = Property(float, lambda self: self._numbers[3], notify=placed)  # noqa: N815


class ScanPicture(_Picture):
    """A ``sensor_msgs/msg/LaserScan`` as an image, with the scanner in the middle, facing right.

    `metres` is the length of the image's side.
    """

    kind, qos = "sensor_msgs/msg/LaserScan", QoS.sensor_data().with_depth(1)
    placed = Signal()
    _PIXELS_PER_METRE = 16

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._metres = 1.0

    def paint(self, message: Message) -> tuple[QtGui.QImage, tuple[float, ...]]:
        """Paint the scan."""
        ranges = np.asarray(message.ranges, dtype=np.float32)
        finite = ranges[np.isfinite(ranges)]
        # Steps of a metre, so that the image's size does not change with every scan.
        far = math.ceil(min(float(finite.max()), 30.0)) if finite.size else 1
        metres = 2.0 * max(1, far)
        size = round(metres * self._PIXELS_PER_METRE)
        picture = paint_scan(ranges, message.angle_min, message.angle_increment, size, metres)
        return picture, (metres,)

    def take(self, numbers: tuple[float, ...]) -> None:
        """Store the size of the image."""
        if numbers[0] != self._metres:
            self._metres = numbers[0]
            self.placed.emit()

    metres = Property(float, lambda self: self._metres, notify=placed)


def register() -> None:
    """Register the types in QML as ``RosglassDemo 1.0``."""
    for kind in (MapPicture, ScanPicture):
        register_type: Any = QtQml.qmlRegisterType  # PySide6's annotation wants bytes for names
        register_type(kind, "RosglassDemo", 1, 0, kind.__name__)
