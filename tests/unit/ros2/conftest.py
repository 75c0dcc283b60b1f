"""A middleware without network, and nodes on it."""

from __future__ import annotations

import itertools
import queue
import threading
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm import ConnectionState, EndpointInfo, EndpointKind, Handle, NodeName, QoS, Status
from rosglass.errors import NodeClosedError
from rosglass.ros2 import Graph, Middleware, Ros2Node, Writer
from rosglass.wires.base import Reader, Replier, Requester, RequestId

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SERVER, CLIENT = EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT
_gids = itertools.count(1)


def _identified(endpoint: EndpointInfo) -> EndpointInfo:
    return replace(endpoint, gid=next(_gids).to_bytes(16, "big"))


class FakeNetwork:
    """Links the middlewares that share it: samples, requests and replies arrive on its thread.

    With `immediate`, they arrive in the thread that sends them, before sending returns.
    """

    def __init__(self, immediate: bool = False) -> None:
        self.immediate = immediate
        self.middlewares: list[FakeMiddleware] = []
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None

    def post(self, job: Callable[[], None]) -> None:
        if self.immediate:
            job()
            return
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="fake network", daemon=True)
            self._thread.start()
        self._jobs.put(job)

    def show(self, key: str, info: EndpointInfo) -> None:
        for middleware in self._opened():
            middleware.graph.put_endpoint(key, info)

    def hide(self, key: str) -> None:
        for middleware in self._opened():
            middleware.graph.remove(key)

    def _opened(self) -> list[FakeMiddleware]:
        return [middleware for middleware in self.middlewares if hasattr(middleware, "graph")]

    def close(self) -> None:
        if self._thread is not None:
            self._jobs.put(None)
            self._thread.join(5)

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            job()


class _FakeServiceEnd:
    """What a requester and a replier have in common: a place in every graph on the network."""

    def _appear(self, middleware: FakeMiddleware, info: EndpointInfo) -> None:
        self.middleware, self.info, self.closed = middleware, info, False
        self.key = f"{info.kind}{info.name}{info.gid.hex()}"
        middleware.network.show(self.key, info)

    def matches(self, other: _FakeServiceEnd) -> bool:
        ours, theirs = self.info, other.info
        return (ours.name, ours.type, ours.type_hash) == (
            theirs.name,
            theirs.type,
            theirs.type_hash,
        )

    def close(self) -> None:
        if not self.closed:
            self.closed = True
            self.middleware.network.hide(self.key)


class FakeRequester(_FakeServiceEnd, Requester):
    """`sent` has what was sent; `reply` answers by hand."""

    def __init__(self, middleware: FakeMiddleware, info: EndpointInfo, on_reply: Any) -> None:
        self.on_reply, self.sent, self.forgotten, self.linked = on_reply, [], [], None
        self.timeouts: list[float | None] = []
        #: Requests whose servers left, whoever is there now.
        self.abandoned: set[int] = set()
        self._numbers = itertools.count(1)
        self._appear(middleware, info)

    def ready(self) -> bool:
        """Whether a server is linked; a test that sets `linked` decides itself."""
        return bool(self._servers()) if self.linked is None else self.linked

    def send(self, data: bytes | bytearray, timeout: float | None) -> int:
        if self.closed:
            raise NodeClosedError("closed")
        number = next(self._numbers)
        self.sent.append(bytes(data))
        self.timeouts.append(timeout)
        request = RequestId(self.info.gid, number, self)
        for server in self._servers():
            self.middleware.network.post(lambda s=server: s.receive(request, bytes(data)))
        return number

    def stranded(self, number: int) -> bool:
        return number in self.abandoned

    def forget(self, number: int) -> None:
        self.forgotten.append(number)

    def reply(self, number: int, data: bytes | None, error: str = "") -> None:
        """Hand over a reply as if it had been received."""
        if not self.closed:
            self.on_reply(number, data, error)

    def _servers(self) -> list[FakeReplier]:
        repliers = [r for m in self.middleware.network.middlewares for r in m.repliers]
        return [r for r in repliers if not r.closed and self.matches(r)]


class FakeReplier(_FakeServiceEnd, Replier):
    """`replies` and `failures` have what was answered."""

    def __init__(self, middleware: FakeMiddleware, info: EndpointInfo, on_request: Any) -> None:
        self.on_request, self.replies, self.failures = on_request, [], []
        self._appear(middleware, info)

    def receive(self, request: RequestId, data: bytes) -> None:
        """Hand over a request as if it had been received."""
        if not self.closed:
            self.on_request(request, data)

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        if self.closed:
            raise NodeClosedError("closed")
        self.replies.append((request, bytes(data)))
        self._answer(request, bytes(data), "")

    def fail(self, request: RequestId, reason: str) -> None:
        self.failures.append((request, reason))
        self._answer(request, None, reason)

    def _answer(self, request: RequestId, data: bytes | None, error: str) -> None:
        client = request.handle
        if isinstance(client, FakeRequester):
            post = self.middleware.network.post
            post(lambda: client.reply(request.sequence, data, error))


class FakeWriter(Writer):
    def __init__(self, middleware: FakeMiddleware, *what: Any) -> None:
        self.middleware = middleware
        self.what, self.written, self.matched, self.closed = what, [], [], False

    def write(self, data: bytes | bytearray) -> None:
        if self.closed:
            raise NodeClosedError("closed")
        self.written.append(bytes(data))
        topic, type_name = self.what[:2]
        network = self.middleware.network
        for other in network.middlewares:
            for reader in other.readers:
                if (reader.topic, reader.type_name, reader.closed) == (topic, type_name, False):
                    network.post(lambda r=reader: r.receive(bytes(data), self.what[2]))

    def match(self, subscriptions: Any) -> None:
        self.matched = list(subscriptions)

    def close(self) -> None:
        self.closed = True


class FakeReader(Reader):
    """`waiting` samples are handed on when somebody asks for them."""

    def __init__(
        self, topic: str, type_name: str, type_hash: str, on_sample: Any, qos: QoS | None = None
    ) -> None:
        self.topic, self.type_name, self.type_hash = topic, type_name, type_hash
        self.on_sample, self.closed, self.count, self.qos = on_sample, False, 0, qos
        self.eager, self.waiting = True, []
        self.missing, self.living = 0, None

    def set_eager(self, eager: bool) -> None:
        self.eager = eager

    def flush(self) -> None:
        waiting, self.waiting = self.waiting, []
        for data in waiting:
            self.receive(data)

    def lost(self) -> int:
        return self.missing

    def alive(self) -> int | None:
        return self.living

    def receive(self, data: bytes, hash: str | None = None, gid: bytes = b"g" * 16) -> None:
        """Hand over a sample as if it had been received."""
        self.count += 1
        announced = self.type_hash if hash is None else hash
        self.on_sample(data, time.time_ns(), time.time_ns(), gid, self.count, announced)

    def close(self) -> None:
        self.closed = True


class FakeMiddleware(Middleware):
    matches_qos = False

    def __init__(self, network: FakeNetwork | None = None) -> None:
        self.network = network or FakeNetwork()
        self.network.middlewares.append(self)
        #: What is in the graph from the start.
        self.known: list[tuple[str, EndpointInfo]] = []
        self.requesters: list[FakeRequester] = []
        self.repliers: list[FakeReplier] = []
        self.state = Status(ConnectionState.CONNECTING, "no answer")
        self.readers: list[FakeReader] = []
        self.writers: list[FakeWriter] = []
        self.announced: list[NodeName] = []
        self.closed = 0
        self.graph: Graph
        self.changed: Callable[[], None]

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        self.graph, self.changed = graph, changed
        for key, info in self.known:
            graph.put_endpoint(key, info)

    def status(self) -> Status:
        return self.state

    def become(self, state: ConnectionState, detail: str = "") -> None:
        self.state = Status(state, detail)
        self.changed()

    def announce(self, node: NodeName) -> Handle:
        self.announced.append(node)
        self.graph.put_node("own", node)
        return FakeReader("", "", "", None)

    def create_writer(self, endpoint: EndpointInfo) -> Writer:
        writer = FakeWriter(self, endpoint.name, endpoint.type, endpoint.type_hash, endpoint.qos)
        self.writers.append(writer)
        return writer

    def create_reader(self, endpoint: EndpointInfo, on_sample: Any) -> Handle:
        name, kind = endpoint.name, endpoint.type
        reader = FakeReader(name, kind, endpoint.type_hash, on_sample, endpoint.qos)
        self.readers.append(reader)
        return reader

    def create_requester(self, endpoint: EndpointInfo, on_reply: Any) -> Requester:
        self.requesters.append(FakeRequester(self, _identified(endpoint), on_reply))
        return self.requesters[-1]

    def create_replier(self, endpoint: EndpointInfo, on_request: Any) -> Replier:
        self.repliers.append(FakeReplier(self, _identified(endpoint), on_request))
        return self.repliers[-1]

    def poll(self) -> None:
        pass

    def close(self) -> None:
        for end in (*self.requesters, *self.repliers):
            end.close()
        if self in self.network.middlewares:
            self.network.middlewares.remove(self)
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
        gid: bytes = b"",
    ) -> str:
        """Let an endpoint appear in the graph; returns its key."""
        info = EndpointInfo(
            kind, topic, type_name, NodeName("/", node), qos or QoS(), type_hash, gid
        )
        key = f"{kind}{topic}{type_name}{type_hash}{node}"
        self.graph.put_endpoint(key, info)
        return key


@pytest.fixture
def network() -> Iterator[FakeNetwork]:
    made = FakeNetwork()
    yield made
    made.close()


@pytest.fixture
def middleware(network: FakeNetwork) -> FakeMiddleware:
    return FakeMiddleware(network)


@pytest.fixture
def connect(network: FakeNetwork) -> Iterator[Callable[..., Ros2Node]]:
    """Connect another node to the network; ``connect(name).fake`` is its middleware."""
    made: list[Ros2Node] = []

    def connect(name: str, namespace: str = "/") -> Ros2Node:
        middleware = FakeMiddleware(network)
        for other in network.middlewares[:-1]:
            ends = (*other.requesters, *other.repliers)
            middleware.known += [(end.key, end.info) for end in ends if not end.closed]
        node = Ros2Node(middleware, "fake://", name, namespace)
        node.fake = middleware
        made.append(node)
        return node

    yield connect
    for node in made:
        node.close()


@pytest.fixture
def robot(connect: Callable[..., Ros2Node]) -> Ros2Node:
    """Another node."""
    return connect("robot")


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look ten times a second for what has no event."""
    monkeypatch.setattr("rosglass.comm.core._POLL", 0.1)


@pytest.fixture
def node(middleware: FakeMiddleware) -> Iterator[Ros2Node]:
    made = Ros2Node(middleware, "fake://", "cockpit", "/arm")
    yield made
    made.close()


@pytest.fixture
def eventually() -> Callable[[Callable[[], Any]], Any]:
    """Return the first true value of a condition; fails after 30 s."""

    def eventually(condition: Callable[[], Any]) -> Any:
        deadline = time.monotonic() + 30
        while not (value := condition()):
            assert time.monotonic() < deadline, "the condition did not come true within 30 s"
            time.sleep(0.002)
        return value

    return eventually
