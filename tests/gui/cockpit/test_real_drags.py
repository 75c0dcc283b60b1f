"""Edit mode with a real mouse and keyboard, on two screens of an X server."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually, nothing_happens

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytest.importorskip("PySide6", reason="the editor needs Qt 6")
pytestmark = pytest.mark.skipif(
    shutil.which("xdotool") is None, reason="needs sudo apt-get install xdotool"
)

LAYOUT = """import QtQuick 2.15
import RosControls 1.0
import RosCockpit 1.0

Cockpit {
    nodeName: "ui"
    Page {
        title: "One"
        Panel { title: "A"; Rectangle { color: "steelblue" } }
        Panel { title: "B"; Rectangle { color: "seagreen" } }
    }
    Page {
        title: "Two"
        Panel { title: "C"; Rectangle { color: "darkorange" } }
    }
}
"""
#: Shows the layout, follows the hand, and prints its state whenever that changes.
PROGRAM = """
import json, sys
from rosglass.qt import QtCore, QtGui, QtQuick
app = QtGui.QGuiApplication(sys.argv)
from rosglass.cockpit.layout_changes import elements_in
from rosglass.cockpit.live_layout import LiveLayout
from rosglass.cockpit.qml_document import Document
from rosglass.qml import Session
session = Session("local://drags")
window = QtQuick.QQuickWindow()
window.setTitle("main")
window.setGeometry(40, 30, 700, 500)
window.show()
live = LiveLayout(sys.argv[1], session, window.contentItem())
def fill():
    window.contentItem().setSize(QtCore.QSizeF(window.size()))
fill()
live.edited.connect(lambda name, document: live.show(document))
assert live.show(Document(open(sys.argv[1]).read(), sys.argv[1])), live.problem
live.root.setProperty("editing", "--use" not in sys.argv)
last = ""
def report():
    global last
    boxes = {}
    for one in elements_in(live.document):
        item = live.item_of(one)
        if item.isVisible() and one.type == "Panel":
            at = item.mapToGlobal(QtCore.QPointF(0, 0))
            boxes[item.property("title")] = [at.x(), at.y(), item.width(), item.height()]
    waiting = [live.root]
    while waiting:
        one = waiting.pop()
        waiting += one.childItems()
        if one.objectName() in ("page0", "page1"):
            at = one.mapToGlobal(QtCore.QPointF(0, 0))
            boxes[one.objectName()] = [at.x(), at.y(), one.width(), one.height()]
    windows = [w.title() for w in app.topLevelWindows() if w.isVisible()]
    state = dict(text=live.document.text, boxes=boxes, page=live.root.property("pageIndex"),
                 maximized=live.root.property("maximized") is not None, windows=sorted(windows),
                 active=window.isActive(), screens=[s.name() for s in app.screens()])
    line = json.dumps(state)
    if line != last:
        last = line
        print(line, flush=True)
timer = QtCore.QTimer(); timer.timeout.connect(report); timer.start(30)
app.exec()
"""


class Hand:
    """The program, and xdotool on its screen."""

    def __init__(self, folder: Path, display: str, *words: str) -> None:
        (folder / "program.py").write_text(PROGRAM)
        (folder / "layout.qml").write_text(LAYOUT)
        env = {**os.environ, "DISPLAY": display, "QT_QPA_PLATFORM": "xcb"}
        self._env = env | {"QT_QUICK_BACKEND": "software"}
        self._program = subprocess.Popen(
            [sys.executable, str(folder / "program.py"), str(folder / "layout.qml"), *words],
            env=self._env,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.lines: list[str] = []
        threading.Thread(target=self._read, daemon=True).start()
        self.wait(lambda state: "A" in state["boxes"])

        def is_active() -> bool:
            self.x11("search --name main windowfocus")
            return bool(self.state["active"])

        eventually(is_active, lambda: self.lines[-3:])

    def _read(self) -> None:
        assert self._program.stdout is not None
        for line in self._program.stdout:
            self.lines.append(line)

    @property
    def state(self) -> dict[str, Any]:
        found = next((one for one in reversed(self.lines) if one.startswith("{")), "{}")
        return {"boxes": {}, "text": "", "active": False, **json.loads(found)}

    def wait(self, condition: Any) -> dict[str, Any]:
        """Wait for a state, and return it."""
        eventually(lambda: condition(self.state), lambda: "".join(self.lines[-3:]))
        return self.state

    def x11(self, words: str) -> None:
        """Give commands to xdotool."""
        subprocess.run(["xdotool", *words.split()], env=self._env, check=False, timeout=20)

    def title(self, name: str) -> tuple[int, int]:
        x, y, *_ = self.state["boxes"][name]
        return round(x) + 30, round(y) + 12

    def point(self, name: str, across: float, down: float) -> tuple[int, int]:
        x, y, width, height = self.state["boxes"][name]
        return round(x + width * across), round(y + height * down)

    def press(self, start: tuple[int, int], *way: tuple[int, int]) -> None:
        """Press at a point, and move the mouse."""
        self.x11(f"mousemove {start[0]} {start[1]} mousedown 1")
        at = start
        for x, y in way:
            middle = (at[0] + x) // 2, (at[1] + y) // 2
            self.x11(f"mousemove {middle[0]} {middle[1]} mousemove {x} {y}")
            at = x, y

    def drag(self, start: tuple[int, int], *way: tuple[int, int]) -> None:
        self.press(start, *way)
        self.x11("mouseup 1")

    def close(self) -> None:
        self._program.kill()
        self._program.wait(10)


@pytest.fixture
def display() -> Iterator[str]:
    reader, writer = os.pipe()
    command = ["Xvfb", "-displayfd", str(writer), "-nolisten", "tcp"]
    for number in range(2):
        command += ["-screen", str(number), "1000x700x24"]
    server = subprocess.Popen(
        command, pass_fds=[writer], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    os.close(writer)
    with os.fdopen(reader) as numbers:
        number = numbers.readline().strip()
    assert number, "Xvfb did not start"
    yield f":{number}"
    server.terminate()
    server.wait(10)


@pytest.fixture
def hand(tmp_path: Path, display: str) -> Iterator[Hand]:
    made = Hand(tmp_path, display)
    yield made
    made.close()


def test_dragged_by_the_mouse(hand: Hand) -> None:
    # Below B.
    hand.drag(hand.title("A"), hand.point("B", 0.5, 0.93))
    state = hand.wait(lambda state: state["boxes"]["A"][1] > state["boxes"]["B"][1] + 100)
    assert "orientation: Qt.Vertical" in state["text"]
    # The edge between them.
    height = state["boxes"]["B"][3]
    edge = hand.point("B", 0.5, 1)
    hand.drag((edge[0], edge[1] + 3), (edge[0], edge[1] - 77))
    state = hand.wait(lambda state: state["boxes"]["B"][3] < height - 60)
    assert "share:" in state["text"]
    # To tabs, and one of them back to the side.
    hand.drag(hand.title("A"), hand.point("B", 0.5, 0.5))
    state = hand.wait(lambda state: "Tabs {" in state["text"])
    x, y, *_ = state["boxes"]["B"] if "B" in state["boxes"] else state["boxes"]["A"]
    hand.drag((round(x) + 10, round(y) - 14), (round(x) + 5, round(y) + 200))
    hand.wait(lambda state: "Tabs {" not in state["text"])


def test_dragged_to_another_page(hand: Hand) -> None:
    hand.press(hand.title("A"), hand.point("page1", 0.5, 0.5))
    hand.wait(lambda state: state["page"] == 1 and "C" in state["boxes"])
    x, y = hand.point("C", 0.05, 0.5)
    hand.x11(f"mousemove {x + 3} {y} mousemove {x} {y} mouseup 1")
    state = hand.wait(lambda state: state["text"] != LAYOUT)
    assert state["text"].index('"Two"') < state["text"].index('"A"') < state["text"].index('"C"')


def test_dragged_out_of_the_window_and_back(hand: Hand) -> None:
    hand.drag(hand.title("A"), (850, 300))
    state = hand.wait(lambda state: state["windows"] == ["A", "main"])
    assert "PanelWindow {" in state["text"]
    hand.wait(lambda state: state["boxes"]["A"][0] > 500)
    # From there, by its title, to the left of B.
    hand.drag(hand.title("A"), hand.point("B", 0.1, 0.5))
    state = hand.wait(lambda state: state["windows"] == ["main"])
    assert "PanelWindow" not in state["text"]
    assert state["boxes"]["A"][0] < state["boxes"]["B"][0]


def test_escape_cancels_a_drag(hand: Hand) -> None:
    before = hand.state["text"]
    hand.press(hand.title("A"), hand.point("B", 0.5, 0.9))
    hand.x11("key Escape")
    hand.x11("mouseup 1")
    nothing_happens(0.3)
    assert hand.state["text"] == before
    assert hand.state["text"] == LAYOUT


def test_the_keyboard_moves_and_resizes(hand: Hand) -> None:
    hand.x11("key F6")
    hand.x11("key ctrl+shift+Right")
    hand.wait(lambda state: state["boxes"]["A"][0] > state["boxes"]["B"][0])
    width = hand.state["boxes"]["A"][2]
    hand.x11("key F8 Left Left Return")
    hand.wait(lambda state: state["boxes"]["A"][2] > width + 30)


def test_nothing_moves_in_use_mode(tmp_path: Path, display: str) -> None:
    hand = Hand(tmp_path, display, "--use")
    try:
        before = hand.state["boxes"]
        hand.drag(hand.title("A"), hand.point("B", 0.5, 0.93))
        edge = hand.point("A", 1, 0.5)
        hand.drag((edge[0] + 3, edge[1]), (edge[0] + 83, edge[1]))
        hand.x11("key ctrl+shift+Right key Delete")
        nothing_happens(0.3)
        assert hand.state["boxes"] == before
        # A double click on the title lets it fill its page.
        x, y = hand.title("A")
        hand.x11(f"mousemove {x} {y} click --repeat 2 --delay 50 1")
        hand.wait(lambda state: state["maximized"] and state["boxes"]["A"][2] > 600)
    finally:
        hand.close()
