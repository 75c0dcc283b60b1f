"""Sorting messages that are nearly in order of time already."""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["by_time"]

#: Messages among which the order is put right.
_SORTED = 1000


def by_time(messages: Iterator[tuple[int, int, bytes]]) -> Iterator[tuple[int, int, bytes]]:
    """Yield messages (channel, time, data) in order of time, without holding a file in memory."""
    heap: list[tuple[int, int, int, bytes]] = []
    for order, (number, time, data) in enumerate(messages):
        heapq.heappush(heap, (time, order, number, data))
        if len(heap) > _SORTED:
            yield _unwrap(heapq.heappop(heap))
    while heap:
        yield _unwrap(heapq.heappop(heap))


def _unwrap(entry: tuple[int, int, int, bytes]) -> tuple[int, int, bytes]:
    time, _, number, data = entry
    return number, time, data
