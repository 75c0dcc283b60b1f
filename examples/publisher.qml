// Sends a message on a click; fields that are left out have their defaults.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Publisher"
    property var pub: Ros2.createPublisher("/flashlight", "std_msgs/msg/Bool", 1)
    Component.onCompleted: Ros2.init("publisher_example")

    Subscription { id: state; topic: "/flashlight/state"; qos: Ros2.QoS().reliable().transient_local() }

    Switch {
        text: "Flashlight"
        // What the robot says, not what was clicked.
        checked: state.message ? state.message.data : false
        onClicked: pub.publish({data: checked})
    }
    Label { textFormat: Text.PlainText; text: "heard by " + (state.message ? "the robot, which says " + state.message.data : "nobody yet") }
}
