"""What a node publishes on one topic: one registration and the subscribers' connections."""

from __future__ import annotations

import logging
import struct
import threading
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, NodeName
from rosglass.errors import DefinitionConflictError
from rosglass.interfaces import ros1_name
from rosglass.ros1.core import Member
from rosglass.ros1.names import split
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.messages import MessageType
    from rosglass.ros1.connection import Connection
    from rosglass.ros1.core import Core
    from rosglass.ros1.master import Master
    from rosglass.ros1.publisher import Ros1Publisher

    Buffer = bytes | bytearray | memoryview

__all__ = ["Publication"]

_log = logging.getLogger("rosglass.ros1")
_length = struct.Struct("<I")


class Publication(Member):
    """A topic that the node publishes, shared by its publishers of that topic.

    Args:
        core: The node.
        topic: Absolute topic name.
        type: What is published on it.
    """

    def __init__(self, core: Core, topic: str, type: MessageType) -> None:
        self.topic, self.type = topic, type
        self._core = core
        self._lock = threading.Lock()
        self.publishers: list[Ros1Publisher] = []
        self._links: list[Connection] = []
        #: The last message of each latched publisher, in parts.
        self._latched: dict[Ros1Publisher, list[bytes]] = {}
        self._closed = False

    # -- who is there ----------------------------------------------------------------------------

    def connected(self) -> list[EndpointInfo]:
        """Return who is connected."""
        with self._lock:
            links = list(self._links)
        return [self._endpoint(link) for link in links]

    def lost(self) -> int:
        """Return how many messages made room for newer ones because somebody is slow."""
        with self._lock:
            return sum(link.lost for link in self._links)

    def links(self) -> list[Connection]:
        """Return the subscribers' connections."""
        with self._lock:
            return list(self._links)

    # -- sending ---------------------------------------------------------------------------------

    def send(self, publisher: Ros1Publisher, parts: Sequence[Buffer]) -> None:
        """Send a message to everybody; does not wait."""
        size = sum(memoryview(part).nbytes for part in parts)
        frame = [_length.pack(size), *parts]
        latched = [bytes(part) for part in frame] if publisher.latched else None
        # Whoever connects meanwhile must get it once: as the latched one, or as a new one.
        with self._lock:
            if latched is not None:
                self._latched[publisher] = latched
            for link in self._links:
                link.send(frame, publisher.qos.depth)

    # -- connections, in the loop's thread -------------------------------------------------------

    def accept(self, link: Connection, header: dict[str, str]) -> str:
        """Take a subscriber's connection; return why not, empty when it is taken."""
        name, md5 = ros1_name(self.type.name), self.type.md5
        theirs, theirs_md5 = header.get("type", ANY), header.get("md5sum", ANY)
        if theirs not in (ANY, name) or theirs_md5 not in (ANY, md5):
            told = header.get("message_definition", "").strip() or "(it sends no definition)"
            problem = (
                f"{self.topic} is {name} with md5 {md5} here, but {link.peer} subscribes to "
                f"{theirs} with md5 {theirs_md5}"
            )
            ours = self._core.types.text(self.type).strip()
            _log.warning("%s. Theirs:\n%s\nOurs:\n%s", problem, told, ours)
            return problem
        latched = any(publisher.latched for publisher in self.publishers)
        with self._lock:
            if self._closed:
                return f"{self.topic} is not published here any more"
            link.send_header(
                {
                    "callerid": self._core.name.full,
                    "latching": "1" if latched else "0",
                    "md5sum": md5,
                    "message_definition": self._core.types.text(self.type),
                    "topic": self.topic,
                    "type": name,
                }
            )
            self._links.append(link)
            for frame in self._latched.values():
                link.send(frame)
        self._core.wake()
        return ""

    def drop(self, link: Connection) -> None:
        """Forget a subscriber that has gone."""
        with self._lock:
            if link in self._links:
                self._links.remove(link)
        self._core.wake()

    # -- as a member -----------------------------------------------------------------------------

    def join(self, publisher: Ros1Publisher) -> None:
        """Add a publisher.

        Raises:
            DefinitionConflictError: It publishes another type.
        """
        if publisher.type.md5 != self.type.md5 or publisher.type.name != self.type.name:
            raise DefinitionConflictError(
                f"{self._core.name} publishes {self.topic} as {self.type.name} already, and ROS 1 "
                f"has one type for a topic of a node: it cannot be {publisher.type.name}, too"
            )
        self.publishers.append(publisher)

    def leave(self, publisher: Ros1Publisher) -> bool:
        """Remove a publisher; return whether it was the last one."""
        with self._lock:
            self._latched.pop(publisher, None)
        if publisher in self.publishers:
            self.publishers.remove(publisher)
        return not self.publishers

    def register(self, master: Master) -> None:
        """Tell the master."""
        name = ros1_name(self.type.name)
        master.call("registerPublisher", self.topic, name, self._core.uri)

    def unregister(self, master: Master) -> None:
        """Tell the master that it is published here no more."""
        master.call("unregisterPublisher", self.topic, self._core.uri)

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - connections come by themselves
        """Tell the publishers who is connected."""
        for publisher in list(self.publishers):
            publisher.tell()

    def close(self) -> None:
        """End the connections once what waits is sent, or a second later."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            links, self._links = self._links, []
            self._latched.clear()
        for link in links:
            self._core.loop.call(lambda link=link: link.finish(1.0))  # type: ignore[misc]
        self._core.remove(self)

    def _endpoint(self, link: Connection) -> EndpointInfo:
        node = NodeName(*split(link.header.get("callerid", "") or link.peer))
        return EndpointInfo(
            EndpointKind.SUBSCRIPTION,
            self.topic,
            self.type.name,
            node,
            type_hash=self.type.md5,
            gid=b"%d" % id(link),
        )

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic} [{self.type.name}]>"
