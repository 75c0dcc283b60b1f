"""ROS 2 over Zenoh, speaking rmw_zenoh's protocol (Jazzy and newer; Humble by its hash marker)."""

from __future__ import annotations

import itertools
import logging
import threading
import time
from abc import abstractmethod
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from rosglass.comm import (
    ConnectionState,
    Durability,
    EndpointInfo,
    EndpointKind,
    Handle,
    History,
    NodeName,
    QoS,
    Reliability,
    Status,
)
from rosglass.errors import ConnectionLostError, NodeClosedError
from rosglass.ros2.middleware import Middleware, OnSample, Writer
from rosglass.ros2.zenoh_config import close_session, session_config
from rosglass.ros2.zenoh_keys import (
    HUMBLE_HASH,
    NO_ATTACHMENT,
    Attachment,
    Token,
    gid_of,
    graph_key,
    topic_key,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.ros2.graph import Graph
    from rosglass.ros2.zenoh_options import ZenohOptions

__all__ = ["ZenohMiddleware"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds between the heartbeats that let subscriptions notice a lost last sample (rmw_zenoh's).
_HEARTBEAT = 0.5


class ZenohMiddleware(Middleware):
    """One Zenoh session.

    What is declared before the session is open (a client opens only when its router answers) is
    kept and declared then.
    """

    matches_qos = False

    def __init__(self, options: ZenohOptions) -> None:
        self._options = options
        self._config, self._address = session_config(options)
        self._session: zenoh.Session | None = None
        self._id = str(self._config.get_json("id")).strip('"')
        self._numbers = itertools.count(1)
        self._lock = threading.Lock()
        self._declared: dict[int, _Declaration] = {}
        self._links: dict[str, bool] = {}
        self._was_connected = self._closed = False
        self._changed: Callable[[], None] = lambda: None
        self._graph: Graph | None = None
        self._strange: set[str] = set()

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        """Open the session; a peer's opens at once, a client's when its router answers."""
        self._graph, self._changed = graph, changed
        self._open()

    def status(self) -> Status:
        """Return whether a router or at least a peer is linked."""
        with self._lock:
            links, was_connected = dict(self._links), self._was_connected
        again = "trying again every second"
        if self._closed:
            return Status(ConnectionState.CLOSED, "closed")
        if any(links.values()):
            return Status(ConnectionState.CONNECTED, f"router at {self._address}")
        if links:
            detail = f"linked with other nodes, but no router at {self._address}, {again}"
            return Status(ConnectionState.CONNECTED, detail)
        if was_connected:
            detail = f"connection to {self._address} lost, {again}"
            return Status(ConnectionState.LOST, detail)
        return Status(ConnectionState.CONNECTING, f"no answer from {self._address}, {again}")

    def announce(self, node: NodeName) -> Handle:
        """Declare the node's token."""
        key = Token(self._options.domain, self._id, "0", "0", node).key()
        return self._add(_TokenOnly(self, key))

    def create_writer(
        self, node: NodeName, topic: str, type_name: str, type_hash: str, qos: QoS
    ) -> Writer:
        """Declare a publisher and its token."""
        kind = EndpointKind.PUBLISHER
        token = self._token(node, EndpointInfo(kind, topic, type_name, node, qos, type_hash))
        writer = _ZenohWriter(self, self._options, token, topic, type_name, type_hash, qos)
        self._add(writer)
        return writer

    def create_reader(
        self,
        node: NodeName,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: QoS,
        on_sample: OnSample,
    ) -> Handle:
        """Declare a subscriber to every definition of the type, and its token."""
        kind = EndpointKind.SUBSCRIPTION
        token = self._token(node, EndpointInfo(kind, topic, type_name, node, qos, type_hash))
        key = topic_key(self._options.domain, topic, type_name, "*")
        return self._add(_Reader(self, token, key, qos, on_sample))

    def poll(self) -> None:
        """Try again to open a client's session."""
        if self._session is None and not self._closed:
            self._open()

    def close(self) -> None:
        """Close the session; everything declared on it goes with it."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            session, self._session = self._session, None
            self._declared.clear()
            self._links.clear()
        if session is not None:
            close_session(session)
        self._changed()

    def forget(self, declaration: _Declaration) -> None:
        """Drop a declaration that was closed; for declarations."""
        with self._lock:
            self._declared.pop(id(declaration), None)

    def _token(self, node: NodeName, endpoint: EndpointInfo) -> str:
        number = str(next(self._numbers))
        if self._options.humble:
            endpoint = EndpointInfo(
                endpoint.kind, endpoint.name, endpoint.type, node, endpoint.qos, HUMBLE_HASH
            )
        return Token(self._options.domain, self._id, "0", number, node, endpoint).key()

    def _add(self, declaration: _Declaration) -> _Declaration:
        with self._lock:
            if self._closed:
                raise NodeClosedError("the node is closed; connect again")
            self._declared[id(declaration)] = declaration
            session = self._session
        if session is not None:
            declaration.attach(session)
        return declaration

    def _open(self) -> None:
        try:
            session = zenoh.open(self._config)
        except zenoh.ZError as error:
            if "Unable to connect" in str(error):
                return  # a client without router; status() says so and poll() tries again
            raise ConnectionLostError(f"cannot open a Zenoh session: {error}") from error
        session.info.declare_transport_events_listener(_direct(self._on_transport), history=True)
        session.liveliness().declare_subscriber(
            graph_key(self._options.domain), _direct(self._on_token), history=True
        )
        with self._lock:
            if not self._closed:
                self._session = session
            waiting = list(self._declared.values())
        if self._closed:
            close_session(session)
        for declaration in waiting:
            declaration.attach(session)

    def _on_transport(self, event: zenoh.TransportEvent) -> None:
        zid = str(event.transport.zid)
        with self._lock:
            if event.kind == zenoh.SampleKind.PUT:
                self._links[zid] = event.transport.whatami == zenoh.WhatAmI.ROUTER
                self._was_connected = True
            else:
                self._links.pop(zid, None)
        self._changed()

    def _on_token(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if self._graph is None or self._closed:
            return
        if sample.kind == zenoh.SampleKind.DELETE:
            self._graph.remove(key)
            return
        try:
            token = Token.parse(key)
        except ValueError as error:
            if key not in self._strange:
                self._strange.add(key)
                _log.warning("ignoring a graph token that is not understood: %s: %s", key, error)
            return
        if token.endpoint is None:
            self._graph.put_node(key, token.node)
        else:
            self._graph.put_endpoint(key, token.endpoint)


class _Declaration(Handle):
    """Something declared on the session, or to be declared when it opens."""

    def __init__(self, owner: ZenohMiddleware) -> None:
        self._owner = owner
        self._lock = threading.Lock()
        self._closed = self._attached = False
        self._handles: list[Any] = []

    def attach(self, session: zenoh.Session) -> None:
        """Declare it on the session that just opened."""
        with self._lock:
            if self._closed or self._attached:
                return
            self._attached = True
        # Declaring may call back at once, into code that closes this very declaration.
        self._keep(self.declare(session))

    @abstractmethod
    def declare(self, session: zenoh.Session) -> list[Any]:
        """Declare it and return what has to be undeclared, in that order."""

    def close(self) -> None:
        """Undeclare it."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            handles, self._handles = self._handles, []
        self._owner.forget(self)
        _undeclare(handles)

    def _keep(self, handles: list[Any]) -> None:
        with self._lock:
            if not self._closed:
                self._handles += handles
                return
        _undeclare(handles)


class _TokenOnly(_Declaration):
    def __init__(self, owner: ZenohMiddleware, token: str) -> None:
        super().__init__(owner)
        self._token = token

    def declare(self, session: zenoh.Session) -> list[Any]:
        return [session.liveliness().declare_token(self._token)]


class _Reader(_Declaration):
    def __init__(
        self, owner: ZenohMiddleware, token: str, key: str, qos: QoS, on_sample: OnSample
    ) -> None:
        super().__init__(owner)
        self._token, self._key, self._qos, self._on_sample = token, key, qos, on_sample

    def declare(self, session: zenoh.Session) -> list[Any]:
        subscriber: Any
        if self._qos.durability is Durability.TRANSIENT_LOCAL:
            reliable = self._qos.reliability is Reliability.RELIABLE
            subscriber = zenoh.ext.declare_advanced_subscriber(
                session,
                self._key,
                _direct(self._on_data),
                history=zenoh.ext.HistoryConfig(
                    detect_late_publishers=True, max_samples=self._qos.depth
                ),
                recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True)
                if reliable
                else None,
                subscriber_detection=True,
            )
        else:
            subscriber = session.declare_subscriber(self._key, _direct(self._on_data))
        return [session.liveliness().declare_token(self._token), subscriber]

    def _on_data(self, sample: zenoh.Sample) -> None:
        received = time.time_ns()
        if self._closed or sample.kind == zenoh.SampleKind.DELETE:
            return
        attached = sample.attachment
        note = NO_ATTACHMENT if attached is None else Attachment.decode(attached.to_bytes())
        type_hash = str(sample.key_expr).rpartition("/")[2]
        self._on_sample(
            sample.payload.to_bytes(),
            received,
            note.sent,
            note.gid,
            note.sequence,
            "" if type_hash == HUMBLE_HASH else type_hash,
        )


class _ZenohWriter(_Declaration, Writer):
    def __init__(
        self,
        owner: ZenohMiddleware,
        options: ZenohOptions,
        token: str,
        topic: str,
        type_name: str,
        type_hash: str,
        qos: QoS,
    ) -> None:
        super().__init__(owner)
        self._options, self._token, self._topic, self._qos = options, token, topic, qos
        self._type_name, self._type_hash = type_name, type_hash
        self._gid = gid_of(token)
        self._numbers = itertools.count(1)
        self._session: zenoh.Session | None = None
        self._hashes = {HUMBLE_HASH if options.humble else type_hash or HUMBLE_HASH}
        self._publishers: tuple[Any, ...] = ()
        # Kept for keys that are declared later: late subscriptions are owed the last samples.
        latched = qos.durability is Durability.TRANSIENT_LOCAL
        self._history: deque[tuple[bytes | bytearray, bytes]] = deque(maxlen=qos.depth * latched)

    def declare(self, session: zenoh.Session) -> list[Any]:
        self._session = session
        token = session.liveliness().declare_token(self._token)
        return [token, *self._declare_publishers(session, self._hashes)]

    def write(self, data: bytes | bytearray) -> None:
        """Send a payload; while nothing is linked, only a transient local cache keeps it."""
        if self._closed:
            raise NodeClosedError(f"the publisher of {self._topic} is closed")
        note = Attachment(next(self._numbers), time.time_ns(), self._gid).encode()
        self._history.append((data, note))
        try:
            for publisher in self._publishers:
                publisher.put(data, attachment=note)
        except zenoh.ZError as error:
            if self._closed or self._owner.status().state is ConnectionState.CLOSED:
                raise NodeClosedError(f"the publisher of {self._topic} is closed") from error
            raise ConnectionLostError(f"cannot publish on {self._topic}: {error}") from error

    def match(self, subscriptions: Sequence[EndpointInfo]) -> None:
        """Send under a further key for subscriptions that name the type's definition otherwise.

        A Humble robot subscribes without hash; the same definition is meant.
        """
        ours = {self._type_hash or HUMBLE_HASH, HUMBLE_HASH}
        wanted = {endpoint.type_hash or HUMBLE_HASH for endpoint in subscriptions}
        new = (wanted & ours) - self._hashes
        if new and not self._closed:
            self._hashes = self._hashes | new
            if self._session is not None:
                self._keep(self._declare_publishers(self._session, new))

    def _declare_publishers(self, session: zenoh.Session, hashes: set[str]) -> list[Any]:
        publishers = [self._declare_publisher(session, name) for name in sorted(hashes)]
        # First: whatever is written from here on reaches them; some of it twice, under one number.
        self._publishers += tuple(publishers)
        for data, note in tuple(self._history):
            for publisher in publishers:
                publisher.put(data, attachment=note)
        return publishers

    def _declare_publisher(self, session: zenoh.Session, type_hash: str) -> Any:
        key = topic_key(self._options.domain, self._topic, self._type_name, type_hash)
        reliable = self._qos.reliability is Reliability.RELIABLE
        keep_all = self._qos.history is History.KEEP_ALL
        # rmw_zenoh's choice: only who keeps everything waits for a full queue.
        block = reliable and keep_all
        congestion = zenoh.CongestionControl.BLOCK if block else zenoh.CongestionControl.DROP
        # Each priority has its own queue: a stop command must not be thrown away because camera
        # pictures, sent best effort by the same program, fill theirs while the network is stuck.
        priority = zenoh.Priority.INTERACTIVE_LOW if reliable else zenoh.Priority.DATA
        if self._qos.durability is Durability.VOLATILE:
            return session.declare_publisher(key, congestion_control=congestion, priority=priority)
        return zenoh.ext.declare_advanced_publisher(
            session,
            key,
            congestion_control=congestion,
            priority=priority,
            cache=zenoh.ext.CacheConfig(max_samples=self._qos.depth),
            publisher_detection=True,
            sample_miss_detection=zenoh.ext.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=_HEARTBEAT
            )
            if reliable
            else None,
        )


def _undeclare(handles: list[Any]) -> None:
    for handle in handles:
        with suppress(zenoh.ZError):  # the session went first
            handle.undeclare()


def _direct(callback: Callable[[Any], None]) -> Any:
    """Run `callback` on Zenoh's own thread, and log what it raises: Zenoh would only print it."""

    def guarded(item: Any) -> None:
        try:
            callback(item)
        except Exception:
            _log.exception("handling something received over Zenoh failed")

    return zenoh.handlers.Callback(guarded, indirect=False)
