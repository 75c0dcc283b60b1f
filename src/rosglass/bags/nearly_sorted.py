"""Sorting messages that are nearly in order of time already."""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

__all__ = ["by_time", "merge_chunks"]

#: A message: its channel, its time, its bytes.
_Message: TypeAlias = tuple[int, int, bytes]
#: Messages, and bytes of messages, among which the order is put right.
_SORTED = 1000
_SORTED_BYTES = 256 * 2**20
#: Bytes that a message costs beside its own.
_OVERHEAD = 200


class _Window:
    """Messages that are held back until no earlier one can follow."""

    def __init__(self) -> None:
        self._heap: list[tuple[int, int, int, bytes]] = []
        self._order = self._bytes = 0

    def __len__(self) -> int:
        return len(self._heap)

    def push(self, message: _Message) -> None:
        number, time, data = message
        self._order += 1
        self._bytes += len(data) + _OVERHEAD
        heapq.heappush(self._heap, (time, self._order, number, data))

    def pop(self) -> _Message:
        time, _, number, data = heapq.heappop(self._heap)
        self._bytes -= len(data) + _OVERHEAD
        return number, time, data

    def full(self) -> bool:
        return self._bytes > _SORTED_BYTES

    def earliest(self) -> int:
        return self._heap[0][0]


def by_time(messages: Iterable[_Message]) -> Iterator[_Message]:
    """Yield messages in order of time, without holding a file in memory."""
    window = _Window()
    for message in messages:
        window.push(message)
        while len(window) > _SORTED or window.full():
            yield window.pop()
    while len(window):
        yield window.pop()


def merge_chunks(chunks: Iterable[tuple[int, Iterable[_Message]]]) -> Iterator[_Message]:
    """Yield the messages of chunks, which may overlap, in order of time.

    Args:
        chunks: Of each the time of its first message, and its messages; sorted by that time.
    """
    window = _Window()
    for start, messages in chunks:
        while len(window) and window.earliest() < start:
            yield window.pop()
        for message in messages:
            window.push(message)
            while window.full():
                yield window.pop()
    while len(window):
        yield window.pop()
