"""The object ``rviz`` in QML, and the same from Python, with a real RViz."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

TOOLS = ["rviz/Interact", "rviz/MoveCamera", "rviz/Select"]


def test_tools(app: Any, tools: Any, qml: Any, wait: Any) -> None:
    here = qml(
        """Item { property var told: []
        property Connections c: Connections { target: rviz.toolManager
            function onToolAdded(tool) { told.push("added " + tool.classId) }
            function onToolRemoved(tool) {
                told.push("removed " + tool.classId + " " + tool.exists) }
            function onToolChanged(tool) { told.push("changed " + tool.classId) }
            function onToolsChanged() { told.push("tools " + rviz.toolManager.tools.length) } }
        function log() { const t = told; told = []; return t } }"""
    )
    run = here.run
    assert run("return rviz.toolManager.tools.map(t => t.classId)") == TOOLS
    assert run("return rviz.toolManager.tools.map(t => t.isSelected)") == [True, False, False]
    first = "const t = rviz.toolManager.tools[1];"
    assert run(first + "return [t.name, t.shortcutKey, t.iconSource]") == [
        "Move Camera",
        "m",
        "image://rviz_tool_icons/rviz/MoveCamera",
    ]
    assert "viewpoint" in run(first + "return t.description")
    assert run("return rviz.toolManager.tools[0] === rviz.toolManager.tools[0]")
    run(first + "rviz.toolManager.currentTool = t")
    assert run("return rviz.toolManager.currentTool.classId") == "rviz/MoveCamera"
    assert run(first + "return t.isSelected")
    run("root.log()")
    # Two of one class are two tools.
    assert run(
        "const m = rviz.toolManager, a = m.addTool('rviz/Measure'), b = m.addTool('rviz/Measure');"
        "m.currentTool = b; const r = [a === b, a.isSelected, b.isSelected, m.tools.length];"
        "b.remove(); return r.concat([a.exists, b.exists, b.name, m.tools.length])"
    ) == [False, False, True, 5, True, False, "Measure", 4]
    assert run("return root.log()") == [
        "tools 4",
        "added rviz/Measure",
        "tools 5",
        "added rviz/Measure",
        "changed rviz/Measure",
        "tools 4",
        "removed rviz/Measure false",
        "changed rviz/Interact",
    ]
    # What the user does is told as well.
    manager = app.window.manager.getToolManager()
    manager.setCurrentTool(manager.getTool(2))
    wait(lambda: here.run("return root.told.length"))
    assert run("return root.log()") == ["changed rviz/Select"]
    manager.removeTool(3)
    wait(lambda: here.run("return root.told.length > 1"))
    assert run("return root.log()") == ["tools 3", "removed rviz/Measure false"]
    assert "rviz/PublishPoint" in run("return rviz.toolManager.toolClasses")
    assert run("return rviz.toolManager.getTool('rviz/Measure')") is None
    run("rviz.toolManager.removeTool(0); rviz.toolManager.removeTool('rviz/Select')")
    assert [tool.class_id for tool in tools.all] == ["rviz/MoveCamera"]
    run("rviz.toolManager.removeAll()")
    assert run("return [rviz.toolManager.tools.length, rviz.toolManager.currentTool]") == [0, None]


def test_displays(app: Any, displays: Any, qml: Any, wait: Any) -> None:
    here = qml(
        """Item { property var told: []
        property Connections c: Connections { target: rviz
            function onDisplayAdded(d) { told.push("added " + d.name) }
            function onDisplayRemoved(d) { told.push("removed " + d.name + " " + d.exists) } }
        property var grid: rviz.display("Grid")
        property bool shown: grid.enabled
        property string called: grid.name }"""
    )
    run = here.run
    # The interface itself is one of them.
    assert run("return rviz.displays.map(d => [d.name, d.classId, d.enabled, d.status])") == [
        ["Grid", "rviz/Grid", True, "ok"],
        ["Overlay0", "rosglass/QmlOverlay", True, "ok"],
    ]
    run("root.grid.enabled = false")
    assert not app.window.manager.getRootDisplayGroup().getDisplayAt(0).isEnabled()
    assert run("return root.shown") is False
    app.window.manager.getRootDisplayGroup().getDisplayAt(0).setEnabled(True)
    wait(lambda: run("return root.shown"))
    run("root.grid.name = 'Floor'")
    assert run("return root.called") == "Floor"
    made = run(
        "const d = rviz.addDisplay('rviz/RobotModel', 'Robot'); root.grid = d; "
        "return [d.name, d.classId, d.enabled, rviz.displays.length]"
    )
    assert made == ["Robot", "rviz/RobotModel", True, 3]
    wait(lambda: run("return root.grid.status === 'error'"))
    assert "robot_description" in run("return root.grid.statusText")
    run("rviz.removeDisplay('Robot')")
    assert run("return [root.grid.exists, root.grid.name, root.grid.status]") == [
        False,
        "Robot",
        "error",
    ]
    assert "was removed" in here.fails("root.grid.get('Alpha')")
    assert "was removed" in here.fails("root.grid.enabled = true")
    assert "was removed" in here.fails("root.grid.remove()")
    told = [text for text in run("return root.told") if "Overlay0" not in text]
    assert told == ["added Robot", "removed Robot false"]
    assert "rviz/PointCloud2" in run("return rviz.displayClasses")
    assert "did you mean rviz/Grid?" in here.fails("rviz.addDisplay('rviz/Gridd')")
    assert run("return rviz.displays.length") == 2
    assert "Floor" in here.fails("rviz.removeDisplay('Grid')")


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


def test_properties_of_displays(app: Any, displays: Any, qml: Any) -> None:
    here = qml("Item { property var grid: rviz.display('Grid') }")
    run = here.run
    tree = run("return root.grid.properties")
    by_name = {one["name"]: one for one in tree}
    assert by_name["Color"]["value"] == "#a0a0a4"
    assert by_name["Color"]["kind"] == "color"
    assert by_name["Offset"]["value"] == {"x": 0, "y": 0, "z": 0}
    assert [one["path"] for one in by_name["Offset"]["properties"]] == [
        "Offset/X",
        "Offset/Y",
        "Offset/Z",
    ]
    assert by_name["Plane Cell Count"]["kind"] == "int"
    for path, value in {
        "Color": "#ff8000",
        "Plane Cell Count": 4,
        "Cell Size": 0.25,
        "Alpha": 0.75,
        "Plane": "XZ",
        "Offset": {"x": 1, "y": 2.5, "z": -3},
        "Offset/X": 7,
        "Reference Frame": "map",
    }.items():
        run(f"root.grid.set({json.dumps(path)}, {json.dumps(value)})")
        assert run(f"return root.grid.get({json.dumps(path)})") == value
    run(
        "root.grid.set('Color', Qt.rgba(0, 1, 0, 1));"
        "root.grid.set(['Offset'], Qt.vector3d(1, 2, 3))"
    )
    assert run("return [root.grid.get('Color'), root.grid.get('Offset/Z')]") == ["#00ff00", 3]
    run("rviz.setProperty('Global Options/Background Color', 'navy')")
    assert run("return rviz.getProperty('Global Options/Background Color')") == "#000080"
    # Other tests look at RViz's own grey.
    run("rviz.setProperty('Global Options/Background Color', '#303030')")
    assert displays.get("Grid/Color") == "#00ff00"
    here.refuses(
        {
            "root.grid.get('Colour')": "did you mean Color",
            "root.grid.set('Color', 'no colour')": "expected a colour",
            "root.grid.set('Plane', 'YX')": "one of XY, XZ, YZ",
            "root.grid.set('Plane Cell Count', 1.5)": "a 32-bit integer",
            # Ogre would end the process.
            "root.grid.set('Offset/X', NaN)": "a finite number",
            "root.grid.set('Offset', [0, Infinity, 0])": "a finite number",
            "root.grid.set('Cell Size', 1e300)": "a finite number",
            "root.grid.set('Alpha', 7)": "has set 1.0",
            "rviz.setProperty('Global Options', 7)": "has no value of its own",
        }
    )


def test_the_fixed_frame_is_reported(app: Any, qml: Any) -> None:
    here = qml("Item { property string frame: rviz.fixedFrame }")
    here.run("rviz.fixedFrame = 'odom'")
    assert app.window.manager.getFixedFrame() == "odom"
    assert here.root.property("frame") == "odom"
    app.window.manager.setFixedFrame("map")
    assert here.root.property("frame") == "map"


def test_the_overlay_and_the_window(app: Any, qml: Any, wait: Any) -> None:
    here = qml(
        "Item { property bool shown: rviz.visible; property bool full: rviz.isFullscreen;"
        "property bool bare: rviz.isBare;"
        "property real rate: rviz.frameRate; property string how: rviz.status }"
    )
    assert here.root.property("shown") is True
    here.overlay.visible = False
    assert here.root.property("shown") is False
    here.overlay.visible = True
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
    assert here.root.property("how") in ("ok", "warn", "error")
    wait(lambda: "Fixed Frame" in here.run("return rviz.statusText"))


def straight_down(app: Any, wait: Any) -> None:
    """Look from 10 m above at the origin."""
    app.rviz.view.reset()
    app.rviz.view.move_eye_and_focus((0, 0, 10), (0, 0, 0), animate=False)
    frames: list[int] = []
    app.window.before_frame.connect(lambda: frames.append(1))
    wait(lambda: len(frames) > 3)


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


def test_screenshots(app: Any, qml: Any, tmp_path: Path) -> None:
    from rosglass.rviz.qt5 import QtGui

    here = qml('Item { Rectangle { x: 10; y: 10; width: 50; height: 50; color: "#ff0000" } }')
    for window, size in ((False, app.window.panel), (True, app.window.widget)):
        file = tmp_path / f"{window}.png"
        here.run(f"rviz.screenshot('{file}', {str(window).lower()})")
        picture = QtGui.QImage(str(file))
        assert abs(picture.width() - size.width()) <= 1
        at = app.window.panel.mapTo(size, app.window.panel.rect().topLeft())
        assert picture.pixelColor(at.x() + 30, at.y() + 30).name() == "#ff0000"
    assert "there is no folder" in here.fails("rviz.screenshot('/nowhere/x.png')")
    assert ".png" in here.fails(f"rviz.screenshot('{tmp_path}/x.xyz')")
    assert "expected the path" in here.fails("rviz.screenshot(5)")


def test_overlays_that_come_and_go(app: Any, tools: Any, qml: Any, wait: Any) -> None:
    """What they followed is not followed any longer."""
    for _ in range(3):
        here = qml("Item { property var t: [rviz.toolManager, rviz.view, rviz.displays] }")
        app.overlays.remove(here.overlay)
        tools.add("rviz/Measure")
        tools.remove(tools.find("rviz/Measure"))
        wait.frames(1)
    # From within its own JavaScript.
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
