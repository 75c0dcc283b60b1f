"""A node's declarations in a Zenoh session: liveliness tokens, publishers with shared memory."""

from __future__ import annotations

import itertools
import logging
import os
import threading
import time
from abc import abstractmethod
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import zenoh
import zenoh.ext

from rosglass.comm import ConnectionState, Durability, Handle, History, Reliability
from rosglass.comm.handle import guarded
from rosglass.comm.wire import Writer
from rosglass.errors import ConnectionLostError, NodeClosedError
from rosglass.wires.zenoh.command_window import CommandWindow
from rosglass.wires.zenoh.keys import ATTACHMENT_FULL, HUMBLE_HASH, gid_of, topic_key, without_hash

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from zenoh import shm

    from rosglass.comm import EndpointInfo, Status
    from rosglass.comm.graph import Graph
    from rosglass.comm.timers import Timers
    from rosglass.wires.zenoh.options import ZenohOptions

__all__ = [
    "CHANNEL",
    "Announcement",
    "Declaration",
    "LocalRegistry",
    "Owner",
    "Pump",
    "SharedMemory",
    "ZenohWriter",
    "receive_directly",
]

_T = TypeVar("_T")
_log = logging.getLogger("rosglass.ros2")
#: Seconds between the heartbeats by which subscriptions notice a lost last sample (rmw_zenoh's).
_HEARTBEAT_INTERVAL_S = 0.5
_FAILURE = "handling received data failed"
#: Part of the names of an action's topics.
_ACTION = "/_action/"
#: Seconds that closing waits for another thread's write or query.
_CLOSE_TIMEOUT_S = 1.0
#: Seconds between two checks while closing waits.
_POLL_INTERVAL_S = 0.0005


class LocalRegistry(Generic[_T]):
    """The node's own readers or servers, to which it delivers directly instead of over Zenoh.

    Zenoh would call back in the sending thread. In the main thread, Ctrl-C often interrupts that
    callback, and Zenoh swallows the KeyboardInterrupt: the program would not end.
    """

    def __init__(self) -> None:
        #: Guards changes; readers take the tuples without it.
        self._lock = threading.Lock()
        self._entries: dict[tuple[str, str], tuple[_T, ...]] = {}

    def add(self, place: tuple[str, str], entry: _T) -> None:
        """Add an entry for a topic or service, given by its name and type."""
        with self._lock:
            self._entries[place] = (*self._entries.get(place, ()), entry)

    def remove(self, place: tuple[str, str], entry: _T) -> None:
        """Remove an entry; safe to call twice."""
        with self._lock:
            left = tuple(other for other in self._entries.pop(place, ()) if other is not entry)
            if left:
                self._entries[place] = left

    def find(self, place: tuple[str, str]) -> tuple[_T, ...]:
        """Return the entries for a topic or service, in order of appearance."""
        return self._entries.get(place, ())


class Owner(Protocol):
    """The middleware, as its declarations use it.

    Attributes:
        options: Options of the session.
        version: Increases with each change of links or service servers.
        timers: Run delayed jobs.
        rate: Samples per second that all readers have received in the last second.
    """

    options: ZenohOptions
    version: int
    timers: Timers
    rate: float

    @property
    def graph(self) -> Graph:
        """The graph."""

    def forget(self, declaration: Declaration) -> None:
        """Remove a declaration that was closed."""

    def recycle(self, declaration: Declaration) -> None:
        """Reuse the number of a declaration whose token is gone."""

    def name_of(self, gid: bytes) -> str | None:
        """Return the topic or service that a publisher or client was announced for.

        None for those whose identity is not derived from their token, as of dora-rs.
        """

    def wake(self) -> None:
        """Poll declarations soon; from any thread."""

    def status(self) -> Status:
        """Return the state of the connection."""

    def is_linked(self) -> bool:
        """Return whether there is a link to a router or peer."""

    def query_router(self, timeout: float) -> Any:
        """Send a query without result; return its channel, None if there is no session."""


class Declaration(Handle):
    """A liveliness token and its Zenoh entities, declared as soon as the session is open.

    Args:
        owner: The middleware.
        token: Key of the token.
    """

    def __init__(self, owner: Owner, token: str) -> None:
        self.token = token
        self._owner = owner
        #: Guards the state of the declaration, and that of subclasses.
        self._lock = threading.Lock()
        self._closed = self._attached = False
        self._handles: list[Any] = []

    def attach(self, session: zenoh.Session) -> None:
        """Declare it on a newly opened session."""
        with self._lock:
            if self._closed or self._attached:
                return
            self._attached = True
        # Declaring may call back at once, into code that closes this declaration.
        try:
            handles = self.declare(session)
            # The token is declared last and undeclared first: it announces the rest.
            self._keep([session.liveliness().declare_token(self.token), *handles])
        except zenoh.ZError as error:
            raise self._error(error) from error

    @abstractmethod
    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare the entities of the token, and return the handles to undeclare."""

    def poll(self) -> None:
        """Do periodic work; called about once a second."""

    def close(self) -> None:
        """Undeclare it; safe to call twice."""
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
    """Undeclare a handle as soon as no other thread is inside one of its methods."""
    deadline = time.monotonic() + _CLOSE_TIMEOUT_S
    while not _try_undeclare(handle):
        if time.monotonic() > deadline:
            _log.warning("%r is in use, and stays declared until the session is closed", handle)
            return
        time.sleep(_POLL_INTERVAL_S)


def _try_undeclare(handle: Any) -> bool:
    try:
        with suppress(zenoh.ZError):  # the session was closed first
            handle.undeclare()
    except RuntimeError:  # "Already borrowed": another thread reads its matching status
        return False
    return True


class Announcement(Declaration):
    """The token of a node."""

    def declare(self, session: zenoh.Session) -> list[Any]:  # noqa: ARG002 - nothing but the token
        """Declare nothing: a node has only its token."""
        return []


class ZenohWriter(Declaration, Writer):
    """A publisher and its token, with one Zenoh publisher for each subscribed key.

    Args:
        owner: The middleware.
        token: The publisher's token.
        endpoint: The publisher.
        shared: Shared memory for its payloads; None for none.
        readers: The node's own readers, which receive the samples directly.
    """

    def __init__(
        self,
        owner: Owner,
        token: str,
        endpoint: EndpointInfo,
        shared: SharedMemory | None,
        readers: LocalRegistry[Any],
    ) -> None:
        super().__init__(owner, token)
        self._topic, self._qos = endpoint.name, endpoint.qos
        self._type_name, self._type_hash = endpoint.type, endpoint.type_hash
        self._readers, self._place = readers, (self._topic, self._type_name)
        self.gid = gid_of(token)
        self._numbers = itertools.count(1)
        self._session: zenoh.Session | None = None
        self._hashes = {HUMBLE_HASH if owner.options.humble else self._type_hash or HUMBLE_HASH}
        self._publishers: tuple[Any, ...] = ()
        #: The threads that are writing, and whether one of them has to release the publishers.
        self._writing: list[int] = []
        self._release_later = False
        self._latched = self._qos.durability is Durability.TRANSIENT_LOCAL
        #: The last samples, for keys that are declared later: payload, attachment, and time of
        #: sending in nanoseconds of the monotonic clock.
        self._history: deque[tuple[bytes | bytearray, bytes, int]] = deque(maxlen=self._qos.depth)
        #: A buffer to join parts in: fresh memory takes longer than copying.
        self._buffers: list[bytearray] = []
        self._window: CommandWindow | None = None
        if self._qos.send_timeout is not None:
            timeout = self._qos.send_timeout.seconds
            self._window = CommandWindow(
                owner.timers, timeout, owner.query_router, self._put, owner.is_linked
            )
        # Samples kept for late subscriptions would fill the shared memory.
        self._shared = None if self._latched or self._window is not None else shared

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare a publisher for each known key."""
        with self._lock:
            self._session, hashes = session, set(self._hashes)
        return self._declare_publishers(session, hashes)

    def write(self, data: bytes | bytearray) -> None:
        """Send a payload; without a link, only a transient-local cache keeps it."""
        now = time.time_ns()
        shared = None if self._shared is None else self._shared.place((data,))
        self._send(data, data if shared is None else shared, now)

    def write_parts(self, parts: Sequence[bytes | bytearray | memoryview]) -> None:
        """Send a payload given in parts, with one copy less than by joining them."""
        now = time.time_ns()
        kept = self._latched or self._window is not None or bool(self._readers.find(self._place))
        shared = None if kept or self._shared is None else self._shared.place(parts)
        if shared is not None:
            self._send(b"", shared, now)
        elif kept:
            joined = b"".join(parts)
            self._send(joined, joined, now)
        else:
            buffer = self._join(parts)
            self._send(b"", buffer, now)
            self._buffers[:] = [buffer]

    def _join(self, parts: Sequence[bytes | bytearray | memoryview]) -> bytearray:
        size = sum(map(len, parts))
        try:
            buffer = self._buffers.pop()
        except IndexError:  # the first message, or another thread is sending
            buffer = bytearray()
        if len(buffer) != size:
            buffer = bytearray(size)
        start = 0
        for part in parts:
            buffer[start : start + len(part)] = part
            start += len(part)
        return buffer

    def _send(self, data: bytes | bytearray, payload: Any, now: int) -> None:
        # No lock, as subscriptions of this session may be called back. Either close() sees the
        # entry in this list, or this sees that it was closed.
        writing, thread = self._writing, threading.get_ident()
        writing.append(thread)
        try:
            if self._closed:
                raise NodeClosedError(f"the publisher of {self._topic} is closed")
            number = next(self._numbers)
            note = ATTACHMENT_FULL.pack(number, now, 16, self.gid)
            if self._latched:
                self._history.append((data, note, time.monotonic_ns()))
            if self._window is not None:
                self._window.send(bytes(payload), note)
            else:  # as _put() does, which costs a call per message
                for publisher in self._publishers:
                    publisher.put(payload, attachment=note)
            for reader in self._readers.find(self._place):
                reader.on_local_sample(bytes(data), now, self.gid, number, self._type_hash)
        except zenoh.ZError as error:
            raise self._error(error) from error
        finally:
            writing.remove(thread)
            if self._release_later and not writing:
                self._release()

    def lost(self) -> int:
        """Return how many commands were dropped because they could not be sent in time."""
        return 0 if self._window is None else self._window.lost

    @property
    def problem(self) -> str:  # type: ignore[override]
        """That commands could not be sent in time, in words; empty if all were."""
        return "" if self._window is None else self._window.problem

    def _put(self, payload: Any, note: bytes) -> None:
        for publisher in self._publishers:
            publisher.put(payload, attachment=note)

    def match(self, subscriptions: Sequence[EndpointInfo]) -> None:
        """Also publish on the key without type hash if a subscription, as in Humble, uses it."""
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
                    # dora-rs finds an action's topics by the hash; others do not.
                    second = without_hash(self.token, self._type_hash)
                    self._keep([session.liveliness().declare_token(second)])
            except zenoh.ZError as error:
                raise self._error(error) from error

    def _release(self) -> None:
        # Zenoh refuses to undeclare a publisher in use. A write ends soon, or else releases it.
        own, deadline = threading.get_ident(), time.monotonic() + _CLOSE_TIMEOUT_S
        while set(self._writing) - {own} and time.monotonic() < deadline:
            time.sleep(_POLL_INTERVAL_S)
        self._release_later = True
        if self._window is not None:
            self._window.close()
        if not self._writing:
            super()._release()

    def _declare_publishers(self, session: zenoh.Session, hashes: set[str]) -> list[Any]:
        publishers = [self._declare_publisher(session, name) for name in sorted(hashes)]
        # First, so that no sample is lost; some are sent twice, with the same number.
        self._publishers += tuple(publishers)
        lifespan, now = self._qos.lifespan, time.monotonic_ns()
        for data, note, sent in tuple(self._history):
            if lifespan is None or now - sent <= lifespan.nanoseconds:
                for publisher in publishers:
                    publisher.put(data, attachment=note)
        return publishers

    def _declare_publisher(self, session: zenoh.Session, type_hash: str) -> Any:
        key = topic_key(self._owner.options.domain, self._topic, self._type_name, type_hash)
        reliable = self._qos.reliability is Reliability.RELIABLE
        keep_all = self._qos.history is History.KEEP_ALL
        # As in rmw_zenoh, only keep-all publishers wait for a full queue.
        block = reliable and keep_all
        congestion = zenoh.CongestionControl.BLOCK if block else zenoh.CongestionControl.DROP
        # Each priority has its own queue: a stop command must not be dropped because best-effort
        # camera images of the same program fill theirs while the network is stuck.
        priority = zenoh.Priority.INTERACTIVE_LOW if reliable else zenoh.Priority.DATA
        if self._window is not None:
            # Not express: each message would take one of the queue's two batches, and be lost
            # behind two others without being counted.
            priority = zenoh.Priority.REAL_TIME
            return session.declare_publisher(key, congestion_control=congestion, priority=priority)
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
                heartbeat=None, sporadic_heartbeat=_HEARTBEAT_INTERVAL_S
            )
            if reliable
            else None,
        )


def receive_directly(callback: Callable[[Any], None]) -> Any:
    """Run a callback on the receiving thread; only for data of other sessions."""
    handling = guarded(_log, _FAILURE)  # Zenoh would only print it

    def receive(item: Any) -> None:
        with handling:
            callback(item)

    return zenoh.handlers.Callback(receive, indirect=False)


class Pump:
    """A thread that hands the items of a Zenoh channel to a callback.

    Zenoh's "net" threads must never wait for Python's global lock: undeclaring an advanced
    publisher holds that lock while it waits for one of their tasks (measured with eclipse-zenoh
    1.10.2: the whole program stops for 10 s). Only samples of plain subscribers are received on
    other threads. Zenoh's own queueing callbacks prevent a program from ending.

    Args:
        source: A declaration with :data:`CHANNEL`; undeclaring it ends the thread.
        callback: Called with each item.
        name: Name of the thread.

    Attributes:
        idle: Whether the callback has had all items, and the thread waits for the next one.
    """

    def __init__(self, source: Any, callback: Callable[[Any], None], name: str) -> None:
        self._source, self._callback, self.idle = source, callback, True
        # Not available any more once the source is undeclared.
        self._items = source.handler
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def undeclare(self, timeout: float = _CLOSE_TIMEOUT_S) -> bool:
        """Undeclare the source, and wait for the thread, unless called on it.

        Args:
            timeout: Seconds to wait.

        Returns:
            Whether the thread has ended. That of an advanced subscriber continues while it has open
            queries; closing the session ends it.
        """
        with suppress(zenoh.ZError):  # undeclared already, or the session was closed first
            self._source.undeclare()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout)
        return not self._thread.is_alive()

    def _work(self) -> None:
        callback, handling = self._callback, guarded(_log, _FAILURE)
        for received in self._items:
            self.idle, item = False, received
            while item is not None:
                with handling:
                    callback(item)
                try:
                    item = self._items.try_recv()
                except zenoh.ZError:  # undeclared
                    return
            self.idle = True


#: The channel of a :class:`Pump`, long enough never to be full while its thread lives.
CHANNEL = zenoh.handlers.FifoChannel(100_000)


#: Size of payloads in bytes from which shared memory is used; Zenoh itself uses it from 3 kB.
_MIN_SHARED_SIZE = 64 * 1024
#: Smallest pool size in bytes and in payloads; only used parts take up memory.
_MIN_POOL_SIZE = 64 * 1024 * 1024
_MIN_POOL_PAYLOADS = 10
#: Bytes of a view to copy at a time; from 128 kB on, malloc would get fresh memory each time.
_PIECE = 96 * 1024
#: The folder of shared memory on Linux.
_SHM_FOLDER = "/dev/shm"


class SharedMemory:
    """The shared memory for the payloads of a session.

    Writing a payload there saves one copy by Zenoh. Where there is no room, because receivers are
    slow or the machine's memory is full, payloads are sent as usual.
    """

    def __init__(self) -> None:
        from zenoh import shm  # noqa: PLC0415 - not in every build of Zenoh

        self._shm = shm
        #: Guards the pool, which is replaced by a larger one when needed.
        self._lock = threading.Lock()
        self._provider: shm.ShmProvider | None = None
        self._size = self._refused = 0

    def place(self, parts: Sequence[bytes | bytearray | memoryview]) -> zenoh.ZBytes | None:
        """Return a payload in shared memory; None if it is too small or there is no room."""
        size = sum(map(len, parts))
        if size < _MIN_SHARED_SIZE:
            return None
        provider = self._provide(size)
        if provider is None:
            return None
        try:
            buffer = provider.alloc(size, policy=self._shm.GarbageCollect())
        except zenoh.ZError:
            return None
        start = 0
        for part in parts:
            _copy(part, buffer, start)
            start += len(part)
        payload: zenoh.ZBytes = zenoh.ZBytes(buffer)
        return payload

    def _provide(self, size: int) -> shm.ShmProvider | None:
        with self._lock:
            if size * 2 <= self._size:
                return self._provider
            wanted = min(max(_MIN_POOL_SIZE, size * _MIN_POOL_PAYLOADS), lockable_bytes())
            if self._refused and wanted >= self._refused:
                return self._provider if size <= self._size else None
            try:
                if wanted < size * 2:
                    raise MemoryError(
                        f"Zenoh locks it, and this user may lock {wanted / 2**20:.0f} MB; "
                        f"{size * 2 / 2**20:.0f} MB are needed at least: raise the limit "
                        "(ulimit -l, memlock in /etc/security/limits.conf, LimitMEMLOCK in systemd)"
                    )
                if wanted > _free() // 2:
                    raise MemoryError(f"{_SHM_FOLDER} has less than {2 * wanted // 2**20} MB left")
                # Payloads in the old pool keep it until they are received.
                self._provider = self._shm.ShmProvider.default_backend(wanted)
                self._size = wanted
            except (zenoh.ZError, MemoryError) as error:
                self._refused = wanted
                _log.warning(
                    "no shared memory for messages of %d bytes, they are copied once more: %s",
                    size,
                    error,
                )
            return self._provider if size <= self._size else None


def _copy(part: bytes | bytearray | memoryview, buffer: shm.ZShmMut, start: int) -> None:
    if not isinstance(part, memoryview):
        buffer[start : start + len(part)] = part
        return
    for offset in range(0, len(part), _PIECE):
        piece = bytes(part[offset : offset + _PIECE])
        buffer[start + offset : start + offset + len(piece)] = piece


def lockable_bytes() -> int:
    """Return the largest pool in bytes that this user may lock.

    Zenoh locks its pools in memory; Debian allows 8 MB to users other than root.
    """
    if resource is None or os.geteuid() == 0:
        return 1 << 62
    limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0]
    # Leave room for Zenoh's own pages and for rounding.
    return 1 << 62 if limit == resource.RLIM_INFINITY else limit * 3 // 4


def _free() -> int:
    """Return the free shared memory in bytes; writing more would kill the program."""
    try:
        state = os.statvfs(_SHM_FOLDER)
    except (AttributeError, OSError):  # not Linux
        return 1 << 62
    return state.f_bavail * state.f_frsize
