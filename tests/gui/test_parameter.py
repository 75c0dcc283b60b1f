"""The element Parameter on a robot's node."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from rosglass.comm.parameters import ParameterDescriptor, Range

if TYPE_CHECKING:
    from conftest import Bench

QML = """
    QtObject {
        property Parameter p: Parameter { nodeName: "/robot"; name: "speed" }
        property string refused
        property Connections c: Connections {
            target: p; function onRejected(reason) { refused = reason }
        }
        function shown() { return JSON.stringify(p.value) }
        function info() {
            return [p.ready, p.pending, p.type, p.description, p.readOnly, p.minimum,
                    p.maximum, p.problem].join()
        }
        function set(value) { p.value = value }
        function ask(node) { p.nodeName = node }
    }
"""

#: Parameters of ROS 1 have no descriptions, and refuse nothing.
ROS2 = pytest.mark.parametrize("url", ["zenoh"], indirect=True, scope="module")


@pytest.fixture
def ros2(live: Bench) -> Bench:
    descriptor = ParameterDescriptor(description="Highest speed", range=Range(0.0, 2.0))
    live.robot.parameters.declare("speed", 1.5, descriptor)
    return live


def test_reading_and_setting(live: Bench, wait: Any) -> None:
    live.robot.parameters.declare("speed", 1.5)
    root: Any = live.load(QML)
    wait(lambda: root.shown() == "1.5")
    root.set(1)
    wait(lambda: live.robot.parameters.get("speed") == 1.0)
    wait(lambda: root.shown() == "1")
    live.robot.parameters.set({"speed": 0.25})
    wait(lambda: root.shown() == "0.25")


@ROS2
def test_description_is_shown(ros2: Bench, wait: Any) -> None:
    root: Any = ros2.load(QML)
    wait(lambda: root.info().startswith("true,false,double"))
    assert root.info() == "true,false,double,Highest speed,false,0,2,"


@ROS2
def test_refused_values_are_reported(ros2: Bench, wait: Any, caplog: Any) -> None:
    root: Any = ros2.load(QML)
    wait(lambda: root.shown() == "1.5")
    root.set(99)
    wait(lambda: root.property("refused"))
    assert root.shown() == "1.5"
    assert "speed" in caplog.text
    root.set("fast")
    wait(lambda: not root.info().startswith("true,true"))
    assert ros2.robot.parameters.get("speed") == 1.5


def test_a_node_that_comes_and_goes(live: Bench, wait: Any) -> None:
    root: Any = live.load(QML.replace("/robot", "/arm"))
    wait.settled(live.session)
    assert root.shown() is None or root.shown() in {"undefined", ""}
    arm = live.world.connect(None, "arm")
    arm.parameters.declare("speed", 3)
    wait(lambda: root.shown() == "3")
    root.set(4)
    wait(lambda: arm.parameters.get("speed") == 4)
    arm.close()
    if not live.session.url.startswith("ros1"):
        wait(lambda: root.info().startswith("false"))


def test_setting_too_early_is_logged(bench: Any, caplog: Any) -> None:
    root: Any = bench.load(QML)
    root.set(1)
    assert "nothing was set" in caplog.text


def test_it_is_ready_only_with_a_value(live: Bench, wait: Any) -> None:
    # ROS 1's parameters outlive their node, and with it the test.
    root: Any = live.load(QML.replace('"speed"', '"gain"'))
    wait(lambda: "/robot has no parameter 'gain'" in root.info())
    assert root.info().startswith("false,false")
    live.robot.parameters.declare("gain", 1.5)
    wait(lambda: root.info().startswith("true,false") and root.shown() == "1.5")
    live.robot.parameters.undeclare("gain")
    wait(lambda: root.info().startswith("false,false"))
    assert root.shown() in {None, "", "undefined"}
    wait(lambda: "/robot has no parameter 'gain'" in root.info())


def test_a_wrong_name_of_the_node_is_named(live: Bench, wait: Any) -> None:
    live.robot.parameters.declare("speed", 1.5)
    # In ROS 1, a node that neither publishes nor serves anything is not in the graph.
    live.robot.create_publisher("/scan", "sensor_msgs/LaserScan")
    root: Any = live.load(QML.replace("/robot", "/robto"))
    wait(lambda: "/robto" in root.info() and "did you mean /robot?" in root.info())
    assert root.info().startswith("false,false")
    root.ask("/robot")
    wait(lambda: root.info().startswith("true") and root.info().endswith(","))


@ROS2
def test_problem_stays_until_it_is_solved(ros2: Bench, wait: Any) -> None:
    root: Any = ros2.load(QML.replace('"speed"', '"sped"'))
    wait(lambda: "/robot has no parameter 'sped'; did you mean speed?" in root.info())
    ticks: list[None] = []
    ros2.session.tick.connect(lambda: ticks.append(None))
    wait(lambda: len(ticks) > 3)
    assert "has no parameter 'sped'" in root.info()
    assert root.info().startswith("false,false")
    ros2.robot.parameters.declare("sped", 2)
    wait(lambda: root.info().endswith(","))
    assert root.shown() == "2"


def test_nothing_is_pending_without_a_node(live: Bench, wait: Any) -> None:
    live.robot.parameters.declare("speed", 1.5)
    root: Any = live.load(QML)
    wait(lambda: root.info().startswith("true,false"))
    root.set(1)
    assert root.info().startswith("true,true")
    live.session.shutdown()
    wait(lambda: root.info().startswith("false,false"))


@ROS2
def test_ready_follows_the_received_values(live: Bench, wait: Any) -> None:
    """A node that was restarted must not be shown with the values of before as its own."""
    root: Any = live.load("""
        QtObject {
            property var log: []
            property Parameter p: Parameter {
                nodeName: "/arm"; name: "speed"; onReadyChanged: log.push(ready + " " + value)
            }
            function states() { return log.join() }
        }
    """)
    for value, states in ((3, "true 3"), (5, "true 3,false 3,true 5")):
        arm = live.world.connect(None, "arm")
        arm.parameters.declare("speed", value)
        wait(lambda states=states: root.states() == states)
        arm.close()
        wait(lambda states=states: root.states().startswith(f"{states},false"))


@ROS2
def test_missed_change_is_found(ros2: Bench, wait: Any, monkeypatch: Any) -> None:
    """The first changes after a node appears may be missed."""
    from rosglass.qml.elements.parameter import ParameterLink

    monkeypatch.setattr(ParameterLink, "_on_event", lambda link, event: None)
    root: Any = ros2.load(QML)
    wait(lambda: root.shown() == "1.5")
    ros2.robot.parameters.set({"speed": 0.25})
    wait(lambda: root.shown() == "0.25")
