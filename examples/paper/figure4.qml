// The paper's Figure 4: selects an iteration of a pose prediction and shows its input and output.
// Start first: python examples/paper/pose_prediction.py
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Rectangle {
    id: root
    implicitWidth: 560; implicitHeight: 380
    // As an overlay over a 3D view, only the panels are visible.
    property bool overlay: false
    property string title: "Pose prediction"
    property var step: null
    // The iterations that were asked for last, and whose values are shown.
    property int asked: 0
    property int shown: 0
    property string failure: ""
    readonly property string problem: client.ready ? failure : "waiting for " + client.name
    readonly property bool current: step !== null && shown === asked && problem === ""
    // The type is not on this machine: it is fetched from the node with the service.
    property var client: Ros2.createServiceClient("/pose_prediction/get_iteration",
                                                  "pose_prediction_msgs/srv/GetIteration")
    color: overlay ? "transparent" : "#20262e"
    Component.onCompleted: Ros2.init("pose_prediction_view")

    function show(iteration) {
        asked = iteration
        client.call({iteration: iteration}).then(
            function (found) {
                if (iteration !== asked) return
                step = found; shown = iteration; failure = ""
            },
            function (error) { if (iteration === asked) failure = error.message })
    }
    Connections { target: client; function onServiceReadyChanged() { if (client.ready) show(slider.value) } }

    // An artificial horizon: rotated by roll, shifted by pitch.
    component Horizon: Column {
        property string name
        property var q: null
        readonly property real roll: q ? Math.atan2(2 * (q.w * q.x + q.y * q.z),
                                                    1 - 2 * (q.x * q.x + q.y * q.y)) : 0
        readonly property real pitch: q ? Math.asin(Math.max(-1, Math.min(1, 2 * (q.w * q.y - q.z * q.x)))) : 0
        spacing: 6
        Label { textFormat: Text.PlainText; text: name; color: "white"; anchors.horizontalCenter: parent.horizontalCenter }
        Rectangle {
            width: 180; height: 180; clip: true; color: "#3b7dd8"; border.color: "white"
            Item {
                anchors.fill: parent
                rotation: roll * 180 / Math.PI
                Rectangle {
                    y: parent.height / 2 + pitch * 150
                    x: -100; width: 380; height: 380
                    color: "#8a5a2b"
                    Rectangle { width: parent.width; height: 2; color: "white" }
                }
            }
            Rectangle { anchors.centerIn: parent; width: 60; height: 3; color: "yellow" }
        }
        Label {
            color: "#c0c8d0"
            anchors.horizontalCenter: parent.horizontalCenter
            textFormat: Text.PlainText
            text: "roll " + (roll * 180 / Math.PI).toFixed(1) + "°, pitch " + (pitch * 180 / Math.PI).toFixed(1) + "°"
        }
    }

    Row {
        id: horizons
        anchors { horizontalCenter: parent.horizontalCenter; top: parent.top; topMargin: 16 }
        spacing: 24
        opacity: root.current ? 1 : 0.35
        Horizon { name: "input"; q: root.step ? root.step.input : null }
        Horizon { name: "output"; q: root.step ? root.step.output : null }
    }
    Column {
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom; margins: 16 }
        spacing: 8
        ProgressBar { width: parent.width; value: root.step ? root.step.stability : 0; opacity: root.current ? 1 : 0.35 }
        Label {
            color: root.problem ? "#ff6060" : "white"
            textFormat: Text.PlainText
            width: parent.width
            wrapMode: Text.Wrap
            maximumLineCount: 8
            elide: Text.ElideRight
            text: (root.problem ? root.problem
                   : root.shown !== root.asked || !root.step ? "asking for iteration " + root.asked
                   : "stability " + root.step.stability.toFixed(2))
                + (root.step && !root.current ? "; above: iteration " + root.shown : "")
        }
        Row {
            spacing: 12
            width: parent.width
            Label { textFormat: Text.PlainText; text: "iteration " + slider.value; color: "white"; width: 90 }
            Slider {
                id: slider
                width: parent.width - 102
                from: 0; to: root.step ? root.step.count - 1 : 1; stepSize: 1
                onMoved: root.show(value)
            }
        }
    }
}
