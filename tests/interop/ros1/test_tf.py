"""Transforms both ways with rospy's tf2_ros."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import pytest
from waiting import eventually

from rosglass.comm import Time
from rosglass.tf import (
    StaticTransformBroadcaster,
    Transform,
    TransformBroadcaster,
    TransformListener,
)

HALF = math.sqrt(0.5)
LEFT = (0.0, 0.0, HALF, HALF)


@pytest.fixture(autouse=True)
def tf2_ros() -> None:
    if not Path("/usr/lib/python3/dist-packages/tf2_ros").is_dir():
        pytest.skip("tf2_ros is not installed: sudo apt-get install python3-tf2-ros")


def place(parent: str, child: str, x: float, sec: int = 5) -> Transform:
    return Transform((x, 0.0, 0.0), LEFT, Time.from_parts(sec, 250), parent, child)


def test_a_robot_that_sends(connect: Any, rospy_peer: Any) -> None:
    static = [place("base", "camera", 1.0).to_dict(1), place("base", "lidar", 2.0).to_dict(1)]
    rospy_peer.call("tf_send", transforms=static, static=True)
    listener = TransformListener(connect("cockpit"))
    buffer = listener.buffer
    assert buffer.wait_for_transform("lidar", "camera", timeout=30)
    promise = buffer.lookup_transform_async("map", "camera")
    numbers = itertools.count(1)

    def found_while_sending() -> bool:
        moving = [place("map", "base", 3.0, next(numbers)).to_dict(1)]
        rospy_peer.call("tf_send", transforms=moving)
        return promise.done()

    eventually(found_while_sending)
    found = promise.result(30)
    assert found.translation == pytest.approx((3, 1, 0))
    assert found.rotation == pytest.approx((0, 0, 1, 0))
    assert found.stamp.nanosec == 250
    tree = buffer.tree()
    assert tree["camera"].authority == tree["base"].authority == "/rospy_peer"
    assert (tree["camera"].static, tree["base"].static) == (True, False)
    listener.close()
    listener.close()


def test_a_robot_that_listens(connect: Any, rospy_peer: Any) -> None:
    node = connect("driver")
    fixed = StaticTransformBroadcaster(node)
    fixed.send_transform(place("odom", "wheel", 1.0))
    fixed.send_transform([place("odom", "bumper", 2.0), place("odom", "wheel", 4.0)])
    found = rospy_peer.call("tf_lookup", target="bumper", source="wheel")
    assert found["transform"]["translation"]["y"] == pytest.approx(-2)
    moving = TransformBroadcaster(node)
    asked = rospy_peer.start("tf_lookup", target="world", source="wheel", timeout=30)
    numbers = itertools.count(1)

    def answer() -> Any:
        moving.send_transform(place("world", "odom", 1.0, next(numbers)))
        return rospy_peer.event(f"answer {asked}", 0.05, otherwise=None)

    value = eventually(answer)
    assert "error" not in value, value
    assert value["value"]["transform"]["translation"]["y"] == pytest.approx(4)


def test_static_transforms_of_several_broadcasters_reach_late_listeners(
    connect: Any, start_rospy: Any
) -> None:
    node = connect("several")
    first, second = StaticTransformBroadcaster(node), StaticTransformBroadcaster(node)
    first.send_transform(place("base", "left", 1.0))
    second.send_transform(place("base", "right", 2.0))
    found = start_rospy("late").call("tf_lookup", target="right", source="left")
    assert found["transform"]["translation"]["y"] == pytest.approx(1)
    reader = connect("late_too")
    for _ in range(2):
        # The second one shares the connection with the first.
        buffer = TransformListener(reader).buffer
        buffer.wait_for_transform("right", "left", timeout=30)


def test_the_old_message_and_a_namespace(connect: Any, rospy_peer: Any) -> None:
    node = connect("cockpit")
    first = TransformListener(node)
    second = TransformListener(node, namespace="/robot2/")
    assert [subscription.topic for subscription in second.subscriptions] == [
        "/robot2/tf",
        "/robot2/tf_static",
    ]
    old = [place("map", "torso", 1.0).to_dict(1)]
    rospy_peer.call("tf_send", transforms=old, old_on="/robot2/tf")
    assert second.buffer.wait_for_transform("map", "torso", timeout=30).translation == (1, 0, 0)
    assert not first.buffer.has_frame("torso")
