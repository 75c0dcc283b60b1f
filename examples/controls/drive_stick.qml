import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 320 * Theme.size; height: 240 * Theme.size
    visible: true
    title: "DriveStick"
    color: Theme.background
    Component.onCompleted: Ros2.init("drive_stick")

    TwistCommand { id: drive; topic: "/cmd_vel"; maxSpeed: 0.9; maxTurn: 1.2 }

    DriveStick {
        anchors.centerIn: parent
        command: drive
    }
}
