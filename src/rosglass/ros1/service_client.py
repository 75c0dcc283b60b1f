"""Calling ROS 1 services."""

from __future__ import annotations

import copy
import logging
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any

from rosglass.comm import Call, QoS, ServiceClient
from rosglass.comm.promise import check_timeout
from rosglass.comm.readiness import Readiness
from rosglass.comm.receiving import check_may_wait
from rosglass.errors import (
    ConversionError,
    DecodeError,
    Error,
    NodeClosedError,
    ServiceError,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)
from rosglass.ros1.core import Member
from rosglass.ros1.service_finder import ServiceFinder
from rosglass.ros1.service_link import Request, ServiceLink, check_size
from rosglass.ros1.service_probe import probe
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Executor, Handle
    from rosglass.messages import Message, ServiceType
    from rosglass.ros1.core import Core
    from rosglass.ros1.service_probe import Peer, Place
    from rosglass.ros1.services import Services

__all__ = ["Ros1ServiceClient"]

_log = logging.getLogger("rosglass.ros1")
#: Connections at once, each with a call; more calls wait for their turn.
_MOST_LINKS = 64


class Ros1ServiceClient(ServiceClient, Member):
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

    def __init__(
        self,
        core: Core,
        services: Services,
        name: str,
        wanted: ServiceType | str | None,
        qos: QoS,
        persistent: bool,
    ) -> None:
        self.name, self.qos, self.persistent = name, qos, persistent
        self._core, self._services = core, services
        self._finder = ServiceFinder(core, services, name, wanted, self)
        self._lock = threading.Lock()
        self._requests: dict[Call, Request] = {}
        self._count = 0
        self._closed = False
        self._waiters = 0
        #: The connection that is kept; who claims it for a request has the lock.
        self._kept: ServiceLink | None = None
        #: Calls that wait; changed with the lock.
        self._queue: deque[Request] = deque()
        # What follows belongs to the loop's thread.
        self._links: set[ServiceLink] = set()
        self._warned = ""
        self._readiness = Readiness(name, lambda: self.ready, self._check_open, core.dispatcher)

    # -- who is there ----------------------------------------------------------------------------

    @property
    def type(self) -> ServiceType | None:  # type: ignore[override]
        """The service type; None while it is not discovered yet."""
        return self._finder.type

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands the requests."""
        return self._finder.ready and not self._closed

    @property
    def problem(self) -> str:
        """Why the service cannot be called, in words; empty when all is well."""
        if self._closed:
            return "the client is closed"
        return self._finder.conflict() or ("" if self.ready else self._finder.absence())

    @property
    def pending(self) -> int:
        """Calls that have not ended."""
        return len(self._requests)

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for a server; see :meth:`rosglass.comm.ServiceClient.wait_for_server`."""
        with self._lock:
            self._waiters += 1
        try:
            if not self.ready:
                self._core.loop.call(self._finder.look)
            return self._readiness.wait(timeout)
        finally:
            with self._lock:
                self._waiters -= 1

    def on_ready_change(
        self, callback: Callable[[bool], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`ready` whenever it changes."""
        return self._readiness.add(callback, executor)

    # -- calling ---------------------------------------------------------------------------------

    def call(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Message:
        """Call and wait; see :meth:`rosglass.comm.ServiceClient.call`."""
        if self._services.serves_here(self.name):
            raise UnsupportedError(
                f"{self.name}: this callback would wait for itself: the server runs on the same "
                "thread of this node; take call_async() here, or give the server an executor "
                "of its own"
            )
        check_may_wait(self.name)
        timeout = check_timeout(timeout, self.name)
        entry = self._enter(request)
        try:
            self._begin(entry)
            if timeout is not None:
                try:
                    return entry.call.result(timeout)
                except TimeoutError:
                    # Either the call's own end, or that of the waiting: then this is its end.
                    self._expire(entry, timeout)
            return entry.call.result()
        except BaseException:
            entry.call.cancel()  # Ctrl-C: nobody waits for the response any more
            raise

    def call_async(
        self, request: Message | dict[str, Any] | None = None, /, *, timeout: float | None = 10.0
    ) -> Call:
        """Call and return at once; see :meth:`rosglass.comm.ServiceClient.call_async`."""
        timeout = check_timeout(timeout, self.name)
        entry = self._enter(request)
        if timeout is not None:
            entry.timer = self._core.timers.after(timeout, lambda: self._expire(entry, timeout))
        self._begin(entry)
        return entry.call

    def _enter(self, value: Any) -> Request:
        """Put a request into the queue."""
        self._check_open()
        kind = self.type
        # Encoded, or copied, now: the caller may change it while it waits for the server.
        if kind is not None:
            taken = kind.request.encode(value)
            check_size(taken, kind.request.name)
        elif value is None or hasattr(value, "to_dict") or isinstance(value, dict):
            taken = copy.deepcopy(value)
        else:
            raise ConversionError("", value, "a message or a dict of fields", self.name)
        call = Call(
            f"{self.name} has not answered, and the call goes on: no response",
            self._core.dispatcher,
            cancellable=True,
        )
        with self._lock:
            closed = self._closed
            self._count += 1
            entry = Request(self._count, call, taken, kind, time.monotonic())
            if not closed:
                self._requests[call] = entry
                self._queue.append(entry)
        if closed:
            self._check_open()
        call.add_done_callback(lambda _: self._ended(entry))
        return entry

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

    def _expire(self, entry: Request, timeout: float) -> None:
        """End a call whose time is over."""
        if entry.call.done():
            return
        error: Error
        if entry.sent is None:
            error = ServiceUnavailableError(
                f"{self.name} could not be called within {timeout:g} s: "
                f"{self.problem or self._delay(entry)}; nothing was sent"
            )
        else:
            error = TimeoutError(
                f"{self.name} did not answer within {timeout:g} s: {self._finder.server} was sent "
                f"the request {time.monotonic() - entry.sent:.1f} s ago, and may still carry it out"
            )
        entry.call.fail(error)

    def _delay(self, entry: Request) -> str:
        """Say why a request was not sent although all is well."""
        if entry.began is not None:
            return "its server takes long to accept a connection"
        busy = len(self._links)
        if busy:
            return f"{busy} earlier call{'s are' if busy > 1 else ' is'} not answered yet"
        return "its server appeared too late"

    def _ended(self, entry: Request) -> None:
        """Clean up after a call; in any thread."""
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
            error = self._encode(entry, kind)
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

    def _encode(self, entry: Request, kind: ServiceType) -> Error | None:
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
                self._take(link, entry, data)
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

    def _take(self, link: ServiceLink, entry: Request, data: bytes | memoryview) -> None:
        response = link.kind.response
        try:
            response.validate(data)
            message = response.decode(data)
        except DecodeError as problem:
            rubbish = ServiceError(
                f"{self._finder.server} answered the call of {self.name} with bytes that are no "
                f"{response.name}: {problem}; it was probably built from another definition "
                "of the type: add that to the library"
            )
            rubbish.__cause__ = problem
            entry.call.fail(rubbish)
        else:
            entry.call.fulfil(message)

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
        problem = self._finder.conflict()
        if problem and problem != self._warned:
            _log.warning("%s: %s", self.name, problem)
        self._warned = problem
        self._readiness.update()

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - time matters as well
        """Follow the graph: whether a server is there, and which."""
        self._core.loop.call(self._finder.follow)

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """End pending calls with NodeClosedError; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            entries = list(self._requests.values())
        if self._core.forked:
            return
        for entry in entries:
            entry.call.fail(NodeClosedError(f"the client of {self.name} was closed during a call"))
        self._finder.close()
        self._core.loop.call(self._end)
        self._readiness.close()
        self._core.remove(self)

    def _end(self) -> None:
        with self._lock:
            self._queue.clear()
        for link in list(self._links):
            link.request = None
            link.end("")

    def _check_open(self) -> None:
        self._core.check_open()
        if self._closed:
            raise NodeClosedError(f"the client of {self.name} is closed; create another one")
