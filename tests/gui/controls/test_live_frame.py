"""The frame of all controls: what it says without a connection, and reasons that have no room."""

from __future__ import annotations

from typing import Any

import pytest
from hands import centre, click
from ports import free_port

pytestmark = pytest.mark.both_qt

#: Controls of which each shows something of a robot.
CONTROLS = """
    ActionPanel { action: "/spin" }
    AlarmList {}
    Attitude {}
    Battery {}
    Battery { topic: "/battery" }
    CameraView {}
    CameraView { topic: "/camera" }
    Compass {}
    DiagnosticsView {}
    GeoMap {}
    Gauge { path: "/battery:percentage" }
    JointView {}
    LogView {}
    MapView {}
    MessageView { topic: "/odom" }
    ModeSwitch { modes: ["manual"]; topic: "/mode" }
    ModeSwitch { nodeName: "/camera" }
    NodeGraph {}
    ParameterForm { nodeName: "/camera" }
    Plot { paths: ["/odom:twist.twist.linear.x"] }
    Recorder {}
    RobotSwitch {}
    ServiceButton { service: "/dock" }
    Speed {}
    TfTree {}
    TopicTree {}
    WhoSteers {}
"""


@pytest.fixture
def unconnected(app: Any, tmp_path: Any, request: Any) -> Any:
    """A bench whose session finds no router or master, and the address."""
    from conftest import Bench, RealWorld
    from rosglass.controls import register
    from rosglass.qml import Session, install
    from rosglass.qt import QtQml, send_deferred_deletes

    register()
    url = f"{request.param}://127.0.0.1:{free_port()}"
    session = Session(url)
    engine = QtQml.QQmlEngine()
    install(engine, session)
    world: Any = RealWorld("local://elsewhere")
    bench = Bench(session, engine, world, tmp_path)
    bench.url = url  # type: ignore[attr-defined]
    yield bench
    bench.close()
    bench.robot.close()
    send_deferred_deletes()
    engine.deleteLater()
    send_deferred_deletes()


def show(bench: Any, controls: str) -> Any:
    return bench.load(
        f"Item {{ width: 400; height: 300\n{controls} }}",
        "import QtQuick 2.15\nimport RosControls 1.0",
    )


@pytest.mark.parametrize("unconnected", ["zenoh", "ros1"], indirect=True)
def test_every_control_says_that_the_robot_is_not_connected(unconnected: Any, wait: Any) -> None:
    root = show(unconnected, CONTROLS)
    assert all("Ros2.init() was not called" in one.property("status") for one in root.childItems())
    unconnected.session.init("ui")
    wait(lambda: "127.0.0.1" in unconnected.session.detail)
    reason = f"the robot is not connected: {unconnected.session.detail}"
    for one in root.childItems():
        wait(lambda one=one: reason in one.property("status"))


@pytest.mark.parametrize("unconnected", ["zenoh"], indirect=True)
def test_missing_topic_is_said_once_connected(unconnected: Any, wait: Any) -> None:
    from rosglass.wires.zenoh.router import Router

    root = show(unconnected, 'Battery {}\nCameraView {}\nServiceButton { service: "/dock" }')
    battery, camera, button = root.childItems()
    unconnected.session.init("ui")
    wait(lambda: "not connected: no answer" in battery.property("status"))
    with Router(unconnected.url.replace("zenoh://", "tcp/")):
        wait(lambda: battery.property("status") == "NO DATA YET")
        wait(lambda: camera.property("status") == "NO SIGNAL: no camera found")
        wait(lambda: button.property("status").startswith("NOT AVAILABLE"))
    wait(lambda: "not connected" in battery.property("status"))


def test_gamepads_and_recordings_need_no_robot(bench: Any) -> None:
    from rosglass.controls import register

    register()
    root = show(bench, "GamepadView {}\nTimeline {}\nLiveFrame {}")
    for one in root.childItems():
        assert "connected" not in one.property("status")


def hover(controls: Any, name: str) -> None:
    from rosglass.qt import QtCore, optional

    test = optional("QtTest").QTest
    test.mouseMove(controls.window, QtCore.QPoint(1, 1))
    test.mouseMove(controls.window, centre(controls.find(name)))


LONG = "the docking station is occupied by another robot; call the operator of bay seven"


def test_reason_of_a_service_is_shown_whole(controls: Any, wait: Any) -> None:
    controls.robot.create_service_server(
        "/dock", "std_srvs/srv/Trigger", lambda _: {"success": False, "message": LONG}
    )
    button = controls.show('ServiceButton { service: "/dock"; x: 150; width: 200 }')
    wait(lambda: button.property("ready"))
    button.call()
    wait(lambda: button.property("outcome") == "refused")
    status = controls.find("status")
    wait(lambda: status.property("truncated"))
    balloon = controls.find("statusBalloon")
    assert not balloon.isVisible()
    hover(controls, "status")
    wait(balloon.isVisible)
    assert controls.find("statusWhole").property("text") == f"REFUSED: {LONG}"
    assert not controls.find("statusWhole").property("truncated")
    assert balloon.x() >= 0
    assert balloon.x() + balloon.width() <= 400
    assert balloon.y() + balloon.height() <= 300
    # Where there is room, it needs no pointer.
    button.setProperty("height", 140)
    wait(lambda: not status.property("truncated"))
    assert not balloon.isVisible()
    assert status.y() + status.height() <= 140


def test_reason_is_shown_by_a_tap_until_the_next(controls: Any, wait: Any) -> None:
    controls.show(f'LiveFrame {{ width: 200; height: 80; title: "Battery"; problem: "{LONG}" }}')
    aside = controls.find("aside")
    wait(lambda: aside.property("truncated"))
    click(controls, "aside")
    hover_away(controls)
    wait(controls.find("asideBalloon").isVisible)
    click(controls, "aside")
    hover_away(controls)
    wait(lambda: not controls.find("asideBalloon").isVisible())


def hover_away(controls: Any) -> None:
    from rosglass.qt import QtCore, optional

    optional("QtTest").QTest.mouseMove(controls.window, QtCore.QPoint(390, 290))


def test_gauge_of_a_text_shows_the_reason_in_its_middle(controls: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/name", "std_msgs/msg/String")
    gauge = controls.show('Gauge { path: "/name:data"; width: 160; height: 160 }')
    wait(publisher.subscription_count)
    publisher.publish(data="seven")
    wait(lambda: "data is a text, not a number" in gauge.property("status"))
    wait(controls.find("wholeProblem").isVisible)
    assert "is a text, not a number" in controls.find("wholeProblem").property("text")
    assert not controls.find("wholeProblem").property("truncated")
