"""A node's published and subscribed topics, each registered once."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from dataclasses import replace
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind, QoS
from rosglass.comm.subscription import SubscriptionFeed
from rosglass.errors import Error, TypeNotFoundError
from rosglass.interfaces import ros1_name
from rosglass.wires.tcpros.connection import ANY
from rosglass.wires.tcpros.publication import Publication
from rosglass.wires.tcpros.topic_subscription import (
    TopicSubscription,
    TypeNegotiation,
    UnreachableLog,
    ask_publisher,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import EndpointInfo, NodeName, Subscription
    from rosglass.messages import MessageType
    from rosglass.wires.tcpros.connection import Connection
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.publication import PublicationWriter

__all__ = ["Topics"]

#: How long a publisher may take for each answer.
_ANSWER_TIMEOUT_S = 5.0


class Topics:
    """A node's publications and subscriptions, by topic.

    Args:
        core: The node.
    """

    def __init__(self, core: TcprosCore) -> None:
        self._core, self._unreachable = core, UnreachableLog(core.loop, core.pool)
        #: Guards which endpoint of a topic is the first one, and which the last.
        self._lock = threading.Lock()
        self._publications: dict[str, Publication] = {}
        #: Handlers for the subscribers of topics that are not published yet.
        self._subscriber_handlers: dict[str, Callable[[Connection, dict[str, str]], str]] = {}
        self._subscribed: dict[str, TopicSubscription] = {}
        core.create_writer = self.create_writer

    def create_writer(self, endpoint: EndpointInfo, type: MessageType) -> PublicationWriter:
        """Register a publisher and return its writer.

        Raises:
            DefinitionConflictError: The node publishes another type there.
            TypeNotFoundError: The type is opaque, and comes without md5 sum.
        """
        topic = endpoint.name
        if not type.md5:
            raise TypeNotFoundError(
                f"{topic} cannot be published as {type.name} without definition or md5 sum: "
                "subscribers compare the md5 sum; give the type of a "
                "received sample, or OpaqueType(name, md5, ros=1)"
            )
        with self._lock:
            publication = self._publications.get(topic)
            new = publication is None
            if publication is None:
                publication = Publication(
                    self._core, topic, type, lambda: self._publications.get(topic)
                )
            writer = publication.join(type, endpoint.qos, self._end_writer)
            self._publications[topic] = publication
        if new:
            self._core.add(publication)
        return writer

    def subscribe(
        self, subscription: Subscription, ignore_local: bool, type_name: str = ""
    ) -> None:
        """Register a subscription and receive its messages.

        Args:
            subscription: The subscription.
            ignore_local: Whether to ignore this node's own publishers.
            type_name: The requested type if its definition is unknown here.
        """
        topic = subscription.topic
        with self._lock:
            shared = self._subscribed.get(topic)
            new = shared is None
            if shared is None:
                message_type = subscription.type
                name = ANY if message_type is None else ros1_name(message_type.name)
                name = ros1_name(type_name) if type_name else name
                shared = self._subscribed[topic] = TopicSubscription(
                    self._core,
                    topic,
                    name,
                    self._unreachable,
                    lambda: self._subscribed.get(topic),
                    lambda: self.latched(topic),
                )
            matching = TypeNegotiation(
                self._core, shared, type_name, ignore_local, self._end_subscription
            )
            SubscriptionFeed(self._core, subscription, matching)
        if new:
            self._core.add(shared)
        elif self._core.closed:
            subscription.close()
            self._core.check_open()

    def accept(self, link: Connection, header: dict[str, str]) -> str:
        """Accept a subscriber's connection; return the reason if it is refused."""
        topic = header.get("topic", "")
        publication, handler = self._publications.get(topic), self._subscriber_handlers.get(topic)
        if publication is not None:
            return publication.accept(link, header)
        if handler is not None:
            return handler(link, header)
        return f"{self._core.name} does not publish {header.get('topic')}"

    def set_subscriber_handler(
        self, topic: str, accept: Callable[[Connection, dict[str, str]], str] | None
    ) -> None:
        """Set the handler for subscribers of a topic while it is not published.

        Args:
            topic: Absolute topic name.
            accept: Called with a connection and its header; returns the reason if it refuses. None
                to remove the handler.
        """
        if accept is None:
            self._subscriber_handlers.pop(topic, None)
        else:
            self._subscriber_handlers[topic] = accept

    def serves(self, topic: str) -> bool:
        """Return whether subscribers of a topic may connect."""
        return topic in self._publications or topic in self._subscriber_handlers

    def drop(self, link: Connection) -> None:
        """Remove a subscriber's connection that has ended."""
        publication = self._publications.get(link.header.get("topic", ""))
        if publication is not None:
            publication.drop(link)

    def publishers(self, topic: str) -> list[EndpointInfo]:
        """Return a topic's publishers in the graph, with the data of their connections' headers."""
        ends = self._core.graph.endpoints(EndpointKind.PUBLISHER, topic)
        return [_described(end, self._known(topic, end.node)) for end in ends]

    def ask_publishers(self, topic: str, timeout: float | None) -> list[EndpointInfo]:
        """Return a topic's publishers with the headers that they send when asked; waits for them.

        Publishers that do not answer in time are returned as by :meth:`publishers`.

        Args:
            topic: Absolute topic name.
            timeout: Seconds to wait in all; None for the limit of each answer.
        """
        limit = _ANSWER_TIMEOUT_S if timeout is None else min(timeout, _ANSWER_TIMEOUT_S)
        ends = self._core.graph.endpoints(EndpointKind.PUBLISHER, topic)
        headers: dict[NodeName, dict[str, str]] = {}
        answers: SimpleQueue[tuple[NodeName, dict[str, str]]] = SimpleQueue()

        def ask(node: NodeName) -> None:
            header = {}
            with suppress(Error):  # it is listed without its header
                header = self.header(topic, node, limit)
            answers.put((node, header))

        for end in ends:
            self._core.pool.run(lambda node=end.node: ask(node))  # type: ignore[misc]
        until = None if timeout is None else time.monotonic() + timeout
        with suppress(Empty):  # the time is up
            for _ in ends:
                wait = None if until is None else max(0.0, until - time.monotonic())
                node, header = answers.get(timeout=wait)
                headers[node] = header
        return [_described(end, headers.get(end.node, {})) for end in ends]

    def header(self, topic: str, node: NodeName, timeout: float) -> dict[str, str]:
        """Return the connection header with which a node publishes a topic; waits for it.

        Raises:
            MasterError: The node is unknown, or does not publish the topic.
            ConnectionLostError: It does not answer, or refuses.
        """
        return self._known(topic, node) or ask_publisher(self._core, topic, node.full, timeout)

    def _known(self, topic: str, node: NodeName) -> dict[str, str]:
        """Return the header of a connected or own publisher; empty for others."""
        publication, shared = self._publications.get(topic), self._subscribed.get(topic)
        if node == self._core.name:
            return {} if publication is None else publication.header()
        for link in shared.links() if shared is not None else ():
            if link.connected and link.name == node.full:
                return link.header
        return {}

    def latched(self, topic: str) -> list[memoryview]:
        """Return the last message of each latched publisher of a topic."""
        publication = self._publications.get(topic)
        return [] if publication is None else publication.latched()

    def published(self) -> dict[str, Publication]:
        """Return the publications, by topic."""
        return dict(self._publications)

    def subscribed(self) -> dict[str, TopicSubscription]:
        """Return the subscriptions, by topic."""
        return dict(self._subscribed)

    def _end_writer(self, writer: PublicationWriter) -> None:
        publication = writer.publication
        with self._lock:
            last = publication.leave(writer)
            if last and self._publications.get(publication.topic) is publication:
                del self._publications[publication.topic]
        if last:
            publication.close()

    def _end_subscription(self, negotiation: TypeNegotiation) -> None:
        shared = negotiation.topic
        with self._lock:
            last = shared.leave(negotiation)
            if last and self._subscribed.get(shared.topic) is shared:
                del self._subscribed[shared.topic]
        if last:
            shared.close()


def _described(end: EndpointInfo, header: dict[str, str]) -> EndpointInfo:
    qos = QoS.latched() if header.get("latching") == "1" else end.qos
    return replace(end, type_hash=header.get("md5sum", ""), qos=qos)
