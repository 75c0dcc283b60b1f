"""Running jobs one after the other, in the order they were added, without a thread for it."""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["InOrder"]

_log = logging.getLogger("rosglass.comm")


class InOrder:
    """Runs jobs one at a time, in order, in the threads that add them.

    A thread that finds another one at it leaves its job to that one. So state that only jobs
    touch needs no lock, and callbacks that jobs make come in the order of what they tell.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._jobs: deque[Callable[[], None]] = deque()
        self._busy = False

    def add(self, job: Callable[[], None]) -> None:
        """Run `job` once all before it have run; exceptions are logged."""
        with self._lock:
            self._jobs.append(job)
            if self._busy:
                return
            self._busy = True
        while True:
            with self._lock:
                if not self._jobs:
                    self._busy = False
                    return
                job = self._jobs.popleft()
            try:
                job()
            except Exception:
                _log.exception("a job failed")
            except BaseException:  # Ctrl-C: the next one to come goes on
                with self._lock:
                    self._busy = False
                raise
