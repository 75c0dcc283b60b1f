"""A middleware without network, and nodes on it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm import ConnectionState, EndpointInfo, EndpointKind, Handle, NodeName, QoS, Status
from rosglass.errors import NodeClosedError
from rosglass.ros2 import Graph, Middleware, Ros2Node, Writer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


class FakeWriter(Writer):
    def __init__(self, *what: Any) -> None:
        self.what, self.written, self.matched, self.closed = what, [], [], False

    def write(self, data: bytes | bytearray) -> None:
        if self.closed:
            raise NodeClosedError("closed")
        self.written.append(bytes(data))

    def match(self, subscriptions: Any) -> None:
        self.matched = list(subscriptions)

    def close(self) -> None:
        self.closed = True


class FakeReader(Handle):
    def __init__(self, topic: str, type_name: str, type_hash: str, on_sample: Any) -> None:
        self.topic, self.type_name, self.type_hash = topic, type_name, type_hash
        self.on_sample, self.closed, self.count = on_sample, False, 0

    def receive(self, data: bytes, hash: str | None = None, gid: bytes = b"g" * 16) -> None:
        """Hand over a sample as if it had been received."""
        self.count += 1
        announced = self.type_hash if hash is None else hash
        self.on_sample(data, time.time_ns(), time.time_ns(), gid, self.count, announced)

    def close(self) -> None:
        self.closed = True


class FakeMiddleware(Middleware):
    matches_qos = False

    def __init__(self) -> None:
        self.state = Status(ConnectionState.CONNECTING, "no answer")
        self.readers: list[FakeReader] = []
        self.writers: list[FakeWriter] = []
        self.announced: list[NodeName] = []
        self.closed = 0
        self.graph: Graph
        self.changed: Callable[[], None]

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        self.graph, self.changed = graph, changed

    def status(self) -> Status:
        return self.state

    def become(self, state: ConnectionState, detail: str = "") -> None:
        self.state = Status(state, detail)
        self.changed()

    def announce(self, node: NodeName) -> Handle:
        self.announced.append(node)
        self.graph.put_node("own", node)
        return FakeReader("", "", "", None)

    def create_writer(
        self, node: NodeName, topic: str, type_name: str, type_hash: str, qos: QoS
    ) -> Writer:
        writer = FakeWriter(topic, type_name, type_hash, qos)
        self.writers.append(writer)
        return writer

    def create_reader(
        self,
        node: NodeName,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: QoS,
        on_sample: Any,
    ) -> Handle:
        reader = FakeReader(topic, type_name, type_hash, on_sample)
        self.readers.append(reader)
        return reader

    def poll(self) -> None:
        pass

    def close(self) -> None:
        self.closed += 1
        self.state = Status(ConnectionState.CLOSED, "closed")

    def appear(
        self,
        kind: EndpointKind,
        topic: str,
        type_name: str,
        type_hash: str = "",
        qos: QoS | None = None,
        node: str = "robot",
    ) -> str:
        """Let an endpoint appear in the graph; returns its key."""
        info = EndpointInfo(kind, topic, type_name, NodeName("/", node), qos or QoS(), type_hash)
        key = f"{kind}{topic}{type_name}{type_hash}{node}"
        self.graph.put_endpoint(key, info)
        return key


@pytest.fixture
def middleware() -> FakeMiddleware:
    return FakeMiddleware()


@pytest.fixture
def node(middleware: FakeMiddleware) -> Iterator[Ros2Node]:
    made = Ros2Node(middleware, "fake://", "cockpit", "/arm")
    yield made
    made.close()


@pytest.fixture
def eventually() -> Callable[[Callable[[], Any]], Any]:
    """Return the first true value of a condition; fails after 5 s."""

    def eventually(condition: Callable[[], Any]) -> Any:
        deadline = time.monotonic() + 5
        while not (value := condition()):
            assert time.monotonic() < deadline, "the condition did not come true within 5 s"
            time.sleep(0.002)
        return value

    return eventually
