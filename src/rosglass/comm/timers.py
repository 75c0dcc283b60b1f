"""Jobs that run after a while, on one thread for all of them."""

from __future__ import annotations

import heapq
import itertools
import logging
import threading
import time
from typing import TYPE_CHECKING

from rosglass.comm.node import Handle

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Timers"]

_log = logging.getLogger("rosglass.comm")
#: Seconds that closing waits for a job that is still running.
_PATIENCE = 2.0
#: Longest single wait in seconds; the system's limit is some thousand years below infinity.
_LONGEST = 3600.0
#: Jobs that were called off are swept out when they are so many, and more than half.
_SWEEP = 64


class Timers:
    """Runs jobs after a delay, in order of time, on one daemon thread that starts with the first.

    Jobs must return soon: the others wait meanwhile.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._changed = threading.Condition()
        self._jobs: list[tuple[float, int, _Job]] = []
        self._numbers = itertools.count()
        self._called_off = 0
        self._thread: threading.Thread | None = None
        self._closed = False

    def after(self, delay: float, job: Callable[[], None]) -> Handle:
        """Run `job` after `delay` seconds, unless the handle is closed before.

        Jobs are forgotten when the timers are closed.
        """
        made = _Job(self, job)
        with self._changed:
            if self._closed:
                return made
            due = time.monotonic() + delay
            heapq.heappush(self._jobs, (due, next(self._numbers), made))
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
                self._thread.start()
            elif self._jobs[0][2] is made:
                self._changed.notify()
        return made

    def close(self) -> None:
        """Forget all jobs and end the thread; safe to call twice, and from a job."""
        with self._changed:
            self._closed = True
            self._jobs.clear()
            thread = self._thread
            self._changed.notify()
        if thread is None or thread is threading.current_thread():
            return
        thread.join(_PATIENCE)
        if thread.is_alive():
            _log.warning("%s: a job still runs %.0f s after closing", self._name, _PATIENCE)

    def _call_off(self) -> None:
        with self._changed:
            self._called_off += 1
            if self._called_off >= _SWEEP and 2 * self._called_off > len(self._jobs):
                self._jobs = [entry for entry in self._jobs if entry[2].job is not None]
                heapq.heapify(self._jobs)
                self._called_off = 0

    def _work(self) -> None:
        while True:
            with self._changed:
                job = None
                while job is None:
                    if self._closed:
                        return
                    left = self._jobs[0][0] - time.monotonic() if self._jobs else _LONGEST
                    if left > 0:
                        self._changed.wait(min(left, _LONGEST))
                        continue
                    job = heapq.heappop(self._jobs)[2].take()
                    if job is None:
                        self._called_off = max(0, self._called_off - 1)
            try:
                job()
            except BaseException:  # sys.exit() in one job must not end all others
                _log.exception("%s: a job failed", self._name)


class _Job(Handle):
    def __init__(self, owner: Timers, job: Callable[[], None]) -> None:
        self._owner = owner
        self.job: Callable[[], None] | None = job

    def take(self) -> Callable[[], None] | None:
        job, self.job = self.job, None
        return job

    def close(self) -> None:
        if self.take() is not None:
            self._owner._call_off()
