"""One goal of an action server, from its acceptance until its result is forgotten."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import GoalStatus
from rosglass.comm.goal_server import ExecutedGoal
from rosglass.ros2.action_types import CODES

if TYPE_CHECKING:
    from concurrent.futures import Future

    from rosglass.comm import Time
    from rosglass.messages import Message
    from rosglass.ros2.action_server import Ros2ActionServer

__all__ = ["Ros2ServerGoal"]

#: Requests for one goal's result that are kept; more come only from a client gone wild.
_MAX_WAITING = 1000


class Ros2ServerGoal(ExecutedGoal):
    """A goal; made by an action server when it accepts one.

    Args:
        server: Whose it is.
        id: Its id.
        goal: What is asked for.
        accepted: When it was accepted.
    """

    _server: Ros2ActionServer

    def __init__(self, server: Ros2ActionServer, id: bytes, goal: Message, accepted: Time) -> None:
        super().__init__(server)
        self.id, self.goal, self.accepted = id, goal, accepted
        self._lock = threading.Lock()
        self._status = GoalStatus.ACCEPTED
        self._response: Message | None = None
        self._waiting: list[Future[Any]] = []
        #: Monotonic time of its acceptance, and whether anybody asked for the result since.
        self.begun, self.asked = time.monotonic(), False
        #: Monotonic time of its end, None before.
        self.ended: float | None = None

    @property
    def status(self) -> GoalStatus:
        """What has become of it."""
        return self._status

    def publish_feedback(
        self, feedback: Message | dict[str, Any] | None = None, /, **fields: Any
    ) -> None:
        """Send feedback; see :meth:`rosglass.comm.ServerGoal.publish_feedback`."""
        if not self._status.is_active:
            raise self._over("feedback comes too late")
        self._server.send_feedback(self, feedback, fields)

    def succeed(self, result: Message | dict[str, Any] | None = None) -> None:
        """End it as done."""
        self.finish(GoalStatus.SUCCEEDED, result)

    def abort(self, result: Message | dict[str, Any] | None = None) -> None:
        """End it as failed."""
        self.finish(GoalStatus.ABORTED, result)

    def canceled(self, result: Message | dict[str, Any] | None = None) -> None:
        """End it as cancelled, after a request to cancel."""
        self.finish(GoalStatus.CANCELED, result)

    def close(self) -> None:
        """Abort it, unless it has ended; safe to call twice."""
        self.finish(GoalStatus.ABORTED, None, strict=False)

    # -- for its server --------------------------------------------------------------------------

    def start(self) -> bool:
        """Take note that it is executed now; returns whether it is, and was not cancelled."""
        with self._lock:
            if self._status is not GoalStatus.ACCEPTED:
                return False
            self._status = GoalStatus.EXECUTING
        self._server.publish_status()
        return True

    def request_cancel(self) -> bool:
        """Let it be cancelled; returns whether it still can be."""
        with self._lock:
            if not self.cancelable:
                return False
            self._status = GoalStatus.CANCELING
        self.stop()
        return True

    @property
    def cancelable(self) -> bool:
        """Whether it has neither ended nor is being cancelled (``rcl_action``'s state machine)."""
        return self._status in (GoalStatus.ACCEPTED, GoalStatus.EXECUTING)

    def conclude(self, result: Any) -> None:
        """End it with what executing it returned: cancelled if that was asked for, or done.

        Raises:
            ConversionError: `result` does not fit.
        """
        made = self._server.make_result(result)
        with self._lock:
            canceled = self._status is GoalStatus.CANCELING
            status = GoalStatus.CANCELED if canceled else GoalStatus.SUCCEEDED
            waiting = self._settle(status, made)
        self._publish(waiting)

    def fail(self, error: BaseException) -> None:  # noqa: ARG002 - ROS 2 has no room for it
        """End it as failed, unless it has ended."""
        self.close()

    def finish(self, status: GoalStatus, result: Any, *, strict: bool = True) -> None:
        """End it.

        Args:
            status: How.
            result: The result, None for the type's defaults.
            strict: Whether it is an error that it has ended already.
        """
        made = self._server.make_result(result)
        with self._lock:
            if self._status.is_active:
                if status is GoalStatus.CANCELED and self._status is not GoalStatus.CANCELING:
                    raise self._not_asked()
                waiting = self._settle(status, made)
            elif strict:
                raise self._over(f"it cannot end as {status.value}")
            else:
                return
        self._publish(waiting)

    def add_waiting(self, future: Future[Any]) -> None:
        """Answer a request for the result, now or when there is one."""
        dropped = None
        with self._lock:
            response, self.asked = self._response, True
            if response is None:
                if len(self._waiting) >= _MAX_WAITING:
                    dropped = self._waiting.pop(0)
                self._waiting.append(future)
        if response is not None:
            future.set_result(response)
        if dropped is not None:
            dropped.cancel()

    def _settle(self, status: GoalStatus, result: Any) -> list[Future[Any]]:
        """Note its end; returns who waits for the result."""
        if not self._status.is_active:
            return []
        self._status, self.ended = status, time.monotonic()
        self._response = self._server.make_response(CODES[status], result)
        waiting, self._waiting = self._waiting, []
        return waiting

    def _publish(self, waiting: list[Future[Any]]) -> None:
        self.stop()
        self._server.publish_status()
        for future in waiting:
            if self._response is not None and future.set_running_or_notify_cancel():
                future.set_result(self._response)
