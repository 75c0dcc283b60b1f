"""A TCPROS connection: a header in each direction, then frames, each after its length.

Formats: ROS wiki, "ROS/Connection Header" and "ROS/TCPROS". A header consists of fields
``name=value``, each after its length, all of them after theirs. The first frame is the header; a
service's responses have one more byte before the length. All lengths are 32-bit, little-endian.

All methods of a :class:`Connection` run in the loop's thread, unless stated otherwise.
"""

from __future__ import annotations

import errno
import itertools
import logging
import os
import socket
import struct
import sys
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.errors import DecodeError
from rosglass.wires.tcpros.io_loop import READ, WRITE

if sys.platform == "linux":
    import fcntl

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rosglass.wires.tcpros.io_loop import IoLoop, Later

    Buffer = bytes | bytearray | memoryview
    Received = bytes | memoryview

__all__ = [
    "ANY",
    "CHUNK",
    "MAX_FRAME",
    "MAX_HEADER",
    "Connection",
    "Frame",
    "Incoming",
    "Outgoing",
    "UnackedBytes",
    "encode_header",
    "parse_header",
    "survive_outages",
]


#: Any type, or any md5 sum, in a connection header.
ANY = "*"
#: Longest accepted header in bytes, far above the definition of the largest message type.
MAX_HEADER = 1_000_000
#: Most fields of one, a few times those in use: a peer must not keep the loop busy.
_MAX_FIELDS = 100
_length = struct.Struct("<I")


def encode_header(fields: Mapping[str, str]) -> bytes:
    """Return a header after its length."""
    lines = [f"{name}={value}".encode() for name, value in fields.items()]
    body = b"".join(_length.pack(len(line)) + line for line in lines)
    return _length.pack(len(body)) + body


def parse_header(data: bytes | memoryview) -> dict[str, str]:
    """Return the fields of a header, given without its length.

    Raises:
        DecodeError: A field reaches beyond the end or has no ``=``, or there are too many.
    """
    data = bytes(data)
    fields: dict[str, str] = {}
    position = count = 0
    while position < len(data):
        count += 1
        if count > _MAX_FIELDS:
            raise DecodeError("connection header", f"more than {_MAX_FIELDS} fields")
        start = position + _length.size
        size = _length.unpack_from(data, position)[0] if start <= len(data) else len(data)
        if start + size > len(data):
            raise DecodeError("connection header", "a field is truncated", offset=position)
        # Definitions of old types may have any encoding.
        line = data[start : start + size].decode("utf-8", "surrogateescape")
        name, separator, value = line.partition("=")
        if not separator:
            raise DecodeError("connection header", f"{line[:40]!r} has no '='", offset=position)
        fields[name] = value
        position = start + size
    return fields


#: Seconds. Only subscribers connect: if this end gave up before the subscriber does, that would not
#: reconnect. rospy's and roscpp's own keepalive takes 60 s and 9 times 10 s.
_SUBSCRIBER_KEEPALIVE = (("TCP_KEEPIDLE", 60), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 12))
_OUTAGE_LIMIT_S = 180
#: TCP_RTO_MAX_MS, since Linux 6.15; Python has no name for it.
_TCP_RTO_MAX_MS = 44
#: SIOCOUTQ (Linux, ``man 7 tcp``): bytes in the send queue that the peer has not acknowledged.
_SIOCOUTQ = 0x5411
_int = struct.Struct("i")
#: ``tcpi_rtt`` of Linux's ``struct tcp_info``, in microseconds.
_TCP_INFO = struct.Struct("=68xI")
#: Shortest time without acknowledgement after which a connection counts as stalled for commands,
#: and the pause between polls while one waits; in seconds.
_COMMAND_STALL_S, _COMMAND_POLL_S = 0.1, 0.01
#: Seconds without acknowledgement after which a connection counts as stalled, and between polls.
_STALL_TIMEOUT_S, _STALL_POLL_S = 0.5, 0.05


def survive_outages(sock: socket.socket) -> None:
    """Set a subscriber's socket to survive outages of three minutes, and to resume soon after.

    By default TCP doubles its retransmission timeout each time: what was published in an outage,
    such as a stop command, would arrive only after as long again.
    """
    for name, value in _SUBSCRIBER_KEEPALIVE:
        if (option := getattr(socket, name, None)) is not None:
            sock.setsockopt(socket.IPPROTO_TCP, option, value)
    if sys.platform == "linux":
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _OUTAGE_LIMIT_S * 1000)
        with suppress(OSError):  # an older Linux
            sock.setsockopt(socket.IPPROTO_TCP, _TCP_RTO_MAX_MS, 1000)


class UnackedBytes:
    """The sent bytes that the peer has not acknowledged: detects stalled connections.

    The system buffers some megabytes more and delivers them after the outage: a robot would
    execute commands of minutes ago before the one that stops it.

    Attributes:
        written: Bytes written to the socket; counted by the owner.
    """

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self.written = 0
        self._acked = -1
        self._acked_at = self._polled_at = 0.0
        self._stalled = False

    def stalled(self, command: bool = False) -> bool:
        """Return whether sent bytes have not been acknowledged for half a second.

        For a command, the limit is twice the round-trip time, but at least 0.1 s: what was given to
        the system cannot be recalled.
        """
        now = time.monotonic()
        if not command and now - self._polled_at < _STALL_POLL_S:
            return self._stalled
        self._polled_at = now
        unacked = self.unacked()
        acked = self.written - unacked
        if not unacked or acked != self._acked:
            self._acked, self._acked_at = acked, now
        silence = now - self._acked_at
        self._stalled = silence > _STALL_TIMEOUT_S
        return self._stalled or (command and silence > max(_COMMAND_STALL_S, 2 * self._rtt()))

    def unacked(self) -> int:
        """Return how many bytes the peer has not acknowledged; 0 where that is unknown."""
        if sys.platform != "linux":
            return 0
        try:
            (waiting,) = _int.unpack(fcntl.ioctl(self._sock, _SIOCOUTQ, bytes(_int.size)))
        except OSError:
            return 0
        return int(waiting)

    def _rtt(self) -> float:
        """Return the round-trip time as the system measures it, in seconds; 0 if unknown."""
        try:
            info = self._sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _TCP_INFO.size)
            return float(_TCP_INFO.unpack(info)[0]) / 1e6
        except (OSError, AttributeError, struct.error):
            return 0.0


#: Parts of a frame in one system call.
_MAX_PARTS = 256


class Frame:
    """A frame that is sent to any number of connections.

    Its parts may be the caller's memory while they are being written; the rest that has to wait is
    copied, once for all connections.

    Args:
        parts: The bytes, with their length.
        kept: See the attribute.
        timeout: Seconds after which it expires; 0 for never.

    Attributes:
        parts: As given, as views of bytes.
        size: Bytes in all.
        kept: Whether it is never dropped for newer ones: the last message of a latched publisher.
        expiry: When it is dropped unless it was sent, by :func:`time.monotonic`; 0 for never.
    """

    __slots__ = ("_copied", "_start", "expiry", "kept", "parts", "size")

    def __init__(self, parts: Sequence[Buffer], kept: bool = False, timeout: float = 0.0) -> None:
        views = [memoryview(part).cast("B") for part in parts]
        if len(views) > _MAX_PARTS:
            views = [memoryview(b"".join(views))]
        self.parts = views
        self.size = sum(map(len, views))
        self.kept = kept
        self.expiry = time.monotonic() + timeout if timeout else 0.0
        self._copied: memoryview | None = None
        self._start = 0

    def rest(self, sent: int) -> memoryview:
        """Return the bytes after the first `sent` ones, in memory of its own."""
        copied = self._copied
        if copied is None or sent < self._start:
            copied = self._copied = memoryview(b"".join(_after(self.parts, sent)))
            self._start = sent
        return copied[sent - self._start :]


class Outgoing:
    """The send queue of one connection; guarded by its owner's lock.

    Attributes:
        lost: Frames that were dropped for newer ones, or expired.
        held: Bytes in the queue.
    """

    __slots__ = ("_begun", "_frames", "held", "lost")

    def __init__(self) -> None:
        #: Each frame with its bytes that are not sent.
        self._frames: deque[tuple[Frame, memoryview]] = deque()
        #: Whether the first frame was sent in part, and cannot be dropped.
        self._begun = False
        self.lost = self.held = 0

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, frame: Frame, sent: int, keep: int, keep_bytes: int) -> None:
        """Queue the rest of a frame, and drop the oldest frames beyond the limits.

        Args:
            frame: The frame.
            sent: Its bytes that are sent already; not 0 only when the queue is empty.
            keep: Most frames in the queue; 0 for any number.
            keep_bytes: Most bytes in the queue, without the frame; 0 for any number.
        """
        left = frame.rest(sent)
        self._frames.append((frame, left))
        self._begun = self._begun or sent > 0
        self.held += len(left)
        while keep and len(self._frames) - self._begun > keep and self._drop():
            pass
        while keep_bytes and self.held > keep_bytes and self._drop():
            pass

    def _drop(self) -> bool:
        """Drop the oldest frame that may be dropped; return whether there is one."""
        for index in range(self._begun, len(self._frames) - 1):
            frame, left = self._frames[index]
            if not frame.kept:
                del self._frames[index]
                self.held -= len(left)
                self.lost += 1
                return True
        return False

    def expire(self) -> None:
        """Drop frames that have waited for longer than their timeout."""
        now = time.monotonic()
        first = int(self._begun)
        while len(self._frames) > first and 0 < self._frames[first][0].expiry < now:
            self.held -= len(self._frames[first][1])
            del self._frames[first]
            self.lost += 1

    @property
    def is_command(self) -> bool:
        """True if the next frame expires."""
        return bool(self._frames) and self._frames[0][0].expiry > 0

    def send(self, write: Callable[[Sequence[memoryview]], int]) -> None:
        """Send frames until `write`, which returns the number of sent bytes, sends less."""
        while self._frames:
            frame, left = self._frames[0]
            sent = write((left,))
            self.held -= sent
            if sent < len(left):
                if sent:
                    self._begun = True
                    self._frames[0] = (frame, left[sent:])
                return
            self._frames.popleft()
            self._begun = False

    def clear(self) -> None:
        """Drop all frames."""
        self._frames.clear()
        self._begun, self.held = False, 0


def _after(parts: Sequence[memoryview], sent: int) -> list[memoryview]:
    """Return the rest of `parts` after the first `sent` bytes."""
    rest = []
    for part in parts:
        if sent >= len(part):
            sent -= len(part)
        else:
            rest.append(part[sent:] if sent else part)
            sent = 0
    return rest


#: Longest accepted frame in bytes: as in roscpp, a longer one is garbage.
MAX_FRAME = 1_000_000_000
#: Bytes to read at once while there is no :attr:`Incoming.room`.
CHUNK = 64 * 1024
#: A partly received frame gets a buffer of its own if it is longer.
_SMALL_FRAME_BYTES = 4 * 1024
#: Bytes allocated for a frame before a peer has sent any frame of that size.
_TRUSTED_BYTES = 1024 * 1024
#: Buffers that are reused once no view of them is left: touching new memory costs as much as
#: receiving into it.
_MAX_SPARE_BUFFERS = 4
#: Frames of one size that are split at once: most topics have messages of one size.
_RUN_FRAMES = 32


class Incoming:
    """Splits one connection's bytes into frames.

    Args:
        peer: For errors.
        lead: Bytes before each frame's length, after the header: 1 or 0.
        take: Called with frames and the byte before them; with one frame if there is such a byte,
            and for the header. Frames above 64 KiB are read-only views of a buffer that is not
            reused while there is a view of it.

    Attributes:
        room: Buffer to receive into before calling :meth:`filled`; None to call :meth:`feed`.
        stopped: Whether frames are kept instead of handed on.
        total: Bytes received in all.
        take: As given; may be replaced.
    """

    def __init__(self, peer: str, lead: int, take: Callable[[list[Received], int], None]) -> None:
        self.room: memoryview | None = None
        self.stopped = False
        self.total = 0
        self.take = take
        self._peer, self._lead = peer, lead
        self._headed = False
        #: The beginning of a partly received small frame.
        self._rest = b""
        self._big = bytearray()
        self._size = self._there = self._first = 0
        self._credit = _TRUSTED_BYTES
        self._spare: list[bytearray] = []
        self._run: struct.Struct | None = None

    def feed(self, data: bytes) -> None:
        """Split received bytes into frames; raises DecodeError for anything but TCPROS."""
        end = len(data)
        self.total += end
        if (
            self._headed
            and end >= 4
            and _length.unpack_from(data)[0] == end - 4
            and not (self._rest or self._lead or self.stopped)
        ):
            # Exactly one message: the usual case at moderate rates.
            self.take([data[4:]], 0)
            return
        if self._rest:
            data = self._rest + data
            self._rest = b""
        start, end = 0, len(data)
        if not self._headed:
            start = self._feed_header(data)
            if start < 0:
                return
        if self._lead:
            self._cut_led(data, start)
            return
        frames: list[Received] = []
        unpack, append = _length.unpack_from, frames.append
        beginning, before, pause = False, -1, 0
        # Hot: each message of the fastest topics runs through all of this.
        while not self.stopped:
            body = start + 4
            if body > end:
                break
            (size,) = unpack(data, start)
            if size == before and not pause and start + _RUN_FRAMES * (size + 4) <= end:
                run = self._run_of(size).unpack_from(data, start)
                if run[::2].count(size) == _RUN_FRAMES:
                    frames += run[1::2]
                    start += _RUN_FRAMES * (size + 4)
                    continue
                pause = _RUN_FRAMES
            stop = body + size
            if stop > end:
                beginning = True
                break
            append(data[body:stop])
            start, before = stop, size
            if pause:
                pause -= 1
        if frames:
            self.take(frames, 0)
        if beginning:
            self._begin(data, start, body, size)
        else:
            self._rest = data[start:]

    def clear(self) -> None:
        """Free the buffers: a peer's unfinished message may have a gigabyte."""
        self.room, self._rest = None, b""
        self._big, self._spare = bytearray(), []

    def _run_of(self, size: int) -> struct.Struct:
        """Return the struct that splits many frames of one size at once, each with its length."""
        if self._run is None or self._run.size != _RUN_FRAMES * (size + 4):
            self._run = struct.Struct(f"<{f'I{size}s' * _RUN_FRAMES}")
        return self._run

    def _cut_led(self, data: bytes, start: int) -> None:
        while not self.stopped and start + 1 + _length.size <= len(data):
            body = start + 1 + _length.size
            (size,) = _length.unpack_from(data, start + 1)
            if body + size > len(data):
                self._begin(data, start, body, size)
                return
            first, start = data[start], body + size
            self.take([data[body:start]], first)
        self._rest = data[start:]

    def filled(self, count: int) -> None:
        """Handle `count` bytes that were received into :attr:`room`."""
        room, self.room = self.room, None
        if room is not None:
            room.release()  # or the buffer cannot grow
        self.total += count
        self._there += count
        if self._there < min(self._size, len(self._big)):
            self._open()
        elif self._there < self._size:
            # The allocated part is complete: double it.
            self._big.extend(bytes(min(self._size - self._there, self._there)))
            self._open()
        else:
            self._complete()

    def _feed_header(self, data: bytes) -> int:
        """Hand on the connection header; return where it ends, -1 while it is not complete."""
        if len(data) < _length.size:
            self._rest = data
            return -1
        (size,) = _length.unpack_from(data)
        stop = int(size) + _length.size
        if stop > len(data):
            self._begin(data, 0, _length.size, size)
            return -1
        self._headed = True
        self.take([data[_length.size : stop]], 0)
        return stop

    def _begin(self, data: bytes, start: int, body: int, size: int) -> None:
        """Prepare for the rest of a frame."""
        if size > (MAX_FRAME if self._headed else MAX_HEADER):
            what = "a message" if self._headed else "the connection header"
            raise DecodeError(f"TCPROS from {self._peer}", f"{what} claims to have {size} bytes")
        if size <= _SMALL_FRAME_BYTES:
            self._rest = data[start:]
            return
        self._big = self._buffer(min(size, self._credit))
        self._size, self._there, self._first = size, len(data) - body, data[start]
        self._big[: self._there] = data[body:]
        self._open()

    def _open(self) -> None:
        self.room = memoryview(self._big)[self._there : self._size]

    def _complete(self) -> None:
        big, self._big = self._big, bytearray()
        self._credit = max(self._credit, self._size)
        view = memoryview(big)[: self._size].toreadonly()
        self._spare.append(big)
        del self._spare[:-_MAX_SPARE_BUFFERS]
        first = self._first if self._headed and self._lead else 0
        if self._headed and self._size > CHUNK:
            self.take([view], first)
        else:
            self._headed = True
            self.take([bytes(view)], first)

    def _buffer(self, size: int) -> bytearray:
        """Return a buffer of at least that size, a spare one if there is no view of it."""
        for index, spare in enumerate(self._spare):
            if size <= len(spare) <= 2 * size:
                with suppress(BufferError):  # it cannot grow while there is a view of it
                    spare.append(0)
                    spare.pop()
                    return self._spare.pop(index)
        return bytearray(size)


_log = logging.getLogger("rosglass.ros1")
#: Most reads in a row, so that other sockets are served, too.
_MAX_READS = 16
#: Seconds that the peer may take to connect and to send its header.
_HEADER_TIMEOUT_S = 10.0
#: Seconds of silence before a keepalive probe, between probes, and how many: a robot without power
#: is noticed after some 15 s.
_KEEPALIVE = (("TCP_KEEPIDLE", 5), ("TCP_KEEPINTVL", 3), ("TCP_KEEPCNT", 3))
#: Seconds to wait, in :meth:`Connection.drain`, for another thread that reads just now.
_TURN_TIMEOUT_S = 0.1
#: Bytes read at once on slow connections.
_SMALL_READ_BYTES = 4096
#: Bytes in one poll after which a connection is read at once again: a full socket would block its
#: publisher.
_URGENT_BYTES = 64 * 1024
#: Seconds between polls whether a stalled connection has recovered.
_STALLED_POLL_S = 0.1
_serials = itertools.count(1)
_PENDING = (errno.EINPROGRESS, errno.EWOULDBLOCK, errno.EAGAIN)


class Connection:
    """One TCPROS connection.

    Args:
        loop: The node's I/O loop.
        sock: Connected or connecting; owned by the connection from now on.
        on_header: Called with the peer's header, before any frame.
        on_frame: Called with each frame's content, and the byte before its length; large contents
            are read-only views. In the calling thread of :meth:`drain`, else in the loop's.
        on_closed: Called once with the reason, empty when this end closed it.
        lead: Bytes before each frame's length: 1 for a service's responses, else 0.
        peer: The peer's address, for messages.

    Attributes:
        peer: The peer's name once it is known, else its address; for messages.
        header: The peer's header; empty until it is received.
        serial: Its number, unique in this process.
        connected: Whether the connection is made; its header may not be received yet.
        on_room: Called when the send queue is empty; or None.
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
        #: Guards reading: frames are handed on in order, and the socket is closed by no other
        #: thread until then. Outside of the loop, this thread has it.
        self._turn = threading.Lock()
        self._turn_of = 0
        #: Guards sending: frames that publishers on any threads send, and those that wait.
        self._lock = threading.Lock()
        self._outgoing = Outgoing()
        self._unacked = UnackedBytes(sock)
        #: Whether frames are held back while the connection is stalled, and whether they are now.
        self._holds = self._held = False
        self.connected = False
        #: Bytes to read at once: each read allocates as many.
        self._read_size = _SMALL_READ_BYTES
        self._reading = self._urgent = True
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
            OSError: The system has no more sockets.
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
        made.connected = failure == 0
        made._begin()
        return made

    def accept(self) -> None:
        """Begin with an accepted socket."""
        self.connected = True
        self._begin()

    def _begin(self) -> None:
        self._limit = self._loop.after(_HEADER_TIMEOUT_S, self._expire)
        self._watch()

    def _expire(self) -> None:
        what = "no connection header was received" if self.connected else "no answer"
        self.end(f"{what} within {_HEADER_TIMEOUT_S:.0f} s")

    @property
    def closed(self) -> bool:
        """True once it has ended."""
        return self._closed

    @property
    def lost(self) -> int:
        """Number of frames that were replaced by newer ones, or expired."""
        return self._outgoing.lost

    @property
    def info(self) -> str:
        """The connection as ``rosnode info`` shows it; empty when it is not connected."""
        try:
            port, number = self._sock.getsockname()[1], self._sock.fileno()
            host, theirs = self._sock.getpeername()[:2]
        except OSError:
            return ""
        return f"TCPROS connection on port {port} to [{host}:{theirs} on socket {number}]"

    @property
    def received(self) -> int:
        """Number of received bytes."""
        return self._incoming.total

    def waiting(self) -> int:
        """Return the length of the send queue; from any thread."""
        return len(self._outgoing)

    def has_nothing_to_read(self) -> bool:
        """Return whether the socket has neither data nor its end to read; from any thread."""
        if not self._turn.acquire(blocking=False):
            return False
        try:
            if not self._closed:
                self._sock.recv(1, socket.MSG_PEEK)
        except (BlockingIOError, InterruptedError):
            return True
        except OSError:
            pass  # the next read reports it
        finally:
            self._release_turn()
        return False

    # -- sending ---------------------------------------------------------------------------------

    def send_header(self, fields: Mapping[str, str]) -> None:
        """Send this end's header; from any thread."""
        self.send_frame(Frame([encode_header(fields)], kept=True))

    def send(self, parts: Sequence[Buffer], keep: int = 0) -> None:
        """Send a frame, given with its length; see :meth:`send_frame`."""
        self.send_frame(Frame(parts), keep)

    def send_frame(self, frame: Frame, keep: int = 0, keep_bytes: int = 0) -> None:
        """Send a frame without blocking; from any thread.

        Queues a copy of what the socket does not accept: the caller may reuse its buffers.

        Args:
            frame: The frame.
            keep: Most frames in the queue, the oldest are dropped; 0 for any number.
            keep_bytes: Most bytes in the queue, without the newest frame; 0 for any number.
        """
        with self._lock:
            if self._closed:
                return
            sent = 0
            first = not self._outgoing
            self._holds = self._holds or keep > 0 or keep_bytes > 0
            if first and self.connected and not self._must_wait(frame.expiry > 0):
                sent = self._write(frame.parts)
                if sent == frame.size:
                    return
            self._outgoing.add(frame, sent, keep, keep_bytes)
        if first:
            self._loop.call(self._watch)

    def _write(self, parts: Sequence[memoryview]) -> int:
        """Write as much as the socket accepts; return the number of bytes."""
        try:
            sent = self._sock.sendmsg(parts)
        except (BlockingIOError, InterruptedError):
            return 0
        except OSError as error:
            reason = error.strerror or str(error)
            self._loop.call(lambda: self.end(reason))
            return 0
        self._unacked.written += sent
        return sent

    def _send_waiting(self) -> None:
        emptied = False
        with self._lock:
            outgoing = self._outgoing
            outgoing.expire()
            if self._closed or not outgoing:
                emptied = not self._closed
            elif self._must_wait(outgoing.is_command):
                self._hold(_COMMAND_POLL_S if outgoing.is_command else _STALLED_POLL_S)
            else:
                self._outgoing.send(self._write)
                emptied = not self._outgoing
        if emptied:
            self._watch()
            if self.on_room is not None:
                self.on_room()

    @property
    def stalled(self) -> bool:
        """True if the peer has not acknowledged sent bytes for half a second; from any thread."""
        with self._lock:
            return not self._closed and self.connected and self._unacked.stalled()

    def _must_wait(self, command: bool) -> bool:
        """Return whether a frame must not be handed to the system now."""
        return self._holds and self._unacked.stalled(command)

    def _hold(self, pause: float) -> None:
        """Send nothing for a moment: only the newest frames are of use after an outage."""
        if self._held:
            return
        self._held = True

        def release() -> None:
            self._held = False
            self._watch()

        self._loop.after(pause, release)
        self._loop.call(self._watch)

    # -- receiving -------------------------------------------------------------------------------

    def pause(self, reading: bool) -> None:
        """Stop or resume reading and handing on frames; in the loop's thread."""
        self._reading = reading
        self._incoming.stopped = self._closed or not reading
        self._watch()
        if reading:
            self._loop.call(self._resume)

    def _resume(self) -> None:
        if self._reading and not self._closed and self._turn.acquire(blocking=False):
            self._receive(resume=True)

    def set_batch_handler(self, on_frames: Callable[[list[Received], int], None]) -> None:
        """Hand on frames as they are received, several at once; `on_frames` must not raise."""
        self._incoming.take = on_frames

    def set_urgent(self, urgent: bool) -> None:
        """Set whether to read as soon as data arrives, or about ten times a second."""
        if urgent != self._urgent and not self._closed:
            self._urgent = urgent
            self._watch()

    def ready(self, events: int) -> None:
        """Send and receive; called by the loop."""
        if self._closed:
            return
        if not self.connected:
            failure = self._sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if failure:
                self.end(os.strerror(failure))
                return
            if self._sock.getsockname() == self._sock.getpeername():
                # TCP connected the socket to itself: its own port was the free one.
                self.end(os.strerror(errno.ECONNREFUSED))
                return
            self.connected = True
            events |= WRITE
        if events & WRITE:
            self._send_waiting()
        if events & READ and self._turn.acquire(blocking=False):
            before = self._incoming.total
            self._receive()
            if not self._urgent and self._incoming.total - before > _URGENT_BYTES:
                self.set_urgent(True)

    def drain(self) -> None:
        """Hand on the socket's data, unless that is done at once; from any thread."""
        me = threading.get_ident()
        if self._urgent or self._closed or self._turn_of == me:
            return
        # A thread that reads just now hands on the same messages.
        if self._turn.acquire(timeout=_TURN_TIMEOUT_S):
            self._turn_of = me
            self._receive()

    def _release_turn(self) -> None:
        self._turn_of = 0
        self._turn.release()
        if self._closed:  # while the socket could not be closed
            if self._loop.is_current:
                self._close_socket()
            else:
                self._loop.call(self._close_socket)

    def _close_socket(self) -> None:
        """Close the socket unless a thread reads from it, which calls this again afterwards."""
        if self._turn.acquire(blocking=False):
            self._sock.close()
            # The connection itself is cyclic garbage, which may be collected much later.
            self._incoming.clear()
            self._turn.release()

    def _receive(self, resume: bool = False) -> None:
        """Read the socket's data; with the turn, which ends here."""
        incoming, sock = self._incoming, self._sock
        try:
            if resume:
                incoming.feed(b"")
            for _ in range(_MAX_READS):
                if self._closed or not self._reading:
                    return
                room = incoming.room
                if room is None:
                    most = self._read_size
                    data = sock.recv(most)
                    count = len(data)
                    self._read_size = CHUNK if count == most else _SMALL_READ_BYTES
                    if count:
                        incoming.feed(data)
                else:
                    most = len(room)
                    count = sock.recv_into(room)
                    if count:
                        incoming.filled(count)
                if not count:
                    self._lose("the peer closed the connection")
                if count < most:
                    return
        except (BlockingIOError, InterruptedError):
            return
        except DecodeError as error:
            self._lose(str(error))
        except OSError as error:
            self._lose(error.strerror or str(error))
        finally:
            self._release_turn()

    def _take(self, frames: list[Received], first: int) -> None:
        if not self.header:
            self._take_header(bytes(frames[0]))
            return
        try:
            for frame in frames:
                self._on_frame(frame, first)
        except Exception as error:  # noqa: BLE001 - of ours: the link is made anew
            _log.exception("%s: handling a message failed", self.peer)
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
            self.end(f"{self.peer} refuses: {error or 'no reason given'}")
            return
        self._on_header(fields)

    def _lose(self, reason: str) -> None:
        """End it in the loop's thread; from any thread."""
        if self._loop.is_current:
            self.end(reason)
        else:
            self._loop.call(lambda: self.end(reason))

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """End it; from any thread."""
        self._loop.call(lambda: self.end(""))

    def finish(self, timeout: float) -> None:
        """End it once the send queue is empty, or after `timeout` seconds; in the loop's thread."""
        if self._closed:
            return
        if not self._outgoing:
            self.end("")
            return
        self.on_room = lambda: self.end("")
        # The system continues to deliver its data: the last message may be a stop command.
        self._holds = self._held = False
        self._watch()
        self._loop.linger(self, True)
        self._loop.after(timeout, lambda: self.end(""))

    def end(self, reason: str) -> None:
        """End it, with a reason; in the loop's thread."""
        with self._lock:
            if self._closed:
                return
            self._closed = self._incoming.stopped = True
            self._outgoing.clear()
        if self._limit is not None:
            self._limit.cancel()
        self._loop.linger(self, False)
        self._loop.watch(self._sock, 0, self)
        with suppress(OSError):  # the peer was faster
            # A forked process has the socket, too, and would keep it connected.
            self._sock.shutdown(socket.SHUT_RDWR)
        self._close_socket()
        self._on_closed(reason)

    def _watch(self) -> None:
        if self._closed:
            return
        sending = bool(self._outgoing and not self._held) or not self.connected
        events = (READ if self._reading else 0) | (WRITE if sending else 0)
        self._loop.watch(self._sock, events, self, urgent=self._urgent)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} with {self.peer}>"
