"""The control JointView."""

from __future__ import annotations

import math
from typing import Any

import pytest
from rows import HOSTILE, rows_of

pytestmark = pytest.mark.both_qt
TYPE = "sensor_msgs/msg/JointState"
URDF = """<robot name="r"><link name="a"/>
<joint name="elbow" type="revolute"><limit lower="-1" upper="1" effort="10" velocity="2"/></joint>
<joint name="lift" type="prismatic"><limit lower="0" upper="0.5" effort="100" velocity="1"/></joint>
<joint name="wheel" type="continuous"/>
</robot>"""


@pytest.fixture
def joints(controls: Any, wait: Any) -> Any:
    from rosglass.comm import QoS

    def show(control: str = "JointView {}", urdf: str = URDF) -> Any:
        publisher = controls.robot.create_publisher("/joint_states", TYPE)
        described = controls.robot.create_publisher(
            "/robot_description", "std_msgs/msg/String", QoS.latched()
        )
        if urdf:
            described.publish(data=urdf)
        view = controls.show(control)
        wait(publisher.subscription_count)
        model = controls.find("list").property("model")

        def rows() -> dict[str, Any]:
            return {row["name"]: row for row in rows_of(model)}

        return view, publisher, rows

    return show


def test_joints_nearest_to_a_limit_are_first(joints: Any, wait: Any) -> None:
    view, publisher, rows = joints()
    publisher.publish(
        name=["wheel", "lift", "elbow"], position=[9, 0.25, 0.9], effort=[0, 5, 9.5]
    )  # fmt: skip
    wait(lambda: rows() and rows()["elbow"]["share"] == pytest.approx(0.95))
    assert list(rows()) == ["elbow", "lift", "wheel"]
    elbow = rows()["elbow"]
    assert elbow["nearness"] == pytest.approx(0.05)
    assert (elbow["maxEffort"], elbow["maxVelocity"]) == (10, 2)
    assert math.isnan(rows()["wheel"]["share"])
    publisher.publish(name=["lift"], position=[0.51])
    wait(lambda: view.property("beyond") == 1)
    assert view.property("note") == "1 at the limit"
    wait(lambda: next(iter(rows())) == "lift")


def test_joints_of_several_publishers_are_merged(joints: Any, controls: Any, wait: Any) -> None:
    _view, publisher, rows = joints("JointView { silentAfter: 0.4 }")
    gripper = controls.robot.create_publisher("/joint_states", TYPE)
    wait(gripper.subscription_count)
    gripper.publish(name=["finger"], position=[0.1])
    publisher.publish(name=["elbow"], position=[0.2])
    wait(lambda: set(rows()) == {"finger", "elbow"})

    def silent() -> bool:
        publisher.publish(name=["elbow"], position=[0.2])
        return rows()["finger"]["silent"] >= 0

    wait(silent)
    assert rows()["elbow"]["silent"] == -1


def test_faulty_values_are_named(joints: Any, controls: Any, wait: Any) -> None:
    _view, publisher, rows = joints()
    publisher.publish(name=["elbow", "lift"], position=[math.nan], effort=[math.inf, math.nan, 1])
    wait(lambda: len(rows()) == 2)
    assert rows()["lift"]["fault"] == "effort has 3 values for 2 joints"
    assert math.isnan(rows()["lift"]["position"])
    publisher.publish(name=["elbow", "lift"], position=[math.nan, math.inf])
    wait(lambda: rows()["lift"]["fault"] == "")
    assert rows()["lift"]["nearness"] < 0
    assert math.isnan(rows()["elbow"]["nearness"])
    assert not controls.grab().isNull()


@pytest.mark.parametrize(
    ("urdf", "reason"),
    [
        ("", "no robot description yet"),
        ("<robot", "robot_description:1"),
        ("<html/>", "expected <robot>, got <html>"),
        (
            '<robot><joint name="a" type="revolute"><limit lower="x"/></joint></robot>',
            "limit of joint 'a': expected a finite number, got 'x'",
        ),
        (
            '<robot><joint name="a" type="revolute"><limit lower="2" upper="1"/></joint></robot>',
            "lower 2 is above upper 1",
        ),
        ('<!DOCTYPE r [<!ENTITY a "b">]><robot/>', "robot_description:1"),
    ],
)
def test_description_that_cannot_be_used_is_named(
    joints: Any, controls: Any, wait: Any, urdf: str, reason: str
) -> None:
    _view, publisher, rows = joints(urdf=urdf)
    publisher.publish(name=["a"], position=[0.5])
    wait(lambda: reason in controls.find("more").property("text"))
    assert list(rows()) == ["a"]


def test_many_and_hostile_joints_are_bounded(joints: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = joints()
    names = [HOSTILE, *(f"joint {at}" for at in range(1200))]
    publisher.publish(name=names, position=[0.0] * len(names))
    wait(lambda: view.property("total") == 1000)
    wait(lambda: "201 further joints not shown" in controls.find("more").property("text"))
    assert max(map(len, rows())) < 300
    assert not controls.grab().isNull()


def test_another_namespace_has_another_robot(joints: Any, controls: Any, wait: Any) -> None:
    view, publisher, rows = joints('JointView { topic: "joint_states" }')
    publisher.publish(name=["elbow"], position=[0.9])
    wait(lambda: rows() and rows()["elbow"]["share"] == pytest.approx(0.95))
    other = controls.robot.create_publisher("/other/joint_states", TYPE)
    view.setProperty("ns", "/other")
    wait(other.subscription_count)
    assert rows() == {}
    other.publish(name=["elbow"], position=[0.9])
    wait(lambda: bool(rows()))
    wait(lambda: math.isnan(rows()["elbow"]["share"]))


def test_description_of_a_real_robot(live_controls: Any, wait: Any) -> None:
    """ROS 1 has it in a parameter, ROS 2 on a latched topic."""
    from rosglass.comm import QoS

    controls = live_controls
    robot = controls.robot
    if robot.wire == "ros1":
        robot.parameter_server.set("/robot_description", URDF)
    else:
        described = robot.create_publisher(
            "/robot_description", "std_msgs/msg/String", QoS.latched()
        )
        described.publish(data=URDF)
    publisher = robot.create_publisher("/joint_states", TYPE)
    controls.show("JointView {}")
    model = controls.find("list").property("model")

    def share() -> float:
        publisher.publish(name=["elbow"], position=[0.9])
        rows = rows_of(model)
        return rows[0]["share"] if rows else math.nan

    wait(lambda: share() == pytest.approx(0.95))
