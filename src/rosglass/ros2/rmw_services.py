"""Services of ROS 2 above a middleware's requesters and repliers.

A client follows the version of the type that servers announce, a server reports clients of other
versions. Neither sends faster than its peers take: a server of ROS 2 keeps the last 10 requests
that it has not taken, of all its clients together, and a client the last 10 replies
(``rmw_qos_profile_services_default``, in every middleware). What comes beyond that displaces the
oldest, and neither side is informed.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, QoS
from rosglass.comm.core import NodeMember
from rosglass.comm.names import similar
from rosglass.comm.service_client import Call, PendingCall, ServiceClient, ServiceRequester
from rosglass.comm.service_server import ServiceServer
from rosglass.errors import Error, NodeClosedError, ServiceError
from rosglass.ros2.announced import Announced, choose, identity, mismatches, nodes_of, rivals
from rosglass.wires.base import SERVER_LEFT, Replier, RequestId

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Hashable, Mapping, Sequence

    from rosglass.comm import Answer, Executor
    from rosglass.comm.timers import Timers
    from rosglass.messages import Message, ServiceType
    from rosglass.ros2.core import Core
    from rosglass.wires.base import OnReply, OnRequest, Requester

__all__ = [
    "HOLD_S",
    "LIMIT",
    "STALL_S",
    "ReplyPacer",
    "RequestWindow",
    "Ros2Replier",
    "Ros2Requester",
    "Ros2ServiceClient",
    "create_service_client",
    "create_service_server",
]

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


def create_service_server(
    core: Core,
    name: str,
    type: ServiceType | str,
    callback: Callable[[Message], Answer | Awaitable[Answer]],
    qos: QoS | None = None,
    executor: Executor | None = None,
) -> ServiceServer:
    """Offer a service in a ROS 2 node.

    Args:
        core: The node.
        name: Absolute service name.
        type: The type, or its name.
        callback: Called with each request; see :meth:`Node.create_service_server`.
        qos: Profile of requests and replies; None for the usual one.
        executor: Where `callback` runs; None for the node's dispatcher, or for the running event
            loop when `callback` is a coroutine function.
    """
    kind, profile = core.types.service(type), qos or QoS.services()

    def create(on_request: OnRequest, quick: bool) -> Replier:
        return Ros2Replier(core, name, kind, profile, on_request, quick)

    return ServiceServer(core, name, kind, callback, profile, executor, create)


class Ros2Replier(Replier, NodeMember):
    """A middleware's replier, with what every ROS 2 server needs besides.

    It names clients of other versions of the type, and other servers of the same service; and it
    sends no more replies at once than a client's queue holds.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        type: The type.
        qos: Profile of requests and replies.
        on_request: Called with each request.
        quick: Whether that only puts a request aside for another thread.
    """

    def __init__(
        self,
        core: Core,
        name: str,
        type: ServiceType,
        qos: QoS,
        on_request: OnRequest,
        quick: bool,
    ) -> None:
        self._core, self._name, self._on_request = core, name, on_request
        self._announced = Announced(core, core.types.service, type, fixed=True)
        self._pacer = ReplyPacer(core.timers)
        self._closed = False
        self._warned = ""
        kind, known = EndpointKind.SERVICE_SERVER, self._announced.hash
        self._replier = core.middleware.create_replier(
            EndpointInfo(kind, name, type.name, core.name, qos, known), self._count_request
        )
        self._replier.quick = quick
        core.add(self)
        core.wake()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some clients cannot be served, in words; empty when all is well."""
        graph = self._core.graph
        clients = graph.endpoints(EndpointKind.SERVICE_CLIENT, self._name)
        problems = mismatches(self._announced, clients, "calls", "it is not served")
        if not problems and self._replier.problem:
            problems.append(self._replier.problem)
        servers = graph.endpoints(EndpointKind.SERVICE_SERVER, self._name)
        others = [server for server in servers if server.node != self._core.name]
        if others:
            problems.append(
                f"{nodes_of(others)} offers {self._name}, too: clients get whichever answer comes "
                "first; end one of the two"
            )
        return "; ".join(problems)

    @property
    def tells_failures(self) -> bool:  # type: ignore[override]
        """Whether :meth:`fail` tells anything."""
        return self._replier.tells_failures

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - the graph alone matters
        """Follow a change of the graph: log what is wrong, once."""
        if not moved or self._closed:
            return
        problem = self.problem
        if problem and problem != self._warned:
            _log.warning("%s: %s", self._name, problem)
        self._warned = problem

    def _count_request(self, request: RequestId, data: bytes | memoryview) -> None:
        self._pacer.on_request(request.client)
        self._on_request(request, data)

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request, as soon as its client can take the reply."""
        if self._pacer.on_reply(request.client):
            self._replier.reply(request, data)
        else:
            self._pacer.send_later(request.client, lambda: self._reply_later(request, data))

    def _reply_later(self, request: RequestId, data: bytes | bytearray) -> None:
        try:
            self._replier.reply(request, data)
        except NodeClosedError:
            pass  # another thread has closed it
        except Error as error:
            _log.error("%s: cannot answer %s: %s", self._name, self.client_name(request), error)

    def fail(self, request: RequestId, reason: str) -> None:
        """Tell the client that no response will come, where the middleware can say so."""
        self._pacer.on_failure(request.client)
        self._replier.fail(request, reason)

    def client_name(self, request: RequestId) -> str:
        """Return who sent a request, for people."""
        clients = self._core.graph.endpoints(EndpointKind.SERVICE_CLIENT, self._name)
        known = [client for client in clients if client.gid and client.gid == request.client]
        if known or len(clients) == 1:
            return nodes_of(known or clients)
        return super().client_name(request)

    def close(self) -> None:
        """Send the replies that wait, and withdraw the service; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._pacer.flush()
        self._replier.close()
        self._core.remove(self)


#: Requests that are open at a time, or replies in a burst: two less than the peer's queue holds.
LIMIT = 8
#: Seconds without an answer after which an open request counts as taken: its server holds it until
#: later, or it is lost.
STALL_S = 30.0
#: The same for requests that a server is known to hold, such as those for an action's result.
HOLD_S = 0.1
#: Seconds that a client is given to take a burst of replies.
_BURST_S = 0.04
#: Clients whose open requests are counted, and replies to one that wait at most: of more, sent to
#: a client that asks faster than it listens, most will be lost.
_MAX_CLIENTS = _MAX_WAITING = 1000


class RequestWindow:
    """The open requests of a node to one service, :data:`LIMIT` at most.

    Args:
        stall_s: Seconds without an answer after which an open request counts as taken.
    """

    def __init__(self, stall_s: float) -> None:
        self._stall_s = stall_s
        self._lock = threading.Lock()
        #: When each that is open was sent, monotonic; the oldest first.
        self._open: dict[Hashable, float] = {}
        #: What to call when there is room, for those that found none.
        self._waiting: dict[Callable[[], None], None] = {}

    def enter(self, request: Hashable, retry: Callable[[], None]) -> bool:
        """Return whether a request may be sent now.

        Args:
            request: It counts until it leaves.
            retry: One of the calls that :meth:`leave` returns when there is room again.
        """
        now = time.monotonic()
        with self._lock:
            if len(self._open) >= LIMIT:
                while self._open and now - next(iter(self._open.values())) >= self._stall_s:
                    del self._open[next(iter(self._open))]
                if len(self._open) >= LIMIT:
                    self._waiting[retry] = None
                    return False
            self._open[request] = now
        return True

    def leave(self, request: Hashable) -> list[Callable[[], None]]:
        """Take note that a request is not open any more; return what to call, without a lock."""
        with self._lock:
            if self._open.pop(request, None) is None or not self._waiting:
                return []
            waiting = list(self._waiting)
            self._waiting.clear()
        return waiting


@dataclass(slots=True)
class _Client:
    """A client that has sent requests.

    Attributes:
        open: How many of them are open.
        paced: Whether they were more than it can take the replies of at once.
        burst: Replies sent since `since`, monotonic.
        waiting: Replies to be sent, in order.
        sending: Whether a thread sends them, or a timer will.
    """

    open: int = 0
    paced: bool = False
    burst: int = 0
    since: float = 0.0
    waiting: list[Callable[[], None]] = field(default_factory=list)
    sending: bool = False


class ReplyPacer:
    """The replies of a server: to clients with many open requests in bursts of :data:`LIMIT`.

    A client with fewer open requests gets each reply at once.

    Args:
        timers: Send what has to wait.
    """

    def __init__(self, timers: Timers) -> None:
        self._timers = timers
        self._lock = threading.Lock()
        self._clients: dict[bytes, _Client] = {}

    def on_request(self, client: bytes) -> None:
        """Count a request."""
        with self._lock:
            known = self._clients.get(client)
            if known is None:
                if len(self._clients) >= _MAX_CLIENTS:
                    self._drop_one()
                known = self._clients[client] = _Client()
            known.open += 1
            if known.open > LIMIT:
                known.paced = True

    def on_reply(self, client: bytes) -> bool:
        """Count a request that is answered; return False if its reply is for :meth:`send_later`."""
        with self._lock:
            known = self._clients.get(client)
            if known is not None:
                if known.paced or known.sending:
                    return False
                self._count_reply(known, time.monotonic())
        return True

    def send_later(self, client: bytes, send: Callable[[], None]) -> None:
        """Send a reply as soon as its client can take it; `send` raises nothing."""
        with self._lock:
            known = self._clients.get(client)
            if known is not None:
                known.waiting.append(send)
                if known.sending:
                    return
                known.sending = True
        if known is None:
            send()
        else:
            self._send_waiting(known)

    def on_failure(self, client: bytes) -> None:
        """Count a request that gets no reply."""
        with self._lock:
            known = self._clients.get(client)
            if known is not None:
                known.open -= 1

    def flush(self) -> None:
        """Send all that waits at once, before the server goes."""
        with self._lock:
            clients = list(self._clients.values())
            self._clients.clear()
        for known in clients:
            while known.waiting:
                with suppress(IndexError):  # another thread sent the last one
                    known.waiting.pop(0)()

    def _send_waiting(self, known: _Client) -> None:
        """Send as much as the client can take now, and the rest later."""
        while True:
            with self._lock:
                if not known.waiting:
                    known.sending = False
                    return
                now = time.monotonic()
                later = known.since + _BURST_S - now
                if later > 0 and known.burst >= LIMIT and len(known.waiting) <= _MAX_WAITING:
                    break
                send = known.waiting.pop(0)
                self._count_reply(known, now)
            send()
        self._timers.after(later, lambda: self._send_waiting(known))

    def _count_reply(self, known: _Client, now: float) -> None:
        """Count a reply that is about to be sent; the lock is held."""
        if now - known.since >= _BURST_S:
            known.burst, known.since, known.paced = 0, now, known.open > LIMIT
        known.burst += 1
        known.open -= 1

    def _drop_one(self) -> None:
        """Forget a client, one without open requests if there is one; the lock is held."""
        idle = (client for client, known in self._clients.items() if known.open <= 0)
        unanswered = (client for client, known in self._clients.items() if not known.waiting)
        client = next(idle, None) or next(unanswered, None)
        if client is not None:
            del self._clients[client]
