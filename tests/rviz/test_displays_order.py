"""Overlays in RViz's Displays panel: order, style sheets, and unsaved changes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from rosglass.rviz.host import pyqt

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

SQUARE = 'import QtQuick 2.15\nItem {{ Rectangle {{ width: 200; height: 200; color: "{0}" }} }}\n'
RED, BLUE, LIME, GREY = (255, 0, 0), (0, 0, 255), (0, 255, 0), (48, 48, 48)


@pytest.fixture(autouse=True)
def entries(app: Any, wait: Callable[..., None]) -> Iterator[Any]:
    wait(lambda: not list(app.entries))
    yield app.entries
    app.overlays.close()
    wait(lambda: not list(app.entries))


@pytest.fixture
def squares(app: Any, tmp_path: Path, wait: Any, entries: Any) -> list[Any]:
    """A red overlay, and a blue one above it."""
    made = []
    for name in ("Red", "Blue"):
        file = tmp_path / f"{name}.qml"
        file.write_text(SQUARE.format(name.lower()))
        made.append(app.add_qml(file))
    wait(lambda: len(list(entries)) == 2)
    return made


@pytest.fixture
def seen(grab: Any) -> Callable[[], tuple[int, ...]]:
    return lambda: tuple(grab().pixelColor(100, 100).getRgb()[:3])


def order(app: Any) -> list[str]:
    return [overlay.name for overlay in app.overlays]


def place(panel: Any, name: str) -> int:
    return int(panel.rows(name).row())


def test_dragging_an_entry_changes_which_is_above(
    app: Any, squares: Any, panel: Any, wait: Any, seen: Any, rviz_notices_changes: Any
) -> None:
    assert seen() == BLUE
    # RViz takes what happens within a second after loading for a part of it.
    wait(rviz_notices_changes)
    app.window.widget.setWindowModified(False)
    panel.drag(("Blue",), place(panel, "Red"))
    wait(lambda: order(app) == ["Blue", "Red"])
    assert seen() == RED
    assert app.window.modified
    # What a program brings to the front stays there until the user drags something.
    app.overlays.to_front(squares[1])
    wait.frames(2)
    assert order(app) == ["Red", "Blue"]
    panel.drag(("Red",), place(panel, "Blue"))
    # Wait for the panel: two moves at once would cancel each other.
    wait(lambda: [overlay.name for overlay in app.entries.panel_order] == ["Red", "Blue"])
    panel.drag(("Blue",), place(panel, "Red"))
    wait(lambda: order(app) == ["Blue", "Red"])
    # A number counts more than the place.
    squares[1].z = 1
    assert seen() == BLUE


def test_a_number_set_and_set_back_leaves_the_order(app: Any, squares: Any, seen: Any) -> None:
    red, blue = squares
    for other in (1, -1):
        red.z = other
        assert order(app)[max(other, 0)] == "Red"
        red.z = 0
        assert order(app) == ["Red", "Blue"]
        blue.z = other
        blue.z = 0
        assert order(app) == ["Red", "Blue"]
    assert seen() == BLUE
    # Who is raised stays so among its equals, even if it was above all by its number alone.
    red.z = 1
    app.overlays.to_front(red)
    red.z = 0
    assert order(app) == ["Blue", "Red"]
    app.overlays.to_back(red)
    assert (order(app), red.z) == (["Red", "Blue"], 0)


def test_a_file_keeps_the_order(
    app: Any, squares: Any, panel: Any, wait: Any, seen: Any, tmp_path: Path
) -> None:
    panel.drag(("Blue",), place(panel, "Red"))
    wait(lambda: order(app) == ["Blue", "Red"])
    saved = tmp_path / "saved.rviz"
    app.save_config(saved)
    # What a program has brought, too.
    panel.drag(("Red",), place(panel, "Blue"))
    wait(lambda: order(app) == ["Red", "Blue"])
    app.load_config(saved)
    wait(lambda: order(app) == ["Blue", "Red"])
    assert list(app.overlays) == [squares[1], squares[0]]
    for overlay in squares:
        app.overlays.remove(overlay)
    wait(lambda: not list(app.entries))
    app.load_config(saved)
    wait(lambda: order(app) == ["Blue", "Red"])
    assert seen() == RED
    assert not app.window.modified


def test_entries_are_dragged_into_groups_and_out_again(
    app: Any, squares: Any, panel: Any, wait: Any, seen: Any
) -> None:
    app.window.manager.createDisplay("rviz/Group", "Group", True)
    panel.drag(("Red",), 0, ("Group",))
    wait(lambda: order(app) == ["Blue", "Red"])
    assert seen() == RED
    panel.check(False, "Group")
    wait(lambda: not squares[0].visible)
    assert seen() == BLUE
    panel.drag(("Group", "Red"), place(panel, "Blue"))
    wait(lambda: squares[0].visible and order(app) == ["Red", "Blue"])
    assert seen() == BLUE
    assert list(app.overlays) == squares


def test_nothing_can_be_dropped_into_an_entry(app: Any, squares: Any, panel: Any) -> None:
    core = pyqt().Qt
    flags = panel.model.flags(panel.rows("Red"))
    assert flags & core.ItemIsDragEnabled
    assert not flags & core.ItemIsDropEnabled


# Widgets.


@pytest.fixture
def styled(app: Any, wait: Any) -> Callable[..., Any]:
    """Show a widget with a style sheet."""
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtWidgets

    def styled(style_sheet: str = "") -> Any:
        frame = QtWidgets.QFrame()
        inner = QtWidgets.QFrame(frame)
        inner.setObjectName("inner")
        inner.setGeometry(0, 0, 200, 200)
        overlay = app.add(WidgetOverlay(frame, "Legend", style_sheet=style_sheet))
        wait(lambda: app.entries.of(overlay) is not None)
        return overlay

    return styled


@pytest.mark.parametrize("how", ["inline", "file", "package"])
def test_style_sheets_are_seen_edited_saved_and_restored(
    app: Any,
    styled: Any,
    panel: Any,
    wait: Any,
    seen: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    how: str,
) -> None:
    text = "#inner {{ background: {0}; }}"
    package = tmp_path / "looks"
    package.mkdir()
    (package / "package.xml").write_text("<package><name>looks</name></package>")
    (package / "lime.qss").write_text(text.format("lime"))
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    lime = {
        "inline": text.format("lime"),
        "file": str(package / "lime.qss"),
        "package": "package://looks/lime.qss",
    }[how]
    overlay = styled(text.format("blue"))
    assert panel.texts("Legend")["Style Sheet"] == text.format("blue")
    assert seen() == BLUE
    panel.edit(lime, "Legend", "Style Sheet")
    assert overlay.style_sheet == lime
    wait(lambda: seen() == LIME)
    saved = tmp_path / "saved.rviz"
    app.save_config(saved)
    # The program's own widget takes the entry of a file, with what was saved for it.
    panel.edit("", "Legend", "Style Sheet")
    wait(lambda: seen() == GREY)
    app.load_config(saved)
    wait(lambda: overlay.style_sheet == lime)
    assert [entry.overlay for entry in app.entries] == [overlay]
    wait(lambda: seen() == LIME)
    assert panel.texts("Legend")["Style Sheet"] == lime


def test_a_widget_added_after_the_file_gets_its_saved_values(
    app: Any, styled: Any, panel: Any, wait: Any, tmp_path: Path
) -> None:
    lime, saved = "#inner { background: lime; }", tmp_path / "saved.rviz"
    overlay = styled(lime)
    panel.edit(0.5, "Legend", "Opacity")
    app.save_config(saved)
    app.overlays.remove(overlay)
    wait(lambda: not list(app.entries))
    app.load_config(saved)
    wait.frames(3)
    assert list(app.overlays) == []
    again = styled()
    assert (again.style_sheet, again.opacity) == (lime, 0.5)
    assert len(list(app.entries)) == 1
    shown = [panel.model.index(row, 0).data() for row in range(panel.model.rowCount())]
    assert shown.count("Legend") == 1


def test_a_missing_style_sheet_is_reported(
    app: Any, styled: Any, panel: Any, wait: Any, tmp_path: Path
) -> None:
    overlay = styled()
    panel.edit("package://nowhere/look.qss", "Legend", "Style Sheet")
    wait(lambda: "Status: Error" in panel.texts("Legend"))
    assert "nowhere" in panel.texts("Legend", "Status: Error")["Overlay"]
    assert "nowhere" in overlay.problem
    panel.edit("#inner { background: lime; }", "Legend", "Style Sheet")
    wait(lambda: "Status: Ok" in panel.texts("Legend"))


# Changes that a file does not know.


def test_saved_values_mark_rviz_as_modified(
    app: Any, squares: Any, panel: Any, wait: Any, tmp_path: Path, rviz_notices_changes: Any
) -> None:
    # RViz takes what happens within a second after loading for a part of it.
    wait(rviz_notices_changes)
    overlay = squares[0]
    speed = overlay.properties.registerFloatProperty("Speed", 1.0)
    file = tmp_path / "saved.rviz"
    app.save_config(file)
    window = app.window.widget
    changes: list[Callable[[], Any]] = [
        lambda: overlay.properties.set_config({"tab": 3}),
        lambda: speed.set(2.0),
        lambda: panel.edit(7.5, "Red", "Configuration", "Speed"),
        lambda: panel.edit(0.5, "Red", "Opacity"),
        lambda: setattr(overlay, "z", 3),
        lambda: setattr(overlay, "visible", False),
        lambda: panel.check(True, "Red"),
    ]
    for number, change in enumerate(changes):
        app.save_config(file)
        wait.frames(1)
        assert not app.window.modified, number
        assert "*" not in window.windowTitle().replace("[*]", "")
        change()
        wait(lambda: app.window.modified)
        # Qt shows a star in its place.
        assert "[*]" in window.windowTitle()
    # Setting the same values again is not a change.
    wait.frames(3)
    app.save_config(file)
    overlay.properties.set_config({"tab": 3})
    speed.set(7.5)
    overlay.z = 3
    wait.frames(3)
    assert not app.window.modified


def test_closing_asks_for_what_was_changed(
    app: Any, squares: Any, wait: Any, tmp_path: Path
) -> None:
    from rosglass.qt import QtCore
    from rosglass.rviz.qt5 import QtWidgets

    app.save_config(tmp_path / "saved.rviz")
    squares[0].properties.set_config({"tab": 3})
    wait(lambda: app.window.modified)
    asked: list[str] = []

    def cancel() -> None:
        (box,) = [w for w in app.qt.topLevelWidgets() if isinstance(w, QtWidgets.QMessageBox)]
        asked.append(box.text())
        box.button(QtWidgets.QMessageBox.Cancel).click()

    QtCore.QTimer.singleShot(300, cancel)
    assert not app.window.widget.close()
    assert len(asked) == 1
    assert app.window.widget.isVisible()
    assert list(app.overlays) == squares
    app.save_config()


def test_another_fixed_frame_changes_no_overlay(
    app: Any, squares: Any, panel: Any, wait: Any, seen: Any
) -> None:
    for frame in ("odom", "nowhere", "map"):
        panel.edit(frame, "Global Options", "Fixed Frame")
        wait(lambda frame=frame: app.fixed_frame == frame)
        assert seen() == BLUE
        assert panel.texts("Blue")["Z-Index"] == 0
        assert list(app.overlays) == squares
    assert [overlay.problem for overlay in squares] == ["", ""]
