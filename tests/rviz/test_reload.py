"""Overlays reload when their files are saved."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from usage import memory

if TYPE_CHECKING:
    from collections.abc import Callable

GREY, BLUE, RED, LIME = (48, 48, 48), (0, 128, 255), (255, 0, 0), (0, 255, 0)
IMPORTS = "import QtQuick 2.15\nimport QtQuick.Controls 2.15\n"
#: Below the panel with errors, which lies along the upper edge.
SQUARE = 'Rectangle { x: 40; y: 240; width: 100; height: 100; color: "%s" }'
BLUE_UI = f"Item {{ {SQUARE % '#0080ff'} }}"
LIME_UI = f"Item {{ {SQUARE % '#00ff00'} }}"


def seen(picture: Any, x: int = 90, y: int = 290) -> tuple[int, ...]:
    return tuple(picture.pixelColor(x, y).getRgb()[:3])


@pytest.fixture
def show(show_file: Callable[..., Any]) -> Callable[..., Any]:
    return show_file


@pytest.fixture
def mouse(app: Any, wait: Callable[..., None]) -> Callable[..., bool]:
    """Send an event of the mouse to the 3D view; returns whether an overlay took it."""
    from rosglass.rviz.qt5 import QtCore, QtGui

    kinds = {
        "press": (QtCore.QEvent.MouseButtonPress, QtCore.Qt.LeftButton, QtCore.Qt.LeftButton),
        "move": (QtCore.QEvent.MouseMove, QtCore.Qt.NoButton, QtCore.Qt.LeftButton),
        "release": (QtCore.QEvent.MouseButtonRelease, QtCore.Qt.LeftButton, QtCore.Qt.NoButton),
        "hover": (QtCore.QEvent.MouseMove, QtCore.Qt.NoButton, QtCore.Qt.NoButton),
    }

    def mouse(kind: str, x: float, y: float) -> bool:
        at = QtCore.QPointF(x, y)
        which, button, buttons = kinds[kind]
        event = QtGui.QMouseEvent(which, at, at, at, button, buttons, QtCore.Qt.NoModifier)
        taken = app.overlays.input.eventFilter(app.window.panel, event)
        wait.frames(1)
        return bool(taken)

    return mouse


def by_writing(file: Path, text: str) -> None:
    file.write_text(text)


def by_renaming(file: Path, text: str) -> None:
    new = file.with_name(".Ui.qml.swp")
    new.write_text(text)
    new.replace(file)


def in_pieces(file: Path, text: str) -> None:
    with file.open("w") as opened:
        for letter in text:
            opened.write(letter)
            opened.flush()


def by_backup(file: Path, text: str) -> None:
    file.rename(file.with_name("Ui.qml~"))
    file.write_text(text)


@pytest.mark.parametrize("save", [by_writing, by_renaming, in_pieces, by_backup])
def test_reloads_however_an_editor_saves(
    show: Any, file: Path, wait: Any, grab: Any, save: Callable[..., None]
) -> None:
    overlay = show(BLUE_UI, watch=True)
    assert seen(grab()) == BLUE
    for text, colour in ((LIME_UI, LIME), (BLUE_UI, BLUE)):
        root = overlay.root
        save(file, IMPORTS + text)
        wait(lambda root=root: overlay.root is not root)
        assert (seen(grab()), overlay.problem) == (colour, "")


def test_follows_its_parts_scripts_and_imported_modules(
    app: Any, tmp_path: Path, wait: Any, grab: Any
) -> None:
    folder, module = tmp_path / "ui", tmp_path / "modules" / "Parts"
    module.mkdir(parents=True)
    (folder / "deep").mkdir(parents=True)
    (module / "qmldir").write_text("module Parts\nLamp 1.0 Lamp.qml\n")
    (module / "Lamp.qml").write_text(f"{IMPORTS}{SQUARE % 'red'}")
    (folder / "deep" / "Part.qml").write_text(f"{IMPORTS}Item {{}}")
    (folder / "colours.js").write_text(".pragma library\nfunction mine() { return '#0080ff' }")
    (folder / "Ui.qml").write_text(
        f'{IMPORTS}import Parts 1.0\nimport "deep"\nimport "colours.js" as Colours\n'
        f"Item {{ Lamp {{}} Part {{}}\n{SQUARE.replace('x: 40', 'x: 240') % ''} }}".replace(
            '""', "Colours.mine()"
        )
    )
    app.add_qml(folder / "Ui.qml", watch=True, import_paths=[tmp_path / "modules"])
    assert (seen(grab()), seen(grab(), 290)) == (RED, BLUE)
    (module / "Lamp.qml").write_text(f"{IMPORTS}{SQUARE % '#0080ff'}")
    wait(lambda: seen(grab()) == BLUE)
    # Several at once, as after a change of branch.
    (folder / "colours.js").write_text(".pragma library\nfunction mine() { return '#00ff00' }")
    (folder / "deep" / "Part.qml").write_text(f"{IMPORTS}{SQUARE % 'red'}")
    wait(lambda: (seen(grab()), seen(grab(), 290)) == (RED, LIME))


def test_the_object_rviz_survives_with_all_that_is_in_it(
    show: Any, file: Path, app: Any, wait: Any
) -> None:
    text = """Item {
        property int number: %s
        property var speed: rviz.registerFloatProperty("Speed", 1.5)
        property real now: speed.value
        property var config: rviz.config }"""
    overlay = show(text % 1)
    first = overlay.properties
    overlay.root.property("speed").set(2.5)
    overlay.properties.set_config({"tab": 3})
    held = overlay.root.property("speed")
    file.write_text(IMPORTS + text % 2)
    assert overlay.reload()
    root = overlay.root
    assert overlay.properties is first
    assert root.property("speed") is held
    assert (root.property("number"), root.property("now")) == (2, 2.5)
    config = root.property("config")
    assert (config.toVariant() if hasattr(config, "toVariant") else config) == {"tab": 3}
    assert len(first.properties) == 1


def test_the_node_and_publishers_stay(show: Any, file: Path, app: Any, wait: Any) -> None:
    text = """Item { property string text: "%s"
        property var pub: Ros2.createPublisher("/reloaded", "std_msgs/msg/String")
        Component.onCompleted: Ros2.init("reloaded")
        Component.onDestruction: Ros2.shutdown() }"""
    overlay = show("import Ros2 1.0\n" + text % "one")
    session = app.session
    wait(lambda: session.node is not None)
    node = session.node
    wait(lambda: overlay.root.property("pub").property("isAdvertised"))
    for number in range(3):
        old = overlay.root
        file.write_text(f"{IMPORTS}import Ros2 1.0\n{text % number}")
        assert overlay.reload()
        from rosglass.qt import is_alive

        wait(lambda old=old: not is_alive(old))
        wait(lambda: not session.holding)
        assert session.node is node
        wait(lambda: overlay.root.property("pub").property("isAdvertised"))
    # No other overlay needs it.
    app.overlays.remove(overlay)
    wait(lambda: session.node is None)


def test_an_overlay_that_goes_leaves_the_node_to_others(
    app: Any, tmp_path: Path, wait: Any
) -> None:
    from rosglass.qt import is_alive

    def show(name: str) -> Any:
        path = tmp_path / f"{name}.qml"
        path.write_text(
            f"{IMPORTS}import Ros2 1.0\nItem {{ Component.onCompleted: Ros2.init('{name}')\n"
            "Component.onDestruction: Ros2.shutdown() }"
        )
        return app.add_qml(path)

    one, two = show("one"), show("two")
    wait(lambda: app.session.node is not None)
    assert app.session.name == "one"
    node, root = app.session.node, one.root
    app.overlays.remove(one)
    wait(lambda: not is_alive(root))
    wait(lambda: not app.session.holding)
    assert app.session.node is node
    app.overlays.remove(two)
    wait(lambda: app.session.node is None)
    # And a new one may ask for a node again.
    show("three")
    wait(lambda: app.session.node is not None)
    assert app.session.name == "three"


def test_errors_are_shown_over_the_last_good_interface(
    show: Any, file: Path, wait: Any, grab: Any, mouse: Any, caplog: Any, error_panels: Any
) -> None:
    overlay = show(BLUE_UI, watch=True)
    root = overlay.root
    file.write_text(f"{IMPORTS}Item {{\n    Botton {{ }}\n}}")
    wait(lambda: overlay.problem)
    assert overlay.problem == f"{file}:4:5: Botton is not a type; did you mean Button?"
    assert overlay.problem in caplog.text
    assert overlay.root is root
    picture = grab()
    assert seen(picture) == BLUE
    assert seen(picture, 20, 24) != GREY
    panel = error_panels()[0]
    assert "last one without errors" in panel.property("heading")
    assert panel.property("text") == overlay.problem
    # The mouse is the panel's above it, and RViz's beside it.
    assert mouse("hover", 20, 24)
    assert not mouse("hover", 90, 400)
    # It is as large on an interface of another scale.
    overlay.scale = 2.0
    larger = grab()
    assert [seen(larger, x, 24) for x in (5, 20)] == [GREY, seen(picture, 20, 24)]
    assert overlay.problem == panel.property("text")
    overlay.scale = 1.0
    file.write_text(IMPORTS + LIME_UI)
    wait(lambda: not overlay.problem)
    picture = grab()
    assert (seen(picture), seen(picture, 20, 24)) == (LIME, GREY)


def test_errors_can_be_dismissed(
    show: Any, file: Path, wait: Any, grab: Any, mouse: Any, error_panels: Any
) -> None:
    overlay = show("Item { MouseArea { anchors.fill: parent } }")
    file.write_text(f"{IMPORTS}Item {{ x: }}")
    assert not overlay.reload()
    grab()
    panel = error_panels()[0]
    x = panel.x() + panel.width() - 20
    mouse("press", x, panel.y() + 20)
    mouse("release", x, panel.y() + 20)
    assert not panel.isVisible()
    assert seen(grab(), 20, 24) == GREY
    assert overlay.problem
    # The next attempt shows them again.
    assert not overlay.reload()
    assert seen(grab(), 20, 24) != GREY


def test_errors_from_the_start_are_shown_until_they_are_mended(
    app: Any, file: Path, wait: Any, grab: Any, mouse: Any, error_panels: Any
) -> None:
    from rosglass.errors import QmlError
    from rosglass.rviz import QmlOverlay

    file.write_text("import QtQuick\nItem {}")
    overlay = QmlOverlay(file, app.session)
    with pytest.raises(QmlError, match="Qt 5 needs one after the module's name"):
        overlay.load()
    app.add(overlay)
    assert not overlay.loaded
    assert "Ui.qml:1:" in overlay.problem
    assert seen(grab(), 20, 24) != GREY
    assert "shown once they are fixed" in error_panels()[0].property("heading")
    assert not mouse("press", 90, 400)
    mouse("release", 90, 400)
    file.write_text(IMPORTS + BLUE_UI)
    assert overlay.reload()
    picture = grab()
    assert (seen(picture), seen(picture, 20, 24), overlay.problem) == (BLUE, GREY, "")


def test_watched_files_may_come_later(
    show: Any, file: Path, wait: Any, grab: Any, caplog: Any
) -> None:
    overlay = show("Item {", watch=True)
    assert not overlay.loaded
    assert overlay.problem
    wait.nothing_happens(0.3)
    assert caplog.text.count(overlay.problem) == 1
    file.unlink()
    wait(lambda: "there is no such file" in overlay.problem)
    file.write_text(IMPORTS + BLUE_UI)
    wait(lambda: overlay.loaded)
    assert (seen(grab()), overlay.problem) == (BLUE, "")


def test_watching_begins_and_ends_at_run_time(show: Any, file: Path, wait: Any) -> None:
    overlay = show(BLUE_UI)
    assert not overlay.watch
    root = overlay.root
    overlay.watch = True
    file.write_text(IMPORTS + LIME_UI)
    wait(lambda: overlay.root is not root)
    root = overlay.root
    overlay.watch = False
    file.write_text(IMPORTS + BLUE_UI + "\n")
    wait.nothing_happens(0.3)
    assert overlay.root is root


PRESSED = """Item { property int clicks: 0; property int canceled: 0
    MouseArea { x: 40; y: 240; width: 100; height: 100
        onClicked: parent.clicks++; onCanceled: log.append("canceled") }
    TextField { x: 200; y: 240; width: 100; height: 40; objectName: "field" } }"""


def test_a_press_ends_without_effect_and_keys_are_rvizs_again(
    show: Any, file: Path, app: Any, mouse: Any, wait: Any, grab: Any
) -> None:
    overlay = show(PRESSED.replace('log.append("canceled")', "rviz.config = {canceled: true}"))
    grab()
    assert mouse("press", 250, 260)
    mouse("release", 250, 260)
    assert app.overlays.input.focused is overlay
    assert mouse("press", 90, 290)
    assert overlay.reload()
    assert overlay.properties.get_config() == {"canceled": True}
    assert app.overlays.input.focused is None
    yaw = app.window.manager.getViewManager().getCurrent().subProp("Yaw")
    before = yaw.getValue()
    # Neither the new interface nor the camera gets the rest of it.
    assert mouse("move", 300, 400)
    assert mouse("release", 90, 290)
    assert (overlay.root.property("clicks"), yaw.getValue()) == (0, before)
    grab()
    assert mouse("press", 90, 290)
    mouse("release", 90, 290)
    assert overlay.root.property("clicks") == 1


@pytest.mark.usefixtures("view")
def test_reloading_from_its_own_click(
    show: Any, app: Any, mouse: Any, wait: Any, grab: Any
) -> None:
    from rosglass.qt import is_alive

    overlay = show(
        """Item { signal wanted()
        Button { x: 40; y: 240; width: 100; height: 100; onPressed: parent.wanted() } }"""
    )
    root = overlay.root
    root.wanted.connect(overlay.reload)
    grab()
    assert mouse("press", 90, 290)
    assert overlay.root is not root
    mouse("move", 92, 290)
    mouse("release", 92, 290)
    wait(lambda: not is_alive(root))
    assert seen(grab(), 150, 400) == GREY


def test_popups_go_with_the_interface(show: Any, mouse: Any, wait: Any, grab: Any) -> None:
    text = """Item { property int clicks: 0
        Button { x: 40; y: 240; width: 100; height: 100; onClicked: parent.clicks++ }
        Popup { x: 200; y: 240; width: 80; height: 80; modal: true; visible: %s
            closePolicy: Popup.NoAutoClose; background: Rectangle { color: "#0080ff" } }
        ComboBox { id: box; x: 400; y: 240; model: 3; Component.onCompleted: %s } }"""
    overlay = show(text % ("true", "Qt.callLater(popup.open)"))
    wait(lambda: seen(grab(), 240, 280) == BLUE)
    file = Path(overlay.file)
    file.write_text(IMPORTS + text % ("false", "{}"))
    assert overlay.reload()
    wait(lambda: seen(grab(), 240, 280) == GREY)
    assert mouse("press", 90, 290)
    mouse("release", 90, 290)
    assert overlay.root.property("clicks") == 1


def test_hidden_overlays_reload_when_they_are_visible_again(
    show: Any, file: Path, grab: Any, wait: Any
) -> None:
    overlay = show(BLUE_UI, watch=True)
    grab()
    overlay.visible = False
    root = overlay.root
    file.write_text(IMPORTS + LIME_UI)
    wait(lambda: overlay.root is not root)
    assert seen(grab()) == GREY
    overlay.visible = True
    assert seen(grab()) == LIME


def test_a_reload_is_deferred_while_a_call_waits(
    show: Any, file: Path, app: Any, wait: Any
) -> None:
    from rosglass.qml.engine.waiting import wait_for
    from rosglass.qt import QtCore

    overlay = show(BLUE_UI)
    root = overlay.root
    during: list[Any] = []

    def begin(end: Any) -> None:
        def job() -> None:
            during.append((overlay.reload(), overlay.root is root))
            end()

        QtCore.QTimer.singleShot(0, job)

    wait_for(app.session, begin)
    assert during == [(False, True)]
    assert overlay.root is root
    wait(lambda: overlay.root is not root)


def test_reloads_leave_nothing_behind(show: Any, file: Path, wait: Any, grab: Any) -> None:
    from rosglass.qt import is_alive
    from rosglass.rviz.qt5 import QtCore

    text = f"""Item {{ {SQUARE % "#0080ff"}
        Button {{ text: "stop %s" }} ComboBox {{ model: 20 }} Popup {{ Label {{ text: "hello" }} }}
        property var speed: rviz.registerFloatProperty("Speed", 1.5) }}"""
    overlay = show(text % 0)
    gone: list[Any] = []

    def cycle(number: int) -> None:
        gone.append(overlay.root)
        file.write_text(IMPORTS + text % number)
        assert overlay.reload()
        wait.frames(1)

    for number in range(60):
        cycle(number)
    gc.collect()
    grab()
    before = memory()
    for number in range(200):
        cycle(number)
    gc.collect()
    grab()
    # A reload that kept its interface would take about 300 KB.
    assert memory() - before < 15_000_000
    wait(lambda: not any(is_alive(root) for root in gone))
    window = overlay.root.window().contentItem()
    assert len(window.childItems()) <= 2
    assert len(overlay.engine.findChildren(QtCore.QObject)) < 50
    assert seen(grab()) == BLUE
