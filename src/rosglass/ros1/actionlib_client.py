"""Actions over actionlib's five topics, as their client has them.

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
from rosglass.errors import (
    ConnectionLostError,
    DecodeError,
    DefinitionConflictError,
    Error,
    GoalRejectedError,
    NodeClosedError,
    TimeoutError,  # noqa: A004 - the field's own word
)
from rosglass.ros1.action_state import CommState, CommStateMachine, ServerState
from rosglass.ros1.actionlib_discovery import ActionDiscovery
from rosglass.ros1.actionlib_types import (
    CANCEL,
    FEEDBACK,
    GOAL,
    QUEUE,
    RESULT,
    STATUS,
    ActionTypes,
    goal_id,
    new_id,
    offered,
    part,
    stamp,
    state_of,
    time_of,
)
from rosglass.wires.tcpros.master import call_node
from rosglass.wires.tcpros.registrations import Member

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from rosglass.comm import Executor, Handle, Sample
    from rosglass.messages import ActionType, Message
    from rosglass.ros1.action_state import Step, TerminalState
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.topics import Topics

__all__ = ["ActionlibClient", "ActionlibClientGoal"]

_log = logging.getLogger("rosglass.ros1")
#: Time without a status message, of which there are five a second usually, after which the
#: server is asked whether it is alive; and that it may take to answer.
_SILENCE_S, _ANSWER_S = 5.0, 5.0
#: Seconds that do not fit into a time stamp any more, and their year.
_END_OF_TIME = 2**32, 2106
#: Time after which a server has shown the goals that it knew when it was connected.
_SETTLED_S = 1.0
#: Time that a result may take once the server keeps the goal's end in mind no longer.
_OVERDUE_S = 5.0
#: Time after which a request to cancel is repeated that the server shows no sign of, and how
#: often while it is connected: a lost stop command is the worst that can happen.
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


class Entry(NamedTuple):
    """What a status message says of a goal.

    Attributes:
        state: Its state.
        text: Why, in the server's words.
        stamp: The goal's time stamp.
    """

    state: ServerState
    text: str
    stamp: Time


class BulkCancel:
    """A request to cancel all goals of a server, or those until a time.

    No ROS 1 server answers such a request: the status of its goals shows what it does.

    Args:
        until: The last time stamp of goals to be cancelled; None for all.
        answer: Fulfilled when the goals that ran are cancelled, or have ended.
        before: The server's goals when it was asked, by their ids.
    """

    def __init__(
        self, until: Time | None, answer: Promise[CancelAnswer], before: dict[str, Entry]
    ) -> None:
        self.answer = answer
        self._begun = time.monotonic()
        self._canceling = {key for key, entry in before.items() if entry.state in _CANCELED}
        self._meant = {
            key
            for key, entry in before.items()
            if entry.state in _RUNNING and (until is None or entry.stamp <= until)
        }
        self._canceled: dict[str, None] = {}

    def on_status(self, entries: dict[str, Entry]) -> bool:
        """Take a status message; return whether the request is answered now."""
        for key, entry in entries.items():
            if entry.state in _CANCELED and key not in self._canceling:
                self._canceled[key] = None
        if any(key in entries and entries[key].state in _RUNNING for key in self._meant):
            return False
        if not self._canceled and time.monotonic() - self._begun < _RECEIVED_S:
            return False  # it may have been on its way already
        accepted = tuple(key.encode() for key in self._canceled)
        self.answer.set_result(
            CancelAnswer(accepted, "" if accepted else "there was no goal to cancel")
        )
        return True


class BulkCancels:
    """A client's requests to cancel many goals: some wait for a server, some for its status.

    Args:
        name: Of the action.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._waiting: list[tuple[Time | None, Promise[CancelAnswer]]] = []
        self._asked: list[BulkCancel] = []

    def add(self, until: Time | None, answer: Promise[CancelAnswer]) -> None:
        """Take a request in; it waits for :meth:`ask`."""
        self._waiting.append((until, answer))

    def ask(self, before: dict[str, Entry], send: Callable[[Time | None], object]) -> None:
        """Ask a server for all that waits.

        Args:
            before: What the server said last of its goals.
            send: Sends one request.
        """
        waiting, self._waiting = self._waiting, []
        for until, answer in waiting:
            self._asked.append(BulkCancel(until, answer, before))
            send(until)

    def on_status(self, entries: dict[str, Entry]) -> None:
        """Take a status message of the server that was asked."""
        self._asked = [each for each in self._asked if not each.on_status(entries)]

    def give_up(self, answer: Promise[CancelAnswer], timeout: float, unsent: Error) -> None:
        """Wait no longer.

        Args:
            answer: For which request.
            timeout: Seconds that were waited.
            unsent: Its error if no server could be asked.
        """
        if any(each is answer for _, each in self._waiting):
            answer.set_exception(unsent)
        answer.set_exception(
            TimeoutError(
                f"{self._name} did not tell within {timeout:g} s that all goals are cancelled. It "
                "may cancel them all the same: watch their status"
            )
        )
        self._waiting = [entry for entry in self._waiting if entry[1] is not answer]
        self._asked = [each for each in self._asked if each.answer is not answer]

    def fail(self, error: Error) -> None:
        """Answer all with an error."""
        answers = [each.answer for each in self._asked] + [each for _, each in self._waiting]
        self._asked, self._waiting = [], []
        for answer in answers:
            answer.set_exception(error)


class ActionlibClientGoal(ClientGoal):
    """A goal with actionlib's states; made by :meth:`ActionClient.send_goal`.

    Args:
        client: Its client.
        id_text: Its id.
        created: Its time stamp.
        goal: What is asked for: a message of the action's type, or what becomes one.
        timeout: Seconds for the server to appear and to show that it knows the goal.
        typed: Whether the action's type is known.

    Attributes:
        stamp: When it was created, by this node's clock; what :meth:`ActionClient.cancel_before`
            compares.
        server: Full name of the node that it was sent to; empty before.
        text: What the server sent with the goal's status, e.g. why it failed.
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

    def resend(self) -> None:
        """Send it once more, as it is: for servers that may have missed it.

        A server that knows it takes no notice.

        Raises:
            Error: It has ended: send a new one.
            NodeClosedError: The client was closed.
        """
        if self._client.closed:
            raise self._client._ended()
        if self._done.done():
            raise Error(f"{self._label} has ended as {self._status.value}: send a new goal instead")
        self._jobs.add(self._resend)

    def close(self) -> None:
        """Watch it no longer; the goal itself goes on. Safe to call twice."""
        self._state_listeners.clear()
        super().close()

    # -- for its client, in jobs -----------------------------------------------------------------

    @property
    def _is_unsent(self) -> bool:
        """Whether it waits for a server."""
        return self._sent is None and not self._done.done()

    def _send(self, server: str, epoch: int) -> None:
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
            self._client._send(sent)
        except Error as error:
            self._lose(error)
        else:
            self._sent, self.server, self._epoch = sent, server, epoch

    def _on_status(self, server: str, said: ServerState, text: str) -> None:
        """Take what a status message says of it."""
        if self._known and server != self.server:
            return  # another server took it, too; the first one counts
        self.server, self._known, self._absent = server, True, None
        self._take(said, text)
        waits = self._machine.state is CommState.WAITING_FOR_CANCEL_ACK
        if waits and self._repeats < _REPEATS and time.monotonic() - self._asked >= _REPEAT_S:
            self._repeats += self._ask_cancel()

    def _on_missing(self, server: str) -> None:
        """Take note that a status message does not name it."""
        if not self._known or server != self.server or self._done.done():
            return
        if self._machine.state is not CommState.WAITING_FOR_RESULT:
            self._lose(
                ConnectionLostError(
                    f"the server of {self._client.name} ({server}) does not know goal "
                    f"{self._id_text} any more: it was restarted meanwhile, or it ended and "
                    "nothing of that came through"
                )
            )
            return
        now = time.monotonic()
        self._absent = self._absent or now
        if now - self._absent >= _OVERDUE_S:
            self._lose_result(f"its result never came from {server}")

    def _on_feedback(self, feedback: Message) -> None:
        """Take feedback for it."""
        if not self._done.done():
            self._add_feedback(feedback)

    def _on_result(self, said: ServerState, text: str, result: Message) -> None:
        """Take its result."""
        if self._done.done():
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
            self._finish(GoalRejectedError(told + because))
        elif status is GoalStatus.LOST:
            told = f"the server of {self._client.name} says that goal {self._id_text} is lost"
            self._finish(ConnectionLostError(told + because))
        else:
            self._finish(ActionResult(status, result))

    def _watch(self, status_publishers: dict[str, str], epoch: int, settled: bool) -> None:
        """Look whether its server is still there.

        Args:
            status_publishers: The nodes that are connected to send the status of goals.
            epoch: Number of the client's connection with a server.
            settled: Whether that connection is some time old.
        """
        if self._sent is None or self._done.done():
            return
        now = time.monotonic()
        if self.server in status_publishers:
            self._alone = None
            if not self._known and settled and epoch != self._epoch:
                self._client._ask_cancel(self._id_text)  # nothing is to run unwatched
                self._lose(self._gone("was cut off after it was sent the goal, before"))
            return
        self._alone = self._alone or now
        cut_off = self._client._core.status().state is not ConnectionState.CONNECTED
        if now - self._alone >= (OUTAGE_S if cut_off else GRACE_S):
            self._lose_server("went away before")

    def _lose_server(self, what: str) -> None:
        """End it, as its server is there no more."""
        if self._machine.state is CommState.WAITING_FOR_RESULT:
            self._lose_result(f"its server ({self.server}) {what} it told the result")
        else:
            self._lose(self._gone(what))

    def _lose(self, error: BaseException) -> None:
        """End it as LOST, unless it has ended."""
        if not self._done.done():
            self._go(self._machine.lose())
            self._finish(error)

    # -- inside ----------------------------------------------------------------------------------

    def _gone(self, what: str) -> ConnectionLostError:
        client = self._client
        return ConnectionLostError(
            f"the server of {client.name} ({self.server}) {what} goal {self._id_text} ended; "
            f"nobody knows what becomes of it ({client._core.url}: {client._core.status()})"
        )

    def _lose_result(self, why: str) -> None:
        ended = self._machine.status.value
        self._lose(ConnectionLostError(f"{self._label} has ended as {ended}, but {why}"))

    def _give_up(self) -> None:
        """Take note that the time has run out in which the server should have answered."""
        if self._done.done() or self._known:
            return
        client, seconds = self._client, self._timeout or 0.0
        if self._sent is None:
            self._lose(client._unsent(seconds))
            return
        client._ask_cancel(self._id_text)  # nothing is to run unwatched
        told = (
            f"the server of {client.name} ({self.server}) did not tell that it knows goal "
            f"{self._id_text} within {seconds:g} s; it was asked to cancel it, should it get it yet"
        )
        self._lose(TimeoutError(told))

    def _resend(self) -> None:
        if self._sent is not None and not self._done.done():
            self._client._send(self._sent)

    def _cancel(self, answer: Promise[CancelAnswer], timeout: float | None) -> None:
        if self._done.done():
            answer.set_result(self._too_late())
        elif self._sent is None:
            self._withdraw()
            answer.set_result(CancelAnswer((self.id,)))
        else:
            failure = (
                f"{self._client.name} did not tell within {timeout or 0.0:g} s that it cancels "
                f"goal {self._id_text}. It may cancel it all the same: watch the goal's status"
            )
            self._add_cancel(answer, timeout, failure)
            self._repeats = 0
            self._ask_cancel()
            self._go(self._machine.cancel())

    def _withdraw(self) -> None:
        """Let it end without having been sent."""
        self._machine.hear(ServerState.PENDING)
        self._go(self._machine.finish(ServerState.RECALLED))
        kind = self._client.type
        if kind is not None:
            self._finish(ActionResult(GoalStatus.CANCELED, kind.result.create()))
        else:
            self._finish(self._without_result())

    def _ask_cancel(self) -> bool:
        self._asked = time.monotonic()
        return self._client._ask_cancel(self._id_text)

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
            self._finish(ConnectionLostError(told))

    def _complain(self, error: ValueError) -> None:
        if not self._odd:
            self._odd = True
            _log.warning(
                "%s: its server %s contradicts itself: %s", self._label, self.server, error
            )

    def _go(self, steps: list[Step]) -> None:
        """Show the states that it has gone through."""
        for state, status in steps:
            self._state_listeners.notify(state)
            if status is not self._status:
                self._set_status(status)
        if self._machine.executed:
            self._acceptance.set_result(True)
        said = self._machine.heard
        if self._cancels and (said in _CANCELED or (said is not None and said.is_terminal)):
            cancels, self._cancels = self._cancels, []
            for answer, _ in cancels:
                answer.set_result(
                    CancelAnswer((self.id,)) if said in _CANCELED else self._too_late()
                )


class ActionlibClient(ActionClient, Member):
    """An action client that follows which of actionlib's servers is there.

    Args:
        core: The node it belongs to.
        topics: The node's topics.
        name: Absolute action name.
        wanted: The type; None for the one that the server's topics tell.
    """

    _core: TcprosCore
    _goals: dict[bytes, ActionlibClientGoal]

    def __init__(
        self, core: TcprosCore, topics: Topics, name: str, wanted: ActionType | None
    ) -> None:
        super().__init__(core, name, _END_OF_TIME)
        #: Runs all that happens to the client and its goals, one after the other.
        self._jobs = InOrder()
        self._topics = topics
        self._ends: _ClientTopics | None = None
        self._discovery: ActionDiscovery | None = None
        #: The server that goals are sent to; empty while none is there.
        self._server, self._since, self._epoch = "", 0.0, 0
        #: What each server said last of its goals, and when it was last known to be alive.
        self._lists: dict[str, dict[str, Entry]] = {}
        self._heard: dict[str, float] = {}
        self._asked: set[str] = set()
        self._bulk_cancels = BulkCancels(name)
        self._garbage = ""
        if wanted is None:
            self._discovery = ActionDiscovery(core, topics, name)
        else:
            self._speak(ActionTypes.of(wanted, core.types))
        core.add(self)

    def _is_ready(self) -> bool:
        """Return whether a server is there that understands the goals.

        As actionlib has it: it tells the status of its goals, and is connected on all five topics.
        """
        return bool(self._server) and not self._closed

    @property
    def server(self) -> str:
        """Full name of the node that goals are sent to; empty while none is there."""
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
        """Send a goal, as soon as a server is there; see :meth:`comm.ActionClient.send_goal`.

        Args:
            goal: A message or a dict of fields; missing fields, and None, get the defaults.
            on_feedback: Called with each feedback.
            on_status_change: Called with each new status.
            on_comm_state_change: Called with each new state of actionlib's own.
            on_done: Called with the goal when it has ended, one way or another.
            executor: Where callbacks run; None for the node's own dispatcher thread.
            timeout: Seconds for the server to appear and to tell that it knows the goal; servers
                may keep it waiting (PENDING) for as long as they like. None for ever.
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
            f"{self.name} has not told that it cancels goals",
            self._core.dispatcher,
            cancellable=False,
        )

        def give_up() -> None:
            unsent = self._not_cancelled(timeout)
            self._bulk_cancels.give_up(answer, timeout or 0.0, unsent)

        if timeout is not None:
            self._core.timers.after(timeout, lambda: self._jobs.add(give_up))
        self._jobs.add(lambda: self._begin_bulk_cancel(until, answer))
        return answer

    # -- for its goals, in jobs ------------------------------------------------------------------

    def _send(self, goal: dict[str, Any]) -> None:
        """Publish a goal; raises ConversionError."""
        if self._ends is not None:
            self._ends.send_goal(goal)

    def _ask_cancel(self, id_text: str) -> bool:
        """Publish a request to cancel one goal; return whether a server is connected."""
        ends = self._ends
        return ends is not None and not self._closed and ends.send_cancel(id_text, Time())

    # -- jobs ------------------------------------------------------------------------------------

    def _send_or_wait(self, goal: ActionlibClientGoal) -> None:
        if self.closed:
            goal._lose(self._ended())
            return
        goal._wait()
        self._look()  # a goal must not go to a server that has left
        if self._server and goal._is_unsent:
            goal._send(self._server, self._epoch)

    def _begin_bulk_cancel(self, until: Time | None, answer: Promise[CancelAnswer]) -> None:
        if self.closed:
            answer.set_exception(NodeClosedError(f"the client of {self.name} was closed"))
            return
        for goal in self._live():
            if goal._is_unsent and (until is None or goal.stamp <= until):
                goal.cancel()
        self._look()  # a lost stop command is the worst that can happen
        self._bulk_cancels.add(until, answer)
        self._ask_bulk_cancels()

    def _ask_bulk_cancels(self) -> None:
        ends = self._ends
        if self._server and ends is not None:
            before = dict(self._lists.get(self._server, {}))
            self._bulk_cancels.ask(before, lambda until: ends.send_cancel("", until or Time()))

    def _take_status(self, server: str, message: Message) -> None:
        entries = {
            each.goal_id.id: Entry(state_of(each), each.text, time_of(each.goal_id.stamp))
            for each in message.status_list
        }
        self._lists[server], self._heard[server] = entries, time.monotonic()
        self._look()
        for goal in self._live():
            entry = entries.get(goal.id_text)
            if entry is None:
                goal._on_missing(server)
            else:
                goal._on_status(server, entry.state, entry.text)
        if server == self._server:
            self._bulk_cancels.on_status(entries)

    def _take_result(self, message: Message) -> None:
        goal = self._goals.get(message.status.goal_id.id.encode())
        if goal is not None:
            goal._on_result(state_of(message.status), message.status.text, message.result)

    def _take_feedback(self, message: Message) -> None:
        goal = self._goals.get(message.status.goal_id.id.encode())
        if goal is not None:
            goal._on_feedback(message.feedback)

    def _look(self) -> None:
        """Look which server is there, and let it have what waits for one."""
        ends = self._ends
        if ends is None or self._closed:
            return
        status_publishers = ends.status_publishers()
        for known in (self._lists, self._heard):
            for name in known.keys() - status_publishers.keys():
                known.pop(name)
        complete = sorted(name for name in self._heard if not ends.missing(name))
        if self._server in complete:
            return
        was, self._server = self._server, next(iter(complete), "")
        if not self._server:
            if was:
                self._readiness.update()
            return
        self._since, self._epoch = time.monotonic(), self._epoch + 1
        for goal in self._live():
            if goal._is_unsent:
                goal._send(self._server, self._epoch)
        self._ask_bulk_cancels()
        self._readiness.update()

    def _watch(self) -> None:
        """Look whether the servers of goals are still there."""
        self._look()
        ends = self._ends
        if ends is None or self._closed:
            return
        status_publishers = ends.status_publishers()
        settled = time.monotonic() - self._since >= _SETTLED_S
        for goal in self._live():
            goal._watch(status_publishers, self._epoch, settled)
        for server in {goal.server for goal in self._live() if goal._sent is not None}:
            silent = time.monotonic() - self._heard.get(server, time.monotonic())
            if silent >= _SILENCE_S and server not in self._asked:
                self._asked.add(server)
                self._core.pool.run(partial(self._ask, server, status_publishers[server]))

    def _ask(self, server: str, uri: str) -> None:
        """Ask a silent server whether it lives: it may be one that sends changes only."""
        problem = ""
        try:
            call_node(uri, "getPid", self._core.name.full, timeout=_ANSWER_S)
        except Error as error:
            problem = str(error)
        self._jobs.add(lambda: self._take_life(server, problem))

    def _take_life(self, server: str, problem: str) -> None:
        self._asked.discard(server)
        heard = self._heard.get(server)
        if heard is None:
            return
        if not problem:
            self._heard[server] = time.monotonic()
        elif time.monotonic() - heard >= _SILENCE_S:  # it said nothing meanwhile either
            self._heard.pop(server)
            self._server = "" if self._server == server else self._server
            self._readiness.update()
            for goal in self._live():
                if goal.server == server:
                    goal._lose_server(f"fell silent ({problem}) before")

    # -- what comes, in the loop's thread --------------------------------------------------------

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
        """Run `job`, which decodes a message; log once what is none."""
        try:
            job()
        except DecodeError as error:
            if str(error) != self._garbage:
                self._garbage = str(error)
                _log.warning("%s: what its server sends cannot be decoded: %s", self.name, error)

    # -- following the graph ---------------------------------------------------------------------

    def follow(self, moved: bool, idle: bool) -> None:  # noqa: ARG002 - links change by themselves
        """Follow the graph: the type, whether a server is there, goals whose server went."""
        if self._closed:
            return
        if self._discovery is not None:
            self._discover(self._discovery)
        self._log_conflicts(_log)
        self._jobs.add(self._watch)

    def _discover(self, discovery: ActionDiscovery) -> None:
        types = discovery.look()
        if types is None:
            return
        try:
            self._speak(types)
        except DefinitionConflictError as error:
            discovery.problem = str(error)
            return
        discovery.close()
        self._discovery = None

    def _speak(self, types: ActionTypes) -> None:
        """Open the topics."""
        callbacks = {
            STATUS: self._on_status,
            RESULT: self._on_result,
            FEEDBACK: self._on_feedback,
        }
        ends = _ClientTopics(self._core, self._topics, self.name, types, callbacks)
        with self._lock:
            self.type = types.action
            closed = self._closed
            if not closed:
                self._ends = ends
        if closed:
            ends.close()

    def _conflicts(self) -> list[str]:
        discovery, ends = self._discovery, self._ends
        if discovery is not None:
            return [discovery.problem] if discovery.problem else []
        return [] if ends is None else ends.problems()

    def _absence(self) -> str:
        ends = self._ends
        connecting = "" if ends is None else ends.absence(self._heard)
        if connecting:
            return connecting
        names = offered(self._core.graph)
        if self.name in names:
            return f"the server of {self.name} is not connected yet"
        return self._no_server(names)

    # -- the end ---------------------------------------------------------------------------------

    def _withdraw(self) -> None:
        self._jobs.add(self._end)
        for end in (self._ends, self._discovery):
            if end is not None:
                end.close()
        self._core.remove(self)

    def _end(self) -> None:
        for goal in self._live():
            goal._lose(self._ended())
        told = f"the client of {self.name} was closed before the server told that it cancels goals"
        self._bulk_cancels.fail(NodeClosedError(told))


class _ClientTopics:
    """A client's two publishers and three subscriptions.

    Args:
        core: The node.
        topics: Its topics.
        name: Absolute action name.
        types: Of the topics.
        callbacks: Take what comes on the topics, by their names, in the loop's thread.

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
            word: core.resolve(part(name, word))
            for word in (GOAL, CANCEL, STATUS, RESULT, FEEDBACK)
        }
        self._publishers: dict[str, Publisher] = {}
        self._subscriptions: dict[str, Subscription] = {}
        try:
            for word in (GOAL, CANCEL):
                kind = getattr(types, word)
                self._publishers[word] = Publisher(core, self._names[word], kind, QUEUE)
        except BaseException:
            self.close()
            raise
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
        """Ask for goals to be cancelled: one, those until a time, or all.

        Returns:
            Whether a server is connected.
        """
        self._publishers[CANCEL].publish(goal_id(id, time))
        return self._publishers[CANCEL].subscription_count() > 0

    def status_publishers(self) -> dict[str, str]:
        """Return the nodes that are connected to send the status of goals, with their URIs."""
        shared = self._topics.subscribed().get(self._names[STATUS])
        links = [] if shared is None else shared.links()
        return {link.name: link.uri for link in links if link.connected}

    def missing(self, server: str) -> list[str]:
        """Return the topics on which a node is not connected (yet)."""
        names = []
        for word in (GOAL, CANCEL):
            publication = self._topics.published().get(self._names[word])
            there = [] if publication is None else publication.connected()
            if all(end.node.full != server for end in there):
                names.append(self._names[word])
        for word in (STATUS, RESULT, FEEDBACK):
            shared = self._topics.subscribed().get(self._names[word])
            links = [] if shared is None else shared.links()
            understood = self._subscriptions[word].publisher_count() > 0
            if not understood or all(n.name != server or not n.connected for n in links):
                names.append(self._names[word])
        return names

    def problems(self) -> list[str]:
        """Say what a person has to mend."""
        if not self.status_publishers():
            return []  # what the topics say is that no server is there
        problems = [end.problem for end in self._subscriptions.values()]
        problems += [end.problem for end in self._publishers.values()]
        return list(dict.fromkeys(problem for problem in problems if problem))

    def absence(self, heard: Collection[str]) -> str:
        """Say why none of the nodes that are connected is a server yet; empty when there is none.

        Args:
            heard: Those that have sent the status of their goals.
        """
        for server in self.status_publishers():
            missing = ", ".join(self.missing(server))
            if missing:
                return f"the server {server} is not connected on {missing} (yet)"
            if server not in heard:
                return f"the server {server} does not tell the status of its goals"
        return ""

    def close(self) -> None:
        """End them all; safe to call twice."""
        for end in (*self._publishers.values(), *self._subscriptions.values()):
            end.close()
