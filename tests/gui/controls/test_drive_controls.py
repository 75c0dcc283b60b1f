"""DriveStick, DriveKeys and WindowKeys."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from rosglass.qt import QtCore, QtGui

if TYPE_CHECKING:
    from collections.abc import Callable

pytestmark = pytest.mark.both_qt
TWIST = "geometry_msgs/msg/Twist"
Key = QtCore.Qt.Key
KEYS = """Item {
    anchors.fill: parent
    property QtObject command: command_
    property Item keys: keys_
    property Item field: field_
    property Item button: button_
    TwistCommand {
        id: command_
        topic: "/cmd_vel"; acceleration: 0; deceleration: 0; turnAcceleration: 0
    }
    DriveKeys { id: keys_; objectName: "keys"; command: command_; speedShare: 1; turnShare: 0.5 }
    ThemeField { id: field_; y: 150 }
    ThemeButton { id: button_; y: 200; text: "button" }
}"""


class Drive:
    """A control in a window, and the last command that the robot received."""

    def __init__(self, controls: Any, wait: Any, declared: str, **size: int) -> None:
        self.controls, self.wait = controls, wait
        self.messages: list[tuple[float, float, float]] = []
        self._subscription = controls.robot.create_subscription(
            "/cmd_vel",
            TWIST,
            lambda m: self.messages.append((m.linear.x, m.linear.y, m.angular.z)),
        )
        self.item = controls.show(declared, **size)
        self.window = controls.window
        self.window.requestActivate()
        wait(self.window.isActive)
        wait(lambda: controls.robot.publishers("/cmd_vel"))
        wait.settled(controls.bench.session)

    def send(self, event: QtCore.QEvent) -> None:
        QtCore.QCoreApplication.sendEvent(self.window, event)

    def key(self, key: Any, *, down: bool, repeats: bool = False, control: bool = False) -> None:
        kinds, modifiers = QtCore.QEvent.Type, QtCore.Qt.KeyboardModifier
        kind = kinds.KeyPress if down else kinds.KeyRelease
        held = modifiers.ControlModifier if control else modifiers.NoModifier
        self.send(QtGui.QKeyEvent(kind, key, held, "", repeats))

    def mouse(self, kind: str, x: float, y: float) -> None:
        kinds, buttons = QtCore.QEvent.Type, QtCore.Qt.MouseButton
        of = {"press": kinds.MouseButtonPress, "move": kinds.MouseMove}
        event_kind, at = of.get(kind, kinds.MouseButtonRelease), QtCore.QPointF(x, y)
        button = buttons.NoButton if kind == "move" else buttons.LeftButton
        held = buttons.NoButton if kind == "release" else buttons.LeftButton
        no_keys = QtCore.Qt.KeyboardModifier.NoModifier
        self.send(QtGui.QMouseEvent(event_kind, at, at, at, button, held, no_keys))

    def moves(self, *expected: float) -> None:
        wanted = pytest.approx(expected, abs=0.02)
        self.wait(lambda: bool(self.messages) and self.messages[-1] == wanted)

    def stands(self) -> None:
        def still() -> bool:
            return len(self.messages) >= 3 and set(self.messages[-3:]) == {(0.0, 0.0, 0.0)}

        self.wait(still)


@pytest.fixture
def keys(controls: Any, wait: Any) -> Drive:
    return Drive(controls, wait, KEYS)


@pytest.fixture
def stick(controls: Any, wait: Any) -> Drive:
    declared = """DriveStick {
        width: 200; height: 200
        command: TwistCommand {
            topic: "/cmd_vel"; acceleration: 0; deceleration: 0; turnAcceleration: 0
            maxSideways: 0.5
        }
    }"""
    return Drive(controls, wait, declared)


def test_keys_steer_while_they_are_held(keys: Drive) -> None:
    keys.key(Key.Key_W, down=True)
    keys.moves(0.5, 0, 0)
    keys.key(Key.Key_Left, down=True)
    keys.moves(0.5, 0, 0.5)
    keys.key(Key.Key_W, down=False)
    keys.moves(0, 0, 0.5)
    keys.key(Key.Key_S, down=True)
    keys.moves(-0.5, 0, 0.5)
    keys.key(Key.Key_Left, down=False)
    keys.key(Key.Key_S, down=False)
    keys.stands()


@pytest.mark.parametrize("focus", ["button", "keys"])
def test_keys_steer_wherever_the_focus_is(keys: Drive, focus: str) -> None:
    keys.item.property(focus).forceActiveFocus()
    keys.key(Key.Key_W, down=True)
    keys.moves(0.5, 0, 0)


def test_a_text_field_keeps_its_keys(keys: Drive) -> None:
    field = keys.item.property("field")
    keys.key(Key.Key_W, down=True)
    keys.moves(0.5, 0, 0)
    field.forceActiveFocus()
    keys.stands()
    count = len(keys.messages)
    keys.key(Key.Key_W, down=False)
    keys.key(Key.Key_A, down=True)
    keys.wait.nothing_happens(0.1)
    assert set(keys.messages[count:]) <= {(0.0, 0.0, 0.0)}
    # Its repeats do not count either once the field has lost the focus.
    keys.item.property("button").forceActiveFocus()
    keys.key(Key.Key_A, down=False)
    keys.key(Key.Key_A, down=True)
    keys.key(Key.Key_A, down=True, repeats=True)
    keys.wait.nothing_happens(0.1)
    assert set(keys.messages[count:]) <= {(0.0, 0.0, 0.0)}
    assert not keys.item.property("keys").property("held")


def test_a_key_that_was_pressed_in_another_window_does_not_count(keys: Drive) -> None:
    for _ in range(3):
        keys.key(Key.Key_W, down=True, repeats=True)
        keys.key(Key.Key_S, down=False)
        keys.key(Key.Key_S, down=True)
        keys.wait.nothing_happens(0.03)
    assert keys.messages == []
    keys.key(Key.Key_S, down=False)
    keys.wait.nothing_happens(0.05)
    keys.key(Key.Key_S, down=True)
    keys.moves(-0.5, 0, 0)


def test_repeats_do_not_release(keys: Drive) -> None:
    """As X11 sends them: a release and a press, not marked as repeats."""
    keys.key(Key.Key_W, down=True)
    keys.moves(0.5, 0, 0)
    for _ in range(10):
        keys.key(Key.Key_W, down=False)
        keys.key(Key.Key_W, down=True)
        keys.wait.nothing_happens(0.02)
    moving = keys.messages.index((0.5, 0.0, 0.0))
    assert set(keys.messages[moving:]) == {(0.5, 0.0, 0.0)}


@pytest.mark.parametrize("repeats", [0, 3])
def test_release_with_another_meaning(keys: Drive, repeats: int) -> None:
    """As after Num Lock, AltGr or a change of the layout: the same key has another name."""

    def send(kind: Any, key: Any) -> None:
        keys.send(QtGui.QKeyEvent(kind, key, QtCore.Qt.KeyboardModifier.NoModifier, 80, 0, 0))

    kinds = QtCore.QEvent.Type
    send(kinds.KeyPress, Key.Key_Up)
    keys.moves(0.5, 0, 0)
    for _ in range(repeats):
        send(kinds.KeyRelease, Key.Key_8)
        send(kinds.KeyPress, Key.Key_8)
    keys.wait.nothing_happens(0.05)
    assert keys.messages[-1] == (0.5, 0.0, 0.0)
    send(kinds.KeyRelease, Key.Key_8)
    keys.stands()
    assert not keys.item.property("keys").property("held")
    # What the key means now is what counts.
    send(kinds.KeyPress, Key.Key_8)
    keys.wait.nothing_happens(0.1)
    assert keys.messages[-1] == (0.0, 0.0, 0.0)
    send(kinds.KeyRelease, Key.Key_8)
    send(kinds.KeyPress, Key.Key_Up)
    keys.moves(0.5, 0, 0)
    send(kinds.KeyRelease, Key.Key_Up)
    keys.stands()


def test_shortcuts_are_left_alone(keys: Drive) -> None:
    keys.key(Key.Key_W, down=True, control=True)
    keys.wait.nothing_happens(0.1)
    assert keys.messages == []


def test_hidden_keys_do_not_steer(keys: Drive) -> None:
    keys.key(Key.Key_W, down=True)
    keys.moves(0.5, 0, 0)
    keys.item.property("keys").setProperty("visible", False)
    keys.stands()
    keys.key(Key.Key_W, down=False)
    keys.key(Key.Key_S, down=True)
    keys.wait.nothing_happens(0.1)
    assert keys.messages[-1] == (0.0, 0.0, 0.0)


def test_keys_without_keycaps_steer(controls: Any, wait: Any) -> None:
    drive = Drive(controls, wait, 'DriveKeys { topic: "/cmd_vel"; keycaps: false; speedShare: 1 }')
    assert drive.item.property("width") <= 1
    drive.key(Key.Key_Up, down=True)
    wait(lambda: drive.messages and drive.messages[-1][0] > 0)


def test_stick_follows_the_thumb_and_springs_back(stick: Drive) -> None:
    knob = stick.controls.find("knob")
    stick.mouse("press", 100, 100)
    stick.mouse("move", 100, 10)
    stick.moves(0.5, 0, 0)
    assert knob.property("y") < 30
    stick.mouse("move", 38, 100)
    stick.moves(0, 0, 1)
    stick.mouse("move", 5000, 5000)
    stick.moves(-0.5 / 2**0.5, 0, -1 / 2**0.5)
    stick.mouse("release", 5000, 5000)
    stick.stands()
    stick.wait(lambda: abs(knob.property("y") - 62) < 1)
    assert not stick.item.property("held")


def test_stick_slides(stick: Drive) -> None:
    stick.item.setProperty("slides", True)
    stick.mouse("press", 100, 100)
    stick.mouse("move", 38, 100)
    stick.moves(0, 0.5, 0)


def test_stick_is_steered_by_the_arrow_keys(stick: Drive) -> None:
    stick.key(Key.Key_Up, down=True)
    stick.wait.nothing_happens(0.05)
    assert stick.messages == []
    stick.key(Key.Key_Up, down=False)
    stick.wait.nothing_happens(0.05)
    stick.item.forceActiveFocus()
    stick.key(Key.Key_Up, down=True)
    stick.moves(0.4, 0, 0)
    stick.key(Key.Key_Up, down=False)
    stick.stands()


def test_hidden_stick_that_kept_the_focus_does_not_steer(stick: Drive) -> None:
    stick.item.forceActiveFocus()
    stick.item.setProperty("visible", False)
    stick.key(Key.Key_Up, down=True)
    assert not stick.item.property("held")
    stick.key(Key.Key_Up, down=False)


def steal(stick: Drive) -> None:
    stick.controls.find("touch").ungrabMouse()


def hide(stick: Drive) -> None:
    stick.item.setProperty("visible", False)


def disable(stick: Drive) -> None:
    stick.item.setProperty("enabled", False)


@pytest.mark.parametrize("event", [steal, hide, disable])
def test_stick_is_let_go(stick: Drive, event: Callable[[Drive], None]) -> None:
    stick.mouse("press", 100, 100)
    stick.mouse("move", 100, 10)
    stick.moves(0.5, 0, 0)
    event(stick)
    stick.stands()
    stick.mouse("move", 100, 20)
    stick.wait.nothing_happens(0.1)
    assert stick.messages[-1] == (0.0, 0.0, 0.0)


def test_stick_says_why_it_does_not_steer(stick: Drive) -> None:
    stick.item.property("command").setProperty("obstacle", "emergency stop")
    stick.mouse("press", 100, 100)
    stick.mouse("move", 100, 10)
    reason = stick.controls.find("reason")
    stick.wait(lambda: reason.property("visible"))
    assert reason.property("text") == "emergency stop: let go first"
    assert stick.messages == []


def test_stick_without_a_command_has_one_of_its_own(controls: Any, wait: Any) -> None:
    drive = Drive(controls, wait, 'DriveStick { topic: "cmd_vel"; width: 200; height: 200 }')
    drive.mouse("press", 100, 100)
    drive.mouse("move", 100, 10)
    wait(lambda: drive.messages and drive.messages[-1][0] > 0.1)
    drive.mouse("release", 100, 10)
    drive.stands()


def test_stick_is_round_whatever_its_shape(controls: Any, wait: Any) -> None:
    drive = Drive(controls, wait, "DriveStick { anchors.fill: parent }", width=400, height=200)
    drive.mouse("press", 200, 100)
    # Its reach is that of a stick of 200 x 200.
    drive.mouse("move", 138, 100)
    assert drive.item.property("leftward") == pytest.approx(1)
    drive.mouse("move", 200, 69)
    assert drive.item.property("forward") == pytest.approx(0.5)
    drive.mouse("release", 200, 69)
