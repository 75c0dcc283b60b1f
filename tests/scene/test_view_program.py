"""The command ``rosglass view`` and its panels."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path

    from conftest import SceneBench

GRID = """
Visualization Manager:
  Displays:
    - {Class: rviz_default_plugins/Grid, Name: Floor, Enabled: true, Color: 255; 0; 255, Alpha: 1}
    - {Class: other_plugins/Radar, Name: Radar, Enabled: true}
  Global Options: {Fixed Frame: odom, Background Color: 0; 0; 40}
"""


@pytest.fixture
def model(bench: SceneBench) -> Any:
    """The rows of a Displays panel of a view with a grid."""
    from rosglass.scene.panel_models import DisplaysModel

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


def test_what_the_user_enters_changes_settings_or_is_refused(bench: SceneBench, model: Any) -> None:
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
    model.add("Path", "/plan")
    assert bench.view.scene.displays[1].topic == "/plan"
    bench.wait(publisher.subscription_count)
    model.rename(row_of(model, "Path"), "Plan")
    model.move(row_of(model, "Plan"), row_of(model, "Grid"))
    assert [one.name for one in bench.view.scene.displays] == ["Plan", "Grid"]
    model.setEnabled(row_of(model, "Plan"), False)
    bench.wait(lambda: not publisher.subscription_count())
    model.remove(row_of(model, "Plan"))
    assert [one.name for one in bench.view.scene.displays] == ["Grid"]


def test_rows_follow_the_status(bench: SceneBench, model: Any) -> None:
    model.add("Axes", "")
    model.edit(row_of(model, "Reference Frame"), "tool")
    row = row_of(model, "Axes")
    assert model.rows[row].level == "error"
    assert "no transform from [tool]" in model.rows[row].description
    assert "Transform" in labels(model)


def view_command(*arguments: str, timeout: float = 100) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "rosglass", "view", *arguments],
        check=False,
        env={**os.environ, "QT_QUICK_BACKEND": ""},
        capture_output=True,
        text=True,
        timeout=timeout,
    )


def test_the_command_shows_a_config(app: Any, tmp_path: Path) -> None:
    from PySide6.QtGui import QImage

    config, picture = tmp_path / "robot.rviz", tmp_path / "view.png"
    config.write_text(GRID)
    done = view_command(
        str(config), "--url", "local://view", "--screenshot", str(picture), "--after", "1"
    )
    assert done.returncode == 0, done.stderr
    assert "display 'Radar': rosglass has no other_plugins/Radar" in done.stderr
    image = QImage(str(picture))
    assert (image.width(), image.height()) == (1280, 800)
    colours = [image.pixelColor(x, y).name() for x in range(360, 1000, 3) for y in range(60, 700)]
    assert colours.count("#000028") > 1000, "the background of the config"
    assert colours.count("#ff00ff") > 100, "its grid"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["nosuch.rviz"], "nosuch.rviz: there is no such file"),
        (["--renderer", "software"], "draws no 3D: use --renderer opengl"),
        (["{empty}"], "empty.rviz:1: the file must be a mapping"),
    ],
)
def test_the_command_says_what_is_wrong(
    app: Any, tmp_path: Path, arguments: list[str], text: str
) -> None:
    empty = tmp_path / "empty.rviz"
    empty.write_text("- 1\n")
    done = view_command(*(one.format(empty=empty) for one in arguments))
    assert done.returncode == 1
    assert text in done.stderr
    assert "Traceback" not in done.stderr


def test_the_command_shows_overlays(app: Any, tmp_path: Path) -> None:
    from PySide6.QtGui import QImage

    overlay, picture = tmp_path / "Panel.qml", tmp_path / "view.png"
    overlay.write_text(
        "import QtQuick 2.15\nimport Ros 1.0\nRectangle { color: rviz.fixedFrame === 'odom' ? "
        '"#ff0000" : "#0000ff"\nComponent.onCompleted: { Ros.init("panel"); rviz.isBare = true } }'
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


def test_what_would_be_lost_is_asked_for(bench: SceneBench, tmp_path: Path) -> None:
    from rosglass.scene.program import ViewProgram

    view = bench.load()
    program = ViewProgram()
    program.begin(view)
    assert program.mayClose()
    view.scene.displays[0].cellSize = 2.0
    assert not program.mayClose()
    bench.wait(lambda: program.modified)
    program.save(str(tmp_path / "new.rviz"))
    assert program.mayClose()
    assert program.configName == "new.rviz"
    view.controller.set("Yaw", 0.1)
    assert program.mayClose(), "where the camera stands is no change"
    view.scene.add("Axes")
    assert not program.mayClose()
    program.open(str(tmp_path / "new.rviz"))
    assert [one.name for one in view.scene.displays] == ["Grid", "TF"]
    program.open(str(tmp_path / "none.rviz"))
    assert "there is no such file" in program.message


def test_reset_in_the_tool_bar_drops_what_was_received(bench: SceneBench) -> None:
    from PySide6.QtCore import QObject
    from PySide6.QtQml import QQmlApplicationEngine

    from rosglass.qml import install
    from rosglass.qt import send_deferred_deletes
    from rosglass.scene.program import WINDOW, ViewProgram

    engine, program = QQmlApplicationEngine(), ViewProgram()
    install(engine, bench.session)
    engine.rootContext().setContextProperty("program", program)
    engine.load(str(WINDOW))
    (window,) = engine.rootObjects()
    scene = window.findChild(QObject, "scene").scene
    path = scene.add("Path", topic="/plan")
    publisher = bench.robot.create_publisher("/plan", "nav_msgs/Path")

    def is_shown() -> bool:
        publisher.publish({"header": {"frame_id": scene.fixed_frame}})
        return bool(len(path.root))

    try:
        bench.wait(is_shown)
        window.findChild(QObject, "reset").clicked.emit()
        assert not len(path.root)
        bench.wait(is_shown)
    finally:
        window.close()
        engine.deleteLater()
        send_deferred_deletes()
