"""Services and actions, and the types that they imply."""

from __future__ import annotations

import pytest

from rosglass.errors import TypeNotFoundError
from rosglass.interfaces import (
    ActionDefinition,
    Definition,
    Library,
    ServiceDefinition,
    md5,
    parse_action,
    parse_service,
    service_event,
)

SERVICE = """\
# Adds.
int64 a # first
int64 b
int64 MOST=100
---
int64 sum
"""

ACTION = """\
int32 order
---
int32[] sequence
---
# How far it is.
float32 done # [%]
"""


def names(definition: Definition) -> list[tuple[str, str]]:
    return [(str(field.type), field.name) for field in definition.fields]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_service_of_ros2(end: str) -> None:
    service = parse_service(SERVICE.replace("\n", end), "my_msgs/Add")
    assert service.name == "my_msgs/srv/Add"
    assert service.request.name == "my_msgs/srv/Add_Request"
    assert service.response.name == "my_msgs/srv/Add_Response"
    assert names(service.request) == [("int64", "a"), ("int64", "b")]
    assert service.request.constant("MOST").value == 100
    assert names(service.response) == [("int64", "sum")]
    assert service.response.fields[0].place == (6, 1)


@pytest.mark.parametrize("text", ["int32 x", "int32 x\n---", "int32 x\n--- anything\n\n"])
def test_service_of_ros1_may_end_early(text: str) -> None:
    service = parse_service(text, "my_msgs/Say", ros=1)
    assert service.request.name == "my_msgs/srv/SayRequest"
    assert service.response.name == "my_msgs/srv/SayResponse"
    assert (len(service.request.fields), len(service.response.fields)) == (1, 0)


def test_service_event() -> None:
    event = service_event(parse_service(SERVICE, "my_msgs/Add"))
    assert event.name == "my_msgs/srv/Add_Event"
    assert names(event) == [
        ("service_msgs/msg/ServiceEventInfo", "info"),
        ("my_msgs/srv/Add_Request[<=1]", "request"),
        ("my_msgs/srv/Add_Response[<=1]", "response"),
    ]


def test_action_of_ros2() -> None:
    action = parse_action(ACTION, "my_msgs/Count")
    assert action.name == "my_msgs/action/Count"
    assert [part.name for part in (action.goal, action.result, action.feedback)] == [
        "my_msgs/action/Count_Goal",
        "my_msgs/action/Count_Result",
        "my_msgs/action/Count_Feedback",
    ]
    assert action.feedback.fields[0].unit == "%"
    assert action.feedback.comment == "How far it is."


def test_types_implied_by_a_service(library: Library) -> None:
    library.add_text("my_msgs/srv/Add", SERVICE)
    service = library.definition("my_msgs/srv/Add")
    assert isinstance(service, ServiceDefinition)
    assert library.definition("my_msgs/Add") is service
    assert library.definition("my_msgs/srv/Add_Request") is service.request
    assert library.definition("my_msgs/srv/Add_Response") is service.response
    event = library.definition("my_msgs/srv/Add_Event")
    assert isinstance(event, Definition)
    assert "builtin_interfaces/msg/Time" in event.nested
    assert event.source.provider == "wire, derived from my_msgs/srv/Add"


@pytest.mark.parametrize(
    ("suffix", "fields"),
    [
        ("_Goal", [("int32", "order")]),
        ("_Result", [("int32[]", "sequence")]),
        ("_Feedback", [("float32", "done")]),
        (
            "_SendGoal_Request",
            [("unique_identifier_msgs/msg/UUID", "goal_id"), ("my_msgs/action/Count_Goal", "goal")],
        ),
        (
            "_SendGoal_Response",
            [("bool", "accepted"), ("builtin_interfaces/msg/Time", "stamp")],
        ),
        ("_GetResult_Request", [("unique_identifier_msgs/msg/UUID", "goal_id")]),
        (
            "_GetResult_Response",
            [("int8", "status"), ("my_msgs/action/Count_Result", "result")],
        ),
        (
            "_FeedbackMessage",
            [
                ("unique_identifier_msgs/msg/UUID", "goal_id"),
                ("my_msgs/action/Count_Feedback", "feedback"),
            ],
        ),
        (
            "_SendGoal_Event",
            [
                ("service_msgs/msg/ServiceEventInfo", "info"),
                ("my_msgs/action/Count_SendGoal_Request[<=1]", "request"),
                ("my_msgs/action/Count_SendGoal_Response[<=1]", "response"),
            ],
        ),
    ],
)
def test_types_implied_by_an_action(
    library: Library, suffix: str, fields: list[tuple[str, str]]
) -> None:
    library.add_text("my_msgs/action/Count", ACTION)
    definition = library.definition(f"my_msgs/action/Count{suffix}")
    assert isinstance(definition, Definition)
    assert names(definition) == fields
    for field in definition.fields:
        assert not field.type.is_compound or field.type.name in definition.nested


@pytest.mark.parametrize("part", ["SendGoal", "GetResult"])
def test_services_implied_by_an_action(library: Library, part: str) -> None:
    library.add_text("my_msgs/action/Count", ACTION)
    service = library.definition(f"my_msgs/action/Count_{part}")
    assert isinstance(service, ServiceDefinition)
    assert service.request is library.definition(f"my_msgs/action/Count_{part}_Request")
    assert service.response.name == f"my_msgs/action/Count_{part}_Response"


@pytest.mark.parametrize(
    ("suffix", "fields"),
    [
        ("Goal", [("int32", "order")]),
        (
            "ActionGoal",
            [
                ("std_msgs/msg/Header", "header"),
                ("actionlib_msgs/msg/GoalID", "goal_id"),
                ("my_msgs/msg/CountGoal", "goal"),
            ],
        ),
        (
            "ActionResult",
            [
                ("std_msgs/msg/Header", "header"),
                ("actionlib_msgs/msg/GoalStatus", "status"),
                ("my_msgs/msg/CountResult", "result"),
            ],
        ),
        (
            "ActionFeedback",
            [
                ("std_msgs/msg/Header", "header"),
                ("actionlib_msgs/msg/GoalStatus", "status"),
                ("my_msgs/msg/CountFeedback", "feedback"),
            ],
        ),
        (
            "Action",
            [
                ("my_msgs/msg/CountActionGoal", "action_goal"),
                ("my_msgs/msg/CountActionResult", "action_result"),
                ("my_msgs/msg/CountActionFeedback", "action_feedback"),
            ],
        ),
    ],
)
def test_messages_implied_by_an_action_of_ros1(
    library: Library, suffix: str, fields: list[tuple[str, str]]
) -> None:
    library.add_text("my_msgs/action/Count", ACTION, ros=1)
    definition = library.definition(f"my_msgs/Count{suffix}", ros=1)
    assert isinstance(definition, Definition)
    assert definition.name == f"my_msgs/msg/Count{suffix}"
    assert names(definition) == fields


def test_text_of_implied_messages_parses_to_the_same(library: Library) -> None:
    library.add_text("my_msgs/action/Count", ACTION, ros=1)
    action = library.definition("my_msgs/CountAction", ros=1)
    again = Library()
    again.add_text("my_msgs/action/Count", ACTION, ros=1)
    again.add_text("my_msgs/CountAction", action.text, ros=1)
    assert md5(again.definition("my_msgs/CountAction", ros=1)) == md5(action)


def test_message_of_the_same_name_comes_first(library: Library) -> None:
    library.add_text("my_msgs/action/Count", ACTION, ros=1)
    library.add_text("my_msgs/CountGoal", "int32 other", ros=1)
    goal = library.definition("my_msgs/CountGoal", ros=1)
    assert isinstance(goal, Definition)
    assert names(goal) == [("int32", "other")]


def test_kinds_of_a_short_name(library: Library) -> None:
    assert isinstance(library.definition("std_srvs/Empty"), ServiceDefinition)
    assert isinstance(library.definition("std_msgs/Empty"), Definition)
    assert isinstance(library.definition("example_interfaces/Fibonacci"), ActionDefinition)


@pytest.mark.parametrize(
    ("name", "ros"),
    [
        ("std_srvs/srv/Empty_Goal", 2),
        ("std_srvs/srv/_Request", 2),
        ("example_interfaces/action/Fibonacci_Request", 2),
        ("example_interfaces/msg/Fibonacci_Goal", 2),
        ("std_srvs/srv/Empty_Event", 1),
        ("std_srvs/srv/Empty_Request", 1),
    ],
)
def test_names_that_are_not_implied_are_unknown(library: Library, name: str, ros: int) -> None:
    with pytest.raises((TypeNotFoundError, ValueError)):
        library.definition(name, ros)


@pytest.mark.parametrize("name", ["pkg/action/Count", "pkg/Count"])
def test_action_of_ros1_whose_file_is_missing(name: str) -> None:
    made = Library()
    made.add_text("pkg/action/Count", ACTION, ros=1)
    library = Library()
    for part in ("Goal", "Result", "Feedback", "ActionGoal"):
        with pytest.raises(TypeNotFoundError):
            library.definition(name, ros=1)
        text = made.definition(f"pkg/Count{part}", ros=1)
        assert isinstance(text, Definition)
        library.add_text(f"pkg/Count{part}", text.text, ros=1)
    action, original = library.definition(name, ros=1), made.definition(name, ros=1)
    assert isinstance(action, ActionDefinition)
    assert isinstance(original, ActionDefinition)
    assert action.name == "pkg/action/Count"
    assert md5(action) == md5(original)
    assert names(action.feedback) == [("float32", "done")]
    assert "composed of its messages" in action.source.provider
    reparsed = parse_action(action.text, action.name, ros=1)
    assert names(reparsed.goal) == [("int32", "order")]
