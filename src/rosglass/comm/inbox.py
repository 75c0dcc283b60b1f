"""Received samples: those repeated are dropped, the others kept and counted until they are taken.

All of it runs for each sample of the fastest topics, and is therefore written for speed.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from contextlib import suppress
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.executor import IMMEDIATE, RetryingExecutor
from rosglass.comm.handle import reraise_exit
from rosglass.comm.log_limits import FailureLog
from rosglass.comm.qos import History
from rosglass.comm.statistics import (
    LatencyEstimator,
    StampMonitor,
    Statistics,
    fading_rate,
    header_stamp,
)
from rosglass.comm.time import Duration, Time
from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from collections.abc import Set as AbstractSet

    from rosglass.comm.handle import Executor
    from rosglass.comm.qos import QoS
    from rosglass.comm.wire import OnSample
    from rosglass.messages import Message, MessageType

__all__ = ["INBOX_LIMIT", "DuplicateFilter", "ImmediateInbox", "Inbox", "Sample", "sample_receiver"]

_log = logging.getLogger("rosglass.comm")
#: Default limit of a keep-all inbox in bytes.
INBOX_LIMIT = 256 * 1024 * 1024
#: Approximate memory of a waiting sample in addition to its data, in bytes.
_SAMPLE_OVERHEAD_BYTES = 500
#: Shortest time between two log lines about a consumer that is too slow.
_LOG_PERIOD_S = 10.0
#: Maximum number of samples taken out for a callback at once.
_MAX_BATCH = 256
#: Time after which a callback yields its executor to other jobs.
_MAX_TURN_S = 0.01
#: Rates are measured between at most this many marks ...
_MAX_MARKS = 30
#: ... which are at least this long apart.
_MARK_PERIOD_S = 1 / 30
#: Number of publishers to remember; only a robot that restarts for days has more.
_MAX_PUBLISHERS = 1024
#: Missing sequence numbers to remember per publisher.
_MAX_MISSING = 64
#: Number and time stamp of the last sample of an unknown publisher.
_NO_SAMPLE = (-3, 0)

_data, _type = itemgetter(0), itemgetter(2)


class Sample(NamedTuple):
    """A received message in its wire format, not decoded yet.

    A tuple with plain numbers for time stamps, as one is made for each message of the fastest
    topics.

    Attributes:
        data: The bytes as received, encapsulation header included; large payloads may be a
            read-only view of the middleware's own buffer.
        wire: Their format, ``cdr`` or ``ros1``.
        type: Their type; an :class:`OpaqueType` if no definition is available.
        received_ns: System time of reception, nanoseconds since the Unix epoch; up to a tenth of a
            second late in subscriptions that receive in batches.
        sent_ns: The publisher's time stamp by the publisher's clock; None if the wire carries none.
        publisher: Identity of the publisher; empty if the wire carries none.
        sequence: The publisher's sequence number; -1 if the wire carries none.
    """

    data: bytes | memoryview
    wire: str
    type: MessageType
    received_ns: int
    sent_ns: int | None = None
    publisher: bytes = b""
    sequence: int = -1

    @property
    def received(self) -> Time:
        """:attr:`received_ns` as a Time."""
        return Time(self.received_ns)

    @property
    def sent(self) -> Time | None:
        """:attr:`sent_ns` as a Time; None if the wire carries no time stamp."""
        return None if self.sent_ns is None else Time(self.sent_ns)

    def __reduce__(self) -> tuple[Any, ...]:
        return Sample, (bytes(self.data), *self[1:])

    def message(self) -> Message:
        """Return the message; its fields are decoded when they are read.

        Raises:
            DecodeError: The bytes are not a message of the type.
            TypeNotFoundError: The type is opaque; the message gives the reason.
        """
        return self.type.decode(self.data, wire=self.wire)


class DuplicateFilter:
    """Detects samples that were received before, by publisher, sequence number and time stamp.

    A sample can be received twice: over an old and a new route while links change, from a
    publisher's history after a reconnection, or under two keys if a publisher serves two
    distributions. Late samples that were not received before are not repeats. Several threads may
    use it: the worst effect of a race is that a repeat passes.

    Attributes:
        lost: The number of skipped sequence numbers so far.
        guarded: Whether samples without number are compared by their time stamps: only while a
            reader is replaced, whose last samples may be received again, as a publisher's clock may
            be set back.
    """

    def __init__(self) -> None:
        self.lost = 0
        self.guarded = False
        self._last: dict[bytes, tuple[int, int]] = {}
        self._missing: dict[bytes, set[int]] = {}

    def is_duplicate(self, gid: bytes, sequence: int, sent: int | None) -> bool:
        """Return whether a sample is a repeat, and record it.

        Samples without identity, number or time stamp are never repeats.
        """
        if sent is None or not gid:
            return False
        last = self._last.get(gid, _NO_SAMPLE)
        if sequence == last[0] + 1:
            self._last[gid] = (sequence, sent)
            return False
        return self._is_late_duplicate(gid, sequence, sent, last)

    def latest(self, gid: bytes) -> tuple[int, int]:
        """Return number and time stamp of a publisher's last sample."""
        return self._last.get(gid, _NO_SAMPLE)

    def _is_late_duplicate(
        self, gid: bytes, sequence: int, sent: int, last: tuple[int, int]
    ) -> bool:
        """Return whether a sample that does not directly follow the last one is a repeat."""
        if sequence < 0:
            repeated = self.guarded and sent <= last[1]
            if not repeated:
                self._remember(gid, -1, sent)
            return repeated
        if last[0] < 0:
            self._remember(gid, sequence, sent)
            return False
        if sequence > last[0]:
            self._record_gap(gid, last[0] + 1, sequence)
        elif sent <= last[1]:
            missing = self._missing.get(gid, set())
            if sequence not in missing:
                return True
            missing.discard(sequence)
            self.lost -= 1
            return False
        self._last[gid] = (sequence, sent)
        return False

    def _remember(self, gid: bytes, sequence: int, sent: int) -> None:
        if gid not in self._last and len(self._last) >= _MAX_PUBLISHERS:
            self._last.clear()
            self._missing.clear()
        self._last[gid] = (sequence, sent)

    def _record_gap(self, gid: bytes, first: int, end: int) -> None:
        self.lost += end - first
        missing = self._missing.setdefault(gid, set())
        missing.update(range(max(first, end - _MAX_MISSING), end))
        if len(missing) > 2 * _MAX_MISSING:
            self._missing[gid] = set(sorted(missing)[-_MAX_MISSING:])


def sample_receiver(
    deliver: Callable[[Sample], None],
    types: Mapping[str, MessageType],
    find_type: Callable[[str], MessageType | None],
    duplicates: DuplicateFilter,
    wire: str,
    ignored: AbstractSet[bytes],
) -> OnSample:
    """Return the function that a reader calls with each of its samples.

    Args:
        deliver: Takes each sample that is neither repeated nor ignored.
        types: The type for each hash that samples may have.
        find_type: Returns the type for another hash; None to drop the sample.
        duplicates: Detects repeated samples.
        wire: The format of the payloads.
        ignored: GIDs of publishers to ignore.
    """
    is_duplicate = duplicates.is_duplicate
    # As Sample(...) does, in half the time.
    make = tuple.__new__

    def receive(
        data: bytes | memoryview,
        received: int,
        sent: int | None,
        gid: bytes,
        sequence: int,
        hash: str,
    ) -> None:
        kind = types.get(hash) or find_type(hash)
        if kind is None or is_duplicate(gid, sequence, sent) or gid in ignored:
            return
        deliver(make(Sample, (data, wire, kind, received, sent, gid, sequence)))

    return receive


class Inbox:
    """Keeps the newest samples until they are taken, or passes them to a callback.

    With keep-last history it holds `qos.depth` samples, with keep-all as many as fit into a limit
    in bytes. When it is full, the oldest samples are dropped and counted.

    Args:
        topic: The topic's name, for log lines and errors.
        qos: The profile with history and depth.
        executor: Runs `call`.
        call: Called with each sample; None if samples are taken with :meth:`pop`.
        call_decoded: Called with messages in place of `call`, if that only decodes the samples:
            decoding many at once is faster.
    """

    def __init__(
        self,
        topic: str,
        qos: QoS,
        executor: Executor,
        call: Callable[[Sample], None] | None,
        call_decoded: Callable[[Message], None] | None = None,
    ) -> None:
        keep_all = qos.history is History.KEEP_ALL
        self._topic = topic
        self._executor = RetryingExecutor(executor, topic)
        self._call, self._call_decoded = call, call_decoded
        self._depth = -1 if keep_all else qos.depth
        self._limit: int | None = INBOX_LIMIT if keep_all else None
        self._samples: deque[Sample] = deque(maxlen=None if keep_all else qos.depth)
        #: Guards the samples with their counters, the waiters, and the two flags below.
        self._lock = threading.Lock()
        self._waiters: list[Callable[[], object]] = []
        self._calling = self._closed = False
        self._batch = 1
        self._held_bytes = self._received = self._received_bytes = self._dropped = 0
        #: Monotonic time at which the last sample arrived; minus infinity before the first.
        self.last_time = self._next_mark = self._next_log = -math.inf
        self._failures = FailureLog(_log)
        self._meter = _Meter()

    @property
    def closed(self) -> bool:
        """True once :meth:`close` was called."""
        return self._closed

    @property
    def waiting(self) -> int:
        """Number of waiting samples."""
        return len(self._samples)

    # -- arrival ---------------------------------------------------------------------------------

    def put(self, sample: Sample) -> None:
        """Add a sample, and notify its consumer; from any thread."""
        self._add((sample,), len(sample[0]))

    def put_many(self, given: list[Sample]) -> None:
        """Add samples that arrived together, at least one; from any thread."""
        self._add(given, sum(map(len, map(_data, given))))

    def _add(self, given: Sequence[Sample], size: int) -> None:
        """Add samples with `size` bytes in total."""
        waiters: Sequence[Callable[[], object]] = ()
        dropped = 0
        with self._lock:
            if self._closed:
                return
            count, samples = len(given), self._samples
            now = self._count(given[0], count, size)
            if self._limit is None:
                excess = len(samples) + count - self._depth
                if excess > 0:
                    self._dropped += excess
                samples.extend(given)
            else:
                samples.extend(given)
                self._held_bytes += size + count * _SAMPLE_OVERHEAD_BYTES
                dropped = self._enforce_limit(self._limit, now)
            if self._waiters:
                waiters, self._waiters = self._waiters, []
            post = self._call is not None and not self._calling
            if post:
                self._calling = True
        if post:
            self._executor.post(self._run_callback)
        for wake in waiters:
            wake()
        if dropped:
            self._log_slow(dropped)

    def _count(self, first: Sample, count: int, size: int) -> float:
        """Count received samples; return the current monotonic time."""
        now = time.monotonic()
        if now >= self._next_mark:
            self._next_mark = now + _MARK_PERIOD_S
            self._meter.mark(now, self.last_time, self._received, self._received_bytes, first)
        self.last_time = now
        self._received += count
        self._received_bytes += size
        return now

    def _enforce_limit(self, limit: int, now: float) -> int:
        """Drop the oldest samples beyond `limit`; return the number of drops to log, 0 for none."""
        if not self._shrink(limit) or now < self._next_log:
            return 0
        self._next_log = now + _LOG_PERIOD_S
        return self._dropped

    def _shrink(self, limit: int) -> bool:
        before = self._dropped
        while self._held_bytes > limit and len(self._samples) > 1:
            self._pop()
            self._dropped += 1
        return self._dropped > before

    def _log_slow(self, dropped: int) -> None:
        reason = "they are not taken"
        if self._call is not None:
            name = getattr(self._call, "__qualname__", repr(self._call))
            reason = f"the callback {name} is too slow"
        _log.warning(
            "%s: messages are dropped, the oldest first, %d so far: %s, and %.0f MB are waiting",
            self._topic,
            dropped,
            reason,
            (self._limit or 0) / 1e6,
        )

    # -- taking ----------------------------------------------------------------------------------

    def pop(self) -> Sample | None:
        """Remove and return the oldest sample; None if there is none."""
        with self._lock:
            return self._pop() if self._samples else None

    def pop_all(self) -> list[Sample]:
        """Remove and return all samples, the oldest first."""
        with self._lock:
            samples = list(self._samples)
            self._samples.clear()
            self._held_bytes = 0
            return samples

    def pop_latest(self) -> Sample | None:
        """Remove and return the newest sample, and drop the others."""
        with self._lock:
            if not self._samples:
                return None
            sample = self._samples.pop()
            self._dropped += len(self._samples)
            self._samples.clear()
            self._held_bytes = 0
            return sample

    def add_waiter(self, wake: Callable[[], object]) -> bool:
        """Register a one-shot wake-up; return False if a sample is ready, or the inbox closed."""
        with self._lock:
            if self._samples or self._closed:
                return False
            self._waiters.append(wake)
            return True

    def remove_waiter(self, wake: Callable[[], object]) -> None:
        """Unregister a wake-up that was not called."""
        with self._lock, suppress(ValueError):  # it is just being called
            self._waiters.remove(wake)

    def set_limit(self, limit: int) -> None:
        """Set the limit of a keep-all inbox in bytes; raises ArgumentError."""
        if type(limit) is not int or limit < 1:
            raise ArgumentError("limit", limit, "a number of bytes, at least 1", self._topic)
        if self._limit is None:
            return
        with self._lock:
            self._limit = limit
            self._shrink(limit)

    def statistics(self, lost: int) -> Statistics:
        """Return the current counts and rates; `lost` is the number of samples lost in transit."""
        now = time.monotonic()
        with self._lock:
            return self._meter.read(
                now, self.last_time, self._received, self._received_bytes, self._dropped, lost
            )

    def lateness_ns(self, sample: Sample) -> tuple[int | None, int | None]:
        """Return how much longer a sample took than the fastest one of its publisher.

        Returns:
            By the time at which it was sent, and by the stamp of its header, in nanoseconds; None
            without such a stamp.
        """
        with self._lock:
            return self._meter.lateness_ns(sample)

    def close(self) -> bool:
        """Discard and refuse all samples and wake all waiters; return False if already closed."""
        with self._lock:
            if self._closed:
                return False
            self._closed = True
            self._samples.clear()
            waiters, self._waiters = self._waiters, []
        self._executor.close()
        for wake in waiters:
            wake()
        return True

    def _pop(self) -> Sample:
        sample = self._samples.popleft()
        if self._limit is not None:
            self._held_bytes -= len(sample[0]) + _SAMPLE_OVERHEAD_BYTES
        return sample

    # -- the callback ----------------------------------------------------------------------------

    def _run_callback(self) -> None:
        """Call back for the waiting samples, but yield the executor after a while."""
        left, end = len(self._samples), time.monotonic() + _MAX_TURN_S
        try:
            while left > 0 and (samples := self._pop_batch(min(left, self._batch))):
                left -= len(samples)
                start = time.monotonic()
                self._call_with(samples)
                now = time.monotonic()
                # A slow callback takes one at a time: newer samples replace those that wait.
                slow = (now - start) * _MAX_BATCH > len(samples) * _MAX_TURN_S
                self._batch = 1 if slow else _MAX_BATCH
                if now >= end:
                    break
        finally:  # continue even if a callback calls sys.exit()
            with self._lock:
                self._calling = again = bool(self._samples)
            if again:
                self._executor.post(self._run_callback)

    def _pop_batch(self, limit: int) -> list[Sample]:
        """Remove and return the oldest samples, at most `limit`."""
        with self._lock:
            pop = self._samples.popleft
            samples = [pop() for _ in range(min(limit, len(self._samples)))]
            if self._limit is not None:
                size = sum(map(len, map(_data, samples)))
                self._held_bytes -= size + len(samples) * _SAMPLE_OVERHEAD_BYTES
            return samples

    def _call_with(self, samples: Sequence[Sample]) -> None:
        call, arguments = self._prepare(samples)
        for argument in arguments:
            if self._closed:
                break
            try:
                call(argument)
            except (Exception, SystemExit) as error:  # noqa: BLE001 - a user's callback
                reraise_exit(error)
                self._log_failure()

    def _prepare(self, samples: Sequence[Sample]) -> tuple[Callable[[Any], None], Sequence[Any]]:
        """Return the callback and its arguments: the samples, or their messages."""
        assert self._call is not None
        if self._call_decoded is not None and len(samples) > 1:
            kind = samples[0][2]
            alike = samples[0][1] == kind.wire == "ros1"
            if alike and list(map(_type, samples)).count(kind) == len(samples):
                messages = kind.decode_small(list(map(_data, samples)))
                if messages is not None:
                    return self._call_decoded, messages
        return self._call, samples

    def _log_failure(self) -> None:
        self._failures.exception("callback of subscription %s failed", self._topic)


class ImmediateInbox(Inbox):
    """Passes samples to a callback in the thread that puts them, one at a time.

    Samples wait only while a call is in progress: those from other threads, and those that the
    callback itself causes.
    """

    def __init__(
        self,
        topic: str,
        qos: QoS,
        call: Callable[[Sample], None],
        call_decoded: Callable[[Message], None] | None = None,
    ) -> None:
        super().__init__(topic, qos, IMMEDIATE, call, call_decoded)
        self._call_one = call
        #: Held by the thread that calls back, never waited for; also guards the counters.
        self._turn = threading.Lock()

    def put(self, sample: Sample) -> None:
        """Call back with a sample; if a call is in progress, leave it to that thread."""
        # Not through put_many(), which takes twice as long for one sample.
        turn = self._turn
        if not self._samples and turn.acquire(False):
            try:
                self._handle_one(sample)
            finally:
                turn.release()
        else:
            self._store(sample)
        if self._samples:
            self._handle_stored()

    def put_many(self, given: list[Sample]) -> None:
        """Call back with samples that arrived together, at least one."""
        left = given
        if not self._samples and self._turn.acquire(False):
            try:
                left = self._handle(given)
            finally:
                self._turn.release()
        for sample in left:
            self.put(sample)
        if self._samples:
            self._handle_stored()

    def _handle_stored(self) -> None:
        """Call back for stored samples, unless another thread is doing so: it checks again."""
        turn = self._turn
        while self._samples and turn.acquire(False):
            try:
                stored = self.pop()
                if stored is not None:
                    self._handle_one(stored)
            finally:
                turn.release()

    def _handle_one(self, sample: Sample) -> None:
        """Call back with a sample; the turn is held."""
        if self._closed:
            return
        self._count(sample, 1, len(sample[0]))
        try:
            self._call_one(sample)
        except (Exception, SystemExit):  # noqa: BLE001 - a user's callback
            self._log_failure()

    def _handle(self, given: list[Sample]) -> list[Sample]:
        """Call back with each sample; return those that must wait for samples stored in between.

        The turn is held.
        """
        if self._closed:
            return []
        self._count(given[0], len(given), sum(map(len, map(_data, given))))
        call, arguments = self._prepare(given)
        for number, argument in enumerate(arguments):
            if self._samples or self._closed:
                left = given[number:]
                self._received -= len(left)
                self._received_bytes -= sum(map(len, map(_data, left)))
                return left
            try:
                call(argument)
            except (Exception, SystemExit):  # noqa: BLE001 - a user's callback
                self._log_failure()
        return []

    def _store(self, sample: Sample) -> None:
        with self._lock:
            if self._closed:
                return
            dropped = self._dropped
            if len(self._samples) == self._depth:
                self._dropped += 1
            self._samples.append(sample)
            to_log = 0
            if self._limit is not None:
                self._held_bytes += len(sample[0]) + _SAMPLE_OVERHEAD_BYTES
                to_log = self._enforce_limit(self._limit, time.monotonic())
            # Samples count when they are handled; those dropped never will be.
            self._received += self._dropped - dropped
        if to_log:
            self._log_slow(to_log)


class _Meter:
    """Measures the rates of an inbox from the values of its counters at about thirty times.

    Samples may therefore arrive one by one or in batches.
    """

    def __init__(self) -> None:
        self._marks: deque[tuple[float, int, int]] = deque(maxlen=_MAX_MARKS)
        #: Latency and lateness of samples in nanoseconds.
        self._latencies: deque[tuple[int, int]] = deque(maxlen=_MAX_MARKS)
        self._estimator, self._stamps = LatencyEstimator(), StampMonitor()

    def mark(self, now: float, last: float, count: int, size: int, sample: Sample) -> None:
        """Add a mark.

        Args:
            now: Monotonic time at which `sample` arrived.
            last: Monotonic time of the previous sample.
            count: Number of samples that had arrived before `sample`.
            size: Their bytes.
            sample: The sample that has just arrived.
        """
        if self._marks and self._rate(now, last, count) == 0:
            # After a pause, the rates start from scratch.
            self._marks.clear()
        elif count:
            self._marks.append((last, count, size))
        sent = sample.sent_ns
        if sent is not None:
            lateness = self._estimator.add(sample.publisher, sample.received_ns, sent)
            self._latencies.append((sample.received_ns - sent, lateness))
        stamp = header_stamp(sample.type, sample.wire, sample.data)
        if stamp:
            self._stamps.add(sample.publisher, sample.received_ns, stamp)

    def lateness_ns(self, sample: Sample) -> tuple[int | None, int | None]:
        """Return the same as :meth:`Inbox.lateness_ns`."""
        publisher, received, sent = sample.publisher, sample.received_ns, sample.sent_ns
        late = None if sent is None else self._estimator.lateness(publisher, received, sent)
        stamp = header_stamp(sample.type, sample.wire, sample.data)
        by_header = self._stamps.lateness(publisher, received, stamp) if stamp else None
        return late, None if by_header is None else round(by_header * 1e9)

    def read(
        self, now: float, last: float, received: int, size: int, dropped: int, lost: int
    ) -> Statistics:
        """Return the statistics at `now`, given the counters and the time of the last sample."""
        frequency = self._rate(now, last, received)
        bandwidth = 0.0
        if frequency:
            _, count, before = self._marks[0]
            bandwidth = (size - before) / (received - count) * frequency
        age = now - last
        latencies = sorted(latency for latency, _ in self._latencies)
        return Statistics(
            received,
            dropped,
            frequency,
            bandwidth,
            Duration.from_seconds(age) if math.isfinite(age) else None,
            lost,
            Duration(latencies[len(latencies) // 2]) if latencies else None,
            Duration(self._latencies[-1][1]) if latencies else None,
        )

    def _rate(self, now: float, last: float, received: int) -> float:
        if not self._marks:
            return 0.0
        start, count, _ = self._marks[0]
        if received <= count or last <= start:
            return 0.0
        return fading_rate((last - start) / (received - count), now - last)
