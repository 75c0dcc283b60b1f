// A camera with any transport, and its statistics.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Item {
    implicitWidth: 640; implicitHeight: 480
    property string title: "Camera"
    Component.onCompleted: Ros2.init("camera_example")

    ImageTransportSubscription { id: camera; topic: "/camera/image_raw"; timeout: 1000 }
    ImageItem { anchors.fill: parent; source: camera }
    Label {
        padding: 6
        background: Rectangle { color: "black"; opacity: 0.6 }
        color: camera.stale ? "red" : "white"
        textFormat: Text.PlainText
        text: camera.stale ? "NO IMAGE " + camera.problem
                           : camera.encoding + " over " + camera.transport + ", "
                             + camera.framerate.toFixed(0) + " Hz, " + camera.latency.toFixed(0) + " ms"
    }
}
