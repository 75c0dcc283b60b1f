"""A received message before anyone looked into it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.time import Time

if TYPE_CHECKING:
    from rosglass.messages import Message, MessageType

__all__ = ["Sample"]


class Sample(NamedTuple):
    """A received message before anyone looked into it.

    A tuple with plain numbers for time stamps, as one is made for each message of the fastest
    topics.

    Attributes:
        data: The bytes as received, encapsulation header included; big ones may come as a
            read-only view of the middleware's own buffer.
        wire: Their format, ``cdr`` or ``ros1``.
        type: Their type; an :class:`OpaqueType` when no definition of it could be had.
        received_ns: System time of reception, nanoseconds since the Unix epoch. Of subscriptions
            that nobody waits for, up to a tenth of a second late.
        sent_ns: Time the publisher stamped it with, by the publisher's clock; None when the world
            does not say.
        publisher: Identity of the publisher, empty when the world does not say.
        sequence: The publisher's running number, -1 when the world does not say.
    """

    data: bytes | memoryview
    wire: str
    type: MessageType
    received_ns: int
    sent_ns: int | None = None
    publisher: bytes = b""
    sequence: int = -1

    @property
    def received(self) -> Time:
        """:attr:`received_ns` as a Time."""
        return Time(self.received_ns)

    @property
    def sent(self) -> Time | None:
        """:attr:`sent_ns` as a Time; None when the world does not say."""
        return None if self.sent_ns is None else Time(self.sent_ns)

    def __reduce__(self) -> tuple[Any, ...]:
        return Sample, (bytes(self.data), *self[1:])

    def message(self) -> Message:
        """Return the message; fields are decoded when they are read.

        Raises:
            DecodeError: The bytes are no message of the type.
            TypeNotFoundError: The type is opaque; the message says why.
        """
        return self.type.decode(self.data, wire=self.wire)
