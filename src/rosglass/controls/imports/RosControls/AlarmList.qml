// Alarms of diagnostic_msgs/DiagnosticArray and std_msgs/Bool, which stay until they are acknowledged.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: list

    // The topic of diagnostics; without one, the first of this type.
    property string topic
    property string ns
    // Whether diagnostics raise alarms.
    property bool diagnostics: true
    // From which level on a part raises one: "error" or "warning". A silent part always does.
    property alias minLevel: alarms.minLevel
    // Topics of std_msgs/Bool: names, or objects such as { topic: "/estop", text: "Emergency stop",
    // when: true, level: "error" }.
    property var topics: []
    // Whether the desktop's bell sounds every two seconds while an alarm is not acknowledged.
    property bool sound: true
    // Silences the bell until the next alarm.
    property bool muted: false
    readonly property alias active: alarms.active
    readonly property alias unacknowledged: alarms.unacknowledged
    readonly property alias total: alarms.total
    // An alarm was added, came again, or became worse.
    signal raised(string name)

    // Topics of which nothing was received yet, and whether this machine has a bell.
    property var missing_: []
    property bool mute_: false
    readonly property var tints_: [Theme.good, Theme.warn, Theme.bad, Theme.dim]
    readonly property var names_: ["", qsTr("warning"), qsTr("error"), qsTr("silent")]

    // Acknowledge all alarms.
    function acknowledgeAll() {
        alarms.acknowledgeAll()
    }

    function set_(topic, missing) {
        const others = missing_.filter(function(one) { return one !== topic })
        if (missing || others.length !== missing_.length)
            missing_ = missing ? others.concat([topic]) : others
    }

    title: qsTr("Alarms")
    source: diagnostics ? live : null
    contentWidth: 280 * Theme.size
    contentHeight: 120 * Theme.size
    note: !total ? (missing_.length ? "" : qsTr("none"))
        : unacknowledged ? qsTr("%1 not acknowledged").arg(unacknowledged) : qsTr("%1 active").arg(active)
    Accessible.description: (status ? status + ", " : "") + note

    DiagnosticsTopic {
        id: live
        topic: list.topic
        ns: list.ns
        enabled: list.diagnostics
    }
    Alarms {
        id: alarms
        reports: list.diagnostics ? live : null
        onRaised: function(name) {
            list.muted = false
            list.raised(name)
        }
    }
    Repeater {
        model: list.topics
        Item {
            id: input
            readonly property bool plain_: typeof modelData === "string"
            readonly property string topic: plain_ ? modelData : modelData.topic
            readonly property string text: plain_ || !modelData.text ? topic : modelData.text
            readonly property bool when: plain_ || modelData.when === undefined ? true : modelData.when
            readonly property int level: !plain_ && modelData.level === "warning" ? 1 : 2
            // 0 while all is well, as an alarm's level.
            readonly property int state_: bool.message === undefined ? 0 : bool.stale ? 3
                : bool.message.data === when ? level : 0
            readonly property bool missing: bool.message === undefined

            function show_() {
                alarms.update(topic, text, state_ === 3 ? qsTr("nothing is received any more") : bool.problem, state_)
            }

            onState_Changed: show_()
            onMissingChanged: list.set_(topic, missing)
            Component.onCompleted: list.set_(topic, missing)
            Component.onDestruction: {
                list.set_(topic, false)
                alarms.update(topic, text, "", 0)
            }

            LiveTopic {
                id: bool
                topic: input.topic
                ns: list.ns
                types: ["std_msgs/msg/Bool"]
                qos: Ros2.BestAvailableQoS()
                throttleRate: 0
                timeout: 0
            }
        }
    }
    Timer {
        interval: 2000
        repeat: true
        triggeredOnStart: true
        running: list.sound && !list.muted && list.unacknowledged > 0
        onTriggered: list.mute_ = !alarms.beep()
    }

    ThemeList {
        id: view
        objectName: "list"
        anchors { top: parent.top; left: parent.left; right: parent.right; bottom: bar.visible ? bar.top : parent.bottom; bottomMargin: bar.visible ? Theme.gap / 2 : 0 }
        name: list.title
        model: alarms.rows
        moreTint: Theme.warn
        more: {
            const parts = []
            if (list.missing_.length)
                parts.push(qsTr("no data yet: %1").arg(Fields.bounded(list.missing_.join(", "), 200)))
            if (alarms.omitted)
                parts.push(qsTr("%1 further alarms not shown").arg(alarms.omitted))
            if (list.mute_ && list.sound)
                parts.push(qsTr("no sound: QtWidgets is not installed"))
            return parts.join(" · ")
        }
        onChosen: function(index) { alarms.acknowledge(index) }
        delegate: Rectangle {
            id: row
            readonly property color tint: list.tints_[model.level]
            readonly property string when: model.active ? model.began : Fields.fill(qsTr("%1 to %2"), [model.began, model.ended])
            width: ListView.view.width
            height: Math.max(Theme.touch, Math.round(Theme.normal * 2.6))
            color: ListView.isCurrentItem ? Theme.track : "transparent"
            Accessible.role: Accessible.ListItem
            Accessible.name: (model.first ? qsTr("first") + ", " : "") + model.name + ": " + model.text + ", " + list.names_[model.level]
                + (model.active ? "" : ", " + qsTr("over")) + (model.acknowledged ? "" : ", " + qsTr("not acknowledged"))
            Accessible.onPressAction: alarms.acknowledge(index)
            Rectangle {
                width: Theme.gap / 2
                height: parent.height - 4
                y: 2
                radius: 2
                color: row.tint
                opacity: model.active ? 1 : 0.4
            }
            ThemeText {
                id: title
                anchors { left: parent.left; leftMargin: Theme.gap * 1.2; right: accept.left; rightMargin: Theme.gap; top: parent.top; topMargin: 3 }
                text: (model.first ? "① " : "") + model.name + (model.times > 1 ? " ×" + model.times : "")
                color: model.acknowledged ? Theme.dim : row.tint
                font.weight: model.acknowledged ? Font.Normal : Font.Bold
            }
            ThemeText {
                anchors { left: title.left; right: title.right; bottom: parent.bottom; bottomMargin: 3 }
                text: [row.when, model.level === 3 ? list.names_[3] : "", model.text, model.active ? "" : qsTr("over")].filter(function(part) { return part }).join(" · ")
                color: Theme.dim
                font.pixelSize: Theme.small
            }
            ThemeText {
                id: accept
                anchors { right: parent.right; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                visible: !model.acknowledged
                width: visible ? implicitWidth : 0
                text: "✓"
                color: Theme.accent
                font.pixelSize: Theme.large
                TapHandler {
                    margin: Theme.gap
                    onTapped: alarms.acknowledge(index)
                }
            }
            TapHandler {
                onTapped: {
                    view.currentIndex = index
                    view.view.forceActiveFocus()
                }
            }
        }
    }
    Row {
        id: bar
        anchors { left: parent.left; bottom: parent.bottom }
        visible: list.total > 0
        spacing: Theme.gap / 2
        ThemeButton {
            objectName: "all"
            enabled: list.unacknowledged > 0
            text: qsTr("Acknowledge all")
            onClicked: list.acknowledgeAll()
        }
        ThemeButton {
            objectName: "mute"
            visible: list.sound
            enabled: list.unacknowledged > 0
            checkable: true
            checked: list.muted
            text: qsTr("Mute")
            onToggled: list.muted = checked
        }
    }
}
