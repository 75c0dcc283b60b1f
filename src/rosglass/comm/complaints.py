"""Naming faults of others in the log: each once, or those that repeat now and then."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import logging
    from collections.abc import Hashable

__all__ = ["Complaints", "FailureLog"]

#: Seconds between two log lines about what fails again and again.
_LOG_EVERY_S = 10.0


class Complaints:
    """Remembers what was complained about.

    Args:
        most: Complaints in all: a peer that changes its identity must not fill the log.
    """

    def __init__(self, most: int = 100) -> None:
        self._most = most
        #: Each with the call that made it: of two threads that complain, one is the first.
        self._made: dict[Hashable, object] = {}

    def fresh(self, about: Hashable) -> bool:
        """Return whether to complain about something, and remember it."""
        if about in self._made or len(self._made) >= self._most:
            return False
        mine = object()
        return self._made.setdefault(about, mine) is mine


class FailureLog:
    """Logs exceptions that repeat: the first one, then one every 10 s, with how many there were.

    A fast topic whose callback fails must not fill the log.

    Args:
        log: Where to.
    """

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._count, self._next = 0, -math.inf

    def exception(self, text: str, *args: object) -> None:
        """Log what was just caught, unless that was done a moment ago."""
        self._count += 1
        now = time.monotonic()
        if now >= self._next:
            self._next = now + _LOG_EVERY_S
            often = f", {self._count} times so far" if self._count > 1 else ""
            self._log.exception(text + "%s", *args, often)
