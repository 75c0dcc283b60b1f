"""``GoalHandle`` of ``Ros 1.0``, in the words of actionlib, whatever the robot speaks."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rosglass.comm.action_client import GoalStatus
from rosglass.errors import Error
from rosglass.qml.goal_handle import GoalHandle
from rosglass.qml.goal_states import (
    ActionCommStates,
    ActionTerminalStates,
    comm_state_of,
    terminal_state_of,
)
from rosglass.qml.log import log_from_qml
from rosglass.qt import Property, QJSValue, Signal, Slot, is_alive

if TYPE_CHECKING:
    from rosglass.comm.action_client import ClientGoal
    from rosglass.comm.handle import Executor

__all__ = ["RosGoalHandle"]

_Comm, _Terminal = ActionCommStates.State, ActionTerminalStates.State
#: A goal goes from one to a later one only.
_ORDER = [
    _Comm.WAITING_FOR_GOAL_ACK,
    _Comm.PENDING,
    _Comm.ACTIVE,
    _Comm.WAITING_FOR_CANCEL_ACK,
    _Comm.RECALLING,
    _Comm.PREEMPTING,
    _Comm.WAITING_FOR_RESULT,
    _Comm.DONE,
]


class RosGoalHandle(GoalHandle):
    """A goal; the same object in every callback."""

    commStateChanged = Signal()
    terminalStateChanged = Signal()
    expiredChanged = Signal()

    _comm = _Comm.WAITING_FOR_GOAL_ACK
    _expired = False
    #: Whether the robot tells the states itself, as ROS 1 does.
    _native = False

    def _get_terminal(self) -> QJSValue:
        state, text = self._terminal(), self._reason
        return self._runtime.value({"state": int(state), "text": text})

    def _terminal(self) -> ActionTerminalStates.State:
        if not self._over:
            return _Terminal.UNKNOWN
        known: Any = getattr(self._goal, "terminal_state", None)
        if known is not None and self._status is not GoalStatus.LOST:
            return _Terminal[known.name]
        return terminal_state_of(self._status, self._executed)

    commState = Property(int, lambda self: int(self._comm), notify=commStateChanged)
    terminalState = Property(QJSValue, _get_terminal, notify=terminalStateChanged)
    expired = Property(bool, lambda self: self._expired, notify=expiredChanged)

    @Slot(result=QJSValue)
    def getResult(self) -> QJSValue:
        """Return the result; undefined while there is none."""
        return self._get_result()

    @Slot()
    def cancel(self) -> None:
        """Ask the server to cancel it."""
        super().cancel()
        # As with actionlib, at once; the robot tells what follows.
        if self.sent and not self._over:
            self._go(_Comm.WAITING_FOR_CANCEL_ACK)

    @Slot()
    def resend(self) -> None:
        """Send it once more, for servers that may have missed it; only ROS 1 knows that."""
        send: Any = getattr(self._goal, "resend", None)
        if self._expired:
            self._warn("resend", "it has expired: its client is gone")
        elif send is None:
            self._warn("resend", "ROS 2 sends goals reliably, and once")
        else:
            try:
                send()
            except Error as error:
                self._warn("resend", str(error))

    def expire(self, reason: str) -> None:
        """Let it have ended, as its client is gone."""
        self._expired = True
        self.end(GoalStatus.LOST, None, reason)
        if is_alive(self):
            self.expiredChanged.emit()

    def _warn(self, what: str, why: str) -> None:
        text = f"{what}() of {self._label} has no effect: {why}"
        log_from_qml("", logging.WARNING, text, self._runtime.caller())

    def _sent(self, goal: ClientGoal, executor: Executor) -> None:
        watch: Any = getattr(goal, "on_comm_state_change", None)
        if watch is not None:
            self._native = True
            watch(self._on_comm_state, executor)
            self._on_comm_state(goal.comm_state)  # type: ignore[attr-defined]

    def _on_comm_state(self, state: Any) -> None:
        # The result comes after the state that says so, and is there once it is DONE.
        if is_alive(self) and not self._over and state.name != "DONE":
            self._go(_Comm[state.name])

    def _moved(self, status: GoalStatus) -> None:
        if not self._native and status is not GoalStatus.LOST:
            self._go(comm_state_of(status))

    def _ended(self, js: QJSValue) -> None:
        self._go(_Comm.DONE, js)
        self.terminalStateChanged.emit()

    def _go(self, state: ActionCommStates.State, js: QJSValue | None = None) -> None:
        if _ORDER.index(state) > _ORDER.index(self._comm):
            self._comm = state
            self.commStateChanged.emit()
            self._told.transition(js or self.js)
