import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 320 * Theme.size; height: 200 * Theme.size
    visible: true
    title: "TwistCommand"
    color: Theme.background
    Component.onCompleted: Ros2.init("drive")

    TwistCommand { id: command; topic: "/cmd_vel"; maxSpeed: 0.4; maxTurn: 0.8 }

    // An input of one's own: drives forward while it is pressed.
    ThemeButton {
        id: ahead
        anchors.centerIn: parent
        text: command.active ? qsTr("%1 m/s").arg(command.speed.toFixed(2)) : qsTr("Hold to drive")
        onPressed: command.steer(ahead, 1, 0)
        onReleased: command.release(ahead)
        onCanceled: command.release(ahead)
        Timer { interval: 50; repeat: true; running: ahead.pressed; onTriggered: command.steer(ahead, 1, 0) }
    }
    ThemeText {
        anchors { bottom: parent.bottom; left: parent.left; right: parent.right; margins: Theme.gap }
        text: command.problem
        color: Theme.bad
    }
}
