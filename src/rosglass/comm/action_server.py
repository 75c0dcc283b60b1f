"""Action servers, their goals, and the protocol by which goals arrive."""

from __future__ import annotations

import inspect
import threading
import time
from abc import ABC, abstractmethod
from concurrent.futures import Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar

from rosglass.comm.action_client import GoalStatus
from rosglass.comm.executor import LoopExecutor, executor_for
from rosglass.comm.handle import Handle
from rosglass.comm.promise import Promise
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.errors import ArgumentError, Error, NodeClosedError

if TYPE_CHECKING:
    import logging
    from collections.abc import Awaitable, Callable, Iterator, Sequence

    from rosglass.comm.core import NodeCore
    from rosglass.comm.handle import Executor
    from rosglass.comm.time import Time
    from rosglass.messages import ActionType, Message

__all__ = ["ActionServer", "ActionServerProtocol", "Result", "ServerGoal", "TakesGoal"]

_Goal = TypeVar("_Goal", bound="ServerGoal")
#: The result that `execute` returns.
Result: TypeAlias = "Message | dict[str, Any] | None"

#: How long closing waits for the goals' threads to end, in all.
_CLOSE_TIMEOUT_S = 2.0


class ActionServerProtocol(ABC, Generic[_Goal]):
    """The protocol of an action server: receives goals, and reports to their clients.

    It receives goals and requests to cancel, and calls the server's ``_on_goal``, ``_run`` and
    ``_on_cancel`` with them. The server decides on goals and executes them.

    Args:
        core: The node.
        name: Absolute action name.
        type: The type.
        wire: The wire format of messages, ``ros1`` or ``cdr``.
        log: Where failures are logged.

    Attributes:
        dispatcher: Where callbacks run unless the user gives an executor.
        lock: Guards the status of goals, and the server's lists of them.
        closed: Whether the server was closed; set by the server.
    """

    def __init__(
        self, core: NodeCore, name: str, type: ActionType, wire: str, log: logging.Logger
    ) -> None:
        self.name, self.type, self.wire, self.log = name, type, wire, log
        self.dispatcher = core.dispatcher
        self.lock = threading.Lock()
        self.closed = False

    @abstractmethod
    def open(self, server: ActionServer) -> None:
        """Announce the action, and pass what is received to `server`."""

    @abstractmethod
    def withdraw(self) -> None:
        """Withdraw the action, once all goals have ended."""

    @abstractmethod
    def problems(self) -> list[str]:
        """Return why some clients cannot be served, in words."""

    def post(self, job: Callable[[], None]) -> None:
        """Run the job that follows a decision of the user's callback."""
        job()

    @abstractmethod
    def accept(self, goal: _Goal) -> bool:
        """Register an accepted goal; return False if it was cancelled. The lock is held."""

    @abstractmethod
    def start(self, goal: _Goal) -> None:
        """Answer the client of an accepted goal, then let the server run it."""

    @abstractmethod
    def reject(self, goal: _Goal, reason: str) -> None:
        """Answer the client of a rejected goal."""

    def on_returned(self) -> None:
        """Called when `execute` has returned, however the goal ended."""

    @abstractmethod
    def publish_feedback(self, goal: _Goal, feedback: Message) -> None:
        """Send a goal's feedback."""

    @abstractmethod
    def publish_status(self) -> None:
        """Send the current status of all goals."""

    @abstractmethod
    def on_end(self, goal: _Goal, text: str) -> None:
        """Register the end of a goal, and its reason. The lock is held."""

    @abstractmethod
    def publish_result(self, goal: _Goal, result: Message) -> None:
        """Send the result of an ended goal, and the status of all goals."""


@hint_at_members
class ServerGoal(Handle):
    """A goal that a server accepted.

    Closing it aborts it, unless it has ended: ``with goal:`` always ends the goal.

    Attributes:
        id: 16 bytes (a UUID) in ROS 2; a UTF-8 string in ROS 1.
        goal: The goal message.
        accepted: When it was accepted.
    """

    id: bytes
    goal: Message
    accepted: Time

    def __init__(
        self, protocol: ActionServerProtocol[Any], id: bytes, goal: Message, accepted: Time
    ) -> None:
        self._protocol = protocol
        self.id, self.goal, self.accepted = id, goal, accepted
        self._status = GoalStatus.ACCEPTED
        self._begun = self._superseded = False
        self._cancel_request: Promise[None] = Promise(
            f"there was no request to cancel a goal of {protocol.name}",
            protocol.dispatcher,
            cancellable=False,
        )

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id_text} {self.status.value}>"

    @property
    def id_text(self) -> str:
        """The id as ROS's tools print it.

        In ROS 2, 32 hexadecimal digits (some logs insert dashes); in ROS 1, the string itself.
        """
        return self.id.hex()

    @property
    def status(self) -> GoalStatus:
        """The status."""
        return self._status

    @property
    def is_cancel_requested(self) -> bool:
        """True if the goal should end soon: cancel it with :meth:`canceled`, or the server closes.

        Also when a newer goal preempts it (in ROS 1, with ``simple=True``).
        """
        return self._cancel_request.done()

    @property
    def cancel_request(self) -> Promise[None]:
        """A promise that ends when :attr:`is_cancel_requested` becomes true."""
        return self._cancel_request

    def wait_for_cancel(self, timeout: float) -> bool:
        """Sleep up to `timeout` seconds; return True as soon as the goal should end."""
        return bool(wait([self._cancel_request], timeout).done)

    def publish_feedback(
        self, feedback: Message | dict[str, Any] | None = None, /, **fields: Any
    ) -> None:
        """Send feedback: a message, a dict of fields, or the fields as keyword arguments.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent.
            NodeClosedError: The server was closed.
            ArgumentError: Both a message and keyword fields are given.
            Error: The goal has ended.
        """
        if not self._status.is_active:
            raise self._ended_error("feedback comes too late")
        kind = self._protocol.type.feedback
        if feedback is not None and fields:
            expected = "either feedback or keyword fields, not both"
            raise ArgumentError("", fields, expected, kind.name)
        made = kind.create(fields if feedback is None else feedback)
        self._protocol.publish_feedback(self, made)

    def succeed(self, result: Message | dict[str, Any] | None = None) -> None:
        """End it as succeeded.

        Args:
            result: A message or a dict of fields; missing fields, and None, get the defaults.

        Raises:
            ConversionError: A value does not fit its field; the goal continues.
            NodeClosedError: The server was closed.
            Error: The goal has ended already.
        """
        self._end(GoalStatus.SUCCEEDED, result)

    def abort(self, result: Message | dict[str, Any] | None = None) -> None:
        """End it as aborted; arguments and errors as for :meth:`succeed`."""
        self._end(GoalStatus.ABORTED, result)

    def canceled(self, result: Message | dict[str, Any] | None = None) -> None:
        """End it as cancelled, after a request to cancel; as :meth:`succeed`.

        Raises:
            Error: No cancel was requested: use abort() to end it without a request.
        """
        self._end(GoalStatus.CANCELED, result)

    def close(self) -> None:
        """Abort it, unless it has ended; safe to call twice."""
        self._end(GoalStatus.ABORTED, None, "it was closed", strict=False)

    # -- for the server and the protocol ---------------------------------------------------------

    def _begin(self) -> bool:
        """Set it to executing; return False if it was cancelled or has ended."""
        with self._protocol.lock:
            if self._status is not GoalStatus.ACCEPTED:
                return False
            self._status, self._begun = GoalStatus.EXECUTING, True
        self._protocol.publish_status()
        return True

    @property
    def _cancelable(self) -> bool:
        """True if it has not ended and is not being cancelled (``rcl_action``'s state machine)."""
        return self._status in (GoalStatus.ACCEPTED, GoalStatus.EXECUTING)

    def _request_cancel(self) -> bool:
        """Set it to canceling; return whether that was possible."""
        with self._protocol.lock:
            if not self._cancelable:
                return False
            self._status = GoalStatus.CANCELING
        self._cancel_request.set_result(None)
        return True

    def _supersede(self) -> None:
        """Preempt it for a newer goal: it may end as cancelled without a client's request."""
        self._superseded = True
        self._cancel_request.set_result(None)

    def _conclude(self, result: Any) -> None:
        """End it with the result of `execute`: as cancelled if that was requested, or succeeded.

        Raises:
            ConversionError: `result` does not fit.
        """
        self._end(None, result, strict=False)

    def _fail(self, error: BaseException) -> None:
        """End it as aborted, unless it has ended."""
        self._end(GoalStatus.ABORTED, None, f"{type(error).__name__}: {error}", strict=False)

    def _end(
        self, status: GoalStatus | None, result: Any, text: str = "", *, strict: bool = True
    ) -> None:
        """End it.

        Args:
            status: The final status; None for SUCCEEDED, or CANCELED if that was requested.
            result: The result; None for the type's defaults.
            text: The reason for its client, where the protocol carries one.
            strict: Whether to raise an error if it has ended already.
        """
        protocol, kind = self._protocol, self._protocol.type.result
        made = kind.decode(kind.encode(result, wire=protocol.wire), wire=protocol.wire)
        with protocol.lock:
            requested = self._superseded or self._status is GoalStatus.CANCELING
            if status is None:
                status = GoalStatus.CANCELED if requested else GoalStatus.SUCCEEDED
            ends = self._status.is_active
            if ends and status is GoalStatus.CANCELED and not requested:
                raise Error(
                    f"there was no request to cancel goal {self.id_text} of {protocol.name}; end "
                    "it with abort() instead"
                )
            if ends:
                self._status = status
                protocol.on_end(self, text)
        if ends:
            self._cancel_request.set_result(None)
            protocol.publish_result(self, made)
        elif strict:
            raise self._ended_error(f"it cannot end as {status.value}")

    def _ended_error(self, what: str) -> Error:
        """Return the error of an operation after its end."""
        where = f"goal {self.id_text} of {self._protocol.name}"
        if self._protocol.closed:
            return NodeClosedError(f"{where} was aborted when its server closed: {what}")
        return Error(f"{where} has ended as {self._status.value} already: {what}")


@dataclass(frozen=True)
class TakesGoal:
    """An `accept` callback that receives the goal itself, not only its message."""

    callback: Callable[[ServerGoal], bool]

    def __call__(self, goal: Any) -> bool:
        """Return whether to accept the goal."""
        return self.callback(goal)


@hint_at_members
class ActionServer(Handle):
    """Serves an action; created by :meth:`Node.create_action_server`.

    Closing it aborts the running goals, and notifies their clients.

    Args:
        core: The node it belongs to.
        protocol: The protocol by which goals arrive; it is opened here.
        execute: Called with each accepted goal.
        accept: Receives the goal message and returns True to accept it; None accepts all.
        cancel: Receives the goal and returns True to accept a request to cancel it; None accepts
            all.
        executor: Where all three run; None for one thread per goal and, for the latter two, the
            node's dispatcher. If `execute` is a coroutine function, all run in the event loop.

    Attributes:
        name: Absolute action name.
        type: The action type.
    """

    name: str
    type: ActionType

    def __init__(
        self,
        core: NodeCore,
        protocol: ActionServerProtocol[Any],
        execute: Callable[[ServerGoal], Result | Awaitable[Result]],
        accept: Callable[[Message], bool] | None,
        cancel: Callable[[ServerGoal], bool] | None,
        executor: Executor | None,
    ) -> None:
        self.name, self.type = protocol.name, protocol.type
        chosen = executor_for(execute, executor, core.dispatcher, self.name)
        for word, callback in (("accept", accept), ("cancel", cancel)):
            plain = callable(callback) and not inspect.iscoroutinefunction(callback)
            if callback is not None and not plain:
                raise ArgumentError(word, callback, "a plain function, or None", self.name)
        self._core, self._protocol, self._log = core, protocol, protocol.log
        self._execute, self._accept, self._cancel = execute, accept, cancel
        self._decider = chosen
        given = executor is not None or isinstance(chosen, LoopExecutor)
        #: Runs goals; None for one thread each.
        self._executor = chosen if given else None
        #: Goals that have not ended; ended ones are removed when the next one is accepted.
        self._goals: dict[bytes, ServerGoal] = {}
        self._threads: set[threading.Thread] = set()
        protocol.open(self)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} [{self.type.name}]>"

    @property
    def closed(self) -> bool:
        """True once the server was closed."""
        return self._protocol.closed

    @property
    def goals(self) -> Sequence[ServerGoal]:
        """The goals that have not ended, in order of acceptance."""
        with self._protocol.lock:
            return tuple(goal for goal in self._goals.values() if goal.status.is_active)

    @property
    def problem(self) -> str:
        """Why some clients cannot be served, in words; empty if there is no problem."""
        if self.closed:
            return "the server is closed"
        problems = self._protocol.problems()
        return "; ".join(dict.fromkeys(problem for problem in problems if problem))

    def close(self) -> None:
        """Abort the running goals, notify their clients, and withdraw; safe to call twice."""
        with self._protocol.lock:
            if self._protocol.closed:
                return
            self._protocol.closed = True
            goals = list(self._goals.values())
        if self._core.forked:
            return
        for goal in goals:
            goal.close()
        self._protocol.withdraw()
        self._join()

    def _join(self) -> None:
        """Wait for the goals' threads to end."""
        with self._protocol.lock:
            threads = [t for t in self._threads if t is not threading.current_thread()]
        until = time.monotonic() + _CLOSE_TIMEOUT_S
        for thread in threads:
            thread.join(max(0.0, until - time.monotonic()))
            if thread.is_alive():
                self._log.warning(
                    "%s still runs %.0f s after closing", thread.name, _CLOSE_TIMEOUT_S
                )

    # -- decisions -------------------------------------------------------------------------------

    def _on_goal(self, goal: ServerGoal) -> None:
        """Decide on a received goal."""
        accept = self._accept
        if accept is None:
            self._on_decision(goal, "")
            return

        def decide() -> None:
            given: Any = goal if isinstance(accept, TakesGoal) else goal.goal
            accepted = self._ask_user(goal, "accept", lambda: accept(given), False, "rejecting")
            refusal = "" if accepted else "It is not accepted"
            self._protocol.post(lambda: self._on_decision(goal, refusal))

        if not self._decide_later(decide):
            self._on_decision(goal, "It cannot be decided on")

    def _on_decision(self, goal: ServerGoal, refusal: str) -> None:
        """Start a goal, or reject it if there is a `refusal`."""
        protocol = self._protocol
        with protocol.lock:
            if not refusal and protocol.closed:
                refusal = "The server was closed"
            accepted = not refusal and protocol.accept(goal)
            if accepted:
                ended = [key for key, old in self._goals.items() if not old.status.is_active]
                for key in ended:
                    del self._goals[key]
                self._goals[goal.id] = goal
        if accepted:
            protocol.start(goal)
        else:
            protocol.reject(goal, refusal)

    def _on_cancel(
        self, goals: Sequence[ServerGoal], then: Callable[[Sequence[ServerGoal]], None]
    ) -> None:
        """Decide which goals may be cancelled, and pass them to `then`."""
        cancel = self._cancel
        if cancel is None or not goals:
            then(goals)
            return

        def decide() -> None:
            # A callback that fails must not prevent a stop.
            allowed = [
                goal
                for goal in goals
                if self._ask_user(goal, "cancel", partial(cancel, goal), True, "cancelling")
            ]
            self._protocol.post(lambda: then(allowed))

        # A broken executor must not prevent a stop.
        if not self._decide_later(decide):
            then(goals)

    def _decide_later(self, decide: Callable[[], None]) -> bool:
        """Run a user's callback; return False if its executor raises."""
        try:
            self._decider.post(decide)
        except Exception:  # noqa: BLE001 - a user's executor
            self._log.exception(
                "%s: the executor of accept and cancel raised: goals are rejected, and cancelled",
                self.name,
            )
            return False
        return True

    def _ask_user(
        self, goal: ServerGoal, name: str, decide: Callable[[], bool], default: bool, effect: str
    ) -> bool:
        """Return the decision of a user's callback.

        Args:
            goal: The goal to decide on.
            name: Name of the callback, for log lines.
            decide: Calls it.
            default: The decision if it fails.
            effect: The consequence of that, for log lines.
        """
        decision: Any
        try:
            decision = decide()
        except Exception:  # noqa: BLE001 - a user's callback
            self._log.exception("%s: %s failed; %s goal %s", self.name, name, effect, goal.id_text)
            return default
        if decision is not True and decision is not False:
            self._log.error(
                "%s: %s returned %.80r instead of True or False; %s goal %s",
                self.name,
                name,
                decision,
                effect,
                goal.id_text,
            )
            return default
        return bool(decision)

    # -- execution -------------------------------------------------------------------------------

    def _run(self, goal: ServerGoal) -> None:
        """Execute a goal on its executor or thread, and end it with the result."""
        try:
            if self._executor is not None:
                self._executor.post(lambda: self._execute_goal(goal))
                return
            thread = threading.Thread(
                target=self._run_in_thread,
                args=(goal,),
                name=f"{self.name} {goal.id_text}",
                daemon=True,
            )
            with self._protocol.lock:  # so that close() joins it
                thread.start()
                self._threads.add(thread)
        except Exception as error:  # noqa: BLE001 - a user's executor; or no thread can start
            self._log.error(
                "%s: aborting goal %s, which cannot be executed: %r", self.name, goal.id_text, error
            )
            goal._fail(error)
            self._protocol.on_returned()

    def _run_in_thread(self, goal: ServerGoal) -> None:
        try:
            self._execute_goal(goal)
        finally:
            with self._protocol.lock:
                self._threads.discard(threading.current_thread())

    def _execute_goal(self, goal: ServerGoal) -> None:
        if not goal._begin():
            goal._conclude(None)  # cancelled before its turn, unless it has ended
            self._protocol.on_returned()
            return
        with self._aborted_on_error(goal):
            result: Any = self._execute(goal)
            if inspect.iscoroutine(result) and isinstance(self._executor, LoopExecutor):
                result = self._executor.run(result)
            if isinstance(result, Future):
                result.add_done_callback(lambda done: self._on_done(goal, done))
                return
            if inspect.iscoroutine(result):
                result.close()
                raise TypeError("execute must be an async def to be awaited")
            self._on_result(goal, result)
        self._protocol.on_returned()

    @contextmanager
    def _aborted_on_error(self, goal: ServerGoal) -> Iterator[None]:
        """Abort a goal after any error of a user's callback, coroutine or result."""
        try:
            yield
        except BaseException as error:  # noqa: BLE001 - sys.exit() ends the goal, not the server
            self._on_failure(goal, error)

    def _on_done(self, goal: ServerGoal, done: Future[Any]) -> None:
        """End a goal whose execution returned a future."""
        with self._aborted_on_error(goal):
            self._on_result(goal, done.result(0))
        self._protocol.on_returned()

    def _on_result(self, goal: ServerGoal, result: Any) -> None:
        if not goal.status.is_active:
            if result is not None and not self.closed:
                self._log.warning(
                    "%s: goal %s has ended as %s already; what execute returned is dropped",
                    self.name,
                    goal.id_text,
                    goal.status.value,
                )
            return
        try:
            goal._conclude(result)
        except Error as error:
            self._log.error(
                "%s: the result of goal %s does not fit, the goal is aborted: %s",
                self.name,
                goal.id_text,
                error,
            )
            goal._fail(error)

    def _on_failure(self, goal: ServerGoal, error: BaseException) -> None:
        if not (self.closed and isinstance(error, NodeClosedError)):
            self._log.error(
                "%s: execute failed on goal %s, which is aborted",
                self.name,
                goal.id_text,
                exc_info=error,
            )
        goal._fail(error)
