"""Services over Zenoh, where requests are queries and servers queryables.

Keys and attachments are rmw_zenoh's (its ``docs/design.md`` and released behaviour).

Replies and requests come on Zenoh's "rx" threads, straight into Python. Its "net" threads must not
(see :class:`rosglass.ros2.zenoh_endpoints.Pump`), and they are the ones that tell of a query's
time running out, and of the end of a query. So queries are given more time than their caller has,
and are cancelled when that is over; and their end is noticed by Python letting go of the callback.
"""

from __future__ import annotations

import itertools
import logging
import threading
import time
import weakref
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import zenoh

from rosglass.comm import ConnectionState, EndpointKind
from rosglass.errors import ConnectionLostError, NodeClosedError
from rosglass.ros2.middleware import (
    CALL_DROPPED,
    SERVER_LEFT,
    OnReply,
    OnRequest,
    Replier,
    Requester,
    RequestId,
)
from rosglass.ros2.zenoh_endpoints import Declaration, Owner, direct
from rosglass.ros2.zenoh_keys import (
    HUMBLE_HASH,
    NO_ATTACHMENT,
    Attachment,
    gid_of,
    topic_key,
    without_hash,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import EndpointInfo
    from rosglass.ros2.graph import Graph
    from rosglass.ros2.zenoh_options import ZenohOptions

__all__ = ["ZenohReplier", "ZenohRequester"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that a query outlives its caller's patience, so that its time never runs out by itself.
_MARGIN = 5.0
#: Seconds for calls that may take for ever, such as those for an action's result.
_FOREVER = 10 * 365 * 86400.0
#: Seconds that a reply may take to come after its server has left: news of the graph are quicker.
_LINGER = 0.5
#: Bytes above which a payload is sent by a thread of its own: it may have to wait for the link.
_BIG = 32_000


@dataclass
class _Call:
    """A request without a reply.

    Attributes:
        cancel: Ends the query.
        servers: Identities of the servers that were asked and have not refused.
        deadline: Monotonic time after which nobody waits for the reply.
        left: Whether all servers have left since.
    """

    cancel: zenoh.CancellationToken
    servers: set[bytes]
    deadline: float
    left: bool = False


class ZenohRequester(Declaration, Requester):
    """A service client's token, and its queries.

    Args:
        owner: Keeps the declaration.
        options: Of the session.
        token: The client's token.
        service: Absolute name of the service.
        type_name: The service's type.
        type_hash: Its RIHS01 hash.
        graph: Where servers are looked up.
        on_reply: Takes the replies.
    """

    def __init__(
        self,
        owner: Owner,
        options: ZenohOptions,
        token: str,
        service: str,
        type_name: str,
        type_hash: str,
        graph: Graph,
        on_reply: OnReply,
    ) -> None:
        super().__init__(owner, token)
        self._service, self._type_name, self._graph = service, type_name, graph
        self._keys = _keys(options, service, type_name, type_hash)
        self._gid = gid_of(token)
        self._on_reply = on_reply
        self._numbers = itertools.count(1)
        self._session: zenoh.Session | None = None
        self._queriers: dict[str, zenoh.Querier] = {}
        self._calls: dict[int, _Call] = {}
        self._ended: deque[int] = deque()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some servers in the graph cannot be called."""
        servers = self._graph.endpoints(EndpointKind.SERVICE_SERVER, self._service)
        return _strangers(servers, self._type_name, self._keys, "it cannot be called")

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare queriers: they tell whether a query will reach a server."""
        self._session = session
        for name, key in self._keys.items():
            self._queriers[name] = session.declare_querier(
                key, target=zenoh.QueryTarget.ALL_COMPLETE
            )
        return list(self._queriers.values())

    def ready(self) -> bool:
        """Return whether a server is in the graph, and queries reach it.

        Not while the link is silent: what is sent then arrives, if ever, when it is out of date.
        """
        return bool(self._route()[1]) and self._owner.status().state is ConnectionState.CONNECTED

    def send(self, data: bytes | bytearray, timeout: float | None) -> int:
        """Send a request; see :meth:`rosglass.ros2.middleware.Requester.send`."""
        key, servers = self._route()
        number = next(self._numbers)
        deadline = float("inf") if timeout is None else time.monotonic() + timeout
        call = _Call(zenoh.CancellationToken(), servers, deadline)
        with self._lock:
            if self._closed:
                raise NodeClosedError(f"the client of {self._service} is closed")
            session = self._session
            if session is None:
                raise ConnectionLostError(f"{self._service}: not linked with anything yet")
            self._calls[number] = call
        if not servers:
            # Zenoh would end the query without a word.
            self._fail(number, SERVER_LEFT)
            return number
        note = Attachment(number, time.time_ns(), self._gid).encode()

        def ask() -> None:
            try:
                session.get(
                    key,
                    zenoh.handlers.Callback(_Answer(self, number), indirect=False),
                    target=zenoh.QueryTarget.ALL_COMPLETE,
                    consolidation=zenoh.ConsolidationMode.NONE,
                    timeout=_FOREVER if timeout is None else timeout + _MARGIN,
                    # A request must arrive, and not wait behind pictures in their queue.
                    congestion_control=zenoh.CongestionControl.BLOCK,
                    priority=zenoh.Priority.DATA_HIGH,
                    payload=data,
                    attachment=note,
                    cancellation_token=call.cancel,
                )
            except zenoh.ZError as error:
                self._fail(number, f"Zenoh refused the request: {error}")

        _start(ask, len(data), f"{self._service} request")
        return number

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
                    call.left, call.deadline = True, time.monotonic() + _LINGER

    def poll(self) -> None:
        """End the calls that can get no reply any more; called about once a second."""
        if self._session is not None:
            self._session.is_closed()  # entering Zenoh, Python lets go of callbacks it dropped
        while self._ended:
            self._fail(self._ended.popleft(), CALL_DROPPED)
        now = time.monotonic()
        for number, call in tuple(self._calls.items()):
            if now > call.deadline and call.left:
                self._fail(number, SERVER_LEFT)
            elif now > call.deadline:
                self.forget(number)

    def close(self) -> None:
        """Withdraw the client; replies that still come are dropped."""
        super().close()
        for number in tuple(self._calls):
            self.forget(number)

    def take(self, number: int, reply: zenoh.Reply) -> None:
        """Take a reply, the first that says something; of its query."""
        call = self._calls.get(number)
        if call is None:
            return
        sample = reply.ok
        if sample is not None:
            if self._calls.pop(number, None) is not None:
                self._on_reply(number, sample.payload.to_bytes(), "")
            return
        error = reply.err
        told = "" if error is None else _text(error.payload)
        with suppress(KeyError):  # errors do not say whose they are
            call.servers.pop()
        if not call.servers:
            self._fail(number, f"its server answered with an error: {told}")

    def ended(self, number: int) -> None:
        """Take note that a query ended; called in any thread, under any lock."""
        self._ended.append(number)

    def _fail(self, number: int, error: str) -> None:
        if self._calls.pop(number, None) is not None:
            self._on_reply(number, None, error)

    def _route(self) -> tuple[str, set[bytes]]:
        """Return the key to send requests on, and the servers that listen to it."""
        servers = self._graph.endpoints(EndpointKind.SERVICE_SERVER, self._service)
        for name, key in self._keys.items():
            querier = self._queriers.get(name)
            listening = {
                server.gid
                for server in servers
                if server.type == self._type_name and (server.type_hash or HUMBLE_HASH) == name
            }
            if listening and querier is not None and _matches(querier):
                return key, listening
        return "", set()


class _Answer:
    """Takes the replies to one query; Zenoh holds on to it until the query ends."""

    __slots__ = ("_number", "_requester")

    def __init__(self, requester: ZenohRequester, number: int) -> None:
        self._requester, self._number = requester, number

    def __call__(self, reply: zenoh.Reply) -> None:
        try:
            self._requester.take(self._number, reply)
        except Exception:
            _log.exception("handling a reply received over Zenoh failed")

    def __del__(self) -> None:
        self._requester.ended(self._number)


class _Held:
    """A query that waits for its reply; letting go of it ends the call at the client."""

    __slots__ = ("__weakref__", "query")

    def __init__(self, query: zenoh.Query) -> None:
        self.query: zenoh.Query | None = query

    def release(self) -> zenoh.Query | None:
        query, self.query = self.query, None
        return query


class ZenohReplier(Declaration, Replier):
    """A service server's token and its queryables; arguments as :class:`ZenohRequester`'s."""

    def __init__(
        self,
        owner: Owner,
        options: ZenohOptions,
        token: str,
        service: str,
        type_name: str,
        type_hash: str,
        graph: Graph,
        on_request: OnRequest,
    ) -> None:
        super().__init__(owner, token)
        self._service, self._type_name, self._graph = service, type_name, graph
        self._keys = _keys(options, service, type_name, type_hash)
        self._on_request = on_request
        self._waiting: weakref.WeakSet[_Held] = weakref.WeakSet()
        self._warned = False
        self._session: zenoh.Session | None = None
        # What clients look for that know no hashes.
        self._second = without_hash(token, type_hash)
        self._needed = False

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some clients in the graph cannot be served."""
        clients = self._graph.endpoints(EndpointKind.SERVICE_CLIENT, self._service)
        return _strangers(clients, self._type_name, self._keys, "it is not served")

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare a queryable for each name of the type's definition; Humble has none."""
        self._session = session
        queryables = [
            session.declare_queryable(key, direct(self._on_query), complete=True)
            for key in self._keys.values()
        ]
        for client in self._graph.endpoints(EndpointKind.SERVICE_CLIENT, self._service):
            self.client_came(client)
        return queryables

    def client_came(self, client: EndpointInfo) -> None:
        """Show the server once more, as one without hash, to clients that look for such a one.

        Those of Humble's rmw_zenoh find it anyway; those of dora-rs compare the hash.
        """
        ours = client.name == self._service and client.type == self._type_name
        if not ours or client.type_hash or self._second == self.token or self._session is None:
            return
        with self._lock:
            if self._needed or self._closed:
                return
            self._needed = True
        with suppress(zenoh.ZError):  # the session is closed
            self._keep([self._session.liveliness().declare_token(self._second)])

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request; a client that is gone is no error."""
        held = request.handle
        query = held.release() if isinstance(held, _Held) else None
        if query is None:
            return
        note = Attachment(request.sequence, time.time_ns(), request.client).encode()

        def answer() -> None:
            with suppress(zenoh.ZError):
                query.reply(query.key_expr, data, attachment=note)
            query.drop()  # type: ignore[no-untyped-call]

        _start(answer, len(data), f"{self._service} reply")

    def fail(self, request: RequestId, reason: str) -> None:
        """Tell the client that no response will come."""
        held = request.handle
        query = held.release() if isinstance(held, _Held) else None
        if query is not None:
            with suppress(zenoh.ZError):
                query.reply_err(reason.encode())
            query.drop()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Withdraw the server; calls without reply end."""
        super().close()
        for held in list(self._waiting):
            query = held.release()
            if query is not None:
                query.drop()  # type: ignore[no-untyped-call]

    def _on_query(self, query: zenoh.Query) -> None:
        payload, attached = query.payload, query.attachment
        if self._closed:
            query.drop()  # type: ignore[no-untyped-call]
            return
        if payload is None:
            if not self._warned:
                self._warned = True
                _log.warning("%s: refusing a request without payload", self._service)
            query.reply_err("the request has no payload")
            query.drop()  # type: ignore[no-untyped-call]
            return
        note = NO_ATTACHMENT if attached is None else Attachment.decode(attached.to_bytes())
        held = _Held(query)
        self._waiting.add(held)
        self._on_request(RequestId(note.gid, note.sequence, held), payload.to_bytes())


def _keys(options: ZenohOptions, service: str, type_name: str, type_hash: str) -> dict[str, str]:
    """Return the keys of a service by the name of the type's definition, the preferred one first.

    Humble names no definition; the same is meant.
    """
    names = [type_hash or HUMBLE_HASH, HUMBLE_HASH]
    if options.humble:
        names.reverse()
    return {name: topic_key(options.domain, service, type_name, name) for name in names}


def _strangers(
    endpoints: list[EndpointInfo], type_name: str, keys: dict[str, str], effect: str
) -> str:
    problems = {}
    for endpoint in endpoints:
        if endpoint.type != type_name:
            problems[f"{endpoint.node} has {endpoint.type} here, not {type_name}: {effect}"] = 0
        elif (endpoint.type_hash or HUMBLE_HASH) not in keys:
            problems[
                f"{endpoint.node} has another definition of {type_name} ({endpoint.type_hash}, "
                f"ours is {min(keys)}): {effect}; add the robot's definition to the library"
            ] = 0
    return "; ".join(problems)


def _matches(querier: zenoh.Querier) -> bool:
    try:
        status = querier.matching_status
    except zenoh.ZError:  # undeclared meanwhile
        return False
    return bool(getattr(status, "matching", status))


def _start(send: Callable[[], None], size: int, name: str) -> None:
    """Send at once, or in a thread what is so big that it may have to wait for the link."""
    if size > _BIG:
        threading.Thread(target=send, name=name, daemon=True).start()
    else:
        send()


def _text(payload: zenoh.ZBytes) -> str:
    return payload.to_bytes().decode(errors="replace")[:200]
