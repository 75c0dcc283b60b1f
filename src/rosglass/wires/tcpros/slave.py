"""The slave API: a node's answers to the master, other nodes and tools such as ``rosnode``.

API: ROS wiki, "ROS/Slave_API"; getBusStats and getBusInfo as ``rosnode info`` reads them, and as
rosgraph's ``graph.py`` and rospy fill them.
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
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from rosglass.comm.log_limits import LogOnce
from rosglass.interfaces import ros1_name
from rosglass.wires.tcpros.address import is_loopback
from rosglass.wires.tcpros.master import TooManyElementsError, parse_xml

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.topics import Topics

__all__ = ["Slave"]


_log = logging.getLogger("rosglass.ros1")
#: Longest call in bytes: a changed parameter is sent as a whole.
_MAX_CALL_BYTES = 64 * 2**20
#: Connections at a time; the master and each tool have one.
_MAX_CONNECTIONS = 100
_PROTOCOL = "TCPROS"
#: Stands for figures that are not counted, as in rospy.
_NOT_COUNTED = -1
#: XML-RPC has 32 bits for a number.
_MAX_INT = 2**31 - 1


class _Handler(xmlrpc.server.SimpleXMLRPCRequestHandler):
    protocol_version = "HTTP/1.1"
    rpc_paths = ()
    #: Seconds without a call after which a connection is closed.
    timeout = 30
    #: Small answers must not wait for the peer's acknowledgement of the header.
    disable_nagle_algorithm = True
    server: Slave  # type: ignore[assignment]

    def log_message(self, *_: Any) -> None:
        """Write nothing to standard error."""

    def do_POST(self) -> None:  # noqa: N802 - named by the standard library
        """Answer a call, unless its length is missing or absurd."""
        length = self.headers.get("content-length", "")
        if not (length.isascii() and length.isdecimal()) or int(length) > _MAX_CALL_BYTES:
            self.send_error(400, "no content length, or too large")
            self.close_connection = True
            return
        if self.headers.get("content-encoding", "identity") != "identity":
            self.send_error(501, "content encodings are not supported")
            self.close_connection = True
            return
        super().do_POST()

    def _dispatch(self, method: str, arguments: tuple[Any, ...]) -> list[Any]:
        return self.server.call(method, arguments, self.connection)


class Slave(socketserver.ThreadingMixIn):
    """A node's slave API, each connection on a daemon thread of its own.

    Args:
        core: The node.
        topics: Its topics.
        on_parameter_changed: Called with the name of a subscribed parameter that has changed.
    """

    daemon_threads = True
    block_on_close = False
    #: Read by the request handler.
    logRequests = False  # noqa: N815 - named by the standard library

    def __init__(
        self, core: TcprosCore, topics: Topics, on_parameter_changed: Callable[[str], None]
    ) -> None:
        self._core, self._topics = core, topics
        self._on_parameter_changed = on_parameter_changed
        #: Guards the connections: none is shut down whose descriptor is closed, and may be reused.
        self._lock = threading.Lock()
        self._log_once = LogOnce()
        #: The oldest first.
        self._connections: dict[socket.socket, None] = {}
        self._methods: dict[str, Callable[..., Any]] = {
            "getBusStats": self._bus_stats,
            "getBusInfo": self._bus_info,
            "getMasterUri": lambda _: core.master.uri,
            "getPid": lambda _: os.getpid(),
            "getSubscriptions": self._subscriptions,
            "getPublications": self._publications,
            "shutdown": self._shutdown,
            "paramUpdate": self._update_parameter,
            "publisherUpdate": self._update_publishers,
            "requestTopic": self._request_topic,
        }

    def accept(self, sock: socket.socket, address: str) -> None:
        """Serve a connection; too many make room by the oldest, so that the master gets through.

        In the loop's thread.
        """
        with self._lock:
            crowded = len(self._connections) >= _MAX_CONNECTIONS
            if crowded:
                oldest = next(iter(self._connections))
                del self._connections[oldest]
                with suppress(OSError):  # its caller was faster
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
                with suppress(OSError):  # its caller was faster
                    # An answer in progress may go out; the thread ends at the next call.
                    sock.shutdown(socket.SHUT_RD)

    # -- called by socketserver and the request handler ------------------------------------------

    def finish_request(self, request: Any, client_address: Any) -> None:
        """Serve a connection until it ends; on its own thread."""
        _Handler(request, client_address, self)  # type: ignore[arg-type]

    def shutdown_request(self, request: Any) -> None:
        """Close a connection."""
        with self._lock:
            self._connections.pop(request, None)
            with suppress(OSError):  # the caller was faster
                request.shutdown(socket.SHUT_WR)
            request.close()

    def handle_error(self, *_: Any) -> None:
        """Log a broken connection or garbage, instead of writing to standard error."""
        _log.debug("a call of the node's API failed", exc_info=True)

    def _marshaled_dispatch(self, data: Any, dispatch: Callable[..., Any], _: object) -> bytes:
        try:
            arguments, method = parse_xml(data)
            answer: Any = (dispatch(method or "", arguments),)
        except Exception as error:  # noqa: BLE001 - of garbage; answered to the caller
            if isinstance(error, TooManyElementsError) and self._log_once.is_first("elements"):
                _log.warning("a call of the node's API is refused: it has %s", error)
            answer = xmlrpc.client.Fault(1, f"{type(error).__name__}: {error}")
        return xmlrpc.client.dumps(answer, methodresponse=True, allow_none=True).encode()

    def call(self, name: str, arguments: tuple[Any, ...], connection: socket.socket) -> list[Any]:
        """Return the answer to a call: code, status message and value.

        Raises:
            LookupError: There is no such method.
        """
        method = self._methods.get(name)
        if method is None:
            raise LookupError(f"the slave API has no method {name!r}")
        if method in (self._shutdown, self._update_publishers):
            arguments = (connection, *arguments)
        try:
            return [1, "", method(*arguments)]
        except (TypeError, ValueError, KeyError) as error:
            return [-1, f"{name}: {error.args[0] if error.args else error}", 0]
        except Exception as error:  # noqa: BLE001 - answered to the caller
            _log.exception("%s failed", name)
            return [0, f"{name} failed: {error}", 0]

    # -- the methods -----------------------------------------------------------------------------

    def _bus_info(self, _: object) -> list[list[Any]]:
        """Return the connections, as ``rosnode info`` shows them."""
        found: list[list[Any]] = []
        for topic, publication in self._topics.published().items():
            for link in publication.links():
                peer = link.header.get("callerid", link.peer)
                found.append([len(found) + 1, peer, "o", _PROTOCOL, topic, True, link.info])
        for topic, shared in self._topics.subscribed().items():
            for source in shared.links():
                # The publisher's URI: rosnode and rqt_graph find the node by it.
                row = [len(found) + 1, source.uri, "i", _PROTOCOL, topic, source.connected]
                found.append([*row, source.info])
        return found

    def _bus_stats(self, _: object) -> list[Any]:
        """Return statistics of publishers, subscriptions and services."""
        publishers = [
            [topic, _NOT_COUNTED, [[n, _NOT_COUNTED, _NOT_COUNTED, True] for n, _ in links]]
            for topic, publication in self._topics.published().items()
            for links in [enumerate(publication.links(), 1)]
        ]
        subscriptions = [
            [
                topic,
                [
                    [n, min(link.received, _MAX_INT), _NOT_COUNTED, _NOT_COUNTED, link.connected]
                    for n, link in enumerate(shared.links(), 1)
                ],
            ]
            for topic, shared in self._topics.subscribed().items()
        ]
        return [publishers, subscriptions, []]

    def _publications(self, _: object) -> list[list[str]]:
        published = self._topics.published()
        return [[topic, ros1_name(one.type.name)] for topic, one in sorted(published.items())]

    def _subscriptions(self, _: object) -> list[list[str]]:
        subscribed = self._topics.subscribed()
        return [[topic, one.type_name] for topic, one in sorted(subscribed.items())]

    def _shutdown(self, connection: socket.socket, caller: object, reason: object = "") -> int:
        """Close the node: another one has its name now, or a user runs ``rosnode kill``."""
        peer, is_here = _peer(connection)
        if not is_here and peer not in _addresses(self._core.master.uri):
            if self._log_once.is_first(("shutdown", peer)):
                text = "%s at %s wanted to end this node: only its own and the master's host may"
                _log.warning(text, caller, peer)
            raise ValueError(f"taken from this node's own and the master's host, not from {peer}")
        self._core.shut_down(_text(caller, "caller_id"), _text(reason, "msg"))
        return 0

    def _update_parameter(self, caller: object, name: object, _value: object) -> int:
        # The value may be an old one: it is read again.
        _text(caller, "caller_id")
        self._on_parameter_changed(_text(name, "parameter_key"))
        return 0

    def _update_publishers(
        self, connection: socket.socket, caller: object, topic: object, uris: object
    ) -> int:
        """Connect to a topic's publishers; if the master does not call, it is asked for them."""
        _text(caller, "caller_id")
        shared = self._topics.subscribed().get(_text(topic, "topic"))
        publishers = [_text(uri, "publishers") for uri in _list(uris, "publishers")]
        if shared is None:
            return 0
        if self._is_master(connection):
            shared.on_publishers_changed(publishers)
            return 0
        shared.must_register_again = True
        peer, _ = _peer(connection)
        if self._log_once.is_first(("publisherUpdate", peer)):
            text = "%s at %s lists publishers of %s, and is not the master at %s, which is asked"
            _log.warning(text, caller, peer, topic, self._core.master.reached_at or "present")
        return 0

    def _is_master(self, connection: socket.socket) -> bool:
        """Return whether a connection comes from the master's host, as far as this node knows it.

        A master with several addresses may call from another one than it is called at.
        """
        peer, is_here = _peer(connection)
        there, here = _ipv4(self._core.master.reached_at), _ipv4(self._core.master.reached_from)
        return peer == there or (is_here and (is_loopback(there) or there == here != ""))

    def _request_topic(self, caller: object, topic: object, protocols: object) -> list[Any]:
        """Return how to connect to a published topic."""
        _text(caller, "caller_id")
        if not self._topics.serves(_text(topic, "topic")):
            raise KeyError(f"{self._core.name} does not publish {topic}")
        offered = _list(protocols, "protocols")
        asked = [one[0] if isinstance(one, list) and one else one for one in offered]
        if _PROTOCOL not in asked:
            names = ", ".join(one if isinstance(one, str) else reprlib.repr(one) for one in asked)
            raise ValueError(
                f"{self._core.name} speaks {_PROTOCOL} only, not {names or 'nothing'}; "
                "let the subscriber ask for it, too"
            )
        return [_PROTOCOL, *self._core.address]


def _peer(connection: socket.socket) -> tuple[str, bool]:
    """Return the address that a connection comes from, and whether it is this machine's."""
    peer, own = (_ipv4(end[0]) for end in (connection.getpeername(), connection.getsockname()))
    # Debian names a machine 127.0.1.1, to which others connect from 127.0.0.1.
    return peer, peer == own or is_loopback(peer)


def _addresses(uri: str) -> set[str]:
    """Return the addresses of a URI's host; none where it is unknown."""
    found: list[Any] = []
    with suppress(OSError, UnicodeError, ValueError):  # unknown, or malformed
        found = socket.getaddrinfo(urlsplit(uri).hostname, None)
    return {_ipv4(str(one[4][0])) for one in found}


def _ipv4(address: str) -> str:
    """Return an address without IPv6's prefix for mapped IPv4 addresses."""
    return address.removeprefix("::ffff:")


def _text(value: object, what: str) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{what} is not a string, but {reprlib.repr(value)}")
    return value


def _list(value: object, what: str) -> list[Any]:
    if not isinstance(value, list):
        raise TypeError(f"{what} is not a list, but {reprlib.repr(value)}")
    return value
