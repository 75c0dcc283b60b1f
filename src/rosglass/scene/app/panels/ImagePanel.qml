import QtQuick
import RosScene 1.0

// Shows the image of an ImageDisplay, or of a CameraDisplay with the scene in it.
Rectangle {
    id: panel

    // The display.
    property QtObject display: null
    // Whether it has handles for the user to move and resize it, and to disable the display, which hides it.
    property bool movable: false

    // The user moves or resizes it, by so much.
    signal dragged(real x, real y)
    signal resized(real x, real y)

    // PictureItem says what is wrong with another display.
    readonly property bool has: display !== null && display.isPicture === true
    readonly property bool bad: has && display.statusLevel !== "ok"
    readonly property real fade: has && display.stale ? 0.35 : 1

    color: "black"
    clip: true
    visible: has && display.active

    PictureItem {
        objectName: "behind"
        anchors.fill: parent
        display: panel.display
        opacity: panel.fade
        visible: panel.has && panel.display.behind
    }
    Loader {
        anchors.fill: parent
        active: panel.has && panel.display.isCamera
        sourceComponent: CameraView { objectName: "cameraView"; display: panel.display; opacity: panel.fade }
    }
    Loader {
        anchors.fill: parent
        active: panel.has && panel.display.overlay > 0
        sourceComponent: PictureItem { display: panel.display; opacity: panel.display.overlay * panel.fade }
    }

    // What is below the panel gets no wheel or clicks through it.
    MouseArea { anchors.fill: parent; enabled: panel.movable; onWheel: wheel => wheel.accepted = true }

    Rectangle {
        width: parent.width
        height: title.implicitHeight + 6
        visible: panel.movable || panel.bad
        color: panel.bad ? "#c0804000" : "#80000000"
        Text {
            id: title
            anchors { left: parent.left; right: parent.right; top: parent.top; margins: 3; rightMargin: panel.movable ? 20 : 3 }
            text: !panel.has ? "" : panel.display.name + (panel.bad ? "\n" + panel.display.statusText : "")
            textFormat: Text.PlainText
            wrapMode: Text.Wrap
            maximumLineCount: 6
            elide: Text.ElideRight
            font.pixelSize: 12
            color: "white"
        }
        MouseArea {
            property point at
            anchors.fill: parent
            enabled: panel.movable
            cursorShape: Qt.SizeAllCursor
            onPressed: mouse => at = mapToItem(panel.parent, mouse.x, mouse.y)
            onPositionChanged: mouse => {
                const now = mapToItem(panel.parent, mouse.x, mouse.y)
                panel.dragged(now.x - at.x, now.y - at.y)
                at = now
            }
        }
    }
    Text {
        anchors { right: parent.right; top: parent.top; rightMargin: 6; topMargin: 1 }
        visible: panel.movable
        text: "\u00d7"
        textFormat: Text.PlainText
        font.pixelSize: 16
        color: "white"
        MouseArea {
            objectName: "closePanel"
            anchors { fill: parent; margins: -4 }
            onClicked: panel.display.enabled = false
        }
    }
    Rectangle {
        anchors { right: parent.right; bottom: parent.bottom }
        width: 14
        height: 14
        visible: panel.movable
        color: "#80ffffff"
        MouseArea {
            property point at
            anchors.fill: parent
            cursorShape: Qt.SizeFDiagCursor
            onPressed: mouse => at = Qt.point(mouse.x, mouse.y)
            onPositionChanged: mouse => panel.resized(mouse.x - at.x, mouse.y - at.y)
        }
    }
}
