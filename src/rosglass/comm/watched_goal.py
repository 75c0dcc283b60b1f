"""A goal as who sent it sees it: what is known of it, and who is told."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from rosglass.comm.action import ActionResult, CancelAnswer, ClientGoal, GoalStatus
from rosglass.comm.listeners import Listeners
from rosglass.comm.promise import Promise
from rosglass.errors import ConversionError, ServiceUnavailableError

if TYPE_CHECKING:
    import logging
    from collections.abc import Callable

    from rosglass.comm.node import Executor, Handle
    from rosglass.messages import Message

    _T = TypeVar("_T")

__all__ = ["FEEDBACK_DEPTH", "WatchedGoal"]

#: Feedback that waits for a slow callback.
FEEDBACK_DEPTH = 10


class WatchedGoal(ClientGoal):
    """A goal of a client; the world hears of it, one job after the other.

    Args:
        id: Its id.
        goal: What is asked for: a message of the action's type, or what becomes one.
        typed: Whether the action's type is known.
        action: The action's name.
        dispatcher: Where callbacks run unless told otherwise.
        log: Where is told what users should know.
    """

    def __init__(
        self,
        id: bytes,
        goal: Any,
        typed: bool,
        action: str,
        dispatcher: Executor,
        log: logging.Logger,
    ) -> None:
        self.id = id
        self.goal: Message | None = goal if typed else None
        self._given, self._dispatcher, self._log = goal, dispatcher, log
        self._status = GoalStatus.PENDING
        self._feedback: Message | None = None
        self._label = label = f"goal {self.id_text} of {action}"
        self._acceptance: Promise[bool] = Promise(
            f"{label} was neither accepted nor rejected", dispatcher, cancellable=False
        )
        self._done: Promise[ActionResult] = Promise(
            f"{label} has not ended, and goes on: no result", dispatcher, cancellable=False
        )
        self._feedback_listeners: Listeners[Message] = Listeners(depth=FEEDBACK_DEPTH, where=label)
        self._status_listeners: Listeners[GoalStatus] = Listeners(where=label)
        #: Ends the waiting for a server.
        self._patience: Handle | None = None
        self._slow = False

    @property
    def status(self) -> GoalStatus:
        """What has become of it, as last heard."""
        return self._status

    @property
    def feedback(self) -> Message | None:
        """The newest feedback; None before the first."""
        return self._feedback

    @property
    def acceptance(self) -> Promise[bool]:
        """The server's decision."""
        return self._acceptance

    @property
    def done(self) -> Promise[ActionResult]:
        """The end."""
        return self._done

    def on_feedback(
        self, callback: Callable[[Message], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each feedback from now on."""
        return self._listen(self._feedback_listeners, callback, executor)

    def on_status_change(
        self, callback: Callable[[GoalStatus], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each new status from now on."""
        return self._listen(self._status_listeners, callback, executor)

    def _listen(
        self, listeners: Listeners[_T], callback: Callable[[_T], None], executor: Executor | None
    ) -> Handle:
        if not callable(callback):
            raise ConversionError("callback", callback, "something that can be called", self._label)
        return listeners.add(callback, executor or self._dispatcher)

    # -- telling, in the world's jobs ------------------------------------------------------------

    def _tell_status(self, status: GoalStatus) -> None:
        self._status = status
        self._status_listeners.notify(status)

    def _tell_feedback(self, feedback: Message) -> None:
        self._feedback = feedback
        if not self._feedback_listeners.notify(feedback) and not self._slow:
            self._slow = True
            self._log.warning(
                "%s: feedback comes faster than a callback takes it: only the newest %d wait",
                self._label,
                FEEDBACK_DEPTH,
            )

    def _tell_end(self, status: GoalStatus, end: ActionResult | BaseException) -> None:
        """Let who waits have its end: a result, or why there is none."""
        if self._patience is not None:
            self._patience.close()
        if isinstance(end, ActionResult):
            self._acceptance.fulfil(False)  # unless it was accepted
            self._done.fulfil(end)
            return
        if status in (GoalStatus.REJECTED, GoalStatus.CANCELED):
            self._acceptance.fulfil(False)
        else:
            self._acceptance.fail(end)
        self._done.fail(end)

    def _too_late(self) -> CancelAnswer:
        """Return the answer to who wants to cancel it after its end."""
        return CancelAnswer((), f"the goal has ended already: {self._status.value}")

    def _without_result(self) -> ServiceUnavailableError:
        """Return the end of a goal that was cancelled while nobody knew its type."""
        return ServiceUnavailableError(
            f"{self._label} was cancelled before any server told its type: no result"
        )
