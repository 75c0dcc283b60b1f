"""The element ``Subscription``: the messages of a topic as QML values."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import math
from dataclasses import replace
from typing import TYPE_CHECKING

from rosglass.comm.handle import Executor
from rosglass.comm.qos import Durability, History, QoS, Reliability
from rosglass.errors import ConversionError, DecodeError, Error, TypeNotFoundError
from rosglass.qml.dialect import Dialect
from rosglass.qml.element import DEFAULT_TIMEOUT, RETRY, TopicElement, changed_enough
from rosglass.qml.profiles import qos_from_js
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.comm.subscription import Subscription as Received
    from rosglass.qml.executor import GuiExecutor
    from rosglass.qml.runtime import Runtime
    from rosglass.qml.session import Session

__all__ = ["DEFAULT_QOS", "Subscription"]

_log = logging.getLogger("rosglass.qml")
#: A topic that comes so much faster than it is shown is received some messages at a time.
_MUCH_FASTER, _HARDLY_FASTER = 3.0, 1.5
#: What ``Ros2.QoS()`` gives: matches every publisher, keeps only the newest message.
DEFAULT_QOS = QoS(depth=1, reliability=Reliability.BEST_EFFORT)


class _Feed(Executor):
    """Carries samples from the middleware's thread to an element on the GUI thread.

    The subscription posts its delivery job here. It does not post another one before that job has
    run, so a fast topic costs one event per delivery, not per message.
    """

    def __init__(self, executor: GuiExecutor, arrived: Callable[[_Feed], None]) -> None:
        self._executor, self._arrived = executor, arrived
        self._job: Callable[[], None] | None = None
        self._samples: list[Sample] = []
        self.subscription: Received | None = None
        self.closed = False

    def post(self, job: Callable[[], None]) -> None:
        self._job = job
        self._executor.post(lambda: self._arrived(self))

    def collect(self, sample: Sample) -> None:
        """Take one sample; called by the subscription's delivery job."""
        self._samples.append(sample)

    def take(self) -> list[Sample]:
        """Return the samples that wait."""
        job, self._job = self._job, None
        if job is not None:
            job()
        samples, self._samples = self._samples, []
        return samples

    def close(self, session: Session) -> None:
        """Stop; the middleware is told on the worker thread."""
        self.closed = True
        if self.subscription is not None:
            session.background(self.subscription.close)


class Subscription(TopicElement):
    """Receives a topic. See its page in ``docs/elements``."""

    topicChanged = Signal()
    messageTypeChanged = Signal()
    qosChanged = Signal()
    queueSizeChanged = Signal()
    throttleRateChanged = Signal()
    enabledChanged = Signal()
    timeoutChanged = Signal()
    messageChanged = Signal()
    subscribedChanged = Signal()
    staleChanged = Signal()
    ageChanged = Signal()
    frequencyChanged = Signal()
    bandwidthChanged = Signal()
    droppedChanged = Signal()
    problemChanged = Signal()
    newMessage = Signal(QJSValue, arguments=["message"])

    _HOLDS = ("_sample", "_value", "_feed", "_have")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._wanted_type, self._found_type = "", ""
        self._qos = DEFAULT_QOS
        self._queue_size: int | None = None
        self._throttle = 20
        self._timeout: int | None = None
        self._sample: Sample | None = None
        #: Whether it came with the present subscription, and so from the present robot.
        self._current = False
        self._value: QJSValue | None = None
        self._shown_at = self._late = 0.0
        self._age, self._frequency, self._bandwidth, self._dropped = -1.0, 0.0, 0.0, 0
        self._inner_problem = ""
        self._feed: _Feed | None = None
        self._have: tuple[Node, str, str, QoS] | None = None
        self._timer = QtCore.QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._deliver_waiting)
        self._retry = QtCore.QTimer(self)
        self._retry.setSingleShot(True)
        self._retry.timeout.connect(self._attach_again)

    def configure(self, topic: str, type_name: str, qos: QoS) -> None:
        """Set what ``Ros2.createSubscription`` was given."""
        self._topic, self._wanted_type, self._qos = topic, type_name, qos

    def source(self) -> tuple[str, str, QoS]:
        """Return what it receives: topic (empty while unknown), type (empty for any), profile."""
        return self._resolve(self._topic), self._wanted_type, self._qos

    # Properties that QML sets.

    def _get_topic(self) -> str:
        return self._resolved or self._topic

    def _set_topic(self, topic: str) -> None:
        if topic == self._topic:
            return
        self._topic = topic
        if topic == self._resolved:
            return  # the same topic, now whatever the node's namespace becomes
        self._resolved = ""
        self._forget()
        self.topicChanged.emit()
        self._schedule()

    def _get_type(self) -> str:
        return self._wanted_type or self._found_type

    def _set_type(self, name: str) -> None:
        if name == self._wanted_type:
            return
        self._wanted_type, self._found_type = name, ""
        self._forget()
        self.messageTypeChanged.emit()
        self._schedule()

    def _get_qos(self) -> QJSValue:
        runtime = self._find_runtime()
        return runtime.qos(self._qos) if runtime is not None else QJSValue()

    def _set_qos(self, value: QJSValue | None) -> None:
        try:
            self._take_qos(qos_from_js(value, DEFAULT_QOS))
        except ConversionError as error:
            self._refuse(f"Subscription {self._topic!r}: {error}")

    def _take_qos(self, qos: QoS) -> None:
        # A queue size that was set wins, whichever of the two QML happens to set last.
        size, before_size, before = self._queue_size, self._get_queue_size(), self._qos
        if size is not None:
            history = History.KEEP_LAST if size else History.KEEP_ALL
            qos = replace(qos, history=history, depth=size or qos.depth)
        self._qos = qos
        if qos == before:
            return
        self.qosChanged.emit()
        if self._get_queue_size() != before_size:
            self.queueSizeChanged.emit()
        self._schedule()

    def _get_queue_size(self) -> int:
        unlimited = self._qos.history is History.KEEP_ALL
        return 0 if unlimited and self.DIALECT is Dialect.ROS1 else self._qos.depth

    def _set_queue_size(self, size: int) -> None:
        # In ROS 1, 0 means no limit.
        least = 0 if self.DIALECT is Dialect.ROS1 else 1
        if size < least:
            self._refuse(
                f"Subscription {self._topic!r}: queueSize must be at least {least}, got {size}"
            )
            return
        self._queue_size = size
        self._take_qos(self._qos)

    def _get_throttle_rate(self) -> int:
        return self._throttle

    def _set_throttle_rate(self, rate: int) -> None:
        if rate < 0:
            self._refuse(f"Subscription {self._topic!r}: throttleRate {rate} is negative")
        elif rate != self._throttle:
            self._throttle = rate
            self.throttleRateChanged.emit()
            if self._timer.isActive():
                self._timer.start(0)

    def _get_enabled(self) -> bool:
        return self._enabled

    def _set_enabled(self, enabled: bool) -> None:
        if enabled != self._enabled:
            self._enabled = enabled
            self.enabledChanged.emit()
            self._schedule()

    def _get_timeout(self) -> int:
        if self._timeout is not None:
            return self._timeout
        latched = self._qos.durability is Durability.TRANSIENT_LOCAL
        return 0 if latched else DEFAULT_TIMEOUT

    def _set_timeout(self, timeout: int) -> None:
        if timeout < 0:
            self._refuse(f"Subscription {self._topic!r}: timeout {timeout} ms is negative")
        elif timeout != self._timeout:
            self._timeout = timeout
            self.timeoutChanged.emit()
            self._judge()

    topic = Property(str, _get_topic, _set_topic, notify=topicChanged)
    messageType = Property(str, _get_type, _set_type, notify=messageTypeChanged)
    qos = Property(QJSValue, _get_qos, _set_qos, notify=qosChanged)
    queueSize = Property(int, _get_queue_size, _set_queue_size, notify=queueSizeChanged)
    throttleRate = Property(int, _get_throttle_rate, _set_throttle_rate, notify=throttleRateChanged)
    enabled = Property(bool, _get_enabled, _set_enabled, notify=enabledChanged)
    timeout = Property(int, _get_timeout, _set_timeout, notify=timeoutChanged)

    # Properties that QML reads.

    def _get_message(self) -> QJSValue:
        if self._value is None:
            self._value = self._build()
        return self._value

    def _get_subscribed(self) -> bool:
        return self._feed is not None and self._feed.subscription is not None

    def _get_problem(self) -> str:
        return self._problem or self._inner_problem or self._mixed

    message = Property(QJSValue, _get_message, notify=messageChanged)
    subscribed = Property(bool, _get_subscribed, notify=subscribedChanged)
    stale = Property(bool, lambda self: self._stale, notify=staleChanged)
    age = Property(float, lambda self: self._age, notify=ageChanged)
    frequency = Property(float, lambda self: self._frequency, notify=frequencyChanged)
    bandwidth = Property(float, lambda self: self._bandwidth, notify=bandwidthChanged)
    dropped = Property(int, lambda self: self._dropped, notify=droppedChanged)
    problem = Property(str, _get_problem, notify=problemChanged)

    @Slot(result=int)
    def getPublisherCount(self) -> int:
        """Return how many publishers the topic has; 0 while not connected."""
        return self._count_publishers()

    # Subscribing.

    def _update(self) -> None:
        node = self.node
        resolved = self._resolve(self._topic)
        want = None
        if node is not None and self._enabled and resolved:
            want = (node, resolved, self._wanted_type, self._qos)
        if want == self._have:
            return
        self._detach()
        self._have = want
        if want is None:
            self._suspect = True
            self._judge()
            return
        if resolved != self._resolved:
            self._resolved = resolved
            self.topicChanged.emit()
        self._attach()

    @Slot()
    def _attach_again(self) -> None:
        if self._have is not None and self._feed is None:
            self._attach()

    def _attach(self) -> None:
        assert self._have is not None
        assert self._session is not None
        session = self._session
        node, topic, type_name, qos = self._have
        feed = self._feed = _Feed(session.executor, self._on_arrival)
        self._at_end["feed"] = lambda: feed.close(session)
        self._publishers = self._count_publishers()

        def done(result: Received | Error) -> None:
            if not isinstance(result, Error):
                feed.subscription = result
            if feed.closed:
                feed.close(session)
            elif is_alive(self):
                self._attached(feed, result)

        session.background(
            lambda: node.create_subscription(
                topic, type_name or None, qos=qos, raw_callback=feed.collect, executor=feed
            ),
            done,
        )

    def _attached(self, feed: _Feed, result: Received | Error) -> None:
        if feed is not self._feed:
            return
        if isinstance(result, Error):
            self._feed = None
            self._say(f"{self._resolved}: {result}")
            if isinstance(result, TypeNotFoundError):
                self._retry.start(RETRY)
            return
        self._say("")
        self.subscribedChanged.emit()
        if is_alive(self):
            self._expect_publishers()

    def _detach(self) -> None:
        self._timer.stop()
        self._retry.stop()
        self._lonely.stop()
        feed, self._feed = self._feed, None
        self._current = False
        self._at_end.pop("feed", None)
        if feed is None or self._session is None:
            return
        feed.close(self._session)
        self._inner_problem = ""
        if feed.subscription is not None:
            self.subscribedChanged.emit()

    def _forget(self) -> None:
        """Throw the message away: it belongs to another topic or type."""
        had = self._sample is not None
        self._sample, self._value, self._age = None, None, -1.0
        if had:
            self.messageChanged.emit()
            self.ageChanged.emit()
        self._judge()

    # Receiving.

    def _on_arrival(self, feed: _Feed) -> None:
        if not is_alive(self) or feed is not self._feed or self._timer.isActive():
            return
        wait = 0.0
        if self._throttle:
            wait = self._shown_at + 1 / self._throttle - self._steady()
        if wait > 0.0005:
            self._timer.start(math.ceil(wait * 1000))
        else:
            self._deliver_waiting()

    @Slot()
    def _deliver_waiting(self) -> None:
        feed = self._feed
        if feed is None:
            return
        samples = feed.take()
        for sample in samples if self._throttle == 0 else samples[-1:]:
            self._deliver(sample)
            # A handler may have changed the topic, or destroyed this very object.
            if not is_alive(self) or feed is not self._feed:
                return

    def _deliver(self, sample: Sample) -> None:
        try:
            sample.type.validate(sample.data, wire=sample.wire)
        except DecodeError as error:
            self._say(f"{self._resolved}: a malformed message was refused: {error}")
            return
        except TypeNotFoundError:
            return  # only bytes; the subscription's own problem says why
        name = self.DIALECT.type_name(sample.type.definition.name)
        new_type = name != self._found_type and not self._wanted_type
        self._found_type = name
        self._sample, self._value, self._current = sample, None, True
        self._shown_at = self._steady()
        self._late = self._lateness(sample)
        self._age = 0.0
        self._suspect = False
        # Every getter answers for the new message before the first signal is sent.
        was_stale, self._stale = self._stale, self._is_old()
        if new_type:
            self.messageTypeChanged.emit()
        self.messageChanged.emit()
        if not is_alive(self) or self._sample is not sample:
            return
        self._say("")
        self.ageChanged.emit()
        if was_stale != self._stale:
            self.staleChanged.emit()
        if is_alive(self) and self._has_listeners():
            self.newMessage.emit(self._get_message())

    def _lateness(self, sample: Sample) -> float:
        """Return by how many seconds a message was kept back on its way."""
        subscription = self._feed.subscription if self._feed is not None else None
        return 0.0 if subscription is None else subscription.lateness(sample).seconds

    def _has_listeners(self) -> bool:
        """Return whether anybody listens to newMessage; if not, its value need not be built."""
        meta = self.metaObject()
        return self.isSignalConnected(meta.method(meta.indexOfSignal("newMessage(QJSValue)")))

    def _build(self) -> QJSValue:
        sample = self._sample
        runtime = self._find_runtime()
        if sample is None or runtime is None:
            return QJSValue()
        try:
            return runtime.message(sample.message(), self.DIALECT)
        except Error as error:
            _log.error("%s: %s", self._resolved, error)
            return QJSValue()

    # Judging.

    def _is_old(self) -> bool:
        if self._sample is None:
            return True
        timeout = self._get_timeout()
        # A link that was silent may hand on what is new only here.
        return timeout > 0 and self._steady() - self._shown_at + self._late > timeout / 1000

    def _trust_again(self) -> None:
        # Who latched the message is there: had it changed, the new one would have come.
        latched = self._qos.durability is Durability.TRANSIENT_LOCAL
        connected = self._session is not None and self._session.state == "connected"
        if latched and connected and self._current and self._sender_is_there():
            self._suspect = False

    def _sender_is_there(self) -> bool:
        """Return whether who sent the message still publishes, and is not one who came after it."""
        node, sample = self.node, self._sample
        if node is None or sample is None:
            return False
        try:
            publishers = node.publishers(self._resolved)
        except Error:
            return False
        known = [one.gid for one in publishers if one.gid]
        return sample.publisher in known if known else bool(publishers)

    def _stale_changed(self) -> None:
        self.staleChanged.emit()

    def _problem_changed(self) -> None:
        self.problemChanged.emit()

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        if self._sample is not None:
            self._age = self._steady() - self._shown_at
            self.ageChanged.emit()
        subscription = self._feed.subscription if self._feed is not None else None
        frequency = bandwidth = 0.0
        dropped = self._dropped
        if subscription is not None:
            statistics = subscription.statistics()
            frequency, bandwidth = statistics.frequency, statistics.bandwidth
            # Thinning out a topic is what throttling is for; only what was wanted can be lost.
            dropped = statistics.dropped if self._throttle == 0 else 0
            enough = _HARDLY_FASTER if subscription.batching else _MUCH_FASTER
            fast = frequency > enough * self._throttle
            subscription.set_batching(self._throttle > 0 and fast)
            if self._inner_problem != subscription.problem:
                self._inner_problem = subscription.problem
                self.problemChanged.emit()
        if changed_enough(self._frequency, frequency):
            self._frequency = frequency
            self.frequencyChanged.emit()
        if changed_enough(self._bandwidth, bandwidth):
            self._bandwidth = bandwidth
            self.bandwidthChanged.emit()
        if dropped != self._dropped:
            self._dropped = dropped
            self.droppedChanged.emit()
