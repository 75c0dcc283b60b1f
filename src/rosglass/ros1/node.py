"""The ROS 1 node, as :func:`rosglass.connect` returns it for ``ros1://``."""

from __future__ import annotations

import itertools
import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, History, Node, NodeName, QoS, Subscription
from rosglass.comm.action_server import ActionServer
from rosglass.comm.builtin_services import USE_SIM_TIME, BuiltinProtocol, BuiltinServices, SimTime
from rosglass.comm.handle import check_flag, check_may_wait, undo_on_error
from rosglass.comm.log import NodeLog, RosoutTopic, clean, message_of
from rosglass.comm.parameters import ParameterClient
from rosglass.comm.promise import check_timeout
from rosglass.comm.rclpy_names import check_order
from rosglass.errors import InvalidNameError, ServiceError
from rosglass.ros1.actionlib import actions
from rosglass.ros1.actionlib_client import ActionlibClient
from rosglass.ros1.actionlib_server import ActionlibServer
from rosglass.ros1.options import Arguments, Ros1Options
from rosglass.ros1.parameter_namespace import RemoteNamespace, Ros1Parameters
from rosglass.ros1.parameter_server import ParameterServer, StartParameters
from rosglass.ros1.services import Services
from rosglass.ros1.type_discovery import fetch
from rosglass.wires.tcpros.core import AnnouncedTypes
from rosglass.wires.tcpros.graph import absolute_namespace, expand, validate_node_name
from rosglass.wires.tcpros.node import TcprosNode

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence

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
    from rosglass.wires.tcpros.core import TcprosCore

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
        with undo_on_error(self._core.close):
            self._topics = self._core.topics
            self._services = Services(self._core)
            self._parameter_server = ParameterServer(self._core, parameters or {})
            self._builtin_services = BuiltinServices(
                self._core,
                RoscppServices(self, self._core, self._parameter_server, self._topic_names),
            )
            self._builtin_services.open(own_services)
            self._core.start(self._parameter_server.changed)

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
        answers_failures: bool = False,
    ) -> ServiceServer:
        """Offer a service; see :meth:`rosglass.comm.Node.create_service_server`.

        Raises:
            ServiceError: This node offers it already.
        """
        self._core.check_open()
        check_order("create_service_server", name, type)
        check_flag(answers_failures, "answers_failures", name)
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


_NO_TOPICS = "/rosout_disable_topics_generation"
#: Latched, as in rospy and roscpp.
_ROSOUT_QOS = QoS(depth=1000, durability=QoS.latched().durability)
#: How long the first messages wait for the node ``/rosout``: only the last one is latched.
_ROSOUT_WAIT_S = 2.0
#: The levels' names in roscpp; fatal is Python's critical.
_LEVELS = {
    "debug": logging.DEBUG,
    "info": logging.INFO,
    "warn": logging.WARNING,
    "error": logging.ERROR,
    "fatal": logging.CRITICAL,
}
#: ``rosgraph_msgs/Log``'s levels by the lowest of Python's that they stand for.
_LOG_LEVELS = ((50, 16), (40, 8), (30, 4), (20, 2))
_DEBUG = 1
_LIBRARY = "rosglass"


class RoscppServices(BuiltinProtocol["Ros1Parameters"]):
    """The built-in services of roscpp and rospy: parameters, ``/rosout``, log levels, clock.

    Behaviour: ROS wiki, "rosout", "Clock", "roscpp" and "rospy/Overview/Logging"; levels and fields
    are ``rosgraph_msgs/Log``'s. As in rospy and roscpp, ``name`` is the node's and ``topics`` are
    those that the node publishes or subscribes to, unless ``/rosout_disable_topics_generation`` is
    set. ``~get_loggers`` and ``~set_logger_level`` are what rosconsole and rqt_logger_level call.

    The clock follows ``/use_sim_time``. roscpp and rospy read that parameter once, as they start;
    this node follows it, so that a screen started before the simulation has its time, too.

    Args:
        node: The node.
        core: The node's core.
        server: The master's parameter server.
        topics: Returns the topics that the node publishes or subscribes to.
    """

    def __init__(
        self, node: Node, core: TcprosCore, server: ParameterServer, topics: Callable[[], list[str]]
    ) -> None:
        self._node, self._core, self._server, self._topics = node, core, server, topics

    def open(self, services: BuiltinServices[Ros1Parameters]) -> None:
        """Set the program's start parameters, and follow simulated time.

        Until the master has answered, which takes some milliseconds after connecting, the clock
        shows the system's time.
        """
        services.own(self._server)
        self._core.add(StartParameters(self._server))
        sim_time = SimTime(self._core, self._node.create_subscription)
        services.own(sim_time)
        # As in rospy, 1 counts, too.
        services.own(
            self._server.subscribe(
                f"/{USE_SIM_TIME}", lambda value: sim_time.follow(bool(value)), IMMEDIATE
            )
        )

    def create_parameters(
        self,
        services: BuiltinServices[Ros1Parameters],  # noqa: ARG002 - they need not be closed
    ) -> Ros1Parameters:
        """Return the node's parameters on the master's server."""
        return Ros1Parameters(self._core, self._server)

    def create_log(self, services: BuiltinServices[Ros1Parameters]) -> NodeLog:
        """Return the log; its logger is below ``ros``, as in roscpp: ``ros.arm.gripper``."""
        core, numbers = self._core, itertools.count(1)
        without_topics = self._server.subscribe(_NO_TOPICS)
        services.own(without_topics)

        def fields(record: logging.LogRecord) -> dict[str, Any]:
            # The node's time may be simulated; the record's is the system's.
            now = core.clock.now().nanoseconds
            return {
                "header": {
                    "seq": next(numbers) % 2**32,
                    "stamp": {"secs": now // 10**9, "nsecs": now % 10**9},
                },
                "level": _level_of(record.levelno),
                "name": core.name.full,
                "msg": message_of(record),
                "file": clean(record.pathname),
                "function": clean(record.funcName or ""),
                "line": max(0, record.lineno),
                "topics": [] if without_topics.value else self._topics(),
            }

        topic = RosoutTopic("rosgraph_msgs/Log", _ROSOUT_QOS, fields, _ROSOUT_WAIT_S)
        name = "ros." + core.name.full.strip("/").replace("/", ".")
        return NodeLog(core, name, topic)

    def offer(self, services: BuiltinServices[Ros1Parameters]) -> Iterator[None]:
        """Publish ``/rosout``, and offer the services for log levels."""
        services.log.open()
        yield
        self._logger = services.log.logger
        for name, type_name, answer in (
            ("~get_loggers", "roscpp/GetLoggers", self._list_loggers),
            ("~set_logger_level", "roscpp/SetLoggerLevel", self._set_level),
        ):
            executor = self._core.own_dispatcher
            services.own(
                self._node.create_service_server(name, type_name, answer, executor=executor)
            )

    def _loggers(self) -> dict[str, logging.Logger]:
        own = {logger.name: logger for logger in self._logger.family()}
        library = {
            name: known
            for name, known in sorted(logging.Logger.manager.loggerDict.items())
            if name.partition(".")[0] == _LIBRARY and isinstance(known, logging.Logger)
        }
        return own | library

    def _list_loggers(self, _: Message) -> dict[str, Any]:
        return {
            "loggers": [
                {"name": name, "level": _name_of(logger.getEffectiveLevel())}
                for name, logger in self._loggers().items()
            ]
        }

    def _set_level(self, request: Message) -> dict[str, Any]:
        known = self._loggers()
        level = _LEVELS.get(request.level.lower())
        if level is None:
            raise ServiceError(f"no level {request.level!r}; one of {', '.join(_LEVELS)}")
        logger = known.get(request.logger) if request.logger else self._logger
        if logger is None:
            raise ServiceError(f"no logger {request.logger!r}; one of {', '.join(known)}")
        logger.setLevel(level)
        return {}


def _name_of(level: int) -> str:
    """Return the name of the most severe level that is not above `level`."""
    return next((n for n, least in reversed(_LEVELS.items()) if level >= least), "debug")


def _level_of(number: int) -> int:
    """Return the most severe level of ``rosgraph_msgs/Log`` that is not above `number`."""
    return next((ros for least, ros in _LOG_LEVELS if number >= least), _DEBUG)
