// Publishes a QML item as a camera, and shows the images as a robot receives them.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Row {
    padding: 20; spacing: 20
    property string title: "Image publisher"
    Component.onCompleted: Ros2.init("image_publisher_example")

    Subscription { id: battery; topic: "/battery_state" }

    Column {
        spacing: 8
        Rectangle {
            id: gauge
            width: 240; height: 180; color: "midnightblue"
            Rectangle {
                anchors.bottom: parent.bottom
                width: parent.width
                height: battery.message ? parent.height * battery.message.percentage : 0
                color: "seagreen"
            }
            Text {
                anchors.centerIn: parent
                color: battery.stale ? "red" : "white"; font.pixelSize: 32
                textFormat: Text.PlainText
                text: battery.message ? (battery.message.percentage * 100).toFixed(1) + " %" : "?"
            }
        }
        Label { text: "the item" }
    }

    ImagePublisher {
        id: sender
        source: gauge
        topic: "/panel/gauge"
        rate: 5
        frameId: "panel"
        cameraInfo: ({})          // an uncalibrated camera, published on /panel/camera_info
    }

    Column {
        spacing: 8
        ImageItem {
            width: 240; height: 180
            source: ImageTransportSubscription { id: receiver; topic: "/panel/gauge"; defaultTransport: "raw" }
        }
        Label {
            textFormat: Text.PlainText
            text: receiver.stale ? "no image " + sender.problem
                                 : "the image, " + sender.frequency.toFixed(0) + " Hz"
        }
    }
}
