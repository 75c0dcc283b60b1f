"""The client's side of a service over TCPROS: its server's location, connections and requests.

Protocol: ROS wiki, "ROS/Master_API" (lookupService) and "ROS/TCPROS": only the server knows its
service's type, and sends it in its header (``probe=1`` connects for that alone). After the headers,
a request is a frame, and its response a frame after a byte that is 1 for success; else the frame
has the error text.
"""

from __future__ import annotations

import logging
import socket
import struct
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

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

    from rosglass.comm.service_client import PendingCalls
    from rosglass.comm.wire import PendingCall
    from rosglass.messages import ServiceType
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.master import Master

__all__ = [
    "ServerInfo",
    "ServiceFinder",
    "ServiceLink",
    "ServiceLocation",
    "TcprosRequester",
    "locate",
    "probe",
]


_log = logging.getLogger("rosglass.ros1")
_length = struct.Struct("<I")
#: Connections at once, each with a call; further calls are queued.
_MAX_LINKS = 64


class TcprosRequester(ServiceRequester):
    """Sends a service client's requests to the server that the master lists.

    The loop's thread owns the connections, and runs everything but the methods that clients call.
    The `route` of a call is the connection that it is sent through.

    Args:
        core: The node it belongs to.
        on_server: Called with the name and what a server of it announced.
        name: Absolute service name.
        wanted: The type, or its name: then the server's version is used if the library has it;
            None uses the type that the server announces.
        persistent: Whether calls use one connection, one after the other, instead of a connection
            each.
        calls: The calls that have not ended.
        on_change: Called when a server may have appeared or left.
    """

    max_request = MAX_FRAME

    def __init__(
        self,
        core: TcprosCore,
        on_server: Callable[[str, ServerInfo], None],
        name: str,
        wanted: ServiceType | str | None,
        persistent: bool,
        calls: PendingCalls,
        on_change: Callable[[], None],
    ) -> None:
        self._core, self._name, self._persistent = core, name, persistent
        self._calls, self._on_change = calls, on_change
        self._finder = ServiceFinder(core, on_server, name, wanted, self)
        #: Guards which request a connection is for: calling threads send through idle ones.
        self._lock = threading.Lock()
        #: The persistent connection; claimed for a request with the lock.
        self._kept: ServiceLink | None = None
        #: Belongs to the loop's thread.
        self._links: set[ServiceLink] = set()
        self._closed = False

    # -- the server --------------------------------------------------------------------------------

    @property
    def type(self) -> ServiceType | None:  # type: ignore[override]
        """The service type; None until it is discovered."""
        return self._finder.type

    def ready(self) -> bool:
        """Return whether there is a server of the right type."""
        return self._finder.ready

    def server_conflicts(self) -> list[str]:
        """Return the problems that the user has to fix."""
        conflict = self._finder.conflict()
        return [conflict] if conflict else []

    def unavailable_reason(self) -> str:
        """Return why there is no server, apart from conflicts."""
        return self._finder.unavailable_reason()

    def server_name(self) -> str:
        """Return the name of the server's node."""
        return self._finder.server

    def delay(self, pending: PendingCall) -> str:
        """Return why a request is not sent yet, apart from conflicts."""
        if not pending.waiting:
            return "its server has not accepted the connection"
        busy = len(self._links)
        if busy:
            return f"{busy} earlier call{'s are' if busy > 1 else ' is'} not answered yet"
        return "its server appeared too late"

    def find_server(self) -> None:
        """Look up the server now, as a thread waits for it."""
        self._core.loop.call(self._finder.look_up)

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - time counts as well
        """Follow the graph."""
        self._core.loop.call(self._finder.follow)

    # -- sending -----------------------------------------------------------------------------------

    def send(self, pending: PendingCall) -> None:
        """Send a request at once if the persistent connection is idle, else from the loop.

        The former saves two thread switches per call, most of its time.
        """
        link, claimed = self._kept, False
        usable = link is not None and link.peer is not None and self._fits(link, pending.type)
        with self._lock:
            if link is not None and usable and not self._calls.waiting:
                taken = link.request is not None or link.settling or link.ended
                if not taken and not pending.call.done() and link.has_nothing_to_read():
                    link.request, pending.route, claimed = pending, link, True
        if link is not None and claimed:
            self._send(link, pending)
        else:
            self._calls.enqueue(pending)
            self._core.loop.call(self._advance)

    def forget(self, pending: PendingCall) -> None:
        """Drop the response to a call that has ended."""
        if pending.route is not None:
            self._core.loop.call(lambda: self._release(pending))

    # -- sending, in the loop's thread -------------------------------------------------------------

    def _release(self, pending: PendingCall) -> None:
        link: ServiceLink | None = pending.route
        if link is not None and link.request is pending:
            # Given up: a late response must not be taken for another call's, and the next call
            # must look up the server again.
            link.request, self._finder.asked = None, 0.0
            link.end("")

    def _advance(self) -> None:
        """Send queued requests, in order, if there is a server."""
        while (pending := self._calls.first()) is not None and not self._closed:
            service_type, location = self.type, None
            link = self._free_link() if self._persistent else None
            if link is None:
                if len(self._links) >= (1 if self._persistent else _MAX_LINKS):
                    return
                location = self._finder.current()
                if location is None:
                    return
            if service_type is None:
                return  # it is being requested from the server
            with self._lock:
                if link is not None and link.request is not None:
                    return
                if not self._calls.take(pending):
                    continue  # it has just ended
                if link is not None:
                    link.request, pending.route = pending, link
            error = self._prepare(pending, service_type)
            if error is not None or pending.call.done():
                if link is not None:
                    link.request = pending.route = None
                if error is not None:
                    pending.fail(error)
            elif link is not None:
                self._send(link, pending)
            elif location is not None:
                self._dial(service_type, location, pending)

    def _dial(
        self, service_type: ServiceType, location: ServiceLocation, pending: PendingCall
    ) -> None:
        try:
            link = ServiceLink(
                self._core, self._name, service_type, location, self._persistent, self
            )
        except OSError as error:  # no more sockets, or an address family without support
            self._calls.enqueue(pending)
            self._finder.fail(location, error.strerror or str(error))
        else:
            self._links.add(link)
            link.request, pending.route = pending, link
            link.is_current = self._finder.asked >= pending.made
            self._kept = link if self._persistent else None

    def _free_link(self) -> ServiceLink | None:
        """Return the persistent connection, if it is idle and still the right one."""
        for link in list(self._links):
            if link.peer is None or link.request is not None:
                continue
            if not self._fits(link, self.type):
                link.end("")
            elif link.is_alive():
                return link
        return None

    def _fits(self, link: ServiceLink, service_type: ServiceType | None) -> bool:
        """Return whether a connection has this type and leads to the current server."""
        return link.type is service_type and self._finder.location in (None, link.location)

    def _prepare(self, pending: PendingCall, service_type: ServiceType) -> Error | None:
        try:
            pending.encode(service_type)
        except Error as error:
            return error
        except Exception as error:  # noqa: BLE001 - the caller waits for it
            _log.exception("%s: encoding a request failed", self._name)
            return ServiceError(f"{self._name}: the request could not be sent: {error}")
        return None

    def _send(self, link: ServiceLink, pending: PendingCall) -> None:
        pending.sent = time.monotonic()
        link.send(pending.encode(link.type))

    # -- events of connections, in the loop's thread -----------------------------------------------

    def on_accepted(self, link: ServiceLink, peer: ServerInfo) -> None:
        """Send the request for which the connection was made."""
        self._finder.on_server_header(peer)
        pending = link.request
        if pending is None or pending.call.done():
            link.end("")
        elif peer.md5 not in (ANY, link.type.md5):
            link.refusal = self._finder.mismatch() or f"it has md5 {peer.md5}"
            link.end(link.refusal)
        else:
            self._send(link, pending)

    def on_response(self, link: ServiceLink, ok: bool, data: bytes | memoryview) -> None:
        """Complete the call that is answered."""
        with self._lock:
            link.settling = link.persistent
            pending, link.request = link.request, None
        if link.persistent:
            # Not at once: right behind the response may be the end, or an unexpected response.
            self._core.loop.call(lambda: self._settle(link))
        else:
            link.end("")
        if pending is not None:
            pending.route = None
            if ok:
                pending.answer(data)
            else:
                text = bytes(data).decode("utf-8", "replace").strip()
                pending.fail(text or "its server reports a failure without a reason")

    def _settle(self, link: ServiceLink) -> None:
        link.settling = False
        self._advance()

    def on_disconnected(self, link: ServiceLink, reason: str) -> None:
        """Fail the call whose answer is lost, or queue it again if it was not sent."""
        self._links.discard(link)
        with self._lock:
            link.ended = True
            pending, link.request = link.request, None
        if pending is not None:
            pending.route = None
            if pending.sent is not None:
                pending.fail(self._loss(pending.sent, reason))
            elif link.refusal and link.is_current:
                self._explain(pending, link)
            else:
                # If refused at a location from before the call, the server may have moved.
                self._calls.enqueue(pending)
        if self._closed:
            return
        if reason:
            self._finder.on_link_lost(link, reason)
        self._advance()

    def _loss(self, sent: float, reason: str) -> ConnectionLostError:
        """Return the error of a call whose connection ended after its request was sent."""
        since = time.monotonic() - sent
        return ConnectionLostError(
            f"{self._finder.server} went away before it answered the call of {self._name} sent "
            f"{since:.1f} s ago ({reason or 'the connection was closed'}), and may have carried it "
            "out or not; check, and call again"
        )

    def _explain(self, pending: PendingCall, link: ServiceLink) -> None:
        """Fail a refused call: most likely the server has another definition."""

        def fail(peer: ServerInfo | None, _: str = "") -> None:
            if peer is not None:
                self._finder.on_server_header(peer)
            called = f"it was called as {link.type.name} with md5 {link.type.md5}"
            why = self._finder.mismatch() or f"{called}: {link.refusal}"
            refused = f"{link.location.uri} refuses the call of {self._name}: {why}"
            pending.fail(ServiceError(refused))

        try:
            probe(self._core, self._name, link.location, fail)
        except OSError:  # no more sockets
            fail(None)

    # -- for the finder, in the loop's thread ------------------------------------------------------

    @property
    def is_awaited(self) -> bool:
        """True while calls or threads wait for the server."""
        return bool(self._calls.waiting or (self.waiters and not self.ready()))

    @property
    def has_connections(self) -> bool:
        """True while there are connections with the server, which make a probe needless."""
        return bool(self._links)

    def on_server_found(self, moved: bool) -> None:
        """Send queued requests to the server, and nothing to its previous location."""
        if moved:
            # Marked first: a calling thread may claim an idle connection at any time.
            with self._lock:
                idle = [link for link in self._links if link.request is None]
                for link in idle:
                    link.ended = True
            for link in idle:
                link.end("")
        self._advance()

    def on_server_changed(self) -> None:
        """Report a change of the server."""
        self._on_change()

    # -- the end -----------------------------------------------------------------------------------

    def close(self) -> None:
        """Close the connections; safe to call twice."""
        self._closed = True
        self._finder.close()
        self._core.loop.call(self._end)

    def _end(self) -> None:
        for link in list(self._links):
            link.request = None
            link.end("")


class ServiceLink:
    """A connection to a server; in the loop's thread.

    Except :meth:`send` and :meth:`has_nothing_to_read`, which any thread may call.

    Args:
        core: The node.
        name: Absolute service name.
        service_type: The service type.
        location: The server's location.
        persistent: Whether to request a persistent connection.
        owner: Handles its events.

    Raises:
        OSError: The system has no more sockets.

    Attributes:
        type: The service type.
        location: The server's location.
        is_current: Whether that was looked up after the call for which the connection was made.
        peer: The server's announcement; None until its header is received.
        refusal: Why the server refuses the connection; empty if it does not.
        request: The call that it is used for; None when it is idle.
        settling: Whether data received with the last response is still being handled.
        ended: Whether it must not be used any more.
    """

    def __init__(
        self,
        core: TcprosCore,
        name: str,
        service_type: ServiceType,
        location: ServiceLocation,
        persistent: bool,
        owner: TcprosRequester,
    ) -> None:
        self.type, self.location, self.persistent = service_type, location, persistent
        self.peer: ServerInfo | None = None
        self.refusal = ""
        self.request: PendingCall | None = None
        self.is_current = self.settling = self.ended = False
        self._owner = owner
        header = {
            "callerid": core.name.full,
            "md5sum": service_type.md5,
            "service": name,
            "type": ros1_name(service_type.name),
        }
        if persistent:
            header["persistent"] = "1"
        self._connection = Connection.dial(
            core.loop,
            location.address,
            header,
            self._on_header,
            self._on_frame,
            self._on_end,
            lead=1,
        )

    def send(self, data: bytes) -> None:
        """Send a request, once the server has accepted the connection."""
        self._connection.send([_length.pack(len(data)), data])

    def has_nothing_to_read(self) -> bool:
        """Return whether the socket has neither data nor its end to read; from any thread."""
        return self._connection.has_nothing_to_read()

    def is_alive(self) -> bool:
        """Return whether the server has not closed it; reads the socket's data."""
        self._connection.ready(READ)
        return not self._connection.closed

    def end(self, reason: str = "") -> None:
        """End it, with a reason."""
        self._connection.end(reason)

    def _on_header(self, header: dict[str, str]) -> None:
        try:
            self.peer = ServerInfo.of(header, self.location)
        except ConnectionLostError as error:
            self.end(str(error))
            return
        self._owner.on_accepted(self, self.peer)

    def _on_frame(self, data: bytes | memoryview, lead: int) -> None:
        if self.request is None:
            self.end("it sent a response without a request")
        else:
            self._owner.on_response(self, lead != 0, data)

    def _on_end(self, reason: str) -> None:
        self.refusal = self.refusal or self._connection.header.get("error", "")
        self._owner.on_disconnected(self, reason)


#: Seconds for which a looked-up location is used for further calls.
_CACHE_S = 1.0
#: Seconds between lookups while calls or threads wait for the server.
_RETRY_S = 0.2
#: Seconds between probes of the server, and of one that is not reached: the master still lists a
#: server that was killed.
_PROBE_S, _PROBE_ABSENT_S = 3.0, 1.0


class ServiceFinder:
    """Finds a service's server and its type; in the loop's thread, unless said otherwise.

    Args:
        core: The node.
        on_server: Called with the name and what a server of it announced.
        name: Absolute service name.
        wanted: The type, its name, or None for the type that the server announces.
        owner: Notified of the results.

    Attributes:
        type: The service type; None while it is unknown.
        peer: The server's announcement; None while no server is known.
        location: The server's location; None when unknown.
        asked: Monotonic time of the last lookup; 0 when the server must be looked up again.
    """

    def __init__(
        self,
        core: TcprosCore,
        on_server: Callable[[str, ServerInfo], None],
        name: str,
        wanted: ServiceType | str | None,
        owner: TcprosRequester,
    ) -> None:
        self.name = name
        self.type: ServiceType | None = None if wanted is None else core.types.service(wanted)
        self.peer: ServerInfo | None = None
        self.location: ServiceLocation | None = None
        self.asked = 0.0
        self._core, self._on_server, self._owner = core, on_server, owner
        self._discovers, self._fixed = wanted is None, not isinstance(wanted, (str, type(None)))
        self._looking = self._probing = self._retrying = self._closed = False
        #: When to probe the server next.
        self._due = 0.0
        #: Why the server cannot be reached, and why its type is unknown; else empty.
        self._fault = self._type_fault = ""
        self._nodes: list[str] = []
        #: Type and md5 sum of the last search for a definition.
        self._tried: tuple[str, str] | None = None

    # -- the server; from any thread -------------------------------------------------------------

    @property
    def ready(self) -> bool:
        """True while there is a server of the right type."""
        return self.peer is not None and self.type is not None and not self.mismatch()

    @property
    def server(self) -> str:
        """The name of the server's node."""
        peer = self.peer
        return "its server" if peer is None else peer.node

    def mismatch(self) -> str:
        """Return how the server's type differs from this node's; empty if it does not."""
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
        """Return the problem that the user has to fix; empty if there is none."""
        if self.peer is not None and self.type is None:
            return self._type_fault
        return self.mismatch()

    def unavailable_reason(self) -> str:
        """Return why there is no server, apart from conflicts."""
        if self._fault:
            return self._fault
        known = self._core.graph.services()
        if self.name in known:
            return f"{' and '.join(known[self.name])} offers it, and its type is being requested"
        suffix = "" if self.type is None else f" [{self.type.name}]"
        return (
            f"no server offers {self.name}{suffix} on {self._core.url} ({self._core.status()})"
            f"{similar(self.name, known)}"
        )

    # -- the location ----------------------------------------------------------------------------

    def current(self) -> ServiceLocation | None:
        """Return the location; if it is not known or too old, look it up and return None."""
        if self.location is None or time.monotonic() - self.asked > _CACHE_S:
            self.look_up()
            return None
        return self.location

    def look_up(self) -> None:
        """Look up the location, and probe the server if it is new or due."""
        if self._looking or self._retrying or self._closed:
            return
        self._looking = True
        self._core.lookups.run(self._locate)

    def _locate(self) -> None:
        """Look up the location; on a thread that may wait."""
        location, fault = None, ""
        try:
            location = locate(self._core.master, self.name)
        except ConnectionLostError as error:
            fault = str(error)
        self._core.loop.call(lambda: self._located(location, fault))

    def _located(self, location: ServiceLocation | None, fault: str) -> None:
        self._looking = False
        if self._closed:
            return
        self.asked = time.monotonic()
        if fault and self.peer is not None and self.location is not None:
            location = (
                self.location
            )  # only the master is unreachable: keep using the known location
        else:
            self._fault = fault
        if location is None:
            self._due = self.asked + _PROBE_ABSENT_S
            self.location = self.peer = None
            self._owner.on_server_changed()
            self._retry()
            return
        moved = self.location is None or self.location.uri != location.uri
        self.location = location
        self._owner.on_server_found(moved)
        wanted = self.peer is None or moved or self.asked >= self._due
        if wanted and not self._probing and not self._owner.has_connections:
            self._probe(location)

    def _retry(self) -> None:
        """Look up the server again soon if calls or threads wait for it."""
        if self._owner.is_awaited and not self._retrying:
            self._retrying = True
            self._core.loop.after(_RETRY_S, self._again)

    def _again(self) -> None:
        self._retrying = False
        if self._owner.is_awaited:
            self.look_up()

    # -- the type --------------------------------------------------------------------------------

    def _probe(self, location: ServiceLocation) -> None:
        self._probing = True
        try:
            probe(
                self._core, self.name, location, lambda peer, why: self._probed(location, peer, why)
            )
        except OSError as error:  # no more sockets
            self._probed(location, None, error.strerror or str(error))

    def _probed(self, location: ServiceLocation, peer: ServerInfo | None, why: str) -> None:
        self._probing = False
        if self._closed:
            return
        if peer is not None:
            self.on_server_header(peer)
        else:
            self.fail(location, why)

    def on_server_header(self, peer: ServerInfo) -> None:
        """Handle a server's header: it is running, with this type."""
        if self._closed:
            return
        self._due = time.monotonic() + _PROBE_S
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
        self._owner.on_server_changed()

    def _learn(self, peer: ServerInfo) -> None:
        """Find the server's definition; on a thread that may wait."""
        service_type, fault = None, ""
        try:
            service_type = self._core.types.announced_service(peer.type, peer.md5)
        except Error as error:
            fault = f"{peer.node} offers it as {peer.type or 'an unknown type'}: {error}"
        self._core.loop.call(lambda: self._learned(peer, service_type, fault))

    def _learned(self, peer: ServerInfo, service_type: ServiceType | None, fault: str) -> None:
        if self._closed or self._tried != (peer.type, peer.md5):
            return
        same_name = self.type is None or service_type is None or service_type.name == self.type.name
        if service_type is not None and (self._discovers or same_name):
            self.type = service_type
        self._type_fault = fault
        self._owner.on_server_changed()
        self._owner.on_server_found(moved=False)

    def fail(self, location: ServiceLocation, why: str) -> None:
        """Note that the server cannot be reached."""
        self._due = time.monotonic() + _PROBE_ABSENT_S
        if self.location in (None, location):
            nodes = self._core.graph.services().get(self.name, [])
            who = f"{' and '.join(nodes)} offers" if nodes else "a node offers"
            self._fault = (
                f"{who} it at {location.uri} according to the master, but calling it fails: {why}; "
                "if it was killed, start it again, or remove it by 'rosnode cleanup'"
            )
            self.peer = self.location = None
        self._owner.on_server_changed()
        self._retry()

    def on_link_lost(self, link: ServiceLink, reason: str) -> None:
        """Handle a connection that has ended unexpectedly."""
        if link.peer is None and not link.refusal:
            self.fail(link.location, reason)
            return
        if self.location in (None, link.location):
            self.asked = self._due = 0.0
        self._owner.on_server_changed()
        if self._owner.is_awaited:
            self._retry()
        else:
            self.look_up()

    # -- following the graph ---------------------------------------------------------------------

    def follow(self) -> None:
        """Follow the graph, and probe the server now and then."""
        if self._closed:
            return
        nodes = self._core.graph.services().get(self.name, [])
        if nodes != self._nodes:
            self._nodes, self._due = nodes, 0.0
            if not nodes and not self._owner.is_awaited:
                self.location = self.peer = None
                self._fault = ""
        # The graph lags: a server that appears and leaves between two polls is never in it.
        known = bool(nodes or self._fault) or self.peer is not None
        if (known and time.monotonic() >= self._due) or self._owner.is_awaited:
            self.look_up()
        self._owner.on_server_changed()

    def close(self) -> None:
        """Stop looking for servers; from any thread."""
        self._closed = True


@dataclass(frozen=True)
class ServiceLocation:
    """The location of a service's server.

    Attributes:
        uri: As registered with the master, ``rosrpc://host:port``.
        address: Resolved address and port.
    """

    uri: str
    address: tuple[str, int]


@dataclass(frozen=True)
class ServerInfo:
    """The fields that a service's server announces in its header.

    Attributes:
        node: Its node's full name; its URI if the header has none.
        type: The service type, ``pkg/srv/Type``; empty if the header has none.
        md5: The type's md5 sum, ``*`` for any.
    """

    node: str
    type: str
    md5: str

    @classmethod
    def of(cls, header: Mapping[str, str], location: ServiceLocation) -> ServerInfo:
        """Read a connection header.

        Raises:
            ConnectionLostError: It lacks the md5 sum, which every server sends.
        """
        node = header.get("callerid", "") or location.uri
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


def locate(master: Master, name: str) -> ServiceLocation | None:
    """Look up the location of a service; None when it is not offered. Waits for the master.

    Raises:
        ConnectionLostError: The master does not answer, or the server's host is unknown here.
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
    return ServiceLocation(uri, (str(found[0][4][0]), int(found[0][4][1])))


def probe(
    core: TcprosCore,
    name: str,
    location: ServiceLocation,
    done: Callable[[ServerInfo | None, str], None],
) -> None:
    """Connect to a server for its type only; in the loop's thread.

    Args:
        core: The asking node.
        name: Absolute name of the service.
        location: Its location.
        done: Called once in the loop's thread: with the server's announcement, or None and why not.

    Raises:
        OSError: The system has no more sockets.
    """
    header = {"callerid": core.name.full, "md5sum": ANY, "probe": "1", "service": name}
    answered = False

    def finish(peer: ServerInfo | None, reason: str) -> None:
        nonlocal answered
        if not answered:
            answered = True
            done(peer, reason)

    def on_header(fields: dict[str, str]) -> None:
        try:
            finish(ServerInfo.of(fields, location), "")
        except ConnectionLostError as error:
            finish(None, str(error))
        link.end("")

    link = Connection.dial(
        core.loop,
        location.address,
        header,
        on_header,
        lambda _data, _lead: None,  # nothing was requested
        lambda reason: finish(None, reason),
        lead=1,
    )
