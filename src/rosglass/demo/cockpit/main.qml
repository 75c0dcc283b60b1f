// The window of `rosglass demo`; also runs by itself: rosglass run main.qml.
import QtQuick
import Ros2 1.0

Window {
    id: window
    objectName: "window"
    // Not every window manager brings a window that is larger than the screen back onto it.
    width: Math.min(1340, Screen.width, Screen.desktopAvailableWidth)
    height: Math.min(800, Screen.height, Screen.desktopAvailableHeight)
    minimumWidth: Math.min(640, Screen.width)
    minimumHeight: Math.min(480, Screen.height)
    visible: true
    color: Theme.background
    title: "rosglass cockpit"

    Component.onCompleted: Ros2.init("cockpit")

    Cockpit {
        anchors.fill: parent
        inFront: window.active
    }
}
