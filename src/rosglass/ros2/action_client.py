"""Action clients of ROS 2: three service clients and two subscriptions.

Protocol: http://design.ros2.org/articles/actions.html and ``rcl_action``'s ``action_client.c``.
"""

from __future__ import annotations

import logging
import time
import uuid
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    ActionResult,
    CancelAnswer,
    ConnectionState,
    EndpointInfo,
    EndpointKind,
    GoalStatus,
    Handle,
    Promise,
    QoS,
    Time,
)
from rosglass.comm.action_client import (
    FEEDBACK_DEPTH,
    GRACE_S,
    OUTAGE_S,
    ActionClient,
    ClientGoal,
)
from rosglass.comm.core import NodeMember
from rosglass.comm.executor import InOrder
from rosglass.comm.handle import guarded
from rosglass.comm.inbox import DuplicateFilter
from rosglass.comm.log_limits import LogOnce
from rosglass.errors import (
    ConnectionLostError,
    DecodeError,
    Error,
    GoalRejectedError,
    NodeClosedError,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
)
from rosglass.ros2.action_types import (
    CANCEL_GOAL,
    CANCEL_REASONS,
    FEEDBACK,
    GET_RESULT,
    NO_ID,
    SEND_GOAL,
    STATUS,
    STATUSES,
    ActionVersion,
    goal_info,
    part,
    stamp_of,
)
from rosglass.ros2.rmw_services import ActionServiceClient

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Call
    from rosglass.comm.wire import OnSample, Reader
    from rosglass.messages import ActionType, Message, MessageType
    from rosglass.ros2.action_types import ActionTypes
    from rosglass.ros2.core import Core

__all__ = ["Ros2ActionClient", "Ros2ClientGoal"]

_log = logging.getLogger("rosglass.ros2")
#: First second beyond the range of a time stamp, and its year.
_END_OF_TIME = 2**31, 2038
#: Seconds until a result is requested again, after a failed request or a final status.
_RETRY_S = 1.0
#: Seconds between further requests after a final status.
_OVERDUE_S = 5.0
#: Profile of the subscriptions. They do not request the status topic's latched array: a client
#: needs no status from before its goals, and some servers' topic is volatile.
_QOS = QoS()
#: The bytes of the goal's id in a feedback message, after the encapsulation header.
_ID = slice(4, 20)

_RANK = {
    GoalStatus.PENDING: 0,
    GoalStatus.ACCEPTED: 1,
    GoalStatus.EXECUTING: 2,
    GoalStatus.CANCELING: 3,
}
_END = 4


class Ros2ClientGoal(ClientGoal):
    """A goal of an action client: requests its acceptance and result, and follows its status.

    Args:
        client: Its client.
        id: Its id, 16 random bytes.
        goal: A message of the action's type, or its fields.
        timeout: Seconds for the server to appear and to accept or reject it.
        typed: Whether the action's type is known.
    """

    _client: Ros2ActionClient

    def __init__(
        self, client: Ros2ActionClient, id: bytes, goal: Any, timeout: float | None, *, typed: bool
    ) -> None:
        super().__init__(client, id, goal, timeout, typed=typed, jobs=InOrder(), log=_log)
        self._deadline = None if timeout is None else time.monotonic() + timeout
        self._accepted: Time | None = None
        #: Feedback from before the goal's acceptance.
        self._held: deque[Message] = deque(maxlen=FEEDBACK_DEPTH)
        self._early_status: tuple[GoalStatus, Time] | None = None
        self._sending: Call | None = None
        self._result_call: Call | None = None
        self._servers: frozenset[bytes | str] = frozenset()
        self._queried: frozenset[bytes | str] = frozenset()
        self._lost_at: float | None = None
        self._result_requested_at = 0.0

    @property
    def accepted(self) -> Time | None:
        """The time of acceptance, by the server's clock; None before."""
        return self._accepted

    # -- for its client --------------------------------------------------------------------------

    def _send(self) -> None:
        """Send the goal as soon as a server is available; again if the type has changed."""
        left = None if self._deadline is None else max(0.0, self._deadline - time.monotonic())
        call = self._client._send_goal_request(self, left)
        self._sending = call
        call.add_done_callback(lambda _: self._jobs.add(lambda: self._on_answer(call)))

    def _withdraw_request(self, service: ActionServiceClient) -> bool:
        """Withdraw the goal if its request was not sent yet; return whether that was so."""
        call, self._sending = self._sending, None  # the call's end must not end the goal
        if call is None or service.withdraw(call):
            return call is not None
        self._sending = call
        if call.done():
            self._jobs.add(lambda: self._on_answer(call))
        return False

    def _send_again(self, kind: MessageType) -> None:
        """Send the goal with another version of its type."""
        try:
            assert self.goal is not None  # an unsent goal has its message
            self.goal = kind.create(self.goal.to_dict())
            self._send()
        except Error as error:
            self._lose_later(error)

    def _lose_later(self, error: Error) -> None:
        self._jobs.add(lambda: self._end_as_lost(error))

    # -- sending ---------------------------------------------------------------------------------

    def _on_type(self) -> None:
        """Send the goal, now that the type is known."""
        if self._done.done():
            return
        kind = self._client.type
        try:
            if kind is None:
                raise self._client._client_closed_error()
            self.goal = kind.goal.create(self._given)
            self._send()
        except Error as error:
            self._end_as_lost(self._or_client_closed(error))

    def _on_timeout(self) -> None:
        if self.goal is None:
            self._end_as_lost(self._client._not_sent_error(self._timeout))

    def _on_answer(self, call: Call) -> None:
        """Handle the response to the goal request."""
        if call is not self._sending or self._status is not GoalStatus.PENDING:
            return
        if call.cancelled():
            result = ActionResult(GoalStatus.CANCELED, self._client._empty_result())
            self._end(GoalStatus.CANCELED, result)
            return
        error = call.exception(0)
        if error is None:
            response = call.result(0)
            if response.accepted:
                self._accept(stamp_of(response.stamp))
            else:
                text = f"the server of {self._client.name} does not accept goal {self.id_text}"
                self._end(GoalStatus.REJECTED, GoalRejectedError(text))
        elif self._early_status is not None:
            self._accept(self._early_status[1])  # the response was lost, but not the goal
        else:
            self._end_as_lost(self._explain(error))

    def _explain(self, error: BaseException) -> Error:
        name, seconds = self._client.name, self._timeout or 0.0
        if isinstance(error, ServiceUnavailableError):
            return self._client._not_sent_error(seconds)
        if isinstance(error, (TimeoutError, ConnectionLostError)):
            # It may have been accepted, or be later: no goal may run without its client.
            self._client._send_cancel_request(self.id, Time(), Promise(cancellable=False), 10.0)
        if isinstance(error, TimeoutError):
            return TimeoutError(
                f"the server of {name} neither accepted nor rejected goal {self.id_text} within "
                f"{seconds:g} s; it was asked to cancel it, should it accept it yet"
            )
        if isinstance(error, NodeClosedError) and not self._client.closed:
            return self._client._server_replaced_error()
        return error if isinstance(error, Error) else ConnectionLostError(str(error))

    def _accept(self, stamp: Time) -> None:
        self._accepted = stamp
        self._servers = self._client._servers()
        self._advance(GoalStatus.ACCEPTED)
        self._acceptance.set_result(True)
        early, self._early_status = self._early_status, None
        if early is not None:
            self._on_status(*early)
        while self._held:
            self._add_feedback(self._held.popleft())
        self._request_result_later(0.0)
        cancels, self._cancels = self._cancels, []
        for answer, deadline in cancels:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            self._after(
                0.0, partial(self._client._send_cancel_request, self.id, Time(), answer, left)
            )

    # -- while it runs ---------------------------------------------------------------------------

    def _on_status(self, status: GoalStatus, accepted: Time) -> None:
        """Handle an entry of the status topic."""
        if self._status is GoalStatus.PENDING:
            self._early_status = (status, accepted)
            return
        self._on_server_back()
        known = self._status
        self._advance(status)
        if known.is_active and not status.is_active:
            # The server has sent the result, which can be lost with a link.
            self._after(_RETRY_S, lambda: self._jobs.add(self._request_result_again))

    def _on_feedback(self, feedback: Message) -> None:
        """Handle feedback."""
        if self._status is GoalStatus.PENDING:
            self._held.append(feedback)
        elif not self._done.done():
            self._on_server_back()
            self._add_feedback(feedback)

    def _on_server_back(self) -> None:
        """Record that the goal has a server again, the former one or another."""
        if self._lost_at is not None:
            self._lost_at, self._servers = None, self._client._servers()

    def _advance(self, status: GoalStatus) -> None:
        """Adopt a status that is later than the current one; ignore others."""
        if _RANK.get(status, _END) > _RANK.get(self._status, _END):
            self._set_status(status)

    def _cancel(self, answer: Promise[CancelAnswer], timeout: float | None) -> None:
        call = self._sending
        if not self._status.is_active:
            answer.set_result(self._answer_after_end())
        elif self.goal is None:
            self._end(GoalStatus.CANCELED, self._without_result())
            answer.set_result(CancelAnswer((self.id,)))
        elif self._status is not GoalStatus.PENDING:
            self._client._send_cancel_request(self.id, Time(), answer, timeout)
        elif call is not None and self._client._withdraw_request(call):
            answer.set_result(CancelAnswer((self.id,)))
        else:
            # Only an accepted goal can be cancelled: wait for the server's response.
            failure = (
                f"{self._label} could not be cancelled within {timeout or 0.0:g} s: the server has "
                "neither accepted nor rejected it"
            )
            self._add_cancel(answer, timeout, failure)

    def _check_server(self) -> None:
        if self._status is GoalStatus.PENDING or self._done.done():
            return
        here = self._client._servers()
        now = time.monotonic()
        if not self._servers:
            self._servers = here
        if not self._status.is_active and now - self._result_requested_at >= _OVERDUE_S:
            self._request_result_again()
        if self._servers & here:
            if self._lost_at is not None:
                self._lost_at = None
                self._request_result_again()  # the request may have been lost with the link
            return
        if self._lost_at is None:
            self._lost_at = now
        if here - self._queried:
            # A server that replaced the goal's server reports the goal as unknown.
            self._queried |= here
            self._request_result_again()
        status = self._client._core.status()
        cut_off = not here and status.state is not ConnectionState.CONNECTED
        known = not self._status.is_active
        if now - self._lost_at >= (OUTAGE_S if cut_off and not known else GRACE_S):
            event = f"goal {self.id_text} ended; its outcome is unknown"
            if known:
                event = (
                    f"it sent the result of goal {self.id_text}, which has ended as "
                    f"{self._status.value}"
                )
            lost = f"the server of {self._client.name} went away before {event}"
            self._end_as_lost(ConnectionLostError(f"{lost} ({self._client._core.url}: {status})"))

    # -- the result ------------------------------------------------------------------------------

    def _request_result_later(self, delay: float) -> None:
        """Request the result after `delay` seconds, not on a thread of the middleware."""
        self._after(delay, lambda: self._jobs.add(self._request_result))

    def _request_result_again(self) -> None:
        asking, self._result_call = self._result_call, None
        if asking is not None:
            asking.cancel()
        if not self._done.done():
            self._request_result_later(0.0)

    def _request_result(self) -> None:
        if self._done.done() or self._result_call is not None:
            return
        try:
            call = self._client._send_result_request(self)
        except Error as error:
            self._end_as_lost(self._or_client_closed(error))
            return
        self._result_call, self._result_requested_at = call, time.monotonic()
        call.add_done_callback(lambda _: self._on_result(call))

    def _on_result(self, call: Call) -> None:
        """Handle the result's response, after feedback that was sent before it."""
        self._client._flush()
        self._jobs.add(lambda: self._take_result(call))

    def _take_result(self, call: Call) -> None:
        if call is not self._result_call:
            return
        self._result_call = None
        error = call.exception(0)
        if error is None:
            response = call.result(0)
            status = STATUSES.get(int(response.status))
            if status is None:
                lost = ConnectionLostError(
                    f"the server of {self._client.name} does not know goal {self.id_text} any "
                    "more: it was restarted, or did not keep the result for long enough"
                )
                self._end_as_lost(lost)
            elif status.is_active:
                self._request_result_later(_RETRY_S)  # the server does not wait for the end
            else:
                self._end(status, ActionResult(status, response.result))
        elif isinstance(error, NodeClosedError) or isinstance(error.__cause__, DecodeError):
            self._end_as_lost(self._or_client_closed(error))
        else:
            _log.debug("%s: asking for its result failed, trying again: %s", self._label, error)
            self._request_result_later(_RETRY_S)

    def _or_client_closed(self, error: BaseException) -> BaseException:
        """Return the goal's error: a request may fail before the client closes the goal."""
        if isinstance(error, NodeClosedError) and self._client.closed:
            return self._client._client_closed_error()
        return error

    def _end_as_lost(self, error: BaseException) -> None:
        """End the goal as LOST, unless it has ended."""
        self._end(GoalStatus.LOST, error)

    def _end(self, status: GoalStatus, end: ActionResult | BaseException) -> None:
        if self._done.done():
            return
        self._advance(status)
        asking, self._result_call = self._result_call, None
        if asking is not None:
            asking.cancel()
        self._finish(end)

    def _after(self, delay: float, job: Callable[[], None]) -> None:
        self._client._core.timers.after(delay, job)


class Ros2ActionClient(ActionClient, NodeMember):
    """An action client, for the version of the type that its server announces.

    Args:
        core: The node it belongs to.
        name: Absolute action name.
        wanted: The type, or its name to use the version that the server announces if the library
            has it; None uses whatever type the server announces.
    """

    _core: Core
    _goals: dict[bytes, Ros2ClientGoal]

    def __init__(self, core: Core, name: str, wanted: ActionType | str | None) -> None:
        super().__init__(core, name, _END_OF_TIME)
        self._version = ActionVersion(core, name, wanted)
        self._endpoints: _ClientEndpoints | None = None
        #: Jobs that wait for the type.
        self._held: list[Callable[[], None]] = []
        self._version.follow(retry=True)
        if self._version.types is not None:
            self._replace_endpoints(self._version.types)
        core.add(self)

    def _is_ready(self) -> bool:
        """Return whether all services of a server of this type are linked."""
        endpoints = self._endpoints
        return (
            endpoints is not None
            and not self._closed
            and all(end.ready for end in endpoints.services)
        )

    # -- sending and cancelling ------------------------------------------------------------------

    def _make_goal(self, goal: Any, timeout: float | None, *, typed: bool) -> Ros2ClientGoal:
        return Ros2ClientGoal(self, uuid.uuid4().bytes, goal, timeout, typed=typed)

    def _begin(self, goal: Ros2ClientGoal) -> None:
        if goal.goal is not None:
            goal._send()
        else:
            goal._wait()
            self._when_type_known(lambda: goal._jobs.add(goal._on_type))

    def _cancel_many(self, until: Time | None, timeout: float | None) -> Promise[CancelAnswer]:
        if until is None:
            for goal in self._open_goals():
                if goal.accepted is None:
                    goal.cancel(timeout)
        text = f"{self.name} has not answered the request to cancel"
        answer: Promise[CancelAnswer] = Promise(text, self._core.dispatcher, cancellable=False)
        self._send_cancel_request(NO_ID, until or Time(), answer, timeout)
        return answer

    def _send_goal_request(self, goal: Ros2ClientGoal, timeout: float | None) -> Call:
        """Send a goal."""
        request = {"goal_id": {"uuid": goal.id}, "goal": goal.goal}
        return self._open_ends().send_goal.call_async(request, timeout=timeout)

    def _send_result_request(self, goal: Ros2ClientGoal) -> Call:
        """Request a goal's result, without timeout."""
        request = {"goal_id": {"uuid": goal.id}}
        return self._open_ends().get_result.call_async(request, timeout=None)

    def _send_cancel_request(
        self, goal_id: bytes, stamp: Time, answer: Promise[CancelAnswer], timeout: float | None
    ) -> None:
        """Request to cancel goals: one, those accepted until a time, or all."""
        if self._endpoints is None and not self._closed:
            self._send_cancel_when_typed(goal_id, stamp, answer, timeout)
            return
        try:
            request = {"goal_info": goal_info(goal_id, stamp)}
            call = self._open_ends().cancel_goal.call_async(request, timeout=timeout)
        except Error as error:
            answer.set_exception(error)
            return
        call.add_done_callback(lambda _: self._on_cancel_answer(goal_id, call, answer, timeout))

    def _send_cancel_when_typed(
        self, goal_id: bytes, stamp: Time, answer: Promise[CancelAnswer], timeout: float | None
    ) -> None:
        until = None if timeout is None else time.monotonic() + timeout

        def ask() -> None:
            if not answer.done():
                left = None if until is None else max(0.0, until - time.monotonic())
                self._send_cancel_request(goal_id, stamp, answer, left)

        def give_up() -> None:
            if self._endpoints is None:
                answer.set_exception(self._not_cancelled_error(timeout))

        if timeout is not None:
            self._core.timers.after(timeout, give_up)
        self._when_type_known(ask)

    def _withdraw_request(self, call: Call) -> bool:
        """Withdraw a goal request that was not sent yet; return whether that was so."""
        endpoints = self._endpoints
        return endpoints is not None and endpoints.send_goal.withdraw(call)

    def _flush(self) -> None:
        """Deliver waiting feedback and status."""
        endpoints = self._endpoints
        if endpoints is not None:
            endpoints.flush()

    def _servers(self) -> frozenset[bytes | str]:
        """Return the identities of the servers of this type."""
        endpoints = self._endpoints
        return frozenset() if endpoints is None else endpoints.send_goal.server_ids()

    def _empty_result(self) -> Message:
        """Return a result with the type's defaults."""
        assert self.type is not None  # goals exist only with a type
        return self.type.result.create()

    def _server_replaced_error(self) -> ConnectionLostError:
        """Return the error of goals whose server was replaced by one of another version."""
        return ConnectionLostError(
            f"the server of {self.name} was replaced by one with another definition of the type; "
            "the outcome of the goal is unknown"
        )

    def _on_cancel_answer(
        self, goal_id: bytes, call: Call, answer: Promise[CancelAnswer], timeout: float | None
    ) -> None:
        """Handle the response to a request to cancel."""
        error = call.exception(0)
        if isinstance(error, TimeoutError):
            error = TimeoutError(
                f"{self.name} did not answer the request to cancel within {timeout:g} s; some "
                "servers answer only while their program looks for such requests. It may cancel "
                "all the same: watch the goal's status"
            )
        elif isinstance(error, ServiceUnavailableError):
            error = self._not_cancelled_error(timeout)
        if error is not None:
            answer.set_exception(error)
            return
        response = call.result(0)
        accepted = tuple(bytes(info.goal_id.uuid) for info in response.goals_canceling)
        for each in accepted:
            goal = self._goals.get(each)
            if goal is not None:
                goal._jobs.add(partial(goal._advance, GoalStatus.CANCELING))
        code = int(response.return_code)
        reason = CANCEL_REASONS.get(code, f"the server answers with the unknown code {code}")
        got = goal_id in accepted if goal_id != NO_ID else bool(accepted)
        answer.set_result(CancelAnswer(accepted, "" if got else reason))

    # -- following the graph ---------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - definitions may be added
        """Update the type, readiness and goals after a change of the graph."""
        if self._closed:
            return
        if self._version.follow(retry=idle) and self._version.types is not None:
            self._replace_endpoints(self._version.types)
        self._log_conflicts(_log, logging.INFO if self._version.pending else logging.WARNING)
        self._readiness.update()
        for goal in self._open_goals():
            goal._jobs.add(goal._check_server)

    def _replace_endpoints(self, types: ActionTypes) -> None:
        """Replace the endpoints with those for a version of the type."""
        endpoints = _ClientEndpoints(self._core, self.name, types, self._goals)
        with self._lock:
            old, self._endpoints = self._endpoints, endpoints
            self.type = types.action
            closed = self._closed
            goals = list(self._goals.values())
            held, self._held = self._held, []
        if closed:
            endpoints.close()
        for job in held:
            job()
        if old is None:
            return
        for goal in goals:
            if goal._withdraw_request(old.send_goal):
                goal._send_again(types.action.goal)
            elif goal.accepted is not None:
                goal._lose_later(self._server_replaced_error())
        old.close()

    def _when_type_known(self, job: Callable[[], None]) -> None:
        """Run a job as soon as the type is known."""
        with self._lock:
            if self._endpoints is None and not self._closed:
                self._held.append(job)
                return
        job()

    def _server_conflicts(self) -> list[str]:
        problems = self._version.server_conflicts()
        endpoints = self._endpoints
        if not problems and endpoints is not None:
            problems = [
                end.middleware_problem for end in endpoints.services if end.middleware_problem
            ]
        return list(dict.fromkeys(problems))

    def _unavailable_reason(self) -> str:
        endpoints = self._endpoints
        if endpoints is not None and any(end.server_ids() for end in endpoints.services):
            missing = ", ".join(end.name for end in endpoints.services if not end.ready)
            return f"its server is incomplete, or not linked yet: {missing} does not answer"
        graph = self._core.graph
        offered = [
            name
            for name in graph.actions()
            if graph.endpoints(EndpointKind.SERVICE_SERVER, part(name, SEND_GOAL))
        ]
        return self._no_server_message(offered)

    # -- closing ---------------------------------------------------------------------------------

    def _withdraw(self) -> None:
        with self._lock:
            endpoints, held, self._held = self._endpoints, self._held, []
        for goal in self._open_goals():
            goal._lose_later(self._client_closed_error())
        for job in held:
            job()  # fails, as the client is closed
        if endpoints is not None:
            endpoints.close()
        self._core.remove(self)

    def _open_ends(self) -> _ClientEndpoints:
        self._check_open()
        assert self._endpoints is not None  # there is a type
        return self._endpoints


class _ClientEndpoints(Handle):
    """The service clients and readers of an action client, for one version of the type.

    Args:
        core: The node.
        name: Absolute name of the action.
        types: The types.
        goals: The client's goals by their ids.
    """

    def __init__(
        self, core: Core, name: str, types: ActionTypes, goals: dict[bytes, Ros2ClientGoal]
    ) -> None:
        self._core, self._name, self._goals = core, name, goals
        self._log_once = LogOnce()
        self.types = types
        self.send_goal = ActionServiceClient(core, part(name, SEND_GOAL), types.send_goal)
        self.cancel_goal = ActionServiceClient(core, part(name, CANCEL_GOAL), types.cancel_goal)
        self.get_result = ActionServiceClient(
            core, part(name, GET_RESULT), types.get_result, waits_for_reconnect=True
        )
        self.services = (self.send_goal, self.cancel_goal, self.get_result)
        self._readers = [
            self._read(FEEDBACK, types.feedback),
            self._read(STATUS, types.status),
        ]

    def flush(self) -> None:
        """Deliver the waiting samples of both topics, in the calling thread."""
        for reader in self._readers:
            reader.flush()

    def close(self) -> None:
        """Close all endpoints; pending calls fail."""
        for end in (*self.services, *self._readers):
            end.close()

    def _read(self, topic: str, kind: MessageType) -> Reader:
        """Create the reader of one of the action's topics."""
        core, full = self._core, part(self._name, topic)
        endpoint = EndpointInfo(
            EndpointKind.SUBSCRIPTION, full, kind.name, core.name, _QOS, kind.rihs01
        )
        return core.middleware.create_reader(endpoint, self._sample_handler(topic, kind))

    def _sample_handler(self, topic: str, kind: MessageType) -> OnSample:
        """Return the function that receives a topic's samples."""
        ours, repeats, feedback = kind.rihs01, DuplicateFilter(), topic == FEEDBACK

        def receive(
            data: bytes | memoryview,
            received: int,  # noqa: ARG001 - part of OnSample
            sent: int | None,
            gid: bytes,
            sequence: int,
            hash: str,
        ) -> None:
            with guarded(_log, "%s: taking %s failed", self._name, topic):
                try:
                    if hash not in ("", ours):
                        text = f"another definition of {kind.name} ({hash}, ours is {ours})"
                        self._log_ignored(topic, gid, text)
                    elif not repeats.is_duplicate(gid, sequence, sent):
                        if feedback:
                            self._take_feedback(kind, data)
                        else:
                            self._take_status(kind, data)
                except DecodeError as error:
                    self._log_ignored(topic, gid, str(error))

        return receive

    def _take_feedback(self, kind: MessageType, data: bytes | memoryview) -> None:
        goal = self._goals.get(bytes(data[_ID]))
        if goal is None and len(data) >= _ID.stop:
            return  # another client's
        kind.validate(data)
        if goal is not None:
            goal._jobs.add(partial(goal._on_feedback, kind.decode(data).feedback))

    def _take_status(self, kind: MessageType, data: bytes | memoryview) -> None:
        kind.validate(data)
        for entry in kind.decode(data).status_list:
            goal = self._goals.get(bytes(entry.goal_info.goal_id.uuid))
            status = STATUSES.get(int(entry.status))
            if goal is not None and status is not None:
                stamp = stamp_of(entry.goal_info.stamp)
                goal._jobs.add(partial(goal._on_status, status, stamp))

    def _log_ignored(self, topic: str, gid: bytes, reason: str) -> None:
        """Log an ignored sample, once for each publisher."""
        if not self._log_once.is_first((topic, gid)):
            return
        publishers = self._core.graph.endpoints(EndpointKind.PUBLISHER, part(self._name, topic))
        who = [found.node.full for found in publishers if found.gid == gid] or [f"gid {gid.hex()}"]
        _log.warning("%s: ignoring %s of %s: %s", self._name, topic, who[0], reason)
