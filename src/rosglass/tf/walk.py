"""The ways through the tree of frames: from a frame up, and up from another, to where they meet.

Behaviour, step by step: tf2's ``BufferCore`` (``walkToTopParent``, ``getLatestCommonTime``), so
that the same question gets the same answer, and the same exception.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.errors import ConnectivityException, ExtrapolationException, LookupException
from rosglass.tf.rotation import conjugate, multiply, rotate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.errors import TransformException
    from rosglass.tf.cache import DynamicCache, StaticCache
    from rosglass.tf.rotation import Quaternion, Vector

__all__ = ["common_time", "links_between", "look_up", "root_of"]

_ORIGIN: Vector = (0.0, 0.0, 0.0)
_UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)


def root_of(caches: Mapping[str, DynamicCache | StaticCache], frame: str) -> str:
    """Return the top of the tree that a frame is in now."""
    for _ in range(len(caches) + 1):
        cache = caches.get(frame)
        if cache is None:
            break
        frame = cache.parent
    return frame


def links_between(
    caches: Mapping[str, DynamicCache | StaticCache], target: str, source: str
) -> tuple[list[str], list[str]] | None:
    """Return the frames below the one where both ways up meet: from the source, from the target.

    Returns:
        None when they do not meet.
    """
    up = [source]
    while up[-1] in caches and len(up) <= len(caches) + 1:
        up.append(caches[up[-1]].parent)
    places = {frame: place for place, frame in reversed(list(enumerate(up)))}
    down: list[str] = []
    frame = target
    while frame not in places:
        cache = caches.get(frame)
        if cache is None or len(down) > len(caches):
            return None
        down.append(frame)
        frame = cache.parent
    return up[: places[frame]], down


def common_time(caches: Mapping[str, DynamicCache | StaticCache], target: str, source: str) -> int:
    """Return the newest time at which every link between two frames is known, nanoseconds.

    Zero when all links are static.

    Raises:
        ConnectivityException: Nothing connects them.
        LookupException: The frames form a loop.
    """
    found = links_between(caches, target, source)
    if found is None:
        for frame in (source, target):
            _check_loop(caches, frame)
        raise _unconnected(caches, target, source)
    up, down = found
    stamps = [caches[frame].latest for frame in (*up, *down)]
    return min((stamp for stamp in stamps if stamp), default=0)


def look_up(
    caches: Mapping[str, DynamicCache | StaticCache], target: str, source: str, time: int
) -> tuple[Vector, Quaternion]:
    """Return where `source` is in `target` at a time (nanoseconds, 0 for the newest of each link).

    Raises:
        ConnectivityException: Nothing connects them.
        ExtrapolationException: A link is not known at that time.
        LookupException: The frames form a loop.
    """
    most = len(caches) + 1
    # Up from the source, to the target or to where the data ends.
    frame, depth = source, 0
    moved, turned = _ORIGIN, _UPRIGHT
    gap = ""
    while True:
        cache = caches.get(frame)
        if cache is None:
            break
        entry = cache.at(time)
        if entry is None:
            # The target's way up may meet this one before.
            gap = _gap(frame, cache.gap(time), target, source)
            break
        if frame == target:
            return moved, turned
        x, y, z = rotate(entry[4:], moved)
        moved = (x + entry[1], y + entry[2], z + entry[3])
        turned = multiply(entry[4:], turned)
        frame = entry[0]
        depth += 1
        if depth > most:
            raise _loop(frame)
    top = frame
    # Up from the target.
    frame, depth = target, 0
    offset, tilt = _ORIGIN, _UPRIGHT
    while frame != top:
        cache = caches.get(frame)
        if cache is None:
            break
        entry = cache.at(time)
        if entry is None:
            raise ExtrapolationException(_gap(frame, cache.gap(time), target, source))
        if frame == source:
            back = conjugate(tilt)
            return rotate(back, (-offset[0], -offset[1], -offset[2])), back
        x, y, z = rotate(entry[4:], offset)
        offset = (x + entry[1], y + entry[2], z + entry[3])
        tilt = multiply(entry[4:], tilt)
        frame = entry[0]
        depth += 1
        if depth > most:
            raise _loop(frame)
    if frame != top:
        raise ExtrapolationException(gap) if gap else _unconnected(caches, target, source)
    back = conjugate(tilt)
    between = (moved[0] - offset[0], moved[1] - offset[1], moved[2] - offset[2])
    return rotate(back, between), multiply(back, turned)


def _gap(frame: str, gap: str, target: str, source: str) -> str:
    return f"{gap} for '{frame}', when looking up transform from frame [{source}] to [{target}]"


def _unconnected(
    caches: Mapping[str, DynamicCache | StaticCache], target: str, source: str
) -> TransformException:
    return ConnectivityException(
        f"Could not find a connection between '{target}' and '{source}' because they are not part "
        f"of the same tree. Tf has two or more unconnected trees: '{target}' belongs to "
        f"'{root_of(caches, target)}', '{source}' to '{root_of(caches, source)}'; "
        "publish what connects them"
    )


def _loop(frame: str) -> TransformException:
    return LookupException(
        f"The tf tree is invalid because it contains a loop, with '{frame}' in it: find out which "
        "of its publishers is wrong"
    )


def _check_loop(caches: Mapping[str, DynamicCache | StaticCache], frame: str) -> None:
    if root_of(caches, frame) in caches:
        raise _loop(frame)
