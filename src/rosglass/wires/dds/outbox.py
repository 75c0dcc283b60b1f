"""What cannot be sent yet, because a counterpart is not matched or takes nothing at the moment."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

from rosglass.errors import Error, NodeClosedError

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Outbox"]

_log = logging.getLogger("rosglass.ros2")


class _Item(NamedTuple):
    attempt: Callable[[], bool]
    deadline: float
    expired: Callable[[], None]


class Outbox:
    """Sends at once what can be sent, and keeps the rest to be tried again.

    Args:
        wake: Called when there is something for :meth:`retry`, with whether it can be done at once.
        in_order: Whether nothing overtakes anything.
    """

    def __init__(self, wake: Callable[[bool], None], *, in_order: bool) -> None:
        self._wake, self._in_order = wake, in_order
        self._lock = threading.Lock()
        self._items: deque[_Item] = deque()
        self._closed = False

    def put(
        self,
        attempt: Callable[[], bool],
        patience: float,
        expired: Callable[[], None],
        *,
        now: bool = True,
    ) -> None:
        """Send something now, or as soon as it can be done.

        Args:
            attempt: Sends it; returns False to be called again a little later.
            patience: Seconds after which it is given up.
            expired: Called then, and when it cannot be sent at all.
            now: Whether to try it in the calling thread; what it raises comes out of here then.
        """
        if now and not (self._in_order and self._items) and attempt():
            return
        with self._lock:
            if self._closed:
                return
            self._items.append(_Item(attempt, time.monotonic() + patience, expired))
        self._wake(not now)

    def retry(self) -> bool:
        """Try again what is left; returns whether there is still something. For one thread."""
        with self._lock:
            items = list(self._items)
        for item in items:
            if self._try(item):
                with self._lock, suppress(ValueError):
                    self._items.remove(item)
            elif self._in_order:
                break
        return bool(self._items)

    def drain(self, seconds: float) -> None:
        """Wait until nothing is left, at most so long; not in the thread that retries."""
        until = time.monotonic() + seconds
        while self._items and time.monotonic() < until:
            time.sleep(0.005)

    def close(self) -> None:
        """Forget what is left."""
        with self._lock:
            self._closed = True
            self._items.clear()

    def _try(self, item: _Item) -> bool:
        try:
            if item.attempt():
                return True
        except NodeClosedError:
            return True
        except Exception as error:
            _log.warning(
                "what was to be sent is lost: %s", error, exc_info=not isinstance(error, Error)
            )
            item.expired()  # nobody is to wait for it
            return True
        if time.monotonic() < item.deadline:
            return False
        item.expired()
        return True
