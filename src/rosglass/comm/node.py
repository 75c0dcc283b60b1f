"""The seam between every world (ROS 1, DDS, Zenoh) and everything above it.

A world implements :class:`Node`, :class:`Publisher` and :class:`Subscription`; nothing above this
package knows which one it talks to.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, TypeVar, overload

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from rosglass.comm.graph import EndpointInfo, NodeName, Status
    from rosglass.comm.qos import QoS
    from rosglass.comm.subscription import Sample, Subscription
    from rosglass.comm.time import Time
    from rosglass.messages import Message, MessageType

__all__ = ["Executor", "Handle", "Node", "Publisher"]

_H = TypeVar("_H", bound="Handle")


class Executor(ABC):
    """Where callbacks run: a thread, an event loop, or at once in the middleware's thread."""

    @abstractmethod
    def post(self, job: Callable[[], None]) -> None:
        """Run `job` soon; called from any thread, returns without waiting."""


class Handle(ABC):
    """Something started or registered that can be ended; ends by itself as a context manager."""

    @abstractmethod
    def close(self) -> None:
        """End it; safe to call twice."""

    def __enter__(self: _H) -> _H:  # noqa: PYI019 - typing.Self needs 3.11
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class Publisher(Handle):
    """Sends messages of one type on one topic.

    Attributes:
        topic: Absolute topic name.
        type: The message type.
        qos: The quality of service offered.
    """

    topic: str
    type: MessageType
    qos: QoS

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
            NodeClosedError: The publisher is closed.
        """

    @abstractmethod
    def publish_serialized(self, data: bytes | bytearray | memoryview) -> None:
        """Send `data`, already encoded in the world's wire format, unchanged."""

    @abstractmethod
    def subscription_count(self) -> int:
        """Return how many subscriptions match this publisher now."""


class Node(Handle):
    """A participant of a ROS graph; made by :func:`rosglass.connect`.

    Attributes:
        url: The URL it was connected with.
        name: Base name.
        namespace: Absolute namespace, ``/`` for the root.
        wire: Wire format of its messages, ``cdr`` or ``ros1``.
    """

    url: str
    name: str
    namespace: str
    wire: str

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.resolve(self.name)} on {self.url}>"

    @abstractmethod
    def create_publisher(
        self, topic: str, type: str | MessageType, qos: QoS | int = 10
    ) -> Publisher:
        """Announce `topic` and return its publisher.

        Args:
            topic: Absolute, relative or private (``~name``) topic name.
            type: Type name or type.
            qos: Profile; an integer is the depth of a reliable, volatile profile.

        Raises:
            InvalidNameError: The topic name breaks ROS's rules.
            TypeNotFoundError: No definition of the type is known.
        """

    @abstractmethod
    def create_subscription(
        self,
        topic: str,
        type: str | MessageType | None = None,
        callback: Callable[[Message], None] | None = None,
        qos: QoS | int = 10,
        *,
        raw_callback: Callable[[Sample], None] | None = None,
        executor: Executor | None = None,
    ) -> Subscription:
        """Subscribe to `topic`.

        Args:
            topic: Absolute, relative or private topic name.
            type: Type name or type; None takes the type that publishers announce, as soon as
                there is one.
            callback: Called with each message, on `executor`. Without callbacks, samples wait in
                the subscription until they are taken.
            qos: Profile; an integer is the depth of a reliable, volatile profile.
            raw_callback: Called with each :class:`Sample` instead: bytes, stamps, origin.
            executor: Where callbacks run; None for the node's own dispatcher thread.

        Raises:
            InvalidNameError: The topic name breaks ROS's rules.
            TypeNotFoundError: No definition of the given type is known.
        """

    @abstractmethod
    def topics(self) -> dict[str, list[str]]:
        """Return every topic in the graph with the types announced for it."""

    @abstractmethod
    def nodes(self) -> list[NodeName]:
        """Return every node in the graph, this one included, sorted."""

    @abstractmethod
    def publishers(self, topic: str) -> list[EndpointInfo]:
        """Return the publishers of a topic."""

    @abstractmethod
    def subscriptions(self, topic: str) -> list[EndpointInfo]:
        """Return the subscriptions of a topic."""

    @abstractmethod
    def on_graph_change(
        self, callback: Callable[[], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` after nodes or endpoints appeared or went; changes may be merged."""

    @abstractmethod
    def status(self) -> Status:
        """Return the state of the connection and what is being done about it."""

    @abstractmethod
    def on_status_change(
        self, callback: Callable[[Status], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with the new status whenever it changes."""

    @abstractmethod
    def resolve(self, name: str) -> str:
        """Return the absolute name of a topic or service; raises InvalidNameError."""

    @abstractmethod
    def now(self) -> Time:
        """Return the time of the node's clock."""
