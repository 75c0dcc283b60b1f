"""Definitions with errors: the message says what, and exactly where."""

from __future__ import annotations

import pytest

from rosglass.errors import DefinitionError, InvalidNameError
from rosglass.interfaces import parse, parse_action, parse_message, parse_service


def failure(text: str, ros: int = 2, name: str = "my_msgs/Odd") -> DefinitionError:
    with pytest.raises(DefinitionError) as caught:
        parse_message(text, name, ros=ros, file="odd.msg")
    return caught.value


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        ("int32", 1, 1, "expected a type and a name, got only 'int32'"),
        ("\n  int32 # x", 2, 3, "expected a type and a name"),
        ("int32 X", 1, 7, "field name 'X' must start with a lower-case letter"),
        ("int32 x__y", 1, 7, "single underscores"),
        ("int32 x_", 1, 7, "single underscores"),
        ("int32 1x", 1, 7, "field name '1x'"),
        ("int32 x-y", 1, 7, "field name 'x-y'"),
        ("int32 é", 1, 7, "field name 'é'"),
        ("int32 x\nint32 y\n int32 x", 3, 8, "'x' is already defined in line 1"),
        ("int8 A=1\nint8 A=1", 2, 6, "'A' is already defined in line 1"),
        ("int8 a=1", 1, 6, "a default value is written without '='"),
        ("int8 _A=1", 1, 6, "constant name '_A'"),
        ("int8 A__B=1", 1, 6, "constant name"),
        ("int8 A=", 1, 8, "the constant A has no value"),
        ("int8 A= # 1", 1, 9, "the constant A has no value"),
        ("int8 A=128", 1, 8, "128 is out of range; int8 takes -128 to 127"),
        ("int8  A  =  -129", 1, 13, "-129 is out of range"),
        ("uint8 A=-1", 1, 9, "out of range"),
        ("uint64 A=18446744073709551616", 1, 10, "out of range"),
        ("byte A=256", 1, 8, "byte takes 0 to 255"),
        ("int8 A=1.5", 1, 8, "'1.5' is not a whole number"),
        ("int8 A=1_", 1, 8, "not a whole number"),
        ("bool A=maybe", 1, 8, "'maybe' is not a bool"),
        ("bool A=2", 1, 8, "'2' is not a bool"),
        ("float32 A=1e39", 1, 11, "1e39 is out of range of float32"),
        ("float64 A=1e400", 1, 11, "out of range of float64"),
        ("float64 A=1,5", 1, 11, "'1,5' is not a number"),
        ("string A='it's'", 1, 10, "must be written \\'"),
        ("string A='\\ud800'", 1, 10, "not a Unicode character"),
        ("Point A=1", 1, 1, "a constant has a primitive type"),
        ("int32[] A=1", 1, 1, "a constant has a primitive type"),
        ("int32 =1", 1, 1, "expected a type and a name"),
        ("=1", 1, 1, "expected a type and a name"),
        ("int x", 1, 1, "'int' is not a ROS type; did you mean int32?"),
        ("double x", 1, 1, "did you mean float64?"),
        ("time x", 1, 1, "ROS 2 has builtin_interfaces/Time"),
        ("duration[] x", 1, 1, "builtin_interfaces/Duration"),
        ("point x", 1, 1, "type name 'point' must start with an upper-case letter"),
        ("Geometry_msgs/Point x", 1, 1, "package name 'Geometry_msgs'"),
        ("a/b/c/D x", 1, 1, "a message type is written package/Type"),
        ("a/foo/D x", 1, 1, "a message type is written package/Type"),
        ("a//D x", 1, 1, "a message type is written package/Type"),
        ("int8[][] x", 1, 1, "there are no arrays of arrays"),
        ("int8[ x", 1, 1, "'int8[' is not a type"),
        ("int8[0] x", 1, 6, "whole number from 1 to 4294967295, got '0'"),
        ("int8[-1] x", 1, 6, "got '-1'"),
        ("int8[99999999999] x", 1, 6, "got '99999999999'"),
        ("int8[<=4294967296] x", 1, 8, "got '4294967296'"),
        ("int8[<=] x", 1, 8, "got ''"),
        ("int8[N] x", 1, 6, "got 'N'"),
        ("string<=0 x", 1, 9, "bound of a string"),
        ("string<=x x", 1, 9, "bound of a string"),
        ("int8<=3 x", 1, 5, "only strings take a bound"),
        ("string<= 10 x", 1, 9, "bound of a string"),
        ("int8 x 200", 1, 8, "default value of x: 200 is out of range"),
        ("int8[2] x [1]", 1, 11, "expected exactly 2 elements, got 1"),
        ("int8[<=2] x [1,2,3]", 1, 13, "expected at most 2 elements, got 3"),
        ("int8[] x 1", 1, 10, "is written [a, b, c]"),
        ("int8[] x [1,]", 1, 10, "element 1: '' is not a whole number"),
        ("int8[] x [1,1000]", 1, 10, "element 1: 1000 is out of range"),
        ("string[] x ['a' 'b']", 1, 12, "expected a comma before \"'b'\""),
        ("string[] x ['a, b]", 1, 12, "no closing quote"),
        ("string[] x [a,,b]", 1, 12, "an element is missing"),
        ("string<=2 x abc", 1, 13, "the string has 3 characters, its bound is 2"),
        ("Point x 1", 1, 9, "can't have a default value"),
        ("@optional int32 x", 1, 1, "@optional is not supported"),
        ("int32 x\n---\nint32 y", 2, 1, "a message has only one"),
        ("int32 x\n===\nfloat64 y", 3, 1, "expected 'MSG: package/Type'"),
        ("int32 x\n===", 3, 1, "expected 'MSG: package/Type'"),
        ("int32 x\n===\nMSG: a/b/C/d\n", 3, 6, "is not a type name"),
        ("int32 x\n===\nMSG: a/B\nint32 y\nint32 Z", 5, 7, "field name 'Z'"),
        ("===\nMSG: a/B\nint8 x\n===\nMSG: a/B\nint8 y", 5, 1, "a/msg/B is defined twice"),
    ],
)  # fmt: skip
def test_errors_of_ros2(text: str, line: int, column: int, words: str) -> None:
    error = failure(text)
    assert str(error).startswith(f"odd.msg:{line}:{column}: ")
    assert words in str(error)
    assert (error.file, error.line, error.column) == ("odd.msg", line, column)


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        ("int32 x 5", 1, 9, "default values exist in ROS 2 only"),
        ("string<=5 x", 1, 7, "bounds ('<=') exist in ROS 2 only"),
        ("int8[<=5] x", 1, 6, "bounds ('<=') exist in ROS 2 only"),
        ("wstring x", 1, 1, "'wstring' exists in ROS 2 only"),
        ("time A=1", 1, 1, "a constant has a primitive type"),
        ("byte A=200", 1, 8, "byte takes -128 to 127"),
        ("char A=-1", 1, 8, "char takes 0 to 255"),
        ("int32 x-y", 1, 7, "field name 'x-y'"),
        ("int8 A=1\nint32 A", 2, 7, "'A' is already defined in line 1"),
        ("bool A=yes", 1, 8, "not a bool"),
    ],
)
def test_errors_of_ros1(text: str, line: int, column: int, words: str) -> None:
    error = failure(text, ros=1)
    assert (error.line, error.column) == (line, column)
    assert words in str(error)


@pytest.mark.parametrize(
    ("name", "ros", "words"),
    [
        ("My_msgs/Odd", 2, "package name 'My_msgs'"),
        ("my_msgs/odd", 2, "type name 'odd'"),
        ("my_msgs/My_Odd", 2, "type name 'My_Odd'"),
    ],
)
def test_names_of_definitions(name: str, ros: int, words: str) -> None:
    assert words in str(failure("int32 x", ros, name))


@pytest.mark.parametrize("name", ["Odd", "a/b/C", "a/msg/B/c", "", "a/", "/B", "a b/C", "a/../B"])
def test_invalid_names_are_rejected(name: str) -> None:
    with pytest.raises(InvalidNameError, match="is not a type name"):
        parse("int32 x", name)


def test_arguments_are_checked() -> None:
    with pytest.raises(DefinitionError, match="must be a str, got bytes"):
        parse_message(b"int32 x", "a/B")  # type: ignore[arg-type]
    with pytest.raises(DefinitionError, match="ros must be 1 or 2, got 3"):
        parse_message("int32 x", "a/B", ros=3)
    with pytest.raises(InvalidNameError, match="names a msg, but a srv is to be parsed"):
        parse_service("---", "a/msg/B")


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("int32 x", 0, "one line '---' between request and response, found 0"),
        ("---\n---\nint32 x", 2, "found 2"),
        ("--- # here\n", 1, "a line that separates is just '---'"),
        ("int32 x\n---\nint32 X", 3, "field name 'X'"),
    ],
)
def test_errors_of_services(text: str, line: int, words: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_service(text, "my_msgs/Odd", file="odd.srv")
    assert (caught.value.file, caught.value.line) == ("odd.srv", line)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("---", 0, "two lines '---', between goal, result and feedback, found 1"),
        ("---\n---\n---\n", 3, "found 3"),
        ("---\n---\nint32", 3, "expected a type and a name"),
    ],
)
def test_errors_of_actions(text: str, line: int, words: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_action(text, "my_msgs/Odd", file="odd.action")
    assert caught.value.line == line
    assert words in str(caught.value)
