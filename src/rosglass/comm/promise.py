"""Promises of what comes later (a response, a goal's end, an answer), and limits of waiting."""

from __future__ import annotations

import math
import time
from concurrent.futures import CancelledError, Future, InvalidStateError
from concurrent.futures import TimeoutError as _NotYet
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.comm.executor import RetryingExecutor, run_job
from rosglass.comm.handle import check_may_wait
from rosglass.errors import ArgumentError, TimeoutError  # noqa: A004 - the field's own word

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from rosglass.comm.handle import Executor

__all__ = [
    "Deadline",
    "Promise",
    "check_timeout",
]

_T = TypeVar("_T")
#: Longest uninterrupted wait in seconds: on Windows a lock that is waited for holds up Ctrl-C.
_SLICE = 0.2
#: Seconds after which a callback is given up whose executor raises each time.
_GIVE_UP_S = 30.0


def check_timeout(timeout: float | None, where: str) -> float | None:
    """Return a timeout in seconds, None for infinite ones; raises ArgumentError."""
    if timeout is None:
        return None
    if isinstance(timeout, bool) or not isinstance(timeout, (int, float)) or not timeout >= 0:
        raise ArgumentError("timeout", timeout, "seconds from 0 on, or None for ever", where)
    return None if math.isinf(timeout) else float(timeout)


class Promise(Future[_T]):
    """Something that comes later, or the error that comes instead.

    A :class:`concurrent.futures.Future` that can also be awaited in asyncio, and that Ctrl-C
    interrupts on every system. Callbacks added with ``add_done_callback`` run in the thread that
    completes it, often the middleware's: they must not wait for anything. :meth:`on_done` brings
    them elsewhere.

    Args:
        what: What has not come when a wait is over, e.g. ``/add has not answered``.
        executor: Where :meth:`on_done` calls back unless told otherwise; None for the thread that
            completes it.
        cancellable: Whether :meth:`cancel` gives it up. Otherwise it stays as it is, and only
            the waiting ends, as when ``asyncio.wait_for`` has waited long enough.
    """

    def __init__(
        self, what: str = "it has not come", executor: Executor | None = None, *, cancellable: bool
    ) -> None:
        super().__init__()
        self._what, self._executor, self._cancellable = what, executor, cancellable
        if cancellable:
            self.add_done_callback(_tell_waiters)

    def __await__(self) -> Generator[Any, None, _T]:
        import asyncio  # noqa: PLC0415 - only for those who use it

        return asyncio.wrap_future(self).__await__()

    def result(self, timeout: float | None = None) -> _T:
        """Wait for it and return it, or raise the error that came instead.

        Args:
            timeout: Seconds to wait, None for ever.

        Raises:
            TimeoutError: It has not come within the time; it may still come.
            UnsupportedError: Called in a thread that receives, where it could never come.
            concurrent.futures.CancelledError: It was given up.
        """
        self._wait(timeout)
        return super().result(0)

    def exception(self, timeout: float | None = None) -> BaseException | None:
        """Wait for it and return the error that came instead, None when there was none."""
        self._wait(timeout)
        return super().exception(0)

    def cancel(self) -> bool:
        """Give it up; returns whether that was still possible."""
        return self._cancellable and super().cancel()

    def on_done(self, callback: Callable[..., None], executor: Executor | None = None) -> None:
        """Call `callback` with this object once it has come, failed or was given up.

        Args:
            callback: Told at once when that has happened already.
            executor: Where it runs; None for the node's own dispatcher thread.
        """
        if not callable(callback):
            raise ArgumentError("callback", callback, "something that can be called", "on_done")
        chosen = executor or self._executor
        if chosen is None:
            self.add_done_callback(callback)
        else:
            poster = RetryingExecutor(chosen, f"on_done() of {self._what}", _GIVE_UP_S)
            self.add_done_callback(lambda _: poster.post(lambda: run_job(lambda: callback(self))))

    def set_result(self, value: _T) -> None:
        """Complete it with `value`, unless it is done already."""
        with suppress(InvalidStateError):
            super().set_result(value)

    def set_exception(self, error: BaseException | None) -> None:
        """Complete it with an error, unless it is done already."""
        with suppress(InvalidStateError):
            super().set_exception(error)

    def _wait(self, timeout: float | None) -> None:
        timeout = check_timeout(timeout, "result()")
        deadline = math.inf if timeout is None else time.monotonic() + timeout
        if timeout != 0 and not self.done():
            check_may_wait(self._what, following=True)
        while True:
            left = deadline - time.monotonic()
            try:
                super().exception(max(0.0, min(left, _SLICE)))
            except CancelledError:
                return
            except _NotYet:
                if left <= 0:
                    raise TimeoutError(f"{self._what} within {timeout:g} s") from None
            else:
                return


def _tell_waiters(promise: Future[Any]) -> None:
    """Let ``concurrent.futures.wait`` notice that a promise was given up."""
    if promise.cancelled():
        promise.set_running_or_notify_cancel()


class Deadline:
    """The end of the time that a caller gives.

    Args:
        timeout: Seconds from now, None for ever.
        where: What is asked, in errors.

    Raises:
        ConversionError: The timeout is none.
    """

    def __init__(self, timeout: float | None, where: str) -> None:
        timeout = check_timeout(timeout, where)
        self._end = None if timeout is None else time.monotonic() + timeout

    def left(self) -> float | None:
        """Return the seconds that are left, None when there is no end."""
        # Rounded: people read it when the time is over.
        return None if self._end is None else max(0.0, round(self._end - time.monotonic(), 2))
