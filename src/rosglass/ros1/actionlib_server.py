"""The server's side of an action over actionlib's five topics.

Protocol: ROS wiki, "actionlib/DetailedDescription", sections "Server-Side States" and "Cancel
Policy"; where it is silent, actionlib's servers in C++ and Python.
"""

from __future__ import annotations

import logging
import time
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

from rosglass.comm import IMMEDIATE, GoalStatus, Publisher, QoS, Subscription, Time
from rosglass.comm.action_server import ActionServerProtocol, ServerGoal
from rosglass.comm.executor import InOrder
from rosglass.comm.handle import check_flag, undo_on_error
from rosglass.errors import ArgumentError, DecodeError, Error, MasterError, NodeClosedError
from rosglass.ros1.actionlib import (
    CANCEL,
    FEEDBACK,
    GOAL,
    QUEUE,
    RESULT,
    STATUS,
    ActionTypes,
    ServerState,
    action_topic,
    goal_id,
    new_id,
    stamp,
    time_of,
)
from rosglass.wires.tcpros.registrations import Member

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.comm import Sample
    from rosglass.comm.action_server import ActionServer
    from rosglass.messages import ActionType, Message
    from rosglass.wires.tcpros.core import TcprosCore
    from rosglass.wires.tcpros.master import Master
    from rosglass.wires.tcpros.topics import Topics

__all__ = ["ActionlibServer", "ActionlibServerGoal", "GoalEntry", "GoalList"]

_log = logging.getLogger("rosglass.ros1")
#: Defaults: status messages per second, and seconds that ended goals stay in them.
_FREQUENCY_HZ, _KEEP_S = 5.0, 5.0
#: Seconds between removals of ended goals where no status is published.
_EXPIRE_PERIOD_S = 1.0
#: Most ended goals that are kept: a misbehaving client must not fill the memory.
_MAX_ENDED = 1000
_CANCELABLE = (ServerState.PENDING, ServerState.ACTIVE)
_REPLACED = "It was preempted by a newer goal"
_RECALLED = "It was cancelled before it was executed"

#: The states of accepted goals that became active, and of accepted goals that wait.
_ACTIVE_STATES = {
    GoalStatus.ACCEPTED: ServerState.ACTIVE,
    GoalStatus.EXECUTING: ServerState.ACTIVE,
    GoalStatus.CANCELING: ServerState.PREEMPTING,
    GoalStatus.CANCELED: ServerState.PREEMPTED,
    GoalStatus.SUCCEEDED: ServerState.SUCCEEDED,
    GoalStatus.ABORTED: ServerState.ABORTED,
}
_WAITING_STATES = {
    **_ACTIVE_STATES,
    GoalStatus.ACCEPTED: ServerState.PENDING,
    GoalStatus.CANCELING: ServerState.RECALLING,
    GoalStatus.CANCELED: ServerState.RECALLED,
    GoalStatus.ABORTED: ServerState.REJECTED,
}


class GoalEntry:
    """A goal in a server's list.

    Attributes:
        id: Its id.
        stamp: Its time stamp.
        text: The explanation of its state for its client.
        asked: The goal message; None for a goal known only from a request to cancel it.
        goal: The goal once it is accepted; None until then.
        at_once: Whether it becomes active when it is accepted, instead of when it is executed.
        until: Monotonic time until which it stays in the list; None for one that has not ended.
    """

    def __init__(self, id: str, stamp: Time, state: ServerState, asked: Any = None) -> None:
        self.id, self.stamp, self.asked = id, stamp, asked
        self.text = ""
        self.goal: ActionlibServerGoal | None = None
        self.at_once = True
        self.until: float | None = None
        self._state = state

    @property
    def state(self) -> ServerState:
        """Its state."""
        if self.goal is None:
            return self._state
        active = self.at_once or self.goal._begun
        return (_ACTIVE_STATES if active else _WAITING_STATES)[self.goal.status]

    def set_state(self, state: ServerState, text: str = "") -> None:
        """Set the state of a goal that is not accepted."""
        self._state, self.text = state, text

    def status(self) -> dict[str, Any]:
        """Return its ``actionlib_msgs/GoalStatus``."""
        state = int(self.state)
        return {"goal_id": goal_id(self.id, self.stamp), "status": state, "text": self.text}


class GoalList:
    """A server's goals in order of arrival; not thread-safe.

    Args:
        keep: Seconds that goals stay in it after their end.

    Attributes:
        keep: As given; may be changed.
    """

    def __init__(self, keep: float = 5.0) -> None:
        self.keep = keep
        self._entries: dict[str, GoalEntry] = {}
        self._last_cancel = Time()

    def __iter__(self) -> Any:
        return iter(list(self._entries.values()))

    def add(self, id: str, stamp: Time, asked: Any, now: float) -> GoalEntry | None:
        """Add a received goal.

        Args:
            id: Its id.
            stamp: Its time stamp.
            asked: The goal message.
            now: Monotonic time.

        Returns:
            Its entry, RECALLED when it was cancelled before it was received; None for a known goal,
            which is to be ignored.
        """
        known = self._entries.get(id)
        if known is not None:
            if known.until is not None:
                known.until = now + self.keep
            if known.state is not ServerState.RECALLING or known.asked is not None:
                return None
            known.asked, known.stamp = asked, stamp
            known.set_state(ServerState.RECALLED, "It was cancelled before it was received")
            return known
        entry = self._entries[id] = GoalEntry(id, stamp, ServerState.PENDING, asked)
        if stamp <= self._last_cancel:
            reason = "Its time stamp is not after that of the last request to cancel"
            entry.set_state(ServerState.RECALLED, reason)
            self.end(entry, now)
        return entry

    def select(self, id: str, stamp: Time, now: float) -> Sequence[GoalEntry]:
        """Return the goals that a request to cancel selects and that can be cancelled.

        An id selects its goal; a stamp, all goals up to it; both select both; neither, all goals.
        An unknown goal is cancelled when it is received.
        """
        everything = not id and stamp == Time()
        chosen = [
            entry
            for entry in self._entries.values()
            if everything or entry.id == id or (stamp != Time() and entry.stamp <= stamp)
        ]
        if id and id not in self._entries:
            self._entries[id] = GoalEntry(id, stamp, ServerState.RECALLING)
            self._entries[id].until = now + self.keep
        self._last_cancel = max(self._last_cancel, stamp)
        return [entry for entry in chosen if entry.state in _CANCELABLE]

    def end(self, entry: GoalEntry, now: float) -> None:
        """Note that a goal has ended."""
        entry.until = now + self.keep

    def expire(self, now: float) -> None:
        """Remove goals that ended some time ago."""
        ended = [entry for entry in self._entries.values() if entry.until is not None]
        surplus = len(ended) - _MAX_ENDED
        for number, entry in enumerate(sorted(ended, key=lambda entry: entry.until or 0.0)):
            if number < surplus or (entry.until is not None and entry.until < now):
                del self._entries[entry.id]


class ActionlibServerGoal(ServerGoal):
    """A goal with actionlib's states and texts.

    Args:
        protocol: Its server's topics.
        entry: Its entry in the list.

    Attributes:
        client_id: Its id as a string, made by its client.
    """

    def __init__(self, protocol: ActionlibServer, entry: GoalEntry) -> None:
        super().__init__(protocol, entry.id.encode(), entry.asked, entry.stamp)
        self.client_id = entry.id
        self._entry = entry

    @property
    def id_text(self) -> str:
        """The id on the wire."""
        return self.client_id

    @property
    def state(self) -> ServerState:
        """Its state in the server's status topic."""
        return self._entry.state

    def succeed(self, result: Message | dict[str, Any] | None = None, text: str = "") -> None:
        """End it as succeeded; `text` is sent to its client with the status."""
        self._end(GoalStatus.SUCCEEDED, result, self._checked(text))

    def abort(self, result: Message | dict[str, Any] | None = None, text: str = "") -> None:
        """End it as aborted; `text` is sent to its client as the reason."""
        self._end(GoalStatus.ABORTED, result, self._checked(text))

    def canceled(self, result: Message | dict[str, Any] | None = None, text: str = "") -> None:
        """End it as cancelled (preempted), after a request to cancel or for a newer goal."""
        self._end(GoalStatus.CANCELED, result, self._checked(text))

    def _checked(self, text: str) -> str:
        if not isinstance(text, str):
            raise ArgumentError("text", text, "a string", f"goal {self.id_text}")
        return text


class ActionlibServer(ActionServerProtocol[ActionlibServerGoal], Member):
    """The three publishers and two subscriptions of an action server.

    It uses the parameters of actionlib's servers: ``actionlib_status_frequency`` (searched
    from the node upwards; 0 for changes only), ``status_frequency`` and ``status_list_timeout``
    below the action's name.

    Args:
        core: The node.
        topics: Its topics.
        name: Absolute action name.
        type: The type.
        simple: Whether one goal is executed at a time and preempted by a newer one, as by
            actionlib's SimpleActionServer.
    """

    _server: ActionServer

    def __init__(
        self, core: TcprosCore, topics: Topics, name: str, type: ActionType, simple: bool
    ) -> None:
        super().__init__(core, name, type, "ros1", _log)
        self._simple = check_flag(simple, "simple", name)
        self._core, self._topics = core, topics
        self._types = ActionTypes.of(type, core.types)
        self._list = GoalList(_KEEP_S)
        #: With `simple`: the goal that is executed, and the one that waits for its end.
        self._current: ActionlibServerGoal | None = None
        self._next: ActionlibServerGoal | None = None
        self._frequency_hz = _FREQUENCY_HZ
        self._publishing = InOrder()
        self._publishers: dict[str, Publisher] = {}
        self._subscriptions: list[Subscription] = []

    def open(self, server: ActionServer) -> None:
        """Open the topics."""
        self._server = server
        core, topics, name = self._core, self._topics, self.name
        with undo_on_error(self._close_publishers):
            for word, qos in ((STATUS, QoS.latched()), (RESULT, QUEUE), (FEEDBACK, QUEUE)):
                topic = core.resolve(action_topic(name, word))
                self._publishers[word] = Publisher(core, topic, getattr(self._types, word), qos)
        self._publish_status()
        for word, callback in ((CANCEL, self._on_cancel), (GOAL, self._on_goal)):
            topic = core.resolve(action_topic(name, word))
            message_type = getattr(self._types, word)
            subscription = Subscription(
                topic, message_type, QUEUE, IMMEDIATE, raw_callback=callback
            )
            self._subscriptions.append(subscription)
            topics.subscribe(subscription, False)
        core.add(self)
        self._tick()

    def withdraw(self) -> None:
        """Reject the goals that are not accepted yet, and close the topics."""
        for subscription in self._subscriptions:
            subscription.close()
        with self.lock:
            undecided = [
                each for each in self._list if each.goal is None and each.asked is not None
            ]
        for entry in undecided:
            self._refuse(entry, "The server was closed")
        self._close_publishers()
        self._core.remove(self)

    def close(self) -> None:
        """Close the server, with its node."""
        self._server.close()

    def _close_publishers(self) -> None:
        for publisher in self._publishers.values():
            publisher.close()

    def problems(self) -> list[str]:
        """Return why some clients cannot be served."""
        problems = [subscription.problem for subscription in self._subscriptions]
        return problems + [publisher.problem for publisher in self._publishers.values()]

    # -- publishing ------------------------------------------------------------------------------

    def publish_feedback(self, goal: ActionlibServerGoal, feedback: Message) -> None:
        """Publish feedback of a goal."""
        with self.lock:
            status = goal._entry.status()
        message = {"header": self._header(), "status": status, "feedback": feedback}
        self._publishers[FEEDBACK].publish(message)

    def on_end(self, goal: ActionlibServerGoal, text: str) -> None:
        """Note that a goal has ended."""
        goal._entry.text = text
        self._list.end(goal._entry, time.monotonic())

    def publish_result(self, goal: ActionlibServerGoal, result: Message) -> None:
        """Publish the result of a goal, and the status of all."""
        self._publish_end(goal._entry, result)

    def _publish_end(self, entry: GoalEntry, result: Message) -> None:
        with self.lock:
            status = entry.status()
        message = {"header": self._header(), "status": status, "result": result}

        def publish() -> None:
            with suppress(NodeClosedError):  # clients notice that the server has left
                self._publishers[RESULT].publish(message)

        self._publishing.add(publish)
        self.publish_status()

    def publish_status(self) -> None:
        """Publish the current status of all goals."""
        self._publishing.add(self._publish_status)

    def _publish_status(self) -> None:
        with self.lock:
            self._list.expire(time.monotonic())
            entries = [entry.status() for entry in self._list]
        with suppress(NodeClosedError):  # clients notice that the server has left
            self._publishers[STATUS].publish({"header": self._header(), "status_list": entries})

    def _header(self) -> dict[str, Any]:
        return {"stamp": stamp(self._core.clock.now())}

    def _tick(self) -> None:
        """Publish the status periodically."""
        if self.closed:
            return
        if self._frequency_hz > 0:
            self.publish_status()
        else:
            with self.lock:
                self._list.expire(time.monotonic())
        pause = 1 / self._frequency_hz if self._frequency_hz > 0 else _EXPIRE_PERIOD_S
        self._core.timers.after(pause, self._tick)

    # -- parameters ------------------------------------------------------------------------------

    def register(self, master: Master) -> None:
        """Read the parameters from the master; the topics register themselves."""
        frequency = _ask(master, "getParam", action_topic(self.name, "status_frequency"))
        found = _ask(master, "searchParam", "actionlib_status_frequency")
        if frequency is None and found is not None:
            frequency = _ask(master, "getParam", str(found))
        keep = _ask(master, "getParam", action_topic(self.name, "status_list_timeout"))
        self._frequency_hz = self._number("status frequency", frequency, _FREQUENCY_HZ)
        self._list.keep = self._number("status_list_timeout", keep, _KEEP_S)

    def _number(self, what: str, value: Any, default: float) -> float:
        if value is None:
            return default
        if type(value) in (int, float) and 0 <= value < 1e6:
            return float(value)
        _log.warning("%s: the parameter for the %s is not a number, but %r", self.name, what, value)
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
        with self.lock:
            known = self.closed
            stamped = sent if sent.nanoseconds else now
            entry = None if known else self._list.add(id_text, stamped, asked, time.monotonic())
        if entry is None:
            return
        if entry.state is ServerState.RECALLED:
            self._publish_end(entry, self.type.result.create())
            return
        if self._server._accept is not None:
            self.publish_status()  # accepting it may take a while
        self._server._on_goal(ActionlibServerGoal(self, entry))

    def accept(self, goal: ActionlibServerGoal) -> bool:
        """Note that a goal is accepted, unless it was cancelled until now."""
        entry = goal._entry
        if entry.state is not ServerState.PENDING:
            return False
        entry.goal, entry.at_once = goal, not self._simple
        return True

    def start(self, goal: ActionlibServerGoal) -> None:
        """Publish that a goal is accepted, and execute it in its turn."""
        if self._simple:
            self._queue(goal)
        else:
            self.publish_status()
            self._server._run(goal)

    def reject(self, goal: ActionlibServerGoal, reason: str) -> None:
        """Reject a goal, or recall one that was cancelled before it was accepted."""
        self._refuse(goal._entry, reason)

    def _refuse(self, entry: GoalEntry, reason: str) -> None:
        with self.lock:
            if entry.state.is_terminal:
                return
            if entry.state is ServerState.RECALLING:
                entry.set_state(ServerState.RECALLED, _RECALLED)
            else:
                entry.set_state(ServerState.REJECTED, reason)
            self._list.end(entry, time.monotonic())
        self._publish_end(entry, self.type.result.create())

    # -- one at a time ---------------------------------------------------------------------------

    def _queue(self, goal: ActionlibServerGoal) -> None:
        """Preempt the current goal by a newer one, which is executed once that has ended."""
        with self.lock:
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
            self._server._run(goal)
        else:
            current._supersede()
            self.publish_status()

    def on_returned(self) -> None:
        """Execute the goal that waits."""
        if not self._simple:
            return
        with self.lock:
            self._current, self._next = self._next, None
            waiting = self._current
        if waiting is not None:
            self._server._run(waiting)

    def _recall(self, goal: ActionlibServerGoal, text: str) -> None:
        goal._supersede()
        with suppress(Error):  # it has ended by itself
            goal.canceled(text=text)

    # -- cancelling ------------------------------------------------------------------------------

    def _on_cancel(self, sample: Sample) -> None:
        try:
            message = sample.message()
            id_text, until = str(message.id), time_of(message.stamp)
        except DecodeError as error:
            _log.warning("%s: a request to cancel cannot be decoded: %s", self.name, error)
            return
        with self.lock:
            if self.closed:
                return
            chosen = self._list.select(id_text, until, time.monotonic())
        accepted = [entry.goal for entry in chosen if entry.goal is not None]
        undecided = [entry for entry in chosen if entry.goal is None]
        self._server._on_cancel(accepted, partial(self._cancel, undecided))

    def _cancel(self, undecided: Sequence[GoalEntry], allowed: Sequence[ServerGoal]) -> None:
        with self.lock:
            accepted = [entry.goal for entry in undecided if entry.goal is not None]  # just now
            for entry in undecided:
                if entry.state is ServerState.PENDING and entry.goal is None:
                    entry.set_state(ServerState.RECALLING)
            waiting = self._next
            if waiting is not None and waiting in (*accepted, *allowed):
                self._next = None
        for goal in (*accepted, *allowed):
            goal._request_cancel()
            if goal is waiting:
                self._recall(waiting, _RECALLED)
        self.publish_status()


def _ask(master: Master, method: str, name: str) -> Any:
    """Return a parameter's value or full name; None when it is not set."""
    with suppress(MasterError):  # it is not set
        return master.call(method, name)
    return None
