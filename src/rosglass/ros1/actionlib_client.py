"""The client's side of an action over actionlib's five topics.

Protocol: ROS wiki, "actionlib/DetailedDescription".
"""

from __future__ import annotations

import logging
import time
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from rosglass.comm import (
    IMMEDIATE,
    ActionResult,
    CancelAnswer,
    ConnectionState,
    GoalStatus,
    Listeners,
    Promise,
    Publisher,
    Subscription,
    Time,
)
from rosglass.comm.action_client import GRACE_S, OUTAGE_S, ActionClient, ClientGoal
from rosglass.comm.executor import InOrder
from rosglass.comm.handle import undo_on_error
from rosglass.errors import (
    ConnectionLostError,
    DecodeError,
    DefinitionConflictError,
    Error,
    GoalRejectedError,
    NodeClosedError,
    TimeoutError,  # noqa: A004 - the field's own word
)
from rosglass.ros1.actionlib import (
    CANCEL,
    FEEDBACK,
    GOAL,
    QUEUE,
    RESULT,
    STATUS,
    ActionTypes,
    CommState,
    CommStateMachine,
    ServerState,
    action_topic,
    goal_id,
    new_id,
    served_actions,
    stamp,
    state_of,
    time_of,
)
from rosglass.ros1.type_discovery import ActionDiscovery
from rosglass.wires.tcpros.master import call_node
from rosglass.wires.tcpros.registrations import Member

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from rosglass.comm import Executor, Handle, Sample
    from rosglass.messages import ActionType, Message
    from rosglass.ros1.actionlib import Step, TerminalState
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.topics import Topics

__all__ = ["ActionlibClient", "ActionlibClientGoal"]

_log = logging.getLogger("rosglass.ros1")
#: Time without a status message, of which there are usually five a second, after which the server
#: is called to see whether it is alive; and that it may take to answer.
_SILENCE_S, _ANSWER_TIMEOUT_S = 5.0, 5.0
#: The first seconds that do not fit into a time stamp, and their year.
_END_OF_TIME = 2**32, 2106
#: Time after which a connected server has published the status of all its goals.
_SETTLED_S = 1.0
#: Time that a result may take once the server's status lacks the goal.
_OVERDUE_S = 5.0
#: Time after which a request to cancel is repeated that the server has not acknowledged, and how
#: often while it is connected: a stop command must not be lost.
_REPEAT_S, _REPEATS = 1.0, 3
#: Time after which a server without goals to cancel has received the request.
_RECEIVED_S = 0.5

_RUNNING = (ServerState.PENDING, ServerState.ACTIVE)
_CANCELED = (
    ServerState.PREEMPTING,
    ServerState.RECALLING,
    ServerState.PREEMPTED,
    ServerState.RECALLED,
)


class GoalStatusEntry(NamedTuple):
    """A goal in a status message.

    Attributes:
        state: Its state.
        text: The server's explanation.
        stamp: The goal's time stamp.
    """

    state: ServerState
    text: str
    stamp: Time


class BulkCancel:
    """A request to cancel all goals of a server, or those up to a time.

    ROS 1's servers do not answer such requests: the status of their goals shows the effect.

    Args:
        until: The last time stamp of goals to be cancelled; None for all.
        answer: Completed when the goals that ran are cancelled, or have ended.

    Attributes:
        until: As given.
        answer: As given.
        sent: Whether it was sent to a server.
    """

    def __init__(self, until: Time | None, answer: Promise[CancelAnswer]) -> None:
        self.until, self.answer = until, answer
        self.sent = False
        self._sent_at = 0.0
        self._canceling: set[str] = set()
        self._affected: set[str] = set()
        self._canceled: dict[str, None] = {}

    def on_sent(self, before: dict[str, GoalStatusEntry]) -> None:
        """Note that it is sent, and the server's last status until then."""
        self.sent, self._sent_at = True, time.monotonic()
        for key, entry in before.items():
            if entry.state in _CANCELED:
                self._canceling.add(key)
            elif entry.state in _RUNNING and (self.until is None or entry.stamp <= self.until):
                self._affected.add(key)

    def on_status(self, entries: dict[str, GoalStatusEntry]) -> bool:
        """Handle a status message; return whether it is answered now."""
        for key, entry in entries.items():
            if entry.state in _CANCELED and key not in self._canceling:
                self._canceled[key] = None
        if any(key in entries and entries[key].state in _RUNNING for key in self._affected):
            return False
        if not self._canceled and time.monotonic() - self._sent_at < _RECEIVED_S:
            return False  # the message may have been sent before the request was received
        accepted = tuple(key.encode() for key in self._canceled)
        self.answer.set_result(
            CancelAnswer(accepted, "" if accepted else "there was no goal to cancel")
        )
        return True


class ActionlibClientGoal(ClientGoal):
    """A goal with actionlib's states; made by :meth:`ActionClient.send_goal`.

    Args:
        client: Its client.
        id_text: Its id.
        created: Its time stamp.
        goal: The goal message, or values for one.
        timeout: Seconds for the server to appear and to acknowledge the goal.
        typed: Whether the action's type is known.

    Attributes:
        stamp: When it was created, by this node's clock; used by
            :meth:`ActionClient.cancel_before`.
        server: Full name of the node that it was sent to; empty until then.
        text: The server's text with the goal's status, e.g. why it failed.
    """

    _client: ActionlibClient

    def __init__(
        self,
        client: ActionlibClient,
        id_text: str,
        created: Time,
        goal: Any,
        timeout: float | None,
        *,
        typed: bool,
    ) -> None:
        self._id_text, self.stamp = id_text, created
        key, jobs = id_text.encode(), client._jobs
        super().__init__(client, key, goal, timeout, typed=typed, jobs=jobs, log=_log)
        self.server, self.text = "", ""
        self._machine = CommStateMachine()
        self._state_listeners: Listeners[CommState] = Listeners(where=self._label)
        #: The sent message, and the number of the client's connection with a server.
        self._sent: dict[str, Any] | None = None
        self._epoch = 0
        self._known = self._odd = False
        self._alone: float | None = None
        self._absent: float | None = None
        self._asked, self._repeats = 0.0, 0

    # -- what users see --------------------------------------------------------------------------

    @property
    def id_text(self) -> str:
        """The id on the wire: node, number and time."""
        return self._id_text

    @property
    def comm_state(self) -> CommState:
        """The state of the communication about it."""
        return self._machine.state

    @property
    def terminal_state(self) -> TerminalState | None:
        """The terminal state; None before it has ended."""
        return self._machine.terminal

    @property
    def accepted(self) -> Time | None:
        """Its :attr:`stamp`, once the server executes it; None before.

        ROS 1's servers do not report when they accepted a goal.
        """
        return self.stamp if self._machine.executed else None

    def on_comm_state_change(
        self, callback: Callable[[CommState], None], executor: Executor | None = None
    ) -> Handle:
        """Call `callback` with every new :attr:`comm_state` from now on."""
        return self._listen(self._state_listeners, callback, executor)

    def resend(self) -> None:
        """Send it again, for servers that may have missed it.

        A server that has it already ignores this.

        Raises:
            Error: It has ended: send a new one.
            NodeClosedError: The client was closed.
        """
        if self._client.closed:
            raise self._client._client_closed_error()
        if self._done.done():
            raise Error(f"{self._label} has ended as {self._status.value}: send a new goal instead")
        self._jobs.add(self._resend)

    def close(self) -> None:
        """Stop following the goal, which continues; safe to call twice."""
        self._state_listeners.clear()
        super().close()

    # -- for its client, in jobs -----------------------------------------------------------------

    @property
    def _is_unsent(self) -> bool:
        """True while the goal waits for a server."""
        return self._sent is None and not self._done.done()

    def _send(self, server: str, epoch: int) -> None:
        """Send it to a server."""
        action_type = self._client.type
        assert action_type is not None  # it is known once there is a server
        try:
            if self.goal is None:
                self.goal = action_type.goal.create(self._given)
            sent = {
                "header": {"stamp": stamp(self.stamp)},
                "goal_id": goal_id(self._id_text, self.stamp),
                "goal": self.goal,
            }
            self._client._send(sent)
        except Error as error:
            self._end_as_lost(error)
        else:
            self._sent, self.server, self._epoch = sent, server, epoch

    def _on_status(self, server: str, reported: ServerState, text: str) -> None:
        """Handle its state in a status message."""
        if self._known and server != self.server:
            return  # another server has it, too; the first one counts
        self.server, self._known, self._absent = server, True, None
        self._on_state(reported, text)
        waits = self._machine.state is CommState.WAITING_FOR_CANCEL_ACK
        if waits and self._repeats < _REPEATS and time.monotonic() - self._asked >= _REPEAT_S:
            self._repeats += self._send_cancel_request()

    def _on_missing(self, server: str) -> None:
        """Handle a status message without it."""
        if not self._known or server != self.server or self._done.done():
            return
        if self._machine.state is not CommState.WAITING_FOR_RESULT:
            self._end_as_lost(
                ConnectionLostError(
                    f"the server of {self._client.name} ({server}) does not know goal "
                    f"{self._id_text} any more: the server was restarted, or the goal ended and "
                    "its result was lost"
                )
            )
            return
        now = time.monotonic()
        self._absent = self._absent or now
        if now - self._absent >= _OVERDUE_S:
            self._lose_result(f"its result was not received from {server}")

    def _on_feedback(self, feedback: Message) -> None:
        """Handle its feedback."""
        if not self._done.done():
            self._add_feedback(feedback)

    def _on_result(self, reported: ServerState, text: str, result: Message) -> None:
        """Handle its result."""
        if self._done.done():
            return
        try:
            steps = self._machine.on_result(reported)
        except ValueError as error:
            self._log_contradiction(error)
            return
        self.text = text
        self._transition(steps)
        status = self._machine.status
        because = f": {text}" if text else ""
        if status is GoalStatus.REJECTED:
            reason = f"the server of {self._client.name} does not accept goal {self._id_text}"
            self._finish(GoalRejectedError(reason + because))
        elif status is GoalStatus.LOST:
            reason = f"the server of {self._client.name} reports that goal {self._id_text} is lost"
            self._finish(ConnectionLostError(reason + because))
        else:
            self._finish(ActionResult(status, result))

    def _check_server(self, status_publishers: dict[str, str], epoch: int, settled: bool) -> None:
        """Check whether its server is still there.

        Args:
            status_publishers: The connected nodes that publish the status of goals.
            epoch: The number of the client's connection with a server.
            settled: Whether that connection is old enough for a complete status.
        """
        if self._sent is None or self._done.done():
            return
        now = time.monotonic()
        if self.server in status_publishers:
            self._alone = None
            if not self._known and settled and epoch != self._epoch:
                self._client._send_cancel_request(self._id_text)  # nothing must run unsupervised
                self._end_as_lost(
                    self._server_lost_error("was disconnected after it was sent the goal, before")
                )
            return
        self._alone = self._alone or now
        cut_off = self._client._core.status().state is not ConnectionState.CONNECTED
        if now - self._alone >= (OUTAGE_S if cut_off else GRACE_S):
            self._lose_server("left before")

    def _lose_server(self, what: str) -> None:
        """End it, as its server has left."""
        if self._machine.state is CommState.WAITING_FOR_RESULT:
            self._lose_result(f"its server ({self.server}) {what} it sent the result")
        else:
            self._end_as_lost(self._server_lost_error(what))

    def _end_as_lost(self, error: BaseException) -> None:
        """End it as LOST, unless it has ended."""
        if not self._done.done():
            self._transition(self._machine.on_server_lost())
            self._finish(error)

    # -- inside ----------------------------------------------------------------------------------

    def _server_lost_error(self, what: str) -> ConnectionLostError:
        client = self._client
        return ConnectionLostError(
            f"the server of {client.name} ({self.server}) {what} goal {self._id_text} ended; "
            f"its outcome is unknown ({client._core.url}: {client._core.status()})"
        )

    def _lose_result(self, why: str) -> None:
        ended = self._machine.status.value
        self._end_as_lost(ConnectionLostError(f"{self._label} has ended as {ended}, but {why}"))

    def _on_timeout(self) -> None:
        """Fail it: the server has not acknowledged it in time."""
        if self._done.done() or self._known:
            return
        client, seconds = self._client, self._timeout or 0.0
        if self._sent is None:
            self._end_as_lost(client._not_sent_error(seconds))
            return
        client._send_cancel_request(self._id_text)  # nothing must run unsupervised
        reason = (
            f"the server of {client.name} ({self.server}) did not acknowledge goal "
            f"{self._id_text} within {seconds:g} s; its cancellation was requested, in case the "
            "server receives it later"
        )
        self._end_as_lost(TimeoutError(reason))

    def _resend(self) -> None:
        if self._sent is not None and not self._done.done():
            self._client._send(self._sent)

    def _cancel(self, answer: Promise[CancelAnswer], timeout: float | None) -> None:
        if self._done.done():
            answer.set_result(self._answer_after_end())
        elif self._sent is None:
            self._withdraw()
            answer.set_result(CancelAnswer((self.id,)))
        else:
            failure = (
                f"{self._client.name} did not acknowledge within {timeout or 0.0:g} s that it "
                f"cancels goal {self._id_text}. It may cancel it later: watch the goal's status"
            )
            self._add_cancel(answer, timeout, failure)
            self._repeats = 0
            self._send_cancel_request()
            self._transition(self._machine.cancel())

    def _withdraw(self) -> None:
        """End it without having sent it."""
        self._machine.on_status(ServerState.PENDING)
        self._transition(self._machine.on_result(ServerState.RECALLED))
        action_type = self._client.type
        if action_type is not None:
            self._finish(ActionResult(GoalStatus.CANCELED, action_type.result.create()))
        else:
            self._finish(self._without_result())

    def _send_cancel_request(self) -> bool:
        self._asked = time.monotonic()
        return self._client._send_cancel_request(self._id_text)

    def _on_state(self, reported: ServerState, text: str) -> None:
        try:
            steps = self._machine.on_status(reported)
        except ValueError as error:
            self._log_contradiction(error)
            return
        self.text = text
        self._transition(steps)
        if reported is ServerState.LOST:
            reason = f"the server of {self._client.name} reports that goal {self._id_text} is lost"
            self._finish(ConnectionLostError(reason))

    def _log_contradiction(self, error: ValueError) -> None:
        if not self._odd:
            self._odd = True
            _log.warning(
                "%s: its server %s contradicts itself: %s", self._label, self.server, error
            )

    def _transition(self, steps: list[Step]) -> None:
        """Report the states that it has passed."""
        for state, status in steps:
            self._state_listeners.notify(state)
            if status is not self._status:
                self._set_status(status)
        if self._machine.executed:
            self._acceptance.set_result(True)
        last = self._machine.heard
        if self._cancels and (last in _CANCELED or (last is not None and last.is_terminal)):
            cancels, self._cancels = self._cancels, []
            for answer, _ in cancels:
                answer.set_result(
                    CancelAnswer((self.id,)) if last in _CANCELED else self._answer_after_end()
                )


class ActionlibClient(ActionClient, Member):
    """An action client that follows actionlib's servers.

    Args:
        core: The node it belongs to.
        topics: The node's topics.
        name: Absolute action name.
        wanted: The type; None for that of the server's topics.
    """

    _core: TcprosCore
    _goals: dict[bytes, ActionlibClientGoal]

    def __init__(
        self, core: TcprosCore, topics: Topics, name: str, wanted: ActionType | None
    ) -> None:
        super().__init__(core, name, _END_OF_TIME)
        #: Runs everything that changes the client and its goals, one after the other.
        self._jobs = InOrder()
        self._topics = topics
        self._endpoints: _ClientTopics | None = None
        self._discovery: ActionDiscovery | None = None
        #: The server that goals are sent to; empty without one.
        self._server, self._since, self._epoch = "", 0.0, 0
        #: By server, its last status message, and when it was last known to be alive.
        self._lists: dict[str, dict[str, GoalStatusEntry]] = {}
        self._heard: dict[str, float] = {}
        self._asked: set[str] = set()
        self._bulk_cancels: list[BulkCancel] = []
        self._garbage = ""
        if wanted is None:
            self._discovery = ActionDiscovery(core, topics, name)
        else:
            self._open(ActionTypes.of(wanted, core.types))
        core.add(self)

    def _is_ready(self) -> bool:
        """Return whether there is a server of the right type.

        As in actionlib: it publishes the status of its goals, and is connected on all five topics.
        """
        return bool(self._server) and not self._closed

    @property
    def server(self) -> str:
        """Full name of the node that goals are sent to; empty while there is none."""
        return "" if self._closed else self._server

    # -- sending and cancelling ------------------------------------------------------------------

    def send_goal(
        self,
        goal: Message | dict[str, Any] | None = None,
        /,
        *,
        on_feedback: Callable[[Message], None] | None = None,
        on_status_change: Callable[[GoalStatus], None] | None = None,
        on_comm_state_change: Callable[[CommState], None] | None = None,
        on_done: Callable[[ClientGoal], None] | None = None,
        executor: Executor | None = None,
        timeout: float | None = 10.0,
    ) -> ActionlibClientGoal:
        """Send a goal, as soon as there is a server; see :meth:`comm.ActionClient.send_goal`.

        Args:
            goal: A message or a dict of fields; missing fields, and None, get the defaults.
            on_feedback: Called with each feedback message.
            on_status_change: Called with each new status.
            on_comm_state_change: Called with each new state of actionlib's own.
            on_done: Called with the goal when it has ended, one way or another.
            executor: Where callbacks run; None for the node's own dispatcher thread.
            timeout: Seconds for the server to appear and to acknowledge the goal; servers may keep
                it PENDING for any time. None for no limit.
        """
        made: ActionlibClientGoal = self._new_goal(
            goal, timeout, executor, on_feedback, on_status_change, on_done
        )
        if on_comm_state_change is not None:
            made.on_comm_state_change(on_comm_state_change, executor)
        self._begin(made)
        return made

    def _make_goal(self, goal: Any, timeout: float | None, *, typed: bool) -> ActionlibClientGoal:
        now = self._core.clock.now()
        id_text = new_id(self._core.name.full, now)
        return ActionlibClientGoal(self, id_text, now, goal, timeout, typed=typed)

    def _begin(self, goal: ActionlibClientGoal) -> None:
        self._jobs.add(lambda: self._send_or_wait(goal))

    def _cancel_many(self, until: Time | None, timeout: float | None) -> Promise[CancelAnswer]:
        answer: Promise[CancelAnswer] = Promise(
            f"{self.name} has not cancelled the goals yet",
            self._core.dispatcher,
            cancellable=False,
        )

        request = BulkCancel(until, answer)
        if timeout is not None:
            self._core.timers.after(
                timeout, lambda: self._jobs.add(lambda: self._expire_bulk_cancel(request, timeout))
            )
        self._jobs.add(lambda: self._begin_bulk_cancel(request))
        return answer

    # -- for its goals, in jobs ------------------------------------------------------------------

    def _send(self, goal: dict[str, Any]) -> None:
        """Publish a goal; raises ConversionError."""
        if self._endpoints is not None:
            self._endpoints.send_goal(goal)

    def _send_cancel_request(self, id_text: str) -> bool:
        """Publish a request to cancel one goal; return whether a server is connected."""
        endpoints = self._endpoints
        return endpoints is not None and not self._closed and endpoints.send_cancel(id_text, Time())

    # -- jobs ------------------------------------------------------------------------------------

    def _send_or_wait(self, goal: ActionlibClientGoal) -> None:
        if self.closed:
            goal._end_as_lost(self._client_closed_error())
            return
        goal._wait()
        self._update_server()  # a goal must not be sent to a server that has left
        if self._server and goal._is_unsent:
            goal._send(self._server, self._epoch)

    def _begin_bulk_cancel(self, request: BulkCancel) -> None:
        if self.closed:
            request.answer.set_exception(NodeClosedError(f"the client of {self.name} was closed"))
            return
        for goal in self._open_goals():
            if goal._is_unsent and (request.until is None or goal.stamp <= request.until):
                goal.cancel()
        self._update_server()  # a stop command must not be sent to a server that has left
        self._bulk_cancels.append(request)
        self._send_bulk_cancels()

    def _send_bulk_cancels(self) -> None:
        endpoints = self._endpoints
        if self._server and endpoints is not None:
            for request in self._bulk_cancels:
                if not request.sent:
                    request.on_sent(self._lists.get(self._server, {}))
                    endpoints.send_cancel("", request.until or Time())

    def _expire_bulk_cancel(self, request: BulkCancel, timeout: float) -> None:
        if request not in self._bulk_cancels:
            return
        self._bulk_cancels.remove(request)
        if request.sent:
            reason = (
                f"{self.name} did not show within {timeout:g} s that all goals are cancelled. It "
                "may cancel them later: watch their status"
            )
            request.answer.set_exception(TimeoutError(reason))
        else:
            request.answer.set_exception(self._not_cancelled_error(timeout))

    def _take_status(self, server: str, message: Message) -> None:
        entries = {
            each.goal_id.id: GoalStatusEntry(state_of(each), each.text, time_of(each.goal_id.stamp))
            for each in message.status_list
        }
        self._lists[server], self._heard[server] = entries, time.monotonic()
        self._update_server()
        for goal in self._open_goals():
            entry = entries.get(goal.id_text)
            if entry is None:
                goal._on_missing(server)
            else:
                goal._on_status(server, entry.state, entry.text)
        if server == self._server:
            self._bulk_cancels = [
                each for each in self._bulk_cancels if not (each.sent and each.on_status(entries))
            ]

    def _take_result(self, message: Message) -> None:
        goal = self._goals.get(message.status.goal_id.id.encode())
        if goal is not None:
            goal._on_result(state_of(message.status), message.status.text, message.result)

    def _take_feedback(self, message: Message) -> None:
        goal = self._goals.get(message.status.goal_id.id.encode())
        if goal is not None:
            goal._on_feedback(message.feedback)

    def _update_server(self) -> None:
        """Choose the server, and send it what waits for one."""
        endpoints = self._endpoints
        if endpoints is None or self._closed:
            return
        status_publishers = endpoints.status_publishers()
        for known in (self._lists, self._heard):
            for name in known.keys() - status_publishers.keys():
                known.pop(name)
        complete = sorted(name for name in self._heard if not endpoints.missing(name))
        if self._server in complete:
            return
        was, self._server = self._server, next(iter(complete), "")
        if not self._server:
            if was:
                self._readiness.update()
            return
        self._since, self._epoch = time.monotonic(), self._epoch + 1
        for goal in self._open_goals():
            if goal._is_unsent:
                goal._send(self._server, self._epoch)
        self._send_bulk_cancels()
        self._readiness.update()

    def _check_server(self) -> None:
        """Check whether the servers of goals are still there."""
        self._update_server()
        endpoints = self._endpoints
        if endpoints is None or self._closed:
            return
        status_publishers = endpoints.status_publishers()
        settled = time.monotonic() - self._since >= _SETTLED_S
        for goal in self._open_goals():
            goal._check_server(status_publishers, self._epoch, settled)
        for server in {goal.server for goal in self._open_goals() if goal._sent is not None}:
            silent = time.monotonic() - self._heard.get(server, time.monotonic())
            if silent >= _SILENCE_S and server not in self._asked:
                self._asked.add(server)
                self._core.pool.run(partial(self._ping, server, status_publishers[server]))

    def _ping(self, server: str, uri: str) -> None:
        """Call a silent server to see whether it is alive: some publish changes only."""
        problem = ""
        try:
            call_node(uri, "getPid", self._core.name.full, timeout=_ANSWER_TIMEOUT_S)
        except Error as error:
            problem = str(error)
        self._jobs.add(lambda: self._on_ping(server, problem))

    def _on_ping(self, server: str, problem: str) -> None:
        self._asked.discard(server)
        heard = self._heard.get(server)
        if heard is None:
            return
        if not problem:
            self._heard[server] = time.monotonic()
        elif time.monotonic() - heard >= _SILENCE_S:  # no status was received until now either
            self._heard.pop(server)
            self._server = "" if self._server == server else self._server
            self._readiness.update()
            for goal in self._open_goals():
                if goal.server == server:
                    goal._lose_server(f"stopped responding ({problem}) before")

    # -- received messages, in the loop's thread -------------------------------------------------

    def _on_status(self, sample: Sample) -> None:
        server = sample.publisher.decode()
        self._jobs.add(lambda: self._decoded(lambda: self._take_status(server, sample.message())))

    def _on_result(self, sample: Sample) -> None:
        def take() -> None:
            self._decoded(lambda: self._take_result(sample.message()))

        # After the feedback that arrived with it on another connection.
        self._core.loop.call(lambda: self._jobs.add(take))

    def _on_feedback(self, sample: Sample) -> None:
        self._jobs.add(lambda: self._decoded(lambda: self._take_feedback(sample.message())))

    def _decoded(self, job: Callable[[], None]) -> None:
        """Run `job`, which decodes a message; log what cannot be decoded once."""
        try:
            job()
        except DecodeError as error:
            if str(error) != self._garbage:
                self._garbage = str(error)
                _log.warning("%s: a message of its server cannot be decoded: %s", self.name, error)

    # -- following the graph ---------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - links change by themselves
        """Follow the graph: the type, the server, and goals whose server has left."""
        if self._closed:
            return
        if self._discovery is not None:
            self._discover(self._discovery)
        self._log_conflicts(_log)
        self._jobs.add(self._check_server)

    def _discover(self, discovery: ActionDiscovery) -> None:
        types = discovery.types()
        if types is None:
            return
        try:
            self._open(types)
        except DefinitionConflictError as error:
            discovery.problem = str(error)
            return
        discovery.close()
        self._discovery = None

    def _open(self, types: ActionTypes) -> None:
        """Open the topics."""
        callbacks = {
            STATUS: self._on_status,
            RESULT: self._on_result,
            FEEDBACK: self._on_feedback,
        }
        endpoints = _ClientTopics(self._core, self._topics, self.name, types, callbacks)
        with self._lock:
            self.type = types.action
            closed = self._closed
            if not closed:
                self._endpoints = endpoints
        if closed:
            endpoints.close()

    def _server_conflicts(self) -> list[str]:
        discovery, endpoints = self._discovery, self._endpoints
        if discovery is not None:
            return [discovery.problem] if discovery.problem else []
        return [] if endpoints is None else endpoints.problems()

    def _unavailable_reason(self) -> str:
        endpoints = self._endpoints
        connecting = "" if endpoints is None else endpoints.unavailable_reason(self._heard)
        if connecting:
            return connecting
        names = served_actions(self._core.graph)
        if self.name in names:
            return f"the server of {self.name} is not connected yet"
        return self._no_server_message(names)

    # -- the end ---------------------------------------------------------------------------------

    def _withdraw(self) -> None:
        self._jobs.add(self._end)
        for end in (self._endpoints, self._discovery):
            if end is not None:
                end.close()
        self._core.remove(self)

    def _end(self) -> None:
        for goal in self._open_goals():
            goal._end_as_lost(self._client_closed_error())
        reason = f"the client of {self.name} was closed before the server cancelled the goals"
        for request in self._bulk_cancels:
            request.answer.set_exception(NodeClosedError(reason))
        self._bulk_cancels.clear()


class _ClientTopics:
    """A client's two publishers and three subscriptions.

    Args:
        core: The node.
        topics: Its topics.
        name: Absolute action name.
        types: The topics' types.
        callbacks: Called with the topics' samples in the loop's thread, by their names.

    Raises:
        DefinitionConflictError: The node publishes another type on one of the topics.
    """

    def __init__(
        self,
        core: TcprosCore,
        topics: Topics,
        name: str,
        types: ActionTypes,
        callbacks: Mapping[str, Callable[[Sample], None]],
    ) -> None:
        self._topics = topics
        self._names = {
            word: core.resolve(action_topic(name, word))
            for word in (GOAL, CANCEL, STATUS, RESULT, FEEDBACK)
        }
        self._publishers: dict[str, Publisher] = {}
        self._subscriptions: dict[str, Subscription] = {}
        with undo_on_error(self.close):
            for word in (GOAL, CANCEL):
                message_type = getattr(types, word)
                self._publishers[word] = Publisher(core, self._names[word], message_type, QUEUE)
        for word, callback in callbacks.items():
            subscription = Subscription(
                self._names[word], getattr(types, word), QUEUE, IMMEDIATE, raw_callback=callback
            )
            self._subscriptions[word] = subscription
            topics.subscribe(subscription, False)

    def send_goal(self, goal: dict[str, Any]) -> None:
        """Publish a goal; raises ConversionError."""
        self._publishers[GOAL].publish(goal)

    def send_cancel(self, id: str, time: Time) -> bool:
        """Request the cancellation of one goal, those up to a time, or all.

        Returns:
            Whether a server is connected.
        """
        self._publishers[CANCEL].publish(goal_id(id, time))
        return self._publishers[CANCEL].subscription_count() > 0

    def status_publishers(self) -> dict[str, str]:
        """Return the connected nodes that publish the status of goals, with their URIs."""
        shared = self._topics.subscribed().get(self._names[STATUS])
        links = [] if shared is None else shared.links()
        return {link.name: link.uri for link in links if link.connected}

    def missing(self, server: str) -> list[str]:
        """Return the topics on which a node is not connected (yet)."""
        names = []
        for word in (GOAL, CANCEL):
            publication = self._topics.published().get(self._names[word])
            connected = [] if publication is None else publication.connected()
            if all(end.node.full != server for end in connected):
                names.append(self._names[word])
        for word in (STATUS, RESULT, FEEDBACK):
            shared = self._topics.subscribed().get(self._names[word])
            links = [] if shared is None else shared.links()
            accepted = self._subscriptions[word].publisher_count() > 0
            if not accepted or all(n.name != server or not n.connected for n in links):
                names.append(self._names[word])
        return names

    def problems(self) -> list[str]:
        """Return the problems that the user has to fix."""
        if not self.status_publishers():
            return []  # the topics' problem is that there is no server
        problems = [end.problem for end in self._subscriptions.values()]
        problems += [end.problem for end in self._publishers.values()]
        return list(dict.fromkeys(problem for problem in problems if problem))

    def unavailable_reason(self, heard: Collection[str]) -> str:
        """Return why none of the connected nodes is a server yet; empty if none is connected.

        Args:
            heard: Those that have published the status of their goals.
        """
        for server in self.status_publishers():
            missing = ", ".join(self.missing(server))
            if missing:
                return f"the server {server} is not connected on {missing} (yet)"
            if server not in heard:
                return f"the server {server} does not publish the status of its goals"
        return ""

    def close(self) -> None:
        """Close them all; safe to call twice."""
        for end in (*self._publishers.values(), *self._subscriptions.values()):
            end.close()
