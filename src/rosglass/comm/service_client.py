"""Calling a service: from a request to its response, or to the error that comes instead."""

from __future__ import annotations

import itertools
import logging
import threading
import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosglass.comm.client import Client, untyped
from rosglass.comm.handle import Handle, check_may_wait
from rosglass.comm.promise import Promise, check_timeout
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.service_server import decode_checked, served_by_this_thread
from rosglass.errors import (
    ConnectionLostError,
    ConversionError,
    DecodeError,
    Error,
    NodeClosedError,
    ServiceError,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)
from rosglass.wires.base import CALL_DROPPED, SERVER_LEFT

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.core import NodeCore
    from rosglass.comm.handle import Executor
    from rosglass.comm.node import Node
    from rosglass.comm.promise import Deadline
    from rosglass.comm.qos import QoS
    from rosglass.comm.subscription import Subscription
    from rosglass.messages import Message, ServiceType
    from rosglass.wires.base import OnReply

__all__ = ["Call", "OtherNode", "PendingCall", "ServiceClient", "ServiceRequester"]

_log = logging.getLogger("rosglass.comm")


class Call(Promise["Message"]):
    """A service call on its way: the promise of the response.

    ``result(timeout)`` waits for it, ``await call`` does in asyncio, :meth:`on_done` calls back.
    ``cancel()`` gives the call up: a request that waits for a server is not sent any more, and
    the response to one that was sent is dropped (the server is not told: ROS has no such message).
    """


@dataclass(eq=False, kw_only=True)
class PendingCall:
    """A call that has not ended; its client owns it, and keeps its time.

    Attributes:
        number: Tells it from the client's other calls; later calls have higher ones.
        call: What the caller holds.
        value: The encoded request, or the value to encode while the type is not known.
        type: The type it is encoded for.
        max_size: Most bytes that the request may have; None for any number.
        deadline: Monotonic time at which it ends without response; None for never.
        timer: Ends it at its deadline, unless the caller waits for it and does so.
        sent: Monotonic time at which its requester sent the request, None before.
        answered: Whether it is known what became of the request.
        private: Whether the caller waits in :meth:`ServiceClient.call`: its end runs no callback.
        route: What its requester needs besides; nothing else looks into it.
    """

    number: int
    call: Call
    value: Any
    type: ServiceType | None
    max_size: int | None
    deadline: float | None
    private: bool
    timer: Handle | None = None
    sent: float | None = None
    answered: bool = False
    route: Any = None

    def encode(self, kind: ServiceType) -> bytes:
        """Return the request's bytes for a type that may have been found only after the call.

        Raises:
            ConversionError: A value does not fit its field.
        """
        if self.type is not kind:
            value = self.value
            if self.type is not None:
                value = self.type.request.decode(value).to_dict()
            self.value, self.type = encode_request(kind, value, self.max_size), kind
        return bytes(self.value)


def encode_request(kind: ServiceType, value: Any, max_size: int | None) -> bytes:
    """Return the bytes of a request's value; raises ConversionError."""
    data = kind.request.encode(value)
    if max_size is not None and len(data) > max_size:
        limit = f"at most {max_size} bytes, as its server takes no larger request"
        raise ConversionError("", f"{len(data)} bytes", limit, kind.request.name)
    return data


class ServiceRequester(ABC):
    """Finds a service's servers for a client and sends them its requests, as a protocol has it.

    It sends each request it is given as soon as there is a server, in the order of the calls, and
    passes on what becomes of it. Times are the client's business.

    Attributes:
        type: The service type; None while it is not discovered yet.
        waiters: How many threads wait for a server; set by the client.
        max_request: Most bytes that a request may have; None for any number.
        warn_level: At which level the client logs conflicts; None where its owner does that.
    """

    type: ServiceType | None
    waiters: int = 0
    max_request: int | None = None
    warn_level: int | None = logging.WARNING

    @abstractmethod
    def ready(self) -> bool:
        """Return whether a server is there that understands the requests."""

    @abstractmethod
    def conflicts(self) -> list[str]:
        """Say what a person has to mend."""

    @abstractmethod
    def absence(self) -> str:
        """Say why no server is there although nothing is wrong."""

    @abstractmethod
    def server_name(self) -> str:
        """Return who has the service, for people."""

    @abstractmethod
    def send(self, pending: PendingCall) -> None:
        """Send a request as soon as that is possible; from any thread, returns at once.

        Sets :attr:`PendingCall.sent` when it does.
        """

    @abstractmethod
    def withdraw(self, pending: PendingCall) -> bool:
        """Do not send a request any more; return False if it is on its way already."""

    @abstractmethod
    def forget(self, pending: PendingCall) -> None:
        """Take note that a call has ended: do not send it, drop its response; from any thread."""

    @abstractmethod
    def delay(self, pending: PendingCall) -> str:
        """Say why a request was not sent although all is well."""

    @abstractmethod
    def look(self) -> None:
        """Look for a server now, because a thread waits for one; from any thread."""

    @abstractmethod
    def follow(self, moved: bool, idle: bool) -> None:
        """Follow the graph: the type, whether a server is there, calls whose server went."""

    @abstractmethod
    def close(self) -> None:
        """Close what leads to the servers; safe to call twice."""


@hint_at_members
class ServiceClient(Client):
    """Calls a service; made by :meth:`Node.create_service_client`.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        qos: The quality of service of requests and replies.
        create_requester: Makes what sends the requests, with the calls that have not ended by
            number, what takes responses, and what to call when a server has come or gone, or may
            have.

    Attributes:
        name: Absolute service name.
        qos: The quality of service of requests and replies.
    """

    def __init__(
        self,
        core: NodeCore,
        name: str,
        qos: QoS,
        create_requester: Callable[
            [Mapping[int, PendingCall], OnReply, Callable[[], None]], ServiceRequester
        ],
    ) -> None:
        super().__init__(core, name)
        self.qos = qos
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        #: The calls that have not ended; the lock keeps those out that would outlive the client.
        self._pending: dict[int, PendingCall] = {}
        self._requester = create_requester(self._pending, self._on_reply, self._on_change)
        core.add(self, self._follow)

    def __repr__(self) -> str:
        kind = self.type.name if self.type is not None else "type not known yet"
        return f"<{type(self).__name__} {self.name} [{kind}]>"

    # -- who is there ------------------------------------------------------------------------------

    @property
    def type(self) -> ServiceType | None:
        """The service type; None while it is not discovered yet."""
        return self._requester.type

    def _is_ready(self) -> bool:
        """Return whether a server is there that understands the requests."""
        return not self._closed and self._requester.ready()

    def _conflicts(self) -> list[str]:
        return self._requester.conflicts()

    def _absence(self) -> str:
        return self._requester.absence()

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` seconds (None: for ever) for a server; return whether it is there.

        Raises:
            NodeClosedError: The client is closed, or gets closed meanwhile.
        """
        with self._lock:
            self._requester.waiters += 1
        try:
            if not self.ready:
                self._requester.look()
            return super().wait_for_server(timeout)
        finally:
            with self._lock:
                self._requester.waiters -= 1

    def _on_change(self) -> None:
        """Log conflicts and report changes of :attr:`ready`; by one thread only."""
        if self._requester.warn_level is not None:
            self._warn(_log, self._requester.warn_level)
        self._readiness.update()

    def _follow(self, moved: bool, idle: bool) -> None:
        if not self._closed:
            self._requester.follow(moved, idle)

    # -- calling -----------------------------------------------------------------------------------

    @property
    def pending(self) -> int:
        """Calls that have not ended."""
        return len(self._pending)

    def call(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Message:
        """Call the service and wait for its response.

        Callbacks may do this, too, as long as the server does not need their thread. Where
        nothing may wait, as on a user interface's thread, take :meth:`call_async`.

        Args:
            request: A message or a dict of fields; missing fields, and None, get the defaults.
            timeout: Seconds to wait in all, for the server to appear and to answer; None for ever.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent.
            ServiceUnavailableError: No server appeared within the time; nothing was sent.
            TimeoutError: The server did not answer within the time; it may still do what it was
                asked to.
            ServiceError: The server says that it failed, or its response cannot be decoded.
            ConnectionLostError: The server went away before it answered.
            UnsupportedError: The calling thread is one that the answer needs.
            NodeClosedError: The client is closed, or gets closed meanwhile.
        """
        if served_by_this_thread(self._core, self.name):
            raise UnsupportedError(
                f"{self.name}: this callback would wait for itself: the server runs on the same "
                "thread of this node; take call_async() here, or give the server an executor "
                "of its own"
            )
        check_may_wait(self.name)
        timeout = check_timeout(timeout, self.name)
        pending = self._enter(request, timeout, private=True)
        try:
            self._requester.send(pending)
            if timeout is not None:
                try:
                    return pending.call.result(timeout)
                except TimeoutError:
                    # Either the call's own end, or that of the waiting: then this is its end.
                    self._expire(pending, timeout)
            return pending.call.result()
        except BaseException:
            pending.call.cancel()  # Ctrl-C: the response is not waited for any more
            raise

    def call_async(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Call:
        """Call the service and return at once; the call carries the response or the error.

        A request for which there is no server yet waits for one, and is sent as soon as it is
        there. Requests are sent in the order of the calls; not in ROS 1, unless the client is
        persistent: there each call has a connection of its own, and they run side by side.
        Arguments and errors as in :meth:`call`; a ConversionError is raised here already, unless
        the type is not known yet.
        """
        timeout = check_timeout(timeout, self.name)
        pending = self._enter(request, timeout, private=False)
        if timeout is not None:
            limit = timeout
            pending.timer = self._core.timers.after(limit, lambda: self._expire(pending, limit))
        self._requester.send(pending)
        return pending.call

    def _enter(self, value: Any, timeout: float | None, *, private: bool) -> PendingCall:
        """Return a new pending call; raises ConversionError."""
        self._check_open()
        kind, max_size = self.type, self._requester.max_request
        # Encoded, or copied, now: the caller may change it while it waits for the server.
        taken = untyped(value, self.name) if kind is None else encode_request(kind, value, max_size)
        call = Call(
            f"{self.name} has not answered, and the call goes on: no response",
            self._core.dispatcher,
            cancellable=True,
        )
        pending = PendingCall(
            number=next(self._numbers),
            call=call,
            value=taken,
            type=kind,
            max_size=max_size,
            deadline=None if timeout is None else time.monotonic() + timeout,
            private=private,
        )
        with self._lock:
            closed = self._closed
            if not closed:
                self._pending[pending.number] = pending
        if closed:
            self._check_open()
        call.add_done_callback(lambda _: self._on_end(pending))
        return pending

    def _withdraw(self, call: Call) -> bool:
        """Cancel a call if its request was not sent yet; return whether that was so."""
        pending = next((p for p in tuple(self._pending.values()) if p.call is call), None)
        return pending is not None and self._requester.withdraw(pending) and call.cancel()

    # -- how a call ends ---------------------------------------------------------------------------

    def _on_end(self, pending: PendingCall) -> None:
        """Clean up after a call; in any thread."""
        if pending.timer is not None:
            pending.timer.close()
        self._pending.pop(pending.number, None)
        self._requester.forget(pending)

    def _expire(self, pending: PendingCall, timeout: float) -> None:
        """End a call whose time is over."""
        if pending.call.done():
            return
        error: Error
        if pending.sent is None:
            error = ServiceUnavailableError(
                f"{self.name} could not be called within {timeout:g} s: "
                f"{self.problem or self._requester.delay(pending)}; nothing was sent"
            )
        else:
            since = time.monotonic() - pending.sent
            error = TimeoutError(
                f"{self.name} did not answer within {timeout:g} s: "
                f"{self._requester.server_name()} was sent the request {since:.1f} s ago, and may "
                "still carry it out"
            )
        pending.call.set_exception(error)

    def _on_reply(self, number: int, data: bytes | memoryview | None, error: str | Error) -> None:
        """End a call with the response that came, or with the error; in a thread that receives."""
        pending = self._pending.get(number)
        if pending is None:
            return
        pending.answered = True
        try:
            if data is not None:
                self._fulfil(pending, data)
            elif isinstance(error, Error):
                pending.call.set_exception(error)
            elif error in (SERVER_LEFT, CALL_DROPPED):
                pending.call.set_exception(self._loss(pending))
            else:
                reason = error or "there is no response"
                pending.call.set_exception(
                    ServiceError(f"the call of {self.name} failed: {reason}")
                )
        except Exception:
            _log.exception("%s: taking a response failed", self.name)

    def _fulfil(self, pending: PendingCall, data: bytes | memoryview) -> None:
        assert pending.type is not None  # it was sent
        kind = pending.type.response
        try:
            message = decode_checked(kind, data)
        except DecodeError as problem:
            rubbish = ServiceError(
                f"{self._requester.server_name()} answered the call of {self.name} with bytes that "
                f"are no {kind.name}: {problem}; it was probably built from another definition of "
                "the type: add that to the library"
            )
            rubbish.__cause__ = problem
            pending.call.set_exception(rubbish)
        else:
            pending.call.set_result(message)

    def _loss(self, pending: PendingCall) -> ConnectionLostError:
        since = time.monotonic() - (pending.sent or time.monotonic())
        return ConnectionLostError(
            f"the server of {self.name} went away before it answered the request sent {since:.1f} "
            f"s ago, and may have carried it out or not; look what happened, and call again "
            f"({self._core.url}: {self._core.status()})"
        )

    def close(self) -> None:
        """End pending calls with NodeClosedError, and withdraw the client; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            pending = list(self._pending.values())
        if self._core.forked:
            return
        for each in pending:
            each.call.set_exception(
                NodeClosedError(f"the client of {self.name} was closed during a call")
            )
        self._requester.close()
        self._readiness.close()
        self._core.remove(self)


class OtherNode(Handle):
    """Another node's services of one kind; each has a client from its first call on.

    Args:
        owner: The node that asks.
        node: Full name of the node that is asked.
        services: Their types by their names, without the node's.
        first: The one that tells whether the node is there. It has a client at once, so that this
            finds its server while the caller still prepares its question.
        qos: The services' profile; None for the usual one.
    """

    def __init__(
        self,
        owner: Node,
        node: str,
        services: Mapping[str, str],
        first: str,
        qos: QoS | None = None,
    ) -> None:
        self.node = node
        self._owner, self._services, self._qos = owner, services, qos
        self._lock = threading.Lock()
        self._clients: dict[str, ServiceClient] = {}
        self._watches: list[Subscription] = []
        self._closed = False
        self._first = first
        self._client(first)

    @property
    def ready(self) -> bool:
        """Whether the node is there and has such services."""
        return not self._closed and self._client(self._first).ready

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for the node; return whether it is there."""
        return self._client(self._first).wait_for_server(timeout)

    def close(self) -> None:
        """Ask and watch no more; calls that wait end with NodeClosedError. Safe to call twice."""
        with self._lock:
            self._closed = True
            made = [*self._clients.values(), *self._watches]
            self._clients, self._watches = {}, []
        for handle in made:
            handle.close()

    def _check_open(self) -> None:
        if self._closed:
            raise NodeClosedError(f"{self!r} is closed; create another one")

    def _client(self, service: str) -> ServiceClient:
        with self._lock:
            self._check_open()
            client = self._clients.get(service)
            if client is None:
                name = f"{self.node}/{service}"
                client = self._owner.create_service_client(name, self._services[service], self._qos)
                self._clients[service] = client
            return client

    def _call(self, service: str, request: dict[str, Any], deadline: Deadline) -> Message:
        return self._client(service).call(request, timeout=deadline.left())

    def _watch(
        self,
        topic: str,
        type: str,
        receive: Callable[[Message], None],
        qos: QoS | int,
        executor: Executor | None,
    ) -> Handle:
        """Hear of the node's news until the handle, or this, is closed."""
        watch = self._owner.create_subscription(topic, type, receive, qos, executor=executor)
        with self._lock:
            self._watches = [*(w for w in self._watches if not w.closed), watch]
        return watch
