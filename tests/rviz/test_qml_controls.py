"""Controls, drags and touch of QML over RViz's 3D view work as in a window of their own."""

from __future__ import annotations

from typing import Any


def item(root: Any, name: str) -> Any:
    from rosglass.rviz.qt5 import QtQuick

    return root.findChild(QtQuick.QQuickItem, name)


def test_menus_dialogs_drawers_and_tooltips(hand: Any, show: Any, view: Any) -> None:
    root = show(
        """Item { id: top; property string log: ""
        property bool menu: menu.opened; property bool sub: sub.opened
        property bool drawn: drawer.visible; property bool asked: ask.opened
        property bool tip: hover.ToolTip.visible
        MouseArea { id: context; width: 120; height: 80; acceptedButtons: Qt.RightButton
            onClicked: menu.popup() }
        Menu { id: menu
            MenuItem { text: "first"; onTriggered: top.log += "first" }
            Menu { id: sub; title: "more"
                MenuItem { text: "deep"; onTriggered: top.log += "deep" } } }
        Button { id: hover; x: 200; width: 100; height: 50; text: "drawer"
            ToolTip.visible: hovered; ToolTip.delay: 100; ToolTip.text: "opens"
            onClicked: drawer.open() }
        Button { x: 320; width: 100; height: 50; text: "dialog"; onClicked: ask.open() }
        Drawer { id: drawer; width: 150; height: top.height; edge: Qt.LeftEdge }
        Dialog { id: ask; anchors.centerIn: parent; modal: true; focus: true
            closePolicy: Popup.CloseOnEscape
            title: "Really?"; standardButtons: Dialog.Yes; onAccepted: top.log += "yes" } }"""
    )
    hand.click(40, 40, button=3)
    hand.wait(lambda: root.property("menu"))
    hand.key("Down", "Down", "Right")
    hand.wait(lambda: root.property("sub"))
    hand.key("Return")
    hand.wait(lambda: root.property("log") == "deep" and not root.property("menu"))
    hand.move(250, 25)
    hand.wait(lambda: root.property("tip"))
    hand.click(250, 25)
    hand.wait(lambda: root.property("drawn"))
    yaw, distance = view("Yaw"), view("Distance")
    hand.wheel(400, 300)
    hand.click(400, 300)
    hand.wait(lambda: not root.property("drawn"))
    assert (view("Yaw"), view("Distance")) == (yaw, distance)
    hand.click(370, 25)
    hand.wait(lambda: root.property("asked"))
    hand.drag(30, 400, 90, 400)
    assert view("Yaw") == yaw
    hand.key("Tab", "space")
    hand.wait(lambda: root.property("log") == "deepyes")


def test_text_is_selected_copied_and_composed(hand: Any, app: Any, show: Any) -> None:
    from rosglass.rviz.qt5 import QtCore, QtGui

    root = show(
        """Item { TextField { objectName: "a"; width: 200; height: 40; text: "hello world"
            selectByMouse: true }
        TextField { objectName: "b"; y: 60; width: 200; height: 40 } }"""
    )
    first, second = item(root, "a"), item(root, "b")
    hand.drag(3, 20, 190, 20)
    assert first.property("selectedText") == "hello world"
    hand.key("ctrl+c")
    hand.click(50, 80)
    hand.key("ctrl+v")
    assert second.property("text") == "hello world"
    hand.key("ctrl+a")
    event = QtGui.QInputMethodEvent()
    event.setCommitString("\u00e9")
    QtCore.QCoreApplication.sendEvent(app.window.panel, event)
    assert second.property("text") == "\u00e9"


def test_items_are_dragged_onto_others(hand: Any, show: Any, view: Any) -> None:
    root = show(
        """Item { id: top; property string dropped: ""
        DropArea { x: 200; width: 100; height: 100; keys: ["part"]
            onDropped: top.dropped = drop.source.objectName }
        Rectangle { objectName: "piece"; width: 60; height: 60; color: "orange"
            Drag.active: area.drag.active; Drag.keys: ["part"]
            Drag.hotSpot.x: 30; Drag.hotSpot.y: 30
            MouseArea { id: area; anchors.fill: parent; drag.target: parent
                onReleased: parent.Drag.drop() } } }"""
    )
    yaw = view("Yaw")
    hand.move(30, 30)
    hand.press()
    # Qt begins to move it where the mouse is when it has gone far enough.
    for x in (45, 100, 200, 265):
        hand.move(x, 50)
    hand.release()
    assert root.property("dropped") == "piece"
    assert view("Yaw") == yaw


def test_two_fingers_pinch(hand: Any, app: Any, show: Any, view: Any) -> None:
    import shiboken2
    from PySide2.QtGui import QTouchDevice
    from PySide2.QtTest import QTest

    from rosglass.rviz.qt5 import QtCore

    root = show(
        """Item { id: top; property real size: box.scale
        Rectangle { id: box; width: 300; height: 300; color: "steelblue"; PinchHandler { } } }"""
    )
    address = shiboken2.getCppPointer(QTest.createTouchDevice())[0]
    panel = app.window.panel
    distance = view("Distance")

    def fingers(what: str, *places: int) -> None:
        sequence = QTest.touchEvent(panel, shiboken2.wrapInstance(address, QTouchDevice), False)
        for number, x in enumerate(places):
            getattr(sequence, what)(number, QtCore.QPoint(x, 150), panel)
        sequence.commit()
        hand.wait.frames(1)

    fingers("press", 120, 180)
    for way in (5, 15, 30, 45, 60):
        fingers("move", 120 - way, 180 + way)
    fingers("release", 60, 240)
    assert root.property("size") > 1.3
    assert view("Distance") == distance


def test_items_know_where_on_the_screen_they_are(app: Any, show: Any) -> None:
    root = show(
        """Item { property point at: Qt.point(0, 0)
        Rectangle { id: box; x: 30; y: 20; width: 9; height: 9 }
        function find() { at = box.mapToGlobal(0, 0) } }"""
    )
    from rosglass.rviz.qt5 import QtCore

    QtCore.QMetaObject.invokeMethod(root, "find")
    assert root.property("at").toPoint() == app.window.panel.mapToGlobal(QtCore.QPoint(30, 20))
