"""The server's end of a service over Zenoh."""

from __future__ import annotations

import logging
import time
import weakref
from abc import ABC, abstractmethod
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import zenoh

from rosglass.comm import EndpointKind
from rosglass.wires.base import OnRequest, Replier, RequestId
from rosglass.wires.zenoh.endpoints import Declaration, Owner, direct
from rosglass.wires.zenoh.keys import NO_ATTACHMENT, Attachment, gid_of, without_hash
from rosglass.wires.zenoh.services import Service, send

if TYPE_CHECKING:
    from rosglass.comm import EndpointInfo
    from rosglass.comm.graph import Graph
    from rosglass.wires.zenoh.local import Places
    from rosglass.wires.zenoh.requester import ZenohRequester

__all__ = ["HeldCall", "ZenohReplier"]

_log = logging.getLogger("rosglass.ros2")


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
        own_servers: Places[ZenohReplier],
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
