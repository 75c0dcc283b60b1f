"""The catalogue of panels."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import rosglass
from rosglass.cockpit import panels
from rosglass.cockpit.panel_properties import KINDS, heading_of, properties_of
from rosglass.errors import Error

MODULE = Path(rosglass.__file__).parent / "controls/imports/RosControls"
#: Types of RosControls that only other controls use.
PARTS = {"FocusRing", "LiveFrame", "PathDrop", "Theme", "MessageForm"}
CATALOGUE = {panel.name: panel for panel in panels.controls()}


def property_of(panel: str, name: str) -> Any:
    found = CATALOGUE[panel].property(name)
    assert found is not None, f"{panel} has no {name}"
    return found


def test_every_control_is_a_panel_or_a_part() -> None:
    files = {file.stem for file in MODULE.glob("*.qml") if not file.stem.startswith("Theme")}
    parts = PARTS | {name for name in files if name.startswith("Map")} - {"MapView"}
    assert files - parts == CATALOGUE.keys() - {"SceneView"}


@pytest.mark.parametrize("panel", CATALOGUE.values(), ids=lambda panel: panel.name)
def test_panel_is_described(panel: Any) -> None:
    assert panel.group in panels.GROUPS
    assert panel.line.endswith((".", ":"))
    assert re.match(rf"(Scene\.)?{panel.name} {{", panel.snippet)
    assert (Path("docs") / panel.page.replace(".html", ".md")).is_file()
    for one in panel.properties:
        assert one.kind in KINDS
        assert one.line, f"{panel.name}.{one.name} has no comment"
        assert not one.name.endswith("_")


def test_properties_have_types_units_ranges_and_choices() -> None:
    low = property_of("Battery", "low")
    assert (low.kind, low.default, low.low, low.high) == ("number", "0.3", 0, 1)
    assert property_of("CameraView", "timeout").unit == "ms"
    assert property_of("CameraView", "imageRotation").choices == ("0", "90", "180", "270")
    assert property_of("Attitude", "convention").choices == ("ENU", "NED")
    assert property_of("Plot", "window").unit == "s"
    assert property_of("Plot", "leftLog").kind == "bool"
    assert property_of("MapView", "goalAction").kind == "action"
    assert property_of("MapView", "robotFrame").kind == "frame"
    assert property_of("CameraView", "maxRate").kind in ("number", "integer")
    assert property_of("Gauge", "path").kind == "path"
    assert property_of("ParameterForm", "nodeName").kind == "node"
    assert property_of("Battery", "topic").types == ("sensor_msgs/msg/BatteryState",)
    assert property_of("EmergencyStop", "counterTopic").types == ("std_msgs/msg/UInt32",)
    assert property_of("SceneView", "fixedFrame").kind == "frame"
    assert property_of("SceneView", "background").kind == "color"
    assert property_of("Battery", "title").line == "Text of the title."


@pytest.mark.parametrize("name", panels._STATES)
def test_states_that_are_left_out_exist(name: str) -> None:
    text = (MODULE / f"{name}.qml").read_text()
    assert [one for one in panels._STATES[name] if f" {one}" not in text] == []
    assert not [one for one in CATALOGUE[name].properties if one.name in panels._STATES[name]]


def test_a_comment_ends_at_an_empty_line() -> None:
    text = """// Shows a thing. More.
Item {
    // Metres.
    property real near: 0.5
    property real far

    property bool plain
    property string inner_
    readonly property int count: 3
    property string mode: "a" // "a" or "b".
    Item {
        property int nested
    }
}
"""
    found = {one.name: one for one in properties_of(text)}
    assert list(found) == ["near", "far", "plain", "mode"]
    assert (found["far"].unit, found["plain"].line) == ("m", "")
    assert found["mode"].choices == ("a", "b")
    assert heading_of(text) == "Shows a thing."


def test_values_are_set_in_a_snippet() -> None:
    gauge = CATALOGUE["Gauge"]
    assert gauge.with_values(path='"/a:b"') == 'Gauge {\n    path: "/a:b"\n    to: 1\n}'
    assert CATALOGUE["Battery"].with_values(topic='"/b"') == 'Battery { topic: "/b" }'
    assert CATALOGUE["Battery"].with_values() == "Battery {}"


# -- panels of a folder --


def test_panels_of_a_folder(tmp_path: Path) -> None:
    (tmp_path / "Arm.qml").write_text(
        "// The arm, of sensor_msgs/JointState.\nimport QtQuick 2.15\nItem {\n"
        "    // Degrees.\n    property real limit: 3\n}\n"
    )
    (tmp_path / "small.qml").write_text("Item {}")
    (tmp_path / "Broken.qml").write_bytes(b"\xff\xfe\xff")
    (tmp_path / "Empty.qml").write_text("")
    found = {panel.name: panel for panel in panels.folder_panels(tmp_path)}
    assert found["Arm"].line == "The arm, of sensor_msgs/JointState."
    assert found["Arm"].imports == (f'"{tmp_path.as_uri()}"',)
    assert found["Arm"].properties[0].unit == "°"
    assert "capital" in found["small"].problem
    assert str(tmp_path / "Broken.qml") in found["Broken"].problem
    assert found["Empty"].problem == ""
    made = panels.propose({"/joints": ["sensor_msgs/msg/JointState"]}, found.values())
    assert [one.panel.name for one in made] == ["Arm"]


def test_a_folder_that_cannot_be_read_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(Error, match=re.escape(str(tmp_path / "none"))):
        panels.folder_panels(tmp_path / "none")


# -- searching --


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("bat", "Battery"),
        ("batery", "Battery"),
        ("batttery", "Battery"),
        ("btatery", "Battery"),
        ("camraview", "CameraView"),
        ("stick", "DriveStick"),
        ("drivestik", "DriveStick"),
        ("joystik", None),
        ("emergency", "EmergencyStop"),
        ("emergancy", "EmergencyStop"),
        ("diagnotics", "DiagnosticsView"),
        ("horizon", "Attitude"),
        ("paramter", "ParameterForm"),
    ],
)
def test_search_forgives_typos(text: str, first: str | None) -> None:
    names = list(CATALOGUE)
    found = panels.search(text, names, [CATALOGUE[name].line for name in names])
    assert [names[at] for at in found[:1]] == ([first] if first else [])


def test_search_forgives_typos_in_parts_of_topics() -> None:
    names = ["/robot1/camera/image_raw", "/robot1/battery_state", "/cmd_vel"]
    for text, found in (("imgae_raw", 0), ("batery", 1), ("cmdvle", 2), ("robto1", 0)):
        assert panels.search(text, names)[0] == found


def test_search_finds_all_for_no_text_and_nothing_for_nonsense() -> None:
    names = list(CATALOGUE)
    assert len(panels.search(" ", names)) == len(names)
    assert panels.search("qqqqqqq", names) == []
    assert panels.search("x" * 100_000, names) == []


# -- proposing --

ROBOT = {
    "/camera/image": ["sensor_msgs/msg/Image"],
    "/camera/image/compressed": ["sensor_msgs/msg/CompressedImage"],
    "/camera/camera_info": ["sensor_msgs/msg/CameraInfo"],
    "/cmd_vel": ["geometry_msgs/msg/Twist"],
    "/emergency_stop": ["std_msgs/msg/Bool"],
    "/emergency_stop/state": ["std_msgs/msg/Bool"],
    "/map": ["nav_msgs/msg/OccupancyGrid"],
    "/local_costmap/costmap": ["nav_msgs/msg/OccupancyGrid"],
    "/battery_state": ["sensor_msgs/msg/BatteryState"],
    "/diagnostics": ["diagnostic_msgs/msg/DiagnosticArray"],
    "/odom": ["nav_msgs/msg/Odometry"],
    "/rosout": ["rcl_interfaces/msg/Log"],
    "/tf": ["tf2_msgs/msg/TFMessage"],
    "/_action/feedback": ["sensor_msgs/msg/Image"],
}


def test_proposals_for_a_robot() -> None:
    made = panels.propose(ROBOT)
    assert [(one.panel.name, one.topic) for one in made] == [
        ("CameraView", "/camera/image"),
        ("DriveStick", "/cmd_vel"),
        ("EmergencyStop", "/emergency_stop"),
        ("MapView", "/map"),
        ("Battery", "/battery_state"),
        ("AlarmList", "/diagnostics"),
        ("Speed", "/odom"),
        ("LogView", ""),
        ("TfTree", ""),
    ]
    assert made[0].snippet == 'CameraView { topic: "/camera/image" }'
    assert made[0].reason == "/camera/image (sensor_msgs/Image)"


def test_the_first_of_each_kind_come_first() -> None:
    topics = {f"/camera{at}/image": ["sensor_msgs/msg/Image"] for at in range(20)}
    made = panels.propose({**topics, **ROBOT})
    names = [one.panel.name for one in made]
    assert names[:3] == ["CameraView", "DriveStick", "EmergencyStop"]
    assert names.count("CameraView") == 8
    assert len({one.topic for one in made if one.topic}) == len([one for one in made if one.topic])


def test_names_of_topics_are_quoted() -> None:
    made = panels.propose({'/a"\n\\': ["sensor_msgs/msg/BatteryState"]})
    assert made[0].snippet == r'Battery { topic: "/a\"\u000a\\" }'


def test_2000_topics_are_looked_at_once_each() -> None:
    class Counting(dict[str, list[str]]):
        looked = 0

        def __getitem__(self, name: str) -> list[str]:
            Counting.looked += 1
            return super().__getitem__(name)

    kinds = [kinds[0] for kinds in ROBOT.values()]
    topics = Counting({f"/robot{at}/t": [kinds[at % len(kinds)]] for at in range(2000)})
    assert len(panels.propose(topics)) < 100
    assert Counting.looked == 2000
