"""Executing the goals of an action server: on threads of their own, an executor, or in asyncio."""

from __future__ import annotations

import inspect
import threading
import time
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, Protocol

from rosglass.comm.loop import LoopExecutor
from rosglass.errors import Error, NodeClosedError

if TYPE_CHECKING:
    import logging
    from collections.abc import Callable

    from rosglass.comm.action import GoalStatus
    from rosglass.comm.node import Executor

__all__ = ["GoalRunner", "Runnable"]

#: Seconds in all that closing waits for goals to notice.
_PATIENCE = 2.0


class Runnable(Protocol):
    """What a runner asks of a goal."""

    @property
    def id_text(self) -> str:
        """Its id."""

    @property
    def status(self) -> GoalStatus:
        """What has become of it."""

    def start(self) -> bool:
        """Take note that it is executed now; returns whether it is, and was not cancelled."""

    def conclude(self, result: Any) -> None:
        """End it with what executing it returned; raises ConversionError."""

    def fail(self, error: BaseException) -> None:
        """End it as failed, unless it has ended."""


class GoalRunner:
    """Runs one callback for each goal, and ends the goal with what comes of it.

    Args:
        name: Of the action.
        execute: Called with the goal.
        executor: Where; None for a thread for each goal.
        log: Where failures are told.
        over: Called each time that a goal's callback has returned; None for nobody.
    """

    def __init__(
        self,
        name: str,
        execute: Callable[[Any], Any],
        executor: Executor | None,
        log: logging.Logger,
        over: Callable[[], None] | None = None,
    ) -> None:
        self._name, self._execute, self._executor, self._log = name, execute, executor, log
        self._over = over
        self._lock = threading.Lock()
        self._threads: set[threading.Thread] = set()
        self._closed = False

    def start(self, goal: Runnable) -> None:
        """Execute a goal, soon."""
        if self._executor is not None:
            try:
                self._executor.post(lambda: self._run(goal))
            except Exception as error:
                self._not_started(goal, error)
            return
        thread = threading.Thread(
            target=self._run_in_thread,
            args=(goal,),
            name=f"{self._name} {goal.id_text}",
            daemon=True,
        )
        try:
            with self._lock:  # who joins must find it started
                thread.start()
                self._threads.add(thread)
        except RuntimeError as error:
            self._not_started(goal, error)

    def close(self) -> None:
        """Take note that goals end because their server closes."""
        self._closed = True

    def join(self) -> None:
        """Wait for the threads, for two seconds at most."""
        with self._lock:
            threads = [t for t in self._threads if t is not threading.current_thread()]
        until = time.monotonic() + _PATIENCE
        for thread in threads:
            thread.join(max(0.0, until - time.monotonic()))
            if thread.is_alive():
                self._log.warning("%s still runs %.0f s after closing", thread.name, _PATIENCE)

    def _not_started(self, goal: Runnable, error: Exception) -> None:
        self._log.error(
            "%s: aborting goal %s, which cannot be executed: %r", self._name, goal.id_text, error
        )
        goal.fail(error)
        self._ended()

    def _run_in_thread(self, goal: Runnable) -> None:
        try:
            self._run(goal)
        finally:
            with self._lock:
                self._threads.discard(threading.current_thread())

    def _run(self, goal: Runnable) -> None:
        if not goal.start():
            if goal.status.is_active:
                goal.conclude(None)  # cancelled before its turn
            self._ended()
            return
        try:
            result: Any = self._execute(goal)
        except BaseException as error:
            self._failed(goal, error)
            self._ended()
            return
        if inspect.iscoroutine(result) and isinstance(self._executor, LoopExecutor):
            result = self._executor.run(result)
        if isinstance(result, Future):
            result.add_done_callback(lambda done: self._finish(goal, done))
            return
        if inspect.iscoroutine(result):
            result.close()
            self._failed(goal, TypeError("execute must be an async def to be awaited"))
        else:
            self._conclude(goal, result)
        self._ended()

    def _finish(self, goal: Runnable, done: Future[Any]) -> None:
        """Take what came later."""
        try:
            result = done.result(0)
        except BaseException as error:
            self._failed(goal, error)
        else:
            self._conclude(goal, result)
        self._ended()

    def _conclude(self, goal: Runnable, result: Any) -> None:
        if not goal.status.is_active:
            if result is not None and not self._closed:
                self._log.warning(
                    "%s: goal %s has ended as %s already; what execute returned is dropped",
                    self._name,
                    goal.id_text,
                    goal.status.value,
                )
            return
        try:
            goal.conclude(result)
        except Error as error:
            self._log.error(
                "%s: the result of goal %s does not fit, the goal is aborted: %s",
                self._name,
                goal.id_text,
                error,
            )
            goal.fail(error)

    def _failed(self, goal: Runnable, error: BaseException) -> None:
        if not (self._closed and isinstance(error, NodeClosedError)):
            self._log.error(
                "%s: execute failed on goal %s, which is aborted",
                self._name,
                goal.id_text,
                exc_info=error,
            )
        goal.fail(error)

    def _ended(self) -> None:
        if self._over is not None:
            self._over()
