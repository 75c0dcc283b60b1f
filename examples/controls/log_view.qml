import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 680 * Theme.size; height: 300 * Theme.size
    visible: true
    title: "LogView"
    color: Theme.background
    Component.onCompleted: Ros2.init("log_view")
    // Something to see: this program's own messages.
    Timer {
        property int count: 0
        interval: 500; repeat: true; running: true
        onTriggered: Ros2.info("the log has been open for %1 s".arg(++count / 2))
    }

    LogView {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/rosout"
    }
}
