"""Delivery of the mouse, the wheel and keys: real ones, sent by the X server."""

from __future__ import annotations

from typing import Any

import pytest


def item(root: Any, name: str) -> Any:
    """Return the item of an objectName."""
    from rosglass.rviz.qt5 import QtQuick

    return root.findChild(QtQuick.QQuickItem, name)


def test_camera_moves_through_the_gaps(hand: Any, show: Any, view: Any) -> None:
    root = show(
        """Item { property int clicks: 0
        Item { anchors.fill: parent }
        Column { anchors.fill: parent }
        Button { x: 20; y: 20; width: 100; height: 50; onClicked: parent.clicks++ } }"""
    )
    yaw = view("Yaw")
    hand.click(60, 40)
    assert root.property("clicks") == 1
    hand.drag(60, 40, 260, 140)
    assert view("Yaw") == yaw
    hand.drag(300, 300, 400, 300)
    assert view("Yaw") != yaw
    distance = view("Distance")
    hand.wheel(300, 300)
    assert view("Distance") < distance


def test_every_button_is_captured_until_all_are_up(hand: Any, show: Any, view: Any) -> None:
    root = show(
        """Item { property int pressed: area.pressedButtons; property int released: 0
        MouseArea { id: area; width: 100; height: 100; acceptedButtons: Qt.AllButtons
            onReleased: parent.released++ } }"""
    )
    yaw, distance = view("Yaw"), view("Distance")
    for number, (button, code) in enumerate(((1, 1), (2, 4), (3, 2)), 1):
        hand.move(50, 50)
        hand.press(button)
        assert root.property("pressed") == code
        hand.move(300, 300)
        hand.move(340, 340)
        hand.release(button)
        assert root.property("released") == number
    hand.move(50, 50)
    hand.press(1)
    hand.press(3)
    hand.release(1)
    hand.move(300, 300)
    hand.move(300, 360)
    assert root.property("pressed") == 2
    hand.release(3)
    assert (view("Yaw"), view("Distance")) == (yaw, distance)


def test_double_clicks_arrive(hand: Any, show: Any) -> None:
    root = show(
        """Item { property string log: ""
        MouseArea { width: 100; height: 100
            onClicked: parent.log += "c"; onDoubleClicked: parent.log += "d" }
        Item { x: 100; width: 100; height: 100
            TapHandler { onTapped: top.log += "t"; onDoubleTapped: top.log += "T" } }
        id: top }"""
    )
    hand.move(50, 50)
    hand.do("click", "--repeat", 2, "--delay", 40, 1)
    assert root.property("log") == "cd"
    root.setProperty("log", "")
    hand.move(150, 50)
    hand.do("click", "--repeat", 2, "--delay", 40, 1)
    assert root.property("log") == "ttT"


def test_pointer_handlers_get_their_events(hand: Any, show: Any, view: Any) -> None:
    root = show(
        """Item { id: root; property bool hovered: hover.hovered; property int wheels: 0
        Rectangle { objectName: "dragged"; x: 50; y: 50; width: 60; height: 60; color: "red"
            DragHandler { }
            HoverHandler { id: hover; cursorShape: Qt.CrossCursor }
            WheelHandler { onWheel: root.wheels++ } } }"""
    )
    yaw, distance = view("Yaw"), view("Distance")
    hand.move(80, 80)
    assert root.property("hovered")
    hand.drag(80, 80, 280, 180)
    assert item(root, "dragged").x() > 150
    hand.wheel(280, 180)
    assert root.property("wheels") > 0
    assert (view("Yaw"), view("Distance")) == (yaw, distance)
    hand.move(20, 300)
    assert not root.property("hovered")


def test_wheel_goes_to_scrollable_items(hand: Any, show: Any, view: Any) -> None:
    root = show(
        """Item {
        Button { x: 200; width: 100; height: 100 }
        Flickable { objectName: "list"; width: 100; height: 100; contentHeight: 1000
            Rectangle { width: 100; height: 1000; color: "steelblue" } } }"""
    )
    distance = view("Distance")
    hand.wheel(50, 50, up=False)
    hand.wait(lambda: item(root, "list").property("contentY") > 0)
    assert view("Distance") == distance
    # A button has no use for it.
    hand.wheel(250, 50)
    assert view("Distance") < distance


def test_slider_is_dragged(hand: Any, show: Any, view: Any) -> None:
    root = show("Item { Slider { objectName: 'slider'; x: 20; y: 20; width: 300 } }")
    yaw = view("Yaw")
    slider = item(root, "slider")
    y = 20 + slider.height() / 2
    hand.drag(20 + 10, y, 20 + 290, y)
    assert slider.property("value") > 0.9
    assert view("Yaw") == yaw


def test_combo_box_and_menu_open_in_the_overlay(hand: Any, show: Any) -> None:
    root = show(
        """Item { property string chosen: ""
        property bool open: box.popup.visible
        ComboBox { id: box; objectName: "combo"; x: 20; y: 20; width: 150; model: ["one", "two"] }
        Button { x: 300; y: 20; width: 80; text: "Menu"; onClicked: menu.open()
            Menu { id: menu; y: parent.height
                MenuItem { text: "first"; onTriggered: root.chosen = text } } }
        id: root }"""
    )
    combo = item(root, "combo")
    hand.click(90, 20 + combo.height() / 2)
    assert root.property("open")
    # The popup lies over the box or right below it; the keys show which row is which.
    hand.key("Down", "Return")
    assert combo.property("currentIndex") == 1
    hand.click(90, 20 + combo.height() / 2)
    hand.click(90, 300)
    hand.wait(lambda: not root.property("open"))
    hand.click(340, 40)
    hand.wait.nothing_happens(0.3)
    hand.click(340, 80)
    assert root.property("chosen") == "first"


def test_keys_go_to_what_was_clicked_and_not_to_tools(hand: Any, app: Any, show: Any) -> None:
    root = show(
        """Item { property string text: a.text + "|" + b.text
        property bool focused: a.activeFocus
        TextField { id: a; x: 20; y: 20; width: 150 }
        TextField { id: b; x: 20; y: 80; width: 150 } }"""
    )
    tools = app.window.manager.getToolManager()
    tools.setCurrentTool(tools.getTool(0))
    names = [tools.getTool(i).getName() for i in range(tools.numTools())]
    hand.click(90, 35)
    assert root.property("focused")
    hand.key("m", "s", "Tab", "g")
    assert root.property("text") == "ms|g"
    assert tools.getCurrentTool().getName() == names[0]
    # The free view takes the keys back.
    hand.click(400, 400)
    assert not root.property("focused")
    hand.key("m")
    assert tools.getCurrentTool().getName() == "Move Camera"
    assert root.property("text") == "ms|g"
    hand.key("Escape")


def test_escape_gives_the_keys_back(hand: Any, app: Any, show: Any) -> None:
    show("Item { TextField { x: 20; y: 20; width: 150 } }")
    hand.click(90, 35)
    assert app.overlays.input.focused is not None
    hand.key("Escape")
    assert app.overlays.input.focused is None


def test_shortcuts_of_the_window_yield_to_a_field(hand: Any, app: Any, show: Any) -> None:
    from rosglass.rviz.qt5 import QtGui, QtWidgets

    root = show("Item { TextField { objectName: 't'; x: 20; y: 20; width: 150 } }")
    heard: list[int] = []
    shortcut = QtWidgets.QShortcut(QtGui.QKeySequence("k"), app.window.widget)
    shortcut.activated.connect(lambda: heard.append(1))
    hand.click(90, 35)
    hand.key("k")
    assert (item(root, "t").property("text"), heard) == ("k", [])
    hand.click(400, 400)
    hand.key("k")
    assert heard == [1]
    shortcut.setParent(None)


def test_cursor_is_the_items_and_then_the_tools(hand: Any, app: Any, show: Any) -> None:
    from rosglass.rviz.qt5 import QtCore

    show("Item { MouseArea { width: 100; height: 100; cursorShape: Qt.PointingHandCursor } }")
    hand.move(300, 300)
    tools = app.window.panel.cursor().shape()
    assert tools != QtCore.Qt.PointingHandCursor
    hand.move(50, 50)
    assert app.window.panel.cursor().shape() == QtCore.Qt.PointingHandCursor
    hand.wait.frames(4)
    assert app.window.panel.cursor().shape() == QtCore.Qt.PointingHandCursor
    hand.move(300, 300)
    assert app.window.panel.cursor().shape() == tools


def test_hover_ends_where_the_view_does(hand: Any, app: Any, show: Any) -> None:
    root = show(
        """Item { property bool hovered: area.containsMouse
        MouseArea { id: area; anchors.fill: parent; hoverEnabled: true
            acceptedButtons: Qt.NoButton } }"""
    )
    hand.move(300, 5)
    assert root.property("hovered")
    hand.move(-60, 300)
    hand.wait(lambda: not root.property("hovered"))


@pytest.mark.parametrize("how", ["removed", "hidden", "deactivated"])
def test_capture_ends(hand: Any, app: Any, show: Any, view: Any, how: str) -> None:
    from rosglass.rviz.qt5 import QtCore

    root = show(
        """Item { property int clicks: 0; property bool down: button.down
        Button { id: button; x: 20; y: 20; width: 100; height: 50; onClicked: parent.clicks++ }
        }"""
    )
    yaw = view("Yaw")
    overlay = app.overlays.find("Test")
    hand.move(60, 40)
    hand.press()
    assert root.property("down")
    if how == "removed":
        app.overlays.remove(overlay)
    elif how == "hidden":
        overlay.visible = False
    else:
        event = QtCore.QEvent(QtCore.QEvent.WindowDeactivate)
        QtCore.QCoreApplication.sendEvent(app.window.widget, event)
    if how != "removed":
        assert not root.property("down")
    hand.move(200, 200)
    hand.move(300, 200)
    hand.release()
    assert view("Yaw") == yaw
    if how != "removed":
        assert root.property("clicks") == 0
    hand.drag(300, 300, 400, 300)
    assert view("Yaw") != yaw


def test_positions_are_in_units_of_the_overlay(hand: Any, show: Any) -> None:
    root = show(
        """Item { property var at: []
        MouseArea { anchors.fill: parent; onPressed: parent.at = [mouse.x, mouse.y] } }""",
        scale=2.0,
    )
    hand.click(100, 60)
    at = root.property("at")
    assert [round(v) for v in getattr(at, "toVariant", lambda: at)()] == [50, 30]


def test_topmost_overlay_is_asked_first(hand: Any, app: Any, show: Any) -> None:
    text = """Item { property int clicks: 0
        MouseArea { width: 100; height: 100; onClicked: parent.clicks++ } }"""
    low, high = show(text, "Low"), show(text, "High", z=1)
    hand.click(50, 50)
    assert (low.property("clicks"), high.property("clicks")) == (0, 1)
    app.overlays.to_front(app.overlays.find("Low"))
    hand.click(50, 50)
    assert (low.property("clicks"), high.property("clicks")) == (1, 1)


def test_overlay_may_be_removed_while_it_handles_an_event(
    hand: Any, app: Any, show: Any, view: Any
) -> None:
    root = show("Item { Button { objectName: 'b'; width: 100; height: 50 } }")
    from rosglass.rviz.qt5 import QtCore

    overlay = app.overlays.find("Test")
    button = root.findChild(QtCore.QObject, "b")
    button.pressed.connect(lambda: app.overlays.remove(overlay))
    yaw = view("Yaw")
    hand.drag(50, 25, 300, 300)
    assert app.overlays.find("Test") is None
    assert view("Yaw") == yaw
    hand.drag(50, 25, 300, 300)
    assert view("Yaw") != yaw


def test_errors_of_an_overlay_are_reported_and_rviz_continues(
    hand: Any, app: Any, view: Any, caplog: pytest.LogCaptureFixture
) -> None:
    from rosglass.rviz import Overlay

    class Bad(Overlay):
        def resize(self, width: int, height: int, ratio: float) -> None:
            pass

        def draw(self) -> None:
            return None

        def deliver(self, event: Any) -> bool:
            raise ValueError(f"no idea of {event.type()!r}")

    overlay = app.add(Bad("Bad"))
    yaw = view("Yaw")
    hand.drag(300, 300, 400, 300)
    assert view("Yaw") != yaw
    assert "test_input.py" in overlay.problem
    assert "ValueError: no idea of" in overlay.problem
    assert "overlay Bad" in caplog.text


def test_touch_works_buttons_and_leaves_the_rest(hand: Any, app: Any, show: Any, view: Any) -> None:
    from PySide2.QtTest import QTest

    from rosglass.rviz.qt5 import QtCore

    root = show(
        """Item { property int clicks: 0
        Button { x: 20; y: 20; width: 100; height: 50; onClicked: parent.clicks++ } }"""
    )
    import shiboken2
    from PySide2.QtGui import QTouchDevice

    address = shiboken2.getCppPointer(QTest.createTouchDevice())[0]
    panel = app.window.panel

    def stroke(*places: tuple[int, int]) -> None:
        def touch() -> Any:
            # The wrapper of a device goes with that of the first event it is asked for.
            return QTest.touchEvent(panel, shiboken2.wrapInstance(address, QTouchDevice), False)

        points = [QtCore.QPoint(*place) for place in places]
        touch().press(0, points[0], panel).commit()
        for point in points[1:]:
            touch().move(0, point, panel).commit()
        touch().release(0, points[-1], panel).commit()
        hand.wait.frames(2)

    yaw = view("Yaw")
    stroke((60, 40))
    assert root.property("clicks") == 1
    stroke((60, 40), (300, 300), (340, 300))
    assert view("Yaw") == yaw
    # What is not accepted, Qt sends again as the mouse.
    taken: list[bool] = []
    route = app.overlays.input.routes[QtCore.QEvent.TouchBegin]
    app.overlays.input.routes[QtCore.QEvent.TouchBegin] = lambda e: bool(
        taken.append(route(e)) or taken[-1]
    )
    stroke((300, 300), (340, 300))
    app.overlays.input.routes[QtCore.QEvent.TouchBegin] = route
    assert taken == [False]
