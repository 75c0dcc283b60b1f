"""Calling ROS 2 services."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import EndpointInfo, EndpointKind, QoS
from rosglass.comm.calling import CallingClient
from rosglass.comm.client import untyped
from rosglass.comm.service_server import served_by_this_thread
from rosglass.comm.similar import similar
from rosglass.errors import ConnectionLostError, Error, ServiceError
from rosglass.ros2.announced import (
    Announced,
    choose,
    identity,
    mismatches,
    nodes_of,
    rivals,
)
from rosglass.ros2.core import Member
from rosglass.ros2.pacing import HOLD_S, LIMIT, STALL_S, RequestWindow
from rosglass.ros2.requests import Link, Request
from rosglass.wires.base import CALL_DROPPED, SERVER_LEFT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm import Call
    from rosglass.messages import Message, MessageType, ServiceType
    from rosglass.ros2.core import Core

__all__ = ["Ros2ServiceClient"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that a server may be out of the graph before its calls end: a router that is restarted
#: hides everybody for one or two.
_GRACE = 3.0
#: Seconds between looks at a server that is in the graph but not linked yet.
_RETRY = 0.05


class Ros2ServiceClient(CallingClient[Request], Member):
    """A service client; made by :meth:`Node.create_service_client`.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        wanted: The type, or its name: then the version that the server announces is taken if the
            library has it; None takes whatever type the server announces.
        qos: Profile of requests and replies; None for the usual one.
        patient: Whether calls go on as long as their server is away, and its servers hold them.
        quiet: Whether somebody else logs what is wrong.
    """

    _core: Core

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
        super().__init__(core, name)
        self.qos = qos or QoS.services()
        self._patient, self._quiet = patient, quiet
        self._discovers = wanted is None
        given = None if wanted is None else core.types.service(wanted)
        fixed = wanted is not None and not isinstance(wanted, str)
        self._announced: Announced[ServiceType] = Announced(core, core.types.service, given, fixed)
        self.type = given
        self._link: Link | None = None
        self._window = core.windows.setdefault(name, RequestWindow(HOLD_S if patient else STALL_S))
        self._flushing = self._again = self._retrying = False
        self._choice = self._failure = ""
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
    def trouble(self) -> str:
        """What its middleware has against servers that are there; empty when nothing."""
        link = self._link
        return "" if link is None else link.requester.problem

    def server_ids(self) -> frozenset[bytes | str]:
        """Return the identities of the servers that understand the requests."""
        return frozenset(map(identity, self._fitting(self._servers())))

    # -- calling ---------------------------------------------------------------------------------

    def _answered_here(self) -> bool:
        return served_by_this_thread(self._core, self.name)

    def withdraw(self, call: Call) -> bool:
        """Cancel a call if its request was not sent yet; return whether that was so."""
        with self._lock:
            entry = self._requests.get(call)
            if entry is None or entry not in self._queue:
                return False
            self._queue.remove(entry)
        return call.cancel()

    def _encode(self, value: Any) -> tuple[ServiceType | None, Any]:
        kind = self._announced.type
        return kind, untyped(value, self.name) if kind is None else Request.encoded(kind, value)

    def _request(
        self, call: Call, value: Any, kind: ServiceType | None, timeout: float | None
    ) -> Request:
        deadline = None if timeout is None else time.monotonic() + timeout
        return Request(call=call, value=value, type=kind, deadline=deadline)

    def _begin(self, entry: Request) -> None:  # noqa: ARG002 - all that waits is sent
        self._flush()

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
            # In the graph, but not linked yet, or holding what it was sent: that may change without
            # news.
            self._retrying = True
            self._core.timers.after(_RETRY, self._retry)

    def _send_waiting(self) -> None:
        while (link := self._link) is not None and self._queue and self.ready:
            with self._lock:
                entry = self._queue[0] if self._queue else None
                if entry is None or not self._window.enter(entry, self._flush):
                    return
                self._queue.popleft()
            if not entry.call.done():
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
        self._fulfil(call, link.type.response, data)

    def _decode(self, kind: MessageType, data: bytes | memoryview) -> Message:
        if kind.fields:
            kind.validate(data)
        return kind.decode(data)

    def _server_name(self) -> str:
        return nodes_of(self._fitting(self._servers())) or "its server"

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

    def _delay(self, entry: Request) -> str:  # noqa: ARG002 - it holds for all that wait
        if self.ready:
            return f"{LIMIT} requests before it still wait for {self._server_name()} to answer"
        return "its server appeared too late"

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
        for send in self._window.leave(entry):
            if entry.private:  # this may be in the middle of receiving
                self._core.timers.after(0.0, send)
            else:
                send()

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
        if not self._quiet:
            self._warn(_log, logging.INFO if self._announced.pending else logging.WARNING)
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
        core, known = self._core, self._announced.hash
        link.requester = core.middleware.create_requester(
            EndpointInfo(
                EndpointKind.SERVICE_CLIENT, self.name, kind.name, core.name, self.qos, known
            ),
            link.take,
        )
        link.requester.changed, link.requester.quick = core.wake, link.quick
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

    def _conflicts(self) -> list[str]:
        problems = [self._choice, self._announced.failure, self._failure]
        problems = [text for text in problems if text]
        if not problems:
            servers = self._servers()
            problems = mismatches(self._announced, servers, "offers", "it cannot be called")
            # The middleware knows better what becomes of several servers.
            others = rivals(self._fitting(servers), self.name)
            problems += [self.trouble] if self.trouble and not problems else others
        return problems

    def _absence(self) -> str:
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

    def _withdraw(self) -> None:
        with self._lock:
            link, self._link = self._link, None
            self._queue.clear()
        if link is not None:
            link.requester.close()
