"""A ROS graph inside one process: nodes exchange bytes by function calls, without a network.

``rosglass.connect("local://NAME")`` joins it: for tests, to try an interface without a robot, and
between parts of one program. Nodes with the same NAME see each other. Samples, requests and replies
are delivered in the thread that sends them.
"""

from __future__ import annotations

import itertools
import re
import threading
import time
import uuid
from abc import abstractmethod
from collections import deque
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from rosglass.comm import ConnectionState, Durability, EndpointKind, Handle, History, Status
from rosglass.comm.wire import (
    SERVER_LEFT,
    Middleware,
    OnRequest,
    OnSample,
    PendingCall,
    Reader,
    Replier,
    Requester,
    RequestId,
    Writer,
)
from rosglass.errors import ArgumentError, NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from rosglass.comm import EndpointInfo, NodeName
    from rosglass.comm.graph import Graph

    _Call = Callable[[], None]

__all__ = ["LocalMiddleware"]

_NAME = re.compile(r"[A-Za-z0-9_.-]*")
_COUNTERPART = {
    EndpointKind.PUBLISHER: EndpointKind.SUBSCRIPTION,
    EndpointKind.SUBSCRIPTION: EndpointKind.PUBLISHER,
    EndpointKind.SERVICE_SERVER: EndpointKind.SERVICE_CLIENT,
    EndpointKind.SERVICE_CLIENT: EndpointKind.SERVICE_SERVER,
}
_Other = TypeVar("_Other", bound="_Endpoint[Any]")
#: The arguments of :class:`OnSample`.
_Sample: TypeAlias = tuple[bytes, int, int | None, bytes, int, str]


class _Network:
    """The graph of the nodes that share a name.

    Attributes:
        lock: Guards the graph and the state of its endpoints; held while the nodes' graphs are
            updated, so that they see changes in order, but never while a sample, request or reply
            is delivered.
    """

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self._graphs: list[Graph] = []
        self._members: dict[Hashable, _Member] = {}
        self._endpoints: dict[tuple[EndpointKind, str, str], tuple[Any, ...]] = {}

    def join(self, graph: Graph) -> None:
        """Start updating a node's graph."""
        with self.lock:
            self._graphs.append(graph)
            for member in self._members.values():
                member.put_into(graph)

    def leave(self, graph: Graph) -> None:
        """Stop updating a node's graph."""
        with self.lock:
            self._graphs = [other for other in self._graphs if other is not graph]

    def add(self, member: _Member) -> None:
        """Add a node or endpoint to all graphs; the lock is held."""
        self._members[member.key] = member
        for graph in self._graphs:
            member.put_into(graph)

    def remove(self, member: _Member) -> None:
        """Remove a node or endpoint from all graphs; the lock is held."""
        if self._members.pop(member.key, None) is not None:
            for graph in self._graphs:
                graph.remove(member.key)

    def add_endpoint(self, endpoint: _Endpoint[Any]) -> tuple[Any, ...]:
        """Add an endpoint that can receive; return its counterparts. The lock is held."""
        info = endpoint.info
        place = info.kind, info.name, info.type
        known = self._endpoints.get(place, ())
        if endpoint not in known:
            self._endpoints[place] = (*known, endpoint)
        return self.counterparts(info)

    def remove_endpoint(self, endpoint: _Endpoint[Any]) -> tuple[Any, ...]:
        """Remove an endpoint; return its counterparts. The lock is held."""
        info = endpoint.info
        place = info.kind, info.name, info.type
        left = tuple(one for one in self._endpoints.pop(place, ()) if one is not endpoint)
        if left:
            self._endpoints[place] = left
        return self.counterparts(info)

    def counterparts(self, info: EndpointInfo) -> tuple[Any, ...]:
        """Return the endpoints that communicate with an endpoint of this topic or service."""
        return self._endpoints.get((_COUNTERPART[info.kind], info.name, info.type), ())


class _Member(Handle):
    """A node or endpoint, which is in the graph until it is closed.

    Attributes:
        key: Its key in the nodes' graphs.
        closed: Whether it is closed; guarded by the network's lock.
    """

    key: Hashable

    def __init__(self, owner: LocalMiddleware) -> None:
        self.closed = False
        self._owner, self._network = owner, owner.network
        self._lock = owner.network.lock

    @abstractmethod
    def put_into(self, graph: Graph) -> None:
        """Add this to a node's graph."""

    def show(self) -> None:
        """Join the graph, unless this is closed; safe to call twice."""
        with self._lock:
            if not self.closed:
                self._network.add(self)

    def hide(self) -> None:
        """Leave the graph until :meth:`show`; safe to call twice."""
        with self._lock:
            self._network.remove(self)

    def close(self) -> None:
        """Leave the graph; safe to call twice."""
        with self._lock:
            if self.closed:
                return
            self.closed = True
        self.hide()
        self._owner.remove(self)


class _Announcement(_Member):
    """A node in the graph."""

    def __init__(self, owner: LocalMiddleware, node: NodeName) -> None:
        super().__init__(owner)
        self.key, self._node = object(), node

    def put_into(self, graph: Graph) -> None:
        graph.put_node(self.key, self._node)


class _Endpoint(_Member, Generic[_Other]):
    """An endpoint in the graph, linked with its counterparts.

    Args:
        owner: The middleware that creates it.
        info: Its description without identity.

    Attributes:
        info: Its description with identity.
    """

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo) -> None:
        super().__init__(owner)
        self.key = gid = uuid.uuid4().bytes
        self.info = replace(info, gid=gid)

    def _open(self) -> None:
        self._owner.add(self)
        self.show()

    def put_into(self, graph: Graph) -> None:
        graph.put_endpoint(self.key, self.info)

    def show(self) -> None:
        """Join the graph, and link with the counterparts; safe to call twice."""
        calls: list[_Call] = []
        with self._lock:
            if self.closed:
                return
            self._network.add(self)
            for other in self._network.add_endpoint(self):
                self.link(other, calls)
                other.link(self, calls)
        for call in calls:
            call()

    def hide(self) -> None:
        """Leave the graph until :meth:`show`; safe to call twice."""
        calls: list[_Call] = []
        with self._lock:
            self._network.remove(self)
            for other in self._network.remove_endpoint(self):
                self.unlink(other, calls)
                other.unlink(self, calls)
        for call in calls:
            call()

    def link(self, other: _Other, calls: list[_Call]) -> None:
        """Link with a counterpart; the lock is held.

        Args:
            other: The counterpart.
            calls: Receives the functions to call once the lock is released.
        """

    def unlink(self, other: _Other, calls: list[_Call]) -> None:
        """Unlink a counterpart; the lock is held. Arguments as for :meth:`link`."""

    def _check_open(self) -> None:
        if self.closed:
            raise NodeClosedError(f"the {self.info.kind.value} of {self.info.name} is closed")


class LocalWriter(_Endpoint["LocalReader"], Writer):
    """Sends the samples of a publisher to all readers of the topic."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo) -> None:
        super().__init__(owner, info)
        qos = info.qos
        self.gid = self.info.gid
        self._readers: tuple[LocalReader, ...] = ()
        self._numbers = itertools.count(1)
        self._keeps = qos.durability is Durability.TRANSIENT_LOCAL
        depth = None if qos.history is History.KEEP_ALL else qos.depth
        #: The last samples, for late readers, each with its monotonic time of expiry.
        self._kept: deque[tuple[float, _Sample]] = deque(maxlen=depth)
        lifespan = qos.lifespan
        self._lifespan_s = float("inf") if lifespan is None else lifespan.seconds
        self._open()

    def write(self, data: bytes | bytearray) -> None:
        """Send a payload; it is delivered when this returns."""
        received, sent = self._owner.stamp()
        with self._lock:
            self._check_open()
            number = next(self._numbers)
            sample = (bytes(data), received, sent, self.gid, number, self.info.type_hash)
            if self._keeps:
                self._kept.append((time.monotonic() + self._lifespan_s, sample))
            readers = self._readers
        for reader in readers:
            reader.deliver(sample)

    def link(self, other: LocalReader, calls: list[_Call]) -> None:
        """Start sending to a reader: the kept samples first, and each exactly once."""
        if other in self._readers:
            return
        if self._owner.matches_qos and other.info.qos.conflicts(self.info.qos):
            return
        self._readers += (other,)
        if other.info.qos.durability is Durability.TRANSIENT_LOCAL:
            now = time.monotonic()
            kept = [sample for expiry, sample in self._kept if now < expiry]
            if other.info.qos.history is History.KEEP_LAST:
                kept = kept[-other.info.qos.depth :]
            if kept and other.hold(self.gid, kept):
                calls.append(partial(other.catch_up, self.gid))

    def unlink(self, other: LocalReader, calls: list[_Call]) -> None:  # noqa: ARG002
        """Stop sending to a reader."""
        self._readers = tuple(one for one in self._readers if one is not other)


class LocalReader(_Endpoint[LocalWriter], Reader):
    """Delivers the samples of all writers of the topic to one subscription."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo, on_sample: OnSample) -> None:
        super().__init__(owner, info)
        self._on_sample = on_sample
        #: The samples that wait for older ones of their writer to be delivered, by its identity.
        self._held: dict[bytes, list[_Sample]] = {}
        self._open()

    def deliver(self, sample: _Sample) -> None:
        """Deliver a sample, after those that its writer has kept."""
        if self._held:
            with self._lock:
                held = self._held.get(sample[3])
                if held is not None:
                    held.append(sample)
                    return
        if not self.closed:
            self._on_sample(*sample)

    def hold(self, gid: bytes, kept: list[_Sample]) -> bool:
        """Hold samples of a writer; return whether :meth:`catch_up` is needed. The lock is held."""
        is_new = gid not in self._held
        self._held.setdefault(gid, []).extend(kept)
        return is_new

    def catch_up(self, gid: bytes) -> None:
        """Deliver the held samples of a writer, and those that arrive until they are delivered."""
        while True:
            with self._lock:
                held, self._held[gid] = self._held[gid], []
                if not held:
                    del self._held[gid]
                    return
            for sample in held:
                if not self.closed:
                    self._on_sample(*sample)


class LocalRequester(_Endpoint["LocalReplier"], Requester):
    """Sends the requests of a service client to all its servers."""

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo) -> None:
        super().__init__(owner, info)
        #: The sent calls, by number; their `route` has the servers that may still answer.
        self._calls: dict[int, PendingCall] = {}
        self._open()

    def ready(self) -> bool:
        """Return whether a server exists."""
        return bool(self._network.counterparts(self.info))

    def send(self, pending: PendingCall, data: bytes | bytearray) -> None:
        """Send a request to all servers; the first reply counts."""
        with self._lock:
            self._check_open()
            servers = self._network.counterparts(self.info)
            self._calls[pending.number], pending.route = pending, set(servers)
        request = RequestId(self.info.gid, pending.number, self)
        for server in servers:
            server.handle_request(request, bytes(data))
        if not servers:
            self._fail(pending.number, SERVER_LEFT)

    def forget(self, pending: PendingCall) -> None:
        """Drop the reply to a request."""
        self._take(pending.number)

    def handle_reply(self, number: int, data: bytes) -> None:
        """Deliver the first reply to a request."""
        pending = self._take(number)
        if pending is not None and not self.closed:
            pending.answer(data)

    def handle_refusal(self, number: int, server: LocalReplier, reason: str) -> None:
        """Fail a request once its last server has refused it."""
        with self._lock:
            pending = self._calls.get(number)
            if pending is None:
                return
            pending.route.discard(server)
        if not pending.route:
            self._fail(number, reason)

    def link(self, other: LocalReplier, calls: list[_Call]) -> None:  # noqa: ARG002 - any will do
        """Notify the client that a server is available."""
        if self.changed is not None:
            calls.append(self.changed)

    def unlink(self, other: LocalReplier, calls: list[_Call]) -> None:
        """Fail the requests that only this server could answer."""
        calls += [
            partial(self.handle_refusal, number, other, SERVER_LEFT)
            for number, pending in self._calls.items()
            if other in pending.route
        ]
        if self.changed is not None:
            calls.append(self.changed)

    def _fail(self, number: int, reason: str) -> None:
        pending = self._take(number)
        if pending is not None and not self.closed:
            pending.fail(reason)

    def _take(self, number: int) -> PendingCall | None:
        """Remove a sent call; return None if it has ended."""
        with self._lock:
            return self._calls.pop(number, None)


class LocalReplier(_Endpoint[LocalRequester], Replier):
    """Delivers the requests of all clients to a service server."""

    reports_failures = True

    def __init__(self, owner: LocalMiddleware, info: EndpointInfo, on_request: OnRequest) -> None:
        super().__init__(owner, info)
        self._on_request = on_request
        self._open()

    def handle_request(self, request: RequestId, data: bytes) -> None:
        """Deliver a request to the server."""
        if self.closed:
            self.fail(request, SERVER_LEFT)
        else:
            self._on_request(request, data)

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Send the response to a request."""
        self._check_open()
        if isinstance(request.handle, LocalRequester):
            request.handle.handle_reply(request.sequence, bytes(data))

    def fail(
        self,
        request: RequestId,
        reason: str,
        instead: bytes | bytearray | None = None,  # noqa: ARG002 - it reaches every client
    ) -> None:
        """Fail a request: no response will be sent."""
        if isinstance(request.handle, LocalRequester):
            request.handle.handle_refusal(request.sequence, self, reason)


class LocalMiddleware(Middleware):
    """A node's connection to a graph inside this process.

    Args:
        url: ``local://NAME``; the name may be empty.
        wire: Format of the payloads, ``cdr`` or ``ros1``.

    Attributes:
        network: The graph that it shares with the other nodes of that name.

    Raises:
        ArgumentError: The URL has more parts than a name.
    """

    matches_qos = True

    def __init__(self, url: str, wire: str = "cdr") -> None:
        name = url.partition("://")[2].rstrip("/")
        if not _NAME.fullmatch(name):
            expected = "local://NAME with a name of letters, digits, '_', '-' and '.', no options"
            raise ArgumentError("url", url, expected)
        self._name, self.wire = name, wire
        #: The open members, and whether this is closed; both guarded by the network's lock.
        self._open_members: dict[_Member, None] = {}
        self._graph: Graph | None = None
        self._closed = False

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:  # noqa: ARG002 - it never does
        """Join the graph."""
        # Not earlier: a node whose name is refused is never opened or closed.
        with _networks_lock:
            self.network = networks.setdefault(self._name, _Network())
            _members[self._name] = _members.get(self._name, 0) + 1
        self._graph = graph
        self.network.join(graph)

    def status(self) -> Status:
        """Return the state of the connection: connected until it is closed."""
        if self._closed:
            return Status(ConnectionState.CLOSED, "closed")
        return Status(ConnectionState.CONNECTED, "in this process")

    def stamp(self) -> tuple[int, int | None]:
        """Return the reception and sending times for a sample that is sent now.

        Both are in nanoseconds since the Unix epoch; the latter is None if unknown.
        """
        now = time.time_ns()
        return now, now

    def announce(self, node: NodeName) -> Handle:
        """Show a node in the graph until the handle is closed."""
        announcement = _Announcement(self, node)
        self.add(announcement)
        announcement.show()
        return announcement

    def create_writer(self, endpoint: EndpointInfo) -> LocalWriter:
        """Announce a publisher and return its writer."""
        return LocalWriter(self, endpoint)

    def create_reader(self, endpoint: EndpointInfo, on_sample: OnSample) -> LocalReader:
        """Announce a subscription and deliver its samples to `on_sample`."""
        return LocalReader(self, endpoint, on_sample)

    def create_requester(self, endpoint: EndpointInfo) -> LocalRequester:
        """Announce a service client and return its requester."""
        return LocalRequester(self, endpoint)

    def create_replier(self, endpoint: EndpointInfo, on_request: OnRequest) -> LocalReplier:
        """Announce a service server and deliver its requests to `on_request`."""
        return LocalReplier(self, endpoint, on_request)

    def poll(self) -> None:
        """Do nothing: every change takes effect at once."""

    def add(self, member: _Member) -> None:
        """Register a member to close together with this; raises NodeClosedError after closing."""
        with self.network.lock:
            if self._closed:
                raise NodeClosedError(f"local://{self._name} is closed; connect again")
            self._open_members[member] = None

    def remove(self, member: _Member) -> None:
        """Remove a closed member."""
        with self.network.lock:
            self._open_members.pop(member, None)

    def close(self) -> None:
        """Leave the graph; safe to call twice."""
        if self._graph is None:
            self._closed = True
            return
        with self.network.lock:
            if self._closed:
                return
            self._closed = True
            members = list(self._open_members)
        for member in members:
            member.close()
        self.network.leave(self._graph)
        with _networks_lock:
            _members[self._name] -= 1
            if not _members[self._name]:
                del _members[self._name], networks[self._name]


#: The graphs of this process by name, and the number of nodes in each; guarded by the lock.
networks: dict[str, _Network] = {}
_members: dict[str, int] = {}
_networks_lock = threading.Lock()
