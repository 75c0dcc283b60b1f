"""Parameter files, as ``ros2 param dump``, ``ros2 param load`` and ``--params-file`` have them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest
import yaml

from rosglass.errors import ParameterError
from rosglass.ros2.parameter_files import dump, matches, parse, parse_value, read, write

if TYPE_CHECKING:
    from pathlib import Path

#: The example of ``ros2 param dump`` in ros2cli's documentation, type for type.
DUMPED = """\
/foo/test_node:
  ros__parameters:
    bool_array_param:
    - false
    - false
    - true
    bool_param: true
    double_array_param:
    - 3.125
    - 6.25
    - 12.5
    double_param: 1.23
    foo:
      bar:
        str_param: foobar
      str_param: foo
    int_array_param:
    - 1
    - 2
    - 3
    int_param: 42
    str_array_param:
    - foo
    - bar
    - baz
    str_param: Hello World
    use_sim_time: false
"""
VALUES: dict[str, Any] = {
    "bool_array_param": [False, False, True],
    "bool_param": True,
    "double_array_param": [3.125, 6.25, 12.5],
    "double_param": 1.23,
    "foo.bar.str_param": "foobar",
    "foo.str_param": "foo",
    "int_array_param": [1, 2, 3],
    "int_param": 42,
    "str_array_param": ["foo", "bar", "baz"],
    "str_param": "Hello World",
    "use_sim_time": False,
}


def test_dump_of_ros2_param_is_read() -> None:
    assert parse(DUMPED).for_node("/foo/test_node") == VALUES


def test_dumping_writes_what_ros2_param_writes() -> None:
    assert dump({"/foo/test_node": VALUES}) == DUMPED


def test_migration_guides_example() -> None:
    file = parse(
        "/lidar_ns:\n  lidar_node_name:\n    ros__parameters:\n      lidar_name: foo\n"
        "      id: 10\nimu:\n  ros__parameters:\n    ports: [2438, 2439, 2440]\n"
        "/**:\n  ros__parameters:\n    debug: true\n"
    )
    assert file.for_node("/lidar_ns/lidar_node_name") == {
        "lidar_name": "foo",
        "id": 10,
        "debug": True,
    }
    assert file.for_node("/imu") == {"ports": [2438, 2439, 2440], "debug": True}
    assert file.for_node("/lidar_ns/imu") == {"debug": True}


def test_design_articles_example_of_precedence() -> None:
    file = parse(
        "my_node:\n    ros__parameters:\n        my_int: 1\n        my_int: 2\n"
        "        another_int: 1\n        my_float: 1.0\n        another_float: 1.0\n"
        "my_node:\n    ros__parameters:\n        another_int: 2\n"
        "/**:\n    ros__parameters:\n        my_int: 3\n        global_int: 1\n"
    )
    assert file.for_node("/my_node") == {
        "my_int": 2,
        "another_int": 2,
        "global_int": 1,
        "my_float": 1.0,
        "another_float": 1.0,
    }


@pytest.mark.parametrize(
    ("pattern", "node", "meant"),
    [
        ("/a/b", "/a/b", True),
        ("/a/b", "/a/bc", False),
        ("/**", "/a", True),
        ("/**", "/a/b/c", True),
        ("/*", "/a", True),
        ("/*", "/a/b", False),
        ("/**/b", "/b", True),
        ("/**/b", "/x/y/b", True),
        ("/**/b", "/x/cb", False),
        ("/*/b", "/x/b", True),
        ("/*/b", "/b", False),
        ("/a/**", "/a", True),
        ("/a/**", "/a/b/c", True),
        ("/a/*/c", "/a/b/c", True),
    ],
)
def test_wildcards(pattern: str, node: str, meant: bool) -> None:
    assert matches(pattern, node) is meant


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("1.0", 1.0),
        ("-0x1F", -31),
        ("010", 8),
        ("08", 8.0),
        ("1e3", 1000.0),
        (".5", 0.5),
        ("0x1p3", 8.0),
        (".inf", math.inf),
        ("-.INF", -math.inf),
        ("infinity", math.inf),
        ("true", True),
        ("Yes", True),
        ("off", False),
        ("tRuE", "tRuE"),
        ("'true'", "true"),
        ('"5"', "5"),
        ("!!str 5", "5"),
        ("1_000", "1_000"),
        ("12:30", "12:30"),
        ("2001-01-01", "2001-01-01"),
        ("''", ""),
        ("a b", "a b"),
        ("null", None),
        ("~", None),
        ("[]", []),
        ("[1, 2]", [1, 2]),
        ("[1.0, 2.5]", [1.0, 2.5]),
        ("[yes, no]", [True, False]),
        ("[a, '1']", ["a", "1"]),
        ("!!binary AQID", b"\x01\x02\x03"),
        ("[!!binary AQ==, !!binary Ag==]", b"\x01\x02"),
        ("9223372036854775807", 2**63 - 1),
    ],
)
def test_scalars_and_lists_are_what_nodes_take_them_for(text: str, value: Any) -> None:
    found = parse_value(text, "p")
    assert found == value
    assert type(found) is type(value)


def test_nan_is_read() -> None:
    assert math.isnan(parse_value(".nan", "p"))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "value",
    [
        *("yes", "1e5", "nan", "0x10", "", " a ", "a: b", "x\ny\n", "é", "1:30", "null", "inf"),
        *(1.0, 1, 1e-5, 1e22, -0.0, 2**63 - 1, True, b"\x00\xff", None),
        *([1.0, 2.0], ["1", "true"], [True], ["é\n", ""]),
    ],
)
def test_every_value_comes_back_as_it_was(value: Any) -> None:
    text = dump({"/n": {"p": value}})
    back = parse(text).for_node("/n")["p"]
    assert back == value
    assert type(back) is type(value)
    assert yaml.safe_load(text)["/n"]["ros__parameters"]["p"] == (
        [bytes([b]) for b in value] if isinstance(value, bytes) else value
    )


@pytest.mark.parametrize(
    "values",
    [
        {"a": 1, "a.b": 2, "a.c.d": 3},
        {"a.b": 2, "a": 1},
        {"a..b": 1, ".c": 2, "d.": 3, "d": 4},
        {"1.2": "x", "yes": "y"},
        {},
    ],
)
def test_every_name_comes_back_as_it_was(values: dict[str, Any]) -> None:
    file = parse(dump({"/n": values, "/m": {"z": 1}}))
    assert file.for_node("/n") == values
    assert file.for_node("/m") == {"z": 1}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: {b: {", r"f\.yaml:1:9: this is not YAML"),
        ("\tx: 1", r"f\.yaml:1:1: this is not YAML"),
        ("just text", r"f\.yaml:1:1: expected node names with 'ros__parameters'"),
        ("- a", r"f\.yaml:1:1: expected node names"),
        ("ros__parameters: {a: 1}", r"f\.yaml:1:1: 'ros__parameters' needs the name of a node"),
        ("n: {ros__parameters: 3}", r"1:22: expected names of parameters below"),
        (
            "n:\n  ros_parameters: 3",
            r"2:3: 'ros_parameters' has a value.*spelled 'ros__parameters'",
        ),
        ("n:\n  speed: 3", r"f\.yaml:2:3: 'speed' has a value, but stands above"),
        ("n:\n  ros__parameters:\n    a:", r"f\.yaml:3:7: there is no value; an empty text is"),
        (
            "n: {ros__parameters: {a: [1, 2.0]}}",
            r"1:30: .*one type: an integer before, a float here",
        ),
        ("n: {ros__parameters: {a: [x, true]}}", r"a text before, a boolean here"),
        ("n: {ros__parameters: {a: [[1]]}}", r"1:27: a list in a list"),
        ("n: {ros__parameters: {a: [~]}}", r"a list cannot hold null"),
        ("n: {ros__parameters: {? [a] : 1}}", r"a key must be a name"),
        ("n: {ros__parameters: {'': 1}}", r"a key is empty"),
        ("n: &x {ros__parameters: {a: 1}}\nm: *x", r"2:4: aliases \(\*x\) are not part of"),
        ("n: {ros__parameters: {a: !!float 1}}", r"take no notice of the tag"),
        ("n: {ros__parameters: {a: !!binary '*'}}", r"not base64"),
        ("n: {ros__parameters: {a: 9223372036854775808}}", r"1:26: .*beyond the 64 bits"),
        ("n: {ros__parameters: {a: 1e999}}", r"beyond the range of a double"),
        ("n: {ros__parameters: {a: 1e-999}}", r"beyond the range of a double"),
        (f"n: {{ros__parameters: {{a: {'9' * 5000}}}}}", r"beyond the 64 bits"),
        ("n-x: {ros__parameters: {a: 1}}", r"1:7: '/n-x' is not the name of a node"),
        ("/a*: {ros__parameters: {a: 1}}", r"a wildcard stands for whole parts"),
        ("n: {ros__parameters: " + "{a: " * 100 + "1" + "}" * 102, r"too deeply nested"),
        ("{a: " * 100 + "1" + "}" * 100, r"too deeply nested"),
    ],
)
def test_errors_have_file_line_and_column(text: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        parse(text, "f.yaml")


@pytest.mark.parametrize(
    "value",
    [
        # rclpy starts with the first three, and reads names and values that are not meant.
        "[{name: a, ranges: [1, 2]}, {name: b, ranges: [3]}]",
        "[{m: {ranges: [1, 2]}, k: v}, [{x: [[1]]}]]",
        "[1, {a: [2]}]",
        "[{}]",
    ],
)
def test_list_of_mappings_costs_its_parameter_only(
    value: str, caplog: pytest.LogCaptureFixture
) -> None:
    text = f"n:\n  ros__parameters:\n    a: 1\n    b: {{c: {value}, d: 2}}\n"
    text += "m: {ros__parameters: {e: 3}}"
    found = parse(text, "f.yaml")
    assert found.for_node("/n") == {"a": 1, "b.d": 2}
    assert found.for_node("/m") == {"e": 3}
    (record,) = caplog.records
    assert "a mapping in a list is not a parameter value; the parameter 'b.c' is left out" in (
        record.getMessage()
    )
    assert record.getMessage().startswith("f.yaml:4:")
    with pytest.raises(ParameterError, match="a mapping in a list is not a parameter value"):
        parse_value(value, "p")


def test_list_of_mappings_is_skipped_within_yaml_rules() -> None:
    for rest in ("*x", "[", "{a: ", "\t"):
        with pytest.raises(ParameterError, match=r"f\.yaml:1:"):
            parse(f"n: {{ros__parameters: {{a: [&x {{}}, {rest}", "f.yaml")


def test_value_that_is_a_mapping_is_refused() -> None:
    with pytest.raises(ParameterError, match="p:1:1: a parameter's value is a scalar or a list"):
        parse_value("{a: 1}", "p")


def test_files_are_written_in_one_go(tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    write(file, {"/n": {"a": 1}})
    assert read(file).for_node("/n") == {"a": 1}
    assert [path.name for path in tmp_path.iterdir()] == ["p.yaml"]
    write(file, {"/n": {"a": 2}})
    assert read(str(file)).for_node("/n") == {"a": 2}


def test_files_that_cannot_be_used_are_reported(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"none\.yaml cannot be read: No such file"):
        read(tmp_path / "none.yaml")
    with pytest.raises(ParameterError, match="cannot be written"):
        write(tmp_path / "none" / "p.yaml", {})
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"a: \xff")
    with pytest.raises(ParameterError, match=r"binary\.yaml is not UTF-8 text \(byte 3\)"):
        read(binary)
    with binary.open("wb") as file:
        file.truncate(17 * 1024 * 1024)
    with pytest.raises(ParameterError, match="too many for a parameter file"):
        read(binary)


def test_empty_file_has_no_parameters() -> None:
    assert parse("").for_node("/n") == {}
    assert parse("# only a comment\n").entries == ()
