"""Executors, which run callbacks: on a thread, in an event loop, or at once in the caller."""

from __future__ import annotations

import inspect
import logging
import math
import threading
import time
from collections import deque
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from rosglass.comm.handle import Executor, reraise_exit
from rosglass.comm.log_limits import FailureLog
from rosglass.comm.timers import Timers
from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable, Coroutine
    from concurrent.futures import Future

__all__ = [
    "IMMEDIATE",
    "Dispatcher",
    "ImmediateExecutor",
    "InOrder",
    "LoopExecutor",
    "RetryingExecutor",
    "check_plain",
    "executor_for",
    "is_coroutine_function",
    "load_asyncio",
    "run_job",
]

_log = logging.getLogger("rosglass.comm")
#: How long closing waits for a running callback.
_CLOSE_TIMEOUT_S = 2.0
#: From this many jobs per second on, a dispatcher pauses for so long when all are done: waking its
#: thread for each costs more than a short job.
_BUSY_HZ, _BUSY_PAUSE_S = 2000.0, 0.001
#: Number of jobs over which their rate is measured.
_RATE_JOBS = 200
#: First and longest delay until jobs are posted again to an executor that raised.
_FIRST_RETRY_S, _LONGEST_RETRY_S = 0.05, 1.0
#: Posts jobs again to executors that raised; its thread starts with the first one.
_retries = Timers("rosglass executor retries")


def run_job(job: Callable[[], None]) -> None:
    """Run `job` and log an error that it raises; see :func:`guarded`, whose cost this saves."""
    try:
        job()
    except BaseException as error:  # noqa: BLE001 - a user's callback
        reraise_exit(error)
        _log.exception("a callback failed")


class ImmediateExecutor(Executor):
    """Runs each job at once, in the thread that posts it.

    For jobs that take microseconds: the wire receives nothing else while they run. They may
    publish and close subscriptions, but must neither wait for anything nor close the node.
    """

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` now; logs an exception that it raises, SystemExit included."""
        try:
            run_job(job)
        except SystemExit:  # must not interrupt the node's own code in the main thread
            _log.exception("a callback failed")


#: The only immediate executor; it has no state.
IMMEDIATE = ImmediateExecutor()


class Dispatcher(Executor):
    """Runs jobs one at a time, in the order of posting, on a thread of its own.

    The thread starts with the first job. It is a daemon, so that a program that does not close its
    node still ends. At thousands of jobs per second they start up to a millisecond late, several at
    a time.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._closed = False

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` on the thread soon; dropped if the dispatcher is closed first."""
        if self._thread is None:
            self._start()
        if not self._closed:
            self._jobs.put(job)

    @property
    def is_current(self) -> bool:
        """True in the dispatcher's own thread."""
        return self._thread is threading.current_thread()

    def close(self) -> None:
        """Drop waiting jobs and end the thread after the current one.

        Safe to call twice and from a job. A job that does not return within 2 s is abandoned with
        a warning, so that closing never hangs a program; its thread is a daemon.
        """
        with self._lock:
            self._closed = True
            thread = self._thread
        self._jobs.put(None)
        if thread is None or thread is threading.current_thread():
            return
        thread.join(_CLOSE_TIMEOUT_S)
        if thread.is_alive():
            _log.warning(
                "%s: a callback still runs %.0f s after closing", self._name, _CLOSE_TIMEOUT_S
            )

    def _start(self) -> None:
        with self._lock:
            if self._thread is None and not self._closed:
                self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
                self._thread.start()

    def _work(self) -> None:
        jobs, empty = self._jobs, self._jobs.empty
        count, since, busy = 0, time.monotonic(), False
        while True:
            if busy and empty():
                time.sleep(_BUSY_PAUSE_S)
            job = jobs.get()
            if job is None or self._closed:
                return
            run_job(job)
            count += 1
            if count == _RATE_JOBS:
                now = time.monotonic()
                count, busy, since = 0, _BUSY_HZ * (now - since) < _RATE_JOBS, now


class RetryingExecutor(Executor):
    """Posts jobs to an executor that may raise, as a full queue or a closed pool does.

    Rejected jobs are posted again, in order, until they are accepted: a job may carry a stop
    command, and must neither be lost nor end the thread that posts it. Jobs must not raise, since
    the executor may run them at once.

    Args:
        executor: The executor, often a user's.
        name: The owner of the jobs, for the log.
        give_up_s: Seconds after which rejected jobs are dropped with an error in the log; for jobs
            without an owner that closes this.
    """

    def __init__(self, executor: Executor, name: str, give_up_s: float = math.inf) -> None:
        self._executor, self._name = executor, name
        self._give_up_s, self._rejected_at = give_up_s, 0.0
        #: Guards the rejected jobs.
        self._lock = threading.Lock()
        self._rejected: deque[Callable[[], None]] = deque()
        self._closed = False
        self._failures = FailureLog(_log)

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` on the executor soon; logs, and never raises."""
        if not self._rejected:
            try:
                self._executor.post(job)
            except Exception:  # noqa: BLE001 - a user's executor, e.g. one that is full
                self._log_failure()
            else:
                return
        with self._lock:
            self._rejected.append(job)
            first = len(self._rejected) == 1
        if first:
            self._rejected_at = time.monotonic()
            self._retry_after(_FIRST_RETRY_S)

    def close(self) -> None:
        """Drop the rejected jobs; safe to call twice."""
        self._closed = True

    def _retry_after(self, delay_s: float) -> None:
        _retries.after(delay_s, lambda: self._retry(delay_s))

    def _retry(self, delay_s: float) -> None:
        while not self._closed:
            try:
                self._executor.post(self._rejected[0])
            except Exception:  # noqa: BLE001 - as above
                if time.monotonic() - self._rejected_at >= self._give_up_s:
                    self._give_up()
                    return
                self._log_failure()
                self._retry_after(min(2 * delay_s, _LONGEST_RETRY_S))
                return
            with self._lock:
                del self._rejected[0]
                if not self._rejected:
                    return

    def _give_up(self) -> None:
        with self._lock:
            count = len(self._rejected)
            self._rejected.clear()
        _log.error(
            "%s: the executor %r rejected every callback for %.0f s: %d callbacks are dropped",
            self._name, self._executor, self._give_up_s, count, exc_info=True,
        )  # fmt: skip

    def _log_failure(self) -> None:
        self._failures.exception(
            "%s: the executor %r raised instead of accepting a callback, which is posted again",
            self._name,
            self._executor,
        )


def load_asyncio() -> Any:
    """Return asyncio, which takes 10 ms to import, and which only programs that use it need."""
    import asyncio  # noqa: PLC0415 - as above

    return asyncio


class LoopExecutor(Executor):
    """Runs callbacks and coroutines in an asyncio event loop.

    Args:
        loop: The loop.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop

    @classmethod
    def running(cls, callback: object, where: str) -> LoopExecutor:
        """Return the executor of this thread's running loop, for a coroutine function.

        Raises:
            ArgumentError: No loop runs here, so that `callback` could never be called.
        """
        try:
            return cls(load_asyncio().get_running_loop())
        except RuntimeError:
            raise ArgumentError(
                "callback",
                callback,
                "a plain function, or to be created inside a running event loop, as in "
                "`async def main()`, where coroutine functions are run",
                where,
            ) from None

    @property
    def is_current(self) -> bool:
        """True if the calling thread runs the loop."""
        try:
            return load_asyncio().get_running_loop() is self._loop
        except RuntimeError:
            return False

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` in the loop soon; raises RuntimeError when the loop is closed."""
        self._loop.call_soon_threadsafe(job)

    def run(self, coroutine: Coroutine[Any, Any, Any]) -> Future[Any]:
        """Run a coroutine in the loop; return the future of its result."""
        future: Future[Any] = load_asyncio().run_coroutine_threadsafe(coroutine, self._loop)
        return future


def is_coroutine_function(callback: object) -> bool:
    """Return whether `callback` is a coroutine function, or an object with such a ``__call__``."""
    call = getattr(callback, "__call__", None)  # noqa: B004 - for objects
    return inspect.iscoroutinefunction(callback) or inspect.iscoroutinefunction(call)


def check_plain(callback: object, where: str = "", name: str = "callback") -> None:
    """Raise ArgumentError unless `callback` is callable and no coroutine function."""
    if not callable(callback):
        raise ArgumentError(name, callback, "something that can be called", where)
    if is_coroutine_function(callback):
        # Calling it would only create a coroutine that never runs.
        expected = "a plain function (loop.call_soon_threadsafe() brings work into asyncio)"
        raise ArgumentError(name, callback, expected, where)


def executor_for(
    callback: Any, executor: Executor | None, default: Executor, where: str
) -> Executor:
    """Return the executor of a callback; raises ArgumentError if it could not run there."""
    if not callable(callback):
        raise ArgumentError("callback", callback, "something that can be called", where)
    if executor is not None and not isinstance(executor, Executor):
        raise ArgumentError("executor", executor, "a rosglass.comm.Executor", where)
    if not is_coroutine_function(callback):
        return executor or default
    if executor is not None:
        expected = "no executor beside a coroutine function, which runs in its event loop"
        raise ArgumentError("executor", executor, expected, where)
    return LoopExecutor.running(callback, where)


class InOrder:
    """Runs jobs one at a time, in order, in the threads that add them.

    While one thread runs jobs, others leave theirs to it. State that only jobs touch therefore
    needs no lock, and callbacks are called in the order of the events that they report.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._jobs: deque[Callable[[], None]] = deque()
        self._busy = False

    def add(self, job: Callable[[], None]) -> None:
        """Run `job` after all jobs added before; logs exceptions."""
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
                run_job(job)
            except BaseException:  # Ctrl-C: the next thread that adds a job continues
                with self._lock:
                    self._busy = False
                raise
