"""Calling ROS 2 services."""

from __future__ import annotations

import copy
import logging
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any

from rosglass.comm import Call, EndpointKind, QoS, ServiceClient
from rosglass.comm.promise import check_timeout
from rosglass.comm.readiness import Readiness
from rosglass.comm.receiving import check_may_wait
from rosglass.comm.similar import similar
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
from rosglass.ros2.announced import (
    Announced,
    choose,
    identity,
    mismatches,
    nodes_of,
    rivals,
)
from rosglass.ros2.core import Member
from rosglass.ros2.middleware import CALL_DROPPED, SERVER_LEFT
from rosglass.ros2.requests import Link, Request

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, Executor, Handle
    from rosglass.messages import Message, ServiceType
    from rosglass.ros2.core import Core

__all__ = ["Ros2ServiceClient"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that a server may be out of the graph before its calls end: a router that is restarted
#: hides everybody for one or two.
_GRACE = 3.0
#: Seconds between looks at a server that is in the graph but not linked yet.
_RETRY = 0.05


class Ros2ServiceClient(ServiceClient, Member):
    """A service client; made by :meth:`Node.create_service_client`.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        wanted: The type, or its name: then the version that the server announces is taken if the
            library has it; None takes whatever type the server announces.
        qos: Profile of requests and replies; None for the usual one.
        patient: Whether calls go on as long as their server is away.
        quiet: Whether somebody else logs what is wrong.
    """

    def __init__(
        self,
        core: Core,
        name: str,
        wanted: ServiceType | str | None,
        qos: QoS | None = None,
        *,
        patient: bool = False,
        quiet: bool = False,
    ) -> None:
        self.name, self.qos = name, qos or QoS.services()
        self._core, self._patient, self._quiet = core, patient, quiet
        self._discovers = wanted is None
        given = None if wanted is None else core.types.service(wanted)
        fixed = wanted is not None and not isinstance(wanted, str)
        self._announced: Announced[ServiceType] = Announced(core, core.types.service, given, fixed)
        self.type = given
        self._lock = threading.Lock()
        self._link: Link | None = None
        self._requests: dict[Call, Request] = {}
        self._queue: deque[Request] = deque()
        self._flushing = self._again = self._retrying = False
        self._closed = False
        self._choice = self._failure = self._warned = ""
        self._readiness = Readiness(name, lambda: self.ready, self._check_open, core.dispatcher)
        self._adopt(retry=True)
        if self._announced.type is not None:
            self._connect(self._announced.type)
        core.add(self)
        core.wake()

    # -- who is there ----------------------------------------------------------------------------

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands the requests."""
        link = self._link
        if link is None or self._closed:
            return False
        servers = self._servers()
        return not (servers and not self._fitting(servers)) and link.requester.ready()

    @property
    def problem(self) -> str:
        """Why the service cannot be called, in words; empty when all is well."""
        if self._closed:
            return "the client is closed"
        problems = self._conflicts(self._servers())
        if not problems and not self.ready:
            problems.append(self._absence())
        return "; ".join(problems)

    @property
    def trouble(self) -> str:
        """What its middleware has against servers that are there; empty when nothing."""
        link = self._link
        return "" if link is None else link.requester.problem

    def server_ids(self) -> frozenset[bytes | str]:
        """Return the identities of the servers that understand the requests."""
        return frozenset(map(identity, self._fitting(self._servers())))

    @property
    def pending(self) -> int:
        """Calls that have not ended."""
        return len(self._requests)

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for a server; see :meth:`rosglass.comm.ServiceClient.wait_for_server`."""
        return self._readiness.wait(timeout)

    def on_ready_change(
        self, callback: Callable[[bool], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`ready` whenever it changes."""
        return self._readiness.add(callback, executor)

    # -- calling ---------------------------------------------------------------------------------

    def call(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Message:
        """Call and wait; see :meth:`rosglass.comm.ServiceClient.call`."""
        if self._core.serves_here(self.name):
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
            self._flush()
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
        self._flush()
        return entry.call

    def withdraw(self, call: Call) -> bool:
        """Cancel a call if its request was not sent yet; return whether that was so."""
        with self._lock:
            entry = self._requests.get(call)
            if entry is None or entry not in self._queue:
                return False
            self._queue.remove(entry)
        return call.cancel()

    def _enter(self, value: Any, timeout: float | None) -> Request:
        """Put a request into the queue."""
        self._check_open()
        kind = self._announced.type
        # Encoded, or copied, now: the caller may change it while it waits for the server.
        if kind is not None:
            taken = kind.request.encode(value)
        elif value is None or hasattr(value, "to_dict") or isinstance(value, dict):
            taken = copy.deepcopy(value)
        else:
            raise ConversionError("", value, "a message or a dict of fields", self.name)
        call = Call(
            f"{self.name} has not answered, and the call goes on: no response",
            self._core.dispatcher,
            cancellable=True,
        )
        deadline = None if timeout is None else time.monotonic() + timeout
        entry = Request(call, taken, kind, deadline)
        with self._lock:
            closed = self._closed
            if not closed:
                self._requests[call] = entry
                self._queue.append(entry)
        if closed:
            self._check_open()
        call.add_done_callback(lambda _: self._ended(entry))
        return entry

    def _flush(self) -> None:
        """Send what waits, in order, if a server is there."""
        with self._lock:
            if self._flushing:
                self._again = True  # whoever does it sees to what was added
                return
            self._flushing = True
        again = True
        try:
            while again:
                self._send_waiting()
                with self._lock:
                    again, self._again = self._again, False
                    self._flushing = again
        except BaseException:
            self._flushing = False
            raise
        if self._queue and not self._retrying and self._fitting(self._servers()):
            # In the graph, but not linked yet: that may come without news.
            self._retrying = True
            self._core.timers.after(_RETRY, self._retry)

    def _send_waiting(self) -> None:
        while (link := self._link) is not None and self._queue and self.ready:
            with self._lock:
                entry = self._queue.popleft() if self._queue else None
            if entry is not None and not entry.call.done():
                self._send(link, entry)

    def _retry(self) -> None:
        self._retrying = False
        self._flush()

    def _send(self, link: Link, entry: Request) -> None:
        try:
            data = entry.encode(link.type)
            now = time.monotonic()
            left = None if entry.deadline is None else max(0.001, entry.deadline - now)
            entry.servers = self.server_ids()
            entry.sent = now
            link.send(entry, data, left)
        except Error as error:
            entry.call.fail(error)
        except Exception as error:
            _log.exception("%s: sending a request failed", self.name)
            entry.call.fail(ServiceError(f"{self.name}: the request could not be sent: {error}"))

    def _take(
        self, link: Link, entry: Request, data: bytes | memoryview | None, error: str
    ) -> None:
        call = entry.call
        if data is None:
            call.fail(self._refusal(entry, error))
            return
        response = link.type.response
        try:
            if response.fields:
                response.validate(data)
            message = response.decode(data)
        except DecodeError as problem:
            who = nodes_of(self._fitting(self._servers())) or "the server"
            rubbish = ServiceError(
                f"{who} answered the call of {self.name} with bytes that are no "
                f"{response.name}: {problem}; it was probably built from another definition "
                "of the type: add that to the library"
            )
            rubbish.__cause__ = problem
            call.fail(rubbish)
        else:
            call.fulfil(message)

    def _refusal(self, entry: Request, error: str) -> Error:
        gone = entry.servers and not entry.servers & self.server_ids()
        if gone or error in (SERVER_LEFT, CALL_DROPPED):
            return self._loss(entry)
        return ServiceError(f"the call of {self.name} failed: {error or 'there is no response'}")

    def _loss(self, entry: Request) -> ConnectionLostError:
        since = time.monotonic() - (entry.sent or 0.0)
        return ConnectionLostError(
            f"the server of {self.name} went away before it answered the request sent {since:.1f} "
            f"s ago, and may have carried it out or not; look what happened, and call again "
            f"({self._core.url}: {self._core.status()})"
        )

    def _expire(self, entry: Request, timeout: float) -> None:
        """End a call whose time is over."""
        if entry.call.done():
            return
        error: Error
        if entry.sent is None:
            error = ServiceUnavailableError(
                f"{self.name} could not be called within {timeout:g} s: "
                f"{self.problem or 'its server appeared too late'}; nothing was sent"
            )
        else:
            who = nodes_of(self._fitting(self._servers())) or "its server"
            error = TimeoutError(
                f"{self.name} did not answer within {timeout:g} s: {who} was sent the request "
                f"{time.monotonic() - entry.sent:.1f} s ago, and may still carry it out"
            )
        entry.call.fail(error)

    def _ended(self, entry: Request) -> None:
        if entry.timer is not None:
            entry.timer.close()
        with self._lock:
            self._requests.pop(entry.call, None)
            if entry.sent is None and entry in self._queue:
                self._queue.remove(entry)
        if entry.link is not None:
            link, number = entry.link
            link.forget(number)

    # -- following the graph ---------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - definitions may be added
        """Follow the graph: the type, whether a server is there, calls whose server went."""
        if self._closed:
            return
        if self._adopt(retry=idle) and self._announced.type is not None:
            try:
                self._connect(self._announced.type)
                self._failure = ""
            except Error as error:
                self._failure = str(error)
        servers = self._servers()
        problem = "; ".join(self._conflicts(servers))
        if problem and problem != self._warned and not self._quiet:
            level = logging.INFO if self._announced.pending else logging.WARNING
            _log.log(level, "%s: %s", self.name, problem)
        self._warned = problem
        self._readiness.update()
        if self._queue:
            self._flush()
        self._watch()

    def _adopt(self, *, retry: bool) -> bool:
        """Take the type that servers announce; returns whether it is another one now."""
        servers = self._servers()
        name = "" if self._announced.type is None else self._announced.type.name
        self._choice = ""
        if self._discovers:
            example = f"create_service_client({self.name!r}, {{}})"
            name, self._choice = choose((s.type for s in servers), name, example)
        return bool(name) and self._announced.follow(name, servers, retry)

    def _connect(self, kind: ServiceType) -> None:
        """Speak `kind` from now on."""
        link = Link(kind, self._take)
        link.requester = self._core.middleware.create_requester(
            self._core.name, self.name, kind.name, self._announced.hash, self.qos, link.take
        )
        link.requester.changed, link.requester.quick = self._core.wake, link.quick
        with self._lock:
            old, self._link = self._link, link
            self.type = kind
            closed = self._closed
            if closed:
                self._link = None
            stranded = [e for e in self._requests.values() if e.link and e.link[0] is old]
        if old is not None:
            old.requester.close()
        if closed:
            link.requester.close()
        for entry in stranded:
            entry.call.fail(self._loss(entry))

    def _watch(self) -> None:
        """End the calls whose servers left, and have not answered for too long since."""
        if not self._requests:
            return
        here = self.server_ids()
        now = time.monotonic()
        with self._lock:
            entries = list(self._requests.values())
        for entry in entries:
            if entry.sent is None:
                continue
            if not entry.servers:
                entry.servers = here
            if not self._left(entry, here):
                entry.alone = None
            elif entry.alone is None:
                entry.alone = now
            elif now - entry.alone >= _GRACE:
                entry.call.fail(self._loss(entry))

    def _left(self, entry: Request, here: frozenset[bytes | str]) -> bool:
        """Return whether a request's servers have left, so that it may get no answer any more."""
        stranded = entry.link is not None and entry.link[0].requester.stranded(entry.link[1])
        if self._patient:
            return stranded and self.ready  # there is somebody to be asked again
        return stranded or (bool(entry.servers) and not entry.servers & here)

    def _servers(self) -> list[EndpointInfo]:
        return self._core.graph.endpoints(EndpointKind.SERVICE_SERVER, self.name)

    def _fitting(self, servers: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        return [server for server in servers if self._announced.fits(server)]

    def _conflicts(self, servers: Sequence[EndpointInfo]) -> list[str]:
        """Say what a person has to mend."""
        problems = [self._choice, self._announced.failure, self._failure]
        problems = [text for text in problems if text]
        if not problems:
            problems = mismatches(self._announced, servers, "offers", "it cannot be called")
            # The middleware knows better what becomes of several servers.
            others = rivals(self._fitting(servers), self.name)
            problems += [self.trouble] if self.trouble and not problems else others
        return problems

    def _absence(self) -> str:
        """Say why no server is there although nothing is wrong."""
        servers = self._fitting(self._servers())
        if servers:
            return f"{nodes_of(servers)} offers it, but is not linked yet"
        known = self._core.graph.services(hidden=False)
        offered = [
            name
            for name in known
            if name != self.name and self._core.graph.endpoints(EndpointKind.SERVICE_SERVER, name)
        ]
        kind = "" if self.type is None else f" [{self.type.name}]"
        status = self._core.status()
        return (
            f"no server offers {self.name}{kind} on {self._core.url} ({status})"
            f"{similar(self.name, offered)}"
        )

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """End pending calls with NodeClosedError, and withdraw the client; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            link, self._link = self._link, None
            entries = list(self._requests.values())
            self._queue.clear()
        if self._core.forked:
            return
        for entry in entries:
            entry.call.fail(NodeClosedError(f"the client of {self.name} was closed during a call"))
        if link is not None:
            link.requester.close()
        self._readiness.close()
        self._core.remove(self)

    def _check_open(self) -> None:
        self._core.check_open()
        if self._closed:
            raise NodeClosedError(f"the client of {self.name} is closed; create another one")
