"""How much longer than usual samples were on their way, whatever the clocks say.

A link that was silent for ten seconds may hand on, all at once, what was sent meanwhile. By its
reception such a sample is new, by its contents it is old. The time stamps of publisher and receiver
come from two clocks, so that their difference says nothing by itself; but the fastest sample of a
publisher took about no time, and how much more another one took is its lateness.
"""

from __future__ import annotations

import time
from typing import NamedTuple

__all__ = ["Lateness"]

#: Publishers remembered; more come only from a robot that restarts for days.
_MAX_PUBLISHERS = 256
#: By how much two clocks run apart at worst; NTP lets a clock run wrong by no more (500 ppm).
_DRIFT = 500e-6
#: Steps of this machine's clock below this many nanoseconds are not looked for.
_STEP = 50_000_000


class _Publisher(NamedTuple):
    """What is known of a publisher, in nanoseconds."""

    fastest: int
    #: When that was brought up to date.
    at: int
    #: Its newest stamp.
    newest: int
    #: Whether the last sample was stamped before that: late itself, or by a clock set back.
    behind: bool


class Lateness:
    """Compares each publisher's samples with its fastest one.

    What a publisher's first sample cannot tell: it may be late itself. Either clock may be set
    meanwhile: a step of ours is measured, a publisher's step back shows in its stamps, and one
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
            fastest = min(took, known.fastest + round(max(0, received - known.at) * _DRIFT))
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
        if abs(step) < _STEP:
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
