"""One goal of an action client, from sending to its end."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import (
    ActionResult,
    CancelAnswer,
    ConnectionState,
    GoalStatus,
    Listeners,
    Promise,
)
from rosglass.comm.promise import check_timeout
from rosglass.comm.watched_goal import WatchedGoal
from rosglass.errors import (
    ConnectionLostError,
    Error,
    GoalRejectedError,
    NodeClosedError,
    TimeoutError,  # noqa: A004 - the field's own word
)
from rosglass.ros1.action_state import CommState, CommStateMachine, ServerState
from rosglass.ros1.action_types import goal_id, stamp

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Executor, Handle, Time
    from rosglass.messages import Message
    from rosglass.ros1.action_client import Ros1ActionClient
    from rosglass.ros1.action_state import Step, TerminalState

__all__ = ["Ros1ClientGoal"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds that a goal's server may be away before the goal counts as lost.
_GRACE = 5.0
#: The same while this program itself is cut off, when nothing can be said of the server.
_OUTAGE = 10.0
#: Seconds that a result may take once the server keeps the goal's end in mind no longer.
_OVERDUE = 5.0
#: Seconds after which a request to cancel is repeated that the server shows no sign of, and how
#: often while it is connected: a lost stop command is the worst that can happen.
_INSIST, _REPEATS = 1.0, 3

_CANCELED = (
    ServerState.PREEMPTING,
    ServerState.RECALLING,
    ServerState.PREEMPTED,
    ServerState.RECALLED,
)


class Ros1ClientGoal(WatchedGoal):
    """A goal; made by :meth:`ActionClient.send_goal`.

    All that happens to it happens in jobs of its client that run one after the other: its state
    needs no lock, and callbacks are told in order.

    Args:
        client: Its client.
        id_text: Its id.
        created: Its time stamp.
        goal: What is asked for: a message of the action's type, or what becomes one.
        timeout: Seconds for the server to appear and to tell that it knows the goal.
        typed: Whether the action's type is known.

    Attributes:
        stamp: When it was created, by this node's clock; what :meth:`ActionClient.cancel_before`
            compares.
        server: Full name of the node that it was sent to; empty before.
        text: What the server told with the goal's status, e.g. why it failed.
    """

    def __init__(
        self,
        client: Ros1ActionClient,
        id_text: str,
        created: Time,
        goal: Any,
        timeout: float | None,
        *,
        typed: bool,
    ) -> None:
        self._id_text, self.stamp = id_text, created
        super().__init__(id_text.encode(), goal, typed, client.name, client.core.dispatcher, _log)
        self.server, self.text = "", ""
        self._client, self._timeout = client, timeout
        self._machine = CommStateMachine()
        self._state_listeners: Listeners[CommState] = Listeners(where=self._label)
        self._cancels: list[Promise[CancelAnswer]] = []
        #: What was sent, and during which of the client's connections with a server.
        self._sent: dict[str, Any] | None = None
        self._epoch = 0
        self._known = self._odd = False
        self._alone: float | None = None
        self._absent: float | None = None
        self._asked, self._repeats = 0.0, 0

    # -- what users see --------------------------------------------------------------------------

    @property
    def id_text(self) -> str:
        """The id as it goes over the wire: node, number and time."""
        return self._id_text

    @property
    def status(self) -> GoalStatus:
        """What has become of it, as last heard; see :attr:`comm_state` for ROS 1's own words.

        PENDING until the server executes it, CANCELING once the server tells that it is about to
        end for that. Recalled and preempted goals are both CANCELED.
        """
        return super().status

    @property
    def comm_state(self) -> CommState:
        """The state of the communication about it."""
        return self._machine.state

    @property
    def terminal_state(self) -> TerminalState | None:
        """How it ended; None before it is done."""
        return self._machine.terminal

    @property
    def accepted(self) -> Time | None:
        """Its :attr:`stamp`, once the server executes it; None before.

        ROS 1 does not tell when a server accepted a goal.
        """
        return self.stamp if self._machine.executed else None

    def on_comm_state_change(
        self, callback: Callable[[CommState], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with each new :attr:`comm_state` from now on, none left out."""
        return self._listen(self._state_listeners, callback, executor)

    def cancel(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel it; see :meth:`rosglass.comm.ClientGoal.cancel`.

        ROS 1 servers do not answer; their status of the goal tells that they have heard of it.
        """
        timeout = check_timeout(timeout, self._label)
        answer = Promise[CancelAnswer](
            f"the server has not told that it cancels {self._label}",
            self._client.core.dispatcher,
            cancellable=False,
        )
        self._client.jobs.add(lambda: self._cancel(answer, timeout))
        return answer

    def resend(self) -> None:
        """Send it once more, as it is: for servers that may have missed it.

        A server that knows it takes no notice.

        Raises:
            Error: It has ended: send a new one.
            NodeClosedError: The client was closed.
        """
        if self._client.closed:
            raise self._client.ended()
        if self._done.done():
            raise Error(f"{self._label} has ended as {self._status.value}: send a new goal instead")
        self._client.jobs.add(self._resend)

    def close(self) -> None:
        """Watch it no longer; the goal itself goes on. Safe to call twice."""
        self._feedback_listeners.clear()
        self._status_listeners.clear()
        self._state_listeners.clear()
        error = NodeClosedError(f"{self._label} is not watched any more: it was closed")
        self._client.jobs.add(lambda: self.lose(error))

    # -- for its client, in the client's jobs ----------------------------------------------------

    @property
    def sent(self) -> bool:
        """Whether it was sent."""
        return self._sent is not None

    @property
    def over(self) -> bool:
        """Whether it is done."""
        return self._done.done()

    def begin(self) -> None:
        """Wait for a server, for as long as it may take."""
        if self._timeout is not None and not self.over:
            timers, jobs = self._client.core.timers, self._client.jobs
            self._patience = timers.after(self._timeout, lambda: jobs.add(self._give_up))

    def send(self, server: str, epoch: int) -> None:
        """Send it to a server that is there."""
        kind = self._client.type
        assert kind is not None  # there is a server that is understood
        try:
            if self.goal is None:
                self.goal = kind.goal.create(self._given)
            sent = {
                "header": {"stamp": stamp(self.stamp)},
                "goal_id": goal_id(self._id_text, self.stamp),
                "goal": self.goal,
            }
            self._client.send(sent)
        except Error as error:
            self.lose(error)
        else:
            self._sent, self.server, self._epoch = sent, server, epoch

    def hear(self, server: str, said: ServerState, text: str) -> None:
        """Take what a status message says of it."""
        if self._known and server != self.server:
            return  # another server took it, too; the first one counts
        self.server, self._known, self._absent = server, True, None
        self._take(said, text)
        waits = self._machine.state is CommState.WAITING_FOR_CANCEL_ACK
        if waits and self._repeats < _REPEATS and time.monotonic() - self._asked >= _INSIST:
            self._repeats += self._ask_cancel()

    def miss(self, server: str) -> None:
        """Take note that a status message does not name it."""
        if not self._known or server != self.server or self.over:
            return
        if self._machine.state is not CommState.WAITING_FOR_RESULT:
            self.lose(
                ConnectionLostError(
                    f"the server of {self._client.name} ({server}) does not know goal "
                    f"{self._id_text} any more: it was restarted meanwhile, or it ended and "
                    "nothing of that came through"
                )
            )
            return
        now = time.monotonic()
        self._absent = self._absent or now
        if now - self._absent >= _OVERDUE:
            self._lose_result(f"its result never came from {server}")

    def hear_feedback(self, feedback: Message) -> None:
        """Take feedback for it."""
        if not self.over:
            self._tell_feedback(feedback)

    def finish(self, said: ServerState, text: str, result: Message) -> None:
        """Take its result."""
        if self.over:
            return
        try:
            steps = self._machine.finish(said)
        except ValueError as error:
            self._complain(error)
            return
        self.text = text
        self._go(steps)
        status = self._machine.status
        because = f": {text}" if text else ""
        if status is GoalStatus.REJECTED:
            told = f"the server of {self._client.name} does not accept goal {self._id_text}"
            self._end(GoalRejectedError(told + because))
        elif status is GoalStatus.LOST:
            told = f"the server of {self._client.name} says that goal {self._id_text} is lost"
            self._end(ConnectionLostError(told + because))
        else:
            self._end(ActionResult(status, result))

    def watch(self, tellers: dict[str, str], epoch: int, settled: bool) -> None:
        """Look whether its server is still there.

        Args:
            tellers: The nodes that are connected to tell their goals' status.
            epoch: Number of the client's connection with a server.
            settled: Whether that connection is some time old.
        """
        if not self.sent or self.over:
            return
        now = time.monotonic()
        if self.server in tellers:
            self._alone = None
            if not self._known and settled and epoch != self._epoch:
                self._client.ask_cancel(self._id_text)  # nothing is to run that nobody watches
                self.lose(self._gone("was cut off after it was sent the goal, before"))
            return
        self._alone = self._alone or now
        cut_off = self._client.core.status().state is not ConnectionState.CONNECTED
        if now - self._alone >= (_OUTAGE if cut_off else _GRACE):
            self.lose_server("went away before")

    def lose_server(self, what: str) -> None:
        """End it, as its server is there no more."""
        if self._machine.state is CommState.WAITING_FOR_RESULT:
            self._lose_result(f"its server ({self.server}) {what} it told the result")
        else:
            self.lose(self._gone(what))

    def lose(self, error: Error) -> None:
        """End it, as nobody will hear of it any more."""
        if not self.over:
            self._go(self._machine.lose())
            self._end(error)

    # -- inside ----------------------------------------------------------------------------------

    def _gone(self, what: str) -> ConnectionLostError:
        client = self._client
        return ConnectionLostError(
            f"the server of {client.name} ({self.server}) {what} goal {self._id_text} ended; "
            f"nobody knows what becomes of it ({client.core.url}: {client.core.status()})"
        )

    def _lose_result(self, why: str) -> None:
        ended = self._machine.status.value
        self.lose(ConnectionLostError(f"{self._label} has ended as {ended}, but {why}"))

    def _give_up(self) -> None:
        """Take note that the time has run out in which the server should have answered."""
        if self.over or self._known:
            return
        client, seconds = self._client, self._timeout or 0.0
        if not self.sent:
            self.lose(client.unsent(seconds))
            return
        client.ask_cancel(self._id_text)  # nothing is to run that nobody watches
        told = (
            f"the server of {client.name} ({self.server}) did not tell that it knows goal "
            f"{self._id_text} within {seconds:g} s; it was asked to cancel it, should it get it yet"
        )
        self.lose(TimeoutError(told))

    def _resend(self) -> None:
        if self._sent is not None and not self.over:
            self._client.send(self._sent)

    def _cancel(self, answer: Promise[CancelAnswer], timeout: float | None) -> None:
        if self.over:
            answer.fulfil(self._too_late())
        elif not self.sent:
            self._withdraw()
            answer.fulfil(CancelAnswer((self.id,)))
        else:
            self._cancels.append(answer)
            self._repeats = 0
            self._ask_cancel()
            self._go(self._machine.cancel())
            if timeout is not None:
                timers = self._client.core.timers
                timers.after(timeout, lambda: self._give_up_cancelling(answer, timeout))

    def _give_up_cancelling(self, answer: Promise[CancelAnswer], timeout: float) -> None:
        answer.fail(
            TimeoutError(
                f"{self._client.name} did not tell within {timeout:g} s that it cancels goal "
                f"{self._id_text}. It may cancel it all the same: watch the goal's status"
            )
        )

    def _withdraw(self) -> None:
        """Let it end without having been sent."""
        self._machine.hear(ServerState.PENDING)
        self._go(self._machine.finish(ServerState.RECALLED))
        kind = self._client.type
        if kind is not None:
            self._end(ActionResult(GoalStatus.CANCELED, kind.result.create()))
        else:
            self._end(self._without_result())

    def _ask_cancel(self) -> bool:
        self._asked = time.monotonic()
        return self._client.ask_cancel(self._id_text)

    def _take(self, said: ServerState, text: str) -> None:
        try:
            steps = self._machine.hear(said)
        except ValueError as error:
            self._complain(error)
            return
        self.text = text
        self._go(steps)
        if said is ServerState.LOST:
            told = f"the server of {self._client.name} says that goal {self._id_text} is lost"
            self._end(ConnectionLostError(told))

    def _complain(self, error: ValueError) -> None:
        if not self._odd:
            self._odd = True
            _log.warning(
                "%s: its server %s contradicts itself: %s", self._label, self.server, error
            )

    def _go(self, steps: list[Step]) -> None:
        """Tell what states it has gone through."""
        for state, status in steps:
            self._state_listeners.notify(state)
            if status is not self._status:
                self._tell_status(status)
        if self._machine.executed:
            self._acceptance.fulfil(True)
        said = self._machine.heard
        if self._cancels and (said in _CANCELED or (said is not None and said.is_terminal)):
            cancels, self._cancels = self._cancels, []
            for answer in cancels:
                answer.fulfil(CancelAnswer((self.id,)) if said in _CANCELED else self._too_late())

    def _end(self, end: ActionResult | Error) -> None:
        self._client.forget(self)
        cancels, self._cancels = self._cancels, []
        for answer in cancels:
            answer.fulfil(self._too_late())
        self._tell_end(self._status, end)
