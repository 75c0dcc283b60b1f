"""What a node answers the master and other nodes (``rosnode``, ``rqt_graph``): the slave API.

API: ROS wiki, "ROS/Slave_API"; getBusStats and getBusInfo as ``rosnode info`` reads them, and what
rosgraph's ``graph.py`` and rospy make of them.
"""

from __future__ import annotations

import logging
import os
import reprlib
import socket
import socketserver
import threading
import xmlrpc.client
import xmlrpc.server
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import urlsplit

from rosglass.comm.log_limits import LogOnce
from rosglass.interfaces import ros1_name
from rosglass.wires.tcpros.address import is_loopback
from rosglass.wires.tcpros.master import parse_xml

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.topics import Topics

__all__ = ["NodeApi", "Slave", "SlaveApi"]


_log = logging.getLogger("rosglass.ros1")
#: Longest call in bytes: a parameter that changed comes whole.
_MAX_CALL_BYTES = 64 * 2**20
#: Connections at a time; the master, and each tool that asks, has one.
_MAX_CONNECTIONS = 100


class SlaveApi(Protocol):
    """What is asked; called on threads of the server's."""

    def bus_info(self) -> list[list[Any]]:
        """Return a list for each connection."""

    def bus_stats(self) -> list[Any]:
        """Return statistics of publishers, subscriptions and services."""

    def master_uri(self) -> str:
        """Return the master's URI."""

    def published(self) -> list[list[str]]:
        """Return topic and type of all that is published."""

    def subscribed(self) -> list[list[str]]:
        """Return topic and type of all that is subscribed."""

    def shut_down(self, caller: str, reason: str) -> None:
        """End the node, because somebody else says so."""

    def parameter_changed(self, name: str, value: Any) -> None:
        """Take a parameter that was subscribed to."""

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        """Take the publishers that a topic has now."""

    def request_topic(self, topic: str, protocols: list[Any]) -> list[Any]:
        """Return how to connect to a published topic; raises KeyError when it is not."""


class _Handler(xmlrpc.server.SimpleXMLRPCRequestHandler):
    protocol_version = "HTTP/1.1"
    rpc_paths = ()
    #: Seconds without a call after which a connection is closed.
    timeout = 30
    #: Small answers must not wait for the peer's acknowledgement of the header.
    disable_nagle_algorithm = True

    def log_message(self, *_: Any) -> None:
        """Write nothing to standard error."""

    def do_POST(self) -> None:  # noqa: N802 - named by the standard library
        """Answer a call, unless it is of a length that no call has."""
        length = self.headers.get("content-length", "")
        if not (length.isascii() and length.isdecimal()) or int(length) > _MAX_CALL_BYTES:
            self.send_error(400, "no content length, or too large")
            self.close_connection = True
            return
        if self.headers.get("content-encoding", "identity") != "identity":
            self.send_error(501, "no encoding is understood")
            self.close_connection = True
            return
        super().do_POST()


class Slave(socketserver.ThreadingMixIn, xmlrpc.server.SimpleXMLRPCDispatcher):
    """Answers the slave API, each connection on a daemon thread of its own.

    Args:
        api: Who answers.
    """

    daemon_threads = True
    block_on_close = False
    #: What the request handler asks of its server.
    logRequests = False  # noqa: N815 - named by the standard library

    def __init__(self, api: SlaveApi) -> None:
        super().__init__(allow_none=True)
        self._api = api
        self._lock = threading.Lock()
        self._log_once = LogOnce()
        #: The oldest first.
        self._connections: dict[socket.socket, None] = {}
        #: Of the connection that a thread serves: the other end's address, and this one's.
        self._ends = threading.local()
        for name, method in (
            ("getBusStats", lambda _: api.bus_stats()),
            ("getBusInfo", lambda _: api.bus_info()),
            ("getMasterUri", lambda _: api.master_uri()),
            ("getPid", lambda _: os.getpid()),
            ("getSubscriptions", lambda _: api.subscribed()),
            ("getPublications", lambda _: api.published()),
            ("shutdown", self._shutdown),
            ("paramUpdate", self._parameter_changed),
            ("publisherUpdate", self._publishers_changed),
            ("requestTopic", self._request_topic),
        ):
            self.register_function(_answering(name, method), name)

    def accept(self, sock: socket.socket, address: str) -> None:
        """Serve a connection; of far too many the oldest is cut, so that the master gets through.

        In the loop's thread.
        """
        with self._lock:
            crowded = len(self._connections) >= _MAX_CONNECTIONS
            if crowded:
                oldest = next(iter(self._connections))
                del self._connections[oldest]
                with suppress(OSError):
                    oldest.shutdown(socket.SHUT_RDWR)  # its thread ends
            self._connections[sock] = None
        if crowded and self._log_once.is_first("crowded"):
            text = "%s: the node's API has more than %d connections, the oldest are cut"
            _log.warning(text, address, _MAX_CONNECTIONS)
        try:
            self.process_request(sock, address)
        except RuntimeError:  # no more threads
            _log.warning("%s: refused, there are too many threads", address)
            self.shutdown_request(sock)

    def close(self) -> None:
        """End the connections; safe to call twice."""
        with self._lock:
            for sock in self._connections:
                with suppress(OSError):
                    # What is being answered may go out; its thread ends at the next call.
                    sock.shutdown(socket.SHUT_RD)

    def _marshaled_dispatch(self, data: Any, *_: Any, **__: Any) -> Any:
        try:
            arguments, method = parse_xml(data)
            answer: Any = (self._dispatch(method or "", arguments),)
        except Exception as error:
            answer = xmlrpc.client.Fault(1, f"{type(error).__name__}: {error}")
        return xmlrpc.client.dumps(answer, methodresponse=True, allow_none=True).encode()

    # -- what socketserver asks ------------------------------------------------------------------

    def finish_request(self, request: Any, client_address: Any) -> None:
        """Serve a connection until it ends; on its own thread."""
        self._ends.addresses = tuple(
            _plain(place[0]) for place in (request.getpeername(), request.getsockname())
        )
        _Handler(request, client_address, self)  # type: ignore[arg-type]

    def shutdown_request(self, request: Any) -> None:
        """Close a connection."""
        with self._lock:
            self._connections.pop(request, None)
            with suppress(OSError):
                request.shutdown(socket.SHUT_WR)
            request.close()

    def handle_error(self, *_: Any) -> None:
        """Log, instead of writing to standard error: somebody went away, or sent garbage."""
        _log.debug("a call of the node's API failed", exc_info=True)

    # -- calls -----------------------------------------------------------------------------------

    def _shutdown(self, caller: object, reason: object = "") -> int:
        peer, own = self._ends.addresses
        # Debian names a machine 127.0.1.1, to which others connect from 127.0.0.1.
        here = peer == own or is_loopback(peer)
        if not here and peer not in _addresses(self._api.master_uri()):
            if self._log_once.is_first(("shutdown", peer)):
                text = "%s at %s wanted to end this node: only its own and the master's host may"
                _log.warning(text, caller, peer)
            raise ValueError(f"taken from this node's own and the master's host, not from {peer}")
        self._api.shut_down(_text(caller, "caller_id"), _text(reason, "msg"))
        return 0

    def _parameter_changed(self, caller: object, name: object, value: Any) -> int:
        _text(caller, "caller_id")
        self._api.parameter_changed(_text(name, "parameter_key"), value)
        return 0

    def _publishers_changed(self, caller: object, topic: object, uris: object) -> int:
        _text(caller, "caller_id")
        if not isinstance(uris, list):
            raise TypeError("publishers is no list")
        self._api.publishers_changed(
            _text(topic, "topic"), [_text(uri, "publishers") for uri in uris]
        )
        return 0

    def _request_topic(self, caller: object, topic: object, protocols: object) -> list[Any]:
        _text(caller, "caller_id")
        if not isinstance(protocols, list):
            raise TypeError("protocols is no list")
        return self._api.request_topic(_text(topic, "topic"), protocols)


def _addresses(uri: str) -> set[str]:
    """Return the addresses of a URI's host; none where it is not known."""
    found: list[Any] = []
    with suppress(OSError, UnicodeError, ValueError):
        found = socket.getaddrinfo(urlsplit(uri).hostname, None)
    return {_plain(str(one[4][0])) for one in found}


def _plain(address: str) -> str:
    """Return an address as IPv4 has it, where a socket of IPv6 shows one of these."""
    return address.removeprefix("::ffff:")


def _text(value: object, what: str) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{what} is no text, but {reprlib.repr(value)}")
    return value


def _answering(name: str, method: Callable[..., Any]) -> Callable[..., list[Any]]:
    """Return `method` with its answers as ROS has them."""

    def answer(*arguments: Any) -> list[Any]:
        try:
            return [1, "", method(*arguments)]
        except (TypeError, ValueError, KeyError) as error:
            return [-1, f"{name}: {error.args[0] if error.args else error}", 0]
        except Exception as error:
            _log.exception("%s failed", name)
            return [0, f"{name} failed: {error}", 0]

    return answer


_PROTOCOL = "TCPROS"
#: What rospy, too, says where nobody counts.
_UNKNOWN = -1
#: XML-RPC has 32 bits for a number.
_MAX_INT = 2**31 - 1


class NodeApi:
    """The slave API of a node.

    Args:
        core: The node.
        topics: Its topics.
        parameter_changed: Called with the name of a parameter that was subscribed to.
    """

    def __init__(
        self, core: TcprosCore, topics: Topics, parameter_changed: Callable[[str], None]
    ) -> None:
        self._core, self._topics, self._parameter_changed = core, topics, parameter_changed

    def bus_info(self) -> list[list[Any]]:
        """Return the connections, as ``rosnode info`` shows them."""
        found: list[list[Any]] = []
        for topic, publication in self._topics.published().items():
            for link in publication.links():
                peer = link.header.get("callerid", link.peer)
                found.append([len(found) + 1, peer, "o", _PROTOCOL, topic, True, link.info])
        for topic, shared in self._topics.subscribed().items():
            for source in shared.links():
                # The publisher's URI: rosnode and rqt_graph find the node by it.
                told = [len(found) + 1, source.uri, "i", _PROTOCOL, topic, source.connected]
                found.append([*told, source.info])
        return found

    def bus_stats(self) -> list[Any]:
        """Return statistics of publishers, subscriptions and services."""
        publishers = [
            [topic, _UNKNOWN, [[n, _UNKNOWN, _UNKNOWN, True] for n, _ in enumerate(p.links(), 1)]]
            for topic, p in self._topics.published().items()
        ]
        subscriptions = [
            [
                topic,
                [
                    [n, min(source.received, _MAX_INT), _UNKNOWN, _UNKNOWN, source.connected]
                    for n, source in enumerate(shared.links(), 1)
                ],
            ]
            for topic, shared in self._topics.subscribed().items()
        ]
        return [publishers, subscriptions, []]

    def master_uri(self) -> str:
        """Return the master's URI."""
        return self._core.master.uri

    def published(self) -> list[list[str]]:
        """Return topic and type of all that is published."""
        return [[t, ros1_name(p.type.name)] for t, p in sorted(self._topics.published().items())]

    def subscribed(self) -> list[list[str]]:
        """Return topic and type of all that is subscribed."""
        return [[t, i.type_name] for t, i in sorted(self._topics.subscribed().items())]

    def shut_down(self, caller: str, reason: str) -> None:
        """End the node, because somebody else says so: another one has its name now."""
        self._core.shut_down(caller, reason)

    def parameter_changed(self, name: str, value: Any) -> None:  # noqa: ARG002 - it may be old
        """Look at a parameter that was subscribed to."""
        self._parameter_changed(name)

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        """Take the publishers that a topic has now."""
        shared = self._topics.subscribed().get(topic)
        if shared is not None:
            shared.on_publishers_changed(uris)

    def request_topic(self, topic: str, protocols: list[Any]) -> list[Any]:
        """Return how to connect to a published topic.

        Raises:
            KeyError: It is not published here.
            ValueError: None of the protocols is TCPROS.
        """
        if not self._topics.serves(topic):
            raise KeyError(f"{self._core.name} does not publish {topic}")
        asked = [one[0] if isinstance(one, list) and one else one for one in protocols]
        if _PROTOCOL not in asked:
            names = ", ".join(one if isinstance(one, str) else reprlib.repr(one) for one in asked)
            raise ValueError(
                f"{self._core.name} speaks {_PROTOCOL} only, not {names or 'nothing'}; "
                "let the subscriber ask for it, too"
            )
        return [_PROTOCOL, *self._core.address]
