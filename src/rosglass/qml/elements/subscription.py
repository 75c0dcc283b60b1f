"""The element ``Subscription``: the messages of a topic as QML values."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.comm.qos import Durability, History, QoS, Reliability
from rosglass.errors import ConversionError, DecodeError, Error, TypeNotFoundError
from rosglass.qml.elements.element import DEFAULT_TIMEOUT_MS, Pace, TopicElement, single_shot
from rosglass.qml.engine.callbacks import Deferred, call_back
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.js_values import qos_from_js
from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QJSValue, QtCore, Signal, Slot, is_alive, is_valid

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.comm.subscription import Subscription as TopicSubscription
    from rosglass.messages import Message, MessageType
    from rosglass.messages.translation import Translation
    from rosglass.qml.engine.runtime import Runtime


__all__ = [
    "DEFAULT_QOS",
    "ROS1_QOS",
    "Subscriber",
    "Subscription",
    "next_message",
    "wait_for_message",
]

_log = logging.getLogger("rosglass.qml")
#: Topics faster than the throttle rate by these factors are received in batches; the second
#: factor applies while batching, the first otherwise.
_MUCH_FASTER, _HARDLY_FASTER = 3.0, 1.5
#: The profile of ``Ros2.QoS()``: matches every publisher, keeps only the newest message.
DEFAULT_QOS = QoS(depth=1, reliability=Reliability.BEST_EFFORT)
#: The profile of ``Ros 1.0``: what each publisher offers, as in ROS 1 every subscriber receives
#: latched messages, and each message that is sent again when it is lost.
ROS1_QOS = QoS(
    depth=1,
    reliability=Reliability.BEST_AVAILABLE,
    durability=Durability.BEST_AVAILABLE,
)
#: Types of ROS 2 that interfaces ask for by name -> the types of ROS 1 that stand for them.
_ROS1_NAMES = dict.fromkeys(
    ("rcl_interfaces/msg/Log", "rcl_interfaces/Log"), "rosgraph_msgs/msg/Log"
)
#: Seconds without a message after which messages of the past may be what is missing.
_NO_MESSAGE_S = 2.0


class Subscription(TopicElement):
    """Receives a topic. See its page in ``docs/elements``."""

    topicChanged = Signal()
    messageTypeChanged = Signal()
    qosChanged = Signal()
    queueSizeChanged = Signal()
    messageChanged = Signal()
    ageChanged = Signal()
    newMessage = Signal(QJSValue, arguments=["message"])

    topic = Writable(str, read="_get_topic", write="_set_topic")
    messageType = Writable(str, read="_get_type", write="_set_type")
    qos = Writable(QJSValue, read="_get_qos", write="_set_qos")
    queueSize = Writable(int, read="_get_queue_size", write="_set_queue_size")
    #: Maximum messages per second that are shown; 0 for all.
    throttleRate = Writable(int, 20, at_least(0), then="_restart_timer")
    enabled = Writable(bool, True)
    timeout = Writable(int, None, at_least(0), then="_update_stale", unit="ms", read="_get_timeout")
    message = ReadOnly(QJSValue, read="_get_message")
    subscribed = ReadOnly(bool, False)
    age = ReadOnly(float, -1.0)
    frequency = ReadOnly(float, 0.0, tolerance=0.01)
    bandwidth = ReadOnly(float, 0.0, tolerance=0.01)
    dropped = ReadOnly(int, 0)

    #: The profile while QML sets none.
    _DEFAULT_QOS: ClassVar[QoS] = DEFAULT_QOS
    #: Whether each message is shown, although they are taken at the throttle rate.
    _TAKES_ALL: ClassVar[bool] = False
    _HOLDS: tuple[str, ...] = ("_sample", "_message", "_value", "_wake")
    _endpoint: TopicSubscription | None
    _timeout: int | None
    #: Has a sample that arrives announced on the GUI thread; from any thread.
    _wake: Callable[[], None]
    _subscribed: bool
    _age: float
    _stale: bool

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._wanted_type, self._found_type = "", ""
        self._profile = self._DEFAULT_QOS
        self._wanted_queue_size: int | None = None
        self._sample: Sample | None = None
        self._translation: Translation | None = None
        #: The sample's message.
        self._message: Message | None = None
        #: Whether the sample is from the current subscription, and so from the current robot.
        self._current = False
        self._value: QJSValue | None = None
        self._shown_at = self._late = 0.0
        self._pace = Pace()
        self._inner_problem = self._missed = ""
        #: When the subscription was created.
        self._created_at = 0.0
        self._timer = single_shot(self, self._deliver)

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"Subscription {self._topic!r}"

    def configure(self, topic: str, type_name: str, qos: QoS) -> None:
        """Set the arguments of ``Ros2.createSubscription``."""
        self._topic, self._wanted_type, self._profile = topic, type_name, qos

    def source(self) -> tuple[str, str, QoS]:
        """Return topic (empty while unknown), type (empty for any) and QoS profile."""
        return self._resolve(self._topic), self._wanted_type, self._profile

    # Properties that QML sets.

    def _get_type(self) -> str:
        return self._wanted_type or self._found_type

    def _set_type(self, name: str) -> None:
        if name == self._wanted_type:
            return
        self._wanted_type, self._found_type = name, ""
        self._clear_shown()
        self.messageTypeChanged.emit()
        self._schedule()

    def _get_qos(self) -> QJSValue:
        runtime = self._find_runtime()
        return runtime.qos(self._profile) if runtime is not None else QJSValue()

    def _set_qos(self, value: QJSValue | None) -> None:
        try:
            self._set_profile(qos_from_js(value, self._DEFAULT_QOS))
        except ConversionError as error:
            self._refuse(f"{self.label}: {error}")

    def _set_profile(self, qos: QoS) -> None:
        # An explicit queue size has priority, whichever of the two QML sets last.
        size, before_size, before = self._wanted_queue_size, self._get_queue_size(), self._profile
        if size is not None:
            history = History.KEEP_LAST if size else History.KEEP_ALL
            # The timeout is a publisher's, and contradicts keep all.
            qos = replace(qos, history=history, depth=size or qos.depth, send_timeout=None)
        self._profile = qos
        if qos == before:
            return
        self.qosChanged.emit()
        if self._get_queue_size() != before_size:
            self.queueSizeChanged.emit()
        self._schedule()

    def _get_queue_size(self) -> int:
        unlimited = self._profile.history is History.KEEP_ALL
        return 0 if unlimited and self.DIALECT is Dialect.ROS1 else self._profile.depth

    def _set_queue_size(self, size: int) -> None:
        # In ROS 1, 0 means no limit.
        least = 0 if self.DIALECT is Dialect.ROS1 else 1
        if size < least:
            self._refuse(f"{self.label}: queueSize must be at least {least}, got {size}")
            return
        self._wanted_queue_size = size
        self._set_profile(self._profile)

    def _restart_timer(self) -> None:
        if self._timer.isActive():
            self._timer.start(0)

    def _get_timeout(self) -> int:
        if self._timeout is not None:
            return self._timeout
        latched = self._profile.durability is Durability.TRANSIENT_LOCAL
        return 0 if latched else DEFAULT_TIMEOUT_MS

    # Properties that QML reads.

    def _get_message(self) -> QJSValue:
        if self._value is None:
            self._value = self._build()
        return self._value

    def _get_problem(self) -> str:
        return self._problem or self._inner_problem or self._missed or self._mixing

    @Slot(result=int)
    def getPublisherCount(self) -> int:
        """Return the number of publishers that match; 0 while there is no subscription."""
        return 0 if self._endpoint is None else self._endpoint.publisher_count()

    # Subscribing.

    def _wanted(self) -> tuple[Node, str, str, QoS] | None:
        node, resolved = self.node, self._resolve(self._topic)
        if node is None or not self.enabled or not resolved:
            return None
        return node, resolved, self._wanted_type, self._profile

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        self._set_resolved(wanted[1])
        self._publishers = self._count_publishers()
        super()._create_endpoint(wanted)

    def _factory(self, *wanted: Any) -> Callable[[], TopicSubscription]:
        node, topic, type_name, qos = wanted
        if node.wire == "ros1" and self.DIALECT is Dialect.ROS2:
            type_name = _ROS1_NAMES.get(type_name, type_name)
        return lambda: node.create_subscription(topic, type_name or None, qos=qos)

    def _on_created(self, endpoint: TopicSubscription) -> None:
        executor, on_arrival = self._executor, weak_callback(self._on_arrival)
        self._wake = lambda: executor.post(lambda: on_arrival(endpoint))
        self._created_at = self._steady()
        self._set_problem("")
        if is_alive(self):
            self._expect_publishers()
            self._refresh()
            self._deliver()

    def _on_closed(self, endpoint: TopicSubscription | None) -> None:  # noqa: ARG002 - the base's
        self._timer.stop()
        self._no_publisher.stop()
        self._current = False
        self._inner_problem = self._missed = ""
        report(self, subscribed=False)

    def _clear_shown(self) -> None:
        """Clear the message, which belongs to another topic or type."""
        had = self._sample is not None
        self._sample = self._message = self._value = None
        self._age = -1.0
        if had:
            self.messageChanged.emit()
            self.ageChanged.emit()
        self._update_stale()

    # Receiving.

    def _on_arrival(self, endpoint: TopicSubscription) -> None:
        if not is_valid(self) or endpoint is not self._endpoint:
            return
        wait = self._wait_ms()
        if wait > 0:
            self._timer.start(wait)
        else:
            self._deliver()

    def _wait_ms(self) -> int:
        """Return the milliseconds until a message may be shown."""
        if not self.throttleRate:
            return 0
        wait = self._pace.wait(1 / self.throttleRate, self._steady())
        return math.ceil(wait * 1000) if wait > 0.0005 else 0

    @Slot()
    def _deliver(self) -> None:
        endpoint = self._endpoint
        if endpoint is None:
            return
        samples = list(iter(endpoint.take, None))
        if samples and self.throttleRate:
            self._pace.take(1 / self.throttleRate, self._steady())
        # Not after showing them: a handler may wait in an event loop of its own.
        if samples and self.throttleRate and endpoint.batching:
            self._timer.start(self._wait_ms())  # batches come too rarely to wait for
        elif not endpoint.add_waiter(self._wake) and not endpoint.closed:
            self._wake()
        # They may have waited for their turn, or for a screen that stood still.
        held = time.monotonic() - endpoint.last_arrival if samples else 0.0
        for sample in samples if self.throttleRate == 0 or self._TAKES_ALL else samples[-1:]:
            self._show(sample, held)
            # A handler may have changed the topic or destroyed this object.
            if not is_valid(self) or endpoint is not self._endpoint:
                return

    def _show(self, sample: Sample, held: float) -> None:
        """Show a message that arrived `held` seconds ago."""
        try:
            message = sample.type.decode_checked(sample.data, sample.wire)
        except DecodeError as error:
            self._set_problem(f"{self._resolved}: a malformed message was refused: {error}")
            return
        except TypeNotFoundError:
            return  # unreadable without its type; the subscription reports the problem
        before, new_type = self._sample, False
        if before is None or sample.type is not before.type:
            name = self.DIALECT.type_name(sample.type.definition.name)
            new_type = name != self._found_type and not self._wanted_type
            self._found_type = name
        self._sample, self._message, self._value = sample, message, None
        self._current = True
        self._shown_at = self._steady() - held
        self._late = self._lateness(sample)
        self._age = held
        if self._outdated or not self._publishers:
            self._judge_publisher(sample.publisher)
        # Update all properties before emitting the first signal.
        was_stale, self._stale = self._stale, self._outdated or self._is_old()
        if new_type:
            self.messageTypeChanged.emit()
        self.messageChanged.emit()
        if not is_valid(self) or self._sample is not sample:
            return
        if self._problem:
            self._set_problem("")
        self.ageChanged.emit()
        if was_stale != self._stale:
            self.staleChanged.emit()
        if not self._subscribed:
            report(self, subscribed=True)
        if is_valid(self) and self._has_listeners():
            self.newMessage.emit(self._get_message())

    def _lateness(self, sample: Sample) -> float:
        """Return the excess delay of a message over others, in seconds."""
        endpoint = self._endpoint
        if endpoint is None:
            return 0.0
        return endpoint.lateness_ns(sample) / 1e9

    def _has_listeners(self) -> bool:
        """Return whether newMessage is connected, so that its value is needed."""
        meta = self.metaObject()
        return self.isSignalConnected(meta.method(meta.indexOfSignal("newMessage(QJSValue)")))

    def _build(self) -> QJSValue:
        message, runtime = self._message, self._runtime
        if message is None or runtime is None:
            return QJSValue()
        try:
            sample, other = self._sample, _ROS1_NAMES.get(self._wanted_type)
            if sample is not None and sample.type.name == other:
                message = self._translated(message, sample.type)
            return runtime.message(message, self.DIALECT)
        except Error as error:
            _log.error("%s: %s", self._resolved, error)
            return QJSValue()

    def _translated(self, message: Message, kind: MessageType) -> Message:
        """Return a message of ROS 1 as one of the type of ROS 2 that was asked for."""
        # Few interfaces need it.
        from rosglass.messages.translation import Translation  # noqa: PLC0415

        if self._translation is None or self._translation.source is not kind:
            self._translation = Translation(kind)
        return self._translation.convert(message)

    # Judging.

    def _is_old(self) -> bool:
        if self._sample is None:
            return True
        timeout = self._get_timeout()
        # After an interruption, a link may deliver old messages that are new only here.
        return timeout > 0 and self._steady() - self._shown_at + self._late > timeout / 1000

    def _recheck_outdated(self) -> None:
        # The publisher that latched the message still exists and would have sent a newer one.
        connected = self._session is not None and self._session.state == "connected"
        if connected and self._current and self._is_latched():
            self._outdated = False

    def _is_latched(self) -> bool:
        """Return whether the publisher of the message, not a successor, still keeps it for us."""
        node, sample, endpoint = self.node, self._sample, self._endpoint
        if node is None or sample is None or endpoint is None:
            return False
        if endpoint.qos.durability is not Durability.TRANSIENT_LOCAL:
            return False
        try:
            publishers = node.publishers(self._resolved)
        except Error:
            return False
        if self._profile.durability is Durability.BEST_AVAILABLE:
            publishers = [p for p in publishers if p.qos.durability is Durability.TRANSIENT_LOCAL]
        known = [one.gid for one in publishers if one.gid]
        return sample.publisher in known if known else bool(publishers)

    @Slot()
    def _on_tick(self) -> None:
        super()._on_tick()
        if self._sample is not None:
            self._age = self._steady() - self._shown_at
            self.ageChanged.emit()
        self._refresh()

    def _refresh(self) -> None:
        """Report the subscription's current statistics and problem."""
        subscription, throttle = self._endpoint, self.throttleRate
        if subscription is None:
            report(self, frequency=0.0, bandwidth=0.0)
            return
        statistics = subscription.statistics()
        enough = _HARDLY_FASTER if subscription.batching else _MUCH_FASTER
        fast = statistics.frequency > enough * throttle
        subscription.set_batching(throttle > 0 and fast)
        self._inner_problem = subscription.problem
        self._note_missed_history(subscription)
        self._announce_problem()
        report(
            self,
            # Without a type, nothing can be received.
            subscribed=subscription.type is not None or self._current,
            frequency=statistics.frequency,
            bandwidth=statistics.bandwidth,
            # Throttling drops messages on purpose, so only count losses without it.
            dropped=statistics.dropped if throttle == 0 else 0,
        )

    def _note_missed_history(self, subscription: TopicSubscription) -> None:
        """Log and keep that only a message is missing which this subscription did not ask for."""
        missed = ""
        waited = self._steady() - self._created_at
        if not self._current and self._publishers and waited > _NO_MESSAGE_S:
            missed = subscription.hint
        if missed and self.DIALECT is Dialect.ROS2:
            missed += ", with qos: Ros2.QoS().reliable().transient_local()"
        if missed != self._missed:
            self._missed = missed
            self._log(f"{self._resolved}: {missed}" if missed else "", logging.WARNING)


class Subscriber(Subscription):
    """The element ``Subscriber`` of ``Ros 1.0``: a :class:`Subscription` within a namespace."""

    DIALECT = Dialect.ROS1
    _DEFAULT_QOS = ROS1_QOS

    nsChanged = Signal()

    running = Writable(bool, read=lambda self: self.enabled, write="_set_running")
    ns = Writable(str, read="_get_namespace", write="_set_namespace")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self.enabledChanged.connect(self.runningChanged)  # type: ignore[attr-defined]

    def configure_within(self, namespace: str, topic: str, qos: QoS) -> None:
        """Set the arguments of ``Ros.subscribe``."""
        self.configure(topic, "", qos)
        self._namespace = self._shown_namespace = namespace

    def _set_running(self, running: bool) -> None:
        self.enabled = running

    @Slot(result=int)
    def getNumPublishers(self) -> int:
        """Return the number of connected publishers; 0 while there is no subscription."""
        return self.getPublisherCount()


#: Maximum milliseconds of a Qt timer, 24 days.
_LONGEST = 2**31 - 1


def next_message(
    subscription: Subscription,
    runtime: Runtime,
    topic: str,
    first: QJSValue | None,
    second: QJSValue | None,
) -> QJSValue:
    """Implement ``waitForMessageAsync``.

    Args:
        subscription: A new subscription for this purpose.
        runtime: The engine's runtime.
        topic: Topic name.
        first: Milliseconds, or the function.
        second: The function after milliseconds.

    Returns:
        A promise of the message; undefined if there is a function.
    """
    timed = first is not None and first.isNumber()
    callback = second if timed else first
    milliseconds = first.toNumber() if timed and first is not None else 0.0
    if math.isnan(milliseconds):
        runtime.throw(f"waitForMessageAsync({topic!r}): the milliseconds to wait are NaN")
        subscription.deleteLater()
        return QJSValue()
    if callback is not None and callback.isCallable():

        def pass_on(message: QJSValue | None) -> None:
            call_back(runtime, callback, QJSValue() if message is None else message)

        wait_for_message(runtime, subscription, topic, milliseconds, pass_on)
        return QJSValue()
    if callback is not None:
        runtime.throw(f"waitForMessageAsync({topic!r}): the callback is not a function")
        subscription.deleteLater()
        return QJSValue()
    deferred = Deferred(runtime, f"waiting for a message on {topic}")

    def settle(message: QJSValue | None) -> None:
        if message is None:
            deferred.reject(f"none came within {milliseconds:g} ms")
        else:
            deferred.resolve(message)

    wait_for_message(runtime, subscription, topic, milliseconds, settle)
    return deferred.promise


def wait_for_message(
    runtime: Runtime,
    subscription: Subscription,
    topic: str,
    milliseconds: float,
    done: Callable[[QJSValue | None], None],
) -> None:
    """Call a function with the next message of a topic, which may be a latched one.

    Args:
        runtime: The engine's runtime, which owns the subscription.
        subscription: A new subscription for this purpose.
        topic: Topic name.
        milliseconds: Time to wait; 0 or infinity for no limit.
        done: Called with the message, or with None after a timeout.
    """
    subscription.setParent(runtime)
    subscription.configure(topic, "", QoS.best_available())
    ended = False

    def end(message: QJSValue | None) -> None:
        nonlocal ended
        if ended:
            return
        ended = True
        if is_alive(subscription):
            subscription.deleteLater()
        done(message)

    subscription.newMessage.connect(end)
    if 0 < milliseconds < math.inf:
        QtCore.QTimer.singleShot(round(min(milliseconds, _LONGEST)), lambda: end(None))
