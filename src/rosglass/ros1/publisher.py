"""Publishing on a ROS 1 topic."""

from __future__ import annotations

import logging
import struct
import threading
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    DeadlineMissed,
    Durability,
    Matched,
    Publisher,
    PublisherEvents,
    Sample,
)
from rosglass.comm.watchdog import Watchdog
from rosglass.errors import ConversionError, NodeClosedError, TypeNotFoundError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, QoS
    from rosglass.messages import Message, MessageType
    from rosglass.ros1.core import Core
    from rosglass.ros1.publication import Publication

    Buffer = bytes | bytearray | memoryview

__all__ = ["Ros1Publisher"]

_log = logging.getLogger("rosglass.ros1")
#: Messages above this size in bytes are handed on in parts, so that arrays in them are not copied.
_BIG = 64 * 1024
#: Longest message in bytes that anybody takes.
_MOST = 1_000_000_000
_HEADER = "std_msgs/msg/Header"
_number = struct.Struct("<I")
#: Tells `publish()` from `publish(None)`.
_NO_MESSAGE: Any = object()


class Ros1Publisher(Publisher):
    """A publisher; made by :meth:`Node.create_publisher`.

    Args:
        core: The node.
        publication: The node's registration of the topic.
        type: What it publishes.
        qos: Transient local means latched; the depth is the queue of each slow subscriber.
        on_close: Called once when it is closed.

    Attributes:
        publication: As given.
        latched: Whether whoever comes later gets the last message.

    Raises:
        TypeNotFoundError: The type is opaque, and comes without md5 sum.
    """

    def __init__(
        self,
        core: Core,
        publication: Publication,
        type: MessageType,
        qos: QoS,
        on_close: Callable[[Ros1Publisher], None],
    ) -> None:
        if not type.md5:
            raise TypeNotFoundError(
                f"{publication.topic} cannot be published as {type.name} without definition or md5 "
                "sum: subscribers could not tell whether they understand it; give the type of a "
                "received sample, or OpaqueType(name, md5, ros=1)"
            )
        self.topic, self.type = publication.topic, type
        self.qos = qos.for_publisher([])
        self.latched = self.qos.durability is Durability.TRANSIENT_LOCAL
        self.publication = publication
        self._core, self._on_close = core, on_close
        self._lock = threading.Lock()
        self._closed = False
        self._big = False
        self._numbered = _has_header(type)
        self._problem = ""
        self._sent_at = 0.0
        self._missed = 0
        self._deadline: Watchdog | None = None
        self.events: PublisherEvents = PublisherEvents(core.dispatcher, core.wake, self.topic)

    # -- sending ---------------------------------------------------------------------------------

    def publish(self, message: Message | dict[str, Any] = _NO_MESSAGE, /, **fields: Any) -> None:
        """Encode and send a message; see :meth:`rosglass.comm.Publisher.publish`.

        As with rospy and roscpp, ``header.seq`` of what is sent is the running number of the node's
        messages on the topic, from 1 on, if the message begins with a header.
        """
        if message is not _NO_MESSAGE and fields:
            raise ConversionError(
                "", fields, "either a message or keyword fields, not both", self.type.name
            )
        self._check_open()
        if message is None:
            # Most likely a function that forgot its return: it must not become a zero command.
            raise ConversionError("", None, "a message, a dict or keyword fields", self.type.name)
        value = fields if message is _NO_MESSAGE else message
        if self._big:
            parts: Sequence[Buffer] = self.type.encode_parts(value, wire="ros1")
        else:
            payload = self.type.encode(value, wire="ros1")
            self._big = len(payload) > _BIG
            parts = (payload,)
        if self._numbered:
            number = _number.pack(next(self.publication.numbers) & 0xFFFFFFFF)
            parts = (number, memoryview(parts[0])[_number.size :], *parts[1:])
        self._send(parts)

    def publish_serialized(self, data: bytes | bytearray | memoryview | Sample) -> None:
        """Send `data` unchanged; see :meth:`rosglass.comm.Publisher.publish_serialized`."""
        self._check_open()
        if isinstance(data, Sample):
            data = self._content(data)
        elif not isinstance(data, (bytes, bytearray, memoryview)):
            raise ConversionError(
                "", data, "bytes, a bytearray, a memoryview or a Sample", self.type.name
            )
        self._send((data if type(data) is bytes else _octets(data),))

    def _content(self, sample: Sample) -> bytes | memoryview:
        """Return the bytes of a sample that can be passed on here."""
        kind, ours = sample.type, self.type
        if sample.wire != "ros1":
            raise ConversionError("wire", sample.wire, "a sample as ros1", self.topic)
        if kind.name != ours.name:
            raise ConversionError("type", kind.name, f"a sample of {ours.name}", self.topic)
        if kind.md5 and kind.md5 != ours.md5:
            expected = f"a sample of {ours.name} with our definition, md5 {ours.md5}"
            raise ConversionError("md5 sum", kind.md5, expected, self.topic)
        return sample.data

    def _send(self, parts: Sequence[Buffer]) -> None:
        size = sum(map(len, parts))
        if size > _MOST:
            expected = f"at most {_MOST} bytes, as ROS 1 takes no larger message"
            raise ConversionError("", f"{size} bytes", expected, self.topic)
        self.publication.send(self, parts)
        if self.qos.deadline is not None:
            first, self._sent_at = not self._sent_at, time.monotonic()
            if first:
                self._core.wake()

    # -- who is there ----------------------------------------------------------------------------

    def subscription_count(self) -> int:
        """Return how many subscribers are connected; 0 after closing."""
        return 0 if self._closed else len(self.publication.links())

    @property
    def dropped(self) -> int:
        """How many messages on the topic made room for newer ones because a subscriber is slow."""
        return self.publication.lost()

    @property
    def problem(self) -> str:
        """Why some subscribers get nothing, or not all, in words; empty when all is well."""
        return self._problem

    @property
    def hint(self) -> str:
        """What may be wrong when nobody subscribes to the topic; empty when somebody does."""
        return "" if self._closed else self.publication.hint()

    def follow(self, connected: Sequence[EndpointInfo], problem: str) -> None:
        """Tell the listeners who is connected, and what is wrong; on the node's own thread."""
        if self._closed:
            return
        self.events.matched.update(connected, Matched)
        if problem != self._problem:
            self._problem = problem
            if problem:
                _log.warning("%s: %s", self.topic, problem)
            self.events.problem.notify(problem)
        limit = self.qos.deadline
        if limit is None or not self._sent_at or not self.events.deadline:
            return
        with self._lock:
            if self._deadline is None and not self._closed:
                timers = self._core.timers
                self._deadline = Watchdog(timers, limit, lambda: self._sent_at, self._miss)

    def close(self) -> None:
        """Publish no more; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            deadline, self._deadline = self._deadline, None
        if deadline is not None:
            deadline.close()
        self.events.clear()
        if not self._core.forked:
            self._on_close(self)

    def _miss(self, count: int) -> None:
        self._missed += count
        self.events.deadline.notify(DeadlineMissed(count, self._missed))

    def _check_open(self) -> None:
        if self._core.forked:
            raise NodeClosedError(
                f"the publisher of {self.topic} belongs to the process that made it, and does not "
                "work after a fork; connect again in this process"
            )
        if self._closed:
            raise NodeClosedError(f"the publisher of {self.topic} is closed; create another one")


def _has_header(type: MessageType) -> bool:
    """Return whether messages begin with a header, of which publishers set the number."""
    from rosglass.messages import OpaqueType  # noqa: PLC0415 - numpy

    if isinstance(type, OpaqueType):
        return False
    fields = type.definition.fields
    return bool(fields) and (fields[0].name, str(fields[0].type)) == ("header", _HEADER)


def _octets(data: bytes | bytearray | memoryview) -> bytes | memoryview:
    """Return a buffer as a view of its bytes, or as bytes when that cannot be had."""
    view = memoryview(data)
    try:
        return view.cast("B")
    except (TypeError, ValueError):  # not contiguous, or of a foreign format
        return view.tobytes()
