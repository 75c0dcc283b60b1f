"""Overlays over a ``SceneView``: declared in QML, added from Python, drawn, removed."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import pytest

import rosglass.scene
from rosglass.errors import Error, QmlError

if TYPE_CHECKING:
    from pathlib import Path

RED = 'import QtQuick 2.15\nRectangle { objectName: "panel"; color: "#ff0000" }\n'


@pytest.fixture
def panel(tmp_path: Path) -> Path:
    """A file with an overlay that is red all over."""
    file = tmp_path / "overlays" / "Panel.qml"
    file.parent.mkdir()
    file.write_text(RED)
    return file


def test_an_overlay_is_declared(bench: Any, panel: Path) -> None:
    bench.load(f'SceneOverlay {{ objectName: "o"; source: "{panel.as_uri()}"; scale: 2 }}')
    from rosglass.qt import QtCore

    element = bench.view.findChild(QtCore.QObject, "o")
    bench.wait(lambda: element.property("loaded"))
    root = element.overlay.root
    assert (root.width(), root.height()) == (bench.view.width() / 2, bench.view.height() / 2)
    assert tuple(bench.picture()[100, 100]) == (255, 0, 0)
    element.setProperty("visible", False)
    bench.wait(lambda: tuple(bench.picture()[100, 100]) == (48, 48, 48))
    element.setProperty("visible", True)
    element.setProperty("opacity", 0.5)
    bench.wait(lambda: bench.picture()[100, 100][0] == pytest.approx(152, abs=2))


def test_overlays_fit_the_view_and_have_an_order(bench: Any, panel: Path) -> None:
    view = bench.load()
    low = rosglass.scene.add_overlay(view, panel, z=1)
    other = panel.with_name("Other.qml")
    other.write_text(RED.replace("ff0000", "00ff00"))
    high = rosglass.scene.add_overlay(view, other, "High", z=2)
    bench.wait(lambda: tuple(bench.picture()[100, 100]) == (0, 255, 0))
    low.z = 3
    bench.wait(lambda: tuple(bench.picture()[100, 100]) == (255, 0, 0))
    bench.window.resize(500, 350)
    bench.wait(lambda: low.root.width() == view.width() == 500)
    low.close()
    bench.wait(lambda: tuple(bench.picture()[100, 100]) == (0, 255, 0))
    assert (low.root, high.loaded) == (None, True)
    low.close()


def test_the_view_at_rest_is_not_drawn_for_an_overlay(bench: Any, panel: Path) -> None:
    view = bench.load()
    panel.write_text(
        "import QtQuick 2.15\nRectangle { property var t: rviz.createPositionTracker(0, 0, 0)\n"
        "property int frames: 0\nNumberAnimation on x { from: 0; to: 100; duration: 500\n"
        "loops: Animation.Infinite } onXChanged: frames++ }"
    )
    overlay = rosglass.scene.add_overlay(view, panel)
    bench.wait(lambda: overlay.root.property("frames") > 3)
    bench.wait(lambda: not view.is_moving)
    drawn, frames = view.pictures_drawn(), overlay.root.property("frames")
    bench.wait(lambda: overlay.root.property("frames") > frames + 10)
    assert view.pictures_drawn() <= drawn + 1


def test_wrong_files_are_refused(bench: Any, panel: Path, caplog: Any) -> None:
    view = bench.load()
    with pytest.raises(QmlError, match=r"Nothing\.qml"):
        rosglass.scene.add_overlay(view, panel.with_name("Nothing.qml"))
    panel.write_text("import QtQuick 2.15\nItem { nothing: 1 }")
    with pytest.raises(QmlError, match=r"Panel\.qml:2:\d+: .*nothing"):
        rosglass.scene.add_overlay(view, panel)
    panel.write_text("import QtQuick 2.15\nQtObject { }")
    with pytest.raises(QmlError, match="must be an Item"):
        rosglass.scene.add_overlay(view, panel)
    panel.write_text(RED)
    with pytest.raises(Error, match="scale 99 is not a number from"):
        rosglass.scene.add_overlay(view, panel, scale=99)
    with caplog.at_level(logging.WARNING):
        bench.load('SceneOverlay { source: "file:///nowhere/x.qml" }')
        bench.wait(lambda: "SceneOverlay" in caplog.text)
    assert "/nowhere/x.qml" in caplog.text


def test_views_with_overlays_come_and_go(bench: Any, panel: Path) -> None:
    panel.write_text(
        "import QtQuick 2.15\nItem { property var all: [rviz.view, rviz.displays,\n"
        "rviz.toolManager, rviz.createPositionTracker(0, 0, 0), rviz.status] }"
    )
    for _ in range(3):
        view = bench.load("GridDisplay { }")
        overlay = rosglass.scene.add_overlay(view, panel)
        assert overlay.loaded
    bench.load()
    bench.wait(lambda: overlay.root is None)


def test_the_overlay_gets_the_mouse_first(bench: Any, panel: Path) -> None:
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    view = bench.load()
    panel.write_text(
        "import QtQuick 2.15\nItem { property int clicks: 0; property string text: field.text\n"
        "MouseArea { width: 100; height: 100; onClicked: parent.clicks++ }\n"
        "TextInput { id: field; x: 150; width: 100; height: 40 } }"
    )
    root = rosglass.scene.add_overlay(view, panel).root
    bench.picture()
    left = Qt.MouseButton.LeftButton

    def drag(start: QPoint, end: QPoint) -> None:
        QTest.mousePress(bench.window, left, pos=start)
        QTest.mouseMove(bench.window, (start + end) / 2)
        QTest.mouseMove(bench.window, end)
        QTest.mouseRelease(bench.window, left, pos=end)

    before = view.camera()
    QTest.mouseClick(bench.window, left, pos=QPoint(50, 50))
    drag(QPoint(20, 20), QPoint(80, 80))
    assert root.property("clicks") == 2
    assert view.camera() == before
    # What it does not take goes to the view.
    drag(QPoint(200, 200), QPoint(240, 230))
    bench.wait(lambda: view.camera() != before)
    # Keys go where the last click went.
    QTest.mouseClick(bench.window, left, pos=QPoint(200, 20))
    for key in "map":
        QTest.keyClick(bench.window, key)
    assert root.property("text") == "map"
    moved = view.camera()
    QTest.mouseClick(bench.window, left, pos=QPoint(200, 200))
    QTest.keyClick(bench.window, "z")
    bench.wait(lambda: view.camera() != moved)
    assert root.property("text") == "map"


CONFIG = """
Visualization Manager:
  Displays:
    - Class: hector_rviz_overlay_controls/QmlOverlay
      Name: Panel
      Enabled: true
      Path: FILE
      Z-Index: 3
      Opacity: 1
      Configuration: {Speed: 0.75, Label: 5}
      Overlay Configuration: {tab: 2, names: [a, '"7"']}
  Global Options: {Fixed Frame: map}
"""


def test_overlays_of_configs_are_shown_and_kept(bench: Any, panel: Path, tmp_path: Path) -> None:
    from rosglass.scene.access import access_of
    from rosglass.scene.configs.rviz_config import RvizConfig

    panel.write_text(
        'import QtQuick 2.15\nRectangle { color: "#ff0000"; property var config: rviz.config\n'
        "property var speed: rviz.registerFloatProperty('Speed', 0.5)\n"
        "property var label: rviz.registerStringProperty('Label', 'none') }"
    )
    file, again = tmp_path / "one.rviz", tmp_path / "two.rviz"
    file.write_text(CONFIG.replace("FILE", str(panel)))
    view = bench.load()
    assert view.load_config(file) == []
    (display,) = view.scene.displays
    bench.wait(lambda: display.overlay is not None and display.overlay.loaded)
    overlay = display.overlay
    assert tuple(bench.picture()[100, 100]) == (255, 0, 0)
    assert (overlay.name, overlay.z, display.statusText) == ("Panel", 3, "Qml: OK")
    values = overlay.properties.properties
    assert (values["Speed"].get(), values["Label"].get()) == (0.75, "5")
    assert overlay.properties.get_config() == {"tab": 2, "names": ["a", "7"]}
    values["Speed"].set(2.0)
    overlay.properties.set_config({"tab": "3"})
    view.save_config(again)
    (saved,) = RvizConfig.load(again).displays
    assert saved.class_id == "hector_rviz_overlay_controls/QmlOverlay"
    assert view.load_config(again) == []
    (display,) = view.scene.displays
    bench.wait(lambda: display.overlay is not None and display.overlay.loaded)
    assert display.overlay.properties.properties["Speed"].get() == 2.0
    assert display.overlay.properties.get_config() == {"tab": "3"}
    # The old one is gone, and the panel's switch hides this one.
    assert overlay.root is None
    display.enabled = False
    bench.wait(lambda: tuple(bench.picture()[100, 100]) != (255, 0, 0))
    display.overlay.visible = True
    assert display.enabled
    display.set("Path", str(panel.with_name("Nothing.qml")))
    bench.wait(lambda: "Nothing.qml" in display.statusText)
    made = access_of(view).displays.add("rosglass/QmlOverlay", "Other")
    assert (made.class_id, made.status.level) == ("rosglass/QmlOverlay", "ok")
    bench.wait(lambda: "Choose a QML file" in made.status.text)


def test_the_status_of_an_overlay_is_there_again_when_it_is_shown(bench: Any, panel: Path) -> None:
    scene = bench.load().scene
    good = scene.add("rosglass/QmlOverlay", "Good", path=str(panel))
    missing = panel.with_name("Later.qml")
    bad = scene.add("rosglass/QmlOverlay", "Bad", path=str(missing))
    bench.wait(lambda: good.statusText == "Qml: OK" and "Later.qml" in bad.statusText)
    for display in (good, bad):
        display.enabled = False
        assert display.statusText == ""
        display.enabled = True
    assert good.statusText == "Qml: OK"
    bench.wait(lambda: "Later.qml" in bad.statusText)
    assert bad.statusLevel == "error"
    missing.write_text(RED)
    bad.enabled = False
    bad.enabled = True
    bench.wait(lambda: bad.statusText == "Qml: OK", lambda: bad.statusText)


def test_popups_follow_points_of_a_view_beside_others(bench: Any, panel: Path) -> None:
    from PySide6.QtCore import QPointF
    from PySide6.QtQuick import QQuickItem

    from rosglass.scene.access import access_of

    panel.write_text(
        "import QtQuick 2.15\nimport QtQuick.Controls 2.15\nimport RosRviz 1.0\n"
        "Item { Component.onCompleted: edge.objectName = 'edge'\n"
        "AnchoredPopup { id: popup; point: Qt.vector3d(0, 0, 0); padding: 0; visible: true\n"
        "contentItem: Rectangle { id: edge; color: '#00ff00'; implicitWidth: 40\n"
        "implicitHeight: 40 } } }"
    )
    # As between the panels of a window.
    root = bench.load('SceneView { objectName: "inner"; x: 120; y: 60; width: 240; height: 200 }')
    from rosglass.scene import SceneView

    view = root.findChild(SceneView, "inner")
    access = access_of(view)
    access.view.move_eye_and_focus((0, 0, 10), (0, 0, 0), animate=False)
    overlay = rosglass.scene.add_overlay(view, panel, scale=2.0)
    edge = overlay.root.findChild(QQuickItem, "edge")
    middle = view.mapToScene(QPointF(120, 100))

    def shown() -> bool:
        at = edge.mapToScene(QPointF(20, 20))
        return abs(at.x() - middle.x()) < 3 and abs(at.y() - middle.y()) < 3

    bench.wait(shown)
    picture = bench.picture()
    assert tuple(picture[round(middle.y()), round(middle.x())]) == (0, 255, 0)
    access.view.move_eye_and_focus((0, 1, 10), (0, 1, 0), animate=False)
    bench.wait(lambda: not shown())


def test_rosglass_view_shows_a_file_once(bench: Any, panel: Path, tmp_path: Path) -> None:
    from rosglass.scene.app.program import ViewProgram

    config, other = tmp_path / "one.rviz", panel.with_name("Other.qml")
    config.write_text(CONFIG.replace("FILE", str(panel)))
    other.write_text(RED.replace("ff0000", "00ff00"))
    view = bench.load()
    program = ViewProgram(config, overlays=[panel, other])
    program.begin(view)
    (display,) = view.scene.displays
    bench.wait(lambda: display.overlay is not None and display.overlay.loaded)
    interfaces = [inner for item in view.childItems() for inner in item.childItems()]
    assert sorted(item.property("color").name() for item in interfaces) == ["#00ff00", "#ff0000"]


def test_a_view_with_listed_displays_is_destroyed_in_silence(bench: Any, capfd: Any) -> None:
    from PySide6.QtCore import QUrl

    from rosglass.qt import is_alive
    from rosglass.scene.access import access_of

    view = bench.load("GridDisplay { }")
    bench.wait(lambda: len(access_of(view).displays.all) == 1)
    bench.window.setSource(QUrl())
    bench.wait(lambda: not is_alive(view))
    assert "Traceback" not in capfd.readouterr().err
