"""Layouts and programs that do what none should: the editor lives on, and no text is lost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("PySide6", reason="the editor needs Qt 6")

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

HEAD = """import QtQuick 2.15
import RosControls 1.0
import RosCockpit 1.0

Cockpit {
    nodeName: "ui"
    Page {
        title: "One"
        Panel { title: "Power"; Battery { topic: "/battery" } }

        // What others add; changes of adjacent lines are a conflict.

"""
TAIL = "    }\n}\n"


@pytest.fixture
def open_(edit: Callable[..., Any], tmp_path: Path) -> Callable[[str], Any]:
    """Opens a layout with further panels."""

    def start(panels: str) -> Any:
        path = tmp_path / "layout.qml"
        path.write_text(HEAD + panels + TAIL)
        editor = edit(path)
        if editor.program.property("question"):
            editor.answer(1)
        editor.wait(lambda: editor.program.property("opened"))
        return editor

    return start


def test_panel_that_loops_for_ever_is_ended_and_said(open_: Callable[[str], Any]) -> None:
    editor = open_(
        'Panel { title: "Loop"; Item { property int n: 0; onNChanged: { while (true) {} }\n'
        "Timer { interval: 1; running: true; onTriggered: parent.n += 1 } } }\n"
    )
    editor.bench.session.longest_script = 0.3
    editor.wait(lambda: "ended in" in editor.program.property("message"), timeout=60)
    editor.key("F4")
    editor.select("Power")
    editor.program.rename("Energy")
    assert "Energy" in editor.text


def test_panel_that_throws_at_load_and_later_leaves_the_editor_usable(
    open_: Callable[[str], Any],
) -> None:
    editor = open_(
        'Panel { title: "Load"; Item { Component.onCompleted: { throw new Error("now") } } }\n'
        'Panel { title: "Later"; Item { Timer { interval: 1; running: true; repeat: true\n'
        'onTriggered: { for (let i = 0; i < 50; i++) Qt.callLater(() => { throw new Error("x") }) }'
        "} } }\n"
    )
    editor.key("F4")
    editor.select("Power")
    editor.program.rename("Energy")
    assert editor.find("stage").isVisible()
    assert "Energy" in editor.text


def test_file_that_changes_ten_times_a_second_while_it_is_edited(
    open_: Callable[[str], Any], tmp_path: Path, app: Any
) -> None:
    from rosglass.qt import QtCore

    editor = open_('Panel { title: "Lean"; Attitude {} }\n')
    path, count = tmp_path / "layout.qml", 0

    def change() -> None:
        nonlocal count
        count += 1
        lines = path.read_text().splitlines(keepends=True)
        lines[-2] = f"    }} // {count}\n"
        part = path.with_suffix(".part")
        part.write_text("".join(lines))
        part.replace(path)

    timer = QtCore.QTimer()
    timer.setInterval(100)
    timer.timeout.connect(change)
    timer.start()
    for number in range(6):
        editor.select(title_of_battery(editor))
        editor.program.rename(f"Energy {number}")
        editor.wait(lambda seen=count: count > seen + 3)
    timer.stop()
    editor.wait(lambda: f"// {count}" in editor.text)
    assert editor.program.property("question") == ""
    assert 'title: "Energy 5"' in editor.text
    assert editor.program.save("")
    assert path.read_text() == editor.text


def title_of_battery(editor: Any) -> str:
    """Return the title of the battery's panel."""
    panel = next(one for one in editor.program._live.document.objects() if one.type == "Battery")
    return str(panel.parent.get("title").value)


def test_two_cockpits_on_one_file(edit: Callable[..., Any], open_: Callable[[str], Any]) -> None:
    first = open_('Panel { title: "Lean"; Attitude {} }\n')
    second = edit(first.program.property("path"))
    second.wait(lambda: second.program.property("opened"))
    first.select("Power")
    first.program.rename("Energy")
    second.select("Lean")
    second.program.rename("Horizon")
    assert first.program.save("")
    second.program.save("")
    second.wait(lambda: "Energy" in second.text)
    assert second.program.save("")
    first.wait(lambda: "Horizon" in first.text)
    assert first.text == second.text
    assert not first.program.property("modified")
