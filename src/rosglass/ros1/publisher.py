"""Publishing on a ROS 1 topic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm import Durability, Matched, Publisher, PublisherEvents, Sample
from rosglass.errors import ConversionError, NodeClosedError

if TYPE_CHECKING:
    from rosglass.comm import QoS
    from rosglass.messages import Message, MessageType
    from rosglass.ros1.publication import Publication

__all__ = ["Ros1Publisher"]

#: Tells `publish()` from `publish(None)`.
_NO_MESSAGE: Any = object()


class Ros1Publisher(Publisher):
    """A publisher; made by :meth:`Node.create_publisher`.

    Args:
        publication: The node's registration of the topic.
        type: What it publishes.
        qos: Transient local means latched; the depth is the queue of each slow subscriber.
        on_close: Called once when it is closed.
    """

    def __init__(
        self, publication: Publication, type: MessageType, qos: QoS, on_close: Any, executor: Any
    ) -> None:
        self.topic, self.type = publication.topic, type
        self.qos = qos.for_publisher([])
        self.latched = self.qos.durability is Durability.TRANSIENT_LOCAL
        self._publication, self._on_close = publication, on_close
        self._closed = False
        self.events: PublisherEvents = PublisherEvents(executor, self.tell, self.topic)

    def publish(self, message: Message | dict[str, Any] = _NO_MESSAGE, /, **fields: Any) -> None:
        """Encode and send a message; see :meth:`rosglass.comm.Publisher.publish`."""
        if message is not _NO_MESSAGE and fields:
            raise ConversionError(
                "", fields, "either a message or keyword fields, not both", self.type.name
            )
        self._check_open()
        if message is None:
            # Most likely a function that forgot its return: it must not become a zero command.
            raise ConversionError("", None, "a message, a dict or keyword fields", self.type.name)
        value = fields if message is _NO_MESSAGE else message
        self._publication.send(self, self.type.encode_parts(value, wire="ros1"))

    def publish_serialized(self, data: bytes | bytearray | memoryview | Sample) -> None:
        """Send `data` unchanged; see :meth:`rosglass.comm.Publisher.publish_serialized`."""
        self._check_open()
        if isinstance(data, Sample):
            if data.type.name != self.type.name or data.wire != "ros1":
                raise ConversionError(
                    "", data.type.name, f"a ROS 1 sample of {self.type.name}", self.topic
                )
            data = data.data
        elif not isinstance(data, (bytes, bytearray, memoryview)):
            raise ConversionError(
                "", data, "bytes, a bytearray, a memoryview or a Sample", self.type.name
            )
        self._publication.send(self, [memoryview(data).cast("B")])

    def subscription_count(self) -> int:
        """Return how many subscribers are connected."""
        return 0 if self._closed else len(self._publication.links())

    def tell(self) -> None:
        """Tell the listeners who is connected."""
        if not self._closed and self.events.matched:
            self.events.matched.update(self._publication.connected(), Matched)

    def close(self) -> None:
        """Publish no more; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self.events.clear()
        self._on_close(self)

    def _check_open(self) -> None:
        if self._closed:
            raise NodeClosedError(f"the publisher of {self.topic} is closed; create another one")
