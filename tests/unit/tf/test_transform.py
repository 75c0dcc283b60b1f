"""The value: composing, inverting, applying, messages of ROS 1 and ROS 2."""

from __future__ import annotations

import dataclasses
import math

import pytest

import rosglass
from rosglass.comm import Time
from rosglass.errors import InvalidArgumentException
from rosglass.tf import Transform

HALF = math.sqrt(0.5)
LEFT = (0.0, 0.0, HALF, HALF)
MAP_BASE = Transform((1.0, 2.0, 3.0), LEFT, Time(5), "map", "base")
BASE_ARM = Transform((1.0, 0.0, 0.0), LEFT, Time(7), "base", "arm")


def test_apply() -> None:
    assert MAP_BASE.apply_point((1, 0, 0)) == pytest.approx((1, 3, 3))
    assert MAP_BASE.apply_vector((1, 0, 0)) == pytest.approx((0, 1, 0))
    place, turn = MAP_BASE.apply_pose((1, 0, 0), LEFT)
    assert place == pytest.approx((1, 3, 3))
    assert turn == pytest.approx((0, 0, 1, 0))


def test_compose_and_inverse() -> None:
    both = MAP_BASE @ BASE_ARM
    assert both.apply_point((1, 0, 0)) == pytest.approx(
        MAP_BASE.apply_point(BASE_ARM.apply_point((1, 0, 0)))
    )
    assert (both.frame_id, both.child_frame_id, both.stamp) == ("map", "arm", Time(5))
    back = both.inverse()
    assert (back.frame_id, back.child_frame_id) == ("arm", "map")
    assert back.apply_point(both.apply_point((4, 5, 6))) == pytest.approx((4, 5, 6))
    with pytest.raises(InvalidArgumentException, match="'base'"):
        BASE_ARM @ MAP_BASE


def test_immutable() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        MAP_BASE.frame_id = "other"  # type: ignore[misc]


@pytest.mark.parametrize("ros", [1, 2])
def test_messages_of_ros_1_and_ros_2(ros: int) -> None:
    kind = rosglass.load("geometry_msgs/msg/TransformStamped", ros)
    message = kind.create(MAP_BASE.to_dict(ros))  # type: ignore[union-attr]
    assert Transform.from_message(message) == MAP_BASE
    assert Transform.from_message(message.to_dict()) == MAP_BASE


@pytest.mark.parametrize(
    "fields",
    [
        {"translation": (1.0, 2.0)},
        {"translation": (1.0, 2.0, math.nan)},
        {"rotation": "up"},
        {"rotation": (0.0, 0.0, 0.0, math.inf)},
        {"stamp": 5},
        {"frame_id": None},
    ],
)
def test_invalid_fields_are_rejected(fields: dict[str, object]) -> None:
    with pytest.raises(InvalidArgumentException, match=next(iter(fields))):
        Transform(**fields)  # type: ignore[arg-type]


@pytest.mark.parametrize("message", [None, {}, {"header": 3, "transform": 4}, "tf"])
def test_other_messages_are_rejected(message: object) -> None:
    with pytest.raises(InvalidArgumentException, match="TransformStamped"):
        Transform.from_message(message)  # type: ignore[arg-type]
