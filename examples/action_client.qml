// Sends goals to the robot's action /turn, shows their status and result, and cancels them.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    id: root
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Action client"
    property var client: Ros2.createActionClient("/turn", "turtlesim/action/RotateAbsolute")
    property var goal: null
    property string outcome: "no goal yet"
    Component.onCompleted: Ros2.init("action_client_example")

    function turn(degrees) {
        outcome = "on its way"
        goal = client.sendGoalAsync({theta: degrees * Math.PI / 180}, {
            onGoalResponse: function (handle) { if (!handle) outcome = "not accepted" },
            onFeedback: function (handle, feedback) {
                outcome = (feedback.remaining * 180 / Math.PI).toFixed(0) + "° to go"
            },
            // Called exactly once per goal.
            onResult: function (end) {
                switch (end.code) {
                case ActionGoalStatus.Succeeded: outcome = "done"; break
                case ActionGoalStatus.Canceled: outcome = "cancelled"; break
                default: outcome = "failed: " + (end.reason || "the robot gave up")
                }
            }
        })
    }

    Label { textFormat: Text.PlainText; text: client.name + (client.ready ? " is available" : " is not available yet") }
    Row {
        spacing: 8
        Button { text: "Face north"; enabled: client.ready; onClicked: turn(90) }
        Button { text: "Face east"; enabled: client.ready; onClicked: turn(0) }
        Button {
            text: "Stop"
            enabled: root.goal !== null && root.goal.isActive
            onClicked: root.goal.cancel()
        }
    }
    Label { textFormat: Text.PlainText; text: outcome; font.bold: true }
}
