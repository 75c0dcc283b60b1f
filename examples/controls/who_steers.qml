import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 320 * Theme.size; height: 100 * Theme.size
    visible: true
    title: "WhoSteers"
    color: Theme.background
    Component.onCompleted: Ros2.init("who_steers")

    TwistCommand { id: drive }
    WhoSteers {
        anchors { fill: parent; margins: Theme.gap }
        command: drive
    }
}
