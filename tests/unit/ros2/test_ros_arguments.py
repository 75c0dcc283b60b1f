"""``--ros-args``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import RosArgumentError
from rosglass.ros2.ros_arguments import Arguments

if TYPE_CHECKING:
    from pathlib import Path


def parse(*arguments: str) -> Arguments:
    return Arguments.parse(["--ros-args", *arguments])


def topics(arguments: Arguments, name: str = "node", namespace: str = "/ns") -> dict[str, str]:
    return arguments.remappings("topic", name, namespace)


def services(arguments: Arguments, name: str = "node", namespace: str = "/ns") -> dict[str, str]:
    return arguments.remappings("service", name, namespace)


def test_only_what_stands_after_ros_args_counts(caplog: pytest.LogCaptureFixture) -> None:
    line = ["prog", "-r", "no:=1", "old:=new", "--ros-args", "-r", "a:=b", "--", "-p", "x:=1"]
    line += ["--ros-args", "-r", "c:=d"]
    arguments = Arguments.parse(line)
    assert topics(arguments) == {"/ns/a": "/ns/b", "/ns/c": "/ns/d"}
    assert arguments.others == ("prog", "-r", "no:=1", "old:=new", "-p", "x:=1")
    assert "'old:=new' stands outside of --ros-args and changes nothing" in caplog.text
    assert Arguments.parse([]) == Arguments()
    assert parse() == parse("--") == Arguments()


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ("foo:=bar", {"/ns/foo": "/ns/bar"}),
        ("/foo:=/a/bar", {"/foo": "/a/bar"}),
        ("foo:=/bar", {"/ns/foo": "/bar"}),
        ("/foo:=bar", {"/foo": "/ns/bar"}),
        ("~/foo:=foo", {"/ns/node/foo": "/ns/foo"}),
        ("foo:=~/x/y", {"/ns/foo": "/ns/node/x/y"}),
        ("node:foo:=bar", {"/ns/foo": "/ns/bar"}),
        ("other:foo:=bar", {}),
        ("rostopic://foo:=bar", {"/ns/foo": "/ns/bar"}),
        ("rostopic:///foo:=bar", {"/foo": "/ns/bar"}),
        ("node:rostopic://~/foo:=bar", {"/ns/node/foo": "/ns/bar"}),
        ("rosservice://foo:=bar", {}),
    ],
)
@pytest.mark.parametrize("option", ["-r", "--remap"])
def test_rules_are_about_absolute_names(option: str, rule: str, expected: dict[str, str]) -> None:
    assert topics(parse(option, rule)) == expected


def test_rules_for_topics_or_services_only() -> None:
    arguments = parse("-r", "rosservice://foo:=bar", "-r", "rostopic://foo:=baz", "-r", "x:=y")
    assert topics(arguments) == {"/ns/foo": "/ns/baz", "/ns/x": "/ns/y"}
    assert services(arguments) == {"/ns/foo": "/ns/bar", "/ns/x": "/ns/y"}


def test_first_rule_that_matches_counts() -> None:
    # The example of the design article.
    arguments = parse(
        *("-r", "my_topic:=first", "-r", "my_topic:=second"),
        *("-r", "my_node:another_topic:=first", "-r", "another_topic:=second"),
    )
    assert topics(arguments, "my_node", "/") == {
        "/my_topic": "/first",
        "/another_topic": "/first",
    }


@pytest.mark.parametrize(
    ("rules", "name", "namespace"),
    [
        (["__node:=x"], "x", "/"),
        (["__name:=x"], "x", "/"),
        (["__ns:=/a/b"], "talker", "/a/b"),
        (["__ns:=/a/"], "talker", "/a"),
        (["__ns:=/"], "talker", "/"),
        (["talker:__node:=x", "talker:__ns:=/no", "x:__ns:=/yes"], "x", "/yes"),
        (["other:__node:=x", "other:__ns:=/x"], "talker", "/"),
        (["__node:=a", "__node:=b"], "a", "/"),
    ],
)
def test_nodes_are_renamed(rules: list[str], name: str, namespace: str) -> None:
    arguments = parse(*(part for rule in rules for part in ("-r", rule)))
    new = arguments.node_name("talker")
    assert (new, arguments.namespace(new, "/")) == (name, namespace)


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ("foo", "argument 3: 'foo' has no ':='; write e.g. -r chatter:=talk"),
        (":=bar", "argument 3: ':=bar' has no name before ':='"),
        ("node::=bar", "has no name before ':='"),
        ("foo:=", r"'foo:=' has no new name after ':=' \(position 5\)"),
        ("/foo/*:=bar", r"the old name '/foo/\*' has a wildcard"),
        (r"foo:=\1", r"the new name .* has a wildcard"),
        ("~:=bar", "the old name '~' is not a name; write '~/name'"),
        ("{node}:=bar", "is not a name"),
        ("fo o:=bar", r"contains ' ' at position 2"),
        ("foo:=b//ar", "'//' at position"),
        ("foo:=1bar", "starts with the digit"),
        ("a:b:c:=d", "contains ':' at position 1"),
        ("__node:=a/b", "node name 'a/b' contains '/'"),
        ("__ns:=a", "namespace 'a' is not absolute"),
        ("__ns:=", "has no new name"),
    ],
)
def test_bad_rules_are_reported(rule: str, message: str) -> None:
    with pytest.raises(RosArgumentError, match=message):
        parse("-r", rule)


def test_rule_that_makes_too_long_a_name_is_reported_with_its_node() -> None:
    arguments = parse("-r", f"foo:={'x' * 200}")
    with pytest.raises(RosArgumentError, match=r"-r foo:=x+ cannot be applied to node node in /y"):
        topics(arguments, namespace="/" + "y" * 50)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("1", 1),
        ("1.0", 1.0),
        ("test", "test"),
        ("'1'", "1"),
        ("[1, 2]", [1, 2]),
        ("true", True),
        ("a:=b", "a:=b"),
        ("[]", []),
    ],
)
def test_parameters(value: str, expected: Any) -> None:
    for arguments in (parse("-p", f"x.y:={value}"), parse(f"--param=x.y:={value}")):
        assert arguments.parameters("/any/node") == {"x.y": expected}
        assert type(arguments.parameters("/n")["x.y"]) is type(expected)


def test_parameters_of_one_node_win(tmp_path: Path) -> None:
    arguments = parse("-p", "node:a:=1", "-p", "a:=2", "-p", "b:=1", "-p", "b:=2", "-p", "o:c:=3")
    assert arguments.parameters("/ns/node") == {"a": 1, "b": 2}
    assert arguments.parameters("/o") == {"a": 2, "b": 2, "c": 3}

    # The example of the design article.
    file = tmp_path / "my_params.yaml"
    file.write_text(
        "my_node:\n    ros__parameters:\n        my_int: 1\n        my_int: 2\n"
        "        another_int: 1\n        my_float: 1.0\n        another_float: 1.0\n"
        "my_node:\n    ros__parameters:\n        another_int: 2\n"
        "/**:\n    ros__parameters:\n        my_int: 3\n        global_int: 1\n"
    )
    arguments = parse(
        *("-p", "my_node:global_int:=2", "-p", "my_float:=2.0", "--params-file", str(file)),
        *("-p", "my_float:=3.0", "-p", "my_node:another_float:=2.0"),
    )
    assert arguments.parameters("/my_node") == {
        "my_int": 2,
        "another_int": 2,
        "global_int": 2,
        "my_float": 1.0,
        "another_float": 2.0,
    }


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ("x", "'x' has no ':='; write e.g. -p speed:=1.5"),
        (
            "x:=",
            r"'x:=' has no value after ':=' \(position 3\); an empty text is written -p \"x:=''\"",
        ),
        (":=1", "has no name before"),
        ("a b:=1", "'a b' is not a parameter name"),
        ("a..b:=1", "is not a parameter name"),
        ("a:b:c:=1", "is not a parameter name"),
        ("x:={a: 1}", "a parameter's value is a scalar or a list, not a mapping"),
        ("x:=[1, 2.0]", "the items of a list must be of one type"),
        ("x:=[", "this is not YAML"),
    ],
)
def test_bad_parameters_are_reported(rule: str, message: str) -> None:
    with pytest.raises(RosArgumentError, match=message):
        parse("-p", rule)


def test_bad_files_are_reported(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text("a:\n  ros_parameters: {b: 1}\n  c: 2")
    with pytest.raises(
        RosArgumentError, match=r"argument 3: --params-file: .*bad\.yaml:2:20: 'b' .* spelled"
    ):
        parse("--params-file", str(file))
    with pytest.raises(RosArgumentError, match=r"none\.yaml cannot be read"):
        parse("--params-file", str(tmp_path / "none.yaml"))


def test_log_levels() -> None:
    arguments = parse(
        *("--log-level", "debug", "--log-level", "WARN", "--log-level", "rcl:=Error"),
        "--log-level=a.b:=fatal",
    )
    assert arguments.log_level == 30
    assert arguments.logger_levels == {"rcl": 40, "a.b": 50}
    for bad, message in (
        ("loud", "'loud' is not a level; known are unset, debug, info, warn, error, fatal"),
        ("x:=loud", "'loud' is not a level"),
        (":=debug", "no logger's name"),
    ):
        with pytest.raises(RosArgumentError, match=message):
            parse("--log-level", bad)


def test_log_output_is_switched_by_arguments() -> None:
    assert (parse().rosout, parse().stdout) == (True, True)
    arguments = parse("--disable-rosout-logs", "--disable-stdout-logs")
    assert (arguments.rosout, arguments.stdout) == (False, False)
    assert parse("--disable-rosout-logs", "--enable-rosout-logs").rosout
    assert parse("--disable-external-lib-logs") == Arguments()


def test_enclave_is_taken_with_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    assert parse("-e", "/a/b") == parse("--enclave=/a/b") == Arguments()
    assert "--enclave /a/b has no effect: this node's traffic is not secured" in caplog.text
    with pytest.raises(RosArgumentError, match="--enclave 'a': namespace 'a' is not absolute"):
        parse("--enclave", "a")


def test_options_for_other_loggers_are_taken_with_a_warning(
    caplog: pytest.LogCaptureFixture,
) -> None:
    assert parse("--log-config-file", "x.conf", "--log-file-name", "y") == Arguments()
    assert "--log-config-file x.conf has no effect" in caplog.text


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (["--remap"], "argument 2: nothing follows --remap; write e.g. -r chatter:=talk"),
        (["-p", "--"], "argument 2: nothing follows -p"),
        (["--params-file"], "--params-file robot.yaml"),
        (["--log-level"], "--log-level debug"),
        (["-e"], "--enclave /robot"),
        (["--wrong"], "argument 2: unknown option '--wrong'; known are"),
        (["a:=b"], "unknown option 'a:=b'"),
    ],
)
def test_bad_lines_are_reported(line: list[str], message: str) -> None:
    with pytest.raises(RosArgumentError, match=message):
        parse(*line)


@pytest.mark.parametrize("arguments", ["--ros-args", [1], b"x", 7, iter(["--ros-args"])])
def test_arguments_of_another_type_are_refused(arguments: Any) -> None:
    with pytest.raises(RosArgumentError, match="must be a list of texts"):
        Arguments.parse(arguments)
