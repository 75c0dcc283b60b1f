"""One TCPROS connection: a header each way, then frames with their length in front.

Protocol: ROS wiki, "ROS/TCPROS". Everything here runs in the loop's thread, except what says so.
"""

from __future__ import annotations

import errno
import itertools
import logging
import os
import socket
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.errors import DecodeError
from rosglass.ros1.header import encode_header, parse_header
from rosglass.ros1.incoming import CHUNK, MAX_FRAME, Incoming
from rosglass.ros1.io_loop import READ, WRITE
from rosglass.ros1.outages import Unconfirmed
from rosglass.ros1.outgoing import Frame, Outgoing

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rosglass.ros1.io_loop import IoLoop, Later

    Buffer = bytes | bytearray | memoryview
    Received = bytes | memoryview

__all__ = ["MAX_FRAME", "Connection"]

_log = logging.getLogger("rosglass.ros1")
#: Most reads in a row: other sockets must have their turn.
_ROUNDS = 16
#: Seconds that the other end may take to connect and to send its header.
_HEADER_LIMIT = 10.0
#: Seconds of silence before the other end is asked for a sign of life, between such questions, and
#: how many: a robot without power is noticed after some 15 s.
_KEEPALIVE = (("TCP_KEEPIDLE", 5), ("TCP_KEEPINTVL", 3), ("TCP_KEEPCNT", 3))
#: Seconds to wait, in :meth:`Connection.drain`, for another thread that reads just now.
_TURN = 0.1
#: Bytes read at once as long as little comes.
_LITTLE = 4096
#: Bytes at one look after which a connection is not left to itself any more: the other end must not
#: be held up by a full socket.
_MUCH = 64 * 1024
#: Seconds between looks whether a stalled connection goes on.
_STALLED = 0.1
_serials = itertools.count(1)
_PENDING = (errno.EINPROGRESS, errno.EWOULDBLOCK, errno.EAGAIN)


class Connection:
    """One TCPROS connection.

    Args:
        loop: Waits for the socket.
        sock: Connected, or about to be; belongs to the connection from now on.
        on_header: Called with the peer's header, before anything else is handed on.
        on_frame: Called with each frame's content, and the byte in front of its length; big
            contents are read-only views. From another thread than the loop's in :meth:`drain`.
        on_closed: Called once with the reason, empty when it was closed from here.
        lead: Bytes in front of each frame's length: 1 for a service's responses, else 0.

    Attributes:
        peer: The other end's name once it is known, else its address; for people.
        header: The peer's header; empty before it came.
        serial: Tells it from all others of this process, also those that are gone.
        on_room: Called when everything is sent; None for nobody.
    """

    def __init__(
        self,
        loop: IoLoop,
        sock: socket.socket,
        on_header: Callable[[dict[str, str]], None],
        on_frame: Callable[[Received, int], None],
        on_closed: Callable[[str], None],
        *,
        lead: int = 0,
        peer: str = "",
    ) -> None:
        self.peer, self.header = peer, dict[str, str]()
        self.serial = next(_serials)
        self.on_room: Callable[[], None] | None = None
        self._loop, self._sock = loop, sock
        self._on_header, self._on_frame, self._on_closed = on_header, on_frame, on_closed
        self._incoming = Incoming(peer, lead, self._take)
        #: Held while another thread than the loop's reads from the socket, which the loop closes.
        self._io = threading.Lock()
        #: Held while frames are handed on, in order; outside of the loop by this thread.
        self._turn = threading.Lock()
        self._turn_of = 0
        self._lock = threading.Lock()
        self._outgoing = Outgoing()
        self._unconfirmed = Unconfirmed(sock)
        #: Whether what waits is for topics, so that it is held back while the other end is silent.
        self._holds = self._held = False
        self._connected = False
        #: Bytes to read at once: memory that stays empty has to be had all the same.
        self._ask = _LITTLE
        self._reading = self._hurried = True
        self._closed = False
        self._limit: Later | None = None
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in _KEEPALIVE:
            if (option := getattr(socket, name, None)) is not None:
                sock.setsockopt(socket.IPPROTO_TCP, option, value)

    @classmethod
    def dial(
        cls,
        loop: IoLoop,
        address: tuple[str, int],
        header: Mapping[str, str],
        on_header: Callable[[dict[str, str]], None],
        on_frame: Callable[[Received, int], None],
        on_closed: Callable[[str], None],
        *,
        lead: int = 0,
    ) -> Connection:
        """Connect to a resolved address and send a header; from the loop's thread.

        Raises:
            OSError: There can be no more sockets.
        """
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
        made._begin()
        return made

    def accept(self) -> None:
        """Begin with a socket that was accepted."""
        self._connected = True
        self._begin()

    def _begin(self) -> None:
        self._limit = self._loop.after(_HEADER_LIMIT, self._expire)
        self._watch()

    def _expire(self) -> None:
        what = "it sent no connection header" if self._connected else "no answer"
        self.end(f"{what} within {_HEADER_LIMIT:.0f} s")

    @property
    def closed(self) -> bool:
        """Whether it has ended."""
        return self._closed

    @property
    def lost(self) -> int:
        """How many frames made room for newer ones before they were sent."""
        return self._outgoing.lost

    @property
    def info(self) -> str:
        """The connection as ``rosnode info`` shows it; empty when it is not made, or ended."""
        try:
            port, number = self._sock.getsockname()[1], self._sock.fileno()
            host, theirs = self._sock.getpeername()[:2]
        except OSError:
            return ""
        return f"TCPROS connection on port {port} to [{host}:{theirs} on socket {number}]"

    @property
    def received(self) -> int:
        """How many bytes have come."""
        return self._incoming.total

    def waiting(self) -> int:
        """Return how many frames wait to be sent; from any thread."""
        return len(self._outgoing)

    def quiet(self) -> bool:
        """Return whether nothing waits in the socket, nor its end; from any thread."""
        with self._io:
            if self._closed:
                return False
            try:
                self._sock.recv(1, socket.MSG_PEEK)
            except (BlockingIOError, InterruptedError):
                return True
            except OSError:
                pass  # whoever reads it next tells why
            return False

    # -- sending ---------------------------------------------------------------------------------

    def send_header(self, fields: Mapping[str, str]) -> None:
        """Send this end's header; from any thread."""
        self.send_frame(Frame([encode_header(fields)], kept=True))

    def send(self, parts: Sequence[Buffer], keep: int = 0) -> None:
        """Send a frame, of which the parts carry length and all; see :meth:`send_frame`."""
        self.send_frame(Frame(parts), keep)

    def send_frame(self, frame: Frame, keep: int = 0, keep_bytes: int = 0) -> None:
        """Send a frame; from any thread, without waiting.

        What the socket does not take at once is copied: the caller may reuse its buffers.

        Args:
            frame: The frame.
            keep: How many frames may wait to be sent; the oldest makes room. 0 for any number.
            keep_bytes: How many bytes may wait, besides the newest frame; 0 for any number.
        """
        with self._lock:
            if self._closed:
                return
            sent = 0
            first = not self._outgoing
            self._holds = self._holds or keep > 0 or keep_bytes > 0
            if first and self._connected and not (self._holds and self._unconfirmed.stalled()):
                sent = self._write(frame.parts)
                if sent == frame.size:
                    return
            self._outgoing.add(frame, sent, keep, keep_bytes)
        if first:
            self._loop.call(self._watch)

    def _write(self, parts: Sequence[memoryview]) -> int:
        """Send what the socket takes; return how much."""
        try:
            sent = self._sock.sendmsg(parts)
        except (BlockingIOError, InterruptedError):
            return 0
        except OSError as error:
            reason = error.strerror or str(error)
            self._loop.call(lambda: self.end(reason))
            return 0
        self._unconfirmed.written += sent
        return sent

    def _send_waiting(self) -> None:
        emptied = False
        with self._lock:
            if self._closed or not self._outgoing:
                emptied = not self._closed
            elif self._holds and self._unconfirmed.stalled():
                self._hold()
            else:
                self._outgoing.send(self._write)
                emptied = not self._outgoing
        if emptied:
            self._watch()
            if self.on_room is not None:
                self.on_room()

    @property
    def stalled(self) -> bool:
        """Whether the other end has not confirmed anything for half a second; from any thread."""
        with self._lock:
            return not self._closed and self._connected and self._unconfirmed.stalled()

    def _hold(self) -> None:
        """Send nothing for a moment: only what is newest then is of use."""
        if self._held:
            return
        self._held = True

        def look() -> None:
            self._held = False
            self._watch()

        self._loop.after(_STALLED, look)
        self._loop.call(self._watch)

    # -- receiving -------------------------------------------------------------------------------

    def pause(self, reading: bool) -> None:
        """Say whether to read and hand on; what comes meanwhile waits. In the loop's thread."""
        self._reading = reading
        self._incoming.stopped = self._closed or not reading
        self._watch()
        if reading:
            self._loop.call(self._go_on)

    def _go_on(self) -> None:
        if self._reading and not self._closed and self._turn.acquire(blocking=False):
            self._receive(self._sock.recv, self._sock.recv_into, go_on=True)

    def take_together(self, take: Callable[[list[Received], int], None]) -> None:
        """Have frames handed on as they come, several at once; `take` must not raise anything."""
        self._incoming.take = take

    def hurry(self, hurried: bool) -> None:
        """Say whether to read as soon as something comes, or about ten times a second."""
        if hurried != self._hurried and not self._closed:
            self._hurried = hurried
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
            if self._sock.getsockname() == self._sock.getpeername():
                # Nobody listens there: TCP found the port to come from free to go to.
                self.end(os.strerror(errno.ECONNREFUSED))
                return
            self._connected = True
            events |= WRITE
        if events & WRITE:
            self._send_waiting()
        if events & READ and self._turn.acquire(blocking=False):
            before = self._incoming.total
            self._receive(self._sock.recv, self._sock.recv_into)
            if not self._hurried and self._incoming.total - before > _MUCH:
                self.hurry(True)

    def drain(self) -> None:
        """Hand on what waits in the socket; from any thread, while nobody hurries."""
        me = threading.get_ident()
        if self._hurried or self._closed or self._turn_of == me:
            return
        # Whoever reads just now hands on the same messages.
        if self._turn.acquire(timeout=_TURN):
            self._turn_of = me
            self._receive(self._recv, self._recv_into)

    def _recv(self, size: int) -> bytes:
        """Read in a thread other than the loop's, which may close the socket at any time."""
        with self._io:
            if self._closed:
                raise BlockingIOError
            return self._sock.recv(size)

    def _recv_into(self, room: memoryview) -> int:
        with self._io:
            if self._closed:
                raise BlockingIOError
            return self._sock.recv_into(room)

    def _receive(
        self,
        recv: Callable[[int], bytes],
        recv_into: Callable[[memoryview], int],
        go_on: bool = False,
    ) -> None:
        """Take in what has come; with the turn, which ends here."""
        incoming = self._incoming
        try:
            if go_on:
                incoming.feed(b"")
            for _ in range(_ROUNDS):
                if self._closed or not self._reading:
                    return
                room = incoming.room
                if room is None:
                    most = self._ask
                    data = recv(most)
                    count = len(data)
                    self._ask = CHUNK if count == most else _LITTLE
                    if count:
                        incoming.feed(data)
                else:
                    most = len(room)
                    count = recv_into(room)
                    if count:
                        incoming.filled(count)
                if not count:
                    self._lose("the other end closed the connection")
                if count < most:
                    return
        except (BlockingIOError, InterruptedError):
            return
        except DecodeError as error:
            self._lose(str(error))
        except OSError as error:
            self._lose(error.strerror or str(error))
        finally:
            self._turn_of = 0
            self._turn.release()

    def _take(self, frames: list[Received], first: int) -> None:
        if not self.header:
            self._take_header(bytes(frames[0]))
            return
        try:
            for frame in frames:
                self._on_frame(frame, first)
        except Exception as error:
            _log.exception("%s: a message could not be taken", self.peer)
            self._lose(f"an error of ours, {error!r}")

    def _take_header(self, data: bytes) -> None:
        fields = parse_header(data)
        if not fields:
            raise DecodeError(f"TCPROS from {self.peer}", "the connection header is empty")
        self.header = fields
        self.peer = fields.get("callerid", "") or self.peer
        if self._limit is not None:
            self._limit.cancel()
        if (error := fields.get("error")) is not None:
            self.end(f"{self.peer} refuses: {error or 'it does not say why'}")
            return
        self._on_header(fields)

    def _lose(self, reason: str) -> None:
        """End it, from whichever thread noticed."""
        if self._loop.is_current:
            self.end(reason)
        else:
            self._loop.call(lambda: self.end(reason))

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """End it from here; from any thread."""
        self._loop.call(lambda: self.end(""))

    def finish(self, patience: float) -> None:
        """End it once everything is sent, or after `patience` seconds; in the loop's thread."""
        if self._closed:
            return
        if not self._outgoing:
            self.end("")
            return
        self.on_room = lambda: self.end("")
        # The system goes on trying to deliver what it has: the last word may be a stop.
        self._holds = self._held = False
        self._watch()
        self._loop.linger(self, True)
        self._loop.after(patience, lambda: self.end(""))

    def end(self, reason: str) -> None:
        """End it, and say why; in the loop's thread."""
        with self._lock:
            if self._closed:
                return
            self._closed = self._incoming.stopped = True
            self._outgoing.clear()
        if self._limit is not None:
            self._limit.cancel()
        self._loop.linger(self, False)
        self._loop.watch(self._sock, 0, self)
        with self._io:
            with suppress(OSError):
                # A process that was forked has the socket, too, and would keep the other end.
                self._sock.shutdown(socket.SHUT_RDWR)
            self._sock.close()
        self._on_closed(reason)

    def _watch(self) -> None:
        if self._closed:
            return
        sending = bool(self._outgoing and not self._held) or not self._connected
        events = (READ if self._reading else 0) | (WRITE if sending else 0)
        self._loop.watch(self._sock, events, self, hurry=self._hurried)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} with {self.peer}>"
