"""A living layout follows its document: panels that stay are not made again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from rosglass.cockpit.layout_edits import LayoutEdits
from rosglass.cockpit.qml_document import Document

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytest.importorskip("PySide6", reason="the editor needs Qt 6")

LAYOUT = """import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import RosCockpit 1.0

Cockpit {
    id: root_
    nodeName: "ui"
    property int made: 0
    property int gone: 0
    property int received: 0
    Page {
        title: "One"
        Split {
            Panel { title: "A"; Mark { name: "a" } }
            Split {
                orientation: Qt.Vertical
                Panel { title: "B"; Mark { name: "b" } }
                Tabs {
                    Panel { title: "C"; Mark { name: "c" } }
                    Panel { title: "D"; Mark { name: "d" } }
                }
            }
        }
    }
    Page {
        title: "Two"
        Panel {
            title: "E"
            Mark { name: "e" }
        }
    }
}
"""
#: Counts how often it is created and destroyed, in the root of the layout.
MARK = """import QtQuick 2.15
import Ros2 1.0
Item {
    id: mark
    property string name
    property int number: 0
    property bool painted: visible
    objectName: "mark_" + name
    Subscription {
        topic: "/ticks"; messageType: "std_msgs/msg/Int32"; onNewMessage: mark.number += 1
    }
    Component.onCompleted: root_.made += 1
    Component.onDestruction: root_.gone += 1
}
"""


class Stage:
    """A LiveLayout in a window."""

    def __init__(self, running: Any, wait: Any, folder: Path) -> None:
        from rosglass.cockpit.live_layout import LiveLayout
        from rosglass.qt import QtQuick

        (folder / "Mark.qml").write_text(MARK)
        self.file = folder / "layout.qml"
        self.wait, self.robot, self.session = wait, running.robot, running.session
        self.window = QtQuick.QQuickWindow()
        self.window.resize(800, 600)
        self.window.show()
        wait(self.window.isExposed)
        self.live = LiveLayout(self.file, running.session, self.window.contentItem())
        self.loads: list[None] = []
        self.live.loaded.connect(lambda: self.loads.append(None))
        self.window.contentItem().setSize(self.window.size())

    def show(self, text: str) -> bool:
        return self.live.show(Document(text, str(self.file)))

    @property
    def document(self) -> Document:
        document = self.live.document
        assert document is not None
        return document

    def panel(self, title: str) -> Any:
        """Return the object of a panel, by its title."""
        for found in self.document.objects():
            member = found.get("title")
            if member is not None and member.value == title and found.type in {"Page", "Panel"}:
                return found
        raise AssertionError(f"no panel {title!r}")

    def item(self, title: str) -> Any:
        return self.live.item_of(self.panel(title))

    def find(self, name: str) -> Any:
        return self.find_in(self.window, name)

    def find_in(self, window: Any, name: str) -> Any:
        waiting = [window.contentItem()]
        while waiting:
            one = waiting.pop()
            if one.objectName() == name:
                return one
            waiting += one.childItems()
        return None

    def edit(self, change: Any) -> bool:
        edits = LayoutEdits(self.document)
        change(edits)
        return self.live.show(edits.document)

    def counts(self) -> tuple[int, int]:
        return self.live.root.property("made"), self.live.root.property("gone")

    def boxes(self) -> dict[str, tuple[int, int, int, int]]:
        """Return where the panels are; those that are hidden are missing."""
        from rosglass.qt import QtCore

        made = {}
        for title in "ABCDE":
            item = self.item(title)
            if item.isVisible():
                at = item.mapToScene(QtCore.QPointF(0, 0))
                made[title] = (
                    round(at.x()),
                    round(at.y()),
                    round(item.width()),
                    round(item.height()),
                )
        return made


@pytest.fixture
def stage(running: Any, wait: Any, tmp_path: Path) -> Iterator[Stage]:
    from rosglass.qt import send_deferred_deletes

    made = Stage(running, wait, tmp_path)
    assert made.show(LAYOUT), made.live.problem
    yield made
    made.live.close()
    made.window.deleteLater()
    send_deferred_deletes()


def test_panels_live_on_when_they_are_moved(stage: Stage) -> None:
    marks = {name: stage.find(f"mark_{name}") for name in "abcde"}
    publisher = stage.robot.create_publisher("/ticks", "std_msgs/msg/Int32")
    stage.wait(lambda: publisher.publish({"data": 1}) or marks["a"].property("number") > 0)
    seen = marks["a"].property("number")
    changes: list[Any] = [
        lambda edits: edits.move(stage.panel("A"), stage.panel("B"), "bottom"),
        lambda edits: edits.move(stage.panel("C"), stage.panel("A"), "left"),
        lambda edits: edits.move(stage.panel("D"), stage.panel("E"), "center"),
        lambda edits: edits.to_window(stage.panel("B"), "", 0, 0, 300, 200),
        lambda edits: edits.move(stage.panel("B"), stage.panel("One"), "top"),
        lambda edits: edits.move(stage.panel("E"), stage.panel("A"), "center"),
    ]
    texts = [stage.document.text]
    for change in changes:
        assert stage.edit(change)
        texts.append(stage.document.text)
        assert {name: stage.find(f"mark_{name}") for name in "abcde"} == marks | {
            name: None for name in "b" if "PanelWindow" in stage.document.text
        }
    for text in reversed(texts):
        assert stage.show(text)
    assert stage.counts() == (5, 0)
    assert len(stage.loads) == 1
    # Its subscription was not made again.
    assert marks["a"].property("number") >= seen
    assert len(stage.robot.subscriptions("/ticks")) == 5


def test_the_screen_is_the_same_as_after_loading(stage: Stage, running: Any) -> None:
    stage.edit(lambda edits: edits.move(stage.panel("A"), stage.panel("D"), "before"))
    stage.edit(lambda edits: edits.move(stage.panel("C"), stage.panel("B"), "right"))
    stage.edit(lambda edits: edits.move(stage.panel("D"), stage.panel("One"), "left"))
    stage.edit(lambda edits: edits.resize(stage.panel("B").parent, [3, 1]))
    stage.wait.settled(running.session)
    before = stage.boxes()
    assert len(stage.loads) == 1
    assert stage.live.reload()
    stage.wait.settled(running.session)
    assert stage.boxes() == before
    assert len(before) == 4


def test_any_changes_give_the_same_screen_as_loading(stage: Stage, running: Any) -> None:
    import random

    from rosglass.cockpit.layout_edits import EDGES, element_of
    from rosglass.errors import ArgumentError

    rng = random.Random(7)
    for turn in range(60):
        edits = LayoutEdits(stage.document)
        found = [one for one in stage.document.objects() if element_of(one) not in {"", "Cockpit"}]
        movable = [one for one in found if element_of(one) in {"Panel", "Split", "Tabs"}]
        try:
            edits.move(rng.choice(movable), rng.choice(found), rng.choice(EDGES))
        except ArgumentError:
            continue
        assert stage.live.show(edits.document)
        if turn % 6 == 0:
            stage.live.root.setProperty("pageIndex", rng.randrange(2))
            stage.wait.settled(running.session)
            followed, loads = stage.boxes(), len(stage.loads)
            shown = {
                item.property("currentIndex")
                for path, item in stage.live._items.items()
                if element_of(stage.document.at(path)) == "Tabs"
            }
            if shown <= {0}:
                assert stage.live.reload()
                stage.wait.settled(running.session)
                assert stage.boxes() == followed, stage.document.text
                assert len(stage.loads) == loads + 1


def test_commands_halt_when_a_change_moves_panels(stage: Stage) -> None:
    from rosglass.qt import QtCore, optional

    received: list[float] = []
    subscription = stage.robot.create_subscription(
        "/cmd_vel", "geometry_msgs/msg/Twist", lambda message: received.append(message.linear.x)
    )
    text = LAYOUT.replace('Mark { name: "a" }', 'DriveStick { objectName: "stick" }')
    assert stage.show(text)
    stick = stage.find("stick")
    test: Any = optional("QtTest").QTest
    left, none = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
    up = stick.mapToScene(QtCore.QPointF(stick.width() / 2, stick.height() / 2 - 60)).toPoint()

    def is_driving() -> bool:
        stage.window.requestActivate()
        if not stick.property("active"):
            test.mouseRelease(stage.window, left, none, up)
            test.mousePress(stage.window, left, none, up)
        return bool(stick.property("active") and received and received[-1] > 0)

    stage.wait(is_driving)
    # A title alone changes nothing for the hand.
    assert stage.show(text.replace('title: "B"', 'title: "Z"'))
    assert stick.property("command").property("active")
    stage.wait(is_driving)
    edits = LayoutEdits(stage.document)
    edits.move(stage.panel("C"), stage.panel("D"), "right")
    assert stage.live.show(edits.document)
    assert not stick.property("command").property("active")
    stage.wait(lambda: received[-1] == 0)
    subscription.close()


def test_any_changes_leave_no_warnings(stage: Stage, caplog: Any, messages: None) -> None:
    """Moves, windows, new and removed panels and pages, undone in any order."""
    import random

    from rosglass.cockpit.layout_edits import EDGES, element_of
    from rosglass.errors import ArgumentError
    from rosglass.qt import send_deferred_deletes

    rng, texts = random.Random(11), [LAYOUT]
    for _ in range(80):
        document = stage.document
        found = [one for one in document.objects() if element_of(one) not in {"", "Cockpit"}]
        panels = [one for one in found if element_of(one) == "Panel"]
        pages = [one for one in found if element_of(one) == "Page"]
        edits, choice = LayoutEdits(document), rng.random()
        try:
            if choice < 0.15 and len(panels) > 2:
                edits.remove(rng.choice(panels))
            elif choice < 0.25:
                edits.to_window(rng.choice(panels), "", 0, 0, 300, 200)
            elif choice < 0.4:
                edits.add('Panel { Mark { name: "new" } }', rng.choice(found))
            elif choice < 0.5 and len(pages) > 1:
                edits.move_page(rng.choice(pages), 0)
            elif choice < 0.6:
                assert stage.show(rng.choice(texts))
                continue
            else:
                edits.move(rng.choice(panels), rng.choice(found), rng.choice(EDGES))
        except ArgumentError:
            continue
        assert stage.live.show(edits.document), stage.live.problem
        texts.append(edits.document.text)
        stage.wait.settled(stage.session)
        send_deferred_deletes()
    assert len(stage.loads) == 1
    assert [one.getMessage() for one in caplog.records if one.levelname != "INFO"] == []


def test_a_changed_literal_is_set(stage: Stage) -> None:
    mark = stage.find("mark_a")
    text = LAYOUT.replace('Mark { name: "a" }', 'Mark { name: "other"; number: 40 }')
    text = text.replace('title: "A"', 'title: "Front"; share: 3')
    assert stage.show(text)
    assert (mark.property("name"), mark.property("number")) == ("other", 40)
    item = stage.item("Front")
    assert item.property("title") == "Front"
    stage.wait(lambda: abs(item.width() - 588) < 10)
    # Without them: as before.
    assert stage.show(LAYOUT.replace('"a" }', '"a"; number: 1 }'))
    assert mark.property("name") == "a"
    stage.wait(lambda: abs(item.width() - 391) < 10)
    assert stage.counts() == (5, 0)
    assert len(stage.loads) == 1


def test_other_changes_make_the_panel_again_alone(stage: Stage) -> None:
    others = {name: stage.find(f"mark_{name}") for name in "bcde"}
    assert stage.show(
        LAYOUT.replace('Mark { name: "a" }', 'Mark { name: "a"; number: root_.made }')
    )
    stage.wait(lambda: stage.counts() == (6, 1))
    assert len(stage.loads) == 1
    assert {name: stage.find(f"mark_{name}") for name in "bcde"} == others
    # In the context of the root: its ids resolve, and the binding lives.
    assert stage.find("mark_a").property("number") == 6
    stage.live.root.setProperty("made", 10)
    assert stage.find("mark_a").property("number") == 10


def test_a_new_panel_and_a_new_import(stage: Stage) -> None:
    marks = {name: stage.find(f"mark_{name}") for name in "abcde"}
    text = LAYOUT.replace("import Ros2 1.0", "import QtQuick.Shapes 1.15\nimport Ros2 1.0")
    edits = LayoutEdits(Document(text))
    edits.add('Panel { id: sixth; title: "F"; Shape { objectName: "shape" } }')
    assert stage.live.show(edits.document)
    assert stage.find("shape") is not None
    assert stage.counts() == (5, 0)
    assert {name: stage.find(f"mark_{name}") for name in "abcde"} == marks
    # An id of a panel that was made alone is not known elsewhere: loaded as a whole.
    assert stage.show(edits.document.text.replace('name: "a"', "name: sixth.title"))
    assert len(stage.loads) == 2
    assert stage.find("mark_F") is not None


def test_types_of_a_new_import_are_registered(python: Any, tmp_path: Path) -> None:
    """In a process of its own, where no other test has registered them."""
    (tmp_path / "Mark.qml").write_text(MARK)
    program = python(
        f"""
import json
from rosglass.qt import QtCore, QtGui, QtQuick
app = QtGui.QGuiApplication([])
from rosglass.cockpit.live_layout import LiveLayout
from rosglass.cockpit.qml_document import Document
from rosglass.qml import Session
session = Session("local://imports")
live = LiveLayout({str(tmp_path / "layout.qml")!r}, session)
text = {LAYOUT!r}
assert live.show(Document(text)), live.problem
loads = []
live.loaded.connect(lambda: loads.append(1))
text = text.replace("import Ros2 1.0", "import Ros2 1.0\\nimport RosScene 1.0")
text = text.replace('Mark {{ name: "e" }}', "SceneView {{}}")
assert live.show(Document(text)), live.problem
page = live.document.root.children[-1]
print("PROBLEM", repr(live.item_of(page.children[0]).property("problem")), loads, flush=True)
live.close()
session.close()
"""
    )
    assert program.until("PROBLEM") == "PROBLEM '' []"


@pytest.mark.parametrize(
    "change",
    [
        ("property int gone: 0", "property int gone: 0; property int more: 1"),
        ("import Ros2 1.0\n", ""),
        ("id: root_", "id: root_; onReceivedChanged: made = 1"),
        ('    Page {\n        title: "One"', '    Item { }\n    Page {\n        title: "One"'),
    ],
)
def test_all_else_loads_the_file_again(stage: Stage, change: tuple[str, str]) -> None:
    text = LAYOUT.replace("import RosControls 1.0\n", "")
    assert stage.show(text)
    loads = len(stage.loads)
    assert stage.show(text.replace(*change))
    assert len(stage.loads) == loads + 1


def test_errors_are_said_and_the_last_layout_stays(stage: Stage) -> None:
    mark = stage.find("mark_a")
    assert not stage.show(LAYOUT.replace("property int gone: 0", "property int gone: 0; oops: 1"))
    assert f"{stage.file}:10:27: " in stage.live.problem
    assert "oops" in stage.live.problem
    assert stage.find("mark_a") is mark
    assert stage.show(LAYOUT)
    assert stage.live.problem == ""
    assert stage.find("mark_a") is mark


def test_a_panel_with_an_error_says_it_and_all_else_lives(stage: Stage) -> None:
    text = LAYOUT.replace('Mark { name: "e" }', "\n\n            Nonsense { a: 1 }")
    text = text.replace('Mark { name: "c" }', "Mark { wrong: 3 }")
    # Loaded as a whole, with a property of the root.
    text = text.replace("id: root_", "id: root_; property int more")
    assert stage.show(text)
    assert len(stage.loads) == 2
    assert stage.counts() == (3, 0)
    assert f"{stage.file}:32:13: Nonsense is not a type" in stage.item("E").property("problem")
    assert "wrong" in stage.item("C").property("problem")
    # Corrected: only these are made.
    assert stage.show(text.replace("Nonsense { a: 1 }", 'Mark { name: "e" }'))
    assert stage.find("mark_e") is not None
    assert stage.item("E").property("problem") == ""
    assert len(stage.loads) == 2


def test_a_new_panel_with_an_error_says_it(stage: Stage) -> None:
    text = LAYOUT.replace('Mark { name: "e" }', "\n\n            Nonsense { a: 1 }")
    assert stage.show(text)
    assert len(stage.loads) == 1
    assert f"{stage.file}:32:13: Nonsense is not a type" in stage.item("E").property("problem")


def test_the_hand_edits_the_document(stage: Stage) -> None:
    edits: list[tuple[str, Document]] = []
    stage.live.edited.connect(lambda name, document: edits.append((name, document)))
    root = stage.live.root
    root.setProperty("editing", True)
    root.moved.emit(stage.item("A"), stage.item("B"), "top")
    assert edits[-1][0] == "Move A"
    assert stage.live.show(edits[-1][1])
    root.resized.emit(stage.item("A").parentItem(), [2, 1, 1])
    assert edits[-1][0] == "Resize"
    assert 'title: "A"; share: 2' in edits[-1][1].text
    root.detached.emit(stage.item("C"), "", 10, 20, 300, 200)
    assert edits[-1][0] == "Move C to a window"
    root.renamed.emit(stage.item("C"), "See")
    assert edits[-1][0] == "Rename C"
    root.removed.emit(stage.item("D"))
    assert edits[-1][0] == "Remove D"
    root.pageAdded.emit()
    assert 'title: "Page 3"' in edits[-1][1].text
    root.pageMoved.emit(stage.item("Two"), 0)
    assert edits[-1][0] == "Move page Two"


def test_a_real_drag_changes_text_and_screen(stage: Stage) -> None:
    from rosglass.qt import QtCore, optional

    test = optional("QtTest").QTest
    stage.live.edited.connect(lambda _, document: stage.live.show(document))
    stage.live.root.setProperty("editing", True)
    mark = stage.find("mark_a")

    def scene(item: Any, x: float, y: float) -> Any:
        return item.mapToScene(QtCore.QPointF(x, y)).toPoint()

    start = scene(stage.item("A"), 60, 12)
    end = scene(stage.item("B"), 100, stage.item("B").height() - 10)
    left, none = QtCore.Qt.MouseButton.LeftButton, QtCore.Qt.KeyboardModifier.NoModifier
    test.mousePress(stage.window, left, none, start)
    test.mouseMove(stage.window, start + (end - start) / 2)
    test.mouseMove(stage.window, end)
    test.mouseRelease(stage.window, left, none, end)
    assert stage.document.text.index('title: "B"') < stage.document.text.index('title: "A"')
    assert "Split {" in stage.document.text
    assert stage.find("mark_a") is mark
    assert stage.boxes()["A"][1] > stage.boxes()["B"][1]


def test_types_written_by_hand_are_not_followed_but_shown(stage: Stage) -> None:
    stage.file.with_name("Mine.qml").write_text(
        'import QtQuick 2.15\nimport RosCockpit 1.0\nPanel { title: "mine"; Item {} }'
    )
    text = LAYOUT.replace('Panel { title: "A"; Mark { name: "a" } }', "Mine { }")
    assert stage.show(text)
    assert stage.live.item_of(stage.document.root.children[0]) is None
    refused: list[str] = []
    stage.live.refused.connect(refused.append)
    stage.live.root.removed.emit(stage.live.root.property("page"))
    assert refused == ["This was written by hand: change it in the text of the layout"]
    assert stage.show(text.replace('title: "B"', 'title: "Z"'))
    assert len(stage.loads) == 3


def test_a_layout_fills_its_container(stage: Stage) -> None:
    from rosglass.qt import QtCore, QtQuick

    stage.window.contentItem().setSize(QtCore.QSizeF(500, 400))
    assert (stage.live.root.width(), stage.live.root.height()) == (500, 400)
    other = QtQuick.QQuickItem(stage.window.contentItem())
    other.setSize(QtCore.QSizeF(300, 200))
    stage.live.put_into(other)
    assert stage.live.root.parentItem() is other
    assert stage.live.root.width() == 300
    other.setSize(QtCore.QSizeF(310, 200))
    assert stage.live.root.width() == 310
    stage.window.contentItem().setSize(QtCore.QSizeF(600, 400))
    assert stage.live.root.width() == 310


def test_a_window_closed_in_edit_mode_gives_its_panels_back(stage: Stage) -> None:
    from rosglass.qt import QtGui

    stage.live.edited.connect(lambda _, document: stage.live.show(document))
    assert stage.edit(lambda edits: edits.to_window(stage.panel("A"), "", 0, 0, 300, 200))
    root = stage.live.root
    root.setProperty("editing", True)
    window = next(one for one in QtGui.QGuiApplication.topLevelWindows() if one.title() == "A")
    stage.wait(window.isExposed)
    mark = stage.find_in(window, "mark_a")
    window.close()
    stage.wait(lambda: "PanelWindow" not in stage.document.text)
    root.setProperty("pageIndex", 1)
    stage.wait(lambda: stage.find("mark_a") is mark)
    assert mark.isVisible()
    assert stage.counts() == (5, 0)
