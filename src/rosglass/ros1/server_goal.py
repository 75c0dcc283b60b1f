"""One goal of an action server, from its acceptance to its end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosglass.comm import GoalStatus
from rosglass.comm.goal_server import ExecutedGoal
from rosglass.errors import ConversionError
from rosglass.ros1.action_state import ServerState

if TYPE_CHECKING:
    import threading

    from rosglass.messages import Message
    from rosglass.ros1.action_server import Ros1ActionServer
    from rosglass.ros1.goal_list import GoalEntry

__all__ = ["Ros1ServerGoal"]

_STATUSES = {
    ServerState.PENDING: GoalStatus.ACCEPTED,
    ServerState.ACTIVE: GoalStatus.EXECUTING,
    ServerState.PREEMPTING: GoalStatus.CANCELING,
    ServerState.RECALLING: GoalStatus.CANCELING,
    ServerState.PREEMPTED: GoalStatus.CANCELED,
    ServerState.RECALLED: GoalStatus.CANCELED,
    ServerState.SUCCEEDED: GoalStatus.SUCCEEDED,
    ServerState.ABORTED: GoalStatus.ABORTED,
    ServerState.REJECTED: GoalStatus.REJECTED,
}
_ENDS = {
    GoalStatus.SUCCEEDED: ServerState.SUCCEEDED,
    GoalStatus.ABORTED: ServerState.ABORTED,
    GoalStatus.CANCELED: ServerState.PREEMPTED,
}
#: What an end is called when the goal was never executed.
_UNBEGUN = {ServerState.PREEMPTED: ServerState.RECALLED, ServerState.ABORTED: ServerState.REJECTED}
_WAITING = (ServerState.PENDING, ServerState.RECALLING)


class Ros1ServerGoal(ExecutedGoal):
    """A goal; made by an action server when it accepts one.

    Args:
        server: Whose it is.
        entry: Its state.
        lock: Held while that changes.

    Attributes:
        client_id: Its id in text, as its client made it.
    """

    _server: Ros1ActionServer

    def __init__(self, server: Ros1ActionServer, entry: GoalEntry, lock: threading.Lock) -> None:
        super().__init__(server)
        self.id, self.client_id = entry.id.encode(), entry.id
        self.goal: Message = entry.asked
        self.accepted = entry.stamp
        self._entry, self._lock = entry, lock
        self._replaced = self._started = False

    @property
    def id_text(self) -> str:
        """The id as it goes over the wire."""
        return self.client_id

    @property
    def status(self) -> GoalStatus:
        """What has become of it; see :attr:`state` for ROS 1's own word."""
        if self._entry.state is ServerState.ACTIVE and not self._started:
            return GoalStatus.ACCEPTED
        return _STATUSES[self._entry.state]

    @property
    def state(self) -> ServerState:
        """What the server's status topic says of it."""
        return self._entry.state

    @property
    def is_cancel_requested(self) -> bool:
        """Whether it should end soon: with :meth:`canceled`, or because the server closes.

        That is so, too, once a newer goal waits for its place (``simple=True``).
        """
        return super().is_cancel_requested

    def publish_feedback(
        self, feedback: Message | dict[str, Any] | None = None, /, **fields: Any
    ) -> None:
        """Send feedback; see :meth:`rosglass.comm.ServerGoal.publish_feedback`."""
        if not self.status.is_active:
            raise self._over("feedback comes too late")
        self._server.send_feedback(self._entry, feedback, fields)

    def succeed(self, result: Message | dict[str, Any] | None = None, text: str = "") -> None:
        """End it as done; `text` goes to its client with the status."""
        self.finish(GoalStatus.SUCCEEDED, result, text)

    def abort(self, result: Message | dict[str, Any] | None = None, text: str = "") -> None:
        """End it as failed; `text` tells its client why."""
        self.finish(GoalStatus.ABORTED, result, text)

    def canceled(self, result: Message | dict[str, Any] | None = None, text: str = "") -> None:
        """End it as cancelled (preempted), after a request to cancel or for a newer goal."""
        self.finish(GoalStatus.CANCELED, result, text)

    def close(self) -> None:
        """Abort it, unless it has ended; safe to call twice."""
        self.finish(GoalStatus.ABORTED, None, "it was closed", strict=False)

    # -- for its server --------------------------------------------------------------------------

    def start(self) -> bool:
        """Take note that it is executed now; returns whether it is, and was not cancelled."""
        with self._lock:
            if self._entry.state not in (ServerState.PENDING, ServerState.ACTIVE):
                return False
            self._entry.go(ServerState.ACTIVE)
            self._started = True
        self._server.publish_status()
        return True

    def replace(self) -> None:
        """Let it end for a newer goal."""
        self._replaced = True
        self.stop()

    def conclude(self, result: Any) -> None:
        """End it with what executing it returned: cancelled if that was asked for, or done.

        Raises:
            ConversionError: `result` does not fit.
        """
        made = self._server.make_result(result)
        with self._lock:
            canceled = self._entry.state in (ServerState.PREEMPTING, ServerState.RECALLING)
            status = GoalStatus.CANCELED if canceled or self._replaced else GoalStatus.SUCCEEDED
            ended = self._settle(status, "")
        if ended:
            self.stop()
            self._server.publish_result(self._entry, made)

    def fail(self, error: BaseException) -> None:
        """End it as failed, unless it has ended; its client is told why."""
        told = f"{type(error).__name__}: {error}"
        self.finish(GoalStatus.ABORTED, None, told, strict=False)

    def finish(self, status: GoalStatus, result: Any, text: str, *, strict: bool = True) -> None:
        """End it.

        Args:
            status: How.
            result: The result, None for the type's defaults.
            text: Why, in words for its client.
            strict: Whether it is an error that it has ended already.
        """
        if not isinstance(text, str):
            raise ConversionError("text", text, "a text", f"goal {self.id_text}")
        made = self._server.make_result(result)
        with self._lock:
            if status is GoalStatus.CANCELED and not self._may_be_canceled():
                raise self._not_asked()
            ended = self._settle(status, text)
        if ended:
            self.stop()
            self._server.publish_result(self._entry, made)
        elif strict:
            raise self._over(f"it cannot end as {status.value}")

    def _may_be_canceled(self) -> bool:
        return self._replaced or self._entry.state not in (ServerState.PENDING, ServerState.ACTIVE)

    def _settle(self, status: GoalStatus, text: str) -> bool:
        """Note its end; returns whether that was so."""
        if self._entry.state.is_terminal:
            return False
        end = _ENDS[status]
        if self._entry.state in _WAITING:
            end = _UNBEGUN.get(end, end)
        self._entry.go(end, text)
        self._server.note_end(self._entry)
        return True
