"""Calling ROS 1 services."""

from __future__ import annotations

import itertools
import logging
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm.calling import CallingClient
from rosglass.comm.client import untyped
from rosglass.comm.service_server import served_by_this_thread
from rosglass.errors import Error, ServiceError
from rosglass.ros1.core import Member
from rosglass.ros1.service_finder import ServiceFinder
from rosglass.ros1.service_link import Request, ServiceLink
from rosglass.ros1.service_probe import probe
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from rosglass.comm import Call, QoS
    from rosglass.messages import Message, MessageType, ServiceType
    from rosglass.ros1.core import Core
    from rosglass.ros1.service_probe import Peer, Place
    from rosglass.ros1.services import Services

__all__ = ["Ros1ServiceClient"]

_log = logging.getLogger("rosglass.ros1")
#: Connections at once, each with a call; more calls wait for their turn.
_MOST_LINKS = 64


class Ros1ServiceClient(CallingClient[Request], Member):
    """A service client; made by :meth:`Ros1Node.create_service_client`.

    Except what users call, everything runs in the loop's thread, which owns the connections.

    Args:
        core: The node it belongs to.
        services: The node's services.
        name: Absolute service name.
        wanted: The type, or its name: then the version that the server announces is taken if the
            library has it; None takes whatever type the server announces.
        qos: Kept for who asks; ROS 1 has none.
        persistent: Whether calls go one after the other through one connection that is kept,
            instead of a connection for each.
    """

    _core: Core

    def __init__(
        self,
        core: Core,
        services: Services,
        name: str,
        wanted: ServiceType | str | None,
        qos: QoS,
        persistent: bool,
    ) -> None:
        super().__init__(core, name)
        self.qos, self.persistent, self._services = qos, persistent, services
        self._finder = ServiceFinder(core, services, name, wanted, self)
        self._numbers = itertools.count(1)
        self._waiters = 0
        #: The connection that is kept; who claims it for a request has the lock.
        self._kept: ServiceLink | None = None
        #: Belongs to the loop's thread.
        self._links: set[ServiceLink] = set()

    # -- who is there ----------------------------------------------------------------------------

    @property
    def type(self) -> ServiceType | None:  # type: ignore[override]
        """The service type; None while it is not discovered yet."""
        return self._finder.type

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands the requests."""
        return self._finder.ready and not self._closed

    def _conflicts(self) -> list[str]:
        conflict = self._finder.conflict()
        return [conflict] if conflict else []

    def _absence(self) -> str:
        return self._finder.absence()

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for a server; see :meth:`rosglass.comm.ServiceClient.wait_for_server`."""
        with self._lock:
            self._waiters += 1
        try:
            if not self.ready:
                self._core.loop.call(self._finder.look)
            return super().wait_for_server(timeout)
        finally:
            with self._lock:
                self._waiters -= 1

    # -- calling ---------------------------------------------------------------------------------

    def _answered_here(self) -> bool:
        return served_by_this_thread(self._core, self.name)

    def _encode(self, value: Any) -> tuple[ServiceType | None, Any]:
        kind = self.type
        return kind, untyped(value, self.name) if kind is None else Request.encoded(kind, value)

    def _request(
        self,
        call: Call,
        value: Any,
        kind: ServiceType | None,
        timeout: float | None,  # noqa: ARG002 - the call's own end is enough
    ) -> Request:
        number, now = next(self._numbers), time.monotonic()
        return Request(call=call, value=value, type=kind, number=number, made=now)

    def _begin(self, entry: Request) -> None:
        """Send a request at once if a kept connection is idle; else let the loop do it."""
        link = self._kept
        if link is not None and link.peer is not None and self._right(link, entry.type):
            with self._lock:
                alone = len(self._queue) == 1 and self._queue[0] is entry
                taken = link.request is not None or link.settling or link.ended
                free = alone and not taken and not entry.call.done() and link.quiet()
                if free:
                    self._queue.popleft()
                    link.request, entry.link = entry, link
                    entry.began = time.monotonic()
            if free:
                self._send(link, entry)
                return
        self._core.loop.call(self._advance)

    def _delay(self, entry: Request) -> str:
        if entry.began is not None:
            return "its server takes long to accept a connection"
        busy = len(self._links)
        if busy:
            return f"{busy} earlier call{'s are' if busy > 1 else ' is'} not answered yet"
        return "its server appeared too late"

    def _server_name(self) -> str:
        return self._finder.server

    def _decode(self, kind: MessageType, data: bytes | memoryview) -> Message:
        kind.validate(data)
        return kind.decode(data)

    def _ended(self, entry: Request) -> None:
        if entry.timer is not None:
            entry.timer.close()
        with self._lock:
            self._requests.pop(entry.call, None)
        if entry.link is not None or entry.began is None:
            self._core.loop.call(lambda: self._release(entry))

    def _release(self, entry: Request) -> None:
        link = entry.link
        if link is not None and link.request is entry:
            # Given up: a response that still comes must not be taken for another one's, and the
            # next call shall not go to the same place without asking.
            link.request, self._finder.asked = None, 0.0
            link.end("")
        else:
            with self._lock:
                if entry in self._queue:
                    self._queue.remove(entry)

    # -- sending, in the loop's thread -----------------------------------------------------------

    def _advance(self) -> None:
        """Send what waits, in order, if a server is there."""
        while self._queue and not self._closed:
            kind, place = self.type, None
            link = self._free_link() if self.persistent else None
            if link is None:
                if len(self._links) >= (1 if self.persistent else _MOST_LINKS):
                    return
                place = self._finder.current()
                if place is None:
                    return
            if kind is None:
                return  # the server is being asked for it
            with self._lock:
                if not self._queue or (link is not None and link.request is not None):
                    return
                entry = self._queue.popleft()
                entry.began = time.monotonic()
                if link is not None:
                    link.request, entry.link = entry, link
            error = self._prepare(entry, kind)
            if error is not None or entry.call.done():
                if link is not None:
                    link.request = entry.link = None
                if error is not None:
                    entry.call.fail(error)
            elif link is not None:
                self._send(link, entry)
            elif place is not None:
                self._dial(kind, place, entry)

    def _dial(self, kind: ServiceType, place: Place, entry: Request) -> None:
        try:
            link = ServiceLink(self._core, self.name, kind, place, self.persistent, self)
        except OSError as error:  # no more sockets, or an address that this machine cannot use
            self._put_back(entry)
            self._finder.fail(place, error.strerror or str(error))
        else:
            self._links.add(link)
            link.request, entry.link = entry, link
            self._kept = link if self.persistent else None

    def _free_link(self) -> ServiceLink | None:
        """Return the kept connection, if it is idle and still the right one."""
        for link in list(self._links):
            if link.peer is None or link.request is not None:
                continue
            if not self._right(link, self.type):
                link.end("")
            elif link.lives():
                return link
        return None

    def _right(self, link: ServiceLink, kind: ServiceType | None) -> bool:
        """Return whether a connection is one of this type with who offers the service now."""
        return link.kind is kind and self._finder.place in (None, link.place)

    def _prepare(self, entry: Request, kind: ServiceType) -> Error | None:
        try:
            entry.encode(kind)
        except Error as error:
            return error
        except Exception as error:
            _log.exception("%s: encoding a request failed", self.name)
            return ServiceError(f"{self.name}: the request could not be sent: {error}")
        return None

    def _send(self, link: ServiceLink, entry: Request) -> None:
        entry.sent = time.monotonic()
        link.send(entry.encode(link.kind))

    def link_ready(self, link: ServiceLink, peer: Peer) -> None:
        """Send the request for which the connection was made."""
        self._finder.meet(peer)
        entry = link.request
        if entry is None or entry.call.done():
            link.end("")
        elif peer.md5 not in (ANY, link.kind.md5):
            link.refusal = self._finder.mismatch() or f"it has md5 {peer.md5}"
            link.end(link.refusal)
        else:
            self._send(link, entry)

    def link_answered(self, link: ServiceLink, ok: bool, data: bytes | memoryview) -> None:
        """End the call that was answered."""
        with self._lock:
            link.settling = link.persistent
            entry, link.request = link.request, None
        if link.persistent:
            # Not at once: its end may come right behind the response, or what nobody asked for.
            self._core.loop.call(lambda: self._settle(link))
        else:
            link.end("")
        if entry is not None:
            entry.link = None
            if ok:
                self._fulfil(entry.call, link.kind.response, data)
            else:
                text = bytes(data).decode("utf-8", "replace").strip()
                told = text or "its server reports a failure and does not say why"
                entry.call.fail(ServiceError(f"the call of {self.name} failed: {told}"))

    def _settle(self, link: ServiceLink) -> None:
        link.settling = False
        self._advance()

    def link_ended(self, link: ServiceLink, reason: str) -> None:
        """End the call that can get no answer any more, or try again if it was not sent."""
        self._links.discard(link)
        with self._lock:
            link.ended = True
            entry, link.request = link.request, None
        if entry is not None:
            entry.link = None
            if entry.sent is not None:
                entry.call.fail(entry.loss(f"the call of {self.name}", self._finder.server, reason))
            elif link.refusal and (entry.refused or self._finder.asked >= entry.made):
                self._explain(entry, link)
            elif not entry.call.done():
                # Refused where the server was before the call: it may be elsewhere by now.
                entry.refused = bool(link.refusal)
                self._put_back(entry)
        if self._closed:
            return
        if reason:
            self._finder.lose(link, reason)
        self._advance()

    def _put_back(self, entry: Request) -> None:
        """Let a request wait again that could not be sent."""
        with self._lock:
            entry.began = None
            waiting = sorted((*self._queue, entry), key=lambda one: one.number)
            self._queue.clear()
            self._queue.extend(waiting)

    def _explain(self, entry: Request, link: ServiceLink) -> None:
        """End a call that was refused: most likely the server has another definition."""

        def fail(peer: Peer | None, _: str = "") -> None:
            if peer is not None:
                self._finder.meet(peer)
            called = f"it was called as {link.kind.name} with md5 {link.kind.md5}"
            told = self._finder.mismatch() or f"{called}: {link.refusal}"
            refused = f"{link.place.uri} refuses the call of {self.name}: {told}"
            entry.call.fail(ServiceError(refused))

        try:
            probe(self._core, self.name, link.place, fail)
        except OSError:  # no more sockets
            fail(None)

    # -- what the finder asks and tells, in the loop's thread --------------------------------------

    @property
    def waits(self) -> bool:
        """Whether somebody waits for the server."""
        return bool(self._queue) or (self._waiters > 0 and not self.ready)

    @property
    def busy(self) -> bool:
        """Whether there are connections with the server."""
        return bool(self._links)

    def server_found(self, moved: bool) -> None:
        """Call the server where it is now."""
        if moved:
            for link in [link for link in self._links if link.request is None]:
                link.end("")  # a kept connection to who offers it no more
        self._advance()

    def server_changed(self) -> None:
        """Tell what has changed."""
        self._warn(_log)
        self._readiness.update()

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - time matters as well
        """Follow the graph: whether a server is there, and which."""
        self._core.loop.call(self._finder.follow)

    # -- the end ---------------------------------------------------------------------------------

    def _withdraw(self) -> None:
        self._finder.close()
        self._core.loop.call(self._end)

    def _end(self) -> None:
        with self._lock:
            self._queue.clear()
        for link in list(self._links):
            link.request = None
            link.end("")
