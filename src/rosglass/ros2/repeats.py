"""Recognising samples that arrive twice."""

from __future__ import annotations

__all__ = ["Repeats"]

#: Publishers remembered; more come only from a robot that restarts for days.
_MAX_PUBLISHERS = 1024
#: Gaps in the numbering that are remembered per publisher, in samples.
_MAX_MISSING = 64


class Repeats:
    """Tells whether a sample was seen before, by its publisher's identity, number and time stamp.

    A sample can come twice: over an old and a new route while links change, from a publisher's
    memory after a reconnection, or under two keys when a publisher serves two distributions. Late
    samples that were not seen are not repeats. Safe from several threads: the worst that a race
    does is let a repeat pass.
    """

    def __init__(self) -> None:
        self._last: dict[bytes, tuple[int, int]] = {}
        self._missing: dict[bytes, set[int]] = {}

    def seen(self, gid: bytes, sequence: int, sent: int | None) -> bool:
        """Return whether the sample is a repeat, and remember it.

        Samples without identity, number or time stamp are never repeats.
        """
        if not gid or sequence < 0 or sent is None:
            return False
        last = self._last.get(gid)
        if last is None:
            if len(self._last) >= _MAX_PUBLISHERS:
                self._last.clear()
                self._missing.clear()
        elif sequence > last[0]:
            if sequence > last[0] + 1:
                missing = self._missing.setdefault(gid, set())
                missing.update(range(max(last[0] + 1, sequence - _MAX_MISSING), sequence))
                if len(missing) > 2 * _MAX_MISSING:
                    self._missing[gid] = set(sorted(missing)[-_MAX_MISSING:])
        elif sent <= last[1]:
            missing = self._missing.get(gid, set())
            if sequence not in missing:
                return True
            missing.discard(sequence)
            return False
        self._last[gid] = (sequence, sent)
        return False
