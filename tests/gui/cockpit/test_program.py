"""The window of ``rosglass cockpit``: layouts are made, changed, saved and opened in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("PySide6", reason="the editor needs Qt 6")

if TYPE_CHECKING:
    from collections.abc import Callable

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


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "drive.qml"
    path.write_text(LAYOUT)
    return path


def test_start_page_makes_a_layout(edit: Callable[..., Any]) -> None:
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


def test_a_plugin_of_rqml_shows_another_one(edit: Callable[..., Any]) -> None:
    from rosglass.cockpit.rqml_api import RqmlApi
    from rosglass.qt import QtQml

    editor = edit(panels=(Path(__file__).with_name("rqml_plugins"),))
    editor.click("new")
    editor.wait(lambda: editor.program.property("opened"))
    RqmlApi.of(QtQml.qmlEngine(editor.root)).createPlugin("robot_panels.counter")
    editor.wait(lambda: "Counter.qml" in editor.text)
    assert editor.program.property("undoText") == "Add Counter"
    editor.click("undo")
    assert "Counter.qml" not in editor.text


def test_property_is_changed_on_its_own_line(edit: Callable[..., Any], file: Path) -> None:
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


def test_palette_finds_commands_in_spite_of_typos(edit: Callable[..., Any], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.key("Ctrl+P")
    editor.find("paletteField")
    editor.type("add guage")
    editor.key("Return")
    editor.wait(lambda: "Gauge {" in editor.text)


def test_opened_layouts_are_remembered(
    edit: Callable[..., Any], file: Path, tmp_path: Path
) -> None:
    edit(file)
    assert json.loads((tmp_path / "state/rosglass/cockpit/recent.json").read_text()) == [str(file)]


def test_broken_layout_is_named(edit: Callable[..., Any], file: Path) -> None:
    file.write_text(LAYOUT.replace("Split {", "Split {{"))
    editor = edit(file)
    assert f"{file}:" in editor.program.property("problem")
    assert not editor.program.property("opened")


def test_change_of_another_program_is_merged(edit: Callable[..., Any], file: Path) -> None:
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


def test_changes_survive_a_crash(edit: Callable[..., Any], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.select("Power")
    editor.program.rename("Energy")
    again = edit(file)
    again.wait(lambda: again.program.property("question") != "")
    again.answer(0)
    again.wait(lambda: "Energy" in again.text)


def test_new_layout_survives_a_crash(edit: Callable[..., Any]) -> None:
    editor = edit()
    editor.click("new")
    editor.wait(lambda: editor.program.property("opened"))
    editor.program.run("add page")
    text = editor.text
    again = edit()
    again.answer(0)
    again.wait(lambda: again.program.property("opened"))
    assert again.text == text
    assert again.program.property("modified")
    again.program.discard()
    assert edit().program.property("question") == ""


def test_change_of_another_program_leaves_nothing_to_recover(
    edit: Callable[..., Any], file: Path
) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    file.write_text(LAYOUT.replace('"Lean"', '"Horizon"'))
    editor.wait(lambda: "Horizon" in editor.text)
    assert not editor.program.property("modified")
    editor.program.undo()
    assert editor.program.property("modified"), "the file has another text"
    editor.program.redo()
    file.write_text(LAYOUT)
    again = edit(file)
    again.wait(lambda: again.program.property("opened"))
    assert again.program.property("question") == ""


def test_help_of_a_panel_opens_its_page(edit: Callable[..., Any], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.select("Power")
    editor.root.helpRequested.emit(editor.root.property("current"))
    editor.wait(lambda: "How much is left in a battery" in editor.program.property("helpText"))
    editor.find("helpPage")
    editor.key("Esc")
    editor.wait(lambda: editor.program.property("helpText") == "")


def test_layout_of_a_stranger_is_opened_once_it_is_agreed_to(
    edit: Callable[..., Any], file: Path
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


def test_layout_of_foxglove_becomes_a_new_one(edit: Callable[..., Any], tmp_path: Path) -> None:
    evil = '"; Component.onCompleted: Qt.quit(); title: "'
    configs = {
        "RawMessages!a": {"topicPath": "/odom", "foxglovePanelTitle": evil},
        "Audio!b": {},
        "Indicator!c": {"path": "/a.data", "fallbackLabel": "dark"},
        "Teleop!d": {"topic": "/cmd_vel"},
    }
    layout: Any = "RawMessages!a"
    for name in list(configs)[1:]:
        layout = {"direction": "row", "first": layout, "second": name}
    file = tmp_path / "desk.json"
    file.write_text(json.dumps({"configById": configs, "layout": layout}))
    editor = edit(file)
    editor.wait(lambda: editor.program.question)
    assert editor.program.question == (
        "This layout of Foxglove was read, except for:\n• Audio: there is no such panel here"
    )
    editor.program.answer(0)
    assert [one.property("title") for one in editor.root.panels().toVariant()] == [
        *(evil, "Lamp", "Drive stick")
    ]
    assert editor.program.problem == ""
    # It has no file: the one that was read stays as it is.
    assert editor.program.path == ""
    assert editor.program.modified
    assert editor.program.editing
    assert not editor.program.save("")


def test_broken_layout_of_foxglove_is_refused(edit: Callable[..., Any], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.opened)
    other = file.with_suffix(".json")
    other.write_text('{"configById": {')
    editor.program.open(str(other))
    assert "layout.json:1:17: this is not JSON" in editor.program.problem.replace(
        file.stem, "layout"
    )
    assert editor.text == LAYOUT


def test_pages_for_all_robots_are_made_and_undone(edit: Callable[..., Any], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.opened)
    editor.program.run("edit")
    twist = "geometry_msgs/msg/Twist"
    keep = [
        editor.bench.robot.create_subscription(f"/{name}/cmd_vel", twist, lambda _: None)
        for name in ("anna", "bert", "carl")
    ]
    node = editor.bench.session.node
    editor.wait(lambda: "/carl/cmd_vel" in node.topics())
    editor.program.run("robot pages")
    assert editor.text.count("Page {") == 3
    pages = editor.root.property("pages").toVariant()
    assert [one.property("ns") for one in pages] == ["/anna", "/bert", "/carl"]
    assert [one.property("title") for one in pages] == ["One anna", "One bert", "One carl"]
    assert editor.text.count('Battery { topic: "/battery"; ns: "/bert" } // of the arm') == 1
    assert "/battery (line 15)" in editor.program.message
    editor.program.run("robot pages")
    assert editor.program.message == "each of the 3 robots has its page"
    editor.program.undo()
    assert editor.text == LAYOUT
    for one in keep:
        one.close()
    editor.wait(lambda: "/carl/cmd_vel" not in node.topics())
    editor.program.run("robot pages")
    assert "no robot is found" in editor.program.message


def test_field_dropped_on_a_panel_is_written_to_the_layout(
    edit: Callable[..., Any], file: Path
) -> None:
    file.write_text(LAYOUT.replace("Attitude {}", 'Gauge { path: "/a:data" }'))
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    gauge = next(
        one
        for one in editor.root.findChildren(type(editor.window).__mro__[-2])
        if one.metaObject().className().startswith("Gauge_QML")
    )
    gauge.setProperty("path", "/b:data")
    editor.wait(lambda: 'Gauge { path: "/b:data" }' in editor.text)
    editor.program.undo()
    assert gauge.property("path") == "/a:data"
    assert 'Gauge { path: "/a:data" }' in editor.text


def test_layout_with_errors_outside_of_panels_is_named(
    edit: Callable[..., Any], file: Path
) -> None:
    file.write_text(LAYOUT.replace("Split {", "Splitt {"))
    editor = edit(file)
    editor.answer(1)
    assert "Splitt is not a type" in editor.program.property("problem")
    assert not editor.program.property("opened")


def test_misspelt_layout_is_refused_with_the_nearest_name(app: Any, file: Path) -> None:
    from rosglass.cockpit.program import CockpitProgram
    from rosglass.errors import QmlError

    with pytest.raises(QmlError, match=r"did you mean drive\.qml"):
        CockpitProgram(file.with_name("drve.qml"))
