"""Service clients and servers over DDS, with peers of every DDS implementation.

A service's replies go to all its clients, who pick their own. How, depends on the peer; see
:class:`rosglass.ros2.dds_service_ends.Scheme`.
"""

from __future__ import annotations

import itertools
import logging
import math
import secrets
import struct
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.errors import (
    NodeClosedError,
    ServiceError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)
from rosglass.ros2 import cyclone_identity
from rosglass.ros2.cyclone_samples import COPIED
from rosglass.ros2.dds_discovery_info import parse_user_data
from rosglass.ros2.dds_identity import UNKNOWN_GUID, Identity, Origin
from rosglass.ros2.dds_service_ends import Ends, Scheme, in_this_process, names_of, scheme_of
from rosglass.ros2.middleware import SERVER_LEFT, Replier, Requester, RequestId

if TYPE_CHECKING:
    from rosglass.comm import NodeName, QoS
    from rosglass.ros2.cyclone_builtin import Discovered
    from rosglass.ros2.dds_endpoints import Taken
    from rosglass.ros2.dds_participant import Participant
    from rosglass.ros2.graph import Graph
    from rosglass.ros2.middleware import OnReply, OnRequest

__all__ = ["DdsReplier", "DdsRequester"]

_log = logging.getLogger("rosglass.ros2")

Parts = tuple["bytes | bytearray | memoryview", ...]
_IDS, _IDS_BIG = struct.Struct("<Qq"), struct.Struct(">Qq")
#: An encapsulation header, and what comes behind it with Scheme.HEADER.
_ENCAPSULATION, _HEADER = 4, 16
#: A participant's readers and writers share the beginning of its GUID.
_PREFIX = 12
#: Seconds after which a reader of requests without writer of replies belongs to no server.
_LISTENER = 2.0
#: Seconds that a reply waits for its client's reader to be found, or to take something.
_REPLY_PATIENCE = 3.0
#: Seconds that closing waits for replies that are on their way.
_FAREWELL = 0.5
_REMEDY = "start it with RMW_IMPLEMENTATION=rmw_cyclonedds_cpp, or use zenoh:// with rmw_zenoh_cpp"


class DdsRequester(Requester):
    """The ends of a service client; arguments as :class:`Ends`'s.

    Attributes:
        gid: Identity of its writer of requests, by which the client is known.
    """

    def __init__(
        self,
        participant: Participant,
        graph: Graph,
        node: NodeName,
        service: str,
        type_name: str,
        type_hash: str,
        qos: QoS,
        on_reply: OnReply,
    ) -> None:
        self._service, self._on_reply = service, on_reply
        self._lock = threading.Lock()
        #: What rmw_cyclonedds takes an instance handle for: nobody else's may be the same.
        self._id = secrets.randbits(64)
        self._next = itertools.count(1)
        #: Numbers of calls, and the sequence number that each was sent with, 0 for none.
        self._calls: dict[int, int] = {}
        self._by_sequence: dict[int, int] = {}
        self._sequence = 0
        #: How requests are sent now; None when no server is linked.
        self._scheme: Scheme | None = None
        #: When readers of requests that belong to no known server came, and when to look again.
        self._unlinked: dict[bytes, float] = {}
        self._recheck = math.inf
        self._ends = Ends(
            participant,
            graph,
            node,
            service,
            type_name,
            type_hash,
            qos,
            self._on_replies,
            self._link,
            server=False,
        )
        assert self._ends.writer is not None
        self._writer = self._ends.writer
        self.gid = self._writer.guid
        self._end_haste = cyclone_identity.hasten(self._ends.reader.entity, self._hasten)
        self._ends.start()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some servers in the graph cannot be called."""
        strangers = self._ends.strangers()
        if not strangers:
            return ""
        names = names_of(strangers)
        if reason := cyclone_identity.reading_problem():
            return f"{names} cannot be called: {reason}; {_REMEDY}"
        if Scheme.HEADER in self._schemes():
            return (
                f"{names} and a server on Cyclone DDS offer {self._service} in ways that exclude "
                "each other: only the former is called; end one of them"
            )
        return ""

    def ready(self) -> bool:
        """Return whether a server's reader of requests and its writer of replies are matched."""
        if time.monotonic() >= self._recheck:
            self._link()
        return self._scheme is not None and not self._ends.closed

    def send(self, data: bytes | bytearray, timeout: float | None) -> int:
        """Send a request; see :meth:`rosglass.ros2.middleware.Requester.send`."""
        if self._ends.closed:
            raise NodeClosedError(f"the client of {self._service} is closed")
        number = next(self._next)
        with self._lock:
            self._calls[number] = 0

        def expired() -> None:
            self._fail(number, "its server takes no requests")

        self._ends.outbox.put(
            lambda: self._send(number, data),
            float("inf") if timeout is None else timeout,
            expired,
            # A signal's exception in the main thread must not spoil the count of what was sent.
            now=self._scheme is not Scheme.IDENTITY or not _in_main_thread(),
        )
        return number

    def forget(self, number: int) -> None:
        """Drop the reply to a request, should it still come."""
        with self._lock:
            self._by_sequence.pop(self._calls.pop(number, 0), None)

    def close(self) -> None:
        """Withdraw the client; replies that still come are dropped."""
        if self._ends.closed:
            return
        self._end_haste()
        self._ends.close()
        with self._lock:
            self._calls.clear()
            self._by_sequence.clear()

    def _send(self, number: int, data: bytes | bytearray) -> bool:
        """Send a request; return whether nothing more is to be done for it."""
        # Whoever has just come must not be sent what it takes for something else.
        self._ends.catch_up()
        scheme = self._scheme
        if scheme is None:
            self._fail(number, SERVER_LEFT)
            return True
        parts: Parts = (data,)
        if scheme is Scheme.HEADER:
            parts = _with_header(data, _IDS.pack(self._id, number))
        # Replies are looked up under the lock, too: they may come before this returns.
        with self._lock:
            if number not in self._calls:
                return True
            if scheme is Scheme.IDENTITY and self._sequence < 0:
                raise ServiceError(
                    f"a request on {self._service} was interrupted, and nobody knows which replies "
                    "belong to later ones; make another client"
                )
            sequence, self._sequence = self._sequence, -1
            try:
                self._writer.write(parts)
            except (NodeClosedError, TimeoutError, UnsupportedError) as error:
                self._sequence = sequence  # nothing was sent
                if isinstance(error, TimeoutError):
                    return False
                raise
            self._sequence = sequence + 1 if sequence >= 0 else -1
            if scheme is Scheme.IDENTITY:
                self._calls[number] = self._sequence
                self._by_sequence[self._sequence] = number
        return True

    def _hasten(self, origin: Origin, data: bytes | memoryview) -> None:
        """Take a reply while it is received; what is not taken now comes again."""
        # Whoever has the lock may be sending, for longer than anybody may be held up here.
        if self._lock.acquire(blocking=False):
            try:
                claim = self._claim(origin.related, data)
            finally:
                self._lock.release()
            if claim is not None:
                self._answer(*claim, data)

    def _on_replies(self, taken: list[Taken]) -> None:
        for data, _, handle, origin in taken:
            server = self._ends.writers.get(handle)
            if server is None:
                continue
            try:
                self._take(server.guid, data, origin)
            except Exception:
                _log.exception("%s: a reply is lost", self._service)

    def _take(self, server: bytes, data: bytes | memoryview, origin: Origin | None) -> None:
        related = None if origin is None else origin.related
        with self._lock:
            claim = self._claim(related, data)
        if claim is not None:
            self._answer(*claim, data)
        elif related is not None:
            pass  # somebody else's, or taken before
        elif scheme_of(server) is Scheme.IDENTITY:
            if not cyclone_identity.reading_problem():
                text = "ignoring replies of %s, which do not say what they answer"
                self._ends.name(server, text, self._ends.who(server))
        # Within this process, what says that a reply is for someone else is not told.
        elif _read_header(data) is None and not in_this_process(server):
            text = "ignoring a reply of %s, which is too short for its header: %d bytes"
            self._ends.name(server, text, self._ends.who(server), len(data))

    def _claim(
        self, related: Identity | None, data: bytes | memoryview
    ) -> tuple[int, Scheme] | None:
        """Return which open call a reply belongs to, and what shows that, and close the call."""
        number, scheme = None, Scheme.IDENTITY
        if related is not None and related.guid in (self.gid, self._ends.reader.guid):
            number = self._by_sequence.pop(related.sequence, None)
        if number is None and (header := _read_header(data)) is not None and header[0] == self._id:
            number, scheme = header[1], Scheme.HEADER
        if number is None or self._calls.pop(number, None) is None:
            return None
        return number, scheme

    def _answer(self, number: int, scheme: Scheme, data: bytes | memoryview) -> None:
        self._on_reply(number, _without_header(data) if scheme is Scheme.HEADER else data, "")

    def _fail(self, number: int, error: str) -> None:
        with self._lock:
            known = self._calls.pop(number, None)
        if known is not None:
            self._on_reply(number, None, error)

    def _route(self) -> Scheme | None:
        """Return how to send requests; None when no server is linked."""
        schemes = self._schemes()
        if schemes.get(Scheme.IDENTITY) is not None and not cyclone_identity.reading_problem():
            # Servers on Cyclone DDS find such requests too short, mostly; the others would take
            # a header for arguments: nothing is sent while they are about to be ready.
            return Scheme.IDENTITY if schemes[Scheme.IDENTITY] else None
        return Scheme.HEADER if Scheme.HEADER in schemes else None

    def _schemes(self) -> dict[Scheme, bool]:
        """Return what the linked servers speak, and whether their replies are sure to arrive."""
        ends, now = self._ends, time.monotonic()
        answering = {_server_of(found): ends.settled(found.guid) for found in ends.writers.all}
        schemes: dict[Scheme, bool] = {}
        unlinked: dict[bytes, float] = {}
        for found in () if ends.readers is None else ends.readers.all:
            scheme = scheme_of(found.guid)
            settled = answering.get(_server_of(found))
            if settled is None and scheme is Scheme.IDENTITY:
                # Its writer of replies is about to be found, unless it is only listening.
                unlinked[found.guid] = since = self._unlinked.get(found.guid, now)
                settled = None if now - since >= _LISTENER else False
            if settled is not None:
                schemes[scheme] = settled or schemes.get(scheme, False)
        self._unlinked = unlinked
        young = [since + _LISTENER for since in unlinked.values() if since + _LISTENER > now]
        self._recheck = min(young, default=math.inf)
        return schemes

    def _link(self) -> None:
        """Take note of the servers that are there now."""
        self._scheme = self._route()
        if self.changed is not None:
            self.changed()


@dataclass(frozen=True)
class _Answer:
    """What a reply needs.

    Attributes:
        client: The writer of the request.
        identity: The request's identity.
        header: What its payload began with, where the reply's is to begin with it, too.
        reader: The client's reader of replies, where it told.
    """

    client: Discovered
    identity: Identity
    header: bytes = b""
    reader: bytes = b""


class DdsReplier(Replier):
    """The ends of a service server; arguments as :class:`Ends`'s.

    Attributes:
        gid: Identity of its reader of requests, by which the server is known.
    """

    def __init__(
        self,
        participant: Participant,
        graph: Graph,
        node: NodeName,
        service: str,
        type_name: str,
        type_hash: str,
        qos: QoS,
        on_request: OnRequest,
    ) -> None:
        self._service, self._on_request = service, on_request
        #: Clients whose readers of replies are matched, as found out since the last change.
        self._hearing: set[bytes] = set()
        self._strangers = False
        self._ends = Ends(
            participant,
            graph,
            node,
            service,
            type_name,
            type_hash,
            qos,
            self._on_requests,
            self._link,
            server=True,
        )
        self._pump = participant.pump
        self.gid = self._ends.reader.guid
        self._ends.start()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some clients in the graph cannot be served."""
        strangers = self._ends.strangers()
        reason = cyclone_identity.reading_problem() or cyclone_identity.writing_problem()
        if not strangers or not reason:
            return ""
        return f"{names_of(strangers)} cannot be answered: {reason}; {_REMEDY}"

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request, once the client can hear it; a client that is gone is no error."""
        answer = request.handle
        if not isinstance(answer, _Answer):
            return

        def expired() -> None:
            who = self._ends.who(answer.client.guid)
            text = "%s did not get its reply: its reader of replies is not found, or takes nothing"
            self._ends.name(answer.client.guid, text, who)

        self._ends.outbox.put(
            lambda: self._answer(answer, data),
            _REPLY_PATIENCE,
            expired,
            # See create_writing_topic() for what the main thread must not do.
            now=not _in_main_thread(),
        )

    def close(self) -> None:
        """Withdraw the server."""
        if not self._pump.current:
            self._ends.outbox.drain(_FAREWELL)
        self._ends.close()

    def _on_requests(self, taken: list[Taken]) -> None:
        for data, _, handle, origin in taken:
            client = self._ends.writers.get(handle)
            if client is None:
                continue  # gone: nobody waits for the reply
            try:
                self._take(client, data, origin)
            except Exception:
                _log.exception("%s: a request is lost", self._service)

    def _take(self, client: Discovered, data: bytes | memoryview, origin: Origin | None) -> None:
        if scheme_of(client.guid) is Scheme.HEADER:
            header = _read_header(data)
            if header is None:
                text = "ignoring a request of %s, which is too short for its header: %d bytes"
                self._ends.name(client.guid, text, self._ends.who(client.guid), len(data))
                return
            kept = bytes(data[_ENCAPSULATION : _ENCAPSULATION + _HEADER])
            sequence = 0 if origin is None else origin.sequence
            answer = _Answer(client, Identity(client.guid, sequence), kept)
            self._on_request(RequestId(client.guid, header[1], answer), _without_header(data))
        elif origin is None:
            text = "cannot answer %s: %s; %s"
            why = cyclone_identity.reading_problem() or "its requests have no identity"
            self._ends.name(client.guid, text, self._ends.who(client.guid), why, _REMEDY)
        else:
            given = origin.related
            reader = b"" if given is None or given.guid == UNKNOWN_GUID else given.guid
            identity = Identity(reader or client.guid, origin.sequence)
            answer = _Answer(client, identity, reader=reader)
            self._on_request(RequestId(client.guid, origin.sequence, answer), data)

    def _answer(self, answer: _Answer, data: bytes | bytearray) -> bool:
        """Send a reply; return whether nothing more is to be done for it."""
        writer = self._ends.writer
        if writer is None or not self._hears(answer):
            # A reply to a reader that is not matched yet would be lost.
            return answer.client not in self._ends.writers.all
        parts = _with_header(data, answer.header) if answer.header else (data,)
        try:
            if answer.header and not self._strangers:
                writer.write(parts)
            elif not cyclone_identity.write(writer, answer.identity, parts) and not answer.header:
                who = self._ends.who(answer.client.guid)
                text = "%s did not get its reply: Cyclone DDS sent it without identity; %s"
                self._ends.name(answer.client.guid, text, who, _REMEDY)
        except TimeoutError:
            return False
        return True

    def _link(self) -> None:
        """Take note of the clients that are there now."""
        self._hearing = set()
        readers = () if self._ends.readers is None else self._ends.readers.all
        # RustDDS's clients fail when they get a reply without identity, whosever it is.
        self._strangers = not cyclone_identity.writing_problem() and any(
            scheme_of(found.guid) is Scheme.IDENTITY for found in readers
        )

    def _hears(self, answer: _Answer) -> bool:
        """Return whether the client's reader of replies is matched."""
        hearing = self._hearing
        key = answer.reader or answer.client.guid
        if key in hearing:
            return True
        readers = () if self._ends.readers is None else self._ends.readers.all
        if answer.reader:
            heard = any(found.guid == answer.reader for found in readers)
        else:
            client = _client_of(answer.client)
            heard = any(_client_of(found) == client for found in readers)
        if heard:
            hearing.add(key)
        return heard


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def _server_of(found: Discovered) -> str | bytes:
    """Return what a server's reader and writer have in common."""
    return parse_user_data(found.user_data).get("serviceid") or found.guid[:_PREFIX]


def _client_of(found: Discovered) -> str | bytes:
    """Return what a client's reader and writer have in common."""
    return parse_user_data(found.user_data).get("clientid") or found.guid[:_PREFIX]


def _read_header(data: bytes | memoryview) -> tuple[int, int] | None:
    """Return the client's number and the request's; None when the payload is too short."""
    if len(data) < _ENCAPSULATION + _HEADER:
        return None
    client, number = (_IDS if data[1] & 1 else _IDS_BIG).unpack_from(data, _ENCAPSULATION)
    return client, number


def _with_header(data: bytes | bytearray, header: bytes) -> Parts:
    if len(data) <= COPIED:
        return (b"".join((data[:_ENCAPSULATION], header, data[_ENCAPSULATION:])),)
    view = memoryview(data)
    return view[:_ENCAPSULATION], header, view[_ENCAPSULATION:]


def _without_header(data: bytes | memoryview) -> bytes:
    return b"".join((data[:_ENCAPSULATION], data[_ENCAPSULATION + _HEADER :]))
