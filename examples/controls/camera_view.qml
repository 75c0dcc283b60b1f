import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 640 * Theme.size; height: 360 * Theme.size
    visible: true
    title: "CameraView"
    color: Theme.background
    Component.onCompleted: Ros2.init("camera_view")

    CameraView {
        anchors.fill: parent
        topic: "/camera/image_raw"
        title: "front camera"
    }
}
