"""Sending goals to ROS 2 actions."""

from __future__ import annotations

import logging
import time
import uuid
from typing import TYPE_CHECKING, Any, cast

from rosglass.comm import CancelAnswer, EndpointKind, Promise, Time
from rosglass.comm.goal_client import GoalClient
from rosglass.comm.promise import check_timeout
from rosglass.errors import (
    ConnectionLostError,
    Error,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
)
from rosglass.ros2.action_ends import ActionEnds
from rosglass.ros2.action_types import CANCEL_REASONS, NO_ID, SEND_GOAL, goal_info, part
from rosglass.ros2.action_version import ActionVersion
from rosglass.ros2.client_goal import Ros2ClientGoal
from rosglass.ros2.core import Member

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Call, ClientGoal, Executor, GoalStatus
    from rosglass.messages import ActionType, Message
    from rosglass.ros2.action_ends import GoalNews
    from rosglass.ros2.action_types import ActionTypes
    from rosglass.ros2.core import Core

__all__ = ["Ros2ActionClient"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that do not fit into a time stamp any more, and their year.
_END_OF_TIME = 2**31, 2038


class Ros2ActionClient(GoalClient[Ros2ClientGoal], Member):
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
        super().__init__(core, name, _END_OF_TIME)
        self.core = core
        self._version = ActionVersion(core, name, wanted)
        self._goals: dict[bytes, Ros2ClientGoal] = {}
        self._ends: ActionEnds | None = None
        #: What is to be done once the type is known.
        self._held: list[Callable[[], None]] = []
        self._version.follow(retry=True)
        if self._version.types is not None:
            self._speak(self._version.types)
        core.add(self)
        core.wake()

    # -- who is there ----------------------------------------------------------------------------

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands the goals."""
        ends = self._ends
        return ends is not None and not self._closed and all(end.ready for end in ends.services)

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
        made = self._new_goal(goal, timeout, executor, on_feedback, on_status_change, on_done)
        with self._lock:
            if not self._closed:
                self._goals[made.id] = made
        if made.goal is not None:
            made.send()
        else:
            made.hold()
            self._once_typed(made.begin)
        return made

    def _make(self, goal: Any, timeout: float | None, *, typed: bool) -> Ros2ClientGoal:
        return Ros2ClientGoal(self, uuid.uuid4().bytes, goal, timeout, typed=typed)

    def cancel_all(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel all its goals; returns at once."""
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        waiting = [goal for goal in self._live() if goal.accepted is None]
        for goal in waiting:
            goal.cancel(timeout)
        answer = self._answer()
        self.ask_cancel(NO_ID, Time(), answer, timeout)
        return answer

    def cancel_before(self, time: Time, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel all goals that it accepted at or before `time`."""
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        self._check_stamp(time)
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
        self._warn(_log, logging.INFO if self._version.pending else logging.WARNING)
        self._readiness.update()
        for goal in self._live():
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
        problems = self._version.conflicts()
        ends = self._ends
        if not problems and ends is not None:
            problems = [end.trouble for end in ends.services if end.trouble]
        return list(dict.fromkeys(problems))

    def _absence(self) -> str:
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
        return self._no_server(offered)

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
