// A slider of the theme, horizontal or vertical.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

T.Slider {
    id: slider

    // What is set by it, for screen readers.
    property string name
    property color tint: Theme.accent

    implicitWidth: horizontal ? 140 * Theme.size : Theme.touch
    implicitHeight: horizontal ? Theme.touch : 140 * Theme.size
    focusPolicy: Qt.StrongFocus
    Accessible.role: Accessible.Slider
    Accessible.name: name

    background: Rectangle {
        readonly property real thick: Math.max(4, Theme.gap / 2)
        x: slider.horizontal ? slider.leftPadding : (slider.width - thick) / 2
        y: slider.horizontal ? (slider.height - thick) / 2 : slider.topPadding
        width: slider.horizontal ? slider.availableWidth : thick
        height: slider.horizontal ? thick : slider.availableHeight
        radius: thick / 2
        color: Theme.track
        Rectangle {
            y: slider.horizontal ? 0 : parent.height - height
            width: slider.horizontal ? parent.width * slider.visualPosition : parent.width
            height: slider.horizontal ? parent.height : parent.height * slider.position
            radius: parent.radius
            color: slider.enabled ? slider.tint : Theme.faint
        }
    }
    handle: Rectangle {
        x: slider.horizontal ? slider.leftPadding + slider.visualPosition * (slider.availableWidth - width)
            : (slider.width - width) / 2
        y: slider.horizontal ? (slider.height - height) / 2
            : slider.topPadding + slider.visualPosition * (slider.availableHeight - height)
        width: Theme.touch / 2
        height: width
        radius: width / 2
        color: slider.pressed ? slider.tint : Theme.panel
        border { color: slider.enabled ? slider.tint : Theme.faint; width: 2 }
        FocusRing { item: parent; radius: width / 2; visible: slider.visualFocus }
    }
}
