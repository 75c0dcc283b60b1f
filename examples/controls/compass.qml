import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 480 * Theme.size; height: 240 * Theme.size
    visible: true
    title: "Compass"
    color: Theme.background
    Component.onCompleted: Ros2.init("compass")

    Row {
        anchors { fill: parent; margins: Theme.gap }
        spacing: Theme.gap

        Compass {
            width: parent.width / 2 - Theme.gap / 2
            height: parent.height
            topic: "/imu"
            declination: 3.5
        }
        Compass {
            width: parent.width / 2 - Theme.gap / 2
            height: parent.height
            topic: "/odom"
        }
    }
}
