"""The simulated robot on a ROS 1 master, whose parameters anybody may set to anything."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

from rosglass.comm import ConnectionState, QoS
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
    [(0.4, 0.4), (1, 1.0), (100.0, 0.1), (-1.0, 0.1), (math.nan, 0.1), ("fast", 0.1), (None, 0.1)],
)
def test_nonsense_makes_it_slow(robot: tuple[Any, Robot], value: Any, used: float) -> None:
    node, made = robot
    assert made.services.max_speed == 1.2
    node.parameters.set({"max_speed": value})
    eventually(lambda: made.services.max_speed == used)


def test_it_drives_and_stops_without_the_master(
    robot: tuple[Any, Robot], connect: Any, master: Any
) -> None:
    node, made = robot
    console = connect("console")
    drive = console.create_publisher("/cmd_vel", "geometry_msgs/Twist")
    stop = console.create_publisher("/emergency_stop", "std_msgs/Bool")
    release = console.create_publisher("/emergency_stop/release", "std_msgs/UInt32", QoS.command())
    counter = console.create_subscription("/emergency_stop/counter", "std_msgs/UInt32")
    topics = (drive, stop, release)
    eventually(lambda: all(one.subscription_count() for one in topics))
    eventually(counter.publisher_count)
    made.start()
    node.parameters.set({"max_speed": 0.4})
    eventually(lambda: made.services.max_speed == 0.4)
    master.stop()
    eventually(lambda: node.status().state is not ConnectionState.CONNECTED)
    eventually(lambda: drive.publish(linear={"x": 1.0}) or made.state.speed > 0.3)
    assert made.state.speed < 0.5
    stop.publish(data=True)
    eventually(lambda: made.state.emergency_stop)

    def is_released() -> bool:
        """Release the stop by the newest number."""
        while (sample := counter.take_latest()) is not None:
            release.publish(data=sample.message().data)
        return not made.state.emergency_stop

    stop.publish(data=False)
    eventually(is_released)
    stop.publish(data=True)
    eventually(lambda: made.state.emergency_stop)
    assert not made.wait(0.3)
