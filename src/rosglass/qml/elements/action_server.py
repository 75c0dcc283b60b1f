"""``ActionServer``: offers an action whose goals JavaScript functions execute."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import re
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from rosglass.comm.action_server import TakesGoal
from rosglass.errors import Error
from rosglass.qml.elements.element import Element
from rosglass.qml.elements.goal_handle import ServerGoalHandle
from rosglass.qml.elements.singleton import full_type
from rosglass.qml.engine.callbacks import Answers, call_back
from rosglass.qml.engine.dialect import Dialect
from rosglass.qml.engine.js_values import properties_of
from rosglass.qml.engine.properties import ReadOnly, Writable, function, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QJSValue, QtCore, Signal, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.action_server import ActionServer as Server
    from rosglass.comm.action_server import ServerGoal
    from rosglass.comm.node import Node
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["ActionServer", "RosActionServer", "action_type", "server_functions"]

_log = logging.getLogger("rosglass.qml")
#: An action type in ROS 1 spelling.
_ROS1_TYPE = re.compile(r"([A-Za-z]\w*)/([A-Za-z]\w*)Action\Z")
_GONE = "the interface that offered this action is gone"


class _Goals:
    """The goals of one server, for the lifetime of the server.

    Args:
        answers: Calls the JavaScript functions.
    """

    def __init__(self, answers: Answers) -> None:
        self.answers = answers
        #: Identifies this object in the node's callbacks.
        self.key = object()
        #: Goals that arrived before the worker thread had returned the server.
        self.early: list[Callable[[Server], object]] = []
        self.handles: dict[bytes, ServerGoalHandle] = {}

    def close(self) -> None:
        """Stop waiting for JavaScript's answers."""
        for handle in self.handles.values():
            handle.abandon()
        self.answers.give_up()


class ActionServer(Element):
    """Offers an action while it is enabled. See its page in ``docs/elements``.

    Goals are executed by the function ``execute``; without it, by what is connected to the signal
    ``goalAccepted``, as in qml6_ros2_plugin, of which it has all members.
    """

    typeChanged = Signal()
    advertisedChanged = Signal()
    #: A goal was accepted; the argument is its handle.
    goalAccepted = Signal(QJSValue, arguments=["handle"])

    name = Writable(str, "")
    actionType = Writable(str, "")
    type = Writable(str, read=lambda self: self.actionType, write="_set_type")
    accept = Writable(QJSValue, accept=function, then="")
    handleGoal = Writable(QJSValue, accept=function, then="")
    execute = Writable(QJSValue, accept=function)
    cancel = Writable(QJSValue, accept=function, then="")
    handleCancel = Writable(QJSValue, accept=function, then="")
    enabled = Writable(bool, True)
    ready = ReadOnly(bool, False)
    advertised = ReadOnly(bool, read=lambda self: self.ready)
    activeGoals = ReadOnly(int, 0)

    _HOLDS = ("_accept", "_handleGoal", "_execute", "_cancel", "_handleCancel", "_goals")
    _endpoint: Server | None
    _goals: _Goals | None = None
    #: Whether QML has set ``type``, so that the action is offered without ``execute``.
    _by_signal = False

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self.actionTypeChanged.connect(self.typeChanged)  # type: ignore[attr-defined]
        self.readyChanged.connect(self.advertisedChanged)  # type: ignore[attr-defined]

    def configure(self, name: str, type_name: str, functions: dict[str, QJSValue]) -> None:
        """Set the arguments of ``Ros2.createActionServer``."""
        self.name, self.actionType = name, type_name
        for what, given in functions.items():
            setattr(self, what, given)

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"action {self.name}"

    def _set_type(self, name: str) -> None:
        self._by_signal = True
        self.actionType = name
        self._schedule()

    def _has_listeners(self) -> bool:
        """Return whether goalAccepted is connected."""
        meta = self.metaObject()
        return self.isSignalConnected(meta.method(meta.indexOfSignal("goalAccepted(QJSValue)")))

    def _full_type(self) -> str:
        return full_type(self.actionType, "action")

    def _wanted(self) -> tuple[Node, str, str] | None:
        node = self.node
        executes = self.execute.isCallable() or self._by_signal or self._has_listeners()
        complete = self.name and self.actionType and executes
        if node is None or not (self.enabled and complete):
            return None
        return node, self.name, self._full_type()

    def _factory(self, node: Node, name: str, type_name: str) -> Callable[[], Server]:
        runtime, executor = self._find_runtime(), self._executor
        assert runtime is not None
        goals = self._goals = _Goals(Answers(runtime, f"execute of {self.label}"))
        self._cleanup["goals"] = goals.close
        # The node holds only the key, not the goals: JavaScript has their handles.
        key = goals.key
        on_goal, accepts = (
            weak_callback(self._on_goal, Error(_GONE)),
            weak_callback(self._accepts, False),
        )
        allows = weak_callback(self._allows, True)
        return lambda: node.create_action_server(
            name,
            type_name,
            lambda goal: on_goal(key, goal),
            accept=TakesGoal(lambda goal: accepts(key, goal)),
            cancel=lambda goal: allows(key, goal),
            executor=executor,
        )

    def _on_created(self, endpoint: Server) -> None:
        self._set_problem(endpoint.problem)
        goals = self._goals
        if report(self, ready=True) and goals is not None:
            early, goals.early = goals.early, []
            for begin in early:
                begin(endpoint)

    def _on_closed(self, endpoint: Server | None) -> None:  # noqa: ARG002 - the base's signature
        goals, self._goals = self._goals, None
        self._cleanup.pop("goals", None)
        if goals is not None:
            goals.close()
        report(self, ready=False, activeGoals=0)

    # The node's requests, on the GUI thread.

    def _goals_of(self, key: object) -> _Goals | None:
        """Return the goals of the current server; None if the key is an earlier server's."""
        goals = self._goals if is_alive(self) else None
        return goals if goals is not None and goals.key is key else None

    def _accepts(self, key: object, goal: ServerGoal) -> bool:
        runtime = self._runtime
        if self._goals_of(key) is None or runtime is None:
            return False
        message = runtime.message(goal.goal, self.DIALECT)
        if not self.accept.isCallable():
            if not self.handleGoal.isCallable():
                return True
            return call_back(runtime, self.handleGoal, message, QJSValue(goal.id_text)).toBool()
        answer = call_back(runtime, self.accept, message)
        if not answer.isBool():
            _log.error("accept of %s returned neither true nor false: rejecting", self.label)
        return answer.isBool() and answer.toBool()

    def _allows(self, key: object, goal: ServerGoal) -> bool:
        runtime, goals = self._runtime, self._goals_of(key)
        handle = goals.handles.get(goal.id) if goals is not None else None
        if not (self.execute.isCallable() or self.cancel.isCallable()):
            # As in qml6_ros2_plugin: a goal that no handler can end is not cancelled.
            if runtime is None or handle is None or not handle.isActive:
                return False
            return call_back(runtime, self.handleCancel, handle.js).toBool()
        if runtime is None or handle is None:
            return True
        decide = self.cancel if self.cancel.isCallable() else self.handleCancel
        answer = call_back(runtime, decide, handle.js)
        return not answer.isBool() or answer.toBool()

    def _on_goal(self, key: object, goal: ServerGoal) -> Any:
        goals = self._goals_of(key)
        if goals is None:
            raise Error(_GONE)
        if self._endpoint is not None:
            return self._begin(goals, self._endpoint, goal)
        # A waiting client sent a goal before the worker thread had returned the server.
        ended: Future[Any] = Future()
        goals.early.append(lambda server: self._begin(goals, server, goal, ended))
        return ended

    def _begin(
        self, goals: _Goals, server: Server, goal: ServerGoal, ended: Future[Any] | None = None
    ) -> Future[Any]:
        runtime = self._runtime
        assert runtime is not None

        def forget(handle: ServerGoalHandle) -> None:
            if goals.handles.pop(goal.id, None) is handle and is_alive(self):
                report(self, activeGoals=len(goals.handles))

        by_signal = not self.execute.isCallable()
        handle = ServerGoalHandle(runtime, goal, server.type, self.DIALECT, forget, by_signal)
        if ended is not None:
            handle.ended = ended
        goals.handles[goal.id] = handle
        report(self, activeGoals=len(goals.handles))
        arguments = [runtime.message(goal.goal, self.DIALECT), handle.js]
        waiting = handle.ended
        thrown = runtime.errors_of(lambda: self.goalAccepted.emit(handle.js))
        if by_signal:
            if not thrown and not self._has_listeners():
                thrown = ["there is no function execute, and goalAccepted is not connected"]
            if thrown and is_alive(self):
                handle.fail(Error(f"{self.label}: {thrown[0]}"))
            return waiting
        try:
            answer = goals.answers.ask(self.execute, arguments, handle.take)
        except Error as error:
            handle.fail(error)
            return waiting
        if isinstance(answer, Future):
            answer.add_done_callback(handle.settle)
        elif answer is not None:
            handle.finish(answer)
        return waiting


def server_functions(given: QJSValue) -> dict[str, QJSValue]:
    """Return the functions passed to ``createActionServer``, by name.

    Args:
        given: ``execute``, or an object with ``execute`` and optionally ``accept`` and ``cancel``.

    Raises:
        Error: It is neither.
    """
    if given.isCallable():
        return {"execute": given}
    found = properties_of(given) if given.isObject() else []
    functions = {name: given.property(name) for name in found}
    unknown = [name for name in functions if name not in ("accept", "execute", "cancel")]
    if unknown:
        raise Error(f"there is no function {unknown[0]}; there are accept, execute, cancel")
    if "execute" not in functions:
        raise Error("give a function that executes goals, or an object with execute")
    for name, value in functions.items():
        if not value.isCallable():
            raise Error(f"{name} is not a function")
    return functions


def action_type(name: str) -> str:
    """Return ``pkg/action/Do`` for ``pkg/DoAction`` (ROS 1) and for ``pkg/Do``."""
    match = _ROS1_TYPE.match(name)
    return full_type(f"{match[1]}/{match[2]}" if match else name, "action")


class RosActionServer(ActionServer):
    """Offers an action in the style of ``Ros 1.0``, with types such as ``pkg/DoAction``."""

    DIALECT = Dialect.ROS1

    def _full_type(self) -> str:
        return action_type(self.actionType)
