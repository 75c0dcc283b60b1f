// A scroll bar of the theme.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

T.ScrollBar {
    id: bar

    implicitWidth: Math.max(6, Theme.gap * 0.8)
    implicitHeight: implicitWidth
    minimumSize: 0.1
    visible: policy === T.ScrollBar.AlwaysOn || size < 1
    contentItem: Rectangle {
        implicitWidth: bar.implicitWidth
        implicitHeight: bar.implicitHeight
        radius: width / 2
        color: bar.pressed ? Theme.accent : Theme.faint
    }
    background: Rectangle { color: "transparent" }
}
