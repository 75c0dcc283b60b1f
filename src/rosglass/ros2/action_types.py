"""What an action consists of in ROS 2: three services and two topics, with derived types.

Names, types and profiles: http://design.ros2.org/articles/actions.html; ``rcl_action``'s
``names.h`` and ``default_qos.h``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rosglass.comm import GoalStatus, QoS, Time
from rosglass.interfaces import parse_message
from rosglass.interfaces.definition import Definition, ServiceDefinition
from rosglass.interfaces.derived import derive

if TYPE_CHECKING:
    from rosglass.comm.types import Types
    from rosglass.messages import ActionType, Message, MessageType, ServiceType

__all__ = [
    "CANCEL_GOAL",
    "CANCEL_REASONS",
    "CODES",
    "FEEDBACK",
    "FEEDBACK_QOS",
    "GET_RESULT",
    "NO_ID",
    "SEND_GOAL",
    "STATUS",
    "STATUSES",
    "STATUS_QOS",
    "ActionTypes",
    "assemble",
    "goal_info",
    "part",
    "stamp_of",
]

SEND_GOAL, CANCEL_GOAL, GET_RESULT = "send_goal", "cancel_goal", "get_result"
FEEDBACK, STATUS = "feedback", "status"

#: Profiles of the topics, as their publishers offer them.
FEEDBACK_QOS = QoS()
STATUS_QOS = QoS.latched()

#: ``action_msgs/msg/GoalStatus``'s codes.
STATUSES = {
    1: GoalStatus.ACCEPTED,
    2: GoalStatus.EXECUTING,
    3: GoalStatus.CANCELING,
    4: GoalStatus.SUCCEEDED,
    5: GoalStatus.CANCELED,
    6: GoalStatus.ABORTED,
}
CODES = {status: code for code, status in STATUSES.items()}

#: ``action_msgs/srv/CancelGoal``'s return codes, for people.
CANCEL_REASONS = {
    0: "there was no goal to cancel",
    1: "the server refuses to cancel",
    2: "the server does not know the goal (any more)",
    3: "the goal has ended already, or is being cancelled already",
}

#: Stands for every goal in a request to cancel.
NO_ID = bytes(16)

_BUILT_IN = {
    "unique_identifier_msgs/msg/UUID": "uint8[16] uuid",
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec",
}


@dataclass(frozen=True)
class ActionTypes:
    """An action's type and those that go over the wire.

    Attributes:
        action: The action's.
        send_goal: The service that takes goals.
        get_result: The service that tells results.
        cancel_goal: The service that cancels goals.
        feedback: The topic with feedback.
        status: The topic with the status of every goal.
    """

    action: ActionType
    send_goal: ServiceType
    get_result: ServiceType
    cancel_goal: ServiceType
    feedback: MessageType
    status: MessageType

    @classmethod
    def of(cls, action: ActionType, types: Types) -> ActionTypes:
        """Return the types that an action implies; raises TypeNotFoundError without action_msgs."""
        from rosglass.messages import MessageType, ServiceType  # noqa: PLC0415 - numpy

        send_goal, get_result = (
            ServiceType(_service(action, suffix)) for suffix in ("_SendGoal", "_GetResult")
        )
        feedback = derive(action.definition, "_FeedbackMessage")
        assert isinstance(feedback, Definition)
        return cls(
            action,
            send_goal,
            get_result,
            types.service("action_msgs/srv/CancelGoal"),
            MessageType(_complete(feedback)),
            types.message("action_msgs/msg/GoalStatusArray"),
        )


def assemble(
    action: ActionType, send_goal: ServiceType, get_result: ServiceType, feedback: MessageType
) -> ActionType:
    """Return the action whose goal, result and feedback are those of the derived types.

    A robot's version of an action shows by the hashes of its parts, each by itself.
    """
    from rosglass.messages import ActionType  # noqa: PLC0415 - numpy

    name = action.name
    definition = replace(
        action.definition,
        goal=send_goal.request.definition.nested[f"{name}_Goal"],
        result=get_result.response.definition.nested[f"{name}_Result"],
        feedback=feedback.definition.nested[f"{name}_Feedback"],
    )
    return ActionType(definition)


def part(action: str, name: str) -> str:
    """Return the full name of an action's service or topic."""
    return f"{action}/_action/{name}"


def goal_info(goal_id: bytes, stamp: Time) -> dict[str, object]:
    """Return an ``action_msgs/msg/GoalInfo``."""
    return {"goal_id": {"uuid": goal_id}, "stamp": stamp.to_dict()}


def stamp_of(message: Message) -> Time:
    """Return the time that a ``builtin_interfaces/msg/Time`` says."""
    return Time.from_parts(int(message.sec), int(message.nanosec))


def _service(action: ActionType, suffix: str) -> ServiceDefinition:
    made = derive(action.definition, suffix)
    assert isinstance(made, ServiceDefinition)
    return replace(made, request=_complete(made.request), response=_complete(made.response))


def _complete(definition: Definition) -> Definition:
    """Return a derived message with the definitions of what actions themselves add to it."""
    names = {field.type.name for field in definition.fields} & _BUILT_IN.keys()
    added = {name: parse_message(_BUILT_IN[name], name) for name in names}
    return replace(definition, nested={**definition.nested, **added})
