// Teleoperation: the camera, a stick and keys to drive with, and the emergency stop.
import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 1000 * Theme.size; height: 640 * Theme.size
    visible: true
    title: "Teleoperation"
    color: Theme.background
    Component.onCompleted: Ros2.init("teleop")

    // All that drives goes through this: it stops when a hand leaves, or the window.
    TwistCommand {
        id: drive
        topic: "cmd_vel"
        maxSpeed: 0.5 // m/s
        maxTurn: 1.0 // rad/s
        obstacle: stop.blocks ? "emergency stop" : ""
    }

    CameraView {
        anchors.fill: parent
        tools: false
    }
    Column {
        anchors { left: parent.left; leftMargin: Theme.gap; top: parent.top; topMargin: 60 * Theme.size }
        width: 200 * Theme.size
        spacing: Theme.gap

        Battery { width: parent.width }
        Speed { width: parent.width; command: drive }
    }
    EmergencyStop {
        id: stop
        anchors { right: parent.right; top: parent.top; margins: Theme.gap }
        topic: "emergency_stop"
    }
    DriveKeys {
        anchors { left: parent.left; bottom: parent.bottom; margins: Theme.gap }
        command: drive
    }
    DriveStick {
        anchors { right: parent.right; bottom: parent.bottom; margins: Theme.gap }
        command: drive
    }
}
