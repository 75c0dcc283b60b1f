"""Enumerations in QML: goal states and clock types."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

from rosglass.qml.runtime import own_runtime
from rosglass.qt import Property, QJSValue, QtCore

if TYPE_CHECKING:
    from rosglass.comm.action_client import GoalStatus


__all__ = [
    "ActionCommStates",
    "ActionGoalStatus",
    "ActionTerminalStates",
    "ClockTypes",
    "comm_state_of",
    "status_code",
    "terminal_state_of",
]


class ActionGoalStatus(QtCore.QObject):
    """The status of a goal; same numbers as ``action_msgs/msg/GoalStatus``."""

    @QtCore.QEnum
    class Status(IntEnum):
        """``Unknown`` until the server accepts the goal, and if the outcome is unknown."""

        Unknown = 0
        Accepted = 1
        Executing = 2
        Canceling = 3
        Succeeded = 4
        Canceled = 5
        Aborted = 6


class ActionCommStates(QtCore.QObject):
    """The communication state of a goal, as actionlib's ``CommState``."""

    @QtCore.QEnum
    class State(IntEnum):
        """The states, in the order in which a goal goes through them."""

        WAITING_FOR_GOAL_ACK = 0
        PENDING = 1
        ACTIVE = 2
        WAITING_FOR_RESULT = 3
        WAITING_FOR_CANCEL_ACK = 4
        RECALLING = 5
        PREEMPTING = 6
        DONE = 7


class ActionTerminalStates(QtCore.QObject):
    """The final state of a goal, as actionlib's ``TerminalState``; UNKNOWN until it ends."""

    @QtCore.QEnum
    class State(IntEnum):
        """The outcome that the server reported, or LOST."""

        RECALLED = 0
        REJECTED = 1
        PREEMPTED = 2
        ABORTED = 3
        SUCCEEDED = 4
        LOST = 5
        UNKNOWN = 6


_Status, _Comm, _Terminal = (
    ActionGoalStatus.Status,
    ActionCommStates.State,
    ActionTerminalStates.State,
)
#: Values of GoalStatus -> codes. A rejected goal counts as aborted, as in the reference plugin.
_CODES = {
    "accepted": _Status.Accepted,
    "executing": _Status.Executing,
    "canceling": _Status.Canceling,
    "succeeded": _Status.Succeeded,
    "canceled": _Status.Canceled,
    "aborted": _Status.Aborted,
    "rejected": _Status.Aborted,
}
_COMM = {
    "pending": _Comm.WAITING_FOR_GOAL_ACK,
    "accepted": _Comm.PENDING,
    "executing": _Comm.ACTIVE,
    "canceling": _Comm.PREEMPTING,
}
_TERMINAL = {
    "succeeded": _Terminal.SUCCEEDED,
    "canceled": _Terminal.PREEMPTED,
    "aborted": _Terminal.ABORTED,
    "rejected": _Terminal.REJECTED,
    "lost": _Terminal.LOST,
}


def status_code(status: GoalStatus) -> ActionGoalStatus.Status:
    """Return the code of a status in ``Ros2 1.0``."""
    return _CODES.get(status.value, _Status.Unknown)


def comm_state_of(status: GoalStatus) -> ActionCommStates.State:
    """Return the actionlib state that corresponds to the status of a ROS 2 goal."""
    return _COMM.get(status.value, _Comm.WAITING_FOR_RESULT)


def terminal_state_of(status: GoalStatus, executed: bool) -> ActionTerminalStates.State:
    """Return actionlib's terminal state of a goal.

    Args:
        status: The goal's status.
        executed: Whether it was executed; a goal cancelled before that was recalled.
    """
    if status.value == "canceled" and not executed:
        return _Terminal.RECALLED
    return _TERMINAL.get(status.value, _Terminal.UNKNOWN)


class ClockTypes(QtCore.QObject):
    """Clock types, numbered as in rcl (``rcl_clock_type_t``).

    Values of a time's ``clockType``, a property in the Qt 5 plugin and a function in the Qt 6 one.
    """

    def _get(self, number: int) -> QJSValue:
        return own_runtime(self).clock(number)

    Uninitialized = Property(QJSValue, lambda self: self._get(0), constant=True)
    Ros = Property(QJSValue, lambda self: self._get(1), constant=True)
    System = Property(QJSValue, lambda self: self._get(2), constant=True)
    Steady = Property(QJSValue, lambda self: self._get(3), constant=True)
