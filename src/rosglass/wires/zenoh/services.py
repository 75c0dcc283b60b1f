"""Service clients and servers over Zenoh: requests are queries, servers are queryables.

Keys and attachments are rmw_zenoh's (its ``docs/design.md`` and released behaviour).

Zenoh calls back with replies on its "rx" threads. Its "net" threads must not call into Python (see
:class:`rosglass.wires.zenoh.endpoints.Pump`), but they report the timeout and the end of queries.
So the timeout of a query is longer than that of its call, which cancels it; and its end is noticed
by Python releasing its callback.
"""

from __future__ import annotations

import logging
import threading
import time
import weakref
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh

from rosglass.comm import ConnectionState, EndpointKind
from rosglass.comm.handle import guarded
from rosglass.comm.wire import (
    CALL_DROPPED,
    SERVER_LEFT,
    OnRequest,
    PendingCall,
    Replier,
    Requester,
    RequestId,
)
from rosglass.errors import ConnectionLostError, NodeClosedError
from rosglass.wires.zenoh.endpoints import Declaration, Owner, receive_directly
from rosglass.wires.zenoh.keys import (
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
    from rosglass.wires.zenoh.endpoints import LocalRegistry
    from rosglass.wires.zenoh.options import ZenohOptions

__all__ = ["OpenRequest", "Service", "ZenohReplier", "ZenohRequester", "send"]

#: Size of payloads in bytes above which a thread sends them: they may wait for the link.
_MAX_DIRECT_SIZE = 32_000


class Service:
    """The keys of a service, for its clients and servers.

    Args:
        options: Options of the session.
        endpoint: The client or server.

    Attributes:
        place: Name and type.
        keys: Its keys by type hash, the preferred one first. Humble has no hashes; its key means
            the same definition.
    """

    def __init__(self, options: ZenohOptions, endpoint: EndpointInfo) -> None:
        self.name, self.type, self.hash = endpoint.name, endpoint.type, endpoint.type_hash
        self.place = self.name, self.type
        names = [self.hash or HUMBLE_HASH, HUMBLE_HASH]
        if options.humble:
            names.reverse()
        self.keys = {known: topic_key(options.domain, *self.place, known) for known in names}


def send(job: Callable[[], None], size: int, name: str) -> None:
    """Send a payload, on a thread if it is so large that it may wait for the link.

    Args:
        job: Sends the payload.
        size: Size of the payload in bytes.
        name: Name of the thread.
    """
    if size > _MAX_DIRECT_SIZE:
        threading.Thread(target=job, name=name, daemon=True).start()
    else:
        job()


_log = logging.getLogger("rosglass.ros2")
#: Seconds by which a query's timeout exceeds that of its call, so that it never expires first.
_TIMEOUT_MARGIN_S = 5.0
#: Timeout in seconds of calls without one, such as those for an action's result.
_NO_TIMEOUT_S = 10 * 365 * 86400.0
#: Seconds to wait for a reply after its server has left: changes of the graph arrive sooner.
_LAST_REPLY_TIMEOUT_S = 0.5


@dataclass
class _Query:
    """The query of a call that waits for its reply.

    Attributes:
        cancel: Cancels the query.
        servers: Identities of the servers that may reply.
        lost: Monotonic time at which the call fails, as all servers have left; None otherwise.
        end: Refers to the query's callback.
    """

    cancel: zenoh.CancellationToken
    servers: set[bytes]
    lost: float | None = None
    end: _QueryEnd | None = None


class _ReplyHandler:
    """Handles the replies to one query; Zenoh keeps it until the query ends."""

    __slots__ = ("__weakref__", "_pending", "_requester")

    def __init__(self, requester: ZenohRequester, pending: PendingCall) -> None:
        self._requester, self._pending = requester, pending

    def __call__(self, reply: zenoh.Reply) -> None:
        with guarded(_log, "handling a reply failed"):
            self._requester.on_reply(self._pending, reply)


class _QueryEnd(weakref.ref[_ReplyHandler]):
    """A weak reference that records the end of a query, without running code on that thread."""

    pending: PendingCall


class ZenohRequester(Declaration, Requester):
    """A service client, its token, and its queries.

    Args:
        owner: The middleware.
        token: The client's token.
        endpoint: The client.
        own_servers: The servers of the same node, which are called directly.
    """

    def __init__(
        self,
        owner: Owner,
        token: str,
        endpoint: EndpointInfo,
        own_servers: LocalRegistry[ZenohReplier],
    ) -> None:
        super().__init__(owner, token)
        self._service, self._own_servers = Service(owner.options, endpoint), own_servers
        self._gid = gid_of(token)
        self._session: zenoh.Session | None = None
        self._queriers: dict[str, zenoh.Querier] = {}
        self._known_route: tuple[int, tuple[str, set[bytes]]] = -1, ("", set())
        self._calls: dict[PendingCall, _Query] = {}
        self._ended: deque[weakref.ref[_ReplyHandler]] = deque()

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare queriers, which report whether a query will reach a server."""
        self._session = session
        for name, key in self._service.keys.items():
            self._queriers[name] = session.declare_querier(
                key, target=zenoh.QueryTarget.ALL_COMPLETE
            )
        return list(self._queriers.values())

    def ready(self) -> bool:
        """Return whether a server is in the graph, and queries reach it.

        False while the link is silent: a request would arrive late, if ever.
        """
        return bool(self._local_servers()) or bool(self._route()[1])

    def send(self, pending: PendingCall, data: bytes | bytearray) -> None:
        """Send a request; see :meth:`rosglass.comm.wire.Requester.send`."""
        own, (key, others) = self._local_servers(), self._route()
        servers = others | {replier.gid for replier in own}
        query = _Query(zenoh.CancellationToken(), servers)
        session = self._session
        if session is None and not own:
            raise ConnectionLostError(f"{self._service.name}: not linked with anything yet")
        with self._lock:
            if self._closed:
                raise NodeClosedError(f"the client of {self._service.name} is closed")
            self._calls[pending] = query
        if not servers:
            # Zenoh would end the query without a reply.
            self._fail(pending, SERVER_LEFT)
        if session is not None and others:
            self._get(session, key, pending, query, data)
        for replier in own:
            request = OpenRequest(
                partial(self.on_response, pending),
                partial(self._on_local_refusal, pending, replier.gid),
                lambda: None,  # the client notices that the server has left
            )
            replier.on_local_request(RequestId(self._gid, pending.number, request), bytes(data))

    def forget(self, pending: PendingCall) -> None:
        """Cancel a call, and drop its reply."""
        query = self._calls.pop(pending, None)
        if query is not None:
            query.cancel.cancel()  # type: ignore[no-untyped-call]

    def on_server_left(self, gid: bytes) -> None:
        """Fail the calls that only this server could answer; called when it leaves the graph."""
        for query in tuple(self._calls.values()):
            if gid in query.servers:
                query.servers.discard(gid)
                if not query.servers:
                    query.lost = time.monotonic() + _LAST_REPLY_TIMEOUT_S

    def poll(self) -> None:
        """Fail the calls that cannot be answered any more; called about once a second."""
        if self._session is not None:
            self._session.is_closed()  # entering Zenoh makes Python release dropped callbacks
        while self._ended:
            end = self._ended.popleft()
            assert isinstance(end, _QueryEnd)
            self._fail(end.pending, CALL_DROPPED)
        now = time.monotonic()
        for pending, query in tuple(self._calls.items()):
            if query.lost is not None and now > query.lost:
                self._fail(pending, SERVER_LEFT)

    def close(self) -> None:
        """Undeclare the client, and cancel its calls."""
        super().close()
        for pending in tuple(self._calls):
            self.forget(pending)

    def on_reply(self, pending: PendingCall, reply: zenoh.Reply) -> None:
        """Handle a reply to a query."""
        sample = reply.ok
        if sample is not None:
            attached = sample.attachment
            note = NO_ATTACHMENT if attached is None else Attachment.decode(attached.to_bytes())
            if note.gid == self._gid and note.sequence != pending.number:
                _log.warning("%s: dropping the reply to another call", self._service.name)
                return
            self.on_response(pending, sample.payload.to_bytes())
            return
        query, error = self._calls.get(pending), reply.err
        if query is not None and error is not None:
            reason = error.payload.to_bytes().decode(errors="replace")[:200]
            # Errors do not name their server.
            self.on_refusal(pending, next(iter(query.servers), b""), reason)

    def on_response(self, pending: PendingCall, data: bytes | bytearray) -> None:
        """Handle the first response to a request."""
        if self._calls.pop(pending, None) is not None:
            pending.answer(bytes(data))

    def on_refusal(self, pending: PendingCall, server: bytes, reason: str) -> None:
        """Fail a call once its last server has refused the request."""
        query = self._calls.get(pending)
        if query is not None:
            query.servers.discard(server)
            if not query.servers:
                self._fail(pending, f"its server answered with an error: {reason}")

    def _on_local_refusal(
        self, pending: PendingCall, server: bytes, reason: str, _: object
    ) -> None:
        self.on_refusal(pending, server, reason)

    def _get(
        self,
        session: zenoh.Session,
        key: str,
        pending: PendingCall,
        query: _Query,
        data: bytes | bytearray,
    ) -> None:
        note = Attachment(pending.number, time.time_ns(), self._gid).encode()
        left = pending.left()
        timeout = _NO_TIMEOUT_S if left is None else left + _TIMEOUT_MARGIN_S
        handler = _ReplyHandler(self, pending)
        query.end = _QueryEnd(handler, self._ended.append)
        query.end.pending = pending
        callback = zenoh.handlers.Callback(handler, indirect=False)

        def get() -> None:
            try:
                session.get(
                    key,
                    callback,
                    target=zenoh.QueryTarget.ALL_COMPLETE,
                    consolidation=zenoh.ConsolidationMode.NONE,
                    timeout=timeout,
                    # Requests must arrive, and not wait behind images in their queue.
                    congestion_control=zenoh.CongestionControl.BLOCK,
                    priority=zenoh.Priority.DATA_HIGH,
                    payload=data,
                    attachment=note,
                    cancellation_token=query.cancel,
                    allowed_destination=zenoh.Locality.REMOTE,
                )
            except zenoh.ZError as error:
                self._fail(pending, f"Zenoh refused the request: {error}")

        send(get, len(data), f"{self._service.name} request")

    def _fail(self, pending: PendingCall, error: str) -> None:
        if self._calls.pop(pending, None) is not None:
            pending.fail(error)

    def _local_servers(self) -> list[ZenohReplier]:
        """Return the servers of the same node, which are called directly."""
        found = self._own_servers.find(self._service.place)
        return [one for one in found if one.hash == self._service.hash]

    def _route(self) -> tuple[str, set[bytes]]:
        """Return the key for requests, and the servers of other nodes that declare it."""
        version = self._owner.version
        known, route = self._known_route
        if known != version or not route[1]:
            route = self._find_route()
            self._known_route = version, route
        return route

    def _find_route(self) -> tuple[str, set[bytes]]:
        if self._owner.status().state is not ConnectionState.CONNECTED:
            return "", set()
        servers = self._owner.graph.endpoints(EndpointKind.SERVICE_SERVER, self._service.name)
        own = {replier.gid for replier in self._local_servers()}
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
    with suppress(zenoh.ZError):  # undeclared by now
        status = querier.matching_status
    return bool(getattr(status, "matching", status))


class OpenRequest:
    """A request that waits for its reply, of which only the first counts.

    Args:
        answer: Sends the response.
        refuse: Reports a failure, and sends the response to clients that ignore that.
        release: Releases the client.
    """

    __slots__ = ("__weakref__", "_ends")

    def __init__(
        self,
        answer: Callable[[bytes | bytearray], None],
        refuse: Callable[[str, bytes | bytearray | None], None],
        release: Callable[[], None],
    ) -> None:
        self._ends: tuple[Any, ...] = answer, refuse, release

    def answer(self, data: bytes | bytearray) -> None:
        """Send the response."""
        self._end(0, data)

    def refuse(self, reason: str, instead: bytes | bytearray | None = None) -> None:
        """Report a failure, and send a response to clients that ignore that."""
        self._end(1, reason, instead)

    def release(self) -> None:
        """Release the client, which then detects the end of the call."""
        self._end(2)

    def _end(self, which: int, *arguments: Any) -> None:
        ends, self._ends = self._ends, ()
        if ends:
            ends[which](*arguments)


def _open_query(query: Any, note: Attachment, name: str) -> OpenRequest:
    """Return the request of a query, which ends at the client when it is dropped."""

    def answer(data: bytes | bytearray) -> None:
        attachment = note._replace(sent=time.time_ns()).encode()

        def reply() -> None:
            with suppress(zenoh.ZError):  # the client, or the session, is gone
                query.reply(query.key_expr, data, attachment=attachment)
            query.drop()

        send(reply, len(data), f"{name} reply")

    def refuse(reason: str, instead: bytes | bytearray | None) -> None:
        with suppress(zenoh.ZError):  # the client, or the session, is gone
            query.reply_err(reason.encode())
        if instead is None:
            query.drop()
        else:
            answer(instead)

    return OpenRequest(answer, refuse, query.drop)


class ZenohReplier(Declaration, Replier):
    """A service server, its token, and its queryables.

    Args:
        owner: The middleware.
        token: The server's token.
        endpoint: The server.
        on_request: Handles the requests.
        own_servers: The servers of the node, which its own clients call directly.
    """

    reports_failures = True

    def __init__(
        self,
        owner: Owner,
        token: str,
        endpoint: EndpointInfo,
        on_request: OnRequest,
        own_servers: LocalRegistry[ZenohReplier],
    ) -> None:
        super().__init__(owner, token)
        self._service = service = Service(owner.options, endpoint)
        self.gid, self.hash = gid_of(token), service.hash
        self._own_servers, self._on_request = own_servers, on_request
        self._waiting: weakref.WeakSet[OpenRequest] = weakref.WeakSet()
        self._warned = False
        self._session: zenoh.Session | None = None
        #: The token for clients without type hashes, and whether it is declared.
        self._second = without_hash(token, service.hash)
        self._has_second = False
        own_servers.add(service.place, self)

    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare a queryable for each key."""
        self._session = session
        queryables = [
            session.declare_queryable(
                key,
                receive_directly(self._on_query),
                complete=True,
                allowed_origin=zenoh.Locality.REMOTE,
            )
            for key in self._service.keys.values()
        ]
        for client in self._owner.graph.endpoints(EndpointKind.SERVICE_CLIENT, self._service.name):
            self.on_client(client)
        return queryables

    def on_client(self, client: EndpointInfo) -> None:
        """Announce the server also without type hash if a client has none.

        Clients of Humble's rmw_zenoh find it anyway; those of dora-rs compare the hash.
        """
        ours = (client.name, client.type) == self._service.place
        if not ours or client.type_hash or self._second == self.token or self._session is None:
            return
        with self._lock:
            if self._has_second or self._closed:
                return
            self._has_second = True
        with suppress(zenoh.ZError):  # the session is closed
            self._keep([self._session.liveliness().declare_token(self._second)])

    def on_local_request(self, request: RequestId, data: bytes) -> None:
        """Handle a request of the same node, in the sending thread."""
        if not self._closed and isinstance(request.handle, OpenRequest):
            self._waiting.add(request.handle)
            self._on_request(request, data)

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request; raises nothing if the client is gone."""
        if isinstance(request.handle, OpenRequest):
            request.handle.answer(data)

    def fail(
        self, request: RequestId, reason: str, instead: bytes | bytearray | None = None
    ) -> None:
        """Report the failure, and send the response to clients that ignore errors.

        rmw_zenoh logs an error and goes on waiting for a response; rosglass takes the error, and
        ignores what follows.
        """
        if isinstance(request.handle, OpenRequest):
            request.handle.refuse(reason, instead)

    def close(self) -> None:
        """Undeclare the server, and end its open requests."""
        self._own_servers.remove(self._service.place, self)
        super().close()
        for request in list(self._waiting):
            request.release()

    def _on_query(self, query: zenoh.Query) -> None:
        payload, attached = query.payload, query.attachment
        note = NO_ATTACHMENT if attached is None else Attachment.decode(attached.to_bytes())
        request = _open_query(query, note, self._service.name)
        if self._closed:
            request.release()
            return
        if payload is None:
            if not self._warned:
                self._warned = True
                _log.warning("%s: refusing a request without payload", self._service.name)
            request.refuse("the request has no payload")
            return
        meant = self._owner.name_of(note.gid)
        if meant is not None and meant != self._service.name:
            # As with topics: see ZenohReader.
            _log.warning("%s: refusing a request for %s", self._service.name, meant)
            request.refuse(f"Zenoh delivered the request to {self._service.name}, not to {meant}")
            return
        self._waiting.add(request)
        self._on_request(RequestId(note.gid, note.sequence, request), payload.to_bytes())
