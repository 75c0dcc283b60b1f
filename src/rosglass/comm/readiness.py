"""Whether the other side of a service or action is there: waited for, and told when it changes."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from rosglass.comm import Listeners
from rosglass.comm.promise import check_timeout
from rosglass.comm.receiving import check_may_wait
from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Executor, Handle

__all__ = ["Readiness"]

#: Longest sleep in seconds of a thread that waits: not every middleware tells at once.
_SLICE = 0.1


class Readiness:
    """Looks whether somebody is there, and tells.

    Args:
        name: Of the service or action, for messages.
        ready: Says whether somebody is there.
        check_open: Raises NodeClosedError when it makes no sense to wait any more.
        default: Where callbacks run unless told otherwise.
    """

    def __init__(
        self,
        name: str,
        ready: Callable[[], bool],
        check_open: Callable[[], None],
        default: Executor,
    ) -> None:
        self._name, self._ready, self._check_open = name, ready, check_open
        self._default = default
        self._changed = threading.Condition()
        self._told = False
        self._listeners: Listeners[bool] = Listeners(where=name)

    def wait(self, timeout: float | None) -> bool:
        """Wait up to `timeout` seconds, None for ever; return whether somebody is there."""
        timeout = check_timeout(timeout, self._name)
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            self._check_open()
            if self._ready():
                return True
            check_may_wait(self._name)
            left = _SLICE if deadline is None else deadline - time.monotonic()
            if left <= 0:
                return False
            with self._changed:
                self._changed.wait(min(left, _SLICE))

    def add(self, callback: Callable[[bool], None], executor: Executor | None) -> Handle:
        """Tell `callback` each change."""
        self._check_open()
        if not callable(callback):
            raise ArgumentError("callback", callback, "something that can be called", self._name)
        return self._listeners.add(callback, executor or self._default)

    def update(self) -> None:
        """Look, and tell; by one thread only."""
        ready = self._ready()
        changed, self._told = ready != self._told, ready
        self._wake()
        if changed:
            self._listeners.notify(ready)

    def close(self) -> None:
        """Tell nobody any more, and let who waits find out."""
        self._wake()
        self._listeners.clear()

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()
