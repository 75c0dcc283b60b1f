"""Calls of the master and other nodes: XML-RPC with timeouts and checked answers.

APIs: ROS wiki, "ROS/Master_API", "ROS/Parameter Server API", "ROS/Slave_API": each answer is
``[code, status message, value]``, the code 1 for success.
"""

from __future__ import annotations

import http.client
import itertools
import math
import reprlib
import socket
import sys
import threading
import time
import xmlrpc.client
from contextlib import nullcontext, suppress
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError, ParserCreate

from rosglass.errors import ConnectionLostError, ConversionError, MasterError

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Master", "TooManyElementsError", "call_node", "parse_xml", "reason_of"]

#: Seconds that a peer may take to answer.
_TIMEOUT_S = 5.0
#: Longest accepted answer in bytes, far above the largest robot's parameters.
_MAX_ANSWER_BYTES = 64 * 2**20
_READ_BYTES = 256 * 1024
_SUCCESS = 1
#: Levels of lists and namespaces that a parameter may have, far above any written by hand.
_MAX_DEPTH = 100
#: XML elements that other peers than the master may send at once: 30,000 values of a parameter.
_MAX_ELEMENTS = 100_000
#: Parsing keeps Python busy: texts of a hundred peers, parsed at once, would stop the interface.
_parsing = threading.Lock()
#: Bytes that are parsed at once: no other thread runs until then. A tag or comment is parsed again
#: with each part that belongs to it.
_PART_BYTES = 64 * 1024
_MAX_TAG_BYTES = 4 * _PART_BYTES
#: Errors of a kept connection that the peer has closed.
_STALE = (http.client.RemoteDisconnected, ConnectionResetError, BrokenPipeError)


class TooManyElementsError(ExpatError):
    """A call or answer has more XML elements than are parsed."""


def parse_xml(data: bytes, max_elements: int = _MAX_ELEMENTS) -> tuple[tuple[Any, ...], str | None]:
    """Return the values of an XML-RPC call or answer, and the method's name.

    Unlike :func:`xmlrpc.client.loads`, it refuses document types, in any encoding: their entities
    can be made to fill the memory.

    Args:
        data: The text.
        max_elements: XML elements that it may have.

    Raises:
        TooManyElementsError: It has more elements.
        ExpatError: It is not XML, or has a document type.
        xmlrpc.client.Fault: It is a fault.
        Exception: It is not XML-RPC; the library raises all kinds of errors.
    """
    target = xmlrpc.client.Unmarshaller()
    target.xml("", None)  # the parser decodes the strings
    parser = ParserCreate()
    parser.buffer_text = True  # else each line is one more call
    count = itertools.count(1)

    def start(tag: str, attributes: dict[str, str]) -> None:
        if next(count) > max_elements:
            raise TooManyElementsError(f"more than {max_elements} XML elements")
        target.start(tag, attributes)

    parser.StartElementHandler, parser.EndElementHandler = start, target.end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = target.data, _refuse_document_type
    with _parsing if max_elements < sys.maxsize else nullcontext():
        for begin in range(0, len(data), _PART_BYTES):
            parser.Parse(data[begin : begin + _PART_BYTES], False)
            if begin - parser.CurrentByteIndex > _MAX_TAG_BYTES:
                raise ExpatError(f"a tag or comment of more than {_MAX_TAG_BYTES} bytes")
        parser.Parse(b"", True)
        return target.close(), target.getmethodname()


def _refuse_document_type(*_: object) -> None:
    raise ExpatError("a document type, which can be made to fill the memory")


class _Socket(socket.socket):
    """A socket whose calls all end at one deadline, however slowly the peer sends.

    Attributes:
        deadline: Monotonic time.
    """

    deadline = math.inf

    def recv_into(self, *arguments: Any) -> int:
        """Receive; raises TimeoutError after the deadline."""
        self._limit()
        return super().recv_into(*arguments)

    def sendall(self, *arguments: Any) -> None:
        """Send; raises TimeoutError after the deadline."""
        self._limit()
        super().sendall(*arguments)

    def connect(self, *arguments: Any) -> None:
        """Connect; raises TimeoutError after the deadline."""
        self._limit()
        super().connect(*arguments)

    def _limit(self) -> None:
        left = self.deadline - time.monotonic()
        if left <= 0:
            raise TimeoutError
        self.settimeout(left)


class _Connection(http.client.HTTPConnection):
    """An HTTP connection that another thread can abort, even while it is connecting.

    Attributes:
        aborted: Whether it was aborted.
        ends: This machine's and the peer's address, once it has been connected.
        sock: Its socket, while it is connected.
    """

    aborted = False
    ends: tuple[str, str] | None = None
    sock: _Socket
    _deadline = 0.0

    def set_deadline(self, deadline: float) -> None:
        """Set the deadline of all calls from now on, in monotonic time."""
        self._deadline = deadline
        if self.sock is not None:
            self.sock.deadline = deadline

    def connect(self) -> None:
        """Connect to the first address of the host that accepts."""
        failure = OSError("the host has no address")
        for family, kind, protocol, _, place in socket.getaddrinfo(
            self.host, self.port, type=socket.SOCK_STREAM
        ):
            self.sock = sock = _Socket(family, kind, protocol)
            sock.deadline = self._deadline
            try:
                if self.aborted:
                    raise OSError("closed")
                sock.connect(place)
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self.ends = (str(sock.getsockname()[0]), str(sock.getpeername()[0]))
            except OSError as error:
                failure = error
                sock.close()
            else:
                return
        raise failure

    def abort(self) -> None:
        """Abort the call in progress, which raises an error; from any thread."""
        self.aborted = True
        with suppress(OSError, AttributeError):  # not connected
            self.sock.shutdown(socket.SHUT_RDWR)


class _Server:
    """The XML-RPC API of a node or master.

    Args:
        uri: Its URI.
        max_elements: XML elements that its answers may have.

    Raises:
        ConnectionLostError: The URI is not valid.
    """

    def __init__(self, uri: str, max_elements: int = _MAX_ELEMENTS) -> None:
        self.uri, self._max_elements = uri, max_elements
        try:
            parts = urlsplit(uri)
            host, port, scheme = parts.hostname, parts.port, parts.scheme
        except ValueError:
            host = None
        if not host or scheme != "http":
            raise ConnectionLostError(f"{uri} is not the URI of a ROS 1 node or master")
        self._host, self._port = host, port or http.client.HTTP_PORT
        self._path = parts.path or "/RPC2"

    def connection(self) -> _Connection:
        """Return a new connection, which connects with the first call."""
        return _Connection(self._host, self._port)

    def call(
        self, connection: _Connection, method: str, arguments: tuple[Any, ...], timeout: float
    ) -> Any:
        """Call a method and return the answer's value; raises what :func:`call_node` does."""
        try:
            body = xmlrpc.client.dumps(arguments, method).encode()
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise ConversionError(method, arguments, f"values of XML-RPC ({error})") from error
        try:
            answer = self._answer(connection, body, timeout)
        except (OSError, http.client.HTTPException, UnicodeError, OverflowError) as error:
            raise ConnectionLostError(f"{self.uri} does not answer: {reason_of(error)}") from error
        except xmlrpc.client.Fault as error:
            raise MasterError(f"{self.uri} failed at {method}: {error.faultString}") from error
        except Exception as error:  # garbage makes the parser raise all kinds of errors
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
        expected, fits = ANSWERS.get(method, _ANYTHING)
        if not fits(value):
            text = (
                f"{self.uri} answers {method}, but not as ROS 1 does: {expected} was expected, got "
                f"{reprlib.repr(value)}"
            )
            # Some node has set that parameter: the master itself works.
            raise MasterError(text) if expected is _PARAMETER[0] else ConnectionLostError(text)
        return value

    def _answer(self, connection: _Connection, body: bytes, timeout: float) -> Any:
        connection.set_deadline(time.monotonic() + timeout)
        kept = connection.sock is not None
        try:
            data = self._exchange(connection, body)
        except _STALE:
            connection.close()
            if not kept or connection.aborted:
                raise
            data = self._exchange(connection, body)
        values, _ = parse_xml(data, self._max_elements)
        return values[0]

    def _exchange(self, connection: _Connection, body: bytes) -> bytes:
        connection.request("POST", self._path, body, {"Content-Type": "text/xml"})
        with connection.getresponse() as response:
            if response.status != http.client.OK:
                raise http.client.HTTPException(f"HTTP status {response.status}")
            parts: list[bytes] = []
            size = 0
            while part := response.read1(_READ_BYTES):
                parts.append(part)
                size += len(part)
                if size > _MAX_ANSWER_BYTES:
                    raise http.client.HTTPException(
                        f"an answer of more than {_MAX_ANSWER_BYTES} bytes"
                    )
        return b"".join(parts)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _are_texts(value: Any) -> bool:
    return isinstance(value, (list, tuple)) and all(isinstance(item, str) for item in value)


def _are_pairs(value: Any) -> bool:
    return isinstance(value, (list, tuple)) and all(_are_texts(i) and len(i) == 2 for i in value)


def _is_graph(value: Any) -> bool:
    """Return whether a value is the system state: publishers, subscribers, services."""
    return (
        isinstance(value, (list, tuple))
        and len(value) == 3
        and all(isinstance(part, (list, tuple)) for part in value)
        and all(
            isinstance(i, (list, tuple)) and len(i) == 2 and _is_text(i[0]) and _are_texts(i[1])
            for part in value
            for i in part
        )
    )


def _is_shallow(value: Any) -> bool:
    """Return whether a parameter has at most :data:`_MAX_DEPTH` levels."""
    level = [value]
    for _ in range(_MAX_DEPTH):
        inner: list[Any] = []
        for item in level:
            if isinstance(item, dict):
                inner += item.values()
            elif isinstance(item, (list, tuple)):
                inner += item
        if not inner:
            return True
        level = inner
    return False


#: The expected value of a method's answer, in words, and the check for it.
_Answer = tuple[str, "Callable[[Any], bool]"]
_TEXT: _Answer = ("a string", _is_text)
_TEXTS: _Answer = ("a list of strings", _are_texts)
_NUMBER: _Answer = ("an integer", lambda value: isinstance(value, int))
_PARAMETER: _Answer = (f"a value of at most {_MAX_DEPTH} levels", _is_shallow)
#: For methods whose answers have no meaning.
_ANYTHING: _Answer = ("anything", lambda _: True)
ANSWERS: dict[str, _Answer] = {
    "getParam": _PARAMETER,
    "getParamNames": _TEXTS,
    "getPid": _NUMBER,
    "getSystemState": ("lists of publishers, subscribers and services", _is_graph),
    "getTopicTypes": ("a list of topics with their types", _are_pairs),
    "hasParam": ("true or false", lambda value: isinstance(value, int)),
    "lookupNode": _TEXT,
    "lookupService": _TEXT,
    "registerSubscriber": _TEXTS,
    "requestTopic": ("a list", lambda value: isinstance(value, (list, tuple))),
    "searchParam": _TEXT,
    "subscribeParam": _PARAMETER,
}


def call_node(uri: str, method: str, *arguments: Any, timeout: float = _TIMEOUT_S) -> Any:
    """Call a method of a node or the master and return the answer's value.

    Raises:
        ConnectionLostError: There is no answer, or it is not of the method's form.
        MasterError: The answer says that the call failed.
        ConversionError: XML-RPC cannot carry the arguments.
    """
    server = _Server(uri)
    connection = server.connection()
    try:
        return server.call(connection, method, arguments, timeout)
    finally:
        connection.close()


def reason_of(error: BaseException) -> str:
    """Return the reason of a network error in a few words."""
    if isinstance(error, (socket.gaierror, UnicodeError)):
        return "its host name is unknown on this machine"
    if isinstance(error, TimeoutError):
        return "no answer in time"
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


class Master:
    """The master's API, called in the name of one node; calls block until they are answered.

    Args:
        uri: The master's, such as ``http://robot:11311``.
        caller: The node's full name.

    Attributes:
        reached_from: This machine's address as of the last connection; empty before the first.
        reached_at: The master's address as of the last connection.
    """

    def __init__(self, uri: str, caller: str) -> None:
        self.uri, self.caller = uri, caller
        self.reached_from = self.reached_at = ""
        self._server = _Server(uri, max_elements=sys.maxsize)  # all parameters are one answer
        #: At most one connection is kept: a new one each second would cost the master a thread
        #: each. Any thread calls; every use of these is atomic.
        self._idle: list[_Connection] = []
        self._busy: set[_Connection] = set()
        self._closed = False

    def call(self, method: str, *arguments: Any, timeout: float = _TIMEOUT_S) -> Any:
        """Call a method with the node's name first; raises what :func:`call_node` does."""
        connection = self._server.connection()
        with suppress(IndexError):  # none is idle: a new one is used
            connection = self._idle.pop()
        self._busy.add(connection)  # before `_closed` is read, which close() sets first
        answered = False
        try:
            if self._closed:
                raise ConnectionLostError(f"{self.uri} is not called any more: the node is closed")
            value = self._server.call(connection, method, (self.caller, *arguments), timeout)
            answered = True
            return value
        except MasterError:
            answered = True
            raise
        finally:
            self._put_back(connection, answered)

    def close(self) -> None:
        """Abort the calls in progress, and refuse others; safe to call twice, from any thread."""
        self._closed = True
        for connection in list(self._busy):
            connection.abort()
        while self._idle:
            self._idle.pop().close()

    def _put_back(self, connection: _Connection, answered: bool) -> None:
        if connection.ends:
            self.reached_from, self.reached_at = connection.ends
        self._busy.discard(connection)
        if answered and not self._idle and not self._closed:
            self._idle.append(connection)
        else:
            connection.close()
