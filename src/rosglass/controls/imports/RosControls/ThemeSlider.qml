// A slider of the theme.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

T.Slider {
    id: slider

    // What is set by it, for screen readers.
    property string name
    property color tint: Theme.accent

    implicitWidth: 140 * Theme.size
    implicitHeight: Theme.touch
    focusPolicy: Qt.StrongFocus
    Accessible.role: Accessible.Slider
    Accessible.name: name

    background: Rectangle {
        x: slider.leftPadding
        y: (slider.height - height) / 2
        width: slider.availableWidth
        height: Math.max(4, Theme.gap / 2)
        radius: height / 2
        color: Theme.track
        Rectangle {
            width: parent.width * slider.visualPosition
            height: parent.height
            radius: height / 2
            color: slider.enabled ? slider.tint : Theme.faint
        }
    }
    handle: Rectangle {
        x: slider.leftPadding + slider.visualPosition * (slider.availableWidth - width)
        y: (slider.height - height) / 2
        width: Theme.touch / 2
        height: width
        radius: width / 2
        color: slider.pressed ? slider.tint : Theme.panel
        border { color: slider.enabled ? slider.tint : Theme.faint; width: 2 }
        FocusRing { item: parent; radius: width / 2; visible: slider.visualFocus }
    }
}
