"""The client's end of a service over TCPROS: connections to its server, and what goes through them.

Protocol: ROS wiki, "ROS/TCPROS": after the headers, a request is a frame, and its response a frame
with a byte in front that says whether all went well; the failure text is its content if not.
"""

from __future__ import annotations

import logging
import struct
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.comm.service_client import ServiceRequester
from rosglass.errors import ConnectionLostError, Error, ServiceError
from rosglass.interfaces import ros1_name
from rosglass.ros1.connection import MAX_FRAME, Connection
from rosglass.ros1.io_loop import READ
from rosglass.ros1.service_finder import ServiceFinder
from rosglass.ros1.service_probe import Peer, probe
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.service_client import PendingCall
    from rosglass.messages import ServiceType
    from rosglass.ros1.core import Core
    from rosglass.ros1.service_probe import Place
    from rosglass.ros1.services import Services
    from rosglass.wires.base import OnReply

__all__ = ["ServiceLink", "TcprosRequester"]

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
        services: The node's services.
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
        core: Core,
        services: Services,
        name: str,
        wanted: ServiceType | str | None,
        persistent: bool,
        on_reply: OnReply,
        on_change: Callable[[], None],
    ) -> None:
        self._core, self._name, self._persistent = core, name, persistent
        self._on_reply, self._on_change = on_reply, on_change
        self._finder = ServiceFinder(core, services, name, wanted, self)
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
            for link in list(self._links):
                if link.request is None:
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
        core: Core,
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
