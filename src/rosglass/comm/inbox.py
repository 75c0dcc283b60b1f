"""Where received samples wait, and from where they are handed on: once, in order, counted.

Everything here happens for each sample of the fastest topics, so that it is written for speed.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from contextlib import suppress
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from rosglass.comm.executor import IMMEDIATE, RetryingExecutor, let_exit
from rosglass.comm.log_limits import FailureLog
from rosglass.comm.qos import History
from rosglass.comm.statistics import MARK_PERIOD, Meter
from rosglass.errors import ConversionError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.handle import Executor
    from rosglass.comm.qos import QoS
    from rosglass.comm.sample import Sample
    from rosglass.comm.statistics import Statistics
    from rosglass.comm.time import Duration
    from rosglass.messages import Message

__all__ = ["INBOX_LIMIT", "ImmediateInbox", "Inbox"]

_log = logging.getLogger("rosglass.comm")
#: Bytes that wait at most in an inbox that keeps all, unless set otherwise.
INBOX_LIMIT = 256 * 1024 * 1024
#: Bytes that a waiting sample takes up besides its data, about.
_SAMPLE_SIZE = 500
#: Seconds between two log lines about a consumer that is too slow.
_LOG_EVERY = 10.0
_data, _kind = itemgetter(0), itemgetter(2)
#: Samples that are made ready for a callback at once.
_BATCH = 256
#: Seconds after which a callback lets others have their turn.
_TURN = 0.01


class Inbox:
    """Keeps the newest samples until they are taken, or hands them to a callback.

    With keep-last history it holds `qos.depth` samples; with keep-all as many as fit into a number
    of bytes. What does not fit drops the oldest, and is counted.

    Args:
        topic: For messages.
        qos: History and depth.
        executor: Where `call` runs.
        call: Takes each sample; None when they are taken by somebody who asks for them.
        call_decoded: What `call` hands messages to, if it does nothing else: many at once are
            decoded in less time than each by itself.
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
        self._lock = threading.Lock()
        self._waiters: list[Callable[[], object]] = []
        self._calling = self._closed = False
        self._at_once = 1
        self._held = self._received = self._bytes = self._dropped = 0
        self._last = self._next_mark = self._next_log = -math.inf
        self._failures = FailureLog(_log)
        self._meter = Meter()

    @property
    def closed(self) -> bool:
        """Whether it takes and gives nothing any more."""
        return self._closed

    @property
    def waiting(self) -> int:
        """How many samples wait."""
        return len(self._samples)

    @property
    def last(self) -> float:
        """When the last sample came, by :func:`time.monotonic`; minus infinity before the first."""
        return self._last

    def put(self, sample: Sample) -> None:
        """Take a sample in and wake whoever wants it; from any thread."""
        waiters: list[Callable[[], object]] | None = None
        now = time.monotonic()
        with self._lock:
            if self._closed:
                return
            if now >= self._next_mark:
                self._next_mark = now + MARK_PERIOD
                self._meter.mark(now, self._last, self._received, self._bytes, sample)
            self._last = now
            self._received += 1
            self._bytes += len(sample[0])
            samples = self._samples
            if len(samples) == self._depth:
                self._dropped += 1
            samples.append(sample)
            slow = 0
            if self._limit is not None:
                self._held += len(sample[0]) + _SAMPLE_SIZE
                slow = self._keep_within(self._limit, now)
            if self._waiters:
                waiters, self._waiters = self._waiters, []
            post = self._call is not None and not self._calling
            if post:
                self._calling = True
        if post:
            self._executor.post(self._call_soon)
        if waiters is not None:
            for wake in waiters:
                wake()
        if slow:
            self._log_slow(slow)

    def put_many(self, given: list[Sample]) -> None:
        """Take samples in that came together, as :meth:`put` does one by one."""
        waiters: list[Callable[[], object]] | None = None
        now = time.monotonic()
        size = sum(map(len, map(_data, given)))
        with self._lock:
            if self._closed:
                return
            if now >= self._next_mark:
                self._next_mark = now + MARK_PERIOD
                self._meter.mark(now, self._last, self._received, self._bytes, given[0])
            self._last = now
            self._received += len(given)
            self._bytes += size
            samples = self._samples
            slow = 0
            if self._limit is None:
                self._dropped += max(0, len(samples) + len(given) - self._depth)
                samples.extend(given)
            else:
                samples.extend(given)
                self._held += size + len(given) * _SAMPLE_SIZE
                slow = self._keep_within(self._limit, now)
            if self._waiters:
                waiters, self._waiters = self._waiters, []
            post = self._call is not None and not self._calling
            if post:
                self._calling = True
        if post:
            self._executor.post(self._call_soon)
        if waiters is not None:
            for wake in waiters:
                wake()
        if slow:
            self._log_slow(slow)

    def pop(self) -> Sample | None:
        """Take the oldest sample out, None when there is none."""
        with self._lock:
            return self._pop() if self._samples else None

    def pop_latest(self) -> Sample | None:
        """Take the newest sample out and drop the others."""
        with self._lock:
            if not self._samples:
                return None
            sample = self._samples.pop()
            self._dropped += len(self._samples)
            self._samples.clear()
            self._held = 0
            return sample

    def enlist(self, wake: Callable[[], object]) -> bool:
        """Have `wake` called once when there is something to take; False if there is already."""
        with self._lock:
            if self._samples or self._closed:
                return False
            self._waiters.append(wake)
            return True

    def dismiss(self, wake: Callable[[], object]) -> None:
        """Take back what :meth:`enlist` was given, if it was not called."""
        with self._lock, suppress(ValueError):
            self._waiters.remove(wake)

    def set_limit(self, limit: int) -> None:
        """Bound the bytes that an inbox keeps that keeps all; raises ConversionError."""
        if type(limit) is not int or limit < 1:
            raise ConversionError("limit", limit, "a number of bytes, at least 1", self._topic)
        if self._limit is None:
            return
        with self._lock:
            self._limit = limit
            self._shrink(limit)

    def statistics(self, lost: int) -> Statistics:
        """Return counts and rates as of now; `lost` is what never came."""
        now = time.monotonic()
        with self._lock:
            return self._meter.read(
                now, self._last, self._received, self._bytes, self._dropped, lost
            )

    def lateness(self, sample: Sample) -> Duration:
        """Return how much longer a sample took than the fastest of its publisher."""
        with self._lock:
            return self._meter.lateness(sample)

    def close(self) -> bool:
        """Forget what waits, take nothing more, wake who waits; returns whether it was open."""
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
            self._held -= len(sample[0]) + _SAMPLE_SIZE
        return sample

    def _keep_within(self, limit: int, now: float) -> int:
        """Make room for what came last; returns how many drops to complain about."""
        if not self._shrink(limit) or now < self._next_log:
            return 0
        self._next_log = now + _LOG_EVERY
        return self._dropped

    def _shrink(self, limit: int) -> bool:
        before = self._dropped
        while self._held > limit and len(self._samples) > 1:
            self._pop()
            self._dropped += 1
        return self._dropped > before

    def _log_slow(self, dropped: int) -> None:
        who = "nobody takes them" if self._call is None else f"{_name(self._call)} is too slow"
        _log.warning(
            "%s: messages are dropped, the oldest first, %d so far: %s, and %.0f MB wait already",
            self._topic,
            dropped,
            who,
            (self._limit or 0) / 1e6,
        )

    def _call_soon(self) -> None:
        """Call back for what waits now; others have their turn before what comes meanwhile."""
        left, end = len(self._samples), time.monotonic() + _TURN
        try:
            while left > 0 and (part := self._take(min(left, self._at_once))):
                left -= len(part)
                begun = time.monotonic()
                call, given = self._prepare(part)
                for one in given:
                    if self._closed:
                        break
                    try:
                        call(one)
                    except (Exception, SystemExit) as error:
                        let_exit(error)
                        self._log_failure()
                now = time.monotonic()
                # What a slow callback has not begun with stays where newer samples take its place.
                slow = (now - begun) * _BATCH > len(part) * _TURN
                self._at_once = 1 if slow else _BATCH
                if now >= end:
                    break
        finally:  # what a callback that calls sys.exit() leaves is called back with, too
            with self._lock:
                self._calling = again = bool(self._samples)
            if again:
                self._executor.post(self._call_soon)

    def _take(self, most: int) -> list[Sample]:
        """Take some of the oldest samples out."""
        with self._lock:
            pop = self._samples.popleft
            part = [pop() for _ in range(min(most, len(self._samples)))]
            if self._limit is not None:
                self._held -= sum(map(len, map(_data, part))) + len(part) * _SAMPLE_SIZE
            return part

    def _prepare(self, samples: Sequence[Sample]) -> tuple[Callable[[Any], None], Sequence[Any]]:
        """Return what to call, and with what: the samples, or the messages in them."""
        assert self._call is not None
        if self._call_decoded is not None and len(samples) > 1:
            kind = samples[0][2]
            alike = samples[0][1] == kind.wire == "ros1"
            if alike and list(map(_kind, samples)).count(kind) == len(samples):
                messages = kind.decode_small(list(map(_data, samples)))
                if messages is not None:
                    return self._call_decoded, messages
        return self._call, samples

    def _log_failure(self) -> None:
        self._failures.exception("callback of subscription %s failed", self._topic)


class ImmediateInbox(Inbox):
    """Hands samples to a callback in the thread that puts them in, one at a time.

    Only what comes while a call is under way waits: from other threads, or from in there.
    """

    def __init__(
        self,
        topic: str,
        qos: QoS,
        call: Callable[[Sample], None],
        call_decoded: Callable[[Message], None] | None = None,
    ) -> None:
        super().__init__(topic, qos, IMMEDIATE, call, call_decoded)
        self._call_back = call
        self._turn = threading.Lock()

    def put(self, sample: Sample) -> None:
        """Take a sample in and call back, unless another call is under way: it goes on then."""
        turn = self._turn
        if not self._samples and turn.acquire(False):
            try:
                self._handle(sample)
            finally:
                turn.release()
        else:
            self._store(sample)
        if self._samples:
            self._go_on()

    def _go_on(self) -> None:
        """Call back for what was stored, unless another thread does so already."""
        turn = self._turn
        # Whoever let go of the turn looks again: what was stored meanwhile is nobody else's.
        while self._samples and turn.acquire(False):
            try:
                stored = self.pop()
                if stored is not None:
                    self._handle(stored)
            finally:
                turn.release()

    def put_many(self, given: list[Sample]) -> None:
        """Take samples in that came together and call back for each."""
        turn = self._turn
        left = given
        if not self._samples and turn.acquire(False):
            try:
                left = self._handle_many(given)
            finally:
                turn.release()
        for sample in left:
            self.put(sample)
        if self._samples:
            self._go_on()

    def _handle_many(self, given: list[Sample]) -> list[Sample]:
        """Call back for each; returns those that have to wait for what came in between."""
        now = time.monotonic()
        if now >= self._next_mark:
            self._next_mark = now + MARK_PERIOD
            self._meter.mark(now, self._last, self._received, self._bytes, given[0])
        self._last = now
        waiting = self._samples
        call, ready = self._prepare(given)
        done = given
        for number, one in enumerate(ready):
            if waiting or self._closed:
                done = given[:number]
                break
            try:
                call(one)
            except (Exception, SystemExit):
                self._log_failure()
        self._received += len(done)
        self._bytes += sum(map(len, map(_data, done)))
        return given[len(done) :]

    def _handle(self, sample: Sample) -> None:
        if self._closed:
            return
        now = time.monotonic()
        if now >= self._next_mark:
            self._next_mark = now + MARK_PERIOD
            self._meter.mark(now, self._last, self._received, self._bytes, sample)
        self._last = now
        self._received += 1
        self._bytes += len(sample[0])
        try:
            self._call_back(sample)
        except (Exception, SystemExit):
            self._log_failure()

    def _store(self, sample: Sample) -> None:
        with self._lock:
            if self._closed:
                return
            dropped = self._dropped
            if len(self._samples) == self._depth:
                self._dropped += 1
            self._samples.append(sample)
            now = time.monotonic()
            slow = 0
            if self._limit is not None:
                self._held += len(sample[0]) + _SAMPLE_SIZE
                slow = self._keep_within(self._limit, now)
            # Samples count when they are handled; these will not be.
            self._received += self._dropped - dropped
        if slow:
            self._log_slow(slow)


def _name(call: Callable[[Sample], None]) -> str:
    """Return what to call a callback in a message to people."""
    return f"the callback {getattr(call, '__qualname__', repr(call))}"
