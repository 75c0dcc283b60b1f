"""A node's scheduler: delayed jobs, a worker thread, and watchdogs for deadlines."""

from __future__ import annotations

import heapq
import itertools
import logging
import threading
import time
from typing import TYPE_CHECKING

from rosglass.comm.handle import Handle, guarded

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.time import Duration

__all__ = [
    "Timers",
    "Watchdog",
    "Worker",
]

_log = logging.getLogger("rosglass.comm")
#: How long closing waits for a running job.
_CLOSE_TIMEOUT_S = 2.0
#: Longest single wait; the operating system has an upper limit.
_LONGEST_WAIT_S = 3600.0
#: After a run, a worker rests for so many times as long, and at most for so many seconds.
_REST_FACTOR, _MAX_REST_S = 4.0, 0.05
#: Cancelled jobs are removed from the heap once there are this many, and more than half.
_SWEEP_COUNT = 64


class Timers:
    """Runs jobs after a delay, on one daemon thread that starts with the first job.

    Jobs must return quickly: each delays all others.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._changed = threading.Condition()
        self._jobs: list[tuple[float, int, _Job]] = []
        self._numbers = itertools.count()
        self._cancelled = 0
        self._thread: threading.Thread | None = None
        self._closed = False

    def after(self, delay: float, job: Callable[[], None]) -> Handle:
        """Run `job` after `delay` seconds unless the handle, or these timers, are closed first."""
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
        """Drop all jobs and end the thread; safe to call twice, and from a job."""
        with self._changed:
            self._closed = True
            self._jobs.clear()
            thread = self._thread
            self._changed.notify()
        if thread is None or thread is threading.current_thread():
            return
        thread.join(_CLOSE_TIMEOUT_S)
        if thread.is_alive():
            _log.warning("%s: a job still runs %.0f s after closing", self._name, _CLOSE_TIMEOUT_S)

    def _on_cancelled(self) -> None:
        with self._changed:
            self._cancelled += 1
            if self._cancelled >= _SWEEP_COUNT and 2 * self._cancelled > len(self._jobs):
                self._jobs = [entry for entry in self._jobs if entry[2].job is not None]
                heapq.heapify(self._jobs)
                self._cancelled = 0

    def _work(self) -> None:
        while True:
            with self._changed:
                job = None
                while job is None:
                    if self._closed:
                        return
                    left = self._jobs[0][0] - time.monotonic() if self._jobs else _LONGEST_WAIT_S
                    if left > 0:
                        self._changed.wait(min(left, _LONGEST_WAIT_S))
                        continue
                    job = heapq.heappop(self._jobs)[2].take()
                    if job is None:
                        self._cancelled = max(0, self._cancelled - 1)
            with guarded(_log, "%s: a job failed", self._name):
                job()


class _Job(Handle):
    def __init__(self, owner: Timers, job: Callable[[], None]) -> None:
        self._owner = owner
        self.job: Callable[[], None] | None = job

    def take(self) -> Callable[[], None] | None:
        job, self.job = self.job, None
        return job

    def close(self) -> None:
        if self.take() is not None:
            self._owner._on_cancelled()


class Worker:
    """A thread that runs `job` soon after each :meth:`wake`, and regularly.

    Wake-ups that arrive during a run, and shortly after it, are merged into one more run: a worker
    that runs all the time would delay the threads that wake it.

    Args:
        name: The thread's name.
        job: Called with True for a regular run, False for a wake-up. Exceptions are logged.
        pause: Seconds between two regular runs, independent of wake-ups.
    """

    def __init__(self, name: str, job: Callable[[bool], None], pause: float) -> None:
        self._job, self._pause = job, pause
        self._wanted, self._closed = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """Request a run soon; from any thread, without waiting."""
        self._wanted.set()

    @property
    def is_current(self) -> bool:
        """True in the worker's own thread."""
        return self._thread is threading.current_thread()

    def close(self) -> None:
        """End the thread after the current run and join it; safe to call twice.

        After 2 s a run that does not return is abandoned with a warning, so that closing never
        hangs a program; its thread is a daemon.
        """
        self._closed.set()
        self._wanted.set()
        if self._thread is threading.current_thread():
            return
        self._thread.join(_CLOSE_TIMEOUT_S)
        if self._thread.is_alive():
            _log.warning("%s still runs %.0f s after closing", self._thread.name, _CLOSE_TIMEOUT_S)

    def _work(self) -> None:
        due = time.monotonic() + self._pause
        while True:
            self._wanted.wait(max(0.0, due - time.monotonic()))
            self._wanted.clear()
            if self._closed.is_set():
                return
            now = time.monotonic()
            regular = now >= due
            if regular:
                due = now + self._pause
            with guarded(_log, "%s failed", self._thread.name):
                self._job(regular)
            self._closed.wait(min(_MAX_REST_S, _REST_FACTOR * (time.monotonic() - now)))


class Watchdog(Handle):
    """Reports missed deadlines between events, without any cost per event.

    Args:
        timers: Runs the checks.
        limit: Longest allowed time between two events.
        last: Returns the :func:`time.monotonic` time of the last event; called on the timers'
            thread.
        missed: Called on the same thread with the number of deadlines missed since the last call.

    Attributes:
        limit: As given.
    """

    def __init__(
        self,
        timers: Timers,
        limit: Duration,
        last: Callable[[], float],
        missed: Callable[[int], None],
    ) -> None:
        self.limit = limit
        self._timers, self._period = timers, limit.seconds
        self._last, self._missed = last, missed
        self._closed = False
        self._since = time.monotonic()
        self._timer = timers.after(self._period, self._check)

    def close(self) -> None:
        """Stop counting; safe to call twice."""
        self._closed = True
        self._timer.close()

    def _check(self) -> None:
        if self._closed:
            return
        self._since = max(self._since, self._last())
        count = int((time.monotonic() - self._since) / self._period)
        if count:
            self._since += count * self._period
            self._missed(count)
        left = self._since + self._period - time.monotonic()
        self._timer = self._timers.after(max(0.0, left), self._check)
        if self._closed:  # another thread may just have closed it with the previous timer
            self._timer.close()
