from __future__ import annotations

import pytest

from rosglass import InvalidNameError
from rosglass.comm.names import (
    action_of,
    demangle_topic,
    demangle_type,
    expand,
    hidden,
    mangle_type,
    validate_namespace,
    validate_node_name,
)


@pytest.mark.parametrize(
    ("written", "namespace", "full"),
    [
        ("/abs", "/arm", "/abs"),
        ("/a/b", "/", "/a/b"),
        ("chatter", "/", "/chatter"),
        ("chatter", "/arm", "/arm/chatter"),
        ("a/b", "/arm/left", "/arm/left/a/b"),
        ("~", "/", "/talker"),
        ("~", "/arm", "/arm/talker"),
        ("~/state", "/arm", "/arm/talker/state"),
        ("~/state", "/", "/talker/state"),
        ("{node}/x", "/arm", "/arm/talker/x"),
        ("/p/{node}", "/arm", "/p/talker"),
        ("{ns}/x", "/arm", "/arm/x"),
        ("{namespace}/x", "/arm", "/arm/x"),
        ("_hidden", "/", "/_hidden"),
        ("a1/_2", "/", "/a1/_2"),
    ],
)
def test_names_expand_as_in_rcl(written, namespace, full):
    assert expand(written, "talker", namespace) == full


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("", "non-empty string"),
        (None, "non-empty string"),
        ("/", "ends with '/'"),
        ("chatter/", "'/chatter/' (expanded from 'chatter/') ends with '/'"),
        ("a//b", "'//' at position 2; write a single '/'"),
        ("my topic", "contains ' ' at position 2"),
        ("a-b", "contains '-' at position 1; only letters, digits"),
        ("ä", "contains 'ä' at position 0"),
        ("1abc", "starts with the digit '1'; put a letter or '_' before it"),
        ("a/2b", "the part at position 3 starts with the digit '2'"),
        ("a~b", "'~' at position 1 must be the first character"),
        ("/~/b", "'~' at position 1 must be the first character"),
        ("~b", "write '~/b'"),
        ("{other}/x", "unknown substitution '{other}' at position 0"),
        ("{node", "unbalanced brace at position 0"),
        ("node}", "unbalanced brace at position 4"),
        ("{}", "unknown substitution '{}'"),
        ("{{node}}", "unbalanced brace"),
        ("x" * 300, "has 301 characters; at most 247"),
    ],
)
def test_bad_topic_names_are_refused_with_the_place_and_the_fix(written, message):
    with pytest.raises(InvalidNameError) as error:
        expand(written, "talker", "/")
    assert message in str(error.value)


@pytest.mark.parametrize("name", ["a", "talker_2", "_x", "A" * 255])
def test_good_node_names(name):
    validate_node_name(name)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "must not be empty"),
        (None, "must be a string"),
        ("a/b", "contains '/' at position 1"),
        ("my node", "contains ' '"),
        ("1a", "starts with a digit"),
        ("a" * 256, "at most 255"),
    ],
)
def test_bad_node_names(name, message):
    with pytest.raises(InvalidNameError, match=message):
        validate_node_name(name)


@pytest.mark.parametrize("namespace", ["/", "/arm", "/arm/left_2"])
def test_good_namespaces(namespace):
    validate_namespace(namespace)


@pytest.mark.parametrize(
    ("namespace", "message"),
    [
        ("", "write '/'"),
        ("arm", "write '/arm'"),
        (None, "must be a string"),
        ("/arm/", "ends with '/'"),
        ("/a//b", "'//' at position 2"),
        ("/a b", "contains ' '"),
        ("/2a", "starts with the digit"),
        ("/" + "a" * 250, "at most 245"),
    ],
)
def test_bad_namespaces(namespace, message):
    with pytest.raises(InvalidNameError, match=message):
        validate_namespace(namespace)


@pytest.mark.parametrize(
    ("ros", "dds"),
    [
        ("std_msgs/msg/String", "std_msgs::msg::dds_::String_"),
        ("example_interfaces/srv/AddTwoInts", "example_interfaces::srv::dds_::AddTwoInts_"),
        ("a/action/B_SendGoal", "a::action::dds_::B_SendGoal_"),
    ],
)
def test_type_names_on_the_wire(ros, dds):
    assert mangle_type(ros) == dds
    assert demangle_type(dds) == ros


@pytest.mark.parametrize("foreign", ["HelloWorld", "a::b", "std_msgs::msg::dds_::String", ""])
def test_foreign_type_names_stay_as_they_are(foreign):
    assert demangle_type(foreign) == foreign


@pytest.mark.parametrize("bad", ["String", "std_msgs/String", "a/msg/b/c", "a/msg/", "a b/msg/C"])
def test_incomplete_type_names_are_refused(bad):
    with pytest.raises(InvalidNameError, match="package/msg/Type"):
        mangle_type(bad)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("/fib/_action/status", True),
        ("/_ros2cli_daemon", True),
        ("_private", True),
        ("/scan", False),
        ("/a_b/c_", False),
        ("/", False),
    ],
)
def test_part_that_begins_with_an_underscore_hides_a_name(name, expected):
    assert hidden(name) is expected


@pytest.mark.parametrize(
    ("name", "type_name", "expected"),
    [
        ("/x/_action/send_goal", "p/action/Go_SendGoal", ("/x", "p/action/Go")),
        ("/a/x/_action/feedback", "p/action/Go_FeedbackMessage", ("/a/x", "p/action/Go")),
        ("/x/_action/send_goal", "p/srv/Other", None),
        ("/x/_action/get_result", "p/action/Go_GetResult", None),
        ("/x/send_goal", "p/action/Go_SendGoal", None),
    ],
)
def test_actions_are_known_by_their_parts(name, type_name, expected):
    assert action_of(name, type_name) == expected


@pytest.mark.parametrize(
    ("dds_topic", "expected"),
    [
        ("rt/chatter", ("rt", "/chatter")),
        ("rt/a/b", ("rt", "/a/b")),
        ("rq/addRequest", ("rq", "/add")),
        ("rr/arm/addReply", ("rr", "/arm/add")),
        ("rq/x/_action/send_goalRequest", ("rq", "/x/_action/send_goal")),
        ("rq/Request", None),
        ("rq/add", None),
        ("rr/addRequest", None),
        ("rt/", None),
        ("rt", None),
        ("rtx/chatter", None),
        ("ros_discovery_info", None),
        ("HelloWorldData_Msg", None),
        ("", None),
    ],
)
def test_dds_topics_are_demangled(dds_topic, expected):
    assert demangle_topic(dds_topic) == expected
