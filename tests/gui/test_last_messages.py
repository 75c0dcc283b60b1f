"""Messages that an interface sends while it ends reach the robot, as those of a reload do."""

from __future__ import annotations

import random
import signal
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

import rosglass
from rosglass.comm import QoS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

TEMPLATE = """import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
Window {
    id: window
    visible: true; width: 200; height: 100
    property var publisher
    property int version: 1
    function send(text) { console.log(text, publisher.publish({data: text + version})) }
    Component.onCompleted: {
        Ros2.init("ui")
        publisher = CREATE
        Qt.application.aboutToQuit.connect(() => send("quitting"))
    }
    Component.onDestruction: send("destroyed")
    Subscription {
        topic: "/order"; messageType: "std_msgs/msg/String"
        onNewMessage: message => message.data === "close" ? window.close() : Qt.quit()
    }
    Timer {
        interval: 50; running: true; repeat: true
        onTriggered: if (publisher.getSubscriptionCount() > 0) { console.log("ready"); stop() }
    }
}"""
ROS2 = TEMPLATE.replace(
    "CREATE",
    'Ros2.createPublisher("/last", "std_msgs/msg/String", Ros2.QoS().reliable().keep_last(10))',
)
ROS1 = (
    TEMPLATE.replace("Ros2", "Ros")
    .replace("CREATE", 'Ros.advertise("std_msgs/String", "/last", 10)')
    .replace("getSubscriptionCount", "getNumSubscribers")
    .replace("Subscription {", "Subscriber {")
    .replace(' messageType: "std_msgs/msg/String"', "")
)


class Robot:
    """Keeps what it receives on ``/last``, and gives orders."""

    def __init__(self, url: str) -> None:
        self.node = rosglass.connect(url, "robot")
        self.received: list[str] = []
        self.node.create_subscription(
            "/last",
            "std_msgs/msg/String",
            lambda m: self.received.append(m.data),
            qos=QoS(depth=10),
        )
        self._orders = self.node.create_publisher("/order", "std_msgs/msg/String")

    def order(self, what: str) -> None:
        eventually(self._orders.subscription_count)
        self._orders.publish(data=what)

    def has(self, *expected: str) -> None:
        eventually(lambda: len(self.received) >= len(expected))
        assert self.received == list(expected)


@pytest.fixture
def robot(url: str) -> Iterator[Robot]:
    made = Robot(url)
    yield made
    made.node.close()


def end(program: Any, robot: Robot, ending: str) -> None:
    if ending in ("SIGINT", "SIGTERM"):
        program.kill(getattr(signal, ending))
    else:
        robot.order(ending)
    program.end(120)


@pytest.mark.parametrize(
    ("ending", "text"), [("SIGINT", ROS1), ("SIGTERM", ROS2), ("close", ROS1), ("quit", ROS2)]
)
def test_last_messages_arrive(
    ending: str, text: str, url: str, robot: Robot, start: Any, tmp_path: Path
) -> None:
    file = tmp_path / "Main.qml"
    file.write_text(text)
    program = start("run", file, "--url", url)
    program.until("ready", 120)
    end(program, robot, ending)
    robot.has("quitting1", "destroyed1")


def test_last_messages_arrive_over_dds(ros_domains: list[int], start: Any, tmp_path: Path) -> None:
    pytest.importorskip("cyclonedds", reason="needs the extra `dds`")
    url = f"dds://?domain={random.SystemRandom().choice(ros_domains)}"
    robot = Robot(url)
    try:
        file = tmp_path / "Main.qml"
        file.write_text(ROS2)
        for ending in ("SIGTERM", "quit"):
            program = start("run", file, "--url", url)
            program.until("ready", 120)
            end(program, robot, ending)
            robot.has("quitting1", "destroyed1")
            robot.received.clear()
    finally:
        robot.node.close()


@pytest.mark.both_qt
def test_a_reload_sends_the_same(url: str, robot: Robot, start: Any, tmp_path: Path) -> None:
    file = tmp_path / "Main.qml"
    file.write_text(ROS2)
    program = start("run", file, "--url", url, "--watch")
    program.until("ready", 120)
    file.write_text(ROS2.replace("version: 1", "version: 2"))
    program.until("reloaded", 120)
    robot.has("destroyed1")
    program.until("ready", 120)
    robot.received.clear()
    end(program, robot, "SIGTERM")
    robot.has("quitting2", "destroyed2")


PROGRAM = """
import sys
from rosglass.qt import QtCore, QtGui, QtQml, run_event_loop
from rosglass.qml import Session, install
app = QtGui.QGuiApplication([])
engine = QtQml.QQmlApplicationEngine()
session = install(engine, Session({url!r}))
engine.load(QtCore.QUrl.fromLocalFile({file!r}))
app.aboutToQuit.connect(engine.deleteLater)
run_event_loop(app)
{close}
"""


@pytest.mark.both_qt
@pytest.mark.parametrize("close", ["session.close()", "sys.exit(0)"])
def test_a_program_with_an_engine_of_its_own_sends_them(
    close: str, url: str, robot: Robot, python: Any, tmp_path: Path
) -> None:
    file = tmp_path / "Main.qml"
    file.write_text(ROS2)
    program = python(PROGRAM.format(url=url, file=str(file), close=close))
    program.until("ready", 120)
    robot.order("quit")
    assert program.end(120) == 0
    robot.has("quitting1", "destroyed1")
