"""The element ``ImageTransportSubscription``: a camera's pictures in a video sink."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.element import DEFAULT_TIMEOUT, TopicElement, changed_enough
from rosglass.qml.image_item import ImageItem
from rosglass.qt import Property, QtCore, Signal, Slot, is_alive, optional

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.qml.image_stream import Picture, SharedStream
    from rosglass.qml.runtime import Runtime

__all__ = ["ImageTransportSubscription"]

#: Read-only properties that are looked at ten times per second, as they are without a stream.
_START: dict[str, Any] = {
    "subscribed": False,
    "transport": "",
    "framerate": 0.0,
    "networkLatency": -1.0,
    "processingLatency": -1.0,
    "latency": -1.0,
    "dropped": 0,
    "lost": 0,
    "problem": "",
}


class ImageTransportSubscription(TopicElement):
    """Shows a camera. See ``docs/qml.md`` for every property."""

    topicChanged = Signal()
    defaultTransportChanged = Signal()
    enabledChanged = Signal()
    timeoutChanged = Signal()
    videoSinkChanged = Signal()
    subscribedChanged = Signal()
    transportChanged = Signal()
    framerateChanged = Signal()
    networkLatencyChanged = Signal()
    processingLatencyChanged = Signal()
    latencyChanged = Signal()
    encodingChanged = Signal()
    staleChanged = Signal()
    droppedChanged = Signal()
    lostChanged = Signal()
    problemChanged = Signal()

    _HOLDS = ("_frame", "_stream", "_have")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        # Loaded before QML hands over its sink: what Qt gave Python as a plain QObject stays one.
        self._multimedia = optional("QtMultimedia")
        self._preferred = "compressed"
        self._timeout = DEFAULT_TIMEOUT
        self._sink: Any = None
        self._stream: SharedStream | None = None
        self._have: tuple[Node, str, str] | None = None
        self._frame: Any = None
        self._looks: tuple[str, bool, bool] = ("", False, False)
        self._shown_at = self._late = 0.0
        self._blank = True
        self._values: dict[str, Any] = dict(_START)
        #: Whether it takes video frames; otherwise it takes images.
        self.wants_video = True

    # Properties that QML sets.

    def _get_topic(self) -> str:
        return self._resolved or self._topic

    def _set_topic(self, topic: str) -> None:
        if topic in {self._topic, self._resolved}:
            return
        self._topic, self._resolved = topic, ""
        self.topicChanged.emit()
        self._schedule()

    def _set_transport(self, name: str) -> None:
        if name != self._preferred:
            self._preferred = name
            self.defaultTransportChanged.emit()
            self._schedule()

    def _set_enabled(self, enabled: bool) -> None:
        if enabled != self._enabled:
            self._enabled = enabled
            self.enabledChanged.emit()
            self._schedule()

    def _set_timeout(self, timeout: int) -> None:
        if timeout < 0:
            self._refuse(f"ImageTransportSubscription {self._topic!r}: timeout {timeout} ms < 0")
        elif timeout != self._timeout:
            self._timeout = timeout
            self.timeoutChanged.emit()
            self._judge()

    def _get_sink(self) -> QtCore.QObject | None:
        return self._sink if is_alive(self._sink) else None

    def _set_sink(self, sink: QtCore.QObject | None) -> None:
        if sink is self._sink:
            return
        video = self._multimedia is not None and isinstance(sink, self._multimedia.QVideoSink)
        if sink is not None and not video and not isinstance(sink, ImageItem):
            name = sink.metaObject().className()
            self._refuse(
                f"ImageTransportSubscription {self._topic!r}: videoSink must be a VideoOutput's "
                f"videoSink or an ImageItem, got {name}"
            )
            return
        self._clear_sink()
        self._sink, self.wants_video = sink, video
        if sink is not None:
            sink.destroyed.connect(self._schedule)
        self.videoSinkChanged.emit()
        # Another kind of display needs other frames: join the stream anew.
        self._leave()
        self._have = None
        self._schedule()

    topic = Property(str, _get_topic, _set_topic, notify=topicChanged)
    defaultTransport = Property(
        str, lambda self: self._preferred, _set_transport, notify=defaultTransportChanged
    )
    enabled = Property(bool, lambda self: self._enabled, _set_enabled, notify=enabledChanged)
    timeout = Property(int, lambda self: self._timeout, _set_timeout, notify=timeoutChanged)
    videoSink = Property(QtCore.QObject, _get_sink, _set_sink, notify=videoSinkChanged)

    # Properties that QML reads.

    subscribed = Property(bool, lambda self: self._values["subscribed"], notify=subscribedChanged)
    transport = Property(str, lambda self: self._values["transport"], notify=transportChanged)
    framerate = Property(float, lambda self: self._values["framerate"], notify=framerateChanged)
    networkLatency = Property(
        float, lambda self: self._values["networkLatency"], notify=networkLatencyChanged
    )
    processingLatency = Property(
        float, lambda self: self._values["processingLatency"], notify=processingLatencyChanged
    )
    latency = Property(float, lambda self: self._values["latency"], notify=latencyChanged)
    dropped = Property(int, lambda self: self._values["dropped"], notify=droppedChanged)
    lost = Property(int, lambda self: self._values["lost"], notify=lostChanged)
    problem = Property(str, lambda self: self._values["problem"], notify=problemChanged)
    stale = Property(bool, lambda self: self._stale, notify=staleChanged)
    encoding = Property(str, lambda self: self._looks[0], notify=encodingChanged)
    hasAlpha = Property(bool, lambda self: self._looks[1], notify=encodingChanged)
    isColor = Property(bool, lambda self: self._looks[2], notify=encodingChanged)

    @Slot(result=int)
    def getPublisherCount(self) -> int:
        """Return how many publishers the transport in use has; 0 while not connected."""
        return self._count_publishers()

    # The stream.

    def _count_publishers(self) -> int:
        try:
            return self._stream.stream.publisher_count() if self._stream is not None else 0
        except Error:
            return 0

    def _update(self) -> None:
        if not is_alive(self._sink):
            self._sink = None
        node = self.node
        resolved = self._resolve(self._topic)
        want = None
        if node is not None and self._enabled and resolved and self._sink is not None:
            want = (node, resolved, self._preferred)
        if want == self._have:
            return
        self._leave()
        self._have = want
        if want is None:
            self._suspect = True
            self._judge()
            self._refresh()
            return
        if resolved != self._resolved:
            self._resolved = resolved
            self.topicChanged.emit()
        self._join(*want)

    def _join(self, node: Node, topic: str, preferred: str) -> None:
        from rosglass.qml.image_stream import SharedStream as Stream  # noqa: PLC0415 - brings numpy

        session = self._session
        assert session is not None
        try:
            stream = Stream.join(session, node, topic, preferred, self)
        except Error as error:
            self._say(str(error))
            return
        self._say("")
        self._stream = stream
        self._publishers = self._count_publishers()
        self._at_end["stream"] = lambda: stream.leave(self)
        if stream.last is not None and not self._suspect:
            self.show_picture(stream.last)
        self._refresh()

    def _leave(self) -> None:
        stream, self._stream = self._stream, None
        self._at_end.pop("stream", None)
        if stream is not None:
            stream.leave(self)
            self._clear_sink()

    def show_picture(self, picture: Picture) -> None:
        """Show a picture; called by the stream on the GUI thread."""
        if not is_alive(self) or not is_alive(self._sink):
            return
        if self._timeout and picture.late > self._timeout / 1000:
            return  # what a silent link kept back would be taken off the screen at once
        if self.wants_video:
            if picture.video is None:
                return
            self._sink.setVideoFrame(picture.video)
        else:
            if picture.image is None:
                return
            self._sink.present(picture.image)
        self._shown_at, self._late = time.monotonic(), picture.late
        self._frame, self._blank, self._suspect = picture.frame, False, False
        looks = (picture.frame.encoding, picture.frame.has_alpha, picture.frame.is_color)
        if looks != self._looks:
            self._looks = looks
            self.encodingChanged.emit()
        self._judge()

    def stream_changed(self) -> None:
        """Look at the stream again; called by the stream on the GUI thread."""
        if is_alive(self):
            self._publishers = max(self._publishers, self._count_publishers())
            self._refresh()

    def _clear_sink(self) -> None:
        """Take the picture off the screen."""
        self._frame, self._blank = None, True
        if not is_alive(self._sink):
            return
        if self.wants_video:
            self._sink.setVideoFrame(self._multimedia.QVideoFrame())
        else:
            self._sink.present(None)

    # Judging.

    def _is_old(self) -> bool:
        if self._frame is None:
            return True
        timeout = self._timeout or DEFAULT_TIMEOUT
        return time.monotonic() - self._shown_at + self._late > timeout / 1000

    def _judge(self) -> None:
        super()._judge()
        # A picture that stays is the more dangerous the more it looks like a live one.
        if self._timeout and not self._blank and self._is_old():
            self._clear_sink()

    def _stale_changed(self) -> None:
        self.staleChanged.emit()

    def _problem_changed(self) -> None:
        self._refresh()

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        self._refresh()

    def _refresh(self) -> None:
        """Tell QML about every read-only property that changed."""
        shared = self._stream
        now = dict(_START)
        if shared is not None:
            network, processing, latency = shared.latencies
            now |= {
                "subscribed": shared.stream.subscribed,
                "transport": shared.stream.transport,
                "dropped": shared.dropped,
                "lost": shared.lost,
                "problem": shared.stream.problem,
            }
            if not self._stale:
                # How fast pictures came once says nothing about one that is not live.
                now["framerate"] = shared.frame_rate
                now["networkLatency"] = network
                now["processingLatency"] = processing
                now["latency"] = latency
        now["problem"] = self._problem or now["problem"]
        for name, value in now.items():
            before = self._values[name]
            real = isinstance(value, float)
            if changed_enough(before, value) if real else value != before:
                self._values[name] = value
                getattr(self, f"{name}Changed").emit()
