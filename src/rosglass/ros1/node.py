"""The ROS 1 node, as :func:`rosglass.connect` returns it for ``ros1://``."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    History,
    Node,
    NodeName,
    QoS,
    Subscription,
)
from rosglass.comm.action_server import ActionServer
from rosglass.comm.builtin_services import BuiltinServices
from rosglass.comm.handle import check_flag, check_may_wait
from rosglass.comm.parameters import ParameterClient
from rosglass.comm.promise import check_timeout
from rosglass.comm.rclpy_names import check_order
from rosglass.errors import InvalidNameError
from rosglass.ros1.actionlib import actions
from rosglass.ros1.actionlib_client import ActionlibClient
from rosglass.ros1.actionlib_server import ActionlibServer
from rosglass.ros1.names import absolute_namespace, expand, validate_node_name
from rosglass.ros1.options import Ros1Options
from rosglass.ros1.parameter_namespace import RemoteNamespace
from rosglass.ros1.parameter_server import ParameterServer
from rosglass.ros1.remapping_arguments import Arguments
from rosglass.ros1.roscpp_services import RoscppServices
from rosglass.ros1.services import Services
from rosglass.ros1.type_discovery import fetch
from rosglass.wires.tcpros.announced_types import AnnouncedTypes
from rosglass.wires.tcpros.node import TcprosNode

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping, Sequence

    from rosglass.comm import (
        Answer,
        EndpointInfo,
        Executor,
        Promise,
        ServerGoal,
        ServiceClient,
        ServiceServer,
    )
    from rosglass.comm.action_server import Result
    from rosglass.interfaces import Library
    from rosglass.messages import ActionType, Message, MessageType, ServiceType
    from rosglass.ros1.parameter_namespace import Ros1Parameters

__all__ = ["Ros1Node", "connect_ros1"]

_log = logging.getLogger("rosglass.ros1")


class Core(TcprosNode):
    """The core of a ROS 1 node, which resolves its names.

    Args:
        name: The node's name.
        url: The URL it was connected with, for messages.
        options: Master, own address, remappings.
        library: Library for definitions; None for the shared one.

    Raises:
        ConnectionLostError: This machine cannot listen for connections.
    """

    def __init__(
        self, name: NodeName, url: str, options: Ros1Options, library: Library | None
    ) -> None:
        self._new_names = options.arguments.remappings(name.name, name.namespace)
        super().__init__(name, url, options, AnnouncedTypes(library, url))

    def resolve(self, name: str, kind: str = "topic") -> str:  # noqa: ARG002 - one rule for all
        """Return the absolute name of a topic, service or parameter, which may be remapped.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """
        full = self.expand(name)
        return self._new_names.get(full, full)

    def expand(self, name: str) -> str:
        """Return the absolute name of anything, not remapped; raises InvalidNameError."""
        return expand(name, self.name.name, self.name.namespace)


def connect_ros1(
    url: str,
    name: str | None,
    namespace: str | None,
    library: Library | None,
    arguments: Sequence[str],
    own_services: bool,
) -> Ros1Node:
    """Connect to the master of a ``ros1://`` URL; see :func:`rosglass.connect`."""
    options = Ros1Options.parse(url, arguments=Arguments.parse(arguments))
    return Ros1Node(
        options,
        url,
        options.node_name(name),
        options.namespace(namespace),
        library,
        options.arguments.parameters,
        own_services=own_services,
    )


class Ros1Node(Node):
    """A node of a ROS 1 graph.

    Args:
        options: Master, own address, remappings.
        url: The URL it was connected with, for messages.
        name: Base name.
        namespace: Absolute namespace.
        library: Library for definitions; None for the shared one.
        parameters: Private parameters that the program was started with, by their names.
        own_services: Whether to offer the built-in services of ROS 1 nodes: the log, and those for
            log levels.

    Raises:
        InvalidNameError: The name or namespace breaks ROS's rules.
        ConnectionLostError: This machine cannot listen for connections.
    """

    wire = "ros1"
    _core: Core
    _builtin_services: BuiltinServices[Ros1Parameters]

    def __init__(
        self,
        options: Ros1Options,
        url: str,
        name: str,
        namespace: str = "/",
        library: Library | None = None,
        parameters: Mapping[str, Any] | None = None,
        *,
        own_services: bool = False,
    ) -> None:
        validate_node_name(name)
        namespace = absolute_namespace(namespace, "namespace", relative=False)
        self.url, self.name, self.namespace = url, name, namespace
        self._core = Core(NodeName(namespace, name), url, options, library)
        try:
            self._topics = self._core.topics
            self._services = Services(self._core)
            self._parameter_server = ParameterServer(self._core, parameters or {})
            self._builtin_services = BuiltinServices(
                self._core,
                RoscppServices(self, self._core, self._parameter_server, self._topic_names),
            )
            self._core.start(self._parameter_server.changed)
            self._builtin_services.open(own_services)
        except BaseException:
            self._core.close()
            raise

    # -- topics ----------------------------------------------------------------------------------

    def _receive(
        self, subscription: Subscription, type: str | MessageType | None, ignore_local: bool
    ) -> None:
        """Register a new subscription."""
        asked = type if subscription.type is None and isinstance(type, str) else ""
        self._topics.subscribe(subscription, ignore_local, asked)

    def _profile(self, qos: QoS | int, place: str) -> QoS:
        if type(qos) is int and qos == 0:
            return QoS(history=History.KEEP_ALL)  # as in roscpp and rospy
        return super()._profile(qos, place)

    # -- services --------------------------------------------------------------------------------

    def create_service_client(
        self,
        name: str,
        type: str | ServiceType | None = None,
        qos: QoS | None = None,
        *,
        persistent: bool = False,
    ) -> ServiceClient:
        """Return a client of a service; see :meth:`rosglass.comm.Node.create_service_client`.

        Args:
            name: Absolute, relative or private service name.
            type: Type name or type; None takes the type that the server announces.
            qos: Stored without effect: ROS 1 has none.
            persistent: Whether all calls use one connection, one after the other, which saves most
                of a call's time; it is reconnected when it is lost. Otherwise each call has a
                connection of its own, as in rospy, and calls run in parallel.
        """
        self._core.check_open()
        check_order("create_service_client", name, type)
        check_flag(persistent, "persistent", name)
        return self._services.client(self.resolve(name), type, qos, persistent)

    def create_service_server(
        self,
        name: str,
        type: str | ServiceType,
        callback: Callable[[Message], Answer | Awaitable[Answer]],
        qos: QoS | None = None,
        *,
        executor: Executor | None = None,
    ) -> ServiceServer:
        """Offer a service; see :meth:`rosglass.comm.Node.create_service_server`.

        Raises:
            ServiceError: This node offers it already.
        """
        self._core.check_open()
        check_order("create_service_server", name, type)
        return self._services.serve(self.resolve(name), type, callback, qos, executor)

    # -- actions ---------------------------------------------------------------------------------

    def create_action_client(
        self, name: str, type: str | ActionType | None = None
    ) -> ActionlibClient:
        """Return a client of an action; see :meth:`rosglass.comm.Node.create_action_client`."""
        self._core.check_open()
        check_order("create_action_client", name, type)
        wanted = None if type is None else self._core.types.action(type)
        return ActionlibClient(self._core, self._topics, self.resolve(name), wanted)

    def create_action_server(
        self,
        name: str,
        type: str | ActionType,
        execute: Callable[[ServerGoal], Result | Awaitable[Result]],
        *,
        accept: Callable[[Message], bool] | None = None,
        cancel: Callable[[ServerGoal], bool] | None = None,
        executor: Executor | None = None,
        simple: bool = False,
    ) -> ActionServer:
        """Offer an action; see :meth:`rosglass.comm.Node.create_action_server`.

        Args:
            name: Absolute, relative or private action name.
            type: Type name or type.
            execute: Called with each accepted goal.
            accept: Called with the goal; returns whether it is accepted.
            cancel: Called with the goal; returns whether a request to cancel it is accepted.
            executor: Where the callbacks run.
            simple: Whether one goal is executed at a time, as by actionlib's SimpleActionServer: a
                newer goal preempts it, and is executed after it.
        """
        self._core.check_open()
        check_order("create_action_server", name, type)
        action_type = self._core.types.action(type)
        protocol = ActionlibServer(
            self._core, self._topics, self.resolve(name), action_type, simple
        )
        return ActionServer(self._core, protocol, execute, accept, cancel, executor)

    def actions(self) -> dict[str, list[str]]:
        """Return every action in the graph with its type."""
        return actions(self._core.graph)

    # -- parameters ------------------------------------------------------------------

    @property
    def parameters(self) -> Ros1Parameters:
        """This node's own parameters: those in its private namespace."""
        self._core.check_open()
        return self._builtin_services.parameters

    @property
    def parameter_server(self) -> ParameterServer:
        """The master's parameter server, with all parameters of all nodes."""
        return self._parameter_server

    def create_parameter_client(self, node: str | NodeName) -> ParameterClient:
        """Return a client of another node's parameters; `node` is its full name.

        `node` may be any other absolute namespace, too.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
        """
        self._core.check_open()
        full = self._node_name(node)
        return ParameterClient(RemoteNamespace(self._core, self._parameter_server, full))

    # -- the node's names ------------------------------------------------------------------------

    @property
    def master_uri(self) -> str:
        """The master's API, such as ``http://robot:11311``."""
        return self._core.master.uri

    @property
    def address(self) -> str:
        """Host or address under which other nodes reach this one."""
        return self._core.address[0]

    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic or service; raises InvalidNameError."""
        full = super().resolve(name)
        if full == "/":
            raise InvalidNameError(f"{name!r} is a namespace; write a topic's or service's name")
        return full

    # -- the graph -------------------------------------------------------------------------------

    def nodes(self) -> list[NodeName]:
        """Return every node in the graph, this one included, sorted."""
        own = () if self._core.closed else (self._core.name,)
        return sorted({*super().nodes(), *own})

    def services(self) -> dict[str, list[str]]:
        """Return every service in the graph with its type.

        Only a service's server has its type: the first call probes the servers in the background,
        and the graph changes as they answer.
        """
        return self._services.listing()

    def publishers(self, topic: str) -> list[EndpointInfo]:
        """Return the publishers of a topic."""
        return self._topics.publishers(self.resolve(topic))

    def ask_publishers(self, topic: str, timeout: float = 3.0) -> list[EndpointInfo]:
        """Request md5 sum and latching from the publishers of a topic; waits for the answers.

        The master does not have them, and :meth:`publishers` returns them only for connected
        publishers. This connects for a moment, without receiving messages.

        Args:
            topic: Absolute, relative or private topic name.
            timeout: Seconds to wait; later answers are missing in the result.

        Raises:
            ConversionError: The timeout is not a number of seconds.
            UnsupportedError: Called in a thread that receives messages.
        """
        full = self.resolve(topic)
        self._core.check_open()
        limit = check_timeout(timeout, "ask_publishers()")
        check_may_wait(f"the publishers of {full} have not answered")
        return self._topics.ask_publishers(full, limit)

    def fetch_type_async(
        self,
        name: str,
        *,
        hash: str = "",
        node: str | NodeName | None = None,
        timeout: float | None = 5.0,
    ) -> Promise[MessageType | ServiceType | ActionType]:
        """Fetch a type from the graph; see :meth:`rosglass.comm.Node.fetch_type_async`."""
        self._core.check_open()
        owner = "" if node is None else self._node_name(node)
        return fetch(self._core, self._topics, self._services, name, hash, owner, timeout)

    def service_servers(self, name: str) -> list[EndpointInfo]:
        """Return the server of a service, with its type once that is known."""
        return self._services.described(super().service_servers(name))

    def endpoints(self, node: str | NodeName) -> list[EndpointInfo]:
        """Return a node's publishers, subscriptions and services; empty for an unknown node."""
        return self._services.described(super().endpoints(node))

    def _topic_names(self) -> list[str]:
        return sorted({*self._topics.published(), *self._topics.subscribed()})
