"""Service clients over DDS, for servers of every DDS implementation.

A service's replies go to all its clients, who pick their own. How, depends on the server; see
:class:`rosglass.wires.dds.service_ends.Scheme`.
"""

from __future__ import annotations

import logging
import math
import secrets
import threading
import time
from typing import TYPE_CHECKING

from rosglass.errors import (
    NodeClosedError,
    ServiceError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)
from rosglass.wires.base import SERVER_LEFT, Requester
from rosglass.wires.dds import cyclone_origins
from rosglass.wires.dds.discovery_info import parse_user_data
from rosglass.wires.dds.headers import Parts, pack, unpack, with_header, without_header
from rosglass.wires.dds.service_ends import (
    PREFIX,
    REMEDY,
    Ends,
    Scheme,
    in_main_thread,
    in_this_process,
    names_of,
    scheme_of,
)

if TYPE_CHECKING:
    from rosglass.comm import EndpointInfo
    from rosglass.comm.graph import Graph
    from rosglass.wires.base import OnReply
    from rosglass.wires.dds.cyclone_builtin import Discovered
    from rosglass.wires.dds.endpoints import Taken
    from rosglass.wires.dds.identity import Identity, Origin
    from rosglass.wires.dds.participant import Participant

__all__ = ["DdsRequester"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds after which a reader of requests without writer of replies belongs to no server.
_LISTENER = 2.0


class DdsRequester(Requester):
    """The ends of a service client; arguments as :class:`Ends`'s.

    Attributes:
        gid: Identity of its writer of requests, by which the client is known.
    """

    def __init__(
        self,
        participant: Participant,
        graph: Graph,
        endpoint: EndpointInfo,
        on_reply: OnReply,
    ) -> None:
        self._service, self._on_reply = endpoint.name, on_reply
        self._lock = threading.Lock()
        #: What rmw_cyclonedds takes an instance handle for: nobody else's may be the same.
        self._id = secrets.randbits(64)
        #: Numbers of calls, and the sequence number that each was sent with, 0 for none.
        self._calls: dict[int, int] = {}
        self._by_sequence: dict[int, int] = {}
        self._sequence = 0
        #: Handles of the linked servers' readers of requests; whoever comes back has others.
        self._linked: dict[Scheme, frozenset[int]] = {}
        #: Numbers of calls that were sent, and who was linked then and has been ever since.
        self._asked: dict[int, frozenset[int]] = {}
        #: How requests are sent now; None when no server is linked.
        self._scheme: Scheme | None = None
        #: When readers of requests that belong to no known server came, and when to look again.
        self._unlinked: dict[bytes, float] = {}
        self._recheck = math.inf
        self._ends = Ends(participant, graph, endpoint, self._on_replies, self._link)
        assert self._ends.writer is not None
        self._writer = self._ends.writer
        self.gid = self._writer.guid
        self._ends.origins.hasten(self._hasten)
        self._ends.start()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some servers in the graph cannot be called."""
        strangers = self._ends.strangers()
        if not strangers:
            return ""
        names = names_of(strangers)
        if reason := cyclone_origins.problem():
            return f"{names} cannot be called: {reason}; {REMEDY}"
        if Scheme.HEADER in self._schemes():
            return (
                f"{names} and a server on Cyclone DDS offer {self._service} in ways that exclude "
                "each other: only the former is called; end one of them"
            )
        return ""

    def ready(self) -> bool:
        """Return whether a server's reader of requests and its writer of replies are matched."""
        if time.monotonic() >= self._recheck:
            self._ends.look()
        return self._scheme is not None and not self._ends.closed

    def send(self, number: int, data: bytes | bytearray, timeout: float | None) -> None:
        """Send a request; see :meth:`rosglass.wires.base.Requester.send`."""
        if self._ends.closed:
            raise NodeClosedError(f"the client of {self._service} is closed")
        with self._lock:
            self._calls[number] = 0

        def expired() -> None:
            self._fail(number, "its server takes no requests")

        self._ends.outbox.put(
            lambda: self._send(number, data),
            float("inf") if timeout is None else timeout,
            expired,
            # A signal's exception in the main thread must not spoil the count of what was sent.
            now=self._scheme is not Scheme.IDENTITY or not in_main_thread(),
        )

    def stranded(self, number: int) -> bool:
        """Return whether a request's servers have left; what they sent meanwhile is lost."""
        asked = self._asked.get(number)
        return asked is not None and not asked

    def forget(self, number: int) -> None:
        """Drop the reply to a request, should it still come."""
        with self._lock:
            self._drop(number)

    def close(self) -> None:
        """Withdraw the client; replies that still come are dropped."""
        if self._ends.closed:
            return
        self._ends.origins.hasten(None)
        self._ends.close()
        with self._lock:
            self._calls.clear()
            self._by_sequence.clear()
            self._asked.clear()

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
            parts = with_header(data, pack(self._id, number))
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
            self._asked[number] = self._linked.get(scheme, frozenset())
            if scheme is Scheme.IDENTITY:
                self._calls[number] = self._sequence
                self._by_sequence[self._sequence] = number
        return True

    def _hasten(self, origin: Origin, data: bytes | memoryview) -> bool:
        """Take a reply while it is received; return False when it should come again later."""
        quick = self.quick
        # Whoever has the lock may be sending, for longer than anybody may be held up here.
        if quick is None or not self._lock.acquire(blocking=False):
            return False
        try:
            claim = self._match(origin.related, data)
            if claim is None or not quick(claim[0]):
                return False
            self._drop(claim[0])
        finally:
            self._lock.release()
        self._answer(*claim, data)
        return True

    def _on_replies(self, taken: list[Taken]) -> None:
        for data, _, handle, told in taken:
            server, origin = self._ends.sender(handle, told)
            if origin is not None and origin.taken:
                continue
            try:
                self._take(None if server is None else server.guid, data, origin)
            except Exception:
                _log.exception("%s: a reply is lost", self._service)

    def _take(self, server: bytes | None, data: bytes | memoryview, origin: Origin | None) -> None:
        related = None if origin is None else origin.related
        with self._lock:
            claim = self._match(related, data)
            if claim is not None:
                self._drop(claim[0])
        if claim is not None:
            self._answer(*claim, data)
        elif related is not None or server is None:
            pass  # somebody else's, or forgotten
        elif scheme_of(server) is Scheme.IDENTITY:
            if not cyclone_origins.problem():
                text = "ignoring replies of %s, which do not say what they answer"
                self._ends.name(server, text, self._ends.who(server))
        # Within this process, what says that a reply is for someone else is not told.
        elif unpack(data) is None and not in_this_process(server):
            text = "ignoring a reply of %s, which is too short for its header: %d bytes"
            self._ends.name(server, text, self._ends.who(server), len(data))

    def _match(
        self, related: Identity | None, data: bytes | memoryview
    ) -> tuple[int, Scheme] | None:
        """Return which open call a reply belongs to, and what shows that."""
        number, scheme = None, Scheme.IDENTITY
        if related is not None and related.guid in (self.gid, self._ends.reader.guid):
            number = self._by_sequence.get(related.sequence)
        if number is None and (header := unpack(data)) is not None and header[0] == self._id:
            number, scheme = header[1], Scheme.HEADER
        return None if number is None or number not in self._calls else (number, scheme)

    def _drop(self, number: int) -> bool:
        """Close a call; return whether it was open."""
        self._asked.pop(number, None)
        sequence = self._calls.pop(number, None)
        if sequence:
            self._by_sequence.pop(sequence, None)
        return sequence is not None

    def _answer(self, number: int, scheme: Scheme, data: bytes | memoryview) -> None:
        self._on_reply(number, without_header(data) if scheme is Scheme.HEADER else data, "")

    def _fail(self, number: int, error: str) -> None:
        with self._lock:
            known = self._drop(number)
        if known:
            self._on_reply(number, None, error)

    def _route(self) -> Scheme | None:
        """Return how to send requests; None when no server is linked."""
        schemes = self._schemes()
        if schemes.get(Scheme.IDENTITY) is not None and not cyclone_origins.problem():
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

    def _readers(self) -> dict[Scheme, frozenset[int]]:
        """Return the handles of the linked servers' readers of requests, by what they speak."""
        answering = {_server_of(found) for found in self._ends.writers.all}
        readers: dict[Scheme, set[int]] = {scheme: set() for scheme in Scheme}
        for found in () if self._ends.readers is None else self._ends.readers.all:
            if _server_of(found) in answering:
                readers[scheme_of(found.guid)].add(found.handle)
        return {scheme: frozenset(handles) for scheme, handles in readers.items()}

    def _link(self) -> None:
        """Take note of the servers that are there now."""
        with self._lock:
            self._linked = linked = self._readers()
            everybody = frozenset().union(*linked.values())
            self._asked = {number: asked & everybody for number, asked in self._asked.items()}
        self._scheme = self._route()
        if self.changed is not None:
            self.changed()


def _server_of(found: Discovered) -> str | bytes:
    """Return what a server's reader and writer have in common."""
    return parse_user_data(found.user_data).get("serviceid") or found.guid[:PREFIX]
