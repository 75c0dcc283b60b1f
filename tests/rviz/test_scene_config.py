"""The scene's config files in RViz: it finds in them what it finds in the originals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from rosglass.scene.configs.rviz_config import DisplayConfig, RvizConfig, ToolConfig, ViewConfig
from rosglass.scene.configs.rviz_formats import DISPLAYS, TOOLS, VIEWS

FOLDER = Path(__file__).parents[1] / "unit" / "scene" / "rviz_configs"
DOCKED = ("rviz/Camera", "rviz/Image")


def saved_by_rviz(app: Any, file: Path, saved: Path) -> Any:
    """Return what RViz saves after it has loaded a file."""
    app.load_config(file)
    app.save_config(saved)
    root = yaml.load(saved.read_text(), yaml.BaseLoader)
    # RViz moves and sizes its window a little.
    del root["Window Geometry"]
    return root


def without_images(file: Path, copy: Path) -> None:
    """Copy a file without displays that have docked panels.

    RViz enables them as their panels were before, and may crash when it removes a Camera display
    together with those that it shows.
    """
    root = yaml.load(file.read_text(), yaml.BaseLoader)
    displays = root["Visualization Manager"]["Displays"]
    displays[:] = [display for display in displays if display["Class"] not in DOCKED]
    copy.write_text(yaml.dump(root, sort_keys=False))


@pytest.mark.parametrize("file", sorted(FOLDER.glob("ros1_*.rviz")), ids=lambda file: file.stem)
def test_rviz_loads_what_was_saved(app: Any, file: Path, tmp_path: Path) -> None:
    original, ours = tmp_path / "original.rviz", tmp_path / "ours.rviz"
    without_images(file, original)
    config = RvizConfig.load(file)
    config.displays[:] = [display for display in config.displays if display.class_id not in DOCKED]
    config.save(ours)
    expected = saved_by_rviz(app, original, tmp_path / "expected.rviz")
    assert saved_by_rviz(app, ours, tmp_path / "found.rviz") == expected
    # And the other way round: what RViz has saved is read, classes included that it does not know.
    again = RvizConfig.load(tmp_path / "found.rviz")
    assert (again.ros, again.warnings) == (1, [])
    again.save(tmp_path / "again.rviz")
    assert saved_by_rviz(app, tmp_path / "again.rviz", tmp_path / "found.rviz") == expected
    given = [(display.class_id, display.name) for display in config.walk()]
    assert [(display.class_id, display.name) for display in again.walk()] == given


def test_rviz_loads_a_new_config(app: Any, tmp_path: Path) -> None:
    new = RvizConfig(1)
    new.fixed_frame, new.options["Frame Rate"] = "odom", 20
    ids = {name: ids[0] for name, ids in DISPLAYS.items() if ids[0] and ids[0] not in DOCKED}
    new.displays.extend(DisplayConfig.new(name, 1, enabled=False) for name in ids)
    new.tools.extend(ToolConfig.new(name, 1) for name, ids in TOOLS.items() if ids[0])
    new.current_view = ViewConfig.new("TopDownOrtho", 1, settings={"Scale": 42})
    new.saved_views.extend(ViewConfig.new(name, 1, name=name) for name in VIEWS)
    new.save(tmp_path / "new.rviz")
    app.load_config(tmp_path / "new.rviz")
    displays = app.rviz.displays.all
    assert [display.name for display in displays] == list(ids)
    assert [display.class_id for display in displays] == list(ids.values())
    assert [display.name for display in displays if display.status.level == "error"] == []
    assert [tool.class_id for tool in app.rviz.tools.all] == [
        ids[0] for ids in TOOLS.values() if ids[0]
    ]
    assert app.rviz.views.kind == "rviz/TopDownOrtho"
    assert app.rviz.views.saved == list(VIEWS)
    assert app.fixed_frame == "odom"
    assert app.rviz.displays.get("Global Options/Frame Rate") == 20


def test_the_classes_are_those_of_rviz(app: Any) -> None:
    tables = ((DISPLAYS, app.rviz.displays), (TOOLS, app.rviz.tools))
    for table, known in tables:
        ours = {ids[0] for ids in table.values() if ids[0]} - {"rviz/Group"}
        theirs = {class_id for class_id in known.classes if class_id.startswith("rviz/")}
        assert ours == theirs - {"rviz/Group"}
    assert {ids[0] for ids in VIEWS.values()} == {
        kind for kind in app.rviz.views.kinds if kind.startswith("rviz/")
    }
