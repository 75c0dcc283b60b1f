"""``ServiceServer``: offers a service whose requests a JavaScript function answers."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, ServiceError, TypeNotFoundError
from rosglass.qml.answering import Answers
from rosglass.qml.element import RETRY, Element
from rosglass.qml.from_js import fields_from_js
from rosglass.qml.singleton import full_type
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.comm.service_server import ServiceServer as Server
    from rosglass.messages import Message
    from rosglass.qml.runtime import Runtime

__all__ = ["ServiceServer", "server_function"]


class ServiceServer(Element):
    """Offers a service while it is enabled. See its page in ``docs/elements``."""

    nameChanged = Signal()
    serviceTypeChanged = Signal()
    handlerChanged = Signal()
    enabledChanged = Signal()
    readyChanged = Signal()
    problemChanged = Signal()

    _HOLDS = ("_handler", "_answers", "_early")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._name, self._type = "", ""
        self._handler = QJSValue()
        self._enabled = True
        self._server: Server | None = None
        self._answers: Answers | None = None
        #: Requests that came before the server was there.
        self._early: list[Callable[[], None]] = []
        self._have: tuple[Node, str, str] | None = None
        self._retry = QtCore.QTimer(self)
        self._retry.setSingleShot(True)
        self._retry.timeout.connect(self._offer)

    def configure(self, name: str, type_name: str, handler: QJSValue) -> None:
        """Set what ``Ros2.createServiceServer`` was given."""
        self._name, self._type, self._handler = name, type_name, handler

    # Properties.

    def _set_name(self, name: str) -> None:
        if name != self._name:
            self._name = name
            self.nameChanged.emit()
            self._schedule()

    def _set_type(self, name: str) -> None:
        if name != self._type:
            self._type = name
            self.serviceTypeChanged.emit()
            self._schedule()

    def _set_handler(self, handler: QJSValue) -> None:
        if not (handler.isCallable() or handler.isNull() or handler.isUndefined()):
            self._refuse(f"ServiceServer {self._name!r}: the handler is not a function")
            return
        self._handler = handler
        self.handlerChanged.emit()

    def _set_enabled(self, enabled: bool) -> None:
        if enabled != self._enabled:
            self._enabled = enabled
            self.enabledChanged.emit()
            self._schedule()

    name = Property(str, lambda self: self._name, _set_name, notify=nameChanged)
    serviceType = Property(str, lambda self: self._type, _set_type, notify=serviceTypeChanged)
    handler = Property(QJSValue, lambda self: self._handler, _set_handler, notify=handlerChanged)
    enabled = Property(bool, lambda self: self._enabled, _set_enabled, notify=enabledChanged)
    ready = Property(bool, lambda self: self._server is not None, notify=readyChanged)
    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    # Serving.

    def _update(self) -> None:
        node = self.node
        want = None
        if node is not None and self._enabled and self._name and self._type:
            want = (node, self._name, full_type(self._type, "srv"))
        if want != self._have:
            self._withdraw()
            self._have = want
            self._offer()

    @Slot()
    def _offer(self) -> None:
        session, runtime, want = self._session, self._runtime, self._have
        if session is None or runtime is None or want is None or self._server is not None:
            return
        node, name, type_name = want
        answers = self._answers = Answers(runtime, f"the handler of service {name}")
        self._at_end["answers"] = answers.give_up

        def done(result: Server | Error) -> None:
            if isinstance(result, Error):
                self._say(f"service {name}: {result}")
                if isinstance(result, TypeNotFoundError):
                    self._retry.start(RETRY)
            else:
                self._server = result
                self._at_end["server"] = lambda: session.background(result.close)
                self._say(result.problem)
                self.readyChanged.emit()
                early, self._early = self._early, []
                for answer in early:
                    answer()

        self._make(
            lambda: node.create_service_server(
                name, type_name, self._on_request, executor=session.executor
            ),
            lambda: self._have is want,
            done,
        )

    def _on_request(self, request: Message) -> Any:
        if not is_alive(self) or self._answers is None:
            raise ServiceError("the interface that offered this service is gone")
        if self._server is not None:
            return self._answer(request, self._server, self._answers)
        # Somebody waited for the service, and was quicker than the news that it is offered.
        return self._answers.later(self._early, lambda: self._on_request(request))

    def _answer(self, request: Message, server: Server, answers: Answers) -> Any:
        runtime = self._runtime
        assert runtime is not None
        kind = server.type.response

        def take(value: QJSValue) -> Any:
            from rosglass.messages.schema import schema_of  # noqa: PLC0415 - loaded by now

            if value.isBool() and not value.toBool():
                raise ServiceError(f"the handler of service {self._name} returned false")
            if value.isUndefined() or value.isNull() or value.isBool():
                return None
            return fields_from_js(value, schema_of(kind.definition), dialect=self.DIALECT)

        return answers.ask(self._handler, [runtime.message(request, self.DIALECT)], take)

    def _withdraw(self) -> None:
        self._retry.stop()
        answers, self._answers = self._answers, None
        self._early = []
        if answers is not None:
            answers.give_up()
        server, self._server = self._server, None
        self._at_end.pop("server", None)
        if server is not None and self._session is not None:
            self._session.background(server.close)
            self.readyChanged.emit()

    def _problem_changed(self) -> None:
        self.problemChanged.emit()


def server_function(given: QJSValue) -> QJSValue:
    """Return the function that ``createServiceServer`` was given.

    Raises:
        Error: It is none.
    """
    if not given.isCallable():
        raise Error("the handler is not a function")
    return given
