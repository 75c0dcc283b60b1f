"""The server's side of a service over TCPROS: its clients' connections and requests.

Protocol: ROS wiki, "ROS/TCPROS": a client's header has the service and its type's md5 sum; a
request is a frame, and its response a frame after a byte that is 1 for success.
"""

from __future__ import annotations

import itertools
import logging
import struct
import time
from collections import deque
from typing import TYPE_CHECKING, Any

from rosglass.comm import EndpointKind
from rosglass.comm.log_limits import LogOnce
from rosglass.comm.wire import Replier, RequestId
from rosglass.errors import ServiceError
from rosglass.interfaces import ros1_name
from rosglass.wires.tcpros.connection import ANY, MAX_FRAME
from rosglass.wires.tcpros.registrations import Member

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.wire import OnRequest
    from rosglass.messages import ServiceType
    from rosglass.wires.tcpros.connection import Connection
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.io_loop import IoLoop
    from rosglass.wires.tcpros.master import Master

__all__ = ["TcprosReplier"]

_log = logging.getLogger("rosglass.ros1")
_head = struct.Struct("<BI")
#: Seconds for which a refused client is reported as a problem.
_REFUSAL_S = 30.0
#: Refused clients that are remembered.
_MAX_REFUSED = 10
#: Seconds that closing waits for a response that is being sent.
_CLOSE_TIMEOUT_S = 1.0
_TRUE = ("1", "true")


class TcprosReplier(Replier, Member):
    """Registers a service with the master, receives its requests and sends the replies.

    Args:
        core: The node it belongs to.
        name: Absolute service name.
        type: The service type.
        on_request: Called with each request, in the loop's thread.
        on_close: Called when the replier is closed.

    Attributes:
        name: Absolute service name.
        type: The service type.
    """

    lists_node = True
    reports_failures = has_refusals = True
    max_reply = MAX_FRAME

    def __init__(
        self,
        core: TcprosCore,
        name: str,
        type: ServiceType,
        on_request: OnRequest,
        on_close: Callable[[TcprosReplier], None],
    ) -> None:
        self._core, self.name, self.type = core, name, type
        self._on_request, self._on_close = on_request, on_close
        self._closed = False
        #: Changed in the loop's thread only, as is the next one.
        self._sessions: dict[Connection, _Session] = {}
        #: By client, why and when it was refused.
        self._refused: dict[str, tuple[str, float]] = {}
        self._log_once = LogOnce()
        #: Whether the graph has shown the service as this node's.
        self._seen = False
        self._warned = ""

    # -- as a replier ------------------------------------------------------------------------------

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some clients cannot be served, in words; empty if all can."""
        if conflict := self._conflict():
            return conflict
        now, refused = time.monotonic(), self._refused.copy().values()
        return "; ".join(dict.fromkeys(text for text, when in refused if now - when < _REFUSAL_S))

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        """Send a response; ignored when the client has left."""
        _session_of(request).answer(True, data)

    def fail(
        self,
        request: RequestId,
        reason: str,
        instead: bytes | bytearray | None = None,  # noqa: ARG002 - it reaches every client
    ) -> None:
        """Send the client the reason why there is no response."""
        _session_of(request).answer(False, reason.encode("utf-8", "replace"))

    def describe_failure(self, error: BaseException) -> str:
        """Return rospy's text for an exception that the service's callback raised."""
        if isinstance(error, ServiceError):
            return f"service cannot process request: {error}"
        return f"error processing request: {str(error) or type(error).__name__}"

    def abandoned(self, request: RequestId) -> bool:
        """Return whether the client of a request has left."""
        return _session_of(request).gone

    def client_name(self, request: RequestId) -> str:
        """Return the name of a request's client."""
        return _session_of(request).client

    def close(self) -> None:
        """Unregister the service and end its connections; safe to call twice, also at once."""
        if self._closed:
            return
        self._closed = True
        self._core.loop.call(self._end)
        self._core.remove(self)
        # Last: unregistering this server must not remove the registration of the next one.
        self._on_close(self)

    # -- connections, in the loop's thread ---------------------------------------------------------

    def _end(self) -> None:
        # With clients that were just accepted: that runs in this thread, too.
        for session in list(self._sessions.values()):
            session.close()

    def accept(self, link: Connection, header: dict[str, str]) -> str:
        """Accept a client's connection; return the reason if it is refused."""
        if "md5sum" not in header:
            return "md5sum is missing in the connection header"
        client, md5 = header.get("callerid", "") or link.peer, header["md5sum"]
        if md5 not in (ANY, self.type.md5):
            return self._refuse_type(client, header.get("type", ANY), md5)
        if self._closed:
            return f"{self.name} is not offered here any more"
        is_probe = header.get("probe", "").lower() in _TRUE
        if not is_probe:
            self._refused.pop(client, None)
            persistent = header.get("persistent", "").lower() in _TRUE
            session = _Session(self._core.loop, link, persistent, self._on_request)
            self._sessions[link] = session
        name = ros1_name(self.type.name)
        link.send_header(
            {
                "callerid": self._core.name.full,
                "md5sum": self.type.md5,
                "request_type": f"{name}Request",
                "response_type": f"{name}Response",
                "service": self.name,
                "type": name,
            }
        )
        if is_probe:
            link.finish(_CLOSE_TIMEOUT_S)
        return ""

    def _refuse_type(self, client: str, theirs: str, md5: str) -> str:
        called = "a type without name" if theirs == ANY else theirs
        problem = (
            f"{self.name} is {ros1_name(self.type.name)} with md5 {self.type.md5} on "
            f"{self._core.name}, but {client} calls it as {called} with md5 {md5}"
        )
        self._refused.pop(client, None)
        self._refused[client] = (problem, time.monotonic())
        if len(self._refused) > _MAX_REFUSED:
            del self._refused[next(iter(self._refused))]
        if self._log_once.is_first((client, md5)):
            ours = self._core.types.text(self.type).strip()
            _log.warning("%s: it is refused. Ours:\n%s", problem, ours)
        return problem

    def on_frame(self, link: Connection, data: bytes | memoryview) -> None:
        """Hand on a request."""
        session = self._sessions.get(link)
        if session is not None:
            session.on_frame(data)

    def on_disconnected(self, link: Connection) -> None:
        """Remove a client that has left."""
        self._sessions.pop(link, None)

    # -- as a member ------------------------------------------------------------------------------

    @property
    def endpoint(self) -> tuple[EndpointKind, str] | None:  # type: ignore[override]
        """Its kind and name in the master's graph; None while another node has the service."""
        nodes = self._core.graph.services().get(self.name, [])
        ours = not nodes or self._core.name.full in nodes
        return (EndpointKind.SERVICE_SERVER, self.name) if ours else None

    def register(self, master: Master) -> None:
        """Register the service with the master."""
        master.call("registerService", self.name, self._uri, self._core.uri)

    def unregister(self, master: Master) -> None:
        """Unregister the service with the master."""
        master.call("unregisterService", self.name, self._uri)

    @property
    def _uri(self) -> str:
        host, port = self._core.address
        return f"rosrpc://[{host}]:{port}" if ":" in host else f"rosrpc://{host}:{port}"

    def follow(self, moved: bool, idle: bool) -> None:
        """Follow the graph: log when another node takes the service over."""
        if self._closed or not (moved or idle):
            return
        nodes = self._core.graph.services().get(self.name, [])
        if self._core.name.full in nodes:
            self._seen = True
        conflict = self._conflict()
        if conflict and conflict != self._warned:
            _log.warning("%s: %s", self.name, conflict)
        self._warned = conflict

    def _conflict(self) -> str:
        """Return which other node has taken the service over; empty if none has."""
        nodes = self._core.graph.services().get(self.name, [])
        if not self._seen or not nodes or self._core.name.full in nodes:
            return ""
        return (
            f"{' and '.join(nodes)} offers {self.name} now, and the master sends all clients "
            "there; stop one of the two"
        )


class _Session:
    """A client's connection; in the loop's thread, except :meth:`answer`.

    Requests are handed on one at a time, so that responses are sent in their order; while one
    waits, nothing is read.

    Args:
        loop: The connection's.
        link: The connection.
        persistent: Whether it stays open after a response.
        on_request: Called with each request.

    Attributes:
        client: The client's name.
    """

    def __init__(
        self, loop: IoLoop, link: Connection, persistent: bool, on_request: OnRequest
    ) -> None:
        self.client = link.header.get("callerid", "") or link.peer
        self._identity = self.client.encode("utf-8", "replace")
        self._loop, self._link, self._persistent = loop, link, persistent
        self._on_request = on_request
        self._numbers = itertools.count(1)
        self._busy = self._paused = False
        self._waiting: deque[bytes | memoryview] = deque()

    @property
    def gone(self) -> bool:
        """True once the connection has ended."""
        return self._link.closed

    def on_frame(self, data: bytes | memoryview) -> None:
        """Hand on a request, or queue it until the previous one is answered."""
        if not self._busy:
            self._busy = True
            self._on_request(RequestId(self._identity, next(self._numbers), self), data)
        else:
            self._waiting.append(data)
            self._paused = True
            self._link.pause(False)

    def answer(self, ok: bool, data: bytes | bytearray) -> None:
        """Send the response to the current request; from any thread."""
        self._link.send([_head.pack(ok, len(data)), data])
        self._loop.call(self._on_answered)

    def close(self) -> None:
        """End the connection once its send queue is empty, or after 1 s."""
        self._waiting.clear()
        self._link.finish(_CLOSE_TIMEOUT_S)

    def _on_answered(self) -> None:
        link = self._link
        if link.closed:
            return
        # Back-pressure: the next request waits until the client has read the response.
        proceed = self._next if self._persistent else lambda: link.end("")
        if link.waiting():
            link.on_room = proceed
        else:
            proceed()

    def _next(self) -> None:
        self._link.on_room = None
        self._busy = False
        if self._waiting:
            self.on_frame(self._waiting.popleft())
        elif self._paused:
            self._paused = False
            self._link.pause(True)


def _session_of(request: RequestId) -> _Session:
    session: Any = request.handle
    assert isinstance(session, _Session)
    return session
