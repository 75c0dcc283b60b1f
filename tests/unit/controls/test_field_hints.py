"""Hints for entering the fields of a message."""

from __future__ import annotations

import math
from typing import Any

import pytest

import rosglass
from rosglass.controls.lists.field_hints import choices_of, range_of


@pytest.mark.parametrize(
    ("comment", "expected"),
    [
        ("Charge percentage on 0 to 1 range  (If unmeasured NaN)", None),
        ("Speed [0, 1]", (0, 1)),
        ("Angle [-pi, pi) [rad]", (-math.pi, math.pi)),
        ("angle in [-pi/2, 2*pi]", (-math.pi / 2, 2 * math.pi)),
        ("in range 0 to 100", (0, 100)),
        ("between -1.5 and 1.5", (-1.5, 1.5)),
        ("probabilities are in the range [0,100]", (0, 100)),
        ("(0..255)", (0, 255)),
        ("[1, 0]", None),
        ("[m]", None),
        ("see issue 5 - 7 and [a, b]", None),
        ("[" * 5000, None),
        ("", None),
    ],
)
def test_range_in_a_comment(comment: str, expected: Any) -> None:
    assert range_of(comment) == (expected and pytest.approx(expected))


def names(kind: str, field: str) -> list[str]:
    definition = rosglass.load(kind).definition
    found = next(one for one in definition.fields if one.name == field)
    return [choice.name for choice in choices_of(definition, found)]


def test_constants_of_a_field_are_found_by_its_name() -> None:
    found = names("sensor_msgs/msg/BatteryState", "power_supply_status")
    assert found[0] == "POWER_SUPPLY_STATUS_UNKNOWN"
    assert all(name.startswith("POWER_SUPPLY_STATUS_") for name in found)
    assert names("sensor_msgs/msg/BatteryState", "power_supply_technology") != found
    assert names("sensor_msgs/msg/BatteryState", "voltage") == []


def test_constants_belong_to_the_only_field_of_their_type() -> None:
    assert names("diagnostic_msgs/msg/DiagnosticStatus", "level") == [
        "OK",
        "WARN",
        "ERROR",
        "STALE",
    ]
    assert names("rcl_interfaces/msg/Log", "level") == ["DEBUG", "INFO", "WARN", "ERROR", "FATAL"]
    assert names("rcl_interfaces/msg/Log", "line") == []
