"""Offering ROS 2 actions.

Behaviour: http://design.ros2.org/articles/actions.html and ``rcl_action``'s ``action_server.c``.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from concurrent.futures import Future
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm import Dispatcher, EndpointKind, Publisher, Time
from rosglass.comm.goal_server import GoalServer
from rosglass.comm.inorder import InOrder
from rosglass.errors import NodeClosedError
from rosglass.ros2.action_types import (
    CANCEL_GOAL,
    CODES,
    FEEDBACK,
    FEEDBACK_QOS,
    GET_RESULT,
    NO_ID,
    SEND_GOAL,
    STATUS,
    STATUS_QOS,
    ActionTypes,
    goal_info,
    part,
    stamp_of,
)
from rosglass.ros2.core import Member
from rosglass.ros2.server_goal import Ros2ServerGoal
from rosglass.ros2.service_replier import create_service_server

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence

    from rosglass.comm import Executor, ServerGoal
    from rosglass.comm.node import Result
    from rosglass.messages import ActionType, Message
    from rosglass.ros2.core import Core

__all__ = ["Ros2ActionServer"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that results are kept for clients that ask late, as in Humble's rcl_action.
_RESULT_TIMEOUT = 900.0
#: Ended goals that are kept at most.
_MAX_ENDED = 500
#: Seconds after its acceptance in which a client asks for a goal's result: closing waits for that.
_ASKING = 1.0
#: ``action_msgs/srv/CancelGoal``'s return codes.
_NONE, _REJECTED, _UNKNOWN, _TERMINATED = range(4)


class Ros2ActionServer(GoalServer, Member):
    """An action server; made by :meth:`Node.create_action_server`.

    Args:
        core: The node it belongs to.
        name: Absolute action name.
        type: The type, or its name.
        execute: Called with each accepted goal.
        accept: Told a goal, says whether it is accepted; None accepts all.
        cancel: Told a goal, says whether it may be cancelled; None accepts all.
        executor: Where all three run; None for a thread for each goal and, for the latter two,
            the node's dispatcher. When `execute` is a coroutine function, all run in the event
            loop.
    """

    def __init__(
        self,
        core: Core,
        name: str,
        type: ActionType | str,
        execute: Callable[[ServerGoal], Result | Awaitable[Result]],
        accept: Callable[[Message], bool] | None = None,
        cancel: Callable[[ServerGoal], bool] | None = None,
        executor: Executor | None = None,
    ) -> None:
        kind = core.types.action(type)
        super().__init__(core, name, kind, execute, accept, cancel, executor, _log)
        self._core = core
        self._types = types = ActionTypes.of(self.type, core.types)
        self._goals: dict[bytes, Ros2ServerGoal] = {}
        self._deciding: set[bytes] = set()
        self._publishing = InOrder()
        #: Runs the protocol: neither the middleware's threads nor users' callbacks hold it up.
        self._desk = Dispatcher(f"{name} goals")
        self._feedback = Publisher(core, part(name, FEEDBACK), types.feedback, FEEDBACK_QOS)
        self._status = Publisher(core, part(name, STATUS), types.status, STATUS_QOS)
        self._services = [
            create_service_server(core, part(name, service), kind, callback, executor=self._desk)
            for service, kind, callback in (
                (GET_RESULT, types.get_result, self._on_result_request),
                (CANCEL_GOAL, types.cancel_goal, self._on_cancel_request),
                (SEND_GOAL, types.send_goal, self._on_goal_request),
            )
        ]
        core.add(self)

    @property
    def goals(self) -> Sequence[ServerGoal]:
        """The goals that have not ended, in order of acceptance."""
        with self._lock:
            return tuple(goal for goal in self._goals.values() if goal.status.is_active)

    @property
    def problem(self) -> str:
        """Why some clients cannot be served, in words; empty when all is well."""
        if self._closed:
            return "the server is closed"
        problems = [service.problem for service in self._services]
        return "; ".join(dict.fromkeys(problem for problem in problems if problem))

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - time passes
        """Forget results that nobody asked for in time."""
        if not idle or self._closed:
            return
        oldest = time.monotonic() - _RESULT_TIMEOUT
        with self._lock:
            ended = [goal for goal in self._goals.values() if goal.ended is not None]
            surplus = len(ended) - _MAX_ENDED
            for number, goal in enumerate(sorted(ended, key=lambda goal: goal.ended or 0.0)):
                if number < surplus or (goal.ended is not None and goal.ended < oldest):
                    del self._goals[goal.id]

    def close(self) -> None:
        """Abort the goals that run, tell their clients, and withdraw; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            goals = list(self._goals.values())
        if self._core.forked:
            return
        self._runner.close()
        for goal in goals:
            goal.close()
        self._await_questions(goals)
        for end in (*self._services, self._feedback, self._status):
            end.close()
        self._desk.close()
        self._runner.join()
        self._core.remove(self)

    def _await_questions(self, goals: Sequence[Ros2ServerGoal]) -> None:
        """Let clients ask what became of goals accepted just now: nobody else can tell them."""
        if self._desk.is_current or not goals:
            return
        graph, name = self._core.graph, part(self.name, GET_RESULT)
        while time.monotonic() - max(
            (goal.begun for goal in goals if not goal.asked), default=-math.inf
        ) < _ASKING and graph.endpoints(EndpointKind.SERVICE_CLIENT, name):
            time.sleep(0.005)
        answered = threading.Event()
        self._desk.post(answered.set)  # behind the last answer
        answered.wait(_ASKING)

    # -- for goals -------------------------------------------------------------------------------

    def make_result(self, result: Any) -> Message:
        """Return a goal's result; raises ConversionError."""
        kind = self.type.result
        return kind.decode(kind.encode(result))

    def make_response(self, code: int, result: Any) -> Message:
        """Return the answer to a request for a goal's result."""
        return self._types.get_result.response.create(status=code, result=result)

    def send_feedback(self, goal: Ros2ServerGoal, feedback: Any, fields: dict[str, Any]) -> None:
        """Publish feedback of a goal; raises ConversionError."""
        made = self._make_feedback(feedback, fields)
        self._feedback.publish({"goal_id": {"uuid": goal.id}, "feedback": made})

    def publish_status(self) -> None:
        """Publish the status of all goals, as of now."""
        self._publishing.add(self._publish_status)

    def _publish_status(self) -> None:
        with self._lock:
            goals = list(self._goals.values())
        entries = [
            {"goal_info": goal_info(goal.id, goal.accepted), "status": CODES[goal.status]}
            for goal in goals
        ]
        with suppress(NodeClosedError):  # those who listen see that the server is gone
            self._status.publish(status_list=entries)

    # -- accepting -------------------------------------------------------------------------------

    def _on_goal_request(self, request: Message) -> Any:
        goal_id = bytes(request.goal_id.uuid)
        with self._lock:
            known = goal_id in self._goals or goal_id in self._deciding
            if not known:
                self._deciding.add(goal_id)
        if known:
            _log.warning("%s: rejecting goal %s: its id is in use", self.name, goal_id.hex())
            return {"accepted": False}
        answer: Future[Any] = Future()
        if self._accept is None:
            # Once the answer is waited for: it must be on its way before the goal starts.
            self._desk.post(lambda: self._take(goal_id, request.goal, answer, True))
        elif not self._decide_later(lambda: self._decide(goal_id, request.goal, answer)):
            self._take(goal_id, request.goal, answer, False)
        return answer

    def _decide(self, goal_id: bytes, goal: Message, answer: Future[Any]) -> None:
        accepted = self._accepts(goal, goal_id.hex())
        # Back on the desk, so that what follows waits for no other callback.
        self._desk.post(lambda: self._take(goal_id, goal, answer, accepted))

    def _take(self, goal_id: bytes, wanted: Message, answer: Future[Any], accepted: bool) -> None:
        stamp = self._core.clock.now()
        goal = Ros2ServerGoal(self, goal_id, wanted, stamp)
        with self._lock:
            self._deciding.discard(goal_id)
            if self._closed:
                accepted = False
            if accepted:
                self._goals[goal_id] = goal
        answer.set_result({"accepted": accepted, "stamp": stamp.to_dict() if accepted else {}})
        if accepted:
            self.publish_status()
            self._runner.start(goal)

    # -- cancelling ------------------------------------------------------------------------------

    def _on_cancel_request(self, request: Message) -> Any:
        goal_id = bytes(request.goal_info.goal_id.uuid)
        stamp = stamp_of(request.goal_info.stamp)
        with self._lock:
            goals = list(self._goals.values())
        chosen, code = _cancelable(goals, goal_id, stamp)
        if self._cancel is None or not chosen:
            return self._cancel_all(chosen, code)
        answer: Future[Any] = Future()

        def decide() -> None:
            allowed = [goal for goal in chosen if self._allows(goal)]
            rejected = _REJECTED if not allowed else code
            self._desk.post(lambda: answer.set_result(self._cancel_all(allowed, rejected)))

        # What cannot be asked must not hold up a stop.
        return answer if self._decide_later(decide) else self._cancel_all(chosen, code)

    def _cancel_all(self, goals: Sequence[Ros2ServerGoal], code: int) -> dict[str, Any]:
        """Cancel goals; returns the answer to the request."""
        canceled = [goal for goal in goals if goal.request_cancel()]
        if goals and not canceled:
            code = _TERMINATED  # they ended while it was decided
        if canceled:
            self.publish_status()
        infos = [goal_info(goal.id, goal.accepted) for goal in canceled]
        return {"return_code": code, "goals_canceling": infos}

    # -- results ---------------------------------------------------------------------------------

    def _on_result_request(self, request: Message) -> Any:
        with self._lock:
            goal = self._goals.get(bytes(request.goal_id.uuid))
        if goal is None:
            return {"status": 0}  # unknown
        answer: Future[Any] = Future()
        goal.add_waiting(answer)
        return answer


def _cancelable(
    goals: Sequence[Ros2ServerGoal], goal_id: bytes, stamp: Time
) -> tuple[list[Ros2ServerGoal], int]:
    """Return the goals that a request to cancel means, and the code that answers it.

    An id alone means one goal; a stamp means all accepted until then, and the goal with the id, if
    there is one; neither means all (``rcl_action_process_cancel_request``).
    """
    if goal_id != NO_ID and stamp == Time():
        found = [goal for goal in goals if goal.id == goal_id]
        if not found:
            return [], _UNKNOWN
        return (found, _NONE) if found[0].cancelable else ([], _TERMINATED)
    everything = goal_id == NO_ID and stamp == Time()
    chosen = [
        goal
        for goal in goals
        if goal.cancelable and (everything or goal.accepted <= stamp or goal.id == goal_id)
    ]
    return chosen, _NONE
