// Many cameras on one screen: previews take turns, so they cost the robot very little.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Grid {
    columns: 2; padding: 20; spacing: 12
    property string title: "Previews"
    Component.onCompleted: Ros2.init("previews_example")

    component Preview: Column {
        property alias rate: camera.throttleRate
        property alias angle: camera.rotation
        ImageTransportSubscription { id: camera; topic: "/camera/image_raw" }
        ImageItem { width: 240; height: 180; source: camera }
        Label { textFormat: Text.PlainText; text: camera.stale ? "NO IMAGE" : camera.framerate.toFixed(1) + " Hz" }
    }

    Preview { rate: 1 }
    Preview { rate: 2; angle: 180 }
}
