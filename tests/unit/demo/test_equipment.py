"""Equipment of a robot: description, cloud, cameras, battery, and a stop that holds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

pytest.importorskip("cv2", reason="the simulated camera needs the extra `camera`")

from waiting import eventually

from rosglass.demo.equipment import CAMERAS
from rosglass.demo.robot import Robot, RobotOptions
from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Iterator

    from conftest import StubNode

OPTIONS = RobotOptions(raw=False, compressed=False, equipped=True, fps=5)


@pytest.fixture(scope="module")
def alive(stub_node: type[StubNode]) -> Iterator[tuple[Any, Robot]]:
    class Node(stub_node):  # type: ignore[misc, valid-type]
        def __init__(self) -> None:
            super().__init__()
            self.parameter_server = self
            self.set_parameters: dict[str, Any] = {}

        def set(self, name: str, value: Any) -> None:
            self.set_parameters[name] = value

    node = Node()
    robot = Robot(node, OPTIONS)
    robot.start()
    yield node, robot
    robot.close()


def test_its_description_is_where_rviz_looks(alive: tuple[Any, Robot]) -> None:
    assert alive[0].set_parameters["/robot_description"].startswith("<?xml")


def test_there_is_no_such_mode(stub_node: type[StubNode]) -> None:
    options = RobotOptions(raw=False, compressed=False, equipped=True, mode="Safe")
    with pytest.raises(Error, match=r"no mode 'Safe'; there are autonomous, supervised, safe"):
        Robot(stub_node(), options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", CAMERAS)
def test_cameras_show_different_moving_images(alive: tuple[Any, Robot], name: str) -> None:
    node, _ = alive
    image = node.last(f"/{name}_camera/image_raw")
    assert (image.height, image.width, image.step, image.encoding) == (240, 320, 960, "rgb8")
    assert image.header.frame_id == f"{name}_camera_link"
    picture = np.frombuffer(bytes(image.data), np.uint8).reshape(240, 320, 3)
    assert picture.std() > 10
    others = [node.last(f"/{other}_camera/image_raw") for other in CAMERAS if other != name]
    assert all(bytes(other.data) != bytes(image.data) for other in others)


def test_nothing_is_drawn_without_subscribers(alive: tuple[Any, Robot], lives_on: Any) -> None:
    node, robot = alive
    topics = ["/points", *(f"/{name}_camera/image_raw" for name in CAMERAS)]
    for topic in topics:
        node.publishers[topic].listeners = 0
    lives_on(robot, 0.2)
    before = [len(node.publishers[topic].sent) for topic in topics]
    lives_on(robot, 1.0)
    assert [len(node.publishers[topic].sent) for topic in topics] == before
    for topic in topics:
        node.publishers[topic].listeners = 1
    for topic in topics:
        node.last(topic)


def test_cloud_grows_into_what_the_laser_sees(alive: tuple[Any, Robot]) -> None:
    eventually(lambda: alive[0].last("/points").width > 500)


def test_safe_is_slow(alive: tuple[Any, Robot], lives_on: Any) -> None:
    node, robot = alive
    node.ask("/mode/safe")
    eventually(lambda: node.command("/cmd_vel", linear={"x": 1.0}) or robot.state.speed > 0.2)
    for _ in range(30):
        node.command("/cmd_vel", linear={"x": 1.0})
        lives_on(robot, 0.01)
    assert robot.state.speed < 0.31
    node.ask("/mode/supervised")


def test_emergency_stop_ends_the_mission_and_holds(alive: tuple[Any, Robot], lives_on: Any) -> None:
    node, robot = alive
    node.ask("/mode/autonomous")
    eventually(lambda: abs(robot.state.speed) + abs(robot.state.turn) > 0.1)
    node.command("/emergency_stop", data=True)
    eventually(lambda: node.last("/emergency_stop/state").data)
    eventually(lambda: abs(robot.state.speed) + abs(robot.state.turn) < 0.01)
    eventually(lambda: node.last("/mission/state").data == "emergency stop")
    place = robot.state.x, robot.state.y
    for command in ("/mode/supervised", "/mode/autonomous"):
        node.ask(command)
        node.command("/cmd_vel", linear={"x": 0.5})
        lives_on(robot, 0.2)
    assert (robot.state.x, robot.state.y) == place
    node.command("/emergency_stop/release", data=node.last("/emergency_stop/counter").data)
    eventually(lambda: node.last("/mission/state").data == "waiting for mode autonomous")


def test_battery_reports_charge_and_voltage(alive: tuple[Any, Robot]) -> None:
    battery = alive[0].last("/battery_state")
    assert 0 < battery.percentage <= 1
    assert battery.charge == pytest.approx(battery.percentage * battery.capacity)
    assert 18 < battery.voltage < 30
    assert battery.present
