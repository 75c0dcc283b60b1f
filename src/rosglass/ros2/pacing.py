"""Requests and replies no faster than ROS 2's servers and clients take them.

A server of ROS 2 keeps the last 10 requests that it has not taken, of all its clients together,
and a client the last 10 replies (``rmw_qos_profile_services_default``, in every middleware). What
comes beyond that displaces the oldest, and neither side is informed.
"""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from rosglass.comm.timers import Timers

__all__ = ["HOLD_S", "LIMIT", "STALL_S", "ReplyPacer", "RequestWindow"]

#: Requests that are open at a time, or replies in a burst: two less than the peer's queue holds.
LIMIT = 8
#: Seconds without an answer after which an open request counts as taken: its server holds it until
#: later, or it is lost.
STALL_S = 30.0
#: The same for requests that a server is known to hold, such as those for an action's result.
HOLD_S = 0.1
#: Seconds that a client is given to take a burst of replies.
_BURST_S = 0.04
#: Clients whose open requests are counted, and replies to one that wait at most: of more, sent to
#: a client that asks faster than it listens, most will be lost.
_MAX_CLIENTS = _MAX_WAITING = 1000


class RequestWindow:
    """The open requests of a node to one service, :data:`LIMIT` at most.

    Args:
        stall_s: Seconds without an answer after which an open request counts as taken.
    """

    def __init__(self, stall_s: float) -> None:
        self._stall_s = stall_s
        self._lock = threading.Lock()
        #: When each that is open was sent, monotonic; the oldest first.
        self._open: dict[Hashable, float] = {}
        #: What to call when there is room, for those that found none.
        self._waiting: dict[Callable[[], None], None] = {}

    def enter(self, request: Hashable, retry: Callable[[], None]) -> bool:
        """Return whether a request may be sent now.

        Args:
            request: It counts until it leaves.
            retry: One of the calls that :meth:`leave` returns when there is room again.
        """
        now = time.monotonic()
        with self._lock:
            if len(self._open) >= LIMIT:
                while self._open and now - next(iter(self._open.values())) >= self._stall_s:
                    del self._open[next(iter(self._open))]
                if len(self._open) >= LIMIT:
                    self._waiting[retry] = None
                    return False
            self._open[request] = now
        return True

    def leave(self, request: Hashable) -> list[Callable[[], None]]:
        """Take note that a request is not open any more; return what to call, without a lock."""
        with self._lock:
            if self._open.pop(request, None) is None or not self._waiting:
                return []
            waiting = list(self._waiting)
            self._waiting.clear()
        return waiting


@dataclass(slots=True)
class _Client:
    """A client that has sent requests.

    Attributes:
        open: How many of them are open.
        paced: Whether they were more than it can take the replies of at once.
        burst: Replies sent since `since`, monotonic.
        waiting: Replies to be sent, in order.
        sending: Whether a thread sends them, or a timer will.
    """

    open: int = 0
    paced: bool = False
    burst: int = 0
    since: float = 0.0
    waiting: list[Callable[[], None]] = field(default_factory=list)
    sending: bool = False


class ReplyPacer:
    """The replies of a server: to clients with many open requests in bursts of :data:`LIMIT`.

    A client with fewer open requests gets each reply at once.

    Args:
        timers: Send what has to wait.
    """

    def __init__(self, timers: Timers) -> None:
        self._timers = timers
        self._lock = threading.Lock()
        self._clients: dict[bytes, _Client] = {}

    def on_request(self, client: bytes) -> None:
        """Count a request."""
        with self._lock:
            known = self._clients.get(client)
            if known is None:
                if len(self._clients) >= _MAX_CLIENTS:
                    self._drop_one()
                known = self._clients[client] = _Client()
            known.open += 1
            if known.open > LIMIT:
                known.paced = True

    def on_reply(self, client: bytes) -> bool:
        """Count a request that is answered; return False if its reply is for :meth:`send_later`."""
        with self._lock:
            known = self._clients.get(client)
            if known is not None:
                if known.paced or known.sending:
                    return False
                self._count_reply(known, time.monotonic())
        return True

    def send_later(self, client: bytes, send: Callable[[], None]) -> None:
        """Send a reply as soon as its client can take it; `send` raises nothing."""
        with self._lock:
            known = self._clients.get(client)
            if known is not None:
                known.waiting.append(send)
                if known.sending:
                    return
                known.sending = True
        if known is None:
            send()
        else:
            self._send_waiting(known)

    def on_failure(self, client: bytes) -> None:
        """Count a request that gets no reply."""
        with self._lock:
            known = self._clients.get(client)
            if known is not None:
                known.open -= 1

    def flush(self) -> None:
        """Send all that waits at once, before the server goes."""
        with self._lock:
            clients = list(self._clients.values())
            self._clients.clear()
        for known in clients:
            while known.waiting:
                with suppress(IndexError):  # another thread sent the last one
                    known.waiting.pop(0)()

    def _send_waiting(self, known: _Client) -> None:
        """Send as much as the client can take now, and the rest later."""
        while True:
            with self._lock:
                if not known.waiting:
                    known.sending = False
                    return
                now = time.monotonic()
                later = known.since + _BURST_S - now
                if later > 0 and known.burst >= LIMIT and len(known.waiting) <= _MAX_WAITING:
                    break
                send = known.waiting.pop(0)
                self._count_reply(known, now)
            send()
        self._timers.after(later, lambda: self._send_waiting(known))

    def _count_reply(self, known: _Client, now: float) -> None:
        """Count a reply that is about to be sent; the lock is held."""
        if now - known.since >= _BURST_S:
            known.burst, known.since, known.paced = 0, now, known.open > LIMIT
        known.burst += 1
        known.open -= 1

    def _drop_one(self) -> None:
        """Forget a client, one without open requests if there is one; the lock is held."""
        idle = (client for client, known in self._clients.items() if known.open <= 0)
        unanswered = (client for client, known in self._clients.items() if not known.waiting)
        client = next(idle, None) or next(unanswered, None)
        if client is not None:
            del self._clients[client]
