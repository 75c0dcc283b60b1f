"""A topic that a node subscribes to: one registration, and the publishers' connections."""

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
    from rosglass.ros1.topics import Topics
    from rosglass.ros1.type_negotiation import TypeNegotiation

__all__ = ["TopicSubscription"]

_log = logging.getLogger("rosglass.ros1")


class TopicSubscription(Member):
    """A topic that the node subscribes to, shared by its subscriptions of that topic.

    Args:
        core: The node.
        topics: The node's topics.
        topic: Absolute topic name.
        type_name: For the master, ``pkg/Type``; ``*`` for any.

    Attributes:
        readers: One for each subscription; replaced, never changed: the loop's thread goes through
            them for each message.
        eager: Whether messages are waited for.
    """

    def __init__(self, core: Core, topics: Topics, topic: str, type_name: str) -> None:
        self.core, self.topic = core, topic
        self.type_name = type_name
        self.readers: tuple[TypeNegotiation, ...] = ()
        self.eager = True
        self._topics = topics
        self._lock = threading.Lock()
        self._links: dict[str, PublisherLink] = {}
        self._closed = False
        #: Which master knows it, counted from 0, and how often one has named publishers.
        self._epoch, self._updates = -1, 0

    def links(self) -> list[PublisherLink]:
        """Return the publishers, from any thread."""
        return list(self._links.values())

    # -- subscriptions ---------------------------------------------------------------------------

    def join(self, reader: TypeNegotiation) -> None:
        """Hand on messages to a subscription, latched ones first; from any thread."""
        with self._lock:
            self.readers = (*self.readers, reader)
        self.core.loop.call(lambda: self._join(reader))

    def _join(self, reader: TypeNegotiation) -> None:
        for link in self.links():
            if link.connected:
                reader.negotiate_type(link, lambda link=link: self._catch_up(reader, link))  # type: ignore[misc]
        self.attend()

    def _catch_up(self, reader: TypeNegotiation, link: PublisherLink) -> None:
        """Hand on what a connection of the subscription's own would have brought."""
        if link.uri == self.core.uri:
            for data in self._topics.latched(self.topic):
                reader.take(link, [data], time.time_ns())
        elif link.latched is not None:
            reader.take(link, [link.latched], time.time_ns())
        reader.feed.inform()

    def leave(self, reader: TypeNegotiation) -> bool:
        """Hand on nothing more to a subscription; return whether it was the last one."""
        with self._lock:
            self.readers = tuple(one for one in self.readers if one is not reader)
            return not self.readers

    def attend(self) -> None:
        """Hand on messages as they come only while they are waited for; from any thread."""
        eager = any(reader.eager for reader in self.readers)
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

    def inform(self) -> None:
        """Let the subscriptions' feeds look soon; from any thread."""
        for reader in self.readers:
            reader.feed.inform()

    def on_publisher_connected(self, link: PublisherLink) -> None:
        """Negotiate the type with every subscription, then resume reading."""
        readers = list(self.readers)
        left = len(readers) + 1

        def decided() -> None:
            nonlocal left
            left -= 1
            if not left:
                link.resume()
                link.attend(self.eager)
                self.inform()

        for reader in readers:
            reader.negotiate_type(link, decided)
        decided()

    def on_publisher_disconnected(self, link: PublisherLink) -> None:
        """Let the subscriptions forget a publisher."""
        _log.debug("%s: %s", self.topic, link.problem)
        for reader in self.readers:
            reader.on_publisher_disconnected(link)
        if link.epoch != self._epoch:
            # No master knows it any more: it was kept as long as it sent something.
            self._forget(link)
        self.inform()

    def on_publishers_changed(self, uris: list[str]) -> None:
        """Connect with new publishers, and forget those that have gone; from any thread."""
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
        self.inform()

    def _forget(self, link: PublisherLink) -> None:
        self._links.pop(link.uri, None)
        link.end()
        for reader in self.readers:
            reader.on_publisher_disconnected(link)

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
        for reader in self.readers:
            reader.feed.follow(moved, idle)
        if idle:
            # The rate of what comes may be another one now.
            self.core.loop.call(self._attend)

    def close(self) -> None:
        """End the subscriptions and the connections."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            readers = self.readers
        for reader in readers:
            reader.feed.close()
        self.core.loop.call(self._end)
        self.core.remove(self)

    def _end(self) -> None:
        for link in self.links():
            link.end()
        self._links.clear()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic}>"
