"""``ActionServer``: offers an action whose goals JavaScript functions execute."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import logging
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any

from rosglass.errors import Error, TypeNotFoundError
from rosglass.qml.answering import Answers
from rosglass.qml.callbacks import call_back
from rosglass.qml.element import RETRY, Element
from rosglass.qml.js_values import properties_of
from rosglass.qml.singleton import full_type
from rosglass.qt import Property, QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm.action_server import ActionServer as Server
    from rosglass.comm.action_server import ServerGoal
    from rosglass.comm.node import Node
    from rosglass.messages import Message
    from rosglass.qml.runtime import Runtime
    from rosglass.qml.server_goal import ServerGoalHandle

__all__ = ["ActionServer", "server_functions"]

_log = logging.getLogger("rosglass.qml")
_GONE = "the interface that offered this action is gone"


class _Offer:
    """What is offered under one name while there is one node.

    Args:
        want: Node, name and full type.
        answers: Asks the functions.
    """

    def __init__(self, want: tuple[Node, str, str], answers: Answers) -> None:
        self.want, self.answers = want, answers
        self.server: Server | None = None
        #: What came before the server was there.
        self.early: list[Callable[[], None]] = []
        self.handles: dict[bytes, ServerGoalHandle] = {}

    def close(self) -> None:
        """End the waiting for answers; the server itself is closed elsewhere."""
        for handle in self.handles.values():
            handle.abandon()
        self.answers.give_up()


class ActionServer(Element):
    """Offers an action while it is enabled. See its page in ``docs/elements``."""

    nameChanged = Signal()
    actionTypeChanged = Signal()
    acceptChanged = Signal()
    executeChanged = Signal()
    cancelChanged = Signal()
    enabledChanged = Signal()
    readyChanged = Signal()
    activeGoalsChanged = Signal()
    problemChanged = Signal()

    _HOLDS = ("_accept", "_execute", "_cancel", "_offer")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._name, self._type = "", ""
        self._accept, self._execute, self._cancel = QJSValue(), QJSValue(), QJSValue()
        self._enabled = True
        self._offer: _Offer | None = None
        self._retry = QtCore.QTimer(self)
        self._retry.setSingleShot(True)
        self._retry.timeout.connect(self._serve)

    def configure(self, name: str, type_name: str, functions: dict[str, QJSValue]) -> None:
        """Set what ``Ros2.createActionServer`` was given."""
        self._name, self._type = name, type_name
        self._accept = functions.get("accept", QJSValue())
        self._execute = functions["execute"]
        self._cancel = functions.get("cancel", QJSValue())

    # Properties.

    def _set_name(self, name: str) -> None:
        if name != self._name:
            self._name = name
            self.nameChanged.emit()
            self._schedule()

    def _set_type(self, name: str) -> None:
        if name != self._type:
            self._type = name
            self.actionTypeChanged.emit()
            self._schedule()

    def _set_enabled(self, enabled: bool) -> None:
        if enabled != self._enabled:
            self._enabled = enabled
            self.enabledChanged.emit()
            self._schedule()

    def _set_accept(self, function: QJSValue) -> None:
        if self._is_function("accept", function):
            self._accept = function
            self.acceptChanged.emit()

    def _set_execute(self, function: QJSValue) -> None:
        if self._is_function("execute", function):
            self._execute = function
            self.executeChanged.emit()
            self._schedule()

    def _set_cancel(self, function: QJSValue) -> None:
        if self._is_function("cancel", function):
            self._cancel = function
            self.cancelChanged.emit()

    def _is_function(self, what: str, value: QJSValue) -> bool:
        if value.isCallable() or value.isNull() or value.isUndefined():
            return True
        self._refuse(f"ActionServer {self._name!r}: {what} is not a function")
        return False

    def _count(self) -> int:
        return len(self._offer.handles) if self._offer is not None else 0

    name = Property(str, lambda self: self._name, _set_name, notify=nameChanged)
    actionType = Property(str, lambda self: self._type, _set_type, notify=actionTypeChanged)
    accept = Property(QJSValue, lambda self: self._accept, _set_accept, notify=acceptChanged)
    execute = Property(QJSValue, lambda self: self._execute, _set_execute, notify=executeChanged)
    cancel = Property(QJSValue, lambda self: self._cancel, _set_cancel, notify=cancelChanged)
    enabled = Property(bool, lambda self: self._enabled, _set_enabled, notify=enabledChanged)
    ready = Property(bool, lambda self: self._is_ready(), notify=readyChanged)
    activeGoals = Property(int, _count, notify=activeGoalsChanged)
    problem = Property(str, lambda self: self._problem, notify=problemChanged)

    def _is_ready(self) -> bool:
        return self._offer is not None and self._offer.server is not None

    # Serving.

    def _full_type(self) -> str:
        return full_type(self._type, "action")

    def _update(self) -> None:
        node = self.node
        want = None
        complete = self._name and self._type and self._execute.isCallable()
        if node is not None and self._enabled and complete:
            want = (node, self._name, self._full_type())
        if want != (self._offer.want if self._offer is not None else None):
            self._withdraw()
            runtime = self._runtime
            if want is not None and runtime is not None:
                answers = Answers(runtime, f"execute of action {self._name}")
                self._offer = _Offer(want, answers)
                self._at_end["offer"] = self._offer.close
            self._serve()

    @Slot()
    def _serve(self) -> None:
        session, offer = self._session, self._offer
        if session is None or offer is None or offer.server is not None:
            return
        node, name, type_name = offer.want

        def done(result: Server | Error) -> None:
            if isinstance(result, Error):
                self._say(f"action {name}: {result}")
                if isinstance(result, TypeNotFoundError):
                    self._retry.start(RETRY)
            else:
                offer.server = result
                self._at_end["server"] = lambda: session.background(result.close)
                self._say(result.problem)
                self.readyChanged.emit()
                early, offer.early = offer.early, []
                for job in early:
                    job()

        self._make(
            lambda: node.create_action_server(
                name,
                type_name,
                lambda goal: self._on_goal(offer, goal),
                accept=lambda goal: self._accepts(offer, goal),
                cancel=lambda goal: self._allows(offer, goal),
                executor=session.executor,
            ),
            lambda: self._offer is offer,
            done,
        )

    def _withdraw(self) -> None:
        self._retry.stop()
        offer, self._offer = self._offer, None
        self._at_end.pop("server", None)
        self._at_end.pop("offer", None)
        if offer is None:
            return
        offer.close()
        if offer.server is not None and self._session is not None:
            self._session.background(offer.server.close)
            self.readyChanged.emit()
        self.activeGoalsChanged.emit()

    # What the node asks, on the GUI thread.

    def _accepts(self, offer: _Offer, goal: Message) -> bool:
        runtime = self._runtime
        if not is_alive(self) or self._offer is not offer or runtime is None:
            return False
        if not self._accept.isCallable():
            return True
        answer = call_back(runtime, self._accept, runtime.message(goal, self.DIALECT))
        if not answer.isBool():
            _log.error("accept of action %s did not say true or false: rejecting", self._name)
        return answer.isBool() and answer.toBool()

    def _allows(self, offer: _Offer, goal: ServerGoal) -> bool:
        runtime = self._runtime
        handle = offer.handles.get(goal.id)
        if not is_alive(self) or runtime is None or handle is None:
            return True
        answer = call_back(runtime, self._cancel, handle.js)
        return not answer.isBool() or answer.toBool()

    def _on_goal(self, offer: _Offer, goal: ServerGoal) -> Any:
        if not is_alive(self) or self._offer is not offer:
            raise Error(_GONE)
        if offer.server is not None:
            return self._begin(offer, offer.server, goal)
        # Somebody waited for the action, and was quicker than the news that it is offered.
        ended: Future[Any] = Future()

        def begin() -> None:
            assert offer.server is not None
            self._begin(offer, offer.server, goal, ended)

        offer.early.append(begin)
        return ended

    def _begin(
        self, offer: _Offer, server: Server, goal: ServerGoal, ended: Future[Any] | None = None
    ) -> Future[Any]:
        runtime = self._runtime
        assert runtime is not None

        from rosglass.qml.server_goal import ServerGoalHandle  # noqa: PLC0415 - few have actions

        def forget(handle: ServerGoalHandle) -> None:
            if offer.handles.pop(goal.id, None) is handle and is_alive(self):
                self.activeGoalsChanged.emit()

        handle = ServerGoalHandle(runtime, goal, server.type, self.DIALECT, forget)
        if ended is not None:
            handle.ended = ended
        offer.handles[goal.id] = handle
        self.activeGoalsChanged.emit()
        arguments = [runtime.message(goal.goal, self.DIALECT), handle.js]
        waiting = handle.ended
        try:
            answer = offer.answers.ask(self._execute, arguments, handle.take)
        except Error as error:
            handle.fail(error)
            return waiting
        if isinstance(answer, Future):
            answer.add_done_callback(handle.settle)
        elif answer is not None:
            handle.finish(answer)
        return waiting

    def _problem_changed(self) -> None:
        self.problemChanged.emit()


def server_functions(given: QJSValue) -> dict[str, QJSValue]:
    """Return the functions that ``createActionServer`` was given, by name.

    Args:
        given: ``execute``, or an object of ``execute`` and optionally ``accept`` and ``cancel``.

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
    for name, function in functions.items():
        if not function.isCallable():
            raise Error(f"{name} is not a function")
    return functions
