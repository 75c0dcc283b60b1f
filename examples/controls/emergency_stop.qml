import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 220; height: 260
    visible: true
    title: "EmergencyStop"
    color: Theme.background
    Component.onCompleted: Ros2.init("emergency_stop")

    EmergencyStop {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/emergency_stop"
    }
}
