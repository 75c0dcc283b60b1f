"""The core of a node: its threads, listeners and members, and their shutdown."""

from __future__ import annotations

import atexit
import os
import threading
from abc import ABC, abstractmethod
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm.clock import Clock
from rosglass.comm.executor import Dispatcher
from rosglass.comm.graph import ConnectionState, EndpointKind, GraphView, Status
from rosglass.comm.handle import Handle, guarded
from rosglass.comm.listeners import Listeners
from rosglass.comm.timers import Timers, Worker
from rosglass.errors import NodeClosedError

if TYPE_CHECKING:
    import logging
    from collections.abc import Callable

    from rosglass.comm.graph import EndpointInfo, NodeName
    from rosglass.comm.wire import Middleware, Writer
    from rosglass.messages import MessageType

__all__ = [
    "NodeCore",
    "NodeMember",
]

#: Number of closed publishers whose GIDs are kept.
_MAX_CLOSED_GIDS = 1000
#: Interval of the regular calls of each member's :meth:`NodeMember.follow`.
_POLL_S = 1.0
#: Id of this process. Publishers check it for each message, and asking the system for it takes a
#: fifth of the time of sending 64 bytes.
_process = [os.getpid()]
#: How long closing waits for listeners to be notified that another node closed this one.
_NOTIFY_TIMEOUT_S = 1.0


class NodeMember(Handle):
    """An object created from a node: it follows the graph, and is closed with the node."""

    def follow(self, moved: bool, idle: bool) -> None:
        """Follow the graph; called on the node's own thread, where it may take its time.

        Args:
            moved: Whether nodes or endpoints appeared or left since the last call.
            idle: Whether this is the regular call, once a second.
        """

    @abstractmethod
    def close(self) -> None:
        """Close it; safe to call twice."""


def _on_fork() -> None:
    _process[0] = os.getpid()


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_on_fork)


class NodeCore(ABC):
    """The threads and listeners of a node; keeps its members informed of the graph.

    Args:
        name: The node's name.
        url: The URL it was connected with, for messages.
        log: Logger for failures.

    Attributes:
        log: As given.
        clock: The node's clock.
        dispatcher: Runs callbacks that have no executor of their own.
        own_dispatcher: Runs the node's built-in services, such as those for its parameters, so that
            no user callback can block them.
        timers: Runs short delayed jobs, and jobs that the wire's threads must not wait for; posts
            the callbacks of the clock's timers.
        graph_listeners: Notified after each change of the graph.
        status_listeners: Notified of each new status.
        local_gids: GIDs of the node's own publishers, including those recently closed.
        servers: The services that the node offers.
    """

    #: Wire format of the node's messages, ``cdr`` or ``ros1``.
    wire: str
    #: The ROS graph as discovered so far.
    graph: GraphView
    #: Finds types.
    types: Any
    #: Transports the bytes; a ROS 1 node has none, and none of its endpoints uses it.
    middleware: Middleware
    #: Announces a publisher of a type and returns its writer.
    create_writer: Callable[[EndpointInfo, MessageType], Writer]
    #: Calls :meth:`_follow`; subclasses start it once everything that it needs exists.
    _worker: Worker

    def __init__(self, name: NodeName, url: str, log: logging.Logger) -> None:
        self.name, self.url, self.log = name, url, log
        self.graph_listeners: Listeners[None] = Listeners(merge=True)
        self.status_listeners: Listeners[Status] = Listeners()
        self.dispatcher = Dispatcher(f"{name.name} callbacks")
        self.own_dispatcher = Dispatcher(f"{name.name} services")
        self.timers = Timers(f"{name.name} timers")
        self.clock = Clock(name.name, self.dispatcher, self.timers)
        #: Guards the members, and closing.
        self._lock = threading.Lock()
        self._closed = self._moved = False
        self._process = _process[0]
        self._members: dict[Handle, Callable[[bool, bool], None]] = {}
        self.local_gids: set[bytes] = set()
        self._closed_gids: dict[bytes, None] = {}
        self.servers: set[Handle] = set()

    @property
    def has_simulated_stamps(self) -> bool:
        """True if messages may have stamps of a simulation; see :class:`Node`."""
        if self.clock.is_simulated:
            return True
        return bool(self.graph.endpoints(EndpointKind.PUBLISHER, "/clock"))

    def _start_following(self) -> Worker:
        return Worker(f"{self.name.name} graph", self._follow, _POLL_S)

    @property
    def closed(self) -> bool:
        """True once the node is closed."""
        return self._closed

    @property
    def forked(self) -> bool:
        """True if this process is a fork of the one that created the node."""
        return self._process != _process[0]

    def check_open(self) -> None:
        """Raise NodeClosedError if the node is closed, or was inherited by a fork."""
        if self.forked:
            raise NodeClosedError(
                f"node {self.name} belongs to the process that made it, and does not work "
                "after a fork; connect again in this process"
            )
        if self._closed:
            raise NodeClosedError(f"node {self.name} is closed; connect again")

    def add(self, member: Handle, follow: Callable[[bool, bool], None] | None = None) -> None:
        """Add a member, which follows the graph from now on; its first call is soon.

        Args:
            member: Closed with the node.
            follow: Called in place of :meth:`NodeMember.follow`, which other handles lack.

        Raises:
            NodeClosedError: The node is closed; the member is closed, too.
        """
        if follow is None:
            follow = member.follow if isinstance(member, NodeMember) else _ignore
        with self._lock:
            self._members[member] = follow
        if self._closed:
            member.close()
        self.check_open()
        self.wake()

    def remove(self, member: Handle) -> None:
        """Remove a closed member."""
        with self._lock:
            self._members.pop(member, None)

    def members(self) -> list[Handle]:
        """Return all members."""
        with self._lock:
            return list(self._members)

    def add_gid(self, gid: bytes) -> None:
        """Add a publisher to :attr:`local_gids`; it may have the GID of a closed one."""
        with self._lock:
            self._closed_gids.pop(gid, None)
            self.local_gids.add(gid)

    def retire_gid(self, gid: bytes) -> None:
        """Keep a closed publisher in :attr:`local_gids` while its samples may still arrive."""
        with self._lock:
            self._closed_gids[gid] = None
            if len(self._closed_gids) > _MAX_CLOSED_GIDS:
                oldest = next(iter(self._closed_gids))
                del self._closed_gids[oldest]
                self.local_gids.discard(oldest)

    def wake(self) -> None:
        """Update the members soon, as if the graph had changed; from any thread."""
        self._moved = True
        self._worker.wake()

    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""
        if self.forked:
            return Status(ConnectionState.CLOSED, "left behind by a fork; connect again here")
        return self._state()

    @abstractmethod
    def resolve(self, name: str, kind: str = "topic") -> str:
        """Return the absolute name of a topic or service, after the user's remappings.

        Args:
            name: Absolute, relative or private name.
            kind: ``topic`` or ``service``: some of ROS 2's rules apply to one of them only.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """

    @abstractmethod
    def expand(self, name: str) -> str:
        """Return the absolute form of any name, not remapped; raises InvalidNameError."""

    def runs_here(self) -> bool:
        """Return whether the calling thread is one of the node's own."""
        threads = (self._worker, self.dispatcher, self.own_dispatcher)
        return any(thread.is_current for thread in threads)

    def close(self, reason: str = "", *, killed: bool = False) -> None:
        """Close every member, leave the graph and end the threads; safe to call twice.

        Args:
            reason: Why, for the last status, if not at the program's request.
            killed: As in :class:`Status`.
        """
        if self.forked:
            self._closed = True  # threads and connections are the parent's
            return
        with self._lock:
            if self._closed:
                return
            self._closed = True
            members = list(self._members)
        atexit.unregister(self.close)
        self.clock.close()
        for member in reversed(members):
            with guarded(self.log, "%s cannot be closed", member):
                member.close()
        self.timers.close()
        self._disconnect()
        self._worker.close()
        self.graph.clear()
        self._notify_closed(Status(ConnectionState.CLOSED, reason or "closed", killed))
        self.graph_listeners.clear()
        if reason:
            notified = threading.Event()
            self.dispatcher.post(notified.set)
            notified.wait(_NOTIFY_TIMEOUT_S)
        self.dispatcher.close()
        self.own_dispatcher.close()
        if not reason:
            self.status_listeners.clear()

    @abstractmethod
    def _disconnect(self) -> None:
        """Leave the graph and end the wire's threads."""

    @abstractmethod
    def _notify_closed(self, status: Status) -> None:
        """Notify the status listeners that the node is closed."""

    @abstractmethod
    def _state(self) -> Status:
        """Return the state of the connection, in the process that owns it."""

    def _follow(self, idle: bool) -> None:
        """Update the members by the graph; run by the worker."""
        moved, self._moved = self._moved, False
        if not moved and not idle:
            return
        with self._lock:
            members = list(self._members.items())
        for member, follow in members:
            # Another thread may close it at any time.
            with guarded(self.log, "%s cannot follow the graph", member), suppress(NodeClosedError):
                follow(moved, idle)
        if moved:
            self.graph_listeners.notify(None)


def _ignore(moved: bool, idle: bool) -> None:
    """Do nothing when the graph changes."""
