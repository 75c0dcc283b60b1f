"""A ROS graph inside one process: nodes exchange bytes by function calls, without a network.

``rosglass.connect("local://NAME")`` joins it: for tests, for interfaces that are tried without a
robot, and between parts of one program. Nodes that give the same name see each other. What is sent
arrives in the thread that sends it.
"""

from __future__ import annotations

import itertools
import re
import threading
import time
import uuid
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rosglass.comm import ConnectionState, Durability, EndpointKind, Handle, History, Status
from rosglass.errors import ArgumentError, NodeClosedError
from rosglass.wires.base import (
    SERVER_LEFT,
    Middleware,
    OnReply,
    OnRequest,
    OnSample,
    Reader,
    Replier,
    Requester,
    RequestId,
    Writer,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from rosglass.comm import EndpointInfo, NodeName
    from rosglass.comm.graph import Graph

__all__ = ["LocalMiddleware"]

_NAME = re.compile(r"[A-Za-z0-9_.-]*")
_COUNTERPART = {
    EndpointKind.PUBLISHER: EndpointKind.SUBSCRIPTION,
    EndpointKind.SUBSCRIPTION: EndpointKind.PUBLISHER,
    EndpointKind.SERVICE_SERVER: EndpointKind.SERVICE_CLIENT,
    EndpointKind.SERVICE_CLIENT: EndpointKind.SERVICE_SERVER,
}
_Other = TypeVar("_Other", bound="_Endpoint[Any]")


class _Network:
    """What the nodes of one name share: their graphs, and their endpoints."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._graphs: tuple[Graph, ...] = ()
        self._nodes: dict[Hashable, NodeName] = {}
        self._endpoints: dict[tuple[EndpointKind, str, str], tuple[Any, ...]] = {}

    def join(self, graph: Graph) -> None:
        """Show a graph what is there, and what comes."""
        with self._lock:
            self._graphs += (graph,)
            nodes = dict(self._nodes)
            endpoints = [one for there in self._endpoints.values() for one in there]
        for key, node in nodes.items():
            graph.put_node(key, node)
        for endpoint in endpoints:
            graph.put_endpoint(endpoint.info.gid, endpoint.info)

    def leave(self, graph: Graph) -> None:
        """Show a graph nothing more."""
        with self._lock:
            self._graphs = tuple(other for other in self._graphs if other is not graph)

    def add_node(self, key: Hashable, node: NodeName) -> None:
        """Put a node into all graphs."""
        with self._lock:
            self._nodes[key] = node
            graphs = self._graphs
        for graph in graphs:
            graph.put_node(key, node)

    def remove_node(self, key: Hashable) -> None:
        """Remove a node from all graphs."""
        with self._lock:
            self._nodes.pop(key, None)
            graphs = self._graphs
        for graph in graphs:
            graph.remove(key)

    def add(self, endpoint: _Endpoint[Any]) -> tuple[Any, ...]:
        """Put an endpoint into all graphs; return its counterparts, which have not seen it."""
        info = endpoint.info
        with self._lock:
            there = self._endpoints.get((info.kind, info.name, info.type), ())
            if endpoint not in there:
                self._endpoints[info.kind, info.name, info.type] = (*there, endpoint)
            graphs = self._graphs
            others = self.counterparts(info)
        for graph in graphs:
            graph.put_endpoint(info.gid, info)
        return others

    def remove(self, endpoint: _Endpoint[Any]) -> tuple[Any, ...]:
        """Remove an endpoint from all graphs; return its counterparts."""
        info = endpoint.info
        place = info.kind, info.name, info.type
        with self._lock:
            there = self._endpoints.pop(place, ())
            left = tuple(one for one in there if one is not endpoint)
            if left:
                self._endpoints[place] = left
            graphs = self._graphs
            others = self.counterparts(info)
        for graph in graphs:
            graph.remove(info.gid)
        return others

    def counterparts(self, info: EndpointInfo) -> tuple[Any, ...]:
        """Return the endpoints that an endpoint of this topic or service talks to."""
        return self._endpoints.get((_COUNTERPART[info.kind], info.name, info.type), ())


class _Endpoint(Handle, Generic[_Other]):
    """What every endpoint has: its place in all graphs, until it is closed.

    Args:
        owner: What it is made by.
        info: What it is, without identity.

    Attributes:
        info: The same with identity.
        closed: Whether it is closed.
    """

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo) -> None:
        self.info = replace(info, gid=uuid.uuid4().bytes)
        self.closed = False
        self._owner, self._network = owner, owner.network
        self._lock = threading.Lock()

    def _open(self) -> None:
        self._owner.add(self)
        self.show()

    def show(self) -> None:
        """Join all graphs, and exchange data with the counterparts there; safe to call twice."""
        for other in self._network.add(self):
            self.link(other)
            other.link(self)

    def hide(self) -> None:
        """Leave all graphs until :meth:`show`; safe to call twice."""
        for other in self._network.remove(self):
            other.unlink(self)

    def link(self, other: _Other) -> None:
        """Take note of a counterpart that has come, or was there first."""

    def unlink(self, other: _Other) -> None:
        """Take note of a counterpart that has gone."""

    def close(self) -> None:
        """Leave all graphs; safe to call twice."""
        with self._lock:
            if self.closed:
                return
            self.closed = True
        self.hide()
        self._owner.remove(self)

    def _counterparts(self) -> tuple[_Other, ...]:
        return self._network.counterparts(self.info)

    def _check_open(self) -> None:
        if self.closed:
            raise NodeClosedError(f"the {self.info.kind.value} of {self.info.name} is closed")


class LocalWriter(_Endpoint["LocalReader"], Writer):
    """Hands the samples of a publisher to all readers of the topic."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo) -> None:
        super().__init__(owner, info)
        qos = info.qos
        self.gid = self.info.gid
        self._readers: tuple[LocalReader, ...] = ()
        self._numbers = itertools.count(1)
        self._keeps = qos.durability is Durability.TRANSIENT_LOCAL
        depth = None if qos.history is History.KEEP_ALL else qos.depth
        #: The last samples, for readers that come later, each with the time it expires at.
        self._kept: deque[tuple[float, tuple[Any, ...]]] = deque(maxlen=depth)
        lifespan = qos.lifespan
        self._lifespan_s = float("inf") if lifespan is None else lifespan.seconds
        self._open()

    def write(self, data: bytes | bytearray) -> None:
        """Send a payload; it has arrived when this returns."""
        received, sent = self._owner.stamp()
        with self._lock:
            self._check_open()
            number = next(self._numbers)
            sample = (bytes(data), received, sent, self.gid, number, self.info.type_hash)
            if self._keeps:
                self._kept.append((time.monotonic() + self._lifespan_s, sample))
            readers = self._readers
        for reader in readers:
            reader.take(sample)

    def link(self, other: LocalReader) -> None:
        """Send to a reader from now on, what was kept first."""
        # Under the lock, so that the reader gets every sample exactly once.
        with self._lock:
            if other in self._readers:
                return
            if self._owner.matches_qos and other.info.qos.conflicts(self.info.qos):
                return
            self._readers += (other,)
            late = other.info.qos.durability is Durability.TRANSIENT_LOCAL
            now = time.monotonic()
            kept = [sample for end, sample in self._kept if now < end] if late else []
            if kept:
                other.hold()
        if kept:
            other.catch_up(kept)

    def hide(self) -> None:
        """Leave all graphs, and send to no reader, until :meth:`show`."""
        super().hide()
        with self._lock:
            self._readers = ()

    def unlink(self, other: LocalReader) -> None:
        """Send to a reader no more."""
        with self._lock:
            self._readers = tuple(one for one in self._readers if one is not other)


class LocalReader(_Endpoint[LocalWriter], Reader):
    """Hands the samples of all writers of the topic to one subscription."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo, on_sample: OnSample) -> None:
        super().__init__(owner, info)
        self._on_sample = on_sample
        #: Samples that came while older ones are handed on, and how many writers' ones are.
        self._held: list[tuple[Any, ...]] = []
        self._holding = 0
        self._open()

    def take(self, sample: tuple[Any, ...]) -> None:
        """Hand on a sample, or let it wait for older ones."""
        if self._holding:
            with self._lock:
                if self._holding:
                    self._held.append(sample)
                    return
        if not self.closed:
            self._on_sample(*sample)

    def hold(self) -> None:
        """Let what comes wait until :meth:`catch_up` has handed on what was kept."""
        with self._lock:
            self._holding += 1

    def catch_up(self, kept: list[tuple[Any, ...]]) -> None:
        """Hand on what a writer has kept, then what came since."""
        while kept:
            for sample in kept:
                if not self.closed:
                    self._on_sample(*sample)
            with self._lock:
                kept, self._held = self._held, []
                if not kept:
                    self._holding -= 1


class LocalRequester(_Endpoint["LocalReplier"], Requester):
    """Sends the requests of a service client to all its servers."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo, on_reply: OnReply) -> None:
        super().__init__(owner, info)
        self._on_reply = on_reply
        #: The servers that may still answer, by the request's number.
        self._pending: dict[int, set[LocalReplier]] = {}
        self._open()

    def ready(self) -> bool:
        """Return whether there is a server."""
        return bool(self._counterparts())

    def send(self, number: int, data: bytes | bytearray, timeout: float | None) -> None:  # noqa: ARG002 - the caller keeps it
        """Send a request to all servers; the first reply counts."""
        servers = self._counterparts()
        with self._lock:
            self._check_open()
            self._pending[number] = set(servers)
        request = RequestId(self.info.gid, number, self)
        for server in servers:
            server.take(request, bytes(data))
        if not servers:
            self._fail(number, SERVER_LEFT)

    def forget(self, number: int) -> None:
        """Drop the reply to a request."""
        with self._lock:
            self._pending.pop(number, None)

    def take(self, number: int, data: bytes) -> None:
        """Hand on a reply, if it is the first one."""
        with self._lock:
            wanted = self._pending.pop(number, None) is not None and not self.closed
        if wanted:
            self._on_reply(number, data, "")

    def refuse(self, number: int, server: LocalReplier, reason: str) -> None:
        """Take note that a server will not answer a request."""
        with self._lock:
            servers = self._pending.get(number)
            if servers is None:
                return
            servers.discard(server)
        if not servers:
            self._fail(number, reason)

    def _fail(self, number: int, reason: str) -> None:
        with self._lock:
            wanted = self._pending.pop(number, None) is not None and not self.closed
        if wanted:
            self._on_reply(number, None, reason)

    def link(self, other: LocalReplier) -> None:  # noqa: ARG002 - any will do
        """Say that a server is there."""
        if self.changed is not None:
            self.changed()

    def unlink(self, other: LocalReplier) -> None:
        """Give up the requests that only this server had."""
        with self._lock:
            numbers = [number for number, servers in self._pending.items() if other in servers]
        for number in numbers:
            self.refuse(number, other, SERVER_LEFT)
        if self.changed is not None:
            self.changed()


class LocalReplier(_Endpoint[LocalRequester], Replier):
    """Hands the requests of all clients to a service server."""

    tells_failures = True

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo, on_request: OnRequest) -> None:
        super().__init__(owner, info)
        self._on_request = on_request
        self._open()

    def take(self, request: RequestId, data: bytes) -> None:
        """Hand on a request."""
        if self.closed:
            self.fail(request, SERVER_LEFT)
        else:
            self._on_request(request, data)

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Answer a request."""
        self._check_open()
        if isinstance(request.handle, LocalRequester):
            request.handle.take(request.sequence, bytes(data))

    def fail(self, request: RequestId, reason: str) -> None:
        """Tell the client that no response will come."""
        if isinstance(request.handle, LocalRequester):
            request.handle.refuse(request.sequence, self, reason)


class _Announcement(Handle):
    """A node's place in all graphs."""

    def __init__(self, network: _Network, node: NodeName) -> None:
        self._network, self._key = network, object()
        network.add_node(self._key, node)

    def close(self) -> None:
        """Leave all graphs; safe to call twice."""
        self._network.remove_node(self._key)


class LocalMiddleware(Middleware):
    """A node's place in a graph inside this process.

    Args:
        url: ``local://NAME``; the name may be empty.
        wire: Format of the payloads, ``cdr`` or ``ros1``.

    Attributes:
        network: What it shares with the other nodes of that name.

    Raises:
        ArgumentError: The URL has more than a name.
    """

    matches_qos = True

    def __init__(self, url: str, wire: str = "cdr") -> None:
        name = url.partition("://")[2].rstrip("/")
        if not _NAME.fullmatch(name):
            expected = "local://NAME with a name of letters, digits, '_', '-' and '.', no options"
            raise ArgumentError("url", url, expected)
        self._name, self.wire = name, wire
        self._lock = threading.Lock()
        self._ends: dict[Handle, None] = {}
        self._graph: Graph | None = None
        self._closed = False

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:  # noqa: ARG002 - it never does
        """Join the graph."""
        # Not sooner: a node whose name is refused is never opened, nor closed.
        with _networks_lock:
            self.network = networks.setdefault(self._name, _Network())
            _members[self._name] = _members.get(self._name, 0) + 1
        self._graph = graph
        self.network.join(graph)

    def status(self) -> Status:
        """Return that it is connected, until it is closed."""
        if self._closed:
            return Status(ConnectionState.CLOSED, "closed")
        return Status(ConnectionState.CONNECTED, "in this process")

    def stamp(self) -> tuple[int, int | None]:
        """Return when a sample that is sent now arrives, and when it was sent, if that is known.

        Both in nanoseconds since the Unix epoch.
        """
        now = time.time_ns()
        return now, now

    def announce(self, node: NodeName) -> Handle:
        """Show a node in the graph until the handle is closed."""
        made = _Announcement(self.network, node)
        self.add(made)
        return made

    def create_writer(self, endpoint: EndpointInfo) -> LocalWriter:
        """Announce a publisher and return its sending end."""
        return LocalWriter(self, endpoint)

    def create_reader(self, endpoint: EndpointInfo, on_sample: OnSample) -> LocalReader:
        """Announce a subscription and hand what arrives to `on_sample`."""
        return LocalReader(self, endpoint, on_sample)

    def create_requester(self, endpoint: EndpointInfo, on_reply: OnReply) -> LocalRequester:
        """Announce a service client and return its sending end."""
        return LocalRequester(self, endpoint, on_reply)

    def create_replier(self, endpoint: EndpointInfo, on_request: OnRequest) -> LocalReplier:
        """Announce a service server, whose requests `on_request` takes."""
        return LocalReplier(self, endpoint, on_request)

    def poll(self) -> None:
        """Do nothing: all is done as it happens."""

    def add(self, end: Handle) -> None:
        """Let something end with this; raises NodeClosedError after closing."""
        with self._lock:
            if self._closed:
                raise NodeClosedError(f"local://{self._name} is closed; connect again")
            self._ends[end] = None

    def remove(self, end: Handle) -> None:
        """Forget something that was closed."""
        with self._lock:
            self._ends.pop(end, None)

    def close(self) -> None:
        """Leave the graph; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            ends = list(self._ends)
        for end in ends:
            end.close()
        if self._graph is None:
            return
        self.network.leave(self._graph)
        with _networks_lock:
            _members[self._name] -= 1
            if not _members[self._name]:
                del _members[self._name], networks[self._name]


#: The graphs of this process by name, and how many nodes each has.
networks: dict[str, _Network] = {}
_members: dict[str, int] = {}
_networks_lock = threading.Lock()
