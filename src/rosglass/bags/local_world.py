"""A graph inside one program: nodes that hand each other bytes by calling functions."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    Clock,
    ConnectionState,
    Dispatcher,
    Durability,
    EndpointInfo,
    EndpointKind,
    Executor,
    Handle,
    Listeners,
    Node,
    NodeName,
    Publisher,
    PublisherEvents,
    QoS,
    Sample,
    Source,
    Status,
    Subscription,
    Time,
    Timers,
)
from rosglass.comm.executor import check_plain
from rosglass.comm.log import NodeLogger, show_on_terminal
from rosglass.comm.names import expand, similar
from rosglass.comm.rclpy_names import check_order
from rosglass.errors import ConversionError, NodeClosedError, UnsupportedError
from rosglass.interfaces.names import join_name
from rosglass.messages import Message, MessageType, OpaqueType, load

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

__all__ = ["LocalNode", "LocalPublisher", "LocalWorld", "SilentPublisher"]


class LocalWorld:
    """What its nodes share: publishers, subscriptions, the time.

    Attributes:
        wire: Wire format of the messages, ``cdr`` or ``ros1``.
        ros: The ROS whose formats these are, 1 or 2.
        clock: The time, which is that of the topic ``/clock``.
    """

    def __init__(self, wire: str) -> None:
        self.wire, self.ros = wire, 1 if wire == "ros1" else 2
        self.dispatcher = Dispatcher("local callbacks")
        self.timers = Timers("local timers")
        self.clock = Clock("local", self.dispatcher, self.timers)
        self.clock.simulate(True)
        #: When a message that is sent now arrives, in nanoseconds since the Unix epoch.
        self.arrival: Callable[[], int] = lambda: self.clock.now().nanoseconds
        self.graph_listeners: Listeners[None] = Listeners(merge=True)
        self._lock = threading.Lock()
        self._publishers: list[LocalPublisher] = []
        self._subscriptions: list[tuple[LocalNode, Subscription]] = []
        #: Topics that are handed on; None for all.
        self._only: frozenset[str] | None = None

    def find(self, name: str) -> MessageType:
        """Return a type by its name, as a publisher here has it or else by its definition.

        Raises:
            TypeNotFoundError: No definition is known.
            InvalidNameError: It is no type's name.
        """
        full = join_name(name)
        for publisher in self.publishers():
            if publisher.type.name == full:
                return publisher.type
        found = load(full, ros=self.ros)
        if not isinstance(found, MessageType):
            raise ConversionError("type", name, "a message type such as std_msgs/msg/String")
        return found

    def publishers(self, topic: str | None = None) -> list[LocalPublisher]:
        """Return the publishers, of one topic if it is given."""
        with self._lock:
            return [
                p
                for p in self._publishers
                if topic in (None, p.topic) and (self._only is None or p.topic in self._only)
            ]

    def subscriptions(self, topic: str) -> list[tuple[LocalNode, Subscription]]:
        """Return the subscriptions of a topic, with the nodes that made them."""
        with self._lock:
            return [pair for pair in self._subscriptions if pair[1].topic == topic]

    def choose(self, topics: Iterable[str]) -> None:
        """Hand on these topics only; all when there are none."""
        chosen = frozenset(topics)
        with self._lock:
            self._only = chosen or None
        self.changed()

    def add_publisher(self, publisher: LocalPublisher) -> None:
        """Let a publisher be seen."""
        with self._lock:
            self._publishers.append(publisher)
        self.changed()

    def remove_publisher(self, publisher: LocalPublisher) -> None:
        """Forget a publisher that was closed."""
        with self._lock:
            self._publishers.remove(publisher)
        self.changed()

    def add_subscription(self, node: LocalNode, subscription: Subscription) -> None:
        """Let a subscription receive, what was latched first."""
        pair = (node, subscription)
        with self._lock:
            self._subscriptions.append(pair)
            kept = [
                sample
                for publisher in self._publishers
                if publisher.topic == subscription.topic
                and (self._only is None or publisher.topic in self._only)
                for sample in publisher.kept
            ]

        def end() -> None:
            with self._lock:
                self._subscriptions.remove(pair)
            self.changed()

        subscription._on_close = end
        if self.ros == 1 or subscription.qos.durability is Durability.TRANSIENT_LOCAL:
            for sample in kept[-subscription.qos.depth :]:
                _hand_on(sample, subscription)
        self.changed()

    def send(self, publisher: LocalPublisher, sample: Sample) -> None:
        """Hand a sample to everyone who subscribed."""
        topic = publisher.topic
        with self._lock:
            if publisher.qos.durability is Durability.TRANSIENT_LOCAL:
                publisher.kept = [*publisher.kept, sample][-publisher.qos.depth :]
            if self._only is not None and topic not in self._only and topic != "/clock":
                return
            told = [s for _, s in self._subscriptions if s.topic == topic]
        if topic == "/clock":
            self.clock.advance(Time(sample.message().clock.nanoseconds))
        for subscription in told:
            _hand_on(sample, subscription)

    def changed(self) -> None:
        """Tell that endpoints appeared or went."""
        self.graph_listeners.notify(None)

    def close(self) -> None:
        """End the threads; safe to call twice."""
        with self._lock:
            open_ones = [subscription for _, subscription in self._subscriptions]
        for subscription in open_ones:
            subscription.close()
        self.graph_listeners.clear()
        self.clock.close()
        self.timers.close()
        self.dispatcher.close()


class SilentPublisher(Publisher):
    """A publisher without news of subscriptions: it has no writer."""

    _problem = ""

    @property
    def dropped(self) -> int:
        """None: a recording waits for no subscriber."""
        return 0

    @property
    def hint(self) -> str:
        """Nothing."""
        return ""

    @property
    def _events(self) -> PublisherEvents:  # type: ignore[override]
        raise UnsupportedError(f"{self!r} tells nothing of itself: it belongs to a recording")

    def assert_liveliness(self) -> None:
        """Refuse: nobody would see it."""
        raise UnsupportedError(f"{self!r} cannot show that it is alive")


class LocalPublisher(SilentPublisher):
    """Hands messages to the subscriptions of its world."""

    def __init__(self, world: LocalWorld, node: LocalNode, topic: str, kind: MessageType, qos: QoS):
        self.world, self.node, self.topic, self.type = world, node, topic, kind
        self.qos = qos.for_publisher()
        self.kept: list[Sample] = []
        self._closed = False
        self._sequence = 0
        world.add_publisher(self)

    def publish(self, message: Message | dict[str, Any] | None = None, /, **fields: Any) -> None:
        """Send a message."""
        self.publish_serialized(self.type.encode(fields if message is None else message))

    def publish_serialized(self, data: bytes | bytearray | memoryview | Sample) -> None:
        """Send what is encoded already."""
        if self._closed:
            raise NodeClosedError(f"the publisher of {self.topic} is closed")
        self._sequence += 1
        held = data.data if isinstance(data, Sample) else data
        held = bytes(held) if isinstance(held, bytearray) else held
        world = self.world
        sample = Sample(held, world.wire, self.type, world.arrival(), None, b"", self._sequence)
        world.send(self, sample)

    def subscription_count(self) -> int:
        """Return how many subscriptions there are."""
        return len(self.world.subscriptions(self.topic))

    def close(self) -> None:
        """Send no more; safe to call twice."""
        if not self._closed:
            self._closed = True
            self.world.remove_publisher(self)


class _LocalSource(Source):
    """What a subscription asks of its world."""

    def __init__(self, world: LocalWorld, topic: str) -> None:
        self._world, self._topic = world, topic

    def publisher_count(self) -> int:
        return len(self._world.publishers(self._topic))

    def hint(self) -> str:
        known = {p.topic for p in self._world.publishers()}
        return "" if self._topic in known else similar(self._topic, sorted(known))


class LocalNode(Node):
    """A node of a :class:`LocalWorld`.

    Args:
        world: The world.
        url: What it was connected with.
        name: Base name.
        namespace: Absolute namespace.
    """

    def __init__(self, world: LocalWorld, url: str, name: str, namespace: str = "/") -> None:
        self.world, self.url, self.name, self.namespace = world, url, name, namespace
        self.wire = world.wire
        self._status = Status(ConnectionState.CONNECTED)
        self._status_listeners: Listeners[Status] = Listeners()
        self._closed = False
        self._logger = NodeLogger(name, logging.getLogger())
        self._logger.setLevel(logging.INFO)
        show_on_terminal(self._logger)

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Announce a topic; arguments and errors as for every node."""
        self._check_open()
        check_order("create_publisher", topic, type)
        kind = self.world.find(type) if isinstance(type, str) else type
        return LocalPublisher(self.world, self, self.resolve(topic), kind, _profile(qos))

    def create_subscription(
        self,
        topic: str,
        type: str | MessageType | None = None,
        callback: Callable[[Message], None] | None = None,
        qos: QoS | int = 10,
        *,
        raw_callback: Callable[[Sample], None] | None = None,
        executor: Executor | None = None,
        ignore_local: bool = False,  # noqa: ARG002 - nothing that it publishes itself comes back
    ) -> Subscription:
        """Subscribe to a topic; arguments and errors as for every node."""
        self._check_open()
        check_order("create_subscription", topic, type)
        name = self.resolve(topic)
        sources = self.world.publishers(name)
        kind = self.world.find(type) if isinstance(type, str) else type
        if kind is None and sources:
            kind = sources[0].type
        profile = _profile(qos).for_subscription([p.qos for p in sources])
        subscription = Subscription(
            name, kind, profile, executor or self.world.dispatcher, callback, raw_callback
        )
        subscription._source = _LocalSource(self.world, name)
        self.world.add_subscription(self, subscription)
        return subscription

    def topics(self) -> dict[str, list[str]]:
        """Return every topic with its types."""
        found: dict[str, list[str]] = {}
        for publisher in self.world.publishers():
            types = found.setdefault(publisher.topic, [])
            if publisher.type.name not in types:
                types.append(publisher.type.name)
        return found

    def services(self) -> dict[str, list[str]]:
        """Return nothing: there are none."""
        return {}

    def actions(self) -> dict[str, list[str]]:
        """Return nothing: there are none."""
        return {}

    def service_servers(self, name: str) -> list[EndpointInfo]:  # noqa: ARG002 - there are none
        """Return nothing: there are none."""
        return []

    def service_clients(self, name: str) -> list[EndpointInfo]:  # noqa: ARG002 - there are none
        """Return nothing: there are none."""
        return []

    def nodes(self) -> list[NodeName]:
        """Return the nodes that publish, and this one."""
        names = {NodeName(p.node.namespace, p.node.name) for p in self.world.publishers()}
        return sorted({*names, NodeName(self.namespace, self.name)})

    def publishers(self, topic: str) -> list[EndpointInfo]:
        """Return the publishers of a topic."""
        name = self.resolve(topic)
        return [
            EndpointInfo(
                EndpointKind.PUBLISHER,
                p.topic,
                p.type.name,
                NodeName(p.node.namespace, p.node.name),
                p.qos,
            )
            for p in self.world.publishers(name)
        ]

    def subscriptions(self, topic: str) -> list[EndpointInfo]:
        """Return the subscriptions of a topic."""
        return [
            EndpointInfo(
                EndpointKind.SUBSCRIPTION,
                s.topic,
                s.type.name if s.type is not None else "",
                NodeName(node.namespace, node.name),
                s.qos,
            )
            for node, s in self.world.subscriptions(self.resolve(topic))
        ]

    def on_graph_change(
        self, callback: Callable[[], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` after endpoints appeared or went."""
        check_plain(callback, "on_graph_change()")
        listeners = self.world.graph_listeners
        return listeners.add(lambda _: callback(), executor or self.world.dispatcher)

    def status(self) -> Status:
        """Return the state of the connection."""
        return self._status

    def on_status_change(
        self, callback: Callable[[Status], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with the new status whenever it changes."""
        return self._status_listeners.add(callback, executor or self.world.dispatcher)

    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic."""
        return expand(name, self.name, self.namespace)

    @property
    def clock(self) -> Clock:
        """The world's clock."""
        return self.world.clock

    @property
    def logger(self) -> NodeLogger:
        """The node's logger; its messages stay in this process."""
        return self._logger

    def now(self) -> Time:
        """Return the world's time."""
        return self.world.clock.now()

    def close(self) -> None:
        """Leave the world; safe to call twice."""
        self._closed = True
        self._status = Status(ConnectionState.CLOSED)

    def _check_open(self) -> None:
        if self._closed:
            raise NodeClosedError(f"node {self.name} is closed; connect again")


def _profile(qos: QoS | int) -> QoS:
    return qos if isinstance(qos, QoS) else QoS(depth=qos)


def _hand_on(sample: Sample, subscription: Subscription) -> None:
    wanted, kind = subscription.type, sample.type
    if wanted is None:
        subscription._type = kind
    elif wanted.name != kind.name:
        subscription._set_problem(f"this is {kind.name} here, not {wanted.name}")
        return
    if subscription._decodes and isinstance(kind, OpaqueType):
        subscription._set_problem(kind.reason)
        return
    subscription._inbox.put(sample)
