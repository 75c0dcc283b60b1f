// A button with an icon and a text.
import QtQuick
import QtQuick.Controls
import QtQuick.Layouts
import RQml.Fonts

Button {
    id: button

    property string iconText
    property var iconFont: Qt.font({ family: IconFont.name, pixelSize: 12 })
    property string tooltipText

    implicitWidth: Math.max(implicitHeight, row.implicitWidth + leftPadding + rightPadding)
    Accessible.name: text || tooltipText
    contentItem: RowLayout {
        id: row
        spacing: 6

        Label {
            textFormat: Text.PlainText
            visible: text !== ""
            text: button.iconText
            font: button.iconFont
            color: button.palette.buttonText
        }
        Label {
            Layout.fillWidth: true
            visible: text !== ""
            text: button.text
            textFormat: Text.PlainText
            color: button.palette.buttonText
        }
    }

    Tip { text: button.tooltipText }
}
