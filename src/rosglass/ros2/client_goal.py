"""One goal of an action client, from sending to its end."""

from __future__ import annotations

import logging
import time
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    ActionResult,
    CancelAnswer,
    ConnectionState,
    GoalStatus,
    Promise,
    Time,
)
from rosglass.comm.inorder import InOrder
from rosglass.comm.promise import check_timeout
from rosglass.comm.watched_goal import FEEDBACK_DEPTH, WatchedGoal
from rosglass.errors import (
    ConnectionLostError,
    DecodeError,
    Error,
    GoalRejectedError,
    NodeClosedError,
    ServiceUnavailableError,
    TimeoutError,  # noqa: A004 - the field's own word
)
from rosglass.ros2.action_types import STATUSES, stamp_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Call
    from rosglass.messages import Message, MessageType
    from rosglass.ros2.action_client import Ros2ActionClient
    from rosglass.ros2.service_client import Ros2ServiceClient

__all__ = ["Ros2ClientGoal"]

_log = logging.getLogger("rosglass.ros2")
#: Seconds that a goal's server may be out of the graph before the goal counts as lost.
_GRACE = 5.0
#: The same while this program itself is cut off, when nothing can be said of the server.
_OUTAGE = 10.0
#: Seconds after which a result is asked for again, when asking failed or an end was announced.
_AGAIN = 1.0
#: The same for an end that was announced, from then on.
_OVERDUE = 5.0

_RANK = {
    GoalStatus.PENDING: 0,
    GoalStatus.ACCEPTED: 1,
    GoalStatus.EXECUTING: 2,
    GoalStatus.CANCELING: 3,
}
_END = 4


class Ros2ClientGoal(WatchedGoal):
    """A goal; made by :meth:`ActionClient.send_goal`.

    All that happens to it happens in jobs that run one after the other, whatever thread hears of
    it: its state needs no lock, and callbacks are told in order.

    Args:
        client: Its client.
        id: Its id, 16 random bytes.
        goal: What is asked for: a message of the action's type, or what becomes one.
        timeout: Seconds for the server to appear and to accept or reject it.
        typed: Whether the action's type is known.
    """

    def __init__(
        self, client: Ros2ActionClient, id: bytes, goal: Any, timeout: float | None, *, typed: bool
    ) -> None:
        super().__init__(id, goal, typed, client.name, client.core.dispatcher, _log)
        self._client = client
        self._timeout = timeout
        self._deadline = None if timeout is None else time.monotonic() + timeout
        self._jobs = InOrder()
        self._accepted: Time | None = None
        #: Feedback that waits for the goal's acceptance.
        self._held: deque[Message] = deque(maxlen=FEEDBACK_DEPTH)
        self._heard: tuple[GoalStatus, Time] | None = None
        self._cancels: list[tuple[Promise[CancelAnswer], float | None]] = []
        self._sending: Call | None = None
        self._asking: Call | None = None
        self._servers: frozenset[bytes | str] = frozenset()
        self._strangers: frozenset[bytes | str] = frozenset()
        self._alone: float | None = None
        self._asked = 0.0

    # -- what users see --------------------------------------------------------------------------

    @property
    def accepted(self) -> Time | None:
        """When the server accepted it, by the server's clock; None before."""
        return self._accepted

    def cancel(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel it; see :meth:`rosglass.comm.ClientGoal.cancel`."""
        timeout = check_timeout(timeout, self._label)
        answer = Promise[CancelAnswer](
            f"the server has not answered the request to cancel {self._label}",
            self._client.core.dispatcher,
            cancellable=False,
        )
        self._jobs.add(lambda: self._cancel(answer, timeout))
        return answer

    def close(self) -> None:
        """Watch it no longer; the goal itself goes on. Safe to call twice."""
        self._feedback_listeners.clear()
        self._status_listeners.clear()
        self.lose(NodeClosedError(f"{self._label} is not watched any more: it was closed"))

    # -- what its client tells it ----------------------------------------------------------------

    def send(self) -> None:
        """Send it, as soon as a server is there; again when the type has changed."""
        left = None if self._deadline is None else max(0.0, self._deadline - time.monotonic())
        call = self._client.ask_goal(self, left)
        self._sending = call
        call.add_done_callback(lambda _: self._jobs.add(lambda: self._answered(call)))

    def hold(self) -> None:
        """Wait for :meth:`begin`, for as long as the server may take to appear."""
        if self._timeout is not None:
            timers = self._client.core.timers
            self._patience = timers.after(self._timeout, lambda: self._jobs.add(self._give_up))

    def begin(self) -> None:
        """Send it, now that the type is known."""
        self._jobs.add(self._begin)

    def take_back(self, service: Ros2ServiceClient) -> bool:
        """Take it back from its service if it was not sent yet; return whether that was so."""
        call, self._sending = self._sending, None  # its end is not the goal's
        if call is None or service.withdraw(call):
            return call is not None
        self._sending = call
        if call.done():
            self._jobs.add(lambda: self._answered(call))
        return False

    def send_again(self, kind: MessageType) -> None:
        """Send it with another version of its type."""
        try:
            assert self.goal is not None  # it waited to be sent
            self.goal = kind.create(self.goal.to_dict())
            self.send()
        except Error as error:
            self.lose(error)

    def hear(self, status: GoalStatus, accepted: Time) -> None:
        """Take what the status topic says of it."""
        self._jobs.add(lambda: self._hear(status, accepted))

    def hear_feedback(self, feedback: Message) -> None:
        """Take feedback for it."""
        self._jobs.add(lambda: self._take_feedback(feedback))

    def canceling(self) -> None:
        """Take note that the server has agreed to cancel it."""
        self._jobs.add(lambda: self._advance(GoalStatus.CANCELING))

    def watch(self) -> None:
        """Look whether its server is still there."""
        self._jobs.add(self._watch)

    def lose(self, error: Error) -> None:
        """End it, as nobody will hear of it any more."""
        self._jobs.add(lambda: self._end(GoalStatus.LOST, error))

    # -- sending ---------------------------------------------------------------------------------

    def _begin(self) -> None:
        if self._done.done():
            return
        kind = self._client.type
        try:
            if kind is None:
                raise self._client.ended()
            self.goal = kind.goal.create(self._given)
            self.send()
        except Error as error:
            self._end(GoalStatus.LOST, self._closing(error))

    def _give_up(self) -> None:
        if self.goal is None:
            self._end(GoalStatus.LOST, self._client.unsent(self._timeout))

    def _answered(self, call: Call) -> None:
        """Take the answer to the goal."""
        if call is not self._sending or self._status is not GoalStatus.PENDING:
            return
        if call.cancelled():
            result = ActionResult(GoalStatus.CANCELED, self._client.empty_result())
            self._end(GoalStatus.CANCELED, result)
            return
        error = call.exception(0)
        if error is None:
            response = call.result(0)
            if response.accepted:
                self._accept(stamp_of(response.stamp))
            else:
                told = f"the server of {self._client.name} does not accept goal {self.id_text}"
                self._end(GoalStatus.REJECTED, GoalRejectedError(told))
        elif self._heard is not None:
            self._accept(self._heard[1])  # its answer got lost, but not the goal
        else:
            self._end(GoalStatus.LOST, self._explain(error))

    def _explain(self, error: BaseException) -> Error:
        name, seconds = self._client.name, self._timeout or 0.0
        if isinstance(error, ServiceUnavailableError):
            return self._client.unsent(seconds)
        if isinstance(error, (TimeoutError, ConnectionLostError)):
            # It may have been accepted, or be yet: nothing is to run that nobody watches.
            self._client.ask_cancel(self.id, Time(), Promise(cancellable=False), 10.0)
        if isinstance(error, TimeoutError):
            return TimeoutError(
                f"the server of {name} neither accepted nor rejected goal {self.id_text} within "
                f"{seconds:g} s; it was asked to cancel it, should it accept it yet"
            )
        if isinstance(error, NodeClosedError) and not self._client.closed:
            return self._client.replaced()
        return error if isinstance(error, Error) else ConnectionLostError(str(error))

    def _accept(self, stamp: Time) -> None:
        self._accepted = stamp
        self._servers = self._client.servers()
        self._advance(GoalStatus.ACCEPTED)
        self._acceptance.fulfil(True)
        heard, self._heard = self._heard, None
        if heard is not None:
            self._hear(*heard)
        while self._held:
            self._tell_feedback(self._held.popleft())
        self._ask_soon(0.0)
        cancels, self._cancels = self._cancels, []
        for answer, deadline in cancels:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            self._later(0.0, partial(self._client.ask_cancel, self.id, Time(), answer, left))

    # -- while it runs ---------------------------------------------------------------------------

    def _hear(self, status: GoalStatus, accepted: Time) -> None:
        if self._status is GoalStatus.PENDING:
            self._heard = (status, accepted)
            return
        self._alive()
        known = self._status
        self._advance(status)
        if known.is_active and not status.is_active:
            # The result should be on its way already; a reply can get lost with a link.
            self._later(_AGAIN, lambda: self._jobs.add(self._ask_again))

    def _take_feedback(self, feedback: Message) -> None:
        if self._status is GoalStatus.PENDING:
            self._held.append(feedback)
        elif not self._done.done():
            self._alive()
            self._tell_feedback(feedback)

    def _alive(self) -> None:
        """Take note that a server has the goal, whoever it is."""
        if self._alone is not None:
            self._alone, self._servers = None, self._client.servers()

    def _advance(self, status: GoalStatus) -> None:
        """Take a later status; what comes late itself is ignored."""
        if _RANK.get(status, _END) > _RANK.get(self._status, _END):
            self._tell_status(status)

    def _cancel(self, answer: Promise[CancelAnswer], timeout: float | None) -> None:
        call = self._sending
        if not self._status.is_active:
            answer.fulfil(self._too_late())
        elif self.goal is None:
            self._end(GoalStatus.CANCELED, self._without_result())
            answer.fulfil(CancelAnswer((self.id,)))
        elif self._status is not GoalStatus.PENDING:
            self._client.ask_cancel(self.id, Time(), answer, timeout)
        elif call is not None and self._client.withdraw(call):
            answer.fulfil(CancelAnswer((self.id,)))
        else:
            # Only a goal that was accepted can be cancelled: the server's answer comes first.
            deadline = None if timeout is None else time.monotonic() + timeout
            self._cancels.append((answer, deadline))
            if timeout is not None:
                self._later(timeout, lambda: self._give_up_cancelling(answer, timeout))

    def _give_up_cancelling(self, answer: Promise[CancelAnswer], timeout: float) -> None:
        answer.fail(
            TimeoutError(
                f"{self._label} could not be cancelled within {timeout:g} s: the server has "
                "neither accepted nor rejected it"
            )
        )

    def _watch(self) -> None:
        if self._status is GoalStatus.PENDING or self._done.done():
            return
        here = self._client.servers()
        now = time.monotonic()
        if not self._servers:
            self._servers = here
        if not self._status.is_active and now - self._asked >= _OVERDUE:
            self._ask_again()
        if self._servers & here:
            if self._alone is not None:
                self._alone = None
                self._ask_again()  # what was asked before may have got lost with the link
            return
        if self._alone is None:
            self._alone = now
        if here - self._strangers:
            # Whoever took the place of the server that had the goal should not know it.
            self._strangers |= here
            self._ask_again()
        status = self._client.core.status()
        cut_off = not here and status.state is not ConnectionState.CONNECTED
        known = not self._status.is_active
        if now - self._alone >= (_OUTAGE if cut_off and not known else _GRACE):
            told = "goal {} ended; nobody knows what becomes of it"
            if known:
                told = (
                    "it told the result of goal {}, " + f"which has ended as {self._status.value}"
                )
            self._end(
                GoalStatus.LOST,
                ConnectionLostError(
                    f"the server of {self._client.name} went away before "
                    f"{told.format(self.id_text)} ({self._client.core.url}: {status})"
                ),
            )

    # -- the result ------------------------------------------------------------------------------

    def _ask_soon(self, delay: float) -> None:
        """Ask for the result, not on the thread of the middleware that may have called us."""
        self._later(delay, lambda: self._jobs.add(self._ask))

    def _ask_again(self) -> None:
        asking, self._asking = self._asking, None
        if asking is not None:
            asking.cancel()
        if not self._done.done():
            self._ask_soon(0.0)

    def _ask(self) -> None:
        if self._done.done() or self._asking is not None:
            return
        try:
            call = self._client.ask_result(self)
        except Error as error:
            self._end(GoalStatus.LOST, self._closing(error))
            return
        self._asking, self._asked = call, time.monotonic()
        call.add_done_callback(lambda _: self._came(call))

    def _came(self, call: Call) -> None:
        """Take the end, after the feedback that came before it on another way."""
        self._client.flush()
        self._jobs.add(lambda: self._take_result(call))

    def _take_result(self, call: Call) -> None:
        if call is not self._asking:
            return
        self._asking = None
        error = call.exception(0)
        if error is None:
            response = call.result(0)
            status = STATUSES.get(int(response.status))
            if status is None:
                lost = ConnectionLostError(
                    f"the server of {self._client.name} does not know goal {self.id_text} any "
                    "more: it was restarted meanwhile, or did not keep the result for long enough"
                )
                self._end(GoalStatus.LOST, lost)
            elif status.is_active:
                self._ask_soon(_AGAIN)  # a server that does not wait for the end
            else:
                self._end(status, ActionResult(status, response.result))
        elif isinstance(error, NodeClosedError) or isinstance(error.__cause__, DecodeError):
            self._end(GoalStatus.LOST, self._closing(error))
        else:
            _log.debug("%s: asking for its result failed, trying again: %s", self._label, error)
            self._ask_soon(_AGAIN)

    def _closing(self, error: BaseException) -> BaseException:
        """Return the error of a goal: asking may fail before the goal hears that all is closed."""
        if isinstance(error, NodeClosedError) and self._client.closed:
            return self._client.ended()
        return error

    def _end(self, status: GoalStatus, end: ActionResult | BaseException) -> None:
        if self._done.done():
            return
        self._advance(status)
        cancels, self._cancels = self._cancels, []
        for answer, _ in cancels:
            answer.fulfil(self._too_late())
        self._client.forget(self)
        asking, self._asking = self._asking, None
        if asking is not None:
            asking.cancel()
        self._tell_end(status, end)

    def _later(self, delay: float, job: Callable[[], None]) -> None:
        self._client.core.timers.after(delay, job)
