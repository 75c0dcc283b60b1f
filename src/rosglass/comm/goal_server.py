"""Offering an action: who decides on goals and executes them, in every world."""

from __future__ import annotations

import inspect
import threading
from typing import TYPE_CHECKING, Any

from rosglass.comm.action import ActionServer, ServerGoal
from rosglass.comm.goal_runner import GoalRunner
from rosglass.comm.loop import LoopExecutor, executor_for
from rosglass.comm.promise import Promise
from rosglass.errors import ConversionError, Error, NodeClosedError

if TYPE_CHECKING:
    import logging
    from collections.abc import Awaitable, Callable

    from rosglass.comm.core import NodeCore
    from rosglass.comm.node import Executor, Result
    from rosglass.messages import ActionType, Message

__all__ = ["ExecutedGoal", "GoalServer"]


class GoalServer(ActionServer):
    """An action server; the world hears of goals, and tells what becomes of them.

    Args:
        core: The node it belongs to.
        name: Absolute action name.
        type: The type.
        execute: Called with each accepted goal.
        accept: Told a goal, says whether it is accepted; None accepts all.
        cancel: Told a goal, says whether it may be cancelled; None accepts all.
        executor: Where all three run; None for a thread for each goal and, for the latter two,
            the node's dispatcher. When `execute` is a coroutine function, all run in the event
            loop.
        log: Where failures are told.
        over: Called each time that `execute` has returned; None for nobody.
    """

    def __init__(
        self,
        core: NodeCore[Any],
        name: str,
        type: ActionType,
        execute: Callable[[ServerGoal], Result | Awaitable[Result]],
        accept: Callable[[Message], bool] | None,
        cancel: Callable[[ServerGoal], bool] | None,
        executor: Executor | None,
        log: logging.Logger,
        over: Callable[[], None] | None = None,
    ) -> None:
        self.name, self.type = name, type
        chosen = executor_for(execute, executor, core.dispatcher, name)
        for word, callback in (("accept", accept), ("cancel", cancel)):
            plain = callable(callback) and not inspect.iscoroutinefunction(callback)
            if callback is not None and not plain:
                raise ConversionError(word, callback, "a plain function, or None", name)
        self._accept, self._cancel, self._decider, self._log = accept, cancel, chosen, log
        given = executor is not None or isinstance(chosen, LoopExecutor)
        self._runner = GoalRunner(name, execute, chosen if given else None, log, over)
        #: Where is told what comes later.
        self.dispatcher = core.dispatcher
        self._lock = threading.Lock()
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether :meth:`close` was called."""
        return self._closed

    def _decide_later(self, decide: Callable[[], None]) -> bool:
        """Have a callback of the user's decide; returns whether its executor takes that."""
        try:
            self._decider.post(decide)
        except Exception:
            self._log.exception(
                "%s: the executor of accept and cancel raised: goals are rejected, and cancelled",
                self.name,
            )
            return False
        return True

    def _accepts(self, goal: Message, id_text: str) -> bool:
        """Return whether a goal is accepted, which is asked for on the decider."""
        assert self._accept is not None
        decision: Any = False
        try:
            decision = self._accept(goal)
        except Exception:
            self._log.exception("%s: accept failed; rejecting goal %s", self.name, id_text)
        if decision is not True and decision is not False:
            self._log.error(
                "%s: accept returned %.80r instead of True or False; rejecting goal %s",
                self.name,
                decision,
                id_text,
            )
        return decision is True

    def _allows(self, goal: ServerGoal) -> bool:
        """Return whether a goal may be cancelled; a callback that fails must not hold up a stop."""
        assert self._cancel is not None
        try:
            decision: Any = self._cancel(goal)
        except Exception:
            self._log.exception("%s: cancel failed; cancelling goal %s", self.name, goal.id_text)
            return True
        if decision is not True and decision is not False:
            self._log.error(
                "%s: cancel returned %.80r instead of True or False; cancelling goal %s",
                self.name,
                decision,
                goal.id_text,
            )
        return decision is not False

    def _make_feedback(self, feedback: Any, fields: dict[str, Any]) -> Message:
        """Return a goal's feedback; raises ConversionError."""
        if feedback is not None and fields:
            told = "either feedback or keyword fields, not both"
            raise ConversionError("", fields, told, self.type.feedback.name)
        return self.type.feedback.create(fields if feedback is None else feedback)


class ExecutedGoal(ServerGoal):
    """A goal as who executes it sees it: it can be told to end.

    Args:
        server: Whose it is.
    """

    _server: GoalServer

    def __init__(self, server: GoalServer) -> None:
        self._server = server
        self._stop = threading.Event()
        self._cancel_request: Promise[None] = Promise(
            f"nobody asked to cancel a goal of {server.name}", server.dispatcher, cancellable=False
        )

    @property
    def is_cancel_requested(self) -> bool:
        """Whether it should end soon: with :meth:`canceled`, or because the server closes."""
        return self._stop.is_set()

    @property
    def cancel_request(self) -> Promise[None]:
        """Comes when :attr:`is_cancel_requested` becomes true."""
        return self._cancel_request

    def stop(self) -> None:
        """Let who executes it know that it should end; not while a lock is held."""
        self._stop.set()
        self._cancel_request.fulfil(None)

    def wait_for_cancel(self, timeout: float) -> bool:
        """Sleep up to `timeout` seconds; return early, with True, when it should end."""
        return self._stop.wait(timeout)

    def _not_asked(self) -> Error:
        """Return the error of an end as cancelled that nobody asked for."""
        return Error(
            f"nobody asked to cancel goal {self.id_text} of {self._server.name}; end it with "
            "abort() instead"
        )

    def _over(self, what: str) -> Error:
        """Return the error of what comes after its end."""
        where = f"goal {self.id_text} of {self._server.name}"
        if self._server.closed:
            return NodeClosedError(f"{where} was aborted when its server closed: {what}")
        return Error(f"{where} has ended as {self.status.value} already: {what}")
