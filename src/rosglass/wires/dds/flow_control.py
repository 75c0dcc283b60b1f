"""Flow control for large samples that readers on Fast DDS receive.

Cyclone DDS displaces the oldest sample of a KEEP_LAST writer even while a reader still asks for
missing fragments of it, and answers the next request with a GAP. Fast DDS (2.14 and 3.2 were read)
releases a sample that it has received in part on such a GAP, but leaves it in the list that
``take()`` walks: the reader's process then spins for ever. Its own writers send no such GAP, as
they send a heartbeat with the new first sample instead.

A large sample is therefore not sent before the readers have acknowledged earlier ones, and is
displaced here, where no reader has seen any of it. A reader that acknowledges nothing, as it was
killed or stopped, holds up the others for half a second only; from then on, frequent heartbeats
name the first sample that is left.
"""

from __future__ import annotations

import math
import time
from collections import deque
from typing import TYPE_CHECKING

from rosglass.wires.dds import cyclone
from rosglass.wires.dds.cyclone_samples import discard, send

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.wires.dds.participant import Pump

__all__ = ["FlowControl", "is_fast_dds"]

#: First two bytes of the GUIDs of Fast DDS.
_FAST_DDS = b"\x01\x0f"
#: Maximum size and number of large samples that are sent without an acknowledgement; one may be
#: larger, and two are always sent.
_WINDOW_BYTES, _WINDOW = 1_000_000, 2
#: Seconds that samples wait for an acknowledgement, before they are sent without one.
_STALL_S = 0.5
#: Seconds without a request for a repetition after which the other readers have got everything.
_QUIET_S = 0.05


def is_fast_dds(guid: bytes) -> bool:
    """Return whether a GUID is that of an entity of Fast DDS."""
    return guid.startswith(_FAST_DDS)


class FlowControl:
    """The large samples of a reliable KEEP_LAST writer, and how many of them are under way.

    Used under the writer's lock, except for :meth:`poll`.

    Args:
        writer: Cyclone's number for the writer.
        depth: Its depth: so many samples wait at most, and a further one displaces the oldest.
        latched: Whether it is transient local: a late reader may be getting what it holds.
        fragment: Size in bytes of the largest sample that is sent in one piece.
        pump: Polls it while samples wait.
        place: The writer's topic, for errors.
        poll: Called on the pump's thread; takes the writer's lock and calls :meth:`advance`.

    Attributes:
        displaced: Number of samples that were displaced before they were sent.
        displaced_at: Monotonic time in seconds when that last happened.
    """

    def __init__(
        self,
        writer: int,
        depth: int,
        latched: bool,
        fragment: int,
        pump: Pump,
        place: str,
        poll: Callable[[], bool],
    ) -> None:
        self._writer, self._depth, self._fragment, self._place = writer, depth, fragment, place
        #: Number of samples under way that displace no other one, and how many of any size.
        self._limit = 0 if latched else max(depth - 1, 1)
        self._window = min(_WINDOW, self._limit)
        self._pump, self._poll = pump, poll
        self.displaced, self.displaced_at = 0, -math.inf
        #: The samples that wait, which hold a reference each, and their sizes.
        self._waiting: deque[tuple[int, int]] = deque()
        #: Number and size of the samples from the first large one that is not acknowledged.
        self._count = self._bytes = 0
        #: When the last one was sent, and whether a reader has acknowledged none for too long.
        self._sent = 0.0
        self._stalled = False
        #: Requested repetitions in bytes, and when they last changed.
        self._repeats: cyclone.RepeatedBytes | None = None
        self._repeated, self._quiet_since = 0, 0.0
        self._readers: list[int] = []
        self._needed = False

    @property
    def idle(self) -> bool:
        """True while no sample waits."""
        return not self._waiting

    def hold(self, serdata: int, size: int) -> bool:
        """Return whether a sample must wait; takes over the reference to it in that case."""
        if size <= self._fragment and not (self._count or self._waiting):
            return False
        if not self._waiting and not self._is_needed():
            self._count = 0
            return False
        self.advance()
        if not self._waiting and self._may_send(size):
            self._note_sent(size)
            return False
        if len(self._waiting) == self._depth:
            discard(self._waiting.popleft()[0])
            self.displaced += 1
            self.displaced_at = time.monotonic()
        self._waiting.append((serdata, size))
        self._pump.poll(-self._writer, self._poll)
        return True

    def advance(self) -> bool:
        """Send the samples that may be sent; return whether to call this again soon."""
        needed = not (self._waiting or self._stalled) or self._is_needed()
        while self._waiting and (not needed or self._may_send(self._waiting[0][1])):
            serdata, size = self._waiting.popleft()
            try:
                send(self._writer, serdata, self._place)
            finally:
                discard(serdata)
            self._note_sent(size)
        if self._stalled and needed and not self._is_acknowledged():
            # This sends a heartbeat with the first sample that is left: a stopped reader that goes
            # on must get it before it asks for an older one.
            cyclone.assert_liveliness(self._writer, self._place)
            return True
        self._stalled = False
        if self._waiting:
            return True
        self._pump.forget(-self._writer)
        return False

    def close(self) -> None:
        """Drop waiting samples."""
        self._stalled = False
        while self._waiting:
            discard(self._waiting.popleft()[0])
        self._pump.forget(-self._writer)
        if self._repeats is not None:
            self._repeats.close()
            self._repeats = None

    def _note_sent(self, size: int) -> None:
        if size > self._fragment or self._count:
            self._count += 1
            self._bytes += size
            self._sent = time.monotonic()

    def _may_send(self, size: int) -> bool:
        if self._count < self._window:
            return True
        if self._count < self._limit and self._bytes + size <= _WINDOW_BYTES:
            return True
        if self._is_acknowledged():
            return True
        now = time.monotonic()
        if self._repeats is None:
            self._repeats = cyclone.RepeatedBytes(self._writer)
        repeated = self._repeats.get()
        if repeated != self._repeated:
            self._repeated, self._quiet_since = repeated, now
        if now - self._sent < _STALL_S:
            return self._stalled and now - max(self._sent, self._quiet_since) >= _QUIET_S
        if not self._stalled:
            self._stalled = True
            self._pump.poll(-self._writer, self._poll)
        return True

    def _is_acknowledged(self) -> bool:
        if not cyclone.acknowledged(self._writer):
            return False
        self._count = self._bytes = 0
        self._stalled = False
        return True

    def _is_needed(self) -> bool:
        """Return whether a reader on Fast DDS is matched."""
        readers = cyclone.matched_subscriptions(self._writer)
        if readers != self._readers:
            found = (cyclone.matched_subscription(self._writer, reader) for reader in readers)
            self._needed = any(each and is_fast_dds(each.guid) for each in found)
            self._readers = readers
        return self._needed
