"""What an action consists of in ROS 1: five topics, with types derived from the action's.

Names and types: ROS wiki, "actionlib/DetailedDescription", section "Action Interface & Transport
Layer".
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rosglass.comm import EndpointKind, History, QoS, Time
from rosglass.errors import DecodeError
from rosglass.interfaces.definition import ActionDefinition, Definition
from rosglass.interfaces.derived import derive
from rosglass.ros1.action_state import ServerState

if TYPE_CHECKING:
    from rosglass.messages import ActionType, Message, MessageType
    from rosglass.wires.tcpros.announced_types import AnnouncedTypes
    from rosglass.wires.tcpros.graph import Graph

__all__ = [
    "CANCEL",
    "FEEDBACK",
    "GOAL",
    "QUEUE",
    "RESULT",
    "STATUS",
    "ActionTypes",
    "actions",
    "announced",
    "assemble",
    "goal_id",
    "new_id",
    "offered",
    "part",
    "stamp",
    "state_of",
    "time_of",
]

GOAL, CANCEL, STATUS, RESULT, FEEDBACK = "goal", "cancel", "status", "result", "feedback"
#: For topics of which no message may be lost, however slow the other end.
QUEUE = QoS(history=History.KEEP_ALL)

_STATUS_TYPE, _CANCEL_TYPE = "actionlib_msgs/msg/GoalStatusArray", "actionlib_msgs/msg/GoalID"
_numbers = itertools.count(1)
_SUFFIXES = {GOAL: "ActionGoal", RESULT: "ActionResult", FEEDBACK: "ActionFeedback"}


@dataclass(frozen=True)
class ActionTypes:
    """An action's type and those of its topics.

    Attributes:
        action: The action's.
        goal: Of goals, client to server.
        cancel: Of requests to cancel, client to server.
        status: Of all goals' states, server to client.
        result: Of results, server to client.
        feedback: Of feedback, server to client.
    """

    action: ActionType
    goal: MessageType
    cancel: MessageType
    status: MessageType
    result: MessageType
    feedback: MessageType

    @classmethod
    def of(cls, action: ActionType, types: AnnouncedTypes) -> ActionTypes:
        """Return the types that an action implies; raises TypeNotFoundError without actionlib."""
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
    from rosglass.messages import ActionType  # noqa: PLC0415 - numpy

    base = name.replace("/action/", "/msg/")
    asked = goal.definition.nested[f"{base}Goal"]
    told = result.definition.nested[f"{base}Result"]
    heard = feedback.definition.nested[f"{base}Feedback"]
    text = "\n---\n".join(each.text.rstrip("\n") for each in (asked, told, heard))
    return ActionType(ActionDefinition(name, 1, asked, told, heard, text, asked.source))


def part(action: str, name: str) -> str:
    """Return the full name of an action's topic."""
    return f"{action}/{name}"


def announced(graph: Graph, action: str) -> str:
    """Return the type that the topics of an action tell, ``pkg/action/Type``; empty for none."""
    for name, suffix in _SUFFIXES.items():
        kind = graph.type_of(part(action, name))
        if kind.endswith(suffix) and not kind.endswith("/" + suffix):
            return kind.removesuffix(suffix).replace("/msg/", "/action/")
    return ""


def actions(graph: Graph) -> dict[str, list[str]]:
    """Return every action in the graph with its type."""
    found = {}
    for topic in graph.topics():
        name, _, word = topic.rpartition("/")
        if word == STATUS and name and graph.type_of(topic) in (_STATUS_TYPE, ""):
            kind = announced(graph, name)
            if kind:
                found[name] = [kind]
    return found


def offered(graph: Graph) -> list[str]:
    """Return the names of the actions that somebody serves."""
    publisher = EndpointKind.PUBLISHER
    return [name for name in actions(graph) if graph.endpoints(publisher, part(name, STATUS))]


def stamp(time: Time) -> dict[str, int]:
    """Return the value of a time field."""
    return {"secs": time.sec, "nsecs": time.nanosec}


def time_of(field: Message) -> Time:
    """Return the time that a field says."""
    return Time.from_parts(int(field.secs), int(field.nsecs))


def goal_id(id: str, time: Time) -> dict[str, object]:
    """Return an ``actionlib_msgs/GoalID``."""
    return {"stamp": stamp(time), "id": id}


def new_id(node: str, time: Time) -> str:
    """Return the id of a new goal, as actionlib makes them: node, number in this process, time."""
    return f"{node}-{next(_numbers)}-{time.sec}.{time.nanosec:09d}"


def state_of(status: Message) -> ServerState:
    """Return the state that an ``actionlib_msgs/GoalStatus`` says; raises DecodeError."""
    code = int(status.status)
    try:
        return ServerState(code)
    except ValueError:
        told = f"goal {status.goal_id.id} has the status {code}, which does not exist"
        raise DecodeError("actionlib_msgs/msg/GoalStatus", told, "status") from None


def _derived(action: ActionType, suffix: str, status: Definition) -> MessageType:
    from rosglass.messages import MessageType  # noqa: PLC0415 - numpy

    made = derive(action.definition, suffix)
    assert isinstance(made, Definition)
    return MessageType(replace(made, nested={**status.nested, **made.nested}))
