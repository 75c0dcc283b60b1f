"""Types that services and actions imply: requests, responses, events, goals and their wrappers.

ROS 2: rosidl's ``rosidl_parser/definition.py`` (services and their event messages, since Iron) and
http://design.ros2.org/articles/actions.html. ROS 1: actionlib_msgs' ``genaction``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosglass.interfaces.definition import (
    ActionDefinition,
    ArrayKind,
    Definition,
    Field,
    FieldType,
    ServiceDefinition,
    Source,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.interfaces.definition import InterfaceDefinition

__all__ = ["compose", "derive", "derived_from", "service_event"]

_UUID = "unique_identifier_msgs/msg/UUID"
_TIME = "builtin_interfaces/msg/Time"
_EVENT_INFO = "service_msgs/msg/ServiceEventInfo"
_HEADER = "std_msgs/msg/Header"
_GOAL_ID = "actionlib_msgs/msg/GoalID"
_GOAL_STATUS = "actionlib_msgs/msg/GoalStatus"

_SERVICE_SUFFIXES = {1: ("Request", "Response"), 2: ("_Request", "_Response", "_Event")}
# Longest first: X_SendGoal_Request is not the request of a service X_SendGoal.
_ACTION_SUFFIXES = {
    1: (
        "ActionFeedback",
        "ActionResult",
        "ActionGoal",
        "Feedback",
        "Result",
        "Action",
        "Goal",
    ),
    2: (
        "_SendGoal_Response",
        "_GetResult_Response",
        "_SendGoal_Request",
        "_GetResult_Request",
        "_FeedbackMessage",
        "_SendGoal_Event",
        "_GetResult_Event",
        "_GetResult",
        "_SendGoal",
        "_Feedback",
        "_Result",
        "_Goal",
    ),
}


def derived_from(name: str, ros: int) -> Iterator[tuple[str, str]]:
    """List the services and actions that a type could be derived from.

    Args:
        name: Full type name.
        ros: 1 or 2.

    Yields:
        Full name of the service or action, and the suffix that turns it into `name`.
    """
    package, kind, base = name.split("/")
    if kind == "srv":
        candidates = [("srv", suffix) for suffix in _SERVICE_SUFFIXES[ros]]
    elif kind == ("msg" if ros == 1 else "action"):
        candidates = [("action", suffix) for suffix in _ACTION_SUFFIXES[ros]]
    else:
        return
    for owner, suffix in candidates:
        if base.endswith(suffix) and len(base) > len(suffix):
            yield f"{package}/{owner}/{base.removesuffix(suffix)}", suffix


def derive(owner: InterfaceDefinition, suffix: str) -> InterfaceDefinition | None:
    """Return the type of `owner` with the name suffix `suffix`; None if there is no such type."""
    if isinstance(owner, ServiceDefinition):
        return _of_service(owner, suffix)
    if isinstance(owner, ActionDefinition):
        table = _ROS1_ACTION if owner.ros == 1 else _ROS2_ACTION
        build = table.get(suffix)
        return build(owner) if build else None
    return None


def compose(
    name: str, find: Callable[[str], InterfaceDefinition | None]
) -> ActionDefinition | None:
    """Return a ROS 1 action whose file is missing, as in packages without sources.

    Args:
        name: Full type name, ``pkg/action/Type``.
        find: Returns the definition of a message; None if there is none.

    Returns:
        The action, composed of its generated messages; None if one of them is missing.
    """
    package, _, base = name.split("/")
    names = [f"{package}/msg/{base}{suffix}" for suffix in ("Goal", "Result", "Feedback")]
    parts = [part for part in map(find, names) if isinstance(part, Definition)]
    if len(parts) < len(names) or find(f"{package}/msg/{base}ActionGoal") is None:
        return None
    goal, result, feedback = parts
    return ActionDefinition(
        name=name,
        ros=1,
        goal=goal,
        result=result,
        feedback=feedback,
        text="\n---\n".join(part.text.rstrip("\n") for part in parts),
        source=Source(f"{goal.source.provider}, composed of its messages", goal.source.file),
    )


def service_event(service: ServiceDefinition) -> Definition:
    """Return the ROS 2 event message of a service (what service introspection publishes)."""
    return _message(
        service,
        f"{service.name}_Event",
        Field("info", FieldType(_EVENT_INFO)),
        Field("request", FieldType(service.request.name, ArrayKind.BOUNDED, 1)),
        Field("response", FieldType(service.response.name, ArrayKind.BOUNDED, 1)),
        needs=(service.request, service.response),
    )


def _of_service(service: ServiceDefinition, suffix: str) -> Definition | None:
    if suffix.lstrip("_") == "Request":
        return service.request
    if suffix.lstrip("_") == "Response":
        return service.response
    return service_event(service) if suffix == "_Event" and service.ros == 2 else None


def _message(
    owner: InterfaceDefinition, name: str, *fields: Field, needs: tuple[Definition, ...] = ()
) -> Definition:
    nested: dict[str, Definition] = {}
    for definition in needs:
        nested |= definition.nested
        nested[definition.name] = definition
    lines = []
    for field in fields:
        package, kind, base = field.type.name.split("/") if field.type.is_compound else ("",) * 3
        short = f"{package}/{base}" if kind == "msg" else field.type.name
        lines.append(f"{str(field.type).replace(field.type.name, short)} {field.name}")
    return Definition(
        name=name,
        ros=owner.ros,
        fields=fields,
        text="\n".join(lines),
        source=Source(f"{owner.source.provider}, derived from {owner.name}", owner.source.file),
        nested=nested,
    )


def _send_goal(action: ActionDefinition) -> ServiceDefinition:
    return _service(
        action,
        "SendGoal",
        (Field("goal_id", FieldType(_UUID)), Field("goal", FieldType(action.goal.name))),
        (Field("accepted", FieldType("bool")), Field("stamp", FieldType(_TIME))),
        needs=((action.goal,), ()),
    )


def _get_result(action: ActionDefinition) -> ServiceDefinition:
    return _service(
        action,
        "GetResult",
        (Field("goal_id", FieldType(_UUID)),),
        (Field("status", FieldType("int8")), Field("result", FieldType(action.result.name))),
        needs=((), (action.result,)),
    )


def _service(
    action: ActionDefinition,
    label: str,
    request: tuple[Field, ...],
    response: tuple[Field, ...],
    needs: tuple[tuple[Definition, ...], tuple[Definition, ...]],
) -> ServiceDefinition:
    name = f"{action.name}_{label}"
    asked = _message(action, f"{name}_Request", *request, needs=needs[0])
    answered = _message(action, f"{name}_Response", *response, needs=needs[1])
    return ServiceDefinition(
        name=name,
        ros=2,
        request=asked,
        response=answered,
        text=f"{asked.text}\n---\n{answered.text}",
        source=asked.source,
    )


def _feedback_message(action: ActionDefinition) -> Definition:
    return _message(
        action,
        f"{action.name}_FeedbackMessage",
        Field("goal_id", FieldType(_UUID)),
        Field("feedback", FieldType(action.feedback.name)),
        needs=(action.feedback,),
    )


_ROS2_ACTION: dict[str, Callable[[ActionDefinition], InterfaceDefinition]] = {
    "_Goal": lambda action: action.goal,
    "_Result": lambda action: action.result,
    "_Feedback": lambda action: action.feedback,
    "_SendGoal": _send_goal,
    "_SendGoal_Request": lambda action: _send_goal(action).request,
    "_SendGoal_Response": lambda action: _send_goal(action).response,
    "_SendGoal_Event": lambda action: service_event(_send_goal(action)),
    "_GetResult": _get_result,
    "_GetResult_Request": lambda action: _get_result(action).request,
    "_GetResult_Response": lambda action: _get_result(action).response,
    "_GetResult_Event": lambda action: service_event(_get_result(action)),
    "_FeedbackMessage": _feedback_message,
}


def _ros1_wrapper(action: ActionDefinition, part: Definition, second: Field) -> Definition:
    label = part.name.removeprefix(action.name.replace("/action/", "/msg/"))
    return _message(
        action,
        f"{action.name.replace('/action/', '/msg/')}Action{label}",
        Field("header", FieldType(_HEADER)),
        second,
        Field(label.lower(), FieldType(part.name)),
        needs=(part,),
    )


def _action_goal(action: ActionDefinition) -> Definition:
    return _ros1_wrapper(action, action.goal, Field("goal_id", FieldType(_GOAL_ID)))


def _action_result(action: ActionDefinition) -> Definition:
    return _ros1_wrapper(action, action.result, Field("status", FieldType(_GOAL_STATUS)))


def _action_feedback(action: ActionDefinition) -> Definition:
    return _ros1_wrapper(action, action.feedback, Field("status", FieldType(_GOAL_STATUS)))


def _action_message(action: ActionDefinition) -> Definition:
    parts = (_action_goal(action), _action_result(action), _action_feedback(action))
    fields = (
        Field(f"action_{label}", FieldType(part.name))
        for label, part in zip(("goal", "result", "feedback"), parts, strict=True)
    )
    name = f"{action.name.replace('/action/', '/msg/')}Action"
    return _message(action, name, *fields, needs=parts)


_ROS1_ACTION: dict[str, Callable[[ActionDefinition], InterfaceDefinition]] = {
    "Goal": lambda action: action.goal,
    "Result": lambda action: action.result,
    "Feedback": lambda action: action.feedback,
    "ActionGoal": _action_goal,
    "ActionResult": _action_result,
    "ActionFeedback": _action_feedback,
    "Action": _action_message,
}
