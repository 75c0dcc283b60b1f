"""Offering ROS 1 services."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import EndpointKind, QoS
from rosglass.comm.answering import AnsweringServer
from rosglass.errors import Error, ServiceError
from rosglass.interfaces import ros1_name
from rosglass.ros1.connection import MAX_FRAME
from rosglass.ros1.core import Member
from rosglass.ros1.service_session import Session
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rosglass.comm import Answer, Executor
    from rosglass.messages import Message, ServiceType
    from rosglass.ros1.connection import Connection
    from rosglass.ros1.core import Core
    from rosglass.ros1.master import Master
    from rosglass.ros1.services import Services

__all__ = ["Ros1ServiceServer"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds for which a client that was refused counts as a problem.
_GRUDGE = 30.0
_TRUE = ("1", "true")


class Ros1ServiceServer(AnsweringServer[Session], Member):
    """A service server; made by :meth:`Ros1Node.create_service_server`.

    Args:
        core: The node it belongs to.
        services: The node's services.
        name: Absolute service name.
        type: The type, or its name.
        callback: Called with each request; see :meth:`Node.create_service_server`.
        qos: Kept for who asks; ROS 1 has none.
        executor: Where `callback` runs; None for the node's dispatcher, or for the running event
            loop when `callback` is a coroutine function.
    """

    _core: Core

    def __init__(
        self,
        core: Core,
        services: Services,
        name: str,
        type: ServiceType | str,
        callback: Callable[[Message], Answer | Awaitable[Answer]],
        qos: QoS,
        executor: Executor | None,
    ) -> None:
        super().__init__(core, name, core.types.service(type), callback, executor)
        self.qos, self._services = qos, services
        self._sessions: dict[Connection, Session] = {}
        #: Why clients were refused lately, and when, by their names.
        self._refused: dict[str, tuple[str, float]] = {}
        self._seen = False
        self._warned = ""

    @property
    def problem(self) -> str:
        """Why some clients cannot be served, in words; empty when all is well."""
        if self._closed:
            return "the server is closed"
        others = self._usurpers()
        if others:
            return (
                f"{' and '.join(others)} offers {self.name} now, and the master sends all clients "
                "there; end one of the two"
            )
        with self._lock:
            told = list(self._refused.values())
        now = time.monotonic()
        return "; ".join(dict.fromkeys(text for text, when in told if now - when < _GRUDGE))

    def _usurpers(self) -> list[str]:
        """Return who else has the service according to the master, if we had it before."""
        nodes = self._core.graph.services().get(self.name, [])
        return [] if not self._seen or self._core.name.full in nodes else nodes

    # -- connections, in the loop's thread -------------------------------------------------------

    def accept(self, link: Connection, header: dict[str, str]) -> str:
        """Take a client's connection; return why not, empty when it is taken."""
        if "md5sum" not in header:
            return "md5sum is missing in the connection header"
        client, md5 = header.get("callerid", "") or link.peer, header["md5sum"]
        if md5 not in (ANY, self.type.md5):
            return self._refuse_type(client, header.get("type", ANY), md5)
        with self._lock:
            if self._closed:
                return f"{self.name} is not offered here any more"
            is_probe = header.get("probe", "").lower() in _TRUE
            if not is_probe:
                self._refused.pop(client, None)
                persistent = header.get("persistent", "").lower() in _TRUE
                session = Session(self._core.loop, link, persistent, self._on_request)
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
            link.finish(1.0)
        return ""

    def _refuse_type(self, client: str, theirs: str, md5: str) -> str:
        called = "a type that it does not name" if theirs == ANY else theirs
        problem = (
            f"{self.name} is {ros1_name(self.type.name)} with md5 {self.type.md5} on "
            f"{self._core.name}, but {client} calls it as {called} with md5 {md5}"
        )
        with self._lock:
            self._refused.pop(client, None)
            self._refused[client] = (problem, time.monotonic())
            if len(self._refused) > 10:
                del self._refused[next(iter(self._refused))]
        if self._complaints.fresh((client, md5)):
            ours = self._core.types.text(self.type).strip()
            _log.warning("%s: it is not served. Ours:\n%s", problem, ours)
        return problem

    def take(self, link: Connection, data: bytes | memoryview) -> None:
        """Take a request."""
        session = self._sessions.get(link)
        if session is not None:
            session.take(data)

    def drop(self, link: Connection) -> None:
        """Forget a client that has gone."""
        with self._lock:
            self._sessions.pop(link, None)

    # -- answering -------------------------------------------------------------------------------

    def _on_request(self, session: Session, data: bytes | memoryview) -> None:
        try:
            self._take(session, data)
        except Exception as error:
            self._failed(session, error)

    def _given_up(self, session: Session) -> bool:
        return session.gone

    def _decode(self, data: bytes | memoryview) -> Message:
        self.type.request.validate(data)
        return self.type.request.decode(data)

    def _respond(self, session: Session, answer: Any) -> None:
        try:
            parts = self.type.response.encode_parts(answer, wire="ros1")
            size = sum(memoryview(part).nbytes for part in parts)
            if size > MAX_FRAME:
                raise ServiceError(f"it has {size} bytes, and ROS 1 takes at most {MAX_FRAME}")
        except Error as error:
            _log.error(
                "%s: the callback's response to %s does not fit: %s; it is told the error instead",
                self.name,
                session.client,
                error,
            )
            self._tell(session, f"the server made no valid response: {error}")
        except Exception as error:
            self._failed(session, error)
        else:
            session.answer(True, parts)

    def _failed(self, session: Session, error: Exception) -> None:
        if isinstance(error, ServiceError):
            # Raised on purpose, as rospy's ServiceException: the client is told, that is all.
            _log.info("%s: the request of %s is refused: %s", self.name, session.client, error)
            self._tell(session, f"service cannot process request: {error}")
            return
        # Our own errors say where and why, as those of handlers in QML do.
        reason = f": {error}" if isinstance(error, Error) else ""
        _log.error(
            "%s: the callback failed on a request of %s; it is told the error instead%s",
            self.name,
            session.client,
            reason,
            exc_info=None if reason else error,
        )
        told = str(error) or type(error).__name__
        self._tell(session, f"error processing request: {told}")

    def _refuse(self, session: Session, reason: str) -> None:
        """Turn a client's fault down, and name it in the log once."""
        if self._complaints.fresh(session.client):
            _log.warning("%s: refusing requests of %s: %s", self.name, session.client, reason)
        self._tell(session, reason)

    def _tell(self, session: Session, reason: str) -> None:
        session.answer(False, [reason.encode("utf-8", "replace")])

    # -- as a member -----------------------------------------------------------------------------

    @property
    def place(self) -> tuple[EndpointKind, str] | None:  # type: ignore[override]
        """As what the master shows it; None while it shows another node's, which has it now."""
        nodes = self._core.graph.services().get(self.name, [])
        ours = not nodes or self._core.name.full in nodes
        return (EndpointKind.SERVICE_SERVER, self.name) if ours else None

    def register(self, master: Master) -> None:
        """Tell the master."""
        master.call("registerService", self.name, self._uri, self._core.uri)

    def unregister(self, master: Master) -> None:
        """Tell the master that it is gone."""
        master.call("unregisterService", self.name, self._uri)

    @property
    def _uri(self) -> str:
        host, port = self._core.address
        return f"rosrpc://[{host}]:{port}" if ":" in host else f"rosrpc://{host}:{port}"

    def follow(self, moved: bool, idle: bool) -> None:
        """Follow the graph: who offers the service, and whether the master has forgotten it."""
        if self._closed or not (moved or idle):
            return
        nodes = self._core.graph.services().get(self.name, [])
        if self._core.name.full in nodes:
            self._seen = True
        problem = self.problem if self._usurpers() else ""
        if problem and problem != self._warned:
            _log.warning("%s: %s", self.name, problem)
        self._warned = problem

    def _withdraw(self) -> None:
        with self._lock:
            sessions = list(self._sessions.values())
        for session in sessions:
            self._core.loop.call(session.close)
        self._core.remove(self)
        # Last: the farewell of this server must not remove the registration of the next one.
        self._services.end(self)
