"""What everything created from one ROS 1 node shares: master, connections, graph, threads."""

from __future__ import annotations

import atexit
import logging
import os
import socket
import threading
from abc import abstractmethod
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm import (
    Clock,
    ConnectionState,
    Dispatcher,
    Handle,
    Listeners,
    Status,
    Timers,
    Worker,
)
from rosglass.errors import ConnectionLostError, Error, MasterError, NodeClosedError
from rosglass.ros1.address import is_loopback
from rosglass.ros1.errands import Errands
from rosglass.ros1.graph import Graph
from rosglass.ros1.io_loop import READ, IoLoop
from rosglass.ros1.master import Master
from rosglass.ros1.names import expand
from rosglass.ros1.types import Types

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import NodeName
    from rosglass.interfaces import Library
    from rosglass.ros1.options import Ros1Options
    from rosglass.ros1.slave import Slave

__all__ = ["Core", "Member"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds between looks at the master, which tells nobody when it was restarted.
_POLL = 1.0
#: Seconds that closing waits for the master.
_FAREWELL = 2.0
_BACKLOG = 128


class Member(Handle):
    """Something created from a node: it is registered with the master, and ends with the node.

    Attributes:
        listed: Whether the master's state of the system shows it once it is registered.
    """

    listed = True

    def register(self, master: Master) -> None:
        """Tell the master of it; called on the node's own thread, again after its restart.

        Raises:
            ConnectionLostError: The master does not answer; this is called again then.
            MasterError: It refuses.
        """

    def unregister(self, master: Master) -> None:
        """Tell the master that it is gone; called on a thread that may wait."""

    def follow(self, moved: bool, idle: bool) -> None:
        """Follow the graph; called on the node's own thread, and may take its time.

        Args:
            moved: Whether nodes or endpoints appeared or went since the last call.
            idle: Whether this is the regular look, about once a second.
        """

    @abstractmethod
    def close(self) -> None:
        """End it; safe to call twice."""


class Core:
    """Holds what a node consists of, and keeps its members registered and informed.

    Args:
        name: The node's name.
        url: What it was connected with, for people to read.
        options: Master, own address, remappings.
        library: Where definitions come from; None for the shared library.

    Attributes:
        master: Called from threads that may wait.
        graph: What the master knew at the last look.
        types: Finds types.
        loop: Waits for all sockets.
        errands: Runs what waits for others.
        uri: The node's own API.
        address: Host and port where connections are accepted.
        clock: The node's clock.
        dispatcher: Runs callbacks that bring no executor of their own.
        own_dispatcher: Runs what the node answers for itself.
        timers: Runs short jobs later.
        graph_listeners: Told after each change of the graph.
        status_listeners: Told each new status.
        services: Who takes a connection to a service, by its name; see :class:`Server`.
        topics: Who takes a connection to a topic, by its name.

    Raises:
        ConnectionLostError: This machine cannot listen for connections.
    """

    def __init__(
        self, name: NodeName, url: str, options: Ros1Options, library: Library | None
    ) -> None:
        self.name, self.url, self.options = name, url, options
        self.master = Master(options.master, name.full)
        self.graph, self.types = Graph(), Types(library, url)
        self.graph_listeners: Listeners[None] = Listeners(merge=True)
        self.status_listeners: Listeners[Status] = Listeners()
        self.dispatcher = Dispatcher(f"{name.name} callbacks")
        self.own_dispatcher = Dispatcher(f"{name.name} services")
        self.clock = Clock(name.name, self.dispatcher)
        self.timers = Timers(f"{name.name} timers")
        self.errands = Errands(f"{name.name} errands")
        self._lock = threading.Lock()
        self._closed = False
        self._process = os.getpid()
        self._members: dict[Member, None] = {}
        #: Members that the master was told of since it was started.
        self._registered: set[Member] = set()
        self._moved = False
        self._master_pid = -1
        self._status = Status(ConnectionState.CONNECTING, f"looking for {options.master}")
        self._listener = self._listen()
        self.address = (options.address, self._listener.getsockname()[1])
        self.slave: Slave | None = None
        self.loop = IoLoop(f"{name.name} connections")
        self._worker = Worker(f"{name.name} graph", self._follow, _POLL)

    def start(self, slave: Slave, accept: Callable[[socket.socket, str], None]) -> None:
        """Begin to listen, and to look for the master.

        Args:
            slave: The node's API.
            accept: Called in the loop's thread with each connection and its address.
        """
        self.slave = slave
        door = _Door(self._listener, accept)
        self.loop.call(lambda: self.loop.watch(self._listener, READ, door))
        # Threads that hand on messages must not meet an interpreter that is being taken down.
        atexit.register(self.close)
        self._worker.wake()

    @property
    def uri(self) -> str:
        """Where the node's own API is reached."""
        assert self.slave is not None
        return self.slave.uri

    @property
    def closed(self) -> bool:
        """Whether the node is closed."""
        return self._closed

    @property
    def forked(self) -> bool:
        """Whether this process is a fork of the one that the node belongs to."""
        return self._process != os.getpid()

    def runs_here(self) -> bool:
        """Return whether the calling thread is one of the node's own."""
        threads = (self._worker, self.dispatcher, self.own_dispatcher, self.loop)
        return any(thread.is_current for thread in threads)

    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic, service or parameter, which may be remapped.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """
        full = self.expand(name)
        return self.options.remapped(full)

    def expand(self, name: str) -> str:
        """Return the absolute name of anything, not remapped; raises InvalidNameError."""
        return expand(name, self.name.name, self.name.namespace)

    def check_open(self) -> None:
        """Raise NodeClosedError when the node is closed, or was left behind by a fork."""
        if self.forked:
            raise NodeClosedError(
                f"node {self.name} belongs to the process that made it, and does not work "
                "after a fork; connect again in this process"
            )
        if self._closed:
            raise NodeClosedError(f"node {self.name} is closed; connect again")

    def add(self, member: Member) -> None:
        """Register a member and let it follow the graph; raises NodeClosedError after closing."""
        with self._lock:
            self._members[member] = None
        if self._closed:
            member.close()
        self.check_open()
        self.wake()

    def remove(self, member: Member) -> None:
        """Unregister a member that was closed, soon."""
        with self._lock:
            known = self._members.pop(member, ...) is None
        if known and not self._closed:
            self.errands.run(lambda: self._unregister(member))

    def members(self) -> list[Member]:
        """Return all members."""
        with self._lock:
            return list(self._members)

    def wake(self) -> None:
        """Look at the master and let the members follow soon."""
        self._moved = True
        self._worker.wake()

    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""
        if self.forked:
            return Status(ConnectionState.CLOSED, "left behind by a fork; connect again here")
        return self._status

    def close(self) -> None:
        """Close every member, leave the graph and end the threads; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            atexit.unregister(self.close)
            if self.forked:
                return  # the threads did not come along
            members = list(self._members)
        self.clock.close()
        for member in reversed(members):
            member.close()
        self._take_leave(members)
        self.timers.close()
        self._worker.close()
        self.errands.close()
        if self.slave is not None:
            self.slave.close()
        self.loop.close()
        self._listener.close()
        self.graph.clear()
        self._tell(Status(ConnectionState.CLOSED, "closed"))
        self.graph_listeners.clear()
        self.dispatcher.close()
        self.own_dispatcher.close()
        self.status_listeners.clear()

    def _take_leave(self, members: list[Member]) -> None:
        """Unregister all members, and end what takes too long; the master may be gone."""
        if self._status.state is not ConnectionState.CONNECTED:
            return

        def leave() -> None:
            with suppress(Error):
                for member in members:
                    if member in self._registered:
                        member.unregister(self.master)

        farewell = threading.Thread(target=leave, daemon=True)
        farewell.start()
        farewell.join(_FAREWELL)

    def _unregister(self, member: Member) -> None:
        if member in self._registered:
            self._registered.discard(member)
            with suppress(ConnectionLostError, MasterError):
                member.unregister(self.master)
        self.wake()

    # -- following the master --------------------------------------------------------------------

    def _follow(self, idle: bool) -> None:
        moved, self._moved = self._moved, False
        try:
            self._find_master()
            refused = self._register()
            moved = self.graph.refresh(self.master) or moved
            self._check_registered()
        except ConnectionLostError as error:
            self._lose(str(error))
        except MasterError as error:
            self._tell(Status(ConnectionState.LOST, f"{error}; trying again every second"))
        else:
            self._tell(Status(ConnectionState.CONNECTED, refused))
        for member in self.members():
            # Another thread may close the node, or this member, meanwhile.
            with suppress(NodeClosedError):
                try:
                    member.follow(moved, idle)
                except NodeClosedError:
                    raise
                except Exception:
                    _log.exception("%s cannot follow the graph", member)
        if moved:
            self.graph_listeners.notify(None)

    def _find_master(self) -> None:
        """Notice a master that was restarted: it has forgotten everybody."""
        pid = self.master.call("getPid")
        if pid != self._master_pid:
            self._master_pid = pid
            self._registered.clear()

    def _check_registered(self) -> None:
        """Notice a master that forgot everybody although its process number is the same."""
        listed = any(member.listed for member in self._registered)
        if listed and self.name not in self.graph.nodes():
            self._registered.clear()
            self.wake()

    def _register(self) -> str:
        """Tell the master of members it does not know; return what it has against some."""
        refused = ""
        for member in self.members():
            if member in self._registered or self._closed:
                continue
            try:
                member.register(self.master)
                self._registered.add(member)
                if member not in self.members():  # closed meanwhile
                    self._unregister(member)
            except MasterError as error:
                refused = str(error)
                _log.warning("%s: %s", member, error)
        return refused

    def _lose(self, reason: str) -> None:
        was = self._status.state
        state = ConnectionState.CONNECTING if self._master_pid < 0 else ConnectionState.LOST
        if was is ConnectionState.CONNECTED:
            _log.warning("%s: %s", self.url, reason)
        self._tell(Status(state, f"{reason}; trying again every second"))

    def _tell(self, status: Status) -> None:
        if status != self._status and not (self._closed and status.state.value != "closed"):
            self._status = status
            self.status_listeners.notify(status)

    def _listen(self) -> socket.socket:
        place = "127.0.0.1" if is_loopback(self.options.address) else ""
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            listener.bind((place, self.options.tcpros_port))
            listener.listen(_BACKLOG)
            listener.setblocking(False)
        except OSError as error:
            listener.close()
            raise ConnectionLostError(
                f"{self.url}: cannot listen on port {self.options.tcpros_port}: {error.strerror}"
            ) from error
        return listener


class _Door:
    """Accepts connections."""

    def __init__(
        self, listener: socket.socket, accept: Callable[[socket.socket, str], None]
    ) -> None:
        self._listener, self._accept = listener, accept

    def ready(self, _: int) -> None:
        """Take in whoever waits."""
        while True:
            try:
                sock, address = self._listener.accept()
            except OSError:  # nobody waits any more
                return
            self._accept(sock, f"{address[0]}:{address[1]}")

    def end(self, _: str) -> None:
        """Let nobody in any more."""
        self._listener.close()
