"""A ROS 1 node on the wire: registers its members with the master, and accepts connections."""

from __future__ import annotations

import atexit
import logging
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from typing import TYPE_CHECKING

from rosglass.comm.log_limits import LogOnce
from rosglass.errors import ConnectionLostError, ServiceError
from rosglass.wires.tcpros.connection import Connection, survive_outages
from rosglass.wires.tcpros.core import TcprosCore
from rosglass.wires.tcpros.io_loop import Acceptor
from rosglass.wires.tcpros.registrations import Member, Registrations
from rosglass.wires.tcpros.service_replier import TcprosReplier
from rosglass.wires.tcpros.slave import Slave
from rosglass.wires.tcpros.topics import Topics

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from rosglass.comm import Handle, NodeName
    from rosglass.comm.wire import OnRequest
    from rosglass.messages import ServiceType
    from rosglass.wires.tcpros.core import AnnouncedTypes, TcprosOptions

__all__ = ["TcprosNode", "max_connections"]

_log = logging.getLogger("rosglass.ros1")
#: Connections at a time whose peer has not sent its header. More than wait to be accepted
#: (``_BACKLOG``): after a pause, as many honest ones arrive at once.
_MAX_SILENT_CONNECTIONS = 300
#: Seconds that listening at another address may wait for the I/O loop.
_MOVE_TIMEOUT_S = 2.0


class TcprosNode(TcprosCore):
    """A node with its topics, services, registrations and API.

    Args:
        name: The node's name.
        url: The URL it was connected with, for messages.
        options: Master, own address and ports.
        types: Finds types.

    Attributes:
        topics: The published and subscribed topics.
        repliers: The offered services, by name.

    Raises:
        ConnectionLostError: This machine cannot listen for connections.
    """

    #: The node's API, once it is started.
    _api: Slave | None = None

    def __init__(
        self, name: NodeName, url: str, options: TcprosOptions, types: AnnouncedTypes
    ) -> None:
        super().__init__(name, url, options, types)
        self._acceptors: list[Acceptor] = []
        #: Accepted connections; those without a header, the oldest first.
        self._connections: set[Connection] = set()
        self._silent: dict[Connection, None] = {}
        self._max_connections, self._log_once = max_connections(), LogOnce()
        self.topics, self.repliers = Topics(self), dict[str, TcprosReplier]()
        self._registrations = Registrations(self)
        self._worker = self._start_following()

    def start(self, on_parameter_changed: Callable[[str], None]) -> None:
        """Accept connections, and begin to poll the master.

        Args:
            on_parameter_changed: Called with the name of a subscribed parameter that has changed.
        """
        self._api = Slave(self, self.topics, on_parameter_changed)
        self.loop.call(self._open_acceptors)
        # Threads that deliver messages must not outlive the interpreter.
        atexit.register(self.close)
        self._registrations.start()

    def set_host(self, host: str) -> bool:
        """Announce a host or address, and listen there; return whether it has changed.

        From the thread that polls the master; waits for the loop.

        Raises:
            ConnectionLostError: This machine cannot listen for connections.
        """
        if self._api is None or host == self.address[0]:
            return super().set_host(host)
        changed: Future[bool] = Future()
        self.loop.call(lambda: self._move(host, changed))
        try:
            return changed.result(_MOVE_TIMEOUT_S)
        except FutureTimeoutError:  # the loop has ended, or a handler blocks it
            raise ConnectionLostError(f"{self.url}: cannot listen at {host} yet") from None

    def _move(self, host: str, changed: Future[bool]) -> None:
        """Listen for connections to another host; in the loop's thread."""
        self._end_acceptors()
        try:
            changed.set_result(not self.loop.closed and super().set_host(host))
        except ConnectionLostError as error:
            changed.set_exception(error)
        self._open_acceptors()

    def _open_acceptors(self) -> None:
        if self._api is None or self.loop.closed:
            return
        for sock, accept in zip(self._sockets, (self._accept, self._api.accept), strict=False):
            self._acceptors.append(Acceptor(self.loop, sock, accept))
            self._acceptors[-1].open()

    def _end_acceptors(self) -> None:
        for acceptor in self._acceptors:
            acceptor.end()
        self._acceptors.clear()

    def create_replier(self, name: str, type: ServiceType, on_request: OnRequest) -> TcprosReplier:
        """Register a service with the master, and return its receiving end.

        Raises:
            ServiceError: The node offers it already.
        """
        made = TcprosReplier(self, name, type, on_request, self._on_replier_closed)
        with self._lock:
            taken = name in self.repliers
            if not taken:
                self.repliers[name] = made
        if taken:
            raise ServiceError(
                f"{self.name} offers {name} already, and in ROS 1 a service has one server: "
                "close that one first"
            )
        self.add(made)
        return made

    def _on_replier_closed(self, replier: TcprosReplier) -> None:
        with self._lock:
            if self.repliers.get(replier.name) is replier:
                del self.repliers[replier.name]

    def runs_here(self) -> bool:
        """Return whether the calling thread is one of the node's own."""
        return super().runs_here() or self._registrations.is_current or self.loop.is_current

    def add(self, member: Handle, follow: Callable[[bool, bool], None] | None = None) -> None:
        """Register a member, and let it follow the graph; raises NodeClosedError."""
        super().add(member, follow)
        if isinstance(member, Member):
            self._registrations.wake()

    def remove(self, member: Handle) -> None:
        """Unregister a closed member in the background."""
        with self._lock:
            known = self._members.pop(member, None) is not None
        if known and not self._closed and isinstance(member, Member):
            self._registrations.forget(member)

    def _disconnect(self) -> None:
        """Unregister all members; takes about two seconds if the master does not answer."""
        self._registrations.close()
        self._worker.close()
        self.pool.close()
        self.lookups.close()
        self.loop.call(self._end_acceptors)
        self.loop.close()
        self._close_sockets()  # those of a node that was never started have no acceptor
        if self._api is not None:
            self._api.close()

    # -- connections, in the loop's thread -------------------------------------------------------

    def _accept(self, sock: socket.socket, address: str) -> None:
        """Accept a connection; its header names the topic or service."""
        link: Connection
        if len(self._connections) >= self._max_connections:
            if self._log_once.is_first("crowded"):
                text = "%s: refused, as this node has %d connections; further ones are not logged"
                _log.warning(text, address, len(self._connections))
            sock.close()
            return

        def refuse(reason: str) -> None:
            link.send_header({"error": reason})
            link.finish(1.0)

        def on_header(header: dict[str, str]) -> None:
            self._silent.pop(link, None)
            if "topic" in header:
                survive_outages(sock)
                reason = self.topics.accept(link, header)
            elif "service" in header:
                replier = self.repliers.get(header["service"])
                if replier is not None:
                    reason = replier.accept(link, header)
                else:
                    reason = f"{self.name} does not offer {header['service']}"
            else:
                reason = "neither topic nor service is named in the connection header"
            if reason:
                refuse(reason)

        link = Connection(
            self.loop,
            sock,
            on_header,
            lambda data, _: self._on_request(link, data),  # subscribers send none
            lambda _: self._drop(link),
            peer=address,
        )
        if len(self._silent) >= _MAX_SILENT_CONNECTIONS:
            next(iter(self._silent)).end("others want to connect, and it has sent no header")
        self._connections.add(link)
        self._silent[link] = None
        link.accept()

    def _drop(self, link: Connection) -> None:
        self._connections.discard(link)
        self._silent.pop(link, None)
        self.topics.drop(link)
        replier = self.repliers.get(link.header.get("service", ""))
        if replier is not None:
            replier.on_disconnected(link)

    def _on_request(self, link: Connection, data: bytes | memoryview) -> None:
        replier = self.repliers.get(link.header.get("service", ""))
        if replier is not None:
            replier.on_frame(link, data)


def max_connections() -> int:
    """Return how many connections to accept: half of the files that may be open."""
    if resource is None:
        return 1000
    soft = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    return 10_000 if soft == resource.RLIM_INFINITY else min(10_000, soft // 2)
