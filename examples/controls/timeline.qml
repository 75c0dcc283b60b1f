import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 520 * Theme.size; height: 130 * Theme.size
    visible: true
    title: "Timeline"
    color: Theme.background
    Component.onCompleted: Ros2.init("timeline")

    Timeline {
        anchors { fill: parent; margins: Theme.gap }
        file: Qt.resolvedUrl("../drive.mcap")
    }
}
