"""Sending goals to actionlib servers.

Protocol: ROS wiki, "actionlib/DetailedDescription".
"""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Any

from rosglass.comm import Promise, Time
from rosglass.comm.goal_client import GoalClient
from rosglass.comm.inorder import InOrder
from rosglass.comm.promise import check_timeout
from rosglass.errors import (
    DecodeError,
    DefinitionConflictError,
    Error,
    NodeClosedError,
)
from rosglass.ros1.action_discovery import ActionDiscovery
from rosglass.ros1.action_ends import ActionEnds
from rosglass.ros1.action_types import (
    FEEDBACK,
    RESULT,
    STATUS,
    ActionTypes,
    new_id,
    offered,
    state_of,
    time_of,
)
from rosglass.ros1.cancelling import Entry, Sweeps
from rosglass.ros1.client_goal import Ros1ClientGoal
from rosglass.ros1.core import Member
from rosglass.ros1.master import call_node

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import CancelAnswer, ClientGoal, Executor, GoalStatus, Sample
    from rosglass.messages import ActionType, Message
    from rosglass.ros1.action_state import CommState
    from rosglass.ros1.core import Core
    from rosglass.ros1.topics import Topics

__all__ = ["Ros1ActionClient"]

_log = logging.getLogger("rosglass.ros1")
#: Seconds without a status message, of which there are five a second usually, after which the
#: server is asked whether it is alive; and that it may take to answer.
_SILENCE, _ANSWER = 5.0, 5.0
#: Seconds that do not fit into a time stamp any more, and their year.
_END_OF_TIME = 2**32, 2106
#: Seconds after which a server has told of the goals that it knew when it was connected.
_SETTLED = 1.0


class Ros1ActionClient(GoalClient[Ros1ClientGoal], Member):
    """An action client; made by :meth:`Node.create_action_client`.

    Args:
        core: The node it belongs to.
        topics: The node's topics.
        name: Absolute action name.
        wanted: The type; None for the one that the server's topics tell.

    Attributes:
        core: The node it belongs to.
        jobs: Where all that happens to the client and its goals happens, one after the other.
    """

    def __init__(self, core: Core, topics: Topics, name: str, wanted: ActionType | None) -> None:
        super().__init__(core, name, _END_OF_TIME)
        self.core = core
        self.jobs = InOrder()
        self._topics = topics
        self._goals: dict[str, Ros1ClientGoal] = {}
        self._ends: ActionEnds | None = None
        self._discovery: ActionDiscovery | None = None
        #: The server that goals are sent to; empty while none is there.
        self._server, self._since, self._epoch = "", 0.0, 0
        #: What each server said last of its goals, and when it was last known to be alive.
        self._lists: dict[str, dict[str, Entry]] = {}
        self._heard: dict[str, float] = {}
        self._asked: set[str] = set()
        self._sweeps = Sweeps(name)
        self._garbage = ""
        if wanted is None:
            self._discovery = ActionDiscovery(core, topics, name)
        else:
            self._speak(ActionTypes.of(wanted, core.types))
        core.add(self)
        core.wake()

    # -- who is there ----------------------------------------------------------------------------

    @property
    def ready(self) -> bool:
        """Whether a server is there that understands the goals.

        As actionlib has it: it tells the status of its goals, and is connected on all five topics.
        """
        return bool(self._server) and not self._closed

    @property
    def server(self) -> str:
        """Full name of the node that goals are sent to; empty while none is there."""
        return "" if self._closed else self._server

    # -- goals -----------------------------------------------------------------------------------

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
    ) -> Ros1ClientGoal:
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
        made = self._new_goal(goal, timeout, executor, on_feedback, on_status_change, on_done)
        if on_comm_state_change is not None:
            made.on_comm_state_change(on_comm_state_change, executor)
        with self._lock:
            if not self._closed:
                self._goals[made.id_text] = made
        self.jobs.add(lambda: self._begin(made))
        return made

    def _make(self, goal: Any, timeout: float | None, *, typed: bool) -> Ros1ClientGoal:
        now = self.core.clock.now()
        id_text = new_id(self.core.name.full, now)
        return Ros1ClientGoal(self, id_text, now, goal, timeout, typed=typed)

    def cancel_all(self, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel all its goals; returns at once."""
        self._check_open()
        return self._sweep(None, check_timeout(timeout, self.name))

    def cancel_before(self, time: Time, timeout: float | None = 10.0) -> Promise[CancelAnswer]:
        """Ask the server to cancel all goals with a time stamp at or before `time`.

        In ROS 1 the stamp is the sender's, see :attr:`Ros1ClientGoal.stamp`. Servers of actionlib
        cancel goals with such a stamp that come later, too.
        """
        self._check_open()
        timeout = check_timeout(timeout, self.name)
        self._check_stamp(time)
        return self._sweep(time, timeout)

    def _sweep(self, until: Time | None, timeout: float | None) -> Promise[CancelAnswer]:
        answer: Promise[CancelAnswer] = Promise(
            f"{self.name} has not told that it cancels goals",
            self.core.dispatcher,
            cancellable=False,
        )

        def give_up() -> None:
            why = self.problem or "its server appeared too late"
            self._sweeps.give_up(answer, timeout or 0.0, why)

        if timeout is not None:
            self.core.timers.after(timeout, lambda: self.jobs.add(give_up))
        self.jobs.add(lambda: self._begin_sweep(until, answer))
        return answer

    # -- what goals ask of it, in its jobs -------------------------------------------------------

    def send(self, goal: dict[str, Any]) -> None:
        """Publish a goal; raises ConversionError."""
        if self._ends is not None:
            self._ends.send_goal(goal)

    def ask_cancel(self, id_text: str) -> bool:
        """Publish a request to cancel one goal; return whether somebody is there to hear it."""
        ends = self._ends
        return ends is not None and not self._closed and ends.send_cancel(id_text, Time())

    def forget(self, goal: Ros1ClientGoal) -> None:
        """Let a goal go that has ended."""
        with self._lock:
            self._goals.pop(goal.id_text, None)

    # -- jobs ------------------------------------------------------------------------------------

    def _begin(self, goal: Ros1ClientGoal) -> None:
        if self.closed:
            goal.lose(self.ended())
            return
        goal.begin()
        self._look()  # it is not to be sent to nobody
        if self._server and not goal.sent and not goal.over:
            goal.send(self._server, self._epoch)

    def _begin_sweep(self, until: Time | None, answer: Promise[CancelAnswer]) -> None:
        if self.closed:
            answer.fail(NodeClosedError(f"the client of {self.name} was closed"))
            return
        for goal in self._live():
            if not goal.sent and (until is None or goal.stamp <= until):
                goal.cancel()
        self._look()  # a lost stop command is the worst that can happen
        self._sweeps.add(until, answer)
        self._ask_sweeps()

    def _ask_sweeps(self) -> None:
        ends = self._ends
        if self._server and ends is not None:
            before = dict(self._lists.get(self._server, {}))
            self._sweeps.ask(before, lambda until: ends.send_cancel("", until or Time()))

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
                goal.miss(server)
            else:
                goal.hear(server, entry.state, entry.text)
        if server == self._server:
            self._sweeps.hear(entries)

    def _take_result(self, message: Message) -> None:
        goal = self._goals.get(message.status.goal_id.id)
        if goal is not None:
            goal.finish(state_of(message.status), message.status.text, message.result)

    def _take_feedback(self, message: Message) -> None:
        goal = self._goals.get(message.status.goal_id.id)
        if goal is not None:
            goal.hear_feedback(message.feedback)

    def _look(self) -> None:
        """Look which server is there, and let it have what waits for one."""
        ends = self._ends
        if ends is None or self._closed:
            return
        tellers = ends.tellers()
        for known in (self._lists, self._heard):
            for name in known.keys() - tellers.keys():
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
            if not goal.sent and not goal.over:
                goal.send(self._server, self._epoch)
        self._ask_sweeps()
        self._readiness.update()

    def _watch(self) -> None:
        """Look whether the servers of goals are still there."""
        self._look()
        ends = self._ends
        if ends is None or self._closed:
            return
        tellers = ends.tellers()
        settled = time.monotonic() - self._since >= _SETTLED
        for goal in self._live():
            goal.watch(tellers, self._epoch, settled)
        for server in {goal.server for goal in self._live() if goal.sent}:
            silent = time.monotonic() - self._heard.get(server, time.monotonic())
            if silent >= _SILENCE and server not in self._asked:
                self._asked.add(server)
                self.core.errands.run(lambda s=server, u=tellers[server]: self._ask(s, u))  # type: ignore[misc]

    def _ask(self, server: str, uri: str) -> None:
        """Ask a silent server whether it lives: it may be one that tells changes only."""
        problem = ""
        try:
            call_node(uri, "getPid", self.core.name.full, timeout=_ANSWER)
        except Error as error:
            problem = str(error)
        self.jobs.add(lambda: self._take_life(server, problem))

    def _take_life(self, server: str, problem: str) -> None:
        self._asked.discard(server)
        heard = self._heard.get(server)
        if heard is None:
            return
        if not problem:
            self._heard[server] = time.monotonic()
        elif time.monotonic() - heard >= _SILENCE:  # it said nothing meanwhile either
            self._heard.pop(server)
            self._server = "" if self._server == server else self._server
            self._readiness.update()
            for goal in self._live():
                if goal.server == server:
                    goal.lose_server(f"fell silent ({problem}) before")

    # -- what comes, in the loop's thread --------------------------------------------------------

    def _on_status(self, sample: Sample) -> None:
        server = sample.publisher.decode()
        self.jobs.add(lambda: self._decoded(lambda: self._take_status(server, sample.message())))

    def _on_result(self, sample: Sample) -> None:
        def take() -> None:
            self._decoded(lambda: self._take_result(sample.message()))

        # After the feedback that arrived with it on another connection.
        self.core.loop.call(lambda: self.jobs.add(take))

    def _on_feedback(self, sample: Sample) -> None:
        self.jobs.add(lambda: self._decoded(lambda: self._take_feedback(sample.message())))

    def _decoded(self, job: Callable[[], None]) -> None:
        """Run `job`, which decodes a message; what is none is told of once."""
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
        self._warn(_log)
        self.jobs.add(self._watch)

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
        heard = {
            STATUS: self._on_status,
            RESULT: self._on_result,
            FEEDBACK: self._on_feedback,
        }
        ends = ActionEnds(self.core, self._topics, self.name, types, heard)
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
        return [] if ends is None else ends.troubles()

    def _absence(self) -> str:
        ends = self._ends
        connecting = "" if ends is None else ends.absence(self._heard)
        if connecting:
            return connecting
        names = offered(self.core.graph)
        if self.name in names:
            return f"the server of {self.name} is not connected yet"
        return self._no_server(names)

    # -- the end ---------------------------------------------------------------------------------

    def close(self) -> None:
        """End the waiting for goals, which go on, and withdraw the client; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            ends, discovery = self._ends, self._discovery
        if self.core.forked:
            return
        self.jobs.add(self._end)
        for end in (ends, discovery):
            if end is not None:
                end.close()
        self._readiness.close()
        self.core.remove(self)

    def _end(self) -> None:
        for goal in self._live():
            goal.lose(self.ended())
        told = f"the client of {self.name} was closed before the server told that it cancels goals"
        self._sweeps.fail(NodeClosedError(told))
