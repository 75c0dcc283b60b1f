// What the robot's parts report about themselves.
import QtQuick
import Ros2 1.0

Panel {
    id: panel
    title: "Diagnostics"
    fresh: feed.fresh
    age: feed.age
    readonly property int worst: {
        let level = 0
        for (const status of states)
            level = Math.max(level, status.level)
        return level
    }
    note: !feed.received ? "" : worst === 0 ? "all good" : worst === 1 ? "warnings" : "errors"
    property var states: []

    property Feed feed: Feed {
        topic: "/diagnostics"
        messageType: "diagnostic_msgs/msg/DiagnosticArray"
        limit: 1.5
        onArrived: function (message) {
            const list = []
            for (let i = 0; i < message.status.length; ++i) {
                const status = message.status[i]
                const value = status.values.length ? status.values[0].value : ""
                list.push({ level: status.level, name: status.name, text: status.message, value: value })
            }
            // Assigned only when it differs: the rows would be rebuilt each time.
            if (JSON.stringify(list) !== JSON.stringify(panel.states))
                panel.states = list
        }
    }

    ListView {
        anchors.fill: parent
        model: panel.states
        clip: true
        interactive: contentHeight > height
        spacing: 2
        delegate: Item {
            id: row
            required property var modelData
            readonly property color tint: [Theme.good, Theme.warn, Theme.bad, Theme.dim][modelData.level] || Theme.bad
            width: ListView.view.width
            height: 20
            Rectangle {
                anchors.verticalCenter: parent.verticalCenter
                width: 8; height: 8; radius: 4
                color: row.tint
            }
            Text {
                id: name
                x: 16
                anchors.verticalCenter: parent.verticalCenter
                width: Math.min(82, row.width * 0.4)
                text: row.modelData.name
                color: Theme.text
                elide: Text.ElideRight
                font.pixelSize: Theme.normal
            }
            Text {
                visible: width > 24
                anchors { left: name.right; right: value.left; rightMargin: 8; verticalCenter: parent.verticalCenter }
                text: row.modelData.text
                color: row.modelData.level === 0 ? Theme.dim : row.tint
                elide: Text.ElideRight
                font.pixelSize: Theme.normal
            }
            Text {
                id: value
                anchors { right: parent.right; verticalCenter: parent.verticalCenter }
                text: row.modelData.value
                color: Theme.dim
                font.pixelSize: Theme.small
            }
        }
    }
}
