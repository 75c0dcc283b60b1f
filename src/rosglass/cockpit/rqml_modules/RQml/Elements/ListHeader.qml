// The heading of a list, which stays above its rows.
import QtQuick
import QtQuick.Controls

Item {
    id: header

    property alias text: label.text
    property color textColor: palette.highlightedText

    width: ListView.view ? ListView.view.width : parent ? parent.width : implicitWidth
    height: 40
    implicitHeight: 40
    implicitWidth: label.implicitWidth + 16
    z: 2

    Rectangle {
        width: parent.width
        height: parent.height - 8
        color: header.palette.highlight

        Label {
            id: label
            textFormat: Text.PlainText
            anchors { left: parent.left; leftMargin: 8; right: parent.right; verticalCenter: parent.verticalCenter }
            color: header.textColor
            font.bold: true
            elide: Text.ElideRight
        }
    }
}
