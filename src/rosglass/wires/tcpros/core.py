"""The core of a ROS 1 node: its master, addresses, graph and threads."""

from __future__ import annotations

import logging
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosglass.comm import ConnectionState, Status
from rosglass.comm.core import NodeCore
from rosglass.errors import Error, MasterError
from rosglass.wires.tcpros.address import bracketed, own_address
from rosglass.wires.tcpros.graph import Graph
from rosglass.wires.tcpros.io_loop import IoLoop, listen
from rosglass.wires.tcpros.master import Master

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from rosglass.comm import NodeName
    from rosglass.wires.tcpros.announced_types import AnnouncedTypes

__all__ = ["BlockingPool", "TcprosCore", "TcprosOptions"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds that the master may take to look up the node's name.
_OWNER_TIMEOUT_S = 1.0
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
    """What the members of a ROS 1 node share: its master, addresses, graph and threads.

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
        lookups: Runs the lookups that service calls wait for: they must not queue behind those of
            topics.
        uri: URI of the node's own API.
        uris: All URIs that the node's own API has had.
        address: Host and port where connections are accepted.

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

    def set_host(self, host: str) -> bool:
        """Set the host or address that the node announces; return whether it has changed."""
        address = (host, self._tcpros.getsockname()[1])
        changed = address != self.address
        if changed:
            self.address = address
            self.uri = f"http://{bracketed(host)}:{self._slave.getsockname()[1]}/"
            self.uris.add(self.uri)
        return changed

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
            owner = self._name_owner()
        if not owner and len(self.uris) > 1 and "same name" in reason:
            return  # the new owner of the name is this node, under its new address
        if owner and owner not in detail:
            detail += f"; {owner} has the name {self.name} now"
        _log.warning("%s: %s", self.name, detail)
        self.close(detail, killed=not owner and "same name" not in reason)

    def _name_owner(self) -> str:
        """Return the URI of another node that has this node's name; empty if there is none.

        Raises:
            ConnectionLostError: The master does not answer.
        """
        try:
            uri = self.master.call("lookupNode", self.name.full, timeout=_OWNER_TIMEOUT_S)
        except MasterError:
            return ""
        return "" if uri in self.uris else str(uri)

    def _notify_closed(self, status: Status) -> None:
        self.set_status(status)


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
