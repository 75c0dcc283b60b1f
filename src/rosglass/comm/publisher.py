"""Sending: a topic's publisher, the same above every world."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any, overload

from rosglass.comm.node import Handle
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.errors import UnsupportedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.events import (
        DeadlineMissed,
        IncompatibleQoS,
        LivelinessLost,
        Matched,
        PublisherEvents,
    )
    from rosglass.comm.node import Executor
    from rosglass.comm.qos import QoS
    from rosglass.comm.sample import Sample
    from rosglass.messages import Message, MessageType

__all__ = ["Publisher"]


@hint_at_members
class Publisher(Handle):
    """Sends messages of one type on one topic.

    Attributes:
        topic: Absolute topic name.
        type: The message type.
        qos: The quality of service offered; what was left open is decided.
        events: Who is told about what; None in worlds that tell nothing.
    """

    topic: str
    type: MessageType
    qos: QoS
    events: PublisherEvents | None = None

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic} [{self.type.name}]>"

    @overload
    def publish(self, message: Message | dict[str, Any], /) -> None: ...
    @overload
    def publish(self, /, **fields: Any) -> None: ...
    @abstractmethod
    def publish(self, message: Message | dict[str, Any] = ..., /, **fields: Any) -> None:
        """Send a message.

        Args:
            message: A :class:`Message`, or a dict of fields; missing fields get their defaults.
                None is refused: it is what a function that forgot its return gives.
            fields: The fields as keyword arguments, instead of `message`.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent.
            TypeNotFoundError: The type is opaque: only bytes can be sent.
            NodeClosedError: The publisher is closed.
        """

    @abstractmethod
    def publish_serialized(self, data: bytes | bytearray | memoryview | Sample) -> None:
        """Send what is encoded already in the world's wire format, unchanged.

        Args:
            data: The bytes, or a received sample to pass on.

        Raises:
            ConversionError: These are no such bytes, or the sample is of another type.
            UnsupportedError: The world cannot carry big-endian bytes, and without a definition
                they cannot be turned round.
            NodeClosedError: The publisher is closed.
        """

    @abstractmethod
    def subscription_count(self) -> int:
        """Return how many subscriptions match this publisher now."""

    @property
    def problem(self) -> str:
        """Why some subscriptions on the topic get nothing, in words; empty when all is well."""
        return ""

    @property
    def hint(self) -> str:
        """What may be wrong when nobody subscribes to the topic, e.g. a name much like it."""
        return ""

    def assert_liveliness(self) -> None:
        """Show that the publisher is alive, without sending anything.

        For publishers with manual liveliness; sending shows it as well. Zenoh cannot carry it.

        Raises:
            NodeClosedError: The publisher is closed.
        """
        raise UnsupportedError(f"{self!r} cannot show that it is alive")

    def on_matched(
        self, callback: Callable[[Matched], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when a subscription comes that matches, and when it goes.

        Those that are there already are told first.

        Args:
            callback: Told who, and how many there are now.
            executor: Where it runs; None for the node's own dispatcher thread.

        Raises:
            ConversionError: One of the arguments is not what it should be.
        """
        events = self._events()
        return events.added(events.matched.add(callback, executor or events.executor))

    def on_incompatible_qos(
        self, callback: Callable[[IncompatibleQoS], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when a subscription comes that asks for more than is offered.

        Those that are there already are told first; arguments as for :meth:`on_matched`.
        """
        events = self._events()
        return events.added(events.incompatible.add(callback, executor or events.executor))

    def on_deadline_missed(
        self, callback: Callable[[DeadlineMissed], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` each time that nothing was sent within the profile's deadline.

        Time runs from the first message. Arguments as for :meth:`on_matched`.
        """
        events = self._events()
        return events.added(events.deadline.add(callback, executor or events.executor))

    def on_liveliness_lost(
        self, callback: Callable[[LivelinessLost], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` when manual liveliness was not shown within the lease duration.

        Arguments as for :meth:`on_matched`.
        """
        events = self._events()
        return events.added(events.liveliness.add(callback, executor or events.executor))

    def on_problem_change(
        self, callback: Callable[[str], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`problem` whenever it changes; empty when all is well again.

        Arguments as for :meth:`on_matched`.
        """
        events = self._events()
        return events.added(events.problem.add(callback, executor or events.executor))

    def _events(self) -> PublisherEvents:
        if self.events is None:
            raise UnsupportedError(f"{self!r} tells nothing of itself: its world does not say it")
        return self.events
