"""How much time has passed for those who watch a recording."""

from __future__ import annotations

import threading
import time

__all__ = ["PlayedTime"]


class PlayedTime:
    """Seconds by which ages are told; none pass while a recording stands still.

    They never run back, so that nothing old becomes new: to go to another place of the recording
    makes what is shown older by the distance. Methods may be called in any thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._value, self._since, self._speed = 0.0, time.monotonic(), 0.0

    def run(self, rate: float) -> None:
        """Pass at a recording's rate from now on, 0 for not at all.

        Never faster than for the operator: at ten times the speed, what is shown once per second
        would look ten seconds old.
        """
        with self._lock:
            self._settle()
            self._speed = min(rate, 1.0)

    def jump(self, seconds: float) -> None:
        """Pass by the distance to another place, in either direction."""
        with self._lock:
            self._value += abs(seconds)

    def now(self) -> float:
        """Return the seconds since the beginning."""
        with self._lock:
            self._settle()
            return self._value

    def _settle(self) -> None:
        now = time.monotonic()
        self._value += (now - self._since) * self._speed
        self._since = now
