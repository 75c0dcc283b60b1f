"""Held buttons whose release may never arrive are cancelled: a robot would drive on."""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

QML = """Item {
    id: top
    property bool area: stick.pressed
    property bool slid: slider.pressed
    property bool button: push.down
    property bool finger: point.pressed
    property bool dragged: dragger.active
    property bool tapped: tapper.pressed
    property string log: ""
    property real speed: 0
    MouseArea {
        id: stick; width: 100; height: 100
        onPositionChanged: top.speed = mouse.x
        onReleased: top.speed = 0
        onCanceled: { top.speed = 0; top.log += "canceled" }
    }
    Slider { id: slider; x: 120; width: 200; height: 100
        onPressedChanged: if (!pressed) value = 0 }
    Button { id: push; y: 120; width: 100; height: 100; onClicked: top.log += "clicked" }
    MultiPointTouchArea {
        x: 120; y: 120; width: 100; height: 100
        touchPoints: [ TouchPoint { id: point } ]
    }
    Rectangle {
        objectName: "box"; x: 240; y: 120; width: 100; height: 100
        DragHandler { id: dragger }
    }
    Item {
        x: 360; width: 100; height: 100
        TapHandler { id: tapper; gesturePolicy: TapHandler.ReleaseWithinBounds
            onTapped: top.log += "tapped" }
    }
}"""
PLACES = {
    "area": (30, 50),
    "slid": (150, 50),
    "button": (30, 170),
    "finger": (150, 170),
    "dragged": (270, 170),
    "tapped": (390, 50),
}


def by_dialog(hand: Any, app: Any) -> Callable[[], Any]:
    from rosglass.rviz.qt5 import QtWidgets

    dialog = QtWidgets.QDialog(app.window.widget)
    dialog.setModal(True)
    dialog.show()
    return lambda: (dialog.close(), dialog.deleteLater())


def by_menu(hand: Any, app: Any) -> Callable[[], Any]:
    from rosglass.rviz.qt5 import QtCore, QtWidgets

    menu = QtWidgets.QMenu(app.window.widget)
    menu.addAction("nothing")
    menu.popup(QtCore.QPoint(900, 600))
    return lambda: (menu.close(), menu.deleteLater())


def by_minimizing(hand: Any, app: Any) -> Callable[[], Any]:
    app.window.widget.showMinimized()
    restore: Callable[[], Any] = app.window.widget.showNormal
    return restore


def by_another_window(hand: Any, app: Any) -> Callable[[], Any]:
    from rosglass.rviz.qt5 import QtWidgets

    other = QtWidgets.QWidget()
    other.setGeometry(900, 600, 100, 100)
    other.show()
    hand.wait(other.windowHandle().isExposed)
    focus(other)
    hand.wait(other.isActiveWindow)

    def back() -> None:
        focus(app.window.widget)
        hand.wait(app.window.widget.isActiveWindow)
        other.close()
        other.deleteLater()

    return back


def focus(window: Any) -> None:
    subprocess.run(["xdotool", "windowfocus", str(int(window.winId()))], check=True)


WAYS = [by_dialog, by_menu, by_minimizing, by_another_window]


@pytest.fixture
def finger(app: Any, hand: Any) -> Callable[..., None]:
    """Put a finger onto the view, move it, or lift it."""
    import shiboken2
    from PySide2.QtGui import QTouchDevice
    from PySide2.QtTest import QTest

    from rosglass.rviz.qt5 import QtCore

    address = shiboken2.getCppPointer(QTest.createTouchDevice())[0]
    panel = app.window.panel

    def touch(what: str, x: float, y: float) -> None:
        # The wrapper of a device goes with that of the first event it is asked for.
        device = shiboken2.wrapInstance(address, QTouchDevice)
        sequence = QTest.touchEvent(panel, device, False)
        getattr(sequence, what)(0, QtCore.QPoint(round(x), round(y)), panel).commit()
        hand.wait.frames(1)

    return touch


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
@pytest.mark.parametrize("by", ["mouse", "touch"])
def test_nothing_stays_pressed(
    hand: Any, app: Any, show: Any, finger: Any, by: str, way: Any
) -> None:
    root = show(QML)
    focus(app.window.widget)
    hand.wait(app.window.widget.isActiveWindow)
    for what, (x, y) in PLACES.items():
        if by == "mouse":
            hand.move(x, y)
            hand.press()
            hand.move(x + 12, y)
            hand.move(x + 30, y)
        else:
            finger("press", x, y)
            for way_to_go in (10, 20, 30):
                finger("move", x + way_to_go, y)
        assert root.property(what)
        back = way(hand, app)
        hand.wait(lambda what=what: not root.property(what))
        assert root.property("speed") == 0
        back()
        if by == "mouse":
            hand.release()
        else:
            finger("release", x + 30, y)
        assert not root.property(what)
    assert root.property("log") == "canceled"
    # A robot's arm must not jump either.
    box = root.findChild(type(root), "box")
    assert abs(box.x() - 270) <= 40
    hand.click(*PLACES["button"])
    hand.click(*PLACES["tapped"])
    assert root.property("log") == "canceledclickedtapped"


def test_keys_count_no_longer_while_a_menu_has_them(hand: Any, app: Any, show: Any) -> None:
    root = show(
        """Item {
        property bool driving: false
        focus: true
        onActiveFocusChanged: if (!activeFocus) driving = false
        Keys.onPressed: driving = true
        Keys.onReleased: driving = false
        MouseArea { width: 100; height: 100 }
        }"""
    )
    focus(app.window.widget)
    hand.wait(app.window.widget.isActiveWindow)
    hand.click(50, 50)
    hand.do("keydown", "F6")
    hand.wait(lambda: root.property("driving"))
    back = by_menu(hand, app)
    hand.do("keyup", "F6")
    hand.wait(lambda: not root.property("driving"))
    back()
    hand.wait(lambda: root.property("activeFocus"))
    assert not root.property("driving")


def test_widgets_are_let_go_of(hand: Any, app: Any) -> None:
    from rosglass.rviz import WidgetOverlay
    from rosglass.rviz.qt5 import QtWidgets

    class Stick(QtWidgets.QWidget):  # type: ignore[misc]
        buttons = 0

        def mousePressEvent(self, event: Any) -> None:  # noqa: N802
            self.buttons = int(event.buttons())

        def mouseReleaseEvent(self, event: Any) -> None:  # noqa: N802
            self.buttons = int(event.buttons())

    stick = Stick()
    app.add(WidgetOverlay(stick, "Stick"))
    hand.wait.frames(3)
    for button, code in ((1, 1), (3, 2), (2, 4)):
        hand.move(200, 200)
        hand.press(button)
        assert stick.buttons == code
        hand.press(1)
        back = by_dialog(hand, app)
        hand.wait(lambda: stick.buttons == 0)
        back()
        hand.release(1)
        hand.release(button)


def test_switching_tools_and_typing_leave_the_mouse_where_it_is(
    hand: Any, app: Any, show: Any, view: Any
) -> None:
    root = show(QML)
    tools = app.window.manager.getToolManager()
    yaw = view("Yaw")
    hand.move(30, 50)
    hand.press()
    hand.key("s")
    hand.wait(lambda: tools.getCurrentTool().getName() == "Select")
    assert root.property("area")
    hand.move(300, 300)
    hand.move(360, 300)
    assert root.property("speed") > 300
    hand.release()
    assert (root.property("area"), root.property("speed"), root.property("log")) == (False, 0, "")
    assert view("Yaw") == yaw
    hand.key("Escape")
    hand.wait(lambda: tools.getCurrentTool().getName() != "Select")


def test_released_buttons_are_not_cancelled_later(hand: Any, show: Any) -> None:
    root = show(
        """Item { property int changes: 0
        Button { width: 100; height: 100; onEnabledChanged: parent.changes++ } }"""
    )
    hand.click(50, 50)
    hand.move(300, 300)
    assert root.property("changes") == 0
