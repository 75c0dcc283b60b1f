// Publishes a message on a click; missing fields get their defaults.
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
        // The state the robot reports, not the click.
        checked: state.message ? state.message.data : false
        onClicked: pub.publish({data: checked})
    }
    Label {
        textFormat: Text.PlainText
        text: "state of the robot: " + (state.message ? state.message.data : "not received yet")
        color: state.stale ? "red" : "black"
    }
}
