"""The client's end of a service over TCPROS: where its server is, connections to it, requests.

Protocol: ROS wiki, "ROS/Master_API" (lookupService) and "ROS/TCPROS": only the server knows its
service's type, and tells it to who connects (``probe=1`` for that alone). After the headers, a
request is a frame, and its response a frame with a byte in front that says whether all went well;
the failure text is its content if not.
"""

from __future__ import annotations

import logging
import socket
import struct
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from rosglass.comm.names import similar
from rosglass.comm.service_client import ServiceRequester
from rosglass.errors import (
    ConnectionLostError,
    ConversionError,
    Error,
    InvalidNameError,
    MasterError,
    ServiceError,
)
from rosglass.interfaces import join_name, ros1_name
from rosglass.wires.tcpros.address import parse_uri
from rosglass.wires.tcpros.connection import ANY, MAX_FRAME, Connection
from rosglass.wires.tcpros.io_loop import READ
from rosglass.wires.tcpros.master import reason_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosglass.comm.service_client import PendingCall
    from rosglass.messages import ServiceType
    from rosglass.wires.base import OnReply
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.master import Master

__all__ = [
    "FinderOwner",
    "Peer",
    "Place",
    "ServiceFinder",
    "ServiceLink",
    "TcprosRequester",
    "locate",
    "probe",
]


_log = logging.getLogger("rosglass.ros1")
_length = struct.Struct("<I")
#: Connections at once, each with a call; more calls wait for their turn.
_MAX_LINKS = 64


@dataclass(eq=False, slots=True)
class _Route:
    """How far a request has come.

    Attributes:
        made: Monotonic time of the call.
        began: Monotonic time at which a connection for it was begun, None while it waits.
        link: The connection it is sent through.
        refused: Whether a server that was found before this call began has refused it.
    """

    made: float
    began: float | None = None
    link: ServiceLink | None = None
    refused: bool = False


class TcprosRequester(ServiceRequester):
    """Sends a service client's requests through connections to the server that the master names.

    Except what the client calls, everything runs in the loop's thread, which owns the connections.

    Args:
        core: The node it belongs to.
        on_server: Called with the name and what a server of it said of itself.
        name: Absolute service name.
        wanted: The type, or its name: then the version that the server announces is taken if the
            library has it; None takes whatever type the server announces.
        persistent: Whether calls go one after the other through one connection that is kept,
            instead of a connection for each.
        on_reply: Takes what comes of the requests.
        on_change: Called when a server has come or gone, or may have.
    """

    max_request = MAX_FRAME

    def __init__(
        self,
        core: TcprosCore,
        on_server: Callable[[str, Peer], None],
        name: str,
        wanted: ServiceType | str | None,
        persistent: bool,
        on_reply: OnReply,
        on_change: Callable[[], None],
    ) -> None:
        self._core, self._name, self._persistent = core, name, persistent
        self._on_reply, self._on_change = on_reply, on_change
        self._finder = ServiceFinder(core, on_server, name, wanted, self)
        self._lock = threading.Lock()
        #: Requests that wait for a connection, in the order of the calls; changed with the lock.
        self._queue: deque[PendingCall] = deque()
        #: The connection that is kept; claimed for a request with the lock.
        self._kept: ServiceLink | None = None
        #: Belongs to the loop's thread.
        self._links: set[ServiceLink] = set()
        self._closed = False

    # -- who is there ------------------------------------------------------------------------------

    @property
    def type(self) -> ServiceType | None:  # type: ignore[override]
        """The service type; None while it is not discovered yet."""
        return self._finder.type

    def ready(self) -> bool:
        """Return whether a server is there that understands the requests."""
        return self._finder.ready

    def conflicts(self) -> list[str]:
        """Say what a person has to mend."""
        conflict = self._finder.conflict()
        return [conflict] if conflict else []

    def absence(self) -> str:
        """Say why no server is there although nothing is wrong."""
        return self._finder.absence()

    def server_name(self) -> str:
        """Return who has the service, for people."""
        return self._finder.server

    def delay(self, pending: PendingCall) -> str:
        """Say why a request was not sent although all is well."""
        if pending.route is not None and pending.route.began is not None:
            return "its server takes long to accept a connection"
        busy = len(self._links)
        if busy:
            return f"{busy} earlier call{'s are' if busy > 1 else ' is'} not answered yet"
        return "its server appeared too late"

    def look(self) -> None:
        """Look for a server now, because a thread waits for one."""
        self._core.loop.call(self._finder.look)

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - time matters as well
        """Follow the graph: whether a server is there, and which."""
        self._core.loop.call(self._finder.follow)

    # -- sending -----------------------------------------------------------------------------------

    def send(self, pending: PendingCall) -> None:
        """Send a request at once if a kept connection is idle; else let the loop do it.

        The former saves a persistent client two changes of threads for each call, most of its time.
        """
        route = pending.route = _Route(time.monotonic())
        link = self._kept
        usable = link is not None and link.peer is not None and self._fits(link, pending.type)
        with self._lock:
            if link is not None and usable and not self._queue:
                taken = link.request is not None or link.settling or link.ended
                if not taken and not pending.call.done() and link.quiet():
                    link.request, route.link = pending, link
                    route.began = time.monotonic()
            if route.link is None:
                self._queue.append(pending)
        if route.link is not None:
            self._send(route.link, pending)
            return
        if pending.call.done():
            self.forget(pending)  # it ended before it came here
        self._core.loop.call(self._advance)

    def withdraw(self, pending: PendingCall) -> bool:
        """Do not send a request any more; return False if it is on its way already."""
        with self._lock:
            if pending not in self._queue:
                return False
            self._queue.remove(pending)
        return True

    def forget(self, pending: PendingCall) -> None:
        """Take note that a call has ended: do not send it, drop its response."""
        route = pending.route
        if route is not None and (route.link is not None or route.began is None):
            self._core.loop.call(lambda: self._release(pending))

    # -- sending, in the loop's thread -------------------------------------------------------------

    def _release(self, pending: PendingCall) -> None:
        link = pending.route.link
        if link is not None and link.request is pending:
            # Given up: a response that still comes must not be taken for another one's, and the
            # next call shall not go to the same place without asking.
            link.request, self._finder.asked = None, 0.0
            link.end("")
        else:
            with self._lock:
                if pending in self._queue:
                    self._queue.remove(pending)

    def _advance(self) -> None:
        """Send what waits, in order, if a server is there."""
        while self._queue and not self._closed:
            kind, place = self.type, None
            link = self._free_link() if self._persistent else None
            if link is None:
                if len(self._links) >= (1 if self._persistent else _MAX_LINKS):
                    return
                place = self._finder.current()
                if place is None:
                    return
            if kind is None:
                return  # the server is being asked for it
            with self._lock:
                if not self._queue or (link is not None and link.request is not None):
                    return
                pending = self._queue.popleft()
                route = pending.route
                route.began = time.monotonic()
                if link is not None:
                    link.request, route.link = pending, link
            error = self._prepare(pending, kind)
            if error is not None or pending.call.done():
                if link is not None:
                    link.request = route.link = None
                if error is not None:
                    self._on_reply(pending.number, None, error)
            elif link is not None:
                self._send(link, pending)
            elif place is not None:
                self._dial(kind, place, pending)

    def _dial(self, kind: ServiceType, place: Place, pending: PendingCall) -> None:
        try:
            link = ServiceLink(self._core, self._name, kind, place, self._persistent, self)
        except OSError as error:  # no more sockets, or an address that this machine cannot use
            self._put_back(pending)
            self._finder.fail(place, error.strerror or str(error))
        else:
            self._links.add(link)
            link.request, pending.route.link = pending, link
            self._kept = link if self._persistent else None

    def _free_link(self) -> ServiceLink | None:
        """Return the kept connection, if it is idle and still the right one."""
        for link in list(self._links):
            if link.peer is None or link.request is not None:
                continue
            if not self._fits(link, self.type):
                link.end("")
            elif link.lives():
                return link
        return None

    def _fits(self, link: ServiceLink, kind: ServiceType | None) -> bool:
        """Return whether a connection is one of this type with who offers the service now."""
        return link.kind is kind and self._finder.place in (None, link.place)

    def _prepare(self, pending: PendingCall, kind: ServiceType) -> Error | None:
        try:
            pending.encode(kind)
        except Error as error:
            return error
        except Exception as error:
            _log.exception("%s: encoding a request failed", self._name)
            return ServiceError(f"{self._name}: the request could not be sent: {error}")
        return None

    def _send(self, link: ServiceLink, pending: PendingCall) -> None:
        pending.sent = time.monotonic()
        link.send(pending.encode(link.kind))

    def _put_back(self, pending: PendingCall) -> None:
        """Let a request wait again that could not be sent."""
        with self._lock:
            pending.route.began = None
            waiting = sorted((*self._queue, pending), key=lambda one: one.number)
            self._queue.clear()
            self._queue.extend(waiting)

    # -- what connections report, in the loop's thread ---------------------------------------------

    def on_accepted(self, link: ServiceLink, peer: Peer) -> None:
        """Send the request for which the connection was made."""
        self._finder.on_server_header(peer)
        pending = link.request
        if pending is None or pending.call.done():
            link.end("")
        elif peer.md5 not in (ANY, link.kind.md5):
            link.refusal = self._finder.mismatch() or f"it has md5 {peer.md5}"
            link.end(link.refusal)
        else:
            self._send(link, pending)

    def on_response(self, link: ServiceLink, ok: bool, data: bytes | memoryview) -> None:
        """End the call that was answered."""
        with self._lock:
            link.settling = link.persistent
            pending, link.request = link.request, None
        if link.persistent:
            # Not at once: its end may come right behind the response, or what was not asked for.
            self._core.loop.call(lambda: self._settle(link))
        else:
            link.end("")
        if pending is not None:
            pending.route.link = None
            if ok:
                self._on_reply(pending.number, data, "")
            else:
                text = bytes(data).decode("utf-8", "replace").strip()
                reason = text or "its server reports a failure and does not say why"
                self._on_reply(pending.number, None, reason)

    def _settle(self, link: ServiceLink) -> None:
        link.settling = False
        self._advance()

    def on_disconnected(self, link: ServiceLink, reason: str) -> None:
        """End the call that can get no answer any more, or try again if it was not sent."""
        self._links.discard(link)
        with self._lock:
            link.ended = True
            pending, link.request = link.request, None
        if pending is not None:
            route = pending.route
            route.link = None
            if pending.sent is not None:
                self._on_reply(pending.number, None, self._loss(pending.sent, reason))
            elif link.refusal and (route.refused or self._finder.asked >= route.made):
                self._explain(pending, link)
            elif not pending.call.done():
                # Refused where the server was before the call: it may be elsewhere by now.
                route.refused = bool(link.refusal)
                self._put_back(pending)
        if self._closed:
            return
        if reason:
            self._finder.lose(link, reason)
        self._advance()

    def _loss(self, sent: float, reason: str) -> ConnectionLostError:
        """Return the error of a call whose connection ended after its request was sent."""
        since = time.monotonic() - sent
        return ConnectionLostError(
            f"{self._finder.server} went away before it answered the call of {self._name} sent "
            f"{since:.1f} s ago ({reason or 'the connection was closed'}), and may have carried it "
            "out or not; look what happened, and call again"
        )

    def _explain(self, pending: PendingCall, link: ServiceLink) -> None:
        """End a call that was refused: most likely the server has another definition."""

        def fail(peer: Peer | None, _: str = "") -> None:
            if peer is not None:
                self._finder.on_server_header(peer)
            called = f"it was called as {link.kind.name} with md5 {link.kind.md5}"
            why = self._finder.mismatch() or f"{called}: {link.refusal}"
            refused = f"{link.place.uri} refuses the call of {self._name}: {why}"
            self._on_reply(pending.number, None, ServiceError(refused))

        try:
            probe(self._core, self._name, link.place, fail)
        except OSError:  # no more sockets
            fail(None)

    # -- what the finder asks and reports, in the loop's thread ------------------------------------

    @property
    def waits(self) -> bool:
        """Whether calls or threads wait for the server."""
        return bool(self._queue) or (self.waiters > 0 and not self.ready())

    @property
    def busy(self) -> bool:
        """Whether there are connections with the server."""
        return bool(self._links)

    def server_found(self, moved: bool) -> None:
        """Send what waits to where the server is, and nothing more to where it was."""
        if moved:
            # Marked first: a call in another thread takes a link that is idle at any time.
            with self._lock:
                idle = [link for link in self._links if link.request is None]
                for link in idle:
                    link.ended = True
            for link in idle:
                link.end("")
        self._advance()

    def server_changed(self) -> None:
        """Report what has changed."""
        self._on_change()

    # -- the end -----------------------------------------------------------------------------------

    def close(self) -> None:
        """Close what leads to the servers; safe to call twice."""
        self._closed = True
        self._finder.close()
        self._core.loop.call(self._end)

    def _end(self) -> None:
        with self._lock:
            self._queue.clear()
        for link in list(self._links):
            link.request = None
            link.end("")


class ServiceLink:
    """A connection to a server; in the loop's thread, except :meth:`send` and :meth:`quiet`.

    Args:
        core: The node.
        name: Absolute service name.
        kind: The type that is spoken.
        place: Where the server is.
        persistent: Whether to ask for a connection that outlives a call.
        owner: Called with what happens.

    Raises:
        OSError: There can be no more sockets.

    Attributes:
        kind: The type that is spoken.
        place: Where the server is.
        peer: What the server says of itself; None before it has.
        refusal: Why the server refuses the connection; empty when it does not.
        request: The call that is, or will be, answered through it; None when it is idle.
        settling: Whether what came with the last response is still being looked at.
        ended: Whether it is of no use any more.
    """

    def __init__(
        self,
        core: TcprosCore,
        name: str,
        kind: ServiceType,
        place: Place,
        persistent: bool,
        owner: TcprosRequester,
    ) -> None:
        self.kind, self.place, self.persistent = kind, place, persistent
        self.peer: Peer | None = None
        self.refusal = ""
        self.request: PendingCall | None = None
        self.settling = self.ended = False
        self._owner = owner
        header = {
            "callerid": core.name.full,
            "md5sum": kind.md5,
            "service": name,
            "type": ros1_name(kind.name),
        }
        if persistent:
            header["persistent"] = "1"
        self._connection = Connection.dial(
            core.loop, place.address, header, self._on_header, self._on_frame, self._on_end, lead=1
        )

    def send(self, data: bytes) -> None:
        """Send a request; the server has accepted the connection."""
        self._connection.send([_length.pack(len(data)), data])

    def quiet(self) -> bool:
        """Return whether nothing has come that was not looked at; from any thread."""
        return self._connection.quiet()

    def lives(self) -> bool:
        """Return whether the server has not closed it; takes in what has come until now."""
        self._connection.ready(READ)
        return not self._connection.closed

    def end(self, reason: str = "") -> None:
        """End it, and say why."""
        self._connection.end(reason)

    def _on_header(self, header: dict[str, str]) -> None:
        try:
            self.peer = Peer.of(header, self.place)
        except ConnectionLostError as error:
            self.end(str(error))
            return
        self._owner.on_accepted(self, self.peer)

    def _on_frame(self, data: bytes | memoryview, lead: int) -> None:
        if self.request is None:
            self.end("it sent a response that nobody asked for")
        else:
            self._owner.on_response(self, lead != 0, data)

    def _on_end(self, reason: str) -> None:
        self.refusal = self.refusal or self._connection.header.get("error", "")
        self._owner.on_disconnected(self, reason)


#: Seconds for which the master's word where a server is counts, when calls come one by one.
_TRUST_S = 1.0
#: Seconds between looks for a server while somebody waits for it.
_RETRY_S = 0.2
#: Seconds between looks whether the server lives: one that was killed stays with the master.
_CHECK_S, _CHECK_ABSENT_S = 3.0, 1.0


class FinderOwner(Protocol):
    """For whom a server is looked for; called in the loop's thread."""

    @property
    def waits(self) -> bool:
        """Whether somebody waits for the server."""

    @property
    def busy(self) -> bool:
        """Whether there are connections with it, which tell more than a probe."""

    def server_found(self, moved: bool) -> None:
        """Take that it is known where the server is, and whether that is another place now."""

    def server_changed(self) -> None:
        """Take that something else is known of the server."""


class ServiceFinder:
    """Knows what can be known of a service's server; in the loop's thread, unless said otherwise.

    Args:
        core: The node.
        on_server: Called with the name and what a server of it said of itself.
        name: Absolute service name.
        wanted: The type, its name, or None for whatever type the server announces.
        owner: Told what is found.

    Attributes:
        type: The service type; None while it is not known.
        peer: What the server said of itself; None when there is none, as far as is known.
        place: Where it is, as far as is known.
        asked: Monotonic time at which the master was asked for the place; 0 when it has to be
            asked again.
    """

    def __init__(
        self,
        core: TcprosCore,
        on_server: Callable[[str, Peer], None],
        name: str,
        wanted: ServiceType | str | None,
        owner: FinderOwner,
    ) -> None:
        self.name = name
        self.type: ServiceType | None = None if wanted is None else core.types.service(wanted)
        self.peer: Peer | None = None
        self.place: Place | None = None
        self.asked = 0.0
        self._core, self._on_server, self._owner = core, on_server, owner
        self._discovers, self._fixed = wanted is None, not isinstance(wanted, (str, type(None)))
        self._looking = self._probing = self._retrying = self._closed = False
        #: When to see next whether the server lives.
        self._due = 0.0
        #: Why the server cannot be reached, or its type is not known; empty when that is not so.
        self._fault = self._type_fault = ""
        self._nodes: list[str] = []
        #: Type and md5 sum for which a definition was looked for last.
        self._tried: tuple[str, str] | None = None

    # -- what is known; from any thread ----------------------------------------------------------

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands the requests."""
        return self.peer is not None and self.type is not None and not self.mismatch()

    @property
    def server(self) -> str:
        """The server, for people."""
        peer = self.peer
        return "its server" if peer is None else peer.node

    def mismatch(self) -> str:
        """Say that the server has another definition; empty when it has ours."""
        peer, ours = self.peer, self.type
        if peer is None or ours is None or peer.md5 in (ANY, ours.md5):
            return ""
        return (
            f"{peer.node} offers {self.name} as {peer.type or 'an unknown type'} with md5 "
            f"{peer.md5}, not as {ours.name} with md5 {ours.md5}: it cannot be called; add the "
            "robot's definition to the library, or leave out the type. Ours:\n"
            f"{self._core.types.text(ours).strip()}"
        )

    def conflict(self) -> str:
        """Say what a person has to mend; empty when nothing."""
        if self.peer is not None and self.type is None:
            return self._type_fault
        return self.mismatch()

    def absence(self) -> str:
        """Say why no server is there although nothing is wrong."""
        if self._fault:
            return self._fault
        known = self._core.graph.services()
        if self.name in known:
            return f"{' and '.join(known[self.name])} offers it, and is being asked for its type"
        kind = "" if self.type is None else f" [{self.type.name}]"
        return (
            f"no server offers {self.name}{kind} on {self._core.url} ({self._core.status()})"
            f"{similar(self.name, known)}"
        )

    # -- where it is -----------------------------------------------------------------------------

    def current(self) -> Place | None:
        """Return where the server is; None, and ask the master, if that was not known lately."""
        if self.place is None or time.monotonic() - self.asked > _TRUST_S:
            self.look()
            return None
        return self.place

    def look(self) -> None:
        """Ask the master where the server is, and the server for its type if need be."""
        if self._looking or self._retrying or self._closed:
            return
        self._looking = True
        self._core.lookups.run(self._locate)

    def _locate(self) -> None:
        """Ask the master; on a thread that may wait."""
        place, fault = None, ""
        try:
            place = locate(self._core.master, self.name)
        except ConnectionLostError as error:
            fault = str(error)
        self._core.loop.call(lambda: self._located(place, fault))

    def _located(self, place: Place | None, fault: str) -> None:
        self._looking = False
        if self._closed:
            return
        self.asked = time.monotonic()
        if fault and self.peer is not None and self.place is not None:
            place = self.place  # only the master is away: the server is called where it was
        else:
            self._fault = fault
        if place is None:
            self._due = self.asked + _CHECK_ABSENT_S
            self.place = self.peer = None
            self._owner.server_changed()
            self._retry()
            return
        moved = self.place is None or self.place.uri != place.uri
        self.place = place
        self._owner.server_found(moved)
        wanted = self.peer is None or moved or self.asked >= self._due
        if wanted and not self._probing and not self._owner.busy:
            self._probe(place)

    def _retry(self) -> None:
        """Look again soon if somebody waits."""
        if self._owner.waits and not self._retrying:
            self._retrying = True
            self._core.loop.after(_RETRY_S, self._again)

    def _again(self) -> None:
        self._retrying = False
        if self._owner.waits:
            self.look()

    # -- what it says ----------------------------------------------------------------------------

    def _probe(self, place: Place) -> None:
        self._probing = True
        try:
            probe(self._core, self.name, place, lambda peer, why: self._probed(place, peer, why))
        except OSError as error:  # no more sockets
            self._probed(place, None, error.strerror or str(error))

    def _probed(self, place: Place, peer: Peer | None, why: str) -> None:
        self._probing = False
        if self._closed:
            return
        if peer is not None:
            self.on_server_header(peer)
        else:
            self.fail(place, why)

    def on_server_header(self, peer: Peer) -> None:
        """Take what the server says of itself."""
        if self._closed:
            return
        self._due = time.monotonic() + _CHECK_S
        self.peer, self._fault = peer, ""
        self._on_server(self.name, peer)
        key, ours = (peer.type, peer.md5), self.type
        fits = ours is not None and peer.md5 in (ANY, ours.md5)
        if self._discovers and fits and ours is not None:
            fits = peer.type in ("", ours.name)
        if fits:
            self._tried, self._type_fault = key, ""
        elif not self._fixed and (key != self._tried or self._type_fault):
            self._tried = key
            self._core.lookups.run(lambda: self._learn(peer))
        self._owner.server_changed()

    def _learn(self, peer: Peer) -> None:
        """Find the definition that the server has; on a thread that may wait."""
        kind, fault = None, ""
        try:
            kind = self._core.types.announced_service(peer.type, peer.md5)
        except Error as error:
            fault = f"{peer.node} offers it as {peer.type or 'an unknown type'}: {error}"
        self._core.loop.call(lambda: self._learned(peer, kind, fault))

    def _learned(self, peer: Peer, kind: ServiceType | None, fault: str) -> None:
        if self._closed or self._tried != (peer.type, peer.md5):
            return
        same_name = self.type is None or kind is None or kind.name == self.type.name
        if kind is not None and (self._discovers or same_name):
            self.type = kind
        self._type_fault = fault
        self._owner.server_changed()
        self._owner.server_found(moved=False)

    def fail(self, place: Place, why: str) -> None:
        """Take that the server cannot be reached."""
        self._due = time.monotonic() + _CHECK_ABSENT_S
        if self.place in (None, place):
            nodes = self._core.graph.services().get(self.name, [])
            who = f"{' and '.join(nodes)} offers" if nodes else "somebody offers"
            self._fault = (
                f"{who} it at {place.uri}, says the master, but calling it there fails: {why}; if "
                "it was killed, start it again, or let 'rosnode cleanup' remove it"
            )
            self.peer = self.place = None
        self._owner.server_changed()
        self._retry()

    def lose(self, link: ServiceLink, reason: str) -> None:
        """Take that a connection has ended which should not have."""
        if link.peer is None and not link.refusal:
            self.fail(link.place, reason)
            return
        if self.place in (None, link.place):
            self.asked = self._due = 0.0
        self._owner.server_changed()
        if self._owner.waits:
            self._retry()
        else:
            self.look()

    # -- following the graph ---------------------------------------------------------------------

    def follow(self) -> None:
        """Look what the master says, and now and then whether the server lives."""
        if self._closed:
            return
        nodes = self._core.graph.services().get(self.name, [])
        if nodes != self._nodes:
            self._nodes, self._due = nodes, 0.0
            if not nodes and not self._owner.waits:
                self.place = self.peer = None
                self._fault = ""
        # The graph may lag behind: who has come and gone between two looks is in none of them.
        known = bool(nodes or self._fault) or self.peer is not None
        if (known and time.monotonic() >= self._due) or self._owner.waits:
            self.look()
        self._owner.server_changed()

    def close(self) -> None:
        """Look for nobody any more; from any thread."""
        self._closed = True


@dataclass(frozen=True)
class Place:
    """Where a service's server is.

    Attributes:
        uri: As the master has it, ``rosrpc://host:port``.
        address: Resolved address and port.
    """

    uri: str
    address: tuple[str, int]


@dataclass(frozen=True)
class Peer:
    """What a service's server says of itself.

    Attributes:
        node: Its node's full name; its address where it does not tell.
        type: The service type, ``pkg/srv/Type``; empty when it does not tell.
        md5: The type's md5 sum, ``*`` for any.
    """

    node: str
    type: str
    md5: str

    @classmethod
    def of(cls, header: Mapping[str, str], place: Place) -> Peer:
        """Return what a connection header says.

        Raises:
            ConnectionLostError: It lacks the md5 sum, which every server tells.
        """
        node = header.get("callerid", "") or place.uri
        if "md5sum" not in header:
            raise ConnectionLostError(
                f"{node} answers, but not as a service does: its connection header has no md5sum"
            )
        name = header.get("type", ANY)
        try:
            full = "" if name == ANY else join_name(name, "srv")
        except InvalidNameError:
            full = name
        return cls(node, full, header["md5sum"])


def locate(master: Master, name: str) -> Place | None:
    """Ask the master where a service is; None when nobody offers it. Waits for the answer.

    Raises:
        ConnectionLostError: The master does not answer, or names a host that is not known here.
    """
    try:
        uri = str(master.call("lookupService", name))
    except MasterError:
        return None
    try:
        host, port = parse_uri(uri, f"the master's answer for {name}")
    except ConversionError as error:
        raise ConnectionLostError(str(error)) from error
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise ConnectionLostError(
            f"{name} is at {uri}, but {reason_of(error)}: set ROS_IP or ROS_HOSTNAME for the node "
            "that offers it to what this machine knows, or add the name to /etc/hosts"
        ) from error
    return Place(uri, (str(found[0][4][0]), int(found[0][4][1])))


def probe(
    core: TcprosCore, name: str, place: Place, done: Callable[[Peer | None, str], None]
) -> None:
    """Ask a server for its type; in the loop's thread.

    Args:
        core: The asking node.
        name: Absolute name of the service.
        place: Where its server is.
        done: Called once in the loop's thread: with what the server says, or None and why not.

    Raises:
        OSError: There can be no more sockets.
    """
    header = {"callerid": core.name.full, "md5sum": ANY, "probe": "1", "service": name}
    answered = False

    def finish(peer: Peer | None, reason: str) -> None:
        nonlocal answered
        if not answered:
            answered = True
            done(peer, reason)

    def on_header(fields: dict[str, str]) -> None:
        try:
            finish(Peer.of(fields, place), "")
        except ConnectionLostError as error:
            finish(None, str(error))
        link.end("")

    link = Connection.dial(
        core.loop,
        place.address,
        header,
        on_header,
        lambda _data, _lead: None,  # it was not called
        lambda reason: finish(None, reason),
        lead=1,
    )
