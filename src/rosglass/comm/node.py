"""A node: everything that :func:`rosglass.connect` offers, for ROS 1 and ROS 2 alike."""

from __future__ import annotations

import time
from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from rosglass.comm.executor import check_plain
from rosglass.comm.graph import ConnectionState, EndpointKind, NodeName, Status
from rosglass.comm.handle import Handle, check_flag, check_may_wait
from rosglass.comm.publisher import Publisher
from rosglass.comm.qos import QoS, check_profile
from rosglass.comm.rclpy_names import check_order, hint_at_members
from rosglass.comm.subscription import Subscription, find_subscribed_type
from rosglass.errors import (
    NodeClosedError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from rosglass.comm.action_client import ActionClient
    from rosglass.comm.action_server import ActionServer, Result, ServerGoal
    from rosglass.comm.builtin_services import BuiltinServices
    from rosglass.comm.clock import Clock, Timer
    from rosglass.comm.core import NodeCore
    from rosglass.comm.graph import EndpointInfo
    from rosglass.comm.handle import Executor
    from rosglass.comm.inbox import Sample
    from rosglass.comm.lifecycle import LifecycleClient
    from rosglass.comm.log import NodeLogger
    from rosglass.comm.parameters import ParameterClient, Parameters
    from rosglass.comm.promise import Deadline, Promise
    from rosglass.comm.service_client import ServiceClient
    from rosglass.comm.service_server import Answer, ServiceServer
    from rosglass.comm.time import Duration, Time
    from rosglass.messages import ActionType, Message, MessageType, ServiceType

__all__ = ["Node", "RemoteNodeClient"]

#: Pause between two checks whether a node that spins is closed.
_SPIN_POLL_S = 0.2


@hint_at_members
class Node(Handle):
    """A participant of a ROS graph; created by :func:`rosglass.connect`.

    Attributes:
        url: The URL it was connected with.
        name: Base name.
        namespace: Absolute namespace, ``/`` for the root.
        wire: Wire format of its messages, ``cdr`` or ``ros1``.
    """

    url: str
    name: str
    namespace: str
    wire: str
    _core: NodeCore
    _builtin_services: BuiltinServices[Any]

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.namespace.rstrip('/')}/{self.name} on {self.url}>"

    # -- topics ----------------------------------------------------------------------------------

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Announce `topic` and return its publisher.

        Args:
            topic: Absolute, relative or private (``~name``) topic name.
            type: Type name or type; an :class:`rosglass.messages.OpaqueType` to forward bytes.
            qos: Profile; an integer is the depth of a reliable, volatile profile.

        Raises:
            InvalidNameError: The topic name breaks ROS's rules.
            TypeNotFoundError: No definition of the type is known.
        """
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
        """Subscribe to `topic`.

        Args:
            topic: Absolute, relative or private topic name.
            type: Type name or type; None uses the type that publishers announce, as soon as one
                does.
            callback: Called with each message, on `executor`. Without callbacks, samples wait in
                the subscription until they are taken.
            qos: Profile; an integer is the depth of a reliable, volatile profile.
            raw_callback: Called with each :class:`Sample` instead: bytes, stamps, origin. Samples
                of a type without a definition have an :class:`rosglass.messages.OpaqueType`.
            executor: Runs callbacks; None for the node's own dispatcher thread.
            ignore_local: Whether to ignore messages that this node itself publishes.

        Raises:
            InvalidNameError: The topic name breaks ROS's rules.
            TypeNotFoundError: No definition of the given type is known.
        """
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
        """Connect a new subscription to its publishers."""

    def _profile(self, qos: QoS | int, place: str) -> QoS:
        """Return the profile that the user gave; errors as for :func:`check_profile`."""
        return check_profile(qos, place)

    def wait_for_message(
        self,
        topic: str,
        type: str | MessageType | None = None,
        timeout: float | None = None,
        qos: QoS | int | None = None,
    ) -> Message:
        """Subscribe to `topic`, wait for one message and return it.

        Args:
            topic: Absolute, relative or private topic name.
            type: Type name or type; None uses the type that publishers announce.
            timeout: Seconds to wait; None waits forever.
            qos: Profile; None for the strongest that is available, so that a latched message is
                received at once.

        Raises:
            TimeoutError: No message arrived in time; the message gives the reason.
            NodeClosedError: The node is closed, or is closed while waiting.
            InvalidNameError: The topic name breaks ROS's rules.
            TypeNotFoundError: No definition of the type is known.
        """
        wanted = QoS.best_available() if qos is None else qos
        with self.create_subscription(topic, type, qos=wanted) as subscription:
            sample = subscription.wait(timeout)
            if sample is not None:
                return sample.message()
            if subscription.closed:
                raise NodeClosedError(f"{self!r} was closed while waiting for {topic}")
            why = subscription.problem or subscription.hint or "it is published, but nothing came"
            raise TimeoutError(f"{subscription.topic}: no message within {timeout:g} s: {why}")

    # -- services and actions --------------------------------------------------------------------

    @abstractmethod
    def create_service_client(
        self, name: str, type: str | ServiceType | None = None, qos: QoS | None = None
    ) -> ServiceClient:
        """Return a client of a service, which need not exist yet.

        Args:
            name: Absolute, relative or private service name.
            type: Type name or type; None uses the type that the server announces, as soon as it is
                available.
            qos: Profile of requests and replies; None for ROS's default for services.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
            TypeNotFoundError: No definition of the given type is known.
        """

    @abstractmethod
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
        """Offer a service.

        Args:
            name: Absolute, relative or private service name.
            type: Type name or type.
            callback: Called with each request; returns the response as a message or a dict of
                fields (None for an empty or all-default one), or a
                :class:`concurrent.futures.Future` of it to answer later. An exception is logged
                and, where the wire supports it, reported to the caller. A coroutine function runs
                in the event loop in which the server is created.
            qos: Profile of requests and replies; None for ROS's default for services.
            executor: Runs `callback`; None for the node's own dispatcher thread.
            answers_failures: Whether a client that the wire cannot report an exception to
                receives a response with all defaults, instead of waiting for ever.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
            TypeNotFoundError: No definition of the type is known.
        """

    @abstractmethod
    def create_action_client(self, name: str, type: str | ActionType | None = None) -> ActionClient:
        """Return a client of an action; arguments and errors as for a service client."""

    @abstractmethod
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
        """Offer an action.

        Args:
            name: Absolute, relative or private action name.
            type: Type name or type.
            execute: Called with each accepted goal, on a thread per goal, or on `executor`. It
                returns the result of a goal that succeeded, or that was cancelled if a request to
                cancel was accepted; an exception aborts the goal. It may also return a
                :class:`concurrent.futures.Future` of the result, which keeps the goal executing,
                or end the goal itself. A coroutine function runs in the event loop in which the
                server is created.
            accept: Receives the goal and returns True to accept it. None accepts all goals.
            cancel: Receives the goal and returns True to accept the request to cancel it. None
                accepts all requests, and so does a callback that fails.
            executor: Runs `execute`, `accept` and `cancel`; None for a thread per goal and, for the
                latter two, the node's dispatcher.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
            TypeNotFoundError: No definition of the type is known.
        """

    # -- parameters ------------------------------------------------------------------------------

    @property
    @abstractmethod
    def parameters(self) -> Parameters:
        """This node's own parameters."""

    @abstractmethod
    def create_parameter_client(self, node: str | NodeName) -> ParameterClient:
        """Return a client of another node's parameters; `node` is its full name."""

    def create_lifecycle_client(self, node: str | NodeName) -> LifecycleClient:
        """Return a client that drives a lifecycle node; `node` is its full name.

        Raises:
            UnsupportedError: ROS 1 has no lifecycle nodes.
        """
        raise UnsupportedError(f"{self!r} does not support lifecycle nodes: ROS 1 has none")

    # -- the log and time ------------------------------------------------------------------------

    @property
    def logger(self) -> NodeLogger:
        """The node's logger, which also publishes to ``/rosout``."""
        return self._builtin_services.log.logger

    @property
    def clock(self) -> Clock:
        """The node's clock, which follows ``/clock`` if ``use_sim_time`` is set."""
        return self._core.clock

    @property
    def has_simulated_stamps(self) -> bool:
        """True if messages may have stamps of a simulation, which say nothing about delays.

        The node's own clock is simulated, or ``/clock`` is published for the clocks of others.
        """
        return self._core.has_simulated_stamps

    def now(self) -> Time:
        """Return the time of the node's clock."""
        return self._core.clock.now()

    #: Returns a monotonic time in seconds, which measures the ages of messages. It stands still
    #: while a recording that replaces a robot is paused.
    steady: Callable[[], float] = staticmethod(time.monotonic)

    def create_timer(
        self,
        period: Duration | float,
        callback: Callable[[], None],
        *,
        executor: Executor | None = None,
    ) -> Timer:
        """Call `callback` periodically, by the node's clock.

        Args:
            period: Seconds, or a Duration, between two calls.
            callback: Called without arguments. Ticks are skipped while a call is still waiting or
                running.
            executor: Runs `callback`; None for the node's own dispatcher thread.

        Raises:
            ArgumentError: The period is not above zero.
            NodeClosedError: The node is closed.
        """
        return self.clock.create_timer(period, callback, executor)

    # -- types -----------------------------------------------------------------------------------

    def fetch_type(
        self,
        name: str,
        *,
        hash: str = "",
        node: str | NodeName | None = None,
        timeout: float | None = 5.0,
    ) -> MessageType | ServiceType | ActionType:
        """Return a type in the version that the robot uses, requesting it from the robot if needed.

        Subscriptions do so themselves, without waiting. A fetched type is added to the library, so
        that its name suffices everywhere else.

        Args:
            name: ``pkg/msg/Type``, ``pkg/srv/Type``, ``pkg/action/Type``, or ``pkg/Type``.
            hash: RIHS01 hash (ROS 1: md5 sum) of the version, if the robot uses several.
            node: Full name of the node whose version is wanted.
            timeout: Total seconds to wait, for an endpoint that uses the type to appear and for the
                answer; None waits forever.

        Raises:
            InvalidNameError: `name` is not a type name, or `hash` not a hash.
            TypeNotFoundError: No endpoint uses the type, or none sends it; the message lists the
                queried nodes and their failures.
            DefinitionConflictError: Several versions are in use.
            NodeClosedError: The node is closed, or is closed while waiting.
        """
        return self.fetch_type_async(name, hash=hash, node=node, timeout=timeout).result()

    @abstractmethod
    def fetch_type_async(
        self,
        name: str,
        *,
        hash: str = "",
        node: str | NodeName | None = None,
        timeout: float | None = 5.0,
    ) -> Promise[MessageType | ServiceType | ActionType]:
        """Request a type as :meth:`fetch_type` does, and return at once.

        The promise can be waited for, awaited in asyncio, or given a callback.
        """

    # -- the graph -------------------------------------------------------------------------------

    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic or service; raises InvalidNameError."""
        return self._core.resolve(name)

    def topics(self) -> dict[str, list[str]]:
        """Return every topic in the graph with its announced types."""
        return self._core.graph.topics()

    @abstractmethod
    def services(self) -> dict[str, list[str]]:
        """Return every service in the graph with its announced types."""

    @abstractmethod
    def actions(self) -> dict[str, list[str]]:
        """Return every action in the graph with its announced types."""

    def nodes(self) -> list[NodeName]:
        """Return every node in the graph, this one included, sorted."""
        return self._core.graph.nodes()

    def duplicate_nodes(self) -> dict[str, int]:
        """Return the full names that several nodes share, and how many.

        None in ROS 1: the master shuts a node down when a second one registers its name.
        """
        return {}

    def unnamed_programs(self) -> int:
        """Return the number of discovered programs that have not announced their nodes yet.

        Over DDS, nodes on Fast DDS announce them up to four seconds after discovery; until then the
        graph is not complete. Over Zenoh it is 1 until the router has sent its graph, which takes
        seconds with thousands of topics, and while the router is lost. Always 0 elsewhere.
        """
        return 0

    def invalid_names(self) -> list[str]:
        """Return the announced names that are left out of the graph, sorted.

        They break ROS's rules, so that they could not be used; they are unchanged, including
        control characters.
        """
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
        """Return the endpoints of a node, given by its full name; none if it is unknown."""
        namespace, _, name = self._node_name(node).rpartition("/")
        return self._core.graph.endpoints_of(NodeName(namespace or "/", name))

    def on_graph_change(
        self, callback: Callable[[], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` after nodes or endpoints appeared or left; changes may be merged."""
        self._core.check_open()
        check_plain(callback, "on_graph_change()")
        return self._core.graph_listeners.add(
            lambda _: callback(), executor or self._core.dispatcher
        )

    def _node_name(self, node: str | NodeName) -> str:
        """Return a node's full name; raises InvalidNameError."""
        return node.full if isinstance(node, NodeName) else self._core.expand(node)

    # -- the connection and its end --------------------------------------------------------------

    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""
        return self._core.status()

    def on_status_change(
        self, callback: Callable[[Status], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with the new status whenever it changes."""
        self._core.check_open()
        return self._core.status_listeners.add(callback, executor or self._core.dispatcher)

    def spin(self) -> None:
        """Wait until the node is closed, or until Ctrl-C, which closes it.

        For programs that have nothing else to do: callbacks run on their own threads, whether or
        not the program waits here.
        """
        check_may_wait(f"{self!r} is not closed")
        try:
            while self.status().state is not ConnectionState.CLOSED:
                time.sleep(_SPIN_POLL_S)
        except KeyboardInterrupt:
            self.close()

    def close(self) -> None:
        """Leave the graph, close everything created from the node and end its threads.

        Safe to call twice, from any thread and from callbacks.
        """
        self._core.close()


class RemoteNodeClient(Handle):
    """Clients of another node's built-in services, and subscriptions to its events.

    Args:
        owner: The node that the clients belong to.
        node: Full name of the other node.
        services: Types of the services by name, relative to the node.
        first: The service whose server shows that the node is available. Its client is created at
            once, so that it finds the server before the first call.
        qos: The services' profile; None for the default.
    """

    def __init__(
        self,
        owner: Node,
        node: str,
        services: Mapping[str, str],
        first: str,
        qos: QoS | None = None,
    ) -> None:
        self.node = node
        self._owner, self._services, self._qos = owner, services, qos
        #: Every use is atomic; additions while another thread closes this are closed at once.
        self._clients: dict[str, ServiceClient] = {}
        self._subscriptions: dict[Subscription, None] = {}
        self._closed = False
        self._first = first
        self._client(first)

    @property
    def ready(self) -> bool:
        """True while the node is available and has the services."""
        return not self._closed and self._client(self._first).ready

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait up to `timeout` seconds (None: forever) for the node; return whether it is ready."""
        return self._client(self._first).wait_for_server(timeout)

    def close(self) -> None:
        """End all calls, with NodeClosedError, and all subscriptions; safe to call twice."""
        self._closed = True
        clients, self._clients = self._clients, {}
        subscriptions, self._subscriptions = self._subscriptions, {}
        for handle in (*clients.values(), *subscriptions):
            handle.close()

    def _check_open(self) -> None:
        if self._closed:
            raise NodeClosedError(f"{self!r} is closed; create another one")

    def _client(self, service: str) -> ServiceClient:
        self._check_open()
        client = self._clients.get(service)
        if client is None:
            name = f"{self.node}/{service}"
            made = self._owner.create_service_client(name, self._services[service], self._qos)
            client = self._clients.setdefault(service, made)
            if client is not made:  # another thread was faster
                made.close()
            if self._closed:
                client.close()
                self._check_open()
        return client

    def _call(self, service: str, request: dict[str, Any], deadline: Deadline) -> Message:
        return self._client(service).call(request, timeout=deadline.left())

    def _subscribe(
        self,
        topic: str,
        type: str,
        callback: Callable[[Message], None],
        qos: QoS | int,
        executor: Executor | None,
    ) -> Handle:
        """Subscribe to the node's events until the handle, or this client, is closed."""
        subscription = self._owner.create_subscription(
            topic, type, callback, qos, executor=executor
        )
        self._subscriptions[subscription] = None
        for other in list(self._subscriptions):
            if other.closed:
                self._subscriptions.pop(other, None)
        if self._closed:
            subscription.close()
            self._check_open()
        return subscription
