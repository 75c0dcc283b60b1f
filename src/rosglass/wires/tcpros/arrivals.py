"""Detects from arrival times that a publisher is silent, or that its messages were delayed.

ROS 1 sends no time stamps with its messages, and TCP holds back everything that follows a lost
packet: after an outage, its messages arrive at once, the oldest first.
"""

from __future__ import annotations

import time

__all__ = ["BacklogMonitor", "SilenceMonitor"]

#: Shortest time between two samples of the count.
_SAMPLE_S = 0.9
#: Consecutive samples with about the same rate that make a publisher regular.
_REGULAR_SAMPLES = 10
#: Silence is suspicious after so many of the usual intervals, and after so many seconds.
_MISSED_INTERVALS, _MIN_SILENCE_S = 5, 1.0


class SilenceMonitor:
    """Detects that a publisher with a regular rate has stopped sending; free for each message.

    Publishers with less than one message per second or with a changing rate are never reported.

    Attributes:
        problem: Why the silence is suspicious, in words; empty when it is not.
    """

    def __init__(self) -> None:
        self.problem = ""
        self._sampled_at = self._received_at = 0.0
        self._count = self._regular = 0
        self._rate = 0.0
        #: The messages of the last sample, and its seconds: evaluated only when more are received,
        #: as the last messages before a silence fill only a part of that time.
        self._newest = (0, 0.0)

    def update(self, name: str, count: int, now: float) -> None:
        """Sample the count of received messages.

        Args:
            name: The publisher, for the problem.
            count: Received messages in all.
            now: The time, by :func:`time.monotonic`.
        """
        passed = now - self._sampled_at
        if count > self._count and self.problem:
            self.problem, self._regular, self._newest = "", 0, (0, 0.0)
        elif passed < _SAMPLE_S:
            return
        elif count > self._count:
            self._evaluate(*self._newest)
            self._newest = (count - self._count, passed)
        elif self._regular < _REGULAR_SAMPLES:
            self._regular, self._newest = 0, (0, 0.0)
        elif not self.problem and self._is_overdue(now):
            # No age: the text would change, and be reported again, every second.
            since = time.strftime(
                "%H:%M:%S", time.localtime(time.time() - (now - self._received_at))
            )
            self.problem = (
                f"nothing was received from {name} since {since} (it sent {self._rate:.0f} per "
                "second before); is it frozen, or cut off?"
            )
        if count > self._count:
            self._received_at = now
        self._sampled_at, self._count = now, count

    @property
    def period(self) -> float:
        """Seconds between two messages; 0 while it is not known to send regularly."""
        return 1 / self._rate if self._regular >= _REGULAR_SAMPLES else 0.0

    def _is_overdue(self, now: float) -> bool:
        limit = max(_MIN_SILENCE_S, _MISSED_INTERVALS / self._rate)
        return now - self._received_at >= limit

    def _evaluate(self, count: int, passed: float) -> None:
        """Update the rate by the messages of one sample."""
        if not count:
            return
        usual = self._rate * passed
        if self._regular and not usual / 2 - 1 <= count <= 2 * usual + 1:
            self._regular = 0
        rate = count / passed
        self._rate = rate if not self._regular else 0.7 * self._rate + 0.3 * rate
        self._regular += 1


#: Gaps of more than so many periods, and of more than so many seconds, may have held messages back.
_GAP_PERIODS, _MIN_GAP_S = 3, 0.3
#: Messages at the usual interval, and seconds of them, after which none is held back any more: if
#: packets get lost, a part of a backlog may arrive at that interval by chance.
_STEADY_MESSAGES, _STEADY_S = 3, 1.0
#: How long a period is remembered of a publisher that is not regular any more: a bad link makes
#: that of it.
_PERIOD_MEMORY_S = 15.0


class BacklogMonitor:
    """Estimates how late the messages of a regular publisher are that a link has held back.

    A gap of ten seconds in which messages were sent is followed by those messages: each that
    arrives earlier than at the usual interval makes up for a part of the gap. If messages arrive
    at the usual interval again, nothing is held back any more: the rest was dropped by the
    publisher, or not sent at all.

    A delay that stays the same is not noticed, nor is one of irregular publishers.

    Attributes:
        late: Seconds by which the last message is late.
        period: The usual interval between two messages in seconds, 0 if there is none.
        received_at: When the last message arrived, by :func:`time.monotonic`; 0 before the first.
    """

    def __init__(self) -> None:
        self.late = 0.0
        self.period = self._known_at = self.received_at = 0.0
        #: Messages at the usual interval, and since when.
        self._steady, self._steady_since = 0, 0.0

    def set_period(self, period: float, now: float) -> None:
        """Set the usual interval between two messages in seconds, 0 if there is none now."""
        if period:
            self.period, self._known_at = period, now
        elif now - self._known_at > _PERIOD_MEMORY_S:
            self.period = self.late = 0.0

    def add(self, count: int, now: float) -> None:
        """Add messages that arrived together, at least one; `now` by :func:`time.monotonic`."""
        before, self.received_at = self.received_at, now
        gap, period = now - before, self.period
        if not (period and before):
            return
        missing = gap - count * period
        if gap > max(_GAP_PERIODS * period, _MIN_GAP_S):
            # Not after reading in batches, which brings as many messages as fit into the gap.
            self.late = max(0.0, self.late + missing) if missing > period else 0.0
            self._steady = 0
        elif gap * 2 < count * period:
            self.late, self._steady = max(0.0, self.late + missing), 0
        else:
            if not self._steady:
                self._steady_since = before
            self._steady += count
            if self._steady >= _STEADY_MESSAGES and now - self._steady_since >= _STEADY_S:
                self.late = 0.0
