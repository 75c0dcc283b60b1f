"""Plugins of RQml, written to its interface, in the element ``Plugin``."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from inside import root_of
from local_world import LocalWorld

from rosglass.qml import Session
from rosglass.qt import QT6

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rosglass.qml.run.runner import Runner

PLUGINS = Path(__file__).with_name("rqml_plugins")
QML = PLUGINS / "qml"
only_qt6 = pytest.mark.skipif(not QT6, reason="plugins of RQml need Qt 6")
LAYOUT = """import QtQuick 2.15
import Ros2 1.0
import RosCockpit 1.0

Cockpit {
    property var edits: []
    property Item plugin: Plugin {
        id: one
        PLUGIN
        onContextEdited: edits = edits.concat(contextText())
    }
    property Item neighbour: Item {
        property int ticks: 0
        Timer { interval: 10; running: true; repeat: true; onTriggered: parent.ticks++ }
    }
    Page { Split { Panel { children: one } Panel { children: neighbour } } }
    OTHER
}
"""


class PluginBench:
    """A layout with a plugin, shown by ``rosglass run``.

    Attributes:
        root: The layout's Cockpit.
        plugin: Its Plugin.
        session: The node.
    """

    def __init__(self, wait: Any, folder: Path) -> None:
        self.wait, self.folder = wait, folder
        self.world = LocalWorld()
        self.robot: Any = self.world.connect(None, "robot")
        self.session = Session(connect=self.world.connect)
        self.runner: Runner | None = None

    def show(self, plugin: str, other: str = "") -> Any:
        """Show a plugin by its properties; return the Plugin once it is no longer waiting."""
        from rosglass.qml.run.runner import Runner

        file = self.folder / "layout.qml"
        file.write_text(LAYOUT.replace("PLUGIN", plugin).replace("OTHER", other))
        self.runner = Runner(file, self.session)
        self.runner.load()
        self.root: Any = root_of(self.runner)
        self.plugin = self.root.property("plugin")
        self.wait(lambda: self.plugin.property("status") != "waiting")
        return self.plugin

    @property
    def shown(self) -> Any:
        """The root item of the plugin."""
        from rosglass.cockpit.plugin_loader import PluginLoader

        (loader,) = self.plugin.findChildren(PluginLoader)
        (item,) = loader.childItems()
        around = item.metaObject().className().startswith("MaterialLook")
        return item.childItems()[0] if around else item

    def api(self, name: str, *given: str) -> Any:
        """Return the result of a function of ``RQml``."""
        return as_json(self.shown.api(name, list(given)))

    def find(self, name: str) -> Any:
        """Return an object of the plugin by its ``objectName``."""
        from rosglass.qt import QtCore

        return self.shown.findChild(QtCore.QObject, name)

    def value(self, name: str) -> Any:
        """Return a property of the plugin's root as JSON does it."""
        return as_json(self.shown.property(name))

    def close(self) -> None:
        from rosglass.qt import send_deferred_deletes

        if self.runner is not None:
            self.runner.close()
        self.session.close()
        send_deferred_deletes()


def as_json(value: Any) -> Any:
    return value.toVariant() if hasattr(value, "toVariant") else value


def source(name: str) -> str:
    return f'source: "{QML / name}"'


@pytest.fixture
def bench(app: Any, tmp_path: Path, wait: Callable[..., None]) -> Iterator[PluginBench]:
    made = PluginBench(wait, tmp_path)
    yield made
    made.close()


@pytest.mark.both_qt
@pytest.mark.skipif(QT6, reason="Qt 6 shows plugins")
def test_qt5_says_that_plugins_need_qt6(bench: PluginBench) -> None:
    plugin = bench.show(source("Counter.qml"))
    assert plugin.property("status") == "failed"
    assert "need Qt 6" in plugin.property("problem")


@only_qt6
def test_a_plugin_has_context_name_size_and_colours(bench: PluginBench) -> None:
    bench.robot.create_publisher("/scan", "sensor_msgs/msg/LaserScan")
    plugin = bench.show(f'{source("Counter.qml")}; context: ({{ count: 3 }}); uniqueName: "left"')
    assert plugin.property("status") == "ready", plugin.property("problem")
    assert (bench.value("shown"), bench.value("before"), bench.value("name")) == (3, 3, "left")
    assert bench.value("inner").property("text") == "count 3 of left"
    # It asks for topics once, when it is loaded: the graph is known by then.
    assert "/scan" in bench.value("topicsAtStart")
    size = plugin.property("kddockwidgets_min_size")
    assert (size.width(), size.height()) == (500, 120)
    # A narrower panel scrolls.
    assert bench.shown.width() >= 500
    assert bench.value("background").name() == "#0e151d"  # the theme's panel
    assert (plugin.property("complaints"), plugin.property("file")) == (0, str(QML / "Counter.qml"))


@only_qt6
def test_a_plugin_waits_for_the_nodes_of_the_robot(bench: PluginBench) -> None:
    bench.robot.close()

    def start() -> None:
        bench.robot = bench.world.connect(None, "robot")
        bench.robot.create_publisher("/scan", "sensor_msgs/msg/LaserScan")

    late = threading.Timer(2, start)
    late.start()
    bench.show(source("Counter.qml"))
    late.join()
    assert "/scan" in bench.value("topicsAtStart")


@only_qt6
def test_any_key_can_be_read_and_written(bench: PluginBench) -> None:
    bench.show(source("Counter.qml"))
    assert bench.value("shown") == "none"
    bench.shown.write("count", 4)
    assert bench.value("shown") == 4  # bindings are notified
    bench.wait(lambda: as_json(bench.root.property("edits")))
    assert as_json(bench.root.property("edits")) == ["({ count: 4 })"]


@only_qt6
@pytest.mark.parametrize(
    ("value", "text"),
    [
        ('"a \\"b\\""', '({ key: "a \\"b\\"" })'),
        ("[1, [true, null], {}]", "({ key: [1, [true, null], {}] })"),
        ('{"x y": 1, default: -0.5}', '({ key: { "x y": 1, "default": -0.5 } })'),
        ("NaN", "({ key: NaN })"),
        ("undefined", "({})"),
        ("new Date(0)", '({ key: "1970-01-01T00:00:00.000Z" })'),
        (
            "Ros2.createEmptyMessage('geometry_msgs/msg/Point')",
            '({ key: { "#messageType": "geometry_msgs/msg/Point", x: 0, y: 0, z: 0 } })',
        ),
        ("[" + "1234567, " * 12 + "]", None),
    ],
)
def test_the_context_is_saved_as_qml(bench: PluginBench, value: str, text: str | None) -> None:
    plugin = bench.show(
        source("Counter.qml"),
        f"function value() {{ return {value} }}",
    )
    bench.shown.write("key", bench.root.value())
    got = plugin.contextText()
    if text is None:
        assert got.count("\n") == 15  # a long list has a line for each element
    else:
        assert got == text
    # What is saved is what is loaded.
    engine: Any = bench.runner.engine if bench.runner is not None else None
    plugin.setProperty("context", engine.evaluate(got))
    assert plugin.contextText() == got


@only_qt6
def test_changes_inside_objects_are_in_the_text(bench: PluginBench) -> None:
    plugin = bench.show(f"{source('Counter.qml')}; context: ({{ limits: {{ max: 1 }} }})")
    bench.shown.change()
    assert plugin.contextText() == "({ limits: { max: 5 } })"


@only_qt6
def test_items_and_functions_are_named_as_not_saved(bench: PluginBench) -> None:
    plugin = bench.show(source("Counter.qml"))
    bench.shown.write("item", bench.shown)
    bench.shown.write("count", 1)
    assert plugin.contextText() == "({ count: 1 })"
    assert "not saved: context.item" in plugin.property("complaint")


@only_qt6
def test_undo_in_the_layout_reaches_the_plugin(bench: PluginBench) -> None:
    plugin = bench.show(f"{source('Counter.qml')}; context: ({{ count: 1, other: 2 }})")
    shown = bench.shown
    engine: Any = bench.runner.engine if bench.runner is not None else None
    plugin.setProperty("context", engine.evaluate("({ count: 7 })"))
    assert (bench.shown is shown, bench.value("shown")) == (True, 7)
    assert plugin.contextText() == "({ count: 7 })"
    assert as_json(bench.root.property("edits")) == []  # it was not the plugin's


@only_qt6
def test_a_plugin_is_found_by_its_id(
    bench: PluginBench, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    share = tmp_path / "share"
    (share / "robot_panels").mkdir(parents=True)
    (share / "robot_panels/qml").symlink_to(QML)
    resources = share / "ament_index/resource_index/rqml_plugin"
    resources.mkdir(parents=True)
    text = (PLUGINS / "rqml_plugins.yaml.in").read_text()
    (resources / "robot_panels").write_text(text.replace("@PROJECT_NAME@", "robot_panels"))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    plugin = bench.show('source: "robot_panels.counter"')
    assert plugin.property("status") == "ready", plugin.property("problem")
    plugin.setProperty("source", "robot_panels.gone")
    bench.wait(lambda: plugin.property("status") == "failed")
    assert "robot_panels.counter, robot_panels.elements" in plugin.property("problem")


@only_qt6
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Compiled.qml", "needs the compiled QML module Robot.CompiledPanels"),
        ("Wrong.qml", "Wrong.qml:4:"),
        ("NotAnItem.qml", "its root is not an Item"),
        ("Gone.qml", "there is no such file"),
    ],
)
def test_failure_to_load_is_said_on_its_panel(bench: PluginBench, name: str, said: str) -> None:
    plugin = bench.show(source(name))
    assert plugin.property("status") == "failed"
    assert said in plugin.property("problem")
    assert str(QML / name) in plugin.property("problem")
    # Another one takes its place.
    plugin.setProperty("source", str(QML / "Counter.qml"))
    bench.wait(lambda: plugin.property("status") == "ready")
    assert plugin.property("problem") == ""


@only_qt6
def test_errors_of_a_plugin_are_said_on_its_panel(bench: PluginBench) -> None:
    other = (
        f"property Item second: Plugin {{ {source('Counter.qml')} }}\n Item {{ children: second }}"
    )
    plugin = bench.show(source("Throws.qml"), other)
    assert plugin.property("status") == "ready"
    assert "Throws.qml:5: ReferenceError: noSuchFunction" in plugin.property("complaint")
    bench.shown.later()
    bench.wait(lambda: plugin.property("complaints") == 2)
    assert "Throws.qml:7: TypeError" in plugin.property("complaint")
    second = bench.root.property("second")
    bench.wait(lambda: second.property("status") == "ready")
    assert second.property("complaints") == 0  # it is another plugin of the same folder


@only_qt6
@pytest.mark.parametrize("name", ["Loops.qml", "LoopsAtStart.qml"])
def test_a_plugin_that_loops_is_stopped_and_the_rest_lives(bench: PluginBench, name: str) -> None:
    bench.session.longest_script = 0.3
    plugin = bench.show(source(name))
    bench.wait(lambda: plugin.property("status") == "stopped")
    assert name in plugin.property("problem")
    neighbour = bench.root.property("neighbour")
    before = neighbour.property("ticks")
    bench.wait(lambda: neighbour.property("ticks") > before + 3)
    engine: Any = bench.runner.engine if bench.runner is not None else None
    plugin.setProperty("context", engine.evaluate("({ loop: false })"))
    plugin.setProperty("source", str(QML / "Counter.qml"))
    bench.wait(lambda: plugin.property("status") == "ready")


@only_qt6
def test_a_plugin_loads_without_a_robot(app: Any, bench: PluginBench) -> None:
    from rosglass.errors import ConnectionLostError

    def refuse(*_: Any) -> Any:
        raise ConnectionLostError("no robot here")

    bench.session.close()
    bench.session = Session(connect=refuse)
    plugin = bench.show(source("Counter.qml"))
    assert plugin.property("status") == "ready"


@only_qt6
def test_reload_shows_the_changed_file_and_keeps_the_context(
    bench: PluginBench, tmp_path: Path
) -> None:
    file = tmp_path / "Mine.qml"
    file.write_text(
        "import QtQuick\nItem { property int version: 1; property var kept: context.kept }"
    )
    plugin = bench.show('source: "Mine.qml"; context: ({ kept: 1 })')  # beside the layout
    bench.shown.property("kept")
    file.write_text(file.read_text().replace("version: 1", "version: 2"))
    plugin.reload()
    bench.wait(lambda: plugin.property("status") == "ready")
    assert (bench.value("version"), bench.value("kept")) == (2, 1)


@only_qt6
def test_files_are_read_and_written_in_the_layouts_folder_only(
    bench: PluginBench, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    bench.show(source("Counter.qml"))
    inside, outside = tmp_path / "notes.txt", tmp_path.parent / "outside.txt"
    assert bench.api("writeFile", str(inside), "text ä") is True
    assert bench.api("readFile", str(inside)) == "text ä"
    assert bench.api("fileExists", inside.as_uri()) is True
    assert bench.api("writeFile", str(outside), "x") is False
    assert not outside.exists()
    assert bench.api("writeFile", str(tmp_path / "../outside.txt"), "x") is False
    assert bench.api("readFile", "/etc/hostname") == ""
    assert "files of plugins are written in the layout's folder" in caplog.text
    # Its own folder can be read.
    assert "Uses what RQml offers" in bench.api("readFile", str(QML / "Counter.qml"))
    assert bench.api("writeFile", str(QML / "new.txt"), "x") is False
    (tmp_path / "link").symlink_to(tmp_path.parent)
    assert bench.api("writeFile", str(tmp_path / "link/outside.txt"), "x") is False


@only_qt6
def test_a_plugin_asks_for_another_and_copies_text(bench: PluginBench) -> None:
    from rosglass.cockpit.rqml_api import RqmlApi
    from rosglass.qt import QtGui

    bench.show(source("Counter.qml"))
    engine: Any = bench.runner.engine if bench.runner is not None else None
    api = RqmlApi.of(engine)
    api.folders.append(str(PLUGINS))
    asked: list[str] = []
    api.pluginRequested.connect(asked.append)
    bench.api("createPlugin", "robot_panels.counter")
    bench.api("createPlugin", "robot_panels.gone")
    assert asked == ["robot_panels.counter"]
    assert bench.api("canCreatePlugin", "robot_panels.elements") is True
    bench.value("inner").copy()
    assert QtGui.QGuiApplication.clipboard().text() == "copied"


@only_qt6
def test_elements_have_the_members_that_plugins_use(bench: PluginBench) -> None:
    bench.show(source("Elements.qml"))
    assert bench.plugin.property("status") == "ready", bench.plugin.property("problem")
    assert bench.plugin.property("complaint") == ""
    shown = bench.shown
    assert shown.property("icon") in {"\uf1f8", "X"}
    assert (shown.property("icon") == "X") is (shown.property("font") == "")
    decimals, integer = bench.find("decimals"), bench.find("integer")
    for field, typed, value, text in (
        (decimals, "2.345", 2.345, "2.35"),
        (decimals, "20", 10, "10"),
        (decimals, "", 10, "10"),
        (decimals, "-", 10, "10"),
        (integer, "300", 255, "255"),
        (integer, "007", 7, "7"),
    ):
        field.setProperty("text", typed)
        field.editingFinished.emit()
        assert (as_json(field.property("value")), field.property("text")) == (value, text)
    spin = bench.find("spin")
    spin.setProperty("value", 4.2)
    assert spin.childItems()[0].property("displayText") == "4.2m"
    assert bench.find("change").property("currentValueVisualPosition") == 0.25
    speed = bench.find("speed")
    assert (speed.property("from"), speed.property("to"), speed.property("value")) == (-2, 2, 0)
    toggle = bench.find("toggle")
    assert toggle.property("text") == "off"
    toggle.setProperty("checked", True)
    assert (toggle.property("text"), toggle.property("tooltipText")) == ("on", "Stop")
    toasts = bench.find("toasts")
    for text in "abc":
        toasts.show(text, "error")
    assert toasts.property("count") == 2
    assert bench.find("parts").property("number") == 3


@only_qt6
def test_selector_and_search(bench: PluginBench) -> None:
    bench.show(source("Elements.qml"))
    shown = bench.shown
    assert shown.score("/cmd_vel", "x") < 0 == shown.score("/cmd_vel", " ")
    assert shown.best(["/camera/velocity", "/cmd_vel", "/odom"], "cmdv") == "/cmd_vel"
    assert shown.best(["/cmd_vel_raw", "/cmd_vel"], "/cmd_vel") == "/cmd_vel"
    assert shown.fields(["Arm controller", "joint_trajectory"], "arm traj") > 0
    assert shown.fields(["Arm controller"], "arm traj") < 0
    selector = bench.find("selector")
    selector.setProperty("text", "/odom")
    assert (selector.property("currentIndex"), selector.property("currentText")) == (0, "/odom")
    selector.setProperty("currentIndex", 2)
    assert selector.property("text") == "/cmd_vel"
    selector.setProperty("text", "/new")
    assert (selector.property("currentIndex"), selector.property("currentText")) == (-1, "")
    selector.setProperty("text", "cam")
    assert as_json(selector.property("filteredItems")) == ["/camera/image"]
    search = bench.find("search")
    (field,) = [one for one in search.childItems() if one.objectName() == "searchBarTextField"]
    field.setProperty("text", "Base_Link")
    bench.wait(lambda: search.property("text") == "base_link")
    search.clear()
    assert search.property("text") == ""


@only_qt6
def test_messages_as_plain_values(bench: PluginBench) -> None:
    bench.show(source("Elements.qml"))
    shown = bench.shown
    stamped = shown.empty("sensor_msgs/msg/JointState")
    plain = json.loads(shown.plain(stamped))
    assert plain.pop("#messageType") == "sensor_msgs/msg/JointState"
    assert plain["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert plain["name"] == []
    engine: Any = bench.runner.engine if bench.runner is not None else None
    value = engine.evaluate(
        '({ names: ["a", { b: [1] }], zero: 0, none: null, inner: { empty: "" } })'
    )
    assert json.loads(shown.listed(value))["names"] == [{"display": "a"}, {"b": [{"display": 1}]}]
    assert json.loads(shown.stripped(value)) == {"names": ["a", {"b": [1]}]}


@only_qt6
def test_the_message_editor_edits_by_type(bench: PluginBench) -> None:
    from rosglass.qt import QtCore

    bench.show(source("Elements.qml"))
    shown = bench.shown

    def emit(item: Any, signal: str) -> None:
        assert QtCore.QMetaObject.invokeMethod(item, signal)

    shown.show("rcl_interfaces/msg/ParameterDescriptor")
    editor = bench.find("editor")
    editor.expandRecursively(-1, -1)
    bench.wait(lambda: editor.property("rows") > 5)

    def fields(kind: str) -> list[Any]:
        found, waiting = [], [editor]
        while waiting:
            one = waiting.pop()
            if one.metaObject().className().startswith(f"{kind}_QML") and one.isVisible():
                found.append(one)
            waiting += one.childItems()
        return sorted(found, key=lambda one: one.mapToScene(one.boundingRect().topLeft()).y())

    bench.wait(lambda: len(fields("TextField")) >= 3)
    name, kind = fields("TextField")[:2]
    name.setProperty("text", "speed")
    emit(name, "textEdited")
    kind.setProperty("text", "300")  # a uint8
    emit(kind, "editingFinished")
    assert kind.property("text") == "0"
    kind.setProperty("text", "3")
    emit(kind, "editingFinished")
    message = json.loads(shown.edited())
    assert (message["name"], message["type"]) == ("speed", 3)

    # Arrays grow and shrink by buttons.
    def buttons(hint: str) -> list[Any]:
        return [one for one in fields("IconButton") if one.property("tooltipText") == hint]

    assert len(buttons("Add an element")) == 2
    emit(buttons("Add an element")[0], "clicked")
    assert len(json.loads(shown.edited())["floating_point_range"]) == 1
    bench.wait(lambda: buttons("Remove this element"))
    emit(buttons("Remove this element")[0], "clicked")
    assert json.loads(shown.edited())["floating_point_range"] == []
    editor.setProperty("readonly", True)
    bench.wait(lambda: not fields("TextField"))


@only_qt6
def test_plugins_in_material_style_have_the_themes_colours(bench: PluginBench) -> None:
    bench.show(source("Material.qml"))
    assert bench.plugin.property("status") == "ready", bench.plugin.property("problem")
    label = bench.find("label")
    assert label.property("color").name() == "#e6eef5"  # light on the dark theme


@only_qt6
def test_a_plugin_in_material_style_leaves_the_style_of_others(bench: PluginBench) -> None:
    other = (
        f"property Item second: Plugin {{ {source('Elements.qml')} }}\n Item {{ children: second }}"
    )
    bench.show(source("Material.qml"), other)
    second = bench.root.property("second")
    bench.wait(lambda: second.property("status") == "ready")
    from rosglass.qt import optional

    assert optional("QtQuickControls2").QQuickStyle.name() == "Fusion"


@only_qt6
def test_arrays_of_messages_in_models_have_at(bench: PluginBench) -> None:
    bench.show(source("Arrays.qml"))
    assert bench.plugin.property("complaint") == ""
    assert bench.value("last") == "elbow4"


@only_qt6
def test_depths_are_shown_as_greys(bench: PluginBench) -> None:
    from rosglass.qt import optional

    if optional("QtMultimedia") is None:
        pytest.skip("QtMultimedia is not installed")
    import numpy as np

    bench.show(source("Depth.qml"))
    assert bench.plugin.property("status") == "ready", bench.plugin.property("problem")
    image = np.array([[0, 1, 1000, 2000, 5000, 65535]], np.uint16)
    camera = bench.robot.create_publisher("/depth/image_raw", "sensor_msgs/msg/Image")
    bench.wait(lambda: camera.subscription_count() > 0)
    camera.publish(
        {"width": 6, "height": 1, "encoding": "16UC1", "step": 12, "data": image.tobytes()}
    )
    sink = bench.find("output").property("videoSink")
    bench.wait(lambda: sink.videoFrame().isValid())
    shown = sink.videoFrame().toImage()
    greys = [shown.pixelColor(x, 0).red() for x in range(6)]
    assert greys[0] < greys[1] < greys[2] < greys[3] < greys[4] == greys[5]
    # 2 of 4 m: in the middle.
    assert abs(greys[3] - 128) < 4
    processor = bench.find("processor")
    file = bench.folder / "depth.png"
    processor.grabFrame()
    assert processor.saveGrabbedFrame(str(file)) is True
    assert file.exists()
    processor.clearGrabbedFrame()
    assert processor.saveGrabbedFrame(str(file)) is False
