import QtQuick 2.15

// Shown over the last good interface while a reloaded one has errors.
Rectangle {
    id: overlay

    property string heading: ""
    property string text: ""

    z: 2000000 // popups are at 1000001
    anchors.fill: parent
    color: "#c0301010"

    Text {
        anchors.fill: parent
        anchors.margins: 24
        color: "white"
        font.family: "monospace"
        font.pixelSize: 15
        wrapMode: Text.Wrap
        maximumLineCount: 100
        elide: Text.ElideRight
        textFormat: Text.PlainText
        text: overlay.heading + "\n\n" + overlay.text
    }
}
