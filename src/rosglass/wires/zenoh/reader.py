"""Receiving samples over Zenoh, in the cheapest of four ways.

Usually each sample is handled on Zenoh's receiving thread, which is the fastest. At thousands per
second, a Python thread takes them from a native channel, as entering Python from outside costs more
than everything else: one thread for a topic that is so fast, or one for all topics that are so fast
together, which takes them every 2 ms. If no consumer waits, they are taken from a channel ten times
a second.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from contextlib import suppress
from enum import Enum
from itertools import islice
from typing import TYPE_CHECKING, Any, Protocol

import zenoh
import zenoh.ext

from rosglass.comm import Durability, EndpointKind, Reliability
from rosglass.comm.statistics import LatencyEstimator
from rosglass.comm.wire import OnSample, Reader
from rosglass.wires.zenoh.endpoints import Declaration, Owner, Pump
from rosglass.wires.zenoh.keys import ATTACHMENT, HUMBLE_HASH, NO_ATTACHMENT, topic_key

if TYPE_CHECKING:
    from rosglass.comm import EndpointInfo
    from rosglass.wires.zenoh.endpoints import LocalRegistry

__all__ = ["COLLECT_INTERVAL_S", "POLL_INTERVAL_S", "Drain", "ZenohReader"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds between two collections of the samples that no consumer waits for, and of those of many
#: fast topics.
COLLECT_INTERVAL_S, POLL_INTERVAL_S = 0.1, 0.002
#: Shortest time in seconds over which the rate is measured.
_MIN_RATE_WINDOW_S = 0.2
#: The rate is checked at every 512th sample (a bit mask).
_RATE_CHECK_MASK = 511
#: Rate in Hz from which collecting is cheaper, if no consumer waits.
_COLLECT_RATE_HZ = 30.0
#: Rate in Hz from which a thread is cheaper, and a thread for all readers of a node, if they have
#: this rate together.
_THREAD_RATE_HZ, _POLL_RATE_HZ, _POLL_TOTAL_HZ = 2000.0, 200.0, 4000.0
#: Capacity of a channel in samples, and in bytes by the largest sample so far.
_MAX_WAITING = 4096
_MAX_BYTES = 32 * 1024 * 1024
#: Capacity of a thread's channel in samples: those that wait get their timestamp late.
_MAX_THREAD_WAITING = 512
#: Largest sample in bytes for which a channel is cheaper, despite copying.
_MAX_THREAD_SIZE = 65_536
#: Seconds that closing waits for a thread, and for that of a transient-local subscription, which
#: may take longer to end.
_CLOSE_TIMEOUT_S, _LATCHED_CLOSE_TIMEOUT_S = 1.0, 0.02
#: The node's own publishers deliver their samples directly.
_REMOTE = zenoh.Locality.REMOTE
#: Seconds for which messages of other topics are a problem of the subscription.
_MISROUTED_S = 10.0
#: Number of publishers to cache, for a second.
_MAX_PUBLISHERS = 256
_NOTE_SIZE, _read_note = ATTACHMENT.size, ATTACHMENT.unpack


class _OnSample(Protocol):
    """Handles a sample."""

    def __call__(self, sample: zenoh.Sample, received: int = 0, /) -> None:
        """Handle a sample and its time of reception, 0 for now."""


class Drain:
    """A thread that collects the samples of several readers at regular intervals.

    Args:
        name: The thread's name.
        interval_s: Seconds between two collections.
    """

    def __init__(self, name: str, interval_s: float) -> None:
        self._name, self._interval_s = name, interval_s
        #: Guards the state below; notified when the thread has to end.
        self._lock = threading.Condition()
        self._collected: dict[_Collected, None] = {}
        self._ending: list[Pump] = []
        self._thread: threading.Thread | None = None

    def add(self, collected: _Collected) -> None:
        """Collect the samples of a source from now on."""
        with self._lock:
            self._collected[collected] = None
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
                self._thread.start()

    def remove(self, collected: _Collected) -> None:
        """Stop collecting from a source; the thread ends with the last one."""
        with self._lock:
            self._collected.pop(collected, None)
            self._lock.notify_all()

    def join_later(self, pump: Pump) -> None:
        """Wait for the end of a pump's thread when the session is closed."""
        with self._lock:
            self._ending = [one for one in self._ending if not one.undeclare(0)]
            self._ending.append(pump)

    def close(self) -> None:
        """Wait for the end of all threads; the session is closed."""
        with self._lock:
            self._collected.clear()
            ending, thread = self._ending, self._thread
            self._lock.notify_all()
        for pump in ending:
            pump.undeclare(_CLOSE_TIMEOUT_S)
        if thread is not None and thread is not threading.current_thread():
            thread.join(_CLOSE_TIMEOUT_S)

    def _work(self) -> None:
        while True:
            with self._lock:
                collected = list(self._collected)
            for source in collected:
                source.flush()
            with self._lock:
                if self._lock.wait_for(lambda: not self._collected, self._interval_s):
                    self._thread = None
                    return


class _Source(Protocol):
    """The source of a reader's samples."""

    def begin(self) -> None:
        """Start to hand on samples, from those received since it was created."""

    def end(self) -> None:
        """Stop receiving, and hand on what was received before."""


class _Direct:
    """Hands on samples on the receiving thread; `held` ones are kept until :meth:`begin`."""

    def __init__(self, session: zenoh.Session, key: str, take: _OnSample, *, held: bool) -> None:
        self._take = take
        #: Guards the held samples, so that they are handed on in order.
        self._lock = threading.Lock()
        self._held: deque[tuple[zenoh.Sample, int]] | None = deque() if held else None
        callback = zenoh.handlers.Callback(self._receive if held else take, indirect=False)
        self._subscriber: Any = session.declare_subscriber(key, callback, allowed_origin=_REMOTE)

    def begin(self) -> None:
        held = self._held
        while held is not None:
            with self._lock:
                if not held:
                    self._held = None
                    return
                item = held.popleft()
            self._take(*item)

    def end(self) -> None:
        with suppress(zenoh.ZError):  # the session was closed first
            self._subscriber.undeclare()

    def _receive(self, sample: zenoh.Sample) -> None:
        received = time.time_ns()
        if self._held is not None:
            with self._lock:
                if self._held is not None:
                    self._held.append((sample, received))
                    return
        self._take(sample, received)


class _Pumped:
    """Hands on samples on a thread."""

    def __init__(
        self, subscriber: Any, take: _OnSample, name: str, timeout: float, drain: Drain
    ) -> None:
        self._subscriber, self._take, self._name = subscriber, take, name
        self._timeout, self._drain = timeout, drain
        self._pump: Pump | None = None

    def begin(self) -> None:
        self._pump = Pump(self._subscriber, self._take, self._name)

    def end(self) -> None:
        if self._pump is None:
            self.begin()
        assert self._pump is not None
        if not self._pump.undeclare(self._timeout):
            self._drain.join_later(self._pump)


class _Collected:
    """Hands on samples when they are collected."""

    def __init__(
        self, session: zenoh.Session, key: str, room: int, take: _OnSample, drain: Drain
    ) -> None:
        self._take, self._drain = take, drain
        #: Guards reading from the channel; reentrant, as callbacks may take samples.
        self._lock = threading.RLock()
        self._subscriber: Any = session.declare_subscriber(
            key, zenoh.handlers.FifoChannel(room), allowed_origin=_REMOTE
        )
        self._next = self._subscriber.handler.try_recv

    def begin(self) -> None:
        self._drain.add(self)

    def end(self) -> None:
        self._drain.remove(self)
        # Undeclaring a handler that is being read raises "Already borrowed".
        with self._lock, suppress(zenoh.ZError):  # the session was closed first
            self._subscriber.undeclare()
        self.flush()

    def flush(self) -> None:
        """Hand on the waiting samples, in the calling thread."""
        with self._lock, suppress(zenoh.ZError):  # undeclared, and empty
            # Those that waited, because the program was stalled, are late by their stamps. Unless
            # this is the time by which that is measured, they would look as if in time.
            received = time.time_ns()
            for sample in islice(iter(self._next, None), _MAX_WAITING):
                self._take(sample, received)


class _Mode(Enum):
    """How a reader's samples are received."""

    DIRECT = "on the receiving thread"
    PUMPED = "on a thread"
    POLLED = "on a thread for all fast topics"
    COLLECTED = "in batches"


class ZenohReader(Declaration, Reader):
    """A subscription and its token.

    Args:
        owner: The middleware.
        token: The subscription's token.
        endpoint: The subscription.
        on_sample: Handles the samples.
        drain: Collects the samples while no consumer waits.
        poller: Collects the samples of many fast topics.
        readers: The readers of the node, to which its own publishers deliver directly.
    """

    def __init__(
        self,
        owner: Owner,
        token: str,
        endpoint: EndpointInfo,
        on_sample: OnSample,
        drain: Drain,
        poller: Drain,
        readers: LocalRegistry[ZenohReader],
    ) -> None:
        super().__init__(owner, token)
        self._place, self._qos = (endpoint.name, endpoint.type), endpoint.qos
        # All definitions of the type, and the own one.
        self._key = topic_key(owner.options.domain, *self._place, "*")
        own_hash = HUMBLE_HASH if owner.options.humble else endpoint.type_hash or HUMBLE_HASH
        self._own_key = topic_key(owner.options.domain, *self._place, own_hash)
        self._on_sample, self._readers = on_sample, readers
        self._drain, self._poller = drain, poller
        # Transient-local ones receive everything over Zenoh, never in the sending thread.
        if self._qos.durability is not Durability.TRANSIENT_LOCAL:
            readers.add(self._place, self)
        self._known_key: zenoh.KeyExpr | None = None
        self._session: zenoh.Session | None = None
        self._source: _Source | None = None
        self._mode = _Mode.DIRECT
        self._eager, self._switching = True, False
        self._known: dict[bytes, tuple[str, int]] = {}
        self._latency = LatencyEstimator()
        self._warned = self._anonymous = False
        #: Messages of other topics, one of these topics, and the time of the last of them.
        self._misrouted, self._other_topic, self._misrouted_at = 0, "", -math.inf
        self._count = self._largest = self._marked = 0
        self._marked_at, self.rate = time.monotonic(), 0.0

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare the subscriber; a transient-local one queries the publishers' last samples."""
        source: _Source
        # Zenoh looks for the routes of a key that no entity has for each of its messages, which is
        # half of its work for a small one. The declaration ends with its object.
        self._known_key = session.declare_keyexpr(self._own_key)
        if self._qos.durability is Durability.TRANSIENT_LOCAL:
            name = f"{self._key} samples"
            advanced = self._declare_advanced(session)
            source = _Pumped(advanced, self._take, name, _LATCHED_CLOSE_TIMEOUT_S, self._drain)
        else:
            self._session = session
            source = _Direct(session, self._key, self._take, held=False)
        with self._lock:
            self._source = source
        source.begin()
        return []

    @property
    def problem(self) -> str:  # type: ignore[override]
        """How many messages of other topics have arrived, while they do."""
        if time.monotonic() - self._misrouted_at > _MISROUTED_S:
            return ""
        return (
            f"{self._misrouted} messages of other topics, such as {self._other_topic}, arrived on "
            "this one and were dropped: Zenoh confuses topics while a link that was interrupted is "
            "restored"
        )

    def set_eager(self, eager: bool) -> None:
        """Set whether a consumer waits for the samples."""
        self._eager = eager
        if eager and self._mode is _Mode.COLLECTED:
            self._switch()

    def flush(self) -> None:
        """Hand on the waiting samples."""
        source = self._source
        if isinstance(source, _Collected):
            source.flush()

    def poll(self) -> None:
        """Choose the cheapest mode; called about once a second."""
        now, count = time.monotonic(), self._count
        if now - self._marked_at < _MIN_RATE_WINDOW_S:
            return
        self._known.clear()  # read the publishers' profiles again
        self.rate = (count - self._marked) / (now - self._marked_at)
        self._marked, self._marked_at = count, now
        self._switch()

    def on_local_sample(
        self, data: bytes, sent: int, gid: bytes, sequence: int, type_hash: str
    ) -> None:
        """Handle a sample of the same node, in the sending thread."""
        if not self._closed:
            self._count += 1
            try:
                self._on_sample(data, time.time_ns(), sent, gid, sequence, type_hash)
            except Exception:  # noqa: BLE001 - the sending thread must go on
                self._log_failure()

    def _release(self) -> None:
        self._readers.remove(self._place, self)
        super()._release()
        with self._lock:
            source, self._source = self._source, None
        if source is not None:
            source.end()
        self._known_key = None

    def _declare_advanced(self, session: zenoh.Session) -> Any:
        reliable = self._qos.reliability is Reliability.RELIABLE
        return zenoh.ext.declare_advanced_subscriber(
            session,
            self._key,
            zenoh.handlers.FifoChannel(_MAX_WAITING),
            history=zenoh.ext.HistoryConfig(
                detect_late_publishers=True, max_samples=self._qos.depth
            ),
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True)
            if reliable
            else None,
            subscriber_detection=True,
        )

    def _choose_mode(self) -> _Mode:
        """Return the cheapest mode for the rate, the size, and whether a consumer waits."""
        # Hysteresis: a mode is kept until the rate is half of what it was chosen for.
        often = _COLLECT_RATE_HZ / 2 if self._mode is _Mode.COLLECTED else _COLLECT_RATE_HZ
        fast = _THREAD_RATE_HZ / 2 if self._mode is _Mode.PUMPED else _THREAD_RATE_HZ
        room = min(_MAX_WAITING, self._room())
        if not self._eager and self.rate > often and self.rate * 4 * COLLECT_INTERVAL_S < room:
            return _Mode.COLLECTED
        if self._largest <= _MAX_THREAD_SIZE:
            if self.rate > fast:
                return _Mode.PUMPED
            factor = 0.5 if self._mode is _Mode.POLLED else 1.0
            if self.rate > factor * _POLL_RATE_HZ and self._owner.rate > factor * _POLL_TOTAL_HZ:
                return _Mode.POLLED
        return _Mode.DIRECT

    def _room(self) -> int:
        return max(1, _MAX_BYTES // max(1, self._largest))

    def _switch(self) -> None:
        """Switch to the cheapest mode without losing or reordering samples.

        The new subscriber is declared before the old one is undeclared. Samples that both receive
        are handed on twice with the same number, by which the subscription recognizes them.
        """
        wanted, session = self._choose_mode(), self._session
        with self._lock:
            staying = self._switching or self._anonymous or wanted is self._mode
            if staying or session is None or self._source is None:
                return
            self._switching = True
        try:
            new = self._create_source(session, wanted)
            with self._lock:
                # Until the new one has begun, this thread ends both, not close().
                old, self._source = self._source, None
            if old is not None:
                old.end()
            new.begin()
            with self._lock:
                closed = self._closed
                if not closed:
                    self._source, self._mode = new, wanted
            if closed:
                new.end()
        except zenoh.ZError as error:
            _log.debug("%s: the mode of receiving is unchanged: %s", self._key, error)
        finally:
            self._switching = False

    def _create_source(self, session: zenoh.Session, mode: _Mode) -> _Source:
        if mode is _Mode.DIRECT:
            return _Direct(session, self._key, self._take, held=True)
        if mode in (_Mode.COLLECTED, _Mode.POLLED):
            room = min(_MAX_WAITING, self._room())
            drain = self._drain if mode is _Mode.COLLECTED else self._poller
            return _Collected(session, self._key, room, self._take, drain)
        channel = zenoh.handlers.FifoChannel(min(_MAX_THREAD_WAITING, self._room()))
        subscriber = session.declare_subscriber(self._key, channel, allowed_origin=_REMOTE)
        name = f"{self._key} samples"
        return _Pumped(subscriber, self._take, name, _CLOSE_TIMEOUT_S, self._drain)

    def _take(self, sample: zenoh.Sample, received: int = 0, /) -> None:
        """Hand on a sample; hot: runs once per sample."""
        try:
            if self._closed:
                return
            received = received or time.time_ns()
            data = sample.payload.to_bytes()
            attached = sample.attachment
            note = b"" if attached is None else attached.to_bytes()
            known = None
            if len(note) == _NOTE_SIZE and note[16] == 16:
                sequence, sent, gid = _read_note(note)
                known = self._known.get(gid)
            else:
                sequence, sent, gid = NO_ATTACHMENT
            if known is None:
                known = self._inspect(sample, data, note, gid)
                if known is None:
                    return
            self._count = count = self._count + 1
            if not count & _RATE_CHECK_MASK:
                self._check_rate()
            type_hash, lifespan = known
            # Compare with the fastest sample, not across clocks.
            if lifespan and gid and self._latency.add(gid, received, sent) > lifespan:
                return
            self._on_sample(data, received, sent, gid, sequence, type_hash)
        except Exception:  # noqa: BLE001 - the next samples must be received
            self._log_failure()

    def _check_rate(self) -> None:
        """Request another mode if the rate is too high for the present one."""
        span = time.monotonic() - self._marked_at
        fast = self._count - self._marked > _THREAD_RATE_HZ * span
        if fast and span > _MIN_RATE_WINDOW_S and self._mode is _Mode.DIRECT:
            self._owner.wake()

    def _inspect(
        self, sample: zenoh.Sample, data: bytes, note: bytes, gid: bytes
    ) -> tuple[str, int] | None:
        """Inspect a publisher's sample, about once a second.

        Returns:
            The publisher's type hash, and its lifespan in nanoseconds, 0 for none. None if there
            is not a sample, or if its publisher is that of another topic.
        """
        if len(data) < 4 and sample.kind == zenoh.SampleKind.DELETE:
            return None
        announced = self._owner.name_of(gid)
        if announced is not None and announced != self._place[0]:
            self._on_misrouted(announced)
            return None
        self._largest = max(self._largest, len(data))
        type_hash = str(sample.key_expr).rpartition("/")[2]
        if type_hash == HUMBLE_HASH:
            type_hash = ""
        known = type_hash, self._lifespan_of(gid)
        if not gid:
            self._on_anonymous(note)
        elif len(self._known) < _MAX_PUBLISHERS:
            self._known[gid] = known
        return known

    def _on_misrouted(self, topic: str) -> None:
        """Count a sample that Zenoh delivered on the wrong topic.

        Its type may be that of this topic, so that nothing else would reveal it. A publisher that
        is not announced is accepted: its token may be late, or its identity not be that of its
        token.
        """
        self._misrouted += 1
        self._misrouted_at, self._other_topic = time.monotonic(), topic
        if self._misrouted == 1:
            _log.warning(
                "%s: dropping a message of %s, as Zenoh confuses topics while a link that was "
                "interrupted is restored; see the subscription's problem for their number",
                self._place[0],
                topic,
            )

    def _log_failure(self) -> None:
        _log.exception("%s: handling a sample failed", self._key)

    def _on_anonymous(self, note: bytes) -> None:
        """Handle a publisher without identity."""
        self._anonymous = True  # duplicates of its samples cannot be recognized
        if note and not self._warned:
            self._warned = True
            _log.warning(
                "%s: samples have attachments of %d bytes that are not those of ROS 2: their "
                "publisher, number and time of sending are unknown",
                self._key,
                len(note),
            )

    def _lifespan_of(self, gid: bytes) -> int:
        publishers = self._owner.graph.endpoints(EndpointKind.PUBLISHER, self._place[0])
        profiles = [self._qos, *(one.qos for one in publishers if gid and one.gid == gid)]
        spans = [profile.lifespan.nanoseconds for profile in profiles if profile.lifespan]
        return min(spans, default=0)
