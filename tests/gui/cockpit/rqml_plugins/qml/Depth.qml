import QtQuick
import QtMultimedia
import Ros2
import RQml.DefaultPlugins

Item {
    VideoOutput {
        id: output
        objectName: "output"
        anchors.fill: parent
    }
    DepthImageProcessor {
        id: processor
        objectName: "processor"
        maxDepth: 4
        outputVideoSink: output.videoSink
    }
    ImageTransportSubscription {
        topic: "/depth/image_raw"
        defaultTransport: "raw"
        videoSink: processor.videoSink
    }
}
