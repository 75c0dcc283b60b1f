"""The example remote_control.qml on a robot's node: over Zenoh with a router, and on ROS 1."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import rosglass
from rosglass.comm import QoS, Time
from rosglass.qml import Session, install

if TYPE_CHECKING:
    from collections.abc import Iterator

EXAMPLE = Path(__file__).parents[2] / "examples" / "remote_control.qml"


class Robot:
    """Films a plain colour at 30 Hz and remembers received commands."""

    def __init__(self, url: str) -> None:
        self.node = rosglass.connect(url, "robot")
        self.commands: list[tuple[float, float]] = []
        self.lamp: list[bool] = []
        self.node.create_subscription("/cmd_vel", "geometry_msgs/msg/Twist", self._on_command)
        self.node.create_subscription(
            "/flashlight", "std_msgs/msg/Bool", lambda m: self.lamp.append(m.data)
        )
        self._camera = self.node.create_publisher(
            "/camera/image_raw", "sensor_msgs/msg/Image", QoS.sensor_data()
        )
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._film)
        self._thread.start()

    def _on_command(self, message: Any) -> None:
        self.commands.append((message.linear.x, message.angular.z))

    def _film(self) -> None:
        data = np.full((480, 640, 3), (200, 40, 20), np.uint8).reshape(-1)
        while not self._ended.wait(1 / 30):
            self._camera.publish(
                header={"stamp": Time.now()},
                width=640,
                height=480,
                encoding="rgb8",
                step=1920,
                data=data,
            )

    def freeze(self) -> None:
        """Send no more images."""
        self._ended.set()
        self._thread.join()

    def close(self) -> None:
        self.freeze()
        self.node.close()


@pytest.fixture
def robot(url: str) -> Iterator[Robot]:
    made = Robot(url)
    yield made
    made.close()


@pytest.fixture
def view(app: Any, url: str, wait: Any) -> Iterator[Any]:
    from rosglass.qt import QtCore, QtQuick

    session = Session(url)
    made = QtQuick.QQuickView()
    made.setResizeMode(QtQuick.QQuickView.ResizeMode.SizeRootObjectToView)
    install(made.engine(), session)
    made.setSource(QtCore.QUrl.fromLocalFile(str(EXAMPLE)))
    assert made.status() == QtQuick.QQuickView.Status.Ready, [e.toString() for e in made.errors()]
    made.resize(400, 300)
    made.show()
    wait(lambda: session.state == "connected")
    yield made
    made.close()
    made.deleteLater()
    wait.settled(session)
    session.close()


@pytest.mark.both_qt
def test_dragging_drives_and_letting_go_stops(robot: Robot, view: Any, wait: Any) -> None:
    from rosglass.qt import QtCore, optional

    test, point, left = optional("QtTest").QTest, QtCore.QPoint, QtCore.Qt.MouseButton.LeftButton
    wait(lambda: robot.node.publishers("/cmd_vel"))
    wait(view.isExposed)
    test.mousePress(view, left, pos=point(200, 240))
    wait(lambda: robot.commands)
    test.mouseMove(view, point(200, 195))
    wait(lambda: robot.commands[-1] == (0.75, 0.0))
    # Held still, it goes on sending, as the robot would stop by itself otherwise.
    count = len(robot.commands)
    wait(lambda: len(robot.commands) > count + 3)
    test.mouseMove(view, point(20, 290))
    wait(lambda: robot.commands[-1][1] == 1.0)
    assert -1.0 <= robot.commands[-1][0] < 0
    test.mouseRelease(view, left, pos=point(20, 290))
    wait(lambda: robot.commands[-1] == (0.0, 0.0))
    begin = len(robot.commands)
    wait(lambda: len(robot.commands) > begin + 35)
    wait.nothing_happens(0.5)
    count = len(robot.commands)
    wait.nothing_happens(0.2)
    assert len(robot.commands) == count, "others may drive"
    assert set(robot.commands[begin:]) == {(0.0, 0.0)}


def test_held_stick_without_live_image_stops_the_robot(robot: Robot, view: Any, wait: Any) -> None:
    from rosglass.qt import QtCore, optional

    test, point, left = optional("QtTest").QTest, QtCore.QPoint, QtCore.Qt.MouseButton.LeftButton
    wait(view.isExposed)
    test.mousePress(view, left, pos=point(200, 195))
    wait(lambda: robot.commands and robot.commands[-1][0] > 0)
    robot.freeze()
    wait(lambda: robot.commands[-1] == (0.0, 0.0))
    test.mouseRelease(view, left, pos=point(200, 195))
    begin = len(robot.commands)
    wait(lambda: len(robot.commands) > begin + 30, "it does not know whether they arrive")
    assert set(robot.commands[begin:]) == {(0.0, 0.0)}


def test_stick_released_before_an_outage_is_noticed_stops_the_robot(
    robot: Robot, view: Any, wait: Any
) -> None:
    from rosglass.qt import QtCore, optional

    test, point, left = optional("QtTest").QTest, QtCore.QPoint, QtCore.Qt.MouseButton.LeftButton
    wait(view.isExposed)
    test.mousePress(view, left, pos=point(200, 195))
    wait(lambda: robot.commands and robot.commands[-1][0] > 0)
    robot.freeze()
    test.mouseRelease(view, left, pos=point(200, 195))
    begin = len(robot.commands)
    wait(lambda: len(robot.commands) > begin + 60, "all so far may have been dropped")
    assert set(robot.commands[begin + 1 :]) == {(0.0, 0.0)}


def test_ending_while_driving_stops_the_robot(robot: Robot, view: Any, wait: Any) -> None:
    from rosglass.qt import QtCore, optional

    test, point, left = optional("QtTest").QTest, QtCore.QPoint, QtCore.Qt.MouseButton.LeftButton
    wait(view.isExposed)
    test.mousePress(view, left, pos=point(200, 195))
    wait(lambda: robot.commands and robot.commands[-1][0] > 0)
    view.setSource(QtCore.QUrl())
    wait(lambda: robot.commands[-1] == (0.0, 0.0))


def test_the_button_switches_the_lamp(robot: Robot, view: Any, wait: Any) -> None:
    from rosglass.qt import QtCore, optional

    test, point, left = optional("QtTest").QTest, QtCore.QPoint, QtCore.Qt.MouseButton.LeftButton
    wait(lambda: robot.node.publishers("/flashlight"))
    wait(view.isExposed)
    for expected in (True, False):
        test.mouseClick(view, left, pos=point(20, 290))
        wait(lambda expected=expected: robot.lamp[-1:] == [expected])


@pytest.mark.xvfb
def test_the_camera_is_on_the_screen(
    robot: Robot, url: str, start: Any, screen: str, tmp_path: Path
) -> None:
    import cv2

    shot = tmp_path / "shot.png"
    program = start(
        "run", EXAMPLE, "--url", url, "--screenshot", shot, "--after", 5, display=screen
    )
    assert program.end(30) == 0, program.text
    picture = cv2.imread(str(shot))
    assert picture[200, 512].tolist() == [20, 40, 200]
    assert "WARNING" not in program.text


def test_a_robot_that_dies_shows_within_a_second_and_comes_back(
    url: str, view: Any, wait: Any
) -> None:
    from rosglass.qt import QtCore

    robot = Robot(url)
    camera = view.rootObject().findChild(QtCore.QObject, "camera") or next(
        child
        for child in view.rootObject().children()
        if child.metaObject().className().startswith("ImageTransport")
    )
    try:
        wait(lambda: not camera.property("stale"))
        assert camera.property("transport") == "raw"
    finally:
        robot.close()
    started = time.monotonic()
    wait(lambda: camera.property("stale"))
    assert time.monotonic() - started < 10
    robot = Robot(url)
    try:
        wait(lambda: not camera.property("stale"))
    finally:
        robot.close()


def test_the_example_is_short_and_the_one_in_the_documentation() -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 42
    assert text in (EXAMPLE.parents[1] / "docs" / "qml.md").read_text(encoding="utf-8")
