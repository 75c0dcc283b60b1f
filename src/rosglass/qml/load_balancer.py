"""Spreading pictures that are fetched one by one over time, so that cameras never fire together."""

from __future__ import annotations

import itertools
import math

__all__ = ["LoadBalancer"]

#: How far the times of others are looked at, in numbers of their turns.
_MOST_TURNS = 64
#: By how many seconds a turn is put off at most: pictures that come later would count as old.
_MOST_DELAY = 1.0


class LoadBalancer:
    """Tells throttled streams when to fetch their next picture; knows no clock and no camera."""

    def __init__(self) -> None:
        #: Whether streams may receive single pictures; otherwise they receive all.
        self.enabled = True
        #: When each stream's turn is, and how far apart its turns are, seconds.
        self._turns: dict[object, tuple[float, float]] = {}

    def place(self, stream: object, interval: float, now: float) -> float:
        """Return when a stream is to fetch its next picture.

        A new one gets the middle of the largest gap before `now` plus `interval`. After that its
        turns are `interval` apart, or somewhat more where it would meet another.

        Args:
            stream: Who asks.
            interval: Seconds that it wants between two pictures.
            now: The time, seconds.
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
        """Give the turns of a stream to others; safe for one that has none."""
        self._turns.pop(stream, None)

    def _taken(self, begin: float, end: float) -> list[float]:
        """Return the turns of all streams within a time, in order."""
        taken = []
        for due, interval in self._turns.values():
            first = max(0, math.ceil((begin - due) / interval))
            turns = (due + turn * interval for turn in range(first, first + _MOST_TURNS))
            taken += [time for time in turns if begin <= time <= end]
        return sorted(taken)


def _widest(taken: list[float], begin: float, end: float) -> float:
    """Return the middle of the largest gap in a time."""
    edges = [begin, *(time for time in taken if begin < time < end), end]
    gaps = [(after - before, before) for before, after in itertools.pairwise(edges)]
    width, start = max(gaps, key=lambda gap: gap[0])
    return start + width / 2
