"""The view controller's settings in RViz's Displays panel, and in its config files."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

#: A plain RViz: loads a file, saves it as another one, and prints its displays.
PLAIN = """
import os, sys
from python_qt_binding.QtWidgets import QApplication
from rviz import bindings
app = QApplication([])
frame = bindings.VisualizationFrame()
frame.setSplashPath("")
frame.initialize(sys.argv[1])
root = frame.getManager().getRootDisplayGroup()
print([str(root.getDisplayAt(at).getName()) for at in range(root.numDisplays())])
print(frame.saveDisplayConfig(sys.argv[2]))
sys.stdout.flush()
os._exit(0)
"""


@pytest.fixture(autouse=True)
def settings(app: Any, wait: Callable[..., None]) -> Iterator[Any]:
    """The settings, as at first."""
    app.connect()
    yield app.view.settings
    app.view_entry.shown = False
    app.view.settings.by_program.clear()
    app.view.settings.load({})
    wait.frames(2)


def all_displays(app: Any) -> list[Any]:
    root = app.window.manager.getRootDisplayGroup()
    return [root.getDisplayAt(at) for at in range(root.numDisplays())]


def displays(app: Any) -> dict[str, Any]:
    return {str(display.getName()): display for display in all_displays(app)}


def click_menu(app: Any, text: str) -> None:
    menu = app.window.menu("&Overlays")
    next(action for action in menu.actions() if action.text() == text).trigger()


def status(display: Any) -> dict[str, str]:
    """Return what is shown below the entry's status."""
    top = next(display.childAt(n) for n in range(display.numChildren()))
    return {
        str(top.childAt(n).getName()): str(top.childAt(n).getValue())
        for n in range(top.numChildren())
    }


def test_the_menu_shows_the_settings_and_edits_count(
    app: Any, settings: Any, wait: Callable[..., None]
) -> None:
    assert "View Controller" not in displays(app)
    click_menu(app, "&View controller")
    entry = displays(app)["View Controller"]
    entry.subProp("Movement Speed").setValue(9.0)
    entry.subProp("Keyboard Navigation").setValue(False)
    assert (settings.speed, settings.keys) == (9.0, False)
    # What does not fit comes back.
    entry.subProp("Movement Speed").setValue(-1.0)
    assert settings.speed == 9.0
    assert entry.subProp("Movement Speed").getValue() == 9.0
    # A program's changes are shown.
    settings.animation_duration = 2.5
    assert entry.subProp("Animation Duration").getValue() == 2.5
    click_menu(app, "&View controller")
    assert "View Controller" not in displays(app)
    # Without the entry, things are as at first, but for what the program wants.
    assert (settings.speed, settings.keys, settings.animation_duration) == (4.0, True, 2.5)


def test_it_is_kept_in_the_file(
    app: Any, settings: Any, wait: Callable[..., None], tmp_path: Path
) -> None:
    without, kept = tmp_path / "without.rviz", tmp_path / "kept.rviz"
    app.save_config(without)
    settings.animation_duration = 0.5
    app.view_entry.shown = True
    entry = displays(app)["View Controller"]
    gain = entry.subProp("Tracking Gain")
    # RViz takes what happens in the first second for a part of loading.
    wait(lambda: gain.setValue(settings.tracking_gain + 1) or app.window.modified)
    gain.setValue(7.0)
    entry.subProp("Animation Duration").setValue(0.25)
    app.save_config(kept)
    app.load_config(without)
    wait(lambda: not app.view_entry.shown and settings.tracking_gain == 3.0)
    assert settings.animation_duration == 0.5
    app.load_config(kept)
    wait(lambda: settings.tracking_gain == 7.0)
    assert settings.animation_duration == 0.25
    assert app.view_entry.shown
    assert not app.window.modified
    assert displays(app)["View Controller"].subProp("Tracking Gain").getValue() == 7.0


def test_broken_values_in_a_file_are_as_at_first(
    app: Any, settings: Any, wait: Callable[..., None], tmp_path: Path, caplog: Any
) -> None:
    file = tmp_path / "broken.rviz"
    app.view_entry.shown = True
    settings.speed = 8.0
    settings.by_program.clear()
    app.save_config(file)
    text = file.read_text()
    assert "Movement Speed: 8" in text
    file.write_text(text.replace("Movement Speed: 8", "Movement Speed: fast"))
    app.load_config(file)
    wait(lambda: settings.speed == 4.0)
    assert "movement speed in the file: expected a finite number, got 'fast'" in caplog.text


def test_a_plain_rviz_keeps_it(
    app: Any, settings: Any, master: str, wait: Callable[..., None], tmp_path: Path
) -> None:
    ours, plain = tmp_path / "ours.rviz", tmp_path / "plain.rviz"
    app.view_entry.shown = True
    displays(app)["View Controller"].subProp("Namespace").setValue("/robot/camera")
    app.save_config(ours)
    command = [sys.executable, "-c", PLAIN, str(ours), str(plain)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.splitlines()[-1] == "True", done.stderr
    assert "View Controller" in done.stdout
    app.view_entry.shown = False
    assert settings.namespace == ""
    app.load_config(plain)
    wait(lambda: settings.namespace == "/robot/camera")


def test_duplicated_and_removed_by_the_panel(
    app: Any, settings: Any, wait: Callable[..., None]
) -> None:
    from rosglass.rviz.host import pyqt

    qt, flags = pyqt("QtWidgets"), pyqt().QItemSelectionModel

    def click(button: str) -> None:
        """Select the first entry, and press one of the panel's buttons."""
        trees = app.window.frame.findChildren(qt.QTreeView)
        tree = next(t for t in trees if t.model().index(0, 0).data() == "Global Options")
        model = tree.model()
        found = [model.index(row, 0) for row in range(model.rowCount())]
        at = next(index for index in found if index.data().startswith("View Controller"))
        tree.selectionModel().setCurrentIndex(at, flags.ClearAndSelect | flags.Rows)
        wait.frames(2)
        panel = tree.parent()
        while not panel.findChildren(qt.QPushButton):
            panel = panel.parent()
        next(b for b in panel.findChildren(qt.QPushButton) if b.text() == button).click()

    def entries() -> list[Any]:
        return [d for d in all_displays(app) if d.getName().startswith("View Controller")]

    app.view_entry.shown = True
    displays(app)["View Controller"].subProp("Movement Speed").setValue(9.0)
    click("Duplicate")
    wait(lambda: [d.subProp("Movement Speed").getValue() for d in entries()] == [9.0, 9.0])
    both = entries()
    both[1].subProp("Movement Speed").setValue(8.0)
    assert both[0].subProp("Movement Speed").getValue() == 8.0
    click("Remove")
    wait(lambda: len(entries()) == 1)
    wait.frames(2)
    assert settings.speed == 8.0
    click("Remove")
    wait(lambda: settings.speed == 4.0)
    assert not app.view_entry.shown


def test_status_says_where_robots_reach_the_camera(
    app: Any, settings: Any, wait: Callable[..., None]
) -> None:
    app.view_entry.shown = True
    entry = displays(app)["View Controller"]
    wait(lambda: "hector_view_controller" in status(entry).get("Robots", ""))
    entry.subProp("Namespace").setValue("/robot/camera")
    node = app.session.node
    wait(lambda: "/robot/camera/move_eye" in node.services())
    wait(lambda: status(entry)["Robots"] == "/robot/camera")
    entry.subProp("Namespace").setValue("no name")
    wait(lambda: "' ' at position 2" in status(entry)["Robots"])
    wait(lambda: "/robot/camera/move_eye" not in node.services())
    entry.subProp("Namespace").setValue("relative")
    wait(lambda: "/relative/move_eye" in node.services())


def test_tracked_frame_and_mode_are_shown_and_set(
    app: Any, settings: Any, steered: Any, wait: Callable[..., None], caplog: Any
) -> None:
    app.view_entry.shown = True
    entry = displays(app)["View Controller"]
    steered.set_mode(1, animate=False)
    steered.track("map")
    assert entry.subProp("2D Mode").getValue()
    assert entry.subProp("Tracked Frame").getValue() == "map"
    entry.subProp("2D Mode").setValue(False)
    wait(lambda: steered.mode == 0 and not steered.is_moving)
    entry.subProp("Tracked Frame").setValue("nowhere")
    assert "Tracked Frame: there is no frame 'nowhere'" in caplog.text
    assert entry.subProp("Tracked Frame").getValue() == steered.tracked_frame == "map"
    entry.subProp("Tracked Frame").setValue("")
    assert steered.tracked_frame == ""


def test_errors_of_settings_say_what_is_valid(settings: Any) -> None:
    wrong = {
        "animation_duration": (-1, "Animation Duration: expected a number from 0 to 60, got -1"),
        "tracking_gain": (float("nan"), "Tracking Gain: expected a number from 0 to 1000, got NaN"),
        "speed": ("fast", "Movement Speed: expected a number from 0 to 1000, got 'fast'"),
        "keys": (1, "Keyboard Navigation: expected true or false, got 1"),
        "namespace": ("a b", "Namespace: name 'a b': ' ' at position 1; only letters, digits"),
    }
    for name, (value, message) in wrong.items():
        before = getattr(settings, name)
        with pytest.raises(Error) as error:
            setattr(settings, name, value)
        assert message in str(error.value)
        assert getattr(settings, name) == before
