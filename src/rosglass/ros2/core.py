"""What everything created from one node shares: its middleware, graph, types and threads."""

from __future__ import annotations

import atexit
import logging
import os
import threading
from abc import abstractmethod
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm import (
    Clock,
    ConnectionState,
    Dispatcher,
    EndpointKind,
    Handle,
    Listeners,
    Status,
    Timers,
    Worker,
)
from rosglass.errors import NodeClosedError
from rosglass.ros2.arguments import NO_ARGUMENTS
from rosglass.ros2.graph import Graph
from rosglass.ros2.names import expand
from rosglass.ros2.types import Types

if TYPE_CHECKING:
    from rosglass.comm import Executor, NodeName
    from rosglass.interfaces import Library
    from rosglass.ros2.arguments import Arguments
    from rosglass.ros2.middleware import Middleware

__all__ = ["Core", "Member"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds between looks at what has no event: definitions added to the library, a client's router.
_POLL = 1.0


class Member(Handle):
    """Something created from a node: it follows the graph, and ends with the node."""

    @abstractmethod
    def follow(self, moved: bool, idle: bool) -> None:
        """Follow the graph; called on the node's own thread, and may take its time.

        Args:
            moved: Whether nodes or endpoints appeared or went since the last call.
            idle: Whether this is the regular look, about once a second.
        """

    def serves(self, service: str, executor: Executor) -> bool:  # noqa: ARG002 - most do not
        """Return whether it answers a service on an executor."""
        return False


class Core:
    """Holds what a node consists of, and keeps its members informed.

    Args:
        name: The node's name.
        url: What it was connected with, for people to read.
        middleware: Opened and closed here.
        library: Where definitions come from; None for the shared library.
        arguments: What the program was told with ``--ros-args``.

    Attributes:
        graph: What is seen of the ROS graph.
        types: Finds types.
        clock: The node's clock.
        dispatcher: Runs callbacks that bring no executor of their own.
        own_dispatcher: Runs what the node answers for itself, such as questions for its parameters;
            no callback of a user can hold that up.
        timers: Runs short jobs later, and jobs that the middleware's threads must not wait for.
        graph_listeners: Told after each change of the graph.
        status_listeners: Told each new status.
        local_gids: Identities of the node's own publishers.

    Raises:
        ConnectionLostError: The middleware cannot start on this machine.
        RosArgumentError: A remapping rule makes a name that is not valid.
    """

    def __init__(
        self,
        name: NodeName,
        url: str,
        middleware: Middleware,
        library: Library | None,
        arguments: Arguments = NO_ARGUMENTS,
    ) -> None:
        self.name, self.url, self.middleware = name, url, middleware
        self.arguments = arguments
        self._new_names = {
            kind: arguments.remappings(kind, name.name, name.namespace)
            for kind in ("topic", "service")
        }
        self.types = Types(library, url)
        self.graph_listeners: Listeners[None] = Listeners(merge=True)
        self.status_listeners: Listeners[Status] = Listeners()
        self.dispatcher = Dispatcher(f"{name.name} callbacks")
        self.own_dispatcher = Dispatcher(f"{name.name} services")
        self.clock = Clock(name.name, self.dispatcher)
        self.timers = Timers(f"{name.name} timers")
        self._lock = threading.Lock()
        self._closed = False
        self._process = os.getpid()
        self._members: dict[Member, None] = {}
        self.local_gids: set[bytes] = set()
        self._moved = True
        self._told = middleware.status()
        self.graph = Graph(self.wake)
        self._worker = Worker(f"{name.name} graph", self._follow, _POLL)
        try:
            middleware.open(self.graph, self._worker.wake)
            middleware.announce(name)
        except BaseException:
            self._worker.close()
            middleware.close()
            raise
        # Threads that hand on samples must not meet an interpreter that is being taken down.
        atexit.register(self.close)

    @property
    def closed(self) -> bool:
        """Whether the node is closed."""
        return self._closed

    @property
    def forked(self) -> bool:
        """Whether this process is a fork of the one that the node belongs to."""
        return self._process != os.getpid()

    def resolve(self, name: str, kind: str = "topic") -> str:
        """Return the absolute name of a topic or service, which the user may have remapped.

        Args:
            name: Absolute, relative or private name.
            kind: ``topic`` or ``service``: some rules are for one of them only. An action's name
                is resolved as a topic's.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """
        full = self.expand(name)
        return self._new_names[kind].get(full, full)

    def expand(self, name: str) -> str:
        """Return the absolute name of anything, not remapped; raises InvalidNameError."""
        return expand(name, self.name.name, self.name.namespace)

    def runs_here(self) -> bool:
        """Return whether the calling thread is one of the node's own."""
        return self._worker.is_current or self.dispatcher.is_current

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
        """Let a member follow the graph from now on; raises NodeClosedError after closing it."""
        with self._lock:
            self._members[member] = None
        if self._closed:
            member.close()
        self.check_open()

    def remove(self, member: Member) -> None:
        """Forget a member that was closed."""
        with self._lock:
            self._members.pop(member, None)

    def serves_here(self, service: str) -> bool:
        """Return whether only the thread that asks can answer a service: the dispatcher's."""
        if not self.dispatcher.is_current:
            return False
        servers = self.graph.endpoints(EndpointKind.SERVICE_SERVER, service)
        with self._lock:
            own = [m for m in self._members if m.serves(service, self.dispatcher)]
        return bool(own) and all(server.node == self.name for server in servers)

    def wake(self) -> None:
        """Let the members follow soon, as if the graph had changed."""
        self._moved = True
        self._worker.wake()

    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""
        if self.forked:
            return Status(ConnectionState.CLOSED, "left behind by a fork; connect again here")
        return self.middleware.status()

    def close(self) -> None:
        """Close every member, leave the graph and end the threads; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            atexit.unregister(self.close)
            if self.forked:
                return  # the connection is the parent's, and its threads did not come along
            members = list(self._members)
        self.clock.close()
        for member in reversed(members):
            member.close()
        self.timers.close()
        self.middleware.close()
        self._worker.close()
        self.graph.clear()
        self._tell_status()
        self.graph_listeners.clear()
        self.dispatcher.close()
        self.own_dispatcher.close()
        self.status_listeners.clear()

    def _follow(self, idle: bool) -> None:
        self.middleware.poll()
        self._tell_status()
        moved, self._moved = self._moved, False
        if not moved and not idle:
            return
        with self._lock:
            members = list(self._members)
        for member in members:
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

    def _tell_status(self) -> None:
        status = self.middleware.status()
        if status != self._told:
            self._told = status
            if status.state is ConnectionState.LOST:
                _log.warning("%s: %s", self.url, status.detail)
            self.status_listeners.notify(status)
