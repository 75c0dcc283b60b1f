// A button that has to be held down until it is full, by mouse, finger or space bar.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

T.AbstractButton {
    id: button

    property color tint: Theme.warn
    // Milliseconds.
    property int delay: 1000
    // From 0 to 1, when it is activated.
    property real progress: 0

    // It was held down for long enough.
    signal activated()

    implicitWidth: Math.max(Theme.touch, label.implicitWidth + 2 * Theme.gap)
    implicitHeight: Theme.touch
    focusPolicy: Qt.StrongFocus
    hoverEnabled: true
    // A finger that slides off lets go, too.
    onPressedChanged: progress = 0
    onEnabledChanged: progress = 0
    Accessible.role: Accessible.Button
    Accessible.name: text
    Accessible.description: qsTr("Hold it down for %1 s").arg((delay / 1000).toFixed(1))
    // A screen reader cannot hold it, and does not press it by accident.
    Accessible.onPressAction: activated()

    // By the clock, but at most 100 ms a step: after a screen that stood still, a release that waits is handled first.
    Timer {
        property real last_: 0
        interval: 35
        repeat: true
        running: button.pressed && button.enabled && button.progress < 1
        onRunningChanged: last_ = Date.now()
        onTriggered: {
            const now = Date.now()
            button.progress = Math.min(1, button.progress + Math.max(0, Math.min(100, now - last_)) / Math.max(1, button.delay))
            last_ = now
            if (button.progress === 1)
                button.activated()
        }
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
