"""Action clients of ``Ros 1.0`` and ``Ros2 1.0``, and the code that they share."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, ClassVar

from rosglass.comm.action_client import GoalStatus
from rosglass.errors import Error, NodeClosedError
from rosglass.qml.elements.action_server import action_type
from rosglass.qml.elements.element import CONNECTION_TIMEOUT_MS, ClientElement
from rosglass.qml.elements.goal_handle import (
    GoalCallbacks,
    GoalHandle,
    RosGoalHandle,
    report_cancelling,
)
from rosglass.qml.engine.callbacks import Deferred, call_back
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.js_values import null, properties_of, time_from_js
from rosglass.qml.engine.log import log_from_qml
from rosglass.qml.engine.properties import ReadOnly, Writable, at_least, report
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.action_client import ActionClient as Sender
    from rosglass.comm.action_client import CancelAnswer
    from rosglass.comm.node import Node
    from rosglass.comm.promise import Promise
    from rosglass.qml.engine.runtime import Runtime


__all__ = ["ActionClient", "GoalSender", "RosActionClient"]

_CLOSED = "its client was closed before it ended; its outcome is unknown"
_CALLBACKS = ("onGoalResponse", "onFeedback", "onResult")


class GoalSender(ClientElement):
    """Sends goals; stays alive until they have ended, even if JavaScript drops it.

    Args:
        runtime: The engine's runtime.
        name: Action name, as in QML.
        type_name: Action type; empty uses the server's.
    """

    #: A request to cancel all goals, or those up to a time, failed for this reason.
    cancelFailed = Signal(str)

    _HANDLE: ClassVar[type[GoalHandle]] = GoalHandle
    _endpoint: Sender | None
    #: Milliseconds that goals wait for a server.
    _timeout_ms = CONNECTION_TIMEOUT_MS

    def __init__(self, runtime: Runtime, name: str, type_name: str) -> None:
        super().__init__(runtime, name, type_name, self.DIALECT)
        self._goals: list[GoalHandle] = []
        #: Keeps JavaScript from collecting the client while goals run.
        self._held = QJSValue()
        goals, executor = self._goals, runtime.session.executor
        self._cleanup["goals"] = lambda: executor.post(lambda: _end_all(goals, _CLOSED))

    @Slot()
    def cancelAllGoals(self) -> None:
        """Ask the server to cancel all its goals, including those of other clients."""
        for handle in list(self._goals):
            if not handle.sent:
                handle.cancel()
        self._ask_cancel(lambda client: client.cancel_all())

    def _cancel_until(self, value: QJSValue) -> None:
        """Ask the server to cancel the goals that it accepted at or before a time."""
        try:
            time = time_from_js(value)
            self._ask_cancel(lambda client: client.cancel_before(time))
        except Error as error:
            self._throw(error)

    def _ask_cancel(self, ask: Callable[[Sender], Promise[CancelAnswer]]) -> None:
        runtime, client, session = self._runtime, self._endpoint, self._session
        assert runtime is not None
        caller, what = runtime.caller(), f"what {self._name} does"

        def answered(answer: Promise[CancelAnswer]) -> None:
            if is_alive(self):
                reason = report_cancelling(answer, what, caller, logging.INFO)
                if reason:
                    self.cancelFailed.emit(reason)

        try:
            if client is None or session is None:
                raise NodeClosedError("there is no connection with the robot")
            ask(client).on_done(answered, session.executor)
        except NodeClosedError as error:
            log_from_qml("", logging.ERROR, f"{what} could not be cancelled: {error}", caller)
            self.cancelFailed.emit(str(error))

    # Sending.

    def _send(self, goal: QJSValue | None, callbacks: GoalCallbacks) -> QJSValue:
        """Send a goal as soon as a server appears; an invalid goal throws into JavaScript.

        Returns:
            The handle; undefined after an exception.
        """
        runtime = self._runtime
        assert runtime is not None
        handle = self._HANDLE(
            runtime,
            self._name,
            QJSValue() if goal is None else goal,
            callbacks,
            self._dialect,
            self._timeout_ms,
            self._forget,
        )
        js = handle.js
        self._goals.append(handle)
        if self._endpoint is not None and self._endpoint.type is not None:
            try:
                self._start(handle, self._endpoint)
            except Error as error:
                self._forget(handle)
                handle.js = QJSValue()
                self._throw(error)
                return QJSValue()
        elif self._timeout_ms:
            QtCore.QTimer.singleShot(self._timeout_ms, lambda: self._give_up(handle))
        if self._held.isUndefined() and runtime.engine is not None:
            self._held = runtime.engine.newQObject(self)
        return js

    def _start(self, handle: GoalHandle, client: Sender) -> None:
        assert self._session is not None
        handle.start(client, self._session.executor)

    def _submit_waiting(self) -> None:
        client = self._endpoint
        if client is None or client.type is None:
            return
        for handle in list(self._goals):
            if handle in self._goals and not handle.sent:
                try:
                    self._start(handle, client)
                except Error as error:
                    handle.end(GoalStatus.REJECTED, None, str(error))

    def _give_up(self, handle: GoalHandle) -> None:
        """End a goal that still has no client or no type."""
        if is_alive(self) and handle in self._goals and not handle.sent:
            why = self._problem or self._missing()
            seconds = (self._timeout_ms or 0) / 1000
            reason = f"no goal could be sent to {self._name} within {seconds:g} s: {why}"
            handle.end(GoalStatus.LOST, None, reason)

    def _missing(self) -> str:
        client = self._endpoint
        if client is None:
            return "there is no connection with the robot"
        return client.problem or "is its server running, and its name right?"

    def _forget(self, handle: GoalHandle) -> None:
        """Drop a goal that has ended."""
        if handle in self._goals:
            self._goals.remove(handle)
        if not self._goals:
            self._held = QJSValue()

    def _throw(self, error: Error) -> None:
        if self._runtime is not None:
            self._runtime.throw(self._dialect.spelled(f"action {self._name}: {error}"))

    def _check_functions(self, functions: dict[str, QJSValue | None]) -> bool:
        """Return whether each is a function or was omitted; otherwise throw into JavaScript."""
        for what, value in functions.items():
            if value is None or value.isCallable() or value.isUndefined() or value.isNull():
                continue
            self._throw(Error(f"{what} is not a function"))
            return False
        return True

    # The client.

    def _factory(self, node: Node) -> Callable[[], Sender]:
        return lambda: node.create_action_client(self._name, self._type or None)

    def _fail_all(self, error: Error) -> None:
        _end_all(self._goals, str(error))


def _end_all(goals: list[GoalHandle], reason: str) -> None:
    for handle in list(goals):
        if is_alive(handle):
            handle.expire(reason)


class ActionClient(GoalSender):
    """The action client that ``Ros2.createActionClient`` returns."""

    ready = ReadOnly(bool, False, notify="serverReadyChanged")
    name = Property(str, lambda self: self._name, constant=True)
    type = Property(str, lambda self: self._type, constant=True)
    actionType = Property(str, lambda self: self._type, constant=True)
    connectionTimeout = Writable(
        int, CONNECTION_TIMEOUT_MS, at_least(0), then="_on_timeout_changed", unit="ms"
    )

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"action {self._name}"

    def _on_timeout_changed(self) -> None:
        self._timeout_ms = self.connectionTimeout

    @Slot(result=bool)
    def isServerReady(self) -> bool:
        """Return whether a server is available."""
        return self.ready

    @Slot(QJSValue, result=QJSValue)
    @Slot(QJSValue, QJSValue, result=QJSValue)
    def sendGoalAsync(self, goal: QJSValue, options: QJSValue | None = None) -> QJSValue:
        """Send a goal and return its handle; an invalid goal throws.

        Args:
            goal: An object with the goal's fields.
            options: Functions ``onGoalResponse(handle)``, called with null if the server rejects
                the goal, ``onFeedback(handle, feedback)`` and ``onResult({goalId, code, result})``.
        """
        runtime = self._runtime
        assert runtime is not None
        given: dict[str, QJSValue] = {}
        if options is not None and options.isObject():
            given = {name: options.property(name) for name in properties_of(options)}
        elif options is not None and not (options.isUndefined() or options.isNull()):
            self._throw(Error(f"the second argument must be an object of {', '.join(_CALLBACKS)}"))
            return QJSValue()
        unknown = [name for name in given if name not in _CALLBACKS]
        if unknown:
            known = ", ".join(_CALLBACKS)
            self._throw(Error(f"there is no callback {unknown[0]}; there are {known}"))
            return QJSValue()
        if not self._check_functions(dict(given)):
            return QJSValue()
        response, feedback, result = (given.get(name, QJSValue()) for name in _CALLBACKS)
        js = QJSValue()

        def respond(accepted: bool) -> None:
            call_back(runtime, response, js if accepted else null())

        js = self._send(
            goal,
            GoalCallbacks(
                response=respond,
                feedback=lambda message: call_back(runtime, feedback, js, message),
                result=lambda handle: call_back(runtime, result, handle.outcome()),
            ),
        )
        return js

    @Slot(result=QJSValue)
    @Slot(QJSValue, result=QJSValue)
    def sendGoal(self, goal: QJSValue | None = None) -> QJSValue:
        """Send a goal and return a promise of ``{goalId, code, result}``.

        The promise is rejected if there is no result: the server rejected the goal, or disappeared.
        """
        runtime = self._runtime
        assert runtime is not None
        deferred = Deferred(runtime, f"action {self._name}")

        def ended(handle: GoalHandle) -> None:
            if handle.failure:
                deferred.reject(handle.failure)
            else:
                deferred.resolve(handle.outcome())

        sent = self._send(goal, GoalCallbacks(result=ended, handles_failure=True))
        return QJSValue() if sent.isUndefined() else deferred.promise

    @Slot(QJSValue)
    def cancelGoalsBefore(self, time: QJSValue) -> None:
        """Ask the server to cancel the goals that it accepted at or before a time, or Date."""
        self._cancel_until(time)


class RosActionClient(GoalSender):
    """Sends goals while a server is connected.

    Args:
        runtime: The engine's runtime.
        name: Action name, as in QML.
        type_name: Action type in ROS 1 spelling, ``pkg/DoAction``.
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
        """Return whether a server is available."""
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
            goal: An object with the goal's fields; an invalid one throws.
            transition: Called with the handle after each change of its ``commState``.
            feedback: Called with the handle and the feedback, for each feedback message.
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
