import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 720 * Theme.size; height: 420 * Theme.size
    visible: true
    title: "MessageView"
    color: Theme.background
    Component.onCompleted: Ros2.init("message_view")

    Row {
        anchors { fill: parent; margins: Theme.gap }
        spacing: Theme.gap

        TopicTree {
            id: tree
            width: (parent.width - Theme.gap) / 2
            height: parent.height
        }
        MessageView {
            width: tree.width
            height: parent.height
            topic: tree.selected || "/odom"
            editable: true
        }
    }
}
