import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 400; height: 320
    visible: true
    title: "Call"
    color: Theme.background
    Component.onCompleted: Ros2.init("call_panel")

    CallPanel {
        anchors { fill: parent; margins: Theme.gap }
        service: "/flashlight/set"
    }
}
