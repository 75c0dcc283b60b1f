"""RobotSwitch and WhoSteers."""

from __future__ import annotations

from typing import Any

import pytest

from rosglass.qt import QtCore, QtGui, optional

pytestmark = pytest.mark.both_qt
TWIST = "geometry_msgs/msg/Twist"
test = optional("QtTest").QTest
Key = QtCore.Qt.Key

FLEET = """Item {
    property QtObject robots: robotsId; property QtObject drive: driveId
    property QtObject stick: stickId
    property var halts: []
    width: 300; height: 200
    Item { id: stickId; objectName: "stick"; width: 10; height: 10 }
    TwistCommand {
        id: driveId
        ns: robotsId.current
        type: "geometry_msgs/msg/Twist"
        onHalted: function(reason) { made.halts = made.halts.concat([reason]) }
    }
    RobotSwitch { id: robotsId; width: 300; command: driveId }
    function steer() { return driveId.steer(stickId, 1, 0) }
}"""


def subscribe(controls: Any, namespace: str) -> tuple[list[float], Any]:
    got: list[float] = []
    topic = f"{namespace}/cmd_vel"
    return got, controls.robot.create_subscription(topic, TWIST, lambda m: got.append(m.linear.x))


def names(robots: Any) -> list[str]:
    return [one["name"] for one in robots.property("found").toVariant()]


def test_robots_are_found_and_switching_halts(controls: Any, wait: Any) -> None:
    anna, keep_anna = subscribe(controls, "/anna")
    bert, keep_bert = subscribe(controls, "/bert")
    root = controls.show(FLEET)
    controls.window.requestActivate()
    wait(lambda: QtGui.QGuiApplication.focusWindow() is not None)
    robots, drive = root.property("robots"), root.property("drive")
    wait(lambda: names(robots) == ["anna", "bert"])
    assert robots.property("current") == "/anna"
    wait(lambda: drive.property("problem") == "")

    def steers(got: list[float]) -> bool:
        # What is refused has to be let go before it is tried again.
        if not root.steer():
            drive.release(root.property("stick"))
        return bool(got) and got[-1] > 0

    wait(lambda: steers(anna), lambda: drive.property("problem"))
    robots.select("/bert")
    wait(lambda: len(anna) >= 3 and anna[-3:] == [0.0] * 3)
    assert root.property("halts").toVariant()
    assert bert == []
    # What is held has to be let go first.
    for _ in range(4):
        root.steer()
        wait.nothing_happens(0.04)
    assert [one for one in bert if one] == []
    drive.release(root.property("stick"))
    wait(lambda: steers(bert), lambda: drive.property("problem"))
    assert anna[-1] == 0
    keep_anna.close()
    keep_bert.close()


def test_a_robot_that_leaves_is_said_to_be_gone(controls: Any, wait: Any) -> None:
    _, keep_anna = subscribe(controls, "/anna")
    _, keep_bert = subscribe(controls, "/bert")
    robots = controls.show("RobotSwitch { width: 300 }")
    wait(lambda: robots.property("current") == "/anna")
    keep_anna.close()
    wait(lambda: robots.property("status") == "anna is not there")
    assert names(robots) == ["anna", "bert"]
    robots.next(1)
    assert robots.property("current") == "/bert"
    wait(lambda: names(robots) == ["bert"])
    keep_bert.close()


def test_given_namespaces_are_listed_before_they_are_there(controls: Any, wait: Any) -> None:
    robots = controls.show('RobotSwitch { width: 300; namespaces: ["anna", "/bert/"] }')
    assert names(robots) == ["anna", "bert"]
    assert robots.property("current") == ""
    _, keep = subscribe(controls, "/bert")
    wait(lambda: [one["present"] for one in robots.property("found").toVariant()] == [False, True])
    keep.close()


def test_two_robots_of_one_name_are_named(controls: Any, wait: Any) -> None:
    nodes = [controls.bench.world.connect(None, "base", "/anna") for _ in range(2)]
    keep = [node.create_subscription("/anna/cmd_vel", TWIST, lambda _: None) for node in nodes]
    robots = controls.show("RobotSwitch { width: 300 }")
    wait(lambda: robots.property("status").startswith("2 robots of this name"))
    assert "/anna/base" in robots.property("status")
    for one in (*keep, *nodes):
        one.close()


def test_robots_are_selected_by_keyboard(controls: Any, wait: Any) -> None:
    keep = [subscribe(controls, name)[1] for name in ("/anna", "/bert", "/carl")]
    robots = controls.show("RobotSwitch { width: 300 }")
    controls.window.requestActivate()
    wait(lambda: QtGui.QGuiApplication.focusWindow() is not None)
    wait(lambda: len(names(robots)) == 3)
    test.keyClick(controls.window, Key.Key_Tab)
    assert controls.find("robot0").property("activeFocus")
    test.keyClick(controls.window, Key.Key_Left)
    assert controls.find("robot2").property("activeFocus")
    test.keyClick(controls.window, Key.Key_Return)
    assert robots.property("current") == "/carl"
    for one in keep:
        one.close()


def findings(who: Any) -> list[str]:
    return [one["text"] for one in who.property("findings").toVariant()]


def test_other_publishers_are_named(controls: Any, wait: Any) -> None:
    _, keep = subscribe(controls, "")
    who = controls.show("WhoSteers { width: 300; TwistCommand {} }")
    wait(lambda: findings(who) == ["only this screen"])
    nav = controls.bench.world.connect(None, "nav2", "/")
    publisher = nav.create_publisher("/cmd_vel", TWIST)
    wait(lambda: findings(who) == ["/nav2 also publishes /cmd_vel"])
    assert who.property("level") == 1
    assert controls.find("finding0").property("text") == "/nav2 also publishes /cmd_vel"
    who.setProperty("allowed", ["/nav2"])
    wait(lambda: findings(who) == ["only this screen", "/nav2 may steer by /cmd_vel"])
    publisher.close()
    wait(lambda: findings(who) == ["only this screen"])
    keep.close()
    wait(lambda: findings(who) == ["no node receives /cmd_vel"])
    nav.close()


def test_nodes_of_one_name_are_named(controls: Any, wait: Any) -> None:
    nodes = [controls.bench.world.connect(None, "base", "/") for _ in range(2)]
    keep = [node.create_subscription("/cmd_vel", TWIST, lambda _: None) for node in nodes]
    who = controls.show("WhoSteers { width: 300 }")
    wait(lambda: "2 nodes are called /base: all obey, or all steer" in findings(who))
    assert who.property("level") == 2
    for one in (*keep, *nodes):
        one.close()


def test_locks_of_a_multiplexer_are_read(controls: Any, wait: Any) -> None:
    mux = controls.bench.world.connect(None, "twist_mux", "/")
    keep = [
        mux.create_subscription("/cmd_vel", TWIST, lambda _: None),
        mux.create_subscription("/nav_vel", TWIST, lambda _: None),
        mux.create_subscription("/pause", "std_msgs/msg/Bool", lambda _: None),
    ]
    nav = controls.robot.create_publisher("/nav_vel", TWIST)
    lock = controls.robot.create_publisher("/pause", "std_msgs/msg/Bool")
    who = controls.show("WhoSteers { width: 300 }")
    wait(
        lambda: "/robot steers by /nav_vel through /twist_mux" in findings(who),
        lambda: findings(who),
    )
    wait(lambda: "lock /pause: nothing received" in findings(who))
    wait(lock.subscription_count)

    def locked(on: bool) -> bool:
        lock.publish(data=on)
        return ("locked by /pause: commands are not passed on" in findings(who)) == on

    wait(lambda: locked(True))
    wait(lambda: locked(False))
    lock.close()
    wait(lambda: "lock /pause: nothing received" in findings(who))
    for one in (*keep, nav, mux):
        one.close()
