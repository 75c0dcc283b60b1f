"""What a node sends to its own subscriptions and servers, without a detour over Zenoh.

Zenoh would call back in the thread that sends. Where that is the main thread, Ctrl-C is most likely
to strike in the callback, and Zenoh swallows whatever that raises: a program would not end.
"""

from __future__ import annotations

import threading
from typing import Generic, TypeVar

__all__ = ["Places"]

_T = TypeVar("_T")


class Places(Generic[_T]):
    """Who is at a place: a topic or service, and its type."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._there: dict[tuple[str, str], tuple[_T, ...]] = {}

    def add(self, place: tuple[str, str], one: _T) -> None:
        """Add somebody."""
        with self._lock:
            self._there[place] = (*self._there.get(place, ()), one)

    def remove(self, place: tuple[str, str], one: _T) -> None:
        """Remove somebody, who may be gone already."""
        with self._lock:
            left = tuple(other for other in self._there.get(place, ()) if other is not one)
            if left:
                self._there[place] = left
            else:
                self._there.pop(place, None)

    def at(self, place: tuple[str, str]) -> tuple[_T, ...]:
        """Return who is there, in order of appearance."""
        return self._there.get(place, ())
