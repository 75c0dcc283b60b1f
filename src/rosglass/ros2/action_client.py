"""Sending goals to ROS 2 actions."""

from __future__ import annotations

import copy
import logging
import threading
import time
import uuid
from typing import TYPE_CHECKING, Any, cast

from rosglass.comm import ActionClient, CancelAnswer, EndpointKind, Executor, Promise, Time
from rosglass.comm.promise import check_timeout
from rosglass.comm.readiness import Readiness
from rosglass.comm.similar import similar
from rosglass.errors import (
    ConnectionLostError,
    ConversionError,
    Error,
    NodeClosedError,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
)
from rosglass.ros2.action_ends import ActionEnds
from rosglass.ros2.action_types import CANCEL_REASONS, NO_ID, SEND_GOAL, goal_info, part
from rosglass.ros2.action_version import ActionVersion
from rosglass.ros2.client_goal import Ros2ClientGoal
from rosglass.ros2.core import Member

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm import Call, ClientGoal, GoalStatus, Handle
    from rosglass.messages import ActionType, Message
    from rosglass.ros2.action_ends import GoalNews
    from rosglass.ros2.action_types import ActionTypes
    from rosglass.ros2.core import Core

__all__ = ["Ros2ActionClient"]

_log = logging.getLogger("rosglass.ros2")


class Ros2ActionClient(ActionClient, Member):
    """An action client; made by :meth:`Node.create_action_client`.

    Args:
        core: The node it belongs to.
        name: Absolute action name.
        wanted: The type, or its name: then the version that the server announces is taken if the
            library has it; None takes whatever type the server announces.

    Attributes:
        core: The node it belongs to.
    """

    def __init__(self, core: Core, name: str, wanted: ActionType | str | None) -> None:
        self.name, self.core = name, core
        self._version = ActionVersion(core, name, wanted)
        self._lock = threading.Lock()
        self._goals: dict[bytes, Ros2ClientGoal] = {}
        self._ends: ActionEnds | None = None
        #: What is to be done once the type is known.
        self._held: list[Callable[[], None]] = []
        self._closed = False
        self._warned = ""
        self._readiness = Readiness(name, lambda: self.ready, self._check_open, core.dispatcher)
        self.type = None
        self._version.follow(retry=True)
        if self._version.types is not None:
            self._speak(self._version.types)
        core.add(self)
        core.wake()

    # -- who is there ----------------------------------------------------------------------------

    @property
    def closed(self) -> bool:
        """Whether :meth:`close` was called, of the client or of its node."""
        return self._closed or self.core.closed

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands the goals."""
        ends = self._ends
        return ends is not None and not self._closed and all(end.ready for end in ends.services)

    @property
    def problem(self) -> str:
        """Why goals cannot be sent, in words; empty when all is well."""
        if self._closed:
            return "the client is closed"
        problems = self._conflicts()
        if not problems and not self.ready:
            problems.append(self._absence())
        return "; ".join(problems)

    @property
    def goals(self) -> Sequence[ClientGoal]:
        """The goals of this client that have not ended, in order of sending."""
        with self._lock:
            return tuple(self._goals.values())

    def wait_for_server(self, timeout: float | None = None) -> bool:
        """Wait for a server; see :meth:`rosglass.comm.ActionClient.wait_for_server`."""
        return self._readiness.wait(timeout)

    def on_ready_change(
        self, callback: Callable[[bool], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with :attr:`ready` whenever it changes."""
        return self._readiness.add(callback, executor)

    # -- goals -----------------------------------------------------------------------------------

    def send_goal(
        self,
        goal: Message | dict[str, Any] | None = None,
        /,
        *,
        on_feedback: Callable[[Message], None] | None = None,
        on_status_change: Callable[[GoalStatus], None] | None = None,
        on_done: Callable[[ClientGoal], None] | None = None,
        executor: Executor | None = None,
        timeout: float | None = 10.0,
    ) -> ClientGoal:
        """Send a goal; see :meth:`rosglass.comm.ActionClient.send_goal`."""
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        if executor is not None and not isinstance(executor, Executor):
            raise ConversionError("executor", executor, "a rosglass.comm.Executor", self.name)
        kind = self.type
        if kind is not None:
            value: Any = kind.goal.create(goal)
        elif goal is None or hasattr(goal, "to_dict") or isinstance(goal, dict):
            value = copy.deepcopy(goal)  # the caller may change it meanwhile
        else:
            raise ConversionError("", goal, "a message or a dict of fields", self.name)
        made = Ros2ClientGoal(self, uuid.uuid4().bytes, value, timeout, typed=kind is not None)
        if on_feedback is not None:
            made.on_feedback(on_feedback, executor)
        if on_status_change is not None:
            made.on_status_change(on_status_change, executor)
        if on_done is not None:
            if not callable(on_done):
                raise ConversionError("on_done", on_done, "something that can be called", self.name)
            made.done.on_done(lambda _: on_done(made), executor)
        with self._lock:
            if not self._closed:
                self._goals[made.id] = made
        if kind is not None:
            made.send()
        else:
            made.hold()
            self._once_typed(made.begin)
        return made

    def cancel_all(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel all its goals; returns at once."""
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        with self._lock:
            waiting = [goal for goal in self._goals.values() if goal.accepted is None]
        for goal in waiting:
            goal.cancel(timeout)
        answer = self._answer()
        self.ask_cancel(NO_ID, Time(), answer, timeout)
        return answer

    def cancel_before(self, time: Time, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel all goals that it accepted at or before `time`."""
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        if not isinstance(time, Time) or not 0 < time.nanoseconds < 2**31 * 1_000_000_000:
            told = "a rosglass.Time after 1970 and before 2038; cancel_all() cancels all goals"
            raise ConversionError("time", time, told, self.name)
        answer = self._answer()
        self.ask_cancel(NO_ID, time, answer, timeout)
        return answer

    def _answer(self) -> Promise[CancelAnswer]:
        told = f"{self.name} has not answered the request to cancel"
        return Promise(told, self.core.dispatcher, cancellable=False)

    # -- what goals ask of it --------------------------------------------------------------------

    def ask_goal(self, goal: Ros2ClientGoal, timeout: float | None) -> Call:
        """Send a goal."""
        request = {"goal_id": {"uuid": goal.id}, "goal": goal.goal}
        return self._open_ends().send_goal.call_async(request, timeout=timeout)

    def ask_result(self, goal: Ros2ClientGoal) -> Call:
        """Ask for a goal's result, for as long as it takes."""
        request = {"goal_id": {"uuid": goal.id}}
        return self._open_ends().get_result.call_async(request, timeout=None)

    def ask_cancel(
        self, goal_id: bytes, stamp: Time, answer: Promise[CancelAnswer], timeout: float | None
    ) -> None:
        """Ask for goals to be cancelled: one, or those until a time, or all."""
        if self._ends is None and not self._closed:
            self._ask_cancel_later(goal_id, stamp, answer, timeout)
            return
        try:
            request = {"goal_info": goal_info(goal_id, stamp)}
            call = self._open_ends().cancel_goal.call_async(request, timeout=timeout)
        except Error as error:
            answer.fail(error)
            return
        call.add_done_callback(lambda _: self._take_answer(goal_id, call, answer, timeout))

    def _ask_cancel_later(
        self, goal_id: bytes, stamp: Time, answer: Promise[CancelAnswer], timeout: float | None
    ) -> None:
        until = None if timeout is None else time.monotonic() + timeout

        def ask() -> None:
            if not answer.done():
                left = None if until is None else max(0.0, until - time.monotonic())
                self.ask_cancel(goal_id, stamp, answer, left)

        def give_up() -> None:
            if self._ends is None:
                answer.fail(self._no_cancelling(timeout))

        if timeout is not None:
            self.core.timers.after(timeout, give_up)
        self._once_typed(ask)

    def _no_cancelling(self, timeout: float | None) -> ServiceUnavailableError:
        return ServiceUnavailableError(
            f"{self.name} could not be asked to cancel within {timeout or 0.0:g} s: "
            f"{self.problem or 'its server appeared too late'}"
        )

    def withdraw(self, call: Call) -> bool:
        """Take a goal back that was not sent yet; return whether that was so."""
        ends = self._ends
        return ends is not None and ends.send_goal.withdraw(call)

    def flush(self) -> None:
        """Take the feedback and status that have arrived and wait to be taken."""
        ends = self._ends
        if ends is not None:
            ends.flush()

    def forget(self, goal: Ros2ClientGoal) -> None:
        """Let a goal go that has ended."""
        with self._lock:
            self._goals.pop(goal.id, None)

    def servers(self) -> frozenset[bytes | str]:
        """Return the identities of the servers that understand the goals."""
        ends = self._ends
        return frozenset() if ends is None else ends.send_goal.server_ids()

    def empty_result(self) -> Message:
        """Return a result with the type's defaults."""
        assert self.type is not None  # there are goals
        return self.type.result.create()

    def ended(self) -> NodeClosedError:
        """Return the error of goals whose client was closed."""
        told = f"the client of {self.name} was closed before the goal ended, which goes on"
        return NodeClosedError(told)

    def replaced(self) -> ConnectionLostError:
        """Return the error of goals whose server made way for one with another definition."""
        return ConnectionLostError(
            f"the server of {self.name} was replaced by one with another definition of the type; "
            "nobody knows what becomes of the goal"
        )

    def _take_answer(
        self, goal_id: bytes, call: Call, answer: Promise[CancelAnswer], timeout: float | None
    ) -> None:
        """Take the answer to a request to cancel."""
        error = call.exception(0)
        if isinstance(error, TimeoutError):
            error = TimeoutError(
                f"{self.name} did not answer the request to cancel within {timeout:g} s; some "
                "servers answer only while their program looks for such requests. It may cancel "
                "all the same: watch the goal's status"
            )
        elif isinstance(error, ServiceUnavailableError):
            error = self._no_cancelling(timeout)
        if error is not None:
            answer.fail(error)
            return
        response = call.result(0)
        accepted = tuple(bytes(info.goal_id.uuid) for info in response.goals_canceling)
        for each in accepted:
            goal = self._goals.get(each)
            if goal is not None:
                goal.canceling()
        code = int(response.return_code)
        reason = CANCEL_REASONS.get(code, f"the server answers with the unknown code {code}")
        got = goal_id in accepted if goal_id != NO_ID else bool(accepted)
        answer.fulfil(CancelAnswer(accepted, "" if got else reason))

    # -- following the graph ---------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - definitions may be added
        """Follow the graph: the type, whether a server is there, goals whose server went."""
        if self._closed:
            return
        if self._version.follow(retry=idle) and self._version.types is not None:
            self._speak(self._version.types)
        problem = "; ".join(self._conflicts())
        if problem and problem != self._warned:
            level = logging.INFO if self._version.pending else logging.WARNING
            _log.log(level, "%s: %s", self.name, problem)
        self._warned = problem
        self._readiness.update()
        with self._lock:
            goals = list(self._goals.values())
        for goal in goals:
            goal.watch()

    def _speak(self, types: ActionTypes) -> None:
        """Speak this version of the type from now on."""
        news = cast("dict[bytes, GoalNews]", self._goals)
        ends = ActionEnds(self.core, self.name, types, news)
        with self._lock:
            old, self._ends = self._ends, ends
            self.type = types.action
            closed = self._closed
            goals = list(self._goals.values())
            held, self._held = self._held, []
        if closed:
            ends.close()
        for job in held:
            job()
        if old is None:
            return
        for goal in goals:
            if goal.take_back(old.send_goal):
                goal.send_again(types.action.goal)
            elif goal.accepted is not None:
                goal.lose(self.replaced())
        old.close()

    def _once_typed(self, job: Callable[[], None]) -> None:
        """Do something now, or as soon as the type is known."""
        with self._lock:
            if self._ends is None and not self._closed:
                self._held.append(job)
                return
        job()

    def _conflicts(self) -> list[str]:
        """Say what a person has to mend."""
        problems = self._version.conflicts()
        ends = self._ends
        if not problems and ends is not None:
            problems = [end.trouble for end in ends.services if end.trouble]
        return list(dict.fromkeys(problems))

    def _absence(self) -> str:
        """Say why no server is there although nothing is wrong."""
        ends = self._ends
        if ends is not None and any(end.server_ids() for end in ends.services):
            missing = ", ".join(end.name for end in ends.services if not end.ready)
            return f"its server is incomplete, or not linked yet: {missing} does not answer"
        graph = self.core.graph
        offered = [
            name
            for name in graph.actions()
            if graph.endpoints(EndpointKind.SERVICE_SERVER, part(name, SEND_GOAL))
        ]
        kind = "" if self.type is None else f" [{self.type.name}]"
        return (
            f"no server offers the action {self.name}{kind} on {self.core.url} "
            f"({self.core.status()}){similar(self.name, offered)}"
        )

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """End the waiting for goals, which go on, and withdraw the client; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            goals = list(self._goals.values())
            ends, held, self._held = self._ends, self._held, []
        if self.core.forked:
            return
        for goal in goals:
            goal.lose(self.ended())
        for job in held:
            job()  # finds the client closed
        if ends is not None:
            ends.close()
        self._readiness.close()
        self.core.remove(self)

    def _open_ends(self) -> ActionEnds:
        self._check_open()
        assert self._ends is not None  # there is a type
        return self._ends

    def _check_open(self) -> None:
        self.core.check_open()
        if self._closed:
            raise NodeClosedError(f"the client of {self.name} is closed; create another one")
