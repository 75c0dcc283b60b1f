import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 640 * Theme.size; height: 360 * Theme.size
    visible: true
    title: "CameraGrid"
    color: Theme.background
    Component.onCompleted: Ros2.init("camera_grid")

    CameraGrid {
        anchors { fill: parent; margins: Theme.gap }
        topics: ["/camera/image_raw", "/rear_camera/image_raw"]
    }
}
