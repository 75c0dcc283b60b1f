import QtQuick 2.15

// Shown over an overlay with errors: no larger than its text, for RViz goes on around it.
Rectangle {
    id: panel

    property string heading: ""
    property string text: ""
    /// Units of the overlay for one of the screen: errors are as large on any overlay.
    property real unit: 1

    readonly property real roomBeside: parent ? parent.width / unit : 0
    readonly property real roomBelow: parent ? parent.height / unit : 0

    z: 2000000 // popups are at 1000001
    x: 12 * unit
    y: 12 * unit
    width: Math.min(Math.max(0, roomBeside - 24), 720)
    height: Math.min(Math.max(0, roomBelow - 24), content.height + 24)
    scale: unit
    transformOrigin: Item.TopLeft
    radius: 6
    color: "#f0501818"
    border.color: "#ff8a80"
    clip: true

    // What is below it is not pressed by accident.
    MouseArea {
        anchors.fill: parent
        acceptedButtons: Qt.AllButtons
        hoverEnabled: true
        onWheel: {}
    }

    Column {
        id: content

        x: 12
        y: 12
        width: parent.width - 56
        spacing: 8

        Text {
            width: parent.width
            color: "white"
            font.bold: true
            font.pixelSize: 14
            wrapMode: Text.Wrap
            maximumLineCount: 100
            elide: Text.ElideRight
            textFormat: Text.PlainText
            text: panel.heading
        }

        Text {
            width: parent.width
            color: "white"
            font.family: "monospace"
            font.pixelSize: 13
            wrapMode: Text.Wrap
            maximumLineCount: 100
            elide: Text.ElideRight
            textFormat: Text.PlainText
            text: panel.text
        }
    }

    Text {
        anchors.right: parent.right
        anchors.rightMargin: 12
        y: 8
        color: "white"
        font.pixelSize: 20
        text: "\u00d7"

        MouseArea {
            objectName: "close"
            anchors.fill: parent
            anchors.margins: -8
            cursorShape: Qt.PointingHandCursor
            onClicked: panel.visible = false
        }
    }
}
