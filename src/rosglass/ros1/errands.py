"""Jobs that wait for others: XML-RPC calls, host names."""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Errands"]

_log = logging.getLogger("rosglass.ros1")
#: Jobs under way at once: nodes that are gone, but registered still, answer only by a time-out,
#: and others must not wait for that.
_MOST = 32
#: Seconds after which a thread without job ends.
_IDLE = 5.0


class Errands:
    """Runs jobs that may take seconds on daemon threads, several at a time.

    Args:
        name: Of the threads.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._changed = threading.Condition()
        self._jobs: deque[Callable[[], None]] = deque()
        self._threads = self._idle = 0
        self._closed = False

    def run(self, job: Callable[[], None]) -> None:
        """Run `job` as soon as a thread is free; forgotten after :meth:`close`."""
        with self._changed:
            if self._closed:
                return
            self._jobs.append(job)
            if self._idle >= len(self._jobs):
                self._changed.notify()
                return
            if self._threads == _MOST:
                return
            self._threads += 1
            number = self._threads
        thread = threading.Thread(target=self._work, name=f"{self._name} {number}", daemon=True)
        try:
            thread.start()
        except RuntimeError as error:  # no more threads, or the interpreter is at its end
            with self._changed:
                self._threads -= 1
            _log.warning("%s: a job has to wait: %s", self._name, error)

    def close(self) -> None:
        """Forget the jobs that wait; those under way end by their own time-outs."""
        with self._changed:
            self._closed = True
            self._jobs.clear()
            self._changed.notify_all()

    def _work(self) -> None:
        while (job := self._next()) is not None:
            self._run(job)

    def _run(self, job: Callable[[], None]) -> None:
        try:
            job()
        except Exception:
            _log.exception("%s: a job failed", self._name)

    def _next(self) -> Callable[[], None] | None:
        with self._changed:
            self._idle += 1
            try:
                self._changed.wait_for(lambda: bool(self._jobs) or self._closed, _IDLE)
                if self._jobs:
                    return self._jobs.popleft()
                self._threads -= 1
                return None
            finally:
                self._idle -= 1
