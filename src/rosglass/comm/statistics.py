"""How a subscription is doing: counts, rates, and how old what it receives is."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.comm.lateness import Lateness
from rosglass.comm.time import Duration

if TYPE_CHECKING:
    from rosglass.comm.sample import Sample

__all__ = ["MARK_PERIOD", "Meter", "Statistics"]

#: Rates are taken over so many marks ...
_MARKS = 30
#: ... which are at least so many seconds apart.
MARK_PERIOD = 1 / 30


@dataclass(frozen=True, slots=True)
class Statistics:
    """How a subscription is doing.

    Attributes:
        received: Samples received since creation.
        dropped: Samples thrown out of a full inbox before anyone took them.
        frequency: Samples per second over the last 30, or the last second where there are more;
            falls to 0 when they stop.
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
        self._lateness = Lateness()

    def mark(self, last: float, count: int, size: int, sample: Sample) -> None:
        """Note where the counts stood when the last sample before `sample` had come."""
        if count:
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
        start, count, before = self._marks[0] if self._marks else (last, received, size)
        frequency = bandwidth = 0.0
        age = now - last
        if received > count and last > start:
            period = (last - start) / (received - count)
            # Once the next sample is overdue, let the figures fall instead of showing a dead rate:
            # as if there had been no more than the last 30.
            recent = min(received - count, _MARKS - 1)
            frequency = recent / (recent * period + max(0.0, age - 1.5 * period))
            bandwidth = (size - before) / (received - count) * frequency
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
