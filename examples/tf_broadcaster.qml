// Broadcasts a transform: drag the goal to move the frame "goal".
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 330; padding: 20; spacing: 8
    property string title: "Transform broadcaster"
    Component.onCompleted: Ros2.init("tf_broadcaster_example")

    TfBroadcaster {
        frameId: "odom"; childFrameId: "goal"
        rate: 10
        // 50 pixels per metre; x to the right, y upwards.
        translation: Qt.vector3d((goal.x - 210) / 50, (110 - goal.y) / 50, 0)
    }
    // The same frame as received, relative to the robot.
    TfTransform { id: seen; targetFrame: "base_link"; sourceFrame: "goal"; rate: 10 }

    Rectangle {
        width: 440; height: 240; color: "#202830"
        Rectangle {
            id: goal
            x: 300; y: 60; width: 20; height: 20; radius: 10; color: "orange"
            MouseArea { anchors.fill: parent; drag.target: goal }
        }
    }
    Label {
        textFormat: Text.PlainText
        text: seen.valid ? "from the robot: " + seen.translation.x.toFixed(2) + " m ahead, "
                           + seen.translation.y.toFixed(2) + " m to the left"
                         : seen.message.message
        color: seen.stale ? "red" : "black"
    }
}
