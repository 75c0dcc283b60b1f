"""RViz configs: what is read from them, what is written, and what bad files get."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

from rosglass.comm.qos import Durability, QoS, Reliability
from rosglass.errors import Error
from rosglass.scene.configs.rviz_config import DisplayConfig, RvizConfig, ToolConfig, ViewConfig
from rosglass.scene.configs.rviz_formats import (
    DescriptionSetting,
    TopicSetting,
    display_type,
    read_bool,
    read_choice,
    read_color,
    read_description,
    read_deviations,
    read_marker_namespace,
    read_number,
    read_topic,
    read_vector,
    tool_type,
    view_type,
    write_color,
    write_description,
    write_deviations,
    write_marker_namespace,
    write_topic,
)

FOLDER = Path(__file__).parent / "rviz_configs"
FILES = sorted(FOLDER.glob("*.rviz"))

#: The classes in RViz 1.14's plugin_description.xml, and of RViz itself.
ROS1_DISPLAYS = (
    "AccelStamped Axes Camera DepthCloud Effort FluidPressure Grid GridCells Group Illuminance"
    " Image InteractiveMarkers LaserScan Map Marker MarkerArray Odometry Path PointCloud"
    " PointCloud2 PointStamped Polygon Pose PoseArray PoseWithCovariance Range RelativeHumidity"
    " RobotModel TF Temperature TwistStamped WrenchStamped"
)
#: The classes in rviz_default_plugins' plugins_description.xml.
ROS2_DISPLAYS = (
    "AccelStamped Axes Camera CameraInfo DepthCloud Effort FluidPressure Grid GridCells"
    " Illuminance Image InteractiveMarkers LaserScan Map Marker MarkerArray Odometry Path"
    " PointCloud PointCloud2 PointStamped Polygon Pose PoseArray PoseWithCovariance Range"
    " RelativeHumidity RobotModel TF Temperature TwistStamped Wrench"
)
TOOLS = "FocusCamera Interact Measure MoveCamera PublishPoint Select SetGoal SetInitialPose"
VIEWS = "FPS FrameAligned Orbit ThirdPersonFollower TopDownOrtho XYOrbit"


def config(body: str) -> RvizConfig:
    return RvizConfig.parse(f"Visualization Manager:\n{body}", "robot.rviz")


def load(name: str) -> RvizConfig:
    return RvizConfig.load(FOLDER / f"{name}.rviz")


def find(config: RvizConfig, name: str) -> DisplayConfig:
    return next(display for display in config.walk() if display.name == name)


def texts(text: str) -> Any:
    """Return a file as RViz reads it: all values are texts."""
    root = yaml.load(text, yaml.BaseLoader)
    views = root["Visualization Manager"]["Views"]
    # RViz writes an empty list as ~, and reads both alike.
    views["Saved"] = views.get("Saved") if isinstance(views.get("Saved"), list) else []
    return root


def keys(value: Any) -> Any:
    """Return the order of all keys in a tree."""
    if isinstance(value, dict):
        return [(key, keys(inner)) for key, inner in value.items()]
    return [keys(inner) for inner in value] if isinstance(value, list) else None


# -- public files ----------------------------------------------------------------------------------


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_nothing_of_a_public_file_is_lost(file: Path, tmp_path: Path) -> None:
    found = RvizConfig.load(file)
    assert found.warnings == []
    assert found.ros == int(file.name[3])
    found.save(tmp_path / "saved.rviz")
    again = RvizConfig.load(tmp_path / "saved.rviz")
    assert again == found
    before, after = texts(file.read_text()), texts((tmp_path / "saved.rviz").read_text())
    before["Visualization Manager"].setdefault("Tools", [])
    assert after == before
    if "Saved" in file.read_text():
        assert keys(after) == keys(before)


def test_data_has_both_formats() -> None:
    assert len(FILES) >= 15
    assert {file.name[:4] for file in FILES} == {"ros1", "ros2"}


def test_nav2_config() -> None:
    nav2 = load("ros2_nav2")
    assert (nav2.ros, nav2.fixed_frame, nav2.options["Frame Rate"]) == (2, "map", 30)
    assert nav2.background_color == pytest.approx((48 / 255, 48 / 255, 48 / 255, 1))
    top = [(display.type, display.name) for display in nav2.displays]
    assert top[:3] == [("Grid", "Grid"), ("RobotModel", "RobotModel"), ("TF", "TF")]
    assert [name for found, name in top if found == "Group"] == [
        "Global Planner",
        "Controller",
        "Realsense",
    ]
    planner, realsense = find(nav2, "Global Planner"), find(nav2, "Realsense")
    assert [display.name for display in planner.displays] == [
        "Global Costmap",
        "Downsampled Costmap",
        "Path",
        "VoxelGrid",
        "Polygon",
    ]
    assert (planner.enabled, realsense.enabled) == (True, False)
    assert not find(nav2, "RobotModel").enabled
    assert find(nav2, "LaserScan").settings["Size (m)"] == 0.009999999776482582
    costmap = find(nav2, "Global Costmap").settings
    topic = TopicSetting("map", 1, "Reliable", "Transient Local", "Keep Last", 10)
    assert read_topic(costmap) == topic._replace(name="global_costmap/costmap")
    assert read_topic(costmap, "Update Topic").durability == "Volatile"
    assert [tool.type for tool in nav2.tools][-2:] == ["PublishPoint", "GoalTool"]
    assert read_deviations(nav2.tools[4].settings) == pytest.approx((0.5, 0.5, math.pi / 12))
    view = nav2.current_view
    assert view is not None
    assert (view.type, view.settings["Scale"]) == ("TopDownOrtho", 54)
    assert nav2.saved_views == []
    assert nav2.panels[-1] == {"Class": "nav2_rviz_plugins/Docking", "Name": "Docking"}


def test_config_of_ros_1_with_groups_in_groups() -> None:
    husky = load("ros1_husky")
    names = [display.name for display in husky.walk()]
    at = names.index("Navigation")
    assert names[at : at + 5] == [
        "Navigation",
        "Exploration",
        "Exploration Marker",
        "Exploration Costmap",
        "Static Map",
    ]
    imu = find(husky, "Imu")
    assert (imu.class_id, imu.type, imu.is_group) == ("rviz_imu_plugin/Imu", "", False)
    assert imu.settings["Box properties"]["x_scale"] == 0.4
    assert read_topic(find(husky, "LaserScan").settings) == TopicSetting("/scan", 10)
    marker = find(husky, "Exploration Marker").settings
    assert read_topic(marker) == TopicSetting("/exploration_polygon_marker", 100)
    assert read_marker_namespace(find(husky, "TwistMarker").settings) == "/twist_marker_server"
    assert read_description(find(husky, "RobotModel").settings) == DescriptionSetting(
        "parameter", "robot_description"
    )
    assert read_number(find(husky, "LaserScan").settings["Min Intensity"]) == -1.83101e-36


def test_every_display_and_view_of_ros_1() -> None:
    found = load("ros1_all_displays")
    types = {display.type for display in found.walk()}
    assert types == set(ROS1_DISPLAYS.split()) - {
        "AccelStamped",
        "DepthCloud",
        "Effort",
        "TwistStamped",
    }
    assert [view.type for view in found.saved_views] == [view.name for view in found.saved_views]
    assert read_topic(find(found, "Camera").settings) == TopicSetting("some/topic/camera", 2)


def test_names_that_look_like_numbers_are_kept() -> None:
    submaps = find(load("ros2_cartographer"), "SubmapsDisplay").settings["Submaps"]
    names = list(submaps["Trajectory 0"])
    assert {"0.60", "1.60", "10.60"} < set(names)
    assert find(load("ros2_cartographer"), "Constraints").settings["Namespaces"][
        "Inter constraints, same trajectory"
    ]


def test_settings_that_a_file_leaves_out() -> None:
    found = load("ros2_urdf_tutorial")
    assert [display.enabled for display in found.displays] == [True] * 3
    description = read_description(found.displays[1].settings)
    assert description == DescriptionSetting(
        "topic", "/robot_description", TopicSetting("/robot_description")
    )
    plain = find(load("ros2_marker_tutorial"), "Marker").settings
    assert read_topic(plain) == TopicSetting("/visualization_marker", 10)


# -- classes ---------------------------------------------------------------------------------------


def test_types_of_all_classes() -> None:
    for name in ROS1_DISPLAYS.split():
        assert display_type(f"rviz/{name}") == name
    for name in ROS2_DISPLAYS.split():
        expected = "WrenchStamped" if name == "Wrench" else name
        assert display_type(f"rviz_default_plugins/{name}") == expected
    for package in ("rviz", "rviz_default_plugins"):
        assert [tool_type(f"{package}/{name}") for name in TOOLS.split()] == TOOLS.split()
        assert [view_type(f"{package}/{name}") for name in VIEWS.split()] == VIEWS.split()
    assert display_type("rviz_common/Group") == "Group"
    assert tool_type("nav2_rviz_plugins/GoalTool") == "GoalTool"
    # As the first releases of RViz 2 had it.
    assert display_type("rviz_default_plugins/WrenchStamped") == "WrenchStamped"


@pytest.mark.parametrize("class_id", ["", "Grid", "other/Grid", "rviz/Orbit", "rviz/", "rviz"])
def test_other_classes_have_no_type(class_id: str) -> None:
    assert display_type(class_id) == ""


def test_new_entries_have_the_classes_of_their_rviz() -> None:
    wrench = [DisplayConfig.new("WrenchStamped", ros).class_id for ros in (1, 2)]
    assert wrench == ["rviz/WrenchStamped", "rviz_default_plugins/Wrench"]
    assert DisplayConfig.new("Group", 2).settings == {
        "Class": "rviz_common/Group",
        "Displays": [],
        "Enabled": True,
        "Name": "Group",
    }
    assert DisplayConfig.new("my_plugins/Radar", 2).class_id == "my_plugins/Radar"
    assert ToolConfig.new("SetGoal", 1).class_id == "rviz/SetGoal"
    assert ViewConfig.new("Orbit", 2).settings["Value"] == "Orbit (rviz_default_plugins)"
    with pytest.raises(Error, match="RViz 1 has no class CameraInfo, only RViz 2 has"):
        DisplayConfig.new("CameraInfo", 1)
    with pytest.raises(Error, match="no class 'PointClout2'; did you mean PointCloud2"):
        DisplayConfig.new("PointClout2")
    with pytest.raises(Error, match="must be 1 or 2, got 3"):
        ToolConfig.new("SetGoal", 3)


# -- writing ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("ros", [1, 2])
def test_new_config(ros: int, tmp_path: Path) -> None:
    new = RvizConfig(ros)
    new.fixed_frame, new.background_color = "odom", (1, 0.5, 0)
    group = DisplayConfig.new("Group", ros, name="Sensors")
    scan = DisplayConfig.new("LaserScan", ros, enabled=False)
    write_topic(scan.settings, TopicSetting("/scan", 5, "Best Effort"), ros)
    group.displays.append(scan)
    new.displays.append(group)
    new.tools.append(ToolConfig.new("Interact", ros))
    new.current_view = ViewConfig.new("Orbit", ros, settings={"Distance": 10})
    new.saved_views.append(ViewConfig.new("FPS", ros, name="1.10"))
    new.save(tmp_path / "new.rviz")
    found = RvizConfig.load(tmp_path / "new.rviz")
    assert found == new
    assert (found.fixed_frame, found.options["Background Color"]) == ("odom", "255; 128; 0")
    assert find(found, "LaserScan").enabled is False
    assert read_topic(find(found, "LaserScan").settings)[:3] == ("/scan", 5, "Best Effort")
    assert found.saved_views[0].name == "1.10"
    assert ("Transformation" in found.manager) == (ros == 2)


def test_changes_are_written_in_the_format_of_the_file() -> None:
    found = load("ros1_husky")
    find(found, "Navigation").enabled = True
    find(found, "Sensing").displays.insert(0, DisplayConfig.new("Axes", found.ros))
    marker = find(found, "Exploration Marker")
    marker.enabled = False
    marker.name = "Goals"
    write_topic(marker.settings, TopicSetting("/goals", 3), found.ros)
    again = RvizConfig.parse(found.dump())
    assert again == found
    assert find(again, "Navigation").enabled
    assert "Value" not in find(again, "Navigation").settings
    assert find(again, "Sensing").displays[0].class_id == "rviz/Axes"
    goals = find(again, "Goals").settings
    assert (goals["Enabled"], goals["Value"]) == (False, False)
    assert (goals["Marker Topic"], goals["Queue Size"]) == ("/goals", 3)
    assert "Topic" not in goals


@pytest.mark.parametrize(
    "value",
    [
        "",
        "~",
        "null",
        "yes",
        "off",
        "True",
        "true",
        "1",
        "-3",
        "007",
        "0x1F",
        "1_000",
        "12:30",
        "2024-01-02",
        "1.10",
        "0.5",
        "1e-05",
        "1e5",
        ".nan",
        "nan",
        "a: b",
        "# a",
        "- a",
        "*a",
        "&a",
        "!a",
        "a\nb\n",
        "<<",
        "'",
        '"',
        "λ",
        "\x07\u2028",
        "x" * 500 + " " + "y" * 500,
    ],
)
def test_texts_stay_texts(value: str) -> None:
    new = RvizConfig()
    new.displays.append(DisplayConfig.new("Grid", name="a", settings={"T": value, value: 1}))
    text = new.dump()
    found = RvizConfig.parse(text).displays[0].settings
    assert (found["T"], found[value]) == (value, 1)
    # Other readers of YAML agree.
    other = yaml.safe_load(text)["Visualization Manager"]["Displays"][0]
    assert other["T"] == value


@pytest.mark.parametrize(
    "text",
    ["1.10", "0.50", "1.", "007", "-0", "+5", "1e5", "2.2e-7", "yes", "True", "0x1F", "1:30"],
)
def test_unquoted_texts_are_written_as_they_were_read(text: str) -> None:
    found = config(f"  Displays:\n    - {{Class: rviz/Grid, Name: {text}, V: {text}}}\n")
    assert found.displays[0].name == text
    assert found.displays[0].settings["V"] == text
    assert RvizConfig.parse(found.dump()) == found
    assert texts(found.dump())["Visualization Manager"]["Displays"][0]["V"] == text


def test_order_of_keys_is_kept() -> None:
    text = (
        "Window Geometry:\n  Y: 1\n  X: 2\n"
        "Visualization Manager:\n"
        "  Tools: []\n"
        "  Displays:\n    - Name: a\n      Class: rviz/Grid\n      Alpha: 1\n"
        "  Views:\n    Saved: []\n    Current:\n      Yaw: 1\n      Class: rviz/Orbit\n"
        "  Global Options: {}\n"
    )
    assert RvizConfig.parse(text).dump() == text


@pytest.mark.parametrize(
    "value", [True, False, None, 0, -5, 10**12, 0.0, -0.5, 1e-5, 1e22, 0.029999999329447746, [], {}]
)
def test_values_keep_their_types(value: object) -> None:
    new = RvizConfig()
    new.displays.append(DisplayConfig.new("Grid", settings={"V": value}))
    found = RvizConfig.parse(new.dump()).displays[0].settings["V"]
    assert (type(found), found) == (type(value), value)


@pytest.mark.parametrize(
    ("value", "fault"),
    [
        (math.nan, "Displays/My Grid/Offset/X: nan cannot be saved"),
        (math.inf, "Displays/My Grid/Offset/X: inf cannot be saved"),
        (b"bytes", "X: b'bytes' cannot be saved"),
        ({1: 2}, "X: a key must be a text, got 1"),
    ],
)
def test_value_that_rviz_cannot_read_is_not_saved(
    value: object, fault: str, tmp_path: Path
) -> None:
    new = RvizConfig()
    offset = {"Offset": {"X": value}}
    new.displays.append(DisplayConfig.new("Grid", name="My Grid", settings=offset))
    file = tmp_path / "kept.rviz"
    file.write_text("old")
    with pytest.raises(Error, match=fault):
        new.save(file)
    assert file.read_text() == "old"


def test_group_in_itself_is_not_saved() -> None:
    new = RvizConfig()
    group = DisplayConfig.new("Group")
    group.displays.append(group)
    new.displays.append(group)
    with pytest.raises(Error, match="more than 100 levels"):
        new.dump()


def test_folder_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(Error, match=r"none/a\.rviz cannot be written: No such file"):
        RvizConfig().save(tmp_path / "none" / "a.rviz")


# -- bad files -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "robot.rviz: the file is empty"),
        ("[1, 2]", "robot.rviz:1: the file must be a mapping"),
        ("a: 1\n", "robot.rviz:1: this is not an RViz config: 'Visualization Manager' is missing"),
        ("Visualization Manager: 3", "robot.rviz:1: Visualization Manager must be a mapping"),
        ("Visualization Manager:\n  Displays: 3", "robot.rviz:2: Displays must be a list"),
        ("Visualization Manager:\n  Displays: {a: 1}", "robot.rviz:2: Displays must be a list"),
        ("Visualization Manager:\n  Tools: x", "robot.rviz:2: Tools must be a list"),
        ("Visualization Manager:\n  Views: []", "robot.rviz:2: Views must be a mapping"),
        ("Visualization Manager:\n  Global Options: 1", "robot.rviz:2: Global Options must be a"),
        ("Visualization Manager:\n  [a]: 1", "robot.rviz:2: .*a key must be a text"),
        ("a: [1\nb: 2", "robot.rviz:2:2: this is not a valid RViz config"),
        ("a: b: c", "robot.rviz:1:5: this is not a valid RViz config"),
        ("--- 1\n--- 2\n", "robot.rviz:2:1: this is not a valid RViz config"),
        ("a: &x [*x]", "robot.rviz:1:8: .*it contains itself"),
        ("a: *b", "robot.rviz:1:4: .*undefined alias"),
        ("".join(f"{' ' * level}a:\n" for level in range(200)), "more than 100 levels"),
        ("[" * 100_000 + "]" * 100_000, "maximum nesting depth|more than 100 levels"),
        ("a: \x00", "this is not a valid RViz config"),
    ],
)
def test_files_that_cannot_be_read(text: str, fault: str) -> None:
    with pytest.raises(Error, match=fault):
        RvizConfig.parse(text, "robot.rviz")


def test_small_texts_that_expand() -> None:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 12)]
    start = time.monotonic()
    with pytest.raises(Error, match=r"robot.rviz:\d+:\d+: .* more than 200000 values"):
        RvizConfig.parse("\n".join(lines), "robot.rviz")
    assert time.monotonic() - start < 5


def test_aliases_become_values_of_their_own() -> None:
    found = config("  Displays:\n    - &a {Class: rviz/Grid, Offset: {X: 1}}\n    - *a\n")
    found.displays[0].settings["Offset"]["X"] = 2
    assert found.displays[1].settings["Offset"]["X"] == 1
    assert "&" not in found.dump()


def test_single_displays_that_are_broken() -> None:
    found = config(
        "  Displays:\n"
        "    - 3\n"
        "    - {Name: nameless}\n"
        "    - {Class: rviz/Grid, Name: fine, Alpha: 1, Alpha: 0.5}\n"
        "    - {Class: rviz/Group, Name: group, Displays: 7}\n"
        "    - ~\n"
        "    - {Class: a/B, Displays: {x: 1}}\n"
        "  Views: {Current: 4}\n"
        "  Global Options: {Background Color: blue, Frame Rate: .nan}\n"
    )
    assert [display.name for display in found.displays] == ["nameless", "fine", "group", "a/B"]
    options = "robot.rviz: Global Options"
    assert found.warnings == [
        "robot.rviz:3: Displays: expected a mapping with a Class; this entry is left out",
        "robot.rviz:4: Displays: the entry 'nameless' has no Class",
        "robot.rviz:5: Displays: 'Alpha' occurs twice; the last one counts",
        "robot.rviz:6: Displays: expected a list of mappings; the group is empty",
        "robot.rviz:7: Displays: expected a mapping with a Class; this entry is left out",
        "robot.rviz:9: Current: expected a mapping with a Class; this entry is left out",
        f"{options}: Background Color: expected a colour, e.g. '255; 128; 0', got 'blue'",
        f"{options}: Frame Rate: expected a finite number, got '.nan'",
    ]
    assert [display.line for display in found.displays] == [4, 5, 6, 8]
    assert find(found, "fine").settings["Alpha"] == 0.5
    assert found.current_view is None
    # What is not understood is kept.
    assert found.displays[-1].settings["Displays"] == {"x": 1}
    assert RvizConfig.parse(found.dump()) == found


def test_warnings_have_a_limit() -> None:
    found = config("  Displays:\n" + "    - {}\n" * 5000)
    assert len(found.displays) == 5000
    assert len(found.warnings) == 101
    assert found.warnings[-1] == "robot.rviz: and 4900 more"


def test_files_that_are_too_large_or_no_files(tmp_path: Path) -> None:
    file = tmp_path / "big.rviz"
    file.write_bytes(b"#" * 5_000_001)
    with pytest.raises(Error, match=r"big\.rviz: more than 5000000 bytes"):
        RvizConfig.load(file)
    with pytest.raises(Error, match="more than 5000000 characters"):
        RvizConfig.parse("#" * 5_000_001)
    (tmp_path / "latin.rviz").write_bytes(b"a: 1\nb: \xe4")
    with pytest.raises(Error, match=r"latin\.rviz:2: this is not UTF-8"):
        RvizConfig.load(tmp_path / "latin.rviz")
    for path in (tmp_path, tmp_path / "none.rviz", "/dev/zero"):
        with pytest.raises(Error, match="there is no such file"):
            RvizConfig.load(path)
    os.mkfifo(tmp_path / "pipe.rviz")
    with pytest.raises(Error, match="there is no such file"):
        RvizConfig.load(tmp_path / "pipe.rviz")
    for bad in ("a\0b", 3):
        with pytest.raises(Error, match=r"not a valid path|no such file"):
            RvizConfig.load(bad)  # type: ignore[arg-type]


# -- values ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("255; 128; 0", (255, 128, 0)),
        (" 1;2 ; 3", (1, 2, 3)),
        ("300; -1; 7", (255, 0, 7)),
        ("#ff8000", (255, 128, 0)),
        ("#F80", (255, 136, 0)),
    ],
)
def test_colors(value: str, expected: tuple[int, ...]) -> None:
    found = read_color(value)
    assert [round(part * 255) for part in found[:3]] == list(expected)
    assert found[3] == 1
    assert write_color(found) == "; ".join(map(str, expected))


@pytest.mark.parametrize(
    "value",
    [None, 3, "", "1; 2", "1; 2; 3; 4", "1; 2; x", "#12", "#1234567", "9" * 9999, "²; 1; 1", {}],
)
def test_invalid_colors_are_rejected(value: object) -> None:
    with pytest.raises(Error, match=r"Color: expected a colour, e\.g\. '255; 128; 0', got"):
        read_color(value)


def test_colors_that_cannot_be_written() -> None:
    for bad in ((1, 2, 3), (0, 0, math.nan), (0, 0)):
        with pytest.raises(Error, match="Max Color: "):
            write_color(bad, "Max Color")


def test_vectors() -> None:
    assert read_vector({"X": 1, "Y": "2.50", "Z": 3e-5}) == (1, 2.5, 3e-5)
    assert read_vector({"X": 0, "Y": 0, "Z": 0, "W": 1}, "Rotation", "XYZW") == (0, 0, 0, 1)
    with pytest.raises(Error, match=r"Offset: expected a mapping of X, Y, Z, got {.X.: 1}"):
        read_vector({"X": 1}, "Offset")
    with pytest.raises(Error, match="Offset/Y: expected a finite number, got 'nan'"):
        read_vector({"X": 1, "Y": "nan", "Z": 0}, "Offset")


def test_numbers() -> None:
    assert [read_number(value) for value in (1, 0.5, "2", "-1e5", " 0.50 ", "+3")] == [
        1,
        0.5,
        2,
        -1e5,
        0.5,
        3,
    ]
    bads: list[Any] = [None, True, "", "x", "nan", "inf", "1e999", math.nan, [], {}, 10**400]
    for bad in [*bads, "9" * 5000]:
        with pytest.raises(Error, match="Alpha: expected a finite number, got"):
            read_number(bad, "Alpha")
    with pytest.raises(Error, match="Alpha: expected at least 0, got -1"):
        read_number(-1, "Alpha", minimum=0)
    with pytest.raises(Error, match="Alpha: expected at most 1, got '2'"):
        read_number("2", "Alpha", maximum=1)


def test_bools_and_choices() -> None:
    assert [read_bool(value) for value in (True, "True", 1, "0", 0, "false", False)] == [
        True,
        True,
        True,
        False,
        False,
        False,
        False,
    ]
    for bad in (None, "yes", 2, {}, []):
        with pytest.raises(Error, match="Enabled: expected true or false, got"):
            read_bool(bad, "Enabled")
    assert read_choice("Best effort", ["Reliable", "Best Effort"]) == "Best Effort"
    with pytest.raises(Error, match="Style: expected one of Points, Boxes, got 'Point'; did you"):
        read_choice("Point", ["Points", "Boxes"], "Style")


# -- topics and what else differs between the formats ----------------------------------------------


def test_topics_of_both_formats() -> None:
    assert read_topic({"Topic": "/a", "Queue Size": 5, "Unreliable": True}) == TopicSetting(
        "/a", 5, "Best Effort"
    )
    # RViz 1 writes false by itself: a best-effort publisher of ROS 2 is received all the same.
    assert read_topic({"Topic": "/a", "Unreliable": False}) == TopicSetting("/a")
    assert read_topic({"Image Topic": "/a"}) == read_topic({"Topic": {"Value": "/a"}})
    assert read_topic({}) == read_topic({"Topic": None}) == TopicSetting("")
    assert read_topic({"Topic": 5}).name == "5"
    found = read_topic({"T": {"Value": "/a", "Reliability Policy": "Best effort"}}, "T")
    assert found.reliability == "Best Effort"


@pytest.mark.parametrize(
    ("settings", "fault"),
    [
        ({"Topic": ["/a"]}, "Topic: expected a topic, got \\['/a'\\]"),
        ({"Topic": {"Value": {}}}, "Topic/Value: expected a topic"),
        ({"Topic": {"Depth": "x"}}, "Topic/Depth: expected a finite number, got 'x'"),
        ({"Topic": {"Depth": -1}}, "Topic/Depth: expected at least 0"),
        ({"Topic": {"Depth": 1.5}}, "Topic/Depth: expected a whole number"),
        ({"Topic": {"Depth": 2**40}}, "Topic/Depth: expected at most"),
        ({"Topic": {"History Policy": "All"}}, "Topic/History Policy: expected one of Keep Last"),
        ({"Marker Topic": "/a", "Queue Size": "many"}, "Queue Size: expected a finite number"),
        ({"Topic": "/a", "Unreliable": "perhaps"}, "Unreliable: expected true or false"),
    ],
)
def test_topics_that_are_not_valid(settings: dict[str, Any], fault: str) -> None:
    with pytest.raises(Error, match=fault):
        read_topic(settings)


def test_topic_that_is_changed_keeps_the_rest() -> None:
    settings: dict[str, Any] = {"Topic": {"Depth": 7, "Value": "/a", "Filter size": 3}}
    write_topic(settings, TopicSetting("/b", durability="Transient Local"), 2)
    assert settings == {
        "Topic": {
            "Depth": 7,
            "Value": "/b",
            "Filter size": 3,
            "Durability Policy": "Transient Local",
        }
    }
    image: dict[str, Any] = {"Class": "rviz/Image"}
    write_topic(image, TopicSetting("/b"), 1)
    assert image == {"Class": "rviz/Image", "Image Topic": "/b"}


def test_qos_of_a_topic() -> None:
    assert TopicSetting("/a").qos(QoS(depth=3)) == QoS(depth=3)
    found = TopicSetting("/a", 5, "Best Effort", "Transient Local", "System Default").qos()
    assert (found.depth, found.reliability) == (5, Reliability.BEST_EFFORT)
    assert found.durability is Durability.TRANSIENT_LOCAL


def test_robot_descriptions() -> None:
    for ros, source in ((1, "parameter"), (2, "topic"), (2, "file")):
        settings: dict[str, Any] = {}
        given = DescriptionSetting(source, "robot", None)
        write_description(settings, given, ros)
        assert read_description(settings)[:2] == (source, "robot")
    effort = {"Class": "rviz_default_plugins/Effort", "Robot Description": "/robot_description"}
    assert read_description(effort).source == "topic"
    with pytest.raises(Error, match="RViz 1 reads a parameter, no topic /a"):
        write_description({}, DescriptionSetting("topic", "/a"), 1)
    with pytest.raises(Error, match="RViz 2 reads a topic or a file, no parameter a"):
        write_description({}, DescriptionSetting("parameter", "a"), 2)
    with pytest.raises(Error, match="Description Source: expected one of Topic, File"):
        read_description({"Description Source": "Web"})


def test_servers_of_interactive_markers() -> None:
    for ros in (1, 2):
        settings: dict[str, Any] = {}
        write_marker_namespace(settings, "/arm", ros)
        assert read_marker_namespace(settings) == "/arm"
    assert settings == {"Interactive Markers Namespace": "/arm"}
    assert read_marker_namespace({}) == ""


def test_deviations_of_the_initial_pose() -> None:
    assert read_deviations({}) == pytest.approx((0.5, 0.5, math.pi / 12))
    for ros in (1, 2):
        settings: dict[str, Any] = {}
        write_deviations(settings, (0.1, 0.2, 0.3), ros)
        assert read_deviations(settings) == pytest.approx((0.1, 0.2, 0.3))
    assert settings["Covariance y"] == pytest.approx(0.04)
    with pytest.raises(Error, match="Covariance x: expected at least 0"):
        read_deviations({"Covariance x": -1})
