"""Keys that move RViz's camera, pressed at a real keyboard, beside overlays that want them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

FIELD = """
Item {
    TextField { id: field; x: 20; y: 20; width: 200; height: 40; text: "abcd" }
    property alias text: field.text
    property alias at: field.cursorPosition
    property alias active: field.activeFocus
}
"""


@pytest.fixture
def steps(
    app: Any, steered: Any, hand: Any, monkeypatch: pytest.MonkeyPatch
) -> Iterator[list[tuple[float, float]]]:
    """The shifts of the view by keys, ahead and to the left; a frame takes 0.1 s for them."""
    from rosglass.overlay import view_controller

    now, found = [0.0], []

    def later() -> float:
        now[0] += 0.1
        return now[0]

    def nudge(ahead: float, left: float) -> None:
        found.append((round(ahead, 3), round(left, 3)))

    monkeypatch.setattr(view_controller, "time", SimpleNamespace(monotonic=later))
    monkeypatch.setattr(steered, "nudge", nudge)
    # A press on the free view gives it the keys.
    hand.click(600, 400)
    yield found
    for key in ("Up", "Left", "shift", "ctrl"):
        hand.do("keyup", key)


def test_shift_doubles_the_speed_whenever_it_is_pressed(
    hand: Any, steps: list[tuple[float, float]], wait: Callable[..., None]
) -> None:
    hand.do("keydown", "Up")
    wait(lambda: steps[-1:] == [(0.4, 0.0)])
    hand.do("keydown", "shift")
    wait(lambda: steps[-1] == (0.8, 0.0))
    hand.do("keyup", "shift")
    wait(lambda: steps[-1] == (0.4, 0.0))
    hand.do("keydown", "Left")
    # Two keys lead no farther than one.
    wait(lambda: steps[-1] == (0.283, 0.283))
    hand.do("keyup", "Up")
    wait(lambda: steps[-1] == (0.0, 0.4))
    hand.do("keyup", "Left")
    steps.clear()
    hand.do("keydown", "shift", "keydown", "Up")
    wait(lambda: steps != [])
    hand.do("keyup", "Up", "keyup", "shift")
    assert set(steps) == {(0.8, 0.0)}
    steps.clear()
    wait.frames(6)
    assert steps == []


def test_other_keys_with_arrows_are_not_ours(
    hand: Any, steps: list[tuple[float, float]], wait: Callable[..., None]
) -> None:
    hand.key("ctrl+Up", "alt+Up")
    wait.frames(6)
    assert steps == []


def test_a_text_field_keeps_its_keys(
    app: Any,
    steered: Any,
    hand: Any,
    show: Any,
    steps: list[tuple[float, float]],
    wait: Callable[..., None],
) -> None:
    root = show(FIELD)
    hand.do("keydown", "Up")
    wait(lambda: steps != [])
    # Who takes the keys ends what they did to the camera.
    hand.click(120, 40)
    wait(lambda: root.property("active"))
    wait.frames(3)
    steps.clear()
    hand.do("keyup", "Up")
    hand.key("End", "Left", "shift+Left", "Up", "Down", "ctrl+d")
    wait.frames(6)
    assert steps == []
    assert steered.mode == 0
    hand.key("x")
    wait(lambda: "x" in root.property("text"))
    hand.click(600, 400)
    wait(lambda: not root.property("active"))
    hand.do("keydown", "Up")
    wait(lambda: steps != [])
    hand.do("keyup", "Up")
    hand.key("ctrl+d")
    wait(lambda: steered.mode == 1)


def test_a_widget_s_field_keeps_its_keys(
    app: Any, steered: Any, hand: Any, steps: list[tuple[float, float]], wait: Callable[..., None]
) -> None:
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtWidgets

    field = QtWidgets.QLineEdit("abcd")
    field.setFixedSize(200, 40)
    app.add(WidgetOverlay(field, "Field"))
    wait.frames(6)
    hand.click(120, 20)
    wait(field.hasFocus)
    hand.key("End", "Left", "Up", "x", "ctrl+d")
    wait(lambda: "cx" in field.text())
    assert steps == []
    assert steered.mode == 0


def test_without_keyboard_navigation_keys_are_rviz_s(
    steered: Any, hand: Any, steps: list[tuple[float, float]], wait: Callable[..., None]
) -> None:
    hand.do("keydown", "Up")
    wait(lambda: steps != [])
    # A key that is down as it is switched off does not go on.
    steered.settings.keys = False
    wait.frames(3)
    steps.clear()
    hand.do("keyup", "Up")
    hand.key("Up", "ctrl+d")
    wait.frames(6)
    assert steps == []
    assert steered.mode == 0
