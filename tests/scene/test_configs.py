"""RViz's config files in a view: what others have published, and what we write."""

from __future__ import annotations

import logging
import os
import random
import re
from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import yaml

from rosglass.errors import Error
from rosglass.qt import QtCore
from rosglass.scene.configs.rviz_config import RvizConfig

if TYPE_CHECKING:
    from collections.abc import Collection

    from conftest import SceneBench

FILES = sorted((Path(__file__).parents[1] / "unit/scene/rviz_configs").glob("*.rviz"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_published_configs_are_shown_and_come_back(
    bench: SceneBench, file: Path, tmp_path: Path
) -> None:
    view = bench.load()
    notes = view.load_config(file)
    before = RvizConfig.load(file)
    shown = [(one.name, one.enabled) for one in before.walk()]
    assert [(one.name, one.enabled) for one in view.scene.displays] == shown
    assert view.scene.fixed_frame == (before.fixed_frame.lstrip("/") or "map")
    bench.picture()
    assert view.problem == ""
    for note in notes:
        assert note.startswith(("display '", "tool '", "view ", "panels '", str(file))), note
    saved = tmp_path / "saved.rviz"
    view.save_config(saved)
    after = RvizConfig.load(saved)
    assert [(one.class_id, one.name, one.enabled) for one in after.walk()] == [
        (one.class_id, one.name, one.enabled) for one in before.walk()
    ]
    # Nothing that the file had is lost: neither displays, nor their settings, nor panels.
    for old, new in zip(before.walk(), after.walk(), strict=True):
        assert set(old.settings) <= set(new.settings), old.name
    assert after.panels == before.panels
    assert after.tools == before.tools
    # Loaded and saved once more, it is the same file.
    view.load_config(saved)
    view.save_config()
    assert RvizConfig.load(saved) == after


def test_settings_come_from_a_file_and_go_into_it(bench: SceneBench, tmp_path: Path) -> None:
    file = tmp_path / "grid.rviz"
    file.write_text(
        """
Visualization Manager:
  Class: ""
  Displays:
    - Class: rviz_default_plugins/Grid
      Name: Floor
      Enabled: true
      Cell Size: 2.5
      Color: 255; 0; 255
      Line Style: {Line Width: 0.05, Value: Billboards}
      Offset: {X: 1, Y: 2, Z: 3}
      Something New: 7
    - Class: rviz_default_plugins/Path
      Name: Plan
      Enabled: true
      Topic: {Value: /plan, Depth: 7, Reliability Policy: Reliable, Durability Policy: Volatile}
  Global Options: {Fixed Frame: odom, Background Color: 10; 20; 30}
  Views: {Current: {Class: rviz_default_plugins/TopDownOrtho, Scale: 42}}
"""
    )
    view = bench.load()
    assert view.load_config(file) == []
    grid, path = view.scene.displays
    assert (grid.name, grid.cellSize, grid.lineStyle, grid.lineWidth) == (
        "Floor",
        2.5,
        "Billboards",
        0.05,
    )
    assert (grid.color.name(), grid.offset.z()) == ("#ff00ff", 3)
    assert (path.topic, path.depth, path.reliability) == ("/plan", 7, "Reliable")
    assert (view.view, view.fixedFrame) == ("TopDownOrtho", "odom")
    assert tuple(bench.picture()[0, 0]) == (10, 20, 30)
    grid.cellSize = 3.0
    path.topic = "/other"
    view.save_config()
    saved = RvizConfig.load(file)
    floor, plan = (one.settings for one in saved.displays)
    assert floor["Cell Size"] == 3.0
    assert floor["Something New"] == 7
    assert floor["Line Style"] == {"Line Width": 0.05, "Value": "Billboards"}
    assert plan["Topic"]["Value"] == "/other"
    assert plan["Topic"]["Depth"] == 7
    assert saved.current_view is not None
    assert saved.current_view.settings["Scale"] == 42
    # RViz has no such policy; without one, rosglass takes it.
    path.reliability = "Best Available"
    view.save_config()
    view.load_config(file)
    path = view.scene.find("Plan")
    assert (path.reliability, path.durability) == ("Best Available", "Volatile")


def test_a_new_view_is_written_for_either_rviz(bench: SceneBench, tmp_path: Path) -> None:
    view = bench.load()
    view.scene.add("Grid")
    view.scene.add("MarkerArray" if "MarkerArray" in view.scene.TYPES else "Path", topic="/m")
    with pytest.raises(Error, match="no config file is loaded; say where to save it"):
        view.save_config()
    for ros, package in ((1, "rviz"), (2, "rviz_default_plugins")):
        config = view.collect_config(ros)
        assert [one.class_id.partition("/")[0] for one in config.displays] == [package] * 2
        file = tmp_path / f"new{ros}.rviz"
        config.save(file)
        assert view.load_config(file) == []
        assert view.scene.displays[1].topic == "/m"
        view.config = None


@pytest.mark.parametrize("ros", [1, 2])
def test_views_are_saved_for_the_rviz_of_the_file(
    bench: SceneBench, tmp_path: Path, ros: int
) -> None:
    view, file = bench.load(), tmp_path / "views.rviz"
    package = ("rviz", "rviz_default_plugins")[ros - 1]
    file.write_text(
        "Visualization Manager:\n  Displays: []\n"
        f"  Tools: [{{Class: {package}/Interact}}]\n"
        f"  Views: {{Current: {{Class: {package}/Orbit, Name: Mine, Distance: 7}}}}\n"
    )
    assert view.load_config(file) == []
    view.view = "TopDownOrtho"
    assert view.saveView("above") == ""
    view.save_config()
    found = RvizConfig.load(file)
    for one in (found.current_view, found.saved_views[0]):
        assert one is not None
        assert one.class_id == f"{package}/TopDownOrtho"
        assert one.settings["Value"] == f"TopDownOrtho ({package})"
    assert found.saved_views[0].name == "above"


def test_groups_hide_what_is_in_them(bench: SceneBench, tmp_path: Path) -> None:
    file = tmp_path / "groups.rviz"
    file.write_text(
        """
Visualization Manager:
  Displays:
    - Class: rviz_common/Group
      Name: Planner
      Enabled: false
      Displays:
        - {Class: rviz_default_plugins/Axes, Name: Inner, Enabled: true, Length: 2}
        - {Class: moveit/Trajectory, Name: Arm, Enabled: true, Speed: 3}
"""
    )
    view = bench.load()
    (note,) = view.load_config(file)
    assert note == "display 'Arm': rosglass has no moveit/Trajectory; it is kept as it is"
    group, axes, arm = view.scene.displays
    assert arm.statusLevel == "warn"
    assert (axes.enabled, axes.shown) == (True, False)

    def red() -> int:
        picture = bench.picture()
        return int(((picture[..., 0] > 80) & (picture[..., 1] == 0)).sum())

    assert red() == 0
    group.enabled = True
    assert axes.shown
    assert red() > 50
    view.save_config()
    (saved,) = RvizConfig.load(file).displays
    assert [one.class_id for one in saved.displays] == [
        "rviz_default_plugins/Axes",
        "moveit/Trajectory",
    ]
    assert saved.displays[1].settings["Speed"] == 3


def test_groups_in_groups_are_hidden_and_removed_with_them(
    bench: SceneBench, tmp_path: Path
) -> None:
    file = tmp_path / "nested.rviz"
    file.write_text(
        """
Visualization Manager:
  Displays:
    - Class: rviz_common/Group
      Name: Outer
      Enabled: true
      Displays:
        - Class: rviz_common/Group
          Name: Inner
          Enabled: true
          Displays:
            - {Class: rviz_default_plugins/Path, Name: Plan, Enabled: true, Topic: /plan}
    - {Class: rviz_default_plugins/Grid, Name: Floor, Enabled: true}
"""
    )
    view = bench.load()
    assert view.load_config(file) == []
    outer = view.scene.find("Outer")
    publisher = bench.publisher("/plan", "nav_msgs/Path")
    outer.enabled = False
    bench.wait(lambda: not publisher.subscription_count())
    outer.enabled = True
    bench.wait(publisher.subscription_count)
    view.scene.remove(outer)
    assert [one.name for one in view.scene.displays] == ["Floor"]
    assert view.load_config(file) == []
    assert len(view.scene.displays) == 4


@pytest.mark.parametrize(
    ("text", "error"),
    [("", "not an RViz config"), ("- a\n- b", "not an RViz config"), ("a: [", "expected")],
)
def test_invalid_config_changes_nothing(
    bench: SceneBench, tmp_path: Path, text: str, error: str
) -> None:
    file = tmp_path / "bad.rviz"
    file.write_text(text)
    view = bench.load("AxesDisplay {}")
    with pytest.raises(Error):
        view.load_config(file)
    assert len(view.scene.displays) == 1


def test_values_that_do_not_fit_are_named_and_the_rest_is_taken(
    bench: SceneBench, tmp_path: Path
) -> None:
    file = tmp_path / "values.rviz"
    file.write_text(
        """
Visualization Manager:
  Displays:
    - {Class: rviz/Grid, Name: A, Enabled: true, Cell Size: wide, Alpha: 0.25, Color: 1; 2}
"""
    )
    view = bench.load()
    notes: Any = view.load_config(file)
    assert len(notes) == 2
    assert "display 'A': Cell Size: expected a finite number, got" in "\n".join(notes)
    assert "Color: expected a colour, e.g. '255; 128; 0', got '1; 2'" in "\n".join(notes)
    assert view.scene.displays[0].alpha == 0.25


#: Settings that rviz 1.14 does not write: those of RViz 2, and the parts of settings that it leaves
#: out with the default choice.
NEWER = {
    "LaserScan": {"Min Intensity", "Max Intensity"},
    "Map": {"Update Topic", "Queue Size"},
    "PointCloud": {"Min Intensity", "Max Intensity"},
    "PointCloud2": {"Min Intensity", "Max Intensity"},
    "TF": {"Filter (whitelist)", "Filter (blacklist)"},
}


def test_panels_of_other_packages_are_named(bench: SceneBench, tmp_path: Path) -> None:
    file = tmp_path / "panels.rviz"
    panels = ["rviz_common/Displays", "nav2_rviz_plugins/Selector", "rviz/Time", "lab/Teleop"]
    rows = [{"Class": one, "Name": one, "topic": "/x"} for one in [*panels, "lab/Teleop"]]
    file.write_text(yaml.safe_dump({"Panels": rows, "Visualization Manager": {"Displays": []}}))
    view = bench.load()
    (note,) = view.load_config(file)
    assert note.startswith("panels 'nav2_rviz_plugins/Selector', 'lab/Teleop': rosglass has no")
    view.save_config()
    assert yaml.safe_load(file.read_text())["Panels"] == rows


def test_unsupported_settings_are_kept(bench: SceneBench, tmp_path: Path) -> None:
    file, again = tmp_path / "some.rviz", tmp_path / "again.rviz"
    view = {"Class": "some_lab/FancyView", "Name": "Current View", "Secret": 42,
            "Target Frame": "base_link", "Distance": 3}  # fmt: skip
    displays = [
        {"Class": "rviz/PointCloud2", "Name": "all", "Topic": "/c", "Queue Size": 0},
        {"Class": "rviz/PointCloud2", "Name": "many", "Topic": "/c", "Queue Size": 100_000},
        {
            "Class": "rviz_default_plugins/Path",
            "Name": "deep",
            "Topic": {"Value": "/p", "Depth": 0},
        },
        {"Class": "rviz/Grid", "Name": "odd", "Cell Size": -4, "Plane": "AB"},
    ]
    manager = {"Displays": displays, "Views": {"Current": view}}
    file.write_text(yaml.safe_dump({"Visualization Manager": manager}))
    shown = bench.load()
    notes = shown.load_config(file)
    assert any("view some_lab/FancyView: rosglass has none" in note for note in notes)
    shown.controller.set("Yaw", 1.0)
    shown.save_config(again)

    def saved() -> tuple[Any, ...]:
        manager = yaml.safe_load(again.read_text())["Visualization Manager"]
        return manager["Views"]["Current"], {one["Name"]: one for one in manager["Displays"]}

    current, kept = saved()
    assert current == view
    assert (kept["all"]["Queue Size"], kept["many"]["Queue Size"]) == (0, 100_000)
    assert kept["deep"]["Queue Size"] == 0
    assert (kept["odd"]["Cell Size"], kept["odd"]["Plane"]) == (-4, "AB")
    # What the user chooses is written.
    for name in ("all", "many", "deep"):
        shown.scene.find(name).depth = 7
    shown.scene.find("odd").cellSize = 2.0
    shown.select_view("TopDownOrtho")
    shown.save_config(again)
    current, kept = saved()
    assert current["Class"].endswith("/TopDownOrtho")
    assert kept["all"]["Queue Size"] == kept["many"]["Queue Size"] == 7
    assert kept["deep"]["Queue Size"] == 7
    assert (kept["odd"]["Cell Size"], kept["odd"]["Plane"]) == (2, "AB")


def test_displays_of_hector_rviz_plugins_say_what_replaces_them(
    bench: SceneBench, tmp_path: Path
) -> None:
    instead = {
        "GraphDisplay": "MarkerArray",
        "MultiRobotModel": "add a RobotModel with a TF Prefix",
        "MultiRobotState": "nothing replaces it",
        "PointCloudFilter": "filter the cloud on the robot",
        "PointCloudNormal": "publish the normals as markers",
    }
    displays = [{"Class": f"hector_rviz_plugins/{name}", "Name": name} for name in instead]
    file = tmp_path / "hector.rviz"
    config = {"Visualization Manager": {"Class": "", "Displays": displays}}
    file.write_text(yaml.safe_dump(config))
    view = bench.load()
    view.load_config(file)
    for display, text in zip(view.scene.displays, instead.values(), strict=True):
        assert text in display.statusText, display.name
    view.save_config()
    assert [one.class_id for one in RvizConfig.load(file).walk()] == [
        f"hector_rviz_plugins/{name}" for name in instead
    ]


def test_settings_have_the_names_that_rviz_writes(bench: SceneBench) -> None:
    (file,) = (file for file in FILES if file.stem == "ros1_all_displays")
    before = RvizConfig.load(file)
    view = bench.load()
    view.load_config(file)
    added = {}
    for old, new in zip(before.walk(), view.collect_config(1).walk(), strict=True):
        names = set(new.settings) - set(old.settings) - NEWER.get(old.type, set())
        if names:
            added[old.type] = names
    assert added == {}


def test_a_depth_cloud_keeps_a_topic_that_is_not_its_own(bench: SceneBench) -> None:
    display = bench.load().scene.add("DepthCloud")
    saved = {"Depth Map Topic": "/depth", "Topic": "mine"}
    assert display.load_settings(saved) == []
    assert display.topic == "/depth"
    kept = display.save_settings(saved)
    assert (kept["Depth Map Topic"], kept["Topic"]) == ("/depth", "mine")


# -- files with random changes ---------------------------------------------------------------------

#: Changed files of each public one; CHANGED_CONFIGS=50 for a search by hand.
CHANGED_COUNT = int(os.environ.get("CHANGED_CONFIGS", "1"))
SEED = os.environ.get("HOSTILE_SEED", "1")
#: Values of another type, and those that are wrong for most settings.
VALUES: list[Any] = [
    None, True, 0, -1, 1e308, float("inf"), float("nan"), 2**63, 10**400, "", "~", "nan", "a; b",
    "1e999", "1; 2; 3", "300; -1; 0", "x" * 10_000, "ü\u202e\n", "/", "rviz/Grid", "Rviz",
    [], [1], ["x"] * 3, {}, {"Value": True}, {"X": "a"}, {"Class": "rviz/Grid"},
]  # fmt: skip


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of everything in a tree."""
    inner: Any = value.items() if isinstance(value, dict) else ()
    if isinstance(value, list):
        inner = enumerate(value)
    return [path, *(one for key, part in inner for one in places(part, (*path, key)))]


def with_changes(tree: Any, rng: random.Random) -> Any:
    """Return a tree with random changes."""
    tree = deepcopy(tree)
    for _ in range(rng.choice([1, 3, 10, 40])):
        found = places(tree)[1:]
        if not found:
            break
        path, holder = rng.choice(found), tree
        for key in path[:-1]:
            holder = holder[key]
        how = rng.random()
        if how < 0.15:
            del holder[path[-1]]
        elif how < 0.3 and isinstance(holder, list):
            holder.insert(path[-1], deepcopy(rng.choice(holder)))
        elif how < 0.4 and isinstance(holder, dict):
            holder[rng.choice(["Unknown", "Value", "Class", "Topic"])] = holder[path[-1]]
        else:
            holder[path[-1]] = deepcopy(rng.choice(VALUES))
    return tree


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_files_with_random_changes_are_shown_or_refused_and_come_back(
    bench: SceneBench, file: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    view, changed, saved = bench.load(), tmp_path / "changed.rviz", tmp_path / "saved.rviz"
    rng = random.Random(f"{SEED} {file.stem}")
    tree = yaml.safe_load(file.read_text())
    messages: list[str] = []
    handler = QtCore.qInstallMessageHandler(lambda _kind, _about, text: messages.append(text))
    try:
        for _ in range(CHANGED_COUNT):
            changed.write_text(yaml.safe_dump(with_changes(tree, rng)))
            before = None
            with suppress(Error):
                before = RvizConfig.load(changed)
            if before is None:
                with pytest.raises(Error, match=re.escape(str(changed))):
                    view.load_config(changed)
                continue
            view.load_config(changed)
            bench.picture()
            view.save_config(saved)
            check_kept(before, RvizConfig.load(saved), view.scene.TYPES)
            # Loaded and saved once more, it is the same file.
            first = RvizConfig.load(saved)
            view.load_config(saved)
            view.save_config()
            assert RvizConfig.load(saved) == first
            assert view.problem == ""
            errors = [one for one in caplog.records if one.levelno >= logging.ERROR]
            assert not errors, errors[0].getMessage() + str(errors[0].exc_info)
            assert not [one for one in messages if "pipewire" not in one], messages
    finally:
        QtCore.qInstallMessageHandler(handler)


#: Keys of each display.
OWN = {"Class", "Displays", "Enabled", "Name", "Value"}


def check_kept(before: RvizConfig, after: RvizConfig, known: Collection[str]) -> None:
    """Check that what rosglass does not know is as it was; it knows displays of these names."""
    assert after.panels == before.panels
    old, new = list(before.walk()), list(after.walk())
    # Classes of the other RViz get the names that the file's has.
    assert [(one.type or one.class_id, one.name, one.enabled) for one in new] == [
        (one.type or one.class_id, one.name or "Unknown", one.enabled) for one in old
    ]
    for one, other in zip(old, new, strict=True):
        assert set(one.settings) <= set(other.settings), one.name
        is_known = one.type or one.class_id in known
        unknown = {"Unknown"} if is_known else set(one.settings) - OWN
        for key in unknown & set(one.settings):
            assert repr(one.settings[key]) == repr(other.settings[key]), (one.name, key)


def test_files_with_random_letters_are_shown_or_refused(bench: SceneBench, tmp_path: Path) -> None:
    view, changed = bench.load(), tmp_path / "changed.rviz"
    rng = random.Random(SEED)
    for number in range(20 * CHANGED_COUNT):
        text = FILES[number % len(FILES)].read_text()
        for _ in range(rng.choice([1, 5, 50])):
            at = rng.randrange(len(text))
            new = rng.choice(
                ["", ":", "-", "\n", "\t", "{", "[", '"', "&a ", "*a", "!!x ", "\0", "é"]
            )
            text = text[:at] + new + text[at + rng.choice([0, 1, 10]) :]
        changed.write_text(text)
        refused = ""
        try:
            view.load_config(changed)
        except Error as error:
            refused = str(error)
        assert not refused or str(changed) in refused
        assert view.problem == ""
