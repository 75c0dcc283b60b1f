// A square button with an icon of IconFont.
import QtQuick
import QtQuick.Controls
import RQml.Fonts

RoundButton {
    property string tooltipText

    implicitWidth: implicitHeight
    radius: 4
    font { family: IconFont.name; pixelSize: 18 }
    Accessible.name: tooltipText || text

    Tip { text: parent.tooltipText }
}
