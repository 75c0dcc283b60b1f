"""Services in QML: clients and servers of ``Ros2 1.0`` and ``Ros 1.0``."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import time
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from rosglass.comm.qos import QoS
from rosglass.errors import ConversionError, Error, ServiceError, ServiceUnavailableError
from rosglass.qml.elements.element import (
    CONNECTION_TIMEOUT_MS,
    ClientElement,
    Element,
    given_fields,
    named,
)
from rosglass.qml.elements.singleton import full_type
from rosglass.qml.engine.callbacks import Answers, Deferred, call_back, pass_on
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.from_js import fields_from_js
from rosglass.qml.engine.js_values import qos_from_js, shown
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, function, report
from rosglass.qml.engine.runtime import own_runtime
from rosglass.qml.engine.session import NOT_INITIALIZED, weak_callback
from rosglass.qml.engine.waiting import MOST_WAITING, wait_for
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.node import Node
    from rosglass.comm.service_client import ServiceClient as Caller_
    from rosglass.comm.service_server import ServiceServer as Server
    from rosglass.comm.wire import Call
    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime

    #: Called on the GUI thread with the response or the error.
    Done: TypeAlias = Callable[[Message | Error], None]

__all__ = ["RosServiceServer", "Service", "ServiceClient", "ServiceServer", "server_function"]


@dataclass(eq=False)
class _Request:
    """A request that cannot be converted yet, as there is no client, or its type is unknown."""

    value: QJSValue
    done: Done
    #: Time of creation, monotonic.
    made: float = field(default_factory=time.monotonic)


class ServiceClient(ClientElement):
    """Calls a service; requests wait until there is a server.

    Args:
        runtime: The engine's runtime.
        name: Service name, as in QML.
        type_name: Service type; empty uses the server's.
        dialect: The module whose format responses have.
        qos: Profile of requests and replies; None for the default one.
    """

    ready = ReadOnly(bool, False, notify="serviceReadyChanged")
    name = Property(str, lambda self: self._name, constant=True)
    type = Property(str, lambda self: self._type, constant=True)
    connectionTimeout = Writable(int, CONNECTION_TIMEOUT_MS, at_least(0), then="", unit="ms")
    pendingRequests = ReadOnly(int, 0)

    _endpoint: Caller_ | None

    def __init__(
        self,
        runtime: Runtime,
        name: str,
        type_name: str,
        dialect: Dialect = Dialect.ROS2,
        qos: QoS | None = None,
    ) -> None:
        super().__init__(runtime, name, type_name, dialect)
        self._qos = qos
        #: The requests that the client has not called yet.
        self._early: list[_Request] = []

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"service {self._name}"

    @Slot(result=bool)
    def isServiceReady(self) -> bool:
        """Return whether a server is available."""
        return self.ready

    # Calling.

    @Slot(QJSValue)
    @Slot(QJSValue, QJSValue)
    def sendRequestAsync(self, request: QJSValue, callback: QJSValue | None = None) -> None:
        """Call the service; `callback` is called with the response, or with false on failure.

        A value that does not fit throws a JavaScript Error that names the field; nothing is sent.
        """
        runtime = self._runtime
        assert runtime is not None
        if callback is not None and not callback.isCallable():
            if not (callback.isUndefined() or callback.isNull()):
                runtime.throw(f"service {self._name}: the callback is not a function")
                return
            callback = None
        caller = runtime.caller()

        def done(result: Message | Error) -> None:
            if isinstance(result, Error):
                log_from_qml("", logging.ERROR, named(self._name, result), caller)
            if callback is not None:
                call_back(runtime, callback, self.shown(result))

        self.send(request, done)

    @Slot(QJSValue, result=QJSValue)
    @Slot(result=QJSValue)
    def call(self, request: QJSValue | None = None) -> QJSValue:
        """Call the service and return a promise of the response."""
        runtime = self._runtime
        assert runtime is not None
        deferred = Deferred(runtime, f"service {self._name}")

        def done(result: Message | Error) -> None:
            if isinstance(result, Error):
                deferred.reject(named(self._name, result))
            else:
                deferred.resolve(runtime.message(result, self._dialect))

        sent = self.send(QJSValue() if request is None else request, done)
        return deferred.promise if sent else QJSValue()

    @Slot()
    def cancelRequests(self) -> None:
        """Drop every request without a response; servers are not notified."""
        self._fail_all(Error(f"the request to {self._name} was given up"))

    def send(self, value: QJSValue, done: Done) -> bool:
        """Send a request as soon as there is a server.

        Args:
            value: The request; an invalid one throws into JavaScript.
            done: Called with the response or the error, on the GUI thread.

        Returns:
            Whether the request was accepted; otherwise `done` is not called.
        """
        self._submit_waiting()
        request, client = _Request(value, done), self._endpoint
        if client is None or client.type is None:
            self._early.append(request)
            self._count()
            if self.connectionTimeout:
                QtCore.QTimer.singleShot(self.connectionTimeout, lambda: self._give_up(request))
            return True
        try:
            self._submit(client, request)
        except Error as error:
            if self._runtime is not None:
                self._runtime.throw(self._dialect.spelled(f"service {self._name}: {error}"))
            return False
        return True

    def _submit(self, client: Caller_, request: _Request) -> None:
        """Make a request a call of the client; raises Error if it is invalid."""
        assert client.type is not None
        fields = given_fields(request.value, client.type.request, self._dialect)
        left = None
        if self.connectionTimeout:
            waited = time.monotonic() - request.made
            left = max(0.0, round(self.connectionTimeout / 1000 - waited, 2))
        call = client.call_async(fields, timeout=left, server_only=True)
        self._count()
        call.on_done(lambda ended: self._answered(request.done, ended), self._executor)

    def _answered(self, done: Done, call: Call) -> None:
        if not is_alive(self):
            return
        self._count()
        error = call.exception()
        if error is None:
            done(call.result())
        else:
            done(error if isinstance(error, Error) else Error(str(error)))

    def _give_up(self, request: _Request) -> None:
        """Fail a request that still has no client, or no type."""
        if not is_alive(self) or request not in self._early:
            return
        reason = self._problem or "is it running, and is its name right?"
        text = f"{self._name}: no server appeared within {self.connectionTimeout / 1000:g} s"
        self._early.remove(request)
        self._count()
        request.done(ServiceUnavailableError(f"{text}: {reason}"))

    def _fail_all(self, error: Error) -> None:
        if self._endpoint is not None:
            self._endpoint.end_calls(error)
        early, self._early = self._early, []
        self._count()
        for request in early:
            request.done(error)

    def _count(self) -> None:
        sent = 0 if self._endpoint is None else self._endpoint.pending
        report(self, pendingRequests=len(self._early) + sent)

    def shown(self, result: Message | Error) -> QJSValue:
        """Return the argument for a callback."""
        runtime = self._runtime
        if runtime is None:
            return QJSValue()
        if isinstance(result, Error):
            return runtime.value(False)
        if self._dialect is Dialect.ROS1 and not result.type.definition.fields:
            return runtime.value(True)
        return runtime.message(result, self._dialect)

    # The client.

    def _factory(self, node: Node) -> Callable[[], Caller_]:
        return lambda: node.create_service_client(self._name, self._type or None, self._qos)

    def _submit_waiting(self) -> None:
        client = self._endpoint
        while client is not None and client.type is not None and self._early:
            request = self._early.pop(0)
            try:
                self._submit(client, request)
            except Error as error:
                self._count()
                request.done(error)

    def _close_endpoint(self) -> None:
        # Closing the client, in the background, would end its calls with another reason.
        if self._endpoint is not None:
            self._endpoint.end_calls(Error(f"{self._name}: the node was shut down"))
        super()._close_endpoint()


#: Milliseconds that a call waits for a server; discovery of an existing one may take this long.
_CONNECTION_TIMEOUT_MS = 5000


class Service(QtCore.QObject):
    """Calls services without a client object."""

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._clients: dict[tuple[str, str], ServiceClient] = {}

    @Slot(str, str, result=QJSValue)
    @Slot(str, str, QJSValue, result=QJSValue)
    def call(self, service: str, type_name: str, request: QJSValue | None = None) -> QJSValue:
        """Call a service and return the response; the interface keeps running.

        Returns:
            The response; true if its type has no fields; false if the call failed, with the reason
            in the log.
        """
        runtime = self._runtime()
        answer: list[Message | Error] = []
        refused = False
        client = self._client(runtime, service, type_name)

        def begin(end: Callable[[], None]) -> None:
            def done(result: Message | Error) -> None:
                answer.append(result)
                end()

            nonlocal refused
            refused = not client.send(QJSValue() if request is None else request, done)
            if refused:
                end()

        caller = runtime.caller()
        if wait_for(runtime.session, begin):
            if refused and not answer:
                # An invalid request has thrown an error.
                return QJSValue()
            why = "" if runtime.session.is_initialized else f": {NOT_INITIALIZED}"
            result = answer[0] if answer else Error(f"{service} was not called to the end{why}")
        else:
            result = Error(
                f"{service} is called, but not waited for: {MOST_WAITING} calls wait already, for "
                "robots that do not answer; use Service.callAsync() where many may wait"
            )
        if isinstance(result, Error):
            log_from_qml("", logging.ERROR, f"Service.call: {result}", caller)
        return client.shown(result)

    @Slot(str, str)
    @Slot(str, str, QJSValue)
    @Slot(str, str, QJSValue, QJSValue)
    def callAsync(
        self,
        service: str,
        type_name: str,
        request: QJSValue | None = None,
        callback: QJSValue | None = None,
    ) -> None:
        """Call a service; `callback` is called with what :meth:`call` returns."""
        client = self._client(self._runtime(), service, type_name)
        client.sendRequestAsync(QJSValue() if request is None else request, callback)

    def _runtime(self) -> Runtime:
        return own_runtime(self)

    def _client(self, runtime: Runtime, service: str, type_name: str) -> ServiceClient:
        # Clients are kept: discovery may take longer than the call.
        key = (service, full_type(type_name, "srv"))
        client = self._clients.get(key)
        if client is None or not is_alive(client):
            client = self._clients[key] = ServiceClient(runtime, *key, Dialect.ROS1)
            client.setParent(self)
            client.setProperty("connectionTimeout", _CONNECTION_TIMEOUT_MS)
        return client


_GONE = "the interface that offered this service is gone"


class ServiceServer(Element):
    """Offers a service while it is enabled. See its page in ``docs/elements``.

    It has the members of qml6_ros2_plugin's, too: ``type``, ``processRequest`` and ``advertised``.
    """

    qosChanged = Signal()
    typeChanged = Signal()
    advertisedChanged = Signal()

    name = Writable(str, "")
    serviceType = Writable(str, "")
    type = Writable(str, read=lambda self: self.serviceType, write="_set_type")
    qos = Writable(QJSValue, read="_get_qos", write="_set_qos")
    handler = Writable(QJSValue, accept=function, then="")
    processRequest = Writable(QJSValue, accept=function, then="")
    enabled = Writable(bool, True)
    ready = ReadOnly(bool, False)
    advertised = ReadOnly(bool, read=lambda self: self.ready)

    _HOLDS = ("_handler", "_processRequest", "_answers", "_early", "_open")
    _endpoint: Server | None

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._answers: Answers | None = None
        #: Requests that arrived before the worker thread had returned the server.
        self._early: list[Callable[[], None]] = []
        #: The answers that processRequest owes, by the number of the request.
        self._open: dict[int, tuple[Future[Any], Callable[[QJSValue], Any]]] = {}
        self._number = 0
        self._profile = QoS.services()
        self.serviceTypeChanged.connect(self.typeChanged)  # type: ignore[attr-defined]
        self.readyChanged.connect(self.advertisedChanged)  # type: ignore[attr-defined]

    def configure(self, name: str, type_name: str, handler: QJSValue) -> None:
        """Set the arguments of ``Ros2.createServiceServer``."""
        self.name, self.serviceType, self.handler = name, type_name, handler

    def _set_type(self, name: str) -> None:
        self.serviceType = name

    def _get_qos(self) -> QJSValue:
        runtime = self._find_runtime()
        return runtime.qos(self._profile) if runtime is not None else QJSValue()

    def _set_qos(self, value: QJSValue | None) -> None:
        try:
            profile = qos_from_js(value, QoS.services())
        except ConversionError as error:
            self._refuse(f"{self.label}: {error}")
            return
        if profile != self._profile:
            self._profile = profile
            self.qosChanged.emit()
            self._schedule()

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"service {self.name}"

    def _wanted(self) -> tuple[Node, str, str, QoS] | None:
        node = self.node
        if node is None or not (self.enabled and self.name and self.serviceType):
            return None
        return node, self.name, full_type(self.serviceType, "srv"), self._profile

    def _factory(self, node: Node, name: str, type_name: str, qos: QoS) -> Callable[[], Server]:
        runtime, executor = self._find_runtime(), self._executor
        assert runtime is not None
        answers = self._answers = Answers(runtime, f"the handler of {self.label}")
        self._cleanup["answers"] = answers.give_up
        on_request = weak_callback(self._on_request, ServiceError(_GONE))
        # ROS 2 has no errors: a client would wait for ever.
        return lambda: node.create_service_server(
            name, type_name, on_request, qos, executor=executor, answers_failures=True
        )

    def _close_endpoint(self) -> None:
        # While the server exists, so that the clients of open requests are answered.
        if self._answers is not None:
            self._answers.give_up()
        super()._close_endpoint()

    def _on_created(self, endpoint: Server) -> None:
        self._set_problem(endpoint.problem)
        report(self, ready=True)
        early, self._early = self._early, []
        for answer in early:
            answer()

    def _on_closed(self, endpoint: Server | None) -> None:  # noqa: ARG002 - the base's signature
        self._answers, self._early = None, []
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

        value = runtime.message(request, self.DIALECT)
        if self.handler.isCallable() or not self.processRequest.isCallable():
            return answers.ask(self.handler, [value], take)
        return self._process(value, answers, take)

    def _process(self, request: QJSValue, answers: Answers, take: Callable[[QJSValue], Any]) -> Any:
        """Return the answer of processRequest: at once, or by sendResponse after undefined."""
        runtime, answered = self._runtime, answers.open()
        assert runtime is not None
        number = self._number = (self._number + 1) % 2**31
        self._open[number] = answered, take
        answered.add_done_callback(lambda _: self._open.pop(number, None))

        def settle(value: QJSValue) -> Any:
            return None if value.isUndefined() else _plain(value, take)

        try:
            answer = answers.ask(self.processRequest, [request, runtime.value(number)], settle)
        except Error as error:
            if not answered.done():
                answered.set_exception(error)
            return answered
        if isinstance(answer, Future):  # of a promise
            answer.add_done_callback(lambda done: pass_on(done, answered))
        elif answer is not None and not answered.done():
            answered.set_result(answer)
        return answered

    @Slot(int)
    @Slot(int, QJSValue)
    def sendResponse(self, id: int, response: QJSValue | None = None) -> None:
        """Answer a request for which processRequest returned undefined.

        A response that does not fit throws a JavaScript Error, and fails the request.

        Args:
            id: The second argument of processRequest.
            response: The response; without it, one with all defaults.
        """
        answered, take = self._open.pop(id, (None, None))
        if answered is None or take is None or answered.done():
            text = f"{self.label}: there is no open request {id}; it may have been answered already"
            log_from_qml("", logging.WARNING, text, self._caller())
            return
        try:
            answered.set_result(take(QJSValue() if response is None else response))
        except Error as error:
            answered.set_exception(error)
            if self._runtime is not None:
                self._runtime.throw(f"sendResponse of {self.label}: {error}")


def _plain(value: QJSValue, take: Callable[[QJSValue], Any]) -> Any:
    """Return the fields of a response; raises Error for all other values."""
    if not value.isObject():
        raise Error(f"processRequest returned {shown(value)!r}, which is not a response")
    return take(value)


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
