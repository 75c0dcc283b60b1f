import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 560; height: 120
    visible: true
    title: "Lamp"
    color: Theme.background
    Component.onCompleted: Ros2.init("lamp")

    Row {
        anchors { fill: parent; margins: Theme.gap }
        spacing: Theme.gap

        Lamp {
            width: (parent.width - 2 * Theme.gap) / 3
            height: parent.height
            title: "Emergency stop"
            path: "/emergency_stop/state:data"
            tint: Theme.bad
            onText: qsTr("STOPPED")
            offText: qsTr("released")
        }
        Lamp {
            width: (parent.width - 2 * Theme.gap) / 3
            height: parent.height
            title: "Battery"
            path: "/battery_state:voltage"
            above: 22
            onText: qsTr("enough")
            offText: qsTr("LOW")
        }
        Lamp {
            width: (parent.width - 2 * Theme.gap) / 3
            height: parent.height
            title: "Arm"
            path: "/arm/ready:data"
        }
    }
}
