"""Noticing that something did not happen in time: messages, signs of life."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from rosglass.comm import Handle

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Duration, Timers

__all__ = ["Watchdog"]


class Watchdog(Handle):
    """Counts how often nothing happened for as long as a limit; costs what happens nothing.

    Args:
        timers: Runs the checks.
        limit: Longest time between two events.
        last: Returns when the last event was, by :func:`time.monotonic`; called on the timers'
            thread.
        missed: Called, on the same thread, with how many times the limit passed by.

    Attributes:
        limit: As given.
    """

    def __init__(
        self,
        timers: Timers,
        limit: Duration,
        last: Callable[[], float],
        missed: Callable[[int], None],
    ) -> None:
        self.limit = limit
        self._timers, self._period = timers, limit.seconds
        self._last, self._missed = last, missed
        self._lock = threading.Lock()
        self._closed = False
        self._since = time.monotonic()
        self._timer = timers.after(self._period, self._check)

    def close(self) -> None:
        """Count no more; safe to call twice."""
        with self._lock:
            self._closed = True
            timer = self._timer
        timer.close()

    def _check(self) -> None:
        if self._closed:
            return
        self._since = max(self._since, self._last())
        count = int((time.monotonic() - self._since) / self._period)
        if count:
            self._since += count * self._period
            self._missed(count)
        with self._lock:
            if not self._closed:
                left = self._since + self._period - time.monotonic()
                self._timer = self._timers.after(max(0.0, left), self._check)
