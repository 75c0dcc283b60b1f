import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 360 * Theme.size; height: 260 * Theme.size
    visible: true
    title: "Gamepad"
    color: Theme.background
    Component.onCompleted: Ros2.init("gamepad")

    TwistCommand { id: drive }
    GamepadView {
        anchors { fill: parent; margins: Theme.gap }
        gamepad: Gamepad {
            command: drive
            topic: "joy"
        }
    }
}
