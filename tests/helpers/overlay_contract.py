"""The object ``rviz`` over any 3D view: RViz's, and that of a ``SceneView``.

``tests/rviz/test_overlay_contract.py`` and ``tests/scene/test_overlay_contract.py`` collect these
tests; the fixture `over` of each folder is a :class:`Over`.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


class Qml:
    """An overlay, and JavaScript that runs in its context."""

    def __init__(self, overlay: Any, wait: Callable[..., None]) -> None:
        self.overlay, self.wait = overlay, wait
        self.root = overlay.root

    def run(self, script: str) -> Any:
        """Return the result of a script as a Python value; raise JavaScript's errors."""
        engine = self.overlay.engine
        scope = engine.newQObject(self.root)
        engine.globalObject().setProperty("root", scope)
        engine.globalObject().setProperty("rviz", engine.newQObject(self.overlay.properties))
        text = (
            f"(function () {{ try {{ return JSON.stringify({{ v: (function () {{ {script} }})() }})"
        )
        text += "} catch (e) { return JSON.stringify({ e: '' + e }) } })()"
        answer = json.loads(engine.evaluate(text).toString())
        if "e" in answer:
            raise AssertionError(answer["e"])
        return answer.get("v")

    def fails(self, script: str) -> str:
        """Return the error that a script throws."""
        with pytest.raises(AssertionError) as caught:
            self.run(script)
        return str(caught.value)

    def refuses(self, mistakes: dict[str, str]) -> None:
        """Check that each script throws an error with a text in it."""
        said = {script: self.fails(script) for script in mistakes}
        assert {s: said[s] for s, text in mistakes.items() if text not in said[s]} == {}


class Over(ABC):
    """A 3D view with one display, Grid, and overlays.

    Attributes:
        access: Its `Access`.
        wait: Waits for a condition.
    """

    access: Any
    wait: Any

    @abstractmethod
    def qml(self, text: str = "Item {}", **options: Any) -> Qml:
        """Show QML text over the view."""

    @abstractmethod
    def remove(self, overlay: Any) -> None:
        """Remove an overlay."""

    @abstractmethod
    def frames(self, count: int) -> None:
        """Wait until so many frames were drawn."""

    @property
    @abstractmethod
    def size(self) -> tuple[float, float]:
        """Width and height of the view."""

    @property
    @abstractmethod
    def own_displays(self) -> list[str]:
        """Names of the displays that are overlays."""

    def use_tools(self, class_ids: list[str]) -> None:
        """Have these tools alone."""
        tools = self.access.tools
        tools.remove_all()
        for class_id in class_ids:
            tools.add(class_id)

    def look_down(self) -> None:
        """Look from 10 m above at the origin."""
        self.access.view.reset()
        self.access.view.move_eye_and_focus((0, 0, 10), (0, 0, 0), animate=False)
        self.frames(3)

    def set_transform(self, child: str, x: float) -> None:
        """Place a frame in the map, in x direction."""
        from rosglass.tf import Transform

        self.wait(lambda: self.access.frames.buffer is not None)
        made = Transform((x, 0.0, 0.0), frame_id="map", child_frame_id=child)
        self.access.frames.buffer.set_transform(made, static=True)


# -- displays --------------------------------------------------------------------------------------


def test_displays_are_listed(over: Over) -> None:
    run = over.qml().run
    names = run("return rviz.displays.map(d => [d.name, d.classId, d.enabled, d.exists])")
    assert names[0] == ["Grid", "rviz/Grid", True, True]
    assert [name for name, *_ in names[1:]] == over.own_displays
    assert run("return rviz.display('Grid') === rviz.displays[0]")
    assert run("return rviz.display('Nothing')") is None
    assert {"rviz/Grid", "rviz/Axes", "rviz/TF"} <= set(run("return rviz.displayClasses"))


def test_displays_are_added_and_removed(over: Over) -> None:
    here = over.qml(
        """Item { property var log: []
        property int count: rviz.displays.length
        property Connections c: Connections { target: rviz
            function onDisplayAdded(d) { log.push("added " + d.name) }
            function onDisplayRemoved(d) { log.push("removed " + d.name + " " + d.exists) } } }"""
    )
    before = here.root.property("count")
    made = here.run(
        "const d = rviz.addDisplay('rviz/Axes', 'Origin', false);"
        "return [d.name, d.classId, d.enabled, d.exists]"
    )
    assert made == ["Origin", "rviz/Axes", False, True]
    assert here.root.property("count") == before + 1
    here.run(
        "const d = rviz.display('Origin'); rviz.removeDisplay('Origin'); root.log.push(d.name)"
    )
    log = [text for text in here.run("return root.log") if "Overlay" not in text]
    assert log == ["added Origin", "removed Origin false", "Origin"]
    assert here.root.property("count") == before
    assert here.run("return rviz.addDisplay('rviz/Axes').name") == "Axes"
    here.run("rviz.display('Axes').remove()")
    assert here.root.property("count") == before


def test_removed_displays_say_so(over: Over) -> None:
    here = over.qml("Item { property var grid: rviz.display('Grid') }")
    here.run("rviz.removeDisplay(root.grid)")
    assert here.run("return [root.grid.exists, root.grid.name, root.grid.status]") == [
        False,
        "Grid",
        "error",
    ]
    here.refuses(
        {
            "root.grid.get('Alpha')": "was removed",
            "root.grid.set('Alpha', 1)": "was removed",
            "root.grid.enabled = true": "was removed",
            "root.grid.name = 'Floor'": "was removed",
            "root.grid.remove()": "was removed",
        }
    )


def test_displays_are_bound_to(over: Over) -> None:
    here = over.qml(
        """Item { property var grid: rviz.display("Grid")
        property bool shown: grid.enabled
        property string called: grid.name }"""
    )
    here.run("root.grid.enabled = false; root.grid.name = 'Floor'")
    assert here.root.property("shown") is False
    assert here.root.property("called") == "Floor"
    # By the program, or the operator.
    over.access.displays.find("Floor").enabled = True
    over.wait(lambda: here.root.property("shown"))
    here.refuses({"root.grid.enabled = 1": "true or false", "root.grid.name = ''": "a text"})


def test_unknown_classes_and_displays_are_refused(over: Over) -> None:
    over.qml().refuses(
        {
            "rviz.addDisplay('rviz/Gridd')": "did you mean rviz/Grid?",
            "rviz.addDisplay('Grid')": "expected a class id, e.g. 'rviz/Grid'",
            "rviz.addDisplay(5)": "expected a class id",
            "rviz.removeDisplay('Floor')": "there is no display 'Floor'; there are: Grid",
            "rviz.removeDisplay(5)": "expected a display or its name, got 5",
            "rviz.display(5)": "the name of a display",
        }
    )


# -- properties ------------------------------------------------------------------------------------


def test_properties_are_described(over: Over) -> None:
    here = over.qml()
    tree = here.run("return rviz.display('Grid').properties")
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
    style = by_name["Line Style"]
    assert style["value"] == "Lines"
    assert [one["path"] for one in style["properties"]] == ["Line Style/Line Width"]
    assert set(style) == {
        *("name", "path", "value", "kind", "description", "readOnly", "hidden", "properties")
    }


def test_properties_are_read_and_written(over: Over) -> None:
    here = over.qml("Item { property var grid: rviz.display('Grid') }")
    run = here.run
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
    run("rviz.setProperty('Grid/Cell Size', 2)")
    assert run("return rviz.getProperty(['Grid', 'Cell Size'])") == 2
    assert over.access.displays.get("Grid/Color") == "#00ff00"


def test_global_options_are_properties(over: Over) -> None:
    run = over.qml().run
    before = run("return rviz.getProperty('Global Options/Background Color')")
    assert before == "#303030"
    run("rviz.setProperty('Global Options/Background Color', 'navy')")
    assert run("return rviz.getProperty('Global Options/Background Color')") == "#000080"
    run("rviz.setProperty('Global Options/Background Color', '#303030')")
    run("rviz.setProperty('Global Options/Fixed Frame', 'odom')")
    assert run("return rviz.fixedFrame") == "odom"
    run("rviz.fixedFrame = 'map'")
    assert run("return rviz.getProperty('Global Options/Fixed Frame')") == "map"


def test_wrong_properties_are_refused(over: Over) -> None:
    over.qml("Item { property var grid: rviz.display('Grid') }").refuses(
        {
            "root.grid.get('Colour')": "did you mean Color",
            "root.grid.set('Color', 'no colour')": "expected a colour",
            "root.grid.set('Plane', 'YX')": "one of XY, XZ, YZ",
            "root.grid.set('Plane Cell Count', 1.5)": "Grid/Plane Cell Count: expected a ",
            "root.grid.set('Offset/X', NaN)": "a finite number",
            "root.grid.set('Offset', [0, Infinity, 0])": "a finite number",
            "root.grid.set('Alpha', 7)": "Grid/Alpha: ",
            "root.grid.set('Color', '#80ffffff')": "transparency; set the property Alpha",
            "root.grid.set('Offset')": "value must be given",
            "rviz.setProperty('Global Options', 7)": "has no value of its own",
            "rviz.getProperty('Grids/Color')": "did you mean Grid?",
            "rviz.getProperty('Grid')": "'Grid' is a display; name one of its properties, e.g. ",
            "rviz.getProperty(5)": "expected the path of a property",
        }
    )
    assert over.access.displays.get("Grid/Offset") == {"x": 0, "y": 0, "z": 0}


# -- tools -----------------------------------------------------------------------------------------

TOOLS = ["rviz/Interact", "rviz/MoveCamera", "rviz/Select"]


def test_tools(over: Over) -> None:
    over.use_tools(TOOLS)
    here = over.qml(
        """Item { property var entries: []
        property Connections c: Connections { target: rviz.toolManager
            function onToolAdded(tool) { entries.push("added " + tool.classId) }
            function onToolRemoved(tool) {
                entries.push("removed " + tool.classId + " " + tool.exists) }
            function onToolChanged(tool) { entries.push("changed " + tool.classId) }
            function onToolsChanged() { entries.push("tools " + rviz.toolManager.tools.length) } }
        function log() { const t = entries; entries = []; return t } }"""
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
    assert run("return rviz.toolManager.tools[0] === rviz.toolManager.tools[0]")
    assert run(first + "return ['accessAllKeys', 'tool', 'name'].map(member => member in t)") == [
        False,
        False,
        True,
    ]
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
    assert "rviz/PublishPoint" in run("return rviz.toolManager.toolClasses")
    run("rviz.toolManager.removeTool(0); rviz.toolManager.removeTool('rviz/Select')")
    assert [tool.class_id for tool in over.access.tools.all] == ["rviz/MoveCamera", "rviz/Measure"]
    run("rviz.toolManager.removeAll()")
    assert run("return [rviz.toolManager.tools.length, rviz.toolManager.currentTool]") == [0, None]


def test_wrong_tools_are_refused(over: Over) -> None:
    over.use_tools(TOOLS)
    over.qml().refuses(
        {
            "rviz.toolManager.addTool('rviz/Measur')": "did you mean rviz/Measure?",
            "rviz.toolManager.addTool('rviz/Grid')": "a display: use addDisplay",
            "rviz.toolManager.addTool(5)": "expected a class id",
            "rviz.toolManager.currentTool = 'rviz/Measure'": "there is no tool of the class",
            "rviz.toolManager.currentTool = 9": "there are 3, numbered from 0",
            "rviz.toolManager.removeTool(null)": "expected a tool, its index, or a class id",
            "rviz.toolManager.getTool(5)": "a class id",
        }
    )


def test_tool_icons(over: Over) -> None:
    over.use_tools(TOOLS)
    here = over.qml(
        """Row { property alias a: a; property alias b: b; property alias c: c
        Image { id: a; source: rviz.toolManager.getTool("rviz/Select").iconSource }
        Image { id: b; source: a.source; sourceSize.width: 20 }
        Image { id: c; source: "image://rviz_tool_icons/no/Such" } }"""
    )
    sizes = (
        "return [root.a, root.b, root.c].map(i => [i.status, i.sourceSize.width, i.implicitHeight])"
    )
    over.wait(lambda: here.run(sizes)[0][0] == 1)
    assert here.run(sizes) == [[1, 48, 48], [1, 20, 20], [1, 48, 48]]


def test_a_tool_icon_is_there_at_the_first_load(over: Over) -> None:
    over.use_tools(TOOLS)
    # Nothing has used the object `rviz` before.
    here = over.qml('Image { source: "image://rviz_tool_icons/rviz/Select" }')
    over.wait(lambda: here.root.property("sourceSize").width() == 48)


def test_removing_a_tool_that_was_added_keeps_the_others(over: Over) -> None:
    over.use_tools([*TOOLS, "rviz/Measure"])
    run = over.qml("Item {}").run
    run("const m = rviz.toolManager; m.removeTool(m.addTool('rviz/Measure'))")
    over.frames(2)
    assert [tool.class_id for tool in over.access.tools.all] == [*TOOLS, "rviz/Measure"]


# -- the view --------------------------------------------------------------------------------------


def test_the_fixed_frame_is_reported(over: Over) -> None:
    here = over.qml("Item { property string frame: rviz.fixedFrame }")
    here.run("rviz.fixedFrame = 'odom'")
    assert over.access.fixed_frame == "odom"
    assert here.root.property("frame") == "odom"
    over.access.fixed_frame = "map"
    assert here.root.property("frame") == "map"
    here.refuses({"rviz.fixedFrame = 5": "a frame", "rviz.fixedFrame = ''": "a frame"})


def test_the_overlay_and_the_window(over: Over) -> None:
    here = over.qml(
        "Item { property bool shown: rviz.visible; property bool bare: rviz.isBare;"
        "property bool full: rviz.isFullscreen; property string how: rviz.status }"
    )
    assert here.root.property("shown") is True
    here.overlay.visible = False
    assert here.root.property("shown") is False
    here.overlay.visible = True
    here.run("rviz.isBare = true")
    over.wait(lambda: here.root.property("bare"))
    over.access.bare = False
    over.wait(lambda: not here.root.property("bare"))
    assert here.root.property("full") is False
    assert here.root.property("how") in ("ok", "warn", "error")
    over.wait(lambda: "Fixed Frame" in here.run("return rviz.statusText"))
    here.refuses({"rviz.isBare = 1": "true or false", "rviz.isFullscreen = 'yes'": "true or false"})


def test_the_camera_is_moved(over: Over) -> None:
    here = over.qml("Item { property vector3d eye: rviz.view.eye }")
    run = here.run
    run("rviz.view.reset()")
    eye = "const e = rviz.view.eye; return [e.x, e.y, e.z]"
    assert run(eye) == pytest.approx([4, 0, 3], abs=1e-3)
    run("rviz.view.moveEye(Qt.vector3d(1, 2, 3), {animate: false})")
    assert run(eye) == pytest.approx([1, 2, 3], abs=1e-3)
    over.wait(lambda: abs(here.root.property("eye").y() - 2) < 1e-2)
    run("rviz.view.moveEyeAndFocus([0, -5, 5], {x: 0, y: 0, z: 1}, {animate: false})")
    focus = run("const f = rviz.view.focus; return [f.x, f.y, f.z]")
    assert focus == pytest.approx([0, 0, 1], abs=1e-3)


def test_the_camera_moves_smoothly(over: Over) -> None:
    here = over.qml(
        "Item { property int moves: 0\nConnections { target: rviz.view\n"
        "function onMoved() { moves += 1 } } }"
    )
    run = here.run
    run("rviz.view.reset(); rviz.view.animationDuration = 0.4")
    over.frames(2)
    moves = here.root.property("moves")
    run("rviz.view.moveEyeAndFocus([-4, 3, 2], [1, 1, 0])")
    eye = "const e = rviz.view.eye; return [e.x, e.y, e.z]"
    assert run(eye) == pytest.approx([4, 0, 3], abs=0.1)
    over.wait(lambda: run(eye) == pytest.approx([-4, 3, 2], abs=1e-3))
    assert here.root.property("moves") > moves + 2


def test_two_and_three_dimensions(over: Over) -> None:
    here = over.qml("Item { property int mode: rviz.view.mode }")
    run = here.run
    run("rviz.view.reset(); rviz.view.moveEyeAndFocus([2, 0, 4], [2, 1, 0], {animate: false})")
    run("rviz.view.setMode(rviz.view.MODE_2D, false)")
    assert run("return [rviz.view.mode, rviz.view.type]") == [1, "rviz/TopDownOrtho"]
    over.wait(lambda: here.root.property("mode") == 1)
    focus = "const f = rviz.view.focus; return [f.x, f.y]"
    assert run(focus) == pytest.approx([2, 1], abs=1e-3)
    run("rviz.view.animationDuration = 0.2; rviz.view.mode = 0")
    over.wait(lambda: run("return rviz.view.type") == "rviz/Orbit")
    over.wait(lambda: run("return rviz.view.focus.y") == pytest.approx(1, abs=1e-3))


def test_view_types_and_saved_views(over: Over) -> None:
    here = over.qml(
        "Item { property var saved: rviz.view.savedViews\nproperty string type: rviz.view.type }"
    )
    run = here.run
    run("rviz.view.reset(); rviz.view.setMode(1, false)")
    run("rviz.view.saveView('Above'); rviz.view.type = 'rviz/XYOrbit'")
    assert run("return [rviz.view.savedViews, rviz.view.type]") == [["Above"], "rviz/XYOrbit"]
    assert here.root.property("type") == "rviz/XYOrbit"
    run("rviz.view.showView('Above')")
    assert run("return rviz.view.type") == "rviz/TopDownOrtho"
    run("rviz.view.saveView('Above')")
    assert run("return rviz.view.savedViews") == ["Above"]
    run("rviz.view.removeView(0); rviz.view.reset()")
    assert run("return rviz.view.savedViews") == []
    assert {"rviz/FPS", "rviz/Orbit"} <= set(run("return rviz.view.viewTypes"))


POINT = "expected x, y and z in metres, e.g. Qt.vector3d(1, 2, 0), got "
MODE = "expected rviz.view.MODE_3D (0) or MODE_2D (1), got "
FRAME = "expected the name of a frame, or '' for none, got "
VIEW = "expected a view type, e.g. 'rviz/Orbit', got "
NAME = "expected a name for the view, a text of one line, got "
VIEW_MISTAKES = {
    "mode = 7": "rviz.view.mode: there is no view mode 7: expected 0 (3D) or 1 (2D)",
    "mode = 'flat'": f"rviz.view.mode: {MODE}'flat'",
    "mode = null": f"rviz.view.mode: {MODE}null",
    "mode = true": f"rviz.view.mode: {MODE}true",
    "mode = NaN": f"rviz.view.mode: {MODE}NaN",
    "trackedFrame = 'nowhere'": "rviz.view.trackedFrame: ",
    "trackedFrame = 5": f"rviz.view.trackedFrame: {FRAME}5",
    "trackedFrame = null": f"rviz.view.trackedFrame: {FRAME}null",
    "animationDuration = -1": "animationDuration: expected a number from 0 to 60, got -1",
    "animationDuration = 'slow'": "animationDuration: expected a number from 0 to 60, got 'slow'",
    "animationDuration = true": "animationDuration: expected a number from 0 to 60, got true",
    "trackingGain = NaN": "rviz.view.trackingGain: expected a number from 0 to 1000, got NaN",
    "trackingGain = []": "rviz.view.trackingGain: expected a number from 0 to 1000, got []",
    "type = 'orbit'": "there is no view type 'orbit'; did you mean rviz/Orbit?; there are",
    "type = 'rviz/Orbi'": "there is no view type 'rviz/Orbi'; did you mean rviz/Orbit",
    "type = 5": f"rviz.view.type: {VIEW}5",
    "eye = Qt.vector3d(1, 2, 3)": "read-only",
    "moveEye()": "rviz.view.moveEye(eye[, options]): eye must be given",
    "moveEye([0, 0, null])": f"rviz.view.moveEye: eye: {POINT}[0, 0, null]",
    "moveEye([1, 2, Infinity])": f"rviz.view.moveEye: eye: {POINT}[1, 2, Infinity]",
    "moveEye([1, 2, 1e9])": "is more than 1e+08 m from the fixed frame's origin",
    "moveEye([1, 2, 3], 'map')": "options: expected {frame, animate, stopTracking, switchTo3D}",
    "moveEye([1, 2, 3], {frame: null})": "rviz.view.moveEye: frame: expected a text, got null",
    "moveEye([1, 2, 3], {frame: 'nowhere'})": "moveEye: ",
    "moveEye([1, 2, 3], {animated: true})": "there is no option 'animated'; there are frame,",
    "moveEye([1, 2, 3], {animate: 1})": "animate: expected true or false, got 1",
    "moveEyeAndFocus([1, 2, 3])": "moveEyeAndFocus(eye, focus[, options]): focus must be given",
    "moveEyeAndFocus([1, 2, 3], 5)": f"rviz.view.moveEyeAndFocus: focus: {POINT}5",
    "moveEyeAndFocus([1, 2, 3], [1, 2, 3])": "are both at [1.0, 2.0, 3.0]",
    "moveEyeAndFocus([1, 2, 3], [0, 0, 0], {switchTo3D: true})": "no option 'switchTo3D'",
    "setMode('3D')": f"rviz.view.setMode: {MODE}'3D'",
    "setMode(0, 1)": "rviz.view.setMode: animate: expected true or false, got 1",
    "track(null)": f"rviz.view.track: {FRAME}null",
    "track(['map'])": f"rviz.view.track: {FRAME}['map']",
    "saveView('')": f"rviz.view.saveView: {NAME}''",
    "showView('x')": "rviz.view.showView: there is no saved view 'x'; no views are saved",
    "removeView(null)": "rviz.view.removeView: there is no saved view null; no views are saved",
    "removeView()": "rviz.view.removeView(name): name must be given",
    "misspelled = 1": "rviz.view has no member 'misspelled'",
}


def test_wrong_movements_are_refused(over: Over) -> None:
    here = over.qml()
    here.run("rviz.view.reset()")
    here.refuses({f"rviz.view.{script}": text for script, text in VIEW_MISTAKES.items()})
    assert here.run("return [rviz.view.mode, rviz.view.type]") == [0, "rviz/Orbit"]
    assert tuple(over.access.view.eye) == pytest.approx((4, 0, 3), abs=1e-3)


def test_a_frame_is_followed(over: Over) -> None:
    here = over.qml(
        "import Ros2 1.0\nItem { Component.onCompleted: Ros2.init('following')\n"
        "property string frame: rviz.view.trackedFrame }"
    )
    over.set_transform("followed_link", 1.0)
    run = here.run
    run("rviz.view.reset(); rviz.view.trackingGain = 1000; rviz.view.track('followed_link')")
    assert here.root.property("frame") == "followed_link"
    x = "return rviz.view.focus.x"
    over.wait(lambda: run(x) == pytest.approx(1.0, abs=1e-2))
    over.set_transform("followed_link", 3.0)
    over.wait(lambda: run(x) == pytest.approx(3.0, abs=1e-2))
    run("rviz.view.trackedFrame = ''")
    over.set_transform("followed_link", 5.0)
    over.frames(3)
    assert run(x) == pytest.approx(3.0, abs=1e-2)
    assert "did you mean followed_link" in here.fails("rviz.view.track('folowed_link')")


# -- points ----------------------------------------------------------------------------------------


def test_position_trackers(over: Over) -> None:
    here = over.qml(
        """Item { property var tracker: null; property var positions: []
        function track() { tracker = rviz.createPositionTracker(0, 0, 0)
            tracker.positionChanged.connect(p => positions.push([p.x, p.y, p.z])) } }""",
        scale=2.0,
    )
    over.look_down()
    run = here.run
    run("root.track()")
    where = "const p = root.tracker.position; return [p.x, p.y, p.z]"
    x, y, z = run(where)
    width, height = over.size
    assert (x, y) == pytest.approx((width / 4, height / 4), abs=1)
    assert z == pytest.approx(10, abs=0.05)
    # It follows the camera, the point, and the overlay's scale.
    over.access.view.move_eye_and_focus((0, 0, 20), (0, 0, 0), animate=False)
    over.wait(lambda: abs(run(where)[2] - 20) < 0.1)
    assert run("return root.positions.length") > 0
    run("root.tracker.point = Qt.vector3d(0, 0, 5)")
    assert run(where)[2] == pytest.approx(15, abs=0.1)
    assert run("return root.tracker.point") == {"x": 0, "y": 0, "z": 5}
    here.overlay.scale = 1.0
    over.wait(lambda: run(where)[0] == pytest.approx(width / 2, abs=1))
    run("root.tracker.point = {x: 0, y: 0, z: 30}")
    # JSON has no NaN.
    assert run(where) == [None, None, None]
    # A frame that does not exist.
    run("root.tracker.point = [0, 0, 0]; root.tracker.frame = 'nowhere'")
    over.wait(lambda: "nowhere" in run("return root.tracker.problem"))
    run("root.tracker.frame = ''")
    assert run("return root.tracker.problem") == ""
    here.refuses(
        {
            "rviz.createPositionTracker('a', 0, 0)": "expected x, y and z",
            "root.tracker.point = 5": "expected x, y and z",
        }
    )


def test_trackers_of_frames(over: Over) -> None:
    here = over.qml(
        "import Ros2 1.0\nItem { Component.onCompleted: Ros2.init('tracking')\n"
        "property var t: rviz.createPositionTracker(Qt.vector3d(1, 0, 0), 'tracked_link') }"
    )
    over.look_down()
    run = here.run
    assert "tracked_link" in run("return root.t.problem")
    over.set_transform("tracked_link", 2.0)
    over.wait(lambda: run("return root.t.problem") == "")
    same = "const s = rviz.createPositionTracker({0}, 0, 0).position, p = root.t.position;"
    same += "return Math.hypot(p.x - s.x, p.y - s.y) < 0.5"
    over.wait(lambda: run(same.replace("{0}", "3")))
    over.set_transform("tracked_link", 1.0)
    over.wait(lambda: run(same.replace("{0}", "2")))
    # What is static does not get old.
    assert run("return root.t.stale") is False


def test_trackers_end_with_their_overlay(over: Over) -> None:
    here = over.qml()
    before = len(over.access.trackers)
    here.run("rviz.createPositionTracker(1, 0, 0)")
    assert len(over.access.trackers) == before + 1
    over.remove(here.overlay)
    over.wait(lambda: len(over.access.trackers) == before)


def test_picking(over: Over) -> None:
    here = over.qml(scale=2.0)
    displays = over.access.displays
    displays.find("Grid").enabled = False
    displays.add("rviz/Axes")
    displays.set("Axes/Length", 4)
    displays.set("Axes/Radius", 0.5)
    over.look_down()
    run = here.run
    middle = "const x = root.width / 2, y = root.height / 2;"
    over.wait(lambda: run(middle + "return rviz.pick(x, y)") is not None)
    found = run(middle + "return rviz.pick(x, y)")
    # The end of the axis that points at the camera.
    assert found["z"] == pytest.approx(4, abs=0.05)
    assert abs(found["x"]) < 0.1
    assert abs(found["y"]) < 0.1
    # There and back again, somewhere on another axis.
    back = run(
        "const t = rviz.createPositionTracker(0, 2, 0.25), p = t.position;"
        "return [p.x, p.y, rviz.pick(p.x, p.y), rviz.pick(p)]"
    )
    assert back[2]["y"] == pytest.approx(2, abs=0.1)
    assert back[2] == back[3]
    assert run("return [rviz.pick(1, 1), rviz.pick(-5, 0), rviz.pick(1e6, 0)]") == [None] * 3
    # Around the place.
    beside = "const p = rviz.createPositionTracker(0, 2, 0.25).position; let x = p.x;"
    beside += "while (rviz.pick(x, p.y)) x -= 1; x -= 3;"
    beside += "return [rviz.pick(x, p.y), rviz.pick(x, p.y, 10)]"
    near = run(beside)
    assert near[0] is None
    assert near[1] is not None
    here.refuses(
        {"rviz.pick('a', 2)": "in units of the overlay", "rviz.pick(NaN, 2)": "expected finite x"}
    )


def test_screenshots(over: Over, tmp_path: Path) -> None:
    from rosglass.qt import QtGui

    here = over.qml('Item { Rectangle { x: 10; y: 10; width: 50; height: 50; color: "#ff0000" } }')
    over.frames(2)
    file = tmp_path / "view.png"
    here.run(f"rviz.screenshot('{file}')")
    picture = QtGui.QImage(str(file))
    assert picture.width() == pytest.approx(over.size[0], abs=1)
    assert picture.height() == pytest.approx(over.size[1], abs=1)
    assert picture.pixelColor(30, 30).name() == "#ff0000"
    here.run(f"rviz.screenshot('{tmp_path}/window.png', true)")
    assert (tmp_path / "window.png").exists()
    here.refuses(
        {
            "rviz.screenshot('/nowhere/x.png')": "there is no folder",
            f"rviz.screenshot('{tmp_path}/x.xyz')": ".png",
            "rviz.screenshot(5)": "expected the path",
        }
    )


# -- configs, properties of overlays, mistakes -----------------------------------------------------


def test_configs(over: Over, tmp_path: Path) -> None:
    here = over.qml(
        """Item { property var loaded: []
        property Connections c: Connections { target: rviz
            function onConfigLoaded(file) { loaded.push(file) } } }"""
    )
    file = tmp_path / "saved.rviz"
    here.run("rviz.display('Grid').name = 'Saved grid'; rviz.view.saveView('Kept')")
    here.run(f"rviz.saveConfig('{file}')")
    assert "Saved grid" in file.read_text()
    here.run("rviz.display('Saved grid').name = 'Grid'; rviz.view.removeView('Kept')")
    here.run(f"root.loaded = []; rviz.loadConfig('{file.as_uri()}')")
    over.wait(lambda: here.run("return root.loaded"))
    assert here.run("return root.loaded") == [str(file)]
    assert here.run("return rviz.displays.map(d => d.name)") == ["Saved grid", *over.own_displays]
    assert here.run("return rviz.view.savedViews") == ["Kept"]
    here.run("rviz.view.removeView('Kept')")
    here.refuses(
        {
            "rviz.loadConfig('/nowhere/x.rviz')": "does not exist",
            "rviz.loadConfig('http://x/y.rviz')": "expected the path of a file",
            "rviz.saveConfig('/nowhere/x.rviz')": "could not save",
        }
    )


def test_registered_properties_and_config(over: Over) -> None:
    here = over.qml("Item { property var p: rviz.registerFloatProperty('Speed', 0.5) }")
    assert here.run("return root.p.value") == 0.5
    here.run("root.p.value = 2; rviz.config = {a: [1, 2]}")
    assert here.run("return [root.p.value, rviz.config.a[1]]") == [2, 2]
    assert here.overlay.properties.properties["Speed"].get() == 2
    assert "finite number" in here.fails("root.p.value = 'fast'")


def test_misspelled_members_are_reported(over: Over) -> None:
    here = over.qml()
    here.refuses(
        {
            "rviz.fixedframe = 'map'": "rviz has no member 'fixedframe'; did you mean fixedFrame",
            "rviz.display('Grid').Enabled = true": "did you mean enabled",
            "rviz.nothing()": "is not a function",
        }
    )


def test_a_file_is_reloaded(over: Over) -> None:
    here = over.qml(
        "Item { property int version: 1; property var p: "
        "rviz.registerFloatProperty('Speed', 0.5) }",
        watch=True,
    )
    overlay = here.overlay
    here.run("root.p.value = 3")
    overlay.file.write_text(overlay.file.read_text().replace("version: 1", "version: 2"))
    over.wait(lambda: overlay.root.property("version") == 2)
    assert Qml(overlay, over.wait).run("return root.p.value") == 3
    # One with errors does not replace it.
    good = overlay.file.read_text()
    overlay.file.write_text(good.replace("Item {", "Item { nothing: 1;"))
    over.wait(lambda: "nothing" in overlay.problem)
    assert overlay.root.property("version") == 2
    overlay.file.write_text(good)
    over.wait(lambda: overlay.problem == "")


def test_functions_of_a_file_end_when_it_is_reloaded(over: Over) -> None:
    here = over.qml(
        """Item {
            property string version: "one"
            property var shown: rviz.displays
            Component.onCompleted: {
                // Names of the file are gone with it; what a function has captured is not.
                const mine = version, own = rviz
                const note = what => () => {
                    own.config = {calls: own.config.calls.concat([mine + " " + what])}
                }
                own.config = {calls: []}
                own.toolManager.toolChanged.connect(note("tool"))
                own.displaysChanged.connect(note("displays"))
                own.registerFloatProperty("Speed", 0.5).valueChanged.connect(note("speed"))
            }
        }""",
        watch=True,
    )
    overlay = here.overlay

    def calls() -> list[str]:
        return list(overlay.properties.get_config()["calls"])

    def act(speed: float) -> list[str]:
        overlay.properties.set_config({"calls": []})
        next(tool for tool in over.access.tools.all[:2] if not tool.selected).select()
        overlay.properties.properties["Speed"].set(speed)
        over.access.displays.add("rviz/Axes").remove()
        wanted = ("tool", "speed", "displays")
        over.wait(lambda: {call.split()[1] for call in calls()} >= {*wanted})
        over.frames(2)
        return sorted({*calls()})

    assert act(2) == ["one displays", "one speed", "one tool"]
    good = overlay.file.read_text()
    for number, version in enumerate(("two", "three")):
        overlay.file.write_text(good.replace('"one"', f'"{version}"'))
        over.wait(lambda version=version: overlay.root.property("version") == version)
        over.frames(1)
        assert act(3 + number) == [f"{version} displays", f"{version} speed", f"{version} tool"]
    # One with errors connects nothing, and the last one goes on.
    overlay.file.write_text(good.replace('"one"', '"four"') + "Item { }")
    over.wait(lambda: overlay.problem != "")
    assert act(9) == ["three displays", "three speed", "three tool"]


def test_overlays_come_and_go(over: Over) -> None:
    """An overlay that is removed stops following tools, the view and displays."""
    for _ in range(3):
        here = over.qml("Item { property var t: [rviz.toolManager, rviz.view, rviz.displays] }")
        over.remove(here.overlay)
        over.access.displays.add("rviz/Axes").remove()
        over.frames(1)
