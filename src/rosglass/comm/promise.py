"""Futures of asynchronous operations (a call, a goal, a request), and timeouts."""

from __future__ import annotations

import math
import time
from concurrent.futures import CancelledError, Future, InvalidStateError
from concurrent.futures import TimeoutError as _NotYet
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.comm.executor import RetryingExecutor, load_asyncio, run_job
from rosglass.comm.handle import check_may_wait
from rosglass.errors import ArgumentError, TimeoutError  # noqa: A004 - the field's own word

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable, Generator

    from rosglass.comm.handle import Executor

__all__ = [
    "Deadline",
    "Promise",
    "check_timeout",
]

_T = TypeVar("_T")
#: Longest uninterrupted wait: on Windows, Ctrl-C does not interrupt one for a lock.
_MAX_BLOCK_S = 0.2
#: How long a callback is re-posted to an executor that raises.
_MAX_RETRY_S = 30.0


def check_timeout(timeout: float | None, where: str) -> float | None:
    """Return a timeout in seconds, None for an infinite one; raises ArgumentError."""
    if timeout is None:
        return None
    if isinstance(timeout, bool) or not isinstance(timeout, (int, float)) or not timeout >= 0:
        raise ArgumentError("timeout", timeout, "seconds, at least 0, or None for no limit", where)
    return None if math.isinf(timeout) else float(timeout)


class Promise(Future[_T]):
    """The result of an operation that has not ended yet, or its error.

    A :class:`concurrent.futures.Future` that can also be awaited in asyncio, and whose waits Ctrl-C
    interrupts on every system. Callbacks added with ``add_done_callback`` run in the thread that
    completes it, often the middleware's: they must not block. :meth:`on_done` runs them on an
    executor.

    Args:
        what: The message of a timeout, without the time, e.g. ``/add has not answered``.
        executor: Default executor of :meth:`on_done`; None for the thread that completes it.
        cancellable: Whether :meth:`cancel` cancels the operation. Otherwise it has no effect, so
            that ``asyncio.wait_for`` ends the wait only.
    """

    def __init__(
        self,
        what: str = "there is no result",
        executor: Executor | None = None,
        *,
        cancellable: bool,
    ) -> None:
        super().__init__()
        self._what, self._executor, self._cancellable = what, executor, cancellable
        if cancellable:
            self.add_done_callback(_notify_cancel)

    def __await__(self) -> Generator[Any, None, _T]:
        future: asyncio.Future[_T] = load_asyncio().wrap_future(self)
        return future.__await__()

    def result(self, timeout: float | None = None) -> _T:
        """Wait for the result and return it, or raise the operation's error.

        Args:
            timeout: Seconds to wait; None waits forever.

        Raises:
            TimeoutError: The operation did not end in time; it continues.
            UnsupportedError: Called in a thread that receives, which would block itself.
            concurrent.futures.CancelledError: It was cancelled.
        """
        self._wait(timeout)
        return super().result(0)

    def exception(self, timeout: float | None = None) -> BaseException | None:
        """Wait for the end and return the operation's error, None if it succeeded."""
        self._wait(timeout)
        return super().exception(0)

    def cancel(self) -> bool:
        """Cancel the operation; return whether that was possible."""
        return self._cancellable and super().cancel()

    def on_done(self, callback: Callable[..., None], executor: Executor | None = None) -> None:
        """Call `callback` with this promise once it is completed or cancelled.

        Args:
            callback: Called immediately if the promise is already done.
            executor: Runs `callback`; None for the node's own dispatcher thread.
        """
        if not callable(callback):
            raise ArgumentError("callback", callback, "something that can be called", "on_done")
        chosen = executor or self._executor
        if chosen is None:
            self.add_done_callback(callback)
        else:
            poster = RetryingExecutor(chosen, f"on_done() of {self._what}", _MAX_RETRY_S)
            self.add_done_callback(lambda _: poster.post(lambda: run_job(lambda: callback(self))))

    def set_result(self, value: _T) -> None:
        """Complete it with `value`, unless it is already done."""
        with suppress(InvalidStateError):  # as documented
            super().set_result(value)

    def set_exception(self, error: BaseException | None) -> None:
        """Complete it with an error, unless it is already done."""
        with suppress(InvalidStateError):  # as documented
            super().set_exception(error)

    def _wait(self, timeout: float | None) -> None:
        timeout = check_timeout(timeout, "result()")
        deadline = math.inf if timeout is None else time.monotonic() + timeout
        if timeout != 0 and not self.done():
            check_may_wait(self._what, following=True)
        while True:
            left = deadline - time.monotonic()
            try:
                super().exception(max(0.0, min(left, _MAX_BLOCK_S)))
            except CancelledError:
                return
            except _NotYet:
                if left <= 0:
                    raise TimeoutError(f"{self._what} within {timeout:g} s") from None
            else:
                return


def _notify_cancel(promise: Future[Any]) -> None:
    """Notify ``concurrent.futures.wait`` of a cancelled promise."""
    if promise.cancelled():
        promise.set_running_or_notify_cancel()


class Deadline:
    """The point in time by which an operation of several steps must end.

    Args:
        timeout: Seconds from now; None for no limit.
        where: The operation, for errors.

    Raises:
        ArgumentError: The timeout is not a number of seconds.
    """

    def __init__(self, timeout: float | None, where: str) -> None:
        timeout = check_timeout(timeout, where)
        self._end = None if timeout is None else time.monotonic() + timeout

    def left(self) -> float | None:
        """Return the remaining seconds; None for no limit."""
        # Rounded, because errors quote it.
        return None if self._end is None else max(0.0, round(self._end - time.monotonic(), 2))
