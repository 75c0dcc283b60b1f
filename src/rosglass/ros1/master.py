"""Calling the master and other nodes: XML-RPC with time-outs, and answers that are checked.

APIs: ROS wiki, "ROS/Master_API", "ROS/Parameter Server API", "ROS/Slave_API": each answer is
``[code, status message, value]``, the code 1 for success.
"""

from __future__ import annotations

import http.client
import reprlib
import socket
import threading
import time
import xmlrpc.client
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

from rosglass.errors import ConnectionLostError, ConversionError, MasterError

__all__ = ["Master", "call_node", "reason_of"]

#: Seconds that somebody may take to answer.
_TIMEOUT = 5.0
#: Longest answer in bytes; the largest robot's parameters are far below it.
_MOST_BYTES = 64 * 2**20
_CHUNK = 256 * 1024
_SUCCESS = 1
#: How the other end of a connection that was kept shows that it has closed it meanwhile.
_STALE = (http.client.RemoteDisconnected, ConnectionResetError, BrokenPipeError)


class _Connection(http.client.HTTPConnection):
    """An HTTP connection that another thread can cut, even while it is being made.

    Attributes:
        cut: Whether it was cut.
    """

    cut = False

    def connect(self) -> None:
        """Connect to the first address of the host that answers."""
        failure = OSError("the host has no address")
        for family, kind, protocol, _, place in socket.getaddrinfo(
            self.host, self.port, type=socket.SOCK_STREAM
        ):
            self.sock = sock = socket.socket(family, kind, protocol)
            try:
                if self.cut:
                    raise OSError("closed")
                sock.settimeout(self.timeout)
                sock.connect(place)
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            except OSError as error:
                failure = error
                sock.close()
            else:
                return
        raise failure

    def end_now(self) -> None:
        """Cut it: whoever waits for an answer gets an error; from any thread."""
        self.cut = True
        with suppress(OSError, AttributeError):
            self.sock.shutdown(socket.SHUT_RDWR)


class _Server:
    """Somebody's XML-RPC API.

    Args:
        uri: Where it is.

    Raises:
        ConnectionLostError: That is no address.
    """

    def __init__(self, uri: str) -> None:
        self.uri = uri
        try:
            parts = urlsplit(uri)
            host, port, scheme = parts.hostname, parts.port, parts.scheme
        except ValueError:
            host = None
        if not host or scheme != "http":
            raise ConnectionLostError(f"{uri} is no address of a ROS 1 node or master")
        self._host, self._port = host, port or http.client.HTTP_PORT
        self._path = parts.path or "/RPC2"

    def connection(self) -> _Connection:
        """Return a connection, which is not made yet."""
        return _Connection(self._host, self._port)

    def call(
        self, connection: _Connection, method: str, arguments: tuple[Any, ...], timeout: float
    ) -> Any:
        """Call a method and return the value of the answer; errors of :func:`call_node`."""
        try:
            body = xmlrpc.client.dumps(arguments, method).encode()
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise ConversionError(method, arguments, f"what XML-RPC carries ({error})") from error
        try:
            answer = self._answer(connection, body, timeout)
        except (OSError, http.client.HTTPException, UnicodeError, OverflowError) as error:
            raise ConnectionLostError(f"{self.uri} does not answer: {reason_of(error)}") from error
        except xmlrpc.client.Fault as error:
            raise MasterError(f"{self.uri} failed at {method}: {error.faultString}") from error
        except Exception as error:  # the parser raises whatever garbage leads to
            raise ConnectionLostError(
                f"{self.uri} answers, but not as ROS 1 does: {error}"
            ) from error
        shape = isinstance(answer, (list, tuple)) and len(answer) == 3
        if not shape or type(answer[0]) is not int:
            raise ConnectionLostError(
                f"{self.uri} answers, but not as ROS 1 does: {reprlib.repr(answer)}"
            )
        code, message, value = answer
        if code != _SUCCESS:
            raise MasterError(f"{self.uri} refuses {method}: {message}")
        return value

    def _answer(self, connection: _Connection, body: bytes, timeout: float) -> Any:
        connection.timeout = timeout
        kept = connection.sock is not None
        try:
            data = self._exchange(connection, body, timeout)
        except _STALE:
            connection.close()
            if not kept or connection.cut:
                raise
            data = self._exchange(connection, body, timeout)
        if b"<!DOCTYPE" in data:
            raise ExpatError("a document type, which can be made to fill the memory")
        values, _ = xmlrpc.client.loads(data)
        return values[0]

    def _exchange(self, connection: _Connection, body: bytes, timeout: float) -> bytes:
        deadline = time.monotonic() + timeout
        if connection.sock is not None:
            connection.sock.settimeout(timeout)
        connection.request("POST", self._path, body, {"Content-Type": "text/xml"})
        sock = connection.sock
        with connection.getresponse() as response:
            if response.status != http.client.OK:
                raise http.client.HTTPException(f"HTTP status {response.status}")
            parts: list[bytes] = []
            size = 0
            while part := response.read1(_CHUNK):
                parts.append(part)
                size += len(part)
                left = deadline - time.monotonic()
                if size > _MOST_BYTES:
                    raise http.client.HTTPException(f"an answer of more than {_MOST_BYTES} bytes")
                if left <= 0:
                    raise TimeoutError
                sock.settimeout(left)
        return b"".join(parts)


def call_node(uri: str, method: str, *arguments: Any, timeout: float = _TIMEOUT) -> Any:
    """Call a method of a node or the master and return the value it answers.

    Raises:
        ConnectionLostError: Nobody answers there, or what is no ROS.
        MasterError: The answer is that it failed.
        ConversionError: The arguments cannot be sent.
    """
    server = _Server(uri)
    connection = server.connection()
    try:
        return server.call(connection, method, arguments, timeout)
    finally:
        connection.close()


def reason_of(error: BaseException) -> str:
    """Return an error of the network in a few words."""
    if isinstance(error, (socket.gaierror, UnicodeError)):
        return "its host name is not known on this machine"
    if isinstance(error, TimeoutError):
        return "no answer in time"
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


class Master:
    """The master's APIs, called as one node; each call waits for its answer.

    Args:
        uri: The master's, such as ``http://robot:11311``.
        caller: The node's full name.

    Attributes:
        reached_from: This machine's address as of the last connection; empty before the first.
    """

    def __init__(self, uri: str, caller: str) -> None:
        self.uri, self.caller = uri, caller
        self.reached_from = ""
        self._server = _Server(uri)
        self._lock = threading.Lock()
        #: One connection is kept: a new one each second would cost the master a thread each.
        self._idle: _Connection | None = None
        self._busy: set[_Connection] = set()
        self._closed = False

    def call(self, method: str, *arguments: Any, timeout: float = _TIMEOUT) -> Any:
        """Call a method, the node's name in front; errors as of :func:`call_node`."""
        with self._lock:
            if self._closed:
                raise ConnectionLostError(f"{self.uri} is not asked any more: the node is closed")
            connection, self._idle = self._idle, None
            if connection is None:
                connection = self._server.connection()
            self._busy.add(connection)
        answered = False
        try:
            value = self._server.call(connection, method, (self.caller, *arguments), timeout)
            answered = True
            return value
        except MasterError:
            answered = True
            raise
        finally:
            self._put_back(connection, answered)

    def close(self) -> None:
        """End the calls under way, and refuse others; safe to call twice, from any thread."""
        with self._lock:
            self._closed = True
            busy, idle = list(self._busy), self._idle
            self._idle = None
        for connection in busy:
            connection.end_now()
        if idle is not None:
            idle.close()

    def _put_back(self, connection: _Connection, answered: bool) -> None:
        if connection.sock is not None:
            with suppress(OSError):
                self.reached_from = str(connection.sock.getsockname()[0])
        with self._lock:
            self._busy.discard(connection)
            if answered and self._idle is None and not self._closed:
                self._idle = connection
                return
        connection.close()
