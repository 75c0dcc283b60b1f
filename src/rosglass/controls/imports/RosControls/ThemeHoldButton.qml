// A button that has to be held down until it is full, by mouse, finger or space bar.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

T.DelayButton {
    id: button

    property color tint: Theme.warn

    // Milliseconds.
    delay: 1000
    implicitWidth: Math.max(Theme.touch, label.implicitWidth + 2 * Theme.gap)
    implicitHeight: Theme.touch
    focusPolicy: Qt.StrongFocus
    hoverEnabled: true
    // A finger that slides off lets go.
    onCanceled: progress = 0
    onEnabledChanged: progress = 0
    onActivated: { checked = false; progress = 0 }
    Accessible.role: Accessible.Button
    Accessible.name: text
    Accessible.description: qsTr("Hold it down for %1 s").arg((delay / 1000).toFixed(1))
    transition: Transition {
        NumberAnimation { duration: button.delay * (button.pressed ? 1 - button.progress : 0.2 * button.progress) }
    }

    contentItem: ThemeText {
        id: label
        text: button.pressed ? qsTr("hold ...") : button.text
        color: !button.enabled ? Theme.faint : button.tint
        font.weight: Font.DemiBold
        horizontalAlignment: Text.AlignHCenter
        verticalAlignment: Text.AlignVCenter
    }
    background: Rectangle {
        radius: Theme.radius
        color: button.enabled && button.hovered ? Theme.track : "transparent"
        border { color: button.enabled ? button.tint : Theme.faint; width: 1 }
        Rectangle {
            width: parent.width * button.progress
            height: parent.height
            radius: Theme.radius
            color: button.tint
            opacity: 0.4
        }
        FocusRing { item: parent; visible: button.visualFocus }
    }
}
