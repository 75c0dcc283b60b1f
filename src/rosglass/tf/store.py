"""What a transform buffer holds, and what it takes in.

Rules: tf2's ``BufferCore::setTransform``; but loops are refused when they would be closed, a frame
can change between static and moving, and one whose time jumped back is taken anew after a while.
"""

from __future__ import annotations

import math
from time import monotonic
from typing import NamedTuple

from rosglass.comm.time import Time
from rosglass.tf.cache import DynamicCache, Entry, StaticCache, clock_text
from rosglass.tf.frames import FrameInfo

__all__ = ["FrameStore"]

#: How far the squared length of a quaternion may be from 1, as in tf2.
_TOLERANCE = 10e-3
#: Seconds that a frame is only told of in times that are past before they count as the right ones.
_DOUBT = 3.0
_PREFIX = {
    "repeated": "TF_REPEATED_DATA ",
    "self": "TF_SELF_TRANSFORM ",
    "no name": "TF_NO_FRAME_ID ",
    "not finite": "TF_NAN_INPUT ",
    "not normalised": "TF_DENORMALIZED_QUATERNION ",
    "loop": "TF_LOOP ",
}
_WHY = {
    "repeated": "there is one of the same time already",
    "self": "the two are the same",
    "no name": "both frames need a name",
    "not finite": "a number in it is not finite",
    "not normalised": "its rotation is no quaternion of length 1; an empty one has w = 1",
    "loop": "the parent is itself placed in the child; find out which of the two is wrong",
}


class _Behind(NamedTuple):
    """What is too old to be taken, since when (seconds, monotonic), and its first stamp."""

    since: float
    first: int


class FrameStore:
    """The frames of a buffer, which locks it.

    Args:
        keep: How long transforms are kept, nanoseconds.

    Attributes:
        caches: What is known of each frame that has a parent.
        names: Every frame there is, parents included, in the order of their appearance.
        authorities: Who placed each frame last.
        arrivals: When something was last taken in for each frame, by :func:`time.monotonic`.
        version: Changes when frames come, go, or get another parent.
        disagreements: Frames that changed between static and moving, and by whom they were
            published before and now; for the buffer to tell people.
        jumps: Frames whose time jumped back, by how many nanoseconds, and who published them; as
            above.
    """

    def __init__(self, keep: int) -> None:
        self._keep = keep
        self.caches: dict[str, DynamicCache | StaticCache] = {}
        self.names: dict[str, None] = {}
        self.authorities: dict[str, object] = {}
        self.arrivals: dict[str, float] = {}
        self.version = 0
        self.disagreements: list[tuple[str, object, object]] = []
        self.jumps: list[tuple[str, int, object]] = []
        self._behind: dict[str, _Behind] = {}

    def put(
        self, child: str, stamp: int, entry: Entry, static: bool, authority: object
    ) -> tuple[str, str]:
        """Take a transform in.

        Returns:
            Why not, a key of :attr:`TransformBuffer.ignored`, empty when it is taken; and the
            frame's name without a slash.
        """
        cache = self.caches.get(child)
        # What comes all the time is quick: a known frame with the parent it had.
        if cache is not None and cache.parent == entry[0] and cache.static is static:
            kind = _bad_numbers(entry) or cache.insert(stamp, entry)
        else:
            child = child.removeprefix("/")
            kind = self._place(
                child, stamp, (entry[0].removeprefix("/"), *entry[1:]), static, authority
            )
        if kind == "old" and self._has_jumped(child, stamp):
            self.jumps.append((child, self.caches[child].latest - stamp, authority))
            self._remove(child)
            entry = (entry[0].removeprefix("/"), *entry[1:])
            kind = self._place(child, stamp, entry, static, authority)
        elif self._behind and kind != "old":
            # Somebody goes on in the time that was: what is old is just old.
            self._behind.pop(child, None)
        if not kind:
            self.authorities[child] = authority
        return kind, child

    def _has_jumped(self, child: str, stamp: int) -> bool:
        """Whether a frame is told of in times that are past by now, and in no others any more."""
        now, behind = monotonic(), self._behind.get(child)
        if behind is None or stamp < behind.first:
            self._behind[child] = _Behind(now, stamp)
            return False
        if now - behind.since < _DOUBT or stamp == behind.first:
            return False
        del self._behind[child]
        return True

    def told(self, kind: str, child: str, stamp: int, entry: Entry) -> str:
        """Return in words why a transform was not taken."""
        what = f"ignoring the transform of '{child}' in '{entry[0]}' at {clock_text(stamp)}: "
        if kind == "old":
            cache = self.caches[child]
            return (
                f"TF_OLD_DATA {what}it is more than {self._keep / 1e9:g} s older than the "
                f"newest one, of {clock_text(cache.latest)}; are the clocks in step?"
            )
        return _PREFIX[kind] + what + _WHY[kind]

    def clear(self, static: bool) -> set[str]:
        """Forget what moves, and what does not if `static`; returns the frames."""
        self._behind.clear()
        gone = {name for name, cache in self.caches.items() if static or not cache.static}
        for name in gone:
            self._remove(name)
        self.names = {}
        for name, cache in self.caches.items():
            self.names[cache.parent] = self.names[name] = None
        return gone

    def info(self, name: str) -> FrameInfo:
        """Return what is known of a frame, but for its authority."""
        cache = self.caches.get(name)
        if cache is None:
            return FrameInfo(name)
        latest = Time(cache.stamp)
        oldest = latest if cache.static else Time(cache.oldest)
        silence = monotonic() - self.arrivals.get(name, -math.inf)
        return FrameInfo(name, cache.parent, "", cache.static, latest, oldest, cache.count, silence)

    def _place(self, child: str, stamp: int, entry: Entry, static: bool, authority: object) -> str:
        """Take a transform in that is new in some way; returns why not."""
        parent = entry[0]
        if not child or not parent:
            return "no name"
        if child == parent:
            return "self"
        wrong = _bad_numbers(entry)
        if wrong:
            return wrong
        cache = self.caches.get(child)
        before = None if cache is None else (cache.parent, cache.static)
        if (cache is None or cache.parent != parent) and self._closes_loop(
            child, parent, None if static else stamp
        ):
            return "loop"
        if cache is None or cache.static is not static:
            if cache is not None:
                self.disagreements.append((child, self.authorities.get(child), authority))
            cache = StaticCache(stamp, entry) if static else DynamicCache(self._keep)
            self.caches[child] = cache
        kind = cache.insert(stamp, entry)
        if not kind:
            self.names[child] = self.names[parent] = None
            self.version += before != (cache.parent, static)
        return kind

    def _closes_loop(self, child: str, parent: str, stamp: int | None) -> bool:
        """Whether a link would close a loop, once outdated links made way for it."""
        path: list[str] = []
        frame = parent
        while frame != child:
            cache = self.caches.get(frame)
            if cache is None or len(path) > len(self.caches):
                return False
            path.append(frame)
            frame = cache.parent
        # A robot that turned its tree round would be lost until it is restarted otherwise.
        limit = -math.inf if stamp is None else stamp - self._keep
        old = [name for name in path if not (c := self.caches[name]).static and c.latest < limit]
        for name in old:
            self._remove(name)
        return not old

    def _remove(self, name: str) -> None:
        del self.caches[name]
        self.authorities.pop(name, None)
        self.arrivals.pop(name, None)
        self.version += 1


def _bad_numbers(entry: Entry) -> str:
    _, a, b, c, x, y, z, w = entry
    length = x * x + y * y + z * z + w * w
    # Only numbers that are finite give zero.
    if (a + b + c) * 0.0 != 0.0 or length * 0.0 != 0.0:
        return "not finite"
    return "" if abs(length - 1.0) < _TOLERANCE else "not normalised"
