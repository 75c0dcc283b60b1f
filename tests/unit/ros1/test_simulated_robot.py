"""The simulated robot on a ROS 1 master, whose parameters anybody may set to anything."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.demo.robot import Robot, RobotOptions

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture
def robot(connect: Any) -> Iterator[tuple[Any, Robot]]:
    node = connect("robot")
    made = Robot(node, RobotOptions(raw=False, compressed=False))
    yield node, made
    made.close()


def test_it_starts_and_says_how_fast_it_may_drive(robot: tuple[Any, Robot]) -> None:
    node, _ = robot
    assert node.parameters.get("max_speed") == 1.2


@pytest.mark.parametrize(
    ("value", "used"),
    [(0.4, 0.4), (1, 1.0), (100.0, 0.1), (-1.0, 0.1), (math.nan, 0.1), ("fast", 0.1)],
)
def test_nonsense_makes_it_slow(robot: tuple[Any, Robot], value: Any, used: float) -> None:
    node, made = robot
    node.parameters.set({"max_speed": value})
    assert made._duties.max_speed == used
