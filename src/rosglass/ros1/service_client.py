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
from rosglass.comm.similar import similar
from rosglass.errors import (
    ConnectionLostError,
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
from rosglass.ros1.service_link import Request, ServiceLink, check_size
from rosglass.ros1.service_probe import locate, probe
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
#: Seconds for which the master's word where a server is counts, when calls come one by one.
_TRUST = 1.0
#: Seconds between looks for a server while somebody waits for it.
_RETRY = 0.2
#: Seconds between looks whether the server lives: one that was killed stays with the master.
_CHECK, _CHECK_ABSENT = 3.0, 1.0


class Ros1ServiceClient(ServiceClient, Member):
    """A service client; made by :meth:`Ros1Node.create_service_client`.

    Except what users call, everything runs in the loop's thread, which owns the queue, the
    connections, and what is known of the server.

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
        self.type: ServiceType | None = None if wanted is None else core.types.service(wanted)
        self._core, self._services = core, services
        self._discovers, self._fixed = wanted is None, not isinstance(wanted, (str, type(None)))
        self._lock = threading.Lock()
        self._requests: dict[Call, Request] = {}
        self._count = 0
        self._closed = False
        self._waiters = 0
        # What follows belongs to the loop's thread.
        self._queue: deque[Request] = deque()
        self._links: set[ServiceLink] = set()
        self._place: Place | None = None
        self._place_time = 0.0
        self._peer: Peer | None = None
        self._looking = self._probing = self._retrying = False
        self._due = 0.0
        #: Why the server cannot be reached, or its type is not known; empty when that is not so.
        self._fault = self._type_fault = self._warned = ""
        self._nodes: list[str] = []
        self._tried: tuple[str, str] | None = None
        self._readiness = Readiness(name, lambda: self.ready, self._check_open, core.dispatcher)

    # -- who is there ----------------------------------------------------------------------------

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands the requests."""
        known = self._peer is not None and self.type is not None
        return known and not self._closed and not self._mismatch()

    @property
    def problem(self) -> str:
        """Why the service cannot be called, in words; empty when all is well."""
        if self._closed:
            return "the client is closed"
        return self._conflict() or ("" if self.ready else self._absence())

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
                self._core.loop.call(self._look)
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
            self._core.loop.call(self._advance)
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
        self._core.loop.call(self._advance)
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
                f"{self.name} did not answer within {timeout:g} s: {self._server} was sent the "
                f"request {time.monotonic() - entry.sent:.1f} s ago, and may still carry it out"
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
        # Whoever waits for room, or for a connection, learns it there.
        self._core.loop.call(lambda: self._release(entry))

    def _release(self, entry: Request) -> None:
        link = entry.link
        if link is not None and link.request is entry:
            # Given up: a response that still comes must not be taken for another one's, and the
            # next call shall not go to the same place without asking.
            link.request, self._place_time = None, 0.0
            link.end("")
        elif entry.began is None:
            with self._lock:
                if entry in self._queue:
                    self._queue.remove(entry)

    # -- sending, in the loop's thread -----------------------------------------------------------

    def _advance(self) -> None:
        """Send what waits, in order, if a server is there."""
        while self._queue and not self._closed:
            kind, place = self.type, self._place
            link = self._free_link() if self.persistent else None
            if link is None:
                if len(self._links) >= (1 if self.persistent else _MOST_LINKS):
                    return
                if place is None or time.monotonic() - self._place_time > _TRUST:
                    self._look()
                    return
            if kind is None:
                return  # the server is being asked for it
            entry = self._queue.popleft()
            if entry.call.done() or not self._encoded(entry, kind):
                continue
            entry.began = time.monotonic()
            if link is not None:
                link.request, entry.link = entry, link
                self._send(link, entry)
            elif place is not None:
                self._dial(kind, place, entry)

    def _dial(self, kind: ServiceType, place: Place, entry: Request) -> None:
        try:
            link = ServiceLink(self._core, self.name, kind, place, self.persistent, self)
        except OSError as error:  # no more sockets, or an address that this machine cannot use
            self._place, self._fault = None, self._dead(place, error.strerror or str(error))
            self._put_back(entry)
            self._retry()
        else:
            self._links.add(link)
            link.request, entry.link = entry, link

    def _free_link(self) -> ServiceLink | None:
        """Return the kept connection, if it is idle and still the right one."""
        for link in list(self._links):
            if link.peer is None or link.request is not None:
                continue
            if link.kind is not self.type or self._place not in (None, link.place):
                link.end("")
            elif link.lives():
                return link
        return None

    def _encoded(self, entry: Request, kind: ServiceType) -> bool:
        try:
            entry.encode(kind)
        except Error as error:
            entry.call.fail(error)
        except Exception as error:
            _log.exception("%s: encoding a request failed", self.name)
            entry.call.fail(ServiceError(f"{self.name}: the request could not be sent: {error}"))
        return not entry.call.done()

    def _send(self, link: ServiceLink, entry: Request) -> None:
        entry.sent = time.monotonic()
        link.send(entry.encode(link.kind))

    def link_ready(self, link: ServiceLink, peer: Peer) -> None:
        """Send the request for which the connection was made."""
        self._meet(peer)
        entry = link.request
        if entry is None or entry.call.done():
            link.end("")
        elif peer.md5 not in (ANY, link.kind.md5):
            link.refusal = self._mismatch() or f"it has md5 {peer.md5}"
            link.end(link.refusal)
        else:
            self._send(link, entry)

    def link_answered(self, link: ServiceLink, ok: bool, data: bytes | memoryview) -> None:
        """End the call that was answered."""
        entry, link.request = link.request, None
        if not link.persistent:
            link.end("")
        if entry is not None:
            entry.link = None
            if ok:
                self._take(link, entry, data)
            else:
                text = bytes(data).decode("utf-8", "replace").strip()
                told = text or "its server reports a failure and does not say why"
                entry.call.fail(ServiceError(f"the call of {self.name} failed: {told}"))
        if link.persistent:
            # Not at once: its end may come right behind the response.
            self._core.loop.call(self._advance)

    def link_ended(self, link: ServiceLink, reason: str) -> None:
        """End the call that can get no answer any more, or try again if it was not sent."""
        self._links.discard(link)
        entry, link.request = link.request, None
        if entry is not None:
            entry.link = None
            if entry.sent is not None:
                entry.call.fail(self._loss(entry, reason))
            elif link.refusal and (entry.refused or self._place_time >= entry.made):
                self._explain(entry, link)
            elif not entry.call.done():
                # Refused where the server was before the call: it may be elsewhere by now.
                entry.refused = bool(link.refusal)
                self._put_back(entry)
        if self._closed:
            return
        if reason:
            self._lose(link, reason)
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
                f"{self._server} answered the call of {self.name} with bytes that are no "
                f"{response.name}: {problem}; it was probably built from another definition "
                "of the type: add that to the library"
            )
            rubbish.__cause__ = problem
            entry.call.fail(rubbish)
        else:
            entry.call.fulfil(message)

    def _loss(self, entry: Request, reason: str) -> ConnectionLostError:
        since = time.monotonic() - (entry.sent or 0.0)
        return ConnectionLostError(
            f"{self._server} went away before it answered the call of {self.name} sent "
            f"{since:.1f} s ago ({reason or 'the connection was closed'}), and may have carried "
            "it out or not; look what happened, and call again"
        )

    def _explain(self, entry: Request, link: ServiceLink) -> None:
        """End a call that was refused: most likely the server has another definition."""

        def fail(peer: Peer | None, _: str = "") -> None:
            if peer is not None and not self._closed:
                self._meet(peer)
            called = f"it was called as {link.kind.name} with md5 {link.kind.md5}"
            told = self._mismatch() or f"{called}: {link.refusal}"
            refused = f"{link.place.uri} refuses the call of {self.name}: {told}"
            entry.call.fail(ServiceError(refused))

        try:
            probe(self._core, self.name, link.place, fail)
        except OSError:  # no more sockets
            fail(None)

    # -- finding the server, in the loop's thread ------------------------------------------------

    def _look(self) -> None:
        """Ask the master where the server is, and the server for its type if need be."""
        if self._looking or self._retrying or self._closed:
            return
        self._looking = True
        self._services.errands.run(self._locate)

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
        self._place_time = time.monotonic()
        if fault and self._peer is not None and self._place is not None:
            place = self._place  # only the master is away: the server is called where it was
        else:
            self._fault = fault
        if place is None:
            self._due = self._place_time + _CHECK_ABSENT
            self._place = self._peer = None
            self._update()
            self._retry()
            return
        moved = self._place is None or self._place.uri != place.uri
        self._place = place
        if moved:
            for link in [link for link in self._links if link.request is None]:
                link.end("")  # a kept connection to who offers it no more
        self._advance()
        wanted = self._peer is None or moved or self._place_time >= self._due
        if wanted and not self._probing and not self._links:
            self._probe(place)

    def _probe(self, place: Place) -> None:
        self._probing = True
        try:
            probe(self._core, self.name, place, lambda peer, why: self._probed(place, peer, why))
        except OSError as error:
            self._probed(place, None, error.strerror or str(error))

    def _probed(self, place: Place, peer: Peer | None, why: str) -> None:
        self._probing = False
        if self._closed:
            return
        if peer is not None:
            self._meet(peer)
            return
        self._due = time.monotonic() + _CHECK_ABSENT
        if place == self._place:
            self._fault, self._peer, self._place = self._dead(place, why), None, None
        self._update()
        self._retry()

    def _retry(self) -> None:
        """Look again soon if somebody waits."""
        if (self._queue or self._waiters) and not self._retrying:
            self._retrying = True
            self._core.loop.after(_RETRY, self._again)

    def _again(self) -> None:
        self._retrying = False
        if self._queue:
            self._advance()
        elif self._waiters and not self.ready:
            self._look()

    def _meet(self, peer: Peer) -> None:
        """Take what the server says of itself."""
        self._due = time.monotonic() + _CHECK
        self._peer, self._fault = peer, ""
        self._services.types.note(self.name, peer)
        key = (peer.type, peer.md5)
        ours = self.type
        fits = ours is not None and peer.md5 in (ANY, ours.md5)
        if self._discovers and fits and ours is not None:
            fits = peer.type in ("", ours.name)
        if fits:
            self._tried, self._type_fault = key, ""
        elif not self._fixed and (key != self._tried or self._type_fault):
            self._tried = key
            self._services.errands.run(lambda: self._learn(peer))
        self._update()

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
        self._update()
        self._advance()

    def _lose(self, link: ServiceLink, reason: str) -> None:
        """Forget a server whose connection has ended, as far as it is the one that counts."""
        if self._place is None or link.place == self._place:
            self._place_time = self._due = 0.0
            if link.peer is None and not link.refusal:
                self._peer, self._fault = None, self._dead(link.place, reason)
        self._update()
        if self._queue or self._waiters:
            self._retry()
        else:
            self._look()

    def _dead(self, place: Place, why: str) -> str:
        nodes = self._core.graph.services().get(self.name, [])
        who = f"{' and '.join(nodes)} offers" if nodes else "somebody offers"
        return (
            f"{who} it at {place.uri}, says the master, but calling it there fails: {why}; if "
            "it was killed, start it again, or let 'rosnode cleanup' remove it"
        )

    # -- following the graph ---------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - time matters as well
        """Follow the graph: whether a server is there, and which."""
        if not self._closed:
            self._core.loop.call(self._follow)

    def _follow(self) -> None:
        nodes = self._core.graph.services().get(self.name, [])
        if self._closed:
            return
        if nodes != self._nodes:
            self._nodes, self._due = nodes, 0.0
            if not nodes and not self._queue:
                self._place = self._peer = None
                self._fault = ""
        # The graph may lag behind: who has come and gone between two looks is in none of them.
        known = bool(nodes) or self._peer is not None
        if (known and time.monotonic() >= self._due) or self._queue:
            self._look()
        self._update()

    def _update(self) -> None:
        """Tell what has changed."""
        problem = self._conflict()
        if problem and problem != self._warned:
            _log.warning("%s: %s", self.name, problem)
        self._warned = problem
        self._readiness.update()

    @property
    def _server(self) -> str:
        return "its server" if self._peer is None else self._peer.node

    def _mismatch(self) -> str:
        """Say that the server has another definition; empty when it has ours."""
        peer, ours = self._peer, self.type
        if peer is None or ours is None or peer.md5 in (ANY, ours.md5):
            return ""
        return (
            f"{peer.node} offers {self.name} as {peer.type or 'an unknown type'} with md5 "
            f"{peer.md5}, not as {ours.name} with md5 {ours.md5}: it cannot be called; add the "
            "robot's definition to the library, or leave out the type. Ours:\n"
            f"{self._core.types.text(ours).strip()}"
        )

    def _conflict(self) -> str:
        """Say what a person has to mend; empty when nothing."""
        if self._peer is not None and self.type is None:
            return self._type_fault
        return self._mismatch()

    def _absence(self) -> str:
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
        self._core.loop.call(self._end)
        self._readiness.close()
        self._core.remove(self)

    def _end(self) -> None:
        self._queue.clear()
        for link in list(self._links):
            link.request = None
            link.end("")

    def _check_open(self) -> None:
        self._core.check_open()
        if self._closed:
            raise NodeClosedError(f"the client of {self.name} is closed; create another one")
