"""``ActionServer``: offers an action whose goals JavaScript functions execute."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
import re
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error
from rosglass.qml.callbacks import Answers, call_back, weak_callback
from rosglass.qml.dialect import Dialect
from rosglass.qml.element import Element
from rosglass.qml.goal_handle import ServerGoalHandle
from rosglass.qml.js_values import properties_of
from rosglass.qml.properties import ReadOnly, Writable, function, report
from rosglass.qml.singleton import full_type
from rosglass.qt import QJSValue, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.action_server import ActionServer as Server
    from rosglass.comm.action_server import ServerGoal
    from rosglass.comm.node import Node
    from rosglass.messages import Message

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
    """Offers an action while it is enabled. See its page in ``docs/elements``."""

    name = Writable(str, "")
    actionType = Writable(str, "")
    accept = Writable(QJSValue, accept=function, then="")
    execute = Writable(QJSValue, accept=function)
    cancel = Writable(QJSValue, accept=function, then="")
    enabled = Writable(bool, True)
    ready = ReadOnly(bool, False)
    activeGoals = ReadOnly(int, 0)

    _HOLDS = ("_accept", "_execute", "_cancel", "_goals")
    _endpoint: Server | None
    _goals: _Goals | None = None

    def configure(self, name: str, type_name: str, functions: dict[str, QJSValue]) -> None:
        """Set the arguments of ``Ros2.createActionServer``."""
        self.name, self.actionType = name, type_name
        for what, given in functions.items():
            setattr(self, what, given)

    @property
    def label(self) -> str:
        """The element's name in error messages."""
        return f"action {self.name}"

    def _full_type(self) -> str:
        return full_type(self.actionType, "action")

    def _wanted(self) -> tuple[Node, str, str] | None:
        node = self.node
        complete = self.name and self.actionType and self.execute.isCallable()
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
            accept=lambda goal: accepts(key, goal),
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

    def _accepts(self, key: object, goal: Message) -> bool:
        runtime = self._runtime
        if self._goals_of(key) is None or runtime is None:
            return False
        if not self.accept.isCallable():
            return True
        answer = call_back(runtime, self.accept, runtime.message(goal, self.DIALECT))
        if not answer.isBool():
            _log.error("accept of %s returned neither true nor false: rejecting", self.label)
        return answer.isBool() and answer.toBool()

    def _allows(self, key: object, goal: ServerGoal) -> bool:
        runtime, goals = self._runtime, self._goals_of(key)
        handle = goals.handles.get(goal.id) if goals is not None else None
        if runtime is None or handle is None:
            return True
        answer = call_back(runtime, self.cancel, handle.js)
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

        handle = ServerGoalHandle(runtime, goal, server.type, self.DIALECT, forget)
        if ended is not None:
            handle.ended = ended
        goals.handles[goal.id] = handle
        report(self, activeGoals=len(goals.handles))
        arguments = [runtime.message(goal.goal, self.DIALECT), handle.js]
        waiting = handle.ended
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
