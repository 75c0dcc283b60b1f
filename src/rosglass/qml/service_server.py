"""``ServiceServer``: offers a service whose requests a JavaScript function answers."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, ServiceError
from rosglass.qml.callbacks import Answers, weak_callback
from rosglass.qml.dialect import Dialect
from rosglass.qml.element import Element
from rosglass.qml.from_js import fields_from_js
from rosglass.qml.properties import ReadOnly, Writable, function, report
from rosglass.qml.singleton import full_type
from rosglass.qt import QJSValue, QtCore, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.comm.service_server import ServiceServer as Server
    from rosglass.messages import Message
    from rosglass.qml.runtime import Runtime

__all__ = ["RosServiceServer", "ServiceServer", "server_function"]

_GONE = "the interface that offered this service is gone"


class ServiceServer(Element):
    """Offers a service while it is enabled. See its page in ``docs/elements``."""

    name = Writable(str, "")
    serviceType = Writable(str, "")
    handler = Writable(QJSValue, accept=function, then="")
    enabled = Writable(bool, True)
    ready = ReadOnly(bool, False)

    _HOLDS = ("_handler", "_answers", "_early")
    _endpoint: Server | None

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._answers: Answers | None = None
        #: Requests that arrived before the worker thread had returned the server.
        self._early: list[Callable[[], None]] = []

    def configure(self, name: str, type_name: str, handler: QJSValue) -> None:
        """Set the arguments of ``Ros2.createServiceServer``."""
        self.name, self.serviceType, self.handler = name, type_name, handler

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"service {self.name}"

    def _wanted(self) -> tuple[Node, str, str] | None:
        node = self.node
        if node is None or not (self.enabled and self.name and self.serviceType):
            return None
        return node, self.name, full_type(self.serviceType, "srv")

    def _factory(self, node: Node, name: str, type_name: str) -> Callable[[], Server]:
        runtime, executor = self._find_runtime(), self._executor
        assert runtime is not None
        answers = self._answers = Answers(runtime, f"the handler of {self.label}")
        self._cleanup["answers"] = answers.give_up
        on_request = weak_callback(self._on_request, ServiceError(_GONE))
        return lambda: node.create_service_server(name, type_name, on_request, executor=executor)

    def _on_created(self, endpoint: Server) -> None:
        self._set_problem(endpoint.problem)
        report(self, ready=True)
        early, self._early = self._early, []
        for answer in early:
            answer()

    def _on_closed(self, endpoint: Server | None) -> None:  # noqa: ARG002 - the base's signature
        answers, self._answers, self._early = self._answers, None, []
        if answers is not None:
            answers.give_up()
        report(self, ready=False)

    def _on_request(self, request: Message) -> Any:
        if not is_alive(self) or self._answers is None:
            raise ServiceError(_GONE)
        if self._endpoint is not None:
            return self._answer(request, self._endpoint, self._answers)
        # A waiting client called before the worker thread had returned the server.
        return self._answers.later(self._early, lambda: self._on_request(request))

    def _answer(self, request: Message, server: Server, answers: Answers) -> Any:
        runtime = self._runtime
        assert runtime is not None
        kind = server.type.response

        def take(value: QJSValue) -> Any:
            if value.isBool() and not value.toBool():
                raise ServiceError(f"the handler of {self.label} returned false")
            if value.isUndefined() or value.isNull() or value.isBool():
                return None
            return fields_from_js(value, kind, dialect=self.DIALECT)

        return answers.ask(self.handler, [runtime.message(request, self.DIALECT)], take)


def server_function(given: QJSValue) -> QJSValue:
    """Return the function passed to ``createServiceServer``.

    Raises:
        Error: It is not a function.
    """
    if not given.isCallable():
        raise Error("the handler is not a function")
    return given


class RosServiceServer(ServiceServer):
    """The element ``ServiceServer`` of ``Ros 1.0``."""

    DIALECT = Dialect.ROS1
