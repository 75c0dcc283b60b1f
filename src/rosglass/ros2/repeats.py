"""Recognising samples that arrive twice, and such that never arrive."""

from __future__ import annotations

__all__ = ["Repeats"]

#: Publishers remembered; more come only from a robot that restarts for days.
_MAX_PUBLISHERS = 1024
#: Gaps in the numbering that are remembered per publisher, in samples.
_MAX_MISSING = 64
_NOBODY = (-3, 0)


class Repeats:
    """Tells whether a sample was seen before, by its publisher's identity, number and time stamp.

    A sample can come twice: over an old and a new route while links change, from a publisher's
    memory after a reconnection, or under two keys when a publisher serves two distributions. Late
    samples that were not seen are not repeats. Safe from several threads: the worst that a race
    does is let a repeat pass.

    Attributes:
        lost: Numbers that were left out, so far.
        guarded: Whether samples without number are told apart by their time stamps: while one
            reader takes the place of another, whose last samples may come again. Not longer, as a
            publisher's clock may be set back.
    """

    def __init__(self) -> None:
        self.lost = 0
        self.guarded = False
        self._last: dict[bytes, tuple[int, int]] = {}
        self._missing: dict[bytes, set[int]] = {}

    def seen(self, gid: bytes, sequence: int, sent: int | None) -> bool:
        """Return whether the sample is a repeat, and remember it.

        Samples without identity, number or time stamp are never repeats.
        """
        if sent is None or not gid:
            return False
        last = self._last.get(gid, _NOBODY)
        if sequence == last[0] + 1:
            self._last[gid] = (sequence, sent)
            return False
        return self._judge(gid, sequence, sent, last)

    def latest(self, gid: bytes) -> tuple[int, int]:
        """Return number and time stamp of a publisher's last sample, to see whether more came."""
        return self._last.get(gid, _NOBODY)

    def _judge(self, gid: bytes, sequence: int, sent: int, last: tuple[int, int]) -> bool:
        """Decide on a sample that is not simply the next one."""
        if sequence < 0:
            repeated = self.guarded and sent <= last[1]
            if not repeated:
                self._remember(gid, -1, sent)
            return repeated
        if last[0] < 0:
            self._remember(gid, sequence, sent)
            return False
        if sequence > last[0]:
            self._leave_out(gid, last[0] + 1, sequence)
        elif sent <= last[1]:
            missing = self._missing.get(gid, set())
            if sequence not in missing:
                return True
            missing.discard(sequence)
            self.lost -= 1
            return False
        self._last[gid] = (sequence, sent)
        return False

    def _remember(self, gid: bytes, sequence: int, sent: int) -> None:
        if gid not in self._last and len(self._last) >= _MAX_PUBLISHERS:
            self._last.clear()
            self._missing.clear()
        self._last[gid] = (sequence, sent)

    def _leave_out(self, gid: bytes, first: int, end: int) -> None:
        self.lost += end - first
        missing = self._missing.setdefault(gid, set())
        missing.update(range(max(first, end - _MAX_MISSING), end))
        if len(missing) > 2 * _MAX_MISSING:
            self._missing[gid] = set(sorted(missing)[-_MAX_MISSING:])
