"""The client's end of a service over Zenoh.

Replies come on Zenoh's "rx" threads, straight into Python. Its "net" threads must not (see
:class:`rosglass.wires.zenoh.endpoints.Pump`), and they are the ones that tell of a query's time
running out, and of the end of a query. So queries are given more time than their caller has, and
are cancelled when that is over; and their end is noticed by Python letting go of the callback.
"""

from __future__ import annotations

import logging
import time
import weakref
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import zenoh

from rosglass.comm import ConnectionState, EndpointKind
from rosglass.errors import ConnectionLostError, NodeClosedError
from rosglass.wires.base import CALL_DROPPED, SERVER_LEFT, OnReply, Requester, RequestId
from rosglass.wires.zenoh.endpoints import Declaration, Owner
from rosglass.wires.zenoh.keys import HUMBLE_HASH, Attachment, gid_of
from rosglass.wires.zenoh.replier import HeldCall
from rosglass.wires.zenoh.services import Service, send

if TYPE_CHECKING:
    from rosglass.comm.graph import Graph
    from rosglass.wires.zenoh.local import Places
    from rosglass.wires.zenoh.replier import ZenohReplier

__all__ = ["ZenohRequester"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that a query outlives its caller's patience, so that its time never runs out by itself.
_MARGIN = 5.0
#: Seconds for calls that may take for ever, such as those for an action's result.
_FOREVER = 10 * 365 * 86400.0
#: Seconds that a reply may take to come after its server has left: news of the graph are quicker.
_LINGER = 0.5


@dataclass
class _Call:
    """A request without a reply.

    Attributes:
        cancel: Ends the query.
        servers: Identities of the servers that were asked and have not refused.
        lost: Monotonic time from which no reply can come, for all servers have left; None while one
            is there.
        end: Tells of the query's end.
    """

    cancel: zenoh.CancellationToken
    servers: set[bytes]
    lost: float | None = None
    end: _End | None = None


class _Answer:
    """Takes the replies to one query; Zenoh holds on to it until the query ends."""

    __slots__ = ("__weakref__", "_number", "_requester")

    def __init__(self, requester: ZenohRequester, number: int) -> None:
        self._requester, self._number = requester, number

    def __call__(self, reply: zenoh.Reply) -> None:
        try:
            self._requester.take(self._number, reply)
        except Exception:
            _log.exception("handling a reply received over Zenoh failed")


class _End(weakref.ref[_Answer]):
    """Notices, without running Python code wherever that happens, that an answer was let go."""

    number: int


class ZenohRequester(Declaration, Requester):
    """A service client's token, and its queries.

    Args:
        owner: Keeps the declaration.
        token: The client's token.
        service: What to call.
        graph: Where servers are looked up.
        on_reply: Takes the replies.
        own_servers: The servers of this very node.
    """

    def __init__(
        self,
        owner: Owner,
        token: str,
        service: Service,
        graph: Graph,
        on_reply: OnReply,
        own_servers: Places[ZenohReplier],
    ) -> None:
        super().__init__(owner, token)
        self._service, self._graph, self._own_servers = service, graph, own_servers
        self._gid = gid_of(token)
        self._on_reply = on_reply
        self._session: zenoh.Session | None = None
        self._queriers: dict[str, zenoh.Querier] = {}
        self._known_route: tuple[int, tuple[str, set[bytes]]] = -1, ("", set())
        self._calls: dict[int, _Call] = {}
        self._ended: deque[weakref.ref[_Answer]] = deque()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some servers in the graph cannot be called."""
        servers = self._graph.endpoints(EndpointKind.SERVICE_SERVER, self._service.name)
        return self._service.problem(servers, "it cannot be called")

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare queriers: they tell whether a query will reach a server."""
        self._session = session
        for name, key in self._service.keys.items():
            self._queriers[name] = session.declare_querier(
                key, target=zenoh.QueryTarget.ALL_COMPLETE
            )
        return list(self._queriers.values())

    def ready(self) -> bool:
        """Return whether a server is in the graph, and queries reach it.

        Not while the link is silent: what is sent then arrives, if ever, when it is out of date.
        """
        return bool(self._own()) or bool(self._route()[1])

    def send(self, number: int, data: bytes | bytearray, timeout: float | None) -> None:
        """Send a request; see :meth:`rosglass.wires.base.Requester.send`."""
        own, (key, others) = self._own(), self._route()
        servers = others | {replier.gid for replier in own}
        call = _Call(zenoh.CancellationToken(), servers)
        session = self._session
        if session is None and not own:
            raise ConnectionLostError(f"{self._service.name}: not linked with anything yet")
        with self._lock:
            if self._closed:
                raise NodeClosedError(f"the client of {self._service.name} is closed")
            self._calls[number] = call
        if not servers:
            # Zenoh would end the query without a word.
            self._fail(number, SERVER_LEFT)
        if session is not None and others:
            patience = _FOREVER if timeout is None else timeout + _MARGIN
            self._ask(session, key, number, call, data, patience)
        for replier in own:
            held = HeldCall(self, number, replier.gid)
            replier.take_own(RequestId(self._gid, number, held), bytes(data))

    def forget(self, number: int) -> None:
        """Drop the reply to a request, should it still come."""
        call = self._calls.pop(number, None)
        if call is not None:
            call.cancel.cancel()  # type: ignore[no-untyped-call]

    def server_left(self, gid: bytes) -> None:
        """Give up the calls that waited for this server alone; called when it leaves the graph."""
        for call in tuple(self._calls.values()):
            if gid in call.servers:
                call.servers.discard(gid)
                if not call.servers:
                    call.lost = time.monotonic() + _LINGER

    def poll(self) -> None:
        """End the calls that can get no reply any more; called about once a second."""
        if self._session is not None:
            self._session.is_closed()  # entering Zenoh, Python lets go of callbacks it dropped
        while self._ended:
            end = self._ended.popleft()
            assert isinstance(end, _End)
            self._fail(end.number, CALL_DROPPED)
        now = time.monotonic()
        for number, call in tuple(self._calls.items()):
            if call.lost is not None and now > call.lost:
                self._fail(number, SERVER_LEFT)

    def close(self) -> None:
        """Withdraw the client; replies that still come are dropped."""
        super().close()
        for number in tuple(self._calls):
            self.forget(number)

    def take(self, number: int, reply: zenoh.Reply) -> None:
        """Take a reply, the first that says something; of its query."""
        sample = reply.ok
        if sample is not None:
            self.answered(number, sample.payload.to_bytes())
            return
        call, error = self._calls.get(number), reply.err
        if call is not None and error is not None:
            told = error.payload.to_bytes().decode(errors="replace")[:200]
            # Errors do not say whose they are.
            self.refused(number, next(iter(call.servers), b""), told)

    def answered(self, number: int, data: bytes) -> None:
        """Take a response, unless there was one."""
        if self._calls.pop(number, None) is not None:
            self._on_reply(number, data, "")

    def refused(self, number: int, server: bytes, reason: str) -> None:
        """Take note that a server will send no response."""
        call = self._calls.get(number)
        if call is not None:
            call.servers.discard(server)
            if not call.servers:
                self._fail(number, f"its server answered with an error: {reason}")

    def _ask(
        self,
        session: zenoh.Session,
        key: str,
        number: int,
        call: _Call,
        data: bytes | bytearray,
        patience: float,
    ) -> None:
        note = Attachment(number, time.time_ns(), self._gid).encode()
        answer = _Answer(self, number)
        call.end = _End(answer, self._ended.append)
        call.end.number = number
        callback = zenoh.handlers.Callback(answer, indirect=False)

        def ask() -> None:
            try:
                session.get(
                    key,
                    callback,
                    target=zenoh.QueryTarget.ALL_COMPLETE,
                    consolidation=zenoh.ConsolidationMode.NONE,
                    timeout=patience,
                    # A request must arrive, and not wait behind pictures in their queue.
                    congestion_control=zenoh.CongestionControl.BLOCK,
                    priority=zenoh.Priority.DATA_HIGH,
                    payload=data,
                    attachment=note,
                    cancellation_token=call.cancel,
                    allowed_destination=zenoh.Locality.REMOTE,
                )
            except zenoh.ZError as error:
                self._fail(number, f"Zenoh refused the request: {error}")

        send(ask, len(data), f"{self._service.name} request")

    def _fail(self, number: int, error: str) -> None:
        if self._calls.pop(number, None) is not None:
            self._on_reply(number, None, error)

    def _own(self) -> list[ZenohReplier]:
        """Return the node's own servers, which are called without Zenoh."""
        found = self._own_servers.at(self._service.place)
        return [one for one in found if one.hash == self._service.hash]

    def _route(self) -> tuple[str, set[bytes]]:
        """Return the key to send requests on, and the servers of others that listen to it."""
        version = self._owner.version
        known, route = self._known_route
        if known != version or not route[1]:
            route = self._find_route()
            self._known_route = version, route
        return route

    def _find_route(self) -> tuple[str, set[bytes]]:
        if self._owner.status().state is not ConnectionState.CONNECTED:
            return "", set()
        servers = self._graph.endpoints(EndpointKind.SERVICE_SERVER, self._service.name)
        own = {replier.gid for replier in self._own()}
        for name, key in self._service.keys.items():
            querier = self._queriers.get(name)
            listening = {
                server.gid
                for server in servers
                if server.type == self._service.type and (server.type_hash or HUMBLE_HASH) == name
            } - own
            if listening and querier is not None and _matches(querier):
                return key, listening
        return "", set()


def _matches(querier: zenoh.Querier) -> bool:
    status: Any = False
    with suppress(zenoh.ZError):  # undeclared meanwhile
        status = querier.matching_status
    return bool(getattr(status, "matching", status))
