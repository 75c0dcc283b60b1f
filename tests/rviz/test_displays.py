"""Overlays as entries of RViz's Displays panel, and in its config files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

QML = """import QtQuick 2.15
Item {
    property var speed: rviz.registerFloatProperty("Speed", 1, "m/s", {min: 0, max: 2})
    Rectangle { x: 40; y: 30; width: 100; height: 60; color: "#0080ff" }
}
"""
BLUE, GREY = (0, 128, 255), (48, 48, 48)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    file = tmp_path / "Dashboard.qml"
    file.write_text(QML)
    return file


@pytest.fixture(autouse=True)
def entries(app: Any, wait: Callable[..., None]) -> Iterator[Any]:
    wait(lambda: not list(app.entries))
    yield app.entries
    for entry in app.entries:
        app.entries.remove(entry)
    app.overlays.close()
    wait.frames(2)


def only(entries: Any) -> Any:
    (entry,) = list(entries)
    return entry


def test_an_overlay_has_an_entry(
    app: Any, file: Path, wait: Callable[..., None], panel: Any, entries: Any
) -> None:
    app.add_qml(file, z=3, scale=1.5, opacity=0.5)
    wait(lambda: len(list(entries)) == 1)
    shown = panel.texts("Dashboard")
    assert shown["Path"] == str(file)
    assert (shown["Z-Index"], shown["Scale"], shown["Opacity"]) == (3, 1.5, 0.5)
    assert panel.texts("Dashboard", "Configuration") == {"Speed": 1.0}
    status = next(name for name in shown if name.startswith("Status"))
    assert status == "Status: Ok"
    assert panel.texts("Dashboard", status) == {"Overlay": "OK", "Qml": "OK"}
    assert not panel.rows("Dashboard").data(1).isNull()


def test_the_check_box_shows_and_hides(
    app: Any, file: Path, wait: Callable[..., None], panel: Any, entries: Any, grab: Any
) -> None:
    from rosglass.rviz.host import pyqt

    overlay = app.add_qml(file)
    wait(lambda: len(list(entries)) == 1)
    assert grab().pixelColor(90, 60).getRgb()[:3] == BLUE
    at = panel.rows("Dashboard").siblingAtColumn(1)
    panel.check(False, "Dashboard")
    wait(lambda: not overlay.visible)
    assert grab().pixelColor(90, 60).getRgb()[:3] == GREY
    overlay.visible = True
    wait(only(entries).display.isEnabled)
    assert at.data(pyqt().Qt.CheckStateRole) == pyqt().Qt.Checked


def test_edits_in_the_panel_reach_the_overlay_and_back(
    app: Any, file: Path, wait: Callable[..., None], panel: Any, entries: Any
) -> None:
    overlay = app.add_qml(file)
    wait(lambda: len(list(entries)) == 1)

    panel.edit(7, "Dashboard", "Z-Index")
    panel.edit(2.5, "Dashboard", "Scale")
    panel.edit(1.25, "Dashboard", "Configuration", "Speed")
    assert (overlay.z, overlay.scale) == (7, 2.5)
    assert overlay.root.property("speed").property("value") == 1.25
    panel.edit(99.0, "Dashboard", "Scale")
    panel.edit(-1.0, "Dashboard", "Configuration", "Speed")
    assert overlay.scale == 2.5
    assert panel.texts("Dashboard")["Scale"] == 2.5
    assert panel.texts("Dashboard", "Configuration") == {"Speed": 1.25}
    overlay.scale = 0.5
    assert panel.texts("Dashboard")["Scale"] == 0.5


def test_errors_become_the_status(
    app: Any, file: Path, wait: Callable[..., None], panel: Any, entries: Any
) -> None:
    entry = entries.add_qml(str(file.with_name("Missing.qml")))
    wait(lambda: "Status: Error" in panel.texts("Missing"))
    assert "there is no such file" in panel.texts("Missing", "Status: Error")["Qml"]
    file.write_text("import QtQuick 2.15\nItem { wrong: 1 }\n")
    entry.own.properties["Path"].set(str(file))
    wait(lambda: f"{file}:2" in panel.texts("Missing", "Status: Error")["Qml"])
    file.write_text(QML)
    entry.overlay.reload()
    wait(lambda: "Status: Ok" in panel.texts("Missing"))
    entry.own.properties["Path"].set("")
    wait(lambda: "Status: Warn" in panel.texts("Missing"))
    assert entry.overlay is None
    assert list(app.overlays) == []


def test_remove_duplicate_and_rename_by_the_panel(
    app: Any, file: Path, wait: Callable[..., None], panel: Any, entries: Any
) -> None:
    app.add_qml(file)
    wait(lambda: len(list(entries)) == 1)
    only(entries).overlay.properties.properties["Speed"].set(1.75)
    panel.select("Dashboard")
    wait.frames(2)
    panel.click("Duplicate")
    wait(lambda: len(list(app.overlays)) == 2)
    first, second = entries
    assert second.overlay.properties.properties["Speed"].get() == 1.75
    assert second.file == str(file)
    second.display.setName("Second")
    wait(lambda: second.overlay.name == "Second")
    gone = second.overlay
    panel.select("Second")
    wait.frames(2)
    panel.click("Remove")
    wait(lambda: gone not in list(app.overlays))
    assert list(entries) == [first]
    app.overlays.remove(first.overlay)
    wait(lambda: not list(entries))
    with pytest.raises(StopIteration):
        panel.rows("Dashboard")


def test_saved_and_restored_at_its_place(
    app: Any, file: Path, wait: Callable[..., None], panel: Any, entries: Any, tmp_path: Path
) -> None:
    from rosglass.rviz.host import pyqt, rviz

    overlay = app.add_qml(file, z=2)
    wait(lambda: len(list(entries)) == 1)
    group = app.window.manager.createDisplay("rviz/Group", "Group", True)
    axes = app.window.manager.createDisplay("rviz/Axes", "Axes", True)
    assert axes is not None
    root = app.window.manager.getRootDisplayGroup()
    group = pyqt("sip").cast(group, rviz().DisplayGroup)
    group.addChild(root.takeChild(only(entries).display), 0)
    group.addChild(root.takeChild(axes), 1)
    overlay.properties.properties["Speed"].set(0.5)
    free = {"tabs": ["a", "1", 1, 1.5, True, None], "deep": {"empty": {}, "none": []}, "t": ""}
    overlay.properties.set_config(free)
    saved = tmp_path / "saved.rviz"
    app.save_config(saved)
    before = saved.read_text()
    assert "Class: rosglass/QmlOverlay" in before
    app.overlays.remove(overlay)
    wait(lambda: not list(entries))
    app.load_config(saved)
    wait(lambda: len(list(app.overlays)) == 1)
    entry = only(entries)
    assert entry.display.getParent().getName() == "Group"
    assert entry.display.rowNumberInParent() == 0
    restored = entry.overlay
    assert (restored.z, restored.name) == (2, "Dashboard")
    assert restored.properties.properties["Speed"].get() == 0.5
    assert restored.properties.get_config() == free
    assert not app.window.modified
    again = tmp_path / "again.rviz"
    app.save_config(again)
    assert _displays(again.read_text()) == _displays(before)
    # A group that is switched off takes the overlay along, but not its own check mark.
    group = entry.display.getParent()
    group.setEnabled(False) if hasattr(group, "setEnabled") else group.setValue(False)
    wait(lambda: not restored.visible)
    assert entry.display.getValue()


def _displays(text: str) -> str:
    return text[text.index("  Displays:") : text.index("  Enabled: true\n  Global Options")]


def test_a_config_of_hector_rviz_overlay_works(
    app: Any, file: Path, wait: Callable[..., None], entries: Any, tmp_path: Path
) -> None:
    config = tmp_path / "hector.rviz"
    config.write_text(
        f"""Panels:
  - Class: rviz/Displays
    Name: Displays
Visualization Manager:
  Class: ""
  Displays:
    - Class: hector_rviz_overlay_controls/QmlOverlay
      Configuration:
        Speed: 1.5
      Enabled: true
      Live Reload: false
      Name: Hector
      Overlay Configuration:
        tabs:
          - one
        count: 3
      Path: {file}
      Scale: 2
      Z-Index: 4
      Value: true
  Global Options:
    Fixed Frame: map
"""
    )
    app.load_config(config)
    wait(lambda: len(list(app.overlays)) == 1)
    overlay = only(entries).overlay
    assert (overlay.name, overlay.z, overlay.scale) == ("Hector", 4, 2)
    assert overlay.properties.properties["Speed"].get() == 1.5
    assert overlay.properties.get_config() == {"tabs": ["one"], "count": 3}


def test_overlays_of_the_program_outlive_the_config(
    app: Any, file: Path, wait: Callable[..., None], entries: Any, tmp_path: Path
) -> None:
    empty, saved = tmp_path / "empty.rviz", tmp_path / "saved.rviz"
    app.save_config(empty)
    overlay = app.add_qml(file, z=3)
    wait(lambda: len(list(entries)) == 1)
    only(entries).display.setEnabled(False)
    wait(lambda: not overlay.visible)
    app.save_config(saved)
    app.load_config(empty)
    # It gets an entry in the config that knows nothing of it.
    wait(lambda: [entry.overlay for entry in entries] == [overlay])
    assert (overlay.z, overlay.visible) == (3, False)
    overlay.visible, overlay.z = True, 5
    app.load_config(saved)
    # It takes the entry that waits for it; what the user has saved counts.
    wait(lambda: [entry.overlay for entry in entries] == [overlay] and not overlay.visible)
    assert overlay.z == 3
    assert list(app.overlays) == [overlay]


def test_displays_that_are_made_without_a_file_hold_nothing_up(
    app: Any, file: Path, wait: Callable[..., None], entries: Any, tmp_path: Path
) -> None:
    """RViz announces that it makes displays, and says nothing where it does not come to the end."""
    from rosglass.rviz.host import rviz

    loaded: list[str] = []
    app.window.config_loaded.connect(loaded.append)
    config = rviz().Config()
    app.window.manager.save(config)
    app.window.manager.load(config)
    overlay = app.add_qml(file)
    wait(lambda: [entry.overlay for entry in entries] == [overlay])
    # Nor is a file that is saved later taken for a loaded one.
    app.save_config(tmp_path / "saved.rviz")
    assert loaded == []


def test_overlays_of_the_program_outlive_a_config(
    app: Any, file: Path, wait: Callable[..., None], entries: Any, panel: Any, tmp_path: Path
) -> None:
    empty, saved = tmp_path / "empty.rviz", tmp_path / "saved.rviz"
    app.save_config(empty)
    overlay = app.add_qml(file)
    wait(lambda: len(list(entries)) == 1)
    root = overlay.root
    only(entries).own.properties["Z-Index"].set(6)
    app.save_config(saved)
    only(entries).own.properties["Z-Index"].set(2)
    for config, z in ((empty, 2), (saved, 6), (empty, 6)):
        before = only(entries)
        app.load_config(config)
        wait(lambda before=before: [e.overlay for e in entries if e is not before] == [overlay])  # type: ignore[misc]
        assert [list(app.overlays), overlay.root, overlay.z] == [[overlay], root, z]
        assert panel.texts("Dashboard")["Z-Index"] == z


def test_own_classes_come_back(
    app: Any, wait: Callable[..., None], entries: Any, tmp_path: Path
) -> None:
    from rosglass.rviz import Overlay, register
    from rosglass.rviz.overlay import class_id_of

    class Gauge(Overlay):
        def __init__(self, name: str = "Gauge") -> None:
            super().__init__(name)
            self.limit = self.properties.registerIntProperty("Limit", 5, min=0, max=9)

        def resize(self, width: int, height: int, ratio: float) -> None:
            self.pixels = np.zeros((height, width), np.uint32)

        def draw(self) -> Any:
            return self.pixels

    register(Gauge, "tests/Gauge")
    with pytest.raises(Error, match="'tests/Gauge' is used by"):
        register(type("Other", (Gauge,), {}), "tests/Gauge")
    with pytest.raises(Error, match="not a class derived"):
        register(dict)
    assert class_id_of(Gauge) == "tests/Gauge"
    gauge = Gauge("Power")
    gauge.limit.set(7)
    app.add(gauge)
    wait(lambda: len(list(entries)) == 1)
    saved = tmp_path / "own.rviz"
    app.save_config(saved)
    app.overlays.remove(gauge)
    wait(lambda: not list(entries))
    app.load_config(saved)
    wait(lambda: [type(o) for o in app.overlays] == [Gauge])
    restored = only(entries).overlay
    assert (restored.name, restored.limit.get()) == ("Power", 7)


def test_an_overlay_that_loads_another_config_in_its_own_click(
    app: Any, wait: Callable[..., None], entries: Any, tmp_path: Path, hand: Any
) -> None:
    empty = tmp_path / "empty.rviz"
    app.save_config(empty)
    file = tmp_path / "Closing.qml"
    file.write_text(
        "import QtQuick 2.15\n"
        "Item { MouseArea { width: 200; height: 200; onClicked: {\n"
        f'    rviz.loadConfig("{empty}"); parent.opacity = 0.5 }} }} }}\n'
    )
    entries.add_qml(str(file))
    wait(lambda: only(entries).overlay.loaded)
    wait.frames(3)
    hand.click(100, 100)
    wait(lambda: not list(app.overlays) and not list(entries))
    assert app.window.config == str(empty)


def test_the_menu(app: Any, file: Path, wait: Callable[..., None], entries: Any) -> None:
    app.add_qml(file, "A & B")
    wait(lambda: len(list(entries)) == 1)
    menu = app.window.menu("Overlays")
    names = [action.text() for action in menu.actions()]
    assert names[:3] == ["&Add QML overlay...", "&Reload", "Re&move"]
    menu.aboutToShow.emit()
    root = only(entries).overlay.root
    (reload,) = menu.actions()[1].menu().actions()
    assert reload.text() == "A && B"
    reload.trigger()
    wait(lambda: only(entries).overlay.root is not root)
    (remove,) = menu.actions()[2].menu().actions()
    remove.trigger()
    wait(lambda: not list(app.overlays))
