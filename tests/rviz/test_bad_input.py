"""RViz survives faulty overlays, and logs messages that say what to do."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest
from rosmaster import RosMaster

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

IMPORTS = "import QtQuick 2.15\nimport QtQuick.Controls 2.15\nimport QtQuick.Window 2.15\n"
PATIENCE = 60
GREY, BLUE = (48, 48, 48), (0, 128, 255)
SQUARE = 'Rectangle { x: 40; y: 240; width: 100; height: 100; color: "#0080ff" }'


@pytest.fixture
def show(show_file: Callable[..., Any]) -> Callable[..., Any]:
    return show_file


@pytest.fixture
def press(app: Any) -> Callable[[float, float], bool]:
    """Press and release the mouse over the 3D view; returns whether an overlay took it."""
    from rosglass.rviz.qt5 import QtCore, QtGui

    def press(x: float, y: float) -> bool:
        at, left, none = QtCore.QPointF(x, y), QtCore.Qt.LeftButton, QtCore.Qt.NoButton
        taken = [
            app.overlays.input.eventFilter(
                app.window.panel,
                QtGui.QMouseEvent(kind, at, at, at, left, held, QtCore.Qt.NoModifier),
            )
            for kind, held in (
                (QtCore.QEvent.MouseButtonPress, left),
                (QtCore.QEvent.MouseButtonRelease, none),
            )
        ]
        return bool(taken[0])

    return press


@pytest.fixture
def messages(caplog: pytest.LogCaptureFixture) -> Iterator[Callable[[], list[str]]]:
    """Return the log messages of Qt and QML, as ``file:line: text``."""
    from rosglass.qml.engine.log import install_message_handler
    from rosglass.qt import QtCore

    install_message_handler()
    caplog.set_level(logging.INFO)
    yield lambda: [f"{r.pathname}:{r.lineno}: {r.getMessage()}" for r in caplog.records]
    QtCore.qInstallMessageHandler(None)


@pytest.fixture
def goes_on(app: Any, show: Any, grab: Any, wait: Any) -> Callable[[], None]:
    """Assert that RViz draws, and shows a good interface."""

    def seen(x: int) -> tuple[int, ...]:
        return tuple(grab().pixelColor(x, 290).getRgb()[:3])

    def goes_on() -> None:
        app.overlays.close()
        show(f"Item {{ {SQUARE} }}")
        wait(lambda: (seen(90), seen(20)) == (BLUE, GREY))

    return goes_on


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Item { x: }", r"Ui\.qml:4:11: Expected token"),
        ("Item { Botton {} }", r"Ui\.qml:4:8: Botton is not a type"),
        ("Item { nothing: 1 }", r"Ui\.qml:4:8: .*non-existent property"),
        ("QtObject {}", "must be an Item, but is a QtObject: put its content into an Item"),
        ("Timer {}", "must be an Item, but is a Timer"),
        ("Window { visible: true }", "is a window; overlays are shown in the 3D view's window"),
        ("ApplicationWindow { visible: true }", "is a window; overlays are shown"),
        ("Popup { }", "must be an Item, but is a Popup"),
        ("", r"Ui\.qml:4:"),
        ("import QtQuick.Nothing 1.0\nItem {}", r'Ui\.qml:4:1: module "QtQuick.Nothing" is not'),
        ("import QtCharts 2.99\nItem {}", r"Ui\.qml:4:1: .*QtCharts"),
        ("import Ros 2.0\nItem {}", r"its version is 1\.0: import Ros 1\.0"),
        ("import Ros\nItem {}", r"Ui\.qml:4:1: .*Qt 5 needs one after the module's name"),
    ],
)
def test_errors_in_files_are_reported_with_place_and_advice(
    app: Any, show: Any, goes_on: Any, text: str, message: str
) -> None:
    from rosglass.errors import QmlError

    with pytest.raises(QmlError, match=message):
        show(text)
    assert list(app.overlays) == []
    shown = [w for w in app.qt.topLevelWindows() if w.isVisible() and w.inherits("QQuickWindow")]
    assert shown == []
    goes_on()


def test_invalid_files_are_rejected(app: Any, tmp_path: Path, goes_on: Any) -> None:
    from rosglass.errors import Error, QmlError

    with pytest.raises(QmlError, match=r"nowhere\.qml: there is no such file"):
        app.add_qml(tmp_path / "nowhere.qml")
    with pytest.raises(QmlError, match="this is a folder"):
        app.add_qml(tmp_path)
    (tmp_path / "Good.qml").write_text("import QtQuick 2.15\nItem {}")
    with pytest.raises(QmlError, match="no such folder to import QML modules from"):
        app.add_qml(tmp_path / "Good.qml", import_paths=[tmp_path / "nowhere"])
    with pytest.raises(QmlError, match="no package 'no_such_package'"):
        app.add_qml("package://no_such_package/Ui.qml")
    app.add_qml(tmp_path / "Good.qml", "one")
    with pytest.raises(Error, match="there is an overlay 'one' already"):
        app.add_qml(tmp_path / "Good.qml", "one")
    goes_on()


def test_run_time_errors_are_logged_with_their_place(
    show: Any, file: Path, messages: Any, press: Any, grab: Any, goes_on: Any, wait: Any
) -> None:
    overlay = show(
        """Item {
        id: root
        property int a: b + 1
        property int b: a + 1
        property var nothing
        width: height; height: width
        Timer { running: true; interval: 1
            onTriggered: root.missing() }
        Button { x: 40; y: 240; width: 100; height: 100
            onClicked: root.nothing.deeper.still = 1 }
        function loop() { loop() }
        Component.onCompleted: loop() }"""
    )
    grab()
    assert press(90, 290)
    # The timer's comes by itself.
    wait(lambda: any("'missing' of" in text for text in messages()))
    said = messages()
    for line, what in ((4, "Binding loop"), (11, "'missing' of"), (13, "'deeper' of undefined")):
        assert any(f"{file}:{line}: " in text and what in text for text in said), said
    assert any("Maximum call stack size exceeded" in text for text in said), said
    assert overlay.loaded
    goes_on()


def test_objects_may_go_while_they_handle_an_event(
    show: Any, press: Any, wait: Any, grab: Any, goes_on: Any
) -> None:
    overlay = show(
        """Item { id: root; property int gone: 0
        Repeater { id: many; model: 1
            Button { x: 40; y: 240; width: 100; height: 100; onPressed: many.model = 0 } }
        Loader { id: page; x: 200; y: 240; sourceComponent: Rectangle { width: 100; height: 100
            Component.onDestruction: root.gone++
            MouseArea { anchors.fill: parent; onPressed: page.sourceComponent = null } } }
        Component { id: part; Rectangle { width: 100; height: 100; x: 400; y: 240
            Component.onDestruction: root.gone++
            MouseArea { anchors.fill: parent; onPressed: parent.destroy() } } }
        Component.onCompleted: part.createObject(root) }"""
    )
    grab()
    for x in (90, 250, 450):
        assert press(x, 290)
        wait.frames(1)
        # There is nothing any more.
        assert not press(x, 290)
    wait(lambda: overlay.root.property("gone") == 2)
    goes_on()


def test_windows_that_an_interface_opens_and_closes_hurt_no_overlay(
    app: Any, show: Any, wait: Any, grab: Any, goes_on: Any
) -> None:
    """Their OpenGL contexts are others than Ogre's, which would take its own to be current."""
    overlay = show(
        """Item { id: root; property bool open: true; property int frames: 0
        Loader { active: root.open; sourceComponent: Window { x: 600; visible: true
            color: "orange"; onFrameSwapped: root.frames++ } }
        Rectangle { x: 200; y: 240; width: 100; height: 100; color: root.open ? "red" : "#0080ff" }
        }"""
    )
    wait(lambda: overlay.root.property("frames") > 0)
    for opened in (False, True, False):
        overlay.root.setProperty("open", opened)
        expected = (255, 0, 0) if opened else BLUE
        wait(lambda expected=expected: tuple(grab().pixelColor(250, 290).getRgb()[:3]) == expected)
    goes_on()


def test_a_root_that_is_destroyed_by_others(
    show: Any, press: Any, wait: Any, grab: Any, app: Any, goes_on: Any
) -> None:
    from rosglass.qt import is_alive

    overlay = show(f"Item {{ {SQUARE} TextField {{ x: 40; y: 240 }} }}")
    grab()
    assert press(90, 250)
    root = overlay.root
    root.deleteLater()
    wait(lambda: not is_alive(root))
    assert not press(90, 250)
    overlay.scale = 2.0
    assert grab().pixelColor(90, 290).getRgb()[:3] == GREY
    assert overlay.reload()
    goes_on()


REMOVED = """Item { signal removed()
    Component.onDestruction: console.warn("goodbye")
    Button { x: 40; y: 240; width: 100; height: 100; onPressed: parent.removed() }
    Button { x: 240; y: 240; width: 100; height: 100; onClicked: parent.removed() }
    Timer { objectName: "timer"; interval: 1; onTriggered: parent.removed() } }"""


@pytest.mark.parametrize("how", ["pressed", "clicked", "timer", "twice"])
def test_an_overlay_may_be_removed_by_its_own_handler(
    app: Any, show: Any, press: Any, wait: Any, grab: Any, goes_on: Any, messages: Any, how: str
) -> None:
    from rosglass.rviz.qt5 import QtCore

    overlay = show(REMOVED)
    overlay.root.removed.connect(lambda: app.overlays.remove(overlay))
    if how == "twice":
        overlay.root.removed.connect(lambda: app.overlays.remove(overlay))
        overlay.root.removed.connect(overlay.close)
        overlay.root.removed.connect(overlay.reload)
    grab()
    if how == "timer":
        overlay.root.findChild(QtCore.QObject, "timer").setProperty("running", True)
    else:
        assert press(290 if how == "clicked" else 90, 290)
    wait(lambda: list(app.overlays) == [])
    wait(lambda: any("goodbye" in text for text in messages()))
    goes_on()


def test_an_overlay_may_be_removed_while_it_is_loaded(
    app: Any, file: Path, show: Any, wait: Any, goes_on: Any, tmp_path: Path
) -> None:
    from rosglass.qt import QtCore, Slot

    class Remover(QtCore.QObject):
        overlay: Any = None

        @Slot()
        def remove(self) -> None:
            if self.overlay is not None:
                app.overlays.remove(self.overlay)

    remover = Remover()
    overlay = show("Item {}")
    overlay.prepare(lambda engine: engine.rootContext().setContextProperty("remover", remover))
    remover.overlay = overlay
    file.write_text(f"{IMPORTS}Item {{ Component.onCompleted: remover.remove() }}")
    assert not overlay.reload()
    assert list(app.overlays) == []
    wait.frames(2)
    # While parts are made in the background.
    (tmp_path / "Part.qml").write_text(
        f"{IMPORTS}Column {{ Repeater {{ model: 50; Button {{}} }} }}"
    )
    for pause in (0, 5, 30):
        passing = show(
            'Item { Loader { asynchronous: true; source: "Part.qml" }\n'
            "Loader { asynchronous: true; sourceComponent: Column { Repeater { model: 200\n"
            "Button {} } } } }"
        )
        wait.nothing_happens(pause / 1000)
        app.overlays.remove(passing)
        wait.frames(1)
    goes_on()


@pytest.mark.parametrize("how", ["removed", "closed"])
def test_an_overlay_may_be_removed_while_its_call_waits(
    app: Any, show: Any, wait: Any, press: Any, grab: Any, goes_on: Any, messages: Any, how: str
) -> None:
    from rosglass.qml.engine.waiting import wait_for
    from rosglass.qt import QtCore, Slot

    class Waiting(QtCore.QObject):
        overlay: Any = None

        @Slot()
        def call(self) -> None:
            def begin(end: Any) -> None:
                QtCore.QTimer.singleShot(0, self.remove)
                QtCore.QTimer.singleShot(150, end)

            wait_for(app.session, begin)

        def remove(self) -> None:
            if how == "closed":
                self.overlay.close()
            app.overlays.remove(self.overlay)
            self.overlay = None

    waiting = Waiting()
    overlay = waiting.overlay = show("Item {}")
    overlay.prepare(lambda engine: engine.rootContext().setContextProperty("waiting", waiting))
    overlay.file.write_text(
        f"""{IMPORTS}Item {{ id: root; property int number: 7
        Component.onDestruction: console.warn("goodbye")
        Timer {{ running: true; interval: 1
            onTriggered: {{ waiting.call(); console.warn("returned", root.number) }} }} }}"""
    )
    assert overlay.reload()
    del overlay
    wait(lambda: any("goodbye" in text for text in messages()))
    said = [text.rpartition(": ")[2] for text in messages() if "Ui.qml" in text]
    assert said[-2:] == ["returned 7", "goodbye"]
    goes_on()


@pytest.mark.parametrize(
    "broken", ["resize", "draw", "deliver", "leave", "set_focus", "cursor", "close"]
)
def test_overlays_of_ones_own_may_raise_anywhere(
    app: Any, grab: Any, press: Any, goes_on: Any, broken: str, caplog: Any
) -> None:
    import numpy as np

    from rosglass.rviz import Overlay

    def fail(name: str) -> None:
        if name == broken:
            raise RuntimeError(f"{name} is broken")

    class Mine(Overlay):
        size = (1, 1)

        def resize(self, width: int, height: int, ratio: float) -> None:
            self.size = (height, width)
            fail("resize")

        def draw(self) -> Any:
            fail("draw")
            return np.full(self.size, 0xFF0080FF, np.uint32)

        def deliver(self, event: Any) -> bool:
            fail("deliver")
            return True

        def leave(self) -> None:
            fail("leave")

        def set_focus(self, focus: bool) -> None:
            fail("set_focus")

        def cursor(self) -> Any:
            return fail("cursor")

        def close(self) -> None:
            fail("close")

    mine = Mine("mine")
    app.add(mine)
    grab()
    press(90, 290)
    app.overlays.input.hover(None)
    app.overlays.remove(mine)
    assert list(app.overlays) == []
    assert f"{broken} is broken" in mine.problem
    assert f"{broken} is broken" in caplog.text
    goes_on()


def test_a_node_finds_its_master_again(
    app: Any, file: Path, tmp_path: Path, wait: Any, goes_on: Any
) -> None:
    """The overlays' node reconnects; RViz's cannot, which the status bar shows."""
    from rosglass.qml import Session
    from rosglass.rviz import QmlOverlay

    master = RosMaster(tmp_path)
    master.start()
    file.write_text(
        f"{IMPORTS}import Ros2 1.0\nItem {{ property QtObject s: Subscription {{ topic: '/again'\n"
        "messageType: 'std_msgs/msg/String' }\nComponent.onCompleted: Ros2.init('again') }"
    )
    session = Session(master.url)

    def known() -> bool:
        return ["/again", ["/again"]] in master.call("getSystemState")[1]

    try:
        overlay = QmlOverlay(file, session)
        overlay.load()
        app.add(overlay)
        wait(known)
        master.kill()
        wait(lambda: session.state != "connected")
        master.start()
        wait(known)
        wait(lambda: session.state == "connected")
        app.overlays.remove(overlay)
    finally:
        session.close()
        master.kill()
    goes_on()


PROGRAM = """
import sys
from rosglass.rviz import Application
from rosglass.qt import QtCore
app = Application()
one = app.add_qml({file!r}, "one", watch=True)
two = app.add_qml({file!r}, "two", scale=2.0)

def act():
    print("acting", flush=True)
    {act}

QtCore.QTimer.singleShot({after}, act)
sys.exit(app.run())
"""
LIVELY = """import Ros2 1.0
Item {
    property var pub: Ros2.createPublisher("/lively", "std_msgs/msg/String")
    property QtObject sub: Subscription { topic: "/rosout" }
    property var speed: rviz.registerFloatProperty("Speed", 1)
    Rectangle { width: 60; height: 60; color: "red"
        RotationAnimation on rotation { loops: Animation.Infinite; from: 0; to: 360 } }
    Loader { asynchronous: true
        sourceComponent: Column { Repeater { model: 200; Button { text: index } } } }
    Popup { visible: true; modal: true; x: 200; y: 200; width: 100; height: 100 }
    Timer { running: true; repeat: true; interval: 20; onTriggered: pub.publish({data: "x"}) }
    Component.onCompleted: Ros2.init("lively")
    Component.onDestruction: Ros2.shutdown()
}"""
CLOSE = "app.window.widget.close()"


@pytest.mark.parametrize(
    ("act", "after", "code"),
    [
        (CLOSE, 0, 0),
        (CLOSE, 40, 0),
        (CLOSE, 350, 0),
        ("app.quit(3)", 5, 3),
        ("app.quit(3)", 600, 3),
        ('one.engine.evaluate("Qt.quit()")', 100, 0),
        ('one.engine.evaluate("Qt.exit(5)")', 20, 5),
        (f"one.reload(); {CLOSE}", 70, 0),
        (f"app.overlays.remove(one); two.reload(); {CLOSE}", 200, 0),
        (f"one.file.write_text('Item {{'); two.reload(); {CLOSE}", 250, 0),
        ("import os; os.kill(os.getpid(), 15)", 150, 128 + signal.SIGTERM),
    ],
)
def test_rviz_may_be_closed_at_any_moment(
    screen: str, master: str, app: Any, file: Path, tmp_path: Path, act: str, after: int, code: int
) -> None:
    file.write_text(IMPORTS + LIVELY)
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.format(file=str(file), act=act, after=after))
    env = {
        **os.environ,
        "DISPLAY": screen,
        "ROS_MASTER_URI": master,
        "HOME": str(tmp_path),
        "XDG_RUNTIME_DIR": str(tmp_path),
        "PYTHONFAULTHANDLER": "1",
    }
    started = time.monotonic()
    done = subprocess.run(
        [sys.executable, str(program)],
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert "acting" in done.stdout
    assert done.returncode == code, (done.stdout, time.monotonic() - started)
    for word in ("Traceback", "Fatal", "TypeError", "ReferenceError"):
        assert word not in done.stdout, done.stdout
