"""The seam between every world (ROS 1, DDS, Zenoh) and everything above it.

A world implements :class:`Node`, :class:`Publisher` and :class:`Subscription`; nothing above this
package knows which one it talks to.
"""

from __future__ import annotations

import sys
import time
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias, TypeVar

from rosglass.comm.graph import ConnectionState
from rosglass.comm.qos import QoS
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.errors import (
    ArgumentError,
    NodeClosedError,
    TimeoutError,  # noqa: A004 - the field's own word
    UnsupportedError,
)

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from concurrent.futures import Future
    from logging import Logger
    from types import FrameType, TracebackType

    from rosglass.comm.action_client import ActionClient
    from rosglass.comm.action_server import ActionServer, ServerGoal
    from rosglass.comm.clock import Clock, Timer
    from rosglass.comm.graph import EndpointInfo, NodeName, Status
    from rosglass.comm.lifecycle import LifecycleClient
    from rosglass.comm.parameters import ParameterClient, Parameters
    from rosglass.comm.promise import Promise
    from rosglass.comm.publisher import Publisher
    from rosglass.comm.sample import Sample
    from rosglass.comm.service_client import ServiceClient
    from rosglass.comm.service_server import ServiceServer
    from rosglass.comm.subscription import Subscription
    from rosglass.comm.time import Duration, Time
    from rosglass.messages import ActionType, Message, MessageType, ServiceType

__all__ = [
    "Answer",
    "Executor",
    "Handle",
    "Node",
    "Unique",
    "check_flag",
    "check_may_wait",
]


_H = TypeVar("_H", bound="Handle")
#: Seconds between two looks whether a node that spins is closed.
_SPIN_POLL_S = 0.2
#: Where the threads begin that receive.
_RECEIVING = ("rosglass.wires.dds.", "rosglass.wires.zenoh.", "rosglass.wires.tcpros.io_loop")
#: Where those begin that follow the graph and keep time; some of their jobs may wait for a moment.
_FOLLOWING = ("rosglass.comm.timers",)
#: What answers a request: a response, or the promise of one.
Answer: TypeAlias = (
    "Message | dict[str, Any] | Future[Message] | Future[dict[str, Any] | None] | None"
)
#: What a goal ends with.
Result: TypeAlias = "Message | dict[str, Any] | None"


class Unique:
    """Base of what cannot be copied: a copy would share threads and sockets, and close them."""

    def __reduce_ex__(self, _: object) -> NoReturn:
        # What copy.copy, copy.deepcopy and pickle ask for.
        raise UnsupportedError(
            f"{self!r} can neither be copied nor pickled: it lives in this process, and exists "
            "once; hand on the object itself, or create another one"
        )


class Executor(ABC):
    """Where callbacks run: a thread, an event loop, or at once in the middleware's thread."""

    @abstractmethod
    def post(self, job: Callable[[], None]) -> None:
        """Run `job` soon; called from any thread, returns without waiting."""


class Handle(Unique, ABC):
    """Something started or registered that can be ended; ends by itself as a context manager."""

    @abstractmethod
    def close(self) -> None:
        """End it; safe to call twice."""

    def __enter__(self: _H) -> _H:  # noqa: PYI019 - typing.Self needs 3.11
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


@hint_at_members
class Node(Handle):
    """A participant of a ROS graph; made by :func:`rosglass.connect`.

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

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.namespace.rstrip('/')}/{self.name} on {self.url}>"

    @abstractmethod
    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Announce `topic` and return its publisher.

        Args:
            topic: Absolute, relative or private (``~name``) topic name.
            type: Type name or type; an :class:`rosglass.messages.OpaqueType` to pass on bytes.
            qos: Profile; an integer is the depth of a reliable, volatile profile.

        Raises:
            InvalidNameError: The topic name breaks ROS's rules.
            TypeNotFoundError: No definition of the type is known.
        """

    @abstractmethod
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
            type: Type name or type; None takes the type that publishers announce, as soon as
                there is one.
            callback: Called with each message, on `executor`. Without callbacks, samples wait in
                the subscription until they are taken.
            qos: Profile; an integer is the depth of a reliable, volatile profile.
            raw_callback: Called with each :class:`Sample` instead: bytes, stamps, origin. Samples
                of a type that nobody can define have an :class:`rosglass.messages.OpaqueType`.
            executor: Where callbacks run; None for the node's own dispatcher thread.
            ignore_local: Whether to leave out what this node publishes itself.

        Raises:
            InvalidNameError: The topic name breaks ROS's rules.
            TypeNotFoundError: No definition of the given type is known.
        """

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
            type: Type name or type; None takes the type that publishers announce.
            timeout: Seconds to wait, None for ever.
            qos: Profile; None for the strongest that is available, so that a latched message comes
                at once.

        Raises:
            TimeoutError: None came within the time; says what stood in the way.
            NodeClosedError: The node is closed, or gets closed meanwhile.
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

    def create_service_client(
        self, name: str, type: str | ServiceType | None = None, qos: QoS | None = None
    ) -> ServiceClient:
        """Return a client of a service, whether it exists yet or not.

        Args:
            name: Absolute, relative or private service name.
            type: Type name or type; None takes the type that the server announces, as soon as it is
                there.
            qos: Profile of requests and replies; None for the usual one.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
            TypeNotFoundError: No definition of the given type is known.
        """
        raise self._unsupported("service clients")

    def create_service_server(
        self,
        name: str,
        type: str | ServiceType,
        callback: Callable[[Message], Answer | Awaitable[Answer]],
        qos: QoS | None = None,
        *,
        executor: Executor | None = None,
    ) -> ServiceServer:
        """Offer a service.

        Args:
            name: Absolute, relative or private service name.
            type: Type name or type.
            callback: Called with each request; returns the response as a message or a dict of
                fields (None for an empty or all-default one), or a
                :class:`concurrent.futures.Future` of it to answer later. An exception is logged
                and, where the world can say so, told to the caller. A coroutine function runs in
                the event loop in which the server is created.
            qos: Profile of requests and replies; None for the usual one.
            executor: Where `callback` runs; None for the node's own dispatcher thread.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
            TypeNotFoundError: No definition of the type is known.
        """
        raise self._unsupported("service servers")

    def create_action_client(self, name: str, type: str | ActionType | None = None) -> ActionClient:
        """Return a client of an action; arguments and errors as for a service client."""
        raise self._unsupported("action clients")

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
            execute: Called with each accepted goal, on a thread of the goal's own, or on
                `executor`. What it returns is the result of a goal that succeeded, or was
                cancelled when a request to cancel was accepted meanwhile; an exception aborts the
                goal. It may also return a :class:`concurrent.futures.Future` of the result, which
                lets the goal go on, or end the goal itself. A coroutine function runs in the event
                loop in which the server is created.
            accept: Told the goal; returns whether it is accepted. None accepts all.
            cancel: Told the goal; returns whether a request to cancel it is accepted. None
                accepts all, and so does a callback that fails.
            executor: Where `execute`, `accept` and `cancel` run; None for threads of the goals'
                own and, for the latter two, the node's dispatcher.

        Raises:
            InvalidNameError: The name breaks ROS's rules.
            TypeNotFoundError: No definition of the type is known.
        """
        raise self._unsupported("action servers")

    @property
    def parameters(self) -> Parameters:
        """This node's own parameters."""
        raise self._unsupported("parameters")

    def create_parameter_client(self, node: str | NodeName) -> ParameterClient:
        """Return a client of another node's parameters; `node` is its full name."""
        raise self._unsupported("parameters")

    def create_lifecycle_client(self, node: str | NodeName) -> LifecycleClient:
        """Return a client that drives a lifecycle node; `node` is its full name."""
        raise self._unsupported("lifecycle nodes")

    @property
    def logger(self) -> Logger:
        """The node's logger, whose messages other nodes can follow (``/rosout``), too."""
        raise self._unsupported("a logger")

    @property
    def clock(self) -> Clock:
        """The node's clock: the system's time, or that of a simulation."""
        raise self._unsupported("a clock")

    def create_timer(
        self,
        period: Duration | float,
        callback: Callable[[], None],
        *,
        executor: Executor | None = None,
    ) -> Timer:
        """Call `callback` again and again, by the node's clock.

        Args:
            period: Seconds, or a Duration, between two calls.
            callback: What to call. One that is still running or waiting when its time comes again
                misses that turn.
            executor: Where it runs; None for the node's own dispatcher thread.

        Raises:
            ConversionError: The period is not above zero.
            NodeClosedError: The node is closed.
        """
        return self.clock.create_timer(period, callback, executor)

    def services(self) -> dict[str, list[str]]:
        """Return every service in the graph with the types announced for it."""
        raise self._unsupported("a list of services")

    def actions(self) -> dict[str, list[str]]:
        """Return every action in the graph with the types announced for it."""
        raise self._unsupported("a list of actions")

    def unnamed_programs(self) -> int:
        """Return how many programs were found that have not said yet which nodes they have.

        Over DDS, nodes on Fast DDS do so up to four seconds after they were found; until then the
        graph is not complete. Over Zenoh it is 1 until the router has sent what it knows, which
        takes seconds with thousands of topics. Always 0 elsewhere.
        """
        return 0

    def invalid_names(self) -> list[str]:
        """Return what other nodes have announced, but is left out of the graph, sorted.

        These names break ROS's rules, so that nothing could be done with them; control characters
        in them are as they were sent.
        """
        return []

    def service_servers(self, name: str) -> list[EndpointInfo]:
        """Return the servers of a service."""
        raise self._unsupported("a list of services")

    def service_clients(self, name: str) -> list[EndpointInfo]:
        """Return the clients of a service."""
        raise self._unsupported("a list of services")

    def endpoints(self, node: str | NodeName) -> list[EndpointInfo]:
        """Return what a node publishes, subscribes, serves and calls; `node` is its full name."""
        raise self._unsupported("a list of endpoints")

    def fetch_type(
        self,
        name: str,
        *,
        hash: str = "",
        node: str | NodeName | None = None,
        timeout: float | None = 5.0,
    ) -> MessageType | ServiceType | ActionType:
        """Return a type in the version that the robot uses, asking the robot for it if need be.

        Subscriptions do so by themselves, without waiting. What is fetched is in the library
        afterwards, so that its name is enough for everything else.

        Args:
            name: ``pkg/msg/Type``, ``pkg/srv/Type``, ``pkg/action/Type``, or ``pkg/Type``.
            hash: RIHS01 hash (ROS 1: md5 sum) of the version, when the robot uses several.
            node: Full name of the node whose version it shall be.
            timeout: Seconds to wait in all, for somebody who uses the type to appear and for the
                answer; None for ever.

        Raises:
            InvalidNameError: `name` is no type's name, or `hash` no hash.
            TypeNotFoundError: Nobody uses or nobody sends it; says who was asked, and why not.
            DefinitionConflictError: Several versions are in use.
            NodeClosedError: The node is closed, or gets closed meanwhile.
            UnsupportedError: In this world nobody can be asked.
        """
        return self.fetch_type_async(name, hash=hash, node=node, timeout=timeout).result()

    def fetch_type_async(
        self,
        name: str,
        *,
        hash: str = "",
        node: str | NodeName | None = None,
        timeout: float | None = 5.0,
    ) -> Promise[MessageType | ServiceType | ActionType]:
        """Ask for a type as :meth:`fetch_type` does, and return at once.

        The promise can be waited for, awaited in asyncio, or call back.
        """
        raise self._unsupported("fetching types")

    def _unsupported(self, what: str) -> UnsupportedError:
        return UnsupportedError(f"{self!r} does not support {what}")

    @abstractmethod
    def topics(self) -> dict[str, list[str]]:
        """Return every topic in the graph with the types announced for it."""

    @abstractmethod
    def nodes(self) -> list[NodeName]:
        """Return every node in the graph, this one included, sorted."""

    def duplicate_nodes(self) -> dict[str, int]:
        """Return the full names that several nodes bear, and how many do.

        In ROS 1 none: the master ends the first node of a name when a second one registers.
        """
        return {}

    @abstractmethod
    def publishers(self, topic: str) -> list[EndpointInfo]:
        """Return the publishers of a topic."""

    @abstractmethod
    def subscriptions(self, topic: str) -> list[EndpointInfo]:
        """Return the subscriptions of a topic."""

    @abstractmethod
    def on_graph_change(
        self, callback: Callable[[], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` after nodes or endpoints appeared or went; changes may be merged."""

    @abstractmethod
    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""

    @abstractmethod
    def on_status_change(
        self, callback: Callable[[Status], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with the new status whenever it changes."""

    @abstractmethod
    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic or service; raises InvalidNameError."""

    @abstractmethod
    def now(self) -> Time:
        """Return the time of the node's clock."""

    def spin(self) -> None:
        """Wait until the node is closed, or until Ctrl-C, which closes it.

        For programs that have nothing else to do: callbacks run on threads of their own, and are
        called whether or not a program waits here.
        """
        check_may_wait(f"{self!r} is not closed")
        try:
            while self.status().state is not ConnectionState.CLOSED:
                time.sleep(_SPIN_POLL_S)
        except KeyboardInterrupt:
            self.close()

    def steady(self) -> float:
        """Return seconds by which the ages of messages are told; they never run back.

        None pass while a recording that is shown in a robot's place is paused.
        """
        return time.monotonic()


def check_flag(value: object, name: str, where: str = "") -> bool:
    """Return an option that is True or False; raises ArgumentError.

    Python takes any text for true, "no" and "false" included.
    """
    if value is not True and value is not False:
        raise ArgumentError(name, value, "True or False", where)
    return value


def check_may_wait(name: str, *, following: bool = False) -> None:
    """Raise UnsupportedError in a callback that runs in a thread that receives.

    Args:
        name: The service, action or topic that is about to be waited for.
        following: Whether threads that follow the graph and keep time may wait.
    """
    # Zenoh's threads are not Python's, and marking them would cost something with every sample.
    frame: FrameType | None = sys._getframe()
    first = ""
    while frame is not None:
        module = frame.f_globals.get("__name__", "")
        first = first if module == "threading" else module
        frame = frame.f_back
    if first.startswith(_RECEIVING if following else (*_RECEIVING, *_FOLLOWING)):
        raise UnsupportedError(
            f"{name}: this callback runs in a thread that receives (executor=IMMEDIATE, or "
            "add_done_callback()), where what it waits for could never arrive; take call_async(), "
            "get_async() or the like here, or let it run elsewhere: on_done(), or another executor"
        )
