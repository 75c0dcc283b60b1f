"""A topic that a node publishes: one registration, and the connections of its subscribers."""

from __future__ import annotations

import itertools
import logging
import struct
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Any

from rosglass.comm import Durability, EndpointInfo, EndpointKind, History, NodeName
from rosglass.comm.inbox import INBOX_LIMIT
from rosglass.comm.wire import Writer
from rosglass.errors import ConversionError, DefinitionConflictError, UnsupportedError
from rosglass.interfaces import ros1_name
from rosglass.messages import OpaqueType
from rosglass.wires.tcpros.connection import ANY, Frame
from rosglass.wires.tcpros.graph import split
from rosglass.wires.tcpros.registrations import Member

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import QoS
    from rosglass.messages import MessageType
    from rosglass.wires.tcpros.connection import Connection
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.master import Master

    Buffer = bytes | bytearray | memoryview

__all__ = ["Publication", "PublicationWriter", "definition_text"]

_log = logging.getLogger("rosglass.ros1")
_SUBSCRIPTION = EndpointKind.SUBSCRIPTION
#: Largest message that ROS 1 nodes accept, in bytes.
_MAX_MESSAGE_BYTES = 1_000_000_000
#: How long a subscriber is reported as slow after it lost messages, and between two counts.
_SLOW_S = 10.0
#: How long queued messages may still be sent after the topic's last publisher was closed.
_FLUSH_TIMEOUT_S = 1.0
#: Most connections that end between two polls and are reported one by one.
_MAX_ENDED = 100
#: How long a connected subscriber may be missing in the master's graph.
_LISTED_AFTER_S = 5.0
_uint32 = struct.Struct("<I")


class Publication(Member):
    """The node's registration of a topic, shared by its publishers of that topic.

    Args:
        core: The node.
        topic: Absolute topic name.
        type: The message type.
        current: Returns the topic's publication as of now, None if it is not published.

    Attributes:
        writers: The writers of its publishers.
        numbers: The sequence numbers of messages that begin with a header.
    """

    lists_node = True

    def __init__(
        self,
        core: TcprosCore,
        topic: str,
        type: MessageType,
        current: Callable[[], Publication | None],
    ) -> None:
        self.topic, self.type = topic, type
        self.endpoint = (EndpointKind.PUBLISHER, topic)
        self._core, self._current = core, current
        #: Guards the connections and latched messages: each subscriber gets each message once.
        self._lock = threading.Lock()
        self.numbers = itertools.count(1)
        self.writers: list[PublicationWriter] = []
        self._links: list[Connection] = []
        #: The last message of each latched publisher.
        self._latched: dict[PublicationWriter, Frame] = {}
        self._closed = False
        #: Messages lost by connections that have ended.
        self._lost_before = 0
        #: By connection, its lost messages when it was reported last, the time, and the report.
        self._slow: dict[Connection, tuple[int, float, str]] = {}
        #: Refused subscribers: the reason and the time.
        self._refused: dict[str, tuple[str, float]] = {}

    # -- subscribers -----------------------------------------------------------------------------

    def connected(self) -> list[EndpointInfo]:
        """Return the subscribers that are connected."""
        return self._endpoints(self.links())

    def changes(self, writer: PublicationWriter) -> list[list[EndpointInfo]]:
        """Return the connected subscribers after each change since a writer's last call."""
        with self._lock:
            looks = [*writer.before, self._links.copy()]
            writer.before.clear()
        return [self._endpoints(links) for links in looks]

    def lost(self) -> int:
        """Return how many messages were dropped because a subscriber is slow."""
        with self._lock:
            return self._lost_before + sum(link.lost for link in self._links)

    def problem(self) -> str:
        """Return why subscribers were refused, and which are too slow."""
        return "; ".join([*self._refusals(), *self._losses()])

    def links(self) -> list[Connection]:
        """Return the subscribers' connections."""
        with self._lock:
            return list(self._links)

    # -- sending ---------------------------------------------------------------------------------

    def send(self, writer: PublicationWriter, parts: Sequence[Buffer]) -> None:
        """Send a message to every subscriber, without blocking.

        Args:
            writer: The writer, whose profile limits the send queues.
            parts: The message, in parts that may change afterwards.

        Raises:
            ConversionError: The message is larger than ROS 1 nodes accept.
        """
        size = sum(map(len, parts))
        if size > _MAX_MESSAGE_BYTES:
            expected = f"at most {_MAX_MESSAGE_BYTES} bytes, the largest message in ROS 1"
            raise ConversionError("", f"{size} bytes", expected, self.topic)
        latched = writer.latched
        if not latched and not self._links:
            return
        if size < 4096:
            # One part is sent faster than several.
            frame = Frame((b"".join((_uint32.pack(size), *parts)),), latched, writer.timeout)
        else:
            frame = Frame((_uint32.pack(size), *parts), latched, writer.timeout)
        if latched:
            frame.parts = [frame.rest(0)]
        keep, keep_bytes = writer.keep, writer.keep_bytes
        # Hold the lock so that a new subscriber gets the message exactly once.
        with self._lock:
            if latched:
                known = self._latched.get(writer)
                if known is not None:
                    known.kept = False
                self._latched[writer] = frame
            for link in self._links:
                link.send_frame(frame, keep, keep_bytes)

    def latched(self) -> list[memoryview]:
        """Return the last message of each latched publisher."""
        with self._lock:
            frames = list(self._latched.values())
        return [frame.rest(0)[_uint32.size :] for frame in frames]

    # -- connections, in the loop's thread -------------------------------------------------------

    def accept(self, link: Connection, header: dict[str, str]) -> str:
        """Accept a subscriber's connection; return the reason if it is refused."""
        name, md5 = ros1_name(self.type.name), self.type.md5
        # A header without type is accepted: roscpp, too, compares only the sum.
        theirs, theirs_md5 = header.get("type", ANY), header.get("md5sum", "")
        if not theirs_md5:
            return self._refuse(link, "its connection header has no md5sum")
        if theirs not in (ANY, name) or theirs_md5 not in (ANY, md5):
            given = header.get("message_definition", "").strip() or "(it sends no definition)"
            problem = (
                f"{self.topic} is {name} with md5 {md5} here, but {link.peer} subscribes to "
                f"{theirs} with md5 {theirs_md5}"
            )
            ours = definition_text(self._core.types, self.type).strip()
            return self._refuse(link, problem, f". Theirs:\n{given}\nOurs:\n{ours}")
        with self._lock:
            if self._closed:
                return f"{self.topic} is not published here any more"
            link.send_header(self.header())
            self._links.append(link)
            for frame in self._latched.values():
                link.send_frame(frame)
        self._refused.pop(link.peer, None)
        self._core.wake()
        return ""

    def header(self) -> dict[str, str]:
        """Return the connection header for subscribers; from any thread."""
        return {
            "callerid": self._core.name.full,
            "latching": "1" if any(writer.latched for writer in self.writers) else "0",
            "md5sum": self.type.md5,
            "message_definition": definition_text(self._core.types, self.type),
            "topic": self.topic,
            "type": ros1_name(self.type.name),
        }

    def drop(self, link: Connection) -> None:
        """Remove a subscriber whose connection has ended."""
        with self._lock:
            if link in self._links:
                for writer in self.writers:
                    writer.before.append(self._links.copy())
                self._links.remove(link)
                self._lost_before += link.lost
        self._core.wake()

    def _refuse(self, link: Connection, problem: str, more: str = "") -> str:
        before = self._refused.get(link.peer)
        self._refused[link.peer] = (problem + more, time.monotonic())
        if before is None:
            _log.info("%s: %s is refused: %s", self.topic, link.peer, problem)
        self._core.wake()
        return problem

    # -- as a member -----------------------------------------------------------------------------

    def join(
        self, type: MessageType, qos: QoS, on_close: Callable[[PublicationWriter], None]
    ) -> PublicationWriter:
        """Add a publisher; return its writer.

        Args:
            type: The message type.
            qos: Transient local means latched; the depth limits each subscriber's send queue.
            on_close: Called when the writer is closed.

        Raises:
            DefinitionConflictError: It publishes another type.
        """
        if type.md5 != self.type.md5 or type.name != self.type.name:
            first, second = ros1_name(self.type.name), ros1_name(type.name)
            raise DefinitionConflictError(
                f"{self._core.name} publishes {self.topic} as {first} already, and ROS 1 has one "
                f"type for a topic of a node: it cannot be {second}, too"
            )
        writer = PublicationWriter(self, type, qos, on_close)
        with self._lock:
            self.writers = [*self.writers, writer]
        return writer

    def leave(self, writer: PublicationWriter) -> bool:
        """Remove a writer; return whether it was the last one."""
        with self._lock:
            frame = self._latched.pop(writer, None)
            if frame is not None:
                frame.kept = False
            self.writers = [one for one in self.writers if one is not writer]
            return not self.writers

    def register(self, master: Master) -> None:
        """Register the publisher."""
        name = ros1_name(self.type.name)
        master.call("registerPublisher", self.topic, name, self._core.uri)

    def unregister(self, master: Master) -> None:
        """Unregister the publisher."""
        master.call("unregisterPublisher", self.topic, self._core.uri)

    def successor(self) -> Member | None:
        """Return the topic's new publication, if it is published again."""
        return self._current()

    def _refusals(self) -> list[str]:
        """Return why subscribers were refused that the master still lists."""
        now = time.monotonic()
        graph = self._core.graph
        listed = {one.node.full for one in graph.endpoints(_SUBSCRIPTION, self.topic)}
        for peer, (_, since) in self._refused.copy().items():
            if peer not in listed and now - since > _LISTED_AFTER_S:
                self._refused.pop(peer, None)
        return [reason for reason, _ in self._refused.copy().values()]

    def _losses(self) -> list[str]:
        """Return which subscribers are too slow."""
        now = time.monotonic()
        slow: dict[Connection, tuple[int, float, str]] = {}
        for link in self.links():
            reported, at, text = self._slow.get(link, (0, -_SLOW_S, ""))
            if now - at >= _SLOW_S:
                lost = link.lost
                if lost == reported:
                    text = ""
                else:
                    reported, at = lost, now
                    text = f"{link.peer} is too slow: {lost} messages were dropped"
                    if not any(writer.timeout for writer in self.writers):
                        text += " for newer ones"
            slow[link] = (reported, at, text)
        self._slow = slow
        return [text for _, _, text in slow.values() if text]

    def close(self) -> None:
        """End the connections once their queues are sent, or after 1 s; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            links, self._links = self._links, []
            self._lost_before += sum(link.lost for link in links)
            self._latched.clear()
        for link in links:
            self._core.loop.call(lambda link=link: link.finish(_FLUSH_TIMEOUT_S))  # type: ignore[misc]
        self._core.remove(self)

    def _endpoints(self, links: Sequence[Connection]) -> list[EndpointInfo]:
        return [self._endpoint(link) for link in links]

    def _endpoint(self, link: Connection) -> EndpointInfo:
        return EndpointInfo(
            _SUBSCRIPTION,
            self.topic,
            self.type.name,
            NodeName(*split(link.peer)),
            type_hash=self.type.md5,
            gid=b"%d" % link.serial,
        )

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic} [{self.type.name}]>"


class PublicationWriter(Writer):
    """The writer of one publisher of a topic.

    Args:
        publication: The node's registration of the topic.
        type: The message type.
        qos: The publisher's profile.
        on_close: Called when it is closed.

    Attributes:
        latched: Whether new subscribers receive the last message.
        keep: Most messages in the send queue of a subscriber; 0 for any number.
        keep_bytes: Most bytes in it; 0 for any number.
        timeout: Seconds after which a message in it is dropped; 0 for never.
        before: The connections before the end of each that ended since the last call of
            :meth:`changes`.
    """

    def __init__(
        self,
        publication: Publication,
        type: MessageType,
        qos: QoS,
        on_close: Callable[[PublicationWriter], None],
    ) -> None:
        self.publication, self._on_close = publication, on_close
        self.latched = qos.durability is Durability.TRANSIENT_LOCAL
        keep_all = qos.history is History.KEEP_ALL
        self.keep, self.keep_bytes = (0, INBOX_LIMIT) if keep_all else (qos.depth, 0)
        self.timeout = 0.0 if qos.send_timeout is None else qos.send_timeout.seconds
        self.before: deque[list[Connection]] = deque(maxlen=_MAX_ENDED)
        if type.has_header:
            self.number = self._number

    def write(self, data: bytes | bytearray) -> None:
        """Send a message."""
        self.publication.send(self, (data,))

    def write_parts(self, parts: Sequence[Buffer]) -> None:
        """Send a message given in parts."""
        self.publication.send(self, parts)

    def subscribers(self) -> list[EndpointInfo]:
        """Return the subscribers that are connected."""
        return self.publication.connected()

    def changes(self) -> list[list[EndpointInfo]]:
        """Return the subscribers after each change since the last call, the current ones last."""
        return self.publication.changes(self)

    def lost(self) -> int:
        """Return how many messages on the topic were dropped because a subscriber is slow."""
        return self.publication.lost()

    @property
    def problem(self) -> str:  # type: ignore[override]
        """Why some subscribers miss messages, in words; empty if none does."""
        return self.publication.problem()

    def assert_liveliness(self) -> None:
        """Raise UnsupportedError: ROS 1 has no liveliness."""
        raise UnsupportedError(
            f"{self.publication.topic}: ROS 1 has no liveliness; publishers show that they live "
            "by sending"
        )

    def close(self) -> None:
        """Stop sending; safe to call twice."""
        self._on_close(self)

    def _number(self, parts: Sequence[Buffer]) -> Sequence[Buffer]:
        """Set ``header.seq`` to the topic's next sequence number."""
        number = _uint32.pack(next(self.publication.numbers) & 0xFFFFFFFF)
        return (number, memoryview(parts[0])[_uint32.size :], *parts[1:])


def definition_text(types: Any, message_type: MessageType) -> str:
    """Return a type's full definition; that of an opaque type as it was received."""
    return message_type.text if isinstance(message_type, OpaqueType) else types.text(message_type)
