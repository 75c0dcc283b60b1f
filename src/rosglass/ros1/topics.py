"""A node's topics: which it publishes and subscribes to, each registered once."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from rosglass.interfaces import ros1_name
from rosglass.ros1.intake import Intake
from rosglass.ros1.publication import Publication
from rosglass.ros1.publisher import Ros1Publisher
from rosglass.ros1.reading import Reading
from rosglass.ros1.types import ANY

if TYPE_CHECKING:
    from rosglass.comm import QoS, Subscription
    from rosglass.messages import MessageType
    from rosglass.ros1.connection import Connection
    from rosglass.ros1.core import Core

__all__ = ["Topics"]


class Topics:
    """Publications and intakes by topic.

    Args:
        core: The node.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self._lock = threading.Lock()
        self._publications: dict[str, Publication] = {}
        self._intakes: dict[str, Intake] = {}

    def publish(self, topic: str, type: MessageType, qos: QoS) -> Ros1Publisher:
        """Return a new publisher of a topic.

        Raises:
            DefinitionConflictError: The node publishes another type there.
        """
        with self._lock:
            publication = self._publications.get(topic)
            new = publication is None
            if publication is None:
                publication = Publication(self._core, topic, type)
            made = Ros1Publisher(publication, type, qos, self._end_publisher, self._core.dispatcher)
            publication.join(made)
            self._publications[topic] = publication
        if new:
            self._core.add(publication)
        return made

    def subscribe(self, subscription: Subscription, ignore_local: bool) -> None:
        """Feed a subscription from now on."""
        topic = subscription.topic
        with self._lock:
            intake = self._intakes.get(topic)
            new = intake is None
            if intake is None:
                kind = subscription.type
                name = ANY if kind is None else ros1_name(kind.name)
                intake = self._intakes[topic] = Intake(self._core, topic, name)
            intake.join(Reading(self._core, intake, subscription, ignore_local, self._end_reading))
        if new:
            self._core.add(intake)

    def accept(self, link: Connection, header: dict[str, str]) -> str:
        """Take a subscriber's connection; return why not, empty when it is taken."""
        publication = self._publications.get(header.get("topic", ""))
        if publication is None:
            return f"{self._core.name} does not publish {header.get('topic')}"
        return publication.accept(link, header)

    def drop(self, link: Connection) -> None:
        """Forget a subscriber's connection that has ended."""
        publication = self._publications.get(link.header.get("topic", ""))
        if publication is not None:
            publication.drop(link)

    def published(self) -> dict[str, Publication]:
        """Return what is published, by topic."""
        return dict(self._publications)

    def subscribed(self) -> dict[str, Intake]:
        """Return what is subscribed to, by topic."""
        return dict(self._intakes)

    def _end_publisher(self, publisher: Ros1Publisher) -> None:
        with self._lock:
            publication = self._publications.get(publisher.topic)
            last = publication is not None and publication.leave(publisher)
            if last:
                del self._publications[publisher.topic]
        if publication is not None and last:
            publication.close()

    def _end_reading(self, reading: Reading) -> None:
        topic = reading.subscription.topic
        with self._lock:
            intake = self._intakes.get(topic)
            last = intake is not None and intake.leave(reading)
            if last:
                del self._intakes[topic]
        if intake is not None and last:
            intake.close()
