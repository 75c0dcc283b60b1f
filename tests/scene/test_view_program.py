"""The command ``rosglass view`` and its panels."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest
from inside import endpoint_of
from nav2_server import Driver
from ports import free_port
from scene_mouse import Hand

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from conftest import SceneBench

GRID = """
Visualization Manager:
  Displays:
    - {Class: rviz_default_plugins/Grid, Name: Floor, Enabled: true, Color: 255; 0; 255, Alpha: 1}
    - {Class: rviz_default_plugins/Image, Name: Camera, Enabled: true}
    - {Class: other_plugins/Radar, Name: Radar, Enabled: true}
  Global Options: {Fixed Frame: odom, Background Color: 0; 0; 40}
"""


@pytest.fixture
def model(bench: SceneBench) -> Any:
    """The rows of a Displays panel of a view with a grid."""
    from rosglass.scene.app.panel_models import DisplaysModel

    view = bench.load("GridDisplay {}")
    bench.wait(lambda: view.scene.displays)
    made = DisplaysModel(view)
    made.view = view
    return made


def labels(model: Any) -> list[str]:
    return [row.label for row in model.rows]


def row_of(model: Any, label: str) -> int:
    return labels(model).index(label)


def test_the_panel_lists_options_displays_and_settings(model: Any) -> None:
    options = ["Global Options", "Fixed Frame", "Background Color"]
    assert labels(model) == [*options, "Global Status", "Grid"]
    model.toggle(row_of(model, "Grid"))
    assert "Cell Size" in labels(model)
    size = model.rows[row_of(model, "Cell Size")]
    assert (size.kind, size.value, size.depth) == ("float", "1", 1)
    plane = model.rows[row_of(model, "Plane")]
    assert plane.choices == ("XY", "XZ", "YZ")
    model.toggle(row_of(model, "Global Options"))
    assert labels(model)[:3] == ["Global Options", "Global Status", "Grid"]


def test_user_input_changes_settings_or_is_refused(bench: SceneBench, model: Any) -> None:
    (grid,) = bench.view.scene.displays
    said: list[str] = []
    model.refused.connect(said.append)
    model.toggle(row_of(model, "Grid"))
    for label, text in (
        ("Cell Size", "2.5"),
        ("Plane", "YZ"),
        ("Color", "#112233"),
        ("Offset", "1; 2 3"),
    ):
        model.edit(row_of(model, label), text)
    # Of UTM coordinates, too: all three are written again where one is edited.
    model.edit(row_of(model, "Offset"), "0.1; 2; 4500000.5")
    assert model.rows[row_of(model, "Offset")].value == "0.1; 2; 4500000.5"
    model.edit(row_of(model, "Offset"), "1; 2 3")
    model.edit(row_of(model, "Fixed Frame"), "odom")
    model.edit(row_of(model, "Background Color"), "#010203")
    assert said == []
    assert (grid.cellSize, grid.plane, grid.color.name()) == (2.5, "YZ", "#112233")
    assert (grid.offset.x(), grid.offset.y(), grid.offset.z()) == (1, 2, 3)
    assert bench.view.fixedFrame == "odom"
    assert bench.view.property("background").name() == "#010203"
    model.edit(row_of(model, "Cell Size"), "wide")
    model.edit(row_of(model, "Offset"), "1 2")
    model.edit(row_of(model, "Fixed Frame"), "")
    assert [text.partition(":")[0] for text in said] == ["Cell Size", "Offset", "Fixed Frame"]
    assert grid.cellSize == 2.5


def test_displays_are_added_renamed_moved_and_removed(bench: SceneBench, model: Any) -> None:
    assert {"Grid", "TF", "Map", "Group"} <= set(model.types())
    assert "Unknown" not in model.types()
    publisher = bench.robot.create_publisher("/plan", "nav_msgs/Path")
    bench.wait(model.suggestions)
    assert {"topic": "/plan", "type": "nav_msgs/Path", "display": "Path"} in model.suggestions()
    bench.robot.create_publisher("/camera_info", "sensor_msgs/CameraInfo")
    bench.wait(lambda: "/camera_info" in bench.view.scene.node.topics())
    assert [one["topic"] for one in model.suggestions()] == ["/plan"]
    model.add("Path", "/plan")
    assert bench.view.scene.displays[1].topic == "/plan"
    bench.wait(publisher.subscription_count)
    model.rename(row_of(model, "Path"), "Plan")
    assert model.drop(row_of(model, "Plan"), row_of(model, "Grid"), 0.2) == row_of(model, "Plan")
    assert [one.name for one in bench.view.scene.displays] == ["Plan", "Grid"]
    model.setEnabled(row_of(model, "Plan"), False)
    bench.wait(lambda: not publisher.subscription_count())
    model.remove(row_of(model, "Plan"))
    assert [one.name for one in bench.view.scene.displays] == ["Grid"]


def test_topics_are_suggested_as_rviz_suggests_them(bench: SceneBench, model: Any) -> None:
    kinds = {
        "/arrow": "visualization_msgs/Marker",
        "/arrows": "visualization_msgs/MarkerArray",
        "/map": "nav_msgs/OccupancyGrid",
        "/map_updates": "map_msgs/OccupancyGridUpdate",
    }
    for topic, kind in kinds.items():
        bench.robot.create_publisher(topic, kind)
    bench.wait(lambda: kinds.keys() <= bench.view.scene.node.topics().keys())
    found = [(one["topic"], one["display"]) for one in model.suggestions()]
    assert found == [("/arrow", "Marker"), ("/arrows", "MarkerArray"), ("/map", "Map")]
    model.add("Map", "/map")
    choices = {row.label: row.choices for row in model.rows if row.kind == "topic"}
    assert choices == {"Topic": ("/map",), "Update Topic": ("/map_updates",)}


def test_a_refresh_lists_the_topics_of_the_robot_once(
    bench: SceneBench, model: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    node, calls = bench.view.scene.node, []
    model.active = False
    for _ in range(3):
        model.add("Path", "/plan")
    topics = type(node).topics
    monkeypatch.setattr(type(node), "topics", lambda node: calls.append(node) or topics(node))
    model.refresh()
    assert calls == [node]


def test_a_panel_that_is_hidden_follows_nothing(bench: SceneBench, window: Any) -> None:
    from PySide6.QtCore import QObject

    rows = Rows(window).model
    bench.wait(lambda: rows.active)
    window.setProperty("panels", False)
    assert not rows.active
    calls: list[int] = []
    rows.dataChanged.connect(lambda *_: calls.append(1))
    scene = window.findChild(QObject, "scene")
    scene.setProperty("background", "#010203")
    bench.wait.nothing_happens(0.3)
    window.setProperty("panels", True)
    assert calls, "the new color"


def test_rows_follow_the_status(bench: SceneBench, model: Any) -> None:
    model.add("Axes", "")
    model.edit(row_of(model, "Reference Frame"), "tool")
    row = row_of(model, "Axes")
    assert model.rows[row].level == "error"
    assert "no transform from [tool]" in model.rows[row].description
    assert labels(model)[row + 1 : row + 3] == ["Status: Error", "Transform"]
    # What is right is one row, until the user wants to know.
    model.edit(row_of(model, "Reference Frame"), "map")
    assert labels(model)[row + 1] == "Status: Ok"
    assert "Transform" not in labels(model)
    model.toggle(row + 1)
    assert labels(model)[row + 2] == "Transform"


def outline(scene: Any, group: Any = None) -> list[Any]:
    """Return the names of displays, those of a group as a list behind its name."""
    found: list[Any] = []
    for one in scene.displays:
        if one.group is group:
            found.append(one.name)
            if one.TYPE == "Group":
                found.append(outline(scene, one))
    return found


@pytest.fixture
def grouped(bench: SceneBench, model: Any) -> Any:
    """The rows with the displays Grid, an empty group Robot, Axes and Plan."""
    bench.view.scene.add("Group", "Robot")
    bench.view.scene.add("Axes")
    bench.view.scene.add("Path", "Plan", topic="/plan")
    model.refresh()
    return model


def test_displays_are_dropped_between_others_and_into_groups(
    bench: SceneBench, grouped: Any, tmp_path: Path
) -> None:
    model, scene = grouped, bench.view.scene

    def drop(moved: str, target: str, part: float) -> list[Any]:
        row = len(model.rows) if target == "" else row_of(model, target)
        source = row_of(model, moved)
        place = model.dropTarget(source, row, part)
        new = model.drop(source, row, part)
        assert model.rows[new].label == moved
        assert not place or model.rows[new].depth == place["depth"] + place["into"]
        return outline(scene)

    assert outline(scene) == ["Grid", "Robot", [], "Axes", "Plan"]
    assert drop("Axes", "Robot", 0.5) == ["Grid", "Robot", ["Axes"], "Plan"]
    assert drop("Grid", "Axes", 0.2) == ["Robot", ["Grid", "Axes"], "Plan"]
    assert drop("Plan", "Grid", 0.9) == ["Robot", ["Grid", "Plan", "Axes"]]
    assert drop("Axes", "Robot", 0.9) == ["Robot", ["Axes", "Grid", "Plan"]]
    assert drop("Grid", "", 0.0) == ["Robot", ["Axes", "Plan"], "Grid"]
    assert drop("Plan", "Robot", 0.1) == ["Plan", "Robot", ["Axes"], "Grid"]
    # Neither into itself, nor into what is in it; above the displays is in front of the first.
    model.add("Group", "")
    assert drop("Group", "Robot", 0.5)[1:3] == ["Robot", ["Axes", "Group", []]]
    assert model.dropTarget(row_of(model, "Robot"), row_of(model, "Group"), 0.5) == {}
    before = outline(scene)
    assert drop("Robot", "Group", 0.5) == before
    assert drop("Grid", "Global Status", 0.5)[0] == "Grid"
    # Below the settings of a display is below it.
    model.toggle(row_of(model, "Plan"))
    assert drop("Grid", "Topic", 0.1)[:2] == ["Plan", "Grid"]
    bench.view.save_config(tmp_path / "moved.rviz")
    after = outline(scene)
    assert bench.view.load_config(tmp_path / "moved.rviz") == []
    assert outline(scene) == after


def test_a_display_is_duplicated_with_its_settings(bench: SceneBench, grouped: Any) -> None:
    model, scene = grouped, bench.view.scene
    scene.move(scene.find("Axes"), group=scene.find("Robot"))
    scene.find("Axes").length = 2.5
    scene.find("Plan").color = "#112233"
    model.refresh()
    row = model.duplicate(row_of(model, "Plan"))
    assert (model.rows[row].label, row) == ("Plan", len(model.rows) - 1)
    assert (scene.displays[-1].topic, scene.displays[-1].color.name()) == ("/plan", "#112233")
    model.duplicate(row_of(model, "Robot"))
    assert outline(scene) == ["Grid", "Robot", ["Axes"], "Robot", ["Axes"], "Plan", "Plan"]
    axes = [one for one in scene.displays if one.name == "Axes"]
    assert [one.length for one in axes] == [2.5, 2.5]
    axes[1].length = 1.0
    assert axes[0].length == 2.5
    # What rosglass does not have is kept, too.
    from rosglass.scene.view.display_configs import UnknownDisplay

    scene.adopt(UnknownDisplay(scene, class_id="other/Radar"))
    model.refresh()
    model.duplicate(row_of(model, "Unknown"))
    assert [one.class_id for one in scene.displays[-2:]] == ["other/Radar"] * 2


def test_a_display_in_a_group_is_shown_and_hidden_with_it(bench: SceneBench, grouped: Any) -> None:
    scene = bench.view.scene
    publisher = bench.publisher("/plan", "nav_msgs/Path")
    _, group, _, plan = scene.displays
    group.enabled = False
    grouped.drop(row_of(grouped, "Plan"), row_of(grouped, "Robot"), 0.5)
    assert not plan.shown
    bench.wait(lambda: not publisher.subscription_count())
    grouped.drop(row_of(grouped, "Plan"), row_of(grouped, "Robot"), 0.1)
    assert plan.shown
    bench.wait(publisher.subscription_count)


def test_displays_are_moved_by_keys(bench: SceneBench, grouped: Any) -> None:
    model, scene = grouped, bench.view.scene

    def shift(moved: str, direction: str) -> list[Any]:
        new = model.shift(row_of(model, moved), direction)
        assert model.rows[new].label == moved
        return outline(scene)

    assert shift("Grid", "up") == ["Grid", "Robot", [], "Axes", "Plan"]
    assert shift("Axes", "in") == ["Grid", "Robot", ["Axes"], "Plan"]
    assert shift("Plan", "up") == ["Grid", "Plan", "Robot", ["Axes"]]
    assert shift("Grid", "down") == ["Plan", "Grid", "Robot", ["Axes"]]
    assert shift("Axes", "down") == ["Plan", "Grid", "Robot", ["Axes"]]
    assert shift("Axes", "out") == ["Plan", "Grid", "Robot", [], "Axes"]
    assert shift("Grid", "in") == ["Plan", "Grid", "Robot", [], "Axes"]


def test_invalid_move_raises(bench: SceneBench, grouped: Any) -> None:
    from rosglass.errors import Error

    scene = bench.view.scene
    grid, group, axes, plan = scene.displays
    for before, into, why in (
        (None, grid, "display 'Grid' is not a group"),
        (None, group, "display 'Robot' cannot be moved into itself"),
        (axes, None, ""),
        (plan, group, "display 'Plan' is not in display 'Robot'"),
    ):
        moved = group if into is group and before is None else axes
        if why:
            with pytest.raises(Error, match=why):
                scene.move(moved, before, into)
        else:
            scene.move(moved, before, into)
        assert outline(scene) == ["Grid", "Robot", [], "Axes", "Plan"]
    scene.remove(plan)
    with pytest.raises(Error, match="'Plan' is not in this scene"):
        scene.move(axes, plan)


def test_namespaces_and_links_are_rows_with_check_boxes(
    bench: SceneBench, model: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.scene.app import panel_models

    monkeypatch.setattr(panel_models, "_MAX_PARTS", 3)
    markers = bench.view.scene.add("MarkerArray", topic="/markers")
    publisher = bench.publisher("/markers", "visualization_msgs/MarkerArray")
    names = ["a/b", "c" * 10_000, "", "d", "e"]
    made = {"header": {"frame_id": "map"}, "type": 1, "scale": {"x": 1.0, "y": 1.0, "z": 1.0}}
    publisher.publish({"markers": [{**made, "ns": name} for name in names]})
    bench.wait(lambda: len(markers.namespaces) == 5)
    model.refresh()
    model.toggle(row_of(model, "MarkerArray"))
    assert "a/b" not in labels(model)
    model.toggle(row_of(model, "Namespaces"))
    at = row_of(model, "Namespaces")
    shown = model.rows[at + 1 : at + 5]
    assert [row.kind for row in shown] == ["part", "part", "part", "list"]
    assert [row.label[:201] for row in shown] == ["", "a/b", "c" * 200 + "\u2026", "and 2 more"]
    model.setEnabled(at + 2, False)
    assert not markers.parts.is_enabled("a/b")
    assert [row.checked for row in model.rows[at + 1 : at + 4]] == [True, False, True]
    assert markers.save_settings()["Namespaces"] == {"a/b": False}


def test_all_frames_are_shown_or_hidden(bench: SceneBench, model: Any) -> None:
    for name in ("base", "tool"):
        bench.place(name, at=(1, 0, 0.5))
    tf = bench.view.scene.add("TF")
    bench.wait(lambda: tf.frames == ["base", "map", "tool"])
    model.refresh()
    model.toggle(row_of(model, "TF"))
    model.toggle(row_of(model, "Frames"))
    at = row_of(model, "Frames")
    assert labels(model)[at : at + 5] == ["Frames", "All Enabled", "base", "map", "tool"]
    model.toggle(at + 4)
    below = [(row.label, row.kind, row.value) for row in model.rows[at + 5 : at + 8]]
    assert below == [
        ("Parent", "text", "map"),
        ("Position", "text", "1; 0; 0.5"),
        ("Orientation", "text", "0; 0; 0; 1"),
    ]
    model.setEnabled(row_of(model, "tool"), False)
    bench.wait(lambda: tf.frames == ["base", "map"])
    # One that is hidden: not all are enabled any more.
    assert model.rows[at + 1].value is False
    model.edit(at + 1, True)
    bench.wait(lambda: tf.frames == ["base", "map", "tool"])
    model.edit(at + 1, False)
    bench.wait(lambda: tf.frames == [])
    checked = [row.checked for row in model.rows[at + 2 :] if row.kind == "part"]
    assert checked == [False] * 3
    model.setEnabled(row_of(model, "base"), True)
    bench.wait(lambda: tf.frames == ["base"])
    saved = tf.save_settings({"Frames": {"All Enabled": True, "map": {"Value": True}}})
    assert saved["Frames"] == {
        "All Enabled": False,
        "base": {"Value": True},
        "map": {"Value": False},
        "tool": {"Value": False},
    }
    # Frames that a file does not name are shown, whatever it says of all.
    bench.place("arm", at=(1, 0, 0))
    other = bench.view.scene.add("TF")
    assert other.load_settings(saved) == []
    bench.wait(lambda: other.frames == ["arm", "base"])


def test_settings_without_effect_are_hidden(bench: SceneBench, model: Any) -> None:
    def rows_of(name: str) -> list[str]:
        model.refresh()
        at = row_of(model, name)
        below = model.rows[at + 1 :]
        end = next((n for n, row in enumerate(below) if row.depth == 0), len(below))
        return [row.label for row in below[:end]]

    model.toggle(row_of(model, "Grid"))
    (grid,) = bench.view.scene.displays
    assert not model.rows[row_of(model, "Line Style")].expandable
    grid.lineStyle = "Billboards"
    model.refresh()
    model.toggle(row_of(model, "Line Style"))
    assert "Line Width" in rows_of("Grid")
    model.add("PointCloud2", "")
    cloud = bench.view.scene.displays[1]
    colors = {"Axis", "Color", "Channel Name", "Use rainbow", "Min Color", "Min Intensity"}
    assert not colors & set(rows_of("PointCloud2"))
    assert "Size (m)" in rows_of("PointCloud2")
    cloud.style, cloud.colorTransformer = "Points", "Intensity"
    assert colors & set(rows_of("PointCloud2")) == {"Channel Name", "Use rainbow"}
    assert "Size (m)" not in rows_of("PointCloud2")
    assert {"Size (Pixels)", "Invert Rainbow"} <= set(rows_of("PointCloud2"))
    cloud.useRainbow = cloud.autocomputeIntensityBounds = False
    assert {"Min Color", "Min Intensity"} <= set(rows_of("PointCloud2"))
    cloud.colorTransformer = "AxisColor"
    assert colors & set(rows_of("PointCloud2")) == {"Axis"}
    # What is hidden is saved all the same.
    assert cloud.save_settings()["Min Intensity"] == 0.0


def test_each_condition_names_a_property(bench: SceneBench) -> None:
    scene = bench.load().scene
    for name in sorted(scene.TYPES):
        if name != "Unknown":
            display = scene.add(name)
            for setting in display.SETTINGS.values():
                assert setting.is_shown(display) in (True, False)


def test_a_color_is_changed_while_rows_come_and_go(bench: SceneBench, model: Any) -> None:
    from PySide6.QtGui import QColor

    (grid,) = bench.view.scene.displays
    model.toggle(row_of(model, "Grid"))
    model.pick(row_of(model, "Color"))
    model.toggle(row_of(model, "Global Options"))
    model.setPicked(QColor("#123456"))
    assert grid.color.name() == "#123456"
    bench.view.scene.remove(grid)
    model.setPicked(QColor("#000000"))


def view_command(*arguments: str, timeout: float = 100) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "rosglass", "view", *arguments],
        check=False,
        env={**os.environ, "QT_QUICK_BACKEND": ""},
        capture_output=True,
        text=True,
        timeout=timeout,
    )


def test_the_program_loads_only_what_its_window_shows() -> None:
    late = (
        "{'rosglass.scene.displays.marker', 'rosglass.images', 'rosglass.qml.elements.ros2', "
        "'rosglass.connection', 'rosglass.interfaces.library', 'rosglass.tf.buffer', 'yaml'}"
    )
    code = f"import rosglass.scene.app.program, sys; print(sorted({late} & set(sys.modules)))"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "[]"


def test_the_command_shows_a_config(app: Any, tmp_path: Path) -> None:
    from PySide6.QtGui import QImage

    config, picture = tmp_path / "robot.rviz", tmp_path / "view.png"
    config.write_text(GRID)
    done = view_command(
        str(config), "--url", "local://view", "--screenshot", str(picture), "--after", "1"
    )
    assert done.returncode == 0, done.stderr
    assert "display 'Radar': rosglass has no other_plugins/Radar" in done.stderr
    assert "WARNING rosglass.qml" not in done.stderr, "types of panels are there"
    image = QImage(str(picture))
    assert (image.width(), image.height()) == (1280, 800)
    colors = [image.pixelColor(x, y).name() for x in range(360, 1000, 3) for y in range(60, 700)]
    assert colors.count("#000028") > 1000, "the background of the config"
    assert colors.count("#ff00ff") > 100, "its grid"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["nosuch.rviz"], "nosuch.rviz: there is no such file"),
        (["--renderer", "software"], "draws no 3D: use --renderer opengl"),
        (["{empty}"], "empty.rviz:1: the file must be a mapping"),
        (
            ["--url", "zenho://robot", "--after", "1", "--screenshot", "{picture}"],
            "unknown scheme 'zenho'; did you mean zenoh?",
        ),
    ],
)
def test_the_command_says_what_is_wrong(
    app: Any, tmp_path: Path, arguments: list[str], text: str
) -> None:
    empty = tmp_path / "empty.rviz"
    empty.write_text("- 1\n")
    files = {"empty": empty, "picture": tmp_path / "view.png"}
    done = view_command(*(one.format(**files) for one in arguments))
    assert done.returncode == 1
    assert text in done.stderr
    assert "Traceback" not in done.stderr


def test_screenshot_without_a_robot_is_noted(app: Any, tmp_path: Path) -> None:
    picture = tmp_path / "view.png"
    nowhere = f"zenoh://127.0.0.1:{free_port()}"
    done = view_command("--url", nowhere, "--after", "1", "--screenshot", str(picture))
    assert done.returncode == 0, done.stderr
    assert f"{picture} shows no robot: " in done.stderr


def test_the_command_shows_overlays(app: Any, tmp_path: Path) -> None:
    from PySide6.QtGui import QImage

    overlay, picture = tmp_path / "Panel.qml", tmp_path / "view.png"
    overlay.write_text(
        "import QtQuick 2.15\nimport Ros 1.0\nimport RosScene 1.0\n"
        'Rectangle { color: rviz.fixedFrame === \'odom\' ? "#ff0000" : "#0000ff"\n'
        'Component.onCompleted: { Ros.init("panel"); rviz.isBare = true }\n'
        "property Component further: SceneView { MarkerDisplay { } } }"
    )
    arguments = ("--fixed-frame", "odom", "--url", "local://overlays", "--overlay", str(overlay))
    done = view_command(*arguments, "--screenshot", str(picture), "--after", "1")
    assert done.returncode == 0, done.stderr
    image = QImage(str(picture))
    # Without panels.
    assert {image.pixelColor(x, y).name() for x in (2, 1277) for y in (2, 797)} == {"#ff0000"}
    overlay.write_text("import QtQuick 2.15\nItem { nothing: 1 }")
    done = view_command(*arguments)
    assert done.returncode == 1
    assert "Panel.qml:2:" in done.stderr
    done = view_command("--overlay", str(tmp_path / "Nothing.qml"))
    assert done.returncode == 1
    assert "Nothing.qml" in done.stderr


@pytest.mark.parametrize(
    ("chosen", "meant"),
    [
        ("/work/a.rviz", ""),
        ("/work//tmp/my robot/a.rviz", "/tmp/my robot/a.rviz"),
        ("///tmp/a.rviz", "/tmp/a.rviz"),
        ("/work/~/a.rviz", "~/a.rviz"),
        ("/work/a~/b.rviz", ""),
    ],
)
def test_typed_paths_are_taken_as_they_are(app: Any, chosen: str, meant: str) -> None:
    from PySide6.QtCore import QUrl

    from rosglass.scene.app.program import ViewProgram

    url = QUrl("file:")
    url.setPath(chosen)
    found = ViewProgram().typedFile(url)
    assert found.toLocalFile() == (os.path.expanduser(meant) if meant else "")  # noqa: PTH111


def test_unsaved_changes_prevent_closing(bench: SceneBench, tmp_path: Path) -> None:
    from rosglass.scene.app.program import ViewProgram

    view = bench.load()
    program = ViewProgram()
    program.begin(view)
    assert program.mayClose()
    # The robot's own data, such as its frames, is not a change.
    bench.place("tool")
    bench.wait(lambda: view.scene.find("TF").frames == ["map", "tool"])
    assert program.mayClose()
    view.scene.displays[0].cellSize = 2.0
    assert not program.mayClose()
    bench.wait(lambda: program.modified)
    program.save(str(tmp_path / "new.rviz"))
    assert program.mayClose()
    assert program.configName == "new.rviz"
    view.controller.set("Yaw", 0.1)
    assert program.mayClose(), "moving the camera is not a change"
    view.scene.add("Axes")
    assert not program.mayClose()
    program.open(str(tmp_path / "new.rviz"))
    assert [one.name for one in view.scene.displays] == ["Grid", "TF"]
    program.open(str(tmp_path / "none.rviz"))
    assert "there is no such file" in program.message


@pytest.fixture
def window(bench: SceneBench, request: pytest.FixtureRequest) -> Iterator[Any]:
    """The window of the program, connected to the robot of the bench; options as parameters."""
    from PySide6.QtCore import QObject
    from PySide6.QtQml import QQmlApplicationEngine

    from rosglass.qml import install
    from rosglass.qt import send_deferred_deletes
    from rosglass.scene.app.program import WINDOW, ViewProgram

    engine, program = QQmlApplicationEngine(), ViewProgram(**getattr(request, "param", {}))
    install(engine, bench.session)
    engine.rootContext().setContextProperty("program", program)
    engine.load(str(WINDOW))
    (window,) = engine.rootObjects()
    # The first frame does not wait for the panels.
    assert window.findChild(QObject, "displayRows") is None
    bench.wait(lambda: window.property("drawn"))
    assert window.findChild(QObject, "displayRows") is not None
    yield window
    # It would ask whether to save what has changed.
    program.discard()
    window.close()
    engine.deleteLater()
    send_deferred_deletes()


class Rows:
    """The rows of the Displays panel in the program's window, for the mouse and the keyboard."""

    def __init__(self, window: Any) -> None:
        from PySide6.QtCore import QObject, QPoint, QPointF, Qt
        from PySide6.QtTest import QTest

        self.window, self._test, self._left = window, QTest, Qt.MouseButton.LeftButton
        self._list = window.findChild(QObject, "displayRows")
        self._point, self._pointf = QPoint, QPointF
        self.model = self._list.property("model")
        self.scene = window.findChild(QObject, "scene").scene

    def at(self, label: str, part: float = 0.5, x: float = 150) -> Any:
        """Return where the row of a label is, or a part of its height further down."""
        self.model.refresh()
        top = self._list.property("originY") - self._list.property("contentY")
        y = top + 24 * (row_of(self.model, label) + part)
        return self._list.mapToScene(self._pointf(x, y)).toPoint()

    @property
    def current(self) -> int:
        """The row that is selected; -1 for none."""
        found: int = self._list.property("currentIndex")
        return found

    def bottom(self) -> Any:
        """Return a place in the lowest row that is visible."""
        return self._list.mapToScene(self._pointf(150, self._list.height() - 8)).toPoint()

    def drag(self, moved: str, target: Any) -> None:
        """Press on a row and move to a place, in steps."""
        start = self.at(moved)
        self._test.mousePress(self.window, self._left, pos=start)
        for share in (0.3, 0.6, 1.0):
            self._test.mouseMove(self.window, start + (target - start) * share)

    def release(self, target: Any) -> None:
        self._test.mouseRelease(self.window, self._left, pos=target)

    def click(self, place: Any) -> None:
        self._test.mouseClick(self.window, self._left, pos=place)

    def key(self, name: str, *, alt: bool = False) -> None:
        from PySide6.QtCore import Qt

        held = Qt.KeyboardModifier.AltModifier if alt else Qt.KeyboardModifier.NoModifier
        self._test.keyClick(self.window, getattr(Qt.Key, f"Key_{name}"), held)


def test_a_large_config_is_announced_once(bench: SceneBench, window: Any, tmp_path: Path) -> None:
    from PySide6.QtCore import QObject

    scene = window.findChild(QObject, "scene").scene
    grids = [f"{{Class: rviz/Grid, Name: g{number}}}" for number in range(400)]
    text = ", ".join([*grids, "{Class: rviz/Image, Name: Camera, Enabled: true}"])
    (tmp_path / "large.rviz").write_text(f"Visualization Manager: {{Displays: [{text}]}}")
    changes: list[int] = []
    scene.displaysChanged.connect(lambda: changes.append(len(scene.displays)))
    window.findChild(QObject, "scene").load_config(tmp_path / "large.rviz")
    assert changes == [401], "each change costs as much as there are displays"
    # Panels of images are not made anew as others come and go.
    panels = window.findChild(QObject, "imagePanels")
    bench.wait(lambda: panels.property("item") is not None)
    (panel,) = panels.property("item").childItems()[:1]
    scene.remove(scene.displays[0])
    assert changes == [401, 400]
    assert panels.property("item").childItems()[0] is panel
    scene.remove(scene.find("Camera"))
    bench.wait(lambda: panels.property("item") is None)


def test_a_display_is_dragged_by_the_mouse(bench: SceneBench, window: Any) -> None:
    rows = Rows(window)
    rows.scene.add("Group", "Robot")
    rows.scene.add("Axes")
    target = rows.at("Robot")
    rows.drag("Grid", target)
    assert rows.model.frozen
    assert outline(rows.scene) == ["Grid", "TF", "Robot", [], "Axes"]
    rows.release(target)
    assert outline(rows.scene) == ["TF", "Robot", ["Grid"], "Axes"]
    assert not rows.model.frozen
    # Escape drops what is dragged, until the button is released.
    target = rows.at("TF", 0.1)
    rows.drag("Axes", target)
    rows.key("Escape")
    rows.release(target)
    assert outline(rows.scene) == ["TF", "Robot", ["Grid"], "Axes"]
    rows.drag("Axes", target)
    rows.release(target)
    assert outline(rows.scene) == ["Axes", "TF", "Robot", ["Grid"]]
    # The display that was moved stays selected, for the keyboard.
    rows.key("Down", alt=True)
    assert outline(rows.scene) == ["TF", "Axes", "Robot", ["Grid"]]
    rows.key("Space")
    assert not rows.scene.find("Axes").enabled
    rows.key("Down")
    rows.key("Down")
    rows.key("Left", alt=True)
    assert outline(rows.scene) == ["TF", "Axes", "Robot", [], "Grid"]
    rows.key("Delete")
    assert outline(rows.scene) == ["TF", "Axes", "Robot", []]


def test_a_display_is_dragged_by_a_finger_that_is_held_down(bench: SceneBench, window: Any) -> None:
    from PySide6.QtTest import QTest

    rows = Rows(window)
    start, end = rows.at("Grid"), rows.at("TF", 0.9)
    device = QTest.createTouchDevice()
    QTest.touchEvent(window, device).press(0, start, window).commit()
    bench.wait(lambda: rows.model.frozen)
    QTest.touchEvent(window, device).move(0, end, window).commit()
    QTest.touchEvent(window, device).release(0, end, window).commit()
    assert outline(rows.scene) == ["TF", "Grid"]
    # One that moves at once does not drag.
    QTest.touchEvent(window, device).press(0, start, window).commit()
    for share in (0.3, 0.6, 1.0):
        QTest.touchEvent(window, device).move(0, start + (end - start) * share, window).commit()
    QTest.touchEvent(window, device).release(0, end, window).commit()
    assert not rows.model.frozen
    assert outline(rows.scene) == ["TF", "Grid"]


def test_a_list_scrolls_to_where_a_display_is_dragged(bench: SceneBench, window: Any) -> None:
    rows = Rows(window)
    for number in range(60):
        rows.scene.add("Axes", f"A{number}")
    bench.wait(lambda: rows.at("A59").y() > 900)
    bottom = rows.bottom()
    rows.drag("Grid", bottom)
    bench.wait(lambda: rows.at("A59").y() < bottom.y())
    rows.release(bottom)
    names = [one.name for one in rows.scene.displays]
    assert names.index("Grid") > 50


def test_the_view_shows_the_color_that_a_dialog_has(bench: SceneBench, window: Any) -> None:
    from PySide6.QtCore import QMetaObject, QObject
    from PySide6.QtGui import QColor

    rows = Rows(window)
    view, colors = (window.findChild(QObject, name) for name in ("scene", "colors"))
    for end, after in (("reject", "#303030"), ("accept", "#112233")):
        rows.click(rows.at("Background Color", x=151))
        bench.wait(lambda: colors.property("visible"))
        assert colors.property("selectedColor").name() == "#303030"
        colors.setProperty("selectedColor", QColor("#112233"))
        assert view.property("background").name() == "#112233"
        QMetaObject.invokeMethod(colors, end)
        bench.wait(lambda: not colors.property("visible"))
        assert view.property("background").name() == after


def test_a_frame_is_hidden_by_its_check_box(bench: SceneBench, window: Any) -> None:
    bench.place("tool")
    rows = Rows(window)
    tf = rows.scene.find("TF")
    bench.wait(lambda: tf.frames == ["map", "tool"])
    # An arrow left of a row shows what is below it.
    rows.click(rows.at("TF", x=10))
    rows.click(rows.at("Frames", x=24))
    rows.click(rows.at("tool", x=62))
    bench.wait(lambda: tf.frames == ["map"])


def test_a_text_being_typed_stays_while_rows_come_above_and_below(
    bench: SceneBench, window: Any
) -> None:
    from PySide6.QtTest import QTest

    rows = Rows(window)
    rows.model.toggle(row_of(rows.model, "Grid"))
    window.grabWindow()
    rows.click(rows.at("Cell Size", x=230))
    field = bench.wait(window.activeFocusItem)
    rows.model.active = False
    field.selectAll()
    for letter in "57":
        QTest.keyClick(window, letter)
    for change in (
        lambda: rows.scene.find("Grid").set_status("X", "warn", "bad"),
        rows.scene.find("Grid").clear_status,
    ):
        change()
        rows.scene.add("Axes")  # a row below
        window.grabWindow()
        assert window.activeFocusItem() == field
        assert field.property("text") == "57"
    QTest.keyClick(window, "5")
    rows.key("Return")
    assert rows.scene.find("Grid").cellSize == 575.0


def test_a_typed_frame_counts_when_the_user_goes_on(bench: SceneBench, window: Any) -> None:
    from PySide6.QtCore import QObject, QPoint
    from PySide6.QtTest import QTest

    bench.place("tool")
    rows = Rows(window)
    view = window.findChild(QObject, "scene")
    bench.wait(lambda: "tool" in rows.scene.frames())
    bench.wait(lambda: "tool" in rows.model.rows[row_of(rows.model, "Fixed Frame")].choices)
    middle = view.mapToScene(view.boundingRect().center()).toPoint()

    def type_text(text: str) -> Any:
        rows.click(rows.at("Fixed Frame", x=230))
        field = window.activeFocusItem()
        field.selectAll()
        for letter in text:
            QTest.keyClick(window, letter)
        rows.click(middle + QPoint(5, 5))
        return field

    field = type_text("odom")
    assert view.fixedFrame == "odom"
    bench.wait(lambda: field.property("text") == "odom")
    # What is refused is not left standing.
    field = type_text(" ")
    assert view.fixedFrame == "odom"
    assert field.property("text") == "odom"


def test_tool_tip_of_a_row_stands_beside_the_panel(bench: SceneBench, window: Any) -> None:
    from PySide6.QtCore import QObject, QPointF
    from PySide6.QtTest import QTest

    rows = Rows(window)
    QTest.mouseMove(window, rows.at("Fixed Frame", x=60))

    def tips(item: Any) -> list[Any]:
        is_tip = item.property("text") == "Frame in which everything is placed."
        below = [tip for one in item.childItems() for tip in tips(one)]
        return [item, *below] if is_tip and item.isVisible() else below

    (tip,) = bench.wait(lambda: tips(window.contentItem()))
    panel = window.findChild(QObject, "displayRows")
    edge = panel.mapToScene(QPointF(panel.width(), 0)).x()
    assert tip.mapToScene(QPointF(0, 0)).x() >= edge


def test_a_transformer_that_is_not_chosen_shows_the_one_in_use(
    bench: SceneBench, window: Any
) -> None:
    rows = Rows(window)
    rows.model.add("LaserScan", "/scan")
    scan = rows.scene.find("LaserScan")
    publisher = bench.robot.create_publisher("/scan", "sensor_msgs/LaserScan")
    message = {"header": {"frame_id": "map"}, "ranges": [1.0], "range_max": 2.0}
    bench.wait(lambda: publisher.publish(message) or scan.usedColorTransformer)

    def shown(item: Any) -> set[str]:
        texts = {str(item.property("displayText"))}
        return texts.union(*(shown(one) for one in item.childItems()))

    wanted = {f"{scan.usedColorTransformer} (automatic)", "XYZ (automatic)"}
    bench.wait(lambda: wanted <= shown(window.contentItem()))
    scan.colorTransformer, scan.positionTransformer = "FlatColor", "XYZ"
    bench.wait(lambda: {"FlatColor", "XYZ"} <= shown(window.contentItem()))
    assert not wanted & shown(window.contentItem())


def test_a_display_is_chosen_from_a_list_that_is_filtered(bench: SceneBench, window: Any) -> None:
    from PySide6.QtCore import QMetaObject, QObject, Qt
    from PySide6.QtTest import QTest

    rows = Rows(window)
    publishers = [bench.robot.create_publisher(f"/plan{n}", "nav_msgs/Path") for n in range(2)]
    bench.wait(lambda: len(rows.model.suggestions()) == len(publishers))
    dialog, choices, button = (
        window.findChild(QObject, name) for name in ("addDialog", "addChoices", "addChosen")
    )

    def open_dialog() -> None:
        QMetaObject.invokeMethod(window.findChild(QObject, "addDisplay"), "click")
        bench.wait(lambda: dialog.property("opened"))

    def middle_of(number: int) -> Any:
        rows_of_it = choices.property("contentItem").childItems()
        item = next(one for one in rows_of_it if one.property("index") == number)
        return item.mapToScene(item.boundingRect().center()).toPoint()

    # A click selects, which adds nothing yet.
    open_dialog()
    assert not button.property("enabled")
    bench.wait(lambda: choices.property("count") == 2)
    window.grabWindow()
    rows.click(middle_of(1))
    assert button.property("enabled")
    assert outline(rows.scene) == ["Grid", "TF"]
    QMetaObject.invokeMethod(button, "click")
    assert [one.topic for one in rows.scene.displays[2:]] == ["/plan1"]
    bench.wait(lambda: not dialog.property("visible"))
    # The new one is selected, for the keyboard as well.
    assert rows.model.rows[rows.current].label == "Path"
    rows.key("Delete")
    assert outline(rows.scene) == ["Grid", "TF"]
    open_dialog()
    window.grabWindow()
    QTest.mouseDClick(window, Qt.MouseButton.LeftButton, pos=middle_of(0))
    assert [one.topic for one in rows.scene.displays[2:]] == ["/plan0"]
    bench.wait(lambda: not dialog.property("visible"))
    # Words of a filter, in any order; Enter adds what is selected.
    open_dialog()
    for letter in "path 1":
        QTest.keyClick(window, letter)
    assert choices.property("count") == 1
    rows.key("Return")
    assert [one.topic for one in rows.scene.displays[2:]] == ["/plan0", "/plan1"]
    bench.wait(lambda: not dialog.property("visible"))
    open_dialog()
    assert choices.property("count") == 2
    window.grabWindow()
    rows.click(middle_of(0))
    rows.key("Down")
    rows.key("Return")
    assert rows.scene.displays[4].topic == "/plan1"
    bench.wait(lambda: not dialog.property("visible"))
    open_dialog()
    rows.key("Escape")
    bench.wait(lambda: not dialog.property("visible"))
    assert len(rows.scene.displays) == 5
    # A filter that fits the other list only says so; a click on its tab leaves the keyboard there.
    open_dialog()
    for letter in "robot":
        QTest.keyClick(window, letter)
    nothing = window.findChild(QObject, "addNothing")
    assert nothing.property("text") == "Nothing here has these words. By type: RobotModel"
    tab = window.findChild(QObject, "addByType")
    rows.click(tab.mapToScene(tab.boundingRect().center()).toPoint())
    assert choices.property("count") == 1
    QTest.keyClick(window, "x")
    assert choices.property("count") == 0
    assert nothing.property("text") == "Nothing has these words."
    rows.key("Backspace")
    rows.key("Return")
    assert outline(rows.scene)[5:] == ["RobotModel"]


def test_reset_in_the_tool_bar_drops_what_was_received(bench: SceneBench, window: Any) -> None:
    from PySide6.QtCore import QObject

    scene = window.findChild(QObject, "scene").scene
    path = scene.add("Path", topic="/plan")
    publisher = bench.robot.create_publisher("/plan", "nav_msgs/Path")

    def is_shown() -> bool:
        publisher.publish({"header": {"frame_id": scene.fixed_frame}})
        return bool(len(path.root))

    bench.wait(is_shown)
    window.findChild(QObject, "reset").clicked.emit()
    assert not len(path.root)
    bench.wait(is_shown)


def test_views_are_saved_shown_and_removed(bench: SceneBench, tmp_path: Path) -> None:
    view = bench.load("GridDisplay {}")
    view.resetView()
    assert view.setViewSetting("Distance", "7") == ""
    assert view.saveView("far") == ""
    assert view.setViewSetting("Distance", "3") == ""
    assert view.saveView("") == ""
    assert view.saveView("two\nlines") == "expected a name of one line, got 'two\\nlines'"
    assert view.savedViews == ["far", "Orbit"]
    view.save_config(tmp_path / "views.rviz")
    view.load_config(tmp_path / "views.rviz")
    assert view.savedViews == ["far", "Orbit"]
    assert view.showSavedView(0) == ""
    assert view.controller.get("Distance") == 7
    assert view.showSavedView(2) == "there is no saved view 2; there are 2"
    view.saveView("far")  # instead of the one before
    assert view.savedViews == ["Orbit", "far"]
    view.removeSavedView(0)
    assert view.savedViews == ["far"]


def test_tools_are_added_and_removed_in_the_tool_bar(bench: SceneBench, window: Any) -> None:
    from PySide6.QtCore import QObject

    tools = window.findChild(QObject, "scene").tools
    assert [tools.nameOf(kind) for kind in ("SetGoal", "Other")] == ["2D Goal Pose", "Other"]
    before = [tool.TYPE for tool in tools]
    assert "GoalTool" in tools.types
    assert tools.addTool("GoalTool") == ""
    assert [tool.TYPE for tool in tools] == [*before, "GoalTool"]
    tools.removeTool(tools.find("GoalTool"))
    assert [tool.TYPE for tool in tools] == before
    assert "there is no tool" in tools.addTool("Hammer")


def test_a_narrow_window_has_all_buttons(bench: SceneBench, window: Any) -> None:
    from PySide6.QtCore import QObject, QPointF

    buttons = [window.findChild(QObject, name) for name in ("addTool", "removeTool", "rightDock")]
    window.setWidth(700)

    def right_edges() -> list[float]:
        return [one.mapToScene(QPointF(one.width(), 0)).x() for one in buttons]

    bench.wait(lambda: max(right_edges()) <= 700, right_edges)
    assert buttons[0].mapToScene(QPointF(0, 0)).y() >= 20, "in the second line"


def test_docks_are_hidden_as_the_config_says_and_saved(
    bench: SceneBench, window: Any, tmp_path: Path
) -> None:
    from PySide6.QtCore import QMetaObject, QObject
    from PySide6.QtQml import qmlContext

    from rosglass.scene.configs.rviz_config import RvizConfig

    program = qmlContext(window).contextProperty("program")
    scene = window.findChild(QObject, "scene")
    narrow = scene.property("width")
    file = tmp_path / "docks.rviz"
    geometry = "Window Geometry: {Hide Left Dock: true, Hide Right Dock: true, Width: 700}\n"
    file.write_text(GRID + geometry)
    program.open(str(file))
    bench.wait(lambda: scene.property("width") == window.property("width"))
    # As its button does.
    button = window.findChild(QObject, "leftDock")
    assert button.property("checked") is False
    QMetaObject.invokeMethod(button, "click")
    assert button.property("checked") is True
    bench.wait(lambda: narrow < scene.property("width") < window.property("width"))
    program.save("")
    expected = {"Hide Left Dock": False, "Hide Right Dock": True, "Width": 700}
    assert RvizConfig.load(file).root["Window Geometry"] == expected


def test_a_goal_is_canceled_by_its_button(bench: SceneBench, window: Any, nav2: Any) -> None:
    from PySide6.QtCore import QMetaObject, QObject

    driver = Driver(nav2)
    scene = window.findChild(QObject, "scene")
    goal = scene.tools.add("GoalTool")
    goal.activate()
    button = window.findChild(QObject, "cancelGoal")
    assert not button.property("visible")
    bench.wait(lambda: endpoint_of(goal) is not None and endpoint_of(goal).ready)
    goal.send_pose(1.0, 0.0, 0.0)
    bench.wait(lambda: driver.goals)
    assert button.property("visible")
    QMetaObject.invokeMethod(button, "click")
    bench.wait(lambda: not button.property("visible"))
    assert scene.property("statusText") == "Goal: canceled"


def test_sent_goals_are_shown_before_messages_and_without_panels(
    bench: SceneBench, window: Any
) -> None:
    from PySide6.QtCore import QObject
    from PySide6.QtQml import qmlContext

    program = qmlContext(window).contextProperty("program")
    scene = window.findChild(QObject, "scene")
    status, bare = (window.findChild(QObject, name) for name in ("status", "bareStatus"))
    program.say("3 notes on robot.rviz")
    assert status.property("text") == "3 notes on robot.rviz"
    scene.tools.announce("Goal <at> [1, 2]: sent")
    assert status.property("text") == "Goal <at> [1, 2]: sent"
    assert not bare.property("visible")
    window.setProperty("panels", False)
    assert bare.property("visible")
    assert bare.property("text") == "Goal <at> [1, 2]: sent"
    bench.wait(lambda: not bare.property("visible"))
    bench.session.shutdown()
    bench.wait(lambda: bare.property("visible"))
    assert "connected" not in bare.property("text").split(":")[0]


def test_the_program_follows_configs_of_overlays(
    bench: SceneBench, window: Any, tmp_path: Path
) -> None:
    from PySide6.QtCore import QObject
    from PySide6.QtQml import qmlContext

    from rosglass.scene.access import access_of
    from rosglass.scene.configs.rviz_config import RvizConfig

    program = qmlContext(window).contextProperty("program")
    access = access_of(window.findChild(QObject, "scene"))
    first, second = tmp_path / "a.rviz", tmp_path / "b.rviz"
    first.write_text(GRID + "Window Geometry: {Hide Left Dock: true}\n")
    second.write_text(GRID)
    program.open(str(first))
    assert (program.configName, program.hidesLeftDock) == ("a.rviz", True)
    access.load_config(str(second))
    bench.wait(lambda: window.title() == "b.rviz - rosglass")
    assert not program.hidesLeftDock
    assert program.mayClose()
    program.save("")
    assert "Window Geometry" not in RvizConfig.load(second).root
    access.scene_view.scene.add("Axes")
    bench.wait(lambda: program.modified)
    program.hideDocks(True, False)
    access.save_config(str(tmp_path / "c.rviz"))
    assert window.title() == "c.rviz - rosglass"
    assert program.mayClose()
    assert RvizConfig.load(tmp_path / "c.rviz").root["Window Geometry"] == {"Hide Left Dock": True}


def test_overlays_of_a_config_ask_for_the_view_alone(
    bench: SceneBench, window: Any, tmp_path: Path
) -> None:
    from PySide6.QtCore import QMetaObject, QObject
    from PySide6.QtQml import qmlContext

    scene = window.findChild(QObject, "scene")
    (tmp_path / "Panel.qml").write_text(
        "import QtQuick 2.15\nimport RosRviz 1.0\nItem { objectName: 'panel'\n"
        "property bool bare: rviz.isBare; function show() { rviz.isBare = false }\n"
        "Component.onCompleted: rviz.isBare = true }"
    )
    file = tmp_path / "own.rviz"
    file.write_text(
        "Visualization Manager:\n  Displays:\n"
        f"    - {{Class: rosglass/QmlOverlay, Name: Panel, Path: {tmp_path / 'Panel.qml'}}}\n"
    )
    qmlContext(window).contextProperty("program").open(str(file))
    bench.wait(lambda: scene.property("width") == window.property("width"))
    overlays = [inner for one in scene.childItems() for inner in (one, *one.childItems())]
    panel = next(one for one in overlays if one.objectName() == "panel")
    bench.wait(lambda: panel.property("bare"))
    QMetaObject.invokeMethod(panel, "show")
    bench.wait(lambda: scene.property("width") < window.property("width"))
    window.setProperty("panels", False)
    assert panel.property("bare")


@pytest.mark.parametrize("window", [{"kiosk": True}], indirect=True)
def test_a_kiosk_is_bare(window: Any) -> None:
    from PySide6.QtCore import QObject

    from rosglass.scene.access import access_of

    access = access_of(window.findChild(QObject, "scene"))
    assert access.bare
    access.bare = False
    assert window.property("panels")


def test_delete_removes_only_what_was_selected(bench: SceneBench, window: Any) -> None:
    """Not the display that takes the place of a setting or display that goes."""
    rows = Rows(window)
    rows.scene.add("Axes")
    rows.scene.add("Path")
    rows.model.toggle(row_of(rows.model, "Axes"))
    window.grabWindow()  # the rows that have come are placed
    rows.click(rows.at("Radius", x=60))
    assert rows.current == row_of(rows.model, "Radius")
    rows.model.toggle(row_of(rows.model, "Axes"))
    assert rows.current == row_of(rows.model, "Axes")
    rows.key("Delete")
    assert outline(rows.scene) == ["Grid", "TF", "Path"]
    rows.key("Delete")
    assert outline(rows.scene) == ["Grid", "TF", "Path"]
    rows.click(rows.at("TF"))
    # A robot's overlay, say, removes it.
    rows.scene.remove(rows.scene.find("TF"))
    rows.model.refresh()
    assert rows.current == -1


def test_the_global_status_says_that_there_is_no_connection(bench: SceneBench, model: Any) -> None:
    def status() -> Any:
        model.refresh()
        return model.rows[row_of(model, "Global Status")]

    bench.wait(lambda: status().level == "ok")
    bench.session.shutdown()
    bench.wait(lambda: status().level != "ok")
    assert status().value != "Ok"


def test_the_first_frame_waits_for_what_it_shows_only(app: Any) -> None:
    code = """
import os, sys
from rosglass.cli import main, view

show = view.show_interface

def watched(*args, **options):
    program = options["context"]["program"]
    begin = type(program).begin

    def look():
        import gc, linecache
        from PySide6 import QtCore

        print("pictures", program.view.pictures_drawn())
        print("enumerations", "Qt" in vars(QtCore))
        print("sources", [file for file in linecache.cache if "scene" in file])
        print("controls", "libQt6QuickControls2" in open("/proc/self/maps").read())
        print("collects", gc.isenabled())
        sys.stdout.flush()
        os._exit(0)

    def watch(self, view, *others):
        begin(self, view, *others)
        view.window().frameSwapped.connect(look)

    type(program).begin = watch
    return show(*args, **options)

view.show_interface = watched
sys.exit(main(["view", "--url", "local://first"]))
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    expected = "pictures 1\nenumerations False\nsources []\ncontrols False\ncollects False\n"
    assert done.stdout == expected, done.stderr


def test_a_window_that_is_too_small_gives_the_view_no_negative_size(
    bench: SceneBench, window: Any
) -> None:
    from PySide6.QtCore import QObject

    scene = window.findChild(QObject, "scene")
    window.setProperty("width", 300)
    window.setProperty("height", 40)
    bench.wait(lambda: scene.property("width") < 300)
    assert scene.property("height") == 0


def run_in(window: Any, script: str) -> Any:
    """Return the result of JavaScript in the program's window."""
    from PySide6.QtCore import QObject
    from PySide6.QtQml import QQmlExpression, qmlContext

    around = window.findChild(QObject, "status")
    expression = QQmlExpression(qmlContext(around), around, script)
    result, _ = expression.evaluate()
    assert not expression.hasError(), expression.error().toString()
    return result


def test_return_accepts_the_name_of_a_file(bench: SceneBench, window: Any, tmp_path: Path) -> None:
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest

    def enter(name: str) -> None:
        run_in(window, f"saving.currentFolder = 'file://{tmp_path}'; saving.ask(null)")
        bench.wait(lambda: run_in(window, "saving.nameField && saving.nameField.activeFocus"))
        field = run_in(window, "saving.nameField")
        for letter in name:
            QTest.keyClick(field.window(), letter)
        QTest.keyClick(field.window(), Qt.Key.Key_Return)
        bench.wait(lambda: not run_in(window, "saving.visible"))

    enter("new")
    file = tmp_path / "new.rviz"
    assert file.exists()
    assert not run_in(window, "replacing.visible")
    file.write_text("kept")
    enter("new")
    assert run_in(window, "replacing.visible")
    assert file.read_text() == "kept"
    run_in(window, "replacing.close()")


def test_closing_waits_for_the_name_of_a_new_file(
    bench: SceneBench, window: Any, tmp_path: Path
) -> None:
    from PySide6.QtCore import QObject

    window.findChild(QObject, "scene").scene.add("Axes")
    window.close()
    assert window.isVisible()
    run_in(window, "unsaved.buttonClicked(MessageDialog.Save, 0); unsaved.close()")
    run_in(window, f"saving.close(); saving.save('{tmp_path}/new.rviz')")
    bench.wait(lambda: not window.isVisible())
    assert (tmp_path / "new.rviz").exists()


def test_choices_are_never_rich_text(bench: SceneBench) -> None:
    from PySide6.QtQml import QQmlExpression, qmlContext

    import rosglass.scene
    from rosglass.qt import QtCore

    panels = QtCore.QUrl.fromLocalFile(f"{rosglass.scene.__path__[0]}/app/panels").toString()
    bench.load(
        'SettingEditor { width: 200; kind: "frame"\n'
        'choices: ["map", "<b>bold</b>"]; value: "<b>bold</b>" }',
        imports=f'import "{panels}"',
    )

    def shown(item: Any) -> list[Any]:
        own = [item] if item.property("text") == "<b>bold</b>" else []
        return own + [one for child in item.childItems() for one in shown(child)]

    Hand(bench).click((190, 11))

    def formats() -> list[Any]:
        context = qmlContext(bench.view)
        items = [one for one in shown(bench.window.contentItem()) if one.inherits("QQuickText")]
        return [QQmlExpression(context, one, "textFormat").evaluate()[0] for one in items]

    bench.wait(formats)
    assert set(formats()) == {QtCore.Qt.TextFormat.PlainText.value}
