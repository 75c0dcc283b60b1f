"""The messages of a display or map on their way from a worker thread to the GUI thread."""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from rosglass.errors import Error
from rosglass.interfaces.names import ros1_name

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.handle import Executor
    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.comm.qos import QoS
    from rosglass.messages import Message

__all__ = [
    "MAX_WAITING_BYTES",
    "MOST_WAITING",
    "MessageQueue",
    "QueuedMessage",
    "Subscriptions",
    "drop_oldest",
    "frame_and_stamp",
    "size_of",
]

_log = logging.getLogger("rosglass.qml")
_T = TypeVar("_T")

#: Messages that wait for the GUI thread or their transforms, of displays that show each.
MOST_WAITING = 1000
#: Bytes of what waits there: 1000 clouds may be 10 GB. The newest one waits in any case.
MAX_WAITING_BYTES = 256 << 20


def frame_and_stamp(message: Message) -> tuple[str, int]:
    """Return the frame and the time in nanoseconds of a message's header; without one "", 0."""
    if "header" not in message:
        return "", 0
    header = message.header
    stamp = header.stamp
    old = "secs" in stamp
    seconds, rest = (stamp.secs, stamp.nsecs) if old else (stamp.sec, stamp.nanosec)
    return header.frame_id.lstrip("/"), seconds * 1_000_000_000 + rest


class QueuedMessage(NamedTuple):
    """A message on its way to the screen.

    Attributes:
        data: The result of :meth:`TopicDisplay.preparer`.
        frame: Its frame.
        stamp: Its time in nanoseconds; 0 for the newest.
        size: Bytes of it as it was received.
    """

    data: Any
    frame: str
    stamp: int
    size: int = 0


def drop_oldest(waiting: deque[_T], most: int, size_of: Callable[[_T], int]) -> int:
    """Drop the oldest of what waits beyond a number, or beyond 256 MiB, but never the newest.

    Args:
        waiting: The newest at the end.
        most: How many may wait.
        size_of: Returns the bytes of one.

    Returns:
        How many were dropped.
    """
    dropped, size = 0, sum(map(size_of, waiting))
    while len(waiting) > most or (len(waiting) > 1 and size > MAX_WAITING_BYTES):
        size -= size_of(waiting.popleft())
        dropped += 1
    return dropped


def size_of(item: QueuedMessage) -> int:
    """Return the bytes of a message as it was received."""
    return item.size


class MessageQueue:
    """Decodes messages in the node's thread, and hands them to the GUI thread.

    Args:
        prepare: Turns a message into what is shown; knows nothing of the display itself.
        types: Names of the types that it accepts.
        executor: Executor of the GUI thread.
        on_ready: Called there when messages have arrived.
        depth: How many wait there at most; older ones, and those beyond 256 MiB, are dropped and
            counted.
        eager: Whether all fields are decoded at once.
        needs_frame: Whether a message whose header names no frame is refused.
    """

    def __init__(
        self,
        prepare: Callable[[Message], Any],
        types: tuple[str, ...],
        executor: Executor,
        on_ready: Callable[[], None],
        depth: int,
        eager: bool = False,
        needs_frame: bool = False,
    ) -> None:
        self.prepare, self._types, self._eager = prepare, types, eager
        self._needs_frame = needs_frame
        self._executor, self._on_ready = executor, on_ready
        self._lock = threading.Lock()
        self._depth = depth
        self._items: deque[QueuedMessage] = deque()
        self._error = ""
        #: Whether the GUI thread is about to drain it: however much a robot sends, one job waits.
        self._is_posted = False
        self.received = self.dropped = 0
        #: Identity of the publisher of the last message; empty if the wire has none.
        self.publisher = b""
        #: Seconds by which the last message was delayed on its way.
        self.late = 0.0

    def receive(self, sample: Sample, late: float = 0.0) -> None:
        """Decode and queue a sample that was delayed by `late` seconds, in the node's thread."""

        def decode() -> Message:
            name = sample.type.name
            if self._types and ros1_name(name) not in self._types:
                raise Error(f"the topic's type is {name}, not {' or '.join(self._types)}")
            if self._eager:
                return sample.type.decode_all(sample.data, wire=sample.wire)
            return sample.message()

        self.publisher, self.late = sample.publisher, late
        self.put(decode, sample.type.name, len(sample.data))

    def put(self, decode: Callable[[], Message], what: str, size: int = 0) -> None:
        """Decode and queue a message, in the node's thread.

        Args:
            decode: Returns it.
            what: The name of its type.
            size: Its bytes.
        """
        item, error = None, ""
        try:
            message = decode()
            data = self.prepare(message)
            if data is not None:
                whole = getattr(data, "source", None)
                whole = message if whole is None else whole
                item = QueuedMessage(data, *frame_and_stamp(whole), size)
                if self._needs_frame and not item.frame and "header" in whole:
                    item = None
                    raise Error("header.frame_id is empty: the publisher has to name the frame")
        except Error as reason:
            error = str(reason)
        except Exception as reason:  # noqa: BLE001 - what peers send never ends the thread
            _log.exception("a %s", what)
            error = f"this message could not be shown: {reason!r}"
        with self._lock:
            is_posted, self._is_posted = self._is_posted, True
            self.received += 1
            self._error = error
            if item is not None:
                if getattr(item.data, "replaces_all", False):
                    self._items.clear()
                self._items.append(item)
                self.dropped += drop_oldest(self._items, self._depth, size_of)
        if not is_posted:
            self._executor.post(self._on_ready)

    def drain(self) -> tuple[list[QueuedMessage], str]:
        """Return and forget what has arrived, and why the last message could not be used."""
        with self._lock:
            items, error = list(self._items), self._error
            self._items.clear()
            self._error, self._is_posted = "", False
        return items, error


class Subscriptions:
    """The subscriptions of a display, all of which feed the same queue.

    Args:
        node: The node.
        profiles: Requested QoS, by the absolute name of the topic.
        queue: Receives all messages.
        worker: Decodes them; None for the node's own thread.

    Raises:
        Error: One of them could not be made.
    """

    def __init__(
        self,
        node: Node,
        profiles: Mapping[str, QoS],
        queue: MessageQueue,
        worker: Executor | None = None,
    ) -> None:
        self._open: list[Any] = []
        self._worker = worker
        try:
            for topic, qos in profiles.items():
                self._open.append(self._subscribe(node, topic, qos, queue))
        except Error:
            self.close()
            raise

    def _subscribe(self, node: Node, topic: str, qos: QoS, queue: MessageQueue) -> Any:
        made: list[Any] = []

        def on_sample(sample: Sample) -> None:
            # The first may arrive before the subscription is returned.
            queue.receive(sample, made[0].lateness(sample).seconds if made else 0.0)

        made.append(
            node.create_subscription(
                topic, None, qos=qos, raw_callback=on_sample, executor=self._worker
            )
        )
        return made[0]

    @property
    def problem(self) -> str:
        """Why messages cannot be received, e.g. by their publishers' policies; empty otherwise."""
        return "; ".join(filter(None, (one.problem for one in list(self._open))))

    @property
    def hint(self) -> str:
        """Possible reasons for missing messages, e.g. earlier ones are kept but not requested."""
        return "; ".join(filter(None, (one.hint for one in list(self._open))))

    def close(self) -> None:
        """Close them; safe to call twice."""
        while self._open:
            self._open.pop().close()
