"""Displays of the messages of one topic.

A :class:`TopicDisplay` decodes messages in the node's thread, waits for the transform at their
time, and shows them in the GUI thread; a :class:`HistoryDisplay` shows the last ones beside each
other.
"""

from __future__ import annotations

import logging
import math
import time
from collections import deque
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from rosglass.comm.qos import Durability, QoS, Reliability
from rosglass.errors import Error
from rosglass.qml.elements.message_queue import (
    MAX_WAITING_BYTES,
    MOST_WAITING,
    MessageQueue,
    QueuedMessage,
    Subscriptions,
    drop_oldest,
    size_of,
)
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import is_alive
from rosglass.scene.configs.rviz_formats import TopicSetting, read_topic
from rosglass.scene.configs.settings import Setting
from rosglass.scene.displays.display import LATE_S, OUTDATED_ALPHA, Display
from rosglass.scene.render.scene_tree import Group

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np
    from numpy.typing import NDArray

    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["HistoryDisplay", "TopicDisplay"]

_log = logging.getLogger("rosglass.scene")
#: Messages that one display shows beside each other.
_MAX_HISTORY = 10_000

#: The policy that matches every publisher; RViz does not have it.
BEST_AVAILABLE = "Best Available"
#: QoS policies by RViz's words.
_RELIABILITY = {
    BEST_AVAILABLE: Reliability.BEST_AVAILABLE,
    "Best Effort": Reliability.BEST_EFFORT,
    "Reliable": Reliability.RELIABLE,
    "System Default": Reliability.SYSTEM_DEFAULT,
}
_DURABILITY = {
    BEST_AVAILABLE: Durability.BEST_AVAILABLE,
    "Volatile": Durability.VOLATILE,
    "Transient Local": Durability.TRANSIENT_LOCAL,
    "System Default": Durability.SYSTEM_DEFAULT,
}

#: Lookups that may fail each time that messages are placed, from either end.
_MOST_MISSES = 25

#: Seconds without a message after which data that is sent all the time is out of date.
_CONTINUOUS_S = 3.0


class TopicDisplay(Display):
    """A display of the messages of one topic.

    Attributes:
        KEEPS_ALL: Whether each message counts, as for markers; otherwise the newest does.
        EAGER: Whether all fields of a message are decoded at once, which is faster if all are used.
        IS_CONTINUOUS: Whether publishers send all the time, unless they keep the last message for
            later subscribers; what is shown is out of date after 3 s without a message then, or
            after twice the time between messages.
    """

    TOPIC_KEYS: ClassVar[tuple[str, ...]] = ("Topic",)
    KEEPS_ALL: ClassVar[bool] = False
    IS_CONTINUOUS: ClassVar[bool] = False
    #: Whether parts of a message have frames of their own, as markers do.
    HAS_FRAMES: ClassVar[bool] = False
    EAGER: ClassVar[bool] = False
    #: QoS for further topics: the settings apply to the main topic only.
    FURTHER_QOS: ClassVar[QoS] = QoS(
        reliability=Reliability.BEST_AVAILABLE, durability=Durability.BEST_AVAILABLE
    )

    topic = Setting("Topic", "topic", "", "Topic to subscribe to.", then="_on_topic")
    depth = Setting(
        "Topic/Depth", "int", 5, "Messages kept until their transform is known.", min=1, max=1000,
        then="_schedule",
    )  # fmt: skip
    reliability = Setting(
        "Topic/Reliability Policy", "enum", BEST_AVAILABLE, "Reliability to request.",
        choices=list(_RELIABILITY), then="_schedule",
    )  # fmt: skip
    durability = Setting(
        "Topic/Durability Policy", "enum", BEST_AVAILABLE, "Durability to request.",
        choices=list(_DURABILITY), then="_schedule",
    )  # fmt: skip

    #: How many messages were received.
    received = ReadOnly(int, 0)

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._queue: MessageQueue | None = None
        self._waiting: deque[QueuedMessage] = deque()
        #: Whether the publisher or the connection of what is shown is gone.
        self._is_gone = False
        self._last: QueuedMessage | None = None
        #: The newest message, which may still wait for its transform.
        self._newest: QueuedMessage | None = None
        #: How many messages were dropped while they waited, and are missed.
        self._dropped = 0
        self._arrived = self._arrived_at = self._message_late = 0.0
        #: Seconds between the last messages.
        self._intervals = deque((0.0, 0.0), maxlen=2)
        super().__init__(parent, runtime)

    # -- files -----------------------------------------------------------------------------------

    def _load_topic(self, saved: Mapping[str, Any]) -> list[str]:
        refused, given = super()._load_topic(saved), read_topic(saved)
        self.reliability = given.reliability or self.reliability
        self.durability = given.durability or self.durability
        return refused

    def _saved_topic(self) -> TopicSetting:
        # What is ours alone, no RViz can read; without a policy, it is that again.
        reliability, durability = (
            "" if value == BEST_AVAILABLE else str(value)
            for value in (self.reliability, self.durability)
        )
        saved = super()._saved_topic()
        return saved._replace(reliability=reliability, durability=durability)

    # -- the subscription ------------------------------------------------------------------------

    def on_group_enabled(self) -> None:
        """Receive messages, or none any more, as it or its group is shown or hidden."""
        super().on_group_enabled()
        if not self.shown:
            self._close_endpoint()  # not later: messages of it may be on their way
            self.reset()  # they would be old when the display is shown again

    def shows_all(self) -> bool:
        """Return whether each message is shown, in order, and not only the newest."""
        return self.KEEPS_ALL

    def most_waiting(self) -> int:
        """Return how many messages may wait for their transforms; older ones are dropped.

        So are those beyond 256 MiB.
        """
        return MOST_WAITING if self.shows_all() else int(self.depth)

    def _is_loss(self) -> bool:
        """Return whether what is dropped while it waits would have been shown."""
        return self.shows_all() and self.most_waiting() == MOST_WAITING

    def _on_length(self) -> None:
        """Show more or fewer messages beside each other."""
        self._restyle()
        self._schedule()  # one that shows each receives more

    def profile(self) -> QoS:
        """Return the QoS to request."""
        return QoS(
            depth=MOST_WAITING if self.shows_all() else self.depth,
            reliability=_RELIABILITY[self.reliability],
            durability=_DURABILITY[self.durability],
        )

    def _wanted(self) -> tuple[Any, ...] | None:
        topic = self._find_topic()
        return (self.node, (topic, *self.further_topics(topic)), self.profile()) if topic else None

    def further_topics(self, topic: str) -> tuple[str, ...]:  # noqa: ARG002 - for subclasses
        """Return topics that are received beside `topic`, e.g. of updates."""
        return ()

    def _resolve_further(self, path: str, topic: str) -> tuple[str, ...]:
        """Return the absolute name of a topic; nothing, and an error status, if it is invalid.

        Args:
            path: The setting that names it.
            topic: The name; empty for no topic.
        """
        found = self._resolve(topic)
        if topic and not found:
            self.set_status(path, "error", self._problem)
            return ()
        self._set_problem("")
        self.delete_status(path)
        return (found,) if found else ()

    def _factory(self, *wanted: Any) -> Callable[[], Any]:
        node, (topic, *others), qos = wanted
        profiles = {**dict.fromkeys(others, self.FURTHER_QOS.with_depth(qos.depth)), topic: qos}
        queue = self._queue = MessageQueue(
            self.preparer(),
            self.MESSAGES,
            self._executor,
            weak_callback(self._on_items),
            MOST_WAITING if self.shows_all() else max(self.depth, 1),
            self.EAGER,
            needs_frame=not self.HAS_FRAMES,
        )
        return lambda: Subscriptions(node, profiles, queue)

    def _on_created(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        self._begin_to_wait()

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        self._queue = None
        self._waiting.clear()

    def _on_create_failed(self, error: Error) -> None:
        self.set_status("Topic", "error", str(error))
        super()._on_create_failed(error)

    def _recheck_outdated(self) -> None:
        # The publisher that latched the message still exists and would have sent a newer one.
        queue, node, session = self._queue, self.node, self._session
        if queue is None or not queue.received or node is None or session is None:
            return
        if session.state != "connected":
            return
        if self._is_latched():
            self._outdated = False
            self._show_age()

    def _is_latched(self) -> bool:
        """Return whether the publisher of the last message keeps it for later subscribers."""
        queue, node = self._queue, self.node
        if queue is None or node is None:
            return False
        try:
            publishers = node.publishers(self._resolved)
        except Error:
            return False
        known = any(one.gid for one in publishers)
        return any(
            one.qos.durability is Durability.TRANSIENT_LOCAL
            and (one.gid == queue.publisher or not known)
            for one in publishers
        )

    def _outdated_after_s(self) -> float:
        """Return after how many seconds without a message the last one is out of date."""
        if not self.IS_CONTINUOUS or self._is_latched():
            return math.inf
        # Maps are sent as clouds as well, every few seconds.
        return max(_CONTINUOUS_S, 2 * min(self._intervals))

    def _seconds_without_message(self) -> float:
        seconds, scene = self._steady() - self._arrived_at, self.scene
        return seconds if scene is None else min(seconds, scene.seconds_running())

    def _update_stale(self) -> None:
        super()._update_stale()
        self._show_age()

    def _is_old(self) -> bool:
        return self._last is None

    def _show_age(self) -> None:
        """Fade data that is out of date, and say so."""
        reason = ""
        if self._last is not None and self.enabled:
            seconds = self._seconds_without_message()
            if self._outdated:
                reason = "its publisher is gone"
            elif seconds > _CONTINUOUS_S and seconds > self._outdated_after_s():
                reason = f"no message for {seconds:.0f} s that could be shown"
            elif self._message_late + seconds > max(_CONTINUOUS_S, self._outdated_after_s()):
                reason = f"the newest message was {self._message_late:.0f} s late"
            elif self._is_late():
                reason = "the transform of the newest message is not known"
        self._is_gone = bool(reason)
        self._fade()
        if reason:
            when = time.strftime("%H:%M:%S", time.localtime(self._arrived))
            self.set_status("Data", "warn", f"{reason}; the last message is of {when}")
        else:
            self.delete_status("Data")

    def _is_late(self) -> bool:
        """Return whether the newest message has waited for its transform for long."""
        newest, scene = self._newest, self.scene
        if scene is None or newest is None or not self._waiting or self._waiting[-1] is not newest:
            return False
        # While a simulation or recording is paused, nothing is late.
        # What is stamped ahead, by a clock that has jumped, waits in vain as well.
        age_s = abs(scene.now() - newest.stamp) * 1e-9 if newest.stamp else math.inf
        return min(age_s, time.monotonic() - self._placed_at) > LATE_S

    def check_frames(self) -> None:
        """Report why nothing is received or shown, and try again to place late messages."""
        self._report_waiting()
        if self.shown and self._is_late():
            self._show_waiting()
        super().check_frames()

    def _fade(self) -> None:
        faded = self._is_gone or self._outdated_frames
        self.root.alpha = OUTDATED_ALPHA if faded else 1.0

    # -- messages --------------------------------------------------------------------------------

    def preparer(self) -> Callable[[Message], Any]:
        """Return a function that decodes a message, for the node's thread.

        It must not refer to the display, only to values of its settings. It returns None where
        there is nothing to show yet. The attribute `source` of what it returns, if there is one, is
        the message whose frame and time count.
        """
        return lambda message: message

    def _renew_preparer(self) -> None:
        """Decode further messages with changed settings, or for another renderer."""
        if self._queue is not None:
            self._queue.prepare = self.preparer()

    def _on_items(self) -> None:
        if not is_alive(self):  # it has no attributes then
            return
        queue = self._queue
        if queue is None or self.scene is None:
            return
        items, error = queue.drain()
        report(self, received=queue.received)
        if error:
            self.set_status("Message", "error", error)
        elif items:
            self.delete_status("Message")
        if items or error:
            self.set_status("Topic", "ok", f"{queue.received} messages received")
        if not items:
            return
        now = self._steady()
        self._intervals.append(now - self._arrived_at)
        self._arrived, self._arrived_at, self._message_late = time.time(), now, queue.late
        self._newest = items[-1]
        self._judge_publisher(queue.publisher)
        self._waiting.extend(items)
        self._show_waiting()
        self._drop_oldest(queue)

    def _drop_oldest(self, queue: MessageQueue) -> None:
        """Drop messages that wait beside newer ones, and report it if that matters."""
        most, before = self.most_waiting(), len(self._waiting)
        count = drop_oldest(self._waiting, most, size_of)
        if self._is_loss() or (self.shows_all() and before <= most):
            self._dropped += count
        dropped = []
        if queue.dropped and self.shows_all():
            dropped.append(f"{queue.dropped} that came faster than they can be shown")
        if self._dropped:
            limit = f"{most}, or {MAX_WAITING_BYTES >> 20} MiB,"
            dropped.append(f"{self._dropped} while more than {limit} waited for their transforms")
        if dropped:
            self.set_status("Dropped messages", "warn", "; ".join(dropped))

    def _show_waiting(self) -> None:
        """Show waiting messages whose transforms are known now."""
        if not self.shows_all():
            # The newest that can be placed; older ones are of no use then.
            for at in range(len(self._waiting) - 1, -1, -1):
                pose = self._place(self._waiting[at])
                if pose is not None:
                    item = self._waiting[at]
                    for _ in range(at + 1):
                        self._waiting.popleft()
                    self._show(item, pose)
                    return
            return
        self._show_all_waiting()

    def _show_all_waiting(self) -> None:
        waiting = list(self._waiting)
        poses: dict[int, NDArray[np.float64]] = {}
        # Lookups that fail take their time; those at one end may fail for ever.
        for order in (range(len(waiting)), range(len(waiting) - 1, -1, -1)):
            misses = 0
            for at in order:
                if at in poses or misses >= _MOST_MISSES:
                    break
                pose = self._place(waiting[at])
                if pose is None:
                    misses += 1
                else:
                    poses[at] = pose
        self._waiting = deque(item for at, item in enumerate(waiting) if at not in poses)
        for at in sorted(poses):
            self._show(waiting[at], poses[at])

    def _place(self, item: QueuedMessage) -> NDArray[np.float64] | None:
        """Return the pose of a message's frame at its time; None while it is not known."""
        return self.place_of(item.frame, item.stamp)

    def _show(self, item: QueuedMessage, pose: NDArray[np.float64]) -> None:
        self._last = item
        self.root.visible = self.enabled
        try:
            self.show(item.data, pose, item.frame, item.stamp)
        except Error as error:
            self.set_status("Message", "error", str(error))
        except Exception as error:  # messages of robots never end the event loop
            _log.exception("%s", self.label)
            self.set_status("Message", "error", f"this message could not be shown: {error!r}")
        self._show_age()

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:
        """Show a message.

        Args:
            data: The result of :meth:`preparer`.
            pose: Pose of its frame in the fixed frame, at its time.
            frame: Its frame.
            stamp: Its time in nanoseconds; 0 for the newest.

        Raises:
            Error: It cannot be shown; the text becomes the status.
        """
        raise NotImplementedError

    def on_transforms(self) -> None:
        """Show messages that waited for transforms or were hidden by another fixed frame."""
        if self.enabled and not self.root.visible:
            self._place_last()
        if self._waiting:
            self._show_waiting()

    def on_fixed_frame(self) -> None:
        """Show the last message in the new fixed frame; where earlier ones are is not known."""
        if self.shows_all():
            last, waiting = self._last, list(self._waiting)
            newest = self._newest
            self.reset()
            self._last, self._newest = last, newest
            self._waiting.extend(waiting)
        self._place_last()
        self._show_waiting()

    def _place_last(self) -> None:
        """Show the last message in this fixed frame; hide it while its frame is not known there."""
        last = self._last
        if last is None:
            return
        pose = self._place(last)
        if pose is None:
            # At its time it is not known any more: rather the newest than a wrong place.
            pose = self.place_of(last.frame, 0)
        self.root.visible = self.enabled and pose is not None
        if pose is not None:
            self._show(last, pose)

    def reset(self) -> None:
        """Drop all messages."""
        self._waiting.clear()
        self._last = self._newest = None
        self._dropped = 0
        self.delete_status("Dropped messages")
        self.root.clear()


class _Kept(NamedTuple):
    """A message that is shown.

    Attributes:
        data: The data read from it.
        pose: Pose of its frame in the fixed frame.
        group: Its drawables.
    """

    data: Any
    pose: NDArray[np.float64]
    group: Group


class HistoryDisplay(TopicDisplay):
    """A display of the last messages, each drawn on its own.

    Attributes:
        LENGTH: The setting of how many are shown; empty for the newest one alone.
    """

    LENGTH: ClassVar[str] = ""

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._kept: deque[_Kept] = deque()
        super().__init__(parent, runtime)

    def length(self) -> int:
        """Return how many messages are shown."""
        return int(self.get(self.LENGTH)) if self.LENGTH else 1

    def shows_all(self) -> bool:
        """Return whether earlier messages are shown as well."""
        return self.length() > 1

    def most_waiting(self) -> int:
        """Return how many messages may wait: no more than are shown."""
        return max(int(self.depth), min(self.length(), MOST_WAITING))

    def draw(self, data: Any, group: Group) -> None:
        """Fill a group with what a message shows, in its frame."""
        raise NotImplementedError

    def show(self, data: Any, pose: NDArray[np.float64], frame: str, stamp: int) -> None:  # noqa: ARG002
        """Show a message beside earlier ones."""
        group = Group()
        group.pose = pose
        self._kept.append(_Kept(data, pose, group))
        self.root.add(group)
        self.draw(data, group)
        self._drop_old()

    def _drop_old(self) -> None:
        length = self.length()
        while len(self._kept) > min(length, _MAX_HISTORY):
            self._kept.popleft().group.remove()
        if len(self._kept) == _MAX_HISTORY < length:
            self.set_status(self.LENGTH, "warn", f"only the latest {_MAX_HISTORY} are shown")
        else:
            self.delete_status(self.LENGTH)

    def _restyle(self) -> None:
        self._drop_old()
        for kept in self._kept:
            kept.group.clear()
            self.draw(kept.data, kept.group)

    def reset(self) -> None:
        """Drop all messages."""
        super().reset()
        self._kept.clear()
        self._drop_old()
