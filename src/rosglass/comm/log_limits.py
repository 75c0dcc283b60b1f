"""Limits for repeated faults in the log: each is logged once, or at most one every 10 s."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import logging
    from collections.abc import Hashable

__all__ = ["FailureLog", "LogOnce"]

#: Shortest time between two log lines about a failure that repeats.
_LOG_PERIOD_S = 10.0


class LogOnce:
    """Remembers which faults were logged, so that each is logged once; thread-safe.

    Args:
        limit: Total number of faults to log: a peer that keeps changing its identity must not fill
            the log.
    """

    def __init__(self, limit: int = 100) -> None:
        self._limit = limit
        #: The call that logs each fault: of two threads with the same fault, only one is first.
        self._owners: dict[Hashable, object] = {}

    def is_first(self, fault: Hashable) -> bool:
        """Return True the first time that `fault` occurs, as long as the limit allows."""
        if fault in self._owners or len(self._owners) >= self._limit:
            return False
        call = object()
        return self._owners.setdefault(fault, call) is call


class FailureLog:
    """Logs repeated exceptions: the first one, then at most one every 10 s with their count.

    A callback that fails on every message of a fast topic must not fill the log.

    Args:
        log: The logger to write to.
    """

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._count, self._next_time = 0, -math.inf

    def exception(self, text: str, *args: object) -> None:
        """Log the exception that is being handled, unless one was logged less than 10 s ago."""
        self._count += 1
        now = time.monotonic()
        if now >= self._next_time:
            self._next_time = now + _LOG_PERIOD_S
            repeats = f", {self._count} times so far" if self._count > 1 else ""
            self._log.exception(text + "%s", *args, repeats)
