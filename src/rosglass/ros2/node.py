"""A node in a ROS 2 graph, over whichever middleware."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind, NodeName, Publisher, QoS, Subscription
from rosglass.comm.builtin_services import BuiltinServices
from rosglass.comm.core import CoreNode
from rosglass.comm.names import validate_namespace, validate_node_name
from rosglass.comm.node import check_flag
from rosglass.comm.qos import check_profile
from rosglass.comm.rclpy_names import check_order
from rosglass.comm.subscription_feed import SubscriptionFeed, find_subscribed_type
from rosglass.ros2.core import Core
from rosglass.ros2.graph_matching import GraphMatching
from rosglass.ros2.rcl_services import RclServices
from rosglass.ros2.ros_arguments import NO_ARGUMENTS
from rosglass.ros2.service_client import create_service_client
from rosglass.ros2.service_replier import create_service_server
from rosglass.ros2.type_fetching import TypeFetcher

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rosglass.comm import (
        ActionClient,
        ActionServer,
        Answer,
        EndpointInfo,
        Executor,
        LifecycleClient,
        ParameterClient,
        Promise,
        Sample,
        ServerGoal,
        ServiceClient,
        ServiceServer,
    )
    from rosglass.comm.log import NodeLogger
    from rosglass.comm.node import Result
    from rosglass.interfaces import Library
    from rosglass.messages import ActionType, Message, MessageType, ServiceType
    from rosglass.ros2.parameters import Ros2Parameters
    from rosglass.ros2.ros_arguments import Arguments
    from rosglass.wires.base import Middleware

__all__ = ["Ros2Node"]


class Ros2Node(CoreNode):
    """A ROS 2 node; made by :func:`rosglass.connect`.

    Args:
        middleware: Opened and closed by the node.
        url: What it was connected with, for people to read.
        name: Base name.
        namespace: Absolute namespace.
        library: Where definitions come from; None for the shared library.
        arguments: What the program was told with ``--ros-args``; name and namespace are the
            final ones.
        own_services: Whether other nodes find what every ROS 2 node offers: its parameters, its
            log, descriptions of its types.

    Raises:
        InvalidNameError: The name or namespace breaks ROS's rules.
        ConnectionLostError: The middleware cannot start on this machine.
        RosArgumentError: A remapping rule makes a name that is not valid.
    """

    _core: Core

    def __init__(
        self,
        middleware: Middleware,
        url: str,
        name: str,
        namespace: str = "/",
        library: Library | None = None,
        arguments: Arguments = NO_ARGUMENTS,
        *,
        own_services: bool = False,
    ) -> None:
        validate_node_name(name)
        validate_namespace(namespace)
        self.url, self.name, self.namespace = url, name, namespace
        self.wire = middleware.wire
        self._core = Core(NodeName(namespace, name), url, middleware, library, arguments)
        self._fetcher = TypeFetcher(self._core)
        self._builtin_services = BuiltinServices(self._core, RclServices(self, self._core))
        self._builtin_services.open(own_services)

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Announce `topic`; see :meth:`rosglass.comm.Node.create_publisher`."""
        self._core.check_open()
        check_order("create_publisher", topic, type)
        self._core.types.ensure(type)
        full = self.resolve(topic)
        return Publisher(self._core, full, self._core.types.message(type), check_profile(qos, full))

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
            check_profile(qos, full),
            executor or self._core.dispatcher,
            callback,
            raw_callback,
        )
        ignored = self._core.local_gids if ignore_local else frozenset[bytes]()
        matching = GraphMatching(self._core, type, ignored)
        self._core.add(SubscriptionFeed(self._core, subscription, matching, ignored))
        return subscription

    def create_service_client(
        self, name: str, type: str | ServiceType | None = None, qos: QoS | None = None
    ) -> ServiceClient:
        """Return a client; see :meth:`rosglass.comm.Node.create_service_client`."""
        self._core.check_open()
        check_order("create_service_client", name, type)
        self._core.types.ensure(type)
        profile = _service_profile(qos, name)
        full = self._core.resolve(name, "service")
        return create_service_client(self._core, full, type, profile)

    def create_service_server(
        self,
        name: str,
        type: str | ServiceType,
        callback: Callable[[Message], Answer | Awaitable[Answer]],
        qos: QoS | None = None,
        *,
        executor: Executor | None = None,
    ) -> ServiceServer:
        """Offer a service; see :meth:`rosglass.comm.Node.create_service_server`."""
        self._core.check_open()
        check_order("create_service_server", name, type)
        self._core.types.ensure(type)
        profile = _service_profile(qos, name)
        full = self._core.resolve(name, "service")
        return create_service_server(self._core, full, type, callback, profile, executor)

    def create_action_client(self, name: str, type: str | ActionType | None = None) -> ActionClient:
        """Return a client; see :meth:`rosglass.comm.Node.create_action_client`."""
        self._core.check_open()
        check_order("create_action_client", name, type)
        self._core.types.ensure(type)
        from rosglass.ros2.action_client_protocol import Ros2ActionClient  # noqa: PLC0415 - few need it

        return Ros2ActionClient(self._core, self.resolve(name), type)

    def create_action_server(
        self,
        name: str,
        type: str | ActionType,
        execute: Callable[[ServerGoal], Result | Awaitable[Result]],
        *,
        accept: Callable[[Message], bool] | None = None,
        cancel: Callable[[ServerGoal], bool] | None = None,
        executor: Executor | None = None,
    ) -> ActionServer:
        """Offer an action; see :meth:`rosglass.comm.Node.create_action_server`."""
        self._core.check_open()
        check_order("create_action_server", name, type)
        self._core.types.ensure(type)
        from rosglass.comm.action_server import ActionServer  # noqa: PLC0415 - few need it
        from rosglass.ros2.action_server_protocol import Ros2ActionServerProtocol  # noqa: PLC0415

        kind = self._core.types.action(type)
        protocol = Ros2ActionServerProtocol(self._core, self.resolve(name), kind)
        return ActionServer(self._core, protocol, execute, accept, cancel, executor)

    @property
    def parameters(self) -> Ros2Parameters:
        """This node's own parameters."""
        self._core.check_open()
        return self._builtin_services.parameters

    def create_parameter_client(self, node: str | NodeName) -> ParameterClient:
        """Return a client of another node's parameters; `node` is its full name."""
        from rosglass.comm.parameters import ParameterClient  # noqa: PLC0415 - few need it
        from rosglass.ros2.parameter_services import RemoteParameterServices  # noqa: PLC0415

        self._core.check_open()
        return ParameterClient(RemoteParameterServices(self, self._node_name(node)))

    def create_lifecycle_client(self, node: str | NodeName) -> LifecycleClient:
        """Return a client that drives a lifecycle node; `node` is its full name."""
        from rosglass.ros2.lifecycle import Ros2LifecycleClient  # noqa: PLC0415

        self._core.check_open()
        return Ros2LifecycleClient(self, self._node_name(node))

    @property
    def logger(self) -> NodeLogger:
        """The node's logger, whose messages go to ``/rosout``, too."""
        return self._builtin_services.log.logger

    def fetch_type_async(
        self,
        name: str,
        *,
        hash: str = "",
        node: str | NodeName | None = None,
        timeout: float | None = 5.0,
    ) -> Promise[MessageType | ServiceType | ActionType]:
        """Ask for a type; see :meth:`rosglass.comm.Node.fetch_type_async`."""
        self._core.check_open()
        owner = "" if node is None else self._node_name(node)
        return self._fetcher.fetch(name, hash=hash, node=owner, timeout=timeout)

    def topics(self) -> dict[str, list[str]]:
        """Return every topic in the graph with the types announced for it."""
        return self._core.graph.topics()

    def nodes(self) -> list[NodeName]:
        """Return every node in the graph, this one included, sorted."""
        return self._core.graph.nodes()

    def duplicate_nodes(self) -> dict[str, int]:
        """Return the full names that several nodes bear, and how many do."""
        return self._core.graph.duplicate_nodes()

    def publishers(self, topic: str) -> list[EndpointInfo]:
        """Return the publishers of a topic."""
        return self._core.graph.endpoints(EndpointKind.PUBLISHER, self.resolve(topic))

    def subscriptions(self, topic: str) -> list[EndpointInfo]:
        """Return the subscriptions of a topic."""
        return self._core.graph.endpoints(EndpointKind.SUBSCRIPTION, self.resolve(topic))

    def unnamed_programs(self) -> int:
        """Return how many; see :meth:`rosglass.comm.Node.unnamed_programs`."""
        return self._core.middleware.unnamed()

    def invalid_names(self) -> list[str]:
        """Return what is left out of the graph; see :meth:`rosglass.comm.Node.invalid_names`."""
        return self._core.graph.invalid_names()

    def services(self) -> dict[str, list[str]]:
        """Return every service that is offered or called, with the types announced for it."""
        return self._core.graph.services()

    def actions(self) -> dict[str, list[str]]:
        """Return every action in the graph with the types announced for it."""
        return self._core.graph.actions()

    def service_servers(self, name: str) -> list[EndpointInfo]:
        """Return the servers of a service."""
        full = self._core.resolve(name, "service")
        return self._core.graph.endpoints(EndpointKind.SERVICE_SERVER, full)

    def service_clients(self, name: str) -> list[EndpointInfo]:
        """Return the clients of a service."""
        full = self._core.resolve(name, "service")
        return self._core.graph.endpoints(EndpointKind.SERVICE_CLIENT, full)

    def endpoints(self, node: str | NodeName) -> list[EndpointInfo]:
        """Return what a node publishes, subscribes, serves and calls; none when it is unknown."""
        namespace, _, name = self._node_name(node).rpartition("/")
        return self._core.graph.endpoints_of(NodeName(namespace or "/", name))

    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic or service; raises InvalidNameError."""
        return self._core.resolve(name)

    def close(self) -> None:
        """Leave the graph, close everything created from the node and end its threads.

        Safe to call twice, from any thread and from callbacks.
        """
        self._core.close()

    def _node_name(self, node: str | NodeName) -> str:
        return node.full if isinstance(node, NodeName) else self._core.expand(node)


def _service_profile(qos: QoS | None, place: str) -> QoS:
    usual = QoS.services()
    return usual if qos is None else check_profile(qos, place).for_subscription((usual,))
