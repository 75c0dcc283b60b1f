// A service and an action in both ways: that of rosglass, and that of qml6_ros2_plugin.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    id: root
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Servers"
    property var question: null
    property var job: null
    Component.onCompleted: Ros2.init("servers_example")

    // A function that returns the response.
    ServiceServer {
        name: "/add"; serviceType: "example_interfaces/srv/AddTwoInts"
        handler: function (request) { return {sum: request.a + request.b} }
    }
    // Returns nothing: sendResponse answers the request later.
    ServiceServer {
        id: asking
        name: "/may_i"; type: "std_srvs/srv/Trigger"
        processRequest: function (request, id) { root.question = id }
    }
    // A function that executes goals; every request to cancel is granted.
    ActionServer {
        name: "/count"; actionType: "example_interfaces/action/Fibonacci"
        execute: function (goal) { return {sequence: Array.from({length: goal.order}, (_, i) => i)} }
    }
    // A signal hands out the goals; without handleCancel, none could be cancelled.
    ActionServer {
        id: walking
        name: "/walk"; type: "example_interfaces/action/Fibonacci"
        handleGoal: function (goal, goalId) { return root.job === null && goal.order <= 10 }
        handleCancel: function (handle) { return true }
        onGoalAccepted: function (goal) {
            root.job = goal
            goal.cancelRequested.connect(() => goal.canceled({sequence: []}))
            goal.terminated.connect(() => root.job = null)
        }
    }

    function decide(yes) {
        asking.sendResponse(question, {success: yes})
        question = null
    }

    Label { textFormat: Text.PlainText; text: asking.advertised ? "rosglass service call /may_i '{}'" : asking.problem }
    Row {
        spacing: 8
        Button { text: "Yes"; enabled: root.question !== null; onClicked: root.decide(true) }
        Button { text: "No"; enabled: root.question !== null; onClicked: root.decide(false) }
    }
    Label { textFormat: Text.PlainText; text: walking.advertised ? "rosglass action send /walk '{order: 3}'" : walking.problem }
    Row {
        spacing: 8
        Button { text: "One step"; enabled: !!root.job; onClicked: root.job.publishFeedback({sequence: [1]}) }
        Button { text: "Arrived"; enabled: !!root.job; onClicked: root.job.succeed({sequence: [1, 2, 3]}) }
        Button { text: "Give up"; enabled: !!root.job; onClicked: root.job.abort() }
    }
}
