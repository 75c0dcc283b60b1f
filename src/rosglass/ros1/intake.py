"""What a node subscribes to on one topic: one registration, and the publishers' connections."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind
from rosglass.ros1.core import Member
from rosglass.ros1.publisher_link import PublisherLink

if TYPE_CHECKING:
    from rosglass.ros1.core import Core
    from rosglass.ros1.master import Master
    from rosglass.ros1.reading import Reading
    from rosglass.ros1.topics import Topics

__all__ = ["Intake"]

_log = logging.getLogger("rosglass.ros1")


class Intake(Member):
    """A topic that the node subscribes to, shared by its subscriptions of that topic.

    Args:
        core: The node.
        topics: The node's topics.
        topic: Absolute topic name.
        type_name: What the master is told, ``pkg/Type``; ``*`` for any.

    Attributes:
        readings: The subscriptions; replaced, never changed: the loop's thread goes through them
            for each message.
        eager: Whether somebody waits for messages.
    """

    def __init__(self, core: Core, topics: Topics, topic: str, type_name: str) -> None:
        self.core, self.topic = core, topic
        self.type_name = type_name
        self.readings: tuple[Reading, ...] = ()
        self.eager = True
        self._topics = topics
        self._lock = threading.Lock()
        self._links: dict[str, PublisherLink] = {}
        self._closed = False
        #: Which master was told of it, counted from 0, and how often one told of publishers.
        self._epoch, self._updates = -1, 0

    def links(self) -> list[PublisherLink]:
        """Return the publishers, from any thread."""
        return list(self._links.values())

    # -- subscriptions ---------------------------------------------------------------------------

    def join(self, reading: Reading) -> None:
        """Feed a subscription from now on, with latched messages first; from any thread."""
        with self._lock:
            self.readings = (*self.readings, reading)
        self.core.loop.call(lambda: self._join(reading))

    def _join(self, reading: Reading) -> None:
        for link in self.links():
            if link.connected:
                reading.meet(link, lambda link=link: self._catch_up(reading, link))  # type: ignore[misc]
        self.attend()

    def _catch_up(self, reading: Reading, link: PublisherLink) -> None:
        """Give a subscription that came late what it would have got on a connection of its own."""
        if link.uri == self.core.uri:
            for data in self._topics.latched(self.topic):
                reading.take(link, [data], time.time_ns())
        elif link.latched is not None:
            reading.take(link, [link.latched], time.time_ns())

    def leave(self, reading: Reading) -> bool:
        """Feed a subscription no more; return whether it was the last one."""
        with self._lock:
            self.readings = tuple(one for one in self.readings if one is not reading)
            return not self.readings

    def attend(self) -> None:
        """Have messages handed on as they come only while somebody waits; from any thread."""
        eager = any(one.subscription.watched for one in self.readings)
        if eager != self.eager:
            self.eager = eager
            self.core.loop.call(self._attend)

    def _attend(self) -> None:
        for link in self.links():
            link.attend(self.eager)

    def drain(self) -> None:
        """Hand on what waits in the sockets; from any thread."""
        for link in self.links():
            link.drain()

    # -- publishers, in the loop's thread --------------------------------------------------------

    def greet(self, link: PublisherLink) -> None:
        """Let the subscriptions know that a publisher is connected; it waits until they do."""
        readings = list(self.readings)
        left = len(readings) + 1

        def decided() -> None:
            nonlocal left
            left -= 1
            if not left:
                link.resume()
                link.attend(self.eager)
                self.core.wake()

        for reading in readings:
            reading.meet(link, decided)
        decided()

    def part(self, link: PublisherLink) -> None:
        """Let the subscriptions know that a publisher is not connected any more."""
        _log.debug("%s: %s", self.topic, link.problem)
        for reading in self.readings:
            reading.part(link)
        if link.epoch != self._epoch:
            # No master knows it any more: it was kept as long as it sent something.
            self._forget(link)
        self.core.wake()

    def publishers_changed(self, uris: list[str]) -> None:
        """Connect with who is new, and forget who has gone; from any thread."""
        self._updates += 1
        self.core.loop.call(lambda: self._take_publishers(uris))

    def _take_answer(self, uris: list[str], updates: int) -> None:
        # What the master told meanwhile, because it knows us now, is newer than its answer.
        if updates == self._updates:
            self._take_publishers(uris)

    def _take_publishers(self, uris: list[str]) -> None:
        if self._closed:
            return
        for uri in self._links.keys() - set(uris):
            link = self._links[uri]
            # A master that was restarted knows but those who told it: others go on publishing.
            if link.epoch == self._epoch or not link.connected:
                self._forget(link)
        for uri in uris:
            known = self._links.get(uri)
            if known is None:
                self._links[uri] = PublisherLink(self, uri, self._epoch)
            else:
                known.epoch = self._epoch
        self.core.wake()

    def _forget(self, link: PublisherLink) -> None:
        self._links.pop(link.uri, None)
        link.end()
        for reading in self.readings:
            reading.part(link)

    # -- as a member -----------------------------------------------------------------------------

    @property
    def place(self) -> tuple[EndpointKind, str]:  # type: ignore[override]
        """As what the master shows it."""
        return EndpointKind.SUBSCRIPTION, self.topic

    def lacks(self, publishers: int) -> bool:
        """Return whether fewer publishers are connected."""
        return sum(link.connected for link in self.links()) < publishers

    def register(self, master: Master) -> None:
        """Tell the master, and connect with the publishers it names."""
        self._epoch += 1
        updates = self._updates
        told: list[str] = []
        with self._topics.registering:
            told = master.call("registerSubscriber", self.topic, self.type_name, self.core.uri)
        uris = list(told)
        self.core.loop.call(lambda: self._take_answer(uris, updates))

    def unregister(self, master: Master) -> Member | None:
        """Tell the master that it is subscribed here no more, unless it is again."""
        with self._topics.registering:
            heir = self._topics.subscribed().get(self.topic)
            if self.core.closed or heir is None:
                master.call("unregisterSubscriber", self.topic, self.core.uri)
                return None
        return heir

    def follow(self, moved: bool, idle: bool) -> None:
        """Let the subscriptions tell what has changed."""
        for link in self.links():
            link.listen()
        for reading in self.readings:
            reading.follow(moved, idle)
        if idle:
            # The rate of what comes may be another one now.
            self.eager = any(one.subscription.watched for one in self.readings)
            self.core.loop.call(self._attend)

    def close(self) -> None:
        """End the subscriptions and the connections."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            readings = self.readings
        for reading in readings:
            reading.close()
        self.core.loop.call(self._end)
        self.core.remove(self)

    def _end(self) -> None:
        for link in self.links():
            link.end()
        self._links.clear()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic}>"
