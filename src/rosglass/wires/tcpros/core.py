"""The core of a ROS 1 node: its master, connections, graph and threads."""

from __future__ import annotations

import atexit
import logging
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState, Handle, Status
from rosglass.comm.core import NodeCore
from rosglass.comm.log_limits import LogOnce
from rosglass.errors import Error, ServiceError
from rosglass.wires.tcpros.address import bracketed, own_address
from rosglass.wires.tcpros.connection import Connection, survive_outages
from rosglass.wires.tcpros.graph import Graph
from rosglass.wires.tcpros.io_loop import Acceptor, IoLoop, listen
from rosglass.wires.tcpros.master import Master
from rosglass.wires.tcpros.registrations import Member, Registrations
from rosglass.wires.tcpros.service_replier import TcprosReplier
from rosglass.wires.tcpros.slave import Slave
from rosglass.wires.tcpros.topic_subscription import UnreachableLog
from rosglass.wires.tcpros.topics import Topics

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from rosglass.comm import NodeName
    from rosglass.messages import ServiceType
    from rosglass.wires.base import OnRequest
    from rosglass.wires.tcpros.announced_types import AnnouncedTypes

__all__ = ["BlockingPool", "TcprosCore", "TcprosOptions", "max_connections"]

_log = logging.getLogger("rosglass.ros1")
#: Connections at a time whose peer has not sent its header. More than wait to be accepted
#: (``_BACKLOG``): after a pause, as many honest ones arrive at once.
_MAX_SILENT_CONNECTIONS = 300
#: Jobs in progress at once: calls of nodes that are gone, but still registered, time out, and
#: other calls must not wait for that.
_MAX_THREADS = 32
#: Seconds after which an idle thread ends.
_IDLE_TIMEOUT_S = 5.0


@dataclass(frozen=True)
class TcprosOptions:
    """A node's master, and the address and ports under which other nodes reach it.

    Attributes:
        master: URI of the master.
        address: Host or address under which other nodes reach this one; empty to detect it.
        source: Where the address was given, such as ``ROS_IP``; empty if it is detected.
        tcpros_port: Where connections are accepted; 0 for any free port.
        slave_port: Where the node's API is served; 0 for any free port.
    """

    master: str
    address: str = ""
    source: str = ""
    tcpros_port: int = 0
    slave_port: int = 0


class TcprosCore(NodeCore):
    """A node's connections, graph and threads, with the members that it keeps registered.

    Args:
        name: The node's name.
        url: The URL it was connected with, for messages.
        options: Master, own address and ports.
        types: Finds types.

    Attributes:
        master: The master's API; called from threads that may wait.
        graph: The graph of the last poll of the master.
        types: Finds types.
        loop: The node's I/O loop.
        pool: Runs jobs that wait for other nodes.
        unreachable: Logs publishers that cannot be reached.
        lookups: Runs the lookups that service calls wait for: they must not queue behind those of
            topics.
        uri: URI of the node's own API.
        uris: All URIs that the node's own API has had.
        address: Host and port where connections are accepted.
        topics: The published and subscribed topics.
        repliers: The offered services, by name.

    Raises:
        ConnectionLostError: This machine cannot listen for connections.
    """

    wire = "ros1"
    graph: Graph
    types: AnnouncedTypes

    def __init__(
        self, name: NodeName, url: str, options: TcprosOptions, types: AnnouncedTypes
    ) -> None:
        super().__init__(name, url, _log)
        self.options = options
        self.master = Master(options.master, name.full)
        self.graph, self.types = Graph(), types
        self.pool = BlockingPool(f"{name.name} pool")
        self.lookups = BlockingPool(f"{name.name} lookups")
        self.address, self.uri = ("", 0), ""
        self._acceptors: list[Acceptor] = []
        self._api: Slave | None = None
        self._status = Status(ConnectionState.CONNECTING, f"looking for {options.master}")
        sockets: list[socket.socket] = []
        try:
            for port in (options.tcpros_port, options.slave_port):
                sockets += [listen(options.address, port, url)]
        except BaseException:
            for sock in sockets:
                sock.close()
            raise
        self._tcpros, self._slave = sockets
        self.uris: set[str] = set()
        self.set_host(options.address or own_address())
        self.loop = IoLoop(f"{name.name} connections")
        self.unreachable = UnreachableLog(self.loop, self.pool)
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
        self._api = Slave(self, on_parameter_changed)
        self._acceptors = [
            Acceptor(self.loop, self._tcpros, self._accept),
            Acceptor(self.loop, self._slave, self._api.accept),
        ]
        for acceptor in self._acceptors:
            self.loop.call(acceptor.open)
        # Threads that deliver messages must not outlive the interpreter.
        atexit.register(self.close)
        self._registrations.start()

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

    def set_host(self, host: str) -> bool:
        """Set the host or address that the node announces; return whether it has changed."""
        address = (host, self._tcpros.getsockname()[1])
        changed = address != self.address
        if changed:
            self.address = address
            self.uri = f"http://{bracketed(host)}:{self._slave.getsockname()[1]}/"
            self.uris.add(self.uri)
        return changed

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

    def _state(self) -> Status:
        return self._status

    def set_status(self, status: Status) -> None:
        """Set the status and notify its listeners; ignored once the node is closed."""
        with self._lock:
            if status == self._status or self._status.state is ConnectionState.CLOSED:
                return
            self._status = status
        self.status_listeners.notify(status)

    def shut_down(self, caller: str, reason: str) -> None:
        """Close the node in the background, as another node requests; from any thread.

        Args:
            caller: The requesting node.
            reason: The caller's reason.
        """
        threading.Thread(
            target=self._shut_down, args=(caller, reason), name="shutdown", daemon=True
        ).start()

    def _shut_down(self, caller: str, reason: str) -> None:
        detail = f"closed by {caller}: {reason or 'no reason given'}"
        owner = ""
        with suppress(Error):
            owner = self._registrations.owner()
        if not owner and len(self.uris) > 1 and "same name" in reason:
            return  # the new owner of the name is this node, under its new address
        if owner and owner not in detail:
            detail += f"; {owner} has the name {self.name} now"
        _log.warning("%s: %s", self.name, detail)
        self.close(detail, killed=not owner and "same name" not in reason)

    def _disconnect(self) -> None:
        """Unregister all members; takes about two seconds if the master does not answer."""
        self._registrations.close()
        self._worker.close()
        self.pool.close()
        self.lookups.close()
        for acceptor in self._acceptors:
            self.loop.call(acceptor.end)
        self.loop.close()
        for sock in (self._tcpros, self._slave):
            sock.close()  # those of a node that was never started have no acceptor
        if self._api is not None:
            self._api.close()

    def _notify_closed(self, status: Status) -> None:
        self.set_status(status)

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
    try:
        import resource  # noqa: PLC0415 - not on Windows
    except ImportError:
        return 1000
    soft = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    return 10_000 if soft == resource.RLIM_INFINITY else min(10_000, soft // 2)


class BlockingPool:
    """Runs jobs that may take seconds on daemon threads, several at a time.

    Args:
        name: Of the threads.
    """

    # Not concurrent.futures: that joins its threads at exit, and a program would wait up to 5 s
    # for a node that does not answer. The threads may wait for what other threads receive, unlike
    # those that begin in io_loop.py; see rosglass.comm.handle.check_may_wait.

    def __init__(self, name: str) -> None:
        self._name = name
        #: Guards the jobs, and wakes the threads.
        self._changed = threading.Condition()
        self._jobs: deque[Callable[[], None]] = deque()
        self._threads = self._idle = 0
        self._closed = False

    def run(self, job: Callable[[], None]) -> None:
        """Run `job` as soon as a thread is free; dropped after :meth:`close`."""
        with self._changed:
            if self._closed:
                return
            self._jobs.append(job)
            if self._idle >= len(self._jobs):
                self._changed.notify()
                return
            if self._threads == _MAX_THREADS:
                return
            self._threads += 1
            number = self._threads
        thread = threading.Thread(target=self._work, name=f"{self._name} {number}", daemon=True)
        try:
            thread.start()
        except RuntimeError as error:  # no more threads, or the interpreter is at its end
            with self._changed:
                self._threads -= 1
            _log.warning("%s: a job has to wait: %s", self._name, error)

    def close(self) -> None:
        """Drop the jobs that wait; those in progress end by their own timeouts."""
        with self._changed:
            self._closed = True
            self._jobs.clear()
            self._changed.notify_all()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._idle += 1
                self._changed.wait_for(lambda: bool(self._jobs) or self._closed, _IDLE_TIMEOUT_S)
                self._idle -= 1
                if not self._jobs:
                    self._threads -= 1
                    return
                job = self._jobs.popleft()
            try:
                job()
            except Exception:
                _log.exception("%s: a job failed", self._name)
