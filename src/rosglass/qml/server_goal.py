"""``ServerGoalHandle``: a goal as the interface that executes it sees it."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.client_element import given_fields
from rosglass.qml.goal_handle import let_go
from rosglass.qml.goal_states import status_code
from rosglass.qml.log import log_from_qml
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.action_client import GoalStatus
    from rosglass.comm.action_server import ServerGoal
    from rosglass.messages import ActionType
    from rosglass.qml.dialect import Dialect
    from rosglass.qml.runtime import Runtime

__all__ = ["ServerGoalHandle"]

#: Milliseconds after which a request to cancel that has had no effect is told of.
_REMINDER = 5000
#: Let go when JavaScript collects a handle: PySide 6.11 never frees the Python half.
_HELD = ("_goal", "_forget", "_type", "_asked")


class ServerGoalHandle(QtCore.QObject):
    """A goal that was accepted; JavaScript sees the same object everywhere.

    Args:
        runtime: The engine's runtime.
        goal: The goal.
        type: The action's type.
        dialect: Whose habits its values follow.
        forget: Called when it has ended.
    """

    #: With the new status.
    statusChanged = Signal(int)
    cancelRequestedChanged = Signal()

    def __init__(
        self,
        runtime: Runtime,
        goal: ServerGoal,
        type: ActionType,
        dialect: Dialect,
        forget: Callable[[ServerGoalHandle], None],
    ) -> None:
        super().__init__()
        self._runtime, self._goal, self._type, self._dialect = runtime, goal, type, dialect
        self._forget, self._status, self._requested = forget, goal.status, False
        self._asked: QJSValue | None = None
        self._abandoned = False
        self._caller = runtime.caller()
        #: What the node waits for: the fields of the result, None when there is nothing to say.
        self.ended: Future[Any] = Future()
        engine = runtime.engine
        #: Keeps JavaScript from collecting it before the goal has ended.
        self.js: QJSValue = QJSValue() if engine is None else engine.newQObject(runtime.keep(self))
        self._id, state = goal.id_text, self.__dict__
        self.destroyed.connect(lambda: None if goal.status.is_active else let_go(state, _HELD))
        goal.cancel_request.on_done(lambda _: self.refresh(), runtime.session.executor)

    # What QML sees.

    def _get_goal(self) -> QJSValue:
        if self._asked is None:
            self._asked = self._runtime.message(self._goal.goal, self._dialect)
        return self._asked

    def _get_stamp(self) -> QJSValue:
        return self._runtime.time(self._goal.accepted, self._dialect)

    def _is_requested(self) -> bool:
        live = self._goal.status.is_active and self._goal.is_cancel_requested
        return self._requested or live

    status = Property(int, lambda self: int(status_code(self._goal.status)), notify=statusChanged)
    isActive = Property(bool, lambda self: self._goal.status.is_active, notify=statusChanged)
    goalId = Property(str, lambda self: self._goal.id_text, constant=True)
    goal = Property(QJSValue, _get_goal, constant=True)
    goalStamp = Property(QJSValue, _get_stamp, constant=True)
    isCancelRequested = Property(bool, _is_requested, notify=cancelRequestedChanged)

    @Slot(QJSValue)
    def publishFeedback(self, feedback: QJSValue) -> None:
        """Send feedback; a value that does not fit, or a goal that has ended, throws."""
        self._do("publishFeedback", self._goal.publish_feedback, self._type.feedback, feedback)

    @Slot()
    @Slot(QJSValue)
    def succeed(self, result: QJSValue | None = None) -> None:
        """End it as done; throws when the result does not fit, or it has ended already."""
        self._do("succeed", self._goal.succeed, self._type.result, result)

    @Slot()
    @Slot(QJSValue)
    def abort(self, result: QJSValue | None = None) -> None:
        """End it as failed; throws as :meth:`succeed`."""
        self._do("abort", self._goal.abort, self._type.result, result)

    @Slot()
    @Slot(QJSValue)
    def canceled(self, result: QJSValue | None = None) -> None:
        """End it as cancelled; throws as :meth:`succeed`, and when nobody asked for that."""
        self._do("canceled", self._goal.canceled, self._type.result, result)

    def _do(self, what: str, do: Callable[[Any], None], kind: Any, value: QJSValue | None) -> None:
        try:
            do(given_fields(QJSValue() if value is None else value, kind, self._dialect))
        except Error as error:
            self._runtime.throw(f"{what} of {self._label}: {error}")
        self.refresh()

    # For its server.

    def take(self, answer: QJSValue) -> Any:
        """Return the fields of the result that JavaScript gave; None for undefined.

        Raises:
            ConversionError: It does not fit.
        """
        if answer.isUndefined() or answer.isNull():
            return None
        return given_fields(answer, self._type.result, self._dialect)

    def settle(self, answer: Future[Any]) -> None:
        """End it with what a promise came to."""
        error = answer.exception(0)
        if error is not None:
            self.fail(error)
        else:
            self.finish(answer.result(0))

    def finish(self, result: Any) -> None:
        """End it with its result: done, or cancelled if that was asked for."""
        if not self.ended.done():
            self.ended.set_result(result)
        elif result is not None and not self._abandoned:
            text = f"{self._label} has ended already; what execute returned is dropped"
            log_from_qml("", logging.WARNING, text, self._caller)
        self.refresh()

    def fail(self, error: BaseException) -> None:
        """End it as failed."""
        if not self.ended.done() and not self._abandoned:
            self.ended.set_exception(error)
        self.refresh()

    def abandon(self) -> None:
        """Take note that its server is about to close, which aborts it."""
        self._abandoned = True

    def refresh(self) -> None:
        """Tell what has changed."""
        if "_goal" not in self.__dict__:
            return
        status = self._goal.status
        requested = self._is_requested()
        if not status.is_active:
            if not self.ended.done():
                self.ended.set_result(None)
            self._forget(self)
        if not is_alive(self):
            if not status.is_active:
                let_go(self.__dict__, _HELD)
            return
        if requested and not self._requested:
            self._requested = True
            self.cancelRequestedChanged.emit()
            QtCore.QTimer.singleShot(_REMINDER, self._remind)
        self._tell(self._goal.status)
        if not status.is_active:
            self.js = QJSValue()

    @Slot()
    def _remind(self) -> None:
        if is_alive(self) and self._goal.status.is_active and not self._abandoned:
            text = (
                f"{self._label} was asked to be cancelled {_REMINDER / 1000:g} s ago, and runs on: "
                "when isCancelRequested becomes true, end it with canceled()"
            )
            log_from_qml("", logging.WARNING, text, self._caller)

    def _tell(self, status: GoalStatus) -> None:
        if status is not self._status:
            self._status = status
            self.statusChanged.emit(int(status_code(status)))

    @property
    def _label(self) -> str:
        return f"goal {self._id}"
