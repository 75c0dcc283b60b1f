import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 320 * Theme.size; height: 160 * Theme.size
    visible: true
    title: "Battery"
    color: Theme.background
    Component.onCompleted: Ros2.init("battery")

    Battery {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/battery_state"
    }
}
