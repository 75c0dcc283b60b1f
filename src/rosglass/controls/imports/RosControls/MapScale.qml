// A bar of a round number of metres; a part of the maps.
import QtQuick 2.15

Row {
    id: scale

    // Pixels of a metre.
    property real pixelsPerMetre: 20
    // The longest bar, in pixels.
    property real longest: 120 * Theme.size

    readonly property real metres_: {
        const most = longest / pixelsPerMetre
        const step = Math.pow(10, Math.floor(Math.log(most) / Math.LN10 + 1e-9))
        return isFinite(step) ? step * (most >= 5 * step ? 5 : most >= 2 * step ? 2 : 1) : 1
    }

    spacing: Theme.gap / 2
    Accessible.role: Accessible.StaticText
    Accessible.name: label.text

    ThemeText {
        id: label
        text: scale.metres_ >= 1000 ? qsTr("%1 km").arg(scale.metres_ / 1000)
            : scale.metres_ >= 1 ? qsTr("%1 m").arg(scale.metres_)
            : qsTr("%1 cm").arg(Math.round(scale.metres_ * 1000) / 10)
        font.pixelSize: Theme.small
    }
    Rectangle {
        anchors.verticalCenter: parent.verticalCenter
        width: scale.metres_ * scale.pixelsPerMetre
        height: 4
        color: Theme.text
        border { color: Theme.panel; width: 1 }
    }
}
