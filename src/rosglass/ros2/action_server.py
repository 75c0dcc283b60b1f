"""Action servers of ROS 2: three service servers and two publishers.

Protocol: http://design.ros2.org/articles/actions.html and ``rcl_action``'s ``action_server.c``.
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
from rosglass.comm.action_server import ActionServerProtocol, ServerGoal
from rosglass.comm.core import NodeMember
from rosglass.comm.executor import InOrder
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
from rosglass.ros2.rmw_services import create_service_server

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rosglass.comm.action_server import ActionServer
    from rosglass.messages import ActionType, Message
    from rosglass.ros2.core import Core

__all__ = ["Ros2ActionServerProtocol"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds for which results are kept for late requests, as in Humble's rcl_action.
_RESULT_TIMEOUT_S = 900.0
#: Maximum number of ended goals to keep.
_MAX_ENDED = 500
#: Maximum number of pending requests for one goal's result; only a faulty client sends more.
_MAX_WAITING = 1000
#: Seconds after acceptance within which a client requests the result: closing waits for that.
_ASK_TIMEOUT_S = 1.0
#: ``action_msgs/srv/CancelGoal``'s return codes.
_NONE, _REJECTED, _UNKNOWN, _TERMINATED = range(4)


class _KeptGoal:
    """A goal and the requests for its result.

    Attributes:
        goal: The goal.
        begun: Monotonic time of its acceptance.
        asked: Whether its result was requested.
        ended: Monotonic time of its end, None before.
        response: The response to requests for its result, None before its end.
        waiting: The pending requests for its result.
    """

    def __init__(self, goal: ServerGoal) -> None:
        self.goal = goal
        self.begun, self.asked = time.monotonic(), False
        self.ended: float | None = None
        self.response: Message | None = None
        self.waiting: list[Future[Any]] = []


class Ros2ActionServerProtocol(ActionServerProtocol[ServerGoal], NodeMember):
    """The three service servers and two publishers of an action server.

    Args:
        core: The node.
        name: Absolute action name.
        type: The type.
    """

    _server: ActionServer

    def __init__(self, core: Core, name: str, type: ActionType) -> None:
        super().__init__(core, name, type, "cdr", _log)
        self._core = core
        self._types = ActionTypes.of(type, core.types)
        self._kept: dict[bytes, _KeptGoal] = {}
        #: The pending responses to goal requests.
        self._deciding: dict[bytes, Future[Any]] = {}
        self._publishing = InOrder()

    def open(self, server: ActionServer) -> None:
        """Create services and publishers."""
        self._server = server
        core, name, types = self._core, self.name, self._types
        #: Runs the protocol, independently of the middleware's threads and users' callbacks.
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

    def withdraw(self) -> None:
        """Close services and publishers, after giving clients time to request the results."""
        self._await_questions()
        for end in (*self._services, self._feedback, self._status):
            end.close()
        self._desk.close()
        self._core.remove(self)

    def close(self) -> None:
        """Close the server together with its node."""
        self._server.close()

    def problems(self) -> list[str]:
        """Return why some clients cannot be served."""
        return [service.problem for service in self._services]

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - time passes
        """Drop the results that have been kept long enough."""
        if not idle or self.closed:
            return
        oldest = time.monotonic() - _RESULT_TIMEOUT_S
        with self.lock:
            ended = [kept for kept in self._kept.values() if kept.ended is not None]
            surplus = len(ended) - _MAX_ENDED
            for number, kept in enumerate(sorted(ended, key=lambda kept: kept.ended or 0.0)):
                if number < surplus or (kept.ended is not None and kept.ended < oldest):
                    del self._kept[kept.goal.id]

    def post(self, job: Callable[[], None]) -> None:
        """Run the job that follows a decision, on the protocol's own thread."""
        self._desk.post(job)

    def _await_questions(self) -> None:
        """Wait for result requests for goals that were only just accepted."""
        with self.lock:
            goals = list(self._kept.values())
        if self._desk.is_current or not goals:
            return
        graph, name = self._core.graph, part(self.name, GET_RESULT)
        while time.monotonic() - max(
            (kept.begun for kept in goals if not kept.asked), default=-math.inf
        ) < _ASK_TIMEOUT_S and graph.endpoints(EndpointKind.SERVICE_CLIENT, name):
            time.sleep(0.005)
        answered = threading.Event()
        self._desk.post(answered.set)  # after the last answer
        answered.wait(_ASK_TIMEOUT_S)

    # -- feedback, status, results ---------------------------------------------------------------

    def publish_feedback(self, goal: ServerGoal, feedback: Message) -> None:
        """Publish feedback for a goal."""
        self._feedback.publish({"goal_id": {"uuid": goal.id}, "feedback": feedback})

    def publish_status(self) -> None:
        """Publish the current status of all goals."""
        self._publishing.add(self._publish_status)

    def _publish_status(self) -> None:
        with self.lock:
            goals = [kept.goal for kept in self._kept.values()]
        entries = [
            {"goal_info": goal_info(goal.id, goal.accepted), "status": CODES[goal.status]}
            for goal in goals
        ]
        with suppress(NodeClosedError):  # clients notice that the server has left
            self._status.publish(status_list=entries)

    def on_end(self, goal: ServerGoal, text: str) -> None:  # noqa: ARG002 - ROS 2 has no room for it
        """Record that a goal has ended."""
        kept = self._kept.get(goal.id)
        if kept is not None:
            kept.ended = time.monotonic()

    def publish_result(self, goal: ServerGoal, result: Message) -> None:
        """Answer the requests for the result of a goal, and publish the status of all."""
        code = CODES[goal.status]
        response = self._types.get_result.response.create(status=code, result=result)
        waiting: list[Future[Any]] = []
        with self.lock:
            kept = self._kept.get(goal.id)
            if kept is not None:
                kept.response = response
                waiting, kept.waiting = kept.waiting, []
        self.publish_status()
        for future in waiting:
            if future.set_running_or_notify_cancel():
                future.set_result(response)

    # -- accepting -------------------------------------------------------------------------------

    def _on_goal_request(self, request: Message) -> Any:
        goal_id = bytes(request.goal_id.uuid)
        answer: Future[Any] = Future()
        with self.lock:
            known = goal_id in self._kept or goal_id in self._deciding
            if not known:
                self._deciding[goal_id] = answer
        if known:
            _log.warning("%s: rejecting goal %s: its id is in use", self.name, goal_id.hex())
            return {"accepted": False}
        goal = ServerGoal(self, goal_id, request.goal, Time())
        # Later: the response must be sent before the goal starts.
        self._desk.post(lambda: self._server._on_goal(goal))
        return answer

    def accept(self, goal: ServerGoal) -> bool:
        """Record that a goal is accepted."""
        goal.accepted = self._core.clock.now()
        self._kept[goal.id] = _KeptGoal(goal)
        return True

    def start(self, goal: ServerGoal) -> None:
        """Send the response, then execute the goal."""
        self._answer(goal, {"accepted": True, "stamp": goal.accepted.to_dict()})
        self.publish_status()
        self._server._run(goal)

    def reject(self, goal: ServerGoal, reason: str) -> None:  # noqa: ARG002 - ROS 2 has no room for it
        """Send the response to a goal that was not accepted."""
        self._answer(goal, {"accepted": False})

    def _answer(self, goal: ServerGoal, response: dict[str, Any]) -> None:
        with self.lock:
            answer = self._deciding.pop(goal.id)
        answer.set_result(response)

    # -- cancelling ------------------------------------------------------------------------------

    def _on_cancel_request(self, request: Message) -> Any:
        goal_id = bytes(request.goal_info.goal_id.uuid)
        stamp = stamp_of(request.goal_info.stamp)
        with self.lock:
            goals = [kept.goal for kept in self._kept.values()]
        chosen, code = _cancelable(goals, goal_id, stamp)
        answer: Future[Any] = Future()

        def cancel(allowed: Sequence[ServerGoal]) -> None:
            refused = _REJECTED if chosen and not allowed else code
            answer.set_result(self._cancel(allowed, refused))

        self._server._on_cancel(chosen, cancel)
        return answer

    def _cancel(self, goals: Sequence[ServerGoal], code: int) -> dict[str, Any]:
        """Cancel goals; return the response."""
        canceled = [goal for goal in goals if goal._request_cancel()]
        if goals and not canceled:
            code = _TERMINATED  # they have ended in between
        if canceled:
            self.publish_status()
        infos = [goal_info(goal.id, goal.accepted) for goal in canceled]
        return {"return_code": code, "goals_canceling": infos}

    # -- results ---------------------------------------------------------------------------------

    def _on_result_request(self, request: Message) -> Any:
        answer: Future[Any] = Future()
        dropped = None
        with self.lock:
            kept = self._kept.get(bytes(request.goal_id.uuid))
            if kept is None:
                return {"status": 0}  # unknown
            kept.asked = True
            if kept.response is not None:
                return kept.response
            if len(kept.waiting) >= _MAX_WAITING:
                dropped = kept.waiting.pop(0)
            kept.waiting.append(answer)
        if dropped is not None:
            dropped.cancel()
        return answer


def _cancelable(
    goals: Sequence[ServerGoal], goal_id: bytes, stamp: Time
) -> tuple[list[ServerGoal], int]:
    """Return the goals that a request to cancel selects, and the return code.

    An id alone selects one goal; a stamp selects all accepted until then, and also the goal with
    the id, if one is given; neither selects all (``rcl_action_process_cancel_request``).
    """
    if goal_id != NO_ID and stamp == Time():
        found = [goal for goal in goals if goal.id == goal_id]
        if not found:
            return [], _UNKNOWN
        return (found, _NONE) if found[0]._cancelable else ([], _TERMINATED)
    everything = goal_id == NO_ID and stamp == Time()
    chosen = [
        goal
        for goal in goals
        if goal._cancelable and (everything or goal.accepted <= stamp or goal.id == goal_id)
    ]
    return chosen, _NONE
