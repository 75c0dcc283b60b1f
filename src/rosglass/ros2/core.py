"""The core of a ROS 2 node: its middleware, graph and types."""

from __future__ import annotations

import atexit
import logging
import threading
import time
from typing import TYPE_CHECKING
from weakref import WeakValueDictionary

from rosglass.comm import ConnectionState, Status
from rosglass.comm.core import NodeCore
from rosglass.comm.graph import Graph
from rosglass.comm.handle import undo_on_error
from rosglass.comm.listeners import ChangeListeners
from rosglass.comm.names import expand
from rosglass.comm.types import Types
from rosglass.ros2.ros_arguments import NO_ARGUMENTS

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from rosglass.comm import NodeName
    from rosglass.comm.wire import Middleware
    from rosglass.interfaces import Library
    from rosglass.ros2.ros_arguments import Arguments

__all__ = ["REQUEST_LIMIT", "Core", "RequestWindow"]

_log = logging.getLogger("rosglass.ros2")
#: Maximum number of open requests, and of replies in a burst: two less than a peer's queue holds.
REQUEST_LIMIT = 8


class Core(NodeCore):
    """The core of a ROS 2 node.

    Args:
        name: The node's name.
        url: The URL it was connected with, for messages.
        middleware: Opened and closed by the core.
        library: Source of type definitions; None for the shared library.
        arguments: The program's ``--ros-args``.

    Attributes:
        graph: The ROS graph as discovered so far.
        types: Finds types.
        windows: The open requests to each service, shared by all its clients.

    Raises:
        ConnectionLostError: The middleware cannot start on this machine.
        RosArgumentError: A remapping rule makes a name that is not valid.
    """

    graph: Graph
    types: Types
    status_listeners: ChangeListeners[Status]

    def __init__(
        self,
        name: NodeName,
        url: str,
        middleware: Middleware,
        library: Library | None,
        arguments: Arguments = NO_ARGUMENTS,
    ) -> None:
        super().__init__(name, url, _log)
        self.middleware, self.wire, self.arguments = middleware, middleware.wire, arguments
        self.create_writer = lambda endpoint, _: middleware.create_writer(endpoint)
        self._new_names = {
            kind: arguments.remappings(kind, name.name, name.namespace)
            for kind in ("topic", "service")
        }
        self.types = Types(library, url, ros=1 if self.wire == "ros1" else 2)
        self.windows: WeakValueDictionary[str, RequestWindow] = WeakValueDictionary()
        self._moved = True
        self.status_listeners = ChangeListeners(middleware.status, middleware.status())
        self.graph = Graph(self.wake)
        self._worker = self._start_following()
        with undo_on_error(middleware.close), undo_on_error(self._worker.close):
            middleware.open(self.graph, self._worker.wake)
            middleware.announce(name)
        # Threads that deliver samples must not run while the interpreter shuts down.
        atexit.register(self.close)

    def resolve(self, name: str, kind: str = "topic") -> str:
        """Return the absolute name of a topic or service, which the user may have remapped.

        Args:
            name: Absolute, relative or private name.
            kind: ``topic`` or ``service``: some rules apply to one of them only. An action's name
                is resolved as a topic's.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """
        full = self.expand(name)
        return self._new_names[kind].get(full, full)

    def expand(self, name: str) -> str:
        """Return the absolute form of any name, not remapped; raises InvalidNameError."""
        return expand(name, self.name.name, self.name.namespace)

    def _state(self) -> Status:
        return self.status_listeners.read()

    def _disconnect(self) -> None:
        self.middleware.close()

    def _notify_closed(self, status: Status) -> None:  # noqa: ARG002 - the middleware's says more
        self._update_status()

    def _follow(self, idle: bool) -> None:
        self.middleware.poll()
        self._update_status()
        super()._follow(idle)

    def _update_status(self) -> None:
        if self.status_listeners.update():
            status = self.middleware.status()
            if status.state is ConnectionState.LOST:
                _log.warning("%s: %s", self.url, status.detail)


class RequestWindow:
    """The open requests of a node to one service: at most :data:`REQUEST_LIMIT`.

    Args:
        stall_s: Seconds after which an open request without response counts as taken.
    """

    def __init__(self, stall_s: float) -> None:
        self._stall_s = stall_s
        #: Guards both dicts: all clients of a service in a node share the window.
        self._lock = threading.Lock()
        #: Monotonic time of sending of each open request, the oldest first.
        self._open: dict[Hashable, float] = {}
        #: The callbacks of requesters that found the window full.
        self._waiting: dict[Callable[[], None], None] = {}

    def enter(self, request: Hashable, retry: Callable[[], None]) -> bool:
        """Return whether a request may be sent now.

        Args:
            request: The request; it is open until :meth:`leave`.
            retry: Returned by :meth:`leave` once the window has room again.
        """
        now = time.monotonic()
        with self._lock:
            if len(self._open) >= REQUEST_LIMIT:
                while self._open and now - next(iter(self._open.values())) >= self._stall_s:
                    del self._open[next(iter(self._open))]
                if len(self._open) >= REQUEST_LIMIT:
                    self._waiting[retry] = None
                    return False
            self._open[request] = now
        return True

    def leave(self, request: Hashable) -> list[Callable[[], None]]:
        """Remove a request; return the callbacks of waiting requesters, for the caller to call."""
        with self._lock:
            if self._open.pop(request, None) is None or not self._waiting:
                return []
            waiting = list(self._waiting)
            self._waiting.clear()
        return waiting
