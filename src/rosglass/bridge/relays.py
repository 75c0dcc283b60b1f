"""The relays of a bridge, each for one topic, service or action in one direction."""

from __future__ import annotations

import logging
import math
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from concurrent.futures import Future, wait
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from rosglass.comm import (
    IMMEDIATE,
    ActionClient,
    ActionServer,
    Durability,
    GoalStatus,
    QoS,
    ServiceClient,
    ServiceServer,
)
from rosglass.comm.handle import guarded
from rosglass.errors import (
    ConnectionLostError,
    ConversionError,
    DecodeError,
    Error,
    GoalRejectedError,
    NodeClosedError,
    TypeNotFoundError,
)
from rosglass.errors import TimeoutError as LateError
from rosglass.messages import (
    ActionTranslation,
    ActionType,
    MessageType,
    OpaqueType,
    ServiceTranslation,
    ServiceType,
    Translation,
    load,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.bridge.side import Side
    from rosglass.comm import ClientGoal, EndpointInfo, Publisher, Sample, ServerGoal, Subscription
    from rosglass.messages import Message

__all__ = [
    "ActionRelay",
    "BridgeStatus",
    "OfferedRelay",
    "Outbox",
    "RelayStatus",
    "ServiceRelay",
    "TopicRelay",
    "service_notes",
    "topic_notes",
]


@dataclass(frozen=True, slots=True)
class RelayStatus:
    """The status of one relay.

    Attributes:
        kind: ``topic``, ``service`` or ``action``.
        name: Name in the source graph, with the publishers or the server.
        other: Name in the target graph.
        direction: ``->`` from the first graph to the second, ``<-`` from the second to the first.
        type: Type in the source graph; empty while it is unknown.
        other_type: Type in the target graph; empty while it is unknown.
        count: Messages relayed, calls answered, or goals completed.
        size: Bytes of these messages.
        dropped: Messages dropped for newer ones, because the target graph is slow.
        refused: Messages, calls or goals that failed.
        notes: What is lost or added in translation.
        problem: Why it is not, or only partly, relayed; empty if there is no problem.
    """

    kind: str
    name: str
    other: str
    direction: str
    type: str = ""
    other_type: str = ""
    count: int = 0
    size: int = 0
    dropped: int = 0
    refused: int = 0
    notes: tuple[str, ...] = ()
    problem: str = ""


@dataclass(frozen=True, slots=True)
class BridgeStatus:
    """The status of a bridge.

    Attributes:
        relays: Status of each relay.
        worlds: Problem with the connection to each graph; empty if there is none.
    """

    relays: tuple[RelayStatus, ...]
    worlds: tuple[str, str]

    @property
    def count(self) -> int:
        """Total number of messages, calls and goals."""
        return sum(relay.count for relay in self.relays)

    def line(self) -> str:
        """Return a summary in one line."""
        well = [r for r in self.relays if r.type or not r.problem]
        topics, services, actions = (
            {(r.name, r.direction) for r in well if r.kind == kind}
            for kind in ("topic", "service", "action")
        )
        dropped, refused = (sum(getattr(r, a) for r in self.relays) for a in ("dropped", "refused"))
        text = f"{_many(len(topics), 'topic')}, {_many(len(services), 'service')}"
        text += f", {_many(len(actions), 'action')}: " if actions else ": "
        text += f"{_many(sum(r.count for r in self.relays if r.kind == 'topic'), 'message')}, "
        text += f"{sum(r.size for r in self.relays) / 1e6:.1f} MB, "
        text += _many(sum(r.count for r in self.relays if r.kind == "service"), "call")
        if actions:
            goals = sum(r.count for r in self.relays if r.kind == "action")
            text += f", {_many(goals, 'goal')}"
        if dropped:
            text += f", {dropped} DROPPED"
        if refused:
            text += f", {refused} REFUSED"
        return text


def _many(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"


_log = logging.getLogger("rosglass.bridge")
#: Seconds that closing waits for a message that is being sent.
_SEND_TIMEOUT_S = 2.0


class Outbox:
    """A queue whose samples are handled one after the other on its own thread.

    Args:
        name: The thread's name.
        handle: Handles a sample.
        limit: Size in bytes; beyond it the oldest samples are dropped.

    Attributes:
        dropped: Number of dropped samples.
    """

    def __init__(self, name: str, handle: Callable[[Sample], None], limit: int) -> None:
        self._name, self._handle, self._limit = name, handle, limit
        #: Guards the queue; notified of samples and of closing.
        self._ready = threading.Condition()
        self._waiting: deque[Sample] = deque()
        self._size = 0
        self._thread: threading.Thread | None = None
        self._closed = False
        self.dropped = 0

    def put(self, sample: Sample) -> None:
        """Queue a sample without blocking; from any thread."""
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
        """Discard the queue and end the thread; safe to call twice."""
        with self._ready:
            self._closed = True
            self._waiting.clear()
            self._ready.notify()
            thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(_SEND_TIMEOUT_S)

    def _work(self) -> None:
        while True:
            with self._ready:
                self._ready.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                sample = self._waiting.popleft()
                self._size -= len(sample.data)
            with guarded(_log, "%s failed", self._name):
                self._handle(sample)


#: Seconds that a subscription is kept without subscribers in the target graph.
_IDLE_TIMEOUT_S = 5.0
#: Seconds that a new publisher waits for its first match, and for a match to take effect.
_MATCH_TIMEOUT_S, _MATCH_DELAY_S = 1.5, 0.15
#: Seconds that a publisher's first message waits for the discovery of the publisher.
_DISCOVERY_TIMEOUT_S = 1.5


class TopicRelay:
    """Relays a topic from one graph to the other.

    It subscribes only while the target graph has subscribers, so that robots send nothing in vain;
    to latched topics, and those to keep, always. Each latching publisher has its own counterpart in
    the target graph, which is closed with it.

    Methods run on the bridge's thread unless noted.

    Args:
        source: Graph with the publishers.
        target: Graph to publish in.
        topic: Name in the source graph.
        other: Name in the target graph.
        kind: Name of its type in the source graph; empty to use that of its publishers.
        qos: Profile at both ends; None for a compatible one.
        keep: Whether to subscribe even without subscribers in the target graph.
        memory: Size of the queue in bytes while the target graph is slow.
        wake: Called when the relay has something to do.

    Attributes:
        fixed: Whether it exists regardless of publishers.
        outdated: Whether its publishers have changed their type, so that it must be recreated.
        ignored: Identities of publishers in the source graph that belong to other bridges.
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
        #: Guards the publishers, which the queue's thread creates.
        self._lock = threading.Lock()
        #: The publisher for all of the source's that do not latch.
        self._shared: Publisher | None = None
        #: The publisher for each of the source's that latches, by its identity.
        self._latched: dict[bytes, Publisher] = {}
        self._volatile: set[bytes] = set()
        #: Creation time of publishers that have not sent anything.
        self._new: dict[Publisher, float] = {}
        self._own = 0
        self._outbox = Outbox(f"bridge {topic}", self._send, memory)
        self._wanted_at = time.monotonic()
        self._problem = ""
        self._failed: dict[str, int] = {}
        self._failed_at = self._sent_at = -math.inf
        self._count = self._size = self._refused = 0
        self._closed = self._untranslatable = False

    # -- on the bridge's thread ------------------------------------------------------------------

    @property
    def alive(self) -> bool:
        """True while it is connected to publishers, regardless of the graph."""
        subscription = self._subscription
        if subscription is None or subscription.closed:
            return False
        return subscription.publisher_count() > 0

    @property
    def subscribed(self) -> bool:
        """True while it is subscribed."""
        return self._subscription is not None

    def follow(self, own: int) -> None:
        """Follow the graph.

        Args:
            own: Number of this bridge's own subscriptions to the topic in the target graph.

        Raises:
            NodeClosedError: One of the nodes is closed.
        """
        try:
            self._follow(own)
        except NodeClosedError:
            raise
        except Error as error:
            self._report(str(error))

    def _follow(self, own: int) -> None:
        if self._untranslatable:
            # Its messages cannot be translated: the robot need not send them.
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
        elif now - self._wanted_at > _IDLE_TIMEOUT_S:
            self._subscription.close()
            self._subscription = None
        if self._subscription is not None:
            self._close_left(ends)
            if self._type is None and self._subscription.type is not None:
                self._set_type(self._subscription.type)
            if self._shared is None and self._type is not None and self._any_volatile(ends):
                self._create_publisher(None)

    def _wanted(self, own: int) -> bool:
        publishers = [p for p in (self._shared, *self._latched.values()) if p is not None]
        if any(publisher.subscription_count() > own for publisher in publishers):
            return True
        there = self._target.node.subscriptions(self.other)
        return any(one.node != self._target.name for one in there)

    def _any_volatile(self, ends: list[EndpointInfo]) -> bool:
        """Return whether a publisher does not latch, or none is known."""
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
            self._report(str(error))
            return
        if self._kind and self._subscription.type is not None:
            self._set_type(self._subscription.type)
        self._subscription.on_matched(lambda _: self._wake(), IMMEDIATE)

    def _set_type(self, kind: MessageType) -> None:
        """Set the type, and find its translation."""
        if self._source.node.wire == self._target.node.wire:
            self._type = kind
            return
        if isinstance(kind, OpaqueType):
            self._report(f"its type {kind.name} cannot be translated: {kind.reason}")
            return
        try:
            self._translation = Translation(kind, self._types_in_use(kind.ros))
            self._target.add_type(self._translation)
        except Error as error:
            self._untranslatable = True
            self._report(str(error))
            return
        self._type = kind

    def _types_in_use(self, ros: int) -> list[MessageType]:
        """Return the types that the target graph uses on the topic, in its versions."""
        node, found = self._target.node, []
        ends = [*node.subscriptions(self.other), *node.publishers(self.other)]
        for end in ends:
            if end.node == self._target.name or not end.type:
                continue
            for version in (end.type_hash, ""):
                with suppress(Error):  # a version that cannot be loaded is not preferred
                    known = load(end.type, 3 - ros, hash=version)
                    if isinstance(known, MessageType) and known not in found:
                        found.append(known)
                        break
        return found

    def _close_left(self, ends: list[EndpointInfo]) -> None:
        """Close the publishers whose latching counterpart has left."""
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

    # -- on the threads of the source and of the queue -------------------------------------------

    def _receive(self, sample: Sample) -> None:
        if sample.publisher not in self.ignored:
            self._outbox.put(sample)

    def _send(self, sample: Sample) -> None:
        if self._type is None:
            self._set_type(sample.type)
            if self._type is None:
                self._refused += 1
                return
        try:
            publisher = self._publisher_for(sample.publisher)
            if publisher is None:
                return
            same = sample.type.name == self._type.name
            if not same if self._translation is None else sample.type != self._type:
                # Its node was updated and restarted, unless there are two versions at once.
                self.outdated = time.monotonic() - self._sent_at > _IDLE_TIMEOUT_S
                expected = f"{self._type.name} in the version of the first message"
                raise ConversionError("", sample.type.name, expected, self.topic)
            data: bytes | memoryview = sample.data
            if self._translation is not None:
                data = self._translation.encode(data)
            if publisher in self._new:
                self._wait_for_match(publisher)
            publisher.publish_serialized(data)
        except NodeClosedError:
            return
        except (ConversionError, DecodeError, TypeNotFoundError, ConnectionLostError) as error:
            self._count_failure(error)
            return
        except Error as error:
            self._report(str(error))
            return
        self._count += 1
        self._size += len(sample.data)
        self._sent_at = time.monotonic()
        if self._problem and time.monotonic() - self._failed_at > _IDLE_TIMEOUT_S:
            self._problem = ""

    def _publisher_for(self, gid: bytes) -> Publisher | None:
        with self._lock:
            found = self._latched.get(gid)
            if found is not None:
                return found
            known = gid in self._volatile
        if not known:
            if self._is_latching(gid):
                return self._create_publisher(gid)
            with self._lock:
                self._volatile.add(gid)
        return self._shared or self._create_publisher(None)

    def _is_latching(self, gid: bytes) -> bool:
        """Return whether a publisher latches, once it is discovered."""
        if not gid:
            return False
        deadline = time.monotonic() + _DISCOVERY_TIMEOUT_S
        while not self._closed:
            for end in self._source.node.publishers(self.topic):
                if gid in _identities(end):
                    return _latches(end)
            if time.monotonic() > deadline:
                break
            time.sleep(0.02)
        return False

    def _wait_for_match(self, publisher: Publisher) -> None:
        """Wait until subscribers in the target graph can receive a publisher's first message.

        A single command that is published as soon as the bridge subscribes must not be lost.
        """
        made = self._new.get(publisher, -math.inf)
        while not self._closed and time.monotonic() < made + _MATCH_TIMEOUT_S:
            if publisher.subscription_count() > self._own:
                time.sleep(
                    max(0.0, min(_MATCH_DELAY_S, made + _MATCH_TIMEOUT_S - time.monotonic()))
                )
                break
            time.sleep(0.01)
        self._new.pop(publisher, None)

    def _create_publisher(self, gid: bytes | None) -> Publisher | None:
        """Create a publisher in the target graph, for one that latches or for all others."""
        kind = self._translation.type if self._translation is not None else self._type
        assert kind is not None
        usual = QoS.latched() if gid is not None else QoS()
        qos = usual if self._qos is None else self._qos
        if self._qos is not None and gid is not None:
            # What is latched is received late: it does not expire.
            qos = replace(qos, durability=Durability.TRANSIENT_LOCAL, send_timeout=None)
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
        with suppress(NodeClosedError):  # another thread closed it
            made.on_matched(lambda _: self._wake(), IMMEDIATE)
        return kept

    # -- status ----------------------------------------------------------------------------------

    def _count_failure(self, error: Error) -> None:
        self._refused += 1
        self._failed_at = time.monotonic()
        where = getattr(error, "path", "") or str(error)
        self._failed[where] = self._failed.get(where, 0) + 1
        if self._failed[where] == 1 and len(self._failed) <= 10:
            _log.warning("%s: a message is not relayed: %s", self.topic, error)
            self._problem = f"messages are not relayed: {error}"

    def _report(self, problem: str) -> None:
        self._failed_at = time.monotonic()
        if problem != self._problem:
            self._problem = problem
            _log.warning("%s is not relayed: %s", self.topic, problem)

    def status(self) -> RelayStatus:
        """Return the status."""
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
            () if translation is None else topic_notes(translation),
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


def topic_notes(translation: Translation) -> tuple[str, ...]:
    """Describe the fields that a translation of messages loses and adds."""
    found = []
    if translation.left_out:
        found.append(f"left out: {', '.join(translation.left_out)}")
    if translation.added:
        found.append(f"default: {', '.join(translation.added)}")
    if translation.derived:
        found.append(f"ROS {translation.type.ros} has no such type")
    return tuple(found)


def _latches(end: EndpointInfo) -> bool:
    return end.qos.durability is Durability.TRANSIENT_LOCAL


def _identities(end: EndpointInfo) -> tuple[bytes, ...]:
    # ROS 1 identifies publishers by their nodes.
    return end.gid, end.node.full.encode()


_Client = TypeVar("_Client", ServiceClient, ActionClient)
_Server = TypeVar("_Server", ServiceServer, ActionServer)
_Type = TypeVar("_Type", ServiceType, ActionType)
_Translation = TypeVar("_Translation", ServiceTranslation, ActionTranslation)


class OfferedRelay(ABC, Generic[_Client, _Server, _Type, _Translation]):
    """Relays a service or an action: a client in one graph, a server in the other.

    Args:
        source: Graph with the server.
        target: Graph to offer it in.
        name: Name in the source graph.
        other: Name in the target graph.
        kind: Name of its type in the source graph; empty to use that of the server.
        timeout: Seconds that the server has to answer.
    """

    #: ``service`` or ``action``.
    KIND: ClassVar[str]
    #: The messages of its type.
    PARTS: ClassVar[tuple[str, ...]]

    def __init__(
        self,
        source: Side,
        target: Side,
        name: str,
        other: str,
        *,
        kind: str = "",
        timeout: float = 10.0,
    ) -> None:
        self._source, self._target = source, target
        self.name, self.other = name, other
        self._kind, self._timeout = kind, timeout
        self._client: _Client | None = None
        self._server: _Server | None = None
        self._translation: _Translation | None = None
        self._type: _Type | None = None
        self._problem = ""
        self._count = self._refused = 0

    @abstractmethod
    def _create_client(self) -> _Client:
        """Create a client in the source graph."""

    @abstractmethod
    def _translate(self, kind: _Type) -> _Translation:
        """Create the translation of a type."""

    @abstractmethod
    def _create_server(self, kind: _Type) -> _Server:
        """Create a server in the target graph."""

    @abstractmethod
    def close(self) -> None:
        """Stop relaying; safe to call twice."""

    def follow(self, wake: Callable[[], None]) -> None:
        """Follow the server; on the bridge's thread."""
        try:
            client = self._client
            if client is None:
                client = self._client = self._create_client()
                client.on_ready_change(lambda _: wake(), IMMEDIATE)
            kind: Any = client.type
            if self._server is None and kind is not None and not self._problem:
                self._serve(kind)
        except NodeClosedError:
            return
        except Error as error:
            if str(error) != self._problem:
                self._problem = str(error)
                _log.warning("%s is not relayed: %s", self.name, error)

    def _serve(self, kind: _Type) -> None:
        offered = kind
        if self._source.node.wire != self._target.node.wire:
            self._translation = self._translate(kind)
            self._target.add_type(self._translation)
            offered = self._translation.type  # type: ignore[assignment]
        self._type = kind
        self._server = self._create_server(offered)

    def status(self) -> RelayStatus:
        """Return the status."""
        kind, translation = self._type, self._translation
        problem = self._problem
        if not problem and self._client is not None:
            problem = self._client.problem
        return RelayStatus(
            self.KIND,
            self.name,
            self.other,
            "->" if self._source.number == 0 else "<-",
            "" if kind is None else kind.name,
            translation.type.name if translation is not None else kind.name if kind else "",
            count=self._count,
            refused=self._refused,
            notes=() if translation is None else service_notes(translation, self.PARTS),
            problem=problem,
        )


def service_notes(
    translation: ServiceTranslation | ActionTranslation, parts: tuple[str, ...]
) -> tuple[str, ...]:
    """Describe the fields that a translation of a service or action loses."""
    found = []
    for name in parts:
        found += [f"left out of the {name}: {path}" for path in getattr(translation, name).left_out]
    if translation.derived:
        found.append(f"ROS {translation.type.ros} has no such type")
    return tuple(found)


class ServiceRelay(OfferedRelay[ServiceClient, ServiceServer, ServiceType, ServiceTranslation]):
    """Relays a service; arguments as for :class:`OfferedRelay`."""

    KIND = "service"
    PARTS = ("request", "response")

    def _create_client(self) -> ServiceClient:
        return self._source.node.create_service_client(self.name, self._kind or None)

    def _translate(self, kind: ServiceType) -> ServiceTranslation:
        return ServiceTranslation(kind)

    def _create_server(self, kind: ServiceType) -> ServiceServer:
        node = self._target.node
        return node.create_service_server(self.other, kind, self._call, executor=IMMEDIATE)

    def _call(self, request: Message) -> Future[Message]:
        """Call the server; return a future for its response or error."""
        answer: Future[Message] = Future()
        answer.set_running_or_notify_cancel()
        client, translation = self._client, self._translation
        assert client is not None
        try:
            asked = request if translation is None else translation.request.convert(request)
            call = client.call_async(asked, timeout=self._timeout)
        except Error as error:
            self._fail(answer, error)
            return answer

        def done(call: Future[Any]) -> None:
            try:
                response = call.result()
                if translation is not None:
                    response = translation.response.convert(response)
            except Exception as error:  # noqa: BLE001 - the client waits for an answer
                self._fail(answer, error)
            else:
                self._count += 1
                answer.set_result(response)

        call.add_done_callback(done)
        return answer

    def _fail(self, answer: Future[Message], error: BaseException) -> None:
        self._refused += 1
        answer.set_exception(error)

    def close(self) -> None:
        """Stop relaying, and fail open calls; safe to call twice."""
        if self._server is not None:
            self._server.close()
        if self._client is not None:
            self._client.close()


#: Seconds that a goal may delay others until its server has decided; then it counts as accepted,
#: and is aborted if the server rejects it after all.
_ACCEPT_TIMEOUT_S = 2.0
#: Seconds that servers have to acknowledge the cancelling of goals when the bridge ends.
_CANCEL_TIMEOUT_S = 1.0
#: Number of completed goals, and of feedback messages of a goal, that are kept.
_MAX_KEPT = 100


class _Goal:
    """A relayed goal.

    Attributes:
        sent: The goal as sent to the server.
        received: The goal as received from the client; None until it is accepted.
        waiting: Feedback that was received before.
        canceled: Whether its client has requested to cancel it.
    """

    def __init__(self) -> None:
        self.sent: ClientGoal | None = None
        self.received: ServerGoal | None = None
        self.waiting: list[Message] = []
        self.canceled = False


class ActionRelay(OfferedRelay[ActionClient, ActionServer, ActionType, ActionTranslation]):
    """Relays an action.

    Requests to cancel are passed on and count as accepted; the server decides how the goal ends.
    When the relay ends, its goals are cancelled.

    Arguments as for :class:`OfferedRelay`; the timeout is for accepting or rejecting a goal.
    """

    KIND = "action"
    PARTS = ("goal", "result", "feedback")

    def __init__(self, source: Side, target: Side, name: str, other: str, **options: Any) -> None:
        super().__init__(source, target, name, other, **options)
        #: Guards the goals.
        self._lock = threading.Lock()
        #: By the message of the goal, which accepting and executing have in common.
        self._goals: dict[int, tuple[Message, _Goal]] = {}

    def _create_client(self) -> ActionClient:
        return self._source.node.create_action_client(self.name, self._kind or None)

    def _translate(self, kind: ActionType) -> ActionTranslation:
        return ActionTranslation(kind)

    def _create_server(self, kind: ActionType) -> ActionServer:
        return self._target.node.create_action_server(
            self.other, kind, self._execute, accept=self._accept, cancel=self._cancel
        )

    # -- from the client to the server -----------------------------------------------------------

    def _accept(self, message: Message) -> bool:
        """Send a goal to the server, and return whether it accepts."""
        translation, client, goal = self._translation, self._client, _Goal()
        assert client is not None
        try:
            asked = message if translation is None else translation.goal.convert(message)
            goal.sent = client.send_goal(
                asked,
                on_feedback=lambda feedback: self._on_feedback(goal, feedback),
                executor=IMMEDIATE,
                timeout=self._timeout,
            )
            with self._lock:
                undecided = sum(not one.sent.acceptance.done() for _, one in self._goals.values()
                                if one.sent is not None)  # fmt: skip
                self._goals[id(message)] = message, goal
                while len(self._goals) > _MAX_KEPT and self._drop_completed():
                    pass
            accepted = goal.sent.acceptance.result(_ACCEPT_TIMEOUT_S if not undecided else 0.0)
        except LateError:
            accepted = goal.sent is not None and not goal.sent.acceptance.done()
        except Error as error:
            self._report(error)
            accepted = False
        if not accepted:
            self._refused += 1
            with self._lock:
                self._goals.pop(id(message), None)
        return accepted

    def _cancel(self, received: ServerGoal) -> bool:
        with self._lock:
            _, goal = self._goals.get(id(received.goal), (None, None))
        if goal is not None and goal.sent is not None:
            goal.canceled = True
            goal.sent.cancel(self._timeout)
        return True

    # -- from the server to the client -----------------------------------------------------------

    def _execute(self, received: ServerGoal) -> None:
        with self._lock:
            _, goal = self._goals.get(id(received.goal), (None, None))
        if goal is None or goal.sent is None:
            received.abort()
            return
        result: Message | None
        while goal.received is None:
            with self._lock:
                waiting, goal.waiting = goal.waiting, []
                if not waiting:
                    goal.received = received
            for feedback in waiting:
                self._publish(received, feedback)
        try:
            status, result = goal.sent.result()
            if self._translation is not None:
                result = self._translation.result.convert(result)
            self._count += 1
        except Error as error:
            if not isinstance(error, (GoalRejectedError, NodeClosedError)):
                self._report(error)
            self._refused += 1
            status, result = GoalStatus.ABORTED, None
        finally:
            with self._lock:
                self._goals.pop(id(received.goal), None)
        if goal.canceled:
            # The result may arrive before the response to the cancel request.
            received.wait_for_cancel(_ACCEPT_TIMEOUT_S)
        with suppress(NodeClosedError):  # another thread closed it
            if status is GoalStatus.SUCCEEDED:
                received.succeed(result)
            elif status is GoalStatus.CANCELED and received.is_cancel_requested:
                received.canceled(result)
            else:
                # If another client cancelled it, the goal has failed for this one.
                received.abort(result)

    def _on_feedback(self, goal: _Goal, feedback: Message) -> None:
        with self._lock:
            received = goal.received
            if received is None:
                goal.waiting.append(feedback)
                del goal.waiting[:-_MAX_KEPT]
                return
        self._publish(received, feedback)

    def _publish(self, received: ServerGoal, feedback: Message) -> None:
        try:
            if self._translation is not None:
                feedback = self._translation.feedback.convert(feedback)
            received.publish_feedback(feedback)
        except NodeClosedError:
            return
        except Error as error:
            if received.status.is_active:
                self._report(error)

    # -- status ----------------------------------------------------------------------------------

    def _drop_completed(self) -> bool:
        for key, (_, goal) in self._goals.items():
            if goal.sent is not None and goal.sent.done.done():
                del self._goals[key]
                return True
        return False

    def _report(self, error: Error) -> None:
        _log.warning("%s: a goal is not relayed: %s", self.name, error)

    def close(self) -> None:
        """Stop relaying, and cancel the goals; safe to call twice."""
        client, self._client = self._client, None
        if client is not None:
            with suppress(Error):  # their server, or the node, may be gone
                asked = [goal.cancel(_CANCEL_TIMEOUT_S) for goal in client.goals]
                deadline = time.monotonic() + _CANCEL_TIMEOUT_S
                for answer in asked:
                    wait([answer], max(0.0, deadline - time.monotonic()))
            client.close()
        if self._server is not None:
            self._server.close()
