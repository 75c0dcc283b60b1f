"""The element ``ImageTransportSubscription``: a camera's pictures in a video sink."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.callbacks import Deferred
from rosglass.qml.element import DEFAULT_TIMEOUT, changed_enough
from rosglass.qml.image_look import LookElement
from rosglass.qml.image_sinks import Sink
from rosglass.qml.log import plain_path
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive, optional

if TYPE_CHECKING:
    from pathlib import Path

    from rosglass.comm.node import Node
    from rosglass.qml.image_rendering import Look, Picture
    from rosglass.qml.image_stream import SharedStream
    from rosglass.qml.runtime import Runtime

__all__ = ["ImageTransportSubscription"]

#: Importing it on the GUI thread would stop the screen for a tenth of a second: it brings numpy.
_HEAVY = "rosglass.images"
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


class ImageTransportSubscription(LookElement):
    """Shows a camera. See its page in ``docs/elements``."""

    @QtCore.QEnum
    class PlaybackState(IntEnum):
        """Whether pictures follow each other; the numbers of Qt's MediaPlayer."""

        StoppedState = 0
        PlayingState = 1
        PausedState = 2

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
    playbackStateChanged = Signal()
    #: A picture is in a file, whose absolute path is given.
    snapshotSaved = Signal(str)
    #: It is not, and why.
    snapshotFailed = Signal(str)

    _HOLDS = ("_picture", "_stream", "_have")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        # Loaded before QML hands over its sink: what Qt gave Python as a plain QObject stays one.
        optional("QtMultimedia")
        self._preferred = "compressed"
        self._timeout = DEFAULT_TIMEOUT
        self._paused = False
        self._sink: Sink | None = None
        self._stream: SharedStream | None = None
        self._have: tuple[Node, str, str] | None = None
        self._has_look: Look | None = None
        self._picture: Picture | None = None
        self._looks: tuple[str, bool, bool] = ("", False, False)
        self._blank = True
        self._values: dict[str, Any] = dict(_START)

    # Properties that QML sets.

    def _get_topic(self) -> str:
        return self._resolved or self._topic

    def _set_topic(self, topic: str) -> None:
        if topic == self._topic:
            return
        self._topic = topic
        if topic == self._resolved:
            return  # the same topic, now whatever the node's namespace becomes
        self._resolved = ""
        # What is paused would stay on the screen under another name.
        self._clear_sink()
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
            self.playbackStateChanged.emit()
            self._schedule()

    def _set_timeout(self, timeout: int) -> None:
        if timeout < 0:
            self._refuse(f"{self._who}: timeout {timeout} ms < 0")
        elif timeout != self._timeout:
            self._timeout = timeout
            self.timeoutChanged.emit()
            self._judge()

    def _get_sink(self) -> QtCore.QObject | None:
        return self._sink.item if self._sink is not None and self._sink.is_alive else None

    def _set_sink(self, item: QtCore.QObject | None) -> None:
        if item is self._get_sink():
            return
        try:
            sink = None if item is None else Sink(item, self)
        except Error as error:
            self._refuse(f"{self._who}: {error}")
            return
        self._clear_sink()
        self._sink = sink
        if item is not None:
            item.destroyed.connect(self._schedule)
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
    #: What Qt 5's VideoOutput looks for.
    videoSurface = Property(QtCore.QObject, _get_sink, _set_sink, notify=videoSinkChanged)

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

    # Playing.

    def _get_state(self) -> int:
        if not self._enabled:
            return int(self.PlaybackState.StoppedState)
        paused = self.PlaybackState.PausedState
        return int(paused if self._paused else self.PlaybackState.PlayingState)

    playbackState = Property(int, _get_state, notify=playbackStateChanged)

    @Slot()
    def play(self) -> None:
        """Receive pictures, after :meth:`pause` or :meth:`stop`."""
        self._set_paused(False)
        self._set_enabled(True)

    @Slot()
    def pause(self) -> None:
        """Receive no more pictures and keep the last one on the screen, where it is stale."""
        self._set_paused(True)

    @Slot()
    def stop(self) -> None:
        """Receive no more pictures and take the last one off the screen."""
        self._set_paused(False)
        self._set_enabled(False)

    def _set_paused(self, paused: bool) -> None:
        if paused != self._paused:
            self._paused = paused
            self.playbackStateChanged.emit()
            self._judge()
            self._schedule()

    @Slot(str, result=QJSValue)
    def saveSnapshot(self, path: str) -> QJSValue:
        """Write the picture that is shown into a file, away from the GUI thread.

        Args:
            path: The file, plain or as a ``file:`` URL; its ending tells its kind.

        Returns:
            A promise of its absolute path.
        """
        runtime, picture = self._find_runtime(), self._picture
        if runtime is None:
            return QJSValue()
        promise = Deferred(runtime, f"{self._who}: saveSnapshot({path!r})")

        def done(result: Path | Error) -> None:
            if isinstance(result, Error):
                promise.reject(str(result))
            else:
                promise.resolve(QJSValue(str(result)))
            if is_alive(self):
                failed = isinstance(result, Error)
                (self.snapshotFailed if failed else self.snapshotSaved).emit(str(result))

        look = self._has_look
        if picture is None or look is None:
            done(Error("no picture is shown"))
            return promise.promise

        def work() -> Path:
            from rosglass.images import save  # noqa: PLC0415 - brings numpy
            from rosglass.qml.image_rendering import whole_frame  # noqa: PLC0415

            # The picture, not only its frame, is held until then: the memory may be the video's.
            return save(whole_frame(picture, look), plain_path(path))

        runtime.session.background(work, done)
        return promise.promise

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
        if self._sink is not None and not self._sink.is_alive:
            self._sink = None
        node = self.node
        resolved = self._resolve(self._topic)
        want = None
        if node is not None and self._enabled and not self._paused and resolved and self._sink:
            want = (node, resolved, self._preferred)
        if want and self._session and not self._session.is_loaded(_HEAVY, self._schedule_again):
            return
        if want != self._have:
            self._leave()
            self._have = want
            if want is None:
                self._suspect = True
                self._judge()
                self._refresh()
            else:
                if resolved != self._resolved:
                    self._resolved = resolved
                    self.topicChanged.emit()
                self._join(*want)
        elif self._stream is not None:
            self._follow(self._stream)
        if not (self._enabled or self._blank):
            self._clear_sink()

    def _schedule_again(self) -> None:
        if is_alive(self):
            self._schedule()

    def _join(self, node: Node, topic: str, preferred: str) -> None:
        from rosglass.qml.image_stream import SharedStream as Stream  # noqa: PLC0415 - brings numpy

        session = self._session
        assert session is not None
        look = self._best_look()
        try:
            stream = Stream.join(session, node, topic, preferred, look, self)
        except Error as error:
            self._say(str(error))
            return
        self._stream, self._has_look = stream, look
        self._publishers = self._count_publishers()
        self._expect_publishers()
        self._at_end["stream"] = lambda: stream.leave(self)
        channel = stream.channel(self)
        if channel is not None and channel.last is not None and not self._suspect:
            self.show_picture(channel.last)
        self._refresh()

    def _follow(self, stream: SharedStream) -> None:
        """Have the pictures as the properties say now."""
        look = self._best_look()
        if look != self._has_look:
            self._has_look = look
            stream.change_look(self, look)

    def _best_look(self) -> Look:
        """Return what the properties ask for; what they asked for before, when that is wrong."""
        from rosglass.qml.image_rendering import Look  # noqa: PLC0415 - brings numpy

        assert self._sink is not None
        video, painted = self._sink.takes_video, self._sink.is_painted()
        try:
            look = self._look(video, self._sink.room(), painted)
        except Error as error:
            self._say(f"{self._who}: {error}")
            before = self._has_look
            fits = before is not None and (before.video, before.painted) == (video, painted)
            return before if before is not None and fits else Look(video, painted=painted)
        self._say("")
        return look

    def _leave(self) -> None:
        self._lonely.stop()
        stream, self._stream = self._stream, None
        self._at_end.pop("stream", None)
        if stream is not None:
            stream.leave(self)
            if not self._paused:
                self._clear_sink()

    def show_picture(self, picture: Picture) -> None:
        """Show a picture; called by the stream on the GUI thread."""
        sink = self._sink
        if not is_alive(self) or sink is None or not sink.is_alive or self._paused:
            return
        # What a silent link kept back would be taken off the screen at once.
        if self._timeout and self._age(picture) > self._patience:
            return
        try:
            if not sink.show(picture):
                return
        except Error as error:
            self._say(str(error))
            return
        self._picture, self._blank, self._suspect = picture, False, False
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
        self._picture, self._blank = None, True
        if self._sink is not None:
            self._sink.clear()

    # Judging.

    @property
    def _patience(self) -> float:
        """Seconds after which a picture is old."""
        return (self._timeout or DEFAULT_TIMEOUT) / 1000 + self._interval

    def _age(self, picture: Picture) -> float:
        return self._steady() - picture.made + picture.late

    def _is_old(self) -> bool:
        picture = self._picture
        return self._paused or picture is None or self._age(picture) > self._patience

    def _judge(self) -> None:
        super()._judge()
        # A picture that stays is the more dangerous the more it looks like a live one.
        if self._timeout and not self._blank and not self._paused and self._is_old():
            self._clear_sink()

    def _stale_changed(self) -> None:
        self.staleChanged.emit()

    def _problem_changed(self) -> None:
        self._refresh()

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        # Items are resized, moved to other windows and transformed without a word to their sinks.
        if self._stream is not None and self._sink is not None and self._sink.is_alive:
            self._follow(self._stream)
        self._refresh()

    def _refresh(self) -> None:
        """Tell QML about every read-only property that changed."""
        shared = self._stream
        now = dict(_START)
        if shared is not None:
            network, processing, latency = shared.latencies
            channel = shared.channel(self)
            now |= {
                "subscribed": shared.stream.subscribed,
                "transport": shared.stream.transport,
                "dropped": shared.dropped,
                "lost": shared.lost,
                "problem": shared.stream.problem or (channel.problem if channel else ""),
            }
            if channel is not None and not self._stale:
                # How fast pictures came once says nothing about one that is not live.
                now["framerate"] = channel.frame_rate
                now["networkLatency"] = network
                now["processingLatency"] = processing
                now["latency"] = latency
        now["problem"] = self._problem or now["problem"] or self._mixed
        for name, value in now.items():
            before = self._values[name]
            real = isinstance(value, float)
            if changed_enough(before, value) if real else value != before:
                self._values[name] = value
                getattr(self, f"{name}Changed").emit()
