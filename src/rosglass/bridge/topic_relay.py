"""Relaying one topic one way."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.bridge.status import RelayStatus
from rosglass.comm import IMMEDIATE, Durability, QoS
from rosglass.errors import (
    ConnectionLostError,
    ConversionError,
    DecodeError,
    Error,
    NodeClosedError,
    TypeNotFoundError,
)
from rosglass.messages import MessageType, OpaqueType, Translation, load

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.bridge.side import Side
    from rosglass.comm import EndpointInfo, Publisher, Sample, Subscription

__all__ = ["TopicRelay", "notes"]

_log = logging.getLogger("rosglass.bridge")
#: Seconds that closing waits for a message that is being sent.
_PATIENCE = 2.0


class Outbox:
    """Hands samples on, one after the other, on a thread of its own.

    Args:
        name: The thread's name.
        handle: What to do with each.
        limit: Bytes that may wait; beyond, the oldest are dropped, and counted.

    Attributes:
        dropped: How many were dropped.
    """

    def __init__(self, name: str, handle: Callable[[Sample], None], limit: int) -> None:
        self._name, self._handle, self._limit = name, handle, limit
        self._ready = threading.Condition()
        self._waiting: deque[Sample] = deque()
        self._size = 0
        self._thread: threading.Thread | None = None
        self._closed = False
        self.dropped = 0

    def put(self, sample: Sample) -> None:
        """Take a sample, from any thread, without waiting."""
        with self._ready:
            if self._closed:
                return
            self._waiting.append(sample)
            self._size += len(sample.data)
            while self._size > self._limit and len(self._waiting) > 1:
                self._size -= len(self._waiting.popleft().data)
                self.dropped += 1
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
                self._thread.start()
            self._ready.notify()

    def close(self) -> None:
        """Forget what waits and end the thread; safe to call twice."""
        with self._ready:
            self._closed = True
            self._waiting.clear()
            self._ready.notify()
            thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(_PATIENCE)

    def _work(self) -> None:
        while True:
            with self._ready:
                self._ready.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                sample = self._waiting.popleft()
                self._size -= len(sample.data)
            try:
                self._handle(sample)
            except Exception:
                _log.exception("%s failed", self._name)


#: Seconds for which messages are still taken that nobody in the other world subscribes to.
_IDLE = 5.0
#: Seconds that the first message waits for subscribers in the other world to be linked, and that
#: links take to carry something once they are told of.
_LINKING, _LINKED = 1.5, 0.15
#: Seconds that a publisher's first message waits for what the graph says of the publisher.
_INTRODUCTION = 1.5


class TopicRelay:
    """Takes a topic's messages in one world and publishes them in the other.

    It subscribes only while somebody in the other world does, so that robots send nothing in vain;
    latched topics, and those told to be kept, always. Latched messages keep their publishers apart:
    each has one in the other world, which ends with it.

    What is not for other threads runs on the bridge's.

    Args:
        source: Where it is published.
        target: Where it is to be.
        topic: Its name at the source.
        other: Its name at the target.
        kind: Name of its type at the source, when nobody publishes it yet; empty to be told.
        qos: Profile for both ends; None for what fits.
        keep: Whether to subscribe even while nobody in the other world does.
        memory: Bytes that may wait while the other world is slow.
        wake: Called when there is something to look at.

    Attributes:
        fixed: Whether it is there whether somebody publishes or not.
        outdated: Whether its type is not that of those who publish now: it is to be made anew.
        ignored: Identities of publishers that other bridges have at the source.
    """

    def __init__(
        self,
        source: Side,
        target: Side,
        topic: str,
        other: str,
        *,
        kind: str = "",
        qos: QoS | None = None,
        keep: bool = False,
        memory: int = 64 * 2**20,
        wake: Callable[[], None],
    ) -> None:
        self._source, self._target, self.topic, self.other = source, target, topic, other
        self._kind, self._qos, self._keep, self._wake = kind, qos, keep, wake
        self.fixed, self.outdated = bool(kind), False
        self.ignored: frozenset[bytes] = frozenset()
        self._subscription: Subscription | None = None
        self._translation: Translation | None = None
        self._type: MessageType | None = None
        self._lock = threading.Lock()
        self._shared: Publisher | None = None
        #: A publisher for each of the source's that latches; those that do not share one.
        self._latched: dict[bytes, Publisher] = {}
        self._volatile: set[bytes] = set()
        #: When publishers were made that have not sent anything.
        self._new: dict[Publisher, float] = {}
        self._own = 0
        self._outbox = Outbox(f"bridge {topic}", self._send, memory)
        self._wanted_at = time.monotonic()
        self._problem = ""
        self._failed: dict[str, int] = {}
        self._failed_at = self._sent_at = -math.inf
        self._count = self._size = self._refused = 0
        self._closed = self._hopeless = False

    # -- on the bridge's thread ------------------------------------------------------------------

    @property
    def alive(self) -> bool:
        """Whether connections to publishers are there, whatever the graph says."""
        subscription = self._subscription
        if subscription is None or subscription.closed:
            return False
        return subscription.publisher_count() > 0

    @property
    def subscribed(self) -> bool:
        """Whether it takes messages now."""
        return self._subscription is not None

    def follow(self, own: int) -> None:
        """Do what is to be done; called often.

        Args:
            own: How many subscriptions this bridge itself has on the topic in the other world.

        Raises:
            NodeClosedError: One of the nodes is closed.
        """
        try:
            self._follow(own)
        except NodeClosedError:
            raise
        except Error as error:
            self._complain(str(error))

    def _follow(self, own: int) -> None:
        if self._hopeless:
            # Nothing can become of its messages: the robot need not send them.
            if self._subscription is not None:
                self._subscription.close()
            return
        now, self._own = time.monotonic(), own
        ends = self._source.sources(self._source.node.publishers(self.topic))
        wanted = self._wanted(own)
        if wanted or self._keep or self._latched or self._type is None:
            self._wanted_at = now
        if self._subscription is None:
            if now == self._wanted_at and (ends or self.fixed):
                self._subscribe()
        elif now - self._wanted_at > _IDLE:
            self._subscription.close()
            self._subscription = None
        if self._subscription is not None:
            self._part(ends)
            if self._type is None and self._subscription.type is not None:
                self._take_type(self._subscription.type)
            if self._shared is None and self._type is not None and self._any_volatile(ends):
                self._publisher(None)

    def _wanted(self, own: int) -> bool:
        publishers = [p for p in (self._shared, *self._latched.values()) if p is not None]
        if any(publisher.subscription_count() > own for publisher in publishers):
            return True
        there = self._target.node.subscriptions(self.other)
        return any(one.node != self._target.name for one in there)

    def _any_volatile(self, ends: list[EndpointInfo]) -> bool:
        """Return whether somebody publishes, or may, who does not latch."""
        return not ends or any(not _latches(end) for end in ends)

    def _subscribe(self) -> None:
        try:
            self._subscription = self._source.node.create_subscription(
                self.topic,
                self._kind or None,
                qos=QoS.best_available(100) if self._qos is None else self._qos,
                raw_callback=self._receive,
                executor=IMMEDIATE,
                ignore_local=True,
            )
        except NodeClosedError:
            return
        except Error as error:
            self._complain(str(error))
            return
        if self._kind and self._subscription.type is not None:
            self._take_type(self._subscription.type)
        self._subscription.on_matched(lambda _: self._wake(), IMMEDIATE)

    def _take_type(self, kind: MessageType) -> None:
        """Find the type in the other world."""
        if self._source.node.wire == self._target.node.wire:
            self._type = kind
            return
        if isinstance(kind, OpaqueType):
            self._complain(f"its type {kind.name} cannot be translated: {kind.reason}")
            return
        try:
            self._translation = Translation(kind, self._in_use(kind.ros))
            self._target.teach(self._translation)
        except Error as error:
            self._hopeless = True
            self._complain(str(error))
            return
        self._type = kind

    def _in_use(self, ros: int) -> list[MessageType]:
        """Return the types that the other world uses on the topic, in the versions it has."""
        node, found = self._target.node, []
        ends = [*node.subscriptions(self.other), *node.publishers(self.other)]
        for end in ends:
            if end.node == self._target.name or not end.type:
                continue
            for version in (end.type_hash, ""):
                with suppress(Error):
                    known = load(end.type, 3 - ros, hash=version)
                    if isinstance(known, MessageType) and known not in found:
                        found.append(known)
                        break
        return found

    def _part(self, ends: list[EndpointInfo]) -> None:
        """Let latched messages go with those who published them."""
        assert self._subscription is not None
        if not self._source.connected:
            return
        there = {identity for end in ends for identity in _identities(end)}
        with self._lock:
            gone = [gid for gid in self._latched if gid not in there]
            ended = [self._latched.pop(gid) for gid in gone]
            self._volatile &= there
        for publisher in ended:
            publisher.close()

    # -- on the threads of the source, and of the outbox -----------------------------------------

    def _receive(self, sample: Sample) -> None:
        if sample.publisher not in self.ignored:
            self._outbox.put(sample)

    def _send(self, sample: Sample) -> None:
        if self._type is None:
            self._take_type(sample.type)
            if self._type is None:
                self._refused += 1
                return
        try:
            publisher = self._publisher_for(sample.publisher)
            if publisher is None:
                return
            same = sample.type.name == self._type.name
            if not same if self._translation is None else sample.type != self._type:
                # A node that was updated has been restarted, unless there are two at once.
                self.outdated = time.monotonic() - self._sent_at > _IDLE
                told = f"{self._type.name} in the version that came first"
                raise ConversionError("", sample.type.name, told, self.topic)
            data: bytes | memoryview = sample.data
            if self._translation is not None:
                data = self._translation.encode(data)
            if publisher in self._new:
                self._await_links(publisher)
            publisher.publish_serialized(data)
        except NodeClosedError:
            return
        except (ConversionError, DecodeError, TypeNotFoundError, ConnectionLostError) as error:
            self._refuse(error)
            return
        except Error as error:
            self._complain(str(error))
            return
        self._count += 1
        self._size += len(sample.data)
        self._sent_at = time.monotonic()
        if self._problem and time.monotonic() - self._failed_at > _IDLE:
            self._problem = ""

    def _publisher_for(self, gid: bytes) -> Publisher | None:
        with self._lock:
            found = self._latched.get(gid)
            if found is not None:
                return found
            known = gid in self._volatile
        if not known:
            if self._introduced(gid):
                return self._publisher(gid)
            with self._lock:
                self._volatile.add(gid)
        return self._shared or self._publisher(None)

    def _introduced(self, gid: bytes) -> bool:
        """Return whether a publisher latches, once the graph has it."""
        if not gid:
            return False
        deadline = time.monotonic() + _INTRODUCTION
        while not self._closed:
            for end in self._source.node.publishers(self.topic):
                if gid in _identities(end):
                    return _latches(end)
            if time.monotonic() > deadline:
                break
            time.sleep(0.02)
        return False

    def _await_links(self, publisher: Publisher) -> None:
        """Wait until those who subscribe in the other world can get a publisher's first message.

        Who publishes a single command, having waited for us to subscribe, must not lose it.
        """
        made = self._new.get(publisher, -math.inf)
        while not self._closed and time.monotonic() < made + _LINKING:
            if publisher.subscription_count() > self._own:
                time.sleep(max(0.0, min(_LINKED, made + _LINKING - time.monotonic())))
                break
            time.sleep(0.01)
        self._new.pop(publisher, None)

    def _publisher(self, gid: bytes | None) -> Publisher | None:
        """Return a new publisher in the other world, for all or for one that latches."""
        kind = self._translation.type if self._translation is not None else self._type
        assert kind is not None
        usual = QoS.latched() if gid is not None else QoS()
        qos = usual if self._qos is None else self._qos
        if self._qos is not None and gid is not None:
            qos = replace(qos, durability=Durability.TRANSIENT_LOCAL)
        made = self._target.node.create_publisher(self.other, kind, qos)
        with self._lock:
            if gid is None and self._shared is None:
                self._shared = kept = made
            elif gid is not None and gid not in self._latched:
                self._latched[gid] = kept = made
            else:
                kept = self._shared if gid is None else self._latched[gid]  # type: ignore[assignment]
            closed = self._closed
            if kept is made:
                self._new[made] = time.monotonic()
        if kept is not made or closed:
            made.close()
        if closed:
            return None
        with suppress(Error):
            made.on_matched(lambda _: self._wake(), IMMEDIATE)
        return kept

    # -- for people ------------------------------------------------------------------------------

    def _refuse(self, error: Error) -> None:
        self._refused += 1
        self._failed_at = time.monotonic()
        where = getattr(error, "path", "") or str(error)
        self._failed[where] = self._failed.get(where, 0) + 1
        if self._failed[where] == 1 and len(self._failed) <= 10:
            _log.warning("%s: a message is not relayed: %s", self.topic, error)
            self._problem = f"messages are not relayed: {error}"

    def _complain(self, problem: str) -> None:
        self._failed_at = time.monotonic()
        if problem != self._problem:
            self._problem = problem
            _log.warning("%s is not relayed: %s", self.topic, problem)

    def status(self) -> RelayStatus:
        """Return how it is doing."""
        translation, kind = self._translation, self._type
        problem = self._problem
        if not problem and self._subscription is not None and not self.alive:
            problem = self._subscription.problem
        return RelayStatus(
            "topic",
            self.topic,
            self.other,
            "->" if self._source.number == 0 else "<-",
            kind.name if kind is not None else "",
            translation.type.name if translation is not None else kind.name if kind else "",
            self._count,
            self._size,
            self._outbox.dropped,
            self._refused,
            () if translation is None else notes(translation),
            problem,
        )

    def close(self) -> None:
        """Stop relaying; safe to call twice."""
        with self._lock:
            self._closed = True
            publishers = [p for p in (self._shared, *self._latched.values()) if p is not None]
            self._latched.clear()
            self._new.clear()
        if self._subscription is not None:
            self._subscription.close()
        self._outbox.close()
        for publisher in publishers:
            publisher.close()


def notes(translation: Translation) -> tuple[str, ...]:
    """Say what a translation loses, adds and makes up."""
    told = []
    if translation.left_out:
        told.append(f"left out: {', '.join(translation.left_out)}")
    if translation.added:
        told.append(f"default: {', '.join(translation.added)}")
    if translation.derived:
        told.append(f"ROS {translation.type.ros} has no such type of its own")
    return tuple(told)


def _latches(end: EndpointInfo) -> bool:
    return end.qos.durability is Durability.TRANSIENT_LOCAL


def _identities(end: EndpointInfo) -> tuple[bytes, ...]:
    # ROS 1 knows publishers by their nodes.
    return end.gid, end.node.full.encode()
