// FlexBE behaviours: a button sends the action's goal; the robot's status is below.
import QtQuick 2.15
import Ros 1.0

Column {
    id: behaviours
    spacing: 4
    property var client: Ros.createActionClient("flexbe_msgs/BehaviorExecutionAction", "/flexbe/execute_behavior")
    property bool live
    readonly property bool ready: client.connected && live
    property var goal: null
    property string name
    property string outcome
    readonly property bool active: goal !== null && goal.isActive

    function start(behaviour) {
        name = behaviour
        outcome = ""
        goal = client.sendGoal({behavior_name: behaviour}, function (handle) {
            if (handle.commState !== ActionCommStates.DONE)
                return
            var end = handle.terminalState, result = handle.getResult()
            outcome = end.state === ActionTerminalStates.SUCCEEDED ? "done, " + result.outcome
                : end.state === ActionTerminalStates.PREEMPTED ? "cancelled"
                : "failed: " + (end.text || result && result.outcome || "no answer")
        }, function () {})
        if (goal === null)
            outcome = "NOT SENT: no server is connected"
    }

    Repeater {
        model: ["Look around", "Turn around", "Flippers up", "Flippers flat", "Return to dock"]
        Push {
            objectName: "behaviour " + modelData
            width: behaviours.width; height: 23
            text: modelData
            enabled: behaviours.ready && !behaviours.active
            checked: behaviours.active && behaviours.name === modelData
            onClicked: behaviours.start(modelData)
        }
    }
    Text {
        width: behaviours.width
        wrapMode: Text.Wrap
        maximumLineCount: 2
        elide: Text.ElideRight
        textFormat: Text.PlainText
        text: !behaviours.live ? "ROBOT SILENT" + (behaviours.active ? ": " + behaviours.name + " may still be running" : "")
            : !behaviours.client.connected ? "NO BEHAVIOUR SERVER" : behaviours.active
            ? behaviours.name + ": " + (behaviours.goal.feedback ? behaviours.goal.feedback.current_state || "executing" : "on its way")
            : behaviours.name ? behaviours.name + ": " + behaviours.outcome : ""
        color: behaviours.ready ? Theme.text : Theme.bad
        font.pixelSize: 11
    }
    Push {
        width: behaviours.width; height: 24
        text: "Cancel"
        tint: Theme.bad
        enabled: behaviours.active
        checked: behaviours.active
        onClicked: behaviours.goal.cancel()
    }
    Connections {
        target: behaviours.goal
        function onCancelFailed(reason) { behaviours.outcome = "NOT CANCELLED: " + reason }
    }
}
