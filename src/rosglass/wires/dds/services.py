"""Service clients and servers over DDS, for peers of every DDS implementation.

A service sends each reply to all its clients, which pick their own. How depends on the peer; see
:class:`rosglass.wires.dds.service_endpoints.Scheme`. rmw_cyclonedds inserts 16 bytes after the
encapsulation header of requests and replies: the client's number and the request's, which a server
returns unchanged. As they are 16, the rest of the payload stays aligned.
"""

from __future__ import annotations

import logging
import math
import secrets
import struct
import threading
import time
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.comm.handle import guarded
from rosglass.comm.wire import SERVER_LEFT, Replier, Requester, RequestId
from rosglass.errors import NodeClosedError, ServiceError, TimeoutError, UnsupportedError  # noqa: A004
from rosglass.wires.dds import cyclone_identity
from rosglass.wires.dds.cyclone_identity import UNKNOWN_GUID, Identity, Origin
from rosglass.wires.dds.cyclone_samples import COPIED
from rosglass.wires.dds.graph import parse_user_data
from rosglass.wires.dds.service_endpoints import (
    PREFIX,
    REMEDY,
    Scheme,
    ServiceEndpoints,
    in_main_thread,
    in_this_process,
    names_of,
    scheme_of,
)

if TYPE_CHECKING:
    from rosglass.comm import EndpointInfo
    from rosglass.comm.graph import Graph
    from rosglass.comm.wire import OnRequest, PendingCall
    from rosglass.wires.dds.cyclone import Discovered
    from rosglass.wires.dds.endpoints import Taken
    from rosglass.wires.dds.participant import Participant

__all__ = [
    "DdsReplier",
    "DdsRequester",
    "Parts",
    "header_of",
    "pack_header",
    "unpack_header",
    "with_header",
    "without_header",
]

#: A payload in one piece or several.
Parts = tuple["bytes | bytearray | memoryview", ...]

_IDS, _IDS_BIG = struct.Struct("<Qq"), struct.Struct(">Qq")
_ENCAPSULATION = 4
_END = _ENCAPSULATION + _IDS.size


def pack_header(client: int, number: int) -> bytes:
    """Return a header, little endian."""
    return _IDS.pack(client, number)


def unpack_header(data: bytes | memoryview) -> tuple[int, int] | None:
    """Return the client's number and the request's; None if the payload is too short."""
    if len(data) < _END:
        return None
    client, number = (_IDS if data[1] & 1 else _IDS_BIG).unpack_from(data, _ENCAPSULATION)
    return client, number


def header_of(data: bytes | memoryview) -> bytes:
    """Return the header of a payload that has one."""
    return bytes(data[_ENCAPSULATION:_END])


def with_header(data: bytes | bytearray, header: bytes) -> Parts:
    """Return a payload with a header inserted."""
    if len(data) <= COPIED:
        return (b"".join((data[:_ENCAPSULATION], header, data[_ENCAPSULATION:])),)
    view = memoryview(data)
    return view[:_ENCAPSULATION], header, view[_ENCAPSULATION:]


def without_header(data: bytes | memoryview) -> bytes:
    """Return a payload with its header removed."""
    return b"".join((data[:_ENCAPSULATION], data[_END:]))


_log = logging.getLogger("rosglass.ros2")
#: Seconds after which a request reader without reply writer counts as not being a server's.
_ANSWERLESS_S = 2.0


@dataclass(slots=True)
class _Route:
    """How a request was sent; its call refers to it until the reply is of no use.

    Attributes:
        key: The number that identifies its reply: the call's with a header, else the negative one
            of the request; None before it was sent.
        readers: Handles of the servers' readers that have been linked ever since it was sent.
    """

    key: int | None = None
    readers: frozenset[int] = frozenset()


class DdsRequester(Requester):
    """The DDS writer and reader of a service client; arguments as for :class:`ServiceEndpoints`.

    Attributes:
        gid: Identity of its request writer, which identifies the client.
    """

    def __init__(self, participant: Participant, graph: Graph, endpoint: EndpointInfo) -> None:
        self._service = endpoint.name
        self._handling = guarded(_log, "%s: a reply is lost", endpoint.name)
        #: Guards the calls, and sending: replies are received on other threads.
        self._lock = threading.Lock()
        #: A random number in place of rmw_cyclonedds's instance handle; unique in the domain.
        self._id = secrets.randbits(64)
        #: The sent calls, by what identifies their replies; the `route` of each is a `_Route`.
        self._calls: dict[int, PendingCall] = {}
        self._sequence = 0
        #: Handles of the linked servers' request readers; they change with a reconnection.
        self._linked: dict[Scheme, frozenset[int]] = {}
        #: How requests are sent now; None if no server is linked.
        self._scheme: Scheme | None = None
        #: When request readers without a known server appeared, and when to check them again.
        self._unlinked: dict[bytes, float] = {}
        self._recheck = math.inf
        self._endpoints = ServiceEndpoints(
            participant, graph, endpoint, self._on_replies, self._on_matched
        )
        assert self._endpoints.writer is not None
        self._writer = self._endpoints.writer
        self.gid = self._writer.guid
        self._endpoints.origins.set_receiver(self._on_received)
        self._endpoints.start()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some servers in the graph cannot be called."""
        foreign_peers = self._endpoints.foreign_peers()
        if not foreign_peers:
            return ""
        names = names_of(foreign_peers)
        if reason := cyclone_identity.reading.problem:
            return f"{names} cannot be called: {reason}; {REMEDY}"
        if Scheme.HEADER in self._schemes():
            return (
                f"{names} and a server on Cyclone DDS offer {self._service} in ways that exclude "
                "each other: only the former is called; end one of them"
            )
        return ""

    def ready(self) -> bool:
        """Return whether a server's request reader and its reply writer are matched."""
        if time.monotonic() >= self._recheck:
            self._endpoints.refresh()
        return self._scheme is not None and not self._endpoints.closed

    def send(self, pending: PendingCall, data: bytes | bytearray) -> None:
        """Send a request; see :meth:`rosglass.comm.wire.Requester.send`."""
        if self._endpoints.closed:
            raise NodeClosedError(f"the client of {self._service} is closed")
        pending.route = _Route()

        def expired() -> None:
            self._fail(pending, "its server takes no requests")

        timeout = pending.left()
        self._endpoints.outbox.put(
            lambda: self._send(pending, data),
            float("inf") if timeout is None else timeout,
            expired,
            # An exception from a signal in the main thread must not spoil the sequence count.
            now=self._scheme is not Scheme.IDENTITY or not in_main_thread(),
        )

    def is_reply_lost(self, pending: PendingCall) -> bool:
        """Return whether a request's servers have left, so that their replies are lost."""
        route: _Route | None = pending.route
        return route is not None and route.key is not None and not route.readers

    def forget(self, pending: PendingCall) -> None:
        """Drop the reply to a request, if it still arrives."""
        with self._lock:
            self._drop(pending)

    def close(self) -> None:
        """Withdraw the client; replies that still arrive are dropped."""
        if self._endpoints.closed:
            return
        self._endpoints.origins.set_receiver(None)
        self._endpoints.close()
        with self._lock:
            for pending in list(self._calls.values()):
                self._drop(pending)

    def _send(self, pending: PendingCall, data: bytes | bytearray) -> bool:
        """Send a request; return False if it must be tried again."""
        # A server that has just appeared must not get a request that it would misread.
        self._endpoints.refresh_readers()
        if self._scheme is Scheme.HEADER and self._endpoints.foreign_peers():
            self._endpoints.refresh()
        scheme = self._scheme
        if scheme is None:
            if self._schemes().get(Scheme.IDENTITY) is False and pending.route is not None:
                return False  # a server is about to be ready
            self._fail(pending, SERVER_LEFT)
            return True
        parts: Parts = (data,)
        if scheme is Scheme.HEADER:
            parts = with_header(data, pack_header(self._id, pending.number))
        # Replies are looked up under the same lock: they may arrive before this returns.
        with self._lock:
            route: _Route | None = pending.route
            if route is None or self._endpoints.closed:
                return True
            if scheme is Scheme.IDENTITY and self._sequence < 0:
                raise ServiceError(
                    f"a request on {self._service} was interrupted, and replies to later ones "
                    "cannot be assigned; make another client"
                )
            sequence, self._sequence = self._sequence, -1
            try:
                self._writer.write_parts(parts)
            except (NodeClosedError, TimeoutError, UnsupportedError) as error:
                self._sequence = sequence  # nothing was sent
                if isinstance(error, TimeoutError):
                    return False
                raise
            self._sequence = sequence + 1 if sequence >= 0 else -1
            route.key = key = pending.number if scheme is Scheme.HEADER else -self._sequence
            route.readers = self._linked.get(scheme, frozenset())
            self._calls[key] = pending
        return True

    def _on_received(self, origin: Origin, data: bytes | memoryview) -> bool:
        """Take a reply on the receiving thread; return False to get it from the pump instead."""
        # A thread that holds the lock may be sending, and must not block the receiving thread.
        if not self._lock.acquire(blocking=False):
            return False
        try:
            claim = self._match(origin.related, data)
            if claim is None or not claim[0].private:
                return False
            self._drop(claim[0])
        finally:
            self._lock.release()
        self._answer(*claim, data)
        return True

    def _on_replies(self, taken: list[Taken]) -> None:
        for data, _, handle, described in taken:
            server, origin = self._endpoints.find_sender(handle, described)
            if origin is not None and origin.taken:
                continue
            with self._handling:
                self._take(None if server is None else server.guid, data, origin)

    def _take(self, server: bytes | None, data: bytes | memoryview, origin: Origin | None) -> None:
        related = None if origin is None else origin.related
        with self._lock:
            claim = self._match(related, data)
            if claim is not None:
                self._drop(claim[0])
        if claim is not None:
            self._answer(*claim, data)
        elif related is not None or server is None:
            pass  # another client's reply, or one to a forgotten request
        elif scheme_of(server) is Scheme.IDENTITY:
            if not cyclone_identity.reading.problem:
                text = "ignoring replies of %s, which do not say what they answer"
                self._endpoints.log_peer(server, text)
        # Replies to other clients in this process carry no identity.
        elif unpack_header(data) is None and not in_this_process(server):
            text = "ignoring a reply of %s, which is too short for its header: %d bytes"
            self._endpoints.log_peer(server, text, len(data))

    def _match(
        self, related: Identity | None, data: bytes | memoryview
    ) -> tuple[PendingCall, Scheme] | None:
        """Return the open call that a reply answers, and the scheme that identifies it."""
        found, scheme = None, Scheme.IDENTITY
        if related is not None and related.guid in (self.gid, self._endpoints.reader.guid):
            found = self._calls.get(-related.sequence)
        if found is None and (header := unpack_header(data)) is not None and header[0] == self._id:
            scheme = Scheme.HEADER
            found = self._calls.get(header[1])
        return None if found is None else (found, scheme)

    def _drop(self, pending: PendingCall) -> bool:
        """Close a call; return whether it was open. The lock is held."""
        route: _Route | None
        route, pending.route = pending.route, None
        if route is not None and route.key is not None:
            self._calls.pop(route.key, None)
        return route is not None

    def _answer(self, pending: PendingCall, scheme: Scheme, data: bytes | memoryview) -> None:
        pending.answer(without_header(data) if scheme is Scheme.HEADER else data)

    def _fail(self, pending: PendingCall, error: str) -> None:
        with self._lock:
            known = self._drop(pending)
        if known:
            pending.fail(error)

    def _route(self) -> Scheme | None:
        """Return how to send requests; None if no server is linked."""
        schemes = self._schemes()
        if schemes.get(Scheme.IDENTITY) is not None and not cyclone_identity.reading.problem:
            # Most servers on Cyclone DDS reject such requests as too short; the others would read a
            # header as arguments: nothing is sent until they are ready.
            return Scheme.IDENTITY if schemes[Scheme.IDENTITY] else None
        return Scheme.HEADER if Scheme.HEADER in schemes else None

    def _schemes(self) -> dict[Scheme, bool]:
        """Return the schemes of the linked servers, and whether replies are sure to arrive."""
        endpoints, now = self._endpoints, time.monotonic()
        answering = {
            _server_of(found): endpoints.is_settled(found.guid) for found in endpoints.writers.all
        }
        schemes: dict[Scheme, bool] = {}
        unlinked: dict[bytes, float] = {}
        for found in () if endpoints.readers is None else endpoints.readers.all:
            scheme = scheme_of(found.guid)
            settled = answering.get(_server_of(found))
            if settled is None and scheme is Scheme.IDENTITY:
                # Its reply writer will be discovered soon, unless it only listens.
                unlinked[found.guid] = since = self._unlinked.get(found.guid, now)
                settled = None if now - since >= _ANSWERLESS_S else False
            if settled is not None:
                schemes[scheme] = settled or schemes.get(scheme, False)
        if Scheme.IDENTITY not in schemes:
            # An announced server may take requests before it is matched here.
            for peer in endpoints.foreign_peers():
                unlinked[peer.gid] = since = self._unlinked.get(peer.gid, now)
                if now - since < _ANSWERLESS_S:
                    schemes[Scheme.IDENTITY] = False
        self._unlinked = unlinked
        return schemes

    def _readers(self) -> dict[Scheme, frozenset[int]]:
        """Return the handles of the linked servers' request readers, by scheme."""
        answering = {_server_of(found) for found in self._endpoints.writers.all}
        readers: dict[Scheme, set[int]] = {scheme: set() for scheme in Scheme}
        for found in () if self._endpoints.readers is None else self._endpoints.readers.all:
            if _server_of(found) in answering:
                readers[scheme_of(found.guid)].add(found.handle)
        return {scheme: frozenset(handles) for scheme, handles in readers.items()}

    def _on_matched(self) -> None:
        """Update the route after a change of the matched servers."""
        with self._lock:
            self._linked = linked = self._readers()
            everybody = frozenset().union(*linked.values())
            for pending in self._calls.values():
                pending.route.readers &= everybody
        now = time.monotonic()
        self._scheme = self._route()
        until = [since + _ANSWERLESS_S for since in self._unlinked.values()]
        self._recheck = min((each for each in until if each > now), default=math.inf)
        if self.changed is not None:
            self.changed()


def _server_of(found: Discovered) -> str | bytes:
    """Return the key that a server's reader and writer have in common."""
    return parse_user_data(found.user_data).get("serviceid") or found.guid[:PREFIX]


#: Seconds that a reply waits for its client's reader to be discovered or to accept samples.
_REPLY_TIMEOUT_S = 3.0
#: Clients whose newest request is remembered; if there are more, departed ones are forgotten.
_MAX_REMEMBERED = 1024
#: Seconds that closing waits for pending replies.
_DRAIN_TIMEOUT_S = 0.5


@dataclass(frozen=True)
class _ReplyTarget:
    """The data of a request that its reply needs.

    Attributes:
        client: The writer of the request.
        identity: The request's identity.
        header: The header of its payload, if the reply must repeat it.
        reader: The client's reply reader, if it was announced.
    """

    client: Discovered
    identity: Identity
    header: bytes = b""
    reader: bytes = b""


class DdsReplier(Replier):
    """The DDS reader and writer of a service server; arguments as for :class:`ServiceEndpoints`.

    Attributes:
        gid: Identity of its request reader, which identifies the server.
    """

    def __init__(
        self,
        participant: Participant,
        graph: Graph,
        endpoint: EndpointInfo,
        on_request: OnRequest,
    ) -> None:
        self._service, self._on_request = endpoint.name, on_request
        self._handling = guarded(_log, "%s: a request is lost", endpoint.name)
        #: Clients whose reply readers were found to be matched since the last change.
        self._matched_clients: set[bytes] = set()
        #: The newest taken request of each client, by its writer; without Cyclone DDS's clients.
        self._newest: dict[bytes, int] = {}
        #: Origins, by id(), of requests left to the pump, which no request may overtake.
        self._pumped: OrderedDict[int, Origin] = OrderedDict()
        #: Guards these origins: requests are received on several threads.
        self._pumped_lock = threading.Lock()
        self._endpoints = ServiceEndpoints(
            participant, graph, endpoint, self._on_requests, self._on_matched
        )
        self._pump = participant.pump
        self.gid = self._endpoints.reader.guid
        self._endpoints.origins.set_receiver(self._on_received)
        self._endpoints.start()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some clients in the graph cannot be served."""
        foreign_peers = self._endpoints.foreign_peers()
        reason = cyclone_identity.reading.problem or cyclone_identity.writing.problem
        if not foreign_peers or not reason:
            return ""
        return f"{names_of(foreign_peers)} cannot be answered: {reason}; {REMEDY}"

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Send a reply once the client's reader is matched; a client that left is ignored."""
        answer = request.handle
        if not isinstance(answer, _ReplyTarget):
            return

        def expired() -> None:
            text = "%s did not get its reply: its reader of replies is not found, or takes nothing"
            self._endpoints.log_peer(answer.client.guid, text)

        self._endpoints.outbox.put(
            lambda: self._answer(answer, data),
            _REPLY_TIMEOUT_S,
            expired,
            # See cyclone_identity.create_reply_topic(): the main thread must not write.
            now=not in_main_thread(),
        )

    def close(self) -> None:
        """Withdraw the server."""
        self._endpoints.origins.set_receiver(None)
        if not self._pump.current:
            self._endpoints.outbox.drain(_DRAIN_TIMEOUT_S)
        self._endpoints.close()

    def _on_received(self, origin: Origin, data: bytes | memoryview) -> bool:
        """Take a request on the receiving thread; return False to get it from the pump instead."""
        guid = origin.guid
        client = self._endpoints.writers.by_guid.get(guid)
        odd = client is None or (scheme_of(guid) is Scheme.HEADER and unpack_header(data) is None)
        with self._pumped_lock:
            if odd or client is None or self._pumped or not self.quick:
                self._pumped[id(origin)] = origin
                return False
        with self._handling:
            self._take(client, data, origin)
        return True

    def _on_requests(self, taken: list[Taken]) -> None:
        for data, _, handle, described in taken:
            client, origin = self._endpoints.find_sender(handle, described)
            if origin is not None and origin.taken:
                continue
            with self._handling:
                if client is not None:
                    self._take(client, data, origin)
                else:
                    _log.error("%s: a request is lost: who sent it is gone", self._service)
            if origin is not None:
                self._on_pumped(origin)

    def _on_pumped(self, origin: Origin) -> None:
        """Stop waiting for a request left to the pump; earlier ones count as lost."""
        with self._pumped_lock:
            waiting, gone = len(self._pumped), 0
            if id(origin) not in self._pumped:
                return
            while self._pumped.popitem(last=False)[0] != id(origin):
                gone += 1
        if gone and waiting > self._endpoints.depth:
            text = "%s: %d requests are lost, as more than %d waited"
            _log.error(text, self._service, gone, self._endpoints.depth)

    def _take(self, client: Discovered, data: bytes | memoryview, origin: Origin | None) -> None:
        if scheme_of(client.guid) is Scheme.HEADER:
            header = unpack_header(data)
            if header is None:
                text = "ignoring a request of %s, which is too short for its header: %d bytes"
                self._endpoints.log_peer(client.guid, text, len(data))
                return
            kept = header_of(data)
            sequence = 0 if origin is None else origin.sequence
            answer = _ReplyTarget(client, Identity(client.guid, sequence), kept)
            self._on_request(RequestId(client.guid, header[1], answer), without_header(data))
        elif origin is None:
            text = "cannot answer %s: %s; %s"
            why = cyclone_identity.reading.problem or "its requests have no identity"
            self._endpoints.log_peer(client.guid, text, why, REMEDY)
        elif origin.sequence > self._newest.get(client.guid, 0):
            # After an interruption, a client sends its history again.
            self._newest[client.guid] = origin.sequence
            given = origin.related
            reader = b"" if given is None or given.guid == UNKNOWN_GUID else given.guid
            identity = Identity(reader or client.guid, origin.sequence)
            answer = _ReplyTarget(client, identity, reader=reader)
            self._on_request(RequestId(client.guid, origin.sequence, answer), data)

    def _answer(self, answer: _ReplyTarget, data: bytes | bytearray) -> bool:
        """Send a reply; return False if it must be tried again."""
        if not self._is_reader_matched(answer):
            # Its event may not have been handled yet.
            self._endpoints.refresh()
        writer = self._endpoints.writer
        if writer is None or not self._is_reader_matched(answer):
            # A reply to a reader that is not matched yet would be lost.
            return answer.client not in self._endpoints.writers.all
        parts = with_header(data, answer.header) if answer.header else (data,)
        try:
            # RustDDS's clients fail on any reply without identity, even another client's. A
            # multicast reply reaches their readers before these are discovered here, but not before
            # their participant is.
            foreign = not cyclone_identity.writing.problem and (
                self._endpoints.has_foreign_participants()
            )
            if answer.header and not foreign:
                writer.write_parts(parts)
            elif (
                not cyclone_identity.write_reply(writer, answer.identity, parts)
                and not answer.header
            ):
                text = "%s did not get its reply: Cyclone DDS sent it without identity; %s"
                self._endpoints.log_peer(answer.client.guid, text, REMEDY)
        except TimeoutError:
            return False
        return True

    def _on_matched(self) -> None:
        """Update the state that depends on the matched clients."""
        self._matched_clients = set()
        if len(self._newest) > _MAX_REMEMBERED:
            here = self._endpoints.writers.by_guid
            self._newest = {guid: last for guid, last in self._newest.items() if guid in here}

    def _is_reader_matched(self, answer: _ReplyTarget) -> bool:
        """Return whether the client's reply reader is matched."""
        matched = self._matched_clients
        key = answer.reader or answer.client.guid
        if key in matched:
            return True
        readers = () if self._endpoints.readers is None else self._endpoints.readers.all
        if answer.reader:
            heard = any(found.guid == answer.reader for found in readers)
        else:
            client = _client_of(answer.client)
            heard = any(_client_of(found) == client for found in readers)
        if heard:
            matched.add(key)
        return heard


def _client_of(found: Discovered) -> str | bytes:
    """Return the key that a client's reader and writer have in common."""
    return parse_user_data(found.user_data).get("clientid") or found.guid[:PREFIX]
