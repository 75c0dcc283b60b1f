import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 220 * Theme.size; height: 220 * Theme.size
    visible: true
    title: "Attitude"
    color: Theme.background
    Component.onCompleted: Ros2.init("attitude")

    Attitude {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/imu"
        limit: 12
    }
}
