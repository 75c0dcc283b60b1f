// An action server whose goals the operator executes: robots request items, and can cancel.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    id: root
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Action server"
    property var job: null
    property int done: 0
    Component.onCompleted: Ros2.init("action_server_example")

    ActionServer {
        id: server
        name: "/fetch"
        actionType: "example_interfaces/action/Fibonacci"
        // One goal at a time, with a limited number of items.
        accept: function (goal) { return root.job === null && goal.order > 0 && goal.order <= 10 }
        // No return value: the goal continues until its handle ends it.
        execute: function (goal, handle) {
            root.done = 0
            root.job = handle
            handle.statusChanged.connect(function () { if (!handle.isActive) root.job = null })
        }
    }

    function fetched() {
        done += 1
        job.publishFeedback({sequence: [done]})
        if (done === job.goal.order)
            job.succeed({sequence: [done]})
    }

    Label { textFormat: Text.PlainText; text: server.ready ? "rosglass action send /fetch '{order: 3}'" : server.problem }
    Label {
        textFormat: Text.PlainText
        text: !root.job ? "nothing to do"
            : root.job.isCancelRequested ? "The robot changed its mind!"
            : "Fetch " + (root.job.goal.order - root.done) + " more"
        font.bold: true
    }
    Row {
        spacing: 8
        Button { text: "Fetched one"; enabled: !!root.job; onClicked: root.fetched() }
        Button {
            text: "Stopped"
            enabled: !!root.job && root.job.isCancelRequested
            onClicked: root.job.canceled({sequence: [root.done]})
        }
        Button { text: "Give up"; enabled: !!root.job; onClicked: root.job.abort() }
    }
}
