"""One camera stream for all the viewers of a session."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.comm.time import Time
from rosglass.images import ImageStream, convert
from rosglass.qml.frames import IMAGE_FORMATS, VIDEO_FORMATS, VideoFrame, to_image
from rosglass.qt import QtCore, is_alive

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.comm.sample import Sample
    from rosglass.images.frame import Frame, RawImage
    from rosglass.qml.session import Session
    from rosglass.qt import QtGui

__all__ = ["Picture", "SharedStream", "Viewer"]

#: Milliseconds that a stream without viewers stays subscribed: changing pages costs nothing.
_LINGER = 1000
_RATE_WINDOW, _LATENCY_WINDOW = 30, 10


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture as it is handed to viewers.

    Attributes:
        frame: Its size, encoding and stamps.
        video: The ``QVideoFrame``; None when nobody wants one.
        image: The ``QImage``; None when nobody wants one.
        received: When it arrived.
        late: Seconds that it was kept back on its way.
    """

    frame: Frame
    video: Any
    image: QtGui.QImage | None
    received: Time
    late: float = 0.0


class Viewer(Protocol):
    """Shows the pictures of a stream; all its methods are called on the GUI thread."""

    #: Whether it takes video frames; otherwise it takes images.
    wants_video: bool

    def show_picture(self, picture: Picture) -> None:
        """Show a picture."""

    def stream_changed(self) -> None:
        """Look at the stream's problem, transport and so on again."""


class SharedStream(QtCore.QObject):
    """An :class:`ImageStream` and its viewers; lives on the GUI thread.

    The newest picture wins: one that the GUI thread has not taken before the next one is ready is
    dropped and counted.
    """

    def __init__(self, session: Session, node: Node, topic: str, preferred: str) -> None:
        super().__init__(session)
        self._session = session
        self._key = (node, topic, preferred)
        self._viewers: list[Viewer] = []
        self._lock = threading.Lock()
        self._pending: Picture | None = None
        self._overtaken = 0
        self._video = self._image = False
        self._arrivals: deque[float] = deque(maxlen=_RATE_WINDOW)
        self._network: deque[float] = deque(maxlen=_LATENCY_WINDOW)
        self._processing: deque[float] = deque(maxlen=_LATENCY_WINDOW)
        self._total: deque[float] = deque(maxlen=_LATENCY_WINDOW)
        #: The newest picture shown, for viewers that come later.
        self.last: Picture | None = None
        executor = session.executor
        self.stream = ImageStream(
            node, topic, self._render, preferred, lambda: executor.post(self._tell)
        )
        self._linger = QtCore.QTimer(self)
        self._linger.setSingleShot(True)
        self._linger.setInterval(_LINGER)
        self._linger.timeout.connect(self.close)
        self._detach = session.attach(self, node_changed=self._node_changed)

    @classmethod
    def join(
        cls, session: Session, node: Node, topic: str, preferred: str, viewer: Viewer
    ) -> SharedStream:
        """Return the stream of a camera with `viewer` among its viewers.

        Raises:
            InvalidNameError: The topic name breaks ROS's rules.
        """
        key = (node, topic, preferred)
        stream = session.streams.get(key)
        if stream is None:
            stream = session.streams[key] = cls(session, node, topic, preferred)
        made: SharedStream = stream
        made._add(viewer)
        return made

    def leave(self, viewer: Viewer) -> None:
        """Take a viewer away; the stream ends some time after the last one has left."""
        if viewer in self._viewers:
            self._viewers.remove(viewer)
        self._look_at_viewers()
        if not self._viewers:
            self._linger.start()

    def close(self) -> None:
        """End the stream; safe to call twice."""
        self.stream.close()
        self._detach()
        if not is_alive(self):
            return
        self._linger.stop()
        self._viewers.clear()
        self._session.streams.pop(self._key, None)
        self.deleteLater()

    @property
    def dropped(self) -> int:
        """Pictures that arrived but were overtaken before they could be shown."""
        return self.stream.statistics().dropped + self._overtaken

    @property
    def lost(self) -> int:
        """Pictures that were sent but never arrived."""
        return self.stream.statistics().lost

    @property
    def frame_rate(self) -> float:
        """Pictures shown per second, falling when they stop."""
        arrivals = self._arrivals
        if len(arrivals) < 2:
            return 0.0
        span = arrivals[-1] - arrivals[0]
        period = span / (len(arrivals) - 1)
        span += max(0.0, time.monotonic() - arrivals[-1] - 1.5 * period)
        return (len(arrivals) - 1) / span if span > 0 else 0.0

    @property
    def latencies(self) -> tuple[float, float, float]:
        """Milliseconds from stamp to arrival, from arrival to display, and both; -1 unknown."""
        return _mean(self._network), _mean(self._processing), _mean(self._total)

    def _add(self, viewer: Viewer) -> None:
        self._linger.stop()
        self._viewers.append(viewer)
        self._look_at_viewers()

    def _look_at_viewers(self) -> None:
        self._video = any(viewer.wants_video for viewer in self._viewers)
        self._image = any(not viewer.wants_video for viewer in self._viewers)

    def _render(self, image: RawImage, sample: Sample) -> None:
        """Convert a picture for the viewers there are; in the stream's thread."""
        wants_video, wants_image = self._video, self._image
        if not (wants_video or wants_image):
            return
        video = picture = None
        if wants_video and not wants_image:
            target = VideoFrame()
            frame = convert(image, VIDEO_FORMATS, sample.received, target.allocate)
            video = target.finish(frame)
        else:
            accept = IMAGE_FORMATS & VIDEO_FORMATS if wants_video else IMAGE_FORMATS
            frame = convert(image, accept, sample.received)
            picture = to_image(frame)
            video = VideoFrame().finish(frame) if wants_video else None
        late = self.stream.lateness(sample)
        with self._lock:
            waiting = self._pending is not None
            self._overtaken += waiting
            self._pending = Picture(frame, video, picture, sample.received, late)
        if not waiting:
            self._session.executor.post(self._present)

    def _present(self) -> None:
        with self._lock:
            picture, self._pending = self._pending, None
        if picture is None:
            return
        self.last = picture
        self._arrivals.append(time.monotonic())
        for viewer in list(self._viewers):
            viewer.show_picture(picture)
        shown = Time.now()
        self._processing.append((shown - picture.received).seconds * 1000)
        if picture.frame.stamp is not None:
            self._network.append((picture.received - picture.frame.stamp).seconds * 1000)
            self._total.append((shown - picture.frame.stamp).seconds * 1000)

    def _tell(self) -> None:
        for viewer in list(self._viewers):
            viewer.stream_changed()

    def _node_changed(self) -> None:
        if self._session.node is not self._key[0]:
            self.close()


def _mean(values: deque[float]) -> float:
    return sum(values) / len(values) if values else -1.0
