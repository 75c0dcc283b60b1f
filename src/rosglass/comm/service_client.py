"""Service clients and their pending calls."""

from __future__ import annotations

import itertools
import logging
import math
import threading
import time
from abc import ABC, abstractmethod
from collections import OrderedDict
from typing import TYPE_CHECKING, Any

from rosglass.comm.client import Client, copy_value
from rosglass.comm.handle import check_may_wait, guarded, undo_on_error
from rosglass.comm.promise import check_timeout
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.service_server import decode_checked, served_by_this_thread
from rosglass.comm.wire import CALL_DROPPED, SERVER_LEFT, Call, PendingCall, encode_request
from rosglass.errors import (
    ConnectionLostError,
    DecodeError,
    Error,
    NodeClosedError,
    ServiceError,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from concurrent.futures import Future

    from rosglass.comm.core import NodeCore
    from rosglass.comm.qos import QoS
    from rosglass.messages import Message, ServiceType

__all__ = ["PendingCalls", "ServiceClient", "ServiceRequester"]

_log = logging.getLogger("rosglass.comm")
#: Seconds that a server may be missing before its calls end: restarting a router of Zenoh hides
#: all nodes for one or two.
_GRACE_S = 3.0


class PendingCalls:
    """The calls of a client that have not ended, in their order; the only table of them.

    A request waits in it until the requester takes it to send it. From any thread.

    Attributes:
        waiting: The number of requests that wait.
    """

    def __init__(self) -> None:
        #: Guards the calls and their flags `waiting`.
        self._lock = threading.Lock()
        # Not a dict, whose first item is searched for behind all those that were removed.
        self._calls: OrderedDict[Future[Message], PendingCall] = OrderedDict()
        self.waiting = 0

    def __len__(self) -> int:
        return len(self._calls)

    def __iter__(self) -> Iterator[PendingCall]:
        with self._lock:
            return iter(tuple(self._calls.values()))

    def get(self, call: Call) -> PendingCall | None:
        """Return a call; None if it has ended."""
        return self._calls.get(call)

    def add(self, pending: PendingCall) -> None:
        """Add a new call, whose request does not wait yet."""
        with self._lock:
            self._calls[pending.call] = pending

    def enqueue(self, pending: PendingCall) -> None:
        """Queue a request for sending, in the order of the calls, unless its call has ended."""
        with self._lock:
            if pending.call in self._calls and not pending.waiting:
                pending.waiting = True
                self.waiting += 1

    def remove(self, call: Future[Message]) -> PendingCall | None:
        """Remove and return a call that has ended; None if it was removed before."""
        with self._lock:
            pending = self._calls.pop(call, None)
            if pending is not None and pending.waiting:
                self.waiting -= 1
                pending.waiting = False
        return pending

    def first(self) -> PendingCall | None:
        """Return the first request that waits; None if there is none."""
        if self.waiting:
            with self._lock:
                for pending in self._calls.values():
                    if pending.waiting:
                        return pending
        return None

    def take(self, pending: PendingCall) -> bool:
        """Stop a request's wait, to send or to withdraw it; return whether it was waiting."""
        with self._lock:
            waited, pending.waiting = pending.waiting, False
            self.waiting -= waited
        return waited


class ServiceRequester(ABC):
    """Finds a service's servers and sends them a client's requests by the wire's protocol.

    It sends each request as soon as a server is available, in the order of the calls, and reports
    its outcome. The client handles timeouts.

    Attributes:
        type: The service type; None while it is not discovered yet.
        waiters: One item per thread that waits for a server; set by the client.
        max_request: Largest size of a request in bytes; None for no limit.
        warn_level: Level at which the client logs conflicts; None if its owner logs them.
    """

    type: ServiceType | None
    waiters: Sequence[None] = ()
    max_request: int | None = None
    warn_level: int | None = logging.WARNING

    @abstractmethod
    def ready(self) -> bool:
        """Return whether a compatible server is available."""

    @abstractmethod
    def server_conflicts(self) -> list[str]:
        """Return the problems that the user has to fix, in words."""

    @abstractmethod
    def unavailable_reason(self) -> str:
        """Return why no server is available, if there are no conflicts."""

    @abstractmethod
    def server_name(self) -> str:
        """Return the server's name for error messages."""

    @abstractmethod
    def send(self, pending: PendingCall) -> None:
        """Send a request as soon as a server is available; from any thread, without waiting.

        Sets :attr:`PendingCall.sent` when the request is sent.
        """

    @abstractmethod
    def forget(self, pending: PendingCall) -> None:
        """Drop a call that has ended, and ignore its response; from any thread."""

    def has_left(self, pending: PendingCall) -> bool:  # noqa: ARG002 - for those that know
        """Return whether the servers that a request was sent to are known to have left."""
        return False

    @abstractmethod
    def delay(self, pending: PendingCall) -> str:
        """Return why a request was not sent although a server is available."""

    @abstractmethod
    def find_server(self) -> None:
        """Search for a server now, because a thread waits for one; from any thread."""

    @abstractmethod
    def follow(self, moved: bool, idle: bool) -> None:
        """Follow the graph: the type, the servers, and calls whose server has left."""

    @abstractmethod
    def close(self) -> None:
        """Close the connections to servers; safe to call twice."""


@hint_at_members
class ServiceClient(Client):
    """Calls a service; created by :meth:`Node.create_service_client`.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        qos: The quality of service of requests and replies.
        create_requester: Creates the requester, given the pending calls and a callback for when a
            server may have appeared or left.

    Attributes:
        name: Absolute service name.
        qos: The quality of service of requests and replies.
    """

    def __init__(
        self,
        core: NodeCore,
        name: str,
        qos: QoS,
        create_requester: Callable[[PendingCalls, Callable[[], None]], ServiceRequester],
    ) -> None:
        super().__init__(core, name)
        self.qos = qos
        self._numbers = itertools.count(1)
        self._processing = guarded(_log, "%s: processing a response failed", name)
        #: Every use is atomic.
        self._waiters: list[None] = []
        self._calls = PendingCalls()
        #: Monotonic time at which a server was last available.
        self._ready_at = -math.inf
        self._requester = create_requester(self._calls, self._on_change)
        self._requester.waiters = self._waiters
        core.add(self, self._follow)

    def __repr__(self) -> str:
        kind = self.type.name if self.type is not None else "type not known yet"
        return f"<{type(self).__name__} {self.name} [{kind}]>"

    # -- the server ------------------------------------------------------------------------------

    @property
    def type(self) -> ServiceType | None:
        """The service type; None while it is not discovered yet."""
        return self._requester.type

    def _is_ready(self) -> bool:
        return not self._closed and self._requester.ready()

    def _server_conflicts(self) -> list[str]:
        return self._requester.server_conflicts()

    def _unavailable_reason(self) -> str:
        return self._requester.unavailable_reason()

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` seconds (None: forever) for a server; return whether there is one.

        Raises:
            NodeClosedError: The client is closed, or is closed during the wait.
        """
        self._waiters.append(None)
        try:
            if not self.ready:
                self._requester.find_server()
            return super().wait_for_server(timeout)
        finally:
            self._waiters.pop()

    def _on_change(self) -> None:
        """Log conflicts and report changes of :attr:`ready`; by one thread only."""
        if self._requester.warn_level is not None:
            self._log_conflicts(_log, self._requester.warn_level)
        self._readiness.update()

    def _follow(self, moved: bool, idle: bool) -> None:
        if self._closed:
            return
        self._requester.follow(moved, idle)
        now = time.monotonic()
        if self._is_ready():
            self._ready_at = now
        for pending in self._calls:
            if pending.lost_at is not None:
                if now - pending.lost_at >= _GRACE_S:
                    pending.call.set_exception(self._loss_error(pending))
            elif pending.deadline is not None and now >= pending.deadline:
                self._expire(pending)

    # -- calling ---------------------------------------------------------------------------------

    @property
    def pending(self) -> int:
        """The number of calls that have not ended."""
        return len(self._calls)

    def call(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Message:
        """Call the service and wait for its response.

        Also allowed in callbacks, unless the server needs their thread. Use :meth:`call_async` on
        threads that must not block, such as a user interface's.

        Args:
            request: A message or a dict of fields; missing fields, and None, get the defaults.
            timeout: Total seconds to wait for a server and its response; None for no limit.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent.
            ServiceUnavailableError: No server appeared in time; nothing was sent.
            TimeoutError: The server did not answer in time; it may still carry out the request.
            ServiceError: The server reports a failure, or its response cannot be decoded.
            ConnectionLostError: The server left before it answered.
            UnsupportedError: The calling thread is needed for the answer.
            NodeClosedError: The client is closed, or is closed during the call.
        """
        if served_by_this_thread(self._core, self.name):
            raise UnsupportedError(
                f"{self.name}: this callback would wait for itself: the server runs on the same "
                "thread of this node; use call_async() here, or give the server an executor "
                "of its own"
            )
        check_may_wait(self.name)
        timeout = check_timeout(timeout, self.name)
        pending = self._enter(request, timeout, private=True)
        with undo_on_error(pending.call.cancel):
            self._requester.send(pending)
            if timeout is not None:
                try:
                    return pending.call.result(timeout)
                except TimeoutError:
                    # Raised by the call, or by the wait for it; in the latter case it ends here.
                    self._expire(pending)
            return pending.call.result()

    def call_async(
        self,
        request: Message | dict[str, Any] | None = None,
        /,
        *,
        timeout: float | None = 10.0,
        server_only: bool = False,
    ) -> Call:
        """Call the service without waiting; return the promise of the response.

        A request is sent as soon as a server is available, in the order of the calls. In ROS 1 the
        order holds for persistent clients only: otherwise each call has its own connection, and
        calls run in parallel.

        Arguments and errors as in :meth:`call`. A ConversionError is raised immediately, unless the
        type is not known yet.

        Args:
            request: As in :meth:`call`.
            timeout: As in :meth:`call`.
            server_only: True to wait for the response without limit while there is a server: after
                `timeout`, the call only ends if none is available, or none has been for 3 s.
        """
        timeout = check_timeout(timeout, self.name)
        pending = self._enter(request, timeout, private=False, server_only=server_only)
        self._requester.send(pending)
        return pending.call

    def _enter(
        self, value: Any, timeout: float | None, *, private: bool, server_only: bool = False
    ) -> PendingCall:
        """Register and return a new pending call; raises ConversionError."""
        self._check_open()
        now = time.monotonic()
        kind, max_size = self.type, self._requester.max_request
        # Encoded or copied now: the caller may change it while the call waits for a server.
        taken = (
            copy_value(value, self.name) if kind is None else encode_request(kind, value, max_size)
        )
        call = Call(
            f"{self.name} has not answered, and the call continues: no response",
            self._core.dispatcher,
            cancellable=True,
        )
        pending = PendingCall(
            number=next(self._numbers),
            call=call,
            on_reply=self._on_reply,
            value=taken,
            type=kind,
            max_size=max_size,
            made=now,
            deadline=None if timeout is None else now + timeout,
            server_only=server_only,
            private=private,
        )
        if timeout is not None and not private:
            pending.timer = self._core.timers.after(timeout, lambda: self._expire(pending))
        self._calls.add(pending)
        if self._closed:  # by another thread, which may have missed this call
            self._on_end(call)
            self._check_open()
        # Not a function with the pending call, which would leave a cycle to the garbage collector.
        call.add_done_callback(self._on_end)
        return pending

    def _withdraw(self, call: Call) -> bool:
        """Cancel a call whose request was not sent yet; return whether that was possible."""
        pending = self._calls.get(call)
        return pending is not None and self._calls.take(pending) and call.cancel()

    # -- the end of a call -----------------------------------------------------------------------

    def _on_end(self, call: Future[Message]) -> None:
        """Clean up after a call, on any thread."""
        pending = self._calls.remove(call)
        if pending is None:
            return
        if pending.timer is not None:
            pending.timer.close()
        self._requester.forget(pending)

    def _expire(self, pending: PendingCall) -> None:
        """End a call whose deadline has passed."""
        now = time.monotonic()
        if pending.call.done() or (
            pending.server_only and (self._is_ready() or now - self._ready_at < _GRACE_S)
        ):
            return
        timeout = 0.0 if pending.deadline is None else pending.deadline - pending.made
        error: Error
        if pending.sent is None:
            error = ServiceUnavailableError(
                f"{self.name} could not be called within {timeout:g} s: "
                f"{self.problem or self._requester.delay(pending)}; nothing was sent"
            )
        else:
            since = now - pending.sent
            error = TimeoutError(
                f"{self.name} did not answer within {timeout:g} s: "
                f"{self._requester.server_name()} was sent the request {since:.1f} s ago, and may "
                "still carry it out"
            )
        pending.call.set_exception(error)

    def _on_reply(
        self, pending: PendingCall, data: bytes | memoryview | None, error: str | Error
    ) -> None:
        """End a call with its response or its error; called on a receiving thread."""
        if pending.call.done():
            return
        pending.answered = True
        with self._processing:
            if data is not None:
                self._complete(pending, data)
            elif isinstance(error, Error):
                pending.call.set_exception(error)
            elif error in (SERVER_LEFT, CALL_DROPPED) or self._requester.has_left(pending):
                pending.call.set_exception(self._loss_error(pending))
            else:
                reason = error or "there is no response"
                pending.call.set_exception(
                    ServiceError(f"the call of {self.name} failed: {reason}")
                )

    def _complete(self, pending: PendingCall, data: bytes | memoryview) -> None:
        assert pending.type is not None  # it was sent
        kind = pending.type.response
        try:
            message = decode_checked(kind, data)
        except DecodeError as problem:
            invalid = ServiceError(
                f"{self._requester.server_name()} answered the call of {self.name} with bytes that "
                f"are not a {kind.name}: {problem}; it was probably built from another definition "
                "of the type: add that to the library"
            )
            invalid.__cause__ = problem
            pending.call.set_exception(invalid)
        else:
            pending.call.set_result(message)

    def _loss_error(self, pending: PendingCall) -> ConnectionLostError:
        since = time.monotonic() - (pending.sent or time.monotonic())
        return ConnectionLostError(
            f"the server of {self.name} went away before it answered the request sent {since:.1f} "
            f"s ago, and may have carried it out or not; check that, and call again "
            f"({self._core.url}: {self._core.status()})"
        )

    def end_calls(self, error: Error) -> None:
        """End all pending calls with an error; servers are not notified."""
        for each in self._calls:
            each.call.set_exception(error)

    def close(self) -> None:
        """Close the client; pending calls end with NodeClosedError. Safe to call twice."""
        if self._closed:
            return
        self._closed = True
        if self._core.forked:
            return
        self.end_calls(NodeClosedError(f"the client of {self.name} was closed during a call"))
        self._requester.close()
        self._readiness.close()
        self._core.remove(self)
