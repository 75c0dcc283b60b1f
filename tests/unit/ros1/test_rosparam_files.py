"""Parameter files as rosparam has them."""

from __future__ import annotations

import math

import pytest

from rosglass.errors import ParameterError
from rosglass.ros1.rosparam_files import dump, parse, parse_value, read, write


def test_documents_have_namespaces_and_angles():
    text = """
a: 1
b: {c: deg(180), d: !degrees 90, e: rad(2*pi), f: !radians -pi/2, g: rad(1e-3)}
base: &base {x: 1, y: 2}
more: {<<: *base, y: 3}
data: !!binary aGVsbG8=
---
---
_ns: arm
list: [1, 2.5, yes, null]
"""
    first, second = parse(text)
    assert first == (
        "",
        {
            "a": 1,
            "b": {"c": math.pi, "d": math.pi / 2, "e": 2 * math.pi, "f": -math.pi / 2, "g": 1e-3},
            "base": {"x": 1, "y": 2},
            "more": {"x": 1, "y": 3},
            "data": b"hello",
        },
    )
    assert second == ("arm", {"list": [1, 2.5, True, None]})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\na: 2", "f.yaml:2:1: .*'a' occurs twice"),
        ("a: [", "f.yaml:1:"),
        ("a: *x", "undefined alias"),
        ("a: deg(x)", "f.yaml:1:4: .*'x' is not a number of degrees"),
        ("a: !radians __import__('os')", "is not a number of radians"),
        ("a: rad(9**9)", "is not a number of radians"),
        ("a: rad(1/0)", "is not a number of radians"),
        ("a: rad()", "is not a number of radians"),
        ("a: &x [*x]", "recursive"),
        ("a: !!python/object/apply:os.system [ls]", "could not determine a constructor"),
        ("_ns: 5\na: 1", "_ns must be a name, got 5"),
        ("[" * 5000, "f.yaml"),
    ],
)
def test_malformed_file_is_rejected_with_the_position(text, message):
    with pytest.raises(ParameterError, match=message):
        parse(text, "f.yaml")


def test_dumped_file_can_be_read(tmp_path):
    tree = {"a": {"b": [1, 2.5, "x"], "c": b"\0\1"}, "s": "yes", "f": math.inf, "u": "ü"}
    path = tmp_path / "robot.yaml"
    write(path, tree)
    assert read(path) == [("", tree)]
    assert dump(1.5) == "1.5\n"
    assert dump({"b": 1, "a": [1]}) == "a:\n- 1\nb: 1\n"


@pytest.mark.parametrize("missing", ["nowhere/robot.yaml", "nowhere"])
def test_files_that_cannot_be_opened_are_reported(tmp_path, missing):
    with pytest.raises(ParameterError, match="nowhere"):
        read(tmp_path / missing)
    with pytest.raises(ParameterError, match="nowhere"):
        write(tmp_path / "nowhere" / "robot.yaml", {})


@pytest.mark.parametrize("path", [None, 3, b"x", "", "a\0b", "\ud800", [], object()])
def test_invalid_path_is_rejected(path):
    for ask in (read, lambda path: write(path, {})):
        with pytest.raises(ParameterError, match="path"):
            ask(path)


def test_values_on_command_lines_are_yaml():
    assert parse_value("1.5", "_speed") == 1.5
    assert parse_value("{a: [1]}", "_speed") == {"a": [1]}
    assert parse_value("", "_speed") is None
    with pytest.raises(ParameterError, match="_speed: this is more than one value"):
        parse_value("a\n---\nb", "_speed")
