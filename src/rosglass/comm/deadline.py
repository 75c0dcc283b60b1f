"""One time limit for several questions that are asked one after the other."""

from __future__ import annotations

import time

from rosglass.comm.promise import check_timeout

__all__ = ["Deadline"]


class Deadline:
    """The end of the time that a caller gives.

    Args:
        timeout: Seconds from now, None for ever.
        where: What is asked, in errors.

    Raises:
        ConversionError: The timeout is none.
    """

    def __init__(self, timeout: float | None, where: str) -> None:
        timeout = check_timeout(timeout, where)
        self._end = None if timeout is None else time.monotonic() + timeout

    def left(self) -> float | None:
        """Return the seconds that are left, None when there is no end."""
        # Rounded: people read it when the time is over.
        return None if self._end is None else max(0.0, round(self._end - time.monotonic(), 2))
