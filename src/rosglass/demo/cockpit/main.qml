// The window of `rosglass demo`; copy this folder for a cockpit of your own (docs/demo.md).
import QtQuick
import Ros2 1.0
import RosControls 1.0

Window {
    id: window; objectName: "window"
    // Not every window manager brings a window that is larger than the screen back onto it.
    width: Math.min(1340, Screen.width, Screen.desktopAvailableWidth)
    // 48: for its title bar, which most window managers put above.
    height: Math.min(800, Screen.height, Screen.desktopAvailableHeight - 48)
    minimumWidth: Math.min(640, Screen.width)
    minimumHeight: Math.min(480, Screen.height)
    visible: true; color: Theme.background; title: "rosglass cockpit"

    Component.onCompleted: {
        Theme.scale = 1 // the zoom enlarges all
        Ros2.init("cockpit")
    }

    // Larger than full HD, everything grows: not all screens report their resolution.
    readonly property real zoom: Math.max(1, Math.min(width / 1920, height / 1080))

    Cockpit {
        width: window.width / window.zoom; height: window.height / window.zoom
        scale: window.zoom; transformOrigin: Item.TopLeft
    }
}
