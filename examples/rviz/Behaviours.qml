// FlexBE behaviours: a button sends the action's goal; the robot's status is below.
import QtQuick 2.15
import RosControls 1.0

ActionPanel {
    id: behaviours
    property bool live

    objectName: "behaviours"
    title: "Behaviours"
    action: "/flexbe/execute_behavior"; type: "flexbe_msgs/action/BehaviorExecution"
    goals: ["Look around", "Turn around", "Flippers up", "Flippers flat", "Return to dock"]
        .map(name => ({text: name, goal: {behavior_name: name}}))
    describe: message => message.outcome !== undefined ? message.outcome : message.current_state || "executing"
    stale: !ready || !live
    obstacle: live ? "" : "ROBOT SILENT"
}
