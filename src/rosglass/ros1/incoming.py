"""Cutting what a connection receives into frames: small ones many at a time, big ones in place.

Format: ROS wiki, "ROS/TCPROS": each frame has its length in front, 32-bit, little-endian. The first
one is the connection header. A service's responses have one more byte in front of the length.
"""

from __future__ import annotations

import struct
from contextlib import suppress
from typing import TYPE_CHECKING

from rosglass.errors import DecodeError
from rosglass.ros1.header import MAX_HEADER

if TYPE_CHECKING:
    from collections.abc import Callable

    Received = bytes | memoryview

__all__ = ["CHUNK", "MAX_FRAME", "Incoming"]

#: Longest frame taken in bytes: what a length says beyond it is garbage, as roscpp has it.
MAX_FRAME = 1_000_000_000
#: Bytes to read at once as long as there is no :attr:`Incoming.room`.
CHUNK = 64 * 1024
#: A frame of which only the beginning came gets a buffer of its own if it is longer.
_SMALL = 4 * 1024
#: Bytes that a peer gets on its word alone, when it has sent nothing of that size before.
_CREDIT = 1024 * 1024
#: Buffers that are used again once nobody looks at them: to touch new memory costs as much as to
#: receive into it.
_SPARE = 4
#: Frames of one size that are cut at once: most topics have messages of one size.
_RUN = 32
_length = struct.Struct("<I")


class Incoming:
    """Cuts one connection's bytes into frames.

    Args:
        peer: For errors.
        lead: Bytes in front of each frame's length once the header has come: 1 or 0.
        take: Called with some frames and the byte in front of them; the header comes alone, and so
            does each frame with a byte in front. Frames above 64 KiB are read-only views of a
            buffer that stays as it is as long as somebody has a view of it.

    Attributes:
        room: Where to receive into, then to call :meth:`filled`; None to call :meth:`feed`.
        stopped: Set to True to have nothing more handed on; what is there already is kept.
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
        #: The beginning of a small frame whose end has not come.
        self._rest = b""
        self._big = bytearray()
        self._size = self._there = self._first = 0
        self._credit = _CREDIT
        self._spare: list[bytearray] = []
        self._run: struct.Struct | None = None

    def feed(self, data: bytes) -> None:
        """Take what came; raises DecodeError when it is no TCPROS."""
        end = len(data)
        self.total += end
        if (
            self._headed
            and end >= 4
            and _length.unpack_from(data)[0] == end - 4
            and not (self._rest or self._lead or self.stopped)
        ):
            # One message, whole: what comes at a moderate rate comes like this.
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
        beginning, before, patience = False, -1, 0
        # Every line of this is paid for by each message of the fastest topics.
        while not self.stopped:
            body = start + 4
            if body > end:
                break
            (size,) = unpack(data, start)
            if size == before and not patience and start + _RUN * (size + 4) <= end:
                run = self._run_of(size).unpack_from(data, start)
                if run[::2].count(size) == _RUN:
                    frames += run[1::2]
                    start += _RUN * (size + 4)
                    continue
                patience = _RUN
            stop = body + size
            if stop > end:
                beginning = True
                break
            append(data[body:stop])
            start, before = stop, size
            if patience:
                patience -= 1
        if frames:
            self.take(frames, 0)
        if beginning:
            self._begin(data, start, body, size)
        else:
            self._rest = data[start:]

    def _run_of(self, size: int) -> struct.Struct:
        """Return what cuts many frames of one size at once, each with its length."""
        if self._run is None or self._run.size != _RUN * (size + 4):
            self._run = struct.Struct(f"<{f'I{size}s' * _RUN}")
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
        """Take what came into :attr:`room`."""
        room, self.room = self.room, None
        if room is not None:
            room.release()  # or the buffer cannot grow
        self.total += count
        self._there += count
        if self._there < min(self._size, len(self._big)):
            self._open()
        elif self._there < self._size:
            # It has sent as much as it was trusted with: as much again.
            self._big.extend(bytes(min(self._size - self._there, self._there)))
            self._open()
        else:
            self._complete()

    def _feed_header(self, data: bytes) -> int:
        """Hand on the connection header; returns where it ends, -1 when it is not complete."""
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
        if size <= _SMALL:
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
        del self._spare[:-_SPARE]
        first = self._first if self._headed and self._lead else 0
        if self._headed and self._size > CHUNK:
            self.take([view], first)
        else:
            self._headed = True
            self.take([bytes(view)], first)

    def _buffer(self, size: int) -> bytearray:
        """Return a buffer of at least that size, one that nobody looks at any more if possible."""
        for index, spare in enumerate(self._spare):
            if size <= len(spare) <= 2 * size:
                with suppress(BufferError):
                    # Python itself says whether somebody has a view of it: it cannot grow then.
                    spare.append(0)
                    spare.pop()
                    return self._spare.pop(index)
        return bytearray(size)
