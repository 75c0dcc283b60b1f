"""Values of ROS 1 parameters."""

from __future__ import annotations

import math
import xmlrpc.client
from datetime import date, datetime, timezone
from enum import IntEnum

import numpy as np
import pytest

from rosglass.errors import ParameterError
from rosglass.ros1.parameter_server import (
    flatten,
    from_wire,
    is_same_value,
    to_wire,
    without_empty_namespaces,
)


class Gear(IntEnum):
    FIRST = 1


@pytest.mark.parametrize(
    "value",
    [
        True,
        0,
        -(2**31),
        2**31 - 1,
        1.5,
        -math.inf,
        1e-300,
        "",
        "Grüße <&> \n\t 'x' 😀",
        b"\0\xff",
        datetime(2026, 2, 3, 4, 5, 6),
        [1, 2.5, "x", [True, {"a": b"b"}]],
        {"a": {"b": [1]}, "c d": "-"},
    ],
)
def test_values_survive_the_way_over_xml(value):
    sent = to_wire("/a", value)
    (received,), _ = xmlrpc.client.loads(xmlrpc.client.dumps((sent,)))
    assert is_same_value(from_wire(received), value)


@pytest.mark.parametrize(
    ("value", "plain"),
    [
        (np.float32(1.5), 1.5),
        (np.int64(3), 3),
        (np.bool_(True), True),
        (np.array([[1, 2], [3, 4]]), [[1, 2], [3, 4]]),
        ((1, 2), [1, 2]),
        (bytearray(b"a"), b"a"),
        (memoryview(b"a"), b"a"),
        (Gear.FIRST, 1),
        ({"x": np.float64(2)}, {"x": 2.0}),
    ],
)
def test_values_of_other_libraries_become_plain(value, plain):
    assert is_same_value(from_wire(to_wire("/a", value)), plain)


RECURSIVE: list = []
RECURSIVE.append(RECURSIVE)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (2**31, r"/a: 2147483648 is beyond the 32 bits.*set it as a float \(2147483648.0\)"),
        (-(2**31) - 1, "/a: -2147483649 is beyond the 32 bits"),
        (10**400, "/a: an integer has 32 bits"),
        ([1, 2**40], r"/a\[1\]: 1099511627776 is beyond"),
        ({"b": {"c": 2**40}}, "/a/b/c: 1099511627776 is beyond"),
        ("a\0b", r"/a: at position 1 there is '\\x00', which XML cannot carry; set bytes"),
        ("\ud800", "at position 0 .* XML cannot carry"),
        ("a\r\nb", "position 1 there is a carriage return, .* replace"),
        ({"b/c": 1}, r"'b/c' has a '/'; write {'a': {'b': 1}}"),
        ({"": 1}, "there is an empty one"),
        ({1: 2}, "keys of a dict are names of parameters, got 1; write '1'"),
        ({"\0": 1}, "XML cannot carry"),
        (None, "got None; to unset it, delete it"),
        (1j, "got 1j"),
        ({1, 2}, "got {1, 2}"),
        (date(2026, 1, 2), "got datetime.date"),
        (datetime(2026, 1, 2, microsecond=5), "whole seconds and no time zone"),
        (datetime(2026, 1, 2, tzinfo=timezone.utc), "whole seconds and no time zone"),
        (RECURSIVE, "nested more than 50 levels"),
    ],
)
def test_unsupported_value_is_refused_with_the_fix(value, message):
    with pytest.raises(ParameterError, match=message):
        to_wire("/a", value)


def test_invalid_dates_stay_strings():
    assert from_wire(xmlrpc.client.DateTime("yesterday")) == "yesterday"


def test_namespaces_are_flattened_and_empty_ones_left_out():
    tree = {"a": {"b": 1, "c": {}}, "d": [{}], "e": {"f": {"g": {}}}}
    assert dict(flatten(tree)) == {"a/b": 1, "d": [{}]}
    assert without_empty_namespaces(tree) == {"a": {"b": 1}, "d": [{}]}


@pytest.mark.parametrize(
    ("one", "other", "equal"),
    [
        (1, 1.0, False),
        (1, True, False),
        ([1], [1.0], False),
        ({"a": 1}, {"a": True}, False),
        (math.nan, math.nan, True),
        ({"a": [1, "b"]}, {"a": [1, "b"]}, True),
        ([1], [1, 2], False),
    ],
)
def test_change_of_type_is_a_change(one, other, equal):
    assert is_same_value(one, other) is equal
