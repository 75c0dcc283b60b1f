"""Naming faults of others in the log, each once."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Hashable

__all__ = ["Complaints"]


class Complaints:
    """Remembers what was complained about.

    Args:
        most: Complaints in all: a peer that changes its identity must not fill the log.
    """

    def __init__(self, most: int = 100) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._made: set[Hashable] = set()

    def fresh(self, about: Hashable) -> bool:
        """Return whether to complain about something, and remember it."""
        with self._lock:
            if about in self._made or len(self._made) >= self._most:
                return False
            self._made.add(about)
            return True
