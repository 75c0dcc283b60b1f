"""EmergencyStop, against robots that latch, that have a counter, or services."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from hands import press, release

from rosglass.qt import QtCore, QtGui, optional

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.both_qt
test = optional("QtTest").QTest
Key = QtCore.Qt.Key


class Latch:
    """A robot's emergency stop, by topics.

    Attributes:
        obeys: Whether commands have an effect.
        commands: What it was sent: True, False, or the number of a release.
    """

    def __init__(self, node: Any, base: str = "/emergency_stop", counter: bool = False) -> None:
        self.stopped, self.obeys, self.commands = False, True, []
        self.state = node.create_publisher(f"{base}/state", "std_msgs/msg/Bool")
        self.counter = (
            node.create_publisher(f"{base}/counter", "std_msgs/msg/UInt32") if counter else None
        )
        self.number = 100
        self.keep = [
            node.create_subscription(base, "std_msgs/msg/Bool", self._on_stop),
            node.create_subscription(f"{base}/release", "std_msgs/msg/UInt32", self._on_release),
        ]
        self.timer = node.create_timer(0.05, self.report)

    def report(self) -> None:
        if self.counter is not None:
            self.number += 1
            self.counter.publish(data=self.number)
        self.state.publish(data=self.stopped)

    def _on_stop(self, message: Any) -> None:
        self.commands.append(message.data)
        if self.obeys and (message.data or self.counter is None):
            self.stopped = message.data

    def _on_release(self, message: Any) -> None:
        self.commands.append(int(message.data))
        if self.obeys and self.counter is not None and self.number - message.data < 20:
            self.stopped = False

    def close(self) -> None:
        self.timer.close()
        for one in (*self.keep, self.state, self.counter):
            if one is not None:
                one.close()


@pytest.fixture
def latch(controls: Any) -> Iterator[Latch]:
    made = Latch(controls.robot)
    yield made
    made.close()


def show(controls: Any, wait: Any, qml: str = "EmergencyStop { width: 160; height: 160 }") -> Any:
    stop = controls.show(qml)
    controls.window.requestActivate()
    wait(lambda: QtGui.QGuiApplication.focusWindow() is not None)
    return stop


def confirmation(controls: Any) -> str:
    return str(controls.find("confirmation").property("text"))


def test_at_the_edge_of_the_window_the_bar_stays_within_reach(
    controls: Any, wait: Any, latch: Latch
) -> None:
    stop = show(controls, wait, "EmergencyStop { width: 160; height: 160 }")
    press(controls, "mushroom")
    release(controls, "mushroom")
    wait(lambda: stop.property("stopped"))
    assert controls.find("unlock").mapToScene(QtCore.QPointF(0, 0)).y() >= 0
    press(controls, "unlock")
    wait(lambda: not latch.stopped)
    release(controls, "unlock")


def test_a_click_stops_and_a_long_press_releases(controls: Any, wait: Any, latch: Latch) -> None:
    stop = show(controls, wait, "EmergencyStop { y: 100; width: 160; height: 160 }")
    wait(lambda: stop.property("known"))
    assert confirmation(controls) == "space bar"
    press(controls, "mushroom")
    release(controls, "mushroom")
    wait(lambda: stop.property("stopped"))
    wait(lambda: confirmation(controls) == "confirmed")
    press(controls, "unlock")
    wait.nothing_happens(0.2)
    release(controls, "unlock")
    wait.nothing_happens(0.7)
    assert latch.stopped, "a short press does not release"
    press(controls, "unlock")
    wait(lambda: not latch.stopped)
    release(controls, "unlock")
    wait(lambda: not stop.property("blocks"))
    assert latch.commands == [True, False]


@pytest.mark.parametrize("name", ["Shift", "Control", "Alt", "Meta"])
def test_the_key_stops_with_a_modifier(controls: Any, wait: Any, latch: Latch, name: str) -> None:
    """The hand that drives may hold one."""
    stop = show(controls, wait)
    modifier = getattr(QtCore.Qt.KeyboardModifier, f"{name}Modifier")
    test.keyClick(controls.window, Key.Key_Space, modifier)
    assert stop.property("blocks")
    wait(lambda: latch.stopped)


def test_an_unconfirmed_stop_is_said_and_sent_again(controls: Any, wait: Any, latch: Latch) -> None:
    latch.obeys = False
    stop = show(controls, wait)
    wait(lambda: stop.property("known"))
    test.keyClick(controls.window, Key.Key_Space)
    assert not stop.property("stopped")
    wait(lambda: stop.property("overdue"))
    assert confirmation(controls).startswith("NOT CONFIRMED")
    assert not stop.property("stopped")
    wait(lambda: latch.commands.count(True) >= 5)
    latch.obeys = True
    wait(lambda: stop.property("stopped"))
    wait(lambda: not stop.property("overdue"))
    # A restart: the robot has forgotten it.
    latch.stopped = False
    wait(lambda: latch.stopped, "the stop is still wanted")


def test_without_a_robot_a_stop_is_kept(controls: Any, wait: Any) -> None:
    stop = show(controls, wait)
    assert confirmation(controls) == "state unknown"
    stop.press()
    wait(lambda: stop.property("overdue"))
    latch = Latch(controls.robot)
    wait(lambda: latch.stopped)
    wait(lambda: confirmation(controls) == "confirmed")
    latch.close()


def test_a_silent_robot_is_unknown_and_one_that_only_latches_is_not(
    controls: Any, wait: Any
) -> None:
    latched = controls.robot.create_publisher("/latched", "std_msgs/msg/Bool", latching())
    latched.publish(data=True)
    repeated = controls.robot.create_publisher("/repeated", "std_msgs/msg/Bool")
    root = show(
        controls,
        wait,
        """Item { property QtObject one: oneId; property QtObject other: otherId
        EmergencyStop { id: oneId; stateTopic: "/latched"; timeout: 300 }
        EmergencyStop { id: otherId; stateTopic: "/repeated"; timeout: 300 } }""",
    )
    one, other = root.property("one"), root.property("other")
    wait(lambda: one.property("stopped"))
    wait(repeated.subscription_count)
    for _ in range(3):
        repeated.publish(data=False)
        wait(lambda: other.property("known"))
        wait.nothing_happens(0.03)
    wait(lambda: not other.property("known"))
    assert one.property("stopped")
    latched.close()
    wait(lambda: not one.property("known"), "its publisher is gone")


def latching() -> Any:
    from rosglass.comm.qos import QoS

    return QoS.latched()


def test_a_release_names_the_robots_counter(controls: Any, wait: Any) -> None:
    latch = Latch(controls.robot, counter=True)
    stop = show(controls, wait)
    stop.press()
    wait(lambda: stop.property("stopped"))
    wait.nothing_happens(0.2)
    number = latch.number
    stop.release()
    wait(lambda: not stop.property("blocks"))
    released = [one for one in latch.commands if one is not True]
    assert number - 2 <= released[0] <= number + 1
    assert len(set(released)) == 1, "the number of the time when it was requested"
    latch.close()


def test_a_release_without_the_number_is_not_sent(controls: Any, wait: Any) -> None:
    latch = Latch(controls.robot, counter=True)
    latch.timer.close()
    latch.stopped = True
    stop = show(controls, wait)
    latch.state.publish(data=True)

    def stopped() -> bool:
        latch.state.publish(data=True)
        return bool(stop.property("stopped"))

    wait(stopped)
    stop.release()
    wait(lambda: stop.property("problem") == "the robot's counter was unknown")
    assert latch.commands == []
    latch.close()


def test_a_stop_by_another_operator_is_shown(controls: Any, wait: Any, latch: Latch) -> None:
    stop = show(controls, wait)
    wait(lambda: stop.property("known"))
    latch.stopped = True
    wait(lambda: confirmation(controls) == "by someone else")
    stop.release()
    wait(lambda: not latch.stopped)
    wait(lambda: not stop.property("stopped"))
    latch.stopped = True
    wait(lambda: confirmation(controls) == "held by someone else")


def test_the_space_bar_stops_wherever_the_focus_is(controls: Any, wait: Any, latch: Latch) -> None:
    root = show(
        controls,
        wait,
        """Item {
        property QtObject stop: stopId; property QtObject field: fieldId
        property QtObject button: buttonId
        EmergencyStop { id: stopId; width: 100; height: 100 }
        ThemeButton { id: buttonId; y: 200; property int clicks: 0; onClicked: clicks += 1 }
        ThemeField { id: fieldId; y: 240 }
        property QtObject plain: plainId
        Item { id: plainId } }""",
    )
    stop, field, button = (root.property(name) for name in ("stop", "field", "button"))
    field.forceActiveFocus()
    test.keyClick(controls.window, Key.Key_Space)
    assert field.property("text") == " "
    assert not stop.property("blocks")
    button.forceActiveFocus()
    test.keyClick(controls.window, Key.Key_Space)
    assert stop.property("blocks")
    assert button.property("clicks") == 0
    wait(lambda: latch.stopped)
    # Enter is the button's, while that has the focus.
    test.keyClick(controls.window, Key.Key_Return)
    assert button.property("clicks") == 1
    root.property("plain").forceActiveFocus()
    test.keyPress(controls.window, Key.Key_Return)
    wait(lambda: not latch.stopped)
    test.keyRelease(controls.window, Key.Key_Return)


def test_enter_does_not_release_by_a_hidden_button(controls: Any, wait: Any, latch: Latch) -> None:
    stop = show(controls, wait)
    stop.press()
    wait(lambda: stop.property("stopped"))
    stop.setProperty("visible", False)
    test.keyPress(controls.window, Key.Key_Enter)
    wait.nothing_happens(1.0)
    test.keyRelease(controls.window, Key.Key_Enter)
    assert latch.stopped
    test.keyClick(controls.window, Key.Key_Space)
    assert stop.property("wanted"), "it stops, hidden or not"


def test_enter_has_to_be_held(controls: Any, wait: Any, latch: Latch) -> None:
    stop = show(controls, wait)
    stop.press()
    wait(lambda: stop.property("stopped"))
    test.keyPress(controls.window, Key.Key_Enter)
    wait.nothing_happens(0.2)
    test.keyRelease(controls.window, Key.Key_Enter)
    wait.nothing_happens(0.8)
    assert latch.stopped
    # As X11 repeats a key that is held down.
    test.keyPress(controls.window, Key.Key_Enter)
    for _ in range(4):
        wait.nothing_happens(0.04)
        test.keyRelease(controls.window, Key.Key_Enter)
        test.keyPress(controls.window, Key.Key_Enter)
    test.keyClick(controls.window, Key.Key_Space)
    for _ in range(20):
        wait.nothing_happens(0.04)
        test.keyRelease(controls.window, Key.Key_Enter)
        test.keyPress(controls.window, Key.Key_Enter)
    assert latch.stopped, "stopping goes before releasing"
    test.keyRelease(controls.window, Key.Key_Enter)
    wait.nothing_happens(0.1)
    test.keyPress(controls.window, Key.Key_Enter)
    for _ in range(20):
        wait.nothing_happens(0.04)
        test.keyRelease(controls.window, Key.Key_Enter)
        test.keyPress(controls.window, Key.Key_Enter)
    wait(lambda: not latch.stopped)
    test.keyRelease(controls.window, Key.Key_Enter)


def test_a_hold_ends_with_the_focus(controls: Any, wait: Any, latch: Latch) -> None:
    stop = show(controls, wait)
    stop.press()
    wait(lambda: stop.property("stopped"))
    test.keyPress(controls.window, Key.Key_Return)
    other = QtGui.QWindow()
    other.show()
    other.requestActivate()
    wait.nothing_happens(1.0)
    assert latch.stopped
    other.destroy()


def test_the_space_bar_stops_every_robot(controls: Any, wait: Any) -> None:
    latches = [Latch(controls.robot, f"/{name}/emergency_stop") for name in ("a", "b")]
    show(controls, wait, 'Row { EmergencyStop { ns: "/a" } EmergencyStop { ns: "/b" } }')
    test.keyClick(controls.window, Key.Key_Space)
    wait(lambda: all(latch.stopped for latch in latches))
    for latch in latches:
        latch.close()


def test_another_robot_gets_no_command_meant_for_the_first(controls: Any, wait: Any) -> None:
    first, second = (Latch(controls.robot, f"/{name}/emergency_stop") for name in ("a", "b"))
    stop = show(controls, wait, 'EmergencyStop { ns: "/a"; width: 160; height: 160 }')
    wait(lambda: stop.property("known"))
    first.obeys = False
    stop.press()
    wait(lambda: stop.property("overdue"))
    stop.setProperty("ns", "/b")
    wait(lambda: stop.property("known"))
    assert not stop.property("blocks")
    assert "last robot was not confirmed" in confirmation(controls)
    assert second.commands == []
    stop.press()
    wait(lambda: second.stopped)
    for latch in (first, second):
        latch.close()


def test_services_stop_and_release(controls: Any, wait: Any) -> None:
    calls: list[Any] = []

    def on_call(request: Any) -> dict[str, Any]:
        calls.append(request.data)
        return {"success": len(calls) > 1, "message": "motors are busy"}

    server = controls.robot.create_service_server("/halt", "std_srvs/srv/SetBool", on_call)
    stop = show(controls, wait, 'EmergencyStop { service: "/halt"; width: 160; height: 160 }')
    stop.press()
    assert not stop.property("stopped")
    wait(lambda: stop.property("stopped"))
    assert calls[:2] == [True, True], "refused, and asked again"
    assert stop.property("problem") == ""
    stop.release()
    wait(lambda: not stop.property("blocks"))
    assert calls[-1] is False
    server.close()


def test_triggers_stop_and_release(controls: Any, wait: Any) -> None:
    calls: list[str] = []

    def server(name: str, success: bool) -> Any:
        def on_call(_: Any) -> dict[str, Any]:
            calls.append(name)
            return {"success": success, "message": "a person is near"}

        return controls.robot.create_service_server(f"/{name}", "std_srvs/srv/Trigger", on_call)

    servers = [server("stop", True), server("release", False)]
    stop = show(
        controls,
        wait,
        'EmergencyStop { service: "/stop"; releaseService: "/release"; width: 160; height: 160 }',
    )
    stop.press()
    wait(lambda: stop.property("stopped"))
    stop.release()
    wait(lambda: stop.property("problem") == "refused: a person is near")
    assert stop.property("stopped")
    assert stop.property("blocks")
    assert calls == ["stop", "release"], "a refused release is not repeated"
    for one in servers:
        one.close()


def test_a_service_that_is_missing_is_said(controls: Any, wait: Any) -> None:
    stop = show(controls, wait, 'EmergencyStop { service: "/halt"; width: 160; height: 160 }')
    stop.press()
    wait(lambda: stop.property("overdue"))
    assert confirmation(controls).startswith("NOT CONFIRMED")
    called: list[bool] = []
    server = controls.robot.create_service_server(
        "/halt",
        "std_srvs/srv/SetBool",
        lambda request: called.append(request.data) or {"success": True, "message": ""},
    )
    wait(lambda: stop.property("stopped"))
    server.close()
    wait(lambda: not stop.property("known"))


def test_topics_and_services_over_a_real_middleware(live_controls: Any, wait: Any) -> None:
    controls = live_controls
    latch = Latch(controls.robot, counter=True)
    calls: list[bool] = []
    server = controls.robot.create_service_server(
        "/halt",
        "std_srvs/srv/SetBool",
        lambda request: calls.append(request.data) or {"success": True, "message": ""},
    )
    root = show(
        controls,
        wait,
        """Item { property QtObject one: oneId; property QtObject other: otherId
        EmergencyStop { id: oneId; width: 160; height: 160 }
        EmergencyStop { id: otherId; x: 200; service: "/halt"; width: 160; height: 160 } }""",
    )
    one, other = root.property("one"), root.property("other")
    wait(lambda: one.property("known"))
    test.keyClick(controls.window, Key.Key_Space)
    wait(lambda: one.property("stopped") and other.property("stopped"))
    assert latch.stopped
    for stop in (one, other):
        stop.release()
    wait(lambda: not one.property("blocks") and not other.property("blocks"))
    assert not latch.stopped
    assert calls[-1] is False
    server.close()
    latch.close()
