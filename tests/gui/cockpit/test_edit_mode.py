"""Edit mode of a layout: every wish of the hand is a signal, by mouse and by keyboard."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.both_qt

#: Collects the wishes as lists of texts and numbers.
WISHES = """
    editing: true
    property var wishes: []
    function note(...wish) { wishes = wishes.concat([wish]) }
    function name(one) { return one.objectName || one.title || one.element_ }
    onMoved: (panel, target, edge) => note("moved", name(panel), name(target), edge)
    onResized: (split, shares) => note("resized", name(split), shares)
    onDetached: (panel, screen, x, y, width, height) => note("detached", name(panel), width, height)
    onRenamed: (one, title) => note("renamed", name(one), title)
    onRemoved: one => note("removed", name(one))
    onPageAdded: note("page")
    onPageMoved: (page, index) => note("pageMoved", name(page), index)
"""


def panel(name: str, more: str = "") -> str:
    return f'Panel {{ objectName: "{name}"; title: "{name}"; {more} Item {{}} }}'


LAYOUT = f"""
    Page {{ objectName: "one"; title: "One"; spacing: 10
        {panel("a")}
        Split {{ objectName: "right"; orientation: Qt.Vertical; spacing: 10
            {panel("b")}
            Tabs {{ objectName: "tabs"; {panel("c")} {panel("d")} }} }} }}
    Page {{ objectName: "two"; title: "Two"; {panel("e")} }}
"""


class Hand:
    """The mouse over a layout."""

    def __init__(self, layouts: Any) -> None:
        from rosglass.qt import QtCore, optional

        self._layouts, self._test = layouts, optional("QtTest").QTest
        self._left = QtCore.Qt.MouseButton.LeftButton
        self._none = QtCore.Qt.KeyboardModifier.NoModifier
        self._point = QtCore.QPoint

    def title(self, name: str) -> Any:
        """Return a point on the title of a panel."""
        return self._layouts.point(name, 0.3, 0) + self._point(0, 12)

    def press(self, point: Any) -> None:
        self._test.mousePress(self._layouts.window, self._left, self._none, point)

    def move(self, point: Any) -> None:
        """Move the pressed mouse."""
        from rosglass.qt import QtCore, QtGui

        window = self._layouts.window
        event = QtGui.QMouseEvent(
            QtCore.QEvent.Type.MouseMove,
            QtCore.QPointF(point),
            QtCore.QPointF(window.mapToGlobal(point)),
            QtCore.Qt.MouseButton.NoButton,
            self._left,
            self._none,
        )
        QtCore.QCoreApplication.sendEvent(window, event)

    def release(self, point: Any) -> None:
        self._test.mouseRelease(self._layouts.window, self._left, self._none, point)

    def drag(self, start: Any, end: Any) -> None:
        """Drag from a point to another."""
        self.press(start)
        self.move(start + (end - start) / 2)
        self.move(end)
        self.release(end)


@pytest.fixture
def hand(layouts: Any) -> Hand:
    layouts.show(WISHES + LAYOUT)
    return Hand(layouts)


def wishes(layouts: Any) -> list[Any]:
    value = layouts.root.property("wishes")
    return list(value.toVariant() if hasattr(value, "toVariant") else value)


@pytest.mark.parametrize(
    ("across", "down", "edge"),
    [
        (0.05, 0.5, "left"),
        (0.95, 0.5, "right"),
        (0.5, 0.12, "top"),
        (0.5, 0.95, "bottom"),
        (0.5, 0.5, "center"),
    ],
)
def test_dragged_to_a_side_of_another_panel(
    layouts: Any, hand: Hand, across: float, down: float, edge: str
) -> None:
    target = layouts.point("b", across, down)
    hand.press(hand.title("a"))
    hand.move(hand.title("a") + (target - hand.title("a")) / 2)
    hand.move(target)
    mark = layouts.find("dropMark")
    assert mark.isVisible()
    x, y, width, height = layouts.place("b")
    expected = {
        "left": (x, y, width / 2, height),
        "right": (x + width / 2, y, width / 2, height),
        "top": (x, y, width, height / 2),
        "bottom": (x, y + height / 2, width, height / 2),
        "center": (x, y, width, height),
    }[edge]
    assert layouts.place(mark) == tuple(round(one) for one in expected)
    hand.release(target)
    assert wishes(layouts) == [["moved", "a", "b", edge]]
    assert not mark.isVisible()


def test_dragged_to_the_rim_of_the_page(layouts: Any, hand: Hand) -> None:
    from rosglass.qt import QtCore

    x, y, _, height = layouts.place("one")
    hand.drag(layouts.point("tab0"), QtCore.QPoint(x + 3, y + height // 2))
    assert wishes(layouts) == [["moved", "c", "one", "left"]]


def test_dragged_among_tabs(layouts: Any, hand: Hand) -> None:
    from rosglass.qt import QtCore

    tab = layouts.find("tab1")
    hand.drag(hand.title("a"), layouts.point(tab, 0.1))
    hand.drag(layouts.point("tab0"), layouts.point(tab, 0.9))
    hand.drag(hand.title("a"), layouts.point("tabs", 0.5, 0.5))
    # Onto its own place: nothing.
    hand.drag(hand.title("a"), hand.title("a") + QtCore.QPoint(40, 40))
    assert wishes(layouts) == [
        ["moved", "a", "d", "before"],
        ["moved", "c", "d", "after"],
        ["moved", "a", "tabs", "center"],
    ]


def test_dragged_over_the_button_of_a_page(layouts: Any, hand: Hand) -> None:
    start, over = hand.title("a"), layouts.point("page1")
    hand.press(start)
    hand.move(over)
    layouts.wait(lambda: layouts.root.property("pageIndex") == 1)
    target = layouts.point("e", 0.5, 0.9)
    hand.move(target)
    hand.release(target)
    assert wishes(layouts) == [["moved", "a", "e", "bottom"]]


def test_dropped_on_the_button_of_a_page(layouts: Any, hand: Hand) -> None:
    hand.drag(hand.title("a"), layouts.point("page1"))
    assert wishes(layouts) == [["moved", "a", "two", "center"]]


def test_dragged_out_of_the_window(layouts: Any, hand: Hand) -> None:
    from rosglass.qt import QtCore

    _, _, width, height = layouts.place("a")
    hand.drag(hand.title("a"), QtCore.QPoint(layouts.window.width() + 60, 300))
    assert wishes(layouts) == [["detached", "a", width, height]]


def test_escape_cancels_a_drag(layouts: Any, hand: Hand) -> None:
    target = layouts.point("b", 0.9, 0.5)
    hand.press(hand.title("a"))
    hand.move(target)
    layouts.key("Esc")
    assert not layouts.find("dropMark").isVisible()
    hand.move(target)
    hand.release(target)
    assert wishes(layouts) == []


def test_a_panel_is_chosen_when_it_is_let_go(layouts: Any, hand: Hand) -> None:
    """An editor shows its form then, which must not move the layout below a drag."""
    target = layouts.point("b", 0.5, 0.5)
    hand.press(hand.title("a"))
    hand.move(target)
    assert layouts.root.property("current") is None
    hand.release(target)
    assert layouts.root.property("current") is layouts.find("a")
    hand.press(hand.title("b"))
    assert layouts.root.property("current") is layouts.find("a")
    hand.release(hand.title("b"))
    assert layouts.root.property("current") is layouts.find("b")


def test_nothing_moves_in_use_mode(layouts: Any, hand: Hand) -> None:
    layouts.root.setProperty("editing", False)
    layouts.wait(lambda: layouts.search("handle0") is None)
    assert layouts.search("dropMark") is None
    hand.drag(hand.title("a"), layouts.point("b", 0.9, 0.5))
    for keys in ("Ctrl+Shift+Right", "F8", "F2", "Del"):
        layouts.key(keys)
    assert wishes(layouts) == []
    assert layouts.search("titleField") is None


def test_an_edge_is_dragged(layouts: Any, hand: Hand) -> None:
    from rosglass.qt import QtCore

    # Between a and what is on its right.
    handle = hand.title("a")
    handle.setX(sum(layouts.place("a")[::2]) + 5)
    width = layouts.place("a")[2]
    hand.press(handle)
    hand.move(handle + QtCore.QPoint(100, 0))
    assert layouts.place("a")[2] == width + 100
    hand.release(handle + QtCore.QPoint(100, 0))
    assert wishes(layouts) == [["resized", "one", [1.26, 0.74]]]
    # Without an editor, nothing has changed.
    layouts.wait(lambda: layouts.place("a")[2] == width)


def test_the_keyboard_resizes(layouts: Any, hand: Hand) -> None:
    layouts.key("F6")
    layouts.key("F8")
    layouts.key("Right")
    layouts.key("Down")
    layouts.key("Return")
    layouts.key("Right")
    assert wishes(layouts) == [["resized", "one", [1.05, 0.95]]]
    layouts.key("F6")
    layouts.key("F8")
    layouts.key("Left")
    layouts.key("Down")
    names = [[*one[:2]] for one in wishes(layouts)[1:]]
    assert names == [["resized", "one"], ["resized", "right"]]


def test_the_keyboard_moves(layouts: Any, hand: Hand) -> None:
    layouts.key("F6")
    layouts.key("Ctrl+Shift+Right")
    layouts.key("Ctrl+Shift+Up")
    layouts.key("F6")
    layouts.key("Ctrl+Shift+Down")
    layouts.key("Ctrl+Shift+Left")
    layouts.key("F6")
    layouts.key("Ctrl+Shift+Up")
    assert wishes(layouts) == [
        ["moved", "a", "b", "right"],
        ["moved", "a", "one", "top"],
        ["moved", "b", "tabs", "bottom"],
        ["moved", "b", "a", "left"],
        ["moved", "c", "tabs", "top"],
    ]


def test_renamed_and_removed_by_keys(layouts: Any, hand: Hand) -> None:
    layouts.key("F6")
    layouts.key("F2")
    field = layouts.find("titleField")
    field.setProperty("text", "Front")
    layouts.key("Return")
    layouts.wait(lambda: layouts.search("titleField") is None)
    layouts.key("F2")
    layouts.find("titleField").setProperty("text", "never")
    layouts.key("Esc")
    layouts.wait(lambda: layouts.search("titleField") is None)
    layouts.key("Del")
    assert wishes(layouts) == [["renamed", "a", "Front"], ["removed", "a"]]


def test_pages_are_added_renamed_moved_and_removed(layouts: Any, hand: Hand) -> None:
    layouts.click("addPage")
    hand.drag(layouts.point("page1"), layouts.point("page0"))
    layouts.key("F2")
    layouts.find("pageField").setProperty("text", "Health")
    layouts.key("Return")
    layouts.wait(lambda: layouts.search("pageField") is None)
    layouts.click("page1")
    layouts.key("Ctrl+Shift+Left")
    layouts.key("Del")
    assert wishes(layouts) == [
        ["page"],
        ["pageMoved", "two", 0],
        ["renamed", "two", "Health"],
        ["pageMoved", "two", 0],
        ["removed", "two"],
    ]


def test_the_menu_of_edit_mode(layouts: Any, hand: Hand) -> None:
    layouts.key("F6")
    layouts.key("Shift+F10")
    layouts.wait(lambda: layouts.search("menu_page") is not None)
    layouts.click("menu_page")
    assert wishes(layouts) == [["moved", "a", "two", "center"]]


def test_detached_panels_come_back_when_edit_mode_begins(layouts: Any, hand: Hand) -> None:
    from rosglass.qt import QtCore

    layouts.root.setProperty("editing", False)
    QtCore.QMetaObject.invokeMethod(layouts.find("a"), "detach")
    assert layouts.find("a").property("detached")
    layouts.root.setProperty("editing", True)
    assert not layouts.find("a").property("detached")


def test_a_window_that_the_hand_has_moved_is_reported(layouts: Any) -> None:
    import time

    from rosglass.qt import QtGui

    layouts.show(
        WISHES
        + 'onWindowMoved: (one, screen, x, y, w, h) => note("window", x, y, w, h)\n'
        + f"Page {{ {panel('a')} }}"
        + 'PanelWindow { title: "W"; x: 10; y: 20; width: 300; height: 200; '
        + panel("b")
        + "}"
    )
    window = next(one for one in QtGui.QGuiApplication.topLevelWindows() if one.title() == "W")
    layouts.wait(window.isExposed)
    moved_at = 0.0

    def is_reported() -> bool:
        # What happens in its first second is the window manager's.
        nonlocal moved_at
        if time.monotonic() > moved_at + 0.7:
            moved_at = time.monotonic()
            window.requestActivate()
            if window.isActive():
                window.setPosition(window.x() + 5, window.y() + 7)
        return bool(wishes(layouts))

    layouts.wait(is_reported)
    assert wishes(layouts)[-1] == ["window", window.x(), window.y(), 300, 200]
