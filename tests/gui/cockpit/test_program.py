"""The window of ``rosglass cockpit``: layouts are made, changed, saved and opened in it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("PySide6", reason="the editor needs Qt 6")

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

LAYOUT = """import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import RosCockpit 1.0

Cockpit {
    title: "Test"
    nodeName: "ui"
    // Both are watched.
    Page {
        title: "One"
        Split {
            Panel {
                title: "Power"
                Battery { topic: "/battery" } // of the arm
            }
            Panel {
                title: "Lean"
                Attitude {}
            }
        }
    }
}
"""


class Editor:
    """The editor's window, on a robot made of memory."""

    def __init__(self, running: Any, wait: Any, layout: str | Path = "") -> None:
        from rosglass.cockpit.modules import register
        from rosglass.cockpit.program import WINDOW, CockpitProgram
        from rosglass.qt import QtCore, QtQml

        register()
        self.bench, self.wait = running, wait
        self.program: Any = CockpitProgram(layout)
        running.engine.rootContext().setContextProperty("program", self.program)
        component = QtQml.QQmlComponent(running.engine, QtCore.QUrl.fromLocalFile(str(WINDOW)))
        self.window: Any = component.create()
        assert self.window is not None, component.errorString()
        running.roots += [self.window, component]
        wait(self.window.isExposed)
        self.window.requestActivate()
        wait(self.window.isActive)

    @property
    def text(self) -> str:
        return str(self.program._live.document.text)

    @property
    def root(self) -> Any:
        return self.program._live.root

    def find(self, name: str) -> Any:
        """Return the item with an ``objectName``, once there is one."""

        def look() -> Any:
            waiting = [self.window.contentItem()]
            while waiting:
                one = waiting.pop()
                if one.objectName() == name and one.isVisible():
                    return one
                waiting += one.childItems()
            return None

        self.wait(look)
        return look()

    def click(self, name: str) -> None:
        from rosglass.qt import QtCore, optional

        item = self.find(name)
        at = item.mapToScene(QtCore.QPointF(item.width() / 2, item.height() / 2)).toPoint()
        left, none = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
        optional("QtTest").QTest.mouseClick(self.window, left, none, at)

    def answer(self, index: int) -> None:
        """Click on an answer of the question, once it can be clicked."""
        from rosglass.qt import QtCore

        box = self.window.findChild(QtCore.QObject, "question")
        self.wait(lambda: box.property("opened"))
        item = self.find(f"answer{index}")
        place: list[float] = []

        def stands() -> bool:
            place.append(item.mapToScene(QtCore.QPointF(0, 0)).x())
            return len(place) > 3 and place[-1] == place[-3]

        self.wait(stands)
        self.click(f"answer{index}")
        assert self.program.property("question") == ""

    def key(self, text: str) -> None:
        from rosglass.qt import QtGui, optional

        pressed = QtGui.QKeySequence(text)[0]
        optional("QtTest").QTest.keyClick(self.window, pressed.key(), pressed.keyboardModifiers())

    def type(self, text: str) -> None:
        from rosglass.qt import optional

        for letter in text:
            optional("QtTest").QTest.keyClick(self.window, letter)

    def select(self, title: str) -> None:
        """Select the panel with a title."""
        live = self.program._live
        found = next(
            one
            for one in live.document.objects()
            if one.type == "Panel" and one.get("title") and one.get("title").value == title
        )
        self.root.setProperty("current", live.item_of(found))


@pytest.fixture
def edit(
    running: Any, wait: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., Editor]]:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("ROSGLASS_URL", "local://empty")
    made: list[Editor] = []

    def start(layout: str | Path = "") -> Editor:
        made.append(Editor(running, wait, layout))
        return made[-1]

    yield start
    from rosglass.qt import send_deferred_deletes

    for one in made:
        one.program.close()
    send_deferred_deletes()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "drive.qml"
    path.write_text(LAYOUT)
    return path


def test_start_page_makes_a_layout(edit: Callable[..., Editor]) -> None:
    editor = edit()
    assert editor.find("startPage").isVisible()
    editor.click("new")
    editor.wait(lambda: editor.program.property("opened"))
    assert editor.program.property("editing")
    editor.find("catalogueSearch").forceActiveFocus()
    editor.type("batery")
    editor.wait(lambda: editor.program.property("catalogue")[0]["title"] == "Battery")
    editor.key("Return")
    assert "Battery {}" in editor.text
    assert editor.program.property("undoText") == "Add Battery"
    editor.click("undo")
    assert "Battery {}" not in editor.text
    editor.click("redo")
    assert "Battery {}" in editor.text


def test_property_is_changed_on_its_own_line(edit: Callable[..., Editor], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.key("F4")
    assert editor.root.property("editing")
    editor.select("Power")
    form = editor.find("form").property("model")
    editor.wait(lambda: form.property("title") == "Battery")
    assert editor.find("panelName").property("text") == "Battery"
    assert form.setText("topic", "/arm/battery")
    assert editor.text == LAYOUT.replace('"/battery"', '"/arm/battery"')
    assert editor.program.property("modified")
    editor.key("Ctrl+S")
    assert file.read_text() == editor.text
    assert not editor.program.property("modified")


def test_palette_finds_commands_in_spite_of_typos(edit: Callable[..., Editor], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.key("Ctrl+P")
    editor.find("paletteField")
    editor.type("add guage")
    editor.key("Return")
    editor.wait(lambda: "Gauge {" in editor.text)


def test_opened_layouts_are_remembered(
    edit: Callable[..., Editor], file: Path, tmp_path: Path
) -> None:
    edit(file)
    assert json.loads((tmp_path / "state/rosglass/cockpit/recent.json").read_text()) == [str(file)]


def test_broken_layout_is_named(edit: Callable[..., Editor], file: Path) -> None:
    file.write_text(LAYOUT.replace("Split {", "Split {{"))
    editor = edit(file)
    assert f"{file}:" in editor.program.property("problem")
    assert not editor.program.property("opened")


def test_change_of_another_program_is_merged(edit: Callable[..., Editor], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.select("Power")
    editor.program.rename("Energy")
    file.write_text(LAYOUT.replace('"Lean"', '"Horizon"'))
    editor.wait(lambda: "Horizon" in editor.text)
    assert "Energy" in editor.text
    file.write_text(LAYOUT.replace('"Power"', '"Volts"'))
    editor.wait(lambda: editor.program.property("question") != "")
    editor.answer(1)
    assert "Energy" in editor.text


def test_changes_survive_a_crash(edit: Callable[..., Editor], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.select("Power")
    editor.program.rename("Energy")
    again = edit(file)
    again.wait(lambda: again.program.property("question") != "")
    again.answer(0)
    again.wait(lambda: "Energy" in again.text)


def test_help_of_a_panel_opens_its_page(edit: Callable[..., Editor], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.select("Power")
    editor.root.helpRequested.emit(editor.root.property("current"))
    editor.wait(lambda: "How much is left in a battery" in editor.program.property("helpText"))
    editor.find("helpPage")
    editor.key("Esc")
    editor.wait(lambda: editor.program.property("helpText") == "")


def test_layout_of_a_stranger_is_opened_once_it_is_agreed_to(
    edit: Callable[..., Editor], file: Path
) -> None:
    file.write_text(LAYOUT.replace("Attitude {}", "DriveStick {}"))
    editor = edit(file)
    editor.wait(lambda: editor.program.property("question") != "")
    assert "DriveStick (line 19)" in editor.program.property("question")
    assert not editor.program.property("hasLayout")
    editor.answer(2)
    assert not editor.program.property("hasLayout")
    editor.program.open(str(file))
    editor.answer(0)
    editor.wait(lambda: editor.program.property("opened"))
    again = edit(file)
    again.wait(lambda: again.program.property("opened"))
    assert again.program.property("question") == ""
