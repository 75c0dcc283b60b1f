"""Receiving samples over Zenoh, in the way that costs least for how they come and who waits.

Usually each sample comes on the thread that receives it, which is the fastest. Where thousands come
in a second, a thread of Python's own takes them from a native channel, as entering Python from
outside costs more than everything else. Where nobody waits for them, they are taken from a channel
some ten times a second.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from contextlib import suppress
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol

import zenoh
import zenoh.ext

from rosglass.comm import Durability, EndpointKind, Reliability
from rosglass.comm.statistics import LatencyEstimator
from rosglass.wires.base import OnSample, Reader
from rosglass.wires.zenoh.endpoints import Declaration, Owner, Pump
from rosglass.wires.zenoh.keys import ATTACHMENT, HUMBLE_HASH, NO_ATTACHMENT

if TYPE_CHECKING:
    from rosglass.comm import QoS
    from rosglass.comm.graph import Graph
    from rosglass.wires.zenoh.endpoints import LocalRegistry

__all__ = ["Drain", "ZenohReader"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds between two looks at what nobody waits for.
_INTERVAL = 0.1
_INTERVAL_NS = 100_000_000
#: Seconds, at least, over which samples are counted to know their rate.
_WINDOW = 0.2
#: Every 512th sample is a moment to see whether they come too fast.
_HURRY = 511
#: Samples per second from which collecting what nobody waits for is worth while.
_OFTEN = 30.0
#: Samples per second from which a thread of their own is worth while.
_FAST = 2000.0
#: Most samples that wait in a channel, and most bytes, going by the largest sample seen.
_MAX_WAITING = 4096
_MAX_BYTES = 32 * 1024 * 1024
#: Most samples that wait for a thread of their own: what waits gets its time stamp late.
_MAX_BUSY = 512
#: Largest sample, in bytes, whose copying does not outweigh what a channel saves.
_SMALL = 65_536
#: Seconds that closing waits for a thread.
_PATIENCE = 1.0
#: Seconds for the thread of a transient local subscription, which may last longer.
_SHORTLY = 0.02
#: The node's own publishers hand on their samples themselves.
_OTHERS = zenoh.Locality.REMOTE
#: Publishers that are remembered, for a second.
_MAX_PUBLISHERS = 256
_NOTE_SIZE, _read_note = ATTACHMENT.size, ATTACHMENT.unpack


class _Take(Protocol):
    """Takes samples."""

    def __call__(self, sample: zenoh.Sample, received: int = 0, /) -> None:
        """Take a sample and the time at which it was received, 0 for now."""


class Drain:
    """The thread that takes what nobody waits for, for all readers of a session."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._lock = threading.Lock()
        self._collected: dict[_Collected, None] = {}
        self._wake = threading.Event()
        self._leaving: list[Pump] = []
        self._thread: threading.Thread | None = None

    def add(self, collected: _Collected) -> None:
        """Take what comes there from now on."""
        with self._lock:
            self._collected[collected] = None
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
                self._thread.start()

    def remove(self, collected: _Collected) -> None:
        """Take no more from there; without anything to do, the thread ends."""
        with self._lock:
            self._collected.pop(collected, None)
            if not self._collected:
                self._wake.set()

    def see_off(self, pump: Pump) -> None:
        """Wait for the end of a pump's thread, but not before the session is closed."""
        with self._lock:
            self._leaving = [one for one in self._leaving if not one.undeclare(0)]
            self._leaving.append(pump)

    def close(self) -> None:
        """Take nothing more, and wait for the end of the threads; the session is closed."""
        with self._lock:
            self._collected.clear()
            leaving, thread = self._leaving, self._thread
        self._wake.set()
        for pump in leaving:
            pump.undeclare(_PATIENCE)
        if thread is not None and thread is not threading.current_thread():
            thread.join(_PATIENCE)

    def _work(self) -> None:
        while True:
            with self._lock:
                collected = list(self._collected)
                if not collected:
                    self._thread = None
                    return
            for one in collected:
                one.flush()
            if self._wake.wait(_INTERVAL):
                self._wake.clear()


class _Source(Protocol):
    """Where a reader's samples come from."""

    def begin(self) -> None:
        """Hand on what has come since it was made, and what comes."""

    def end(self) -> None:
        """Receive no more; hand on what came before that."""


class _Direct:
    """Hands on samples in the thread that receives them; held ones only from the beginning on."""

    def __init__(self, session: zenoh.Session, key: str, take: _Take, *, held: bool) -> None:
        self._take = take
        self._lock = threading.Lock()
        self._held: deque[tuple[zenoh.Sample, int]] | None = deque() if held else None
        callback = zenoh.handlers.Callback(self._receive if held else take, indirect=False)
        self._subscriber: Any = session.declare_subscriber(key, callback, allowed_origin=_OTHERS)

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
        with suppress(zenoh.ZError):  # the session went first
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
    """Hands on samples in a thread of their own."""

    def __init__(
        self, subscriber: Any, take: _Take, name: str, patience: float, drain: Drain
    ) -> None:
        self._subscriber, self._take, self._name = subscriber, take, name
        self._patience, self._drain = patience, drain
        self._pump: Pump | None = None

    def begin(self) -> None:
        self._pump = Pump(self._subscriber, self._receive, self._name)

    def end(self) -> None:
        if self._pump is None:
            self.begin()
        assert self._pump is not None
        if not self._pump.undeclare(self._patience):
            self._drain.see_off(self._pump)

    def _receive(self, sample: zenoh.Sample) -> None:
        self._take(sample, time.time_ns())


class _Collected:
    """Hands on samples now and then."""

    def __init__(
        self, session: zenoh.Session, key: str, room: int, take: _Take, drain: Drain
    ) -> None:
        self._take, self._drain = take, drain
        # Reentrant: what listens to events of a subscription may ask for its samples.
        self._lock = threading.RLock()
        self._looked = time.monotonic_ns()
        self._subscriber: Any = session.declare_subscriber(
            key, zenoh.handlers.FifoChannel(room), allowed_origin=_OTHERS
        )
        self._next = self._subscriber.handler.try_recv

    def begin(self) -> None:
        self._drain.add(self)

    def end(self) -> None:
        self._drain.remove(self)
        # Not while its handler is read: undeclaring it then raises "Already borrowed".
        with self._lock, suppress(zenoh.ZError):  # the session went first
            self._subscriber.undeclare()
        self.flush()

    def flush(self) -> None:
        """Hand on what waits, in the calling thread."""
        with self._lock, suppress(zenoh.ZError):  # undeclared, and empty
            now = time.monotonic_ns()
            # What waited longer than it should must not look new: the program was held up.
            received = time.time_ns() - max(0, now - self._looked - _INTERVAL_NS)
            for _ in range(_MAX_WAITING):
                sample = self._next()
                if sample is None:
                    break
                self._take(sample, received)
            self._looked = now


class _Way(Enum):
    """How a reader's samples come."""

    DIRECT = "one by one"
    PUMPED = "through a thread of their own"
    COLLECTED = "together, now and then"


class ZenohReader(Declaration, Reader):
    """A subscriber and its token.

    Args:
        owner: Keeps the declaration.
        token: The subscription's token.
        place: The topic and its type.
        key: Key expression of the topic's samples, whatever their definition.
        qos: The subscription's profile.
        on_sample: Takes the samples.
        drain: Takes what nobody waits for.
        readers: Where the node's own publishers find it.
        graph: Where publishers' profiles are looked up.
    """

    def __init__(
        self,
        owner: Owner,
        token: str,
        place: tuple[str, str],
        key: str,
        qos: QoS,
        on_sample: OnSample,
        drain: Drain,
        readers: LocalRegistry[ZenohReader],
        graph: Graph,
    ) -> None:
        super().__init__(owner, token)
        self._place, self._readers, self._graph = place, readers, graph
        # Transient local ones get everything over Zenoh, and never in the thread that sends.
        if qos.durability is not Durability.TRANSIENT_LOCAL:
            readers.add(place, self)
        self._key, self._qos, self._on_sample, self._drain = key, qos, on_sample, drain
        self._session: zenoh.Session | None = None
        self._source: _Source | None = None
        self._way = _Way.DIRECT
        self._eager, self._moving = True, False
        self._known: dict[bytes, tuple[str, int]] = {}
        self._lateness = LatencyEstimator()
        self._warned = self._anonymous = False
        self._count = self._largest = self._marked = 0
        self._marked_at, self._rate = time.monotonic(), 0.0

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare the subscriber; a transient local one asks publishers for their last samples."""
        source: _Source
        if self._qos.durability is Durability.TRANSIENT_LOCAL:
            name = f"{self._key} samples"
            advanced = self._declare_advanced(session)
            source = _Pumped(advanced, self._take, name, _SHORTLY, self._drain)
        else:
            self._session = session
            source = _Direct(session, self._key, self._take, held=False)
        with self._lock:
            self._source = source
        source.begin()
        return []

    def set_eager(self, eager: bool) -> None:
        """Say whether anybody waits for the samples."""
        self._eager = eager
        if eager and self._way is _Way.COLLECTED:
            self._move()

    def flush(self) -> None:
        """Hand on what waits for its turn."""
        source = self._source
        if isinstance(source, _Collected):
            source.flush()

    def poll(self) -> None:
        """Choose how samples come from now on; called about once a second."""
        now, count = time.monotonic(), self._count
        if now - self._marked_at < _WINDOW:
            return
        self._known.clear()  # other publishers may have appeared, or these tell more
        self._rate = (count - self._marked) / (now - self._marked_at)
        self._marked, self._marked_at = count, now
        self._move()

    def take_own(self, data: bytes, sent: int, gid: bytes, sequence: int, type_hash: str) -> None:
        """Take a sample of the same node, in the thread that sends it."""
        if not self._closed:
            self._count += 1
            try:
                self._on_sample(data, time.time_ns(), sent, gid, sequence, type_hash)
            except Exception:
                self._log_failure()

    def _release(self) -> None:
        self._readers.remove(self._place, self)
        super()._release()
        with self._lock:
            source, self._source = self._source, None
        if source is not None:
            source.end()

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

    def _wanted(self) -> _Way:
        """Return how samples should come, going by their rate, their size and who waits."""
        # Once chosen, a way is kept until the rate is half of what it was chosen for.
        often = _OFTEN / 2 if self._way is _Way.COLLECTED else _OFTEN
        fast = _FAST / 2 if self._way is _Way.PUMPED else _FAST
        room = min(_MAX_WAITING, self._room())
        if not self._eager and self._rate > often and self._rate * 4 * _INTERVAL < room:
            return _Way.COLLECTED
        if self._rate > fast and self._largest <= _SMALL:
            return _Way.PUMPED
        return _Way.DIRECT

    def _room(self) -> int:
        return max(1, _MAX_BYTES // max(1, self._largest))

    def _move(self) -> None:
        """Let samples come in another way: all of them, and in order.

        The new subscriber is there before the old one goes. What both receive is handed on twice,
        under one number, and recognised by who takes it.
        """
        wanted, session = self._wanted(), self._session
        with self._lock:
            staying = self._moving or self._anonymous or wanted is self._way
            if staying or session is None or self._source is None:
                return
            self._moving = True
        try:
            new = self._make(session, wanted)
            with self._lock:
                # Until the new one has begun, both are this thread's to end, not close()'s.
                old, self._source = self._source, None
            if old is not None:
                old.end()
            new.begin()
            with self._lock:
                closed = self._closed
                if not closed:
                    self._source, self._way = new, wanted
            if closed:
                new.end()
        except zenoh.ZError as error:
            _log.debug("%s: keeps receiving as before: %s", self._key, error)
        finally:
            self._moving = False

    def _make(self, session: zenoh.Session, way: _Way) -> _Source:
        if way is _Way.DIRECT:
            return _Direct(session, self._key, self._take, held=True)
        if way is _Way.COLLECTED:
            room = min(_MAX_WAITING, self._room())
            return _Collected(session, self._key, room, self._take, self._drain)
        channel = zenoh.handlers.FifoChannel(min(_MAX_BUSY, self._room()))
        subscriber = session.declare_subscriber(self._key, channel, allowed_origin=_OTHERS)
        name = f"{self._key} samples"
        return _Pumped(subscriber, self._take, name, _PATIENCE, self._drain)

    def _take(self, sample: zenoh.Sample, received: int = 0, /) -> None:
        """Hand a sample on; every line here is paid for by each sample."""
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
                known = self._look_at(sample, data, note, gid)
                if known is None:
                    return
            self._count = count = self._count + 1
            if not count & _HURRY:
                self._hurry()
            type_hash, lifespan = known
            # Not by the difference of two clocks, but by how long others of its kind took.
            if lifespan and gid and self._lateness.add(gid, received, sent) > lifespan:
                return
            self._on_sample(data, received, sent, gid, sequence, type_hash)
        except Exception:
            self._log_failure()

    def _hurry(self) -> None:
        """Have the way of receiving chosen anew, if this one is too slow for what comes."""
        span = time.monotonic() - self._marked_at
        fast = self._count - self._marked > _FAST * span
        if fast and span > _WINDOW and self._way is _Way.DIRECT:
            self._owner.wake()

    def _look_at(
        self, sample: zenoh.Sample, data: bytes, note: bytes, gid: bytes
    ) -> tuple[str, int] | None:
        """Take a closer look at a publisher's sample, about once a second.

        Returns:
            The publisher's type hash, and the nanoseconds after which its samples are worthless, 0
            for never. None when there is no sample.
        """
        if len(data) < 4 and sample.kind == zenoh.SampleKind.DELETE:
            return None
        self._largest = max(self._largest, len(data))
        type_hash = str(sample.key_expr).rpartition("/")[2]
        if type_hash == HUMBLE_HASH:
            type_hash = ""
        known = type_hash, self._lifespan_of(gid)
        if not gid:
            self._doubt(note)
        elif len(self._known) < _MAX_PUBLISHERS:
            self._known[gid] = known
        return known

    def _log_failure(self) -> None:
        _log.exception("%s: handling a sample failed", self._key)

    def _doubt(self, note: bytes) -> None:
        """Take note of a publisher that does not say who it is."""
        self._anonymous = True  # its samples cannot be told apart when they come twice
        if note and not self._warned:
            self._warned = True
            _log.warning(
                "%s: samples come with %d bytes attached that are not what ROS 2 attaches: their "
                "publisher, number and time of sending stay unknown",
                self._key,
                len(note),
            )

    def _lifespan_of(self, gid: bytes) -> int:
        publishers = self._graph.endpoints(EndpointKind.PUBLISHER, self._place[0])
        profiles = [self._qos, *(one.qos for one in publishers if gid and one.gid == gid)]
        spans = [profile.lifespan.nanoseconds for profile in profiles if profile.lifespan]
        return min(spans, default=0)
