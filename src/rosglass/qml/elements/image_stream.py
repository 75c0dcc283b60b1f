"""Camera streams, each shared by all its viewers in a session."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from rosglass.comm.statistics import note_time, rate_of
from rosglass.comm.time import Time
from rosglass.images import ImageStream
from rosglass.qml.elements.element import Pace
from rosglass.qml.elements.image_rendering import Look, Picture, Renderer
from rosglass.qml.elements.load_balancer import LoadBalancer
from rosglass.qt import QtCore, is_alive

if TYPE_CHECKING:
    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.images.encodings import RawImage
    from rosglass.qml.engine.session import Session

__all__ = ["SharedStream", "Viewer"]

#: Milliseconds that a stream without viewers stays subscribed, so that changing pages is cheap.
_LINGER = 1000
_RATE_WINDOW, _LATENCY_WINDOW = 30, 10
#: Factor by which the wanted interval must exceed the possible one before images are fetched
#: one by one.
_HYSTERESIS = 1.1
#: Bytes of an image that are compared with those of the image before.
_COMPARED = 1 << 14
#: Decay of the estimated cost of fetching, per image that was not fetched.
_FORGETTING = 0.9


class Viewer(Protocol):
    """Shows the images of a stream; all its methods are called on the GUI thread."""

    def show_picture(self, picture: Picture) -> None:
        """Show an image."""

    def stream_changed(self) -> None:
        """Read the stream's problem, transport and so on again."""


class Channel:
    """The viewers of a stream with the same look; each image is converted once for all of them.

    Args:
        look: Their look.
    """

    def __init__(self, look: Look) -> None:
        self.look = look
        self.viewers: list[Viewer] = []
        #: The newest image shown, for viewers that join later.
        self.last: Picture | None = None
        #: Why the images cannot be shown with this look, though with others; empty if they can.
        self.problem = ""
        self._pace = Pace()
        self._arrivals: deque[float] = deque(maxlen=_RATE_WINDOW)

    def is_due(self, now: float) -> bool:
        """Return whether the next image is due."""
        return self._pace.wait(self.look.interval, now) <= 0

    def take(self, now: float) -> None:
        """Count an image, so that the mean rate does not exceed the requested one."""
        self._pace.take(self.look.interval, now)

    def show(self, picture: Picture) -> None:
        """Show an image to all viewers."""
        self.last = picture
        note_time(self._arrivals, time.monotonic())
        for viewer in list(self.viewers):
            viewer.show_picture(picture)

    @property
    def frame_rate(self) -> float:
        """Images shown per second; 0 when they have stopped."""
        return rate_of(self._arrivals, time.monotonic())


@dataclass(slots=True)
class _Pending:
    """Results of the stream's thread for the GUI thread."""

    pictures: dict[Channel, Picture]
    received: Time
    stamp: Time | None


class SharedStream(QtCore.QObject):
    """An :class:`ImageStream` and its viewers; lives on the GUI thread.

    The newest image wins: an image that the GUI thread has not taken before the next is ready is
    dropped and counted. While all viewers want fewer images than the camera sends, images are
    fetched one by one, at times scheduled by the session's load balancer.
    """

    def __init__(
        self, session: Session, node: Node, topic: str, preferred: str, look: Look, viewer: Viewer
    ) -> None:
        super().__init__(session)
        self._session = session
        self._key = (node, topic, preferred)
        channel = Channel(look)
        channel.viewers.append(viewer)
        #: Replaced instead of modified, because the stream's thread reads it. With the first viewer
        #: before the stream begins: a latched image arrives at once, and only once.
        self._channels: tuple[Channel, ...] = (channel,)
        self._renderer = Renderer(session.steady)
        self._lock = threading.Lock()
        self._pending: _Pending | None = None
        self._overtaken = 0
        self._network: deque[float] = deque(maxlen=_LATENCY_WINDOW)
        self._processing: deque[float] = deque(maxlen=_LATENCY_WINDOW)
        self._total: deque[float] = deque(maxlen=_LATENCY_WINDOW)
        #: Seconds between two images that satisfy all viewers; 0 if one viewer wants all.
        self._interval = 0.0
        #: Seconds between two images when all are received, and seconds that fetching one takes.
        self._period = self._price = 0.0
        self._asked: float | None = None
        self._last_stamp: Time | None = None
        #: Compared bytes of the last image; when the first and the last image with them arrived.
        self._content: Any = None
        self._changed_at = self._compared_at = 0.0
        self._balancer = LoadBalancer.of(session)
        executor = session.executor
        self.stream = ImageStream(
            node, topic, self._render, preferred, lambda: executor.post(self._notify), self._wanted
        )
        self._linger = QtCore.QTimer(self)
        self._linger.setSingleShot(True)
        self._linger.setInterval(_LINGER)
        self._linger.timeout.connect(self.close)
        self._turn = QtCore.QTimer(self)
        self._turn.setSingleShot(True)
        self._turn.setTimerType(QtCore.Qt.TimerType.PreciseTimer)
        self._turn.timeout.connect(self._fetch)
        self._detach = session.attach(self, node_changed=self._node_changed)

    @classmethod
    def join(
        cls, session: Session, node: Node, topic: str, preferred: str, look: Look, viewer: Viewer
    ) -> SharedStream:
        """Add `viewer` to the stream of a camera, created if needed; return the stream.

        Raises:
            InvalidNameError: The topic name breaks ROS's rules.
        """
        key = (node, topic, preferred)
        stream = session.streams.get(key)
        if stream is None:
            first = session.streams[key] = cls(session, node, topic, preferred, look, viewer)
            first._look_at_channels()
            return first
        made: SharedStream = stream
        made._linger.stop()
        made.change_look(viewer, look)
        return made

    def change_look(self, viewer: Viewer, look: Look) -> None:
        """Change a viewer's look from the next image on."""
        self._take_out(viewer)
        channel = next((c for c in self._channels if c.look == look), None)
        if channel is None:
            channel = Channel(look)
            self._channels = (*self._channels, channel)
        channel.viewers.append(viewer)
        self._look_at_channels()

    def leave(self, viewer: Viewer) -> None:
        """Remove a viewer; the stream ends a while after the last one has left."""
        self._take_out(viewer)
        self._look_at_channels()
        if not self._channels:
            self._linger.start()

    def channel(self, viewer: Viewer) -> Channel | None:
        """Return the channel of a viewer."""
        return next((c for c in self._channels if viewer in c.viewers), None)

    def close(self) -> None:
        """End the stream; safe to call twice."""
        self.stream.close()
        self._detach()
        if not is_alive(self):
            return
        self._linger.stop()
        self._turn.stop()
        self._balancer.forget(self)
        self._channels = ()
        self._session.streams.pop(self._key, None)
        self.deleteLater()

    @property
    def dropped(self) -> int:
        """Number of images that were replaced by newer ones before they could be shown."""
        return self.stream.statistics().dropped + self._overtaken

    @property
    def lost(self) -> int:
        """Number of images that were sent but never arrived."""
        return self.stream.statistics().lost

    @property
    def latencies(self) -> tuple[float, float, float]:
        """Milliseconds from stamp to arrival, from there to display, and in total; -1 unknown."""
        return _mean(self._network), _mean(self._processing), _mean(self._total)

    @property
    def unchanged(self) -> float:
        """Seconds during which images arrived that all had the same pixels."""
        return self._compared_at - self._changed_at

    # Viewers and their looks.

    def _take_out(self, viewer: Viewer) -> None:
        channel = self.channel(viewer)
        if channel is not None:
            channel.viewers.remove(viewer)
            if not channel.viewers:
                self._channels = tuple(c for c in self._channels if c is not channel)

    def _look_at_channels(self) -> None:
        intervals = [channel.look.interval for channel in self._channels]
        interval = min(intervals, default=self._interval)
        if interval != self._interval:
            self._interval = interval
            # The user may need images before the next turn.
            self._turn.stop()
            self._balancer.forget(self)
            self._fetch()

    def _wanted(self) -> bool:
        """Return whether a received image is needed; in the middleware's thread."""
        if self._due():
            return True
        self._rest_if_possible()
        return False

    def _due(self) -> list[Channel]:
        """Return the channels that need an image now."""
        now = time.monotonic()
        # A turn may be somewhat earlier than the time at which an image is due.
        early = self._interval / 2 if self._asked is not None else 0.0
        return [channel for channel in self._channels if channel.is_due(now + early)]

    # Turns.

    def _rest_if_possible(self) -> None:
        """Stop receiving until the next turn, if images can be fetched one by one."""
        if not self._interval:  # also 0 for an image that arrives during the stream's creation
            return
        stream = self.stream
        self._period = stream.period or self._period
        if not (self._period and self._balancer.enabled):
            return
        # A single video frame that is not a key frame cannot be decoded.
        if stream.video or self._interval <= _HYSTERESIS * max(self._period, self._price):
            return
        stream.rest()
        self._session.executor.post(self._plan)

    def _plan(self) -> None:
        """Schedule the next turn; on the GUI thread."""
        if not is_alive(self) or self._turn.isActive():
            return
        if not self._interval:
            self._fetch()
            return
        now = time.monotonic()
        due = self._balancer.place(self, self._interval, now)
        self._turn.start(max(0, round((due - now) * 1000)))

    def _fetch(self) -> None:
        if self.stream.resume():
            self._asked = time.monotonic()

    # Images.

    def _render(self, image: RawImage, sample: Sample) -> None:
        """Convert a received image for the channels that need it; in the stream's thread."""
        now, channels = time.monotonic(), self._due()
        repeated = image.stamp is not None and image.stamp == self._last_stamp
        # A latched image that is sent again to a new subscriber is not new.
        if not channels or (repeated and self._interval):
            return
        self._last_stamp = image.stamp
        late = self.stream.lateness(sample)
        looks = {channel.look for channel in channels}
        made, failed = self._renderer.render(image, sample.received, late, looks)
        self._compare(image)
        for channel in channels:
            channel.take(now)
            channel.problem = failed.get(channel.look, "")
        pictures = {c: made[c.look] for c in channels if c.look in made}
        if pictures:
            self._hand_over(_Pending(pictures, sample.received, image.stamp))
        if failed:
            self._session.executor.post(self._notify)
        if self._asked is None:
            self._price *= _FORGETTING
        else:
            self._price, self._asked = now - self._asked, None
        self._rest_if_possible()

    def _compare(self, image: RawImage) -> None:
        """Find out whether an image has other pixels than the one before."""
        content = _sampled(image)
        self._compared_at = self._session.steady()
        if content != self._content:
            self._content, self._changed_at = content, self._compared_at

    def _hand_over(self, pending: _Pending) -> None:
        with self._lock:
            before, self._pending = self._pending, pending
            if before is not None:
                self._overtaken += not before.pictures.keys().isdisjoint(pending.pictures)
                pending.pictures = {**before.pictures, **pending.pictures}
        if before is None:
            self._session.executor.post(self._present)

    def _present(self) -> None:
        with self._lock:
            pending, self._pending = self._pending, None
        if pending is None:
            return
        for channel, picture in pending.pictures.items():
            channel.show(picture)
        # In a recording, times are recorded ones, and only the delay on the way is known.
        shown = pending.received if hasattr(self._key[0], "playback") else Time.now()
        self._processing.append((shown - pending.received).seconds * 1000)
        if pending.stamp is not None:
            self._network.append((pending.received - pending.stamp).seconds * 1000)
            self._total.append((shown - pending.stamp).seconds * 1000)

    def _notify(self) -> None:
        for channel in self._channels:
            for viewer in list(channel.viewers):
                viewer.stream_changed()

    def _node_changed(self) -> None:
        if self._session.node is not self._key[0]:
            self.close()


def _sampled(image: RawImage) -> tuple[int, int, bytes]:
    """Return the size of an image, and bytes from all over it.

    The noise of a camera changes some of them in every image.
    """
    data = np.frombuffer(image.data, np.uint8)
    # Odd, so that it visits all channels and columns.
    step = data.size // _COMPARED | 1
    return image.width, image.height, data[::step].tobytes()


def _mean(values: deque[float]) -> float:
    return sum(values) / len(values) if values else -1.0
