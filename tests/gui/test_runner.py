"""The runner in this process: reloading keeps the node and leaves nothing behind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from local_world import LocalNode, LocalWorld

from rosglass.errors import QmlError
from rosglass.extras import install_command
from rosglass.qml import Session
from rosglass.qml.engine.waiting import wait_for
from rosglass.qml.run.runner import Runner, needs_widgets
from rosglass.qt import QtCore, Signal, is_alive
from rosglass.tf import Transform, TransformBroadcaster

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

UI = """import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
Rectangle {
    property string title: "%s"
    property var pub: Ros2.createPublisher("/x", "std_msgs/msg/Bool")
    property QtObject sub: Subscription { topic: "/y" }
    implicitWidth: 300; implicitHeight: 200
    color: "%s"
    Component.onCompleted: Ros2.init("ui")
    Component.onDestruction: Ros2.shutdown()
}"""


@pytest.fixture
def world() -> LocalWorld:
    return LocalWorld()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "Main.qml"
    path.write_text(UI % ("one", "red"))
    return path


@pytest.fixture
def runner(app: Any, file: Path, world: LocalWorld, wait: Any) -> Iterator[Runner]:
    made = Runner(file, Session(connect=world.connect))
    made.load()
    wait(lambda: world.publishers and world.subscriptions)
    yield made
    made.close()
    made.session.close()


def colour(runner: Runner) -> str:
    return runner.grab().pixelColor(20, 150).name()


@pytest.mark.both_qt
def test_reload_keeps_the_node_and_collects_the_old_interface(
    runner: Runner, file: Path, world: LocalWorld, wait: Any
) -> None:
    node, window = runner.session.node, runner.window
    assert (window.title(), window.width(), window.height()) == ("one", 300, 200)
    assert colour(runner) == "#ff0000"
    for title, name in (("two", "blue"), ("three", "lime")):
        file.write_text(UI % (title, name))
        assert runner.reload()
        wait.settled(runner.session)
        assert runner.session.node is node
        assert runner.window is window
        assert window.title() == title
    assert colour(runner) == "#00ff00"
    wait(lambda: len(world.publishers) == 1 and len(world.subscriptions) == 1)


LISTENING = """import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
Item {
    id: root
    property string version: "one"
    property var publisher
    property var subscription
    Component.onCompleted: {
        Ros2.init("ui")
        publisher = Ros2.createPublisher("/effect", "std_msgs/msg/String", 10)
        subscription = Ros2.createSubscription("/chat", "std_msgs/msg/String", 10)
        // Names of the file are gone with it; what a function has captured is not.
        const mine = version, send = publisher, effect = what => () => {
            send.publish({data: mine + " " + what})
        }
        arm.moved.connect(effect("arm"))
        subscription.newMessage.connect(effect("message"))
        root.parentChanged.connect(() => {
            root.Window.window.windowTitleChanged.connect(effect("title"))
        })
        TfTransformListener.transformChanged.connect(effect("transform"))
    }
}
"""


class Arm(QtCore.QObject):
    """An object of the program, which outlives each interface."""

    moved = Signal()


@pytest.mark.both_qt
def test_functions_of_a_file_end_when_it_is_reloaded(
    app: Any, file: Path, world: LocalWorld, wait: Any
) -> None:
    session = Session(connect=world.connect)
    robot, arm, received = world.connect(None, "robot"), Arm(), []
    robot.create_subscription(
        "/effect", "std_msgs/msg/String", lambda m: received.append(m.data), qos=10
    )
    chat = robot.create_publisher("/chat", "std_msgs/msg/String")
    tf = TransformBroadcaster(robot)
    file.write_text(LISTENING)
    runner = Runner(file, session)
    runner.prepare(lambda engine: engine.rootContext().setContextProperty("arm", arm))
    wanted = {"arm", "message", "title", "transform"}
    try:
        for number, version in enumerate(("one", "two", "three")):
            file.write_text(LISTENING.replace('"one"', f'"{version}"'))
            assert runner.reload() if number else runner.load() is None
            wait.settled(session)
            received.clear()

            def effects(version: str = version) -> bool:
                arm.moved.emit()
                chat.publish(data="x")
                runner.window.setTitle(f"title {len(received)}")
                at = Transform(frame_id="map", child_frame_id="base", stamp=robot.now())
                tf.send_transform(at)
                return {text.split()[1] for text in received if version in text} == wanted

            wait(effects)
            wait.settled(session)
            assert {text.split()[0] for text in received} == {version}
        # One that was never shown connects nothing that stays.
        file.write_text(LISTENING.replace('"one"', '"four"') + "Item { }")
        assert not runner.reload()
        arm.moved.emit()
        wait.settled(session)
        assert {text.split()[0] for text in received} == {"three"}
    finally:
        runner.close()
        session.close()


@pytest.mark.both_qt
def test_errors_are_shown_over_the_last_good_interface(
    runner: Runner, file: Path, wait: Any, caplog: Any
) -> None:
    wait.settled(runner.session)
    before = colour(runner)
    file.write_text((UI % ("bad", "blue")).replace("implicitWidth", "implicitWitdh"))
    assert not runner.reload()
    wait.settled(runner.session)
    assert runner.window.title() == "one"
    assert f"{file}:8:5: " in caplog.text
    covered = colour(runner)
    assert covered != before
    file.write_text(UI % ("good", "red"))
    assert runner.reload()
    wait.settled(runner.session)
    assert colour(runner) == before


@pytest.mark.both_qt
def test_roots_may_change_between_item_and_window(runner: Runner, file: Path, wait: Any) -> None:
    first = runner.window
    window = UI.replace("Rectangle", "Window").replace("property string title", "title")
    window = window.replace("implicitWidth: 300; implicitHeight: 200", "")
    file.write_text(window % ("window", "red"))
    assert runner.reload()
    wait.settled(runner.session)
    assert runner.window is not first
    assert runner.window.title() == "window"
    assert runner.window.isVisible()
    assert not is_alive(first)
    file.write_text(window % ("window 2", "blue"))
    assert runner.reload()
    wait.settled(runner.session)
    assert (runner.window.title(), colour(runner)) == ("window 2", "#0000ff")
    file.write_text(UI % ("item", "lime"))
    assert runner.reload()
    wait.settled(runner.session)
    assert (runner.window.title(), colour(runner)) == ("item", "#00ff00")


@pytest.mark.both_qt
def test_a_file_with_errors_leaves_nothing_open(app: Any, file: Path, world: LocalWorld) -> None:
    file.write_text("import QtQuick 2.15\nItem { x: }")
    session = Session(connect=world.connect)
    with pytest.raises(QmlError, match=r"Main\.qml:2:11: "):
        Runner(file, session).load()
    session.close()
    assert not world.nodes


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("import QtCharts 2.2", True),
        ("import Qt.labs.platform as P", True),
        ("import QtQuick 2.15", False),
        ("// import QtCharts", False),
    ],
)
def test_modules_that_need_widgets(file: Path, line: str, expected: bool) -> None:
    file.with_name("Part.qml").write_text(f"{line}\nItem {{}}")
    assert needs_widgets(file) is expected


WINDOWS = """import QtQuick 2.15
import QtQuick.Window 2.15
import QtQml 2.15
import Ros2 1.0
QtObject {
    property var first: Window { visible: true; title: "first"; width: 200; height: 100 }
    property var second: Window { visible: true; title: "second"; width: 210; height: 110 }
    property var hidden: Window { title: "hidden" }
    Component.onCompleted: Ros2.init("ui")
    Component.onDestruction: Ros2.shutdown()
}"""


def titles(runner: Runner) -> list[str]:
    return sorted(window.title() for window in runner.windows())


def overlays(runner: Runner) -> int:
    return sum(
        "last one without errors" in str(child.property("text") or "")
        for window in runner.windows()
        for item in window.contentItem().childItems()
        for child in item.childItems()
    )


@pytest.mark.both_qt
def test_several_windows(runner: Runner, file: Path, wait: Any, caplog: Any) -> None:
    file.write_text(WINDOWS)
    assert runner.reload()
    wait.settled(runner.session)
    assert titles(runner) == ["first", "hidden", "second"]
    assert runner.window.title() in {"first", "second"}
    old = {window.title(): window for window in runner.windows()}
    old["second"].setGeometry(150, 160, 333, 222)
    wait.settled(runner.session)
    node = runner.session.node
    # With errors all windows stay, and all show them.
    file.write_text(WINDOWS.replace("height: 100", "heigth: 100"))
    assert not runner.reload()
    wait.settled(runner.session)
    assert titles(runner) == ["first", "hidden", "second"]
    assert overlays(runner) == 3
    file.write_text(WINDOWS.replace("width: 200", "width: 240"))
    assert runner.reload()
    wait(lambda: not any(is_alive(window) for window in old.values()))
    assert titles(runner) == ["first", "hidden", "second"]
    assert overlays(runner) == 0
    assert runner.session.node is node
    # They stay where they were put.
    new = {window.title(): window for window in runner.windows()}
    assert (new["second"].width(), new["second"].height()) == (333, 222)
    assert [w.title() for w in runner.windows() if w.isVisible()].count("hidden") == 0
    file.write_text(UI % ("alone", "red"))
    assert runner.reload()
    wait.settled(runner.session)
    assert titles(runner) == ["alone"]


@pytest.mark.both_qt
def test_windows_within_a_window(runner: Runner, file: Path, wait: Any) -> None:
    file.write_text(
        """import QtQuick 2.15
        import QtQuick.Window 2.15
        import QtQuick.Controls 2.15
        ApplicationWindow {
            visible: true; title: "outer"; width: 300; height: 200
            header: Label { text: "header" }
            Window { visible: true; title: "inner"; width: 100; height: 50 }
        }"""
    )
    for _ in range(2):
        assert runner.reload()
        wait.settled(runner.session)
        assert titles(runner) == ["inner", "outer"]
        assert runner.window.title() == "outer"


def test_a_root_without_windows_may_get_one_later(
    runner: Runner, file: Path, wait: Any, caplog: Any
) -> None:
    file.write_text("import QtQml 2.15\nQtObject {}")
    assert runner.reload()
    wait.settled(runner.session)
    assert runner.window is None
    assert runner.grab().isNull()
    assert "shows no window" in caplog.text
    file.write_text("import QtQml 2.15\nQtObject { x: }")
    assert not runner.reload()
    file.write_text(UI % ("back", "red"))
    assert runner.reload()
    wait.settled(runner.session)
    assert runner.window.title() == "back"


@pytest.mark.both_qt
def test_errors_at_run_time_do_not_stop_a_reload(
    runner: Runner, file: Path, world: LocalWorld, wait: Any
) -> None:
    broken = (UI % ("broken", "red")).replace(
        'Ros2.init("ui")', '{ Ros2.init("ui"); nothing.here() }'
    )
    node = runner.session.node
    for _ in range(2):
        file.write_text(
            broken.replace("Ros2.shutdown()", '{ Ros2.shutdown(); throw new Error("end") }')
        )
        assert runner.reload()
        wait.settled(runner.session)
        assert runner.window.title() == "broken"
    # Reloading quickly, one before the former has been taken down, keeps the node, too.
    for _ in range(3):
        assert runner.reload()
    wait(lambda: not runner.session.holding)
    assert runner.session.node is node
    assert not runner.session.holding
    wait(lambda: len(world.publishers) == 1)


@pytest.mark.both_qt
def test_a_reload_is_deferred_while_a_call_waits(runner: Runner, file: Path, wait: Any) -> None:
    from rosglass.qml.engine.waiting import wait_for
    from rosglass.qt import QtCore

    file.write_text(UI % ("new", "lime"))
    during: list[Any] = []

    def begin(end: Any) -> None:
        def job() -> None:
            during.append((runner.reload(), runner.window.title()))
            end()

        QtCore.QTimer.singleShot(0, job)

    wait_for(runner.session, begin)
    assert during == [(False, "one")]
    assert runner.window.title() == "one"
    wait(lambda: runner.window.title() == "new")


@pytest.mark.both_qt
def test_import_paths_and_packages(
    app: Any, tmp_path: Path, world: LocalWorld, monkeypatch: Any
) -> None:
    package = tmp_path / "ws" / "my_robot"
    module = package / "qml" / "Parts"
    module.mkdir(parents=True)
    (package / "package.xml").write_text('<package format="2"><name>my_robot</name></package>')
    (module / "qmldir").write_text("module Parts\nPart 1.0 Part.qml\n")
    (module / "Part.qml").write_text("import QtQuick 2.15\nRectangle { color: 'lime' }")
    # One that is called as ours does not hide it.
    (package / "qml" / "Ros2").mkdir()
    (package / "qml" / "Ros2" / "qmldir").write_text("module Ros2\n")
    main = "import QtQuick 2.15\nimport Parts 1.0\nimport Ros2 1.0\nPart { Subscription {} }"
    (package / "qml" / "Main.qml").write_text(main)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ws"))
    session = Session(connect=world.connect)
    place = "package://my_robot/qml"
    made = Runner(f"{place}/Main.qml", session, import_paths=[place])
    made.load()
    assert made.file == package / "qml" / "Main.qml"
    made.close()
    monkeypatch.setenv("QML_IMPORT_PATH", str(package / "qml"))
    made = Runner(f"{place}/Main.qml", session)
    made.load()
    made.close()
    session.close()


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("package://none/x.qml", "there is no package 'none' in ROS_PACKAGE_PATH"),
        ("package://", "expected package://name/path"),
        ("{0}", r"this is a folder; name a file in it: Main\.qml"),
        ("{0}/empty", "this is a folder; it has no QML files"),
        ("{0}/Other.qml", "there is no such file"),
        ("{0}/data.bin", "not a QML file"),
    ],
)
def test_invalid_files_are_rejected(
    file: Path, world: LocalWorld, place: str, message: str
) -> None:
    (file.parent / "empty").mkdir()
    (file.parent / "data.bin").write_bytes(b"\0\1")
    session = Session(connect=world.connect)
    with pytest.raises(QmlError, match=message):
        Runner(place.format(file.parent), session)
    session.close()


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("import Ros2 2.0\nimport QtQuick 2.15\nItem {}", "its version is 1.0: import Ros2 1.0"),
        ("import QtQuick 2.15\nimport No.Such 1.0\nItem {}", "-I FOLDER or in QML_IMPORT_PATH"),
        ("import QtQuick 7.0\nItem {}", "this Qt may have another version of it"),
        ("import ROS2 1.0\nimport QtQuick 2.15\nItem {}", "it is written Ros2: import Ros2 1.0"),
        (
            "import Ros2 1.0\nSubscriber {}",
            "Ros 1.0 has it; the other module calls it Subscription",
        ),
        (
            "import Ros 1.0\nSubscription {}",
            "Ros2 1.0 has it; the other module calls it Subscriber",
        ),
        ("import QtQuick 2.15\nButton {}", "it comes with: import QtQuick.Controls 2.15"),
        ("import QtQuick 2.15\nRowLayout {}", "it comes with: import QtQuick.Layouts 1.15"),
        ("import Ros2 1.0\nBattery {}", "it comes with: import RosControls 1.0"),
    ],
)
def test_errors_say_what_to_do(
    app: Any, file: Path, world: LocalWorld, text: str, advice: str
) -> None:
    file.write_text(text)
    session = Session(connect=world.connect)
    runner = Runner(file, session)
    with pytest.raises(QmlError, match=r"Main\.qml:\d+:\d+: ") as caught:
        runner.load()
    assert advice in str(caught.value)
    runner.close()
    session.close()


@pytest.mark.both_qt
@pytest.mark.parametrize("module", ["QtMultimedia", "QtQuick.Controls"])
def test_errors_name_the_package_that_is_missing(file: Path, module: str) -> None:
    from rosglass.qml.run.live_file import error_list
    from rosglass.qt import QT6, QtCore, QtQml

    error = QtQml.QQmlError()
    error.setUrl(QtCore.QUrl.fromLocalFile(str(file)))
    error.setLine(2)
    error.setColumn(1)
    error.setDescription(f'module "{module}" is not installed')
    text = error_list([error], file)
    assert text.startswith(f'{file}:2:1: module "{module}" is not installed; ')
    if not QT6:
        assert "apt install qml-module-qt" in text
    elif module == "QtMultimedia":
        assert text.endswith(f"to install it: {install_command('camera')}")


def test_a_kiosk_stays_open_and_hides_the_pointer(
    app: Any, file: Path, world: LocalWorld, wait: Any, monkeypatch: Any
) -> None:
    from rosglass.qml.run import runner as module
    from rosglass.qt import QtCore, optional

    monkeypatch.setattr(module, "_STILL", 50)
    session = Session(connect=world.connect)
    runner = Runner(file, session, kiosk=True)
    runner.load()
    window = runner.window
    assert window.visibility() == window.Visibility.FullScreen
    wait(lambda: app.overrideCursor() is not None)
    optional("QtTest").QTest.mouseMove(window, QtCore.QPoint(30, 40))
    wait(lambda: app.overrideCursor() is None)
    window.close()
    wait.settled(session)
    assert window.isVisible()
    # Reloading with another kind of root closes the old window all the same.
    text = UI.replace("Rectangle", "Window").replace("property string title", "title")
    file.write_text(text.replace("implicitWidth: 300; implicitHeight: 200", "") % ("w", "red"))
    assert runner.reload()
    wait(lambda: not is_alive(window))
    assert runner.window.visibility() == runner.window.Visibility.FullScreen
    runner.window.close()
    wait.settled(session)
    assert runner.window.isVisible()
    runner.close()
    assert app.overrideCursor() is None
    session.close()


@pytest.mark.both_qt
def test_connecting_waits_for_the_first_frame(
    app: Any, file: Path, world: LocalWorld, wait: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    monkeypatch.setattr("rosglass.qml.engine.session._MAX_DEFER_MS", 60_000)

    def connect(*arguments: Any) -> LocalNode:
        order.append("connected")
        return world.connect(*arguments)

    session = Session(connect=connect)
    runner = Runner(file, session)
    runner.load()
    assert (session.state, order) == ("connecting", [])
    runner.window.afterRendering.connect(
        lambda: order.append("drawn"), QtCore.Qt.ConnectionType.DirectConnection
    )
    wait(lambda: session.node is not None)
    assert order.index("drawn") < order.index("connected")
    runner.close()
    session.close()


def test_connecting_does_not_wait_for_a_hidden_window(
    app: Any, file: Path, world: LocalWorld, wait: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.qml.engine.session._MAX_DEFER_MS", 60_000)
    file.write_text(
        """import QtQuick 2.15
        import QtQuick.Window 2.15
        import Ros2 1.0
        Window { Component.onCompleted: Ros2.init("ui") }"""
    )
    session = Session(connect=world.connect)
    runner = Runner(file, session)
    runner.load()
    wait(lambda: session.node is not None)
    runner.close()
    session.close()


def test_connecting_waits_for_a_frame_that_never_comes_only_so_long(
    app: Any, world: LocalWorld, wait: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.qml.engine.session._MAX_DEFER_MS", 50)
    session = Session(connect=world.connect)
    session.defer_connecting()
    session.init("ui")
    assert session.state == "connecting"
    wait(lambda: session.node is not None)
    session.close()


def test_connecting_does_not_wait_while_a_call_of_qml_does(
    app: Any, world: LocalWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosglass.qml.engine.session._MAX_DEFER_MS", 60_000)
    session = Session(connect=world.connect)
    session.defer_connecting()
    session.init("ui")
    assert wait_for(session, session.node_changed.connect)
    assert session.node is not None
    session.close()


def texts(runner: Runner) -> str:
    """Return what the items over the interface say."""
    found: list[str] = []

    def read(item: Any) -> None:
        for child in item.childItems():
            found.append(str(child.property("text") or ""))
            read(child)

    for window in runner.windows():
        read(window.contentItem())
    return "\n".join(found)


@pytest.mark.parametrize(("module", "element"), [("Ros", "Subscriber"), ("Ros2", "Subscription")])
def test_an_interface_that_asks_for_no_node_is_shown_the_line_to_add(
    app: Any,
    file: Path,
    world: LocalWorld,
    wait: Any,
    monkeypatch: pytest.MonkeyPatch,
    module: str,
    element: str,
) -> None:
    monkeypatch.setattr("rosglass.qml.engine.session._FORGOTTEN", 20)
    text = f"""import QtQuick 2.15
        import {module} 1.0
        Item {{ {element} {{ topic: "/x" }} }}"""
    file.write_text(text)
    runner = Runner(file, Session(connect=world.connect))
    line = f'Component.onCompleted: {module}.init("main")'
    try:
        runner.load()
        wait(lambda: line in texts(runner))
        assert "This interface has no node: nothing is received or sent." in texts(runner)
        assert runner.reload()
        wait(lambda: line in texts(runner))
        file.write_text(text.replace("Item {", f"Item {{ {line}; "))
        assert runner.reload()
        wait(lambda: world.subscriptions)
        wait(lambda: "no node" not in texts(runner))
    finally:
        runner.close()
        runner.session.close()


def test_own_file_that_a_control_hides_is_named(runner: Runner, file: Path, caplog: Any) -> None:
    own = file.parent / "Battery.qml"
    own.write_text("import QtQuick 2.15\nItem {}\n")
    (file.parent / "Mine.qml").write_text("import QtQuick 2.15\nItem {}\n")
    file.write_text("import QtQuick 2.15\nimport RosControls 1.0\nItem { Battery {} }\n")
    runner.load()
    assert f"{own} is not used: import RosControls has a type of this name" in caplog.text
    assert "Mine.qml" not in caplog.text
