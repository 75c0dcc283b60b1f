"""Calling services of ROS 2: versions of their type, and requests that are not lost."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, QoS
from rosglass.comm.names import similar
from rosglass.comm.service_client import Call, PendingCall, ServiceClient, ServiceRequester
from rosglass.errors import Error, ServiceError
from rosglass.ros2.announced import (
    Announced,
    choose,
    identity,
    mismatches,
    nodes_of,
    rivals,
)
from rosglass.ros2.pacing import HOLD_S, LIMIT, STALL_S, RequestWindow
from rosglass.wires.base import SERVER_LEFT

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rosglass.messages import ServiceType
    from rosglass.ros2.core import Core
    from rosglass.wires.base import OnReply, Requester

__all__ = ["Ros2Requester", "Ros2ServiceClient", "create_service_client"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that a server may be out of the graph before its calls end: a router that is restarted
#: hides everybody for one or two.
_GRACE_S = 3.0
#: Seconds between looks at a server that is in the graph but not linked yet.
_RETRY_S = 0.05


def create_service_client(
    core: Core, name: str, wanted: ServiceType | str | None, qos: QoS | None = None
) -> ServiceClient:
    """Return a client of a service in a ROS 2 node.

    Args:
        core: The node.
        name: Absolute service name.
        wanted: The type, or its name: then the version that the server announces is taken if the
            library has it; None takes whatever type the server announces.
        qos: Profile of requests and replies; None for the usual one.
    """
    profile = qos or QoS.services()

    def create(
        pending: Mapping[int, PendingCall], on_reply: OnReply, on_change: Callable[[], None]
    ) -> Ros2Requester:
        return Ros2Requester(core, name, wanted, profile, pending, on_reply, on_change)

    return ServiceClient(core, name, profile, create)


class Ros2ServiceClient(ServiceClient):
    """A client of a service that belongs to more, such as an action's, whose owner watches it.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        type: The type.
        patient: Whether calls go on as long as their server is away, and its servers hold them.
        quiet: Whether its owner logs what is wrong.
    """

    _requester: Ros2Requester

    def __init__(
        self,
        core: Core,
        name: str,
        type: ServiceType | str,
        *,
        patient: bool = False,
        quiet: bool = False,
    ) -> None:
        profile = QoS.services()

        def create(
            pending: Mapping[int, PendingCall], on_reply: OnReply, on_change: Callable[[], None]
        ) -> Ros2Requester:
            return Ros2Requester(
                core,
                name,
                type,
                profile,
                pending,
                on_reply,
                on_change,
                patient=patient,
                quiet=quiet,
            )

        super().__init__(core, name, profile, create)

    @property
    def trouble(self) -> str:
        """What its middleware has against servers that are there; empty when nothing."""
        return self._requester.trouble

    def server_ids(self) -> frozenset[bytes | str]:
        """Return the identities of the servers that understand the requests."""
        return self._requester.server_ids()

    def withdraw(self, call: Call) -> bool:
        """Cancel a call if its request was not sent yet; return whether that was so."""
        return self._withdraw(call)


@dataclass(eq=False, slots=True)
class _Route:
    """How a request was sent.

    Attributes:
        requester: Through which it was sent.
        servers: Identities of the servers that were there then.
        alone: Since when none of them is there, or was; None while one is that may answer.
    """

    requester: Requester
    servers: frozenset[bytes | str]
    alone: float | None = None


class Ros2Requester(ServiceRequester):
    """A middleware's requester for the version of the type that servers announce.

    It keeps no more requests open than a server's queue holds, and ends calls whose servers left.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        wanted: The type, its name, or None; see :func:`create_service_client`.
        qos: Profile of requests and replies.
        pending: The calls that have not ended, by number.
        on_reply: Takes what comes of the requests.
        on_change: Called when a server has come or gone, or may have.
        patient: Whether calls go on as long as their server is away, and its servers hold them.
        quiet: Whether the client's owner logs what is wrong.
    """

    def __init__(
        self,
        core: Core,
        name: str,
        wanted: ServiceType | str | None,
        qos: QoS,
        pending: Mapping[int, PendingCall],
        on_reply: OnReply,
        on_change: Callable[[], None],
        *,
        patient: bool = False,
        quiet: bool = False,
    ) -> None:
        self._core, self._name, self._qos, self._patient = core, name, qos, patient
        self._quiet = quiet
        self._pending, self._on_reply, self._on_change = pending, on_reply, on_change
        self._discovers = wanted is None
        given = None if wanted is None else core.types.service(wanted)
        fixed = wanted is not None and not isinstance(wanted, str)
        self._announced: Announced[ServiceType] = Announced(core, core.types.service, given, fixed)
        self.type = given
        self._lock = threading.Lock()
        #: Requests that wait to be sent; changed with the lock.
        self._queue: deque[PendingCall] = deque()
        #: Speaks the type; None while that is not known, and after closing.
        self._requester: Requester | None = None
        self._window = core.windows.setdefault(name, RequestWindow(HOLD_S if patient else STALL_S))
        self._flushing = self._again = self._retrying = self._closed = False
        self._choice = self._failure = ""
        self._adopt(retry=True)
        if self._announced.type is not None:
            self._connect(self._announced.type)

    # -- who is there ------------------------------------------------------------------------------

    @property
    def warn_level(self) -> int | None:  # type: ignore[override]
        """At which level the client logs conflicts; None where its owner does that."""
        if self._quiet:
            return None
        return logging.INFO if self._announced.pending else logging.WARNING

    @property
    def trouble(self) -> str:
        """What the middleware has against servers that are there; empty when nothing."""
        requester = self._requester
        return "" if requester is None else requester.problem

    def ready(self) -> bool:
        """Return whether a server is there that understands the requests."""
        requester = self._requester
        if requester is None:
            return False
        servers = self._servers()
        return not (servers and not self._fitting(servers)) and requester.ready()

    def server_ids(self) -> frozenset[bytes | str]:
        """Return the identities of the servers that understand the requests."""
        return frozenset(map(identity, self._fitting(self._servers())))

    def server_name(self) -> str:
        """Return who has the service, for people."""
        return nodes_of(self._fitting(self._servers())) or "its server"

    def _servers(self) -> list[EndpointInfo]:
        return self._core.graph.endpoints(EndpointKind.SERVICE_SERVER, self._name)

    def _fitting(self, servers: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        return [server for server in servers if self._announced.fits(server)]

    def conflicts(self) -> list[str]:
        """Say what a person has to mend."""
        problems = [self._choice, self._announced.failure, self._failure]
        problems = [text for text in problems if text]
        if not problems:
            servers = self._servers()
            problems = mismatches(self._announced, servers, "offers", "it cannot be called")
            # The middleware knows better what becomes of several servers.
            others = rivals(self._fitting(servers), self._name)
            problems += [self.trouble] if self.trouble and not problems else others
        return problems

    def absence(self) -> str:
        """Say why no server is there although nothing is wrong."""
        servers = self._fitting(self._servers())
        if servers:
            return f"{nodes_of(servers)} offers it, but is not linked yet"
        known = self._core.graph.services(hidden=False)
        offered = [
            name
            for name in known
            if name != self._name and self._core.graph.endpoints(EndpointKind.SERVICE_SERVER, name)
        ]
        kind = "" if self.type is None else f" [{self.type.name}]"
        status = self._core.status()
        return (
            f"no server offers {self._name}{kind} on {self._core.url} ({status})"
            f"{similar(self._name, offered)}"
        )

    def look(self) -> None:
        """Do nothing: servers announce themselves."""

    def delay(self, pending: PendingCall) -> str:  # noqa: ARG002 - it holds for all that wait
        """Say why a request was not sent although all is well."""
        if self.ready():
            return f"{LIMIT} requests before it still wait for {self.server_name()} to answer"
        return "its server appeared too late"

    # -- sending -----------------------------------------------------------------------------------

    def send(self, pending: PendingCall) -> None:
        """Send a request as soon as a server is there, in the order of the calls."""
        with self._lock:
            self._queue.append(pending)
        if pending.call.done():
            self.forget(pending)  # it ended before it came here
        self._flush()

    def withdraw(self, pending: PendingCall) -> bool:
        """Do not send a request any more; return False if it is on its way already."""
        with self._lock:
            if pending not in self._queue:
                return False
            self._queue.remove(pending)
        return True

    def forget(self, pending: PendingCall) -> None:
        """Take note that a call has ended: do not send it, drop its response."""
        if pending.sent is None:
            with self._lock:
                if pending in self._queue:
                    self._queue.remove(pending)
        if pending.route is not None and not pending.answered:
            pending.route.requester.forget(pending.number)
        for send in self._window.leave(pending):
            if pending.private:  # this may be in the middle of receiving
                self._core.timers.after(0.0, send)
            else:
                send()

    def _flush(self) -> None:
        """Send what waits, in order, if a server is there."""
        with self._lock:
            if self._flushing:
                self._again = True  # the thread that does it sees to what was added
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
            self._core.timers.after(_RETRY_S, self._retry)

    def _send_waiting(self) -> None:
        while self._queue and self.ready():
            with self._lock:
                requester, kind = self._requester, self.type
                if requester is None or kind is None or not self._queue:
                    return
                pending = self._queue[0]
                if not self._window.enter(pending, self._flush):
                    return
                self._queue.popleft()
            if pending.call.done():
                self.forget(pending)
            else:
                self._send(requester, kind, pending)

    def _retry(self) -> None:
        self._retrying = False
        self._flush()

    def _send(self, requester: Requester, kind: ServiceType, pending: PendingCall) -> None:
        error: Error
        try:
            data = pending.encode(kind)
            now, deadline = time.monotonic(), pending.deadline
            left = None if deadline is None else max(0.001, deadline - now)
            pending.route = _Route(requester, self.server_ids())
            pending.sent = now
            requester.send(pending.number, data, left)
        except Error as problem:
            error = problem
        except Exception as problem:
            _log.exception("%s: sending a request failed", self._name)
            error = ServiceError(f"{self._name}: the request could not be sent: {problem}")
        else:
            if pending.call.done() and not pending.answered:
                requester.forget(pending.number)  # it was given up while it was sent
            return
        pending.call.set_exception(error)

    def _take(self, number: int, data: bytes | memoryview | None, error: str | Error) -> None:
        """Take a reply; called by the middleware."""
        if data is None:
            pending = self._pending.get(number)
            route = None if pending is None else pending.route
            if route is not None and route.servers and not route.servers & self.server_ids():
                error = SERVER_LEFT  # whatever the middleware makes of it
        self._on_reply(number, data, error)

    def _is_quick(self, number: int) -> bool:
        """Return whether taking a reply now runs none but our own code."""
        pending = self._pending.get(number)
        return pending is not None and pending.private

    # -- following the graph -----------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - definitions may be added
        """Follow the graph: the type, whether a server is there, calls whose server went."""
        if self._adopt(retry=idle) and self._announced.type is not None:
            try:
                self._connect(self._announced.type)
                self._failure = ""
            except Error as error:
                self._failure = str(error)
        self._on_change()
        if self._queue:
            self._flush()
        self._end_lost_calls()

    def _adopt(self, *, retry: bool) -> bool:
        """Take the type that servers announce; returns whether it is another one now."""
        servers = self._servers()
        name = "" if self._announced.type is None else self._announced.type.name
        self._choice = ""
        if self._discovers:
            example = f"create_service_client({self._name!r}, {{}})"
            name, self._choice = choose((s.type for s in servers), name, example)
        return bool(name) and self._announced.follow(name, servers, retry)

    def _connect(self, kind: ServiceType) -> None:
        """Speak `kind` from now on."""
        core, known = self._core, self._announced.hash
        requester = core.middleware.create_requester(
            EndpointInfo(
                EndpointKind.SERVICE_CLIENT, self._name, kind.name, core.name, self._qos, known
            ),
            self._take,
        )
        requester.changed, requester.quick = core.wake, self._is_quick
        with self._lock:
            old, self._requester = self._requester, requester
            self.type = kind
            closed = self._closed
            if closed:
                self._requester = None
        if old is not None:
            old.close()
        if closed:
            requester.close()
        if old is not None:
            for pending in tuple(self._pending.values()):
                if pending.route is not None and pending.route.requester is old:
                    self._on_reply(pending.number, None, SERVER_LEFT)

    def _end_lost_calls(self) -> None:
        """End the calls whose servers left, and have not answered for too long since."""
        if not self._pending:
            return
        here = self.server_ids()
        now = time.monotonic()
        for pending in tuple(self._pending.values()):
            route = pending.route
            if route is None:
                continue
            if not route.servers:
                route.servers = here
            if not self._has_left(pending, here):
                route.alone = None
            elif route.alone is None:
                route.alone = now
            elif now - route.alone >= _GRACE_S:
                self._on_reply(pending.number, None, SERVER_LEFT)
                route.requester.forget(pending.number)

    def _has_left(self, pending: PendingCall, here: frozenset[bytes | str]) -> bool:
        """Return whether a request's servers have left, so that it may get no answer any more."""
        route = pending.route
        stranded = route.requester.stranded(pending.number)
        if self._patient:
            return bool(stranded and self.ready())  # there is a server to be asked again
        return stranded or (bool(route.servers) and not route.servers & here)

    # -- the end -----------------------------------------------------------------------------------

    def close(self) -> None:
        """Close what leads to the servers; safe to call twice."""
        with self._lock:
            self._closed = True
            requester, self._requester = self._requester, None
            self._queue.clear()
        if requester is not None:
            requester.close()
