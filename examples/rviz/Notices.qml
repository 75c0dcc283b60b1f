// Notices in the middle of the 3D view: which data is old, and the outcome of a goal.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0

Column {
    id: notices
    property Contact contact
    spacing: Theme.gap * 0.7

    component Notice: Rectangle {
        property string text
        property color tint: Theme.bad
        anchors.horizontalCenter: parent.horizontalCenter
        width: label.implicitWidth + 3 * Theme.gap; height: Theme.touch
        radius: Theme.radius
        color: Theme.panel
        border { color: tint; width: 2 }
        ThemeText {
            id: label
            anchors.centerIn: parent
            text: parent.text.slice(0, 200)
            color: parent.tint
            font { pixelSize: Theme.normal * 1.2; weight: Font.DemiBold }
        }
    }
    Repeater {
        model: notices.contact.problems
        Notice { text: modelData }
    }

    // A goal of RViz's tool 2D Nav Goal, from the status of move_base.
    LiveTopic {
        id: status
        topic: "/move_base/status"; types: ["actionlib_msgs/msg/GoalStatusArray"]; timeout: 2000
        property string last
        onNewMessage: function (message) {
            var goals = message.status_list, goal = goals.length ? goals.at(goals.length - 1) : null
            var now = goal ? goal.goal_id.id + " " + goal.status : "none"
            // A goal that had ended before this interface started is not shown.
            if (goal && now !== last && (last || goal.status === 1))
                notice.show(goal.status, goal.text)
            last = now
        }
    }
    Notice {
        id: notice
        objectName: "goal"
        readonly property var words: ({4: "GOAL GIVEN UP: ", 5: "GOAL REFUSED: "})
        visible: false
        tint: Theme.accent
        function show(status, reason) {
            notice.text = (words[status] || "Goal: ") + reason
            notice.tint = words[status] ? Theme.bad : status === 2 ? Theme.warn : Theme.accent
            notice.visible = true
            hide.restart()
        }
        Timer { id: hide; interval: 8000; onTriggered: notice.visible = false }
    }
}
