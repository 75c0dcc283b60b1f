import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 720 * Theme.size; height: 520 * Theme.size
    visible: true
    title: "NodeGraph"
    color: Theme.background
    Component.onCompleted: Ros2.init("node_graph")

    NodeGraph {
        anchors { fill: parent; margins: Theme.gap }
    }
}
