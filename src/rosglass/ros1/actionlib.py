"""actionlib's protocol: an action's five topics, their types, and the states of a goal.

Names and types: ROS wiki, "actionlib/DetailedDescription", section "Action Interface & Transport
Layer". States: section "Client-Side States"; where it is silent, the transitions that actionlib's
clients in C++ and Python have in common.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm import EndpointKind, GoalStatus, History, QoS, Time
from rosglass.errors import DecodeError
from rosglass.interfaces.definition import ActionDefinition, Definition
from rosglass.interfaces.derived import derive
from rosglass.messages import ActionType, MessageType

if TYPE_CHECKING:
    from rosglass.messages import Message
    from rosglass.wires.tcpros.core import AnnouncedTypes
    from rosglass.wires.tcpros.graph import Graph

__all__ = [
    "CANCEL",
    "FEEDBACK",
    "GOAL",
    "QUEUE",
    "RESULT",
    "STATUS",
    "ActionTypes",
    "CommState",
    "CommStateMachine",
    "ServerState",
    "Step",
    "TerminalState",
    "action_topic",
    "actions",
    "announced",
    "assemble",
    "goal_id",
    "new_id",
    "served_actions",
    "stamp",
    "state_of",
    "time_of",
]

GOAL, CANCEL, STATUS, RESULT, FEEDBACK = "goal", "cancel", "status", "result", "feedback"
#: For topics whose messages must not be lost, however slow the peer.
QUEUE = QoS(history=History.KEEP_ALL)

_STATUS_TYPE, _CANCEL_TYPE = "actionlib_msgs/msg/GoalStatusArray", "actionlib_msgs/msg/GoalID"
_numbers = itertools.count(1)
_SUFFIXES = {GOAL: "ActionGoal", RESULT: "ActionResult", FEEDBACK: "ActionFeedback"}


@dataclass(frozen=True)
class ActionTypes:
    """An action's type and those of its topics.

    Attributes:
        action: The action's.
        goal: Topic of goals, client to server.
        cancel: Topic of requests to cancel, client to server.
        status: Topic of all goals' states, server to client.
        result: Topic of results, server to client.
        feedback: Topic of feedback, server to client.
    """

    action: ActionType
    goal: MessageType
    cancel: MessageType
    status: MessageType
    result: MessageType
    feedback: MessageType

    @classmethod
    def of(cls, action: ActionType, types: AnnouncedTypes) -> ActionTypes:
        """Derive the types of an action's topics; raises TypeNotFoundError without actionlib."""
        status = types.message(_STATUS_TYPE)
        goal, result, feedback = (
            _derived(action, suffix, status.definition) for suffix in _SUFFIXES.values()
        )
        return cls(action, goal, types.message(_CANCEL_TYPE), status, result, feedback)


def assemble(
    name: str, goal: MessageType, result: MessageType, feedback: MessageType
) -> ActionType:
    """Return the action whose goal, result and feedback these topics carry.

    Args:
        name: Full type name, ``pkg/action/Type``.
        goal: Type of the topic with goals, ``pkg/msg/TypeActionGoal``.
        result: Type of the topic with results.
        feedback: Type of the topic with feedback.
    """
    base = name.replace("/action/", "/msg/")
    parts = (
        goal.definition.nested[f"{base}Goal"],
        result.definition.nested[f"{base}Result"],
        feedback.definition.nested[f"{base}Feedback"],
    )
    text = "\n---\n".join(part.text.rstrip("\n") for part in parts)
    return ActionType(ActionDefinition(name, 1, *parts, text, parts[0].source))


def action_topic(action: str, name: str) -> str:
    """Return the full name of an action's topic."""
    return f"{action}/{name}"


def announced(graph: Graph, action: str) -> str:
    """Return the type of an action by its topics, ``pkg/action/Type``; empty if unknown."""
    for name, suffix in _SUFFIXES.items():
        type_name = graph.type_of(action_topic(action, name))
        if type_name.endswith(suffix) and not type_name.endswith("/" + suffix):
            return type_name.removesuffix(suffix).replace("/msg/", "/action/")
    return ""


def actions(graph: Graph) -> dict[str, list[str]]:
    """Return every action in the graph with its type."""
    found = {}
    for topic in graph.topics():
        name, _, word = topic.rpartition("/")
        if word == STATUS and name and graph.type_of(topic) in (_STATUS_TYPE, ""):
            type_name = announced(graph, name)
            if type_name:
                found[name] = [type_name]
    return found


def served_actions(graph: Graph) -> list[str]:
    """Return the names of the actions that have a server."""
    publisher = EndpointKind.PUBLISHER
    return [
        name for name in actions(graph) if graph.endpoints(publisher, action_topic(name, STATUS))
    ]


def stamp(time: Time) -> dict[str, int]:
    """Return the value of a time field."""
    return {"secs": time.sec, "nsecs": time.nanosec}


def time_of(field: Message) -> Time:
    """Return the time in a field."""
    return Time.from_parts(int(field.secs), int(field.nsecs))


def goal_id(id: str, time: Time) -> dict[str, object]:
    """Return an ``actionlib_msgs/GoalID``."""
    return {"stamp": stamp(time), "id": id}


def new_id(node: str, time: Time) -> str:
    """Return the id of a new goal, as actionlib makes them: node, number in this process, time."""
    return f"{node}-{next(_numbers)}-{time.sec}.{time.nanosec:09d}"


def state_of(status: Message) -> ServerState:
    """Return the state in an ``actionlib_msgs/GoalStatus``; raises DecodeError."""
    code = int(status.status)
    try:
        return ServerState(code)
    except ValueError:
        reason = f"goal {status.goal_id.id} has the status {code}, which does not exist"
        raise DecodeError("actionlib_msgs/msg/GoalStatus", reason, "status") from None


def _derived(action: ActionType, suffix: str, status: Definition) -> MessageType:
    made = derive(action.definition, suffix)
    assert isinstance(made, Definition)
    return MessageType(replace(made, nested={**status.nested, **made.nested}))


# -- the states of a goal ----------------------------------------------------------------------


class ServerState(IntEnum):
    """The state of a goal at its server: the codes of ``actionlib_msgs/GoalStatus``."""

    PENDING = 0
    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4
    REJECTED = 5
    PREEMPTING = 6
    RECALLING = 7
    RECALLED = 8
    LOST = 9

    @property
    def is_terminal(self) -> bool:
        """True once the goal has ended."""
        return self in _TERMINAL


_TERMINAL = {
    ServerState.PREEMPTED,
    ServerState.SUCCEEDED,
    ServerState.ABORTED,
    ServerState.REJECTED,
    ServerState.RECALLED,
    ServerState.LOST,
}


class CommState(Enum):
    """The state of the communication about a goal."""

    #: The goal was sent, or waits for a server; no server has acknowledged it.
    WAITING_FOR_GOAL_ACK = "waiting for goal ack"
    #: A server has acknowledged it, and has not accepted or rejected it.
    PENDING = "pending"
    #: It is being executed.
    ACTIVE = "active"
    #: It has ended, and its result is awaited.
    WAITING_FOR_RESULT = "waiting for result"
    #: Its cancellation was requested, which the server has not acknowledged.
    WAITING_FOR_CANCEL_ACK = "waiting for cancel ack"
    #: It is being cancelled before it was executed.
    RECALLING = "recalling"
    #: It is being cancelled while it is executed.
    PREEMPTING = "preempting"
    #: It has ended, one way or another; see :class:`TerminalState`.
    DONE = "done"


class TerminalState(Enum):
    """The terminal state of a goal."""

    #: Cancelled before it was executed.
    RECALLED = "recalled"
    #: Refused.
    REJECTED = "rejected"
    #: Cancelled while it was executed.
    PREEMPTED = "preempted"
    #: Failed.
    ABORTED = "aborted"
    #: Done.
    SUCCEEDED = "succeeded"
    #: Unknown: the server has left, or does not have the goal (any more).
    LOST = "lost"


_States = tuple[CommState, ...]
_G, _P, _A = CommState.WAITING_FOR_GOAL_ACK, CommState.PENDING, CommState.ACTIVE
_R, _C, _D = CommState.WAITING_FOR_RESULT, CommState.WAITING_FOR_CANCEL_ACK, CommState.DONE
_RECALLING, _PREEMPTING = CommState.RECALLING, CommState.PREEMPTING

#: The states that follow a state when a server reports one; none where nothing changes. What is
#: missing contradicts the protocol.
_NEXT: dict[CommState, dict[ServerState, _States]] = {
    _G: {
        ServerState.PENDING: (_P,),
        ServerState.ACTIVE: (_A,),
        ServerState.PREEMPTED: (_A, _PREEMPTING, _R),
        ServerState.SUCCEEDED: (_A, _R),
        ServerState.ABORTED: (_A, _R),
        ServerState.REJECTED: (_P, _R),
        ServerState.PREEMPTING: (_A, _PREEMPTING),
        ServerState.RECALLING: (_P, _RECALLING),
        ServerState.RECALLED: (_P, _R),
    },
    _P: {
        ServerState.PENDING: (),
        ServerState.ACTIVE: (_A,),
        ServerState.PREEMPTED: (_A, _PREEMPTING, _R),
        ServerState.SUCCEEDED: (_A, _R),
        ServerState.ABORTED: (_A, _R),
        ServerState.REJECTED: (_R,),
        ServerState.PREEMPTING: (_A, _PREEMPTING),
        ServerState.RECALLING: (_RECALLING,),
        ServerState.RECALLED: (_RECALLING, _R),
    },
    _A: {
        ServerState.ACTIVE: (),
        ServerState.PREEMPTED: (_PREEMPTING, _R),
        ServerState.SUCCEEDED: (_R,),
        ServerState.ABORTED: (_R,),
        ServerState.PREEMPTING: (_PREEMPTING,),
    },
    _R: {
        ServerState.ACTIVE: (),
        ServerState.PREEMPTED: (),
        ServerState.SUCCEEDED: (),
        ServerState.ABORTED: (),
        ServerState.REJECTED: (),
        ServerState.RECALLED: (),
    },
    _C: {
        ServerState.PENDING: (),
        ServerState.ACTIVE: (),
        ServerState.PREEMPTED: (_PREEMPTING, _R),
        ServerState.SUCCEEDED: (_PREEMPTING, _R),
        ServerState.ABORTED: (_PREEMPTING, _R),
        ServerState.REJECTED: (_R,),
        ServerState.PREEMPTING: (_PREEMPTING,),
        ServerState.RECALLING: (_RECALLING,),
        ServerState.RECALLED: (_RECALLING, _R),
    },
    _RECALLING: {
        ServerState.PREEMPTED: (_PREEMPTING, _R),
        ServerState.SUCCEEDED: (_PREEMPTING, _R),
        ServerState.ABORTED: (_PREEMPTING, _R),
        ServerState.REJECTED: (_R,),
        ServerState.PREEMPTING: (_PREEMPTING,),
        ServerState.RECALLING: (),
        ServerState.RECALLED: (_R,),
    },
    _PREEMPTING: {
        ServerState.PREEMPTED: (_R,),
        ServerState.SUCCEEDED: (_R,),
        ServerState.ABORTED: (_R,),
        ServerState.PREEMPTING: (),
    },
    _D: {state: () for state in (*ServerState,) if state.is_terminal},
}

_ENDS = {
    ServerState.PREEMPTED: (TerminalState.PREEMPTED, GoalStatus.CANCELED),
    ServerState.SUCCEEDED: (TerminalState.SUCCEEDED, GoalStatus.SUCCEEDED),
    ServerState.ABORTED: (TerminalState.ABORTED, GoalStatus.ABORTED),
    ServerState.REJECTED: (TerminalState.REJECTED, GoalStatus.REJECTED),
    ServerState.RECALLED: (TerminalState.RECALLED, GoalStatus.CANCELED),
    ServerState.LOST: (TerminalState.LOST, GoalStatus.LOST),
}


class Step(NamedTuple):
    """One of the states that a goal passes.

    Attributes:
        state: The state.
        status: Its status in ROS 2's terms.
    """

    state: CommState
    status: GoalStatus


class CommStateMachine:
    """A goal's state at its client, changed by messages of its server.

    Methods that change it return the states that it passed, in order: a server that is faster than
    its status messages makes it pass several at once.

    Attributes:
        state: The current state.
        heard: The last state that the server reported; None before that.
        executed: Whether the server has begun to execute it.
    """

    def __init__(self) -> None:
        self.state = CommState.WAITING_FOR_GOAL_ACK
        self.heard: ServerState | None = None
        self.executed = False

    @property
    def terminal(self) -> TerminalState | None:
        """The terminal state of the goal; None before it has ended."""
        if self.state is not CommState.DONE:
            return None
        return _ENDS[self.heard or ServerState.LOST][0]

    @property
    def status(self) -> GoalStatus:
        """The status in ROS 2's terms.

        PENDING until the server executes the goal; CANCELING once the server has acknowledged the
        cancellation; RECALLED and PREEMPTED are both CANCELED.
        """
        if self.state in (CommState.WAITING_FOR_RESULT, CommState.DONE):
            return _ENDS[self.heard or ServerState.LOST][1]
        if self.state in (CommState.RECALLING, CommState.PREEMPTING):
            return GoalStatus.CANCELING
        return GoalStatus.EXECUTING if self.executed else GoalStatus.PENDING

    def on_status(self, reported: ServerState) -> list[Step]:
        """Handle the state in a status message.

        Raises:
            ValueError: It contradicts what the server reported before; nothing is changed.
        """
        if reported is ServerState.LOST:
            return self.on_server_lost()
        steps = _NEXT[self.state].get(reported)
        if steps is None:
            raise ValueError(f"{reported.name} does not follow {self.state.name}")
        if self.state in (CommState.WAITING_FOR_RESULT, CommState.DONE):
            return []  # the first reported end counts
        self.heard = reported
        return self._transition(*steps)

    def on_result(self, reported: ServerState) -> list[Step]:
        """Handle the state in a result message; ignored once the goal is done.

        Raises:
            ValueError: The state is not terminal.
        """
        if self.state is CommState.DONE:
            return []
        if not reported.is_terminal:
            raise ValueError(f"a result with the state {reported.name}, which is not terminal")
        # The result counts, whatever was reported before.
        steps = _NEXT[self.state].get(reported, ())
        self.heard = reported
        return self._transition(*steps, CommState.DONE)

    def cancel(self) -> list[Step]:
        """Note that the cancellation is requested.

        Ignored for a goal that is being cancelled, or has ended.
        """
        if self.state in (CommState.WAITING_FOR_GOAL_ACK, CommState.PENDING, CommState.ACTIVE):
            return self._transition(CommState.WAITING_FOR_CANCEL_ACK)
        return []

    def on_server_lost(self) -> list[Step]:
        """Note that the goal is lost: its server will report nothing more."""
        if self.state is CommState.DONE:
            return []
        self.heard = ServerState.LOST
        return self._transition(CommState.DONE)

    def _transition(self, *states: CommState) -> list[Step]:
        steps = []
        for state in states:
            self.state = state
            self.executed |= state in (CommState.ACTIVE, CommState.PREEMPTING)
            steps.append(Step(state, self.status))
        return steps
