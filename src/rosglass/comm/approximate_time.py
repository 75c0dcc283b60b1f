"""Synchronizes messages of several topics by their time stamps.

The policy is that of ROS's message_filters (``sync_policies::ApproximateTime``, described at
https://wiki.ros.org/message_filters/ApproximateTime): sets depend on stamps only, not on the order
of arrival; no message is in two sets; sets do not cross; of the sets around one message, the pivot,
the one with the shortest time span is chosen.
"""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

from rosglass.errors import ArgumentError

__all__ = ["ApproximateTime"]

_T = TypeVar("_T")
#: The age penalty: tenths of a later set's delay by which it must be shorter.
_AGE_PENALTY = 11


class ApproximateTime(Generic[_T]):
    """Finds sets of messages, one per topic, whose stamps are close together.

    The messages from the candidate set on are kept until no better set can follow: usually until
    the next message of each topic but the pivot's. Equal stamps match at once. Not thread-safe.

    Args:
        count: Number of topics, at least two.
        queue_size: Maximum number of waiting messages per topic; more drop the oldest.
        slop: Longest time span of a set in nanoseconds.

    Attributes:
        dropped: Number of messages that are in no set.

    Raises:
        ArgumentError: An argument is out of range.
    """

    def __init__(self, count: int, queue_size: int = 10, slop: int = 100_000_000) -> None:
        if count < 2:
            raise ArgumentError("topics", count, "at least two of them")
        if queue_size < 1:
            raise ArgumentError("queue size", queue_size, "at least 1")
        if slop < 0:
            raise ArgumentError("slop", slop, "a time of 0 or more")
        self._size, self._slop = queue_size, slop
        self._queues: list[deque[tuple[int, _T]]] = [deque() for _ in range(count)]
        #: Messages skipped since the candidate was found, starting with its own.
        self._past: list[list[tuple[int, _T]]] = [[] for _ in range(count)]
        self._newest: list[int | None] = [None] * count
        #: By topic, whether messages were dropped that could have made a better set.
        self._cut = [False] * count
        self._candidate: list[tuple[int, _T]] | None = None
        self._pivot = 0
        self._pivot_time = 0
        self.dropped = 0

    def add(self, index: int, stamp: int, item: _T) -> list[list[_T]]:
        """Add a message.

        A stamp older than the topic's last one, as when a recording restarts, discards all waiting
        messages.

        Args:
            index: Number of its topic.
            stamp: Its time in nanoseconds.
            item: The message.

        Returns:
            The sets that are complete now, each in the order of the topics.
        """
        newest = self._newest[index]
        if newest is not None and stamp < newest:
            self.clear()
        self._newest[index] = stamp
        found: list[list[_T]] = []
        queue = self._queues[index]
        queue.append((stamp, item))
        if len(queue) == 1:
            self._search(found)
        if len(queue) + len(self._past[index]) > self._size:
            searching = self._candidate is not None
            self._candidate = None
            self._recover()
            queue.popleft()
            self.dropped += 1
            self._cut[index] = True
            if searching:
                self._search(found)
        return found

    def clear(self) -> None:
        """Discard all waiting messages."""
        self.dropped += sum(map(len, self._queues)) + sum(map(len, self._past))
        for queue, past in zip(self._queues, self._past, strict=True):
            queue.clear()
            past.clear()
        self._newest = [None] * len(self._queues)
        self._cut = [False] * len(self._queues)
        self._candidate = None

    def _search(self, found: list[list[_T]]) -> None:
        while all(self._queues):
            heads = [queue[0][0] for queue in self._queues]
            first, last = min(heads), max(heads)
            start, end = heads.index(first), heads.index(last)
            for index in range(len(heads)):
                self._cut[index] &= index == end
            if self._candidate is None:
                if last - first > self._slop or self._cut[end]:
                    self._queues[start].popleft()
                    self.dropped += 1
                    continue
                self._make_candidate()
                self._pivot, self._pivot_time = end, last
            elif self._is_better(first, last):
                self._make_candidate()
            self._move_front_to_past(start)
            if start == self._pivot or self._is_late(last) or self._is_best():
                self._publish_candidate(found)

    def _bounds(self) -> tuple[int, int]:
        assert self._candidate is not None
        stamps = [stamp for stamp, _ in self._candidate]
        return min(stamps), max(stamps)

    def _is_better(self, first: int, last: int) -> bool:
        """Return whether the set from `first` to `last` is better than the candidate."""
        start, end = self._bounds()
        return (last - end) * _AGE_PENALTY < (first - start) * 10

    def _is_late(self, last: int) -> bool:
        """Return whether no set that ends at `last` or later can be better than the candidate."""
        start, end = self._bounds()
        return (last - end) * _AGE_PENALTY >= (self._pivot_time - start) * 10

    def _is_best(self) -> bool:
        """Return whether no better set can follow, whatever arrives on topics with empty queues."""
        if all(self._queues):
            return False
        at = [0] * len(self._queues)
        while True:
            # The next message of an empty queue has the pivot's stamp at best.
            heads = [
                queue[i][0] if i < len(queue) else max(self._newest_of(index), self._pivot_time)
                for index, (queue, i) in enumerate(zip(self._queues, at, strict=True))
            ]
            first, last = min(heads), max(heads)
            if self._is_late(last):
                return True
            if self._is_better(first, last):
                return False
            at[heads.index(first)] += 1

    def _newest_of(self, index: int) -> int:
        newest = self._newest[index]
        assert newest is not None
        return newest

    def _make_candidate(self) -> None:
        """Make the heads of the queues the candidate."""
        self._candidate = [queue[0] for queue in self._queues]
        for past in self._past:
            self.dropped += len(past)
            past.clear()

    def _move_front_to_past(self, index: int) -> None:
        self._past[index].append(self._queues[index].popleft())

    def _recover(self) -> None:
        for queue, past in zip(self._queues, self._past, strict=True):
            queue.extendleft(reversed(past))
            past.clear()

    def _publish_candidate(self, found: list[list[_T]]) -> None:
        assert self._candidate is not None
        found.append([item for _, item in self._candidate])
        self._candidate = None
        self._recover()
        for queue in self._queues:
            queue.popleft()
