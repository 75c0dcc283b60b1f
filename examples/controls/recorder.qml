import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 380 * Theme.size; height: 200 * Theme.size
    visible: true
    title: "Recorder"
    color: Theme.background
    Component.onCompleted: Ros2.init("recorder")

    Recorder {
        anchors { fill: parent; margins: Theme.gap }
        topics: ["/odom", "/scan", "/tf", "/tf_static"]
        folder: "/tmp"
        sizeLimit: 1e9
        markTexts: ["Obstacle", "Victim", "Operator error"]
    }
}
