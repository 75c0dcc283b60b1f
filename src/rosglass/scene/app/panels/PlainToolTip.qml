import QtQuick
import QtQuick.Controls.Fusion

// A tool tip whose text is never taken for rich text: names come from the robot.
ToolTip {
    id: tip

    property string plain: ""

    delay: 800
    contentItem: Text {
        width: Math.min(implicitWidth, 400)
        text: tip.plain
        textFormat: Text.PlainText
        wrapMode: Text.Wrap
        maximumLineCount: 40
        elide: Text.ElideRight
        color: tip.palette.toolTipText
    }
}
