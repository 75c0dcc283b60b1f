"""RobotTiles."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

import pytest

from rosglass.qt import QtCore, QtGui, optional

pytestmark = pytest.mark.both_qt
TWIST = "geometry_msgs/msg/Twist"
BATTERY = "sensor_msgs/msg/BatteryState"
IMAGE = "sensor_msgs/msg/CompressedImage"
test = optional("QtTest").QTest
Key = QtCore.Qt.Key


class Robot:
    """A robot in a namespace, with battery, diagnostics and mode."""

    def __init__(self, controls: Any, namespace: str, camera: bool = False) -> None:
        self.node = controls.bench.world.connect(None, "base", namespace or "/")
        self.commands: list[float] = []
        self.steered = self.node.create_subscription(
            f"{namespace}/cmd_vel", TWIST, lambda m: self.commands.append(m.linear.x)
        )
        self.battery = self.node.create_publisher(f"{namespace}/battery", BATTERY)
        self.mode = self.node.create_publisher(f"{namespace}/mode/state", "std_msgs/msg/String")
        self.alarms = self.node.create_publisher(
            f"{namespace}/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"
        )
        self.camera = None
        if camera:
            self.camera = self.node.create_publisher(f"{namespace}/camera/image/compressed", IMAGE)

    def close(self) -> None:
        self.node.close()


@pytest.fixture
def fleet(controls: Any) -> Any:
    """Makes robots, which end with the test."""
    with ExitStack() as stack:

        def make(*namespaces: str, camera: bool = False) -> list[Robot]:
            robots = [Robot(controls, one, camera) for one in namespaces]
            for robot in robots:
                stack.callback(robot.close)
            return robots

        yield make


def tile(controls: Any, index: int) -> Any:
    return controls.find(f"tile_{index}")


def text(controls: Any, index: int, name: str) -> str:
    return str(controls.find(name, tile(controls, index)).property("text"))


def names(tiles: Any) -> list[str]:
    return [one["name"] for one in tiles.property("found").toVariant()]


def focused(controls: Any, wait: Any) -> None:
    controls.window.requestActivate()
    wait(lambda: QtGui.QGuiApplication.focusWindow() is not None)


def test_each_tile_shows_its_own_robot(controls: Any, wait: Any, fleet: Any) -> None:
    home, anna, bert = fleet("", "/anna", "/bert")
    tiles = controls.show("RobotTiles { anchors.fill: parent }", 700, 500)
    wait(lambda: names(tiles) == ["(no namespace)", "anna", "bert"])

    def shows(*expected: str) -> bool:
        home.battery.publish(percentage=0.11)
        anna.battery.publish(percentage=0.5)
        bert.battery.publish(percentage=0.87)
        return [text(controls, at, "battery") for at in range(3)] == list(expected)

    wait(lambda: shows("11 %", "50 %", "87 %"))

    def reports() -> bool:
        anna.mode.publish(data="charging")
        anna.alarms.publish(status=[{"name": "motor", "level": 2, "message": "hot"}])
        bert.alarms.publish(status=[{"name": "motor", "level": 0}])
        alarms = [text(controls, at, "alarm") for at in (1, 2)]
        return alarms == ["1 error", "no alarm"] and text(controls, 1, "mode") == "charging"

    wait(reports, lambda: [text(controls, at, "alarm") for at in range(3)])
    wait(lambda: tiles.property("troubled") == 1)
    assert "1 in trouble" in tiles.property("note")
    assert text(controls, 2, "mode") == ""
    # What no longer comes is said to be old.
    tiles.setProperty("timeout", 300)
    wait(lambda: text(controls, 1, "battery") == "50 %, OLD")
    wait(lambda: text(controls, 1, "alarm") == "diagnostics silent")
    frame = controls.find("frame", tile(controls, 1))
    wait(lambda: frame.property("stale") and frame.property("status").startswith("OLD"))
    assert tiles.property("troubled") == 3


FLEET = """Item {
    property QtObject tiles: tilesId; property QtObject drive: driveId
    property QtObject stick: stickId
    property var log: []
    anchors.fill: parent
    Item { id: stickId; objectName: "stick" }
    TwistCommand {
        id: driveId
        ns: tilesId.selected
        type: "geometry_msgs/msg/Twist"
        onHalted: function(reason) { made.log = made.log.concat(["halted"]) }
    }
    RobotTiles {
        id: tilesId
        anchors.fill: parent
        command: driveId
        onChosen: function(ns) { made.log = made.log.concat([ns]) }
    }
    function steer() { return driveId.steer(stickId, 1, 0) }
}"""


def test_a_tile_selects_its_robot_and_halts_first(controls: Any, wait: Any, fleet: Any) -> None:
    anna, bert, carl = fleet("/anna", "/bert", "/carl")
    root = controls.show(FLEET, 700, 500)
    focused(controls, wait)
    tiles, drive = root.property("tiles"), root.property("drive")
    wait(lambda: names(tiles) == ["anna", "bert", "carl"])
    assert tiles.property("selected") == "/anna"

    def steers() -> bool:
        if not root.steer():
            drive.release(root.property("stick"))
        return bool(anna.commands) and anna.commands[-1] > 0

    wait(steers, lambda: drive.property("problem"))
    place = tile(controls, 1).mapToScene(QtCore.QPointF(20, 40)).toPoint()
    test.mouseClick(
        controls.window, QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier(0), place
    )
    assert tiles.property("selected") == "/bert"
    wait(lambda: anna.commands[-3:] == [0.0] * 3)
    assert "/bert" in root.property("log").toVariant()
    assert root.property("log").toVariant()[0] == "halted"
    for _ in range(3):
        root.steer()
        wait.nothing_happens(0.04)
    assert not any(bert.commands)
    # By keyboard, also the one that is selected already.
    test.keyClick(controls.window, Key.Key_Return)
    test.keyClick(controls.window, Key.Key_Right)
    test.keyClick(controls.window, Key.Key_Return)
    assert root.property("log").toVariant()[-2:] == ["/bert", "/carl"]
    assert tiles.property("selected") == "/carl"
    assert not any(carl.commands)


def test_only_tiles_in_sight_receive_cameras(controls: Any, wait: Any, fleet: Any) -> None:
    robots = fleet(*(f"/robot{at:02}" for at in range(12)), camera=True)
    tiles = controls.show("RobotTiles { anchors.fill: parent; tileWidth: 300 }", 400, 260)
    wait(lambda: len(names(tiles)) == 12)

    def received() -> list[int]:
        return [at for at, robot in enumerate(robots) if robot.camera.subscription_count()]

    wait(lambda: received() == [0], received)
    focused(controls, wait)
    tiles.forceActiveFocus()
    for _ in range(20):
        test.keyClick(controls.window, Key.Key_Down)
    wait(lambda: received() == [11], received)
    # Batteries of all of them are received: a robot out of sight may be in trouble.
    assert all(robot.battery.subscription_count() for robot in robots)
    tiles.setProperty("visible", False)
    wait(lambda: received() == [])
    wait(lambda: not any(robot.battery.subscription_count() for robot in robots))


def test_twins_and_robots_that_leave_are_named(controls: Any, wait: Any, fleet: Any) -> None:
    _, _, bert = fleet("/anna", "/anna", "/bert")
    tiles = controls.show('RobotTiles { anchors.fill: parent; namespaces: ["anna", "bert"] }', 700)

    def status(index: int) -> str:
        return str(controls.find("frame", tile(controls, index)).property("status"))

    wait(lambda: status(0) == "TWO OF THIS NAME")
    assert text(controls, 0, "alarm") == (
        "2 robots of this name: that many nodes are called /anna/base"
    )
    assert tiles.property("troubled") >= 1
    bert.close()
    wait(lambda: status(1) == "GONE")


def test_hostile_values_are_shown_in_words(controls: Any, wait: Any, fleet: Any) -> None:
    (anna,) = fleet("/" + "a" * 200)
    tiles = controls.show("RobotTiles { anchors.fill: parent }", 400)
    wait(lambda: len(names(tiles)) == 1)

    def shown() -> bool:
        anna.battery.publish(percentage=float("nan"))
        anna.mode.publish(data="<b>x</b>" * 10_000)
        return text(controls, 0, "battery") == "? %" and text(controls, 0, "mode") != ""

    wait(shown)
    assert len(text(controls, 0, "mode")) < 60
    mode = controls.find("mode", tile(controls, 0))
    assert mode.property("width") <= tile(controls, 0).property("width")


def test_robots_beyond_the_tiles_are_counted(controls: Any) -> None:
    listed = ", ".join(f'"r{at:03}"' for at in range(120))
    tiles = controls.show(f"RobotTiles {{ anchors.fill: parent; namespaces: [{listed}] }}")
    assert tile(controls, 99)
    assert "20 not shown" in tiles.property("note")


def test_without_robots_it_says_what_is_missing(controls: Any, wait: Any) -> None:
    tiles = controls.show('RobotTiles { anchors.fill: parent; topic: "steer" }')
    wait(lambda: tiles.property("status") == "no robot: no namespace has steer")
