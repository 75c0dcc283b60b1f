"""Executors, which run callbacks: a dispatcher thread, an event loop, or the caller's at once."""

from __future__ import annotations

import inspect
import logging
import math
import threading
import time
from collections import deque
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from rosglass.comm.handle import Executor
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
    "let_exit",
    "run_job",
]

_log = logging.getLogger("rosglass.comm")
#: Seconds that closing waits for a callback that is still running.
_CLOSE_TIMEOUT_S = 2.0
#: Seconds until an executor that raised is given its jobs again: the first, and the longest.
_FIRST_RETRY_S, _LONGEST_RETRY_S = 0.05, 1.0
#: Gives executors that raised their jobs again; its thread starts with the first of them.
_retries = Timers("rosglass executor retries")


def run_job(job: Callable[[], None]) -> None:
    """Run `job`, and log an exception that it raises."""
    try:
        job()
    except (Exception, SystemExit) as error:
        let_exit(error)
        _log.exception("a callback failed")


def let_exit(error: BaseException) -> None:
    """Raise `error` if it is of `sys.exit()` in the main thread; none of ours ends by that."""
    if isinstance(error, SystemExit) and threading.current_thread() is threading.main_thread():
        raise error


class ImmediateExecutor(Executor):
    """Runs each job at once, in the thread that posts it.

    For jobs that take microseconds: the middleware receives nothing else meanwhile. They may
    publish and close subscriptions, but must not wait for anything nor close the node.
    """

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` now; an exception it raises is logged, and `sys.exit()` ends nothing."""
        try:
            run_job(job)
        except SystemExit:  # in the main thread, in the midst of what the node does
            _log.exception("a callback failed")


#: The one immediate executor; it has no state.
IMMEDIATE = ImmediateExecutor()


class Dispatcher(Executor):
    """Runs jobs one after the other, in the order they were posted, on a thread of its own.

    The thread starts with the first job. It is a daemon: a program that forgets to close its node
    still ends.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._closed = False

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` on the thread soon; forgotten when the dispatcher is closed."""
        if self._thread is None:
            self._start()
        if not self._closed:
            self._jobs.put(job)

    @property
    def is_current(self) -> bool:
        """Whether this is the dispatcher's own thread."""
        return self._thread is threading.current_thread()

    def close(self) -> None:
        """End the thread after the job that runs now; waiting jobs are forgotten.

        Safe to call twice and from a job. A job that does not return within 2 s is left to its
        daemon thread, with a warning: closing must not hang a program.
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
        while True:
            job = self._jobs.get()
            if job is None or self._closed:
                return
            try:
                run_job(job)
            except BaseException:  # sys.exit() in one callback must not end all others
                _log.exception("%s: a callback asked to end its thread, which goes on", self._name)


class RetryingExecutor(Executor):
    """Posts jobs to an executor that may raise, as a full queue or a pool that was shut down does.

    What it did not take is posted again, in the order of refusal, until it takes it: a job may
    carry a stop command, and must neither be lost nor end the thread that posts it. Jobs must not
    raise: an executor may run them at once.

    Args:
        executor: The executor, often the user's own.
        name: What posts, for the log.
        give_up_s: Seconds after which a job that was not taken is given up, with an error in the
            log; for jobs that have no owner who closes this.
    """

    def __init__(self, executor: Executor, name: str, give_up_s: float = math.inf) -> None:
        self._executor, self._name = executor, name
        self._give_up_s, self._refused_at = give_up_s, 0.0
        self._lock = threading.Lock()
        self._refused: deque[Callable[[], None]] = deque()
        self._closed = False
        self._failures = FailureLog(_log)

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` on the executor soon; logs, and never raises."""
        if not self._refused:
            try:
                self._executor.post(job)
            except Exception:
                self._log_failure()
            else:
                return
        with self._lock:
            self._refused.append(job)
            first = len(self._refused) == 1
        if first:
            self._refused_at = time.monotonic()
            self._retry_after(_FIRST_RETRY_S)

    def close(self) -> None:
        """Forget the jobs that were not taken; safe to call twice."""
        self._closed = True

    def _retry_after(self, delay_s: float) -> None:
        _retries.after(delay_s, lambda: self._retry(delay_s))

    def _retry(self, delay_s: float) -> None:
        while not self._closed:
            try:
                self._executor.post(self._refused[0])
            except Exception:
                if time.monotonic() - self._refused_at >= self._give_up_s:
                    self._give_up()
                    return
                self._log_failure()
                self._retry_after(min(2 * delay_s, _LONGEST_RETRY_S))
                return
            with self._lock:
                del self._refused[0]
                if not self._refused:
                    return

    def _give_up(self) -> None:
        with self._lock:
            count = len(self._refused)
            self._refused.clear()
        _log.error(
            "%s: the executor %r took nothing for %.0f s: %d callbacks are given up",
            self._name, self._executor, self._give_up_s, count, exc_info=True,
        )  # fmt: skip

    def _log_failure(self) -> None:
        self._failures.exception(
            "%s: the executor %r raised instead of taking a callback, which it is given again",
            self._name,
            self._executor,
        )


class LoopExecutor(Executor):
    """Runs callbacks in an asyncio event loop, and coroutines.

    Args:
        loop: The loop.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop

    @classmethod
    def running(cls, callback: object, where: str) -> LoopExecutor:
        """Return one for the loop that runs in this thread, for a coroutine function.

        Raises:
            ArgumentError: None runs, so that `callback` could never be called.
        """
        import asyncio  # noqa: PLC0415 - only for those who use it

        try:
            return cls(asyncio.get_running_loop())
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
        """Whether the calling thread runs the loop just now."""
        import asyncio  # noqa: PLC0415 - only for those who use it

        try:
            return asyncio.get_running_loop() is self._loop
        except RuntimeError:
            return False

    def post(self, job: Callable[[], None]) -> None:
        """Run `job` in the loop soon; raises RuntimeError when the loop is closed."""
        self._loop.call_soon_threadsafe(job)

    def run(self, coroutine: Coroutine[Any, Any, Any]) -> Future[Any]:
        """Run a coroutine in the loop; the future has what it returns."""
        import asyncio  # noqa: PLC0415 - only for those who use it

        return asyncio.run_coroutine_threadsafe(coroutine, self._loop)


def is_coroutine_function(callback: object) -> bool:
    """Return whether calling `callback` does nothing but make a coroutine."""
    call = getattr(callback, "__call__", None)  # noqa: B004 - objects may be callable, too
    return inspect.iscoroutinefunction(callback) or inspect.iscoroutinefunction(call)


def check_plain(callback: object, where: str = "", name: str = "callback") -> None:
    """Raise ArgumentError unless `callback` can be called and is no coroutine function."""
    if not callable(callback):
        raise ArgumentError(name, callback, "something that can be called", where)
    if is_coroutine_function(callback):
        # It would be called, and nothing in it would ever run.
        told = "a plain function (loop.call_soon_threadsafe() brings work into asyncio)"
        raise ArgumentError(name, callback, told, where)


def executor_for(
    callback: Any, executor: Executor | None, default: Executor, where: str
) -> Executor:
    """Return where a callback runs; raises ArgumentError when it cannot run."""
    if not callable(callback):
        raise ArgumentError("callback", callback, "something that can be called", where)
    if executor is not None and not isinstance(executor, Executor):
        raise ArgumentError("executor", executor, "a rosglass.comm.Executor", where)
    if not is_coroutine_function(callback):
        return executor or default
    if executor is not None:
        told = "no executor beside a coroutine function, which runs in its event loop"
        raise ArgumentError("executor", executor, told, where)
    return LoopExecutor.running(callback, where)


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
