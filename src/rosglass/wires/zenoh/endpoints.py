"""What a node declares on a Zenoh session: tokens, and the writers of its publishers."""

from __future__ import annotations

import itertools
import logging
import threading
import time
from abc import abstractmethod
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import zenoh
import zenoh.ext

from rosglass.comm import ConnectionState, Durability, Handle, History, Reliability
from rosglass.errors import ConnectionLostError, NodeClosedError
from rosglass.wires.base import Writer
from rosglass.wires.zenoh.keys import ATTACHMENT_FULL, HUMBLE_HASH, gid_of, topic_key, without_hash

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, Status
    from rosglass.wires.zenoh.options import ZenohOptions
    from rosglass.wires.zenoh.reader import ZenohReader
    from rosglass.wires.zenoh.shm import SharedMemory

__all__ = [
    "CHANNEL",
    "Announcement",
    "Declaration",
    "LocalRegistry",
    "Owner",
    "Pump",
    "ZenohWriter",
    "direct",
]

_T = TypeVar("_T")


class LocalRegistry(Generic[_T]):
    """The node's own ends of each topic or service, to which it sends without a detour over Zenoh.

    Zenoh would call back in the thread that sends. Where that is the main thread, Ctrl-C is most
    likely to strike in the callback, and Zenoh swallows whatever that raises: a program would not
    end.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._there: dict[tuple[str, str], tuple[_T, ...]] = {}

    def add(self, place: tuple[str, str], one: _T) -> None:
        """Add somebody."""
        with self._lock:
            self._there[place] = (*self._there.get(place, ()), one)

    def remove(self, place: tuple[str, str], one: _T) -> None:
        """Remove somebody, who may be gone already."""
        with self._lock:
            left = tuple(other for other in self._there.get(place, ()) if other is not one)
            if left:
                self._there[place] = left
            else:
                self._there.pop(place, None)

    def at(self, place: tuple[str, str]) -> tuple[_T, ...]:
        """Return who is there, in order of appearance."""
        return self._there.get(place, ())


_log = logging.getLogger("rosglass.ros2")
#: Seconds between the heartbeats that let subscriptions notice a lost last sample (rmw_zenoh's).
_HEARTBEAT = 0.5
#: Part of the names of an action's topics.
_ACTION = "/_action/"
#: Seconds that closing waits for another thread's write, or question.
_PATIENCE = 1.0


class Owner(Protocol):
    """Who keeps declarations.

    Attributes:
        version: Another number after each change of links or service servers.
    """

    version: int

    def forget(self, declaration: Declaration) -> None:
        """Drop a declaration that was closed."""

    def recycle(self, declaration: Declaration) -> None:
        """Take back the number of a declaration whose token is gone."""

    def wake(self) -> None:
        """Have declarations polled soon; from any thread."""

    def status(self) -> Status:
        """Return the state of the connection."""


class Declaration(Handle):
    """Something declared on the session, or to be declared when it opens."""

    def __init__(self, owner: Owner, token: str) -> None:
        self.token = token
        self._owner = owner
        self._lock = threading.Lock()
        self._closed = self._attached = False
        self._handles: list[Any] = []

    def attach(self, session: zenoh.Session) -> None:
        """Declare it on the session that just opened."""
        with self._lock:
            if self._closed or self._attached:
                return
            self._attached = True
        # Declaring may call back at once, into code that closes this very declaration.
        try:
            handles = self.declare(session)
            # The token comes last and goes first: who sees it can count on the rest.
            self._keep([session.liveliness().declare_token(self.token), *handles])
        except zenoh.ZError as error:
            raise self._error(error) from error

    @abstractmethod
    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare what comes with the token, and return what has to be undeclared."""

    def poll(self) -> None:
        """Do what has to be done now and then; called about once a second."""

    def close(self) -> None:
        """Undeclare it."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self._owner.forget(self)
        self._release()
        with self._lock:
            gone = self._attached and not self._handles
        if gone:
            self._owner.recycle(self)

    def _error(self, error: zenoh.ZError) -> ConnectionLostError | NodeClosedError:
        if self._closed or self._owner.status().state is ConnectionState.CLOSED:
            return NodeClosedError("the node is closed; connect again")
        return ConnectionLostError(f"Zenoh refused {self.token}: {error}")

    def _keep(self, handles: list[Any]) -> None:
        with self._lock:
            self._handles += handles
            closed = self._closed
        if closed:
            self._release()

    def _release(self) -> None:
        with self._lock:
            handles, self._handles = self._handles, []
        for handle in handles:
            _undeclare(handle)


def _undeclare(handle: Any) -> None:
    """Withdraw a handle, once no other thread is inside one of its methods."""
    deadline = time.monotonic() + _PATIENCE
    while not _undeclared(handle):
        if time.monotonic() > deadline:
            _log.warning("%r is still in use and is left to the end of the session", handle)
            return
        time.sleep(0.0005)


def _undeclared(handle: Any) -> bool:
    try:
        with suppress(zenoh.ZError):  # the session went first
            handle.undeclare()
    except RuntimeError:  # "Already borrowed": another thread asks it who matches
        return False
    return True


class Announcement(Declaration):
    """A token alone: a node."""

    def declare(self, session: zenoh.Session) -> list[Any]:  # noqa: ARG002 - nothing but the token
        """Declare nothing more."""
        return []


class ZenohWriter(Declaration, Writer):
    """A publisher and its token; one publisher for each key that is listened to.

    Plain subscriptions of the same node are handed the samples here.
    """

    def __init__(
        self,
        owner: Owner,
        options: ZenohOptions,
        token: str,
        endpoint: EndpointInfo,
        shared: SharedMemory | None,
        readers: LocalRegistry[ZenohReader],
    ) -> None:
        super().__init__(owner, token)
        self._options, self._topic, self._qos = options, endpoint.name, endpoint.qos
        self._type_name, self._type_hash = endpoint.type, endpoint.type_hash
        self._readers, self._place = readers, (self._topic, self._type_name)
        self.gid = gid_of(token)
        self._numbers = itertools.count(1)
        self._session: zenoh.Session | None = None
        self._hashes = {HUMBLE_HASH if options.humble else self._type_hash or HUMBLE_HASH}
        self._publishers: tuple[Any, ...] = ()
        self._writing: list[int] = []
        self._abandoned = False
        self._quiet = threading.Condition(self._lock)
        # Kept for keys that are declared later: late subscriptions are owed the last samples.
        self._latched = self._qos.durability is Durability.TRANSIENT_LOCAL
        #: Payload, attachment, and when it was sent, in nanoseconds of the monotonic clock.
        self._history: deque[tuple[bytes | bytearray, bytes, int]] = deque(maxlen=self._qos.depth)
        self._joining, self._joined = threading.Lock(), bytearray()
        # What is kept for late subscriptions would fill the shared memory for good.
        self._shared = None if self._latched else shared

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare the publishers of the keys known so far."""
        with self._lock:
            self._session, hashes = session, set(self._hashes)
        return self._declare_publishers(session, hashes)

    def write(self, data: bytes | bytearray) -> None:
        """Send a payload; while nothing is linked, only a transient local cache keeps it."""
        now = time.time_ns()
        shared = None if self._shared is None else self._shared.place((data,))
        self._send(data, data if shared is None else shared, now)

    def write_parts(self, parts: Sequence[bytes | bytearray | memoryview]) -> None:
        """Send a payload that comes in parts, with one copy less than by joining them."""
        now = time.time_ns()
        kept = self._latched or bool(self._readers.at(self._place))
        shared = None if kept or self._shared is None else self._shared.place(parts)
        if shared is not None:
            self._send(b"", shared, now)
        elif kept or not self._joining.acquire(blocking=False):
            joined = b"".join(parts)
            self._send(joined, joined, now)
        else:
            try:
                self._send(b"", self._join(parts), now)
            finally:
                self._joining.release()

    def _join(self, parts: Sequence[bytes | bytearray | memoryview]) -> bytearray:
        """Join parts in memory that is used again: fresh memory takes longer than the copying."""
        size = sum(map(len, parts))
        if len(self._joined) != size:
            self._joined = bytearray(size)
        start = 0
        for part in parts:
            self._joined[start : start + len(part)] = part
            start += len(part)
        return self._joined

    def _send(self, data: bytes | bytearray, payload: Any, now: int) -> None:
        # No lock: it would be held while a subscription of this very session is called back.
        # Either close() sees the entry in this list, or this sees that it was closed.
        writing, thread = self._writing, threading.get_ident()
        writing.append(thread)
        try:
            if self._closed:
                raise NodeClosedError(f"the publisher of {self._topic} is closed")
            number = next(self._numbers)
            note = ATTACHMENT_FULL.pack(number, now, 16, self.gid)
            if self._latched:
                self._history.append((data, note, time.monotonic_ns()))
            for publisher in self._publishers:
                publisher.put(payload, attachment=note)
            for reader in self._readers.at(self._place):
                reader.take_own(bytes(data), now, self.gid, number, self._type_hash)
        except zenoh.ZError as error:
            raise self._error(error) from error
        finally:
            writing.remove(thread)
            if self._closed:
                self._finish()

    def _finish(self) -> None:
        """Let close() go on; or do its work, if it waits no more."""
        with self._lock:
            self._quiet.notify_all()
            late = self._abandoned and not self._writing
        if late:
            self._release()

    def match(self, subscriptions: Sequence[EndpointInfo]) -> None:
        """Send under a further key for subscriptions that name the type's definition otherwise.

        A Humble robot subscribes without hash; the same definition is meant.
        """
        ours = {self._type_hash or HUMBLE_HASH, HUMBLE_HASH}
        wanted = {endpoint.type_hash or HUMBLE_HASH for endpoint in subscriptions}
        with self._lock:
            new = (wanted & ours) - self._hashes
            self._hashes |= new
            session = None if self._closed else self._session
        if new and session is not None:
            try:
                self._keep(self._declare_publishers(session, new))
                if _ACTION in self._topic and HUMBLE_HASH in new:
                    # dora-rs looks for an action's topics by the hash, too; others do not.
                    second = without_hash(self.token, self._type_hash)
                    self._keep([session.liveliness().declare_token(second)])
            except zenoh.ZError as error:
                raise self._error(error) from error

    def _release(self) -> None:
        # Zenoh refuses to undeclare what is in use; a write ends soon, or does this when it ends.
        own = threading.get_ident()
        with self._lock:
            self._quiet.wait_for(lambda: not set(self._writing) - {own}, _PATIENCE)
            self._abandoned = bool(self._writing)
            if self._abandoned:
                return
        super()._release()

    def _declare_publishers(self, session: zenoh.Session, hashes: set[str]) -> list[Any]:
        publishers = [self._declare_publisher(session, name) for name in sorted(hashes)]
        # First: whatever is written from here on reaches them; some of it twice, under one number.
        self._publishers += tuple(publishers)
        lifespan, now = self._qos.lifespan, time.monotonic_ns()
        for data, note, sent in tuple(self._history):
            if lifespan is None or now - sent <= lifespan.nanoseconds:
                for publisher in publishers:
                    publisher.put(data, attachment=note)
        return publishers

    def _declare_publisher(self, session: zenoh.Session, type_hash: str) -> Any:
        key = topic_key(self._options.domain, self._topic, self._type_name, type_hash)
        reliable = self._qos.reliability is Reliability.RELIABLE
        keep_all = self._qos.history is History.KEEP_ALL
        # rmw_zenoh's choice: only who keeps everything waits for a full queue.
        block = reliable and keep_all
        congestion = zenoh.CongestionControl.BLOCK if block else zenoh.CongestionControl.DROP
        # Each priority has its own queue: a stop command must not be thrown away because camera
        # pictures, sent best effort by the same program, fill theirs while the network is stuck.
        priority = zenoh.Priority.INTERACTIVE_LOW if reliable else zenoh.Priority.DATA
        if self._qos.durability is Durability.VOLATILE:
            return session.declare_publisher(key, congestion_control=congestion, priority=priority)
        return zenoh.ext.declare_advanced_publisher(
            session,
            key,
            congestion_control=congestion,
            priority=priority,
            cache=zenoh.ext.CacheConfig(max_samples=self._qos.depth),
            publisher_detection=True,
            sample_miss_detection=zenoh.ext.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=_HEARTBEAT
            )
            if reliable
            else None,
        )


def _guarded(callback: Callable[[Any], None]) -> Callable[[Any], None]:
    """Log what `callback` raises: Zenoh would only print it."""

    def guarded(item: Any) -> None:
        try:
            callback(item)
        except Exception:
            _log.exception("handling something received over Zenoh failed")

    return guarded


def direct(callback: Callable[[Any], None]) -> Any:
    """Run `callback` on the thread that receives; for what comes from other sessions only."""
    return zenoh.handlers.Callback(_guarded(callback), indirect=False)


class Pump:
    """Hands what a Zenoh channel receives to a callback, on a thread of its own.

    Zenoh's "net" threads must never wait for Python's global lock: undeclaring an advanced
    publisher holds that lock while it waits for a task of theirs (measured with eclipse-zenoh
    1.10.2: the whole program stands still for 10 s). Only the samples of plain subscribers come
    on other threads. Zenoh's own queueing callbacks keep a program from ending.

    Args:
        source: What was declared with :data:`CHANNEL`; it ends the thread when it is undeclared.
        callback: Takes each item.
        name: The thread's name.
    """

    def __init__(self, source: Any, callback: Callable[[Any], None], name: str) -> None:
        self._source, self._callback = source, _guarded(callback)
        # It cannot be asked for any more once the source is undeclared.
        self._items = source.handler
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def undeclare(self, patience: float = _PATIENCE) -> bool:
        """Undeclare the source, and wait up to so many seconds for the thread, unless this is it.

        Returns:
            Whether the thread has ended. That of an advanced subscriber goes on while questions to
            publishers are open; the end of the session ends it.
        """
        with suppress(zenoh.ZError):  # undeclared already, or the session went first
            self._source.undeclare()
        if self._thread is not threading.current_thread():
            self._thread.join(patience)
        return not self._thread.is_alive()

    def _work(self) -> None:
        for item in self._items:
            self._callback(item)


#: Channel for a :class:`Pump`; so long that its end is never met while the pump's thread lives.
CHANNEL = zenoh.handlers.FifoChannel(100_000)
