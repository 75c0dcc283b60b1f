// Who else may steer the robot: other publishers of its command topics, nodes of the same name, and
// the locks of its multiplexer; in words.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: who

    // Command topics; empty for those of `command`, or cmd_vel.
    property var topics: []
    property string ns
    // The TwistCommand of this screen.
    property var command: null
    // Lock topics (std_msgs/Bool, true locks); those of a twist_mux are found by themselves.
    property var locks: []
    // Full names of nodes that may steer as well, such as the navigation.
    property var allowed: []

    // What was found, worst first: {level, text} with level 0 (good), 1 (warning) or 2 (bad).
    readonly property var findings: findings_
    // The worst level.
    readonly property int level: findings_.length ? findings_[0].level : 0

    property var findings_: []
    property var locks_: []
    property var locked_: ({})

    title: qsTr("Who steers")
    source: null
    stale: Ros2.connectionState !== "connected"
    age: -1
    contentWidth: 240 * Theme.size
    contentHeight: column.height
    Accessible.description: status || findings_.map(function(one) { return one.text }).join("; ")

    function within_(name) {
        if (name.startsWith("/"))
            return name
        const space = ns || Ros2.getNamespace()
        return (space.startsWith("/") ? "" : "/") + (space === "/" ? "" : space.replace(/\/+$/, "")) + "/" + name
    }

    function commandTopics_() {
        const given = topics.length ? topics : [command && command.topic ? command.topic : "cmd_vel"]
        return given.map(function(one) { return within_(String(one)) })
    }

    function refresh_() {
        const found = [], mine = graph.nodeName
        const twins = graph.duplicateNodes, named = {}, locks = who.locks.map(function(one) { return within_(String(one)) })
        for (const topic of commandTopics_()) {
            const others = {}
            let own = 0
            for (const one of Ros2.getPublishersInfo(topic)) {
                if (one.node === mine)
                    own += 1
                else
                    others[one.node] = (others[one.node] || 0) + 1
            }
            if (own > 1 && twins[mine])
                found.push({ level: 2, text: Fields.fill(qsTr("another node called %1 publishes %2"), [mine, topic]) })
            for (const node in others) {
                const may = allowed.indexOf(node) >= 0
                found.push({ level: may ? 0 : 1, text: may ? Fields.fill(qsTr("%1 may steer by %2"), [node, topic]) : Fields.fill(qsTr("%1 also publishes %2"), [node, topic]) })
                named[node] = true
            }
            const receivers = Ros2.getSubscriptionsInfo(topic).map(function(one) { return one.node })
            if (receivers.length === 0)
                found.push({ level: 2, text: qsTr("no node receives %1").arg(topic) })
            for (const node of receivers) {
                named[node] = true
                // A multiplexer: it passes on one of several inputs, and has locks of type Bool.
                if (/(^|\/)(twist|cmd_vel)_mux[^\/]*$/.test(node)) {
                    const info = Ros2.getNodeInfo(node)
                    for (const input of info.subscriptions) {
                        if (input.type === "std_msgs/msg/Bool" || input.type === "std_msgs/Bool")
                            locks.push(input.name)
                        else if (/\/msg\/Twist(Stamped)?$/.test(input.type) && commandTopics_().indexOf(input.name) < 0) {
                            for (const one of Ros2.getPublishersInfo(input.name))
                                if (one.node !== mine)
                                    found.push({ level: 0, text: Fields.fill(qsTr("%1 steers by %2 through %3"), [one.node, input.name, node]) })
                        }
                    }
                }
            }
        }
        for (const node in twins)
            if (named[node] || node === mine)
                found.push({ level: 2, text: Fields.fill(qsTr("%1 nodes are called %2: all obey, or all steer"), [twins[node], node]) })
        const unique = locks.filter(function(one, at) { return locks.indexOf(one) === at }).slice(0, 32).sort()
        if (JSON.stringify(unique) !== JSON.stringify(locks_))
            locks_ = unique
        for (const lock of locks_) {
            const state = locked_[lock]
            if (state === true)
                found.push({ level: 2, text: qsTr("locked by %1: commands are not passed on").arg(lock) })
            else if (state === undefined)
                found.push({ level: 1, text: qsTr("lock %1: nothing received").arg(lock) })
        }
        found.sort(function(a, b) { return b.level - a.level || (a.text < b.text ? -1 : a.text > b.text ? 1 : 0) })
        if (found.every(function(one) { return one.level === 0 }))
            found.unshift({ level: 0, text: qsTr("only this screen") })
        if (JSON.stringify(found) !== JSON.stringify(findings_))
            findings_ = found
    }

    function setLock_(topic, state) {
        if (locked_[topic] === state)
            return
        const next = Object.assign({}, locked_)
        next[topic] = state
        locked_ = next
        refresh_()
    }

    Component.onCompleted: refresh_()
    onTopicsChanged: refresh_()
    onNsChanged: refresh_()
    onLocksChanged: refresh_()
    onAllowedChanged: refresh_()
    onCommandChanged: refresh_()
    onStaleChanged: refresh_()

    GraphWatch {
        id: graph
        onChanged: who.refresh_()
    }
    Repeater {
        model: who.locks_
        Item {
            LiveTopic {
                topic: modelData
                types: ["std_msgs/msg/Bool"]
                qos: Ros2.BestAvailableQoS()
                timeout: 0
                onMessageChanged: who.setLock_(modelData, message === undefined ? undefined : message.data === true)
                onStaleChanged: if (stale) who.setLock_(modelData, undefined)
            }
        }
    }

    Column {
        id: column
        width: parent.width
        spacing: Theme.gap / 3
        Repeater {
            model: Math.min(who.findings_.length, 12)
            Row {
                readonly property var finding: index < who.findings_.length ? who.findings_[index] : ({ level: 0, text: "" })
                readonly property color tint: finding.level === 2 ? Theme.bad : finding.level === 1 ? Theme.warn : Theme.good
                width: column.width
                spacing: Theme.gap / 2
                ThemeText {
                    id: mark
                    width: Theme.normal
                    text: parent.finding.level === 0 ? "●" : "▲"
                    color: parent.tint
                    font.pixelSize: Theme.small
                }
                ThemeText {
                    objectName: "finding" + index
                    width: parent.width - mark.width - parent.spacing
                    text: parent.finding.text
                    color: parent.finding.level === 2 ? Theme.bad : Theme.text
                    wrapMode: Text.Wrap
                    maximumLineCount: 3
                    font { pixelSize: Theme.small; weight: parent.finding.level === 2 ? Font.DemiBold : Font.Normal }
                }
            }
        }
        ThemeText {
            visible: who.findings_.length > 12
            width: parent.width
            text: qsTr("and %1 more").arg(who.findings_.length - 12)
            color: Theme.dim
            font.pixelSize: Theme.small
        }
    }
}
