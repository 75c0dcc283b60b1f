"""Sending goals to an action: the client, and its goals from their sending to their end.

What becomes of a goal depends on the protocol: ``ros1/actionlib_client.py`` and
``ros2/action_client.py`` follow it, and put here what users see of it.
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

#: Feedback that waits for a slow callback.
FEEDBACK_DEPTH = 10
#: Time that a goal's server may be away before the goal counts as lost.
GRACE_S = 5.0
#: The same while this program itself is cut off, when nothing can be said of the server.
OUTAGE_S = 10.0


class GoalStatus(Enum):
    """What has become of a goal."""

    PENDING = "pending"
    REJECTED = "rejected"
    ACCEPTED = "accepted"
    EXECUTING = "executing"
    CANCELING = "canceling"
    SUCCEEDED = "succeeded"
    CANCELED = "canceled"
    ABORTED = "aborted"
    #: The server went away, or never came: nobody knows.
    LOST = "lost"

    @property
    def is_active(self) -> bool:
        """Whether the goal has not ended."""
        return self in _ACTIVE


_ACTIVE = (GoalStatus.PENDING, GoalStatus.ACCEPTED, GoalStatus.EXECUTING, GoalStatus.CANCELING)


class ActionResult(NamedTuple):
    """How a goal ended.

    Attributes:
        status: SUCCEEDED, CANCELED or ABORTED.
        result: What the server sent with it; the type's defaults for a goal that was cancelled
            before it was sent.
    """

    status: GoalStatus
    result: Message


class CancelAnswer(NamedTuple):
    """What a server answers to a request to cancel.

    Attributes:
        accepted: Ids of the goals that are being cancelled.
        reason: Why there are none, in words; empty when there are.
    """

    accepted: tuple[bytes, ...]
    reason: str = ""


@hint_at_members
class ClientGoal(Handle):
    """A goal that was sent; the same object in every callback, for as long as it lives.

    Closing it ends its callbacks and the waiting; the goal itself goes on at the server.

    All that happens to it happens in jobs that run one after the other, whatever thread they come
    from: its state needs no lock, and callbacks come in order.

    Args:
        client: Its client.
        id: Its id.
        goal: What is asked for: a message of the action's type, or what becomes one.
        timeout: Seconds for the server to appear and to answer it, None for ever.
        typed: Whether the action's type is known.
        jobs: Runs the jobs.
        log: Where is logged what users should know.

    Attributes:
        id: 16 bytes (a UUID) in ROS 2; a text in UTF-8 in ROS 1.
        goal: What was asked for; None while the action's type is not discovered yet.
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
            f"{label} has not ended, and goes on: no result", dispatcher, cancellable=False
        )
        self._feedback_listeners: Listeners[Message] = Listeners(depth=FEEDBACK_DEPTH, where=label)
        self._status_listeners: Listeners[GoalStatus] = Listeners(where=label)
        #: Requests to cancel it that are not answered, and the monotonic time of their end.
        self._cancels: list[tuple[Promise[CancelAnswer], float | None]] = []
        #: Ends the waiting for a server.
        self._waiting: Handle | None = None
        self._slow = False

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id_text} {self.status.value}>"

    @property
    def id_text(self) -> str:
        """The id as ROS's tools print it.

        In ROS 2, 32 hexadecimal digits (some logs put dashes in); in ROS 1, the text that it is.
        """
        return self.id.hex()

    @property
    def status(self) -> GoalStatus:
        """What has become of it, as last heard.

        In ROS 1, PENDING until the server executes it, and CANCELING once the server says that it
        is about to end for that; recalled and preempted goals are both CANCELED.
        """
        return self._status

    @property
    @abstractmethod
    def accepted(self) -> Time | None:
        """When the server accepted it, by the server's clock; None before."""

    @property
    def feedback(self) -> Message | None:
        """The newest feedback; None before the first."""
        return self._feedback

    @property
    def acceptance(self) -> Promise[bool]:
        """The server's decision: whether it accepts the goal, or why it could not be asked."""
        return self._acceptance

    @property
    def done(self) -> Promise[ActionResult]:
        """The end: a result, or one of :meth:`result`'s errors. Cannot be cancelled itself."""
        return self._done

    def result(self, timeout: float | None = None) -> ActionResult:
        """Wait for the end.

        Args:
            timeout: Seconds to wait, None for ever.

        Raises:
            TimeoutError: It has not ended within the time, and goes on; or the server did not
                accept it within the time given to send_goal() (status LOST).
            GoalRejectedError: The server did not accept it.
            ServiceUnavailableError: No server appeared within the time given to send_goal(), or the
                goal was cancelled before any server told the action's type (status CANCELED).
            ConversionError: A value does not fit the type, which was discovered after sending.
            ServiceError: The server's answer cannot be decoded.
            ConnectionLostError: The server went away before the end.
            NodeClosedError: The client is closed, or gets closed meanwhile.
        """
        return self._done.result(timeout)

    def cancel(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel it; returns at once. A goal not sent yet is not sent at all.

        ROS 1 servers do not answer; their status of the goal shows that they know of it.

        Args:
            timeout: Seconds for the server to answer, None for ever; then a TimeoutError. Some
                servers never answer.
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
            callback: Told the feedback; when it is slow, the newest ones only.
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
        """Watch it no longer; the goal itself goes on. Safe to call twice."""
        self._feedback_listeners.clear()
        self._status_listeners.clear()
        error = NodeClosedError(f"{self._label} is not watched any more: it was closed")
        self._jobs.add(lambda: self._lose(error))

    # -- what the protocol does, in jobs ---------------------------------------------------------

    @abstractmethod
    def _cancel(self, answer: Promise[CancelAnswer], timeout: float | None) -> None:
        """Ask the server to cancel it, or end it if it was not sent yet."""

    @abstractmethod
    def _lose(self, error: BaseException) -> None:
        """End it as LOST, unless it has ended."""

    @abstractmethod
    def _give_up(self) -> None:
        """End it, unless a server has answered it: the time for that is over."""

    # -- what becomes of it, in jobs -------------------------------------------------------------

    def _wait(self) -> None:
        """Give up waiting for a server after its time."""
        if self._timeout is not None and not self._done.done():
            give_up = partial(self._jobs.add, self._give_up)
            self._waiting = self._client._core.timers.after(self._timeout, give_up)

    def _set_status(self, status: GoalStatus) -> None:
        self._status = status
        self._status_listeners.notify(status)

    def _add_feedback(self, feedback: Message) -> None:
        self._feedback = feedback
        if not self._feedback_listeners.notify(feedback) and not self._slow:
            self._slow = True
            self._log.warning(
                "%s: feedback comes faster than a callback takes it: only the newest %d wait",
                self._label,
                FEEDBACK_DEPTH,
            )

    def _finish(self, end: ActionResult | BaseException) -> None:
        """End it, as its status says: with a result, or with why there is none."""
        self._client._forget(self)
        cancels, self._cancels = self._cancels, []
        for answer, _ in cancels:
            answer.set_result(self._too_late())
        if self._waiting is not None:
            self._waiting.close()
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
        """Let a request to cancel wait for `timeout` seconds; then it fails."""
        deadline = None if timeout is None else time.monotonic() + timeout
        self._cancels.append((answer, deadline))
        if timeout is not None:

            def give_up() -> None:
                answer.set_exception(TimeoutError(failure))

            self._client._core.timers.after(timeout, give_up)

    def _too_late(self) -> CancelAnswer:
        """Return the answer to a request to cancel it after its end."""
        return CancelAnswer((), f"the goal has ended already: {self._status.value}")

    def _without_result(self) -> ServiceUnavailableError:
        """Return the end of a goal that was cancelled while its type was not known."""
        return ServiceUnavailableError(
            f"{self._label} was cancelled before any server told its type: no result"
        )


@hint_at_members
class ActionClient(Client):
    """Sends goals to an action; made by :meth:`Node.create_action_client`.

    Closing it leaves its goals to the server: cancel them first if they must not go on.

    Args:
        core: The node it belongs to.
        name: Absolute action name.
        end_of_time: Seconds since 1970 that the protocol's messages cannot carry any more, and the
            year that this is.

    Attributes:
        name: Absolute action name.
        type: The action type; None while it is not discovered yet.
    """

    type: ActionType | None

    def __init__(self, core: NodeCore, name: str, end_of_time: tuple[int, int]) -> None:
        super().__init__(core, name)
        self.type = None
        self._end_of_time = end_of_time
        self._lock = threading.Lock()
        #: Those that have not ended, by their ids; of the protocol's own class.
        self._goals: dict[bytes, Any] = {}

    def __repr__(self) -> str:
        kind = self.type.name if self.type is not None else "type not known yet"
        return f"<{type(self).__name__} {self.name} [{kind}]>"

    @property
    def closed(self) -> bool:
        """Whether :meth:`close` was called, of the client or of its node."""
        return self._closed or self._core.closed

    @property
    def goals(self) -> Sequence[ClientGoal]:
        """The goals of this client that have not ended, in order of sending."""
        return tuple(self._live())

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
        """Send a goal, as soon as a server is there, and return at once.

        A goal that the server does not answer within `timeout` is given up, and the server is
        asked to cancel it, should it have accepted it: nothing runs that nobody watches.

        Args:
            goal: A message or a dict of fields; missing fields, and None, get the defaults.
            on_feedback: Called with each feedback.
            on_status_change: Called with each new status.
            on_done: Called with the goal when it has ended, one way or another.
            executor: Where callbacks run; None for the node's own dispatcher thread.
            timeout: Seconds for the server to appear and to accept or reject it; None for ever.

        Raises:
            ConversionError: A value does not fit its field; nothing is sent. While the type is not
                discovered yet, that shows later: the goal ends with it.
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
        """Ask the server to cancel all its goals, other clients' too; returns at once.

        Goals of this client that wait for a server are not sent any more.

        Args:
            timeout: Seconds for the server to appear and to answer, None for ever.
        """
        self._check_open()
        return self._cancel_many(None, check_timeout(timeout, self.name))

    def cancel_before(self, time: Time, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel all goals that it accepted at or before `time`.

        Args:
            time: By the server's clock, e.g. :attr:`ClientGoal.accepted`; in ROS 1, by the clocks
                of those who sent the goals. Servers of actionlib cancel goals with such a stamp
                that come later, too.
            timeout: As for :meth:`cancel_all`.

        Raises:
            ArgumentError: It is no time after the epoch that a message can carry.
        """
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        seconds, year = self._end_of_time
        if not isinstance(time, Time) or not 0 < time.nanoseconds < seconds * 1_000_000_000:
            told = f"a rosglass.Time after 1970 and before {year}; cancel_all() cancels all goals"
            raise ArgumentError("time", time, told, self.name)
        return self._cancel_many(time, timeout)

    def close(self) -> None:
        """End the waiting for goals, which go on, and withdraw the client; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        if self._core.forked:
            return
        self._withdraw()
        self._readiness.close()

    # -- what the protocol does ------------------------------------------------------------------

    @abstractmethod
    def _make_goal(self, goal: Any, timeout: float | None, *, typed: bool) -> ClientGoal:
        """Return a goal that is not sent yet: a message, or what becomes one (`typed` false)."""

    @abstractmethod
    def _begin(self, goal: Any) -> None:
        """Send a goal, now or once a server is there."""

    @abstractmethod
    def _cancel_many(self, until: Time | None, timeout: float | None) -> Promise[CancelAnswer]:
        """Ask the server to cancel the goals until a time, or all."""

    @abstractmethod
    def _withdraw(self) -> None:
        """End the goals and leave the graph."""

    # -- for the protocol ------------------------------------------------------------------------

    def _live(self) -> list[Any]:
        with self._lock:
            return list(self._goals.values())

    def _forget(self, goal: ClientGoal) -> None:
        """Let a goal go that has ended."""
        with self._lock:
            self._goals.pop(goal.id, None)

    def _ended(self) -> NodeClosedError:
        """Return the error of goals whose client was closed."""
        told = f"the client of {self.name} was closed before the goal ended, which goes on"
        return NodeClosedError(told)

    def _unsent(self, timeout: float | None) -> ServiceUnavailableError:
        """Return the error of goals that found no server within `timeout` seconds."""
        why = self.problem or "its server appeared too late"
        return ServiceUnavailableError(
            f"no goal could be sent to {self.name} within {timeout or 0.0:g} s: {why}"
        )

    def _not_cancelled(self, timeout: float | None) -> ServiceUnavailableError:
        """Return the error of requests to cancel that found no server within `timeout` seconds."""
        why = self.problem or "its server appeared too late"
        return ServiceUnavailableError(
            f"{self.name} could not be asked to cancel within {timeout or 0.0:g} s: {why}"
        )

    def _no_server(self, offered: Iterable[str]) -> str:
        """Say that the action is not offered, and which one may be meant of those that are."""
        kind = "" if self.type is None else f" [{self.type.name}]"
        return (
            f"no server offers the action {self.name}{kind} on {self._core.url} "
            f"({self._core.status()}){similar(self.name, offered)}"
        )
