import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 520 * Theme.size; height: 200 * Theme.size
    visible: true
    title: "Gauge"
    color: Theme.background
    Component.onCompleted: Ros2.init("gauge")

    Row {
        anchors { fill: parent; margins: Theme.gap }
        spacing: Theme.gap

        Gauge {
            width: parent.width / 2 - Theme.gap / 2
            height: parent.height
            title: "Battery"
            path: "/battery_state:voltage"
            unit: "V"
            from: 18; to: 26
            warnBelow: 21; badBelow: 19.5
        }
        Gauge {
            width: parent.width / 2 - Theme.gap / 2
            title: "Pitch rate"
            path: "/imu:angular_velocity.y"
            style: "bar"
            unit: "°/s"
            factor: 180 / Math.PI
            from: -45; to: 45
            warnAbove: 20; badAbove: 35
            warnBelow: -20; badBelow: -35
        }
    }
}
