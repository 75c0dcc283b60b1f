"""What every node of a graph can do, whichever ROS it speaks."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from rosglass.comm.executor import check_plain
from rosglass.comm.graph import EndpointKind, NodeName, Status
from rosglass.comm.node import Handle, Node, check_flag
from rosglass.comm.publisher import Publisher
from rosglass.comm.qos import check_profile
from rosglass.comm.rclpy_names import check_order
from rosglass.comm.subscription import Subscription
from rosglass.comm.subscription_feed import find_subscribed_type

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.builtin_services import BuiltinServices
    from rosglass.comm.clock import Clock
    from rosglass.comm.core import NodeCore
    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.log import NodeLogger
    from rosglass.comm.node import Executor
    from rosglass.comm.qos import QoS
    from rosglass.comm.sample import Sample
    from rosglass.comm.time import Time
    from rosglass.messages import Message, MessageType

__all__ = ["GraphNode"]


class GraphNode(Node):
    """A node of a graph: its topics, what it sees of the graph, its log, clock and status."""

    _core: NodeCore
    _builtin_services: BuiltinServices[Any]

    # -- topics ----------------------------------------------------------------------------------

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Announce `topic`; see :meth:`rosglass.comm.Node.create_publisher`."""
        self._core.check_open()
        check_order("create_publisher", topic, type)
        self._core.types.ensure(type)
        full = self.resolve(topic)
        return Publisher(self._core, full, self._core.types.message(type), self._profile(qos, full))

    def create_subscription(
        self,
        topic: str,
        type: str | MessageType | None = None,
        callback: Callable[[Message], None] | None = None,
        qos: QoS | int = 10,
        *,
        raw_callback: Callable[[Sample], None] | None = None,
        executor: Executor | None = None,
        ignore_local: bool = False,
    ) -> Subscription:
        """Subscribe to `topic`; see :meth:`rosglass.comm.Node.create_subscription`."""
        self._core.check_open()
        check_order("create_subscription", topic, type)
        full = self.resolve(topic)
        check_flag(ignore_local, "ignore_local", full)
        subscription = Subscription(
            full,
            find_subscribed_type(self._core, full, type),
            self._profile(qos, full),
            executor or self._core.dispatcher,
            callback,
            raw_callback,
        )
        self._receive(subscription, type, ignore_local)
        return subscription

    @abstractmethod
    def _receive(
        self, subscription: Subscription, type: str | MessageType | None, ignore_local: bool
    ) -> None:
        """Let a new subscription find its publishers."""

    def _profile(self, qos: QoS | int, place: str) -> QoS:
        """Return the profile that a user gave; errors as of :func:`check_profile`."""
        return check_profile(qos, place)

    # -- the log and time ------------------------------------------------------------------------

    @property
    def logger(self) -> NodeLogger:
        """The node's logger, whose messages go to ``/rosout``, too."""
        return self._builtin_services.log.logger

    @property
    def clock(self) -> Clock:
        """The node's clock, which follows ``/clock`` where ROS's parameter says so."""
        return self._core.clock

    def now(self) -> Time:
        """Return the time of the node's clock."""
        return self._core.clock.now()

    def on_graph_change(
        self, callback: Callable[[], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` after nodes or endpoints appeared or went; changes may be merged."""
        self._core.check_open()
        check_plain(callback, "on_graph_change()")
        return self._core.graph_listeners.add(
            lambda _: callback(), executor or self._core.dispatcher
        )

    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""
        return self._core.status()

    def on_status_change(
        self, callback: Callable[[Status], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with the new status whenever it changes."""
        self._core.check_open()
        return self._core.status_listeners.add(callback, executor or self._core.dispatcher)

    # -- the graph -------------------------------------------------------------------------------

    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic or service; raises InvalidNameError."""
        return self._core.resolve(name)

    def topics(self) -> dict[str, list[str]]:
        """Return every topic in the graph with the types announced for it."""
        return self._core.graph.topics()

    def nodes(self) -> list[NodeName]:
        """Return every node in the graph, this one included, sorted."""
        return self._core.graph.nodes()

    def invalid_names(self) -> list[str]:
        """Return what is left out of the graph; see :meth:`rosglass.comm.Node.invalid_names`."""
        return self._core.graph.invalid_names()

    def publishers(self, topic: str) -> list[EndpointInfo]:
        """Return the publishers of a topic."""
        return self._core.graph.endpoints(EndpointKind.PUBLISHER, self.resolve(topic))

    def subscriptions(self, topic: str) -> list[EndpointInfo]:
        """Return the subscriptions of a topic."""
        return self._core.graph.endpoints(EndpointKind.SUBSCRIPTION, self.resolve(topic))

    def service_servers(self, name: str) -> list[EndpointInfo]:
        """Return the servers of a service."""
        full = self._core.resolve(name, "service")
        return self._core.graph.endpoints(EndpointKind.SERVICE_SERVER, full)

    def service_clients(self, name: str) -> list[EndpointInfo]:
        """Return the clients of a service; none in ROS 1, which does not register them."""
        full = self._core.resolve(name, "service")
        return self._core.graph.endpoints(EndpointKind.SERVICE_CLIENT, full)

    def endpoints(self, node: str | NodeName) -> list[EndpointInfo]:
        """Return what a node publishes, subscribes, serves and calls; none when it is unknown."""
        namespace, _, name = self._node_name(node).rpartition("/")
        return self._core.graph.endpoints_of(NodeName(namespace or "/", name))

    def _node_name(self, node: str | NodeName) -> str:
        """Return a node's full name; raises InvalidNameError."""
        return node.full if isinstance(node, NodeName) else self._core.expand(node)

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """Leave the graph, close everything created from the node and end its threads.

        Safe to call twice, from any thread and from callbacks.
        """
        self._core.close()
