"""A node in a ROS 2 graph, over whichever middleware."""

from __future__ import annotations

import atexit
import logging
import os
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.comm import (
    ConnectionState,
    Dispatcher,
    EndpointInfo,
    EndpointKind,
    Executor,
    Handle,
    Listeners,
    Node,
    NodeName,
    Publisher,
    QoS,
    Sample,
    Status,
    Subscription,
    Time,
    Worker,
)
from rosglass.errors import Error, NodeClosedError, TypeNotFoundError, UnsupportedError
from rosglass.ros2.graph import Graph
from rosglass.ros2.names import expand, validate_namespace, validate_node_name
from rosglass.ros2.publisher import Ros2Publisher
from rosglass.ros2.reading import Reading

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.interfaces import Library
    from rosglass.messages import Message, MessageType
    from rosglass.ros2.middleware import Middleware

__all__ = ["Ros2Node"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds between looks at what has no event: definitions added to the library, a client's router.
_POLL = 1.0


class Ros2Node(Node):
    """A ROS 2 node; made by :func:`rosglass.connect`.

    Args:
        middleware: Opened and closed by the node.
        url: What it was connected with, for people to read.
        name: Base name.
        namespace: Absolute namespace.
        library: Where definitions come from; None for the shared library.

    Raises:
        InvalidNameError: The name or namespace breaks ROS's rules.
        ConnectionLostError: The middleware cannot start on this machine.
    """

    wire = "cdr"

    def __init__(
        self,
        middleware: Middleware,
        url: str,
        name: str,
        namespace: str = "/",
        library: Library | None = None,
    ) -> None:
        validate_node_name(name)
        validate_namespace(namespace)
        self.url, self.name, self.namespace = url, name, namespace
        self._full_name = NodeName(namespace, name)
        self._middleware, self._library = middleware, library
        self._lock = threading.Lock()
        self._closed = False
        self._process = os.getpid()
        self._readings: dict[Subscription, Reading] = {}
        self._publishers: list[Ros2Publisher] = []
        self._graph_listeners: Listeners[None] = Listeners(merge=True)
        self._status_listeners: Listeners[Status] = Listeners()
        self._graph_moved = True
        self._told = middleware.status()
        self._dispatcher = Dispatcher(f"{name} callbacks")
        self._graph = Graph(self._on_graph)
        self._worker = Worker(f"{name} graph", self._follow, _POLL)
        try:
            middleware.open(self._graph, self._worker.wake)
            middleware.announce(self._full_name)
        except BaseException:
            self._worker.close()
            middleware.close()
            raise
        # Threads that hand on samples must not meet an interpreter that is being taken down.
        atexit.register(self.close)

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Announce `topic`; see :meth:`rosglass.comm.Node.create_publisher`."""
        self._check_open()
        full, profile = self.resolve(topic), _profile(qos)
        message_type = self._find(type) if isinstance(type, str) else self._check_type(type)
        writer = self._middleware.create_writer(
            self._full_name, full, message_type.name, message_type.rihs01, profile
        )
        publisher = Ros2Publisher(
            full,
            message_type,
            profile,
            writer,
            self._graph,
            self._middleware.matches_qos,
            self._forget_publisher,
        )
        with self._lock:
            self._publishers.append(publisher)
        if self._closed:
            publisher.close()
        self._check_open()
        publisher.follow()
        return publisher

    def create_subscription(
        self,
        topic: str,
        type: str | MessageType | None = None,
        callback: Callable[[Message], None] | None = None,
        qos: QoS | int = 10,
        *,
        raw_callback: Callable[[Sample], None] | None = None,
        executor: Executor | None = None,
    ) -> Subscription:
        """Subscribe to `topic`; see :meth:`rosglass.comm.Node.create_subscription`."""
        self._check_open()
        if isinstance(type, str):
            known: MessageType | None = self._find(type)
        else:
            known = None if type is None else self._check_type(type)
        subscription = Subscription(
            self.resolve(topic),
            known,
            _profile(qos),
            executor or self._dispatcher,
            callback,
            raw_callback,
            self._forget_subscription,
        )
        reading = Reading(
            subscription,
            type,
            self._middleware,
            self._full_name,
            self._find,
            self._on_graph,
        )
        if known is not None:
            reading.read(known)
        with self._lock:
            self._readings[subscription] = reading
        if self._closed:
            subscription.close()
        self._check_open()
        self._on_graph()
        return subscription

    def topics(self) -> dict[str, list[str]]:
        """Return every topic in the graph with the types announced for it."""
        return self._graph.topics()

    def nodes(self) -> list[NodeName]:
        """Return every node in the graph, this one included, sorted."""
        return self._graph.nodes()

    def publishers(self, topic: str) -> list[EndpointInfo]:
        """Return the publishers of a topic."""
        return self._graph.endpoints(EndpointKind.PUBLISHER, self.resolve(topic))

    def subscriptions(self, topic: str) -> list[EndpointInfo]:
        """Return the subscriptions of a topic."""
        return self._graph.endpoints(EndpointKind.SUBSCRIPTION, self.resolve(topic))

    def on_graph_change(
        self, callback: Callable[[], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` after nodes or endpoints appeared or went; changes may be merged."""
        self._check_open()
        return self._graph_listeners.add(lambda _: callback(), executor or self._dispatcher)

    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""
        if self._process != os.getpid():
            return Status(ConnectionState.CLOSED, "left behind by a fork; connect again here")
        return self._middleware.status()

    def on_status_change(
        self, callback: Callable[[Status], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with the new status whenever it changes."""
        self._check_open()
        return self._status_listeners.add(callback, executor or self._dispatcher)

    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic or service; raises InvalidNameError."""
        return expand(name, self.name, self.namespace)

    def now(self) -> Time:
        """Return the system's time."""
        return Time.now()

    def close(self) -> None:
        """Leave the graph, close everything created from the node and end its threads.

        Safe to call twice, from any thread and from callbacks.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
            atexit.unregister(self.close)
            if self._process != os.getpid():
                return  # the connection is the parent's, and its threads did not come along
            readings, publishers = list(self._readings), list(self._publishers)
        for item in (*readings, *publishers):
            item.close()
        self._middleware.close()
        self._worker.close()
        self._graph.clear()
        self._tell_status()
        self._graph_listeners.clear()
        self._dispatcher.close()
        self._status_listeners.clear()

    def _find(self, name: str, hash: str = "") -> MessageType:
        """Return the message type `name`, in the version that a peer announced by its hash."""
        from rosglass.interfaces import Definition  # noqa: PLC0415 - only when a type is needed
        from rosglass.messages import MessageType, default_library, load  # noqa: PLC0415 - numpy

        try:
            found = self._check_type(load(name, ros=2, library=self._library))
        except Error:
            if not hash:
                raise
        else:
            if hash in ("", found.rihs01):
                return found
        library = default_library() if self._library is None else self._library
        definition = library.definition(name, ros=2, hash=hash)
        return self._check_type(
            MessageType(definition) if isinstance(definition, Definition) else definition
        )

    def _check_type(self, found: object) -> MessageType:
        from rosglass.messages import MessageType  # noqa: PLC0415 - numpy

        if not isinstance(found, MessageType):
            raise TypeNotFoundError(
                f"{found!r} is not a message type; give a name such as std_msgs/msg/String "
                "or what rosglass.load() returns for a message"
            )
        if found.ros != 2:
            raise UnsupportedError(
                f"{found.name} is ROS 1's definition, and {self.url} is a ROS 2 graph; "
                f"load it with rosglass.load({found.name!r}, ros=2)"
            )
        return found

    def _on_graph(self) -> None:
        self._graph_moved = True
        self._worker.wake()

    def _follow(self, idle: bool) -> None:
        self._middleware.poll()
        self._tell_status()
        moved, self._graph_moved = self._graph_moved, False
        if not moved and not idle:
            return
        with self._lock:
            readings, publishers = list(self._readings.values()), list(self._publishers)
        # Another thread may close the node, or one of these, meanwhile.
        with suppress(NodeClosedError):
            for reading in readings:
                self._update(reading, idle)
            if moved:
                for publisher in publishers:
                    publisher.follow()
        if moved:
            self._graph_listeners.notify(None)

    def _update(self, reading: Reading, idle: bool) -> None:
        subscription = reading.subscription
        found = self._graph.endpoints(EndpointKind.PUBLISHER, subscription.topic)
        try:
            reading.update(found, retry=idle)
        except NodeClosedError:
            raise
        except Error as error:
            subscription.set_problem(str(error))

    def _tell_status(self) -> None:
        status = self._middleware.status()
        if status != self._told:
            self._told = status
            if status.state is ConnectionState.LOST:
                _log.warning("%s: %s", self.url, status.detail)
            self._status_listeners.notify(status)

    def _forget_subscription(self, subscription: Subscription) -> None:
        with self._lock:
            reading = self._readings.pop(subscription, None)
        if reading is not None:
            reading.close()

    def _forget_publisher(self, publisher: Ros2Publisher) -> None:
        with self._lock:
            if publisher in self._publishers:
                self._publishers.remove(publisher)

    def _check_open(self) -> None:
        if self._process != os.getpid():
            raise NodeClosedError(
                f"node {self._full_name} belongs to the process that made it, and does not work "
                "after a fork; connect again in this process"
            )
        if self._closed:
            raise NodeClosedError(f"node {self._full_name} is closed; connect again")


def _profile(qos: QoS | int) -> QoS:
    if isinstance(qos, QoS):
        return qos
    return QoS(depth=qos)
