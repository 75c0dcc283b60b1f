"""Command lines as rospy and roscpp read them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

import rosglass
from rosglass import RosArgumentError
from rosglass.ros1.options import Arguments

if TYPE_CHECKING:
    from tests.unit.ros1.conftest import FakeMaster


def parse(*arguments: str) -> Arguments:
    return Arguments.parse(["program", *arguments])


@pytest.mark.parametrize(
    ("rule", "old", "new"),
    [
        ("chatter:=talk", "/ns/chatter", "/ns/talk"),
        ("chatter:=/talk", "/ns/chatter", "/talk"),
        ("/chatter:=talk", "/chatter", "/ns/talk"),
        ("~state:=state", "/ns/node/state", "/ns/state"),
        ("state:=~state", "/ns/state", "/ns/node/state"),
        ("a/b:=c/d", "/ns/a/b", "/ns/c/d"),
        ("a//b/:=c", "/ns/a/b", "/ns/c"),
        (" a := b ", "/ns/a", "/ns/b"),
    ],
)
def test_names_are_replaced(rule: str, old: str, new: str) -> None:
    parsed = parse(rule.strip()) if rule.startswith(" ") else parse(rule)
    assert parsed.remappings("node", "/ns") == {old: new}


def test_last_rule_for_a_name_counts_as_in_rospy() -> None:
    assert parse("a:=b", "/ns/a:=c").remappings("node", "/ns") == {"/ns/a": "/ns/c"}


def test_special_names() -> None:
    parsed = parse(
        *("__name:=left", "__ns:=arm/", "__ip:=10.0.0.2", "__master:=http://robot:11312"),
        *("__log:=/tmp/x.log", "__tcpros_server_port:=5000"),
    )
    assert (parsed.name, parsed.namespace, parsed.address) == ("left", "/arm", "10.0.0.2")
    assert (parsed.master, parsed.tcpros_port) == ("http://robot:11312", 5000)
    assert parse("__ip:=10.0.0.2", "__hostname:=robot").address == "robot"
    assert parse("__ns:=/").namespace == "/"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("1.5", 1.5),
        ("true", True),
        ("'1'", "1"),
        ("[1, two]", [1, "two"]),
        ("{a: {b: 1}}", {"a": {"b": 1}}),
        ("x:=y", "x:=y"),
        ("hello world", "hello world"),
    ],
)
def test_private_parameters_have_yaml_values(text: str, value: Any) -> None:
    for parsed in (parse(f"_a/b:={text}"), parse("--ros-args", "-p", f"a/b:={text}", "--")):
        assert parsed.parameters == {"a/b": value}
        assert type(parsed.parameters["a/b"]) is type(value)


def test_other_arguments_are_kept() -> None:
    others = ["program", "--file", "x.qml", "-v", "--name:=x", "=", ":=x", "10:=20", "", "a:b=c"]
    assert Arguments.parse([*others, "a:=b"]).others == tuple(others)


def test_ros_2_arguments_work_in_ros_1() -> None:
    parsed = parse(
        *("--ros-args", "-r", "chatter:=talk", "--remap", "__ns:=/arm", "--param", "speed:=2"),
        *("-r", "__node:=left", "--", "rest"),
    )
    assert parsed.remappings("left", "/arm") == {"/arm/chatter": "/arm/talk"}
    assert (parsed.name, parsed.namespace, parsed.parameters) == ("left", "/arm", {"speed": 2})
    assert parsed.others == ("program", "rest")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a:="], "argument 2: 'a:=' has nothing after ':='; write e.g. chatter:=talk"),
        (["x", "a b:=c"], "argument 3: 'a b:=c': name 'a b': ' ' at position 1"),
        (["a:=b-c"], "'a:=b-c': name 'b-c': '-' at position 1"),
        (["a:=1b"], "must begin with a letter"),
        (["/:=b"], "'/' is not the name of a topic or service"),
        (["a:=~"], "'~' is not the name of a topic or service"),
        (["a:=b:=c"], "':' at position 1"),
        (["__nmae:=x"], "__nmae is unknown; known are __name, .*did you mean __name"),
        (["__name:=a/b"], "node name 'a/b': '/' at position 1"),
        (["__name:=1a"], "must begin with a letter"),
        (["__ns:=a b"], "__ns 'a b': ' ' at position 1"),
        (["__ip:=10.0.0.2:80"], "__ip: expected a host or address only, without port"),
        (["__hostname:=http://x"], "__hostname: expected a host"),
        (["__master:=robot"], "__master: expected scheme, host and port"),
        (["__tcpros_server_port:=70000"], "a port number from 0 to 65535"),
        (["_a:=["], "argument 2: '_a:=\\['"),
        (["_:=1"], "a parameter's name is missing"),
        (["_a-b:=1"], "'-' at position"),
        (["--ros-args", "--params-file", "x"], "no option '--params-file'; known are -r"),
        (["--ros-args", "-r"], "-r is followed by ''"),
        (["--ros-args", "-r", "a"], "argument 3: -r is followed by 'a', which is not a rule"),
        (["--ros-args", "a"], "argument 3: 'a' is not a rule"),
    ],
)
def test_bad_arguments_are_reported(arguments: list[str], message: str) -> None:
    with pytest.raises(RosArgumentError, match=message):
        parse(*arguments)


@pytest.mark.parametrize("arguments", ["a:=b", b"a:=b", None, [1], 5])
def test_arguments_are_a_list_of_texts(arguments: Any) -> None:
    with pytest.raises(RosArgumentError, match="must be a list of strings such as sys"):
        rosglass.connect("ros1://127.0.0.1:1", arguments=arguments)


def test_node_obeys_its_arguments(master: FakeMaster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_NAMESPACE", "ignored")
    arguments = ["prog", "__name:=left", "__ns:=/arm", "in:=/out", "_speed:=1.5"]
    with rosglass.connect(master.url, "right", "/leg", arguments=arguments) as node:
        assert (node.name, node.namespace) == ("left", "/arm")
        assert node.resolve("in") == node.resolve("/arm/in") == "/out"
        assert node.resolve("~in") == "/arm/left/in"
        assert node.create_publisher("in", "std_msgs/Empty").topic == "/out"
        assert node.create_subscription("in").topic == "/out"
        assert node.create_service_client("in", "std_srvs/Empty").name == "/out"


@pytest.mark.parametrize(
    ("given", "variable", "namespace"),
    [(None, "arm", "/arm"), ("/", "/arm/", "/arm"), ("/leg", "arm", "/leg"), (None, "", "/")],
)
def test_namespace_comes_from_the_program_or_the_environment(
    monkeypatch: pytest.MonkeyPatch, given: str | None, variable: str, namespace: str
) -> None:
    monkeypatch.setenv("ROS_NAMESPACE", variable)
    with rosglass.connect("ros1://127.0.0.1:1", "node", given) as node:
        assert node.namespace == namespace
        assert node.resolve("a") == f"{namespace.rstrip('/')}/a"


def test_bad_ros_namespace_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_NAMESPACE", "a-b")
    with pytest.raises(rosglass.InvalidNameError, match="ROS_NAMESPACE 'a-b': '-' at position 1"):
        rosglass.connect("ros1://127.0.0.1:1")


def test_anonymous_names_are_unique() -> None:
    url = "ros1://127.0.0.1:1"
    with (
        rosglass.connect(url) as one,
        rosglass.connect(url) as two,
        rosglass.connect(f"{url}?anonymous=true", "panel") as three,
        rosglass.connect(f"{url}?anonymous=true", "panel") as four,
        rosglass.connect(f"{url}?anonymous=true", "panel", arguments=["__name:=exact"]) as five,
    ):
        names = [node.name for node in (one, two, three, four)]
        assert len(set(names)) == 4
        assert [name.split("_")[0] for name in names] == ["rosglass"] * 2 + ["panel"] * 2
        assert five.name == "exact"  # as rospy and roscpp have it
