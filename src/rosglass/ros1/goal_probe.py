"""Learning what the goals of an action are from its server, which only subscribes to them.

Servers in Python tell the definition when they connect to a publisher, and they connect to whoever
the master says is one. Servers in C++ tell the md5 sum only.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.errors import Error
from rosglass.interfaces import ros1_name
from rosglass.ros1.core import Member

if TYPE_CHECKING:
    from rosglass.messages import MessageType
    from rosglass.ros1.connection import Connection
    from rosglass.ros1.core import Core
    from rosglass.ros1.master import Master
    from rosglass.ros1.topics import Topics

__all__ = ["GoalProbe"]

#: Subscribers that are kept waiting for an answer at most.
_MOST = 100


class GoalProbe(Member):
    """Stands in for a publisher of goals until their type is known.

    Whoever connects waits for an answer meanwhile, and gets it from the publisher that comes next.

    Args:
        core: The node.
        topics: Its topics.
        topic: The topic of the goals.
        name: Full name of their type.
    """

    def __init__(self, core: Core, topics: Topics, topic: str, name: str) -> None:
        self._core, self._topics, self._topic, self._name = core, topics, topic, name
        self._lock = threading.Lock()
        self._waiting: list[tuple[Connection, dict[str, str]]] = []
        self._closed = False
        topics.stand_in(topic, self._accept)
        core.add(self)

    def look(self) -> MessageType | None:
        """Return the type, None while nobody has told it."""
        with self._lock:
            headers = [header for _, header in self._waiting]
        for header in headers:
            text = header.get("message_definition", "")
            if header.get("type") == ros1_name(self._name) and text.strip():
                with suppress(Error):
                    return self._core.types.learn(self._name, header.get("md5sum", ""), text)
        return None

    def _accept(self, link: Connection, header: dict[str, str]) -> str:
        with self._lock:
            if not self._closed:
                self._waiting = [each for each in self._waiting[-_MOST:] if not each[0].closed]
                self._waiting.append((link, header))
        self._core.wake()
        return ""

    def register(self, master: Master) -> None:
        """Tell the master."""
        with self._topics.registering:
            if self._topic not in self._topics.published():
                name = ros1_name(self._name)
                master.call("registerPublisher", self._topic, name, self._core.uri)

    def unregister(self, master: Master) -> Member | None:
        """Tell the master that goals are not published here, unless they are by now."""
        with self._topics.registering:
            heir = self._topics.published().get(self._topic)
            if self._core.closed or heir is None:
                master.call("unregisterPublisher", self._topic, self._core.uri)
                return None
        return heir

    def close(self) -> None:
        """Hand over who waits; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            waiting, self._waiting = self._waiting, []
        self._topics.stand_in(self._topic, None)
        self._core.loop.call(lambda: self._hand_over(waiting))
        self._core.remove(self)

    def _hand_over(self, waiting: list[tuple[Connection, dict[str, str]]]) -> None:
        for link, header in waiting:
            reason = "" if link.closed else self._topics.accept(link, header)
            if reason:
                link.send_header({"error": reason})
                link.finish(1.0)
