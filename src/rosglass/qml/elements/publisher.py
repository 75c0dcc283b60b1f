"""Publishers made by ``Ros2.createPublisher``."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import os
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING

import rosglass
from rosglass import connection
from rosglass.comm.names import similar
from rosglass.comm.qos import Durability, History, QoS
from rosglass.errors import ConversionError, Error, UnsupportedError
from rosglass.qml.elements.element import NO_PEER_MS, Element, single_shot
from rosglass.qml.elements.singleton import full_type
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.from_js import fields_from_js
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import ReadOnly
from rosglass.qml.engine.session import NOT_INITIALIZED, weak_callback
from rosglass.qt import Property, QJSValue, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.events import Matched
    from rosglass.comm.node import Node
    from rosglass.comm.publisher import Publisher as Sender
    from rosglass.messages import Message, MessageType
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session

__all__ = ["Publisher", "RosPublisher"]

_log = logging.getLogger("rosglass.qml")

#: Maximum seconds that a message waits for its topic to be advertised and the node connected.
_HOLD_TIMEOUT_S = 2.0
#: Maximum seconds after that during which messages wait for known subscribers to connect.
_MATCH_TIMEOUT_S = 1.0
#: Maximum number of messages held with keep-all history.
_MAX_HELD = 1000


class Publisher(Element):
    """Sends messages of one type on one topic; advertises as soon as there is a node.

    Messages published right after its creation are held until the topic is advertised, the node
    connected to the robot and the topic's subscribers are connected; then they are sent in order.

    Args:
        runtime: The engine's runtime.
        topic: Topic name, as in QML.
        type_name: Message type.
        qos: Profile offered.
    """

    #: :attr:`isAdvertised` changed.
    advertised = Signal()
    topicChanged = Signal()

    topic = ReadOnly(str, read=lambda self: self._resolved or self._topic)
    type = Property(str, lambda self: self._type, constant=True)
    queueSize = Property(int, lambda self: self._qos.depth, constant=True)
    qos = Property(QJSValue, lambda self: self._runtime.qos(self._qos), constant=True)
    isAdvertised = ReadOnly(bool, read=lambda self: self._endpoint is not None, notify="advertised")

    _endpoint: Sender | None

    def __init__(self, runtime: Runtime, topic: str, type_name: str, qos: QoS) -> None:
        super().__init__(None, runtime)
        self._topic, self._type, self._qos = topic, type_name, qos
        self._resolved = ""
        #: Held messages, each with its deadline by :func:`time.monotonic`.
        self._held: deque[tuple[Message, float]] = deque()
        #: Keeps JavaScript from collecting this publisher while it holds messages.
        self._reference: QJSValue | None = None
        #: Whether a held message was dropped, and the node has not been connected since.
        self._unreachable = False
        #: When the node was connected and the topic advertised, monotonic.
        self._ready_at: float | None = None
        self._settled = False
        self._no_subscriber = single_shot(self, self._log_no_subscriber)

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return self._topic

    @Slot(result=int)
    def getSubscriptionCount(self) -> int:
        """Return the number of matching subscriptions; 0 before the topic is advertised."""
        sender = self._endpoint
        try:
            return sender.subscription_count() if sender is not None else 0
        except Error:
            return 0

    @Slot(QJSValue, result=bool)
    def publish(self, message: QJSValue) -> bool:
        """Publish a message; omitted fields get their defaults.

        A value that does not fit throws a JavaScript Error that names the field; nothing is sent.

        Returns:
            Whether it was passed to a connected node, or is held until the node is connected. False
            while there is no node and none is connecting, while the topic cannot be advertised, and
            while the connection is lost or was not established in time.
        """
        sender = self._endpoint
        kind = self._early_type() if sender is None else sender.type
        if kind is None:
            why = self._problem.removeprefix(f"{self._topic}: ")
            reason = why or "it is not advertised yet"
            if self._session is not None and not self._session.is_initialized:
                if self._session.closed:
                    return False  # the program is ending
                ended = bool(self._resolved)  # it was advertised
                reason = "the node was shut down" if ended else f"{reason}; {NOT_INITIALIZED}"
            self._complain(f"nothing was published on {self._topic}: {reason}", logging.WARNING)
            return False
        try:
            fields = fields_from_js(message, kind, dialect=self.DIALECT)
            if self._held:
                self._send_held()
            if sender is None or self._held or not self._may_send(sender):
                # Copied by encoding, so that later changes of the JavaScript object have no effect.
                self._hold(kind.decode(kind.encode(fields)))
                return True
            self._send(sender, fields)
        except ConversionError as error:
            # Qt logs it with the QML line, unless JavaScript catches it.
            if self._runtime is not None:
                text = f"nothing was published on {self._resolved or self._topic}: {error}"
                self._runtime.throw(self.DIALECT.spelled(text))
            return False
        except Error as error:
            self._complain(f"nothing was published on {self._resolved}: {error}", logging.ERROR)
            return False
        if not self._is_connected():
            detail = self._session.detail if self._session is not None else ""
            text = f"published on {self._resolved} while the connection is lost: {detail}"
            self._complain(text, logging.WARNING)
            return False
        return True

    def _send(self, sender: Sender, message: dict[str, object] | Message) -> None:
        waits = self.node is not None and self.node.wire != "ros1"  # ROS 1 queues without limit
        if waits and self._qos.history is History.KEEP_ALL and self._session is not None:
            # On the worker: with keep-all history, publishing blocks while the network is stuck.
            data = sender.type.encode(message)
            self._session.background(lambda: sender.publish_serialized(data), self._on_sent_late)
        else:
            sender.publish(message)

    def _early_type(self) -> MessageType | None:
        """Return the type of a topic that will be advertised soon; None if it will not be.

        A type that must be requested from the robot is unknown until the topic is advertised.
        """
        session = self._session or (self._runtime.session if self._runtime is not None else None)
        if session is None or self._problem or session.state not in ("connecting", "connected"):
            return None
        if self._unreachable and session.state != "connected":
            return None
        try:
            if session.node is not None:
                ros = 1 if session.node.wire == "ros1" else 2
            else:
                url = session.url or connection.default_url(os.environ)
                ros = 1 if url.lower().startswith("ros1:") else 2
            found = rosglass.load(self._type, ros=ros)
        except Error:
            return None
        return found if isinstance(found, rosglass.MessageType) else None

    def _is_connected(self) -> bool:
        return self._session is not None and self._session.state == "connected"

    def _may_send(self, sender: Sender) -> bool:
        """Return whether a message is sent now instead of being held."""
        return self._unreachable or self._is_settled(sender)

    def _is_settled(self, sender: Sender) -> bool:
        """Return whether the known subscribers will receive a message sent now."""
        if self._is_connected():
            self._unreachable = False
            if self._ready_at is None:
                self._ready_at = time.monotonic()
        if not self._settled:
            latched = self._qos.durability is Durability.TRANSIENT_LOCAL  # late ones get it, too
            late = self._ready_at is not None and (
                time.monotonic() - self._ready_at > _MATCH_TIMEOUT_S or self._is_matched(sender)
            )
            self._settled = latched or late
        return self._settled

    def _is_matched(self, sender: Sender) -> bool:
        """Return whether there are subscribers, and all of those in the graph are connected."""
        if self.node is None:
            return False
        try:
            count = sender.subscription_count()
            return 0 < count >= len(self.node.subscriptions(self._resolved))
        except Error:
            return False

    def _hold(self, message: Message) -> None:
        most = _MAX_HELD if self._qos.history is History.KEEP_ALL else self._qos.depth
        if len(self._held) >= most:
            self._held.popleft()
            if self._endpoint is None or self._qos.history is History.KEEP_ALL:
                text = f"{self._topic}: messages are dropped, the oldest first: more than "
                text += f"{most} were published before it was advertised"
                self._complain(text, logging.WARNING)
        # JavaScript may drop its only reference, as in createPublisher(...).publish({}).
        engine = self._runtime.engine if self._runtime is not None else None
        if self._reference is None and engine is not None:
            self._reference = engine.newQObject(self)
        limit = self._qos.send_timeout
        longest = _HOLD_TIMEOUT_S if limit is None else min(_HOLD_TIMEOUT_S, limit.seconds)
        self._held.append((message, time.monotonic() + longest))
        if self._config is None:
            # The interface may end before the next event.
            self._run_update()
        self._cleanup["held"] = self._report_held

    def _send_held(self) -> None:
        """Send held messages once subscribers can receive them; drop those that are too old."""
        sender, held = self._endpoint, self._held
        connected, ready = self._is_connected(), sender is not None and self._is_settled(sender)
        if self._qos.send_timeout is not None or not (ready or (sender is not None and connected)):
            while held and time.monotonic() > held[0][1]:
                held.popleft()
                late = "it could not be advertised in time"
                if sender is not None and connected:
                    late = "no subscriber was connected in time"
                else:
                    self._unreachable = sender is not None or not connected
                    if sender is not None and self._session is not None:
                        late = f"not connected in time: {self._session.detail}"
                self._on_sent_late(Error(self._problem or late))
        if sender is not None and ready:
            while held:
                message, _ = held.popleft()
                try:
                    self._send(sender, message)
                except Error as error:
                    self._on_sent_late(error)
        if not held:
            self._reference = None

    def _report_held(self) -> None:
        """Log messages that an ended interface did not send."""
        if self._held and self._config is None:
            text = "the interface ended before there was a node"
            _log.error("nothing was published on %s: %s", self._topic, text)

    def _on_sent_late(self, result: Error | None) -> None:
        """Log that a message could not be sent after waiting for the network."""
        if result is not None and is_alive(self):
            text = f"nothing was published on {self._resolved or self._topic}: {result}"
            self._log(self.DIALECT.spelled(text), logging.ERROR)

    def _complain(self, text: str, level: int) -> None:
        """Log with the QML line, at a limited rate."""
        if self._runtime is None:
            return
        text, caller = self.DIALECT.spelled(text), self._runtime.caller()
        if self._limit.allows((caller, text)):
            log_from_qml("", level, text, caller)

    def _wanted(self) -> tuple[Node] | None:
        return None if self.node is None else (self.node,)

    def _factory(self, node: Node) -> Callable[[], Sender]:
        return lambda: node.create_publisher(self._topic, self._type, self._qos)

    def _dispose(self, session: Session, endpoint: Sender) -> None:
        # What is held goes out first if the interface has ended.
        held = [] if is_alive(self) else list(self._held)
        if not held:
            super()._dispose(session, endpoint)
            return
        self._held.clear()

        def send() -> None:
            try:
                for message, deadline in held:
                    if time.monotonic() > deadline:
                        raise Error("it was not sent in time before the interface ended")
                    endpoint.publish(message)
            except Error as error:
                _log.error("nothing was published on %s: %s", endpoint.topic, error)
            finally:
                endpoint.close()

        session.background(send)

    def _on_created(self, endpoint: Sender) -> None:
        self._resolved = endpoint.topic
        self._ready_at, self._settled = None, False
        self._no_subscriber.start(NO_PEER_MS)
        self._set_problem("")
        self.topicChanged.emit()
        self.advertised.emit()
        if is_alive(self):
            self._send_held()

    def _on_closed(self, endpoint: Sender | None) -> None:
        self._no_subscriber.stop()
        if endpoint is not None:
            self.advertised.emit()
        if self.node is None and self._held:
            self._held.clear()
            self._reference = None
            self._on_sent_late(Error("the node was shut down"))

    @Slot()
    def _log_no_subscriber(self) -> None:
        """Log that the topic has no subscription, with a similar name in case it is misspelt."""
        node, sender = self.node, self._endpoint
        if node is None or sender is None or not self._is_connected():
            return
        with suppress(Error):  # the node may just have been closed
            if sender.subscription_count() or node.subscriptions(self._resolved):
                return
            subscribed = [name for name in node.topics() if node.subscriptions(name)]
            hint = similar(self._resolved, subscribed)
            level = logging.WARNING if hint else logging.INFO
            self._log(f"{self._resolved}: this topic has no subscription{hint}", level)

    @Slot()
    def _on_tick(self) -> None:
        if self._held:
            self._send_held()
        if self._endpoint is not None:
            self._is_settled(self._endpoint)  # updates the state for the next message
            self._set_problem(self._endpoint.problem)


class RosPublisher(Publisher):
    """A publisher with the names of ``Ros 1.0``.

    Args:
        runtime: The engine's runtime.
        type_name: Message type, as in QML.
        topic: Topic name, as in QML.
        queue_size: Maximum number of messages queued for a slow subscriber; 0 for no limit.
        qos: Profile offered, with that size; transient local if new subscribers immediately get the
            last message.
    """

    DIALECT = Dialect.ROS1

    connected = Signal()
    disconnected = Signal()

    def __init__(
        self, runtime: Runtime, type_name: str, topic: str, queue_size: int, qos: QoS
    ) -> None:
        super().__init__(runtime, topic, full_type(type_name), qos)
        self._written, self._size = type_name, queue_size

    type = Property(str, lambda self: self._written, constant=True)
    queueSize = Property(int, lambda self: self._size, constant=True)
    isLatched = Property(
        bool, lambda self: self._qos.durability is Durability.TRANSIENT_LOCAL, constant=True
    )

    @Slot(result=int)
    def getNumSubscribers(self) -> int:
        """Return the number of connected subscribers; 0 before the topic is advertised."""
        return self.getSubscriptionCount()

    def _on_created(self, endpoint: Sender) -> None:
        with suppress(UnsupportedError):  # a recording, which has no subscribers
            endpoint.on_matched(weak_callback(self._on_matched), self._executor)
        super()._on_created(endpoint)

    def _on_matched(self, event: Matched) -> None:
        if is_alive(self):
            (self.connected if event.change > 0 else self.disconnected).emit()
