import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 560 * Theme.size; height: 420 * Theme.size
    visible: true
    title: "TopicTree"
    color: Theme.background
    Component.onCompleted: Ros2.init("topic_tree")

    TopicTree {
        anchors { fill: parent; margins: Theme.gap }
        onActivated: function(topic) { console.log(topic) }
    }
}
