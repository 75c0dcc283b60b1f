// A slider for a wanted value, which shows the current one as well.
import QtQuick
import QtQuick.Controls

Slider {
    id: slider

    property real currentValue: 0
    readonly property real currentValueVisualPosition: {
        const part = to === from ? 0 : Math.max(0, Math.min(1, (currentValue - from) / (to - from)))
        return mirrored ? 1 - part : part
    }

    stepSize: (to - from) / 1000
    background: Rectangle {
        readonly property real lower_: Math.min(slider.visualPosition, slider.currentValueVisualPosition)
        readonly property real upper_: Math.max(slider.visualPosition, slider.currentValueVisualPosition)
        implicitWidth: 160
        implicitHeight: 8
        x: slider.leftPadding
        y: slider.topPadding + (slider.availableHeight - height) / 2
        width: slider.availableWidth
        height: 8
        radius: 4
        color: slider.palette.mid

        // From the current value to the wanted one.
        Rectangle {
            x: parent.lower_ * parent.width
            width: (parent.upper_ - parent.lower_) * parent.width
            height: parent.height
            color: slider.palette.highlight
            opacity: 0.6
        }
        Rectangle {
            x: slider.currentValueVisualPosition * parent.width - width / 2
            y: -4
            width: 3
            height: parent.height + 8
            color: slider.palette.text
        }
    }
    handle: Rectangle {
        implicitWidth: 10
        implicitHeight: 24
        x: slider.leftPadding + slider.visualPosition * (slider.availableWidth - width)
        y: slider.topPadding + (slider.availableHeight - height) / 2
        radius: 4
        color: slider.palette.highlight
        border { width: slider.pressed || slider.visualFocus ? 2 : 0; color: slider.palette.text }
    }
}
