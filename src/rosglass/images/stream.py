"""A camera stream, which decodes and converts the newest image on its own thread."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.comm.executor import IMMEDIATE
from rosglass.comm.handle import Handle
from rosglass.comm.qos import Durability, QoS, Reliability
from rosglass.errors import Error, NodeClosedError, NoPictureError
from rosglass.images.transports import choose

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.comm.subscription import Subscription
    from rosglass.images.encodings import RawImage
    from rosglass.images.transports import Choice, PictureReader, Transport
    from rosglass.messages import MessageType

__all__ = ["ImageStream", "StreamStatistics"]

_T = TypeVar("_T")
_log = logging.getLogger("rosglass.images")
#: Seconds between two checks of the graph while not subscribed.
_RETRY_INTERVAL_S = 1.0
#: Seconds between two log messages of a stream.
_LOG_INTERVAL_S = 5.0
#: Queue size for video packets; beyond it, decoding continues at the next key frame.
MAX_BACKLOG = 60
_QUEUE = 16
#: Number of arrivals for measuring the period, and the minimum.
_MAX_ARRIVALS, _MIN_ARRIVALS = 12, 4
_STILLS = QoS(depth=1, reliability=Reliability.BEST_EFFORT)
_VIDEO = QoS(depth=_QUEUE, reliability=Reliability.BEST_AVAILABLE)


@dataclass(frozen=True, slots=True)
class StreamStatistics:
    """The statistics of a stream.

    Attributes:
        received: Images received.
        shown: Images displayed.
        dropped: Images dropped for a newer one.
        lost: Images lost on the way, by the publisher's sequence numbers.
        invalid: Images that could not be displayed; see :attr:`ImageStream.problem`.
    """

    received: int = 0
    shown: int = 0
    dropped: int = 0
    lost: int = 0
    invalid: int = 0


class ImageStream(Handle):
    """Receives the images of a camera.

    Subscribes to the preferred transport, or to another one while that is not published; best
    effort, except for videos with a reliable publisher. Images are decoded and converted on the
    stream's own thread, so that neither the middleware nor the user interface waits; an image is
    dropped if a newer one has arrived.

    Args:
        node: Node that subscribes.
        topic: The camera's base topic, or the topic of a transport.
        show: Called on the stream's thread with each image and its sample, to convert and display
            it. A rosglass.Error that it raises becomes the stream's problem.
        preferred: Name of the preferred transport.
        changed: Called from any thread after changes of :attr:`problem` or :attr:`transport`.
        wanted: Called from any thread, returns whether to decode a received image; others are not
            counted as dropped. Not called for videos, whose frames depend on each other. None to
            decode all.

    Raises:
        InvalidNameError: The topic name breaks ROS's rules.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        show: Callable[[RawImage, Sample], None],
        preferred: str = "compressed",
        changed: Callable[[], None] | None = None,
        wanted: Callable[[], bool] | None = None,
    ) -> None:
        self.topic = node.resolve(topic)
        self._node, self._preferred = node, preferred
        self._show_picture, self._changed, self._wanted = show, changed, wanted
        #: Guards the state below; notified when the thread has something to do.
        self._wake = threading.Condition()
        self._samples: deque[tuple[Transport, Sample]] = deque()
        self._overflow = False
        self._look, self._closing, self._resting = True, False, False
        self._arrivals: deque[float] = deque(maxlen=_MAX_ARRIVALS)
        self._choice: Choice | None = None
        self._subscription: Subscription | None = None
        self._reader: tuple[MessageType, str, PictureReader] | None = None
        self._problem, self._logged = "", ("", 0.0)
        self._received = self._shown = self._dropped = self._lost = self._invalid = 0
        self._sequence: tuple[bytes, int] = (b"", -1)
        self._graph = node.on_graph_change(self._on_graph, IMMEDIATE)
        self._thread = threading.Thread(target=self._work, name=f"images {topic}", daemon=True)
        self._thread.start()

    @property
    def problem(self) -> str:
        """Why no image is displayed; empty if there is no problem."""
        subscription = self._subscription
        return self._problem or (subscription.problem if subscription is not None else "")

    @property
    def transport(self) -> str:
        """Name of the transport in use; empty while none is published."""
        return self._choice.transport.name if self._choice is not None else ""

    @property
    def subscribed(self) -> bool:
        """True while subscribed, or while only :meth:`rest` prevents it."""
        return self._subscription is not None or self._resting

    @property
    def video(self) -> bool:
        """True if the transport in use is a video, which must be received without gaps."""
        return self._choice is not None and self._choice.transport.video

    @property
    def period(self) -> float:
        """Measured period of the camera in seconds; 0 until it is known."""
        with self._wake:
            arrivals = list(self._arrivals)
        if len(arrivals) < _MIN_ARRIVALS:
            return 0.0
        return (arrivals[-1] - arrivals[0]) / (len(arrivals) - 1)

    def rest(self) -> None:
        """Unsubscribe until :meth:`resume`, so that the robot neither compresses nor sends."""
        with self._wake:
            self._resting = True
            self._wake.notify_all()

    def resume(self) -> bool:
        """Subscribe again after :meth:`rest`; return whether it was resting."""
        with self._wake:
            if not self._resting:
                return False
            self._resting, self._look = False, True
            # The interval and the numbers skipped while resting do not count.
            self._arrivals.clear()
            self._sequence = (b"", -1)
            self._wake.notify_all()
        return True

    def publisher_count(self) -> int:
        """Return the number of publishers of the transport in use."""
        choice = self._choice
        return len(self._node.publishers(choice.topic)) if choice is not None else 0

    def lateness(self, sample: Sample) -> float:
        """Return the delay of an image on the way in seconds."""
        subscription = self._subscription
        return 0.0 if subscription is None else subscription.lateness(sample).seconds

    def statistics(self) -> StreamStatistics:
        """Return the current statistics."""
        with self._wake:
            return StreamStatistics(
                self._received, self._shown, self._dropped, self._lost, self._invalid
            )

    def close(self) -> None:
        """Stop receiving. Returns at once; the thread ends after the current image."""
        with self._wake:
            if self._closing:
                return
            self._closing = True
            self._wake.notify_all()
        self._graph.close()

    def join(self, timeout: float) -> bool:
        """Wait up to `timeout` seconds for the thread after :meth:`close`; True if it ended."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _on_graph(self) -> None:
        with self._wake:
            self._look = True
            self._wake.notify_all()

    def _on_sample(self, transport: Transport, sample: Sample) -> None:
        now = time.monotonic()
        with self._wake:
            if self._resting:
                return
            self._received += 1
            self._arrivals.append(now)
            publisher, last = self._sequence
            if sample.sequence >= 0:
                if sample.publisher == publisher and sample.sequence > last >= 0:
                    self._lost += sample.sequence - last - 1
                self._sequence = (sample.publisher, sample.sequence)
        if not (transport.video or self._wanted is None or self._wanted()):
            return
        with self._wake:
            if not transport.video or len(self._samples) >= MAX_BACKLOG:
                self._overflow |= transport.video
                self._dropped += len(self._samples)
                self._samples.clear()
            self._samples.append((transport, sample))
            self._wake.notify_all()

    def _work(self) -> None:
        while True:
            with self._wake:
                idle = self._subscription is None
                self._wake.wait_for(
                    lambda: self._samples or self._has_work,
                    _RETRY_INTERVAL_S if idle and not self._resting else None,
                )
                if self._closing:
                    break
                resting = self._resting
                look, self._look = self._look or idle, False
                samples, self._samples = self._samples, deque()
                overflow, self._overflow = self._overflow, False
            if resting:
                self._unsubscribe()
                continue
            if look:
                self._subscribe()
            if overflow and self._reader is not None:
                self._reader[2].lost()
            self._decode(samples)
        self._unsubscribe()

    @property
    def _has_work(self) -> bool:
        """True if the thread has something to do besides decoding."""
        idle = self._subscription is None
        return self._closing or (not idle if self._resting else self._look)

    def _unsubscribe(self) -> None:
        subscription, self._subscription = self._subscription, None
        if subscription is not None:
            subscription.close()

    def _subscribe(self) -> None:
        try:
            published = {
                name: types
                for name, types in self._node.topics().items()
                if name.startswith(self.topic) and self._node.publishers(name)
            }
            choice = choose(self.topic, self._preferred, published)
            # Stay subscribed to a camera that has left, as it may return.
            listening = self._subscription is not None
            if choice is None or (choice == self._choice and listening):
                self._set_problem("" if choice is not None else self._problem)
                return
            subscription = self._node.create_subscription(
                choice.topic,
                choice.transport.type,
                qos=self._profile(choice),
                raw_callback=partial(self._on_sample, choice.transport),
                executor=IMMEDIATE,
            )
        except NodeClosedError:
            self._set_problem("")
            return
        except Error as error:
            self._set_problem(str(error))
            return
        previous, self._subscription = self._subscription, subscription
        self._choice, self._reader = choice, None
        if previous is not None:
            previous.close()
        self._problem = ""
        self._notify()

    def _profile(self, choice: Choice) -> QoS:
        """Return the QoS to request, which includes an image that a publisher has latched."""
        qos = _VIDEO if choice.transport.video else _STILLS
        publishers = self._node.publishers(choice.topic)
        if any(p.qos.durability is not Durability.TRANSIENT_LOCAL for p in publishers):
            return qos
        return replace(
            qos, reliability=Reliability.BEST_AVAILABLE, durability=Durability.BEST_AVAILABLE
        )

    def _decode(self, samples: deque[tuple[Transport, Sample]]) -> None:
        """Decode the received samples, and display the newest image."""
        newest: tuple[RawImage, Sample] | None = None
        for transport, sample in samples:
            choice = self._choice
            if choice is None or transport is not choice.transport:
                continue
            picture = self._guarded(self._read, transport, sample)
            if picture is not None:
                with self._wake:
                    self._dropped += newest is not None
                newest = (picture, sample)
        if newest is not None and self._guarded(self._show, *newest):
            self._set_problem("")

    def _read(self, transport: Transport, sample: Sample) -> RawImage | None:
        if self._reader is None or self._reader[:2] != (sample.type, sample.wire):
            reader = transport.reader(sample.type, sample.wire)
            self._reader = (sample.type, sample.wire, reader)
        return self._reader[2](sample)

    def _show(self, picture: RawImage, sample: Sample) -> bool:
        self._show_picture(picture, sample)
        with self._wake:
            self._shown += 1
        return True

    def _guarded(self, step: Callable[..., _T], *arguments: Any) -> _T | None:
        """Call a step; return None if it fails: no image may end the stream."""
        try:
            return step(*arguments)
        except NoPictureError as error:
            self._set_problem(str(error))
        except Error as error:
            with self._wake:
                self._invalid += 1
            self._set_problem(str(error))
        except Exception as error:  # noqa: BLE001 - no image may end the stream
            _log.exception("%s: an image could not be converted", self.topic)
            self._set_problem(f"internal error: {error}")
        return None

    def _set_problem(self, problem: str) -> None:
        """Set the problem, and log it, but not for every image of a bad stream."""
        if problem:
            now = time.monotonic()
            last, at = self._logged
            if problem != last or now - at > _LOG_INTERVAL_S:
                self._logged = (problem, now)
                _log.warning("%s: %s", self.topic, problem)
        if problem != self._problem:
            self._problem = problem
            self._notify()

    def _notify(self) -> None:
        if self._changed is not None:
            self._changed()
