"""Menus, lists, drags and text of widgets over RViz's 3D view, which Qt thinks of as a scene."""

from __future__ import annotations

import functools
import subprocess
import threading
import time
from typing import TYPE_CHECKING, Any

import pytest
from waiting import eventually

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.fixture
def panel(app: Any, hand: Any) -> Any:
    """An overlay with what opens something."""
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtCore, QtWidgets

    class Panel(WidgetOverlay):
        def setup(self, root: Any) -> None:
            self.chosen: list[str] = []
            self.bar = QtWidgets.QMenuBar()
            menu = self.bar.addMenu("File")
            self.sub = menu.addMenu("More")
            self.sub.addAction("Deep", lambda: self.chosen.append("deep"))
            self.tool, self.push = QtWidgets.QToolButton(), QtWidgets.QPushButton("push")
            self.tool.setText("tool")
            self.tool.setPopupMode(QtWidgets.QToolButton.InstantPopup)
            for opener in (self.tool, self.push):
                opens = QtWidgets.QMenu(opener)
                opens.addAction("first", functools.partial(self.chosen.append, opener.text()))
                opener.setMenu(opens)
            self.custom, self.actions = QtWidgets.QPushButton("a"), QtWidgets.QPushButton("b")
            self.custom.setContextMenuPolicy(QtCore.Qt.CustomContextMenu)
            self.custom.customContextMenuRequested.connect(self.open_menu)
            self.actions.setContextMenuPolicy(QtCore.Qt.ActionsContextMenu)
            action = QtWidgets.QAction("act", self.actions)
            action.triggered.connect(lambda: self.chosen.append("action"))
            self.actions.addAction(action)
            self.text, self.other = QtWidgets.QLineEdit("hello world"), QtWidgets.QLineEdit()
            self.text.setToolTip("what to say")
            self.combo = QtWidgets.QComboBox()
            self.combo.addItems([f"item {n}" for n in range(60)])
            self.number = QtWidgets.QSpinBox()
            self.list = QtWidgets.QListWidget()
            self.list.addItems(["a", "b", "c"])
            self.list.setDragDropMode(QtWidgets.QAbstractItemView.InternalMove)
            self.plain = QtWidgets.QPushButton("plain")
            layout = QtWidgets.QVBoxLayout(root)
            layout.setAlignment(QtCore.Qt.AlignTop | QtCore.Qt.AlignLeft)
            for widget in (
                self.bar, self.tool, self.push, self.custom, self.actions, self.text, self.other,
                self.number, self.combo, self.list, self.plain,
            ):  # fmt: skip
                widget.setFixedSize(160, 80 if widget is self.list else 26)
                layout.addWidget(widget)

        def open_menu(self, at: Any) -> None:
            menu = QtWidgets.QMenu(self.custom)
            menu.addAction("custom", lambda: self.chosen.append("custom"))
            menu.popup(self.custom.mapToGlobal(at))

        def opened(self) -> list[Any]:
            """Return the menus that are open over the view."""
            windows = QtWidgets.QApplication.topLevelWidgets()
            menus = [w for w in windows if w.windowType() == QtCore.Qt.Popup and w.isVisible()]
            return [menu for menu in menus if menu.graphicsProxyWidget() is not None]

        def room(self) -> Any:
            """Return the view, in units of the scene."""
            return self.root.graphicsProxyWidget().scene().sceneRect()

    overlay = app.add(Panel())
    hand.wait.frames(6)
    return overlay


@pytest.fixture
def act(hand: Any) -> Callable[..., None]:
    """Use mouse and keys from another thread: Qt's menus wait in a loop of their own."""
    from rosglass.rviz.qt5 import QtCore

    def run(*steps: Any) -> None:
        origin = hand.panel.mapToGlobal(QtCore.QPoint(0, 0))

        def go() -> None:
            for step in steps:
                if callable(step):
                    eventually(step)
                    continue
                kind, *words = step
                if kind == "at":
                    x, y = words
                    words = [round(x) + origin.x(), round(y) + origin.y()]
                    kind = "mousemove"
                subprocess.run(["xdotool", kind, *map(str, words)], check=True)
                time.sleep(0.1)

        thread = threading.Thread(target=go)
        thread.start()
        hand.wait(lambda: not thread.is_alive(), timeout=60.0)

    return run


def at(widget: Any, across: float = 0, down: float = 0) -> tuple[str, float, float]:
    middle = widget.mapTo(widget.window(), widget.rect().center())
    return "at", middle.x() + across, middle.y() + down


LEFT, RIGHT = ("click", 1), ("click", 3)


def test_menus_of_buttons_open_where_they_belong(panel: Any, act: Any) -> None:
    for opener in (panel.tool, panel.push):
        act(at(opener), LEFT, opener.menu().isVisible, at(opener, -40, 25), LEFT)
        assert panel.chosen.pop() == opener.text()
        act(at(opener), LEFT, opener.menu().isVisible, ("at", 500, 500), LEFT)
        assert not opener.menu().isVisible()
    assert panel.chosen == []


def test_submenus_are_inside_the_view(panel: Any, act: Any) -> None:
    boxes: list[Any] = []

    def opened() -> bool:
        if not panel.sub.isVisible():
            return False
        shown = panel.sub.graphicsProxyWidget()
        boxes.append(shown.mapRectToScene(shown.rect()))
        return bool(panel.room().contains(boxes[-1]))

    keys = [("key", key) for key in ("Down", "Right")]
    act(at(panel.bar, -60), LEFT, *keys, opened, ("key", "Return"))
    assert panel.chosen == ["deep"]
    assert boxes[-1].left() > 0
    assert panel.room().contains(boxes[-1])


def test_context_menus(panel: Any, act: Any, view: Any) -> None:
    act(at(panel.custom), RIGHT, panel.opened, at(panel.custom, 10, 10), LEFT)
    act(at(panel.actions), RIGHT, panel.opened, at(panel.actions, 10, 10), LEFT)
    assert panel.chosen == ["custom", "action"]
    # By the keyboard, beside what has the keys.
    act(at(panel.custom), LEFT, ("at", 500, 500), ("key", "Menu"), panel.opened)
    box = panel.opened()[0].graphicsProxyWidget().sceneBoundingRect()
    assert abs(box.top() - panel.custom.geometry().center().y()) < 20
    act(("key", "Down"), ("key", "Return"))
    assert panel.chosen == ["custom", "action", "custom"]
    # Qt's own; after it, keys are the field's again.
    act(at(panel.text), RIGHT, panel.opened, ("key", "Escape"), panel.text.hasFocus)
    act(("key", "End"), ("key", "s"))
    assert panel.text.text() == "hello worlds"
    # Beside it, the mouse leaves it open until it presses; keys are the field's then as well.
    beside = ("at", 500, 500)
    act(at(panel.text), RIGHT, panel.opened, beside, ("at", 520, 500))
    assert panel.opened()
    act(LEFT, panel.text.hasFocus, ("key", "End"), ("key", "t"))
    assert not panel.opened()
    assert panel.text.text() == "hello worldst"
    # What has no menu leaves the button to RViz, which zooms.
    distance = view("Distance")
    _, x, y = at(panel.plain)
    act(("at", x, y), ("mousedown", 3), ("at", x, y + 40), ("at", x, y + 80), ("mouseup", 3))
    act(lambda: view("Distance") != distance)
    assert view("Distance") != distance


def test_long_lists_are_inside_the_view(panel: Any, act: Any) -> None:
    act(at(panel.combo), LEFT, panel.combo.view().isVisible)
    shown = panel.combo.view().window().graphicsProxyWidget()
    act(lambda: panel.room().contains(shown.sceneBoundingRect()))
    assert panel.room().contains(shown.sceneBoundingRect())
    act(("key", "End"), ("key", "Return"))
    assert panel.combo.currentText() == "item 59"
    act(panel.combo.hasFocus, ("key", "Up"))
    assert panel.combo.currentText() == "item 58"


def test_items_are_dragged_within_a_list(panel: Any, act: Any, caplog: Any) -> None:
    across, top = -50, -30
    ways = [at(panel.list, across, top + way) for way in (0, 4, 12, 30, 50)]
    act(ways[0], ("mousedown", 1), *ways[1:], ("mouseup", 1))
    assert [panel.list.item(row).text() for row in range(panel.list.count())] == ["b", "c", "a"]
    assert caplog.text == ""
    act(at(panel.tool), LEFT, panel.tool.menu().isVisible, ("key", "Escape"))


def test_tooltips_are_shown_beside_the_mouse(panel: Any, hand: Any, app: Any) -> None:
    from rosglass.rviz.qt5 import QtGui, QtWidgets

    _, x, y = at(panel.text)
    hand.move(x, y)
    hand.wait(QtWidgets.QToolTip.isVisible)
    assert QtWidgets.QToolTip.text() == "what to say"
    tips = [w for w in app.qt.topLevelWidgets() if w.objectName() == "qtooltip_label"]
    seen = tips[0].geometry().topLeft() - QtGui.QCursor.pos()
    assert abs(seen.x()) < 40
    assert abs(seen.y()) < 40
    hand.move(500, 500)


def test_text_is_selected_copied_and_composed(panel: Any, act: Any, app: Any) -> None:
    from rosglass.rviz.qt5 import QtCore, QtGui

    way = [at(panel.text, across) for across in (-76, -30, 70)]
    act(way[0], ("mousedown", 1), *way[1:], ("mouseup", 1), ("key", "ctrl+c"))
    assert panel.text.selectedText() == "hello world"
    act(at(panel.other), LEFT, ("key", "ctrl+v"))
    assert panel.other.text() == "hello world"
    act(at(panel.text), ("click", "--repeat", 2, "--delay", 40, 1))
    assert panel.text.selectedText() in ("hello", "world")
    act(at(panel.other), LEFT, ("key", "ctrl+a"))
    # As a dead key, or a language that is composed, arrives.
    widget = app.window.panel
    assert widget.testAttribute(QtCore.Qt.WA_InputMethodEnabled)
    event = QtGui.QInputMethodEvent()
    event.setCommitString("\u00e9")
    QtCore.QCoreApplication.sendEvent(widget, event)
    assert panel.other.text() == "\u00e9"
    act(at(panel.number), ("click", 4), ("click", 4), ("click", 5))
    assert panel.number.value() == 1
