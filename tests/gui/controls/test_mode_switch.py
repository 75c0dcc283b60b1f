"""ModeSwitch, by topics, services and of lifecycle nodes."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest
from hands import click

from rosglass.comm.qos import QoS
from rosglass.qt import QtCore, QtGui, optional

pytestmark = pytest.mark.both_qt
test = optional("QtTest").QTest
STRING = "std_msgs/msg/String"
MODES = 'ModeSwitch { width: 300; timeout: 400; modes: ["manual", "auto"] }'


def outcome(controls: Any) -> str:
    return str(controls.find("outcome").property("text"))


def test_it_shows_the_confirmed_mode_not_the_requested(controls: Any, wait: Any) -> None:
    got: list[str] = []
    state = controls.robot.create_publisher("/mode/state", STRING, QoS.latched())
    keep = controls.robot.create_subscription("/mode", STRING, lambda m: got.append(m.data))
    state.publish(data="manual")
    modes = controls.show(MODES)
    wait(lambda: modes.property("note") == "manual")
    click(controls, "mode1")
    wait(lambda: got == ["auto"])
    assert modes.property("pending")
    assert modes.property("note") == "manual"
    assert controls.find("mode0").property("confirmed")
    assert outcome(controls) == "auto requested, not confirmed yet"
    wait(lambda: "auto was requested, and not confirmed within 0.4 s" in outcome(controls))
    assert not modes.property("pending")
    click(controls, "mode1")
    state.publish(data="auto")
    wait(lambda: modes.property("note") == "auto")
    wait(lambda: not modes.property("pending"))
    assert outcome(controls) == ""
    state.publish(data="<b>nap</b>" * 100)
    wait(lambda: modes.property("note").startswith("<b>nap"))
    assert len(modes.property("note")) <= 64
    state.close()
    wait(lambda: modes.property("stale"))
    keep.close()


def test_integers_have_texts(controls: Any, wait: Any) -> None:
    got: list[int] = []
    state = controls.robot.create_publisher("/mode/state", "std_msgs/msg/UInt8", QoS.latched())
    keep = controls.robot.create_subscription(
        "/mode", "std_msgs/msg/UInt8", lambda m: got.append(m.data)
    )
    state.publish(data=0)
    modes = controls.show(
        """ModeSwitch { width: 300
        modes: [{ value: 0, text: "standby" }, { value: 1, text: "mow" }, { value: 999 }] }"""
    )
    wait(lambda: modes.property("note") == "standby")
    click(controls, "mode1")
    wait(lambda: got == [1])
    state.publish(data=1)
    wait(lambda: modes.property("note") == "mow")
    click(controls, "mode2")
    wait(lambda: "999" in outcome(controls), lambda: outcome(controls))
    assert not modes.property("pending")
    state.close()
    keep.close()


def test_modes_by_services(controls: Any, wait: Any) -> None:
    state = controls.robot.create_publisher("/mode", STRING, QoS.latched())
    state.publish(data="safe")
    server = controls.robot.create_service_server(
        "/mode/auto", "std_srvs/srv/Trigger", lambda _: {"success": False, "message": "no map"}
    )
    modes = controls.show(
        'ModeSwitch { width: 300; stateTopic: "/mode"; service: "/mode/%1"; '
        'modes: ["safe", "auto"] }'
    )
    wait(lambda: modes.property("note") == "safe")
    click(controls, "mode1")
    wait(lambda: outcome(controls) == "refused: no map")
    server.close()
    state.close()


def test_a_topic_of_another_type_is_named(controls: Any, wait: Any) -> None:
    keep = controls.robot.create_subscription("/mode", "std_msgs/msg/Bool", lambda _: None)
    controls.show(MODES)
    wait.nothing_happens(0.2)
    click(controls, "mode0")
    wait(lambda: "std_msgs/msg/Bool, which is not" in outcome(controls))
    keep.close()


def test_an_obstacle_is_said(controls: Any) -> None:
    controls.show('ModeSwitch { width: 300; modes: ["a"]; obstacle: "emergency stop" }')
    click(controls, "mode0")
    assert outcome(controls) == "emergency stop"


class Lifecycle:
    """The services of a lifecycle node."""

    NEXT: ClassVar = {
        ("unconfigured", 1): (2, "inactive"),
        ("inactive", 3): (3, "active"),
        ("active", 4): (2, "inactive"),
        ("inactive", 2): (1, "unconfigured"),
    }

    def __init__(self, node: Any) -> None:
        self.state, self.refuses, self.asked = (1, "unconfigured"), False, []
        self.servers = [
            node.create_service_server(
                "/lidar/get_state",
                "lifecycle_msgs/srv/GetState",
                lambda _: {"current_state": {"id": self.state[0], "label": self.state[1]}},
            ),
            node.create_service_server(
                "/lidar/change_state", "lifecycle_msgs/srv/ChangeState", self.change
            ),
        ]

    def change(self, request: Any) -> dict[str, Any]:
        self.asked.append(request.transition.id)
        after = self.NEXT.get((self.state[1], request.transition.id))
        if after is None or self.refuses:
            return {"success": False}
        self.state = after
        return {"success": True}

    def close(self) -> None:
        for server in self.servers:
            server.close()


def test_a_lifecycle_node_is_brought_to_a_state_by_its_transitions(
    controls: Any, wait: Any
) -> None:
    lidar = Lifecycle(controls.robot)
    modes = controls.show('ModeSwitch { width: 400; nodeName: "/lidar" }')
    wait(lambda: modes.property("note") == "unconfigured")
    click(controls, "mode2")
    wait(lambda: modes.property("note") == "active")
    wait(lambda: not modes.property("pending"))
    assert lidar.asked == [1, 3]
    lidar.refuses = True
    click(controls, "mode1")
    wait(lambda: outcome(controls) == "refused: /lidar did not become inactive")
    assert modes.property("note") == "active"
    lidar.close()
    wait(lambda: modes.property("status"))


def test_a_lifecycle_node_that_is_missing_is_named(controls: Any, wait: Any) -> None:
    modes = controls.show('ModeSwitch { width: 400; nodeName: "/lidar" }')
    wait(lambda: "/lidar/get_state" in modes.property("status"), timeout=20)
    click(controls, "mode2")
    assert "unknown" in outcome(controls)


def test_modes_are_reached_by_keyboard(controls: Any, wait: Any) -> None:
    modes = controls.show(MODES)
    controls.window.requestActivate()
    wait(lambda: QtGui.QGuiApplication.focusWindow() is not None)
    key = QtCore.Qt.Key
    test.keyClick(controls.window, key.Key_Tab)
    test.keyClick(controls.window, key.Key_Right)
    assert controls.find("mode1").property("activeFocus")
    test.keyClick(controls.window, key.Key_Enter)
    wait(lambda: modes.property("requested") == "auto" or outcome(controls))


def test_modes_over_a_real_middleware(live_controls: Any, wait: Any) -> None:
    controls = live_controls
    state = controls.robot.create_publisher("/mode/state", STRING, QoS.latched())
    keep = controls.robot.create_subscription("/mode", STRING, state.publish)
    state.publish(data="manual")
    modes = controls.show('ModeSwitch { width: 300; modes: ["manual", "auto"] }')
    wait(lambda: modes.property("note") == "manual")
    click(controls, "mode1")
    wait(lambda: modes.property("note") == "auto" and not modes.property("pending"))
    keep.close()
    state.close()


def test_a_repeated_mode_that_falls_silent_is_out_of_date(controls: Any, wait: Any) -> None:
    state = controls.robot.create_publisher("/mode/state", STRING, QoS.latched())
    state.publish(data="manual")
    modes = controls.show('ModeSwitch { stateTimeout: 200; modes: ["manual"] }')
    wait(lambda: modes.property("note") == "manual")
    wait(lambda: modes.property("stale"))
    assert not controls.find("mode0").property("confirmed")
    state.publish(data="manual")
    wait(lambda: not modes.property("stale"))
    state.close()
