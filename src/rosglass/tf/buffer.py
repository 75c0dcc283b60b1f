"""The transform buffer, which stores the last seconds of all frames for lookups.

Behaviour: tf2's ``BufferCore`` and tf2_ros's ``Buffer``.
"""

from __future__ import annotations

import logging
import math
import threading
from collections import Counter
from dataclasses import dataclass
from time import monotonic
from typing import TYPE_CHECKING

from rosglass.comm.executor import IMMEDIATE, check_plain
from rosglass.comm.handle import Executor, Handle, check_may_wait
from rosglass.comm.listeners import Listeners
from rosglass.comm.log_limits import LogOnce
from rosglass.comm.names import similar
from rosglass.comm.promise import Promise, check_timeout
from rosglass.comm.time import Duration, Time
from rosglass.comm.timers import Timers
from rosglass.errors import (
    ArgumentError,
    InvalidArgumentException,
    LookupException,
    NodeClosedError,
    TimeoutException,
    TransformException,
    UnsupportedError,
)
from rosglass.tf.frames import (
    FrameInfo,
    FrameStore,
    FrameTree,
    common_time,
    links_between,
    look_up,
    look_up_newest,
)
from rosglass.tf.transform import Transform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from collections.abc import Set as AbstractSet

    from rosglass.tf.frames import Entry
    from rosglass.tf.transform import Quaternion, Vector

__all__ = ["TransformBuffer", "Transformable"]


def check_name(name: object, what: str) -> None:
    """Raise InvalidArgumentException if `name` is not a valid frame name."""
    if not isinstance(name, str) or not name:
        raise InvalidArgumentException(f"{what}: expected the name of a frame, got {name!r}")
    if name[0] == "/":
        raise InvalidArgumentException(
            f"\"{name}\" passed as {what} is not valid: in tf2 frame_ids cannot start with a '/'; "
            f"use '{name.lstrip('/')}'"
        )


def nanoseconds_of(time: Time | None, what: str) -> int:
    """Return a time in nanoseconds, 0 for the newest; raises InvalidArgumentException."""
    if time is None:
        return 0
    if not isinstance(time, Time):
        raise InvalidArgumentException(
            f"{what}: expected a rosglass.Time, or None for the newest, got {time!r}"
        )
    return time.nanoseconds


class ChangeListeners:
    """The listeners for changes of a buffer.

    Args:
        lock: The buffer's lock, which guards the list.
        links: Returns the frames whose transforms connect a target and a source; None if they
            are not connected.
    """

    def __init__(
        self, lock: threading.Lock, links: Callable[[str, str], frozenset[str] | None]
    ) -> None:
        self._lock, self._links = lock, links
        self._pairs: list[_Pair] = []
        self._any: Listeners[None] = Listeners(merge=True, where="transforms")
        self._tree: Listeners[None] = Listeners(merge=True, where="the tree of frames")

    def on_any(self, callback: Callable[[], None], executor: Executor) -> Handle:
        """Call back after any new transform."""
        return self._any.add(_ignoring(callback), executor)

    def on_tree(self, callback: Callable[[], None], executor: Executor) -> Handle:
        """Call back after changes of the tree."""
        return self._tree.add(_ignoring(callback), executor)

    def on_pair(
        self, target: str, source: str, callback: Callable[[], None], executor: Executor
    ) -> Handle:
        """Call back after a new transform between two frames."""
        pair = _Pair(self, target, source)
        pair.listeners.add(_ignoring(callback), executor)
        pair.links = self._links(target, source)
        with self._lock:
            self._pairs.append(pair)
        # Again, as changes between the first time and the registration were not notified.
        pair.links = self._links(target, source)
        return pair

    def notify(self, changed: AbstractSet[str], tree: bool) -> None:
        """Notify the listeners; from any thread, without the lock held.

        Args:
            changed: The frames with new transforms.
            tree: Whether frames appeared, disappeared, or changed their parent.
        """
        self._any.notify(None)
        if tree:
            self._tree.notify(None)
        if not self._pairs:
            return
        with self._lock:
            pairs = list(self._pairs)
        for pair in pairs:
            before = pair.links
            if tree:
                pair.links = self._links(pair.target, pair.source)
            if before != pair.links or (before is not None and not changed.isdisjoint(before)):
                pair.listeners.notify(None)

    def remove(self, pair: _Pair) -> None:
        """Remove a listener."""
        with self._lock:
            if pair in self._pairs:
                self._pairs.remove(pair)


class _Pair(Handle):
    def __init__(self, owner: ChangeListeners, target: str, source: str) -> None:
        self._owner = owner
        self.target, self.source = target, source
        self.listeners: Listeners[None] = Listeners(merge=True, where=f"{target} <- {source}")
        self.links: frozenset[str] | None = None

    def close(self) -> None:
        self._owner.remove(self)
        self.listeners.clear()


def _ignoring(callback: Callable[[], None]) -> Callable[[None], None]:
    check_plain(callback, "transforms")
    return lambda _: callback()


class PendingLookups:
    """The lookups of a buffer that wait for transforms.

    Args:
        lock: The buffer's lock, which guards the list.
    """

    def __init__(self, lock: threading.Lock) -> None:
        self._lock = lock
        self._requests: list[_Request] = []
        self._timers: Timers | None = None
        self._closed = False

    def __bool__(self) -> bool:
        return bool(self._requests)

    def add(
        self, what: str, query: Callable[[], Transform], timeout: float | None
    ) -> Promise[Transform]:
        """Return the promise of a lookup, completed as soon as it succeeds.

        Args:
            what: Description of the lookup.
            query: Performs the lookup.
            timeout: Seconds; None for no limit.

        Raises:
            ConversionError: The timeout is not a number of seconds.
            InvalidArgumentException: The arguments are invalid.
            NodeClosedError: The buffer is closed.
        """
        timeout = check_timeout(timeout, what)
        request = _Request(what, query)
        with self._lock:
            if self._closed:
                raise NodeClosedError(f"{what}: the transform buffer is closed")
            self._requests.append(request)
        if request.attempt():
            self._forget(request)
            error = request.promise.exception(0)
            if error is not None:
                raise error
            return request.promise
        request.promise.add_done_callback(lambda _: self._forget(request))
        if timeout is not None:
            with self._lock:
                if self._timers is None:
                    self._timers = Timers("rosglass tf timeouts")
                timers = self._timers
            request.timer = timers.after(timeout, lambda: request.expire(timeout))
            if request.promise.done():
                request.timer.close()
        return request.promise

    def retry(self) -> None:
        """Try all lookups again; without the lock held."""
        with self._lock:
            requests = list(self._requests)
        for request in requests:
            request.attempt()

    def close(self) -> None:
        """Fail all lookups; safe to call twice."""
        with self._lock:
            self._closed = True
            requests, self._requests = self._requests, []
            timers, self._timers = self._timers, None
        if timers is not None:
            timers.close()
        for request in requests:
            request.promise.set_exception(
                NodeClosedError(f"{request.what}: the transform buffer was closed")
            )

    def _forget(self, request: _Request) -> None:
        with self._lock:
            if request in self._requests:
                self._requests.remove(request)
        if request.timer is not None:
            request.timer.close()


class _Request:
    def __init__(self, what: str, query: Callable[[], Transform]) -> None:
        self.what, self._query = what, query
        self.promise: Promise[Transform] = Promise(f"{what} is not available", cancellable=True)
        self.timer: Handle | None = None
        self._reason: TransformException | None = None

    def attempt(self) -> bool:
        """Try the lookup; return whether it succeeded or can never succeed."""
        try:
            found = self._query()
        except InvalidArgumentException as error:
            self.promise.set_exception(error)
            return True
        except TransformException as error:
            self._reason = error
            return False
        self.promise.set_result(found)
        return True

    def expire(self, timeout: float) -> None:
        """Fail with the reason of the last attempt."""
        error = TimeoutException(
            f"{self.what} is not available within {timeout:g} s: {self._reason}"
        )
        error.__cause__ = self._reason
        self.promise.set_exception(error)


def check_may_wait_for(promise: Promise[Transform], what: str) -> None:
    """Cancel a promise, and raise UnsupportedError, if this thread receives transforms.

    Args:
        promise: Promise of a transform.
        what: Description of the lookup.
    """
    try:
        check_may_wait(what)
    except UnsupportedError:
        promise.cancel()
        raise


_log = logging.getLogger("rosglass.tf")
#: Names that do not exist, whose hints are kept.
_MAX_HINTS = 1000


@dataclass(frozen=True, slots=True)
class Transformable:
    """The answer to :meth:`TransformBuffer.can_transform`; true if the transform is available.

    Attributes:
        error: Why the transform is not available; None if it is.
    """

    error: TransformException | None = None

    def __bool__(self) -> bool:
        return self.error is None

    @property
    def reason(self) -> str:
        """Why it is not available, as a text; empty if it is."""
        return "" if self.error is None else str(self.error)


class TransformBuffer(Handle):
    """Stores transforms for some seconds, and looks them up at any time in between.

    Times are :class:`rosglass.Time`; None and zero mean the newest time at which all links between
    the two frames are known. Thread-safe.

    Args:
        cache_time: Time to keep transforms, in seconds or as a Duration, before the newest stamp of
            each frame.

    Attributes:
        ignored: Number of refused transforms by reason: ``old`` (beyond the cache time),
            ``repeated`` (same frame and stamp), ``self``, ``no name``, ``not finite``,
            ``not normalised``, ``loop``, ``too deep``, ``long name`` (more than 255 letters),
            ``too many`` (more than 10,000 names of one publisher, or 50,000 of all; names that were
            not received for longer than the cache time, and have no frames below them, make room).

    Raises:
        ArgumentError: The cache time is not above zero.
    """

    def __init__(self, cache_time: float | Duration = 10.0) -> None:
        kept = cache_time
        if isinstance(kept, (int, float)) and not isinstance(kept, bool) and 0 < kept < 1e9:
            kept = Duration.from_seconds(kept)
        if not isinstance(kept, Duration) or kept <= Duration():
            raise ArgumentError("cache_time", cache_time, "seconds above zero, or a Duration")
        self.cache_time = kept
        self.ignored: Counter[str] = Counter()
        #: Why the last transform was refused that was neither old nor repeated, and its publisher.
        self._fault: tuple[str, object] = ("", "")
        #: Guards the frames, the listeners and the pending lookups.
        self._lock = threading.Lock()
        self._store = FrameStore(kept.nanoseconds)
        self._log_once = LogOnce(1000)
        #: Hints at similar frames by names that do not exist, and the version of the frames.
        self._hints: tuple[int, dict[str, str]] = (0, {})
        self._changes = ChangeListeners(self._lock, self._links)
        self._pending = PendingLookups(self._lock)

    def __repr__(self) -> str:
        return f"<TransformBuffer of {len(self._store.names)} frames>"

    # -- filling ---------------------------------------------------------------------------------

    def set_transform(
        self, transform: Transform, authority: str = "", *, static: bool = False
    ) -> bool:
        """Store a transform.

        Args:
            transform: The transform; leading slashes of its frames are removed, as in tf2.
            authority: Publisher of the transform.
            static: Whether it is static. If a frame is published as static and as dynamic, the last
                transform counts, and a warning is logged.

        Returns:
            Whether it was stored; false if it is beyond the cache time, or known already.

        Raises:
            InvalidArgumentException: A frame is its own parent or has no name, the quaternion is
                not normalised, or the frames would form a loop.
        """
        if not isinstance(transform, Transform):
            raise InvalidArgumentException(
                f"expected a rosglass.tf.Transform, got {transform!r}; Transform.from_message() "
                "creates one from a message"
            )
        entry = (transform.frame_id, *transform.translation, *transform.rotation)
        item = (transform.child_frame_id, transform.stamp.nanoseconds, entry)
        refused = self.set_many([item], authority, static)
        for kind, reason in refused:
            if kind not in ("old", "repeated"):
                raise InvalidArgumentException(reason)
        return not refused

    def set_many(
        self,
        items: Iterable[tuple[str, int, Entry]],
        authority: object = "",
        static: bool = False,
        late: float = 0.0,
    ) -> list[tuple[str, str]]:
        """Store several transforms; for listeners.

        Args:
            items: For each the child frame, the stamp in nanoseconds, and the transform.
            authority: Publisher of the transforms; converted to a string when needed.
            static: Whether they are static.
            late: Seconds by which they were delayed on their way, for :meth:`silence`.

        Returns:
            The refused ones: a key of :attr:`ignored`, and the reason. Each reason is logged once
            for each frame and authority.
        """
        refused: list[tuple[str, str, str]] = []
        changed = set()
        store = self._store
        with self._lock:
            tree, now = store.version, monotonic() - late
            for child, stamp, entry in items:
                kind, name = store.put(child, stamp, entry, static, authority)
                if kind:
                    refused.append((kind, name, store.describe(kind, name, stamp, entry)))
                else:
                    changed.add(name)
                    store.arrivals[name] = now
            self.ignored.update(kind for kind, _, _ in refused)
            faults = [reason for kind, _, reason in refused if kind not in ("old", "repeated")]
            self._fault = (faults[-1], authority) if faults else self._fault
            moved = store.version != tree
            disagreements, store.disagreements = store.disagreements, []
            jumps, store.jumps = store.jumps, []
        # Without the lock: log handlers may do anything, and names are looked up in the graph.
        for frame, first, second in disagreements:
            if self._log_once.is_first(("kind", frame)):
                _log.warning(
                    "frame '%s' is published as static and as dynamic, by %s and %s: the last "
                    "transform counts; let only one of them publish it",
                    frame,
                    first,
                    second,
                )
        if jumps:
            frames = ", ".join(f"'{frame}' by {back / 1e9:.3f} s" for frame, back, _ in jumps)
            _log.warning(
                "time jumped back for %s (from %s): earlier transforms are removed; was a clock "
                "set, or the robot restarted?",
                frames,
                str(jumps[-1][2]) or "an unnamed authority",
            )
        for kind, child, reason in refused:
            # A name that is not kept must not be kept by the log; it may be any number of them.
            frame = "" if kind in ("long name", "too many") else child
            if self._log_once.is_first((kind, frame, authority)):
                level = logging.DEBUG if kind == "repeated" else logging.WARNING
                _log.log(level, "%s (from %s)", reason, str(authority) or "an unnamed authority")
        if changed:
            if self._pending:
                self._pending.retry()
            self._changes.notify(changed, moved)
        return [(kind, reason) for kind, _, reason in refused]

    @property
    def last_fault(self) -> str:
        """Why the last transform was refused that was neither old nor repeated, and its publisher.

        Empty if there was none.
        """
        reason, authority = self._fault
        return f"{reason} (from {str(authority) or 'an unnamed authority'})" if reason else ""

    def clear(self, *, static: bool = False) -> None:
        """Remove all dynamic transforms, and the static ones if `static`."""
        with self._lock:
            gone = self._store.clear(static)
        self._changes.notify(gone, True)

    def close(self) -> None:
        """Fail pending lookups; safe to call twice. Everything else continues to work."""
        self._pending.close()

    # -- looking up ------------------------------------------------------------------------------

    def lookup_transform(
        self, target: str, source: str, time: Time | None = None, *, timeout: float = 0.0
    ) -> Transform:
        """Return the pose of the frame `source` in the frame `target`.

        The result transforms points from `source` to `target`.

        Args:
            target: Parent frame of the result.
            source: Child frame of the result.
            time: Time of the transform; None for the newest.
            timeout: Seconds to wait for it to become available. Blocks: not for GUI threads.

        Raises:
            LookupException: A frame does not exist.
            ConnectivityException: The frames are not connected.
            ExtrapolationException: A link between them is unknown at that time.
            InvalidArgumentException: A frame's name is empty or starts with a slash, or the time
                is invalid.
            UnsupportedError: A thread that receives transforms cannot wait for them.
        """
        return self._look_up_within(
            timeout,
            f"{target} <- {source}",
            lambda: self._look_up(target, source, nanoseconds_of(time, "time")),
        )

    def lookup_newest(
        self, target: str, sources: Iterable[str]
    ) -> dict[str, tuple[Vector, Quaternion] | TransformException]:
        """Return the newest poses of many frames in the frame `target`.

        The same as :meth:`lookup_transform` for each, but links that they share are passed once.

        Args:
            target: Parent frame of the results.
            sources: The frames.

        Returns:
            For each source its position and rotation, or the error of :meth:`lookup_transform`.
        """
        found: dict[str, tuple[Vector, Quaternion] | TransformException] = {}
        known: list[str] = []
        with self._lock:
            try:
                self._check_name(target, "target")
            except TransformException as error:
                return dict.fromkeys(sources, error)
            for source in sources:
                try:
                    self._check_name(source, "source")
                    known.append(source)
                except TransformException as error:  # noqa: PERF203 - the others are looked up
                    found[source] = error
            return found | look_up_newest(self._store.caches, target, known)

    def lookup_transform_full(
        self,
        target: str,
        target_time: Time | None,
        source: str,
        source_time: Time | None,
        fixed_frame: str,
        *,
        timeout: float = 0.0,
    ) -> Transform:
        """Return the pose of `source` at one time in `target` at another.

        Args:
            target: Parent frame of the result.
            target_time: Time of the parent frame; None for the newest.
            source: Child frame of the result.
            source_time: Time of the child frame; None for the newest.
            fixed_frame: Frame that does not move between these times, e.g. ``odom``.
            timeout: Seconds to wait; as for :meth:`lookup_transform`, as are errors.
        """
        return self._look_up_within(
            timeout,
            f"{target} <- {source}",
            lambda: self._look_up_full(target, target_time, source, source_time, fixed_frame),
        )

    def lookup_transform_async(
        self,
        target: str,
        source: str,
        time: Time | None = None,
        *,
        timeout: float | None = None,
    ) -> Promise[Transform]:
        """Return the promise of a transform, completed as soon as it is available.

        A promise can be waited for, awaited in asyncio, and cancelled; its ``on_done`` calls back,
        on the receiving thread or an executor.

        Args:
            target: As for :meth:`lookup_transform`.
            source: As above.
            time: As above; may be in the future.
            timeout: Seconds until the promise fails with a TimeoutException that has the reason;
                None for no limit.

        Raises:
            InvalidArgumentException: A name or the time is invalid.
            NodeClosedError: The buffer is closed.
        """
        when = nanoseconds_of(time, "time")
        return self._pending.add(
            f"{target} <- {source}", lambda: self._look_up(target, source, when), timeout
        )

    def lookup_transform_full_async(
        self,
        target: str,
        target_time: Time | None,
        source: str,
        source_time: Time | None,
        fixed_frame: str,
        *,
        timeout: float | None = None,
    ) -> Promise[Transform]:
        """Promise :meth:`lookup_transform_full`; see :meth:`lookup_transform_async`."""
        return self._pending.add(
            f"{target} <- {source}",
            lambda: self._look_up_full(target, target_time, source, source_time, fixed_frame),
            timeout,
        )

    def wait_for_transform(
        self,
        target: str,
        source: str,
        time: Time | None = None,
        timeout: float | None = None,
    ) -> Transform:
        """Wait for a transform and return it.

        Args:
            target: As for :meth:`lookup_transform`.
            source: As above.
            time: As above.
            timeout: Seconds to wait; None for no limit.

        Raises:
            TimeoutException: It did not become available; has the reason.
            InvalidArgumentException: A name or the time is invalid.
            UnsupportedError: A thread that receives transforms cannot wait for them.
            NodeClosedError: The buffer is closed.
        """
        promise = self.lookup_transform_async(target, source, time, timeout=timeout)
        if not promise.done():
            check_may_wait_for(promise, f"{target} <- {source}")
        return promise.result()

    def can_transform(
        self, target: str, source: str, time: Time | None = None, *, timeout: float = 0.0
    ) -> Transformable:
        """Return whether :meth:`lookup_transform` would succeed, and why not."""
        return _tried(lambda: self.lookup_transform(target, source, time, timeout=timeout))

    def can_transform_full(
        self,
        target: str,
        target_time: Time | None,
        source: str,
        source_time: Time | None,
        fixed_frame: str,
        *,
        timeout: float = 0.0,
    ) -> Transformable:
        """Return whether :meth:`lookup_transform_full` would succeed, and why not."""
        return _tried(
            lambda: self.lookup_transform_full(
                target, target_time, source, source_time, fixed_frame, timeout=timeout
            )
        )

    def latest_common_time(self, target: str, source: str) -> Time:
        """Return the newest time at which all links between two frames are known.

        Zero if all are static. Errors as for :meth:`lookup_transform`.
        """
        with self._lock:
            self._check_name(target, "target")
            self._check_name(source, "source")
            if target == source:
                cache = self._store.caches.get(target)
                return Time(0 if cache is None else cache.latest)
            return Time(common_time(self._store.caches, target, source))

    # -- the tree --------------------------------------------------------------------------------

    def has_frame(self, name: str) -> bool:
        """Return whether a frame exists."""
        return isinstance(name, str) and name in self._store.names

    def frame(self, name: str) -> FrameInfo | None:
        """Return the state of a frame; None if it does not exist."""
        return self._infos([name])[0] if self.has_frame(name) else None

    def frame_names(self) -> list[str]:
        """Return the names of all frames, those that appeared first at the beginning."""
        with self._lock:
            return list(self._store.names)

    def tree(self, frames: Iterable[str] | None = None) -> FrameTree:
        """Return a snapshot of all frames, or of those of these names that exist."""
        return FrameTree(self._infos(None if frames is None else list(frames)))

    def tree_faults(self) -> dict[str, str]:
        """Return what is wrong with the place of frames in the tree, in words, by frame.

        Two parents: transforms in both alternate, or two publishers have sent static ones. Cycles:
        the transform that would close one is refused. A fault of transforms that are not static
        ends ten seconds after the last of them.
        """
        with self._lock:
            faults = self._store.faults()
        # Without the lock: names of publishers are looked up in the graph.
        return {
            frame: "".join(str(part) or "an unknown node" for part in parts)
            for frame, parts in faults.items()
        }

    def silence(self, target: str, source: str) -> float:
        """Return for how long one frame may have been somewhere else in another one, in seconds.

        That is since the last transform of whichever link between them was received longest ago, or
        should have been if it was delayed; 0 if all are static, or if nothing connects the frames.
        """
        store, now = self._store, monotonic()
        with self._lock:
            up, down = links_between(store.caches, target, source) or ([], [])
            moving = [frame for frame in (*up, *down) if not store.caches[frame].static]
            return max((now - store.arrivals.get(one, -math.inf) for one in moving), default=0.0)

    def rest(self) -> tuple[int, int] | None:
        """Return a value that stays the same while the newest pose of no frame changes.

        None while poses may change without further transforms that differ, as the newest common
        time of frames has not come to the last move yet.
        """
        with self._lock:
            return self._store.rest()

    # -- changes ---------------------------------------------------------------------------------

    def on_change(
        self, target: str, source: str, callback: Callable[[], None], executor: Executor = IMMEDIATE
    ) -> Handle:
        """Call `callback` after a new transform between two frames.

        Also when they become connected or disconnected. Changes in a burst are merged.

        Args:
            target: A frame; need not exist yet.
            source: Another one.
            callback: Function without arguments.
            executor: Executor that runs it; by default the thread that fills the buffer, where it
                must not block.

        Raises:
            ArgumentError: `callback` or `executor` is invalid.
            InvalidArgumentException: A name is empty or starts with a slash.
        """
        for frame, what in ((target, "target"), (source, "source")):
            check_name(frame, what)
        return self._changes.on_pair(target, source, callback, executor)

    def on_tree_change(
        self, callback: Callable[[], None], executor: Executor = IMMEDIATE
    ) -> Handle:
        """Call `callback` after changes of frames or their parents; see :meth:`on_change`."""
        return self._changes.on_tree(callback, executor)

    def on_update(self, callback: Callable[[], None], executor: Executor = IMMEDIATE) -> Handle:
        """Call `callback` after any new transform; see :meth:`on_change`."""
        return self._changes.on_any(callback, executor)

    # -- internals -------------------------------------------------------------------------------

    def _look_up(self, target: str, source: str, time: int) -> Transform:
        with self._lock:
            self._check_name(target, "target")
            self._check_name(source, "source")
            caches = self._store.caches
            if target == source:
                if not time and target in caches:
                    time = caches[target].latest
                return Transform(stamp=Time(time), frame_id=target, child_frame_id=source)
            if not time:
                time = common_time(caches, target, source)
            translation, rotation = look_up(caches, target, source, time)
        return Transform(translation, rotation, Time(time), target, source)

    def _look_up_full(
        self,
        target: str,
        target_time: Time | None,
        source: str,
        source_time: Time | None,
        fixed_frame: str,
    ) -> Transform:
        times = (
            nanoseconds_of(target_time, "target_time"),
            nanoseconds_of(source_time, "source_time"),
        )
        with self._lock:
            for frame, what in (
                (target, "target"),
                (source, "source"),
                (fixed_frame, "fixed_frame"),
            ):
                self._check_name(frame, what)
        before = self._look_up(fixed_frame, source, times[1])
        return self._look_up(target, fixed_frame, times[0]).compose(before)

    def _look_up_within(
        self, timeout: float, what: str, query: Callable[[], Transform]
    ) -> Transform:
        # Most lookups do not wait, and need no promise.
        limit = check_timeout(timeout, what)
        if limit == 0:
            return query()
        promise = self._pending.add(what, query, limit)
        if not promise.done():
            check_may_wait_for(promise, what)
        try:
            return promise.result()
        except TimeoutException as late:
            # As in tf2: the reason, not the timeout.
            raise (late.__cause__ or late) from None

    def _check_name(self, name: str, what: str) -> None:
        if isinstance(name, str) and name in self._store.names:
            return
        check_name(name, what)
        raise LookupException(f'"{name}" passed as {what} does not exist{self._hint(name)}')

    def _hint(self, name: str) -> str:
        """Return a hint at similar frames, which is found once.

        It takes milliseconds, and 3D views look up the frames of a robot 30 times per second, also
        those that do not exist.
        """
        version, hints = self._hints
        if version != self._store.version or len(hints) >= _MAX_HINTS:
            hints = {}
            self._hints = (self._store.version, hints)
        if name not in hints:
            hints[name] = similar(name, self._store.names)
        return hints[name]

    def _infos(self, names: list[str] | None) -> list[FrameInfo]:
        store = self._store
        with self._lock:
            wanted = list(store.names) if names is None else [n for n in names if n in store.names]
            authorities = [store.authorities.get(name, "") for name in wanted]
        # Without the lock: names of publishers are looked up in the graph.
        texts = [str(authority) for authority in authorities]
        with self._lock:
            return [store.info(name, text) for name, text in zip(wanted, texts, strict=True)]

    def _links(self, target: str, source: str) -> frozenset[str] | None:
        with self._lock:
            if target not in self._store.names or source not in self._store.names:
                return None
            found = links_between(self._store.caches, target, source)
        return None if found is None else frozenset((*found[0], *found[1]))


def _tried(query: Callable[[], Transform]) -> Transformable:
    try:
        query()
    except TransformException as error:
        return Transformable(error)
    return Transformable()
