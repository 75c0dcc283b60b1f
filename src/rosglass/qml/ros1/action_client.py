"""What ``Ros.createActionClient`` returns."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from rosglass.qml.action_client import GoalSender
from rosglass.qml.action_server import action_type
from rosglass.qml.callbacks import call_back
from rosglass.qml.dialect import Dialect
from rosglass.qml.goal_handle import GoalCallbacks
from rosglass.qml.js_values import null
from rosglass.qml.log import log_from_qml
from rosglass.qml.properties import ReadOnly, report
from rosglass.qml.ros1.goal_handle import RosGoalHandle
from rosglass.qt import Property, QJSValue, Slot

if TYPE_CHECKING:
    from rosglass.qml.runtime import Runtime

__all__ = ["RosActionClient"]


class RosActionClient(GoalSender):
    """Sends goals while a server is connected.

    Args:
        runtime: The engine's runtime.
        name: Action name, as in QML.
        type_name: Action type as ROS 1 calls it, ``pkg/DoAction``.
    """

    DIALECT = Dialect.ROS1
    _HANDLE = RosGoalHandle

    connected = ReadOnly(bool, False)
    name = Property(str, lambda self: self._name, constant=True)
    actionType = Property(str, lambda self: self._given_type, constant=True)

    def __init__(self, runtime: Runtime, name: str, type_name: str) -> None:
        super().__init__(runtime, name, action_type(type_name))
        self._given_type = type_name

    def _set_ready(self, ready: bool) -> None:
        report(self, connected=ready)

    @Slot(result=bool)
    def isServerConnected(self) -> bool:
        """Return whether a server is there."""
        return self.connected

    @Slot(QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, QJSValue, result=QJSValue)
    def sendGoal(
        self,
        goal: QJSValue,
        transition: QJSValue | None = None,
        feedback: QJSValue | None = None,
    ) -> QJSValue:
        """Send a goal and return its handle; null while no server is connected.

        Args:
            goal: An object with the goal's fields; one that does not fit throws.
            transition: Told the handle whenever its ``commState`` has changed.
            feedback: Told the handle and each feedback.
        """
        runtime = self._runtime
        assert runtime is not None
        if not self._check_functions({"transition_cb": transition, "feedback_cb": feedback}):
            return QJSValue()
        if not self.connected:
            text = f"action {self._name}: no goal was sent: {self._problem or self._missing()}"
            log_from_qml("", logging.WARNING, text, runtime.caller())
            return null()
        js = QJSValue()

        def changed(handle: QJSValue) -> None:
            if transition is not None:
                call_back(runtime, transition, handle)

        def fed(message: QJSValue) -> None:
            if feedback is not None:
                call_back(runtime, feedback, js, message)

        js = self._send(goal, GoalCallbacks(transition=changed, feedback=fed))
        return js

    @Slot(QJSValue)
    def cancelGoalsAtAndBeforeTime(self, time: QJSValue) -> None:
        """Ask the server to cancel the goals sent at or before a time, or Date."""
        self._cancel_until(time)
