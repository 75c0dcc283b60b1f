import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 360; height: 260
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
