"""The element ``ImageTransportSubscription``: shows a camera in a video sink."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import rosglass
from rosglass.errors import Error
from rosglass.qml.elements.element import DEFAULT_TIMEOUT_MS, TopicElement
from rosglass.qml.elements.image_sinks import Sink
from rosglass.qml.elements.load_balancer import LoadBalancer
from rosglass.qml.engine.callbacks import Deferred
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.log import plain_path
from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, report
from rosglass.qml.engine.runtime import own_runtime
from rosglass.qt import QJSValue, QtCore, Signal, Slot, is_alive, optional

if TYPE_CHECKING:
    from pathlib import Path

    from rosglass.comm.node import Node
    from rosglass.qml.elements.image_rendering import Look, Picture
    from rosglass.qml.elements.image_stream import SharedStream
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session


__all__ = [
    "ImageTransportManager",
    "ImageTransportSubscriber",
    "ImageTransportSubscription",
    "LookElement",
]


def _quarter_turns(degrees: int) -> int:
    if degrees % 90:
        raise ValueError("is not a multiple of 90 degrees")
    return degrees % 360


def _zoom(zoom: float) -> float:
    if not 1 <= zoom < math.inf:
        raise ValueError("is below 1, where the whole image is shown")
    return zoom


def _region(region: QtCore.QRectF) -> QtCore.QRectF:
    edges = (region.x(), region.y(), region.width(), region.height())
    if not all(0 <= edge < 1e6 for edge in edges):
        raise ValueError(
            "is not part of an image: give x, y, width and height in pixels from its top "
            "left corner"
        )
    return QtCore.QRectF(region)


def _depth(depth: float) -> float:
    if not math.isfinite(depth):
        raise ValueError("is not a depth; give metres, or -1 to follow the camera")
    return depth


def _rate(rate: float) -> float:
    if not 0 <= rate < math.inf:
        raise ValueError("is not a number of images per second")
    return rate


class LookElement(TopicElement):
    """The properties of a camera's view: rotation, region, zoom, colours and rate."""

    #: Degrees clockwise, a multiple of 90.
    rotation = Writable(int, 0, _quarter_turns)
    mirrored = Writable(bool, False)
    flipped = Writable(bool, False)
    zoom = Writable(float, 1.0, _zoom)
    #: In pixels from the top left corner; an empty rectangle means the whole image.
    regionOfInterest = Writable(QtCore.QRectF, QtCore.QRectF(), _region)
    colorMap = Writable(str, "")
    #: Metres; -1 follows the camera.
    minimumDepth = Writable(float, -1.0, _depth)
    maximumDepth = Writable(float, -1.0, _depth)
    #: Images per second at most; 0 shows all.
    throttleRate = Writable(float, 0.0, _rate)
    fullResolution = Writable(bool, False)

    def _look(self, video: bool, room: tuple[int, int] | None, painted: bool) -> Look:
        """Return the look that the properties describe.

        Args:
            video: Whether video frames are needed; otherwise images.
            room: Width and height on the screen, pixels; None if unknown.
            painted: Whether images are needed in addition to video frames.

        Raises:
            UnsupportedError: The colour map is unknown, or the depths are not a valid range.
        """
        box = self.regionOfInterest
        region = None
        if box.width() or box.height():
            region = (round(box.x()), round(box.y()), round(box.width()), round(box.height()))
        view = rosglass.images.View(self.rotation, self.mirrored, self.flipped, region, self.zoom)
        colors = None
        if self.colorMap:
            near, far = (
                None if depth < 0 else depth for depth in (self.minimumDepth, self.maximumDepth)
            )
            colors = (self.colorMap, near, far)
            rosglass.images.DepthColors(*colors)
        if room is not None and self.rotation % 180:
            room = (room[1], room[0])
        room = None if self.fullResolution else room
        made: Look = _rendering().Look(video, view, colors, self._interval, room, painted)
        return made

    @property
    def _interval(self) -> float:
        """Minimum seconds between two images."""
        return 1 / self.throttleRate if self.throttleRate else 0.0

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"{type(self).__name__} {self._topic!r}"


def _rendering() -> Any:
    """Return the module of looks, which imports numpy: interfaces without a camera need neither."""
    from rosglass.qml.elements import image_rendering  # noqa: PLC0415

    return image_rendering


#: Not imported on the GUI thread: it imports numpy, which would freeze the screen for 0.1 s.
_NUMPY_MODULE = "rosglass.images"


class ImageTransportSubscription(LookElement):
    """Shows a camera. See its page in ``docs/elements``."""

    @QtCore.QEnum
    class PlaybackState(IntEnum):
        """Playback states, numbered as in Qt's MediaPlayer."""

        StoppedState = 0
        PlayingState = 1
        PausedState = 2

    topicChanged = Signal()
    videoSinkChanged = Signal()
    playbackStateChanged = Signal()
    #: An image was handed to the video sink.
    imageShown = Signal()
    #: An image was saved to this file (absolute path).
    snapshotSaved = Signal(str)
    #: Saving an image failed, for this reason.
    snapshotFailed = Signal(str)

    topic = Writable(str, read="_get_topic", write="_set_topic")
    defaultTransport = Writable(str, "compressed")
    enabled = Writable(bool, True, then="_on_enabled_changed")
    timeout = Writable(int, DEFAULT_TIMEOUT_MS, at_least(0), then="_update_stale", unit="ms")
    videoSink = Writable(QtCore.QObject, read="_get_sink", write="_set_sink")
    #: Required by Qt 5's VideoOutput.
    videoSurface = Writable(
        QtCore.QObject, read="_get_sink", write="_set_sink", notify="videoSinkChanged"
    )
    subscribed = ReadOnly(bool, False)
    transport = ReadOnly(str, "")
    #: Seconds since the shown image arrived, more if it was late; -1 before the first.
    age = ReadOnly(float, -1.0)
    #: Seconds during which images arrived that all had the same pixels.
    unchanged = ReadOnly(float, 0.0)
    framerate = ReadOnly(float, 0.0, tolerance=0.01)
    #: Milliseconds, -1 while unknown.
    networkLatency = ReadOnly(float, -1.0, tolerance=0.01)
    processingLatency = ReadOnly(float, -1.0, tolerance=0.01)
    latency = ReadOnly(float, -1.0, tolerance=0.01)
    dropped = ReadOnly(int, 0)
    lost = ReadOnly(int, 0)
    encoding = ReadOnly(str, "")
    hasAlpha = ReadOnly(bool, False, notify="encodingChanged")
    isColor = ReadOnly(bool, False, notify="encodingChanged")
    playbackState = ReadOnly(int, read="_get_state")

    _HOLDS = ("_picture",)
    _endpoint: SharedStream | None

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        # Load before QML sets a sink: an object first wrapped as a plain QObject remains one.
        optional("QtMultimedia")
        self._paused = False
        self._sink: Sink | None = None
        self._shown_look: Look | None = None
        self._picture: Picture | None = None
        self._blank = True

    def _on_enabled_changed(self) -> None:
        self.playbackStateChanged.emit()
        self._schedule()

    def _get_sink(self) -> QtCore.QObject | None:
        return self._sink.item if self._sink is not None and self._sink.is_alive else None

    def _set_sink(self, item: QtCore.QObject | None) -> None:
        if item is self._get_sink():
            return
        try:
            sink = None if item is None else Sink(item, self)
        except Error as error:
            self._refuse(f"{self.label}: {error}")
            return
        self._clear_shown()
        self._sink = sink
        if item is not None:
            item.destroyed.connect(self._schedule)
        self.videoSinkChanged.emit()
        # Another type of sink needs other frames: join the stream again.
        self._close_endpoint()
        self._schedule()

    # Playing.

    def _get_state(self) -> int:
        if not self.enabled:
            return int(self.PlaybackState.StoppedState)
        paused = self.PlaybackState.PausedState
        return int(paused if self._paused else self.PlaybackState.PlayingState)

    @Slot()
    def play(self) -> None:
        """Resume receiving after :meth:`pause` or :meth:`stop`."""
        self._set_paused(False)
        self.enabled = True

    @Slot()
    def pause(self) -> None:
        """Stop receiving; keep the last image on the screen, marked as stale."""
        self._set_paused(True)

    @Slot()
    def stop(self) -> None:
        """Stop receiving and clear the screen."""
        self._set_paused(False)
        self.enabled = False

    def _set_paused(self, paused: bool) -> None:
        if paused != self._paused:
            self._paused = paused
            self.playbackStateChanged.emit()
            self._update_stale()
            self._schedule()

    @Slot(str, result=QJSValue)
    def saveSnapshot(self, path: str) -> QJSValue:
        """Save the current image to a file, on a thread other than the GUI thread.

        Args:
            path: The file, as a path or ``file:`` URL; its extension determines the format.

        Returns:
            A promise of the file's absolute path.
        """
        runtime, picture = self._find_runtime(), self._picture
        if runtime is None:
            return QJSValue()
        promise = Deferred(runtime, f"{self.label}: saveSnapshot({path!r})")

        def done(result: Path | Error) -> None:
            if isinstance(result, Error):
                promise.reject(str(result))
            else:
                promise.resolve(QJSValue(str(result)))
            if is_alive(self):
                failed = isinstance(result, Error)
                (self.snapshotFailed if failed else self.snapshotSaved).emit(str(result))

        look = self._shown_look
        if picture is None or look is None:
            done(Error("no image is shown"))
            return promise.promise

        def work() -> Path:
            # Keep the image, not only its frame, until then: its video may own the memory.
            return rosglass.images.save(_rendering().whole_frame(picture, look), plain_path(path))

        runtime.session.background(work, done)
        return promise.promise

    @Slot(result=int)
    def getPublisherCount(self) -> int:
        """Return the number of publishers of the transport in use; 0 while not connected."""
        return self._count_publishers()

    # The stream.

    def _count_publishers(self) -> int:
        try:
            return self._endpoint.stream.publisher_count() if self._endpoint is not None else 0
        except Error:
            return 0

    def _wanted(self) -> tuple[Node, str, str] | None:
        node, resolved = self.node, self._resolve(self._topic)
        if node is None or not self.enabled or self._paused or not resolved or not self._sink:
            return None
        return node, resolved, self.defaultTransport

    def _update(self) -> None:
        if self._sink is not None and not self._sink.is_alive:
            self._sink = None
        session, again = self._session, self._schedule_again
        if self._wanted() and session and not session.is_loaded(_NUMPY_MODULE, again):
            return
        super()._update()
        if self._endpoint is not None:
            self._change_look(self._endpoint)
        self._refresh()
        if not (self.enabled or self._blank):
            self._clear_shown()

    def _schedule_again(self) -> None:
        if is_alive(self):
            self._schedule()

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        from rosglass.qml.elements.image_stream import SharedStream as Stream  # noqa: PLC0415 - brings numpy

        session = self._session
        assert session is not None
        self._set_resolved(wanted[1])
        node, topic, transport = wanted
        look = self._best_look()
        try:
            self._set_endpoint(Stream.join(session, node, topic, transport, look, self))
        except Error as error:
            self._set_problem(str(error))
            return
        self._shown_look = look

    def _dispose(self, session: Session, endpoint: SharedStream) -> None:  # noqa: ARG002
        endpoint.leave(self)

    def _on_created(self, endpoint: SharedStream) -> None:
        self._publishers = self._count_publishers()
        self._expect_publishers()
        channel = endpoint.channel(self)
        if channel is not None and channel.last is not None and not self._outdated:
            self.show_picture(channel.last)

    def _on_closed(self, endpoint: SharedStream | None) -> None:
        self._no_publisher.stop()
        if endpoint is not None and not self._paused:
            self._clear_shown()

    def _change_look(self, stream: SharedStream) -> None:
        look = self._best_look()
        if look != self._shown_look:
            self._shown_look = look
            stream.change_look(self, look)

    def _best_look(self) -> Look:
        """Return the look that the properties describe; the previous one if they are invalid."""
        assert self._sink is not None
        video, painted = self._sink.takes_video, self._sink.is_painted()
        try:
            look = self._look(video, self._sink.room(), painted)
        except Error as error:
            self._set_problem(f"{self.label}: {error}")
            before = self._shown_look
            fits = before is not None and (before.video, before.painted) == (video, painted)
            if before is not None and fits:
                return before
            look = _rendering().Look(video, painted=painted)
        else:
            self._set_problem("")
        return look

    def show_picture(self, picture: Picture) -> None:
        """Show an image; called by the stream on the GUI thread."""
        sink = self._sink
        if not is_alive(self) or sink is None or not sink.is_alive or self._paused:
            return
        # An image delayed by an interrupted link would be cleared immediately.
        if self.timeout and self._age_of(picture) > self._max_age_s:
            return
        try:
            if not sink.show(picture):
                return
        except Error as error:
            self._set_problem(str(error))
            return
        self._picture, self._blank, self._outdated = picture, False, False
        frame = picture.frame
        stream = self._endpoint
        alive = report(
            self,
            encoding=frame.encoding,
            hasAlpha=frame.has_alpha,
            isColor=frame.is_color,
            age=round(max(0.0, self._age_of(picture)), 2),
            unchanged=0.0 if stream is None else round(stream.unchanged, 1),
        )
        if alive:
            self._update_stale()
        if is_alive(self):
            self.imageShown.emit()

    def stream_changed(self) -> None:
        """Emit the signals of changed properties; called by the stream on the GUI thread."""
        if is_alive(self):
            self._publishers = max(self._publishers, self._count_publishers())
            self._refresh()

    def _clear_shown(self) -> None:
        """Remove the image from the screen."""
        self._picture, self._blank = None, True
        report(self, age=-1.0, unchanged=0.0)
        if self._sink is not None:
            self._sink.clear()

    # Judging.

    @property
    def _max_age_s(self) -> float:
        """Seconds after which an image counts as old."""
        return (self.timeout or DEFAULT_TIMEOUT_MS) / 1000 + self._interval

    def _age_of(self, picture: Picture) -> float:
        return self._steady() - picture.made + picture.late

    def _is_old(self) -> bool:
        picture = self._picture
        return self._paused or picture is None or self._age_of(picture) > self._max_age_s

    def _update_stale(self) -> None:
        super()._update_stale()
        # An old image that looks live is dangerous.
        if self.timeout and not self._blank and not self._paused and self._is_old():
            self._clear_shown()

    def _get_problem(self) -> str:
        stream = self._endpoint
        if stream is None:
            return self._problem or self._mixing
        channel = stream.channel(self)
        below = stream.stream.problem or (channel.problem if channel else "")
        return self._problem or below or self._mixing

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        # Sinks have no signal for an item that is resized, transformed or moved to another window.
        if self._endpoint is not None and self._sink is not None and self._sink.is_alive:
            self._change_look(self._endpoint)
        self._refresh()

    def _refresh(self) -> None:
        """Emit the signal of every read-only property that changed."""
        shared = self._endpoint
        channel = shared.channel(self) if shared is not None else None
        framerate, latencies = 0.0, (-1.0, -1.0, -1.0)
        picture = self._picture
        if shared is not None and channel is not None and not self.stale:
            # The rate of a stream that is no longer live is meaningless.
            framerate, latencies = channel.frame_rate, shared.latencies
        report(
            self,
            age=-1.0 if picture is None else round(max(0.0, self._age_of(picture)), 2),
            subscribed=shared is not None and shared.stream.subscribed,
            transport=shared.stream.transport if shared is not None else "",
            framerate=framerate,
            networkLatency=latencies[0],
            processingLatency=latencies[1],
            latency=latencies[2],
            dropped=shared.dropped if shared is not None else 0,
            lost=shared.lost if shared is not None else 0,
        )
        if is_alive(self):
            self._announce_problem()


class ImageTransportSubscriber(ImageTransportSubscription):
    """The element ``ImageTransportSubscriber`` of ``Ros 1.0``, within a namespace."""

    DIALECT = Dialect.ROS1

    nsChanged = Signal()

    ns = Writable(str, read="_get_namespace", write="_set_namespace")


class ImageTransportManager(QtCore.QObject):
    """Switches load balancing; one per engine, with one setting per session."""

    loadBalancingEnabledChanged = Signal()

    loadBalancingEnabled = Writable(
        bool, read=lambda self: self._balancer.enabled, write="setLoadBalancingEnabled"
    )

    @property
    def _balancer(self) -> LoadBalancer:
        return LoadBalancer.of(own_runtime(self).session)

    @Slot(bool)
    def setLoadBalancingEnabled(self, enabled: bool) -> None:
        """Set whether streams of throttled cameras take turns to fetch single images.

        Otherwise all images are received, and surplus ones are not decoded.
        """
        if enabled != self._balancer.enabled:
            self._balancer.enabled = enabled
            self.loadBalancingEnabledChanged.emit()
