"""The runner in this process: reloading keeps the node and leaves nothing behind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from memory_world import MemoryWorld

from rosglass.errors import QmlError
from rosglass.qml import Session
from rosglass.qml.runner import Runner, needs_widgets
from rosglass.qt import is_alive

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
def world() -> MemoryWorld:
    return MemoryWorld()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "Main.qml"
    path.write_text(UI % ("one", "red"))
    return path


@pytest.fixture
def runner(app: Any, file: Path, world: MemoryWorld, wait: Any) -> Iterator[Runner]:
    made = Runner(file, Session(connect=world.connect))
    made.load()
    wait(lambda: world.publishers and world.subscriptions)
    yield made
    made.close()
    made.session.close()


def colour(runner: Runner) -> str:
    return runner.grab().pixelColor(20, 150).name()


def test_reload_keeps_the_node_and_collects_the_old_interface(
    runner: Runner, file: Path, world: MemoryWorld, wait: Any
) -> None:
    node, window = runner.session.node, runner.window
    assert (window.title(), window.width(), window.height()) == ("one", 300, 200)
    assert colour(runner) == "#ff0000"
    for title, name in (("two", "blue"), ("three", "lime")):
        file.write_text(UI % (title, name))
        assert runner.reload()
        wait(200)
        assert runner.session.node is node
        assert runner.window is window
        assert window.title() == title
    assert colour(runner) == "#00ff00"
    wait(lambda: len(world.publishers) == 1 and len(world.subscriptions) == 1)


def test_errors_are_shown_over_the_last_good_interface(
    runner: Runner, file: Path, wait: Any, caplog: Any
) -> None:
    wait(50)
    before = colour(runner)
    file.write_text((UI % ("bad", "blue")).replace("implicitWidth", "implicitWitdh"))
    assert not runner.reload()
    wait(50)
    assert runner.window.title() == "one"
    assert f"{file}:8:5: " in caplog.text
    covered = colour(runner)
    assert covered != before
    file.write_text(UI % ("good", "red"))
    assert runner.reload()
    wait(50)
    assert colour(runner) == before


def test_roots_may_change_between_item_and_window(runner: Runner, file: Path, wait: Any) -> None:
    first = runner.window
    window = UI.replace("Rectangle", "Window").replace("property string title", "title")
    window = window.replace("implicitWidth: 300; implicitHeight: 200", "")
    file.write_text(window % ("window", "red"))
    assert runner.reload()
    wait(50)
    assert runner.window is not first
    assert runner.window.title() == "window"
    assert runner.window.isVisible()
    assert not is_alive(first)
    file.write_text(window % ("window 2", "blue"))
    assert runner.reload()
    wait(50)
    assert (runner.window.title(), colour(runner)) == ("window 2", "#0000ff")
    file.write_text(UI % ("item", "lime"))
    assert runner.reload()
    wait(50)
    assert (runner.window.title(), colour(runner)) == ("item", "#00ff00")


def test_a_file_with_errors_leaves_nothing_open(app: Any, file: Path, world: MemoryWorld) -> None:
    file.write_text("import QtQuick 2.15\nItem { x: }")
    session = Session(connect=world.connect)
    with pytest.raises(QmlError, match=r"Main\.qml:2:11: "):
        Runner(file, session).load()
    session.close()
    assert not world.nodes


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
