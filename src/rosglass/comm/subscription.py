"""Receiving: samples, the inbox that keeps the newest of them, and the subscription around it."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.node import Executor, Handle
from rosglass.comm.qos import History, QoS
from rosglass.comm.time import Duration, Time
from rosglass.errors import ConversionError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages import Message, MessageType

__all__ = ["Sample", "Statistics", "Subscription"]

_log = logging.getLogger("rosglass.comm")
_WINDOW = 30


class Sample(NamedTuple):
    """A received message before anyone looked into it; made in a fifth of a dataclass's time.

    Attributes:
        data: The bytes as received, encapsulation header included; big ones may come as a
            read-only view of the middleware's own buffer.
        wire: Their format, ``cdr`` or ``ros1``.
        type: Their type.
        received: System time of reception.
        sent: Time the publisher stamped it with, None when the world does not say.
        publisher: Identity of the publisher, empty when the world does not say.
        sequence: The publisher's running number, -1 when the world does not say.
    """

    data: bytes | memoryview
    wire: str
    type: MessageType
    received: Time
    sent: Time | None = None
    publisher: bytes = b""
    sequence: int = -1

    def message(self) -> Message:
        """Return the message; fields are decoded when they are read."""
        return self.type.decode(self.data, wire=self.wire)


@dataclass(frozen=True, slots=True)
class Statistics:
    """How a subscription is doing.

    Attributes:
        received: Samples received since creation.
        dropped: Samples thrown out of a full inbox before anyone took them.
        frequency: Samples per second over the last 30, falling to 0 when they stop.
        bandwidth: Bytes per second over the same samples.
        age: Time since the last sample, None before the first.
    """

    received: int
    dropped: int
    frequency: float
    bandwidth: float
    age: Duration | None


class Subscription(Handle):
    """Receives the messages of one topic.

    Worlds create it, call :meth:`deliver` from their threads, and set `on_close`. Once closed, it
    has nothing more to take: :attr:`closed` tells a polling loop when to end.

    Attributes:
        topic: Absolute topic name.
        qos: The quality of service requested.
        on_close: Called once when it is closed; for worlds.
    """

    def __init__(
        self,
        topic: str,
        message_type: MessageType | None,
        qos: QoS,
        executor: Executor,
        callback: Callable[[Message], None] | None = None,
        raw_callback: Callable[[Sample], None] | None = None,
        on_close: Callable[[], None] | None = None,
    ) -> None:
        for name, given in (("callback", callback), ("raw_callback", raw_callback)):
            if given is not None and not callable(given):
                raise ConversionError(name, given, "something that can be called", topic)
        if not isinstance(executor, Executor):
            raise ConversionError("executor", executor, "a rosglass.comm.Executor", topic)
        self.topic = topic
        self.qos = qos
        self._type = message_type
        self._executor = executor
        self._callback, self._raw_callback = callback, raw_callback
        self.on_close = on_close
        limit = None if qos.history is History.KEEP_ALL else qos.depth
        self._inbox: deque[Sample] = deque(maxlen=limit)
        self._changed = threading.Condition()
        self._scheduled = False
        self._closed = False
        self._received = self._dropped = 0
        self._recent: deque[tuple[float, int]] = deque(maxlen=_WINDOW)
        self._problem = ""

    @property
    def type(self) -> MessageType | None:
        """The message type; None while it is not discovered yet."""
        return self._type

    @property
    def problem(self) -> str:
        """Why nothing can be received, in words; empty when all is well."""
        return self._problem

    @property
    def closed(self) -> bool:
        """Whether :meth:`close` was called."""
        return self._closed

    def __repr__(self) -> str:
        kind = self._type.name if self._type is not None else "type not known yet"
        return f"<{type(self).__name__} {self.topic} [{kind}]{' closed' * self._closed}>"

    def set_type(self, message_type: MessageType) -> None:
        """Take the type that was discovered; for worlds."""
        self._type = message_type

    def set_problem(self, problem: str) -> None:
        """Say why nothing can be received; for worlds. Logged once for each new problem."""
        if problem and problem != self._problem:
            _log.warning("%s: %s", self.topic, problem)
        self._problem = problem

    def deliver(self, sample: Sample) -> None:
        """Put a sample into the inbox and wake the consumer; for worlds, from any thread."""
        with self._changed:
            if self._closed:
                return
            if len(self._inbox) == self._inbox.maxlen:
                self._dropped += 1
            self._inbox.append(sample)
            self._received += 1
            self._recent.append((time.monotonic(), len(sample.data)))
            wake = not self._scheduled and bool(self._callback or self._raw_callback)
            self._scheduled = self._scheduled or wake
            self._changed.notify_all()
        if wake:
            self._executor.post(self._drain)

    def take(self) -> Sample | None:
        """Return the oldest waiting sample, or None."""
        with self._changed:
            return self._inbox.popleft() if self._inbox else None

    def take_latest(self) -> Sample | None:
        """Return the newest waiting sample and forget the older ones (they count as dropped)."""
        with self._changed:
            if not self._inbox:
                return None
            sample = self._inbox.pop()
            self._dropped += len(self._inbox)
            self._inbox.clear()
            return sample

    def wait(self, timeout: float) -> Sample | None:
        """Return the oldest waiting sample, waiting up to `timeout` seconds for one."""
        with self._changed:
            self._changed.wait_for(lambda: self._inbox or self._closed, timeout)
            return self._inbox.popleft() if self._inbox else None

    def statistics(self) -> Statistics:
        """Return counts and rates as of now."""
        now = time.monotonic()
        with self._changed:
            recent = list(self._recent)
            received, dropped = self._received, self._dropped
        age = now - recent[-1][0] if recent else 0.0
        frequency = bandwidth = 0.0
        if len(recent) > 1:
            period = (recent[-1][0] - recent[0][0]) / (len(recent) - 1)
            # Once the next sample is overdue, let the figures fall instead of showing a dead rate.
            span = recent[-1][0] - recent[0][0] + max(0.0, age - 1.5 * period)
            if span > 0:
                frequency = (len(recent) - 1) / span
                bandwidth = sum(size for _, size in recent[1:]) / span
        return Statistics(
            received,
            dropped,
            frequency,
            bandwidth,
            Duration.from_seconds(age) if recent else None,
        )

    def close(self) -> None:
        """Stop receiving; waiting samples are forgotten. Safe to call twice, from any thread."""
        with self._changed:
            if self._closed:
                return
            self._closed = True
            self._inbox.clear()
            self._changed.notify_all()
        if self.on_close is not None:
            self.on_close()

    def _drain(self) -> None:
        with self._changed:
            # Only what waits now: a fast topic must not keep a shared executor for itself.
            batch = list(self._inbox)
            self._inbox.clear()
        for sample in batch:
            if self._closed:
                break
            try:
                if self._raw_callback is not None:
                    self._raw_callback(sample)
                elif self._callback is not None:
                    self._callback(sample.message())
            except Exception:
                _log.exception("callback of subscription %s failed", self.topic)
        with self._changed:
            self._scheduled = bool(self._inbox) and not self._closed
            again = self._scheduled
        if again:
            self._executor.post(self._drain)
