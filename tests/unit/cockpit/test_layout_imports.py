"""Layouts of Foxglove and configurations of RQml as layouts of the cockpit."""

from __future__ import annotations

import json
import random
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.cockpit.layout_imports import ImportedLayout, import_layout, is_foreign
from rosglass.cockpit.qml_document import Document
from rosglass.cockpit.qml_values import is_literal
from rosglass.errors import Error

if TYPE_CHECKING:
    from pathlib import Path


def foxglove(configs: dict[str, Any], layout: object, **more: object) -> dict[str, Any]:
    return {"configById": configs, "layout": layout, "playbackConfig": {"speed": 1}, **more}


@pytest.fixture
def read(tmp_path: Path) -> Any:
    """Imports a value as JSON, or a text."""

    def read(given: object, name: str = "desk.json", **plugins: str) -> ImportedLayout:
        file = tmp_path / name
        file.write_text(given if isinstance(given, str) else json.dumps(given))
        known = {key.replace("__", "."): value for key, value in plugins.items()}
        return import_layout(file, known)

    return read


def only(read: Any, name: str, config: dict[str, Any]) -> tuple[str, tuple[str, ...]]:
    """Return the control that a panel becomes, and what was left out."""
    found = read(foxglove({name: config}, name))
    (page,) = [one for one in Document(found.text).root.children if one.type == "Page"]
    control = page.children[0].children[0].text if page.children else ""
    return " ".join(control.split()), found.left_out


def test_foxglove_layout_keeps_places_shares_and_titles(read: Any) -> None:
    configs = {
        "Image!a": {"imageMode": {"imageTopic": "/camera/image"}, "foxglovePanelTitle": "Front"},
        "Plot!b": {"paths": [{"value": "/odom.twist.twist.linear.x", "enabled": True}]},
        "RosOut!c": {"minLogLevel": 3, "searchTerms": ["motor"]},
    }
    layout = {
        "direction": "row",
        "first": "Image!a",
        "second": {"direction": "column", "first": "Plot!b", "second": "RosOut!c"},
        "splitPercentage": 75,
    }
    found = read(foxglove(configs, layout))
    assert found.left_out == ()
    assert found.text == (
        "import QtQuick 2.15\nimport Ros2 1.0\nimport RosControls 1.0\nimport RosCockpit 1.0\n\n"
        'Cockpit {\n    title: "desk"\n    Page {\n        title: "desk"\n        Split {\n'
        '            Panel {\n                share: 3\n                title: "Front"\n'
        '                CameraView {\n                    topic: "/camera/image"\n'
        "                }\n            }\n"
        "            Split {\n                share: 1\n                orientation: Qt.Vertical\n"
        '                Panel {\n                    title: "Plot"\n                    Plot {\n'
        '                        paths: ["/odom:twist.twist.linear.x"]\n                    }\n'
        '                }\n                Panel {\n                    title: "Log view"\n'
        "                    LogView {\n                        minLevel: 2\n"
        '                        textFilter: "motor"\n                    }\n                }\n'
        "            }\n        }\n    }\n}\n"
    )


@pytest.mark.parametrize(
    ("name", "config", "expected"),
    [
        ("3D!x", {"followTf": "base_link"}, 'Scene.SceneView { fixedFrame: "base_link" }'),
        ("RawMessages!x", {"topicPath": "/odom"}, 'MessageView { topic: "/odom" }'),
        ("map!x", {"followTopic": "/fix"}, 'GeoMap { topic: "/fix" }'),
        ("map!x", {"followTopic": ""}, "GeoMap {}"),
        ("Parameters!x", {}, "ParameterForm {}"),
        ("DiagnosticSummary!x", {"topicToRender": "/diag"}, 'DiagnosticsView { topic: "/diag" }'),
        (
            "Publish!x",
            {"topicName": "/a", "datatype": "std_msgs/String", "value": "{}"},
            'PublishPanel { topic: "/a" type: "std_msgs/String" }',
        ),
        ("CallService!x", {"serviceName": "/reset"}, 'CallPanel { service: "/reset" }'),
        (
            "Gauge!x",
            {"path": "/b.percentage", "minValue": 0, "maxValue": 100.5},
            'Gauge { path: "/b:percentage" from: 0 to: 100.5 }',
        ),
        (
            "Indicator!x",
            {
                "path": "/t.data",
                "fallbackLabel": "cold",
                "rules": [{"operator": ">", "rawValue": "80", "label": "hot"}],
            },
            'Lamp { path: "/t:data" above: 80 onText: "hot" offText: "cold" }',
        ),
        (
            "Plot!x",
            {"paths": [{"value": "/j.position[:]"}], "minYValue": -1, "followingViewWidth": 30},
            'Plot { paths: ["/j:position[*]"] window: 30 leftMin: -1 }',
        ),
        ("TopicGraph!x", {}, "NodeGraph {}"),
    ],
)
def test_panels_of_foxglove(read: Any, name: str, config: dict[str, Any], expected: str) -> None:
    assert only(read, name, config) == (expected, ())


def test_teleop_of_foxglove_gets_a_command_of_its_own(read: Any) -> None:
    button = {"field": "linear-x", "value": 0.4}
    turn = {"field": "angular-z", "value": -1.5}
    config = {"topic": "/cmd_vel", "upButton": button, "leftButton": turn}
    layout = {"first": "Teleop!a", "second": "Teleop!b"}
    found = read(foxglove({"Teleop!a": config, "Teleop!b": {"topic": "/b/cmd_vel"}}, layout))
    root = Document(found.text).root
    assert [one.id for one in root.children[:2]] == ["command", "command2"]
    first = " ".join(root.children[0].text.split())
    assert first == 'TwistCommand { id: command topic: "/cmd_vel" maxSpeed: 0.4 maxTurn: 1.5 }'
    assert "command: command2" in found.text


def test_tabs_of_foxglove_are_pages_or_tabs(read: Any) -> None:
    tab = {
        "activeTabIdx": 1,
        "tabs": [
            {"title": "A", "layout": "Parameters!p"},
            {"title": "B", "layout": {"first": "RosOut!r", "second": "SourceInfo!s"}},
            {"title": "empty"},
        ],
    }
    whole = Document(read(foxglove({"Tab!t": tab}, "Tab!t")).text)
    assert [one.get("title").value for one in whole.root.children] == ["A", "B", "empty"]
    beside = {"first": "Tab!t", "second": "TopicGraph!g", "direction": "column"}
    found = read(foxglove({"Tab!t": tab}, beside))
    tabs = next(one for one in Document(found.text).objects() if one.type == "Tabs")
    assert [one.children[0].type for one in tabs.children] == [
        *("ParameterForm", "LogView", "TopicTree")
    ]
    assert tabs.get("currentIndex").value == 1
    assert [one.get("title").value for one in tabs.children] == ["A", "Log view", "Topic tree"]
    assert found.left_out == ("Tab 'B': its 2 panels are tabs of their own",)


def test_panels_without_a_counterpart_are_listed(read: Any) -> None:
    configs = {
        "Plot!a": {
            "title": "Speed",
            "paths": [{"value": "/a{id==1}.x"}, {"value": "/a.x.@abs"}, {"value": "/a.b"}],
        },
        "Audio!b": {},
        "Indicator!c": {"path": "/a.b", "rules": [{"operator": "=", "rawValue": "7"}] * 2},
        "Image!d": {"imageMode": {"imageTopic": "rtsp://elsewhere/stream"}},
    }
    layout: Any = "Plot!a"
    for name in ("Audio!b", "Indicator!c", "Image!d"):
        layout = {"first": layout, "second": name}
    found = read(foxglove(configs, layout, userNodes={"n": {}}))
    assert found.left_out == (
        "user scripts: they are not read",
        "Plot 'Speed': '/a{id==1}.x': filters in paths are not supported",
        "Plot 'Speed': '/a.x.@abs': functions in paths are not supported",
        "Audio: there is no such panel here",
        "Indicator: 2 of its 2 rules are not used",
        "Image: 'rtsp://elsewhere/stream' is not the name of a topic",
    )
    assert "rtsp" not in found.text


def container(vertical: bool, *children: tuple[str, float]) -> dict[str, Any]:
    return {
        "isContainer": True,
        "orientation": 2 if vertical else 1,
        "children": [
            {"isContainer": False, "guestId": key, "sizingInfo": {"percentageWithinParent": share}}
            for key, share in children
        ],
    }


def rqml(docks: dict[str, object], **more: Any) -> dict[str, Any]:
    return {
        "serializationVersion": 3,
        "allDockWidgets": [{"uniqueName": key, "context": one} for key, one in docks.items()],
        **more,
    }


def test_rqml_configuration_keeps_docks_tabs_and_contexts(read: Any) -> None:
    splitter = {
        "frames": {
            "1": {"dockWidgets": ["plugins.console.0"], "currentTabIndex": 0},
            "2": {"dockWidgets": ["plugins.image.0", "plugins.image.1"], "currentTabIndex": 1},
        },
        "layout": container(True, ("1", 0.25), ("2", 0.75)),
    }
    floating = {
        "geometry": {"x": 5, "y": -20, "width": 300, "height": 200},
        "multiSplitterLayout": {
            "frames": {"9": {"dockWidgets": ["plugins.tf.0"]}},
            "layout": container(False, ("9", 1)),
        },
    }
    docks = {
        "plugins.console.0": {"level": 2, "filters": ["a", {"b": None}]},
        "plugins.image.0": {},
        "plugins.image.1": {"topic": "/camera"},
        "plugins.tf.0": None,
        "plugins.rest.0": None,
    }
    given = rqml(docks, mainWindows=[{"multiSplitterLayout": splitter}], floatingWindows=[floating])
    found = read(given, "default.rqml", plugins__console="Console", plugins__rest="Rest")
    assert found.program == "RQml"
    assert found.left_out == (
        "plugins.image: this plugin is not installed here; its panel says so",
        "plugins.tf: this plugin is not installed here; its panel says so",
    )
    document = Document(found.text)
    page, window = document.root.children
    assert " ".join(window.text.split()) == (
        'PanelWindow { x: 5 y: -20 width: 300 height: 200 Panel { title: "Tf" '
        'Plugin { source: "plugins.tf" } } }'
    )
    outer = page.children[0]
    split, rest = outer.children
    assert split.get("share").value == 3
    assert rest.get("title").value == "Rest"
    console, tabs = split.children
    assert [one.get("share").value for one in split.children] == [1, 3]
    assert console.get("title").value == "Console"
    plugin = console.children[0]
    assert plugin.get("source").value == "plugins.console"
    assert plugin.get("context").value == docks["plugins.console.0"]
    assert tabs.get("currentIndex").value == 1


def test_rqml_configuration_in_yaml_is_read(read: Any) -> None:
    text = "allDockWidgets:\n  - uniqueName: plugins.tf.0\n    context: {frame: map}\n"
    found = read(text, "old.yaml", plugins__tf="Frames")
    assert 'source: "plugins.tf"' in found.text
    assert '({frame: "map"})' in found.text


@pytest.mark.parametrize(
    "name",
    ["../../evil/File.qml.0", "/etc/File.qml.0", "Evil.qml.0", "package://evil/File.0", "x", ".0"],
)
def test_a_plugin_is_never_a_file(read: Any, name: str) -> None:
    found = read(rqml({name: {}}), "evil.rqml")
    assert "Plugin" not in found.text
    assert "not the name of a plugin" in found.left_out[0]


EVIL = (
    '"; Component.onCompleted: Qt.quit() //',
    "'; }\n} Timer { running: true }",
    "\\",
    '\\"',
    "\u2028Item {}\u2029",
    "*/ Item {} /*",
    "${Qt.quit()}",
    "\ud800",
    "\x00\x1b[2J",
    '" + Qt.quit() + "',
    "`${1}`",
    "// }",
    "² : 1, a",
    "a²",
    "__proto__",
    "x" * 5000,
)


def attacked(value: object, random_: random.Random) -> Any:
    """Return a value in which texts, keys and numbers are replaced."""
    if isinstance(value, dict):
        return {
            (random_.choice(EVIL) if random_.random() < 0.1 else key): attacked(one, random_)
            for key, one in value.items()
        }
    if isinstance(value, list):
        return [attacked(one, random_) for one in value]
    if random_.random() < 0.6:
        more = (None, True, -1, 10**400, 1e308, float("nan"), [], {}, [[]], {"a": {"b": 1}})
        return random_.choice(EVIL) if random_.random() < 0.8 else random_.choice(more)
    return value


KINDS = (
    *("Image", "3D", "Plot", "RawMessages", "map", "StateTransitions", "Teleop", "Publish"),
    *("CallService", "Parameters", "DiagnosticSummary", "RosOut", "Gauge", "Indicator"),
)
EVERYTHING = {
    "foxglovePanelTitle": "t",
    "imageMode": {"imageTopic": "/a"},
    "followTf": "map",
    "topics": {"/a": {"visible": True}},
    "paths": [{"value": "/a.b"}],
    "topicPath": "/a.b",
    "followTopic": "/a",
    "topic": "/a",
    "upButton": {"field": "linear-x", "value": 1},
    "topicName": "/a",
    "datatype": "a/B",
    "value": "x",
    "serviceName": "/a",
    "path": "/a.b",
    "requestPayload": "x",
    "topicToRender": "/a",
    "hardwareIdFilter": "h",
    "minLogLevel": 2,
    "searchTerms": ["a"],
    "minValue": 0,
    "maxValue": 1,
    "fallbackLabel": "off",
    "rules": [{"operator": ">", "rawValue": "1", "label": "on"}],
}
KNOWN_TYPES = {
    *("Cockpit", "Page", "Split", "Tabs", "Panel", "PanelWindow", "Plugin", "TwistCommand"),
    *("CameraView", "Scene.SceneView", "Plot", "MessageView", "GeoMap", "DriveStick", "Lamp"),
    *("PublishPanel", "CallPanel", "ParameterForm", "DiagnosticsView", "LogView", "Gauge"),
}


def check_is_harmless(text: str) -> None:
    """Check that a layout has nothing but known objects with literals."""
    for found in Document(text).objects():
        assert found.type in KNOWN_TYPES
        for member in found.members:
            plain = member.kind == "id" or is_literal(member.text)
            command = found.type == "DriveStick" and member.name == "command"
            assert plain or command, member.text
            assert len(member.text) < 50_000


@pytest.mark.parametrize("seed", range(150))
def test_nothing_of_a_file_becomes_code(read: Any, seed: int) -> None:
    random_ = random.Random(seed)
    configs = {f"{kind}!x": dict(EVERYTHING) for kind in KINDS}
    layout: Any = "Image!x"
    for kind in KINDS[1:]:
        layout = {"direction": "row", "first": layout, "second": f"{kind}!x"}
    given = foxglove({name: attacked(one, random_) for name, one in configs.items()}, layout)
    splitter = {
        "frames": {"1": {"dockWidgets": ["a.b.0", random_.choice(EVIL)]}},
        "layout": container(False, ("1", 1)),
    }
    window = attacked({"x": 1, "y": 2, "width": 3, "height": 4}, random_)
    docks = {f"a.b.{at}": attacked(EVERYTHING, random_) for at in range(3)}
    docks[random_.choice(EVIL) + ".0"] = {}
    windows = [{"multiSplitterLayout": splitter, "geometry": window}]
    for value, name in (
        (given, "evil.json"),
        (rqml(docks, floatingWindows=windows), "evil.rqml"),
        (attacked(given, random_), "broken.json"),
        (attacked(rqml(docks, mainWindows=windows), random_), "broken.rqml"),
    ):
        try:
            found = read(value, name)
        except Error:
            if not name.startswith("broken"):
                raise
            continue
        check_is_harmless(found.text)
        assert all(len(line) < 1000 for line in found.left_out)


def test_keys_that_javascript_refuses_as_names_are_quoted(read: Any) -> None:
    text = read(rqml({"a.b.0": {"a²": 1, "b": 2}}), "a.rqml").text
    assert 'context: ({"a²": 1, b: 2})' in text


def test_evil_names_of_files_become_no_code(tmp_path: Path) -> None:
    file = tmp_path / '"; Component.onCompleted: Qt.quit(); x: ".json'
    file.write_text(json.dumps(foxglove({}, "Parameters!x")))
    check_is_harmless(import_layout(file).text)


@pytest.mark.parametrize(
    ("text", "name", "part"),
    [
        ('{"configById": {"a": ', "cut.json", "cut.json:1:22: this is not JSON"),
        ("[" * 200_000, "deep.json", "nested too deep"),
        ("[1, 2]", "list.json", "an object in braces; got [1, 2]"),
        ("{}", "other.json", "neither a layout of Foxglove"),
        ("a: [", "cut.yaml", "cut.yaml:"),
        ('{"keys": {}, "groups": {}}', "rqt.json", "perspectives of rqt are not read"),
        ("", "a.perspective", "New layout of what the robot offers"),
        ('{"configById": 3}', "a.json", "configById: expected an object"),
        ('{"configById": {}, "layout": 3}', "a.json", "layout: expected the name of a panel"),
        (
            '{"configById": {}, "layout": {"first": "a", "second": {"first": 1}}}',
            "a.json",
            "layout.second: expected the name of a panel, or a split with first and second",
        ),
        ('{"mainWindows": 1}', "a.rqml", "mainWindows: expected a list of objects"),
        ('{"mainWindows": [{}]}', "a.rqml", "mainWindows[0].multiSplitterLayout: expected"),
        ('{"allDockWidgets": [{}]}', "a.rqml", "allDockWidgets[0].uniqueName: expected a name"),
        ("1" * 10_000, "number.json", "this is not a layout"),
    ],
)
def test_wrong_files_are_refused_with_a_place(read: Any, text: str, name: str, part: str) -> None:
    with pytest.raises(Error) as caught:
        read(text, name)
    assert part in str(caught.value)
    assert name in str(caught.value)


def test_endless_and_huge_layouts_are_refused(read: Any) -> None:
    # A Tab in itself has its place once.
    loop = {"tabs": [{"title": "a", "layout": "Tab!t"}]}
    assert "second place" in read(foxglove({"Tab!t": loop}, "Tab!t")).left_out[0]
    layout: Any = "RosOut!x"
    for at in range(200):
        layout = {"first": layout, "second": f"RosOut!{at}"}
    with pytest.raises(Error, match="more than 64 splits in each other"):
        read(foxglove({}, layout))
    with pytest.raises(Error, match="more than 500 docks"):
        read(rqml({f"a.b.{at}": {} for at in range(600)}), "a.rqml")


def test_missing_and_binary_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(Error, match=r"no\.json cannot be read"):
        import_layout(tmp_path / "no.json")
    (tmp_path / "a.json").write_bytes(b"\x80abc")
    with pytest.raises(Error, match="not UTF-8"):
        import_layout(tmp_path / "a.json")
    assert is_foreign(tmp_path / "A.JSON")
    assert not is_foreign(tmp_path / "a.qml")
