"""Goals in QML: handles of goals that a client sent or a server executes, and their states."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import time
from concurrent.futures import Future
from enum import IntEnum
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm.action_client import GoalStatus
from rosglass.comm.time import Time
from rosglass.errors import ConversionError, Error
from rosglass.qml.elements.element import given_fields, named
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import ReadOnly
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rosglass.comm.action_client import ActionClient, CancelAnswer, ClientGoal
    from rosglass.comm.action_server import ServerGoal
    from rosglass.comm.handle import Executor
    from rosglass.comm.promise import Promise
    from rosglass.messages import ActionType, Message
    from rosglass.qml.engine.dialect import Dialect
    from rosglass.qml.engine.log import Caller
    from rosglass.qml.engine.runtime import Runtime

__all__ = [
    "ActionCommStates",
    "ActionGoalStatus",
    "ActionTerminalStates",
    "GoalCallbacks",
    "GoalHandle",
    "RosGoalHandle",
    "ServerGoalHandle",
    "comm_state_of",
    "let_go",
    "report_cancelling",
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


#: Released when JavaScript collects a handle: PySide 6.11 never frees the Python half.
_HELD = ("_goal", "_callbacks", "_forget", "_value", "_feedback", "_result", "_shown")


def _ignore(_: object) -> None:
    pass


class GoalCallbacks(NamedTuple):
    """The callbacks of one goal, called on the GUI thread.

    Attributes:
        response: Called once with whether the server accepts the goal.
        feedback: Called with each feedback.
        transition: Called with the handle after each change of its ``commState``.
        result: Called once with the handle when the goal has ended, however it ended.
        handles_failure: Whether `result` reports failures; otherwise they are logged.
    """

    response: Callable[[bool], object] = _ignore
    feedback: Callable[[QJSValue], object] = _ignore
    transition: Callable[[QJSValue], object] = _ignore
    result: Callable[[GoalHandle], object] = _ignore
    handles_failure: bool = False


class GoalHandle(QtCore.QObject):
    """A sent goal: the same object everywhere in JavaScript, kept until the goal has ended.

    Args:
        runtime: The engine's runtime.
        action: Name of the action, as in QML.
        value: The goal's fields.
        callbacks: The callbacks for its status, feedback and result.
        dialect: The module whose format feedback and result have.
        timeout_ms: Milliseconds for a server to appear and to answer; 0 for no limit.
        forget: Called when the goal has ended.
        tolerant: Whether functions after the end, and results that do not fit, are logged instead
            of thrown; such a result aborts the goal, so that its client does not wait.
    """

    #: The status, given as the argument, or ``isActive`` changed.
    statusChanged = Signal(int)
    goalIdChanged = Signal()
    feedbackChanged = Signal()
    resultChanged = Signal()
    #: Cancelling failed, for this reason; as far as is known, the goal continues.
    cancelFailed = Signal(str)

    status = ReadOnly(int, read=lambda self: int(status_code(self._status)))
    isActive = ReadOnly(bool, read="_is_active", notify="statusChanged")
    goalId = ReadOnly(str, read="_get_id")
    goalStamp = ReadOnly(QJSValue, read="_get_stamp", notify="statusChanged")
    feedback = ReadOnly(QJSValue, read=lambda self: self._show("feedback", self._feedback))
    result = ReadOnly(QJSValue, read=lambda self: self._show("result", self._result))
    reason = ReadOnly(str, read=lambda self: self._reason, notify="resultChanged")

    def __init__(
        self,
        runtime: Runtime,
        action: str,
        value: QJSValue,
        callbacks: GoalCallbacks,
        dialect: Dialect,
        timeout_ms: int,
        forget: Callable[[GoalHandle], None],
    ) -> None:
        super().__init__()
        self._runtime, self._action, self._value = runtime, action, value
        self._callbacks, self._dialect, self._forget = callbacks, dialect, forget
        self._deadline = time.monotonic() + timeout_ms / 1000 if timeout_ms else None
        self._caller = runtime.caller()
        self._goal: ClientGoal | None = None
        self._status = GoalStatus.PENDING
        self._answered = self._over = False
        self._reason = ""
        self._executed = False
        self._feedback: Message | None = None
        self._result: Message | None = None
        self._shown: dict[str, QJSValue] = {}
        engine = runtime.engine
        #: Keeps JavaScript from collecting it before the goal has ended.
        self.js: QJSValue = QJSValue() if engine is None else engine.newQObject(runtime.keep(self))
        state = self.__dict__
        self.destroyed.connect(lambda: let_go(state, _HELD))

    # For QML.

    def _get_id(self) -> str:
        return self._goal.id_text if self._goal is not None else ""

    def _get_stamp(self) -> QJSValue:
        accepted = self._goal.accepted if self._goal is not None else None
        return self._runtime.time(accepted or Time(), self._dialect)

    def _is_active(self) -> bool:
        return not self._over and self._status.is_active

    def _show(self, what: str, message: Message | None) -> QJSValue:
        if message is None:
            return QJSValue()
        if what not in self._shown:
            self._shown[what] = self._runtime.message(message, self._dialect)
        return self._shown[what]

    @Slot()
    def cancel(self) -> None:
        """Ask the server to cancel the goal; one that is still unsent is never sent."""
        caller = self._runtime.caller()
        if self._status is GoalStatus.LOST:
            reason = f"no further updates of it will arrive: {self._reason}"
            log_from_qml("", logging.WARNING, f"{self._label} is not cancelled: {reason}", caller)
            self.cancelFailed.emit(reason)
            return
        if self._over:
            return
        if self._goal is None:
            self.end(GoalStatus.CANCELED, None, "it was cancelled before it was sent")
            return

        def answered(answer: Promise[CancelAnswer]) -> None:
            if is_alive(self) and (not self._over or self._status is GoalStatus.LOST):
                reason = report_cancelling(answer, self._label, caller, logging.WARNING)
                if reason:
                    self.cancelFailed.emit(reason)

        self._goal.cancel().on_done(answered, self._runtime.session.executor)

    # For its client.

    @property
    def sent(self) -> bool:
        """True once the goal was passed to a client of the node."""
        return self._goal is not None

    @property
    def left(self) -> float | None:
        """Seconds left for a server to answer, as shown in errors; None for no limit."""
        if self._deadline is None:
            return None
        return round(max(0.0, self._deadline - time.monotonic()), 1)

    def start(self, client: ActionClient, executor: Executor) -> None:
        """Send the goal as soon as there is a server.

        Args:
            client: A client whose type is known.
            executor: The executor of the GUI thread.

        Raises:
            ConversionError: The goal's fields do not match its type.
            Error: The client cannot send.
        """
        assert client.type is not None
        goal = client.send_goal(
            given_fields(self._value, client.type.goal, self._dialect),
            on_feedback=weak_callback(self._on_feedback),
            on_status_change=weak_callback(self._on_status),
            on_done=weak_callback(self._on_done),
            executor=executor,
            timeout=self.left,
        )
        self._goal, self._value = goal, QJSValue()
        goal.acceptance.on_done(weak_callback(self._on_acceptance), executor)
        self.goalIdChanged.emit()
        self._sent(goal, executor)

    def end(self, status: GoalStatus, result: Message | None, reason: str) -> None:
        """End the goal and notify all listeners; only once.

        Args:
            status: The final status.
            result: The server's result; None without one.
            reason: Why there is no result.
        """
        if not is_alive(self) or self._over:
            return
        js = self.js
        self._forget(self)
        self._answer(False)
        active, self._over, self._result = self._is_active(), True, result
        # ROS 1 servers send the reason.
        self._reason = reason or getattr(self._goal, "text", "")
        if reason and not self._callbacks.handles_failure:
            text = named(self._action, Error(reason))
            log_from_qml("", logging.WARNING, text, self._caller)
        self._set_status(status, active)
        self.resultChanged.emit()
        self._ended(js)
        self._callbacks.result(self)
        # From here on, only JavaScript keeps the handle alive.
        self.js, self._callbacks = QJSValue(), GoalCallbacks()

    def outcome(self) -> QJSValue:
        """Return ``{goalId, code, result, reason}``; without a result, `result` is empty."""
        runtime = self._runtime
        parts = {"goalId": self._get_id(), "code": int(status_code(self._status))}
        made = runtime.value({**parts, "reason": self._reason})
        result = runtime.value({}) if self._result is None else self.result
        made.setProperty("result", result)
        return made

    @property
    def failure(self) -> str:
        """Why there is no result; empty if there is one, or the goal has not ended."""
        return self._reason if self._result is None else ""

    def expire(self, reason: str) -> None:
        """End the goal because its client no longer exists."""
        self.end(GoalStatus.LOST, None, reason)

    # For subclasses.

    def _sent(self, goal: ClientGoal, executor: Executor) -> None:
        """Handle that the goal was sent."""

    def _moved(self, status: GoalStatus) -> None:
        """Handle a new status."""

    def _ended(self, js: QJSValue) -> None:
        """Handle the goal's end; `js` is the handle in JavaScript."""

    # Events of the goal.

    @property
    def _label(self) -> str:
        return f"goal {self._get_id()} of {self._action}"

    def _on_status(self, status: GoalStatus) -> None:
        if is_alive(self) and not self._over:
            self._set_status(status, self._is_active())

    def _set_status(self, status: GoalStatus, was_active: bool) -> None:
        if status is self._status and was_active == self._is_active():
            return
        self._status = status
        self._executed |= status in (GoalStatus.EXECUTING, GoalStatus.SUCCEEDED)
        self.statusChanged.emit(int(status_code(status)))
        self._moved(status)

    def _on_acceptance(self, acceptance: Promise[bool]) -> None:
        if is_alive(self) and not self._over:
            self._answer(acceptance.exception(0) is None and acceptance.result(0))

    def _answer(self, accepted: bool) -> None:
        if not self._answered:
            self._answered = True
            self._callbacks.response(accepted)

    def _on_feedback(self, feedback: Message) -> None:
        if is_alive(self) and not self._over:
            self._feedback = feedback
            self._shown.pop("feedback", None)
            self.feedbackChanged.emit()
            self._callbacks.feedback(self.feedback)

    def _on_done(self, goal: ClientGoal) -> None:
        if not is_alive(self) or self._over:
            return
        # Of a goal that ends at once, the end may be notified first.
        self._on_acceptance(goal.acceptance)
        error = goal.done.exception(0)
        if error is None:
            end = goal.done.result(0)
            self.end(end.status, end.result, "")
        else:
            self.end(goal.status, None, str(error))


def let_go(state: dict[str, object], names: Iterable[str]) -> None:
    """Delete some attributes of an object that JavaScript has collected."""
    for name in names:
        state.pop(name, None)


def report_cancelling(
    answer: Promise[CancelAnswer], what: str, caller: Caller, refused: int
) -> str:
    """Log that a request to cancel failed, or was refused.

    Args:
        answer: The answer, already settled.
        what: The goals that should have been cancelled.
        caller: The QML line of the request.
        refused: The log level of refusals.

    Returns:
        Why nothing is cancelled; empty if something is.
    """
    error = answer.exception(0)
    if error is not None:
        log_from_qml("", logging.ERROR, f"{what} could not be cancelled: {error}", caller)
        return str(error)
    if answer.result(0).accepted:
        return ""
    reason = answer.result(0).reason or "the server refused without giving a reason"
    log_from_qml("", refused, f"{what} is not cancelled: {reason}", caller)
    return reason


_Comm, _Terminal = ActionCommStates.State, ActionTerminalStates.State
#: A goal only moves from a state to a later one.
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
    """The handle of a sent goal in ``Ros 1.0``; the same object in every callback."""

    commStateChanged = Signal()
    terminalStateChanged = Signal()
    expiredChanged = Signal()

    commState = ReadOnly(int, read=lambda self: int(self._comm))
    terminalState = ReadOnly(QJSValue, read="_get_terminal")
    expired = ReadOnly(bool, False)

    _comm = _Comm.WAITING_FOR_GOAL_ACK
    _expired: bool
    #: Whether the robot reports the states itself, as in ROS 1.
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

    @Slot(result=QJSValue)
    def getResult(self) -> QJSValue:
        """Return the result; undefined while there is none."""
        return self.result

    @Slot()
    def cancel(self) -> None:
        """Ask the server to cancel the goal."""
        super().cancel()
        # Change the state immediately, like actionlib; the robot reports the next ones.
        if self.sent and not self._over:
            self._go(_Comm.WAITING_FOR_CANCEL_ACK)

    @Slot()
    def resend(self) -> None:
        """Send the goal again, for servers that may have missed it; supported by ROS 1 only."""
        send: Any = getattr(self._goal, "resend", None)
        if self.expired:
            self._warn("resend", "it has expired: its client is gone")
        elif send is None:
            self._warn("resend", "ROS 2 sends goals reliably, and once")
        else:
            try:
                send()
            except Error as error:
                self._warn("resend", str(error))

    def expire(self, reason: str) -> None:
        """End the goal because its client no longer exists."""
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
            watch(weak_callback(self._on_comm_state), executor)
            self._on_comm_state(goal.comm_state)  # type: ignore[attr-defined]

    def _on_comm_state(self, state: Any) -> None:
        # The result arrives after the terminal state, and is available once the state is DONE.
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
            self._callbacks.transition(js or self.js)


#: Milliseconds after which a cancel request without effect is reported.
_REMINDER = 5000
#: Released when JavaScript collects a handle: PySide 6.11 never frees the Python half.
_SERVER_HELD = ("_goal", "_forget", "_type", "_asked")


class ServerGoalHandle(QtCore.QObject):
    """An accepted goal of a server; the same object everywhere in JavaScript.

    Args:
        runtime: The engine's runtime.
        goal: The goal.
        type: The action's type.
        dialect: The module whose format its values have.
        forget: Called when the goal has ended.
    """

    #: The status changed to the argument.
    statusChanged = Signal(int)
    cancelRequestedChanged = Signal()
    #: A request to cancel the goal was accepted.
    cancelRequested = Signal()
    #: The goal has ended.
    terminated = Signal()

    status = ReadOnly(int, read=lambda self: int(status_code(self._goal.status)))
    isActive = ReadOnly(bool, read=lambda self: self._goal.status.is_active, notify="statusChanged")
    isExecuting = ReadOnly(
        bool,
        read=lambda self: self._goal.status is GoalStatus.EXECUTING,
        notify="statusChanged",
    )
    isCanceling = ReadOnly(
        bool,
        read=lambda self: self._goal.status is GoalStatus.CANCELING,
        notify="statusChanged",
    )
    goalId = Property(str, lambda self: self._goal.id_text, constant=True)
    goalStamp = Property(
        QJSValue, lambda self: self._runtime.time(self._goal.accepted, self._dialect), constant=True
    )
    isCancelRequested = ReadOnly(bool, read="_is_requested", notify="cancelRequestedChanged")

    def __init__(
        self,
        runtime: Runtime,
        goal: ServerGoal,
        type: ActionType,
        dialect: Dialect,
        forget: Callable[[ServerGoalHandle], None],
        tolerant: bool = False,
    ) -> None:
        super().__init__()
        self._runtime, self._goal, self._type, self._dialect = runtime, goal, type, dialect
        self._tolerant = tolerant
        self._forget, self._status, self._requested = forget, goal.status, False
        self._asked: QJSValue | None = None
        self._abandoned = self._over = False
        self._caller = runtime.caller()
        #: The node waits for this: the fields of the result, or None for an empty result.
        self.ended: Future[Any] = Future()
        engine = runtime.engine
        #: Keeps JavaScript from collecting it before the goal has ended.
        self.js: QJSValue = QJSValue() if engine is None else engine.newQObject(runtime.keep(self))
        self._id, state = goal.id_text, self.__dict__
        self.destroyed.connect(
            lambda: None if goal.status.is_active else let_go(state, _SERVER_HELD)
        )
        refresh = weak_callback(self.refresh)
        goal.cancel_request.on_done(lambda _: refresh(), runtime.session.executor)

    # For QML.

    def _get_goal(self) -> QJSValue:
        if self._asked is None:
            self._asked = self._runtime.message(self._goal.goal, self._dialect)
        return self._asked

    goal = Property(QJSValue, _get_goal, constant=True)

    def _is_requested(self) -> bool:
        live = self._goal.status.is_active and self._goal.is_cancel_requested
        return self._requested or live

    @Slot(QJSValue)
    def publishFeedback(self, feedback: QJSValue) -> None:
        """Send feedback; throws if the value is invalid or the goal has ended."""
        self._do("publishFeedback", self._goal.publish_feedback, self._type.feedback, feedback)

    @Slot()
    @Slot(QJSValue)
    def succeed(self, result: QJSValue | None = None) -> None:
        """End the goal as succeeded; throws if the result is invalid or the goal has ended."""
        self._do("succeed", self._goal.succeed, self._type.result, result)

    @Slot()
    @Slot(QJSValue)
    def abort(self, result: QJSValue | None = None) -> None:
        """End the goal as aborted; throws like :meth:`succeed`."""
        self._do("abort", self._goal.abort, self._type.result, result)

    @Slot()
    @Slot(QJSValue)
    def canceled(self, result: QJSValue | None = None) -> None:
        """End the goal as cancelled; throws like :meth:`succeed`, and without a cancel request."""
        self._do("canceled", self._goal.canceled, self._type.result, result)

    def _do(self, what: str, do: Callable[[Any], None], kind: Any, value: QJSValue | None) -> None:
        try:
            do(given_fields(QJSValue() if value is None else value, kind, self._dialect))
        except Error as error:
            text = f"{what} of {self._label}: {error}"
            if not self._tolerant:
                self._runtime.throw(text)
            elif isinstance(error, ConversionError) and kind is self._type.result:
                self._log(f"{text}; the goal is aborted", logging.ERROR)
                self.fail(error)
            else:
                self._log(text, logging.WARNING)
        self.refresh()

    def _log(self, text: str, level: int) -> None:
        log_from_qml("", level, text, self._runtime.caller())

    # For its server.

    def take(self, answer: QJSValue) -> Any:
        """Return the result's fields from JavaScript; None for undefined.

        Raises:
            ConversionError: It does not fit.
        """
        if answer.isUndefined() or answer.isNull():
            return None
        return given_fields(answer, self._type.result, self._dialect)

    def settle(self, answer: Future[Any]) -> None:
        """End the goal with the outcome of a promise."""
        error = answer.exception(0)
        if error is not None:
            self.fail(error)
        else:
            self.finish(answer.result(0))

    def finish(self, result: Any) -> None:
        """End the goal with its result: succeeded, or canceled if that was requested."""
        if not self.ended.done():
            self.ended.set_result(result)
        elif result is not None and not self._abandoned:
            text = f"{self._label} has ended already; what execute returned is dropped"
            log_from_qml("", logging.WARNING, text, self._caller)
        self.refresh()

    def fail(self, error: BaseException) -> None:
        """End the goal as aborted."""
        if not self.ended.done() and not self._abandoned:
            self.ended.set_exception(error)
        self.refresh()

    def abandon(self) -> None:
        """Handle that its server is about to close, which aborts the goal."""
        self._abandoned = True

    def refresh(self) -> None:
        """Emit the signals of everything that has changed."""
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
                let_go(self.__dict__, _SERVER_HELD)
            return
        if requested and not self._requested:
            self._requested = True
            self.cancelRequestedChanged.emit()
            QtCore.QTimer.singleShot(_REMINDER, self._remind)
        canceling = status is GoalStatus.CANCELING and self._status is not GoalStatus.CANCELING
        self._set_status(self._goal.status)
        # Unless a handler has ended it.
        if canceling and is_alive(self) and self.isCanceling:
            self.cancelRequested.emit()
        if not status.is_active:
            ended, self._over = not self._over, True
            if ended and is_alive(self):
                self.terminated.emit()
            self.js = QJSValue()

    @Slot()
    def _remind(self) -> None:
        if is_alive(self) and self._goal.status.is_active and not self._abandoned:
            text = (
                f"{self._label} was asked to be cancelled {_REMINDER / 1000:g} s ago, and runs on: "
                "when isCancelRequested becomes true, end it with canceled()"
            )
            log_from_qml("", logging.WARNING, text, self._caller)

    def _set_status(self, status: GoalStatus) -> None:
        if status is not self._status:
            self._status = status
            self.statusChanged.emit(int(status_code(status)))

    @property
    def _label(self) -> str:
        return f"goal {self._id}"
