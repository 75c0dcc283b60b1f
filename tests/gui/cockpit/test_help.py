"""Help in the window of ``rosglass cockpit``: the tour, the keys and the pages."""

from __future__ import annotations

import os
import re
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
    nodeName: "ui"
    Page {
        Panel { title: "Power"; Battery { topic: "/battery" } }
        Panel { title: "Lean"; Attitude {} }
    }
}
"""
DOCS = Path(__file__).parents[3] / "docs"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "drive.qml"
    path.write_text(LAYOUT)
    return path


def search(editor: Any, name: str) -> Any:
    """Return the visible item with an ``objectName``; None if there is none."""
    waiting = [editor.window.contentItem()]
    while waiting:
        one = waiting.pop()
        if one.objectName() == name and one.isVisible():
            return one
        waiting += one.childItems()
    return None


@pytest.mark.first_start
def test_tour_begins_at_the_first_start_and_escape_ends_it(
    edit: Callable[..., Any], tmp_path: Path
) -> None:
    editor = edit()
    seen = tmp_path / "state/rosglass/cockpit/tour_seen"
    said = {editor.find("hintText").property("text")}
    for _ in range(3):
        editor.key("Return")
        said.add(editor.find("hintText").property("text"))
    assert len(said) == 4
    assert not seen.exists()
    editor.key("Escape")
    assert search(editor, "hintText") is None
    assert seen.exists()
    assert not edit().program.property("hints")


@pytest.mark.first_start
def test_tour_does_not_cover_a_layout_that_was_given(edit: Callable[..., Any], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    assert not editor.program.property("hints")
    assert search(editor, "hintText") is None


def test_tour_is_started_again_by_the_palette(edit: Callable[..., Any], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    assert search(editor, "hintText") is None
    editor.key("Ctrl+P")
    editor.find("paletteField")
    editor.type("tour of")
    editor.key("Return")
    hint = editor.find("hintText")
    assert "robot" in hint.property("text")
    editor.click("hintSkip")
    editor.wait(lambda: search(editor, "hintText") is None)


def test_f1_without_a_panel_lists_all_keys(edit: Callable[..., Any], file: Path) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.key("F1")
    text = editor.program.property("helpText")
    for said in ("**Ctrl+Shift+S**: Save the layout as", "**F11**: maximise", "**F8, arrow keys"):
        assert said in text
    editor.key("Escape")
    editor.wait(lambda: not editor.program.property("helpText"))
    editor.select("Power")
    editor.key("F1")
    assert editor.program.property("helpText").startswith("# Battery")


def test_every_panel_of_the_catalogue_has_a_page_with_links_that_lead_on(
    edit: Callable[..., Any],
) -> None:
    from rosglass.cockpit.panels import controls

    program = edit().program
    for panel in controls():
        program.help(panel.page)
        text = program.property("helpText")
        assert text.startswith("# "), panel.name
        assert "--8<--" not in text, panel.name
        # An odd number would show the rest of the page as code.
        assert text.count("```") % 2 == 0, panel.name
        for link in re.findall(r"\]\(([^)\s]+\.md[^)]*)\)", text):
            if "://" not in link:
                program.help(panel.page)
                program.follow(link)
                assert program.property("helpText") != text, (panel.name, link)


def test_pages_that_are_shown_come_with_the_wheel() -> None:
    from rosglass.cockpit.panels import controls

    build = (DOCS.parent / "pyproject.toml").read_text()
    pages = {panel.page.removesuffix(".html") for panel in controls()} | {"cockpit"}
    linked = {
        os.path.normpath(f"{Path(page).parent}/{link}")
        for page in pages
        for link in re.findall(r"\]\(([^)\s#:]+)\.md", (DOCS / f"{page}.md").read_text())
    }
    # That one is written while the web pages are built.
    for page in (pages | linked) - {"reference/command_line"}:
        places = (f"docs/{page}.md", str(Path(f"docs/{page}.md").parent))
        assert any(f'"{one}" =' in build for one in places), page


def test_keyboard_goes_from_the_bar_to_catalogue_layout_and_form(
    edit: Callable[..., Any], file: Path
) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.key("F4")
    editor.select("Power")
    editor.find("home").forceActiveFocus()
    places = [editor.find(name) for name in ("catalogue", "stage", "properties")]
    passed: list[int] = []
    for _ in range(40):
        editor.key("Tab")
        item = editor.window.activeFocusItem()
        for at, place in enumerate(places):
            if place.isAncestorOf(item) and at not in passed:
                passed.append(at)
    assert passed == [0, 1, 2]


def test_keyboard_alone_adds_changes_moves_and_removes_a_panel(
    edit: Callable[..., Any], file: Path
) -> None:
    editor = edit(file)
    editor.wait(lambda: editor.program.property("opened"))
    editor.key("Ctrl+I")
    editor.wait(lambda: editor.find("catalogueSearch").hasActiveFocus())
    editor.type("compass")
    editor.key("Return")
    editor.wait(lambda: "Compass {" in editor.text)
    editor.key("F6")
    before = editor.text
    editor.key("Ctrl+Shift+Right")
    editor.wait(lambda: editor.text != before)
    editor.key("Ctrl+E")
    editor.wait(lambda: editor.find("panelTitle").hasActiveFocus())
    editor.key("Ctrl+A")
    editor.type("mine")
    editor.key("Return")
    editor.wait(lambda: 'title: "mine"' in editor.text)
    editor.key("F6")
    before = editor.text
    editor.key("Delete")
    editor.wait(lambda: len(editor.text) < len(before))


def test_empty_page_says_what_to_do_next(edit: Callable[..., Any]) -> None:
    editor = edit()
    editor.click("new")
    editor.wait(lambda: editor.program.property("opened"))
    assert "choose a panel" in editor.find("emptyPage").property("text")
    editor.program.add(0)
    editor.wait(lambda: search(editor, "emptyPage") is None)
