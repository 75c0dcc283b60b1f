"""The statistics of a subscription: counts, rates, and the latency of its samples."""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections import deque
    from collections.abc import Sequence

    from rosglass.comm.time import Duration
    from rosglass.messages import MessageType

__all__ = [
    "LatencyEstimator",
    "StampMonitor",
    "Statistics",
    "fading_rate",
    "header_stamp",
    "note_time",
    "rate_of",
]

#: A rate starts to fall when the next event is this many periods late, ...
_LATE_PERIODS = 1.5
#: ... and is 0 this many periods or seconds after that, whichever is longer.
_FADE_PERIODS, _FADE_S = 2.0, 2.0
#: Number of publishers, or frames, to remember; only a robot that restarts for days has more.
_MAX_PUBLISHERS = 2048
#: Largest drift between two clocks; NTP slews a clock by at most 500 ppm.
_MAX_DRIFT = 500e-6
#: How long the fastest message is remembered, at least, where stamps are those of headers.
_STAMP_MEMORY_NS = 30 * 10**9
#: Steps of this machine's clock below this are ignored.
_MIN_STEP_NS = 50_000_000


def fading_rate(period: float, age: float) -> float:
    """Return the rate of an event in hertz, which falls to 0 once the event no longer occurs.

    Args:
        period: Mean time between two events in seconds.
        age: Time since the last event in seconds.
    """
    overdue = max(0.0, age - _LATE_PERIODS * period)
    return max(0.0, 1 - overdue / max(_FADE_S, _FADE_PERIODS * period)) / period


def rate_of(times: Sequence[float], now: float) -> float:
    """Return the rate of an event in hertz from its last times; see :func:`fading_rate`."""
    if len(times) < 2 or times[-1] <= times[0]:
        return 0.0
    return fading_rate((times[-1] - times[0]) / (len(times) - 1), now - times[-1])


def note_time(times: deque[float], now: float) -> None:
    """Append a time for :func:`rate_of`; after a pause, restart measuring."""
    if len(times) > 1 and rate_of(times, now) == 0:
        times.clear()
    times.append(now)


@dataclass(frozen=True, slots=True)
class Statistics:
    """The statistics of a subscription.

    Attributes:
        received: Samples received since creation.
        dropped: Samples that a full inbox dropped before they were taken.
        frequency: Samples per second over the last 30, or the last second if there were more;
            0 after 3.5 s without any, or after 3.5 periods if they are longer than a second.
        bandwidth: Bytes per second over the same samples.
        age: Time since the last sample; None before the first.
        lost: Samples that were sent, by the publishers' sequence numbers, but not received.
        latency: Median time from sending to reception of the same samples. Publisher and receiver
            have different clocks, so that it may be wrong by their difference, and even negative.
            None if publishers do not stamp their samples.
        lateness: How much longer the last sample took than the fastest one of its publisher,
            independent of the clocks: large after an outage, when a link delivers delayed samples.
    """

    received: int
    dropped: int
    frequency: float
    bandwidth: float
    age: Duration | None
    lost: int = 0
    latency: Duration | None = None
    lateness: Duration | None = None


class _Publisher(NamedTuple):
    """The measurements of one publisher, in nanoseconds."""

    #: Shortest time from stamp to reception, corrected for drift.
    fastest: int
    #: When that was updated.
    updated: int
    #: Its newest stamp.
    newest: int
    #: Whether the last stamp was older than that: a late sample, or a clock that was set back.
    behind: bool
    #: The shortest time of the period before, and when the present one began; without memory, both
    #: have no meaning.
    before: int
    began: int
    #: Whether the last stamp was that of the sample before.
    repeats: bool


class LatencyEstimator:
    """Measures how much longer than usual samples took, without comparing two clocks.

    After an outage of ten seconds, a link may deliver all samples of that time at once: just
    received, but with old contents. The stamps of publisher and receiver come from two clocks, so
    that their difference alone is meaningless. But the fastest sample of a publisher took almost
    no time, and the lateness of another one is the time that it took longer.

    A late first sample of a publisher cannot be detected. Clocks may be set: a step of this
    machine's clock is measured, a step back of the publisher's shows in its stamps, and one forward
    makes its samples look faster than any before.

    Args:
        memory: Nanoseconds after which the fastest sample is forgotten, up to twice as late; 0 for
            never.
    """

    def __init__(self, memory: int = 0) -> None:
        self._memory = memory
        self._publishers: dict[bytes, _Publisher] = {}
        self._offset = _offset()

    def add(self, publisher: bytes, received: int, sent: int) -> int:
        """Add a sample and return its lateness; times in nanoseconds."""
        self._follow_clock()
        took = received - sent
        known = self._publishers.get(publisher)
        if known is None and len(self._publishers) >= _MAX_PUBLISHERS:
            self._publishers.clear()
        if known is None or (known.behind and sent < known.newest):
            self._publishers[publisher] = _Publisher(
                took, received, sent, False, took, received, False
            )
            return 0
        drift = round(max(0, received - known.updated) * _MAX_DRIFT)
        fastest, before, began = known.fastest + drift, known.before + drift, known.began
        if self._memory and received - began > self._memory:
            before, fastest, began = fastest, took, received
        fastest = min(took, fastest)
        self._publishers[publisher] = _Publisher(
            fastest,
            received,
            max(sent, known.newest),
            sent < known.newest,
            before,
            began,
            sent == known.newest,
        )
        return took - (min(fastest, before) if self._memory else fastest)

    def lateness(self, publisher: bytes, received: int, sent: int) -> int:
        """Return the lateness of a sample, 0 for unknown publishers; times in nanoseconds."""
        self._follow_clock()
        known = self._publishers.get(publisher)
        if known is None:
            return 0
        fastest = min(known.fastest, known.before) if self._memory else known.fastest
        return max(0, received - sent - fastest)

    def repeats(self, publisher: bytes, sent: int) -> bool:
        """Return whether a stamp is that of several samples in a row, and so not their time."""
        known = self._publishers.get(publisher)
        return known is not None and known.repeats and sent == known.newest

    def _follow_clock(self) -> None:
        offset = _offset()
        step = offset - self._offset
        if abs(step) < _MIN_STEP_NS:
            return
        self._offset = offset
        for publisher, known in self._publishers.items():
            self._publishers[publisher] = known._replace(
                fastest=known.fastest + step,
                updated=known.updated + step,
                before=known.before + step,
                began=known.began + step,
            )


class StampMonitor:
    """Measures by their own stamps how much later than usual data arrives.

    Unlike the time stamp of a wire, a stamp in a message is what its node chose: stamps of zero,
    and stamps that do not change, say nothing; and the shortest delay is that of the last 30 to 60
    seconds only, for data that is paused, or by whose stamps the time runs differently.
    """

    def __init__(self) -> None:
        self._estimator = LatencyEstimator(_STAMP_MEMORY_NS)

    def add(self, source: bytes, received: int, stamp: int) -> float:
        """Add data and return its lateness in seconds.

        Args:
            source: Source of the data; each source has its own clock.
            received: System time of arrival in nanoseconds.
            stamp: The data's own time in nanoseconds; 0 for none.
        """
        if not stamp:
            return 0.0
        late = self._estimator.add(source, received, stamp)
        return 0.0 if self._estimator.repeats(source, stamp) else max(0, late) / 1e9

    def lateness(self, source: bytes, received: int, stamp: int) -> float | None:
        """Return the lateness of data in seconds; None if its stamp says nothing."""
        if not stamp or self._estimator.repeats(source, stamp):
            return None
        return self._estimator.lateness(source, received, stamp) / 1e9


_ros1_stamp, _ros2_stamps = struct.Struct("<4xII"), (struct.Struct(">4xiI"), struct.Struct("<4xiI"))


def header_stamp(type: MessageType, wire: str, data: bytes | memoryview) -> int:
    """Return the stamp of a message that begins with a header, in nanoseconds; 0 without one.

    Args:
        type: The message's type.
        wire: ``ros1`` or ``cdr``.
        data: The message's bytes.
    """
    if not getattr(type, "has_header", False) or len(data) < _ros1_stamp.size:
        return 0
    # In ROS 1, the sequence number is before the stamp; in ROS 2, the encapsulation header.
    stamp = _ros1_stamp if wire == "ros1" else _ros2_stamps[data[1] & 1]
    seconds, nanoseconds = stamp.unpack_from(data)
    return max(0, int(seconds) * 10**9 + int(nanoseconds))


def _offset() -> int:
    """Return the difference between the system's clock and a steady one, in nanoseconds.

    The steady one continues while the machine is suspended, if the system has such a clock.
    """
    clock = getattr(time, "CLOCK_BOOTTIME", None)
    steady = time.monotonic_ns() if clock is None else time.clock_gettime_ns(clock)
    return time.time_ns() - steady
