import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 320 * Theme.size; height: 120 * Theme.size
    visible: true
    title: "LiveFrame"
    color: Theme.background
    Component.onCompleted: Ros2.init("live_frame")

    LiveFrame {
        anchors { fill: parent; margins: Theme.gap }
        title: "Distance driven north"
        source: odometry

        ThemeText {
            text: odometry.message ? odometry.message.pose.pose.position.x.toFixed(2) + " m" : "–"
            font.pixelSize: Theme.large
        }
    }
    LiveTopic {
        id: odometry
        types: ["nav_msgs/msg/Odometry"]
    }
}
