"""One TCPROS connection: a header each way, then frames with their length in front.

Protocol: ROS wiki, "ROS/TCPROS". Everything here runs in the loop's thread, except what says so.
"""

from __future__ import annotations

import errno
import os
import socket
import struct
import threading
from collections import deque
from typing import TYPE_CHECKING

from rosglass.errors import DecodeError
from rosglass.ros1.header import MAX_HEADER, encode_header, parse_header
from rosglass.ros1.io_loop import READ, WRITE

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rosglass.ros1.io_loop import IoLoop

    Buffer = bytes | bytearray | memoryview

__all__ = ["MAX_FRAME", "Connection"]

#: Longest frame taken in bytes: what a length says beyond it is garbage, as roscpp has it.
MAX_FRAME = 1_000_000_000
#: Bytes read at once; frames that do not fit get a buffer of their own.
_CHUNK = 64 * 1024
#: Most reads in a row: other sockets must have their turn.
_ROUNDS = 16
#: Parts of a frame that the system takes at once.
_MOST_PARTS = 256
_length = struct.Struct("<I")
_PENDING = (errno.EINPROGRESS, errno.EWOULDBLOCK, errno.EAGAIN)


class Connection:
    """One TCPROS connection.

    Args:
        loop: Waits for the socket.
        sock: Connected, or about to be; belongs to the connection from now on.
        on_header: Called with the peer's header. Nothing is read before it returns.
        on_frame: Called with each frame's content, and the byte in front of its length.
        on_closed: Called once with the reason, empty when it was closed from here.
        lead: Bytes in front of each frame's length: 1 for a service's responses, else 0.

    Attributes:
        peer: The other end's address, for people.
        header: The peer's header; empty before it came.
        lost: Frames that made room for newer ones before they were sent.
        on_room: Called when everything is sent; None for nobody.
    """

    def __init__(
        self,
        loop: IoLoop,
        sock: socket.socket,
        on_header: Callable[[dict[str, str]], None],
        on_frame: Callable[[bytes | bytearray, int], None],
        on_closed: Callable[[str], None],
        *,
        lead: int = 0,
        peer: str = "",
    ) -> None:
        self.peer, self.header = peer, dict[str, str]()
        self.lost = 0
        self.on_room: Callable[[], None] | None = None
        self._loop, self._sock = loop, sock
        self._on_header, self._on_frame, self._on_closed = on_header, on_frame, on_closed
        self._lead = lead
        self._chunk = bytearray(_CHUNK)
        self._view = memoryview(self._chunk)
        self._start = self._end = 0
        self._big: bytearray | None = None
        self._big_view = memoryview(b"")
        self._big_lead = 0
        self._lock = threading.Lock()
        #: Frames to send, each in parts; the first may be sent in part.
        self._outgoing: deque[list[Buffer]] = deque()
        self._begun = False
        self._connected = False
        self._reading = True
        self._closed = False
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)

    @classmethod
    def dial(
        cls,
        loop: IoLoop,
        address: tuple[str, int],
        header: Mapping[str, str],
        on_header: Callable[[dict[str, str]], None],
        on_frame: Callable[[bytes | bytearray, int], None],
        on_closed: Callable[[str], None],
        *,
        lead: int = 0,
    ) -> Connection:
        """Connect to a resolved address and send a header; from the loop's thread."""
        family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
        sock = socket.socket(family, socket.SOCK_STREAM)
        place = f"{address[0]}:{address[1]}"
        made = cls(loop, sock, on_header, on_frame, on_closed, lead=lead, peer=place)
        failure = sock.connect_ex(address)
        made.send_header(header)
        if failure not in (0, *_PENDING):
            loop.call(lambda: made.end(os.strerror(failure)))
            return made
        made._connected = failure == 0
        loop.watch(sock, READ | WRITE, made)
        return made

    def accept(self) -> None:
        """Begin with a socket that was accepted."""
        self._connected = True
        self._loop.watch(self._sock, READ, self)

    @property
    def closed(self) -> bool:
        """Whether it has ended."""
        return self._closed

    def waiting(self) -> int:
        """Return how many frames wait to be sent; from any thread."""
        return len(self._outgoing)

    # -- sending ---------------------------------------------------------------------------------

    def send_header(self, fields: Mapping[str, str]) -> None:
        """Send this end's header; from any thread."""
        self.send([encode_header(fields)])

    def send(self, parts: Sequence[Buffer], keep: int = 0) -> None:
        """Send a frame, of which the parts carry length and all; from any thread, without waiting.

        What the socket does not take at once is copied: the caller may reuse its buffers.

        Args:
            parts: The frame's bytes.
            keep: How many frames may wait to be sent; the oldest makes room. 0 for any number.
        """
        with self._lock:
            if self._closed:
                return
            rest: Sequence[Buffer] = parts if len(parts) <= _MOST_PARTS else [b"".join(parts)]
            if not self._outgoing and self._connected:
                sent = self._write(rest)
                if sent is None:
                    return
                self._begun = sent > 0
                rest = _after(rest, sent)
                if not rest:
                    self._begun = False
                    return
            self._outgoing.append([bytes(part) for part in rest])
            if keep and len(self._outgoing) - self._begun > keep:
                self._make_room()
            first = len(self._outgoing) == 1
        if first:
            self._loop.call(self._watch)

    def _make_room(self) -> None:
        """Drop the oldest frame of which nothing was sent."""
        if self._begun:
            begun = self._outgoing.popleft()
            self._outgoing.popleft()
            self._outgoing.appendleft(begun)
        else:
            self._outgoing.popleft()
        self.lost += 1

    def _write(self, parts: Sequence[Buffer]) -> int | None:
        """Send what the socket takes; return how much, None when the connection is at its end."""
        try:
            return self._sock.sendmsg(parts)
        except (BlockingIOError, InterruptedError):
            return 0
        except OSError as error:
            reason = error.strerror or str(error)
            self._loop.call(lambda: self.end(reason))
            return None

    def _send_waiting(self) -> None:
        emptied = False
        with self._lock:
            while self._outgoing and not self._closed:
                frame = self._outgoing[0]
                sent = self._write(frame)
                if not sent:
                    break
                rest = _after(frame, sent)
                self._begun = bool(rest)
                if rest:
                    self._outgoing[0] = rest
                    break
                self._outgoing.popleft()
                emptied = not self._outgoing
        if emptied:
            self._watch()
            if self.on_room is not None:
                self.on_room()

    # -- receiving -------------------------------------------------------------------------------

    def pause(self, reading: bool) -> None:
        """Say whether to read; what comes meanwhile waits in the socket."""
        self._reading = reading
        self._watch()

    def ready(self, events: int) -> None:
        """Send and receive; called by the loop."""
        if self._closed:
            return
        if not self._connected:
            failure = self._sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if failure:
                self.end(os.strerror(failure))
                return
            self._connected = True
        if events & WRITE:
            self._send_waiting()
        if events & READ:
            self.receive()

    def receive(self) -> None:
        """Take in what has come."""
        try:
            for _ in range(_ROUNDS):
                if self._closed or not self._receive_some():
                    return
        except DecodeError as error:
            self.end(str(error))

    def _receive_some(self) -> bool:
        """Read once; return whether there may be more."""
        room = self._big_view if self._big is not None else self._view[self._end :]
        try:
            count = self._sock.recv_into(room)
        except (BlockingIOError, InterruptedError):
            return False
        except OSError as error:
            self.end(error.strerror or str(error))
            return False
        if not count:
            self.end("the other end closed the connection")
            return False
        full = count == len(room)
        if self._big is None:
            self._end += count
            self._cut()
            return full or self._big is not None
        self._big_view = self._big_view[count:]
        if not self._big_view:
            frame, self._big = self._big, None
            self._on_frame(frame, self._big_lead)
        return True

    def _cut(self) -> None:
        """Hand on the frames that are complete."""
        lead, chunk = self._lead, self._chunk
        while not self._closed:
            # Only once the header is there, frames have the byte in front.
            front = lead if self.header else 0
            body = self._start + front + _length.size
            if body > self._end:
                break
            (size,) = _length.unpack_from(chunk, self._start + front)
            first = chunk[self._start] if front else 0
            if size > (MAX_FRAME if self.header else MAX_HEADER):
                what = "a message" if self.header else "the header"
                raise DecodeError(
                    f"connection with {self.peer}", f"{what} claims to have {size} bytes"
                )
            if body + size <= self._end:
                self._start = body + size
                self._take(bytes(self._view[body : body + size]), first)
            elif front + _length.size + size > _CHUNK:
                self._begin_big(size, body, first)
                return
            else:
                break
        rest = self._end - self._start
        if self._start and rest:
            chunk[:rest] = chunk[self._start : self._end]
        self._start, self._end = 0, rest

    def _begin_big(self, size: int, body: int, first: int) -> None:
        self._big, self._big_lead = bytearray(size), first
        view = memoryview(self._big)
        there = self._end - body
        view[:there] = self._view[body : self._end]
        self._big_view = view[there:]
        self._start = self._end = 0

    def _take(self, data: bytes, first: int) -> None:
        if self.header:
            self._on_frame(data, first)
            return
        self.header = parse_header(data)
        self.peer = self.header.get("callerid", "") or self.peer
        if error := self.header.get("error"):
            self.end(f"{self.peer} refuses: {error}")
            return
        self._on_header(self.header)

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """End it from here; from any thread."""
        self._loop.call(lambda: self.end(""))

    def finish(self, patience: float) -> None:
        """End it once everything is sent, or after `patience` seconds; in the loop's thread."""
        self.on_room = lambda: self.end("")
        if not self._outgoing:
            self.end("")
        else:
            self._loop.after(patience, lambda: self.end(""))

    def end(self, reason: str) -> None:
        """End it, and say why; in the loop's thread."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._outgoing.clear()
        self._loop.watch(self._sock, 0, self)
        self._sock.close()
        self._on_closed(reason)

    def _watch(self) -> None:
        if self._closed:
            return
        sending = bool(self._outgoing) or not self._connected
        self._loop.watch(
            self._sock, (READ if self._reading else 0) | (WRITE if sending else 0), self
        )

    def __repr__(self) -> str:
        return f"<{type(self).__name__} with {self.peer}>"


def _after(parts: Sequence[Buffer], sent: int) -> list[Buffer]:
    """Return what is left of `parts` after so many bytes."""
    rest: list[Buffer] = []
    for part in parts:
        view = memoryview(part).cast("B")
        if sent >= len(view):
            sent -= len(view)
        else:
            rest.append(view[sent:] if sent else view)
            sent = 0
    return rest
