"""Nodes on ``local://`` whose wire a test steers: what it hands on, and who is in the graph."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import ConnectionState, EndpointInfo, EndpointKind, NodeName, QoS, Status
from rosglass.wires.local import (
    LocalMiddleware,
    LocalReader,
    LocalReplier,
    LocalRequester,
    LocalWriter,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import Handle
    from rosglass.comm.graph import Graph
    from rosglass.comm.wire import OnRequest, OnSample, PendingCall, RequestId

SERVER, CLIENT = EndpointKind.SERVICE_SERVER, EndpointKind.SERVICE_CLIENT


class SteeredWriter(LocalWriter):
    """`written` has what was sent, `matched` whom the node says it is for."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo) -> None:
        self.written: list[bytes] = []
        self.matched: list[EndpointInfo] = []
        super().__init__(owner, info)

    def write(self, data: bytes | bytearray) -> None:
        super().write(data)
        self.written.append(bytes(data))

    def match(self, subscriptions: Sequence[EndpointInfo]) -> None:
        self.matched = list(subscriptions)


class SteeredReader(LocalReader):
    """`receive` hands on samples by hand, `waiting` ones come when the node asks for them."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo, on_sample: OnSample) -> None:
        self.on_sample, self.count = on_sample, 0
        self.eager, self.waiting = True, list[bytes]()
        self.missing, self.living = 0, None
        super().__init__(owner, info, on_sample)

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
        announced = self.info.type_hash if hash is None else hash
        self.on_sample(data, time.time_ns(), time.time_ns(), gid, self.count, announced)


class SteeredRequester(LocalRequester):
    """`sent` has what was sent; `reply` answers by hand, the first that was sent as number 1."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo) -> None:
        #: Whether a server is linked; None for as the graph says.
        self.linked: bool | None = None
        self.sent: list[bytes] = []
        self.timeouts: list[float | None] = []
        self.forgotten: list[int] = []
        self._numbers: list[int] = []
        #: Requests whose server left, even if another one serves now.
        self.abandoned: set[int] = set()
        super().__init__(owner, info)

    def ready(self) -> bool:
        return super().ready() if self.linked is None else self.linked

    def send(self, pending: PendingCall, data: bytes | bytearray) -> None:
        self._numbers.append(pending.number)
        super().send(pending, data)
        self.sent.append(bytes(data))
        self.timeouts.append(pending.left())

    def _fail(self, number: int, reason: str) -> None:
        if self.linked is None:  # else the test answers
            super()._fail(number, reason)

    def is_reply_lost(self, pending: PendingCall) -> bool:
        return self._numbers.index(pending.number) + 1 in self.abandoned

    def forget(self, pending: PendingCall) -> None:
        self.forgotten.append(self._numbers.index(pending.number) + 1)
        super().forget(pending)

    def reply(self, count: int, data: bytes | None, error: str = "") -> None:
        """Hand over a reply to a request that was sent, as if it had been received."""
        pending = self._take(self._numbers[count - 1]) if count <= len(self._numbers) else None
        if self.closed or pending is None:
            return
        if data is None:
            pending.fail(error)
        else:
            pending.answer(data)


class SteeredReplier(LocalReplier):
    """`replies` and `failures` have what was answered."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo, on_request: OnRequest) -> None:
        self.on_request = on_request
        self.replies: list[tuple[RequestId, bytes]] = []
        self.failures: list[tuple[RequestId, str]] = []
        super().__init__(owner, info, on_request)

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        super().reply(request, data)
        self.replies.append((request, bytes(data)))

    def fail(self, request: RequestId, reason: str) -> None:
        self.failures.append((request, reason))
        super().fail(request, reason)


class SteeredMiddleware(LocalMiddleware):
    """A place in a local graph that keeps what the node has made of it, for tests to steer."""

    def __init__(self, url: str) -> None:
        super().__init__(url)
        #: The status to return; None for the real one.
        self.state: Status | None = None
        self.readers: list[SteeredReader] = []
        self.writers: list[SteeredWriter] = []
        self.requesters: list[SteeredRequester] = []
        self.repliers: list[SteeredReplier] = []
        self.announced: list[NodeName] = []
        self.closed = 0
        self.graph: Graph
        self.changed: Callable[[], None]

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        self.graph, self.changed = graph, changed
        super().open(graph, changed)

    def status(self) -> Status:
        return self.state or super().status()

    def become(self, state: ConnectionState, detail: str = "") -> None:
        """Change the status of the connection."""
        self.state = Status(state, detail)
        self.changed()

    def announce(self, node: NodeName) -> Handle:
        self.announced.append(node)
        return super().announce(node)

    def create_writer(self, endpoint: EndpointInfo) -> SteeredWriter:
        self.writers.append(SteeredWriter(self, endpoint))
        return self.writers[-1]

    def create_reader(self, endpoint: EndpointInfo, on_sample: OnSample) -> SteeredReader:
        self.readers.append(SteeredReader(self, endpoint, on_sample))
        return self.readers[-1]

    def create_requester(self, endpoint: EndpointInfo) -> SteeredRequester:
        self.requesters.append(SteeredRequester(self, endpoint))
        return self.requesters[-1]

    def create_replier(self, endpoint: EndpointInfo, on_request: OnRequest) -> SteeredReplier:
        self.repliers.append(SteeredReplier(self, endpoint, on_request))
        return self.repliers[-1]

    def close(self) -> None:
        self.closed += 1
        self.state = None
        super().close()

    def appear(
        self,
        kind: EndpointKind,
        topic: str,
        type_name: str,
        type_hash: str = "",
        qos: QoS | None = None,
        node: str = "robot",
        gid: bytes = b"",
    ) -> Any:
        """Show this node an endpoint that nothing stands behind; returns its key in the graph."""
        info = EndpointInfo(
            kind, topic, type_name, NodeName("/", node), qos or QoS(), type_hash, gid
        )
        key = f"{kind}{topic}{type_name}{type_hash}{node}"
        self.graph.put_endpoint(key, info)
        return key
