"""The ends of a service over Zenoh: requests are queries, servers are queryables.

Keys and attachments are rmw_zenoh's (its ``docs/design.md`` and released behaviour).

Replies come on Zenoh's "rx" threads, straight into Python. Its "net" threads must not (see
:class:`rosglass.wires.zenoh.endpoints.Pump`), and they are the ones that tell of a query's time
running out, and of the end of a query. So queries are given more time than their caller has, and
are cancelled when that is over; and their end is noticed by Python letting go of the callback.
"""

from __future__ import annotations

import logging
import threading
import time
import weakref
from abc import ABC, abstractmethod
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import zenoh

from rosglass.comm import ConnectionState, EndpointKind
from rosglass.errors import ConnectionLostError, NodeClosedError
from rosglass.wires.base import (
    CALL_DROPPED,
    SERVER_LEFT,
    OnReply,
    OnRequest,
    Replier,
    Requester,
    RequestId,
)
from rosglass.wires.zenoh.endpoints import Declaration, Owner, direct
from rosglass.wires.zenoh.keys import (
    HUMBLE_HASH,
    NO_ATTACHMENT,
    Attachment,
    gid_of,
    topic_key,
    without_hash,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo
    from rosglass.comm.graph import Graph
    from rosglass.wires.zenoh.endpoints import LocalRegistry
    from rosglass.wires.zenoh.options import ZenohOptions

__all__ = ["HeldCall", "Service", "ZenohReplier", "ZenohRequester", "send"]

#: Bytes above which a payload is sent by a thread of its own: it may have to wait for the link.
_BIG = 32_000


class Service:
    """A service, as one of its ends knows it.

    Args:
        options: Of the session.
        endpoint: The end.

    Attributes:
        place: Name and type.
        keys: Its keys by the name of the type's definition, the preferred one first. Humble names
            no definition; the same is meant.
    """

    def __init__(self, options: ZenohOptions, endpoint: EndpointInfo) -> None:
        self.name, self.type, self.hash = endpoint.name, endpoint.type, endpoint.type_hash
        self.place = self.name, self.type
        names = [self.hash or HUMBLE_HASH, HUMBLE_HASH]
        if options.humble:
            names.reverse()
        self.keys = {known: topic_key(options.domain, *self.place, known) for known in names}

    def problem(self, endpoints: Sequence[EndpointInfo], effect: str) -> str:
        """Say which endpoints mean something else by this name, and to what effect."""
        problems: dict[str, None] = {}
        for endpoint in endpoints:
            if endpoint.type != self.type:
                told = f"{endpoint.node} has {endpoint.type} here, not {self.type}: {effect}"
                problems[told] = None
            elif (endpoint.type_hash or HUMBLE_HASH) not in self.keys:
                told = (
                    f"{endpoint.node} has another definition of {self.type} "
                    f"({endpoint.type_hash}, ours is {self.hash}): {effect}; add the robot's "
                    "definition to the library"
                )
                problems[told] = None
        return "; ".join(problems)


def send(job: Callable[[], None], size: int, name: str) -> None:
    """Send at once, or in a thread what is so big that it may have to wait for the link.

    Args:
        job: Sends.
        size: Bytes to be sent.
        name: The thread's name.
    """
    if size > _BIG:
        threading.Thread(target=job, name=name, daemon=True).start()
    else:
        job()


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
        own_servers: LocalRegistry[ZenohReplier],
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


class _Held(ABC):
    """Where a reply goes; only the first counts."""

    __slots__ = ("__weakref__",)

    @abstractmethod
    def answer(self, data: bytes | bytearray) -> None:
        """Send the response."""

    @abstractmethod
    def refuse(self, reason: str) -> None:
        """Tell that there will be no response."""

    @abstractmethod
    def release(self) -> None:
        """Let go of the client."""


class _HeldQuery(_Held):
    """A query that waits for its reply; letting go of it ends the call at the client."""

    __slots__ = ("_name", "_note", "_query")

    def __init__(self, query: zenoh.Query, note: Attachment, name: str) -> None:
        self._query: Any = query
        self._note, self._name = note, name

    def answer(self, data: bytes | bytearray) -> None:
        query, self._query = self._query, None
        if query is None:
            return
        note = self._note._replace(sent=time.time_ns()).encode()

        def answer() -> None:
            with suppress(zenoh.ZError):  # the client, or the session, is gone
                query.reply(query.key_expr, data, attachment=note)
            query.drop()

        send(answer, len(data), f"{self._name} reply")

    def refuse(self, reason: str) -> None:
        query, self._query = self._query, None
        if query is not None:
            with suppress(zenoh.ZError):
                query.reply_err(reason.encode())
            query.drop()

    def release(self) -> None:
        query, self._query = self._query, None
        if query is not None:
            query.drop()


class HeldCall(_Held):
    """A request of the same node.

    Args:
        requester: The client.
        number: The client's number for it.
        server: Identity of the server that holds it.
    """

    __slots__ = ("_number", "_requester", "_server")

    def __init__(self, requester: ZenohRequester, number: int, server: bytes) -> None:
        self._requester: ZenohRequester | None = requester
        self._number, self._server = number, server

    def answer(self, data: bytes | bytearray) -> None:
        """Hand the response over."""
        requester, self._requester = self._requester, None
        if requester is not None:
            requester.answered(self._number, bytes(data))

    def refuse(self, reason: str) -> None:
        """Tell that there will be no response."""
        requester, self._requester = self._requester, None
        if requester is not None:
            requester.refused(self._number, self._server, reason)

    def release(self) -> None:
        """Let go of the client, which sees that the server left."""
        self._requester = None


class ZenohReplier(Declaration, Replier):
    """A service server's token and its queryables.

    Args:
        owner: Keeps the declaration.
        token: The server's token.
        service: What to offer.
        graph: Where clients are looked up.
        on_request: Takes the requests.
        own_servers: Where clients of this very node find it.
    """

    tells_failures = True

    def __init__(
        self,
        owner: Owner,
        token: str,
        service: Service,
        graph: Graph,
        on_request: OnRequest,
        own_servers: LocalRegistry[ZenohReplier],
    ) -> None:
        super().__init__(owner, token)
        self.gid, self.hash = gid_of(token), service.hash
        self._service, self._graph, self._own_servers = service, graph, own_servers
        self._on_request = on_request
        self._waiting: weakref.WeakSet[_Held] = weakref.WeakSet()
        self._warned = False
        self._session: zenoh.Session | None = None
        # What clients look for that know no hashes.
        self._second = without_hash(token, service.hash)
        self._needed = False
        own_servers.add(service.place, self)

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some clients in the graph cannot be served."""
        clients = self._graph.endpoints(EndpointKind.SERVICE_CLIENT, self._service.name)
        return self._service.problem(clients, "it is not served")

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare a queryable for each name of the type's definition; Humble has none."""
        self._session = session
        queryables = [
            session.declare_queryable(
                key,
                direct(self._on_query),
                complete=True,
                allowed_origin=zenoh.Locality.REMOTE,
            )
            for key in self._service.keys.values()
        ]
        for client in self._graph.endpoints(EndpointKind.SERVICE_CLIENT, self._service.name):
            self.client_came(client)
        return queryables

    def client_came(self, client: EndpointInfo) -> None:
        """Show the server once more, as one without hash, to clients that look for such a one.

        Those of Humble's rmw_zenoh find it anyway; those of dora-rs compare the hash.
        """
        ours = (client.name, client.type) == self._service.place
        if not ours or client.type_hash or self._second == self.token or self._session is None:
            return
        with self._lock:
            if self._needed or self._closed:
                return
            self._needed = True
        with suppress(zenoh.ZError):  # the session is closed
            self._keep([self._session.liveliness().declare_token(self._second)])

    def take_own(self, request: RequestId, data: bytes) -> None:
        """Take a request of the same node, in the thread that sends it."""
        if not self._closed and isinstance(request.handle, _Held):
            self._waiting.add(request.handle)
            self._on_request(request, data)

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request; a client that is gone is no error."""
        if isinstance(request.handle, _Held):
            request.handle.answer(data)

    def fail(self, request: RequestId, reason: str) -> None:
        """Tell the client that no response will come."""
        if isinstance(request.handle, _Held):
            request.handle.refuse(reason)

    def close(self) -> None:
        """Withdraw the server; calls without reply end."""
        self._own_servers.remove(self._service.place, self)
        super().close()
        for held in list(self._waiting):
            held.release()

    def _on_query(self, query: zenoh.Query) -> None:
        payload, attached = query.payload, query.attachment
        note = NO_ATTACHMENT if attached is None else Attachment.decode(attached.to_bytes())
        held = _HeldQuery(query, note, self._service.name)
        if self._closed:
            held.release()
            return
        if payload is None:
            if not self._warned:
                self._warned = True
                _log.warning("%s: refusing a request without payload", self._service.name)
            held.refuse("the request has no payload")
            return
        self._waiting.add(held)
        self._on_request(RequestId(note.gid, note.sequence, held), payload.to_bytes())
