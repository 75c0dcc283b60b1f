"""How a subscription is doing: counts, rates, and how old what it receives is."""

from __future__ import annotations

import math
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.time import Duration

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm.sample import Sample

__all__ = [
    "MARK_PERIOD",
    "LatencyEstimator",
    "Meter",
    "Statistics",
    "fading_rate",
    "note_time",
    "rate_of",
]

#: Rates are taken over so many marks ...
_MARKS = 30
#: ... which are at least so many seconds apart.
MARK_PERIOD = 1 / 30
#: A rate begins to fall when the next is so many periods late, ...
_LATE_PERIODS = 1.5
#: ... and is 0 so many periods or seconds after that, whichever is longer.
_FADE_PERIODS, _FADE_S = 2.0, 2.0
#: Publishers remembered; more come only from a robot that restarts for days.
_MAX_PUBLISHERS = 256
#: By how much two clocks run apart at worst; NTP lets a clock run wrong by no more (500 ppm).
_MAX_DRIFT = 500e-6
#: Steps of this machine's clock below this many nanoseconds are not looked for.
_MIN_STEP_NS = 50_000_000


def fading_rate(period: float, age: float) -> float:
    """Return how often something comes a second; 0 once it has stopped.

    Args:
        period: Seconds from one to the next, on average.
        age: Seconds since the last one.
    """
    overdue = max(0.0, age - _LATE_PERIODS * period)
    return max(0.0, 1 - overdue / max(_FADE_S, _FADE_PERIODS * period)) / period


def rate_of(times: Sequence[float], now: float) -> float:
    """Return how often something comes a second, given when it came last; see `fading_rate`."""
    if len(times) < 2 or times[-1] <= times[0]:
        return 0.0
    return fading_rate((times[-1] - times[0]) / (len(times) - 1), now - times[-1])


def note_time(times: deque[float], now: float) -> None:
    """Append a time for `rate_of`; after a silence the rate is taken anew."""
    if len(times) > 1 and rate_of(times, now) == 0:
        times.clear()
    times.append(now)


@dataclass(frozen=True, slots=True)
class Statistics:
    """How a subscription is doing.

    Attributes:
        received: Samples received since creation.
        dropped: Samples thrown out of a full inbox before anyone took them.
        frequency: Samples per second over the last 30, or the last second where there are more;
            0 from 3.5 s without any, or 3.5 periods where they come more rarely than once a second.
        bandwidth: Bytes per second over the same samples.
        age: Time since the last sample, None before the first.
        lost: Samples that were sent, by the publishers' running numbers, and have not arrived.
        latency: Time from sending to reception, the median of the same samples. Publisher and
            receiver each have their own clock, so that it may be wrong by the difference, even
            negative. None when publishers do not stamp what they send.
        lateness: How much longer the last sample took than the fastest of its publisher, whatever
            the clocks say: large when a silent link hands on what it had kept back.
    """

    received: int
    dropped: int
    frequency: float
    bandwidth: float
    age: Duration | None
    lost: int = 0
    latency: Duration | None = None
    lateness: Duration | None = None


class Meter:
    """Keeps what the rates are made of: where the counts stood at some thirty moments.

    Samples may come one by one or, when nobody waits for them, some at a time.
    """

    def __init__(self) -> None:
        self._marks: deque[tuple[float, int, int]] = deque(maxlen=_MARKS)
        self._took: deque[tuple[int, int]] = deque(maxlen=_MARKS)
        self._lateness = LatencyEstimator()

    def mark(self, now: float, last: float, count: int, size: int, sample: Sample) -> None:
        """Note where the counts stood when the last sample before `sample`, of `now`, had come."""
        if self._marks and self._rate(now, last, count) == 0:
            # After a silence the rates are taken anew.
            self._marks.clear()
        elif count:
            self._marks.append((last, count, size))
        sent = sample.sent_ns
        if sent is not None:
            late = self._lateness.see(sample.publisher, sample.received_ns, sent)
            self._took.append((sample.received_ns - sent, late))

    def lateness(self, sample: Sample) -> Duration:
        """Return how much longer `sample` took than the fastest of its publisher."""
        if sample.sent_ns is None:
            return Duration()
        return Duration(self._lateness.of(sample.publisher, sample.received_ns, sample.sent_ns))

    def read(
        self, now: float, last: float, received: int, size: int, dropped: int, lost: int
    ) -> Statistics:
        """Return the figures as of `now`, given the counts and the time of the last sample."""
        frequency = self._rate(now, last, received)
        bandwidth = 0.0
        if frequency:
            _, count, before = self._marks[0]
            bandwidth = (size - before) / (received - count) * frequency
        age = now - last
        ways = sorted(way for way, _ in self._took)
        return Statistics(
            received,
            dropped,
            frequency,
            bandwidth,
            Duration.from_seconds(age) if math.isfinite(age) else None,
            lost,
            Duration(ways[len(ways) // 2]) if ways else None,
            Duration(self._took[-1][1]) if ways else None,
        )

    def _rate(self, now: float, last: float, received: int) -> float:
        if not self._marks:
            return 0.0
        start, count, _ = self._marks[0]
        if received <= count or last <= start:
            return 0.0
        return fading_rate((last - start) / (received - count), now - last)


class _Publisher(NamedTuple):
    """What is known of a publisher, in nanoseconds."""

    fastest: int
    #: When that was brought up to date.
    at: int
    #: Its newest stamp.
    newest: int
    #: Whether the last sample was stamped before that: late itself, or by a clock set back.
    behind: bool


class LatencyEstimator:
    """How much longer than usual samples were on their way, whatever the clocks say.

    A link that was silent for ten seconds may hand on, all at once, what was sent in that time. By
    its reception such a sample is new, by its contents it is old. The time stamps of publisher and
    receiver come from two clocks, so that their difference says nothing by itself; but the fastest
    sample of a publisher took about no time, and how much more another one took is its lateness.

    What a publisher's first sample cannot tell: it may be late itself. Either clock may be set in
    between: a step of ours is measured, a publisher's step back shows in its stamps, and one
    forward makes its samples look faster than any before.
    """

    def __init__(self) -> None:
        self._publishers: dict[bytes, _Publisher] = {}
        self._offset = _offset()

    def see(self, publisher: bytes, received: int, sent: int) -> int:
        """Remember a sample and return its lateness; times in nanoseconds."""
        self._follow_clock()
        took = received - sent
        known = self._publishers.get(publisher)
        if known is None and len(self._publishers) >= _MAX_PUBLISHERS:
            self._publishers.clear()
        if known is None or (known.behind and sent < known.newest):
            fastest = took
            known = None
        else:
            fastest = min(took, known.fastest + round(max(0, received - known.at) * _MAX_DRIFT))
        behind = known is not None and sent < known.newest
        newest = sent if known is None else max(sent, known.newest)
        self._publishers[publisher] = _Publisher(fastest, received, newest, behind)
        return took - fastest

    def of(self, publisher: bytes, received: int, sent: int) -> int:
        """Return the lateness of a sample, 0 for unknown publishers; times in nanoseconds."""
        self._follow_clock()
        known = self._publishers.get(publisher)
        return 0 if known is None else max(0, received - sent - known.fastest)

    def _follow_clock(self) -> None:
        offset = _offset()
        step = offset - self._offset
        if abs(step) < _MIN_STEP_NS:
            return
        self._offset = offset
        for publisher, known in self._publishers.items():
            self._publishers[publisher] = known._replace(
                fastest=known.fastest + step, at=known.at + step
            )


def _offset() -> int:
    """Return by how much the system's clock is ahead of one that nobody sets.

    That clock goes on while the machine sleeps, where there is such a one.
    """
    clock = getattr(time, "CLOCK_BOOTTIME", None)
    steady = time.monotonic_ns() if clock is None else time.clock_gettime_ns(clock)
    return time.time_ns() - steady
