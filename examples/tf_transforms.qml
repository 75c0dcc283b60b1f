// The position of the robot, and the tree of its frames.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Transforms"
    property var frames: []
    Component.onCompleted: Ros2.init("tf_example")

    TfTransform { id: pose; targetFrame: "odom"; sourceFrame: "base_link"; rate: 10 }
    Connections {
        target: TfTransformListener
        function onFramesChanged() { frames = TfTransformListener.getAllFrames() }
    }

    Label {
        color: pose.stale ? "red" : "black"
        textFormat: Text.PlainText
        text: pose.valid ? "base_link in odom: " + pose.translation.x.toFixed(2) + ", "
                           + pose.translation.y.toFixed(2)
                         : pose.message.message
    }
    Repeater {
        model: frames
        Label {
            textFormat: Text.PlainText
            text: modelData.frameId + (modelData.parentId ? " in " + modelData.parentId : "")
                  + (modelData.isStatic ? ", static" : "")
        }
    }
}
