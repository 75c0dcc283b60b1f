"""What everything created from one node shares in every world, and the node's end."""

from __future__ import annotations

import os
import threading
from abc import ABC, abstractmethod
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm.clock import Clock
from rosglass.comm.executor import Dispatcher
from rosglass.comm.graph import ConnectionState, GraphView, Status
from rosglass.comm.listeners import Listeners
from rosglass.comm.node import Handle
from rosglass.comm.timers import Timers, Worker
from rosglass.errors import NodeClosedError

if TYPE_CHECKING:
    import logging
    from collections.abc import Callable

    from rosglass.comm.graph import EndpointInfo, NodeName
    from rosglass.messages import MessageType
    from rosglass.wires.base import Middleware, Writer

__all__ = [
    "NodeCore",
    "NodeMember",
]

#: Seconds between the members' regular looks at what has no event.
_POLL = 1.0
#: Closed publishers whose GIDs are kept.
_MAX_CLOSED_GIDS = 1000


class NodeMember(Handle):
    """Something created from a node: it follows the graph, and ends with the node."""

    def follow(self, moved: bool, idle: bool) -> None:
        """Follow the graph; called on the node's own thread, and may take its time.

        Args:
            moved: Whether nodes or endpoints appeared or went since the last call.
            idle: Whether this is the regular look, about once a second.
        """

    @abstractmethod
    def close(self) -> None:
        """End it; safe to call twice."""


class NodeCore(ABC):
    """Holds a node's threads and listeners, and keeps its members informed.

    Args:
        name: The node's name.
        url: What it was connected with, for people to read.
        log: Where failures are told.

    Attributes:
        log: As given.
        clock: The node's clock.
        dispatcher: Runs callbacks that bring no executor of their own.
        own_dispatcher: Runs what the node answers for itself, such as questions for its parameters;
            no callback of a user can hold that up.
        timers: Runs short jobs later, and jobs that the middleware's threads must not wait for;
            posts the callbacks of the clock's timers.
        graph_listeners: Told after each change of the graph.
        status_listeners: Told each new status.
        local_gids: GIDs of the node's own publishers, and of those closed last.
        servers: The services that the node offers.
    """

    #: Wire format of the node's messages, ``cdr`` or ``ros1``.
    wire: str
    #: What is seen of the ROS graph.
    graph: GraphView
    #: Finds types.
    types: Any
    #: What moves the bytes; a ROS 1 node has none yet, and no endpoint of its asks for it.
    middleware: Middleware
    #: Announces a publisher, given its type, and returns its sending end.
    create_writer: Callable[[EndpointInfo, MessageType], Writer]
    #: Calls :meth:`_follow`; made by the world, once all is there that this needs.
    _worker: Worker

    def __init__(self, name: NodeName, url: str, log: logging.Logger) -> None:
        self.name, self.url, self.log = name, url, log
        self.graph_listeners: Listeners[None] = Listeners(merge=True)
        self.status_listeners: Listeners[Status] = Listeners()
        self.dispatcher = Dispatcher(f"{name.name} callbacks")
        self.own_dispatcher = Dispatcher(f"{name.name} services")
        self.timers = Timers(f"{name.name} timers")
        self.clock = Clock(name.name, self.dispatcher, self.timers)
        self._lock = threading.Lock()
        self._closed = self._moved = False
        self._process = os.getpid()
        self._members: dict[Handle, Callable[[bool, bool], None]] = {}
        self.local_gids: set[bytes] = set()
        self._closed_gids: deque[bytes] = deque()
        self.servers: set[Handle] = set()

    def _start_following(self) -> Worker:
        return Worker(f"{self.name.name} graph", self._follow, _POLL)

    @property
    def closed(self) -> bool:
        """Whether the node is closed."""
        return self._closed

    @property
    def forked(self) -> bool:
        """Whether this process is a fork of the one that the node belongs to."""
        return self._process != os.getpid()

    def check_open(self) -> None:
        """Raise NodeClosedError when the node is closed, or was left behind by a fork."""
        if self.forked:
            raise NodeClosedError(
                f"node {self.name} belongs to the process that made it, and does not work "
                "after a fork; connect again in this process"
            )
        if self._closed:
            raise NodeClosedError(f"node {self.name} is closed; connect again")

    def add(self, member: Handle, follow: Callable[[bool, bool], None] | None = None) -> None:
        """Let a member follow the graph from now on; raises NodeClosedError after closing it.

        Args:
            member: Closed with the node.
            follow: What a member that is no :class:`NodeMember` has in place of its method.
        """
        if follow is None:
            follow = member.follow if isinstance(member, NodeMember) else _ignore
        with self._lock:
            self._members[member] = follow
        if self._closed:
            member.close()
        self.check_open()

    def remove(self, member: Handle) -> None:
        """Forget a member that was closed."""
        with self._lock:
            self._members.pop(member, None)

    def members(self) -> list[Handle]:
        """Return all members."""
        with self._lock:
            return list(self._members)

    def retire_gid(self, gid: bytes) -> None:
        """Keep a closed publisher in :attr:`local_gids` while its samples may still arrive."""
        self._closed_gids.append(gid)
        if len(self._closed_gids) > _MAX_CLOSED_GIDS:
            self.local_gids.discard(self._closed_gids.popleft())

    def wake(self) -> None:
        """Let the members follow soon, as if the graph had changed; from any thread."""
        self._moved = True
        self._worker.wake()

    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""
        if self.forked:
            return Status(ConnectionState.CLOSED, "left behind by a fork; connect again here")
        return self._state()

    @abstractmethod
    def resolve(self, name: str, kind: str = "topic") -> str:
        """Return the absolute name of a topic or service, which the user may have remapped.

        Args:
            name: Absolute, relative or private name.
            kind: ``topic`` or ``service``: some of ROS 2's rules are for one of them only.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """

    @abstractmethod
    def expand(self, name: str) -> str:
        """Return the absolute name of anything, not remapped; raises InvalidNameError."""

    @abstractmethod
    def close(self) -> None:
        """Close every member, leave the graph and end the threads; safe to call twice."""

    @abstractmethod
    def runs_here(self) -> bool:
        """Return whether the calling thread is one of the node's own."""

    @abstractmethod
    def _state(self) -> Status:
        """Return the state of the connection, in the process that it belongs to."""

    def _follow(self, idle: bool) -> None:
        """Let the members follow the graph; run by the worker."""
        moved, self._moved = self._moved, False
        if not moved and not idle:
            return
        with self._lock:
            members = list(self._members.items())
        for member, follow in members:
            # Another thread may close the node, or this member, meanwhile.
            with suppress(NodeClosedError):
                try:
                    follow(moved, idle)
                except NodeClosedError:
                    raise
                except Exception:
                    self.log.exception("%s cannot follow the graph", member)
        if moved:
            self.graph_listeners.notify(None)


def _ignore(moved: bool, idle: bool) -> None:
    """Follow nothing."""
