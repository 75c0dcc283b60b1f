// A tool tip with plain text.
import QtQuick
import QtQuick.Controls

ToolTip {
    delay: 500
    visible: text !== "" && parent.hovered
}
