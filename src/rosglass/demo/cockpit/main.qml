// The window of `rosglass demo`; also runs by itself: rosglass run main.qml.
import QtQuick
import Ros2 1.0

Window {
    id: window
    objectName: "window"
    width: 1340
    height: 800
    minimumWidth: 640
    minimumHeight: 480
    visible: true
    color: Theme.background
    title: "rosglass cockpit"

    Component.onCompleted: Ros2.init("cockpit")

    Cockpit {
        anchors.fill: parent
        inFront: window.active
    }
}
