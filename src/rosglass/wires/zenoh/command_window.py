"""Keeps at most one command of a publisher on its way to the router."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

import zenoh

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.timers import Timers

__all__ = ["CommandWindow"]

#: Seconds between polls for the router's answer, while a message waits for it.
_POLL_S = 0.01
#: Shortest and longest time in seconds without an answer after which messages are held. The last
#: zeros of a stop are repeated for a second without one that was dropped, so that an outage that
#: begins with them has to be noticed within that.
_MIN_STALL_S, _MAX_STALL_S = 0.1, 0.8
#: Longest answer in seconds that counts as a round trip, not as an outage.
_MAX_ROUND_TRIP_S = 1.0
#: Seconds after which a query is given up, and the next message is sent all the same: an answer
#: that was lost must not silence a publisher for ever.
_QUERY_TIMEOUT_S = 10.0
#: How long :attr:`CommandWindow.problem` names dropped messages.
_REPORT_S = 10.0


class CommandWindow:
    """Holds a publisher's messages back while the router does not confirm earlier ones.

    A message that was handed to Zenoh cannot be recalled: it lies in Zenoh's queue, in the system's
    buffers or in those of a relay, and is delivered after an outage, however old it is by then. So
    a query without result follows the messages. When it has not been answered within twice the
    usual time, or 0.8 s, only the newest message is kept, and sent when the answer comes, or
    dropped.

    The limit follows the round trip, as the answers may queue behind camera images for a second: a
    stop must not wait for them. They confirm the way to the router, not that from there to the
    subscribers.

    Args:
        timers: Poll for the answer while a message waits.
        timeout: Seconds that a message may wait.
        query: Sends a query that ends when the router has answered, and returns its channel.
        send: Sends a message; called with the window's lock held.
        is_linked: Returns whether there is a link that a message could leave by.

    Attributes:
        lost: Messages dropped here: for newer ones, as too old, or without a link.
    """

    def __init__(
        self,
        timers: Timers,
        timeout: float,
        query: Callable[[float], Any],
        send: Callable[[bytes, bytes], None],
        is_linked: Callable[[], bool],
    ) -> None:
        self._timers, self._timeout = timers, timeout
        self._query, self._send, self._is_linked = query, send, is_linked
        self._lock = threading.Lock()
        #: The channel of the query that is not answered yet; when the last one was sent, and
        #: for how long it was seen without an answer; the usual value of that.
        self._answer: Any = None
        self._asked_at = self._waited = self._round_trip = 0.0
        #: The message that waits, its attachment, and when it is dropped.
        self._held: tuple[bytes, bytes, float] | None = None
        self._polls = False
        self.lost = 0
        self._lost_at = -_REPORT_S

    def send(self, data: bytes, note: bytes) -> None:
        """Send a message now, or hold it in place of the one that waits.

        Raises:
            zenoh.ZError: The session is closed.
        """
        with self._lock:
            if self._held is not None:
                self._drop()
            if not self._is_linked():
                self._drop()
            elif self._is_open():
                self._send_now(data, note)
            else:
                self._held = (data, note, time.monotonic() + self._timeout)
                if not self._polls:
                    self._polls = True
                    self._timers.after(_POLL_S, self._poll)

    @property
    def problem(self) -> str:
        """That messages were dropped in the last 10 s, in words; empty if none was."""
        if time.monotonic() - self._lost_at > _REPORT_S:
            return ""
        return (
            "messages are dropped here, as the router does not confirm earlier ones in time: they "
            "would be delivered too late"
        )

    def close(self) -> None:
        """Send the message that waits, if any: it may be a stop. Safe to call twice."""
        with self._lock:
            if self._held is not None:
                self._release(self._send, *self._held[:2])

    def _poll(self) -> None:
        with self._lock:
            self._polls = False
            if self._held is None:
                return
            data, note, expiry = self._held
            if time.monotonic() > expiry:
                self._drop()
            elif self._is_open():
                self._release(self._send_now, data, note)
            else:
                self._polls = True
                self._timers.after(_POLL_S, self._poll)

    def _release(self, send: Callable[[bytes, bytes], None], data: bytes, note: bytes) -> None:
        """Send the message that waited."""
        try:
            send(data, note)
        except zenoh.ZError:  # the session is closed
            self._drop()
        self._held = None

    def _is_open(self) -> bool:
        """Return whether the router confirms the messages in time."""
        if self._answer is None:
            return True
        waited = time.monotonic() - self._asked_at
        try:
            over = self._answer.try_recv() is not None  # an error: the timeout
        except zenoh.ZError:  # the end of the answer
            over = True
        if not over:
            self._waited = waited
            return waited <= min(max(_MIN_STALL_S, 2 * self._round_trip), _MAX_STALL_S)
        self._answer = None
        if self._waited <= _MAX_ROUND_TRIP_S:
            self._round_trip = max(self._waited, 0.9 * self._round_trip)
        return True

    def _send_now(self, data: bytes, note: bytes) -> None:
        self._send(data, note)
        if self._answer is None:
            self._asked_at, self._waited = time.monotonic(), 0.0
            self._answer = self._query(_QUERY_TIMEOUT_S)

    def _drop(self) -> None:
        """Count a dropped message: the one that waits, or the one that is given."""
        self._held = None
        self.lost += 1
        self._lost_at = time.monotonic()
