"""Calling a service: from the request to its response, whoever carries them."""

from __future__ import annotations

import threading
import time
from abc import abstractmethod
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rosglass.comm.client import Client
from rosglass.comm.promise import check_timeout
from rosglass.comm.receiving import check_may_wait
from rosglass.comm.service import Call, ServiceClient
from rosglass.errors import (
    DecodeError,
    Error,
    NodeClosedError,
    ServiceError,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)

if TYPE_CHECKING:
    from rosglass.comm.core import NodeCore
    from rosglass.comm.node import Handle
    from rosglass.messages import Message, MessageType, ServiceType

__all__ = ["CallRequest", "CallingClient"]


@dataclass(eq=False, kw_only=True)
class CallRequest:
    """A call's request.

    Attributes:
        call: What the caller holds.
        value: The encoded request, or the value to encode while the type is not known.
        type: The type it is encoded for.
        timer: Ends the call when its time is over.
        sent: Monotonic time of sending, None before.
        private: Whether nobody else has the call, so that its end calls nobody.
    """

    call: Call
    value: Any
    type: ServiceType | None
    timer: Handle | None = None
    sent: float | None = None
    private: bool = False

    def encode(self, kind: ServiceType) -> bytes:
        """Return its bytes for a type that may have been found only after the call.

        Raises:
            ConversionError: A value does not fit its field.
        """
        if self.type is not kind:
            value = self.value
            if self.type is not None:
                value = self.type.request.decode(value).to_dict()
            self.value, self.type = self.encoded(kind, value), kind
        return bytes(self.value)

    @staticmethod
    def encoded(kind: ServiceType, value: Any) -> bytes:
        """Return the bytes of a request's value; raises ConversionError."""
        return kind.request.encode(value)


_Request = TypeVar("_Request", bound=CallRequest)


class CallingClient(Client, ServiceClient, Generic[_Request]):
    """A service client; the world carries the requests that wait in its queue.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
    """

    def __init__(self, core: NodeCore[Any], name: str) -> None:
        super().__init__(core, name)
        self._lock = threading.Lock()
        self._requests: dict[Call, _Request] = {}
        #: Calls that wait; changed with the lock.
        self._queue: deque[_Request] = deque()

    # -- what the world adds ---------------------------------------------------------------------

    @abstractmethod
    def _answered_here(self) -> bool:
        """Return whether only the thread that asks can answer."""

    @abstractmethod
    def _encode(self, value: Any) -> tuple[ServiceType | None, Any]:
        """Return the type, and a request's bytes, or its copy while the type is not known."""

    @abstractmethod
    def _request(
        self, call: Call, value: Any, kind: ServiceType | None, timeout: float | None
    ) -> _Request:
        """Return the request of a new call; the lock is held."""

    @abstractmethod
    def _begin(self, request: _Request) -> None:
        """Send what waits in the queue as soon as that is possible."""

    @abstractmethod
    def _ended(self, request: _Request) -> None:
        """Clean up after a call; in any thread."""

    @abstractmethod
    def _delay(self, request: _Request) -> str:
        """Say why a request was not sent although all is well."""

    @abstractmethod
    def _server_name(self) -> str:
        """Return who has the service, for people."""

    @abstractmethod
    def _decode(self, kind: MessageType, data: bytes | memoryview) -> Message:
        """Return a response's message; raises DecodeError."""

    @abstractmethod
    def _withdraw(self) -> None:
        """Close what leads to the servers."""

    # -- calling ---------------------------------------------------------------------------------

    @property
    def pending(self) -> int:
        """Calls that have not ended."""
        return len(self._requests)

    def call(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Message:
        """Call and wait; see :meth:`rosglass.comm.ServiceClient.call`."""
        if self._answered_here():
            raise UnsupportedError(
                f"{self.name}: this callback would wait for itself: the server runs on the same "
                "thread of this node; take call_async() here, or give the server an executor "
                "of its own"
            )
        check_may_wait(self.name)
        timeout = check_timeout(timeout, self.name)
        entry = self._enter(request, timeout)
        entry.private = True
        try:
            self._begin(entry)
            if timeout is not None:
                try:
                    return entry.call.result(timeout)
                except TimeoutError:
                    # Either the call's own end, or that of the waiting: then this is its end.
                    self._expire(entry, timeout)
            return entry.call.result()
        except BaseException:
            entry.call.cancel()  # Ctrl-C: nobody waits for the response any more
            raise

    def call_async(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Call:
        """Call and return at once; see :meth:`rosglass.comm.ServiceClient.call_async`."""
        timeout = check_timeout(timeout, self.name)
        entry = self._enter(request, timeout)
        if timeout is not None:
            entry.timer = self._core.timers.after(timeout, lambda: self._expire(entry, timeout))
        self._begin(entry)
        return entry.call

    def _enter(self, value: Any, timeout: float | None) -> _Request:
        """Put a request into the queue."""
        self._check_open()
        # Encoded, or copied, now: the caller may change it while it waits for the server.
        kind, taken = self._encode(value)
        call = Call(
            f"{self.name} has not answered, and the call goes on: no response",
            self._core.dispatcher,
            cancellable=True,
        )
        with self._lock:
            closed = self._closed
            entry = self._request(call, taken, kind, timeout)
            if not closed:
                self._requests[call] = entry
                self._queue.append(entry)
        if closed:
            self._check_open()
        call.add_done_callback(lambda _: self._ended(entry))
        return entry

    def _expire(self, entry: _Request, timeout: float) -> None:
        """End a call whose time is over."""
        if entry.call.done():
            return
        error: Error
        if entry.sent is None:
            error = ServiceUnavailableError(
                f"{self.name} could not be called within {timeout:g} s: "
                f"{self.problem or self._delay(entry)}; nothing was sent"
            )
        else:
            error = TimeoutError(
                f"{self.name} did not answer within {timeout:g} s: {self._server_name()} was sent "
                f"the request {time.monotonic() - entry.sent:.1f} s ago, and may still carry it out"
            )
        entry.call.fail(error)

    def _fulfil(self, call: Call, kind: MessageType, data: bytes | memoryview) -> None:
        """End a call with the response that came."""
        try:
            message = self._decode(kind, data)
        except DecodeError as problem:
            rubbish = ServiceError(
                f"{self._server_name()} answered the call of {self.name} with bytes that are no "
                f"{kind.name}: {problem}; it was probably built from another definition of the "
                "type: add that to the library"
            )
            rubbish.__cause__ = problem
            call.fail(rubbish)
        else:
            call.fulfil(message)

    def close(self) -> None:
        """End pending calls with NodeClosedError, and withdraw the client; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            entries = list(self._requests.values())
        if self._core.forked:
            return
        for entry in entries:
            entry.call.fail(NodeClosedError(f"the client of {self.name} was closed during a call"))
        self._withdraw()
        self._readiness.close()
        self._core.remove(self)
