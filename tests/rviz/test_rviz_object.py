"""The object ``rviz`` with a real RViz, beside what every 3D view does: see `overlay_contract`."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest


def test_tools_that_the_user_selects_and_removes(app: Any, tools: Any, qml: Any, wait: Any) -> None:
    here = qml(
        """Item { property var entries: []
        property Connections c: Connections { target: rviz.toolManager
            function onToolRemoved(tool) {
                entries.push("removed " + tool.classId + " " + tool.exists) }
            function onToolChanged(tool) { entries.push("changed " + tool.classId) }
            function onToolsChanged() { entries.push("tools " + rviz.toolManager.tools.length) } }
        function log() { const t = entries; entries = []; return t } }"""
    )
    run = here.run
    assert "viewpoint" in run("return rviz.toolManager.tools[1].description")
    run("rviz.toolManager.addTool('rviz/Measure'); root.log()")
    manager = app.window.manager.getToolManager()
    manager.setCurrentTool(manager.getTool(2))
    wait(lambda: run("return root.entries.length"))
    assert run("return root.log()") == ["changed rviz/Select"]
    manager.removeTool(3)
    wait(lambda: run("return root.entries.length > 1"))
    assert run("return root.log()") == ["tools 3", "removed rviz/Measure false"]
    assert run("return rviz.toolManager.getTool('rviz/Measure')") is None


def test_displays_that_the_user_changes(app: Any, displays: Any, qml: Any, wait: Any) -> None:
    here = qml(
        """Item { property var grid: rviz.display("Grid")
        property bool shown: grid.enabled
        property string called: grid.name }"""
    )
    run = here.run
    # The interface itself is one of them.
    assert run("return rviz.displays.map(d => [d.name, d.classId, d.enabled, d.status])") == [
        ["Grid", "rviz/Grid", True, "ok"],
        ["Overlay0", "rosglass/QmlOverlay", True, "ok"],
    ]
    handle = app.window.manager.getRootDisplayGroup().getDisplayAt(0)
    run("root.grid.enabled = false")
    assert not handle.isEnabled()
    handle.setEnabled(True)
    wait(lambda: run("return root.shown"))
    run("root.grid.name = 'Floor'")
    assert run("return root.called") == "Floor"
    assert "Floor" in here.fails("rviz.removeDisplay('Grid')")
    run("root.grid = rviz.addDisplay('rviz/RobotModel', 'Robot')")
    wait(lambda: run("return root.grid.status === 'error'"))
    assert "robot_description" in run("return root.grid.statusText")
    run("rviz.removeDisplay('Robot')")
    assert run("return [root.grid.name, root.grid.status]") == ["Robot", "error"]


def test_displays_removed_by_the_user(app: Any, displays: Any, qml: Any, wait: Any) -> None:
    """In every way in which RViz does it, those in groups included."""
    from rosglass.qt import QtCore
    from rosglass.rviz.host import as_pyside

    here = qml("Item { property var axes: null }")
    group = displays.add("rviz/Group", "Group")
    outer = app.window.manager.getRootDisplayGroup()
    inner = outer.getGroupAt(1)
    axes = displays.add("rviz/Axes")
    inner.addChild(outer.takeChild(axes.handle))
    assert not axes.exists
    assert sorted(display.name for display in displays.all) == ["Axes", "Grid", "Group", "Overlay0"]
    here.run("root.axes = rviz.displays.find(d => d.name === 'Axes')")
    app.window.manager.removeAllDisplays()
    assert "was removed" in here.fails("root.axes.get('Length')")
    assert here.run("return [root.axes.exists, rviz.displays.length]") == [False, 0]
    assert not group.exists
    again = displays.add("rviz/Axes")
    handle = again.handle
    handle.disconnect()
    handle.getParent().takeChild(handle)
    as_pyside(handle, QtCore.QObject).deleteLater()
    wait.frames(1)
    assert not again.exists
    assert again.status.level == "error"


def test_properties_that_rviz_refuses(displays: Any, qml: Any) -> None:
    qml("Item { property var grid: rviz.display('Grid') }").refuses(
        {
            "root.grid.set('Plane Cell Count', 1.5)": "a 32-bit integer",
            # Ogre would end the process.
            "root.grid.set('Cell Size', 1e300)": "a finite number",
            "root.grid.set('Alpha', 7)": "has set 1.0",
        }
    )


def test_the_window_that_the_user_changes(app: Any, qml: Any, wait: Any) -> None:
    here = qml(
        "Item { property string frame: rviz.fixedFrame; property bool full: rviz.isFullscreen;"
        "property bool bare: rviz.isBare; property real rate: rviz.frameRate }"
    )
    here.run("rviz.fixedFrame = 'odom'")
    assert app.window.manager.getFixedFrame() == "odom"
    app.window.manager.setFixedFrame("map")
    assert here.root.property("frame") == "map"
    here.run("rviz.isFullscreen = true")
    wait(lambda: here.root.property("full"))
    assert app.window.fullscreen
    here.run("rviz.isFullscreen = false")
    wait(lambda: not here.root.property("full"))
    here.run("rviz.isBare = true")
    wait(lambda: here.root.property("bare"))
    assert app.window.bare.on
    app.window.bare.on = False
    wait(lambda: not here.root.property("bare"))
    wait(lambda: here.root.property("rate") > 0)


def test_trackers_end_with_their_objects(app: Any, qml: Any, wait: Any) -> None:
    here = qml()
    before = len(app.rviz.trackers)
    here.run("for (let i = 0; i < 20; i++) rviz.createPositionTracker(i, 0, 0)")
    wait.frames(1)
    here.overlay.engine.collectGarbage()
    wait(lambda: len(app.rviz.trackers) <= before + 1)


def test_trackers_end_with_their_overlay(app: Any, qml: Any) -> None:
    here = qml()
    before = len(app.rviz.trackers)
    here.run("rviz.createPositionTracker(1, 0, 0)")
    assert len(app.rviz.trackers) == before + 1
    app.overlays.remove(here.overlay)
    # Programs that have no event loop of their own: the engine lives on until they have.
    until = time.monotonic() + 30
    while len(app.rviz.trackers) > before and time.monotonic() < until:
        app.qt.processEvents()
    assert len(app.rviz.trackers) == before


def test_screenshots_of_the_window(app: Any, qml: Any, tmp_path: Path) -> None:
    from rosglass.rviz.qt5 import QtGui

    here = qml('Item { Rectangle { x: 10; y: 10; width: 50; height: 50; color: "#ff0000" } }')
    file = tmp_path / "window.png"
    here.run(f"rviz.screenshot('{file}', true)")
    picture, window, panel = QtGui.QImage(str(file)), app.window.widget, app.window.panel
    assert abs(picture.width() - window.width()) <= 1
    at = panel.mapTo(window, panel.rect().topLeft())
    assert picture.pixelColor(at.x() + 30, at.y() + 30).name() == "#ff0000"


def test_an_overlay_is_removed_from_within_its_own_javascript(
    app: Any, tools: Any, qml: Any, wait: Any
) -> None:
    here = qml("Item { signal end; onEnd: rviz.toolManager.removeTool(0) }")
    tools.removed.connect(lambda tool: app.overlays.remove(here.overlay))
    here.root.end.emit()
    wait.frames(2)
    assert here.overlay not in list(app.overlays)


# It takes a quarter of a minute by itself; other tests run beside it.
@pytest.mark.timeout(240)
def test_nothing_crashes_hangs_or_raises(screen: str, master: str, tmp_path: Path) -> None:
    """Runs in a separate process, because it looks for a crash."""
    program, last = Path(__file__).with_name("fuzz_rviz.py"), tmp_path / "last"
    environment = os.environ | {"DISPLAY": screen, "ROS_MASTER_URI": master, "HOME": str(tmp_path)}
    environment |= {"ROSGLASS_QT": "pyside2", "QT_QPA_PLATFORM": "xcb", "ROS_IP": "127.0.0.1"}
    with (tmp_path / "output").open("wb") as output:
        done = subprocess.run(
            [sys.executable, str(program), str(last), str(tmp_path)],
            cwd=tmp_path,
            env=environment,
            stdout=output,
            stderr=subprocess.STDOUT,
            timeout=220,
            check=False,
        )
    text = (tmp_path / "output").read_text(errors="replace")
    tried = last.read_text(errors="replace").strip()
    end = "\n".join(line[:300] for line in text.splitlines()[-40:])
    assert done.returncode == 0, f"it ended at {tried}:\n{end}"
    assert "came to the end" in text
    for sign in ("Traceback (most recent", "internal error"):
        assert sign not in text, text[text.index(sign) :][:2000]
