"""Offering ROS 2 services."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import Dispatcher, EndpointInfo, EndpointKind, LoopExecutor, QoS
from rosglass.comm.answering import AnsweringServer
from rosglass.errors import Error, NodeClosedError
from rosglass.ros2.announced import Announced, mismatches, nodes_of
from rosglass.ros2.core import Member
from rosglass.ros2.pacing import ReplyPacer
from rosglass.wires.base import RequestId

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rosglass.comm import Answer, Executor
    from rosglass.messages import Message, ServiceType
    from rosglass.ros2.core import Core

__all__ = ["Ros2ServiceServer"]

_log = logging.getLogger("rosglass.ros2")


class Ros2ServiceServer(AnsweringServer[RequestId], Member):
    """A service server; made by :meth:`Node.create_service_server`.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        type: The type, or its name.
        callback: Called with each request; see :meth:`Node.create_service_server`.
        qos: Profile of requests and replies; None for the usual one.
        executor: Where `callback` runs; None for the node's dispatcher, or for the running event
            loop when `callback` is a coroutine function.
    """

    _core: Core

    def __init__(
        self,
        core: Core,
        name: str,
        type: ServiceType | str,
        callback: Callable[[Message], Answer | Awaitable[Answer]],
        qos: QoS | None = None,
        executor: Executor | None = None,
    ) -> None:
        super().__init__(core, name, core.types.service(type), callback, executor)
        self.qos = qos or QoS.services()
        self._announced = Announced(core, core.types.service, self.type, fixed=True)
        self._warned = ""
        #: Requests that come before what answers them is there; None from then on.
        self._early: list[tuple[RequestId, bytes | memoryview]] | None = []
        kind, known = EndpointKind.SERVICE_SERVER, self._announced.hash
        self._replier = core.middleware.create_replier(
            EndpointInfo(kind, name, self.type.name, core.name, self.qos, known), self._on_request
        )
        # Others' executors may do anything.
        self._replier.quick = isinstance(self.executor, (Dispatcher, LoopExecutor))
        self._pacer = ReplyPacer(core.timers)
        core.add(self)
        with self._lock:
            early, self._early = self._early or [], None
        for request, data in early:
            self._on_request(request, data)
        core.wake()

    @property
    def problem(self) -> str:
        """Why some clients cannot be served, in words; empty when all is well."""
        if self._closed:
            return "the server is closed"
        graph = self._core.graph
        clients = graph.endpoints(EndpointKind.SERVICE_CLIENT, self.name)
        problems = mismatches(self._announced, clients, "calls", "it is not served")
        if not problems and self._replier.problem:
            problems.append(self._replier.problem)
        servers = graph.endpoints(EndpointKind.SERVICE_SERVER, self.name)
        others = [server for server in servers if server.node != self._core.name]
        if others:
            problems.append(
                f"{nodes_of(others)} offers {self.name}, too: clients get whichever answer comes "
                "first; end one of the two"
            )
        return "; ".join(problems)

    def serves(self, service: str, executor: Executor) -> bool:
        """Return whether it answers `service` on `executor`."""
        return service == self.name and executor is self.executor

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - the graph alone matters
        """Follow a change of the graph: log what is wrong, once."""
        if not moved or self._closed:
            return
        problem = self.problem
        if problem and problem != self._warned:
            _log.warning("%s: %s", self.name, problem)
        self._warned = problem

    def _withdraw(self) -> None:
        self._pacer.flush()
        self._replier.close()
        self._core.remove(self)

    # -- answering -------------------------------------------------------------------------------

    def _on_request(self, request: RequestId, data: bytes | memoryview) -> None:
        with self._lock:
            if self._early is not None:
                # The buffer is the middleware's, and ends with this call.
                self._early.append((request, bytes(data)))
                return
        self._pacer.on_request(request.client)
        try:
            self._take(request, data)
        except Exception as error:  # its executor may raise
            self._failed(request, error)

    def _decode(self, data: bytes | memoryview) -> Message:
        kind = self.type.request
        if kind.fields:
            kind.validate(data)
        return kind.decode(data)

    def _respond(self, request: RequestId, answer: Any) -> None:
        kind = self.type.response
        try:
            data = kind.encode(answer)
        except Error as error:
            _log.error(
                "%s: the callback's response to %s does not fit: %s; %s",
                self.name,
                self._origin(request),
                error,
                self._consequence,
            )
            self._fail(request, f"the server made no valid response: {error}")
            return
        if self._pacer.on_reply(request.client):
            self._reply(request, data)
        else:
            self._pacer.send_later(request.client, lambda: self._reply(request, data))

    def _reply(self, request: RequestId, data: bytes) -> None:
        try:
            self._replier.reply(request, data)
        except NodeClosedError:
            pass  # closed meanwhile
        except Error as error:
            _log.error("%s: cannot answer %s: %s", self.name, self._origin(request), error)

    def _fail(self, request: RequestId, reason: str) -> None:
        self._pacer.on_failure(request.client)
        self._replier.fail(request, reason)

    @property
    def _consequence(self) -> str:
        """What a client gets instead of a response, for people."""
        told = self._replier.tells_failures
        return "it is told the error instead" if told else "it gets no response, and waits"

    def _failed(self, request: RequestId, error: Exception) -> None:
        # Our own errors say where and why, as those of handlers in QML do.
        reason = f": {error}" if isinstance(error, Error) else ""
        _log.error(
            "%s: the callback failed on a request of %s; %s%s",
            self.name,
            self._origin(request),
            self._consequence,
            reason,
            exc_info=None if reason else error,
        )
        self._fail(request, f"{type(error).__name__}: {error}")

    def _refuse(self, request: RequestId, reason: str) -> None:
        """Turn a client's fault down, and name it in the log once."""
        if self._complaints.fresh(request.client):
            who = self._origin(request)
            _log.warning("%s: refusing requests of %s: %s", self.name, who, reason)
        self._fail(request, reason)

    def _origin(self, request: RequestId) -> str:
        """Return who sent a request, for people."""
        clients = self._core.graph.endpoints(EndpointKind.SERVICE_CLIENT, self.name)
        known = [client for client in clients if client.gid and client.gid == request.client]
        if known or len(clients) == 1:
            return nodes_of(known or clients)
        return f"client {request.client.hex()}"
