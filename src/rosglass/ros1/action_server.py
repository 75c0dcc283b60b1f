"""Offering actions to actionlib clients.

Protocol: ROS wiki, "actionlib/DetailedDescription".
"""

from __future__ import annotations

import logging
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, Publisher, QoS, Subscription
from rosglass.comm.flags import check_flag
from rosglass.comm.goal_server import GoalServer
from rosglass.comm.inorder import InOrder
from rosglass.errors import DecodeError, MasterError, NodeClosedError
from rosglass.ros1.action_state import ServerState
from rosglass.ros1.action_types import (
    CANCEL,
    FEEDBACK,
    GOAL,
    QUEUE,
    RESULT,
    STATUS,
    ActionTypes,
    new_id,
    part,
    stamp,
    time_of,
)
from rosglass.ros1.core import Member
from rosglass.ros1.goal_list import GoalList
from rosglass.ros1.server_goal import Ros1ServerGoal

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence

    from rosglass.comm import Executor, Sample, ServerGoal
    from rosglass.comm.node import Result
    from rosglass.messages import ActionType, Message
    from rosglass.ros1.core import Core
    from rosglass.ros1.goal_list import GoalEntry
    from rosglass.ros1.master import Master
    from rosglass.ros1.topics import Topics

__all__ = ["Ros1ActionServer"]

_log = logging.getLogger("rosglass.ros1")
#: Status messages per second, and seconds that ended goals stay in them, unless parameters say
#: otherwise.
_FREQUENCY, _KEEP = 5.0, 5.0
#: Longest pause in seconds before ended goals are forgotten where no status is published.
_TICK = 1.0
_REPLACED = "Another goal was received, which takes its place"


class Ros1ActionServer(GoalServer, Member):
    """An action server; made by :meth:`Node.create_action_server`.

    The parameters of actionlib's servers hold for it, too: ``actionlib_status_frequency`` (searched
    from the node upwards; 0 for changes only), ``status_frequency`` and ``status_list_timeout``
    below the action's name.

    Args:
        core: The node it belongs to.
        topics: The node's topics.
        name: Absolute action name.
        type: The type.
        execute: Called with each accepted goal.
        accept: Told a goal, says whether it is accepted; None accepts all.
        cancel: Told a goal, says whether it may be cancelled; None accepts all.
        executor: Where all three run; None for a thread for each goal and, for the latter two,
            the node's dispatcher. When `execute` is a coroutine function, all run in the event
            loop.
        simple: Whether one goal is executed at a time, and a newer one takes its place, as with
            actionlib's SimpleActionServer.
    """

    def __init__(
        self,
        core: Core,
        topics: Topics,
        name: str,
        type: ActionType,
        execute: Callable[[ServerGoal], Result | Awaitable[Result]],
        accept: Callable[[Message], bool] | None,
        cancel: Callable[[ServerGoal], bool] | None,
        executor: Executor | None,
        simple: bool,
    ) -> None:
        super().__init__(core, name, type, execute, accept, cancel, executor, _log, self._ran)
        self._simple = check_flag(simple, "simple", name)
        self._core = core
        self._list = GoalList(_KEEP)
        #: With `simple`: the goal that is executed, and the one that waits for its end.
        self._current: Ros1ServerGoal | None = None
        self._next: Ros1ServerGoal | None = None
        self._frequency = _FREQUENCY
        self._publishing = InOrder()
        types = ActionTypes.of(type, core.types)
        self._publishers: dict[str, Publisher] = {}
        self._subscriptions: list[Subscription] = []
        try:
            for word, qos in ((STATUS, QoS.latched()), (RESULT, QUEUE), (FEEDBACK, QUEUE)):
                topic = core.resolve(part(name, word))
                self._publishers[word] = Publisher(core, topic, getattr(types, word), qos)
        except BaseException:
            self._close_topics()
            raise
        self._publish_status()
        for word, heard in ((CANCEL, self._on_cancel), (GOAL, self._on_goal)):
            topic = core.resolve(part(name, word))
            kind = getattr(types, word)
            subscription = Subscription(topic, kind, QUEUE, IMMEDIATE, raw_callback=heard)
            self._subscriptions.append(subscription)
            topics.subscribe(subscription, False)
        core.add(self)
        self._tick()

    # -- what users see --------------------------------------------------------------------------

    @property
    def goals(self) -> Sequence[ServerGoal]:
        """The goals that have not ended, in order of acceptance."""
        with self._lock:
            goals = [entry.goal for entry in self._list if entry.goal is not None]
        return tuple(goal for goal in goals if goal.status.is_active)

    @property
    def problem(self) -> str:
        """Why some clients cannot be served, in words; empty when all is well."""
        if self._closed:
            return "the server is closed"
        problems = [end.problem for end in self._subscriptions]
        problems += [end.problem for end in self._publishers.values()]
        return "; ".join(dict.fromkeys(problem for problem in problems if problem))

    def close(self) -> None:
        """Abort the goals that run, tell their clients, and withdraw; safe to call twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            entries = list(self._list)
        if self._core.forked:
            return
        self._runner.close()
        for subscription in self._subscriptions:
            subscription.close()
        for entry in entries:
            if entry.goal is not None:
                entry.goal.close()
            elif entry.asked is not None:
                self._refuse(entry, "The server was closed")
        self._close_topics()
        self._runner.join()
        self._core.remove(self)

    def _close_topics(self) -> None:
        for publisher in self._publishers.values():
            publisher.close()

    # -- for goals -------------------------------------------------------------------------------

    def make_result(self, result: Any) -> Message:
        """Return a goal's result; raises ConversionError."""
        kind = self.type.result
        return kind.decode(kind.encode(result or {}, wire="ros1"), wire="ros1")

    def note_end(self, entry: GoalEntry) -> None:
        """Take note that a goal has ended; the goals' lock is held."""
        self._list.end(entry, time.monotonic())

    def send_feedback(self, entry: GoalEntry, feedback: Any, fields: dict[str, Any]) -> None:
        """Publish feedback of a goal; raises ConversionError."""
        made = self._make_feedback(feedback, fields)
        with self._lock:
            status = entry.status()
        self._publishers[FEEDBACK].publish(
            {"header": self._header(), "status": status, "feedback": made}
        )

    def publish_result(self, entry: GoalEntry, result: Message) -> None:
        """Publish how a goal has ended, and the status of all."""
        with self._lock:
            status = entry.status()
        message = {"header": self._header(), "status": status, "result": result}

        def publish() -> None:
            with suppress(NodeClosedError):
                self._publishers[RESULT].publish(message)

        self._publishing.add(publish)
        self.publish_status()

    def publish_status(self) -> None:
        """Publish the status of all goals, as of now."""
        self._publishing.add(self._publish_status)

    def _publish_status(self) -> None:
        with self._lock:
            self._list.expire(time.monotonic())
            entries = [entry.status() for entry in self._list]
        with suppress(NodeClosedError):  # those who listen see that the server is gone
            self._publishers[STATUS].publish({"header": self._header(), "status_list": entries})

    def _header(self) -> dict[str, Any]:
        return {"stamp": stamp(self._core.clock.now())}

    def _tick(self) -> None:
        """Publish the status again and again."""
        if self._closed:
            return
        if self._frequency > 0:
            self.publish_status()
        else:
            with self._lock:
                self._list.expire(time.monotonic())
        self._core.timers.after(1 / self._frequency if self._frequency > 0 else _TICK, self._tick)

    # -- parameters ------------------------------------------------------------------------------

    def register(self, master: Master) -> None:
        """Read the parameters; the topics register themselves."""
        frequency = _ask(master, "getParam", part(self.name, "status_frequency"))
        found = _ask(master, "searchParam", "actionlib_status_frequency")
        if frequency is None and found is not None:
            frequency = _ask(master, "getParam", str(found))
        keep = _ask(master, "getParam", part(self.name, "status_list_timeout"))
        self._frequency = self._number("status frequency", frequency, _FREQUENCY)
        self._list.keep = self._number("status_list_timeout", keep, _KEEP)

    def _number(self, what: str, value: Any, default: float) -> float:
        if value is None:
            return default
        if type(value) in (int, float) and 0 <= value < 1e6:
            return float(value)
        _log.warning("%s: the parameter for the %s is no number but %r", self.name, what, value)
        return default

    # -- accepting -------------------------------------------------------------------------------

    def _on_goal(self, sample: Sample) -> None:
        try:
            message = sample.message()
            goal_id, asked = message.goal_id, message.goal
            id_text, sent = str(goal_id.id), time_of(goal_id.stamp)
        except DecodeError as error:
            _log.warning("%s: a goal cannot be decoded: %s", self.name, error)
            return
        now = self._core.clock.now()
        if not id_text:
            id_text = new_id(self._core.name.full, now)
        with self._lock:
            known = self._closed
            stamped = sent if sent.nanoseconds else now
            entry = None if known else self._list.take(id_text, stamped, asked, time.monotonic())
        if entry is None:
            return
        if entry.state is ServerState.RECALLED:
            self.publish_result(entry, self.make_result(None))
        elif self._accept is None:
            self._take(entry, True)
        else:
            self.publish_status()
            if not self._decide_later(lambda: self._decide(entry)):
                self._refuse(entry, "It cannot be decided on")

    def _decide(self, entry: GoalEntry) -> None:
        self._take(entry, self._accepts(entry.asked, entry.id))

    def _take(self, entry: GoalEntry, accepted: bool) -> None:
        if not accepted:
            self._refuse(entry, "It is not accepted")
            return
        goal = Ros1ServerGoal(self, entry, self._lock)
        with self._lock:
            going = entry.state is ServerState.PENDING and not self._closed
            if going:
                entry.goal = goal
                if not self._simple:
                    entry.go(ServerState.ACTIVE)
        if not going:
            self._refuse(entry, "The server was closed")
        elif self._simple:
            self._queue(goal)
        else:
            self.publish_status()
            self._runner.start(goal)

    def _refuse(self, entry: GoalEntry, text: str) -> None:
        """Reject a goal, or let one go that was cancelled before it was decided on."""
        with self._lock:
            if entry.state.is_terminal:
                return
            if entry.state is ServerState.RECALLING:
                entry.go(ServerState.RECALLED, "It was cancelled before it was executed")
            else:
                entry.go(ServerState.REJECTED, text)
            self._list.end(entry, time.monotonic())
        self.publish_result(entry, self.make_result(None))

    # -- one at a time ---------------------------------------------------------------------------

    def _queue(self, goal: Ros1ServerGoal) -> None:
        """Let a goal take the place of the one that is executed, once that has ended."""
        with self._lock:
            rivals = [one for one in (self._current, self._next) if one is not None]
            late = any(goal.accepted < rival.accepted for rival in rivals)
            bumped = goal if late else self._next
            current = self._current
            if not late and current is None:
                self._current = goal
            elif not late:
                self._next = goal
        if bumped is not None:
            self._recall(bumped, _REPLACED)
        if late:
            return
        if current is None:
            self._runner.start(goal)
        else:
            current.replace()
            self.publish_status()

    def _ran(self) -> None:
        """Go on with the goal that waits."""
        if not self._simple:
            return
        with self._lock:
            self._current, self._next = self._next, None
            waiting = self._current
        if waiting is not None:
            self._runner.start(waiting)

    def _recall(self, goal: Ros1ServerGoal, text: str) -> None:
        goal.replace()
        with suppress(Exception):
            goal.canceled(text=text)

    # -- cancelling ------------------------------------------------------------------------------

    def _on_cancel(self, sample: Sample) -> None:
        try:
            message = sample.message()
            id_text, until = str(message.id), time_of(message.stamp)
        except DecodeError as error:
            _log.warning("%s: a request to cancel cannot be decoded: %s", self.name, error)
            return
        with self._lock:
            if self._closed:
                return
            chosen = self._list.select(id_text, until, time.monotonic())
        if self._cancel is None or all(entry.goal is None for entry in chosen):
            self._cancel_all(chosen)
            return

        def decide() -> None:
            allowed = [one for one in chosen if one.goal is None or self._allows(one.goal)]
            self._cancel_all(allowed)

        # What cannot be asked must not hold up a stop.
        if not self._decide_later(decide):
            self._cancel_all(chosen)

    def _cancel_all(self, entries: Sequence[GoalEntry]) -> None:
        waiting = []
        with self._lock:
            for entry in entries:
                if entry.state is ServerState.ACTIVE:
                    entry.go(ServerState.PREEMPTING)
                elif entry.state is ServerState.PENDING:
                    entry.go(ServerState.RECALLING)
                    if entry.goal is not None and entry.goal is self._next:
                        self._next = None
                        waiting.append(entry.goal)
        for entry in entries:
            if entry.goal is not None and entry.state is not ServerState.ACTIVE:
                entry.goal.stop()
        for goal in waiting:
            self._recall(goal, "It was cancelled before it was executed")
        self.publish_status()


def _ask(master: Master, method: str, name: str) -> Any:
    """Return a parameter's value or full name; None when it is not set."""
    with suppress(MasterError):
        return master.call(method, name)
    return None
