// Why the layout, or the last change of it, cannot be shown.
import QtQuick 2.15
import RosControls 1.0

Item {
    id: box

    property string text

    Rectangle {
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        height: Math.min(parent.height, content.implicitHeight + 3 * Theme.gap)
        radius: Theme.radius
        color: Theme.panel
        border { color: Theme.bad; width: 2 }
        ThemeText {
            id: content
            anchors { fill: parent; margins: 1.5 * Theme.gap }
            text: box.text
            wrapMode: Text.Wrap
            maximumLineCount: 20
            Accessible.role: Accessible.AlertMessage
            Accessible.name: text
        }
    }
}
