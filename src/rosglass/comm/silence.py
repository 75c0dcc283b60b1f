"""Noticing that somebody who has sent regularly does so no more, although nobody has left.

A robot that is frozen, or cut off, closes no connection: the network finds out after some 14 s.
"""

from __future__ import annotations

import time

__all__ = ["Silence"]

#: Seconds between two looks that count.
_LOOK = 0.9
#: So many looks in a row at which about as much had come make somebody regular.
_LOOKS = 10
#: Silence is strange after so many of the usual intervals, and after so many seconds.
_INTERVALS, _SECONDS = 5, 1.0


class Silence:
    """Follows how regularly somebody sends, about once a second; costs what is sent nothing.

    Who sends less than once a second, or now more and now less, is never missed.

    Attributes:
        problem: What is strange about the silence, in words; empty as long as nothing is.
    """

    def __init__(self) -> None:
        self.problem = ""
        self._looked = self._came = 0.0
        self._count = self._regular = 0
        self._rate = 0.0
        #: What had come at the last look, and in how many seconds: judged only when more comes, as
        #: the last messages before a silence fill but a part of the time.
        self._newest = (0, 0.0)

    def follow(self, name: str, count: int, now: float) -> None:
        """Take note of how much has come.

        Args:
            name: Who sends it.
            count: How many messages have come in all.
            now: The time, by :func:`time.monotonic`.
        """
        passed = now - self._looked
        if count > self._count and self.problem:
            self.problem, self._regular, self._newest = "", 0, (0, 0.0)
        elif passed < _LOOK:
            return
        elif count > self._count:
            self._judge(*self._newest)
            self._newest = (count - self._count, passed)
        elif self._regular < _LOOKS:
            self._regular, self._newest = 0, (0, 0.0)
        elif not self.problem and now - self._came >= max(_SECONDS, _INTERVALS / self._rate):
            # No age: the text would be another one, and told again, every second.
            since = time.strftime("%H:%M:%S", time.localtime(time.time() - (now - self._came)))
            self.problem = (
                f"nothing has come from {name} since {since} (it sent {self._rate:.0f} per second "
                "before); is it frozen, or cut off?"
            )
        if count > self._count:
            self._came = now
        self._looked, self._count = now, count

    def _judge(self, came: int, passed: float) -> None:
        """Take note of what came between two looks."""
        if not came:
            return
        usual = self._rate * passed
        if self._regular and not usual / 2 - 1 <= came <= 2 * usual + 1:
            self._regular = 0
        rate = came / passed
        self._rate = rate if not self._regular else 0.7 * self._rate + 0.3 * rate
        self._regular += 1
