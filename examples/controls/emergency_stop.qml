import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 220 * Theme.size; height: 260 * Theme.size
    visible: true
    title: "EmergencyStop"
    color: Theme.background
    Component.onCompleted: Ros2.init("emergency_stop")

    EmergencyStop {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/emergency_stop"
    }
}
