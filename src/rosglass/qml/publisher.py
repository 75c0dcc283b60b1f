"""Publishers made by ``Ros2.createPublisher``."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from rosglass.comm.qos import History
from rosglass.errors import ConversionError, Error, TypeNotFoundError
from rosglass.qml.element import RETRY, Element
from rosglass.qml.from_js import fields_from_js
from rosglass.qml.log import log_from_qml
from rosglass.qml.session import NOT_INITIALIZED
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.comm.node import Node
    from rosglass.comm.publisher import Publisher as Sender
    from rosglass.comm.qos import QoS
    from rosglass.messages.schema import Schema
    from rosglass.qml.runtime import Runtime

__all__ = ["Publisher"]


class Publisher(Element):
    """Sends messages of one type on one topic; advertises as soon as there is a node.

    Args:
        runtime: The engine's runtime.
        topic: Topic name, as in QML.
        type_name: Message type.
        qos: Profile offered.
    """

    #: :attr:`isAdvertised` changed.
    advertised = Signal()
    topicChanged = Signal()
    problemChanged = Signal()

    def __init__(self, runtime: Runtime, topic: str, type_name: str, qos: QoS) -> None:
        super().__init__(None, runtime)
        self._topic, self._type, self._qos = topic, type_name, qos
        self._resolved = ""
        self._sender: Sender | None = None
        self._schema: Schema | None = None
        self._have: Node | None = None
        self._retry = QtCore.QTimer(self)
        self._retry.setSingleShot(True)
        self._retry.timeout.connect(self._advertise)

    topic = Property(str, lambda self: self._resolved or self._topic, notify=topicChanged)
    type = Property(str, lambda self: self._type, constant=True)
    queueSize = Property(int, lambda self: self._qos.depth, constant=True)
    qos = Property(QJSValue, lambda self: self._runtime.qos(self._qos), constant=True)
    isAdvertised = Property(bool, lambda self: self._sender is not None, notify=advertised)
    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    @Slot(result=int)
    def getSubscriptionCount(self) -> int:
        """Return how many subscriptions match; 0 before the topic is advertised."""
        sender = self._sender
        try:
            return sender.subscription_count() if sender is not None else 0
        except Error:
            return 0

    @Slot(QJSValue, result=bool)
    def publish(self, message: QJSValue) -> bool:
        """Send a message; fields that are left out get their defaults.

        A value that does not fit throws a JavaScript Error that names the field; nothing is sent.

        Returns:
            Whether it was handed to a connected node: false before the topic is advertised and
            while the connection is lost.
        """
        sender, schema = self._sender, self._schema
        if sender is None or schema is None:
            told = self._problem.removeprefix(f"{self._topic}: ")
            reason = told or "it is not advertised yet"
            if self._session is not None and not self._session.is_initialized:
                reason += f"; {NOT_INITIALIZED}"
            self._complain(f"nothing was published on {self._topic}: {reason}", logging.WARNING)
            return False
        try:
            fields = fields_from_js(message, schema, dialect=self.DIALECT)
            if self._qos.history is History.KEEP_ALL and self._session is not None:
                # Who must not lose anything waits for a network that is stuck: not here.
                data = sender.type.encode(fields)
                self._session.background(lambda: sender.publish_serialized(data), self._sent_late)
            else:
                sender.publish(fields)
        except ConversionError as error:
            # Logged by Qt, with the place, unless somebody catches it.
            if self._runtime is not None:
                text = f"nothing was published on {self._resolved}: {error}"
                self._runtime.throw(self.DIALECT.spelled(text))
            return False
        except Error as error:
            self._complain(f"nothing was published on {self._resolved}: {error}", logging.ERROR)
            return False
        if self._session is None or self._session.state != "connected":
            detail = self._session.detail if self._session is not None else ""
            text = f"published on {self._resolved} while the connection is lost: {detail}"
            self._complain(text, logging.WARNING)
            return False
        return True

    def _sent_late(self, result: Error | None) -> None:
        """Tell that what waited for the network was not sent in the end."""
        if result is not None and is_alive(self):
            text = f"nothing was published on {self._resolved}: {result}"
            self._complain(text, logging.ERROR)

    def _complain(self, text: str, level: int) -> None:
        """Log with the QML place, but not for every message of a stream."""
        if self._runtime is None:
            return
        text, caller = self.DIALECT.spelled(text), self._runtime.caller()
        if self._limit.allows((caller, text)):
            log_from_qml("", level, text, caller)

    def _update(self) -> None:
        node = self.node
        if node is self._have:
            return
        self._withdraw()
        self._have = node
        if node is not None:
            self._advertise()

    @Slot()
    def _advertise(self) -> None:
        node = self._have
        if node is None or self._session is None or self._sender is not None:
            return
        self._make(
            lambda: node.create_publisher(self._topic, self._type, self._qos),
            lambda: self._have is node,
            self._advertised,
        )

    def _advertised(self, result: Sender | Error) -> None:
        if isinstance(result, Error):
            self._say(f"{self._topic}: {result}")
            if isinstance(result, TypeNotFoundError):
                self._retry.start(RETRY)
            return
        from rosglass.messages.schema import schema_of  # noqa: PLC0415 - loaded by now

        session = self._session
        assert session is not None
        self._sender, self._resolved = result, result.topic
        self._schema = schema_of(result.type.definition)
        self._at_end["sender"] = lambda: session.background(result.close)
        self._say("")
        self.topicChanged.emit()
        self.advertised.emit()

    @Slot()
    def _on_tick(self) -> None:
        if self._sender is not None:
            self._say(self._sender.problem)

    def _withdraw(self) -> None:
        self._retry.stop()
        sender, self._sender = self._sender, None
        if sender is None or self._session is None:
            return
        self._at_end.pop("sender", None)
        self._session.background(sender.close)
        self.advertised.emit()

    def _problem_changed(self) -> None:
        self.problemChanged.emit()
