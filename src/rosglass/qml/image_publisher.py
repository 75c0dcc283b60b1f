"""The element ``ImagePublisher``: what an item shows, as a topic of pictures."""
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
from rosglass.qml.dialect import Dialect
from rosglass.qml.element import Element, changed_enough
from rosglass.qml.from_js import fields_from_js
from rosglass.qml.item_grab import GRABBED, ItemGrab, pixels_of
from rosglass.qml.item_window import window_of
from rosglass.qml.log import log_from_qml
from rosglass.qt import Property, QJSValue, QtCore, QtGui, QtQuick, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.comm.publisher import Publisher
    from rosglass.comm.time import Time
    from rosglass.qml.runtime import Runtime

__all__ = ["ImagePublisher", "RosImagePublisher"]

_IMAGE, _COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_INFO = "sensor_msgs/msg/CameraInfo"
_MAX_RATE, _MAX_SIDE = 120.0, 16384
#: Seconds after which a window that does not draw is told of.
_PATIENCE = 2.0
#: Pictures over which the frequency is taken.
_MARKS = 30


class ImagePublisher(Element):
    """Publishes an item as pictures. See its page in ``docs/elements``."""

    sourceChanged = Signal()
    topicChanged = Signal()
    rateChanged = Signal()
    encodingChanged = Signal()
    transportChanged = Signal()
    formatChanged = Signal()
    qualityChanged = Signal()
    frameIdChanged = Signal()
    sizeChanged = Signal()
    cameraInfoChanged = Signal()
    enabledChanged = Signal()
    alwaysChanged = Signal()
    publishingChanged = Signal()
    frequencyChanged = Signal()
    droppedChanged = Signal()
    problemChanged = Signal()

    _HOLDS = ("_source", "_grab", "_senders", "_camera_info", "_info_fields")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._source: QtQuick.QQuickItem | None = None
        self._topic = self._frame = ""
        self._rate, self._size = 10.0, QtCore.QSize()
        self._encoding, self._transport, self._format, self._quality = "rgb8", "raw", "jpeg", 90
        self._camera_info = QJSValue()
        self._info_fields: dict[str, Any] | None = None
        self._enabled, self._always = True, False
        self._publishing, self._frequency, self._dropped = False, 0.0, 0
        #: Publishers of pictures and, where wanted, of camera information.
        self._senders: list[Publisher] = []
        self._have: tuple[Node, str, str, bool] | None = None
        self._grab: ItemGrab | None = None
        self._grabbed_at = 0.0
        self._stamp: Time | None = None
        self._converting = self._again = False
        self._sent: deque[float] = deque(maxlen=_MARKS)
        self._worker: Dispatcher | None = None
        self._timer = QtCore.QTimer(self)
        self._timer.timeout.connect(self._on_time)

    # Properties.

    def _set_source(self, source: QtCore.QObject | None) -> None:
        if source is self._source:
            return
        if source is not None and not isinstance(source, QtQuick.QQuickItem):
            kind = source.metaObject().className()
            self._refuse(
                f"ImagePublisher: source must be an item, got {kind}; of a window, its contentItem"
            )
            return
        self._source = source
        self._abandon()
        self.sourceChanged.emit()

    def _set_topic(self, topic: str) -> None:
        if topic != self._topic:
            self._topic = topic
            self.topicChanged.emit()
            self._schedule()

    def _set_rate(self, rate: float) -> None:
        if not math.isfinite(rate) or not 0 <= rate <= _MAX_RATE:
            self._refuse(f"ImagePublisher: rate {rate:g} is not from 0 to {_MAX_RATE:g} per second")
        elif rate != self._rate:
            self._rate = rate
            self.rateChanged.emit()
            self._schedule()

    def _set_encoding(self, encoding: str) -> None:
        if encoding not in GRABBED:
            self._refuse_choice("encoding", encoding, GRABBED)
        elif encoding != self._encoding:
            self._encoding = encoding
            self.encodingChanged.emit()

    def _set_transport(self, transport: str) -> None:
        if transport not in {"raw", "compressed"}:
            self._refuse_choice("transport", transport, ("raw", "compressed"))
        elif transport != self._transport:
            self._transport = transport
            self.transportChanged.emit()
            self._schedule()

    def _set_format(self, name: str) -> None:
        if name not in {"jpeg", "png"}:
            self._refuse_choice("format", name, ("jpeg", "png"))
        elif name != self._format:
            self._format = name
            self.formatChanged.emit()

    def _set_quality(self, quality: int) -> None:
        if not 1 <= quality <= 100:
            self._refuse(f"ImagePublisher: quality {quality} is not from 1 to 100")
        elif quality != self._quality:
            self._quality = quality
            self.qualityChanged.emit()

    def _set_frame(self, frame: str) -> None:
        if frame != self._frame:
            self._frame = frame
            self.frameIdChanged.emit()

    def _set_size(self, size: QtCore.QSize) -> None:
        given = (size.width(), size.height())
        unset = max(given) <= 0
        if not unset and not (min(given) >= 1 and max(given) <= _MAX_SIDE):
            self._refuse(
                f"ImagePublisher: size {given[0]}x{given[1]} is not from 1 to {_MAX_SIDE} pixels "
                "each way; Qt.size(0, 0) is the item's own"
            )
        elif size != self._size:
            self._size = QtCore.QSize() if unset else size
            self.sizeChanged.emit()

    def _set_camera_info(self, value: QJSValue | None) -> None:
        value = QJSValue() if value is None or value.isNull() else value
        if not (value.isUndefined() or value.isObject()):
            self._refuse("ImagePublisher: cameraInfo must be an object with fields of CameraInfo")
            return
        self._camera_info, self._info_fields = value, None
        self.cameraInfoChanged.emit()
        self._schedule()

    def _set_enabled(self, enabled: bool) -> None:
        if enabled != self._enabled:
            self._enabled = enabled
            self.enabledChanged.emit()
            self._schedule()

    def _set_always(self, always: bool) -> None:
        if always != self._always:
            self._always = always
            self.alwaysChanged.emit()

    source = Property(QtCore.QObject, lambda self: self._source, _set_source, notify=sourceChanged)
    topic = Property(str, lambda self: self._topic, _set_topic, notify=topicChanged)
    rate = Property(float, lambda self: self._rate, _set_rate, notify=rateChanged)
    encoding = Property(str, lambda self: self._encoding, _set_encoding, notify=encodingChanged)
    transport = Property(str, lambda self: self._transport, _set_transport, notify=transportChanged)
    format = Property(str, lambda self: self._format, _set_format, notify=formatChanged)
    quality = Property(int, lambda self: self._quality, _set_quality, notify=qualityChanged)
    frameId = Property(str, lambda self: self._frame, _set_frame, notify=frameIdChanged)
    size = Property(QtCore.QSize, lambda self: self._size, _set_size, notify=sizeChanged)
    cameraInfo = Property(
        QJSValue, lambda self: self._camera_info, _set_camera_info, notify=cameraInfoChanged
    )
    enabled = Property(bool, lambda self: self._enabled, _set_enabled, notify=enabledChanged)
    always = Property(bool, lambda self: self._always, _set_always, notify=alwaysChanged)
    publishing = Property(bool, lambda self: self._publishing, notify=publishingChanged)
    frequency = Property(float, lambda self: self._frequency, notify=frequencyChanged)
    dropped = Property(int, lambda self: self._dropped, notify=droppedChanged)
    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    def _refuse_choice(self, what: str, given: str, known: Any) -> None:
        self._refuse(f"ImagePublisher: {what} {given!r} is none of {', '.join(known)}")

    # Advertising.

    def _update(self) -> None:
        node, session = self.node, self._session
        want = None
        if node is not None and self._enabled and self._topic:
            want = (node, self._topic, self._transport, not self._camera_info.isUndefined())
        if want != self._have and session is not None:
            self._withdraw()
            self._have = want
            if want is not None:
                self._advertise(*want)
        self._run_timer()

    def _advertise(self, node: Node, topic: str, transport: str, info: bool) -> None:
        session, want = self._session, self._have
        assert session is not None

        def work() -> list[Publisher]:
            base = node.resolve(topic)
            raw = transport == "raw"
            name = base if raw else f"{base}/compressed"
            made = [node.create_publisher(name, _IMAGE if raw else _COMPRESSED, 1)]
            if info:
                # Where image_transport's camera subscribers look for it.
                sibling = f"{base.rpartition('/')[0]}/camera_info"
                try:
                    made.append(node.create_publisher(sibling, _INFO, 1))
                except Error:
                    made[0].close()
                    raise
            return made

        def done(result: list[Publisher] | Error) -> None:
            if isinstance(result, Error):
                if is_alive(self) and self._have is want:
                    self._say(f"{topic}: {result}")
                return

            def close() -> None:
                for sender in result:
                    session.background(sender.close)

            if not is_alive(self) or self._have is not want:
                close()
                return
            self._senders = result
            self._at_end["senders"] = close
            self._say("")
            self._run_timer()

        session.background(work, done)

    def _withdraw(self) -> None:
        self._timer.stop()
        self._abandon()
        self._senders = []
        self._sent.clear()
        self._measure()
        self._say("")
        close = self._at_end.pop("senders", None)
        if close is not None:
            close()

    def _run_timer(self) -> None:
        if self._senders and self._rate:
            self._timer.start(max(1, round(1000 / self._rate)))
        else:
            self._timer.stop()

    # Publishing.

    @Slot(result=bool)
    def publish(self) -> bool:
        """Publish a picture of the item as it is drawn next.

        Returns:
            Whether one is on its way; not while nobody subscribes, unless :attr:`always`.
        """
        if self._senders:
            if not self._is_wanted() or self._take():
                return self._is_wanted()
            why = self._problem
        else:
            why = self._problem or ("it is disabled" if not self._enabled else "not advertised yet")
        runtime = self._find_runtime()
        if runtime is not None:
            caller = runtime.caller()
            text = f"no picture was published on {self._topic}: {why}"
            if self._limit.allows((caller, text)):
                log_from_qml("", logging.WARNING, text, caller)
        return False

    def _is_wanted(self) -> bool:
        try:
            return self._always or any(sender.subscription_count() for sender in self._senders)
        except Error:
            return False

    @Slot()
    def _on_time(self) -> None:
        if self._is_wanted():
            self._take()

    def _take(self) -> bool:
        """Take a picture, or another one after the one on its way; return whether one can come."""
        node, source = self.node, self._source
        if node is None or not is_alive(source):
            self._say("ImagePublisher: there is no source" if node is not None else "")
            return False
        assert source is not None
        if self._grab is not None and self._grab.window is not window_of(source):
            self._abandon()
        if self._grab is not None or self._converting:
            if self._again:
                self._dropped += 1
                self.droppedChanged.emit()
            self._again = True
            return True
        size = (self._size.width(), self._size.height()) if self._size.isValid() else None
        self._grabbed_at, self._stamp = time.monotonic(), node.now()
        grab = ItemGrab(source, size, self._on_grabbed)
        if grab.problem:
            self._say(f"ImagePublisher: {grab.problem}")
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
        session, stamp, senders = self._session, self._stamp, self._senders
        if session is None or stamp is None or not senders:
            return
        if image.isNull():
            self._say("ImagePublisher: Qt could not draw the item")
            return
        try:
            info = self._info() if len(senders) > 1 else None
        except Error as error:
            self._say(f"ImagePublisher: cameraInfo: {error}")
            return
        ros1 = self.node is not None and self.node.wire == "ros1"
        part = "nsecs" if ros1 else "nanosec"
        header = {
            "stamp": {"secs" if ros1 else "sec": stamp.sec, part: stamp.nanosec},
            "frame_id": self._frame,
        }
        look = (self._encoding, self._transport, self._format, self._quality)
        size = grab.size

        def work() -> None:
            problem = ""
            try:
                fields = _fields(image, size, *look)
                senders[0].publish({"header": header, **fields})
                if info is not None:
                    measures = {"width": size[0], "height": size[1]}
                    senders[1].publish({**measures, **info, "header": header})
            except Error as error:
                problem = str(error)
            session.executor.post(lambda: self._published(senders, problem))

        if self._worker is None:
            worker = self._worker = Dispatcher("rosglass-pictures")
            self._at_end["worker"] = lambda: session.background(worker.close)
        self._converting = True
        self._worker.post(work)

    def _info(self) -> dict[str, Any]:
        if self._info_fields is None:
            from rosglass.messages.schema import schema_of  # noqa: PLC0415 - loaded by now

            schema = schema_of(self._senders[1].type.definition)
            self._info_fields = dict(
                fields_from_js(self._camera_info, schema, dialect=self.DIALECT)
            )
        return self._info_fields

    def _published(self, senders: list[Publisher], problem: str) -> None:
        if not is_alive(self):
            return
        self._converting = False
        if senders is not self._senders:
            return
        self._say(f"ImagePublisher: {problem}" if problem else "")
        if not problem:
            note_time(self._sent, time.monotonic())
            self._measure()
        again, self._again = self._again, False
        if again and self._senders:
            self._take()

    @Slot()
    def _on_tick(self) -> None:
        if self._grab is not None:
            if not self._grab.is_possible:
                self._abandon()
            elif time.monotonic() - self._grabbed_at > _PATIENCE:
                self._say("ImagePublisher: the window is not drawn: is it minimized or hidden?")
        self._measure()

    def _measure(self) -> None:
        """Find out how often pictures go out, and whether one is overdue."""
        now, sent = time.monotonic(), self._sent
        frequency, age = rate_of(sent, now), now - sent[-1] if sent else math.inf
        if changed_enough(self._frequency, frequency):
            self._frequency = frequency
            self.frequencyChanged.emit()
        longest = max(1.0, 3 / self._rate if self._rate else 0.0)
        publishing = bool(self._senders) and age < longest
        if publishing != self._publishing:
            self._publishing = publishing
            self.publishingChanged.emit()

    def _problem_changed(self) -> None:
        self.problemChanged.emit()


def _fields(
    image: QtGui.QImage,
    size: tuple[int, int],
    encoding: str,
    transport: str,
    kind: str,
    quality: int,
) -> dict[str, Any]:
    """Return the fields of a picture's message besides its header; on any thread."""
    pixels = pixels_of(image, size, encoding)
    if transport == "compressed":
        from rosglass.images.compressed import compress  # noqa: PLC0415 - needs numpy

        data, told = compress(pixels, encoding, kind, quality)
        return {"format": told, "data": data}
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
