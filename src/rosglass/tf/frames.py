"""The frames of a transform buffer: their caches, the tree, and lookups through it.

Behaviour: tf2's ``BufferCore``, ``TimeCache`` and ``StaticCache``; values and exceptions are equal.
But loops are refused when they would be closed, a frame can change between static and dynamic, and
a frame whose time jumped back is accepted again after a while.
"""

from __future__ import annotations

import json
import math
import re
from bisect import bisect_right
from collections import Counter, deque
from dataclasses import dataclass, field
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from rosglass.comm.statistics import fading_rate
from rosglass.comm.time import Time
from rosglass.errors import (
    ConnectivityException,
    ExtrapolationException,
    LookupException,
    TransformException,
)
from rosglass.tf.transform import conjugate, multiply, rotate, slerp

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rosglass.comm.time import Duration
    from rosglass.tf.transform import Quaternion, Vector

__all__ = [
    "DynamicCache",
    "Entry",
    "FrameInfo",
    "FrameStore",
    "FrameTree",
    "StaticCache",
    "clock_text",
    "common_time",
    "links_between",
    "look_up",
    "look_up_newest",
    "root_of",
]


_PLAIN = re.compile(r"[A-Za-z_][\w./-]*")


@dataclass(frozen=True, slots=True)
class FrameInfo:
    """The state of a frame.

    Attributes:
        name: Its name.
        parent: Parent frame; empty for the root of a tree.
        authority: Publisher of the last transform, usually a node's full name; empty if unknown.
        static: Whether it is static.
        latest: Time of the newest transform; of a static one, its stamp. None without a parent.
        oldest: Time of the oldest transform in the buffer.
        count: Number of transforms in the buffer.
        silence: Seconds since the last transform was received, by this machine's clock, or should
            have been if it was delayed.
    """

    name: str
    parent: str = ""
    authority: str = ""
    static: bool = False
    latest: Time | None = None
    oldest: Time | None = None
    count: int = 0
    silence: float = field(default=0.0, compare=False)

    @property
    def rate(self) -> float:
        """Rate of transforms in Hz, by their stamps; 0 for static frames and without new ones."""
        if self.static or self.latest is None or self.oldest is None or self.count < 2:
            return 0.0
        period = (self.latest - self.oldest).seconds / (self.count - 1)
        return fading_rate(period, self.silence)

    def age(self, now: Time) -> Duration | None:
        """Return the age of the newest transform at a time; None without a parent."""
        return None if self.latest is None else now - self.latest


class FrameTree:
    """A snapshot of all frames of a buffer; iterates over their names.

    Args:
        frames: The frames, including all parents.
    """

    def __init__(self, frames: Iterable[FrameInfo]) -> None:
        self._frames = {frame.name: frame for frame in frames}

    def __iter__(self) -> Iterator[str]:
        return iter(self._frames)

    def __len__(self) -> int:
        return len(self._frames)

    def __contains__(self, name: object) -> bool:
        return name in self._frames

    def __getitem__(self, name: str) -> FrameInfo:
        try:
            return self._frames[name]
        except KeyError:
            raise LookupException(f"frame '{name}' does not exist") from None

    def roots(self) -> list[str]:
        """Return the frames without a parent; several if there are unconnected trees."""
        return [name for name, frame in self._frames.items() if not frame.parent]

    def children(self, name: str) -> list[str]:
        """Return the children of a frame; raises LookupException."""
        parent = self[name].name
        return [other for other, frame in self._frames.items() if frame.parent == parent]

    def ancestors(self, name: str) -> list[str]:
        """Return a frame's parent, its parent, and so on; raises LookupException."""
        found: dict[str, None] = {}
        frame = self[name]
        while frame.parent and frame.parent not in found:
            found[frame.parent] = None
            frame = self[frame.parent]
        return list(found)

    def chain(self, target: str, source: str) -> list[str]:
        """Return the frames from `source` to `target`, both included.

        Raises:
            LookupException: One of them does not exist.
            ConnectivityException: They are not connected.
        """
        up, down = [source, *self.ancestors(source)], [target, *self.ancestors(target)]
        places = {frame: place for place, frame in enumerate(up)}
        for place, frame in enumerate(down):
            if frame in places:
                return [*up[: places[frame] + 1], *reversed(down[:place])]
        raise ConnectivityException(
            f"nothing connects '{target}', which belongs to '{down[-1]}', and '{source}', which "
            f"belongs to '{up[-1]}'"
        )

    def to_yaml(self, now: Time | None = None) -> str:
        """Return all frames with a parent in the format of tf2's ``all_frames_as_yaml()``.

        Args:
            now: Current time, for the delay of each frame; None to leave it out.
        """
        lines = []
        for frame in self._frames.values():
            if frame.latest is None or frame.oldest is None:
                continue
            # tf2 has no time for static transforms, and counts 10,000 Hz.
            static = frame.static
            latest = 0.0 if static else frame.latest.seconds
            oldest = 0.0 if static else frame.oldest.seconds
            rate = frame.count / max(latest - oldest, 0.0001)
            lines += [
                f"{_key(frame.name)}: ",
                f"  parent: {_quoted(frame.parent)}",
                f"  broadcaster: {_quoted(frame.authority or 'no recorded authority')}",
                f"  rate: {rate:.3f}",
                f"  most_recent_transform: {latest:.3f}",
                f"  oldest_transform: {oldest:.3f}",
            ]
            if now is not None:
                lines.append(f"  transform_delay: {now.seconds - latest:.3f}")
            lines.append(f"  buffer_length: {latest - oldest:.3f}")
        return "\n".join(lines) + "\n" if lines else "{}"


def _key(name: str) -> str:
    return name if _PLAIN.fullmatch(name) else json.dumps(name)


def _quoted(text: str) -> str:
    return f"'{text}'" if text.isprintable() and "'" not in text else json.dumps(text)


#: The parent's name, the translation (x, y, z) and the rotation (x, y, z, w).
Entry: TypeAlias = tuple[str, float, float, float, float, float, float, float]
#: Links between a frame and its root that are followed, as in tf2.
_MAX_DEPTH = 1000
#: Number of outdated entries to delete at once.
_PRUNE_SIZE = 256
#: Letters of a frame's name, and names of one publisher and of all: a peer may send any number.
_MAX_NAME_LENGTH, _MAX_NAMES, _MAX_ALL_NAMES = 255, 10_000, 50_000
#: Seconds between two searches for frames that can make room for others.
_FORGET_PERIOD_S = 1.0
#: Links that one lookup of many frames follows, far beyond those of a robot.
_MAX_LINKS = 50_000


def clock_text(nanoseconds: int) -> str:
    """Format a time as in tf2's error messages."""
    return f"{nanoseconds // 1_000_000_000}.{nanoseconds % 1_000_000_000:09d}"


class StaticCache:
    """The transform of a static frame.

    Args:
        stamp: Its stamp in nanoseconds.
        entry: The transform.
    """

    __slots__ = ("entry", "moves", "stamp")
    static = True
    #: Number and times of the transforms, as tf2 counts static ones.
    count, latest, oldest = 1, 0, 0

    def __init__(self, stamp: int, entry: Entry) -> None:
        self.stamp, self.entry = stamp, entry
        #: Counts changes.
        self.moves = 0

    @property
    def parent(self) -> str:
        """Parent frame."""
        return self.entry[0]

    def insert(self, stamp: int, entry: Entry) -> str:
        """Replace the transform."""
        self.moves += entry != self.entry
        self.stamp, self.entry = stamp, entry
        return ""

    def at(self, time: int) -> Entry | None:  # noqa: ARG002 - the same at all times
        """Return the transform."""
        return self.entry

    def gap(self, time: int) -> str:  # noqa: ARG002 - as above
        """Return an empty text: a static transform is valid at all times."""
        return ""


class DynamicCache:
    """The transforms of a dynamic frame.

    Args:
        keep: Time before the newest transform to keep, in nanoseconds.
    """

    __slots__ = ("_entries", "_first", "_keep", "_stamps", "moved", "moves")
    static = False

    def __init__(self, keep: int) -> None:
        self._keep = keep
        #: Sorted by time; those before `_first` are outdated.
        self._stamps: list[int] = []
        self._entries: list[Entry] = []
        self._first = 0
        #: Counts transforms that differ from the one before, and the stamp of the last of them.
        self.moves = self.moved = 0

    @property
    def count(self) -> int:
        """Number of transforms."""
        return len(self._stamps) - self._first

    @property
    def latest(self) -> int:
        """Time of the newest transform in nanoseconds."""
        return self._stamps[-1]

    @property
    def stamp(self) -> int:
        """The same as :attr:`latest`."""
        return self._stamps[-1]

    @property
    def oldest(self) -> int:
        """Time of the oldest transform in nanoseconds."""
        return self._stamps[self._first]

    @property
    def parent(self) -> str:
        """Parent frame of the newest transform."""
        return self._entries[-1][0]

    def insert(self, stamp: int, entry: Entry) -> str:
        """Insert a transform; return why it is refused, ``old`` or ``repeated``, or empty."""
        stamps = self._stamps
        if not stamps or stamp > stamps[-1]:
            if not stamps or entry != self._entries[-1]:
                self.moves, self.moved = self.moves + 1, stamp
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
        self.moves, self.moved = self.moves + 1, stamps[-1]
        return ""

    def at(self, time: int) -> Entry | None:
        """Return the interpolated transform at a time; None if there is none, see :meth:`gap`.

        Args:
            time: Time in nanoseconds, 0 for the newest.
        """
        stamps = self._stamps
        if not time or time == stamps[-1]:
            return self._entries[-1]
        if not stamps[self._first] <= time < stamps[-1]:
            return None
        place = bisect_right(stamps, time, self._first)
        then, entry = stamps[place - 1], self._entries[place - 1]
        other = self._entries[place]
        # Between two parents, the older one is valid, as in tf2.
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
        """Return why there is no transform at a time, as in tf2."""
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
        if first > _PRUNE_SIZE:
            del stamps[:first]
            del self._entries[:first]
            first = 0
        self._first = first


#: Frames up to which it is found out whether they move.
_MAX_RESTING = 2000
#: How far the squared length of a quaternion may be from 1, as in tf2.
_TOLERANCE = 10e-3
#: Changes of a frame's parent within some seconds that show two publishers, not a move.
_MIN_MOVES, _MOVES_S = 3, 10.0
#: Frames whose changes of parent, and loops, are kept.
_MAX_FAULTS = 1000
#: Frames of a loop that a text names.
_MAX_CHAIN = 8
#: Seconds of old stamps only after which the time of a frame counts as jumped back.
_JUMP_TIME_S = 3.0
_PREFIX = {
    "repeated": "TF_REPEATED_DATA ",
    "self": "TF_SELF_TRANSFORM ",
    "no name": "TF_NO_FRAME_ID ",
    "not finite": "TF_NAN_INPUT ",
    "not normalised": "TF_DENORMALIZED_QUATERNION ",
    "loop": "TF_LOOP ",
    "too deep": "",
    "long name": "",
    "too many": "",
}
_REASON = {
    "repeated": "there is one of the same time already",
    "self": "the two are the same",
    "no name": "both frames need a name",
    "not finite": "a number in it is not finite",
    "not normalised": "its rotation is not a quaternion of length 1; the identity has w = 1",
    "loop": "the parent is itself placed in the child; find out which of the two is wrong",
    "too deep": f"the parent is below more than {_MAX_DEPTH} other frames; find out who names them",
    "long name": f"names of frames have at most {_MAX_NAME_LENGTH} letters",
    "too many": f"at most {_MAX_NAMES} names of frames are kept for each publisher, and "
    f"{_MAX_ALL_NAMES} for all; let it use names again instead of new ones",
}


class _Move(NamedTuple):
    """A transform with another parent than the one before; the time is monotonic, in seconds."""

    time: float
    before: str
    authority_before: object
    parent: str
    authority: object
    static: bool


class _Behind(NamedTuple):
    """The start of a series of old transforms: monotonic time in seconds, and first stamp."""

    since: float
    first: int


class FrameStore:
    """The frames of a buffer; guarded by the buffer's lock.

    Args:
        keep: Time to keep transforms in nanoseconds.

    Attributes:
        caches: The transforms of each frame with a parent.
        names: All frames, including parents, in order of appearance, each with the publisher that
            named it first.
        authorities: Publisher of the last transform of each frame.
        arrivals: Time of the last transform of each frame, by :func:`time.monotonic`; earlier by
            what it was late.
        version: Changes when frames appear, disappear, or change their parent.
        disagreements: Frames that changed between static and dynamic, with their publishers before
            and now; for the buffer to log.
        jumps: Frames whose time jumped back, by how many nanoseconds, and their publishers; for the
            buffer to log.
        moved_to: The last transforms of a frame that had another parent than the one before, each
            with that parent and both publishers, by frame.
        loops: The last transform of a frame that was refused because it closes a loop, by frame.
    """

    def __init__(self, keep: int) -> None:
        self._keep = keep
        self.caches: dict[str, DynamicCache | StaticCache] = {}
        self.names: dict[str, object] = {}
        self.authorities: dict[str, object] = {}
        self.arrivals: dict[str, float] = {}
        self.version = 0
        self.disagreements: list[tuple[str, object, object]] = []
        self.jumps: list[tuple[str, int, object]] = []
        self.moved_to: dict[str, deque[_Move]] = {}
        self.loops: dict[str, _Move] = {}
        self._behind: dict[str, _Behind] = {}
        #: Number of names by publisher, and when its outdated ones were last searched; those of
        #: all by None.
        self._counts: Counter[object] = Counter()
        self._forgot_at: dict[object | None, float] = {}
        #: Number of accepted transforms.
        self._stored = 0

    def put(
        self, child: str, stamp: int, entry: Entry, static: bool, authority: object
    ) -> tuple[str, str]:
        """Insert a transform.

        Returns:
            Why it is refused, a key of :attr:`TransformBuffer.ignored`, or empty; and the frame's
            name without leading slash.
        """
        cache = self.caches.get(child)
        # The common case is fast: a known frame with an unchanged parent.
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
            # Transforms with current stamps continue: old ones are just old.
            self._behind.pop(child, None)
        if not kind:
            self.authorities[child] = authority
            self._stored += 1
        return kind, child

    def _has_jumped(self, child: str, stamp: int) -> bool:
        """Return whether a frame has had only old stamps for a while."""
        now, behind = monotonic(), self._behind.get(child)
        if behind is None or stamp < behind.first:
            self._behind[child] = _Behind(now, stamp)
            return False
        if now - behind.since < _JUMP_TIME_S or stamp == behind.first:
            return False
        del self._behind[child]
        return True

    def describe(self, kind: str, child: str, stamp: int, entry: Entry) -> str:
        """Describe why a transform was refused."""
        child_name, parent = _shortened(child), _shortened(entry[0])
        what = f"ignoring the transform of '{child_name}' in '{parent}' at {clock_text(stamp)}: "
        if kind == "old":
            cache = self.caches[child]
            return (
                f"TF_OLD_DATA {what}it is more than {self._keep / 1e9:g} s older than the "
                f"newest one, of {clock_text(cache.latest)}; are the clocks in step?"
            )
        return _PREFIX[kind] + what + _REASON[kind]

    def clear(self, static: bool) -> set[str]:
        """Remove dynamic frames, and static ones if `static`; return their names."""
        self._behind.clear()
        self.moved_to.clear()
        self.loops.clear()
        gone = {name for name, cache in self.caches.items() if static or not cache.static}
        for name in gone:
            self._remove(name)
        before, self.names = self.names, {}
        for name, cache in self.caches.items():
            for one in (cache.parent, name):
                self.names[one] = before[one]
        self._counts = Counter(self.names.values())
        return gone

    def info(self, name: str, authority: str) -> FrameInfo:
        """Return the state of a frame, whose last transform is from `authority`."""
        cache = self.caches.get(name)
        if cache is None:
            return FrameInfo(name)
        latest = Time(cache.stamp)
        oldest = latest if cache.static else Time(cache.oldest)
        silence = monotonic() - self.arrivals.get(name, -math.inf)
        return FrameInfo(
            name, cache.parent, authority, cache.static, latest, oldest, cache.count, silence
        )

    def rest(self) -> tuple[int, int] | None:
        """Return a value that is the same while no frame moves; None while one may still move.

        The last move of a frame is seen by all lookups once each frame is known at a later time.
        For more frames than a robot has, it changes with each transform.
        """
        if len(self.caches) > _MAX_RESTING:
            return self.version, -self._stored
        moving = [cache for cache in self.caches.values() if isinstance(cache, DynamicCache)]
        known = min((cache.latest for cache in moving), default=0)
        if any(cache.moved > known for cache in moving):
            return None
        return self.version, sum(cache.moves for cache in self.caches.values())

    def _place(self, child: str, stamp: int, entry: Entry, static: bool, authority: object) -> str:
        """Insert a transform of a new frame or parent; return why it is refused."""
        parent = entry[0]
        if not child or not parent:
            return "no name"
        if child == parent:
            return "self"
        wrong = _bad_numbers(entry) or self._find_room((child, parent), authority)
        if wrong:
            return wrong
        cache = self.caches.get(child)
        before = None if cache is None else (cache.parent, cache.static)
        # A frame that is new has nothing below it.
        if child in self.names and (cache is None or cache.parent != parent):
            wrong = self._closes_loop(child, parent, None if static else stamp)
            if wrong == "loop":
                _keep(self.loops, child, _Move(monotonic(), "", None, parent, authority, static))
            if wrong:
                return wrong
        if cache is not None and cache.parent != parent:
            before_it = self.authorities.get(child)
            move = _Move(monotonic(), cache.parent, before_it, parent, authority, static)
            if child not in self.moved_to:
                _keep(self.moved_to, child, deque(maxlen=_MIN_MOVES))
            self.moved_to[child].append(move)
        if cache is None or cache.static is not static:
            if cache is not None:
                self.disagreements.append((child, self.authorities.get(child), authority))
            cache = StaticCache(stamp, entry) if static else DynamicCache(self._keep)
            self.caches[child] = cache
        kind = cache.insert(stamp, entry)
        if not kind:
            new = self._new_among((child, parent))
            self.names.update(dict.fromkeys(new, authority))
            self._counts[authority] += len(new)
            self.loops.pop(child, None)
            self.version += before != (cache.parent, static)
        return kind

    def faults(self) -> dict[str, tuple[object, ...]]:
        """Return what is wrong with the place of frames in the tree, by frame.

        Each is a text in parts; every second part is a publisher, whose name is looked up in the
        graph, and so without the lock.
        """
        now = monotonic()
        found: dict[str, tuple[object, ...]] = {}
        for child, moves in self.moved_to.items():
            last = moves[-1]
            # Static transforms are sent once.
            both = last.static and last.authority != last.authority_before
            if both or (len(moves) == _MIN_MOVES and now - moves[0].time < _MOVES_S):
                found[child] = (
                    f"two parents: '{last.before}' from ",
                    last.authority_before,
                    f" and '{last.parent}' from ",
                    last.authority,
                )
        for child, refused in self.loops.items():
            if not refused.static and now - refused.time > _MOVES_S:
                continue
            chain = [child, refused.parent]
            while (cache := self.caches.get(chain[-1])) and len(chain) < _MAX_CHAIN:
                chain.append(cache.parent)
                if chain[-1] == child:
                    break
            found[child] = (
                f"a cycle: {' in '.join(chain)}; the transform in '{refused.parent}' from ",
                refused.authority,
                " is ignored",
            )
        return found

    def _new_among(self, names: Sequence[str]) -> list[str]:
        return [name for name in names if name not in self.names]

    def _find_room(self, names: Sequence[str], authority: object) -> str:
        """Return why a publisher cannot name these frames; outdated ones make room for new ones."""
        new = self._new_among(names)
        if not new:
            return ""
        if max(map(len, new)) > _MAX_NAME_LENGTH:
            return "long name"
        if self._counts[authority] + len(new) > _MAX_NAMES:
            self._forget_outdated(authority)
        elif len(self.names) + len(new) > _MAX_ALL_NAMES:
            self._forget_outdated(None)
        # One of the two that was known may have been removed.
        count = len(self._new_among(names))
        has_room = self._counts[authority] + count <= _MAX_NAMES
        return "" if has_room and len(self.names) + count <= _MAX_ALL_NAMES else "too many"

    def _forget_outdated(self, authority: object | None) -> None:
        """Remove frames that were not received for longer than transforms are kept.

        Not those in which others are placed.

        Args:
            authority: Publisher that named them; None for all.
        """
        now = monotonic()
        if now < self._forgot_at.get(authority, -math.inf) + _FORGET_PERIOD_S:
            return
        self._forgot_at[authority] = now
        used: set[str] = set()
        for name, cache in self.caches.items():
            silence = now - self.arrivals.get(name, now)
            old = not cache.static and silence * 1e9 > self._keep
            if not old or authority not in (None, self.names[name]):
                frame = name
                while frame not in used:
                    used.add(frame)
                    above = self.caches.get(frame)
                    frame = frame if above is None else above.parent
        gone = {
            name: owner
            for name, owner in self.names.items()
            if authority in (None, owner) and name not in used
        }
        for name in gone:
            del self.names[name]
            self._behind.pop(name, None)
            if name in self.caches:
                self._remove(name)
        self._counts -= Counter(gone.values())

    def _closes_loop(self, child: str, parent: str, stamp: int | None) -> str:
        """Return why a link is refused, as it closes a loop; outdated links are removed for it."""
        path: list[str] = []
        frame = parent
        while frame != child:
            cache = self.caches.get(frame)
            if cache is None:
                return ""
            if len(path) > _MAX_DEPTH:
                return "too deep"
            path.append(frame)
            frame = cache.parent
        # Otherwise a robot that reversed its tree would be ignored until it is restarted.
        limit = -math.inf if stamp is None else stamp - self._keep
        old = [name for name in path if not (c := self.caches[name]).static and c.latest < limit]
        for name in old:
            self._remove(name)
        return "" if old else "loop"

    def _remove(self, name: str) -> None:
        del self.caches[name]
        self.authorities.pop(name, None)
        self.arrivals.pop(name, None)
        self.version += 1


def _keep(kept: dict[str, Any], name: str, value: Any) -> None:
    """Keep the value of a frame; the oldest makes room."""
    kept.pop(name, None)
    kept[name] = value
    if len(kept) > _MAX_FAULTS:
        del kept[next(iter(kept))]


def _shortened(name: str) -> str:
    return name if len(name) <= _MAX_NAME_LENGTH else f"{name[:50]}..."


def _bad_numbers(entry: Entry) -> str:
    _, a, b, c, x, y, z, w = entry
    length = x * x + y * y + z * z + w * w
    # Only finite numbers give zero.
    if (a + b + c) * 0.0 != 0.0 or length * 0.0 != 0.0:
        return "not finite"
    return "" if abs(length - 1.0) < _TOLERANCE else "not normalised"


_ORIGIN: Vector = (0.0, 0.0, 0.0)
_UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)


def root_of(caches: Mapping[str, DynamicCache | StaticCache], frame: str) -> str:
    """Return the root of a frame's tree."""
    for _ in range(_MAX_DEPTH + 1):
        cache = caches.get(frame)
        if cache is None:
            break
        frame = cache.parent
    return frame


def links_between(
    caches: Mapping[str, DynamicCache | StaticCache], target: str, source: str
) -> tuple[list[str], list[str]] | None:
    """Return the frames below the common ancestor of two frames, on the side of each.

    Returns:
        Those from the source up, and those from the target up; None without a common ancestor.
    """
    up = [source]
    while up[-1] in caches and len(up) <= _MAX_DEPTH + 1:
        up.append(caches[up[-1]].parent)
    places = {frame: place for place, frame in reversed(list(enumerate(up)))}
    down: list[str] = []
    frame = target
    while frame not in places:
        cache = caches.get(frame)
        if cache is None or len(down) > _MAX_DEPTH:
            return None
        down.append(frame)
        frame = cache.parent
    return up[: places[frame]], down


def common_time(caches: Mapping[str, DynamicCache | StaticCache], target: str, source: str) -> int:
    """Return the newest time, in nanoseconds, at which all links between two frames are known.

    Zero if all links are static.

    Raises:
        ConnectivityException: They are not connected.
        LookupException: The frames form a loop.
    """
    found = links_between(caches, target, source)
    if found is None:
        for frame in (source, target):
            _check_loop(caches, frame)
        raise _unconnected(target, source, root_of(caches, target), root_of(caches, source))
    up, down = found
    stamps = [caches[frame].latest for frame in (*up, *down)]
    return min((stamp for stamp in stamps if stamp), default=0)


def look_up(
    caches: Mapping[str, DynamicCache | StaticCache], target: str, source: str, time: int
) -> tuple[Vector, Quaternion]:
    """Return the pose of `source` in `target` at a time.

    Args:
        caches: The transforms of all frames.
        target: The parent frame of the result.
        source: The child frame of the result.
        time: Time in nanoseconds, 0 for the newest of each link.

    Raises:
        ConnectivityException: They are not connected.
        ExtrapolationException: A link is unknown at that time.
        LookupException: The frames form a loop.
    """
    # From the source up to the target, or to where the data ends.
    frame, depth = source, 0
    moved, turned = _ORIGIN, _UPRIGHT
    gap = ""
    while True:
        cache = caches.get(frame)
        if cache is None:
            break
        entry = cache.at(time)
        if entry is None:
            # The way up from the target may meet this one below.
            gap = _gap(frame, cache.gap(time), target, source)
            break
        if frame == target:
            return moved, turned
        x, y, z = rotate(entry[4:], moved)
        moved = (x + entry[1], y + entry[2], z + entry[3])
        turned = multiply(entry[4:], turned)
        frame = entry[0]
        depth += 1
        if depth > _MAX_DEPTH:
            raise _loop(frame)
    top = frame
    # From the target up.
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
        if depth > _MAX_DEPTH:
            raise _loop(frame)
    if frame != top:
        if gap:
            raise ExtrapolationException(gap)
        raise _unconnected(target, source, root_of(caches, target), root_of(caches, source))
    back = conjugate(tilt)
    between = (moved[0] - offset[0], moved[1] - offset[1], moved[2] - offset[2])
    return rotate(back, between), multiply(back, turned)


def look_up_newest(
    caches: Mapping[str, DynamicCache | StaticCache], target: str, sources: Iterable[str]
) -> dict[str, tuple[Vector, Quaternion] | TransformException]:
    """Return the newest poses of many frames in one; links that they share are passed once.

    Returns:
        For each source what :func:`look_up` returns at the :func:`common_time` of both frames, or
        what these raise.
    """
    found: dict[str, tuple[Vector, Quaternion] | TransformException] = {}
    frames = _FramesNewest(caches, target)
    for source in sources:
        try:
            found[source] = frames.look_up(source)
        except TransformException as error:  # noqa: PERF203 - the others are looked up
            found[source] = error
    return found


class _Ancestry(NamedTuple):
    """The links above a frame, up to the target or to the root of the tree.

    Attributes:
        top: The target, or the root.
        depth: Number of links.
        time: The newest time at which all of them are known; 0 for any time.
    """

    top: str
    depth: int
    time: int


class _FramesNewest:
    """The newest poses of frames in a target.

    What frames share is found once, also that nothing connects them with the target: chains of
    1,000 frames each would keep a 3D view busy otherwise.
    """

    def __init__(self, caches: Mapping[str, DynamicCache | StaticCache], target: str) -> None:
        self._caches, self._target = caches, target
        self._ancestry: dict[str, _Ancestry] = {}
        self._above_target = self._find_ancestry(target)
        self._ancestry[target] = _Ancestry(target, 0, 0)
        #: By frame and time.
        self._poses: dict[tuple[str, int], tuple[Vector, Quaternion]] = {}
        #: Number of links that may still be followed.
        self._links_left = _MAX_LINKS

    def look_up(self, source: str) -> tuple[Vector, Quaternion]:
        """Return the newest pose of a frame; raises TransformException."""
        above, root = self._find_ancestry(source), self._above_target.top
        is_below = above.top == self._target
        if above.depth > _MAX_DEPTH:
            raise _loop(source)
        if not is_below and self._above_target.depth > _MAX_DEPTH:
            raise _loop(self._target)
        if not is_below and above.top != root:
            raise _unconnected(self._target, source, root, above.top)
        if self._links_left <= 0:
            raise TransformException(
                f"'{source}' is not looked up in '{self._target}': together, there are more than "
                f"{_MAX_LINKS} links between these frames"
            )
        pose = self._pose_below(source, above.time) if is_below else None
        if pose is None:
            # It is beside or above the target, or its parent has changed.
            self._links_left -= above.depth + self._above_target.depth
            time = common_time(self._caches, self._target, source)
            pose = look_up(self._caches, self._target, source, time)
        return pose

    def _pose_below(self, source: str, time: int) -> tuple[Vector, Quaternion] | None:
        """Return the pose of a frame below the target; None if it was elsewhere at that time."""
        pose: tuple[Vector, Quaternion] | None = (_ORIGIN, _UPRIGHT)
        links: list[tuple[str, Entry]] = []
        frame = source
        while frame != self._target:
            pose = self._poses.get((frame, time))
            if pose is not None:
                break
            cache = self._caches[frame]
            entry = cache.at(time)
            if entry is None or entry[0] != cache.parent:
                return None
            links.append((frame, entry))
            frame = entry[0]
        self._links_left -= len(links)
        moved, turned = pose or (_ORIGIN, _UPRIGHT)
        for frame, entry in reversed(links):
            x, y, z = rotate(turned, entry[1:4])
            moved = (moved[0] + x, moved[1] + y, moved[2] + z)
            turned = multiply(turned, entry[4:])
            self._poses[frame, time] = moved, turned
        return moved, turned

    def _find_ancestry(self, source: str) -> _Ancestry:
        known, path = self._ancestry, []
        frame = source
        while frame not in known:
            cache = self._caches.get(frame)
            if cache is None:
                known[frame] = _Ancestry(frame, 0, 0)
                break
            path.append(frame)
            frame = cache.parent
        above = known[frame]
        for frame in reversed(path):
            latest = self._caches[frame].latest
            time = min(latest, above.time) if latest and above.time else latest or above.time
            above = known[frame] = _Ancestry(above.top, above.depth + 1, time)
        return above


def _gap(frame: str, gap: str, target: str, source: str) -> str:
    return f"{gap} for '{frame}', when looking up transform from frame [{source}] to [{target}]"


def _unconnected(
    target: str, source: str, target_root: str, source_root: str
) -> TransformException:
    return ConnectivityException(
        f"Could not find a connection between '{target}' and '{source}' because they are not part "
        f"of the same tree. Tf has two or more unconnected trees: '{target}' belongs to "
        f"'{target_root}', '{source}' to '{source_root}'; publish what connects them"
    )


def _loop(frame: str) -> TransformException:
    return LookupException(
        f"The tf tree is invalid because it contains a loop, or more than {_MAX_DEPTH} links, at "
        f"'{frame}': find out which of its publishers is wrong"
    )


def _check_loop(caches: Mapping[str, DynamicCache | StaticCache], frame: str) -> None:
    if root_of(caches, frame) in caches:
        raise _loop(frame)
