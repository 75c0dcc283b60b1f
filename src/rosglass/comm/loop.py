"""Callbacks that are coroutine functions: they run in an asyncio event loop."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

from rosglass.comm.node import Executor
from rosglass.errors import ArgumentError

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable, Coroutine
    from concurrent.futures import Future

__all__ = ["LoopExecutor", "check_plain", "executor_for", "is_coroutine_function"]


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
