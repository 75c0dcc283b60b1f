// The current time.
import QtQuick 2.15
import RosControls 1.0

Rectangle {
    width: 150 * Theme.size; height: 54 * Theme.size
    radius: Theme.radius
    color: Theme.panel
    border.color: Theme.edge
    property date now: new Date()
    Timer {
        interval: 1000 - new Date().getMilliseconds()
        running: true; repeat: true
        onTriggered: { now = new Date(); interval = 1000 - now.getMilliseconds() }
    }
    Column {
        x: Theme.gap
        anchors.verticalCenter: parent.verticalCenter
        ThemeText {
            text: Qt.formatTime(now, "hh:mm:ss")
            font { pixelSize: Theme.large * 1.2; weight: Font.Light }
        }
        ThemeText {
            text: Qt.formatDate(now, "ddd d MMM yyyy")
            color: Theme.dim
            font.pixelSize: Theme.small
        }
    }
}
