"""A client's connection to a server of ours: its requests, one after the other."""

from __future__ import annotations

import struct
from collections import deque
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.ros1.connection import Connection
    from rosglass.ros1.io_loop import IoLoop

__all__ = ["Session"]

_head = struct.Struct("<BI")
#: Seconds that closing waits until a response that is on its way is sent.
_FAREWELL = 1.0


class Session:
    """A connection through which a service is called; in the loop's thread, unless said otherwise.

    Requests are handed on one at a time, so that responses go out in their order; while one
    waits, no more is read.

    Args:
        loop: The connection's.
        link: The connection.
        persistent: Whether it stays open after a response.
        on_request: Called with each request.

    Attributes:
        client: Who calls, for people.
    """

    def __init__(
        self,
        loop: IoLoop,
        link: Connection,
        persistent: bool,
        on_request: Callable[[Session, bytes | memoryview], None],
    ) -> None:
        self.client = link.header.get("callerid", "") or link.peer
        self._loop, self._link, self._persistent = loop, link, persistent
        self._on_request = on_request
        self._busy = self._paused = False
        self._waiting: deque[bytes | memoryview] = deque()

    @property
    def gone(self) -> bool:
        """Whether the client cannot get a response any more."""
        return self._link.closed

    def take(self, data: bytes | memoryview) -> None:
        """Take a request."""
        if not self._busy:
            self._busy = True
            self._on_request(self, data)
        else:
            self._waiting.append(data)
            self._paused = True
            self._link.pause(False)

    def answer(self, ok: bool, parts: Sequence[Any]) -> None:
        """Send the response to the request that was handed on; from any thread."""
        size = sum(memoryview(part).nbytes for part in parts)
        self._link.send([_head.pack(ok, size), *parts])
        self._loop.call(self._answered)

    def close(self) -> None:
        """End the connection once what is on its way is sent, or a second later."""
        self._waiting.clear()
        self._link.finish(_FAREWELL)

    def _answered(self) -> None:
        link = self._link
        if link.closed:
            return
        # Who does not read a response gets no more of them.
        proceed = self._next if self._persistent else lambda: link.end("")
        if link.waiting():
            link.on_room = proceed
        else:
            proceed()

    def _next(self) -> None:
        self._link.on_room = None
        self._busy = False
        if self._waiting:
            self.take(self._waiting.popleft())
        elif self._paused:
            self._paused = False
            self._link.pause(True)
