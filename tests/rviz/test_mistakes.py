"""Errors of the object ``rviz`` name the thing, the place, and valid values."""

from __future__ import annotations

from typing import Any

MISTAKES = {
    "rviz.loadConfig()": "rviz.loadConfig(file): file must be given",
    "rviz.setProperty('Grid/Color')": "setProperty(path, value): value must be given",
    "rviz.pick()": "rviz.pick(x[, y[, radius]]): x must be given",
    "rviz.pick(1)": "y: expected a number, in units of the overlay, got null",
    "rviz.pick({x: 1, y: 2}, 'r')": "radius: expected a number",
    "rviz.addDisplay()": "rviz.addDisplay(classId[, name[, enabled]]): classId must be given",
    "rviz.addDisplay('rviz/Measure')": "rviz/Measure is a tool: use addTool",
    "rviz.addDisplay('rosglass/QmlOverlay')": "is an overlay: add it by the Overlays menu",
    "rviz.display('Grid').set('Alpha')": "display.set(path, value): value must be given",
    "rviz.display('Grid').enabled = 'no'": "display.enabled: expected true or false, got 'no'",
    "rviz.display('Grid').name = 5": "display.name: expected a name, a text of one line, got 5",
    "rviz.fixedFrame = 5": "rviz.fixedFrame: expected the name of a frame, e.g. 'map', got 5",
    "rviz.fixedFrame = ''": "expected the name of a frame, e.g. 'map', got ''",
    "rviz.isFullscreen = 'no'": "rviz.isFullscreen: expected true or false, got 'no'",
    "rviz.isBare = 0": "rviz.isBare: expected true or false, got 0",
    "rviz.config = [true, null]": "expected a map, e.g. {speed: 1}, got [true, null]",
    "rviz.getProperty('Grids/Color')": "panel is called 'Grids'; did you mean Grid?",
    "rviz.getProperty('Nope')": "called 'Nope'; there are: Global Options, Grid, Overlay0",
    "rviz.getProperty('Grid')": "'Grid' is a display; name one of its properties, e.g. 'Grid/",
    "rviz.setProperty('Grid/Offset', 5)": "expected x, y, z, e.g. {x: 0, y: 0, z: 0}, got 5",
    "rviz.loadConfig('http://x/y.rviz')": "expected the path of a file, got 'http://x/y.rviz'",
    "rviz.saveConfig('package://x/y.rviz')": "expected the path of a file to save to, got 'pack",
    "rviz.saveConfig('/nope/x.rviz')": "could not save its config: there is no folder /nope",
    "rviz.createPositionTracker(0, 0)": "e.g. Qt.vector3d(1, 2, 0), got [0, 0]",
    "rviz.createPositionTracker(0, 0, 0).frame = 5": "tracker.frame: expected the name of a frame",
    "rviz.removeDisplay(rviz.toolManager)": "a display or its name, got rviz.toolManager",
    "rviz.toolManager.currentTool = 'Move Camera'": "did you mean 'rviz/MoveCamera'?",
    "rviz.toolManager.addTool('rviz/Grid')": "rviz/Grid is a display: use addDisplay",
    "rviz.registerIntProperty()": "the name must be a text, e.g. 'Speed'",
    "rviz.registerIntProperty('I').readOnly = 1": "property I.readOnly: expected true or false",
    "rviz.registerRosTopicProperty('T', '/a', 'std_msgs')": "expected the name of a type, e.g.",
}


def test_every_error_names_the_thing_and_valid_values(tools: Any, displays: Any, qml: Any) -> None:
    qml().refuses(MISTAKES)


def test_properties_of_any_type_can_still_be_bound(app: Any, displays: Any, qml: Any) -> None:
    here = qml(
        """Item { id: root; property bool on: false; property string where: "odom"
        property bool shown: rviz.display("Grid").enabled
        Binding { target: rviz.display("Grid"); property: "enabled"; value: root.on }
        Binding { target: rviz; property: "fixedFrame"; value: root.where } }"""
    )
    grid = displays.find("Grid")
    assert (grid.enabled, here.root.property("shown"), app.rviz.fixed_frame) == (
        False,
        False,
        "odom",
    )
    here.root.setProperty("on", True)
    here.root.setProperty("where", "map")
    assert (grid.enabled, here.root.property("shown"), app.rviz.fixed_frame) == (True, True, "map")


def test_mistakes_with_tools_say_what_to_do(tools: Any, qml: Any) -> None:
    here = qml()
    fails = here.fails
    here.refuses(
        {
            "rviz.toolManager.addTool('rviz/Measur')": "did you mean rviz/Measure?",
            "rviz.toolManager.addTool('; rm -rf /')": "expected a class id",
            "rviz.toolManager.removeTool(7)": "there are 3",
            "rviz.toolManager.removeTool('rviz/Measure')": "rviz/Select",
            "rviz.toolManager.currentTool = null": "expected a tool",
        }
    )
    gone = "const t = rviz.toolManager.tools[2]; t.remove();"
    assert "the tool Select was removed" in fails(gone + "t.select()")
    assert len(tools.all) == 2
