"""Commands of the editor while a hand drives: the robot halts, and nothing moves under the hand."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("PySide6", reason="the editor needs Qt 6")

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

LAYOUT = """import QtQuick 2.15
import RosControls 1.0
import RosCockpit 1.0

Cockpit {
    nodeName: "ui"
    Page {
        title: "One"
        Panel { title: "Power"; Battery { topic: "/battery" } }
        Panel { title: "Drive"; DriveStick { objectName: "stick" } }
    }
}
"""


class Driving:
    """An open layout whose stick is held by the mouse.

    Attributes:
        received: The forward speeds that the robot has received.
    """

    def __init__(self, editor: Any) -> None:
        from rosglass.qt import QtCore, optional

        self.editor, self.received = editor, []
        self._test: Any = optional("QtTest").QTest
        self._button = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
        self._subscription = editor.bench.robot.create_subscription(
            "/cmd_vel",
            "geometry_msgs/msg/Twist",
            lambda message: self.received.append(message.linear.x),
        )
        self.stick = editor.find("stick")
        self.editor.wait(lambda: bool(editor.bench.robot.publishers("/cmd_vel")))
        self.editor.wait(self._drives)

    @property
    def active(self) -> bool:
        return bool(self.stick.property("active"))

    def point(self) -> Any:
        from rosglass.qt import QtCore

        across, down = self.stick.width() / 2, self.stick.height() / 2
        side = min(across, down)
        return self.stick.mapToScene(QtCore.QPointF(across, down - side * 0.5)).toPoint()

    def _drives(self) -> bool:
        # A busy machine may have halted it.
        if not self.active:
            self._test.mouseRelease(self.editor.window, *self._button, self.point())
            self._test.mousePress(self.editor.window, *self._button, self.point())
        return self.active and bool(self.received) and self.received[-1] > 0

    def close(self) -> None:
        self._test.mouseRelease(self.editor.window, *self._button, self.point())
        self._subscription.close()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "drive.qml"
    path.write_text(LAYOUT)
    return path


@pytest.fixture
def opened(edit: Callable[..., Any], file: Path) -> Any:
    """The editor, with the layout open."""
    editor = edit(file)
    editor.answer(1)
    editor.wait(lambda: editor.program.property("opened"))
    return editor


@pytest.fixture
def drive(opened: Any) -> Iterator[Driving]:
    made = Driving(opened)
    yield made
    made.close()


@pytest.mark.parametrize("keys", ["F4", "Ctrl+H", "Ctrl+P", "Ctrl+S", "Shift+F10"])
def test_keys_of_the_editor_halt_the_robot_at_once(drive: Driving, keys: str) -> None:
    drive.editor.key(keys)
    assert not drive.active
    drive.editor.wait(lambda: drive.received[-1] == 0)


def test_arrow_keys_do_not_steer_behind_the_start_page(drive: Driving) -> None:
    drive.stick.forceActiveFocus()
    drive.editor.key("Ctrl+H")
    drive.editor.find("startPage")
    drive.editor.key("Up")
    assert not drive.stick.property("held")


def test_used_layout_is_not_changed_by_undo(opened: Any) -> None:
    editor = opened
    editor.key("F4")
    editor.select("Power")
    editor.program.rename("Energy")
    editor.key("F4")
    editor.key("Ctrl+Z")
    assert "Energy" in editor.text
    assert "F4" in editor.program.property("message")
    editor.key("F4")
    editor.key("Ctrl+Z")
    assert "Energy" not in editor.text


def test_message_does_not_move_the_layout(opened: Any) -> None:
    editor = opened
    editor.program.say("")
    before = editor.find("stage").height()
    editor.program.say("saved")
    assert editor.find("stage").height() == before


def test_question_has_a_box_around_its_text(edit: Callable[..., Any], file: Path) -> None:
    from rosglass.qt import QtCore

    editor = edit(file)
    box = editor.window.findChild(QtCore.QObject, "question")
    editor.wait(lambda: box.property("opened"))
    around, text = box.property("background"), box.property("contentItem")
    assert around.height() >= text.height() + 2 * box.property("padding") > 50


def test_refused_layout_leaves_the_robots_to_choose(
    edit: Callable[..., Any],
    file: Path,
) -> None:
    editor = edit(file)
    assert not editor.program.property("robots")
    editor.answer(2)
    assert editor.program.property("robots")


@pytest.mark.parametrize("change", ["Ctrl+2", "Ctrl+Tab"])
def test_arrow_keys_do_not_steer_from_a_hidden_page_or_tab(layouts: Any, change: str) -> None:
    layouts.show("""
        Page { title: "One"
            Tabs {
                Panel { DriveStick { objectName: "stick" } }
                Panel { Item {} } } }
        Page { title: "Two"; Panel { Item {} } }""")
    stick = layouts.find("stick")
    stick.forceActiveFocus()
    assert stick.property("activeFocus")
    layouts.key(change)
    layouts.wait(lambda: not stick.isVisible())
    layouts.key("Up")
    assert not stick.property("held")
    assert not stick.property("activeFocus")


@pytest.mark.parametrize("change", ["Ctrl+2", "Ctrl+Tab"])
def test_keys_do_not_press_a_button_of_a_hidden_page_or_tab(layouts: Any, change: str) -> None:
    layouts.show("""
        property int pressed: 0
        Page { title: "One"
            Tabs {
                Panel { ThemeButton { objectName: "button"; onClicked: made.pressed += 1 } }
                Panel { Item {} } } }
        Page { title: "Two"; Panel { Item {} } }""")
    button = layouts.find("button")
    button.forceActiveFocus()
    layouts.key("Space")
    assert layouts.root.property("pressed") == 1
    layouts.key(change)
    layouts.wait(lambda: not button.isVisible())
    layouts.key("Space")
    assert layouts.root.property("pressed") == 1


def test_window_is_no_larger_than_the_screen(opened: Any) -> None:
    # The screen of the offscreen platform has 800x800 pixels.
    screen = opened.window.screen().size()
    assert opened.window.width() <= screen.width()
    assert opened.window.height() <= screen.height()
