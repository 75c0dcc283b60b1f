"""A service server's way from a request to its answer: by a callback, a coroutine or a future."""

from __future__ import annotations

import inspect
import threading
from abc import abstractmethod
from concurrent.futures import CancelledError, Future
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rosglass.comm.complaints import Complaints
from rosglass.comm.loop import LoopExecutor, executor_for
from rosglass.comm.service import ServiceServer
from rosglass.errors import DecodeError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rosglass.comm.core import NodeCore
    from rosglass.comm.node import Answer, Executor
    from rosglass.messages import Message, ServiceType

__all__ = ["AnsweringServer"]

_Request = TypeVar("_Request")
#: Requests that wait for the callback; more come only from a client gone wild.
_MAX_WAITING = 1000


class AnsweringServer(ServiceServer, Generic[_Request]):
    """A server that answers requests; the world brings them and sends what comes of them.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        type: The type.
        callback: Called with each request; see :meth:`Node.create_service_server`.
        executor: Where `callback` runs; None for the node's dispatcher, or for the running event
            loop when `callback` is a coroutine function.

    Attributes:
        executor: Where the callback runs.
    """

    _core: NodeCore[Any]

    def __init__(
        self,
        core: NodeCore[Any],
        name: str,
        type: ServiceType,
        callback: Callable[[Message], Answer | Awaitable[Answer]],
        executor: Executor | None,
    ) -> None:
        self._core, self.name, self.type = core, name, type
        self.executor = executor_for(callback, executor, core.dispatcher, name)
        self._callback = callback
        self._lock = threading.Lock()
        self._closed = False
        self._waiting = 0
        self._running: set[Future[Any]] = set()
        self._complaints = Complaints()

    # -- what the world adds ---------------------------------------------------------------------

    @abstractmethod
    def _decode(self, data: bytes | memoryview) -> Message:
        """Return a request's message; raises DecodeError."""

    @abstractmethod
    def _respond(self, request: _Request, answer: Any) -> None:
        """Send what the callback answers."""

    @abstractmethod
    def _failed(self, request: _Request, error: Exception) -> None:
        """Log that the callback failed, and tell the client where the world can."""

    @abstractmethod
    def _refuse(self, request: _Request, reason: str) -> None:
        """Turn a client's fault down, and name it in the log once."""

    @abstractmethod
    def _withdraw(self) -> None:
        """Take the service out of the graph."""

    def _given_up(self, request: _Request) -> bool:  # noqa: ARG002 - most worlds cannot know
        """Return whether nobody waits for the answer any more."""
        return False

    # -- answering -------------------------------------------------------------------------------

    def _take(self, request: _Request, data: bytes | memoryview) -> None:
        """Let the callback have a request; raises what its executor does."""
        with self._lock:
            if self._closed:
                return
            full = self._waiting >= _MAX_WAITING
            if not full:
                self._waiting += 1
        if full:
            self._refuse(request, f"{_MAX_WAITING} requests wait for the callback already")
            return
        try:
            self.executor.post(lambda: self._serve(request, data))
        except Exception:
            with self._lock:
                self._waiting -= 1
            raise

    def _serve(self, request: _Request, data: bytes | memoryview) -> None:
        with self._lock:
            self._waiting -= 1
            if self._closed:
                return
        if self._given_up(request):
            return
        try:
            message = self._decode(data)
        except DecodeError as error:
            self._refuse(request, f"the request is no {self.type.request.name}: {error}")
            return
        try:
            answer = self._callback(message)
        except Exception as error:
            self._failed(request, error)
            return
        if inspect.iscoroutine(answer):
            if not isinstance(self.executor, LoopExecutor):
                answer.close()
                self._failed(request, TypeError("the callback must be an async def to be awaited"))
                return
            answer = self.executor.run(answer)
            with self._lock:
                self._running.add(answer)
        if isinstance(answer, Future):
            answer.add_done_callback(lambda future: self._finish(request, future))
        else:
            self._respond(request, answer)

    def _finish(self, request: _Request, future: Future[Any]) -> None:
        """Answer a request whose response was promised."""
        with self._lock:
            self._running.discard(future)
        if self._closed:
            return
        try:
            answer = future.result(0)
        except CancelledError:
            self._refuse(request, "the callback's future was cancelled")
        except Exception as error:
            self._failed(request, error)
        else:
            self._respond(request, answer)

    def close(self) -> None:
        """Withdraw the service; requests without response end unanswered. Safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            running, self._running = self._running, set()
        if self._core.forked:
            return
        self._withdraw()
        for future in running:
            future.cancel()
