import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 260 * Theme.size; height: 120 * Theme.size
    visible: true
    title: "Speed"
    color: Theme.background
    Component.onCompleted: Ros2.init("speed")

    Speed {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/odom"
    }
}
