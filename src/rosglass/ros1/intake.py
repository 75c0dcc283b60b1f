"""What a node subscribes to on one topic: one registration, and the publishers' connections."""

from __future__ import annotations

import logging
import socket
import threading
import time
from typing import TYPE_CHECKING, Any

from rosglass.errors import ConnectionLostError, ConversionError, MasterError
from rosglass.ros1.connection import Connection
from rosglass.ros1.core import Member
from rosglass.ros1.master import call_node, reason_of
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from rosglass.ros1.core import Core
    from rosglass.ros1.master import Master
    from rosglass.ros1.reading import Reading

__all__ = ["Intake", "Link"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds between attempts to reach a publisher, the first and the longest.
_RETRY, _LONGEST_RETRY = 0.5, 5.0


class Link:
    """A publisher of the topic, as long as the master names it; all in the loop's thread.

    Args:
        intake: Whom it belongs to.
        uri: The publisher's API.

    Attributes:
        header: What the publisher said of itself; empty before it is connected.
        problem: Why it is not connected; empty when it is, or about to be.
        latched: The last message of a publisher that latches.
    """

    def __init__(self, intake: Intake, uri: str) -> None:
        self.intake, self.uri = intake, uri
        self.header: dict[str, str] = {}
        self.problem = ""
        self.latched: bytes | bytearray | None = None
        self._core = intake.core
        self._connection: Connection | None = None
        self._gone = False
        self._delay = _RETRY
        self._begin()

    @property
    def name(self) -> str:
        """The publishing node's full name, or its URI as long as that is not known."""
        return self.header.get("callerid", "") or self.uri

    @property
    def connected(self) -> bool:
        """Whether messages can come."""
        return bool(self.header)

    def end(self) -> None:
        """Forget the publisher."""
        self._gone = True
        if self._connection is not None:
            self._connection.end("")

    def _begin(self) -> None:
        if not self._gone and not self._core.closed:
            self._core.errands.run(self._ask)

    def _ask(self) -> None:
        """Ask the publisher where to connect; on a thread that may wait."""
        topic = self.intake.topic
        try:
            answer = call_node(self.uri, "requestTopic", self._core.name.full, topic, [["TCPROS"]])
            address = _address(answer, f"{self.uri} for {topic}")
        except (ConnectionLostError, MasterError, ConversionError) as error:
            reason = str(error)
            self._core.loop.call(lambda: self._fail(reason))
        else:
            self._core.loop.call(lambda: self._connect(address))

    def _connect(self, address: tuple[str, int]) -> None:
        if self._gone:
            return
        header = {
            "callerid": self._core.name.full,
            "md5sum": ANY,
            "tcp_nodelay": "1",
            "topic": self.intake.topic,
            "type": ANY,
        }
        self._connection = Connection.dial(
            self._core.loop, address, header, self._on_header, self._on_frame, self._fail
        )

    def _on_header(self, header: dict[str, str]) -> None:
        self.header, self.problem, self._delay = header, "", _RETRY
        self.intake.greet(self)

    def _on_frame(self, data: bytes | bytearray, _: int) -> None:
        received = time.time_ns()
        if self.header.get("latching") == "1":
            self.latched = data
        for reading in self.intake.readings:
            reading.take(self, data, received)

    def _fail(self, reason: str) -> None:
        """Try again later: the master names it still."""
        self._connection, self.header, self.latched = None, {}, None
        if self._gone or self._core.closed:
            return
        self.problem = reason
        self.intake.part(self)
        self._core.loop.after(self._delay, self._begin)
        self._delay = min(_LONGEST_RETRY, 2 * self._delay)


class Intake(Member):
    """A topic that the node subscribes to, shared by its subscriptions of that topic.

    Args:
        core: The node.
        topic: Absolute topic name.
        type_name: What the master is told, ``pkg/Type``; ``*`` for any.
    """

    def __init__(self, core: Core, topic: str, type_name: str) -> None:
        self.core, self.topic = core, topic
        self.type_name = type_name
        self._lock = threading.Lock()
        #: Replaced, never changed: the loop's thread goes through it for each message.
        self.readings: tuple[Reading, ...] = ()
        self._links: dict[str, Link] = {}
        self._closed = False

    def links(self) -> list[Link]:
        """Return the publishers, from any thread."""
        return list(self._links.values())

    def join(self, reading: Reading) -> None:
        """Feed a subscription from now on, with latched messages first; from any thread."""
        self.core.loop.call(lambda: self._join(reading))

    def _join(self, reading: Reading) -> None:
        self.readings = (*self.readings, reading)
        for link in self.links():
            if link.connected:
                reading.meet(link)
                if link.latched is not None:
                    reading.take(link, link.latched, time.time_ns())

    def leave(self, reading: Reading) -> bool:
        """Feed a subscription no more; return whether it was the last one."""
        with self._lock:
            self.readings = tuple(one for one in self.readings if one is not reading)
            return not self.readings

    def greet(self, link: Link) -> None:
        """Let the subscriptions know that a publisher is connected."""
        for reading in self.readings:
            reading.meet(link)
        self.core.wake()

    def part(self, link: Link) -> None:
        """Let the subscriptions know that a publisher is not connected any more."""
        _log.debug("%s: %s: %s", self.topic, link.uri, link.problem)
        self.core.wake()

    def publishers_changed(self, uris: list[str]) -> None:
        """Connect with who is new, and forget who has gone; from any thread."""
        self.core.loop.call(lambda: self._take_publishers(uris))

    def _take_publishers(self, uris: list[str]) -> None:
        if self._closed:
            return
        for uri in self._links.keys() - set(uris):
            self._links.pop(uri).end()
        for uri in uris:
            if uri not in self._links:
                self._links[uri] = Link(self, uri)
        self.core.wake()

    # -- as a member -----------------------------------------------------------------------------

    def register(self, master: Master) -> None:
        """Tell the master, and connect with the publishers it names."""
        uris: Any = master.call("registerSubscriber", self.topic, self.type_name, self.core.uri)
        self.publishers_changed([str(uri) for uri in uris])

    def unregister(self, master: Master) -> None:
        """Tell the master that it is subscribed here no more."""
        master.call("unregisterSubscriber", self.topic, self.core.uri)

    def follow(self, moved: bool, idle: bool) -> None:
        """Let the subscriptions tell what has changed."""
        for reading in self.readings:
            reading.follow(moved, idle)

    def close(self) -> None:
        """End the connections."""
        if self._closed:
            return
        self._closed = True
        self.core.loop.call(self._end)
        self.core.remove(self)

    def _end(self) -> None:
        for link in self._links.values():
            link.end()
        self._links.clear()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic}>"


def _address(answer: Any, place: str) -> tuple[str, int]:
    """Return the resolved address in an answer to requestTopic.

    Raises:
        MasterError: It offers no TCPROS.
        ConnectionLostError: The host is not known here.
    """
    if not (isinstance(answer, (list, tuple)) and len(answer) >= 3 and answer[0] == "TCPROS"):
        raise MasterError(f"{place} offers no TCPROS, but {answer!r:.80}")
    host, port = str(answer[1]), answer[2]
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, OverflowError, TypeError) as error:
        raise ConnectionLostError(
            f"{place} says to connect to {host}:{port}, but {reason_of(error)}: set ROS_IP or "
            "ROS_HOSTNAME for that node to what this machine knows, or add the name to /etc/hosts"
        ) from error
    return str(found[0][4][0]), int(found[0][4][1])
