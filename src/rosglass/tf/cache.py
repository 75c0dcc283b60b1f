"""What is known of one frame: where it was in its parent, over time.

Behaviour: tf2's ``TimeCache`` and ``StaticCache``.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import TypeAlias

from rosglass.tf.rotation import slerp

__all__ = ["DynamicCache", "Entry", "StaticCache", "clock_text"]

#: The parent's name, the translation (x, y, z) and the rotation (x, y, z, w).
Entry: TypeAlias = tuple[str, float, float, float, float, float, float, float]
#: Outdated entries that may wait to be cleared away together.
_SWEEP = 256


def clock_text(nanoseconds: int) -> str:
    """Return a time as tf2 writes it in messages."""
    return f"{nanoseconds // 1_000_000_000}.{nanoseconds % 1_000_000_000:09d}"


class StaticCache:
    """A frame that is always in the same place.

    Args:
        stamp: When that was said, nanoseconds.
        entry: Where it is.
    """

    __slots__ = ("entry", "stamp")
    static = True
    #: How many transforms there are, and between which times; tf2 counts static ones like this.
    count, latest, oldest = 1, 0, 0

    def __init__(self, stamp: int, entry: Entry) -> None:
        self.stamp, self.entry = stamp, entry

    @property
    def parent(self) -> str:
        """The parent frame."""
        return self.entry[0]

    def insert(self, stamp: int, entry: Entry) -> str:
        """Take the place of what was known; always."""
        self.stamp, self.entry = stamp, entry
        return ""

    def at(self, time: int) -> Entry | None:  # noqa: ARG002 - the same at all times
        """Return where it is."""
        return self.entry

    def gap(self, time: int) -> str:  # noqa: ARG002 - as above
        """Return nothing: a static frame is known at all times."""
        return ""


class DynamicCache:
    """A frame that moves; holds what came within the last seconds before the newest.

    Args:
        keep: How long, nanoseconds.
    """

    __slots__ = ("_entries", "_first", "_keep", "_stamps")
    static = False

    def __init__(self, keep: int) -> None:
        self._keep = keep
        #: In order of time; those before `_first` are outdated.
        self._stamps: list[int] = []
        self._entries: list[Entry] = []
        self._first = 0

    @property
    def count(self) -> int:
        """How many transforms there are."""
        return len(self._stamps) - self._first

    @property
    def latest(self) -> int:
        """Time of the newest, nanoseconds."""
        return self._stamps[-1]

    @property
    def stamp(self) -> int:
        """The same as :attr:`latest`."""
        return self._stamps[-1]

    @property
    def oldest(self) -> int:
        """Time of the oldest, nanoseconds."""
        return self._stamps[self._first]

    @property
    def parent(self) -> str:
        """The parent frame in the newest."""
        return self._entries[-1][0]

    def insert(self, stamp: int, entry: Entry) -> str:
        """Take an entry in; returns why not: ``old`` or ``repeated``, empty when it is taken."""
        stamps = self._stamps
        if not stamps or stamp > stamps[-1]:
            stamps.append(stamp)
            self._entries.append(entry)
            limit = stamp - self._keep
            if stamps[self._first] < limit:
                self._prune(limit)
            return ""
        if stamp < stamps[-1] - self._keep:
            return "old"
        place = bisect_right(stamps, stamp, self._first)
        if place > self._first and stamps[place - 1] == stamp:
            return "repeated"
        stamps.insert(place, stamp)
        self._entries.insert(place, entry)
        return ""

    def at(self, time: int) -> Entry | None:
        """Return where it was; None when that is not known, and :meth:`gap` says why.

        Args:
            time: Nanoseconds, 0 for the newest.
        """
        stamps = self._stamps
        if not time or time == stamps[-1]:
            return self._entries[-1]
        if not stamps[self._first] <= time < stamps[-1]:
            return None
        place = bisect_right(stamps, time, self._first)
        then, entry = stamps[place - 1], self._entries[place - 1]
        other = self._entries[place]
        # Between two parents, as in tf2, the older one holds.
        if then == time or entry[0] != other[0]:
            return entry
        ratio = (time - then) / (stamps[place] - then)
        rest = 1.0 - ratio
        return (
            entry[0],
            rest * entry[1] + ratio * other[1],
            rest * entry[2] + ratio * other[2],
            rest * entry[3] + ratio * other[3],
            *slerp(entry[4:], other[4:], ratio),
        )

    def gap(self, time: int) -> str:
        """Return why nothing is known of a time."""
        if self.count == 1:
            return (
                f"Lookup would require extrapolation at time {clock_text(time)}, but only time "
                f"{clock_text(self.latest)} is in the buffer"
            )
        if time > self.latest:
            return (
                "Lookup would require extrapolation into the future.  Requested time "
                f"{clock_text(time)} but the latest data is at time {clock_text(self.latest)}"
            )
        return (
            "Lookup would require extrapolation into the past.  Requested time "
            f"{clock_text(time)} but the earliest data is at time {clock_text(self.oldest)}"
        )

    def _prune(self, limit: int) -> None:
        stamps, first = self._stamps, self._first
        while stamps[first] < limit:
            first += 1
        if first > _SWEEP:
            del stamps[:first]
            del self._entries[:first]
            first = 0
        self._first = first
