"""The ROS 2 node, over any middleware."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, Node, NodeName, QoS, Subscription
from rosglass.comm.action_server import ActionServer
from rosglass.comm.builtin_services import USE_SIM_TIME, BuiltinProtocol, BuiltinServices, SimTime
from rosglass.comm.handle import check_flag, undo_on_error
from rosglass.comm.lifecycle import LifecycleClient
from rosglass.comm.log import NodeLog, RosoutTopic, clean, message_of
from rosglass.comm.names import validate_namespace, validate_node_name
from rosglass.comm.parameters import ParameterClient
from rosglass.comm.qos import check_profile
from rosglass.comm.rclpy_names import check_order
from rosglass.comm.subscription import SubscriptionFeed
from rosglass.ros2.action_client import Ros2ActionClient
from rosglass.ros2.action_server import Ros2ActionServerProtocol
from rosglass.ros2.core import Core
from rosglass.ros2.parameters import (
    DESCRIBE_TYPES,
    ParameterServices,
    RemoteParameterServices,
    Ros2Parameters,
)
from rosglass.ros2.rmw_services import create_service_client, create_service_server
from rosglass.ros2.ros_arguments import NO_ARGUMENTS
from rosglass.ros2.topic_matching import GraphMatching
from rosglass.ros2.type_descriptions import TypeDescriptionServer, TypeFetcher

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterator

    from rosglass.comm import (
        ActionClient,
        Answer,
        Executor,
        Promise,
        ServerGoal,
        ServiceClient,
        ServiceServer,
    )
    from rosglass.comm.action_server import Result
    from rosglass.comm.wire import Middleware
    from rosglass.interfaces import Library
    from rosglass.messages import ActionType, Message, MessageType, ServiceType
    from rosglass.ros2.parameters import Change
    from rosglass.ros2.ros_arguments import Arguments

__all__ = ["RclServices", "Ros2Node"]


class Ros2Node(Node):
    """A ROS 2 node; created by :func:`rosglass.connect`.

    Args:
        middleware: Opened and closed by the node.
        url: The URL it was connected with, for messages.
        name: Base name.
        namespace: Absolute namespace.
        library: Source of type definitions; None for the shared library.
        arguments: The program's ``--ros-args``; already applied to name and namespace.
        own_services: Whether to offer the services of every ROS 2 node: its parameters, its log and
            descriptions of its types.

    Raises:
        InvalidNameError: The name or namespace breaks ROS's rules.
        ConnectionLostError: The middleware cannot start on this machine.
        RosArgumentError: A remapping rule makes a name that is not valid.
    """

    _core: Core
    _builtin_services: BuiltinServices[Ros2Parameters]

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
        self._builtin_services = BuiltinServices(self._core, RclServices(self, self._core))
        with undo_on_error(self._core.close):
            self._fetcher = TypeFetcher(self._core)
            self._builtin_services.open(own_services)

    def _receive(
        self, subscription: Subscription, type: str | MessageType | None, ignore_local: bool
    ) -> None:
        """Connect a new subscription to its publishers."""
        ignored = self._core.local_gids if ignore_local else frozenset[bytes]()
        matching = GraphMatching(self._core, type, ignored)
        self._core.add(SubscriptionFeed(self._core, subscription, matching, ignored))

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
        answers_failures: bool = False,
    ) -> ServiceServer:
        """Offer a service; see :meth:`rosglass.comm.Node.create_service_server`."""
        self._core.check_open()
        check_order("create_service_server", name, type)
        self._core.types.ensure(type)
        check_flag(answers_failures, "answers_failures", name)
        profile = _service_profile(qos, name)
        full = self._core.resolve(name, "service")
        return create_service_server(
            self._core, full, type, callback, profile, executor, answers_failures
        )

    def create_action_client(self, name: str, type: str | ActionType | None = None) -> ActionClient:
        """Return a client; see :meth:`rosglass.comm.Node.create_action_client`."""
        self._core.check_open()
        check_order("create_action_client", name, type)
        self._core.types.ensure(type)
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
        self._core.check_open()
        return ParameterClient(RemoteParameterServices(self, self._node_name(node)))

    def create_lifecycle_client(self, node: str | NodeName) -> LifecycleClient:
        """Return a client that drives a lifecycle node; `node` is its full name."""
        self._core.check_open()
        return LifecycleClient(self, self._node_name(node))

    def fetch_type_async(
        self,
        name: str,
        *,
        hash: str = "",
        node: str | NodeName | None = None,
        timeout: float | None = 5.0,
    ) -> Promise[MessageType | ServiceType | ActionType]:
        """Request a type; see :meth:`rosglass.comm.Node.fetch_type_async`."""
        self._core.check_open()
        owner = "" if node is None else self._node_name(node)
        return self._fetcher.fetch(name, hash=hash, node=owner, timeout=timeout)

    def duplicate_nodes(self) -> dict[str, int]:
        """Return the full names that several nodes share, and how many."""
        return self._core.graph.duplicate_nodes()

    def unnamed_programs(self) -> int:
        """Return the number of programs without node names; see :class:`rosglass.comm.Node`."""
        return self._core.middleware.unnamed()

    def services(self) -> dict[str, list[str]]:
        """Return every service that is offered or called, with its announced types."""
        return self._core.graph.services()

    def actions(self) -> dict[str, list[str]]:
        """Return every action in the graph, with its announced types."""
        return self._core.graph.actions()


def _service_profile(qos: QoS | None, place: str) -> QoS:
    usual = QoS.services()
    return usual if qos is None else check_profile(qos, place).for_subscription((usual,))


_FATAL = 50


class RclServices(BuiltinProtocol["Ros2Parameters"]):
    """The built-in services of a ROS 2 node.

    Args:
        node: The node.
        core: Its core.
    """

    def __init__(self, node: Node, core: Core) -> None:
        self._node, self._core = node, core

    def open(self, services: BuiltinServices[Ros2Parameters]) -> None:
        """Set the levels of the library's loggers, and use simulated time if requested."""
        arguments, name = self._core.arguments, self._core.name
        for logger, level in arguments.logger_levels.items():
            if logger.partition(".")[0] == "rosglass":
                logging.getLogger(logger).setLevel(level)
        if USE_SIM_TIME in arguments.parameters(name.full):
            _ = services.parameters

    def create_parameters(self, services: BuiltinServices[Ros2Parameters]) -> Ros2Parameters:
        """Return the parameters; from here on, the clock follows ``use_sim_time``."""
        core, full = self._core, self._core.name.full
        parameters = Ros2Parameters(full, core.dispatcher, core.arguments.parameters(full))
        sim_time = SimTime(core, self._node.create_subscription)

        def follow() -> None:
            sim_time.follow(parameters.typed_value(USE_SIM_TIME).value is True)

        def on_change(change: Change) -> None:
            if any(USE_SIM_TIME in names for names in change):
                follow()

        services.own(sim_time)
        services.own(parameters.changes.add(on_change, IMMEDIATE))
        follow()
        return parameters

    def create_log(self, services: BuiltinServices[Ros2Parameters]) -> NodeLog:  # noqa: ARG002
        """Return the log; its logger has rcl's name: ``/arm/gripper`` logs as arm.gripper."""
        core, arguments = self._core, self._core.arguments
        topic = RosoutTopic("rcl_interfaces/msg/Log", QoS.rosout(), _log_fields)
        return NodeLog(
            core,
            core.name.full.strip("/").replace("/", "."),
            topic if arguments.rosout else None,
            level=logging.INFO if arguments.log_level is None else arguments.log_level,
            levels=arguments.logger_levels,
            to_python=arguments.stdout,
        )

    def offer(self, services: BuiltinServices[Ros2Parameters]) -> Iterator[None]:
        """Announce ``/rosout``, and offer descriptions of types and the parameter services."""
        core, parameters = self._core, services.parameters
        services.log.open()
        yield
        if parameters.get(DESCRIBE_TYPES):
            descriptions = TypeDescriptionServer(core)
            services.own(descriptions)
            descriptions.open()
            yield
        offered = ParameterServices(self._node, parameters, core.own_dispatcher)
        services.own(offered)
        yield from offered.offer()


def _log_fields(record: logging.LogRecord) -> dict[str, Any]:
    """Return the fields of a ``Log`` message."""
    return {
        "stamp": {
            "sec": int(record.created),
            "nanosec": min(999_999_999, int(record.created % 1 * 1e9)),
        },
        "level": max(10, min(_FATAL, record.levelno // 10 * 10)),
        "name": clean(record.name),
        "msg": message_of(record),
        "file": clean(record.pathname),
        "function": clean(record.funcName or ""),
        "line": max(0, record.lineno),
    }
