"""The element ``SynchronizedSubscription``: messages of several topics that belong together."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any

from rosglass.comm.approximate_time import ApproximateTime
from rosglass.comm.executor import Dispatcher
from rosglass.comm.statistics import note_time, rate_of
from rosglass.errors import ConversionError, DecodeError, Error, TypeNotFoundError
from rosglass.qml.dialect import Dialect
from rosglass.qml.element import DEFAULT_TIMEOUT, RETRY, Element, changed_enough
from rosglass.qml.js_values import shown
from rosglass.qml.profiles import qos_from_js
from rosglass.qml.subscription import DEFAULT_QOS, Subscription
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.comm.qos import QoS
    from rosglass.comm.subscription import Subscription as Received
    from rosglass.qml.executor import GuiExecutor
    from rosglass.qml.runtime import Runtime

__all__ = ["RosSynchronizedSubscription", "SynchronizedSubscription"]

_MAX_SLOP = 3_600_000
#: Sets over which the frequency is taken.
_MARKS = 30


class _Matcher:
    """Receives topics and matches them, on a thread of its own.

    Args:
        node: Who subscribes.
        wanted: Topic, type (may be empty) and profile of each.
        queue_size: Messages of a topic that wait at most.
        slop: Nanoseconds that a set may span.
        headerless: Whether messages without header count by the time of their arrival.
        arrived: Called on the GUI thread with this object when there are sets.
        executor: The GUI thread.

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
        self._match: ApproximateTime[Sample] = ApproximateTime(len(wanted), queue_size, slop)
        self._headerless, self._arrived, self._executor = headerless, arrived, executor
        self._lock = threading.Lock()
        self._sets: deque[list[Sample]] = deque()
        self._size, self._lost = queue_size, 0
        self._bad: dict[int, str] = {}
        self._worker = Dispatcher("rosglass-synchronizer")
        self.subscriptions: list[Received] = []
        try:
            for index, (topic, type_name, qos) in enumerate(wanted):
                self.subscriptions.append(self._subscribe(node, index, topic, type_name, qos))
        except BaseException:
            self.close()
            raise

    @property
    def dropped(self) -> int:
        """Messages that came into no set, and those in sets that nobody took in time."""
        return self._match.dropped + self._lost

    @property
    def problem(self) -> str:
        """What is wrong with one of the topics; empty when nothing is."""
        for index, subscription in enumerate(self.subscriptions):
            told = subscription.problem or self._bad.get(index, "")
            if told:
                return f"{subscription.topic}: {told}"
        return ""

    def take(self) -> list[list[Sample]]:
        """Return the sets that wait."""
        with self._lock:
            sets, self._sets = list(self._sets), deque()
        return sets

    def lateness(self, samples: list[Sample]) -> float:
        """Return by how many seconds a set was kept back on its way."""
        pairs = zip(self.subscriptions, samples, strict=True)
        return max(subscription.lateness(sample).seconds for subscription, sample in pairs)

    def close(self) -> None:
        """Receive no more."""
        for subscription in self.subscriptions:
            subscription.close()
        self._worker.close()

    def _subscribe(self, node: Node, index: int, topic: str, type_name: str, qos: QoS) -> Received:
        return node.create_subscription(
            topic,
            type_name or None,
            qos=qos.with_depth(self._size),
            raw_callback=lambda sample: self._receive(index, sample),
            executor=self._worker,
        )

    def _receive(self, index: int, sample: Sample) -> None:
        stamp = self._stamp_of(index, sample)
        if stamp is None:
            return
        found = self._match.add(index, stamp, sample)
        if not found:
            return
        with self._lock:
            first = not self._sets
            self._sets.extend(found)
            while len(self._sets) > self._size:
                self._lost += len(self._sets.popleft())
        if first:
            self._executor.post(lambda: self._arrived(self))

    def _stamp_of(self, index: int, sample: Sample) -> int | None:
        try:
            sample.type.validate(sample.data, wire=sample.wire)
            header = getattr(sample.message(), "header", None)
        except DecodeError as error:
            self._bad[index] = f"a malformed message was refused: {error}"
            return None
        except TypeNotFoundError as error:
            self._bad[index] = str(error)
            return None
        stamp = getattr(header, "stamp", None)
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

    topicsChanged = Signal()
    subscriptionsChanged = Signal()
    queueSizeChanged = Signal()
    slopChanged = Signal()
    allowHeaderlessChanged = Signal()
    enabledChanged = Signal()
    timeoutChanged = Signal()
    messagesChanged = Signal()
    staleChanged = Signal()
    frequencyChanged = Signal()
    droppedChanged = Signal()
    problemChanged = Signal()
    newMessages = Signal(QJSValue, arguments=["messages"])

    _HOLDS = ("_topics", "_subscriptions", "_samples", "_value", "_matcher", "_have")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._topics, self._subscriptions = QJSValue(), QJSValue()
        self._queue_size, self._slop, self._timeout = 10, 100.0, DEFAULT_TIMEOUT
        self._headerless, self._enabled = False, True
        self._samples: list[Sample] | None = None
        self._value: QJSValue | None = None
        self._matcher: _Matcher | None = None
        self._have: tuple[Any, ...] | None = None
        self._stale, self._frequency, self._dropped = True, 0.0, 0
        #: Seconds that the set was kept back on its way; whether the connection was lost since.
        self._shown_at = self._late = 0.0
        self._suspect = False
        self._times: deque[float] = deque(maxlen=_MARKS)
        self._retry = QtCore.QTimer(self)
        self._retry.setSingleShot(True)
        self._retry.timeout.connect(self._attach)

    # Properties.

    def _set_topics(self, topics: QJSValue) -> None:
        self._topics = topics
        self.topicsChanged.emit()
        self._schedule()

    def _set_subscriptions(self, subscriptions: QJSValue) -> None:
        self._subscriptions = subscriptions
        self.subscriptionsChanged.emit()
        self._schedule()

    def _set_queue_size(self, size: int) -> None:
        if not 1 <= size <= 10_000:
            self._refuse(f"SynchronizedSubscription: queueSize {size} is not from 1 to 10000")
        elif size != self._queue_size:
            self._queue_size = size
            self.queueSizeChanged.emit()
            self._schedule()

    def _set_slop(self, slop: float) -> None:
        if not 0 <= slop <= _MAX_SLOP:
            self._refuse(f"SynchronizedSubscription: slop {slop:g} ms is not from 0 to {_MAX_SLOP}")
        elif slop != self._slop:
            self._slop = slop
            self.slopChanged.emit()
            self._schedule()

    def _set_headerless(self, allowed: bool) -> None:
        if allowed != self._headerless:
            self._headerless = allowed
            self.allowHeaderlessChanged.emit()
            self._schedule()

    def _set_enabled(self, enabled: bool) -> None:
        if enabled != self._enabled:
            self._enabled = enabled
            self.enabledChanged.emit()
            self._schedule()

    def _set_timeout(self, timeout: int) -> None:
        if timeout < 0:
            self._refuse(f"SynchronizedSubscription: timeout {timeout} ms is negative")
        elif timeout != self._timeout:
            self._timeout = timeout
            self.timeoutChanged.emit()

    def _get_messages(self) -> QJSValue:
        if self._value is None:
            self._value = self._build()
        return self._value

    topics = Property(QJSValue, lambda self: self._topics, _set_topics, notify=topicsChanged)
    subscriptions = Property(
        QJSValue, lambda self: self._subscriptions, _set_subscriptions, notify=subscriptionsChanged
    )
    queueSize = Property(
        int, lambda self: self._queue_size, _set_queue_size, notify=queueSizeChanged
    )
    slop = Property(float, lambda self: self._slop, _set_slop, notify=slopChanged)
    allowHeaderless = Property(
        bool, lambda self: self._headerless, _set_headerless, notify=allowHeaderlessChanged
    )
    enabled = Property(bool, lambda self: self._enabled, _set_enabled, notify=enabledChanged)
    timeout = Property(int, lambda self: self._timeout, _set_timeout, notify=timeoutChanged)
    messages = Property(QJSValue, _get_messages, notify=messagesChanged)
    stale = Property(bool, lambda self: self._stale, notify=staleChanged)
    frequency = Property(float, lambda self: self._frequency, notify=frequencyChanged)
    dropped = Property(int, lambda self: self._dropped, notify=droppedChanged)
    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    # Subscribing.

    def _wanted(self, node: Node) -> tuple[tuple[str, str, QoS], ...]:
        """Return topic, type and profile of each; nothing while one of them has no topic yet.

        Raises:
            Error: They are not what they must be.
        """
        given = [*_items(self._topics, "topics"), *_items(self._subscriptions, "subscriptions")]
        found = []
        for at, item in enumerate(given):
            item_object = item.toQObject() if item.isQObject() else None
            if isinstance(item_object, Subscription):
                topic, type_name, qos = item_object.source()
            elif item.isString():
                topic, type_name, qos = item.toString(), "", DEFAULT_QOS
            elif item.isObject() and item.property("topic").isString():
                topic = item.property("topic").toString()
                kind = item.property("type")
                type_name = "" if kind.isUndefined() else kind.toString()
                qos = qos_from_js(item.property("qos"), DEFAULT_QOS)
            else:
                told = 'a topic, {topic: "/scan", type: "...", qos: ...}, or a Subscription'
                raise ConversionError(f"topics[{at}]", shown(item), told)
            if not topic:
                return ()
            found.append((node.resolve(topic), type_name, qos))
        if len(found) == 1:
            raise ConversionError("topics", found[0][0], "at least two of them")
        return tuple(found)

    def _update(self) -> None:
        node = self.node
        want = None
        if node is not None and self._enabled:
            try:
                wanted = self._wanted(node)
                slop = round(self._slop * 1e6)
                if wanted:
                    want = (node, wanted, self._queue_size, slop, self._headerless)
            except Error as error:
                self._say(f"SynchronizedSubscription: {error}")
        if want == self._have:
            return
        self._detach()
        self._have = want
        self._attach()

    @Slot()
    def _attach(self) -> None:
        session, want = self._session, self._have
        if session is None or want is None or self._matcher is not None:
            return

        def done(result: _Matcher | Error) -> None:
            if isinstance(result, Error):
                self._say(f"SynchronizedSubscription: {result}")
                if isinstance(result, TypeNotFoundError):
                    self._retry.start(RETRY)
            else:
                self._matcher = result
                self._at_end["matcher"] = lambda: session.background(result.close)
                self._say("")
                self._on_arrival(result)

        arrived, executor = self._on_arrival, session.executor
        node, wanted, size, slop, headerless = want
        self._make(
            lambda: _Matcher(node, wanted, size, slop, headerless, arrived, executor),
            lambda: self._have is want,
            done,
        )

    def _detach(self) -> None:
        self._retry.stop()
        self._matcher = None
        self._times.clear()
        end = self._at_end.pop("matcher", None)
        if end is not None:
            end()

    # Receiving.

    def _on_arrival(self, matcher: _Matcher) -> None:
        if is_alive(self) and matcher is self._matcher:
            self._deliver(matcher, matcher.take())

    def _deliver(self, matcher: _Matcher, sets: list[list[Sample]]) -> None:
        for samples in sets:
            self._samples, self._value = samples, None
            note_time(self._times, time.monotonic())
            self._shown_at = self._steady()
            self._late, self._suspect = matcher.lateness(samples), False
            was_stale, self._stale = self._stale, self._is_old()
            self.messagesChanged.emit()
            if not is_alive(self) or matcher is not self._matcher:
                return
            if was_stale != self._stale:
                self.staleChanged.emit()
            self.newMessages.emit(self._get_messages())
            if not is_alive(self) or matcher is not self._matcher:
                return

    def _build(self) -> QJSValue:
        runtime = self._find_runtime()
        engine = runtime.engine if runtime is not None else None
        if self._samples is None or runtime is None or engine is None:
            return QJSValue()
        made = engine.newArray(len(self._samples))
        for index, sample in enumerate(self._samples):
            made.setProperty(index, runtime.message(sample.message(), self.DIALECT))
        return made

    # Judging.

    @Slot()
    def _on_connection(self) -> None:
        self._judge()

    @Slot()
    def _on_tick(self) -> None:
        if not self._subscriptions.isUndefined():
            # Their topics, types and profiles may have changed.
            self._update()
        self._judge()
        matcher, session = self._matcher, self._session
        frequency = rate_of(self._times, time.monotonic())
        if changed_enough(self._frequency, frequency):
            self._frequency = frequency
            self.frequencyChanged.emit()
        if matcher is None or session is None:
            return
        mixing = (session.mixing(one.topic) for one in matcher.subscriptions)
        self._say(matcher.problem or next(filter(None, mixing), ""))
        if matcher.dropped != self._dropped:
            self._dropped = matcher.dropped
            self.droppedChanged.emit()

    def _is_old(self) -> bool:
        age = self._steady() - self._shown_at + self._late if self._times else math.inf
        return math.isinf(age) or (self._timeout > 0 and age > self._timeout / 1000)

    def _judge(self) -> None:
        if self._session is None or self._session.state != "connected":
            self._suspect = True
        stale = self._suspect or self._is_old()
        if stale != self._stale:
            self._stale = stale
            self.staleChanged.emit()

    def _problem_changed(self) -> None:
        self.problemChanged.emit()


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
