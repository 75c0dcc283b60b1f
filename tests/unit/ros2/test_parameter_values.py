"""Parameter values and their messages."""

from __future__ import annotations

import enum
from typing import Any

import numpy as np
import pytest

from rosglass import Time, load
from rosglass.comm import ParameterDescriptor, ParameterType, Range
from rosglass.errors import ParameterError
from rosglass.ros2.parameters import (
    TypedValue,
    check_name,
    descriptor_from_message,
    descriptor_to_message,
    event_from_message,
    event_to_message,
    in_range,
    typed,
    value_from_message,
    value_to_message,
)

T = ParameterType


class Level(enum.IntEnum):
    HIGH = 3


@pytest.mark.parametrize(
    ("value", "kind", "plain"),
    [
        (None, T.NOT_SET, None),
        (True, T.BOOL, True),
        (0, T.INTEGER, 0),
        (-(2**63), T.INTEGER, -(2**63)),
        (2**63 - 1, T.INTEGER, 2**63 - 1),
        (1.0, T.DOUBLE, 1.0),
        (float("inf"), T.DOUBLE, float("inf")),
        ("", T.STRING, ""),
        ("grüß", T.STRING, "grüß"),
        (b"\x00\xff", T.BYTE_ARRAY, b"\x00\xff"),
        (bytearray(b"x"), T.BYTE_ARRAY, b"x"),
        (memoryview(b"x"), T.BYTE_ARRAY, b"x"),
        ([True, False], T.BOOL_ARRAY, [True, False]),
        ((1, 2), T.INTEGER_ARRAY, [1, 2]),
        ([1.0, 2.5], T.DOUBLE_ARRAY, [1.0, 2.5]),
        (["a", ""], T.STRING_ARRAY, ["a", ""]),
        (np.float32(1.5), T.DOUBLE, 1.5),
        (np.int16(7), T.INTEGER, 7),
        (np.bool_(True), T.BOOL, True),
        (np.array([1.0, 2.0]), T.DOUBLE_ARRAY, [1.0, 2.0]),
        ([np.int64(1), 2], T.INTEGER_ARRAY, [1, 2]),
        (Level.HIGH, T.INTEGER, 3),
    ],
)
def test_values_have_a_type(value: Any, kind: ParameterType, plain: Any) -> None:
    found = typed("p", value)
    assert found == TypedValue(kind, plain)
    assert type(found.value) is type(plain)


@pytest.mark.parametrize("kind", [T.BYTE_ARRAY, T.BOOL_ARRAY, T.INTEGER_ARRAY, T.STRING_ARRAY])
def test_empty_list_keeps_the_type_that_is_known(kind: ParameterType) -> None:
    assert typed("p", [], kind) == TypedValue(kind, b"" if kind is T.BYTE_ARRAY else [])


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (2**63, "beyond the 64 bits of an integer"),
        (-(2**63) - 1, "beyond the 64 bits of an integer"),
        (
            [1, 2.0],
            r"\[0\] is of type integer and \[1\] of type double; write whole numbers as 1.0",
        ),
        ([1, True], r"\[0\] is of type integer and \[1\] of type boolean"),
        (["a", 1], r"\[0\] is of type string and \[1\] of type integer"),
        ([1, 2**64], r"'p'\[1\]: .* beyond the 64 bits"),
        ([], "an empty list does not say its type; give it in the descriptor"),
        ([b"a"], "a byte array is one bytes object"),
        ([[1]], r"'p'\[0\]: a parameter is a bool, int, float, str, bytes or a list"),
        ({"a": 1}, "a parameter is a bool, int, float, str, bytes or a list"),
        (1j, "a parameter is a bool"),
        ("a\0b", "has a NUL character at position 1"),
        ("a\ud800", "cannot be written as UTF-8"),
    ],
)
def test_invalid_value_is_refused(value: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        typed("p", value)


def test_scalar_cannot_become_an_empty_list() -> None:
    with pytest.raises(ParameterError, match="is of type string, and cannot become a list"):
        typed("p", [], T.STRING)


@pytest.mark.parametrize("name", ["", 3, None, "a\0"])
def test_bad_names_are_refused(name: Any) -> None:
    with pytest.raises(ParameterError, match="name"):
        check_name(name)


@pytest.mark.parametrize(
    "value",
    [
        TypedValue(T.NOT_SET, None),
        TypedValue(T.BOOL, True),
        TypedValue(T.INTEGER, -5),
        TypedValue(T.DOUBLE, 0.1),
        TypedValue(T.STRING, "ä"),
        TypedValue(T.BYTE_ARRAY, b"\x00\x01\xff"),
        TypedValue(T.BOOL_ARRAY, [True, False]),
        TypedValue(T.INTEGER_ARRAY, [2**62, -1]),
        TypedValue(T.DOUBLE_ARRAY, [0.5, 1e300]),
        TypedValue(T.STRING_ARRAY, ["a", ""]),
        TypedValue(T.DOUBLE_ARRAY, []),
        TypedValue(T.BYTE_ARRAY, b""),
    ],
)
def test_values_survive_the_wire(value: TypedValue) -> None:
    kind = load("rcl_interfaces/msg/ParameterValue", ros=2)
    back = value_from_message(kind.decode(kind.encode(value_to_message(value), wire="cdr")))
    assert back == value
    assert type(back.value) is type(value.value)
    if isinstance(back.value, list):
        assert [type(item) for item in back.value] == [type(i) for i in value.value]  # type: ignore[union-attr]


def test_unknown_type_is_reported() -> None:
    message = load("rcl_interfaces/msg/ParameterValue", ros=2).create({"type": 42})
    with pytest.raises(ParameterError, match="parameter 'x' of /a has the type 42"):
        value_from_message(message, "parameter 'x' of /a")


@pytest.mark.parametrize(
    "descriptor",
    [
        ParameterDescriptor("a", T.STRING, "what", "rules", True, True),
        ParameterDescriptor("b", T.INTEGER, range=Range(-5, 2**62, 3)),
        ParameterDescriptor("c", T.DOUBLE, range=Range(0.5, 1.5, 0.25)),
    ],
)
def test_descriptors_survive_the_wire(descriptor: ParameterDescriptor) -> None:
    kind = load("rcl_interfaces/msg/ParameterDescriptor", ros=2)
    data = kind.encode(descriptor_to_message(descriptor), wire="cdr")
    assert descriptor_from_message(kind.decode(data)) == descriptor


def test_events_survive_the_wire() -> None:
    kind = load("rcl_interfaces/msg/ParameterEvent", ros=2)
    fields = event_to_message(
        "/n", Time(5), {"a": TypedValue(T.BOOL, True)}, {"b": TypedValue(T.INTEGER, 1)}, ["c"]
    )
    event = event_from_message(kind.decode(kind.encode(fields, wire="cdr")))
    assert (event.node, event.new, event.changed) == ("/n", {"a": True}, {"b": 1})
    assert event.deleted == ("c",)


@pytest.mark.parametrize(
    ("allowed", "value", "problem"),
    [
        (Range(0, 10, 0), 5, ""),
        (Range(0, 10, 3), 9, ""),
        (Range(0, 10, 3), 10, ""),  # the end is allowed though no step leads there
        (Range(0, 10, 3), 8, "8 is not among 0, 3 ... 10 (step 3)"),
        (Range(0, 10, 0), 11, "11 is outside 0 to 10"),
        (Range(0.0, 1.0, 0.1), 0.30000000000000004, ""),
        (Range(0.0, 1.0, 0.1), 0.35, "0.35 is not among 0.0, 0.1 ... 1.0 (step 0.1)"),
        (Range(0.0, 1.0, 0.0), -0.0, ""),
        (Range(0.0, 1.0, 0.0), 1.0000001, "1.0000001 is outside 0.0 to 1.0"),
        (Range(0.0, float("inf"), 0.0), -5.0, "-5.0 is outside 0.0 to inf"),
        (Range(0.0, float("inf"), 0.0), 1e300, ""),
        (Range(0.0, 1.0, 0.0), float("nan"), "nan is outside 0.0 to 1.0"),
    ],
)
def test_ranges(allowed: Range, value: float, problem: str) -> None:
    assert in_range(allowed, value) == problem
