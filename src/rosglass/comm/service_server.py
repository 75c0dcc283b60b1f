"""Service servers, which answer requests with a callback, a coroutine or a future."""

from __future__ import annotations

import inspect
import logging
import threading
from collections import deque
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, TypeAlias

from rosglass.comm.executor import Dispatcher, LoopExecutor, executor_for
from rosglass.comm.graph import EndpointKind
from rosglass.comm.handle import Handle, reraise_exit
from rosglass.comm.log_limits import LogOnce
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.errors import DecodeError, Error, NodeClosedError, ServiceError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine

    from rosglass.comm.core import NodeCore
    from rosglass.comm.handle import Executor
    from rosglass.comm.qos import QoS
    from rosglass.comm.wire import OnRequest, Replier, RequestId
    from rosglass.messages import Message, MessageType, ServiceType

__all__ = ["Answer", "ServiceServer", "decode_checked", "served_by_this_thread"]

_log = logging.getLogger("rosglass.comm")
#: The answer to a request: a response, or a future of one.
Answer: TypeAlias = (
    "Message | dict[str, Any] | Future[Message] | Future[dict[str, Any] | None] | None"
)
#: Maximum number of requests that wait for the callback; more are refused.
_MAX_WAITING = 1000


@hint_at_members
class ServiceServer(Handle):
    """Offers a service; created by :meth:`Node.create_service_server`.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        type: The service type.
        callback: Called with each request; see :meth:`Node.create_service_server`.
        qos: The quality of service of requests and replies.
        executor: Runs `callback`; None for the node's dispatcher, or for the running event loop if
            `callback` is a coroutine function.
        create_replier: Announces the service; called with the handler of its requests, and whether
            that handler only passes them to another thread (:attr:`Replier.quick`).
        answers_failures: See :meth:`Node.create_service_server`.

    Attributes:
        name: Absolute service name.
        type: The service type.
        qos: The quality of service of requests and replies.
    """

    def __init__(
        self,
        core: NodeCore,
        name: str,
        type: ServiceType,
        callback: Callable[[Message], Answer | Awaitable[Answer]],
        qos: QoS,
        executor: Executor | None,
        create_replier: Callable[[OnRequest, bool], Replier],
        *,
        answers_failures: bool = False,
    ) -> None:
        self._core, self.name, self.type, self.qos = core, name, type, qos
        self._executor = executor_for(callback, executor, core.dispatcher, name)
        self._callback = callback
        #: Guards the members below, to which nothing may be added after closing.
        self._lock = threading.Lock()
        self._closed = False
        self._waiting = 0
        self._running: set[Future[Any]] = set()
        self._log_once = LogOnce()
        #: The response to a request that failed, where the wire cannot report that.
        self._instead = type.response.encode(None) if answers_failures else None
        #: Requests received before the replier is set; None from then on.
        self._early: deque[tuple[RequestId, bytes]] | None = deque()
        # Other executors may block.
        quick = isinstance(self._executor, (Dispatcher, LoopExecutor))
        self._replier = create_replier(self._on_request, quick)
        core.servers.add(self)
        core.add(self)
        self._post_early()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} [{self.type.name}]>"

    @property
    def problem(self) -> str:
        """Why some clients cannot be served, in words; empty if there is no problem."""
        return "the server is closed" if self._closed else self._replier.problem

    def close(self) -> None:
        """Withdraw the service; pending requests stay unanswered. Safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            running, self._running = self._running, set()
        if self._core.forked:
            return
        self._replier.close()
        self._core.servers.discard(self)
        self._core.remove(self)
        for future in running:
            future.cancel()

    # -- from a request to its response ----------------------------------------------------------

    def _on_request(self, request: RequestId, data: bytes | memoryview) -> None:
        """Pass a request to the callback's executor."""
        with self._lock:
            if self._closed:
                return
            if self._early is not None:
                # Copied: the wire's buffer is valid during this call only.
                self._early.append((request, bytes(data)))
                return
        self._post(request, data)

    def _post_early(self) -> None:
        """Pass on the early requests; later ones wait behind them until this is done."""
        while True:
            with self._lock:
                if not self._early:
                    self._early = None
                    return
                request, data = self._early.popleft()
            self._post(request, data)

    def _post(self, request: RequestId, data: bytes | memoryview) -> None:
        with self._lock:
            full = self._waiting >= _MAX_WAITING
            if not full:
                self._waiting += 1
        if full:
            self._refuse(request, f"{_MAX_WAITING} requests are waiting for the callback")
            return
        try:
            self._executor.post(lambda: self._serve(request, data))
        except Exception as error:  # noqa: BLE001 - a user's executor
            with self._lock:
                self._waiting -= 1
            self._on_failure(request, error)

    def _serve(self, request: RequestId, data: bytes | memoryview) -> None:
        with self._lock:
            self._waiting -= 1
            if self._closed:
                return
        if self._replier.abandoned(request):
            return
        try:
            message = decode_checked(self.type.request, data)
        except DecodeError as error:
            self._refuse(request, f"the request is not a {self.type.request.name}: {error}")
            return
        self._answer(request, lambda: self._callback(message))

    def _answer(self, request: RequestId, call: Callable[[], Any]) -> None:
        """Respond with the result of a call, now or when its future is done, or with its error."""
        try:
            answer = call()
            if inspect.iscoroutine(answer):
                answer = self._start(answer)
            if isinstance(answer, Future):
                answer.add_done_callback(lambda future: self._finish(request, future))
            else:
                self._respond(request, answer)
        except (Exception, SystemExit) as error:  # noqa: BLE001 - the client waits for an answer
            self._on_failure(request, error)
            reraise_exit(error)

    def _start(self, coroutine: Coroutine[Any, Any, Any]) -> Future[Any]:
        """Start a callback's coroutine."""
        if not isinstance(self._executor, LoopExecutor):
            coroutine.close()
            raise TypeError("the callback must be an async def to be awaited")
        answer = self._executor.run(coroutine)
        with self._lock:
            closed = self._closed
            self._running.add(answer)
        if closed:  # by another thread, after this one checked
            answer.cancel()
        return answer

    def _finish(self, request: RequestId, future: Future[Any]) -> None:
        """Answer a request whose callback returned a future."""
        with self._lock:
            self._running.discard(future)
        if self._closed:
            return
        if future.cancelled():
            self._refuse(request, "the callback's future was cancelled")
            return
        self._answer(request, lambda: future.result(0))

    def _respond(self, request: RequestId, answer: Any) -> None:
        """Send the callback's response."""
        try:
            data = self.type.response.encode(answer)
            most = self._replier.max_reply
            if most is not None and len(data) > most:
                raise ServiceError(f"it has {len(data)} bytes, and clients accept at most {most}")
        except Error as error:
            _log.error(
                "%s: the callback's response to %s does not fit: %s; %s",
                self.name,
                self._replier.client_name(request),
                error,
                self._failure_effect,
            )
            self._fail(request, f"the server returned no valid response: {error}")
            return
        try:
            self._replier.reply(request, data)
        except NodeClosedError:
            pass  # closed by another thread
        except Error as error:
            client = self._replier.client_name(request)
            _log.error("%s: cannot answer %s: %s", self.name, client, error)

    # -- failures --------------------------------------------------------------------------------

    @property
    def _failure_effect(self) -> str:
        """The effect of a failure on the client, for log lines."""
        if self._replier.reports_failures:
            return "it receives the error instead"
        if self._instead is not None:
            return "it gets a response with all defaults, as ROS 2 has no errors"
        return "it gets no response, and waits"

    def _on_failure(self, request: RequestId, error: BaseException) -> None:
        """Log that the callback failed, and report it to the client if the wire can."""
        client = self._replier.client_name(request)
        if isinstance(error, ServiceError) and self._replier.has_refusals:
            # Raised deliberately, like rospy's ServiceException: not a failure of the server.
            _log.info("%s: the request of %s is refused: %s", self.name, client, error)
        else:
            # Our own errors need no traceback.
            reason = f": {error}" if isinstance(error, Error) else ""
            _log.error(
                "%s: the callback failed on a request of %s; %s%s",
                self.name,
                client,
                self._failure_effect,
                reason,
                exc_info=None if reason else error,
            )
        self._fail(request, self._replier.describe_failure(error))

    def _refuse(self, request: RequestId, reason: str) -> None:
        """Refuse an invalid request, and log that once per client."""
        if self._log_once.is_first(request.client):
            client = self._replier.client_name(request)
            _log.warning("%s: refusing requests of %s: %s", self.name, client, reason)
        self._fail(request, reason)

    def _fail(self, request: RequestId, reason: str) -> None:
        """Report a failure to the client; ignored once the server is closed by another thread."""
        try:
            self._replier.fail(request, reason, self._instead)
        except NodeClosedError:
            pass
        except Error as error:
            client = self._replier.client_name(request)
            _log.error("%s: cannot answer %s: %s", self.name, client, error)


def decode_checked(kind: MessageType, data: bytes | memoryview) -> Message:
    """Return the request or response in `data`; raises DecodeError if it is invalid."""
    # Each ROS 2 implementation pads empty messages with a different number of bytes.
    if kind.fields or kind.wire == "ros1":
        kind.validate(data)
    return kind.decode(data)


def served_by_this_thread(core: NodeCore, name: str) -> bool:
    """Return whether a service's only server runs on the calling thread."""
    for server in list(core.servers):
        if not isinstance(server, ServiceServer) or server.name != name:
            continue
        executor = server._executor
        if isinstance(executor, (Dispatcher, LoopExecutor)) and executor.is_current:
            found = core.graph.endpoints(EndpointKind.SERVICE_SERVER, name)
            return all(other.node == core.name for other in found)
    return False
