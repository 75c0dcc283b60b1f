"""ROS 2 over Zenoh with rmw_zenoh's protocol (Jazzy and newer, and Humble)."""

from __future__ import annotations

import itertools
import json
import logging
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import zenoh

from rosglass.comm import (
    ConnectionState,
    EndpointInfo,
    EndpointKind,
    Handle,
    NodeName,
    Status,
)
from rosglass.comm.handle import undo_on_error
from rosglass.comm.timers import Timers
from rosglass.comm.wire import (
    Middleware,
    OnRequest,
    OnSample,
    Reader,
    Replier,
    Requester,
    Writer,
)
from rosglass.errors import ConnectionLostError, Error, NodeClosedError
from rosglass.wires.zenoh.endpoints import (
    CHANNEL,
    Announcement,
    Declaration,
    LocalRegistry,
    Pump,
    SharedMemory,
    ZenohWriter,
)
from rosglass.wires.zenoh.keys import Token, gid_of, graph_key
from rosglass.wires.zenoh.reader import (
    COLLECT_INTERVAL_S,
    POLL_INTERVAL_S,
    Drain,
    ZenohReader,
)
from rosglass.wires.zenoh.refusal import find_refusal
from rosglass.wires.zenoh.services import ZenohReplier, ZenohRequester
from rosglass.wires.zenoh.session import (
    OPEN_TIMEOUT_S,
    Heartbeat,
    check_process,
    close_session,
    limit_silence,
    open_session,
    reason,
    session_config,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.graph import Graph
    from rosglass.wires.zenoh.options import ZenohOptions

__all__ = ["ZenohMiddleware"]

_Kind = TypeVar("_Kind", bound=Declaration)

_log = logging.getLogger("rosglass.ros2")
#: Number of closed endpoints before the number of the oldest is used again.
_MIN_UNUSED_NUMBERS = 64
#: Seconds between two heartbeats to the router.
_HEARTBEAT_INTERVAL_S = 0.9
#: Seconds until a query that ends after a router's tokens is sent again: for 10,000, Zenoh needs 4
#: to 13. Routers end unanswered ones after their `routing/interests/timeout` as if answered.
_HISTORY_TIMEOUT_S = 9.0
#: Number of publishers and clients whose topics and services are remembered.
_MAX_NAMES = 20_000
#: Number of invalid tokens to log.
_MAX_LOGGED = 100
#: Seconds without a router until the reason is looked for, between two times, and for its answer.
_REFUSAL_DELAY_S, _REFUSAL_INTERVAL_S, _REFUSAL_TIMEOUT_S = 2.0, 3.0, 2.0
#: Seconds without a new link before a peer's session is closed: a link that is opened at that
#: moment is never closed (eclipse-zenoh 1.10.2), nor are its sockets.
_SETTLING_TIME_S = 0.2


class ZenohMiddleware(Middleware):
    """A Zenoh session.

    Entities created before the session opens are declared when it does; the session of a client
    opens when its router answers.
    """

    matches_qos = False

    def __init__(self, options: ZenohOptions) -> None:
        self.options = options
        self._config, self._address = session_config(options)
        self._session: zenoh.Session | None = None
        self._id = json.loads(self._config.get_json("id"))
        self._numbers = itertools.count(1)
        #: Numbers of closed endpoints by the part of their tokens behind it; the last closed ones.
        self._used_numbers: dict[str, deque[str]] = {}
        self._just_closed: deque[str] = deque()
        #: Guards what several threads change: declarations, links, the session.
        self._lock = threading.Lock()
        self._declared: dict[int, Declaration] = {}
        self._links: dict[str, bool] = {}
        self._versions = itertools.count(1)
        self.version = 0
        self._is_peer = json.loads(self._config.get_json("mode")) != "client"
        self._settled = 0.0
        self._was_connected = self._closed = False
        self._retries_open = self._linked = False
        #: Held while a session is being opened, which takes seconds without an answer.
        self._opening = threading.Lock()
        self._no_token = f"@ros2_lv/{options.domain}/{self._id}/pulse"
        self._heartbeat = Heartbeat(self._no_token)
        #: Whether tokens of a router are missing, a query that ends after those that it had when it
        #: was linked, and when that was.
        self._incomplete, self._history, self._linked_at = False, None, 0.0
        self._next_beat = 0.0
        #: Why the router refuses the session, and when to look for that again.
        self._refusal, self._next_refusal = "", time.monotonic() + _REFUSAL_DELAY_S
        self._found_refusal: tuple[str, str] | None = None
        self._looks_for_refusal = False
        self._pumps: list[Pump] = []
        self._shared: SharedMemory | None = None
        if json.loads(self._config.get_json("transport/shared_memory/enabled")):
            self._shared = SharedMemory()
        self._readers: LocalRegistry[ZenohReader] = LocalRegistry()
        self._servers: LocalRegistry[ZenohReplier] = LocalRegistry()
        self.timers = Timers(f"{self._address} commands")
        self._drain = Drain(f"{self._address} unread", COLLECT_INTERVAL_S)
        self._poller = Drain(f"{self._address} fast", POLL_INTERVAL_S)
        self.rate = 0.0
        self._changed: Callable[[], None] = lambda: None
        self._graph: Graph | None = None
        #: Topic or service of each announced publisher and client by its GID, the oldest first.
        #: Kept after they leave: what they have sent may still arrive.
        self._names: dict[bytes, str] = {}
        self._logged_tokens: set[str] = set()

    def open(self, graph: Graph, changed: Callable[[], None]) -> None:
        """Open the session of a peer; that of a client opens when its router answers."""
        check_process()
        self._graph, self._changed = graph, changed
        if not self._is_peer:
            self._retries_open = True  # poll() opens it: opening waits for the router
            changed()
        else:
            self._open()

    @property
    def graph(self) -> Graph:
        """The graph."""
        if self._graph is None:
            raise NodeClosedError("the node is not open yet")
        return self._graph

    def status(self) -> Status:
        """Return the state: connected if a router, or at least a peer, is linked."""
        with self._lock:
            links, was_connected = dict(self._links), self._was_connected
        retry = "trying again every second"
        if self._closed:
            return Status(ConnectionState.CLOSED, "closed")
        routers, silent = sum(links.values()), self._heartbeat.silent
        if routers and not silent:
            return Status(ConnectionState.CONNECTED, f"router at {self._address}")
        if len(links) > routers:
            missing = (
                f"the router at {self._address} is silent"
                if routers
                else f"{self._refusal or f'no router at {self._address}'}, {retry}"
            )
            detail = f"linked with other nodes, but {missing}"
            return Status(ConnectionState.CONNECTED, detail)
        if routers:
            detail = f"connected to {self._address}, which is silent, waiting for it"
            return Status(ConnectionState.LOST, detail)
        if self._refusal:
            state = ConnectionState.LOST if was_connected else ConnectionState.CONNECTING
            return Status(state, f"{self._refusal}; {retry}")
        if was_connected:
            detail = f"connection to {self._address} lost, {retry}"
            return Status(ConnectionState.LOST, detail)
        return Status(ConnectionState.CONNECTING, f"no answer from {self._address}, {retry}")

    def unnamed(self) -> int:
        """Return 1 until the graph has all tokens of the router, and while that is lost; else 0."""
        with self._lock:
            # The answer does not cover links that have been opened since.
            if self._history is not None and not self._linked:
                try:
                    if self._history.try_recv() is not None:  # an error: the timeout
                        self._history = None
                except zenoh.ZError:  # the end of the answer
                    # All tokens are in the pump's channel.
                    if any(self._links.values()) and all(pump.idle for pump in self._pumps):
                        self._incomplete, self._history = False, None
            return int(self._incomplete)

    def announce(self, node: NodeName) -> Handle:
        """Declare the node's token."""
        key = Token(self.options.domain, self._id, "0", "0", node).key()
        return self._add(Announcement(self, key))

    def create_writer(self, endpoint: EndpointInfo) -> Writer:
        """Declare a publisher and its token."""
        token = self._token(endpoint)
        return self._add(ZenohWriter(self, token, endpoint, self._shared, self._readers))

    def create_reader(self, endpoint: EndpointInfo, on_sample: OnSample) -> Reader:
        """Declare a subscriber to all definitions of the type, and its token."""
        token = self._token(endpoint)
        return self._add(
            ZenohReader(self, token, endpoint, on_sample, self._drain, self._poller, self._readers)
        )

    def create_requester(self, endpoint: EndpointInfo) -> Requester:
        """Declare a client's queriers and its token."""
        token = self._token(endpoint)
        return self._add(ZenohRequester(self, token, endpoint, self._servers))

    def create_replier(self, endpoint: EndpointInfo, on_request: OnRequest) -> Replier:
        """Declare a server's queryables and its token."""
        token = self._token(endpoint)
        return self._add(ZenohReplier(self, token, endpoint, on_request, self._servers))

    def poll(self) -> None:
        """Open a client's session if its router answers; poll all declarations."""
        if self._closed:
            return
        if self._retries_open:
            self._open()
        self._watch_links()
        self._look_for_refusal()
        self.rate = sum(reader.rate for reader in self._declared_of(ZenohReader))
        for declaration in self._declared_of(Declaration):  # type: ignore[type-abstract]
            declaration.poll()

    def close(self) -> None:
        """Close the session, with everything declared on it."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            session, self._session = self._session, None
            pause = max(0.0, self._settled - time.monotonic()) if self._is_peer else 0.0
            self._declared.clear()
            self._links.clear()
        self._increase_version()
        # A thread that is inside Zenoh while the interpreter shuts down would abort the program.
        if self._opening.acquire(timeout=OPEN_TIMEOUT_S):
            self._opening.release()
        for pump in self._pumps:
            pump.undeclare()
        self.timers.close()
        if session is not None:
            close_session(session, pause)
        self._drain.close()
        self._poller.close()
        self._changed()

    def forget(self, declaration: Declaration) -> None:
        """Remove a declaration that was closed."""
        with self._lock:
            self._declared.pop(id(declaration), None)
        self._hide(declaration.token)

    def recycle(self, declaration: Declaration) -> None:
        """Reuse the number of a declaration whose token is gone.

        Only for the same endpoint, whose token is the same then: every program in the graph, and
        the router, stores each token's key for ever.
        """
        with self._lock:
            self._just_closed.append(declaration.token)
            if len(self._just_closed) > _MIN_UNUSED_NUMBERS:
                *_, number, rest = self._just_closed.popleft().split("/", 5)
                self._used_numbers.setdefault(rest, deque()).append(number)

    def name_of(self, gid: bytes) -> str | None:
        """Return the topic or service that a publisher or client was announced for, if any."""
        return self._names.get(gid)

    def wake(self) -> None:
        """Poll declarations soon."""
        self._changed()

    def is_linked(self) -> bool:
        """Return whether there is a link to a router or peer."""
        return bool(self._links)

    def query_router(self, timeout: float) -> Any:
        """Send a query without result; return its channel, None if there is no session."""
        session = self._session
        if session is None:
            return None
        channel = zenoh.handlers.FifoChannel(4)
        return session.liveliness().get(self._no_token, channel, timeout=timeout)

    def _token(self, endpoint: EndpointInfo) -> str:
        if self.options.humble:
            endpoint = replace(endpoint, type_hash="")
        token = Token(self.options.domain, self._id, "0", "", endpoint.node, endpoint)
        with self._lock:
            used = self._used_numbers.get(token.key().split("/", 5)[5])
            number = used.popleft() if used else str(next(self._numbers))
        return replace(token, entity_id=number).key()

    def _add(self, declaration: _Kind) -> _Kind:
        with self._lock:
            if self._closed:
                raise NodeClosedError("the node is closed; connect again")
            self._declared[id(declaration)] = declaration
            session = self._session
        if session is not None:
            declaration.attach(session)
        # Last, as it must be able to receive once it is in the graph.
        self._show(declaration.token)
        with self._lock:
            gone = id(declaration) not in self._declared
        if gone:
            self._hide(declaration.token)
        return declaration

    def _open(self) -> None:
        try:
            with self._opening:
                if self._closed:
                    return
                session = open_session(self._config)
        except zenoh.ZError as error:
            if "Unable to connect" in str(error):
                self._retries_open = True  # a client without router; poll() tries again
                return
            raise ConnectionLostError(f"cannot open a Zenoh session: {reason(error)}") from error
        self._retries_open = False
        self._settled = time.monotonic() + _SETTLING_TIME_S
        # A pump that waits in Zenoh while the interpreter shuts down would abort the program.
        with undo_on_error(lambda: close_session(session)):
            events = session.info.declare_transport_events_listener(CHANNEL, history=True)
            tokens = session.liveliness().declare_subscriber(
                graph_key(self.options.domain), CHANNEL, history=True
            )
            self._pumps = [
                Pump(events, self._on_transport, f"{self._address} links"),
                Pump(tokens, self._on_token, f"{self._address} tokens"),
            ]
        with self._lock:
            if not self._closed:
                self._session = session
            waiting = list(self._declared.values())
        if self._closed:
            close_session(session, _SETTLING_TIME_S)
        for declaration in waiting:
            declaration.attach(session)

    def _watch_links(self) -> None:
        """Detect links that are dead but not closed, and when the router has sent its tokens."""
        now = time.monotonic()
        with self._lock:
            session, routers = self._session, any(self._links.values())
            if session is None:
                return
            fresh, self._linked = self._linked, False
            if fresh:
                self._history, self._linked_at = None, now
            queries = routers and self._incomplete and self._history is None
        if fresh:
            limit_silence(session)
        if queries:
            with suppress(zenoh.ZError):  # the session is closed
                history = self.query_router(_HISTORY_TIMEOUT_S)
                with self._lock:
                    self._history = history
        # Answers queue behind the tokens.
        awaits_tokens = self.unnamed() and now < self._linked_at + _HISTORY_TIMEOUT_S
        if not routers or awaits_tokens:
            self._heartbeat.pause()
        elif now >= self._next_beat:
            self._next_beat = now + _HEARTBEAT_INTERVAL_S
            self._heartbeat.beat(session, now)
            if self._heartbeat.silent:
                self._increase_version()

    def _look_for_refusal(self) -> None:
        """Find out why there is no router; in its own thread, as it may wait for a name server."""
        with self._lock:
            linked, now = any(self._links.values()), time.monotonic()
            if linked:
                self._refusal, self._next_refusal = "", now + _REFUSAL_DELAY_S
                self._found_refusal = None
            if linked or now < self._next_refusal or self._looks_for_refusal:
                return
            self._next_refusal, self._looks_for_refusal = now + _REFUSAL_INTERVAL_S, True

        def look() -> None:
            found = None
            with suppress(Error):  # a file is missing by now
                found = find_refusal(self.options, _REFUSAL_TIMEOUT_S, tries=False)
            before, self._found_refusal = self._found_refusal, found
            # Found once, the session may be about to open: the network is back.
            self._refusal = ": ".join(found) if found is not None and found == before else ""
            self._looks_for_refusal = False
            self._changed()

        threading.Thread(target=look, name=f"{self._address} refusal", daemon=True).start()

    def _increase_version(self) -> None:
        # next() is atomic: a new number on every thread.
        self.version = next(self._versions)

    def _on_transport(self, event: zenoh.TransportEvent) -> None:
        zid = str(event.transport.zid)
        with self._lock:
            if event.kind == zenoh.SampleKind.PUT:
                self._settled = time.monotonic() + _SETTLING_TIME_S
                self._links[zid] = event.transport.whatami == zenoh.WhatAmI.ROUTER
                self._was_connected = self._linked = True
                # At once: from now on, status() calls the graph connected.
                self._incomplete |= any(self._links.values())
            elif self._links.pop(zid, False) and not any(self._links.values()):
                self._incomplete = True
        self._increase_version()
        self._changed()

    def _on_token(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if f"/{self._id}/" in key or self._closed:
            return  # own tokens stay in the graph while declared, regardless of links
        if sample.kind == zenoh.SampleKind.DELETE:
            self._hide(key)
        else:
            self._heartbeat.on_received(time.monotonic())
            self._show(key)

    def _show(self, key: str) -> None:
        if self._graph is None:
            return
        try:
            token = Token.parse(key)
        except ValueError as error:
            if key not in self._logged_tokens and len(self._logged_tokens) < _MAX_LOGGED:
                self._logged_tokens.add(key)
                _log.warning("ignoring an invalid graph token: %s: %s", key, error)
            return
        endpoint = token.endpoint
        if endpoint is None:
            self._graph.put_node(key, token.node)
            return
        if endpoint.kind in (EndpointKind.PUBLISHER, EndpointKind.SERVICE_CLIENT):
            with self._lock:
                self._names[endpoint.gid] = endpoint.name
                if len(self._names) > _MAX_NAMES:
                    del self._names[next(iter(self._names))]
        self._graph.put_endpoint(key, endpoint)
        if endpoint.kind is EndpointKind.SERVICE_SERVER:
            self._increase_version()
        if endpoint.kind is EndpointKind.SERVICE_CLIENT and not endpoint.type_hash:
            for replier in self._declared_of(ZenohReplier):
                replier.on_client(endpoint)

    def _hide(self, key: str) -> None:
        if self._graph is None:
            return
        self._graph.remove(key)
        if key.split("/", 6)[5:6] == ["SS"]:
            self._increase_version()
            for requester in self._declared_of(ZenohRequester):
                requester.on_server_left(gid_of(key))

    def _declared_of(self, kind: type[_Kind]) -> list[_Kind]:
        with self._lock:
            declared = list(self._declared.values())
        return [one for one in declared if isinstance(one, kind)]
