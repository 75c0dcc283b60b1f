import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 440 * Theme.size; height: 260 * Theme.size
    visible: true
    title: "AlarmList"
    color: Theme.background
    Component.onCompleted: Ros2.init("alarm_list")

    AlarmList {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/diagnostics"
        minLevel: "warning"
        topics: [
            { topic: "/emergency_stop/state", text: "Emergency stop" },
            { topic: "/flashlight/state", text: "Lamp is off", when: false, level: "warning" }
        ]
    }
}
