"""Gamepad and GamepadView, with SDL's virtual gamepads."""

from __future__ import annotations

import math
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hands import click

pytest.importorskip("sdl2", reason='needs pip install "rosglass[gamepad]"')

from virtual_pads import (
    LEFT_SHOULDER,
    LEFT_TRIGGER,
    LEFT_X,
    LEFT_Y,
    RIGHT_SHOULDER,
    A,
    B,
    VirtualPad,
)

from rosglass.controls.steering.gamepad_devices import devices, parse_element, smooth
from rosglass.qt import QtGui

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

pytestmark = pytest.mark.both_qt

DRIVE = """Item {
    property QtObject pad: padId
    property QtObject drive: driveId
    property var buttons: []
    property int stops: 0
    width: 100; height: 100
    TwistCommand {
        id: driveId
        type: "geometry_msgs/msg/Twist"
        maxSpeed: 1; maxTurn: 1; acceleration: 0; deceleration: 0; turnAcceleration: 0
    }
    Gamepad {
        id: padId
        command: driveId
        stopButton: "b"
        onPressed: function(button) { made.buttons = made.buttons.concat(["+" + button]) }
        onReleased: function(button) { made.buttons = made.buttons.concat(["-" + button]) }
        onStopPressed: made.stops += 1
    }
}"""


@pytest.fixture(autouse=True)
def counts_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rosglass.controls.steering.gamepad._SETTLE_S", 0.0)


@pytest.fixture
def plug(wait: Any) -> Iterator[Callable[..., VirtualPad]]:
    """Plugs gamepads in, and out at the end."""
    seen: list[Any] = []
    end = devices.listen(seen.append)
    wait(lambda: seen, "SDL's thread")
    assert seen[-1].problem == ""
    pads: list[VirtualPad] = []

    def make(*arguments: Any, **more: Any) -> VirtualPad:
        pads.append(VirtualPad(*arguments, **more))
        if pads[-1]:
            wait(lambda: any(pad.id == pads[-1].id for pad in seen[-1].pads))
        return pads[-1]

    yield make
    for pad in pads:
        pad.unplug()
    wait(lambda: not seen[-1].pads, "the gamepads to be gone")
    end()


@pytest.fixture
def twists(controls: Any) -> list[tuple[float, float]]:
    got: list[tuple[float, float]] = []
    controls.keep = controls.robot.create_subscription(
        "/cmd_vel",
        "geometry_msgs/msg/Twist",
        lambda m: got.append((m.linear.x, m.angular.z)),
    )
    return got


def in_front(controls: Any, wait: Any) -> None:
    controls.window.requestActivate()
    wait(lambda: QtGui.QGuiApplication.focusWindow() is not None)


def show_drive(controls: Any, wait: Any) -> tuple[Any, Any]:
    root = controls.show(DRIVE)
    in_front(controls, wait)
    pad = root.property("pad")
    wait(lambda: pad.property("connected"))
    # What steers before there is a topic has to be let go first.
    wait(controls.keep.publisher_count)
    return root, pad


def shown(controls: Any, name: str, what: str) -> Any:
    with suppress(AssertionError):  # it is not made yet
        return controls.find(name).property(what)
    return None


def axis(element: Any, number: int) -> float:
    axes = element.property("axes")
    return float(axes[number]) if axes else math.nan


def drive_state(element: Any) -> Any:
    return element.property("refusal"), element.property("command").property("problem")


def halted(twists: list[tuple[float, float]]) -> bool:
    return len(twists) >= 3 and twists[-3:] == [(0.0, 0.0)] * 3


def test_smooth_dead_zone_has_no_step() -> None:
    assert smooth(0.04 * 32767, 0.05) == 0
    assert smooth(0.0501 * 32767, 0.05) == pytest.approx(0.0001, abs=1e-4)
    assert smooth(32767, 0.05) == 1
    assert smooth(-32768, 0.05) == -1


def test_names_of_raw_controls() -> None:
    assert str(parse_element("a3")) == "a3"
    assert parse_element("-a3").reversed  # type: ignore[union-attr]
    assert str(parse_element("h0.4")) == "h0.4"
    for text in ("", "a", "x1", "h0.3", "a1000", "b1 "):
        assert parse_element(text) is None


def test_it_steers_while_the_dead_man_button_is_held(
    controls: Any, wait: Any, plug: Any, twists: Any
) -> None:
    pad = plug()
    root, element = show_drive(controls, wait)
    pad.axis(LEFT_Y, -1.0)  # forward
    wait(lambda: axis(element, LEFT_Y) == 1.0)
    assert twists == []
    pad.button(LEFT_SHOULDER)
    wait(lambda: twists and twists[-1] == (0.5, 0.0), lambda: (twists, element.property("refusal")))
    pad.button(RIGHT_SHOULDER)  # turbo
    wait(lambda: twists[-1] == (1.0, 0.0))
    pad.axis(LEFT_X, 1.0)  # to the right
    wait(lambda: twists[-1] == (1.0, -1.0))
    assert element.property("held")
    pad.button(LEFT_SHOULDER, False)
    wait(lambda: halted(twists))
    assert root.property("buttons").toVariant() == [
        "+leftshoulder",
        "+rightshoulder",
        "-leftshoulder",
    ]


def test_a_gamepad_unplugged_in_a_turn_halts(
    controls: Any, wait: Any, plug: Any, twists: Any
) -> None:
    pad = plug()
    _, element = show_drive(controls, wait)
    pad.button(LEFT_SHOULDER)
    pad.axis(LEFT_X, -1.0)
    wait(lambda: twists and twists[-1] == (0.0, 0.5), lambda: twists)
    pad.unplug()
    wait(lambda: halted(twists))
    wait(lambda: not element.property("connected"))
    assert element.property("refusal") == "no gamepad"
    # Plugged in with the button held: it does not count until it was let go once.
    again = plug(pressed=(LEFT_SHOULDER,))
    again.axis(LEFT_Y, -1.0)
    wait(lambda: axis(element, LEFT_Y) == 1.0)
    moving = [one for one in twists if one[0] != 0]
    assert moving == []
    again.button(LEFT_SHOULDER, False)
    wait(lambda: element.property("buttons")[LEFT_SHOULDER] == 0)
    again.button(LEFT_SHOULDER)
    wait(lambda: twists[-1] == (0.5, 0.0))


def test_button_that_is_reported_late_does_not_steer(
    controls: Any, wait: Any, plug: Any, twists: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its plug was loose for a moment: its button is held, but its report is still to come."""
    monkeypatch.setattr("rosglass.controls.steering.gamepad._SETTLE_S", 60.0)
    pad = plug()
    _, element = show_drive(controls, wait)
    pad.button(LEFT_SHOULDER)
    pad.axis(LEFT_Y, -1.0)
    wait(lambda: element.property("refusal") == "let go first")
    assert [one for one in twists if any(one)] == []
    pad.button(LEFT_SHOULDER, False)
    wait(lambda: element.property("refusal") == "")
    monkeypatch.setattr("rosglass.controls.steering.gamepad._SETTLE_S", 0.0)
    pad.axis(LEFT_Y, -0.5)
    wait(lambda: axis(element, LEFT_Y) < 0.6)
    pad.axis(LEFT_Y, -1.0)
    pad.button(LEFT_SHOULDER)
    wait(lambda: twists and twists[-1][0] == 0.5)


def test_only_the_window_in_front_counts(controls: Any, wait: Any, plug: Any, twists: Any) -> None:
    pad = plug()
    root, element = show_drive(controls, wait)
    pad.button(LEFT_SHOULDER)
    pad.axis(LEFT_Y, -1.0)
    wait(lambda: twists and twists[-1] == (0.5, 0.0))
    other = QtGui.QWindow()
    other.show()
    other.requestActivate()
    wait(lambda: halted(twists))
    wait(lambda: element.property("refusal") == "the window is not in front")
    pad.button(A)
    pad.button(B)
    wait(lambda: root.property("stops") == 1, "the stop counts wherever the focus is")
    assert "+a" not in root.property("buttons").toVariant()
    del twists[:]
    other.destroy()
    in_front(controls, wait)
    wait(lambda: element.property("refusal") == "let go first")
    pad.axis(LEFT_Y, -0.9)
    wait(lambda: 0.8 < axis(element, LEFT_Y) < 0.95)
    assert [one for one in twists if one != (0.0, 0.0)] == [], "the button was never let go"


def test_joy_has_the_layout_of_joy_node(controls: Any, wait: Any, plug: Any) -> None:
    got: list[Any] = []
    keep = controls.robot.create_subscription("/pad/joy", "sensor_msgs/msg/Joy", got.append)
    pad = plug("Old Stick", axes=3, buttons=4, hats=1, type=0)
    controls.show('Item { Gamepad { topic: "joy"; ns: "/pad" } }')
    in_front(controls, wait)
    pad.axis(0, -1.0)  # left
    pad.axis(1, 0.5)  # back
    pad.button(2)
    pad.hat(0, 1 | 2)  # up and right
    wait(lambda: got and list(got[-1].buttons) == [0, 0, 1, 0] and got[-1].axes[3] == -1)
    assert got[-1].header.frame_id == "joy"
    assert list(got[-1].axes) == pytest.approx(
        [1.0, -(0.5 - 0.05) / 0.95, 0.0, -1.0, 1.0], abs=1e-3
    )
    pad.hat(0, 8 | 4)
    wait(lambda: list(got[-1].axes)[3:] == [1.0, -1.0])
    count = len(got)
    wait(lambda: len(got) >= count + 3, "repetitions")
    pad.unplug()
    wait(lambda: [list(m.axes) for m in got[-3:]] == [[0.0] * 5] * 3)
    assert list(got[-1].buttons) == [0] * 4
    wait.nothing_happens(0.3)
    count = len(got)
    wait.nothing_happens(0.3)
    assert len(got) == count
    assert list(got[-1].axes) == [0.0] * 5
    keep.close()


def test_triggers_rest_at_the_end_of_their_way(controls: Any, wait: Any, plug: Any) -> None:
    pad = plug()
    root = controls.show("Item { property QtObject pad: padId; Gamepad { id: padId } }")
    element = root.property("pad")
    pad.axis(LEFT_TRIGGER, -1.0)
    wait(lambda: axis(element, LEFT_TRIGGER) == 1.0)
    assert element.value("lefttrigger") == 0
    pad.axis(LEFT_TRIGGER, 1.0)
    wait(lambda: element.value("lefttrigger") == pytest.approx(1.0))
    assert element.value("nonsense") == 0


def test_feedback_rumbles(controls: Any, wait: Any, plug: Any) -> None:
    pad = plug()
    array = controls.robot.create_publisher("/joy/set_feedback", "sensor_msgs/msg/JoyFeedbackArray")
    root = controls.show(
        'Item { property QtObject pad: padId; Gamepad { id: padId; topic: "joy" } }'
    )
    wait(lambda: root.property("pad").property("connected"))
    wait(array.subscription_count)
    array.publish(
        array=[
            {"type": 1, "id": 0, "intensity": 1.0},
            {"type": 1, "id": 1, "intensity": 0.5},
            {"type": 1, "id": 1, "intensity": math.nan},
            {"type": 0, "id": 0, "intensity": 0.1},
            {"type": 1, "id": 9, "intensity": 0.1},
        ]
    )
    wait(lambda: pad.rumbles)
    assert pad.rumbles[-1] == pytest.approx((1.0, 0.5), abs=0.01)
    root.property("pad").rumble(0.0, 0.25, 0.2)
    wait(lambda: pad.rumbles[-1] == pytest.approx((0.0, 0.25), abs=0.01))
    wait(lambda: pad.rumbles[-1] == (0.0, 0.0), "the end of the rumble")


def test_joy_and_feedback_over_a_real_middleware(live_controls: Any, wait: Any, plug: Any) -> None:
    controls, got = live_controls, []
    keep = controls.robot.create_subscription("/joy", "sensor_msgs/msg/Joy", got.append)
    kind = "sensor_msgs/msg/JoyFeedbackArray"
    feedback = controls.robot.create_publisher("/joy/set_feedback", kind)
    pad = plug()
    controls.show('Item { Gamepad { topic: "joy" } }')
    in_front(controls, wait)
    pad.axis(LEFT_X, -1.0)
    wait(lambda: got and got[-1].axes[LEFT_X] == 1.0)

    def rumbles() -> bool:
        feedback.publish(array=[{"type": 1, "id": 0, "intensity": 0.5}])
        return bool(pad.rumbles)

    wait(rumbles)
    pad.unplug()
    wait(lambda: not any(got[-1].axes[:LEFT_TRIGGER]))
    keep.close()
    feedback.close()


def test_the_gamepad_is_chosen_by_name_or_number(controls: Any, wait: Any, plug: Any) -> None:
    plug("Red Pad")
    plug("Blue Pad")
    plug("Red Pad")
    root = controls.show("Item { property QtObject pad: padId; Gamepad { id: padId } }")
    pad = root.property("pad")
    wait(lambda: list(pad.property("devices")) == ["Red Pad", "Blue Pad", "Red Pad (2)"])
    assert pad.property("name") == "Red Pad"
    for wanted, name in (("blue", "Blue Pad"), ("Red Pad", "Red Pad"), ("2", "Red Pad (2)")):
        pad.setProperty("device", wanted)
        wait(lambda name=name: pad.property("name") == name)
    pad.setProperty("device", "green")
    wait(lambda: not pad.property("connected"))


def test_the_view_says_why_what_is_held_does_not_steer(
    controls: Any, wait: Any, plug: Any, twists: Any
) -> None:
    pad = plug()
    view = controls.show(
        """GamepadView { anchors.fill: parent; gamepad: padId
        TwistCommand { id: driveId; obstacle: "emergency stop" }
        Gamepad { id: padId; command: driveId } }"""
    )
    in_front(controls, wait)
    wait(lambda: view.property("status") == "")
    assert controls.find("state").property("text") == "hold leftshoulder to steer"
    pad.button(LEFT_SHOULDER)
    wait(lambda: "does not steer: emergency stop" in controls.find("state").property("text"))
    assert twists == []


def test_a_missing_control_is_named(controls: Any, wait: Any, plug: Any, twists: Any) -> None:
    pad = plug("Old Stick", axes=2, buttons=3, type=0)
    root = controls.show(DRIVE)
    in_front(controls, wait)
    wait(controls.keep.publisher_count)
    element = root.property("pad")
    wait(lambda: 'Old Stick has no control "b" (Gamepad.stopButton)' in element.property("problem"))
    assert "a0 to a1, b0 to b2" in element.property("problem")
    for name, control in (("stopButton", ""), ("forward", "a1"), ("left", "a0"), ("turbo", "")):
        element.setProperty(name, control)
    wait(lambda: '"leftshoulder" (Gamepad.deadMan)' in element.property("problem"))
    element.setProperty("deadMan", "b2")
    wait(lambda: element.property("problem") == "")
    pad.button(2)
    pad.axis(1, -1.0)
    wait(lambda: twists and twists[-1] == (0.5, 0.0))


def test_own_names_and_reversed_axes(controls: Any, wait: Any, plug: Any) -> None:
    pad = plug()
    root = controls.show(
        "Item { property QtObject pad: padId; "
        'Gamepad { id: padId; names: ({ lift: "-a1", horn: "b3" }) } }'
    )
    element = root.property("pad")
    wait(lambda: element.property("connected"))
    pad.axis(LEFT_Y, -1.0)
    pad.button(3)
    wait(lambda: element.value("lift") == -1.0)
    assert element.value("-lift") == 1.0
    wait(lambda: element.value("horn") == 1.0)
    wait(lambda: list(element.property("buttonNames"))[3:4] == ["horn"])


def test_the_view_shows_axes_and_buttons(controls: Any, wait: Any, plug: Any) -> None:
    pad = plug("Red Pad")
    plug("Blue Pad")
    controls.show("GamepadView { anchors.fill: parent; gamepad: Gamepad {} }", height=400)
    wait(lambda: controls.window.property("control").property("status") == "")
    pad.axis(LEFT_X, -1.0)
    pad.button(A)
    wait(lambda: shown(controls, "axis0", "text") == "1.00")
    wait(lambda: shown(controls, "button0", "down"))
    assert controls.window.property("control").property("note") == "Red Pad"
    wait(lambda: shown(controls, "device1", "text") == "Blue Pad")

    def blue() -> bool:
        click(controls, "device1")  # it may still be moved by the layout
        return bool(controls.window.property("control").property("note") == "Blue Pad")

    wait(blue)


def test_without_gamepads_the_view_says_so(controls: Any, wait: Any) -> None:
    view = controls.show("GamepadView { anchors.fill: parent; gamepad: Gamepad {} }")
    wait(lambda: view.property("status") == "no gamepad is connected")


def test_without_sdl_it_says_what_to_install(
    controls: Any, wait: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "sdl2", None)
    seen: list[Any] = []
    end = devices.listen(seen.append)
    wait(lambda: seen and seen[-1].problem)
    # Also a gamepad that comes later.
    view = controls.show("GamepadView { anchors.fill: parent; gamepad: Gamepad {} }")
    wait(lambda: "sdl2 is not installed; install it with: pip install" in view.property("status"))
    assert "[gamepad]" in view.property("status")
    end()


def test_sdl_leaves_signals_alone(start: Any) -> None:
    example = Path(__file__).parents[3] / "examples/controls/gamepad.qml"
    program = start("run", example, "--url", "local://no_robot", "-vv")
    program.until("gamepads are read by SDL")
    program.kill(signal.SIGTERM)
    assert program.end(20) in (0, 143, -15), program.text
