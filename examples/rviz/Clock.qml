// The current time.
import QtQuick 2.15

Rectangle {
    width: 118; height: 46
    radius: 6
    color: Theme.background
    border.color: Theme.edge
    property date now: new Date()
    Timer {
        interval: 1000 - new Date().getMilliseconds()
        running: true; repeat: true
        onTriggered: { now = new Date(); interval = 1000 - now.getMilliseconds() }
    }
    Text {
        x: 10; y: 4
        textFormat: Text.PlainText
        text: Qt.formatTime(now, "hh:mm:ss")
        color: Theme.text
        font { pixelSize: 21; weight: Font.Light }
    }
    Text {
        x: 11; y: 29
        textFormat: Text.PlainText
        text: Qt.formatDate(now, "ddd d MMM yyyy")
        color: Theme.dim
        font.pixelSize: 10
    }
}
