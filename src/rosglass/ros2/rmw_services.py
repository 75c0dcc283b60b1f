"""ROS 2 services above a middleware's requesters and repliers.

A client follows the version of the type that servers announce, a server reports clients of other
versions. Neither sends faster than its peers read: a ROS 2 server queues the last 10 requests of
all its clients together, and a client the last 10 replies (``rmw_qos_profile_services_default``, in
every middleware). Further ones displace the oldest, without an error on either side.
"""

from __future__ import annotations

import logging
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, QoS
from rosglass.comm.core import NodeMember
from rosglass.comm.names import similar
from rosglass.comm.service_client import ServiceClient, ServiceRequester
from rosglass.comm.service_server import ServiceServer
from rosglass.comm.wire import SERVER_LEFT, Replier, RequestId
from rosglass.errors import Error, NodeClosedError, ServiceError
from rosglass.ros2.announced import (
    Announced,
    choose_type_name,
    duplicate_servers,
    endpoint_id,
    mismatches,
    nodes_of,
)
from rosglass.ros2.core import REQUEST_LIMIT, RequestWindow

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence

    from rosglass.comm import Answer, Call, Executor
    from rosglass.comm.service_client import PendingCalls
    from rosglass.comm.timers import Timers
    from rosglass.comm.wire import OnRequest, PendingCall, Requester
    from rosglass.messages import Message, ServiceType
    from rosglass.ros2.core import Core

__all__ = [
    "HOLD_S",
    "STALL_S",
    "ActionServiceClient",
    "ReplyPacer",
    "Ros2Replier",
    "Ros2Requester",
    "create_service_client",
    "create_service_server",
]

_log = logging.getLogger("rosglass.ros2")
#: Poll interval in seconds of a server that is in the graph but not linked yet.
_RETRY_S = 0.05


def create_service_client(
    core: Core, name: str, wanted: ServiceType | str | None, qos: QoS | None = None
) -> ServiceClient:
    """Return a service client for a ROS 2 node.

    Args:
        core: The node.
        name: Absolute service name.
        wanted: The type, or its name to use the version that the server announces if the library
            has it; None uses whatever type the server announces.
        qos: Profile of requests and replies; None for the default.
    """
    profile = qos or QoS.services()
    return ServiceClient(core, name, profile, partial(Ros2Requester, core, name, wanted, profile))


class ActionServiceClient(ServiceClient):
    """A client of one of an action's services, whose problems the action client logs.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        type: The type.
        waits_for_reconnect: Whether calls survive the loss of their server; its requests may stay
            open for long.
    """

    _requester: Ros2Requester

    def __init__(
        self, core: Core, name: str, type: ServiceType, *, waits_for_reconnect: bool = False
    ) -> None:
        profile = QoS.services()
        create = partial(
            Ros2Requester,
            core,
            name,
            type,
            profile,
            waits_for_reconnect=waits_for_reconnect,
            quiet=True,
        )
        super().__init__(core, name, profile, create)

    @property
    def middleware_problem(self) -> str:
        """Why its middleware cannot call some servers in the graph; empty if it can."""
        return self._requester.middleware_problem

    def server_ids(self) -> frozenset[bytes | str]:
        """Return the identities of the servers that understand the requests."""
        return self._requester.server_ids()

    def withdraw(self, call: Call) -> bool:
        """Cancel a call if its request was not sent yet; return whether it was cancelled."""
        return self._withdraw(call)


class Ros2Requester(ServiceRequester):
    """The requester of a service client, for the version of the type that servers announce.

    It keeps no more requests open than a server's queue holds, and ends calls whose servers left.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        wanted: The type, its name, or None; see :func:`create_service_client`.
        qos: Profile of requests and replies.
        calls: The calls that have not ended.
        on_change: Called when a server may have appeared or left.
        waits_for_reconnect: See :class:`ActionServiceClient`.
        quiet: Whether the client's owner logs conflicts.
    """

    def __init__(
        self,
        core: Core,
        name: str,
        wanted: ServiceType | str | None,
        qos: QoS,
        calls: PendingCalls,
        on_change: Callable[[], None],
        *,
        waits_for_reconnect: bool = False,
        quiet: bool = False,
    ) -> None:
        self._core, self._name, self._qos, self._quiet = core, name, qos, quiet
        self._waits_for_reconnect = waits_for_reconnect
        self._calls, self._on_change = calls, on_change
        self._discovers = wanted is None
        given = None if wanted is None else core.types.service(wanted)
        fixed = wanted is not None and not isinstance(wanted, str)
        self._announced: Announced[ServiceType] = Announced(core, core.types.service, given, fixed)
        self.type = given
        #: Guards the current requester and the flags of :meth:`_flush`.
        self._lock = threading.Lock()
        #: None while the type is unknown, and after closing.
        self._requester: Requester | None = None
        stall_s = HOLD_S if waits_for_reconnect else STALL_S
        self._window = core.windows.setdefault(name, RequestWindow(stall_s))
        self._flushing = self._again = self._retrying = self._closed = False
        self._choice = self._failure = ""
        self._adopt(retry=True)
        if self._announced.type is not None:
            self._connect(self._announced.type)

    # -- servers -----------------------------------------------------------------------------------

    @property
    def warn_level(self) -> int | None:  # type: ignore[override]
        """The level at which the client logs conflicts; None if its owner logs them."""
        if self._quiet:
            return None
        return logging.INFO if self._announced.pending else logging.WARNING

    @property
    def middleware_problem(self) -> str:
        """Why the middleware cannot call some servers in the graph; empty if it can."""
        requester = self._requester
        return "" if requester is None else requester.problem

    def ready(self) -> bool:
        """Return whether a server of this type and version is linked."""
        requester = self._requester
        if requester is None:
            return False
        servers = self._servers()
        return not (servers and not self._fitting(servers)) and requester.ready()

    def server_ids(self) -> frozenset[bytes | str]:
        """Return the identities of the servers of this type and version."""
        return frozenset(map(endpoint_id, self._fitting(self._servers())))

    def server_name(self) -> str:
        """Return the names of the nodes that offer the service, for messages."""
        return nodes_of(self._fitting(self._servers())) or "its server"

    def _servers(self) -> list[EndpointInfo]:
        return self._core.graph.endpoints(EndpointKind.SERVICE_SERVER, self._name)

    def _fitting(self, servers: Sequence[EndpointInfo]) -> list[EndpointInfo]:
        return [server for server in servers if self._announced.is_compatible(server)]

    def server_conflicts(self) -> list[str]:
        """Return the conflicts with servers, one sentence each."""
        problems = [self._choice, self._announced.failure, self._failure]
        problems = [text for text in problems if text]
        if not problems:
            servers = self._servers()
            problems = mismatches(self._announced, servers, "offers", "it cannot be called")
            # The middleware's reason is more precise than the one about several servers.
            others = duplicate_servers(self._fitting(servers), self._name)
            problem = self.middleware_problem
            problems += [problem] if problem and not problems else others
        return problems

    def unavailable_reason(self) -> str:
        """Return why no server is available although none conflicts."""
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

    def find_server(self) -> None:
        """Do nothing: servers are discovered by the graph."""

    def delay(self, pending: PendingCall) -> str:  # noqa: ARG002 - the same for all
        """Return why a request was not sent although no server conflicts."""
        if self.ready():
            return (
                f"{REQUEST_LIMIT} requests before it still wait for {self.server_name()} to answer"
            )
        return "its server appeared too late"

    # -- sending -----------------------------------------------------------------------------------

    def send(self, pending: PendingCall) -> None:
        """Send a request as soon as a server is available, in the order of the calls."""
        self._calls.enqueue(pending)
        self._flush()

    def forget(self, pending: PendingCall) -> None:
        """Ignore the response of an ended call, and make room for another request."""
        if pending.requester is not None and not pending.answered:
            pending.requester.forget(pending)
        for send in self._window.leave(pending):
            if pending.private:  # this may run while the middleware receives
                self._core.timers.after(0.0, send)
            else:
                send()

    def _flush(self) -> None:
        """Send the queued requests, in order, if a server is available."""
        with self._lock:
            if self._flushing:
                self._again = True  # the thread that is flushing repeats
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
        if self._calls.waiting and not self._retrying and self._fitting(self._servers()):
            # The server is not linked yet, or holds requests: no event reports the change.
            self._retrying = True
            self._core.timers.after(_RETRY_S, self._retry)

    def _send_waiting(self) -> None:
        while self._calls.waiting and self.ready():
            pending = self._calls.first()
            with self._lock:
                requester, kind = self._requester, self.type
            if pending is None or requester is None or kind is None:
                return
            if not self._window.enter(pending, self._flush):
                return
            if self._calls.take(pending) and not pending.call.done():
                self._send(requester, kind, pending)
            else:
                self.forget(pending)  # it has just been withdrawn

    def _retry(self) -> None:
        self._retrying = False
        self._flush()

    def _send(self, requester: Requester, kind: ServiceType, pending: PendingCall) -> None:
        error: Error
        try:
            data = pending.encode(kind)
            pending.requester, pending.servers = requester, self.server_ids()
            pending.sent = time.monotonic()
            requester.send(pending, data)
        except Error as problem:
            error = problem
        except Exception as problem:  # noqa: BLE001 - the caller waits for it
            _log.exception("%s: sending a request failed", self._name)
            error = ServiceError(f"{self._name}: the request could not be sent: {problem}")
        else:
            if pending.call.done() and not pending.answered:
                requester.forget(pending)  # cancelled while it was sent
            return
        pending.call.set_exception(error)

    # -- following the graph -----------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - definitions may be added
        """Update the type, readiness, the queue and lost calls after a change of the graph."""
        if self._adopt(retry=idle) and self._announced.type is not None:
            try:
                self._connect(self._announced.type)
                self._failure = ""
            except Error as error:
                self._failure = str(error)
        self._on_change()
        self._flush()
        self._find_lost_calls()

    def _adopt(self, *, retry: bool) -> bool:
        """Adopt the type that servers announce; return whether it has changed."""
        servers = self._servers()
        name = "" if self._announced.type is None else self._announced.type.name
        self._choice = ""
        if self._discovers:
            example = f"create_service_client({self._name!r}, {{}})"
            name, self._choice = choose_type_name((s.type for s in servers), name, example)
        return bool(name) and self._announced.follow(name, servers, retry)

    def _connect(self, kind: ServiceType) -> None:
        """Replace the requester with one for the type `kind`."""
        core, known = self._core, self._announced.hash
        requester = core.middleware.create_requester(
            EndpointInfo(
                EndpointKind.SERVICE_CLIENT, self._name, kind.name, core.name, self._qos, known
            )
        )
        requester.changed = core.wake
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
            for pending in self._calls:
                if pending.requester is old:
                    pending.fail(SERVER_LEFT)

    def _find_lost_calls(self) -> None:
        """Note since when the servers of sent requests are missing."""
        now = time.monotonic()
        for pending in self._calls:
            if pending.requester is None:
                continue
            if not pending.servers:
                pending.servers = self.server_ids()
            if not self._is_lost(pending, pending.requester):
                pending.lost_at = None
            elif pending.lost_at is None:
                pending.lost_at = now

    def has_left(self, pending: PendingCall) -> bool:
        """Return whether the servers that a request was sent to have left the graph."""
        return bool(pending.servers) and not pending.servers & self.server_ids()

    def _is_lost(self, pending: PendingCall, requester: Requester) -> bool:
        """Return whether a call has no server any more that may answer it."""
        lost = requester.is_reply_lost(pending) or self._is_replaced(pending)
        if self._waits_for_reconnect:
            return bool(lost and self.ready())  # it can be sent again
        return lost or self.has_left(pending)

    def _is_replaced(self, pending: PendingCall) -> bool:
        """Return whether each of a request's servers has a successor of the same node name.

        A killed server stays in the graph of DDS for 10 to 20 s, although its successor answers.
        """
        servers = self._fitting(self._servers())
        successors = {each.node for each in servers if endpoint_id(each) not in pending.servers}
        asked = [each.node for each in servers if endpoint_id(each) in pending.servers]
        return bool(asked) and all(node.name and node in successors for node in asked)

    def close(self) -> None:
        """Close the requester; safe to call twice."""
        with self._lock:
            self._closed = True
            requester, self._requester = self._requester, None
        if requester is not None:
            requester.close()


def create_service_server(
    core: Core,
    name: str,
    type: ServiceType | str,
    callback: Callable[[Message], Answer | Awaitable[Answer]],
    qos: QoS | None = None,
    executor: Executor | None = None,
    answers_failures: bool = False,
) -> ServiceServer:
    """Return a service server for a ROS 2 node.

    Args:
        core: The node.
        name: Absolute service name.
        type: The type, or its name.
        callback: Called with each request; see :meth:`Node.create_service_server`.
        qos: Profile of requests and replies; None for the default.
        executor: Runs `callback`; None for the node's dispatcher, or for the running event loop if
            `callback` is a coroutine function.
        answers_failures: See :meth:`Node.create_service_server`.
    """
    kind, profile = core.types.service(type), qos or QoS.services()
    create = partial(Ros2Replier, core, name, kind, profile)
    return ServiceServer(
        core, name, kind, callback, profile, executor, create, answers_failures=answers_failures
    )


class Ros2Replier(Replier, NodeMember):
    """The replier of a service server, above a middleware's.

    It reports clients of other versions of the type and other servers of the same service, and
    sends no more replies at once than a client's queue holds.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        type: The type.
        qos: Profile of requests and replies.
        on_request: Called with each request.
        quick: Whether `on_request` only queues a request for another thread.
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
        """Why some clients cannot be served, in words; empty if all can."""
        graph = self._core.graph
        clients = graph.endpoints(EndpointKind.SERVICE_CLIENT, self._name)
        problems = mismatches(self._announced, clients, "calls", "it is not served")
        if not problems and self._replier.problem:
            problems.append(self._replier.problem)
        servers = graph.endpoints(EndpointKind.SERVICE_SERVER, self._name)
        others = [server for server in servers if server.node != self._core.name]
        if others:
            problems.append(
                f"{nodes_of(others)} offers {self._name}, too: clients get whichever reply arrives "
                "first; stop one of the two"
            )
        return "; ".join(problems)

    @property
    def reports_failures(self) -> bool:  # type: ignore[override]
        """True if the middleware can carry :meth:`fail`."""
        return self._replier.reports_failures

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - the graph alone matters
        """Log a new problem after a change of the graph."""
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
        """Send a reply, as soon as its client can take it."""
        self._pace(request, lambda: self._replier.reply(request, data))

    def _send_later(self, request: RequestId, send: Callable[[], None]) -> None:
        try:
            send()
        except NodeClosedError:
            pass  # closed by another thread
        except Error as error:
            _log.error("%s: cannot answer %s: %s", self._name, self.client_name(request), error)

    def fail(
        self, request: RequestId, reason: str, instead: bytes | bytearray | None = None
    ) -> None:
        """Report a failure, or send a response instead, as soon as the client can take it."""
        if instead is not None:
            self._pace(request, lambda: self._replier.fail(request, reason, instead))
        else:
            self._pacer.on_failure(request.client)
            self._replier.fail(request, reason)

    def _pace(self, request: RequestId, send: Callable[[], None]) -> None:
        if self._pacer.on_reply(request.client):
            send()
        else:
            self._pacer.send_later(request.client, lambda: self._send_later(request, send))

    def client_name(self, request: RequestId) -> str:
        """Return the name of a request's client, for messages."""
        clients = self._core.graph.endpoints(EndpointKind.SERVICE_CLIENT, self._name)
        known = [client for client in clients if client.gid and client.gid == request.client]
        if known or len(clients) == 1:
            return nodes_of(known or clients)
        return super().client_name(request)

    def close(self) -> None:
        """Send the delayed replies and withdraw the service; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._pacer.flush()
        self._replier.close()
        self._core.remove(self)


#: Seconds after which an open request without response counts as taken: its server holds it, or it
#: is lost.
STALL_S = 30.0
#: The same for requests that servers hold by design, such as those for an action's result.
HOLD_S = 0.1
#: Seconds from one burst of replies to a client to the next.
_BURST_S = 0.04
#: Maximum numbers of clients whose open requests are counted, and of delayed replies to one client:
#: a client that sends requests faster than it reads replies loses most further ones.
_MAX_CLIENTS = _MAX_WAITING = 1000


@dataclass(slots=True)
class _Client:
    """A client that has sent requests.

    Attributes:
        open: Number of open requests.
        paced: Whether more requests were open than a burst has replies.
        burst: Replies sent since the monotonic time `since`.
        waiting: Delayed replies, in order.
        sending: Whether a thread or timer is sending them.
    """

    open: int = 0
    paced: bool = False
    burst: int = 0
    since: float = 0.0
    waiting: list[Callable[[], None]] = field(default_factory=list)
    sending: bool = False


class ReplyPacer:
    """Sends replies to clients with many open requests in bursts of :data:`REQUEST_LIMIT`.

    A client with fewer open requests gets each reply at once.

    Args:
        timers: Send the delayed replies.
    """

    def __init__(self, timers: Timers) -> None:
        self._timers = timers
        #: Guards the clients: requests arrive and replies are sent on different threads.
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
            if known.open > REQUEST_LIMIT:
                known.paced = True

    def on_reply(self, client: bytes) -> bool:
        """Count a reply; return False if it must be sent with :meth:`send_later`."""
        with self._lock:
            known = self._clients.get(client)
            if known is not None:
                if known.paced or known.sending:
                    return False
                self._count_reply(known, time.monotonic())
        return True

    def send_later(self, client: bytes, send: Callable[[], None]) -> None:
        """Send a reply as soon as its client can take it; `send` must not raise."""
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
        """Count a request that will get no reply."""
        with self._lock:
            known = self._clients.get(client)
            if known is not None:
                known.open -= 1

    def flush(self) -> None:
        """Send all delayed replies now, before the server closes."""
        with self._lock:
            clients = list(self._clients.values())
            self._clients.clear()
        for known in clients:
            while known.waiting:
                with suppress(IndexError):  # another thread sent the last one
                    known.waiting.pop(0)()

    def _send_waiting(self, known: _Client) -> None:
        """Send the replies that the client can take now, and schedule the others."""
        while True:
            with self._lock:
                if not known.waiting:
                    known.sending = False
                    return
                now = time.monotonic()
                later = known.since + _BURST_S - now
                if (
                    later > 0
                    and known.burst >= REQUEST_LIMIT
                    and len(known.waiting) <= _MAX_WAITING
                ):
                    break
                send = known.waiting.pop(0)
                self._count_reply(known, now)
            send()
        self._timers.after(later, lambda: self._send_waiting(known))

    def _count_reply(self, known: _Client, now: float) -> None:
        """Count a reply that is about to be sent; the lock is held."""
        if now - known.since >= _BURST_S:
            known.burst, known.since, known.paced = 0, now, known.open > REQUEST_LIMIT
        known.burst += 1
        known.open -= 1

    def _drop_one(self) -> None:
        """Remove a client, preferably one without open requests; the lock is held."""
        idle = (client for client, known in self._clients.items() if known.open <= 0)
        unanswered = (client for client, known in self._clients.items() if not known.waiting)
        client = next(idle, None) or next(unanswered, None)
        if client is not None:
            del self._clients[client]
