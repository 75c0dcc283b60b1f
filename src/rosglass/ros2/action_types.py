"""The services and topics of a ROS 2 action, and the types derived for them.

Names, types and profiles: http://design.ros2.org/articles/actions.html; ``rcl_action``'s
``names.h`` and ``default_qos.h``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from rosglass.comm import EndpointKind, GoalStatus, QoS, Time
from rosglass.errors import Error
from rosglass.interfaces import parse_message
from rosglass.interfaces.definition import Definition, ServiceDefinition
from rosglass.interfaces.derived import derive
from rosglass.messages import ActionType, MessageType, ServiceType
from rosglass.ros2.announced import (
    Announced,
    choose_type_name,
    duplicate_servers,
    mismatches,
    request_definition,
)

if TYPE_CHECKING:
    from rosglass.comm import EndpointInfo
    from rosglass.comm.types import Types
    from rosglass.messages import Message
    from rosglass.ros2.core import Core

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
    "ActionVersion",
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

#: ``action_msgs/srv/CancelGoal``'s return codes in words.
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
    """An action's type and those of its services and topics.

    Attributes:
        action: The action's type.
        send_goal: The service type for sending goals.
        get_result: The service type for requesting results.
        cancel_goal: The service type for cancelling goals.
        feedback: The message type of feedback.
        status: The message type of the status of all goals.
    """

    action: ActionType
    send_goal: ServiceType
    get_result: ServiceType
    cancel_goal: ServiceType
    feedback: MessageType
    status: MessageType

    @classmethod
    def of(cls, action: ActionType, types: Types) -> ActionTypes:
        """Return the types derived from an action; raises TypeNotFoundError without action_msgs."""
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

    A robot announces its version of an action by the hash of each part.
    """
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
    """Return the time in a ``builtin_interfaces/msg/Time``."""
    return Time.from_parts(int(message.sec), int(message.nanosec))


def _service(action: ActionType, suffix: str) -> ServiceDefinition:
    made = derive(action.definition, suffix)
    assert isinstance(made, ServiceDefinition)
    return replace(made, request=_complete(made.request), response=_complete(made.response))


def _complete(definition: Definition) -> Definition:
    """Return a derived message, completed with the definitions of the fields that actions add."""
    names = {field.type.name for field in definition.fields} & _BUILT_IN.keys()
    added = {name: parse_message(_BUILT_IN[name], name) for name in names}
    return replace(definition, nested={**definition.nested, **added})


class ActionVersion:
    """The type of an action, in the version that its server announces.

    Two versions of an action often differ in one part only, and each part has its own hash: the
    service ``send_goal`` has the goal's, ``get_result`` the result's, the topic the feedback's.

    Args:
        core: The node.
        name: Absolute name of the action.
        wanted: The type, or its name to use the announced version; None uses whatever type is
            announced.

    Attributes:
        types: The types in use; None while they are unknown.

    Raises:
        TypeNotFoundError: No definition of the given type is known.
    """

    def __init__(self, core: Core, name: str, wanted: ActionType | str | None) -> None:
        self._core, self._name = core, name
        self._discovers = wanted is None
        self._fixed = wanted is not None and not isinstance(wanted, str)
        self.types: ActionTypes | None = None
        self._choice = self._missing = self._failure = ""
        self._fetching = False
        self._send_goal: Announced[ServiceType]
        self._get_result: Announced[ServiceType]
        self._feedback: Announced[MessageType]
        if wanted is not None:
            self._begin(core.types.action(wanted))

    def follow(self, *, retry: bool) -> bool:
        """Adopt the type and version that the server announces.

        Args:
            retry: Whether to search again for definitions that were not found before.

        Returns:
            Whether the type has changed.
        """
        before = self.types
        try:
            if self._discovers:
                self._discover()
            if self.types is not None:
                self._adopt(self.types.action, retry)
            self._failure = ""
        except Error as error:
            self._failure = str(error)
        return self.types is not before

    @property
    def pending(self) -> bool:
        """True while a definition is being fetched."""
        types = self.types
        return self._fetching or (
            types is not None and any(version.pending for version, _ in self._parts())
        )

    def server_conflicts(self) -> list[str]:
        """Return the conflicts with servers, one sentence each."""
        types = self.types
        problems = [self._choice, self._missing, self._failure]
        if types is not None:
            problems += [version.failure for version, _ in self._parts()]
        problems = [text for text in problems if text]
        if not problems and types is not None:
            for version, name in self._parts():
                effect = "its feedback is lost" if name == FEEDBACK else "it gets no goals"
                problems += mismatches(version, self._peers(name), "offers", effect)
            servers = [
                peer for peer in self._peers(SEND_GOAL) if self._send_goal.is_compatible(peer)
            ]
            problems += duplicate_servers(servers, self._name)
        return problems

    def _discover(self) -> None:
        servers = self._peers(SEND_GOAL)
        names = [s.type.removesuffix("_SendGoal") for s in servers if s.type.endswith("_SendGoal")]
        current = "" if self.types is None else self.types.action.name
        example = f"create_action_client({self._name!r}, {{}})"
        name, self._choice = choose_type_name(names, current, example)
        if not name or name == current:
            self._missing, self._fetching = "", False
            return
        try:
            found = self._core.types.action(name)
        except Error as error:
            self._missing, self._fetching = request_definition(self._core, name, "", servers, error)
        else:
            self._missing, self._fetching = "", False
            self._begin(found)

    def _begin(self, action: ActionType) -> None:
        core, find, fixed = self._core, self._core.types, self._fixed
        types = ActionTypes.of(action, find)
        self._send_goal = Announced(core, find.service, types.send_goal, fixed)
        self._get_result = Announced(core, find.service, types.get_result, fixed)
        self._feedback = Announced(core, find.message, types.feedback, fixed)
        self.types = types

    def _adopt(self, action: ActionType, retry: bool) -> None:
        changed = [
            self._send_goal.follow(f"{action.name}_SendGoal", self._peers(SEND_GOAL), retry),
            self._get_result.follow(f"{action.name}_GetResult", self._peers(GET_RESULT), retry),
            self._feedback.follow(f"{action.name}_FeedbackMessage", self._peers(FEEDBACK), retry),
        ]
        if not any(changed):
            return
        goal, result, feedback = self._send_goal.type, self._get_result.type, self._feedback.type
        assert goal is not None  # each was created with a type
        assert result is not None
        assert feedback is not None
        self.types = ActionTypes.of(assemble(action, goal, result, feedback), self._core.types)

    def _parts(self) -> list[tuple[Announced[Any], str]]:
        return [
            (self._send_goal, SEND_GOAL),
            (self._get_result, GET_RESULT),
            (self._feedback, FEEDBACK),
        ]

    def _peers(self, name: str) -> list[EndpointInfo]:
        kind = EndpointKind.PUBLISHER if name == FEEDBACK else EndpointKind.SERVICE_SERVER
        return self._core.graph.endpoints(kind, part(self._name, name))
