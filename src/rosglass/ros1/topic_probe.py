"""Asking a publisher where it is reached and what it publishes, without receiving anything.

Protocol: ROS wiki, "ROS/Slave_API" (requestTopic) and "ROS/TCPROS": a publisher tells type, md5
sum, definition and whether it latches in the header with which it answers a subscriber's.
"""

from __future__ import annotations

import socket
import struct
import time
from typing import TYPE_CHECKING

from rosglass.errors import ConnectionLostError, DecodeError, MasterError
from rosglass.ros1.header import MAX_HEADER, encode_header, parse_header
from rosglass.ros1.master import call_node, reason_of
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from rosglass.ros1.core import Core

__all__ = ["ask_publisher", "publisher_addresses", "subscriber_header"]

_CHUNK = 64 * 1024
_length = struct.Struct("<I")


def subscriber_header(caller: str, topic: str) -> dict[str, str]:
    """Return the connection header of somebody who takes whatever type a topic has."""
    return {
        "callerid": caller,
        "md5sum": ANY,
        "message_definition": "",
        "tcp_nodelay": "1",
        "topic": topic,
        "type": ANY,
    }


def publisher_addresses(
    caller: str, uri: str, topic: str, timeout: float = 5.0
) -> list[tuple[str, int]]:
    """Ask a publisher's API where to connect; waits for the answer and for the name service.

    Args:
        caller: The asking node's full name.
        uri: The publisher's API.
        topic: Absolute topic name.
        timeout: Seconds that the publisher may take.

    Returns:
        Resolved addresses and ports.

    Raises:
        MasterError: It does not publish the topic, or offers no TCPROS.
        ConnectionLostError: It does not answer, or names a host that is not known here.
    """
    answer = call_node(uri, "requestTopic", caller, topic, [["TCPROS"]], timeout=timeout)
    place = f"{uri} for {topic}"
    if not (isinstance(answer, (list, tuple)) and len(answer) >= 3 and answer[0] == "TCPROS"):
        raise MasterError(f"{place} offers no TCPROS, but {answer!r:.80}")
    host, port = str(answer[1]), answer[2]
    if type(port) is not int or not 0 < port < 65536:
        raise ConnectionLostError(f"{place} says to connect to port {port!r:.80}")
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise ConnectionLostError(
            f"{place} says to connect to {host}:{port}, but {reason_of(error)}"
        ) from error
    return list(dict.fromkeys((str(one[4][0]), int(one[4][1])) for one in found))


def ask_publisher(core: Core, topic: str, node: str, timeout: float) -> dict[str, str]:
    """Return the connection header with which a node publishes a topic; waits for it.

    Args:
        core: The asking node.
        topic: Absolute topic name.
        node: The publishing node's full name.
        timeout: Seconds that each of its answers may take.

    Raises:
        MasterError: It is not known, or does not publish the topic.
        ConnectionLostError: It does not answer, or refuses.
    """
    caller = core.name.full
    uri = str(core.master.call("lookupNode", node, timeout=timeout))
    failures = []
    for address in publisher_addresses(caller, uri, topic, timeout):
        header, failure = _try(address, subscriber_header(caller, topic), timeout)
        if "error" in header:
            raise ConnectionLostError(f"{node} refuses {topic}: {header['error']:.200}")
        if header.get("md5sum", ANY) != ANY:
            return header
        failures.append(failure or "its connection header has no md5sum")
    told = "; ".join(failures) or "it has no address"
    raise ConnectionLostError(f"{node} does not tell what it publishes on {topic}: {told}")


def _try(
    address: tuple[str, int], header: dict[str, str], timeout: float
) -> tuple[dict[str, str], str]:
    """Return the other end's header, or none and why."""
    try:
        return _exchange(address, header, timeout), ""
    except OSError as error:
        return {}, f"{address[0]}:{address[1]}: {reason_of(error)}"
    except DecodeError as error:
        return {}, str(error)


def _exchange(address: tuple[str, int], header: dict[str, str], timeout: float) -> dict[str, str]:
    """Connect, send a header, and return the other end's; raises OSError and DecodeError."""
    deadline = time.monotonic() + timeout
    with socket.create_connection(address, timeout) as sock:
        sock.sendall(encode_header(header))
        (size,) = _length.unpack(_receive(sock, _length.size, deadline))
        if size > MAX_HEADER:
            raise DecodeError("connection header", f"{size} bytes are more than any has")
        return parse_header(_receive(sock, size, deadline))


def _receive(sock: socket.socket, size: int, deadline: float) -> bytes:
    data = bytearray()
    while len(data) < size:
        sock.settimeout(max(0.001, deadline - time.monotonic()))
        part = sock.recv(min(size - len(data), _CHUNK))
        if not part:
            raise ConnectionResetError("the other end closed the connection")
        data += part
    return bytes(data)
