import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 760; height: 440
    visible: true
    title: "Publish"
    color: Theme.background
    Component.onCompleted: Ros2.init("publish_panel")

    Row {
        anchors { fill: parent; margins: Theme.gap }
        spacing: Theme.gap

        PublishPanel {
            width: (parent.width - parent.spacing) / 2
            height: parent.height
            topic: "/flipper_controller/commands"
            rate: 2
        }
        PublishPanel {
            width: (parent.width - parent.spacing) / 2
            height: parent.height
            topic: "/cmd_vel"
            type: "geometry_msgs/Twist"
        }
    }
}
