"""A world without a network: nodes in this process that exchange bytes by function calls."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass import load
from rosglass.comm import (
    ConnectionState,
    Dispatcher,
    EndpointInfo,
    EndpointKind,
    Executor,
    Handle,
    Listeners,
    Matched,
    Node,
    NodeName,
    Publisher,
    PublisherEvents,
    QoS,
    Sample,
    Status,
    Subscription,
    Time,
)
from rosglass.comm.names import expand
from rosglass.comm.qos import Durability
from rosglass.errors import NodeClosedError, TypeNotFoundError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.messages import Message, MessageType


class MemoryWorld:
    """The graph that all its nodes share."""

    def __init__(self) -> None:
        self.publishers: list[MemoryPublisher] = []
        self.subscriptions: list[Subscription] = []
        self.nodes: list[MemoryNode] = []
        self.missing: set[str] = set()
        self.sequence = 0

    def connect(
        self,
        url: str | None,
        name: str,
        namespace: str = "/",
        arguments: tuple[str, ...] = (),
    ) -> MemoryNode:
        node = MemoryNode(self, url or "memory://", name, namespace)
        self.nodes.append(node)
        return node

    def changed(self) -> None:
        for publisher in list(self.publishers):
            publisher.look()
        for node in self.nodes:
            node.graph_listeners.notify(None)

    def find(self, name: str) -> MessageType:
        if name in self.missing:
            raise TypeNotFoundError(f"no definition of {name}")
        return load(name, ros=2)


class MemoryPublisher(Publisher):
    problem = hint = ""
    dropped = 0

    def __init__(self, node: MemoryNode, topic: str, type: MessageType, qos: QoS) -> None:
        self.node, self.topic, self.type, self.qos = node, topic, type, qos
        self.kept: list[bytes] = []
        self.closed = False
        #: For how many nanoseconds the network holds back what is sent.
        self.held_back = 0
        self._events = PublisherEvents(node.dispatcher, self.look, topic)
        node.world.publishers.append(self)
        node.world.changed()

    def publish(self, message: Message | dict[str, Any] | None = None, /, **fields: Any) -> None:
        self.publish_serialized(self.type.encode(fields if message is None else message))

    def publish_serialized(self, data: bytes | bytearray | memoryview) -> None:
        if self.closed:
            raise NodeClosedError("closed")
        world = self.node.world
        world.sequence += 1
        if self.qos.durability is Durability.TRANSIENT_LOCAL:
            self.kept = [*self.kept, bytes(data)][-self.qos.depth :]
        for subscription in list(world.subscriptions):
            if subscription.topic == self.topic:
                self.send(subscription, bytes(data), world.sequence)

    def send(self, subscription: Subscription, data: bytes, sequence: int) -> None:
        if subscription.type is None:
            subscription._type = self.type
        now = Time.now().nanoseconds
        sent = now - self.held_back
        subscription._inbox.put(Sample(data, "cdr", self.type, now, sent, b"me", sequence))

    def look(self) -> None:
        """Tell who listens to the topic."""
        there = [
            EndpointInfo(
                EndpointKind.SUBSCRIPTION, self.topic, "", NodeName("/", "x"), gid=b"%d" % id(one)
            )
            for one in self.node.world.subscriptions
            if one.topic == self.topic
        ]
        self._events.matched.update(there, Matched)

    def subscription_count(self) -> int:
        return sum(s.topic == self.topic for s in self.node.world.subscriptions)

    def close(self) -> None:
        if not self.closed:
            self.closed = True
            self.node.world.publishers.remove(self)
            self.node.world.changed()


class MemoryNode(Node):
    wire = "cdr"

    def __init__(self, world: MemoryWorld, url: str, name: str, namespace: str) -> None:
        self.world, self.url, self.name, self.namespace = world, url, name, namespace
        self.graph_listeners: Listeners[None] = Listeners()
        self.status_listeners: Listeners[Status] = Listeners()
        self.dispatcher = Dispatcher(name)
        self.closed = False
        self.state = Status(ConnectionState.CONNECTED, f"connected to {url}")

    def set_status(self, state: ConnectionState, detail: str = "") -> None:
        self.state = Status(state, detail)
        self.status_listeners.notify(self.state)

    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> MemoryPublisher:
        kind = self.world.find(type) if isinstance(type, str) else type
        profile = qos if isinstance(qos, QoS) else QoS(depth=qos)
        return MemoryPublisher(self, self.resolve(topic), kind, profile)

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
        subscription = Subscription(
            self.resolve(topic),
            self.world.find(type) if isinstance(type, str) else type,
            qos if isinstance(qos, QoS) else QoS(depth=qos),
            executor or self.dispatcher,
            callback,
            raw_callback,
        )

        def leave() -> None:
            self.world.subscriptions.remove(subscription)
            self.world.changed()

        subscription._on_close = leave
        self.world.subscriptions.append(subscription)
        self.world.changed()
        latched = subscription.qos.durability is Durability.TRANSIENT_LOCAL
        for publisher in self.world.publishers:
            if latched and publisher.topic == subscription.topic:
                for data in publisher.kept[-subscription.qos.depth :]:
                    publisher.send(subscription, data, 0)
        return subscription

    def topics(self) -> dict[str, list[str]]:
        found: dict[str, list[str]] = {}
        for publisher in self.world.publishers:
            types = found.setdefault(publisher.topic, [])
            if publisher.type.name not in types:
                types.append(publisher.type.name)
        return found

    def nodes(self) -> list[NodeName]:
        return sorted(NodeName(n.namespace, n.name) for n in self.world.nodes)

    def publishers(self, topic: str) -> list[EndpointInfo]:
        return [
            EndpointInfo(
                EndpointKind.PUBLISHER, p.topic, p.type.name, NodeName("/", p.node.name), p.qos
            )
            for p in self.world.publishers
            if p.topic == topic
        ]

    def subscriptions(self, topic: str) -> list[EndpointInfo]:
        return [
            EndpointInfo(EndpointKind.SUBSCRIPTION, topic, "", NodeName("/", "x"), s.qos)
            for s in self.world.subscriptions
            if s.topic == topic
        ]

    def on_graph_change(
        self, callback: Callable[[], None], executor: Executor | None = None
    ) -> Handle:
        return self.graph_listeners.add(lambda _: callback(), executor or self.dispatcher)

    def status(self) -> Status:
        return self.state

    def on_status_change(
        self, callback: Callable[[Status], None], executor: Executor | None = None
    ) -> Handle:
        return self.status_listeners.add(callback, executor or self.dispatcher)

    def resolve(self, name: str) -> str:
        return expand(name, self.name, self.namespace)

    def now(self) -> Time:
        return Time.now()

    def close(self) -> None:
        if not self.closed:
            self.closed = True
            self.world.nodes.remove(self)
            for publisher in [p for p in self.world.publishers if p.node is self]:
                publisher.close()
            self.dispatcher.close()
