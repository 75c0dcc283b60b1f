"""The element ``ImagePublisher``: publishes an item's appearance as images."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import math
import time
from collections import deque
from typing import TYPE_CHECKING, Any

from rosglass.comm.executor import Dispatcher
from rosglass.comm.statistics import note_time, rate_of
from rosglass.errors import Error
from rosglass.qml.elements.element import Element, Pace, single_shot
from rosglass.qml.elements.image_sinks import window_of
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.from_js import fields_from_js, numpy
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable, one_of, report, within
from rosglass.qt import QT6, QJSValue, QtCore, QtGui, QtQuick, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from rosglass.comm.node import Node
    from rosglass.comm.publisher import Publisher
    from rosglass.comm.time import Time
    from rosglass.qml.engine.runtime import Runtime


__all__ = ["GRABBED", "ImagePublisher", "ItemGrab", "RosImagePublisher", "pixels_of"]

#: Encodings that a grabbed image can be converted to: Qt's format, and channels.
GRABBED = {
    "rgb8": ("Format_RGB888", 3),
    "bgr8": ("Format_BGR888", 3),
    "rgba8": ("Format_RGBA8888", 4),
    "mono8": ("Format_RGB888", 1),
}
#: Weights of red, green and blue in grey (ITU-R BT.601), as in OpenCV and ROS's drivers.
_GREY = (0.299, 0.587, 0.114)


class ItemGrab:
    """Grabs one image of an item, with the next frame of its renderer.

    Args:
        item: The item.
        size: Width and height of the image in pixels; None for the item's size on the screen.
        done: Called with the image, on the GUI thread.

    Attributes:
        problem: Why the item cannot be grabbed; empty if it can.
        size: Requested width and height of the image, pixels.
    """

    def __init__(
        self,
        item: QtQuick.QQuickItem,
        size: tuple[int, int] | None,
        done: Callable[[ItemGrab, QtGui.QImage], None],
    ) -> None:
        self._item: Any = item
        self._done = done
        self._result: Any = None
        self.window = window = window_of(item)
        self.size = (0, 0)
        self.problem = ""
        if window is None or not window.isVisible():
            self.problem = "the item is in no window that is shown"
            return
        ratio = window.effectiveDevicePixelRatio()
        self.size = size or (round(item.width() * ratio), round(item.height() * ratio))
        if min(self.size) < 1:
            self.problem = f"the item is {item.width():g}x{item.height():g} pixels"
            return
        # Qt 6 multiplies the requested size by the ratio, Qt 5 does not.
        scale = ratio if QT6 else 1.0
        wanted = QtCore.QSize(*(max(1, -(-side // scale)) for side in self.size))
        result: Any = item.grabToImage(wanted)
        if result is None or not result:
            self.problem = "Qt cannot draw the item apart from its window"
            return
        self._result = result
        result.ready.connect(self._ready)

    @property
    def is_possible(self) -> bool:
        """True while the grab is possible: the item exists and is in the same window."""
        return self._result is not None and is_alive(self._item) and is_alive(self.window)

    def cancel(self) -> None:
        """Cancel the callback."""
        self._result = None

    def _ready(self) -> None:
        result, self._result = self._result, None
        if result is not None:
            self._done(self, result.image())


def pixels_of(image: QtGui.QImage, size: tuple[int, int], encoding: str) -> NDArray[Any]:
    """Return the pixels of a grabbed image; thread-safe.

    If the encoding has no transparency, transparent areas become black.

    Args:
        image: The grabbed image.
        size: Requested width and height, pixels.
        encoding: One of :data:`GRABBED`.

    Returns:
        Rows x columns (x channels) of bytes, top row first.
    """
    np = numpy()
    formats = QtGui.QImage.Format
    if (image.width(), image.height()) != size:
        modes = QtCore.Qt.AspectRatioMode.IgnoreAspectRatio
        smooth = QtCore.Qt.TransformationMode.SmoothTransformation
        image = image.scaled(*size, modes, smooth)
    name, channels = GRABBED[encoding]
    if encoding != "rgba8" and image.hasAlphaChannel():
        # Premultiplied colours without alpha are the image on a black background.
        image = image.convertToFormat(formats.Format_ARGB32_Premultiplied)
        image.reinterpretAsFormat(formats.Format_RGB32)
    image = image.convertToFormat(getattr(formats, name))
    width, height = size
    rows = np.frombuffer(image.constBits(), np.uint8, image.bytesPerLine() * height)
    held = 4 if encoding == "rgba8" else 3
    pixels = rows.reshape(height, -1)[:, : width * held].reshape(height, width, held)
    if channels == 1:
        grey = pixels.astype(np.float32) @ np.array(_GREY, np.float32)
        pixels = np.rint(grey).astype(np.uint8)
    made: NDArray[Any] = np.array(pixels)
    return made


_IMAGE, _COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_INFO = "sensor_msgs/msg/CameraInfo"
_MAX_RATE, _MAX_SIDE = 120.0, 16384
#: Seconds after which a window that is not drawn is reported.
_DRAW_TIMEOUT_S = 2.0
#: Number of images over which the frequency is measured.
_MARKS = 30


def _item(source: QtCore.QObject | None) -> QtQuick.QQuickItem | None:
    if source is not None and not isinstance(source, QtQuick.QQuickItem):
        kind = source.metaObject().className()
        raise ValueError(f"must be an item, got {kind}; of a window, its contentItem")
    return source


def _size(size: QtCore.QSize) -> QtCore.QSize:
    given = (size.width(), size.height())
    if max(given) <= 0:
        return QtCore.QSize()
    if not (min(given) >= 1 and max(given) <= _MAX_SIDE):
        raise ValueError(
            f"is not from 1 to {_MAX_SIDE} pixels each way; Qt.size(0, 0) is the item's own"
        )
    return size


def _object(value: QJSValue) -> QJSValue:
    value = QJSValue() if value.isNull() else value
    if not (value.isUndefined() or value.isObject()):
        raise ValueError("must be an object with fields of CameraInfo")
    return value


class ImagePublisher(Element):
    """Publishes an item as images. See its page in ``docs/elements``."""

    source = Writable(QtCore.QObject, None, _item, then="_abandon")
    topic = Writable(str, "")
    #: Images per second; 0 publishes on request.
    rate = Writable(float, 10.0, within(0, _MAX_RATE, "per second"))
    encoding = Writable(str, "rgb8", one_of(*GRABBED), then="")
    transport = Writable(str, "raw", one_of("raw", "compressed"))
    format = Writable(str, "jpeg", one_of("jpeg", "png"), then="")
    quality = Writable(int, 90, within(1, 100), then="")
    frameId = Writable(str, "", then="")
    size = Writable(QtCore.QSize, QtCore.QSize(), _size, then="")
    cameraInfo = Writable(QJSValue, None, _object, then="_on_info_changed")
    enabled = Writable(bool, True)
    #: Whether to publish even without subscribers.
    always = Writable(bool, False, then="")
    publishing = ReadOnly(bool, False)
    frequency = ReadOnly(float, 0.0, tolerance=0.01)
    dropped = ReadOnly(int, 0)

    _HOLDS = ("_source", "_grab", "_cameraInfo", "_info_fields")
    _endpoint: _Publishers | None
    _source: QtQuick.QQuickItem | None

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._info_fields: dict[str, Any] | None = None
        self._grab: ItemGrab | None = None
        self._grabbed_at = 0.0
        self._stamp: Time | None = None
        self._converting = self._again = False
        self._sent: deque[float] = deque(maxlen=_MARKS)
        self._worker: Dispatcher | None = None
        self._pace = Pace()
        self._timer = single_shot(self, self._on_time)

    def _on_info_changed(self) -> None:
        self._info_fields = None
        self._schedule()

    # Advertising.

    def _update(self) -> None:
        super()._update()
        self._run_timer()

    def _wanted(self) -> tuple[Node, str, str, bool] | None:
        node = self.node
        if node is None or not self.enabled or not self.topic:
            return None
        return node, self.topic, self.transport, not self.cameraInfo.isUndefined()

    def _factory(self, *wanted: Any) -> Callable[[], _Publishers]:
        return lambda: _Publishers(*wanted)

    def _on_create_failed(self, error: Error) -> None:
        self._set_problem(f"{self.topic}: {error}")

    def _on_created(self, endpoint: _Publishers) -> None:  # noqa: ARG002 - the base's signature
        self._set_problem("")
        self._run_timer()

    def _on_closed(self, endpoint: _Publishers | None) -> None:  # noqa: ARG002 - as above
        self._timer.stop()
        self._abandon()
        self._sent.clear()
        self._measure()
        self._set_problem("")

    def _run_timer(self) -> None:
        if self._endpoint is not None and self.rate:
            self._pace = Pace()
            self._timer.start(self._pace.take_ms(self.rate))
        else:
            self._timer.stop()

    # Publishing.

    @Slot(result=bool)
    def publish(self) -> bool:
        """Publish an image of the item when it is next drawn.

        Returns:
            True if one will be published; without subscribers, only if :attr:`always` is set.
        """
        if self._endpoint is not None:
            if not self._is_wanted() or self._take():
                return self._is_wanted()
            why = self._problem
        else:
            why = self._problem or ("it is disabled" if not self.enabled else "not advertised yet")
        runtime = self._find_runtime()
        if runtime is not None:
            caller = runtime.caller()
            text = f"no image was published on {self.topic}: {why}"
            if self._limit.allows((caller, text)):
                log_from_qml("", logging.WARNING, text, caller)
        return False

    def _is_wanted(self) -> bool:
        try:
            return self.always or (self._endpoint is not None and self._endpoint.has_subscriber())
        except Error:
            return False

    @Slot()
    def _on_time(self) -> None:
        if self.rate:  # otherwise 0 since just now
            self._timer.start(self._pace.take_ms(self.rate))
        if self._is_wanted():
            self._take()

    def _take(self) -> bool:
        """Start a grab, or queue one after the current grab; return False if impossible."""
        node, source = self.node, self._source
        if node is None or not is_alive(source):
            self._set_problem("ImagePublisher: there is no source" if node is not None else "")
            return False
        assert source is not None
        if self._grab is not None and self._grab.window is not window_of(source):
            self._abandon()
        if self._grab is not None or self._converting:
            if self._again:
                report(self, dropped=self.dropped + 1)
            self._again = True
            return True
        size = (self.size.width(), self.size.height()) if self.size.isValid() else None
        self._grabbed_at, self._stamp = time.monotonic(), node.now()
        grab = ItemGrab(source, size, self._on_grabbed)
        if grab.problem:
            self._set_problem(f"ImagePublisher: {grab.problem}")
            return False
        self._grab = grab
        return True

    def _abandon(self) -> None:
        grab, self._grab = self._grab, None
        self._again = False
        if grab is not None:
            grab.cancel()

    def _on_grabbed(self, grab: ItemGrab, image: QtGui.QImage) -> None:
        if not is_alive(self) or grab is not self._grab:
            return
        self._grab = None
        session, stamp, endpoint = self._session, self._stamp, self._endpoint
        if session is None or stamp is None or endpoint is None:
            return
        if image.isNull():
            self._set_problem("ImagePublisher: Qt could not draw the item")
            return
        try:
            info = self._info(endpoint.info) if endpoint.info is not None else None
        except Error as error:
            self._set_problem(f"ImagePublisher: cameraInfo: {error}")
            return
        ros1 = self.node is not None and self.node.wire == "ros1"
        part = "nsecs" if ros1 else "nanosec"
        header = {
            "stamp": {"secs" if ros1 else "sec": stamp.sec, part: stamp.nanosec},
            "frame_id": self.frameId,
        }
        look = (self.encoding, self.transport, self.format, self.quality)
        size = grab.size

        def work() -> None:
            problem = ""
            try:
                fields = _fields(image, size, *look)
                endpoint.pictures.publish({"header": header, **fields})
                if endpoint.info is not None and info is not None:
                    measures = {"width": size[0], "height": size[1]}
                    endpoint.info.publish({**measures, **info, "header": header})
            except Error as error:
                problem = str(error)
            session.executor.post(lambda: self._on_published(endpoint, problem))

        if self._worker is None:
            worker = self._worker = Dispatcher("rosglass-pictures")
            self._cleanup["worker"] = lambda: session.background(worker.close)
        self._converting = True
        self._worker.post(work)

    def _info(self, publisher: Publisher) -> dict[str, Any]:
        if self._info_fields is None:
            kind = publisher.type
            self._info_fields = dict(fields_from_js(self.cameraInfo, kind, dialect=self.DIALECT))
        return self._info_fields

    def _on_published(self, endpoint: _Publishers, problem: str) -> None:
        if not is_alive(self):
            return
        self._converting = False
        if endpoint is not self._endpoint:
            return
        self._set_problem(f"ImagePublisher: {problem}" if problem else endpoint.problem)
        if not problem:
            note_time(self._sent, time.monotonic())
            self._measure()
        again, self._again = self._again, False
        if again and self._endpoint is not None:
            self._take()

    @Slot()
    def _on_tick(self) -> None:
        if self._grab is not None:
            if not self._grab.is_possible:
                self._abandon()
            elif time.monotonic() - self._grabbed_at > _DRAW_TIMEOUT_S:
                self._set_problem(
                    "ImagePublisher: the window is not drawn: is it minimized or hidden?"
                )
        self._measure()

    def _measure(self) -> None:
        """Report the rate of published images, and whether one is overdue."""
        now, sent = time.monotonic(), self._sent
        age = now - sent[-1] if sent else math.inf
        longest = max(1.0, 3 / self.rate if self.rate else 0.0)
        report(
            self,
            frequency=rate_of(sent, now),
            publishing=self._endpoint is not None and age < longest,
        )


class _Publishers:
    """The publishers of images and, if wanted, of camera information.

    Args:
        node: The node.
        topic: Base topic of the images.
        transport: ``raw`` or ``compressed``.
        info: Whether camera information is wanted.

    Raises:
        Error: A topic cannot be advertised.
    """

    def __init__(self, node: Node, topic: str, transport: str, info: bool) -> None:
        base, raw = node.resolve(topic), transport == "raw"
        name = base if raw else f"{base}/compressed"
        self.pictures = node.create_publisher(name, _IMAGE if raw else _COMPRESSED, 1)
        self.info: Publisher | None = None
        if info:
            # The topic on which image_transport's camera subscribers expect it.
            sibling = f"{base.rpartition('/')[0]}/camera_info"
            try:
                self.info = node.create_publisher(sibling, _INFO, 1)
            except Error:
                self.pictures.close()
                raise

    @property
    def problem(self) -> str:
        """Why subscribers receive nothing, or not everything; empty if all is well."""
        pictures = self.pictures
        return pictures.problem and f"{pictures.topic}: {pictures.problem}"

    def has_subscriber(self) -> bool:
        """Return whether a subscription matches; raises Error if the node is closed."""
        publishers = (self.pictures, self.info)
        return any(one.subscription_count() for one in publishers if one is not None)

    def close(self) -> None:
        """Close both publishers."""
        self.pictures.close()
        if self.info is not None:
            self.info.close()


def _fields(
    image: QtGui.QImage,
    size: tuple[int, int],
    encoding: str,
    transport: str,
    kind: str,
    quality: int,
) -> dict[str, Any]:
    """Return the fields of an image's message except its header; thread-safe."""
    pixels = pixels_of(image, size, encoding)
    if transport == "compressed":
        from rosglass.images.compressed import compress  # noqa: PLC0415 - needs numpy

        data, name = compress(pixels, encoding, kind, quality)
        return {"format": name, "data": data}
    width, height = size
    step = width * GRABBED[encoding][1]
    return {
        "width": width,
        "height": height,
        "encoding": encoding,
        "step": step,
        "data": pixels.reshape(-1),
    }


class RosImagePublisher(ImagePublisher):
    """The element ``ImagePublisher`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1
