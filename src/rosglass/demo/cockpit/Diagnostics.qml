// What the robot's parts report about themselves.
import QtQuick
import Ros2 1.0

Panel {
    id: panel
    title: "Diagnostics"
    fresh: feed.fresh
    age: feed.age
    // Seconds after which a part's last report counts as outdated.
    readonly property real limit: 5
    // Maximum number of parts; further ones are only counted.
    readonly property int most: 200
    // What each part said last, by its name and hardware: several nodes report, each its own parts.
    property var parts: ({})
    property var states: []
    property int uncounted: 0
    // The time in seconds, which setting the clock does not change.
    property int seconds: 0
    readonly property int hidden: Math.max(0, states.length - list.shown)
    readonly property var counts: {
        const found = [0, 0, 0, 0]
        for (const state of states)
            found[state.level] += 1
        return found
    }
    note: {
        const said = []
        for (const level of [2, 3, 1])
            if (counts[level])
                said.push(counts[level] + [" ok", " warning", " error", " stale"][level] + (counts[level] > 1 && level !== 3 ? "s" : ""))
        return !feed.received ? "" : said.join(", ") || "all good"
    }

    function rank(level) { return [0, 1, 3, 2][level] }

    function take(message) {
        for (let i = 0; i < message.status.length; ++i) {
            const status = message.status[i]
            const key = status.name + "\n" + status.hardware_id
            if (!(key in parts) && Object.keys(parts).length >= most) {
                uncounted += 1
                continue
            }
            parts[key] = {
                level: [0, 1, 2, 3].includes(status.level) ? status.level : 2,
                name: status.name, text: status.message,
                value: status.values.length ? status.values[0].value : "", at: seconds
            }
        }
        sort()
    }

    // The worst first.
    function sort() {
        const found = Object.values(parts).map(function (part) {
            const silent = seconds - part.at > limit
            return { level: silent ? 3 : part.level, name: part.name, value: silent ? "" : part.value,
                     text: silent ? "silent, said: " + part.text : part.text }
        })
        found.sort((a, b) => rank(b.level) - rank(a.level) || (a.name < b.name ? -1 : a.name > b.name ? 1 : 0))
        // Assigned only when it differs: the rows would be rebuilt each time.
        if (JSON.stringify(found) === JSON.stringify(states))
            return
        // A new model takes the view back to its top, away from what is being read.
        const y = list.contentY
        states = found
        list.forceLayout()
        list.contentY = Math.max(0, Math.min(y, list.contentHeight - list.height))
    }

    property Feed feed: Feed {
        topic: "/diagnostics"
        messageType: "diagnostic_msgs/msg/DiagnosticArray"
        limit: 1.5
        // Each message counts: another node's follows at once.
        throttleRate: 0
        queueSize: 100
    }
    Connections {
        target: panel.feed.subscription
        function onNewMessage(message) { panel.take(message) }
    }
    Timer {
        interval: 1000
        repeat: true
        running: true
        onTriggered: {
            panel.seconds += 1
            panel.sort()
        }
    }

    ListView {
        id: list
        objectName: "list"
        // Rows that are wholly in sight from the top.
        readonly property int shown: Math.floor((height + spacing) / (20 + spacing))
        anchors { fill: parent; bottomMargin: panel.states.length * 22 > parent.height + 2 || panel.uncounted ? 16 : 0 }
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
                textFormat: Text.PlainText
                text: row.modelData.name
                color: Theme.text
                elide: Text.ElideRight
                font.pixelSize: Theme.normal
            }
            Text {
                visible: width > 24
                anchors { left: name.right; right: value.left; rightMargin: 8; verticalCenter: parent.verticalCenter }
                textFormat: Text.PlainText
                text: row.modelData.text
                color: row.modelData.level === 0 ? Theme.dim : row.tint
                elide: Text.ElideRight
                font.pixelSize: Theme.normal
            }
            Text {
                id: value
                anchors { right: parent.right; verticalCenter: parent.verticalCenter }
                textFormat: Text.PlainText
                text: row.modelData.value
                color: Theme.dim
                font.pixelSize: Theme.small
            }
        }
    }
    Text {
        objectName: "more"
        anchors { left: parent.left; leftMargin: 16; bottom: parent.bottom }
        visible: text !== ""
        text: panel.uncounted ? "and more than " + panel.most + " parts"
            : panel.hidden ? panel.hidden + " more" : ""
        textFormat: Text.PlainText
        color: panel.hidden && panel.states[list.shown].level > 0 ? Theme.warn : Theme.dim
        font.pixelSize: Theme.small
    }
}
