"""A client's connection to a service's server, and the requests that wait for one.

Protocol: ROS wiki, "ROS/TCPROS": after the headers, a request is a frame, and its response a frame
with a byte in front that says whether all went well; the failure text is its content if not.
"""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.comm.calling import CallRequest
from rosglass.errors import ConnectionLostError, ConversionError
from rosglass.interfaces import ros1_name
from rosglass.ros1.connection import MAX_FRAME, Connection
from rosglass.ros1.io_loop import READ
from rosglass.ros1.service_probe import Peer

if TYPE_CHECKING:
    from rosglass.messages import ServiceType
    from rosglass.ros1.core import Core
    from rosglass.ros1.service_probe import Place

__all__ = ["LinkOwner", "Request", "ServiceLink"]

_length = struct.Struct("<I")


@dataclass(eq=False, kw_only=True)
class Request(CallRequest):
    """A call's request.

    Attributes:
        number: Its place in the order of the calls.
        made: Monotonic time of the call.
        began: Monotonic time at which a connection for it was begun, None while it waits.
        link: The connection it is sent through.
        refused: Whether a server that was found before this call began has refused it.
    """

    number: int
    made: float
    began: float | None = None
    link: ServiceLink | None = None
    refused: bool = False

    @staticmethod
    def encoded(kind: ServiceType, value: Any) -> bytes:
        """Return the bytes of a request's value; raises ConversionError."""
        data = kind.request.encode(value)
        if len(data) > MAX_FRAME:
            told = f"at most {MAX_FRAME} bytes, as ROS 1 takes no larger message"
            raise ConversionError("", f"{len(data)} bytes", told, kind.request.name)
        return data

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
