"""What waits to be sent on: one thread for each topic, so that pictures hold up no command."""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Sample

__all__ = ["Outbox"]

_log = logging.getLogger("rosglass.bridge")
#: Seconds that closing waits for a message that is being sent.
_PATIENCE = 2.0


class Outbox:
    """Hands samples on, one after the other, on a thread of its own.

    Args:
        name: The thread's name.
        handle: What to do with each.
        limit: Bytes that may wait; beyond, the oldest are dropped, and counted.

    Attributes:
        dropped: How many were dropped.
    """

    def __init__(self, name: str, handle: Callable[[Sample], None], limit: int) -> None:
        self._name, self._handle, self._limit = name, handle, limit
        self._ready = threading.Condition()
        self._waiting: deque[Sample] = deque()
        self._size = 0
        self._thread: threading.Thread | None = None
        self._closed = False
        self.dropped = 0

    def put(self, sample: Sample) -> None:
        """Take a sample, from any thread, without waiting."""
        with self._ready:
            if self._closed:
                return
            self._waiting.append(sample)
            self._size += len(sample.data)
            while self._size > self._limit and len(self._waiting) > 1:
                self._size -= len(self._waiting.popleft().data)
                self.dropped += 1
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
                self._thread.start()
            self._ready.notify()

    def close(self) -> None:
        """Forget what waits and end the thread; safe to call twice."""
        with self._ready:
            self._closed = True
            self._waiting.clear()
            self._ready.notify()
            thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(_PATIENCE)

    def _work(self) -> None:
        while True:
            with self._ready:
                self._ready.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                sample = self._waiting.popleft()
                self._size -= len(sample.data)
            try:
                self._handle(sample)
            except Exception:
                _log.exception("%s failed", self._name)
