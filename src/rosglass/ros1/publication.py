"""What a node publishes on one topic: one registration and the subscribers' connections."""

from __future__ import annotations

import itertools
import logging
import struct
import threading
import time
from collections import deque
from typing import TYPE_CHECKING

from rosglass.comm import EndpointInfo, EndpointKind, History, NodeName
from rosglass.comm.inbox import INBOX_LIMIT
from rosglass.comm.similar import similar
from rosglass.errors import DefinitionConflictError
from rosglass.interfaces import ros1_name
from rosglass.ros1.core import Member
from rosglass.ros1.definitions import definition_text
from rosglass.ros1.names import split
from rosglass.ros1.outgoing import Frame
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.messages import MessageType
    from rosglass.ros1.connection import Connection
    from rosglass.ros1.core import Core
    from rosglass.ros1.master import Master
    from rosglass.ros1.publisher import Ros1Publisher
    from rosglass.ros1.topics import Topics

    Buffer = bytes | bytearray | memoryview

__all__ = ["Publication"]

_log = logging.getLogger("rosglass.ros1")
_SUBSCRIPTION = EndpointKind.SUBSCRIPTION
#: Seconds for which a subscriber counts as slow after it lost messages, and between two counts.
_SLOW = 10.0
#: Seconds that what waits may still be sent when nobody publishes any more.
_FAREWELL = 1.0
#: Subscribers between two looks, come and gone, that listeners are informed of at most.
_MAX_BRIEF = 100
#: Seconds until the master's list shows a subscriber for certain.
_SETTLED = 5.0
_length = struct.Struct("<I")


class Publication(Member):
    """A topic that the node publishes, shared by its publishers of that topic.

    Args:
        core: The node.
        topics: The node's topics.
        topic: Absolute topic name.
        type: What is published on it.

    Attributes:
        numbers: What messages that begin with a header are numbered with.
    """

    def __init__(self, core: Core, topics: Topics, topic: str, type: MessageType) -> None:
        self.topic, self.type = topic, type
        self._core, self._topics = core, topics
        self._lock = threading.Lock()
        self.numbers = itertools.count(1)
        self.publishers: list[Ros1Publisher] = []
        self._links: list[Connection] = []
        #: Those of them that the last look has found.
        self._found: set[Connection] = set()
        #: What `_links` was when one left that no look had found.
        self._brief: deque[list[Connection]] = deque(maxlen=_MAX_BRIEF)
        #: The last message of each latched publisher.
        self._latched: dict[Ros1Publisher, Frame] = {}
        self._closed = False
        #: What those lost that are gone.
        self._lost_before = 0
        #: How much each link had lost when it was told of last, when, and how.
        self._slow: dict[Connection, tuple[int, float, str]] = {}
        #: Who was refused, why, and when.
        self._refused: dict[str, tuple[str, float]] = {}

    # -- who is there ----------------------------------------------------------------------------

    def connected(self) -> list[EndpointInfo]:
        """Return who is connected."""
        return self._endpoints(self.links())

    def lost(self) -> int:
        """Return how many messages made room for newer ones because somebody is slow."""
        with self._lock:
            return self._lost_before + sum(link.lost for link in self._links)

    def links(self) -> list[Connection]:
        """Return the subscribers' connections."""
        with self._lock:
            return list(self._links)

    def hint(self) -> str:
        """Say what may be wrong when nobody subscribes; empty when somebody does."""
        graph = self._core.graph
        if self._links or graph.endpoints(_SUBSCRIPTION, self.topic):
            return ""
        wanted = [name for name in graph.topics() if graph.endpoints(_SUBSCRIPTION, name)]
        return f"nobody subscribes to {self.topic}{similar(self.topic, wanted)}"

    # -- sending ---------------------------------------------------------------------------------

    def send(self, publisher: Ros1Publisher, parts: Sequence[Buffer]) -> None:
        """Send a message to everybody; does not wait.

        Args:
            publisher: Who sends; its profile tells how many messages may wait.
            parts: The message, which may change afterwards.
        """
        latched = publisher.latched
        if not latched and not self._links:
            return
        size = sum(map(len, parts))
        if size < 4096:
            # One part is handed to the system sooner than several.
            frame = Frame((b"".join((_length.pack(size), *parts)),), latched)
        else:
            frame = Frame((_length.pack(size), *parts), latched)
        if latched:
            frame.parts = [frame.rest(0)]
        qos = publisher.qos
        keep_all = qos.history is History.KEEP_ALL
        keep, keep_bytes = (0, INBOX_LIMIT) if keep_all else (qos.depth, 0)
        # Whoever connects meanwhile must get it once: as the latched one, or as a new one.
        with self._lock:
            if latched:
                known = self._latched.get(publisher)
                if known is not None:
                    known.kept = False
                self._latched[publisher] = frame
            for link in self._links:
                link.send_frame(frame, keep, keep_bytes)

    def latched(self) -> list[memoryview]:
        """Return the last message of each latched publisher."""
        with self._lock:
            frames = list(self._latched.values())
        return [frame.rest(0)[_length.size :] for frame in frames]

    # -- connections, in the loop's thread -------------------------------------------------------

    def accept(self, link: Connection, header: dict[str, str]) -> str:
        """Take a subscriber's connection; return why not, empty when it is taken."""
        name, md5 = ros1_name(self.type.name), self.type.md5
        # roscpp goes by the sum alone, too: who leaves the type out is understood.
        theirs, theirs_md5 = header.get("type", ANY), header.get("md5sum", "")
        if not theirs_md5:
            return self._refuse(link, "its connection header has no md5sum")
        if theirs not in (ANY, name) or theirs_md5 not in (ANY, md5):
            told = header.get("message_definition", "").strip() or "(it sends no definition)"
            problem = (
                f"{self.topic} is {name} with md5 {md5} here, but {link.peer} subscribes to "
                f"{theirs} with md5 {theirs_md5}"
            )
            ours = definition_text(self._core.types, self.type).strip()
            return self._refuse(link, problem, f". Theirs:\n{told}\nOurs:\n{ours}")
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
        """Return what subscribers are told when they connect; from any thread."""
        return {
            "callerid": self._core.name.full,
            "latching": "1" if any(publisher.latched for publisher in self.publishers) else "0",
            "md5sum": self.type.md5,
            "message_definition": definition_text(self._core.types, self.type),
            "topic": self.topic,
            "type": ros1_name(self.type.name),
        }

    def drop(self, link: Connection) -> None:
        """Forget a subscriber that has gone."""
        with self._lock:
            if link in self._links:
                if link not in self._found:
                    self._brief.append(self._links.copy())
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

    def join(self, publisher: Ros1Publisher) -> None:
        """Add a publisher.

        Raises:
            DefinitionConflictError: It publishes another type.
        """
        if publisher.type.md5 != self.type.md5 or publisher.type.name != self.type.name:
            first, second = ros1_name(self.type.name), ros1_name(publisher.type.name)
            raise DefinitionConflictError(
                f"{self._core.name} publishes {self.topic} as {first} already, and ROS 1 has one "
                f"type for a topic of a node: it cannot be {second}, too"
            )
        with self._lock:
            self.publishers = [*self.publishers, publisher]

    def leave(self, publisher: Ros1Publisher) -> bool:
        """Remove a publisher; return whether it was the last one."""
        with self._lock:
            frame = self._latched.pop(publisher, None)
            if frame is not None:
                frame.kept = False
            self.publishers = [one for one in self.publishers if one is not publisher]
            return not self.publishers

    @property
    def place(self) -> tuple[EndpointKind, str]:  # type: ignore[override]
        """As what the master shows it."""
        return EndpointKind.PUBLISHER, self.topic

    def register(self, master: Master) -> None:
        """Tell the master."""
        name = ros1_name(self.type.name)
        with self._topics.registering:
            master.call("registerPublisher", self.topic, name, self._core.uri)

    def unregister(self, master: Master) -> Member | None:
        """Tell the master that it is published here no more, unless it is again."""
        with self._topics.registering:
            heir = self._topics.published().get(self.topic)
            if self._core.closed or heir is None:
                master.call("unregisterPublisher", self.topic, self._core.uri)
                return None
        return heir

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - connections come by themselves
        """Tell the publishers who is connected, and who is in trouble."""
        problem = "; ".join([*self._refusals(), *self._losses()])
        with self._lock:
            looks = [*self._brief, self._links.copy()]
            self._brief.clear()
            self._found = set(self._links)
        for links in looks:
            connected = self._endpoints(links)
            for publisher in self.publishers:
                publisher.follow(connected, problem)

    def _refusals(self) -> list[str]:
        """Return why some are refused that still want to subscribe."""
        now = time.monotonic()
        graph = self._core.graph
        there = {one.node.full for one in graph.endpoints(_SUBSCRIPTION, self.topic)}
        for peer, (_, since) in self._refused.copy().items():
            if peer not in there and now - since > _SETTLED:
                self._refused.pop(peer, None)
        return [told for told, _ in self._refused.copy().values()]

    def _losses(self) -> list[str]:
        """Return who is too slow."""
        now = time.monotonic()
        slow: dict[Connection, tuple[int, float, str]] = {}
        for link in self.links():
            told, at, text = self._slow.get(link, (0, -_SLOW, ""))
            if now - at >= _SLOW:
                lost = link.lost
                if lost == told:
                    text = ""
                else:
                    told, at = lost, now
                    text = f"{link.peer} is too slow: {lost} messages made room for newer ones"
            slow[link] = (told, at, text)
        self._slow = slow
        return [text for _, _, text in slow.values() if text]

    def close(self) -> None:
        """End the publishers, and the connections once what waits is sent, or a second later."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            links, self._links = self._links, []
            publishers = self.publishers
            self._lost_before += sum(link.lost for link in links)
            self._latched.clear()
        for publisher in publishers:
            publisher.close()
        for link in links:
            self._core.loop.call(lambda link=link: link.finish(_FAREWELL))  # type: ignore[misc]
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
