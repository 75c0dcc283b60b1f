"""Who gets the mouse, the wheel and the keys: real ones, sent by the X server."""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

IMPORTS = "import QtQuick 2.15\nimport QtQuick.Controls 2.15\n"


class Hand:
    """A mouse and a keyboard, in units of the 3D view."""

    def __init__(self, app: Any, wait: Callable[..., None]) -> None:
        self.app, self.wait, self.panel = app, wait, app.window.panel

    def do(self, *words: object) -> None:
        subprocess.run(["xdotool", *map(str, words)], check=True, capture_output=True)
        self.wait(60)

    def move(self, x: float, y: float) -> None:
        from rosglass.rviz.qt5 import QtCore

        at = self.panel.mapToGlobal(QtCore.QPoint(round(x), round(y)))
        # RViz's tools take two places; one way leads over the place beside it.
        self.do("mousemove", at.x() - 1, at.y(), "mousemove", at.x(), at.y())

    def press(self, button: int = 1) -> None:
        self.do("mousedown", button)

    def release(self, button: int = 1) -> None:
        self.do("mouseup", button)

    def click(self, x: float, y: float, button: int = 1) -> None:
        self.move(x, y)
        self.press(button)
        self.release(button)

    def drag(self, x: float, y: float, to_x: float, to_y: float, button: int = 1) -> None:
        self.move(x, y)
        self.press(button)
        self.move((x + to_x) / 2, (y + to_y) / 2)
        self.move(to_x, to_y)
        self.release(button)

    def wheel(self, x: float, y: float, up: bool = True) -> None:
        self.move(x, y)
        self.do("click", 4 if up else 5)

    def key(self, *keys: str) -> None:
        for key in keys:
            self.do("key", key)


@pytest.fixture
def hand(app: Any, wait: Callable[..., None]) -> Any:
    hand = Hand(app, wait)
    app.window.widget.activateWindow()
    for button in (1, 2, 3):
        hand.do("mouseup", button)
    hand.move(5, 5)
    return hand


@pytest.fixture
def show(app: Any, wait: Callable[..., None], tmp_path: Path) -> Callable[..., Any]:
    """Show QML text over the 3D view; returns its root."""

    def show(text: str, name: str = "Test", **options: Any) -> Any:
        file = tmp_path / f"{name}.qml"
        file.write_text(IMPORTS + text)
        overlay = app.add_qml(file, **options)
        drawn: list[int] = []
        app.window.before_frame.connect(lambda: drawn.append(1))
        wait(lambda: len(drawn) > 2)
        return overlay._root

    return show


@pytest.fixture
def view(app: Any) -> Callable[[str], float]:
    """Return a property of RViz's camera."""
    views = app.window.manager.getViewManager()
    before = {"Yaw": 0.8, "Pitch": 0.8, "Distance": 10.0}
    for name, value in before.items():
        views.getCurrent().subProp(name).setValue(value)
    return lambda name: float(views.getCurrent().subProp(name).getValue())


def test_camera_moves_through_the_gaps(hand: Any, show: Any, view: Any) -> None:
    root = show(
        """Item { property int clicks: 0
        Item { anchors.fill: parent }
        Column { anchors.fill: parent }
        Button { x: 20; y: 20; width: 100; height: 50; onClicked: parent.clicks++ } }"""
    )
    yaw = view("Yaw")
    hand.click(60, 40)
    assert root.property("clicks") == 1
    hand.drag(60, 40, 260, 140)
    assert view("Yaw") == yaw
    hand.drag(300, 300, 400, 300)
    assert view("Yaw") != yaw
    distance = view("Distance")
    hand.wheel(300, 300)
    assert view("Distance") < distance
