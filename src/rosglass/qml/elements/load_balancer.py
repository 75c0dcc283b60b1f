"""Schedules the images that throttled streams fetch one by one, so that they are spread."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosglass.qml.engine.session import Session

__all__ = ["LoadBalancer"]

#: Number of future turns of each other stream that are considered.
_MOST_TURNS = 64
#: Maximum delay of a turn in seconds: later images would count as old.
_MOST_DELAY = 1.0


class LoadBalancer:
    """Schedules the images that throttled streams fetch one by one."""

    @classmethod
    def of(cls, session: Session) -> LoadBalancer:
        """Return the load balancer of a session."""
        balancer: LoadBalancer = session.shared.setdefault(cls, cls())
        return balancer

    def __init__(self) -> None:
        #: Whether streams may fetch single images; otherwise they receive all of them.
        self.enabled = True
        #: Time of each stream's next turn, and the interval between its turns, both in seconds.
        self._turns: dict[object, tuple[float, float]] = {}

    def place(self, stream: object, interval: float, now: float) -> float:
        """Return the time, in seconds, at which a stream should fetch its next image.

        A new stream gets the middle of the largest gap before `now` plus `interval`. After that,
        its turns are `interval` apart, or somewhat more to avoid the turn of another stream.

        Args:
            stream: The stream.
            interval: Wanted seconds between two images.
            now: The current time, seconds.
        """
        before = self._turns.pop(stream, None)
        if before is None:
            due = _widest(self._taken(now, now + interval), now, now + interval)
        else:
            wanted = max(before[0] + interval, now)
            shortest = min([interval, *(other for _, other in self._turns.values())])
            apart = shortest / (4 * (len(self._turns) + 1))
            due, latest = wanted, wanted + min(interval / 2, _MOST_DELAY)
            taken = self._taken(wanted - apart, latest + apart)
            if taken and min(abs(time - wanted) for time in taken) < apart:
                due = _widest(taken, wanted, latest)
        self._turns[stream] = (due, interval)
        return due

    def forget(self, stream: object) -> None:
        """Remove a stream from the schedule; safe for unknown streams."""
        self._turns.pop(stream, None)

    def _taken(self, begin: float, end: float) -> list[float]:
        """Return the turns of all streams between two times, sorted."""
        taken = []
        for due, interval in self._turns.values():
            first = max(0, math.ceil((begin - due) / interval))
            turns = (due + turn * interval for turn in range(first, first + _MOST_TURNS))
            taken += [time for time in turns if begin <= time <= end]
        return sorted(taken)


def _widest(taken: list[float], begin: float, end: float) -> float:
    """Return the middle of the largest gap between two times."""
    edges = [begin, *(time for time in taken if begin < time < end), end]
    gaps = [(after - before, before) for before, after in itertools.pairwise(edges)]
    width, start = max(gaps, key=lambda gap: gap[0])
    return start + width / 2
