// Switches the robot's lamp; lit when the robot says it is.
import QtQuick
import Ros2 1.0
import RosControls 1.0

ThemeButton {
    id: lamp

    readonly property bool on: !state_.stale && state_.message.data
    property var publisher: null
    Component.onCompleted: publisher = Ros2.createPublisher("/flashlight", "std_msgs/msg/Bool", 1)

    function toggle() {
        publisher.publish({ data: !on })
    }

    width: 54; height: 54
    text: on ? "LAMP\nON" : "LAMP"
    tint: on ? Theme.warn : Theme.dim
    opacity: state_.stale ? 0.4 : 1
    onPressed: toggle()

    Rectangle {
        z: -1
        anchors.fill: parent
        radius: Theme.radius; color: Theme.shade
    }

    LiveTopic {
        id: state_; topic: "/flashlight/state"; types: ["std_msgs/msg/Bool"]
        timeout: 700
    }
}
