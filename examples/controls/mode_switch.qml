import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 360 * Theme.size; height: 100 * Theme.size
    visible: true
    title: "ModeSwitch"
    color: Theme.background
    Component.onCompleted: Ros2.init("mode_switch")

    ModeSwitch {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/drive/mode"
        modes: ["manual", "assisted", "autonomous"]
    }

    // The robot's side: it confirms each mode that it accepts.
    Subscription {
        property var confirm: Ros2.createPublisher("/drive/mode/state", "std_msgs/msg/String",
                                                   Ros2.QoS().reliable().transient_local())
        topic: "/drive/mode"
        messageType: "std_msgs/msg/String"
        onNewMessage: function(message) { confirm.publish(message) }
        Component.onCompleted: confirm.publish({ data: "manual" })
    }
}
