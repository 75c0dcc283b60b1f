// A letter in a coloured circle.
import QtQuick
import QtQuick.Controls

Rectangle {
    id: circle

    property alias text: letter.text
    property alias font: letter.font
    property color textColor: color.hslLightness < 0.75 ? "white" : "black"
    property string tooltipText

    width: 16
    height: 16
    radius: height / 2
    Accessible.role: Accessible.StaticText
    Accessible.name: tooltipText || text

    Label {
        id: letter
        textFormat: Text.PlainText
        anchors.centerIn: parent
        color: circle.textColor
        font { bold: true; pixelSize: 10 }
    }
    HoverHandler {
        id: pointer
        enabled: circle.tooltipText !== ""
    }
    ToolTip {
        delay: 500
        text: circle.tooltipText
        contentItem: Label {
            text: circle.tooltipText
            textFormat: Text.PlainText
        }
        visible: pointer.hovered && text !== ""
    }
}
