// A titled card. What it shows is dimmed, and said to be old, as soon as it is not fresh any more.
import QtQuick

Rectangle {
    id: panel

    property string title
    property bool fresh: true
    // Seconds since the newest data, -1 for never.
    property real age: 0
    property string note
    readonly property bool small: height < 110
    default property alias content: body.data

    color: Theme.panel
    clip: true
    radius: Theme.radius
    border.color: fresh ? Theme.panelEdge : Theme.bad
    border.width: 1

    Text {
        id: heading
        anchors { left: parent.left; right: parent.right; top: parent.top }
        anchors { leftMargin: 12; rightMargin: 12; topMargin: panel.small ? 6 : 9 }
        elide: Text.ElideRight
        textFormat: Text.PlainText
        text: panel.title.toUpperCase()
        color: Theme.dim
        font { pixelSize: Theme.small; letterSpacing: 1.2; weight: Font.DemiBold }
    }
    Text {
        id: aside
        x: beside ? parent.width - width - 12 : 12
        // Beside the title, or below it where both have no room.
        readonly property bool beside: heading.implicitWidth + implicitWidth + 6 <= heading.width
        y: heading.y + (beside ? 0 : heading.height)
        z: 1
        textFormat: Text.PlainText
        text: panel.fresh ? panel.note
            : panel.age < 0 ? "NO DATA YET" : "OLD: " + panel.age.toFixed(0) + " s"
        color: panel.fresh ? Theme.dim : Theme.bad
        font { pixelSize: Theme.small; weight: panel.fresh ? Font.Normal : Font.Bold }
    }
    Item {
        id: body
        anchors {
            fill: parent
            leftMargin: 12; rightMargin: 12; topMargin: panel.small ? 24 : 30; bottomMargin: panel.small ? 5 : 10
        }
        opacity: panel.fresh ? 1 : 0.28
        Behavior on opacity { NumberAnimation { duration: 120 } }
    }
}
