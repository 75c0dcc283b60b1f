"""Which publishers of a topic are alive, as far as a subscription can know.

A publisher with automatic liveliness is alive while it is seen. One that promised to show its
liveliness itself (manual by topic) is alive while it does so within its lease duration: by sending
something, or by a word of its own, which only DDS carries and only as a count.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rosglass.comm import Liveliness

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import EndpointInfo, Handle, Timers
    from rosglass.ros2.repeats import Repeats
    from rosglass.wires.base import Reader

__all__ = ["Liveness"]


class Liveness:
    """Tells the publishers that are alive from those that are only there.

    Args:
        timers: Run the next look.
        repeats: Knows the last sample of each publisher.
        look: Called when it is time to :meth:`follow` again.
    """

    def __init__(self, timers: Timers, repeats: Repeats, look: Callable[[], None]) -> None:
        self._timers, self._repeats, self._look = timers, repeats, look
        self._signs: dict[bytes, tuple[tuple[int, int], float]] = {}
        self._timer: Handle | None = None

    def follow(self, there: Sequence[EndpointInfo], reader: Reader | None) -> list[EndpointInfo]:
        """Return those of the publishers that are `there` who are alive now."""
        manual = [
            (endpoint, endpoint.qos.lease_duration.seconds)
            for endpoint in there
            if endpoint.qos.liveliness is Liveliness.MANUAL_BY_TOPIC
            and endpoint.qos.lease_duration is not None
        ]
        if not manual:
            self.close()
            return list(there)
        now = time.monotonic()
        signs = {endpoint.gid: self._sign(endpoint.gid, now) for endpoint, _ in manual}
        self._signs = {gid: (self._repeats.latest(gid), at) for gid, at in signs.items()}
        silent = [endpoint for endpoint, lease in manual if now - signs[endpoint.gid] > lease]
        alive = None if reader is None else reader.alive()
        if alive is not None:
            # The middleware knows better how many, but not which: those who sent last.
            manual.sort(key=lambda one: signs[one[0].gid])
            silent = [endpoint for endpoint, _ in manual[: max(0, len(there) - alive)]]
        self.close()
        pause = min(lease for _, lease in manual) / 2
        self._timer = self._timers.after(pause, self._look)
        return [endpoint for endpoint in there if endpoint not in silent]

    def close(self) -> None:
        """Look no more; safe to call twice."""
        timer, self._timer = self._timer, None
        if timer is not None:
            timer.close()

    def _sign(self, gid: bytes, now: float) -> float:
        """Return when a publisher showed last that it is alive; when it was seen first, that."""
        known = self._signs.get(gid)
        if known is None or known[0] != self._repeats.latest(gid):
            return now
        return known[1]
