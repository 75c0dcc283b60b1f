"""Action clients and their goals.

The course of a goal depends on the protocol: ``ros1/actionlib_client.py`` and
``ros2/action_client.py`` implement it, and update the classes here, which users see.
"""

from __future__ import annotations

import threading
import time
from abc import abstractmethod
from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from rosglass.comm.client import Client, copy_value
from rosglass.comm.handle import Executor, Handle
from rosglass.comm.listeners import Listeners
from rosglass.comm.names import similar
from rosglass.comm.promise import Promise, check_timeout
from rosglass.comm.rclpy_names import hint_at_members
from rosglass.comm.time import Time
from rosglass.errors import (
    ArgumentError,
    NodeClosedError,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
)

if TYPE_CHECKING:
    import logging
    from collections.abc import Callable, Iterable, Sequence

    from rosglass.comm.core import NodeCore
    from rosglass.comm.executor import InOrder
    from rosglass.messages import ActionType, Message

    _T = TypeVar("_T")

__all__ = [
    "FEEDBACK_DEPTH",
    "GRACE_S",
    "OUTAGE_S",
    "ActionClient",
    "ActionResult",
    "CancelAnswer",
    "ClientGoal",
    "GoalStatus",
]

#: Maximum number of feedback messages that wait for a slow callback.
FEEDBACK_DEPTH = 10
#: How long a goal's server may be unavailable before the goal counts as lost.
GRACE_S = 5.0
#: The same while this node is disconnected, so that the server's state is unknown.
OUTAGE_S = 10.0


class GoalStatus(Enum):
    """The status of a goal."""

    PENDING = "pending"
    REJECTED = "rejected"
    ACCEPTED = "accepted"
    EXECUTING = "executing"
    CANCELING = "canceling"
    SUCCEEDED = "succeeded"
    CANCELED = "canceled"
    ABORTED = "aborted"
    #: The server left, or never appeared: its end is unknown.
    LOST = "lost"

    @property
    def is_active(self) -> bool:
        """True until the goal has ended."""
        return self in _ACTIVE


_ACTIVE = (GoalStatus.PENDING, GoalStatus.ACCEPTED, GoalStatus.EXECUTING, GoalStatus.CANCELING)


class ActionResult(NamedTuple):
    """The outcome of a goal.

    Attributes:
        status: SUCCEEDED, CANCELED or ABORTED.
        result: The server's result; the type's defaults if the goal was cancelled before it was
            sent.
    """

    status: GoalStatus
    result: Message


class CancelAnswer(NamedTuple):
    """A server's answer to a request to cancel.

    Attributes:
        accepted: Ids of the goals that are being cancelled.
        reason: Why no goal is being cancelled, in words; empty if one is.
    """

    accepted: tuple[bytes, ...]
    reason: str = ""


@hint_at_members
class ClientGoal(Handle):
    """A goal that was sent; callbacks always receive this object.

    Closing it ends its callbacks and promises; the goal itself continues at the server.

    Its state changes in jobs only, which run one at a time whatever thread adds them: it needs no
    lock, and callbacks run in order.

    Args:
        client: Its client.
        id: Its id.
        goal: The goal message, or the value to make it from while the type is unknown.
        timeout: Seconds for the server to appear and to answer it; None for no limit.
        typed: Whether the action's type is known.
        jobs: Runs the jobs.
        log: Where problems are logged.

    Attributes:
        id: 16 bytes (a UUID) in ROS 2; a UTF-8 string in ROS 1.
        goal: The goal message; None while the action's type is not discovered yet.
    """

    id: bytes
    goal: Message | None
    _client: ActionClient

    def __init__(
        self,
        client: ActionClient,
        id: bytes,
        goal: Any,
        timeout: float | None,
        *,
        typed: bool,
        jobs: InOrder,
        log: logging.Logger,
    ) -> None:
        self._client, self.id, self.goal = client, id, goal if typed else None
        self._given, self._timeout, self._jobs, self._log = goal, timeout, jobs, log
        self._dispatcher = dispatcher = client._core.dispatcher
        self._status = GoalStatus.PENDING
        self._feedback: Message | None = None
        self._label = label = f"goal {self.id_text} of {client.name}"
        self._acceptance: Promise[bool] = Promise(
            f"{label} was neither accepted nor rejected", dispatcher, cancellable=False
        )
        self._done: Promise[ActionResult] = Promise(
            f"{label} has not ended, and continues: no result", dispatcher, cancellable=False
        )
        self._feedback_listeners: Listeners[Message] = Listeners(depth=FEEDBACK_DEPTH, where=label)
        self._status_listeners: Listeners[GoalStatus] = Listeners(where=label)
        #: Unanswered requests to cancel it, and the monotonic time of their deadlines.
        self._cancels: list[tuple[Promise[CancelAnswer], float | None]] = []
        #: The timeout of the wait for a server.
        self._server_timeout: Handle | None = None
        self._logged_slow = False

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
        """The status, as last received.

        In ROS 1 it is PENDING until the server executes the goal, and CANCELING once the server
        reports a preempt request; recalled and preempted goals are both CANCELED.
        """
        return self._status

    @property
    @abstractmethod
    def accepted(self) -> Time | None:
        """The time of acceptance, by the server's clock; None before."""

    @property
    def feedback(self) -> Message | None:
        """The newest feedback; None before the first."""
        return self._feedback

    @property
    def acceptance(self) -> Promise[bool]:
        """The server's decision: True if it accepts the goal; an error if it did not answer."""
        return self._acceptance

    @property
    def done(self) -> Promise[ActionResult]:
        """The end: a result, or one of :meth:`result`'s errors; it cannot be cancelled."""
        return self._done

    def result(self, timeout: float | None = None) -> ActionResult:
        """Wait for the end, and return the result.

        Args:
            timeout: Seconds to wait; None waits forever.

        Raises:
            TimeoutError: The goal did not end in time, and continues; or the server did not accept
                it within the timeout of send_goal() (status LOST).
            GoalRejectedError: The server rejected it.
            ServiceUnavailableError: No server appeared within the timeout of send_goal(), or the
                goal was cancelled before the action's type was discovered (status CANCELED).
            ConversionError: A value does not fit the type, which was discovered after sending.
            ServiceError: The server's answer cannot be decoded.
            ConnectionLostError: The server left before the end.
            NodeClosedError: The client is closed, or is closed during the wait.
        """
        return self._done.result(timeout)

    def cancel(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Request the server to cancel it, without waiting. A goal not sent yet is not sent.

        ROS 1 servers do not answer; the status of the goal shows whether they got the request.

        Args:
            timeout: Seconds after which the promise ends with a TimeoutError; None for no limit.
                Some servers never answer.
        """
        timeout = check_timeout(timeout, self._label)
        answer: Promise[CancelAnswer] = Promise(
            f"the server has not answered the request to cancel {self._label}",
            self._dispatcher,
            cancellable=False,
        )
        self._jobs.add(lambda: self._cancel(answer, timeout))
        return answer

    def on_feedback(
        self, callback: Callable[[Message], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each feedback from now on.

        Args:
            callback: Called with the feedback; if it is slow, with the newest only.
            executor: Where it runs; None for the node's own dispatcher thread.
        """
        return self._listen(self._feedback_listeners, callback, executor)

    def on_status_change(
        self, callback: Callable[[GoalStatus], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each new status from now on; arguments as :meth:`on_feedback`."""
        return self._listen(self._status_listeners, callback, executor)

    def _listen(
        self, listeners: Listeners[_T], callback: Callable[[_T], None], executor: Executor | None
    ) -> Handle:
        if not callable(callback):
            raise ArgumentError("callback", callback, "something that can be called", self._label)
        return listeners.add(callback, executor or self._dispatcher)

    def close(self) -> None:
        """End callbacks and promises; the goal itself continues. Safe to call twice."""
        self._feedback_listeners.clear()
        self._status_listeners.clear()
        error = NodeClosedError(f"{self._label} was closed: its end is unknown")
        self._jobs.add(lambda: self._end_as_lost(error))

    # -- the protocol, in jobs -------------------------------------------------------------------

    @abstractmethod
    def _cancel(self, answer: Promise[CancelAnswer], timeout: float | None) -> None:
        """Request the server to cancel it, or end it if it was not sent yet."""

    @abstractmethod
    def _end_as_lost(self, error: BaseException) -> None:
        """End it as LOST, unless it has ended."""

    @abstractmethod
    def _on_timeout(self) -> None:
        """End it at its timeout, unless a server has answered."""

    # -- for the protocol, in jobs ---------------------------------------------------------------

    def _wait(self) -> None:
        """Start the timeout of the wait for a server."""
        if self._timeout is not None and not self._done.done():
            give_up = partial(self._jobs.add, self._on_timeout)
            self._server_timeout = self._client._core.timers.after(self._timeout, give_up)

    def _set_status(self, status: GoalStatus) -> None:
        self._status = status
        self._status_listeners.notify(status)

    def _add_feedback(self, feedback: Message) -> None:
        self._feedback = feedback
        if not self._feedback_listeners.notify(feedback) and not self._logged_slow:
            self._logged_slow = True
            self._log.warning(
                "%s: feedback arrives faster than a callback handles it: the newest %d are kept",
                self._label,
                FEEDBACK_DEPTH,
            )

    def _finish(self, end: ActionResult | BaseException) -> None:
        """End it with its result, or with the error if there is none."""
        self._client._forget(self)
        cancels, self._cancels = self._cancels, []
        for answer, _ in cancels:
            answer.set_result(self._answer_after_end())
        if self._server_timeout is not None:
            self._server_timeout.close()
        if isinstance(end, ActionResult):
            self._acceptance.set_result(False)  # unless it was accepted
            self._done.set_result(end)
            return
        if self._status in (GoalStatus.REJECTED, GoalStatus.CANCELED):
            self._acceptance.set_result(False)
        else:
            self._acceptance.set_exception(end)
        self._done.set_exception(end)

    def _add_cancel(
        self, answer: Promise[CancelAnswer], timeout: float | None, failure: str
    ) -> None:
        """Add a pending request to cancel, which fails after `timeout` seconds."""
        deadline = None if timeout is None else time.monotonic() + timeout
        self._cancels.append((answer, deadline))
        if timeout is not None:
            error = TimeoutError(failure)
            self._client._core.timers.after(timeout, lambda: answer.set_exception(error))

    def _answer_after_end(self) -> CancelAnswer:
        """Return the answer to a request to cancel the goal that arrives after its end."""
        return CancelAnswer((), f"the goal has ended already: {self._status.value}")

    def _without_result(self) -> ServiceUnavailableError:
        """Return the error of a goal that was cancelled while its type was unknown."""
        return ServiceUnavailableError(
            f"{self._label} was cancelled before its type was discovered: no result"
        )


@hint_at_members
class ActionClient(Client):
    """Sends goals to an action; created by :meth:`Node.create_action_client`.

    After closing it, its goals continue at the server: cancel them first if they must not.

    Args:
        core: The node it belongs to.
        name: Absolute action name.
        end_of_time: First time that the protocol's messages cannot carry: seconds since 1970, and
            the year.

    Attributes:
        name: Absolute action name.
        type: The action type; None while it is not discovered yet.
    """

    type: ActionType | None

    def __init__(self, core: NodeCore, name: str, end_of_time: tuple[int, int]) -> None:
        super().__init__(core, name)
        self.type = None
        self._end_of_time = end_of_time
        #: Guards the goals, and that none is added after closing.
        self._lock = threading.Lock()
        #: Goals that have not ended, by id; of the protocol's own class.
        self._goals: dict[bytes, Any] = {}

    def __repr__(self) -> str:
        kind = self.type.name if self.type is not None else "type not known yet"
        return f"<{type(self).__name__} {self.name} [{kind}]>"

    @property
    def closed(self) -> bool:
        """True once the client or its node was closed."""
        return self._closed or self._core.closed

    @property
    def goals(self) -> Sequence[ClientGoal]:
        """The client's goals that have not ended, in order of sending."""
        return tuple(self._open_goals())

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
        """Send a goal as soon as a server is available; does not wait.

        If the server does not answer within `timeout`, the goal ends, and the server is requested
        to cancel it in case it has accepted it, so that no unobserved goal runs.

        Args:
            goal: A message or a dict of fields; missing fields, and None, get the defaults.
            on_feedback: Called with each feedback.
            on_status_change: Called with each new status.
            on_done: Called with the goal when it has ended, in any way.
            executor: Where callbacks run; None for the node's own dispatcher thread.
            timeout: Seconds for the server to appear and to accept or reject it; None for no limit.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent. If the type is not
                discovered yet, the goal ends with that error instead.
            ArgumentError: A callback is not callable, or the executor is not an Executor.
            NodeClosedError: The client is closed.
        """
        made: ClientGoal = self._new_goal(
            goal, timeout, executor, on_feedback, on_status_change, on_done
        )
        self._begin(made)
        return made

    def _new_goal(
        self,
        goal: Any,
        timeout: float | None,
        executor: Executor | None,
        on_feedback: Callable[[Message], None] | None,
        on_status_change: Callable[[GoalStatus], None] | None,
        on_done: Callable[[ClientGoal], None] | None,
    ) -> Any:
        """Return a goal that is not sent yet; see :meth:`send_goal`."""
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        if executor is not None and not isinstance(executor, Executor):
            raise ArgumentError("executor", executor, "a rosglass.comm.Executor", self.name)
        kind = self.type
        value = copy_value(goal, self.name) if kind is None else kind.goal.create(goal)
        made = self._make_goal(value, timeout, typed=kind is not None)
        if on_feedback is not None:
            made.on_feedback(on_feedback, executor)
        if on_status_change is not None:
            made.on_status_change(on_status_change, executor)
        if on_done is not None:
            if not callable(on_done):
                raise ArgumentError("on_done", on_done, "something that can be called", self.name)
            made.done.on_done(lambda _: on_done(made), executor)
        with self._lock:
            if not self._closed:
                self._goals[made.id] = made
        return made

    def cancel_all(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Request the server to cancel all goals, other clients' too; does not wait.

        Goals of this client that wait for a server are not sent.

        Args:
            timeout: Seconds for the server to appear and to answer; None for no limit.
        """
        self._check_open()
        return self._cancel_many(None, check_timeout(timeout, self.name))

    def cancel_before(self, time: Time, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Request the server to cancel all goals that it accepted at or before `time`.

        Args:
            time: By the server's clock, e.g. :attr:`ClientGoal.accepted`; in ROS 1, by the clocks
                of the goals' clients. Actionlib's servers also cancel goals with such a stamp that
                arrive later.
            timeout: As for :meth:`cancel_all`.

        Raises:
            ArgumentError: It is not a time after the epoch that a message can carry.
        """
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        seconds, year = self._end_of_time
        if not isinstance(time, Time) or not 0 < time.nanoseconds < seconds * 1_000_000_000:
            expected = f"a rosglass.Time between 1970 and {year}; cancel_all() cancels all goals"
            raise ArgumentError("time", time, expected, self.name)
        return self._cancel_many(time, timeout)

    def close(self) -> None:
        """Close the client; its goals end here, but continue at the server. Safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        if self._core.forked:
            return
        self._withdraw()
        self._readiness.close()

    # -- the protocol ----------------------------------------------------------------------------

    @abstractmethod
    def _make_goal(self, goal: Any, timeout: float | None, *, typed: bool) -> ClientGoal:
        """Return a goal that is not sent yet; `typed` as in :class:`ClientGoal`."""

    @abstractmethod
    def _begin(self, goal: Any) -> None:
        """Send a goal, now or once a server is available."""

    @abstractmethod
    def _cancel_many(self, until: Time | None, timeout: float | None) -> Promise[CancelAnswer]:
        """Request the server to cancel the goals accepted until a time, or all."""

    @abstractmethod
    def _withdraw(self) -> None:
        """End the goals and leave the graph."""

    # -- for the protocol ------------------------------------------------------------------------

    def _open_goals(self) -> list[Any]:
        with self._lock:
            return list(self._goals.values())

    def _forget(self, goal: ClientGoal) -> None:
        """Remove a goal that has ended."""
        with self._lock:
            self._goals.pop(goal.id, None)

    def _client_closed_error(self) -> NodeClosedError:
        """Return the error of goals whose client was closed."""
        return NodeClosedError(
            f"the client of {self.name} was closed before the goal ended, which continues"
        )

    def _not_sent_error(self, timeout: float | None) -> ServiceUnavailableError:
        """Return the error of goals that found no server within `timeout` seconds."""
        why = self.problem or "its server appeared too late"
        return ServiceUnavailableError(
            f"no goal could be sent to {self.name} within {timeout or 0.0:g} s: {why}"
        )

    def _not_cancelled_error(self, timeout: float | None) -> ServiceUnavailableError:
        """Return the error of requests to cancel that found no server within `timeout` seconds."""
        why = self.problem or "its server appeared too late"
        return ServiceUnavailableError(
            f"{self.name} could not be asked to cancel within {timeout or 0.0:g} s: {why}"
        )

    def _no_server_message(self, offered: Iterable[str]) -> str:
        """Return the message that the action has no server, with a hint at a similar one."""
        kind = "" if self.type is None else f" [{self.type.name}]"
        return (
            f"no server offers the action {self.name}{kind} on {self._core.url} "
            f"({self._core.status()}){similar(self.name, offered)}"
        )
