"""The element ``SynchronizedSubscription``: matching messages of several topics."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from rosglass.comm.approximate_time import ApproximateTime
from rosglass.comm.executor import Dispatcher
from rosglass.comm.handle import undo_on_error
from rosglass.comm.statistics import note_time, rate_of
from rosglass.errors import ConversionError, DecodeError, Error, TypeNotFoundError
from rosglass.qml.elements.element import DEFAULT_TIMEOUT_MS, Element
from rosglass.qml.elements.subscription import DEFAULT_QOS, ROS1_QOS, Subscription
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.js_values import qos_from_js, shown
from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, report, within
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.comm.qos import QoS
    from rosglass.comm.subscription import Subscription as TopicSubscription
    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import GuiExecutor

__all__ = ["RosSynchronizedSubscription", "SynchronizedSubscription"]

_MAX_SLOP_MS = 3_600_000
#: Number of sets over which the frequency is measured.
_MARKS = 30


class _Received(NamedTuple):
    """A received message."""

    sample: Sample
    message: Message


class _Matcher:
    """Receives topics and matches their messages, on its own thread.

    Args:
        node: The subscribing node.
        wanted: Topic, type (may be empty) and QoS profile of each topic.
        queue_size: Maximum number of waiting messages per topic.
        slop: Maximum difference between the stamps of a set, nanoseconds.
        headerless: Whether the arrival time replaces the stamp of messages without a header.
        arrived: Called on the GUI thread with this object when sets are available.
        executor: The executor of the GUI thread.

    Raises:
        Error: One of the topics cannot be subscribed to.
    """

    def __init__(
        self,
        node: Node,
        wanted: tuple[tuple[str, str, QoS], ...],
        queue_size: int,
        slop: int,
        headerless: bool,
        arrived: Callable[[_Matcher], None],
        executor: GuiExecutor,
    ) -> None:
        self._match: ApproximateTime[_Received] = ApproximateTime(len(wanted), queue_size, slop)
        self._headerless, self._arrived, self._executor = headerless, arrived, executor
        self._lock = threading.Lock()
        self._sets: deque[list[_Received]] = deque()
        self._size, self._lost = queue_size, 0
        self._bad: dict[int, str] = {}
        self._worker = Dispatcher("rosglass-synchronizer")
        self.subscriptions: list[TopicSubscription] = []
        with undo_on_error(self.close):
            for index, (topic, type_name, qos) in enumerate(wanted):
                self.subscriptions.append(self._subscribe(node, index, topic, type_name, qos))

    @property
    def dropped(self) -> int:
        """Number of messages that matched no set, or whose set was not taken in time."""
        return self._match.dropped + self._lost

    @property
    def problem(self) -> str:
        """The problem of one of the topics; empty if there is none."""
        for index, subscription in enumerate(self.subscriptions):
            problem = subscription.problem or self._bad.get(index, "")
            if problem:
                return f"{subscription.topic}: {problem}"
        return ""

    def take(self) -> list[list[_Received]]:
        """Take the waiting sets."""
        with self._lock:
            sets, self._sets = list(self._sets), deque()
        return sets

    def lateness(self, received: list[_Received]) -> float:
        """Return the delay of a set in transit, in seconds."""
        pairs = zip(self.subscriptions, received, strict=True)
        return max(subscription.lateness(one.sample).seconds for subscription, one in pairs)

    def close(self) -> None:
        """Stop receiving."""
        for subscription in self.subscriptions:
            subscription.close()
        self._worker.close()

    def _subscribe(
        self, node: Node, index: int, topic: str, type_name: str, qos: QoS
    ) -> TopicSubscription:
        return node.create_subscription(
            topic,
            type_name or None,
            qos=qos.with_depth(self._size),
            raw_callback=lambda sample: self._receive(index, sample),
            executor=self._worker,
        )

    def _receive(self, index: int, sample: Sample) -> None:
        try:
            message = sample.type.decode_checked(sample.data, sample.wire)
            stamp = self._stamp_of(index, sample, message)
        except DecodeError as error:
            self._bad[index] = f"a malformed message was refused: {error}"
            return
        except TypeNotFoundError as error:
            self._bad[index] = str(error)
            return
        if stamp is None:
            return
        found = self._match.add(index, stamp, _Received(sample, message))
        if not found:
            return
        with self._lock:
            first = not self._sets
            self._sets.extend(found)
            while len(self._sets) > self._size:
                self._lost += len(self._sets.popleft())
        if first:
            self._executor.post(lambda: self._arrived(self))

    def _stamp_of(self, index: int, sample: Sample, message: Message) -> int | None:
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        if stamp is None and not self._headerless:
            self._bad[index] = (
                f"{sample.type.name} has no header.stamp to go by; "
                "allowHeaderless: true goes by the time of arrival"
            )
            return None
        self._bad.pop(index, None)
        return sample.received_ns if stamp is None else int(stamp.nanoseconds)


class SynchronizedSubscription(Element):
    """Receives topics in sets of messages. See its page in ``docs/elements``."""

    staleChanged = Signal()
    messagesChanged = Signal()
    newMessages = Signal(QJSValue, arguments=["messages"])

    topics = Writable(QJSValue)
    subscriptions = Writable(QJSValue)
    queueSize = Writable(int, 10, within(1, 10_000))
    #: Maximum difference between the stamps of a set, milliseconds.
    slop = Writable(float, 100.0, within(0, _MAX_SLOP_MS), unit="ms")
    allowHeaderless = Writable(bool, False)
    enabled = Writable(bool, True)
    timeout = Writable(int, DEFAULT_TIMEOUT_MS, at_least(0), then="", unit="ms")
    messages = ReadOnly(QJSValue, read="_get_messages")
    stale = ReadOnly(bool, True)
    frequency = ReadOnly(float, 0.0, tolerance=0.01)
    dropped = ReadOnly(int, 0)

    #: The profile of topics that QML gives none.
    _DEFAULT_QOS: ClassVar[QoS] = DEFAULT_QOS
    _HOLDS = ("_topics", "_subscriptions", "_received", "_value")
    _endpoint: _Matcher | None
    _stale: bool

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._received: list[_Received] | None = None
        self._value: QJSValue | None = None
        #: When the set was shown, and the seconds by which it was delayed before.
        self._shown_at = self._late = 0.0
        #: Whether the connection has been lost since then.
        self._outdated = False
        self._times: deque[float] = deque(maxlen=_MARKS)

    def _get_messages(self) -> QJSValue:
        if self._value is None:
            self._value = self._build()
        return self._value

    # Subscribing.

    def _sources(self, node: Node) -> tuple[tuple[str, str, QoS], ...]:
        """Return topic, type and QoS profile of each source; empty while one has no topic.

        Raises:
            Error: A source is invalid.
        """
        given = [*_items(self.topics, "topics"), *_items(self.subscriptions, "subscriptions")]
        found = []
        for at, item in enumerate(given):
            item_object = item.toQObject() if item.isQObject() else None
            if isinstance(item_object, Subscription):
                topic, type_name, qos = item_object.source()
            elif item.isString():
                topic, type_name, qos = item.toString(), "", self._DEFAULT_QOS
            elif item.isObject() and item.property("topic").isString():
                topic = item.property("topic").toString()
                kind = item.property("type")
                type_name = "" if kind.isUndefined() else kind.toString()
                qos = qos_from_js(item.property("qos"), self._DEFAULT_QOS)
            else:
                expected = 'a topic, {topic: "/scan", type: "...", qos: ...}, or a Subscription'
                raise ConversionError(f"topics[{at}]", shown(item), expected)
            if not topic:
                return ()
            found.append((node.resolve(topic), type_name, qos))
        if len(found) == 1:
            raise ConversionError("topics", found[0][0], "at least two of them")
        return tuple(found)

    def _wanted(self) -> tuple[Any, ...] | None:
        node = self.node
        if node is None or not self.enabled:
            return None
        try:
            sources = self._sources(node)
        except Error as error:
            self._set_problem(f"{self.label}: {error}")
            return None
        slop_ns = round(self.slop * 1e6)
        return (node, sources, self.queueSize, slop_ns, self.allowHeaderless) if sources else None

    def _factory(self, *wanted: Any) -> Callable[[], _Matcher]:
        node, sources, size, slop_ns, headerless = wanted
        on_sets, executor = weak_callback(self._on_sets), self._executor
        return lambda: _Matcher(node, sources, size, slop_ns, headerless, on_sets, executor)

    def _on_created(self, endpoint: _Matcher) -> None:
        self._set_problem("")
        self._on_sets(endpoint)

    def _on_closed(self, endpoint: _Matcher | None) -> None:  # noqa: ARG002 - the base's signature
        self._times.clear()

    # Receiving.

    def _on_sets(self, matcher: _Matcher) -> None:
        if not is_alive(self) or matcher is not self._endpoint:
            return
        for received in matcher.take():
            self._received, self._value = received, None
            note_time(self._times, time.monotonic())
            self._shown_at = self._steady()
            self._late, self._outdated = matcher.lateness(received), False
            was_stale, self._stale = self._stale, self._is_old()
            self.messagesChanged.emit()
            if not is_alive(self) or matcher is not self._endpoint:
                return
            if was_stale != self._stale:
                self.staleChanged.emit()
            self.newMessages.emit(self._get_messages())
            if not is_alive(self) or matcher is not self._endpoint:
                return

    def _build(self) -> QJSValue:
        runtime = self._find_runtime()
        engine = runtime.engine if runtime is not None else None
        if self._received is None or runtime is None or engine is None:
            return QJSValue()
        made = engine.newArray(len(self._received))
        for index, one in enumerate(self._received):
            made.setProperty(index, runtime.message(one.message, self.DIALECT))
        return made

    # Judging.

    @Slot()
    def _on_connection(self) -> None:
        self._update_stale()

    @Slot()
    def _on_tick(self) -> None:
        if not self.subscriptions.isUndefined():
            # Their topics, types and profiles may have changed.
            self._update()
        self._update_stale()
        report(self, frequency=rate_of(self._times, time.monotonic()))
        matcher, session = self._endpoint, self._session
        if matcher is None or session is None:
            return
        mixing = (session.mixing(one.topic) for one in matcher.subscriptions)
        self._set_problem(matcher.problem or next(filter(None, mixing), ""))
        report(self, dropped=matcher.dropped)

    def _is_old(self) -> bool:
        age = self._steady() - self._shown_at + self._late if self._times else math.inf
        return math.isinf(age) or (self.timeout > 0 and age > self.timeout / 1000)

    def _update_stale(self) -> None:
        if self._session is None or self._session.state != "connected":
            self._outdated = True
        report(self, stale=self._outdated or self._is_old())


def _items(value: QJSValue, name: str) -> list[QJSValue]:
    if value.isUndefined() or value.isNull():
        return []
    length = value.property("length")
    if value.isString() or not length.isNumber():
        raise ConversionError(name, shown(value), "an array")
    return [value.property(at) for at in range(length.toInt())]


class RosSynchronizedSubscription(SynchronizedSubscription):
    """The element ``SynchronizedSubscription`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1
    _DEFAULT_QOS = ROS1_QOS
