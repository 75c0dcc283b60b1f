"""A client's connection to a service's server, and the requests that wait for one.

Protocol: ROS wiki, "ROS/TCPROS": after the headers, a request is a frame, and its response a frame
with a byte in front that says whether all went well; the failure text is its content if not.
"""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.errors import ConnectionLostError, ConversionError
from rosglass.interfaces import ros1_name
from rosglass.ros1.connection import MAX_FRAME, Connection
from rosglass.ros1.io_loop import READ
from rosglass.ros1.service_probe import Peer

if TYPE_CHECKING:
    from rosglass.comm import Call, Handle
    from rosglass.messages import ServiceType
    from rosglass.ros1.core import Core
    from rosglass.ros1.service_probe import Place

__all__ = ["LinkOwner", "Request", "ServiceLink", "check_size"]

_length = struct.Struct("<I")


@dataclass(eq=False)
class Request:
    """A call's request.

    Attributes:
        number: Its place in the order of the calls.
        call: What the caller holds.
        value: The encoded request, or the value to encode while the type is not known.
        type: The type it is encoded for.
        made: Monotonic time of the call.
        timer: Ends the call when its time is over.
        began: Monotonic time at which a connection for it was begun, None while it waits.
        sent: Monotonic time of sending, None before.
        link: The connection it is sent through.
        refused: Whether a server that was found before this call began has refused it.
    """

    number: int
    call: Call
    value: Any
    type: ServiceType | None
    made: float
    timer: Handle | None = None
    began: float | None = None
    sent: float | None = None
    link: ServiceLink | None = None
    refused: bool = False

    def encode(self, kind: ServiceType) -> bytes:
        """Return its bytes for a type that may have been found only after the call.

        Raises:
            ConversionError: A value does not fit its field.
        """
        if self.type is not kind:
            value = self.value
            if self.type is not None:
                value = self.type.request.decode(value).to_dict()
            self.value, self.type = kind.request.encode(value), kind
            check_size(self.value, kind.request.name)
        return bytes(self.value)

    def loss(self, what: str, server: str, reason: str) -> ConnectionLostError:
        """Return the error that tells of its connection's end, after it was sent."""
        since = time.monotonic() - (self.sent or 0.0)
        return ConnectionLostError(
            f"{server} went away before it answered {what} sent {since:.1f} s ago "
            f"({reason or 'the connection was closed'}), and may have carried it out or not; look "
            "what happened, and call again"
        )


class LinkOwner(Protocol):
    """Whom a connection belongs to; called in the loop's thread."""

    def link_ready(self, link: ServiceLink, peer: Peer) -> None:
        """Take that the server has accepted the connection: a request can be sent."""

    def link_answered(self, link: ServiceLink, ok: bool, data: bytes | memoryview) -> None:
        """Take a response, or the text of a failure."""

    def link_ended(self, link: ServiceLink, reason: str) -> None:
        """Take that the connection has ended; the reason is empty when it was ended from here."""


class ServiceLink:
    """A connection to a server; in the loop's thread, except :meth:`send` and :meth:`quiet`.

    Args:
        core: The node.
        name: Absolute service name.
        kind: The type that is spoken.
        place: Where the server is.
        persistent: Whether to ask for a connection that outlives a call.
        owner: Told what happens.

    Raises:
        OSError: There can be no more sockets.

    Attributes:
        kind: The type that is spoken.
        place: Where the server is.
        peer: What the server says of itself; None before it has.
        refusal: Why the server refuses the connection; empty when it does not.
        request: The request that is, or will be, answered through it; None when it is idle.
        settling: Whether what came with the last response is still being looked at.
        ended: Whether it is of no use any more.
    """

    def __init__(
        self,
        core: Core,
        name: str,
        kind: ServiceType,
        place: Place,
        persistent: bool,
        owner: LinkOwner,
    ) -> None:
        self.kind, self.place, self.persistent = kind, place, persistent
        self.peer: Peer | None = None
        self.refusal = ""
        self.request: Request | None = None
        self.settling = self.ended = False
        self._owner = owner
        header = {
            "callerid": core.name.full,
            "md5sum": kind.md5,
            "service": name,
            "type": ros1_name(kind.name),
        }
        if persistent:
            header["persistent"] = "1"
        self._connection = Connection.dial(
            core.loop, place.address, header, self._on_header, self._on_frame, self._on_end, lead=1
        )

    def send(self, data: bytes) -> None:
        """Send a request; the server has accepted the connection."""
        self._connection.send([_length.pack(len(data)), data])

    def quiet(self) -> bool:
        """Return whether nothing has come that was not looked at; from any thread."""
        return self._connection.quiet()

    def lives(self) -> bool:
        """Return whether the server has not closed it; takes in what has come until now."""
        self._connection.ready(READ)
        return not self._connection.closed

    def end(self, reason: str = "") -> None:
        """End it, and say why."""
        self._connection.end(reason)

    def _on_header(self, header: dict[str, str]) -> None:
        try:
            self.peer = Peer.of(header, self.place)
        except ConnectionLostError as error:
            self.end(str(error))
            return
        self._owner.link_ready(self, self.peer)

    def _on_frame(self, data: bytes | memoryview, lead: int) -> None:
        if self.request is None:
            self.end("it sent a response that nobody asked for")
        else:
            self._owner.link_answered(self, lead != 0, data)

    def _on_end(self, reason: str) -> None:
        self.refusal = self.refusal or self._connection.header.get("error", "")
        self._owner.link_ended(self, reason)


def check_size(data: bytes, name: str) -> None:
    """Raise ConversionError for a message that is too large for ROS 1."""
    if len(data) > MAX_FRAME:
        told = f"at most {MAX_FRAME} bytes, as ROS 1 takes no larger message"
        raise ConversionError("", f"{len(data)} bytes", told, name)
