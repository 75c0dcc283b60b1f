// The camera image. An old image is never shown as live: once images stop, or arrive late, it turns
// grey under a red frame that says how old they are.
import QtQuick
import Ros2 1.0

Item {
    id: view

    property alias topic: camera.topic
    property alias transport: camera.defaultTransport
    // Why images may be missing altogether, from the connection.
    property string reason
    // Seconds that an image may be shown as live after its arrival: at 30 images a second, losing
    // fifteen is more than a hiccup.
    property real limit: 0.5
    property bool received: false
    property double stamp: 0
    property real age: -1
    // Milliseconds from the robot's stamp to here. More than a second means an old image, or
    // clocks too far apart to distinguish the two: neither may be shown as live.
    readonly property real latency: camera.latency
    readonly property bool late: received && !camera.stale && Math.abs(latency) > 1000
    readonly property bool live: received && age <= limit && !camera.stale && !late
    // -1 for unknown: the stream's is a mean over some images, including an interruption among them.
    readonly property real framerate: settled ? camera.framerate : -1
    property bool settled: false
    onLiveChanged: settled = false
    // The rectangle of the image, in this item's coordinates.
    readonly property rect pictureRect: output.contentRect

    ImageTransportSubscription {
        id: camera
        objectName: "cameraStream"
        topic: "/camera/image_raw"
        defaultTransport: "raw"
        // The last image stays, so that the operator can see where the robot was; the frame says
        // that it is old.
        timeout: 0
        // The figures are read from the pixels of the image.
        fullResolution: true
    }
    Connections {
        target: output.videoSink
        function onVideoFrameChanged() {
            view.stamp = Date.now()
            view.age = 0
            view.received = true
            Beat.picture()
        }
    }
    Timer {
        interval: 1200
        running: view.live && !view.settled
        onTriggered: view.settled = true
    }
    Timer {
        interval: 100
        running: view.received
        repeat: true
        // It grows even when the clock is set back, so that a frozen image never counts as live.
        onTriggered: view.age = Math.max(view.age + interval / 1000, (Date.now() - view.stamp) / 1000)
    }

    VideoOutput {
        id: output
        objectName: "picture"
        anchors.fill: parent
        source: camera
    }

    // Name, rate and latency of the stream.
    Rectangle {
        x: output.contentRect.x + 12
        y: output.contentRect.y + 12
        width: label.width + 24
        height: 28
        radius: 14
        color: Theme.shade
        visible: view.live && width < output.contentRect.width - 24
        Row {
            id: label
            anchors.centerIn: parent
            spacing: 8
            Rectangle {
                anchors.verticalCenter: parent.verticalCenter
                width: 8; height: 8; radius: 4
                color: Theme.bad
                SequentialAnimation on opacity {
                    running: view.live
                    loops: Animation.Infinite
                    PropertyAction { value: 1 }
                    PauseAnimation { duration: 700 }
                    PropertyAction { value: 0.25 }
                    PauseAnimation { duration: 500 }
                }
            }
            Text {
                anchors.verticalCenter: parent.verticalCenter
                text: "LIVE"
                color: Theme.text
                font { pixelSize: Theme.small; weight: Font.Bold; letterSpacing: 1 }
            }
            Text {
                anchors.verticalCenter: parent.verticalCenter
                textFormat: Text.PlainText
                text: "front camera   " + (view.framerate < 0 ? "" : view.framerate.toFixed(0) + " Hz   ")
                    + (view.latency >= 0 ? view.latency.toFixed(0) + " ms" : "")
                color: Theme.dim
                font.pixelSize: Theme.small
            }
        }
    }

    // The image below this is not live and must not look live.
    Rectangle {
        objectName: "noSignal"
        anchors.fill: parent
        visible: !view.live
        // A veil, not a shader: one that has to be compiled first would come late.
        color: view.received ? "#b8403a3d" : "#160a0e"
        border { color: Theme.bad; width: 6 }

        Rectangle {
            anchors.centerIn: parent
            width: Math.min(parent.width - 20, Math.max(380, banner.implicitWidth + 56))
            height: banner.height + 36
            radius: Theme.radius
            color: "#f0200409"
            border { color: Theme.bad; width: 2 }
            Column {
                id: banner
                anchors.centerIn: parent
                width: Math.max(1, Math.min(implicitWidth, view.width - 40))
                spacing: 8
                Text {
                    anchors.horizontalCenter: parent.horizontalCenter
                    textFormat: Text.PlainText
                    text: !view.late ? "NO SIGNAL" : view.latency > 0 ? "PICTURE DELAYED" : "CLOCKS DIFFER"
                    color: Theme.bad
                    font { pixelSize: Math.max(12, Math.min(38, view.width / 14)); weight: Font.Black; letterSpacing: view.width / 200 }
                    SequentialAnimation on opacity {
                        running: !view.live
                        loops: Animation.Infinite
                        PropertyAction { value: 1 }
                        PauseAnimation { duration: 600 }
                        PropertyAction { value: 0.45 }
                        PauseAnimation { duration: 300 }
                    }
                }
                Text {
                    objectName: "noSignalText"
                    anchors.horizontalCenter: parent.horizontalCenter
                    textFormat: Text.PlainText
                    text: !view.received ? "no image received yet"
                        : view.late
                            ? "by " + Math.abs(view.latency / 1000).toFixed(1) + " s"
                            : "last image " + view.age.toFixed(1) + " s old"
                    color: Theme.text
                    font.pixelSize: Theme.large
                }
                Text {
                    anchors.horizontalCenter: parent.horizontalCenter
                    width: Math.max(1, Math.min(implicitWidth, view.width - 50))
                    visible: text !== ""
                    textFormat: Text.PlainText
                    text: view.late ? "or the clocks of robot and cockpit differ by that much"
                        : view.reason || camera.problem
                    color: Theme.dim
                    wrapMode: Text.Wrap
                    maximumLineCount: 8
                    elide: Text.ElideRight
                    horizontalAlignment: Text.AlignHCenter
                    font.pixelSize: Theme.normal
                }
            }
        }
    }
}
