// The log messages of all nodes, of rcl_interfaces/Log or rosgraph_msgs/Log.
import QtQuick 2.15
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: log

    // The topic; without one, the first of these types.
    property string topic
    property string ns
    // Least level that is shown, 0 to 4: 0 debug, 1 info, 2 warn, 3 error, 4 fatal.
    property alias minLevel: live.minLevel
    // Shows only nodes, and only texts, that have it; empty for all.
    property alias nodeFilter: live.nodeFilter
    property alias textFilter: live.textFilter
    // Whether the rows stay as they are; messages are kept all the same.
    property alias paused: live.paused
    // Most messages that are kept.
    property alias keep: live.keep
    // Whether levels, filters and buttons are shown.
    property bool tools: true
    // Messages of each level.
    readonly property alias counts: live.counts

    property bool follow_: true
    readonly property var letters_: [qsTr("D"), qsTr("I"), qsTr("W"), qsTr("E"), qsTr("F")]
    readonly property var names_: [qsTr("debug"), qsTr("info"), qsTr("warning"), qsTr("error"), qsTr("fatal")]
    readonly property var tints_: [Theme.dim, Theme.text, Theme.warn, Theme.bad, Theme.bad]

    // Copy the selected row, or all rows without one.
    function copy() {
        live.copy(list.currentIndex)
    }

    // Forget all messages and counts.
    function clear() {
        live.clear()
    }

    title: qsTr("Log")
    source: live
    contentWidth: 420 * Theme.size
    contentHeight: 240 * Theme.size
    note: paused ? qsTr("PAUSED · %1 new").arg(live.waiting) : live.kept ? qsTr("%1 messages").arg(live.kept) : ""

    LogTopic {
        id: live
        topic: log.topic
        ns: log.ns
    }

    Flow {
        id: bar
        visible: log.tools
        width: parent.width
        spacing: Theme.gap / 2
        Repeater {
            model: 5
            ThemeButton {
                objectName: "level" + index
                implicitHeight: Theme.touch * 0.75
                text: log.letters_[index] + " " + (log.counts[index] < 10000 ? log.counts[index] : Math.floor(log.counts[index] / 1000) + "k")
                tint: index < log.minLevel ? Theme.dim : index ? log.tints_[index] : Theme.accent
                Accessible.name: Fields.fill(qsTr("show from %1, %2 messages"), [log.names_[index], log.counts[index]])
                onClicked: log.minLevel = index
            }
        }
        ThemeField {
            objectName: "nodes"
            width: 76 * Theme.size
            implicitHeight: Theme.touch * 0.75
            placeholderText: qsTr("node")
            text: log.nodeFilter
            Accessible.name: qsTr("show nodes with")
            onTextEdited: log.nodeFilter = text
        }
        ThemeField {
            objectName: "texts"
            width: 76 * Theme.size
            implicitHeight: Theme.touch * 0.75
            placeholderText: qsTr("text")
            text: log.textFilter
            Accessible.name: qsTr("show texts with")
            onTextEdited: log.textFilter = text
        }
        ThemeButton {
            objectName: "pause"
            implicitHeight: Theme.touch * 0.75
            text: log.paused ? qsTr("Resume") : qsTr("Pause")
            onClicked: log.paused = !log.paused
        }
        ThemeButton {
            objectName: "copy"
            implicitHeight: Theme.touch * 0.75
            text: list.currentIndex >= 0 ? qsTr("Copy row") : qsTr("Copy all")
            onClicked: log.copy()
        }
        ThemeButton {
            objectName: "clear"
            implicitHeight: Theme.touch * 0.75
            text: qsTr("Clear")
            onClicked: log.clear()
        }
    }

    ThemeList {
        id: list
        objectName: "list"
        anchors { top: bar.visible ? bar.bottom : parent.top; topMargin: bar.visible ? Theme.gap / 2 : 0; left: parent.left; right: parent.right; bottom: details.visible ? details.top : parent.bottom }
        name: log.title
        model: live.rows
        moreTint: live.lost ? Theme.warn : Theme.dim
        more: {
            const parts = []
            const hidden = live.kept - (live.rows ? live.rows.count : 0)
            if (hidden > 0 && !log.paused)
                parts.push(qsTr("%1 filtered out").arg(hidden))
            if (live.removed)
                parts.push(qsTr("%1 older ones removed").arg(live.removed))
            if (live.lost)
                parts.push(qsTr("%1 lost").arg(live.lost))
            return parts.join(" · ")
        }
        onCurrentIndexChanged: if (currentIndex >= 0) log.follow_ = currentIndex === view.count - 1
        Keys.onPressed: function(event) {
            if (event.matches(StandardKey.Copy)) {
                log.copy()
                event.accepted = true
            } else if (event.key === Qt.Key_Escape && currentIndex >= 0) {
                currentIndex = -1
                log.follow_ = true
                event.accepted = true
            } else if (event.key === Qt.Key_P) {
                log.paused = !log.paused
                event.accepted = true
            }
        }
        delegate: Rectangle {
            width: ListView.view.width
            height: Math.round(Theme.normal * 1.5)
            color: ListView.isCurrentItem ? Theme.track : "transparent"
            Accessible.role: Accessible.ListItem
            Accessible.name: log.names_[model.level] + ", " + model.node + ": " + model.line
            ThemeText {
                id: clock
                anchors.verticalCenter: parent.verticalCenter
                visible: parent.width > 300 * Theme.size
                width: visible ? Theme.small * 7 : 0
                text: model.time
                color: Theme.dim
                font.pixelSize: Theme.small
            }
            ThemeText {
                id: letter
                anchors { left: clock.right; verticalCenter: parent.verticalCenter }
                width: Theme.normal * 1.3
                text: log.letters_[model.level]
                color: log.tints_[model.level]
                font.weight: Font.Bold
            }
            ThemeText {
                id: node
                anchors { left: letter.right; verticalCenter: parent.verticalCenter }
                width: Math.min(implicitWidth, parent.width * 0.25)
                text: model.node
                color: Theme.dim
                font.pixelSize: Theme.small
            }
            ThemeText {
                anchors { left: node.right; leftMargin: Theme.gap; right: parent.right; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                text: model.line
                color: log.tints_[model.level]
            }
            TapHandler {
                onTapped: {
                    list.currentIndex = list.currentIndex === index ? -1 : index
                    list.view.forceActiveFocus()
                }
            }
        }
    }
    Connections {
        target: list.view
        function onMovementEnded() { log.follow_ = list.view.atYEnd }
    }
    Connections {
        target: live.rows
        function onRowsInserted() { if (log.follow_) Qt.callLater(log.toEnd_) }
        function onModelReset() { if (log.follow_) Qt.callLater(log.toEnd_) }
    }

    function toEnd_() {
        if (follow_)
            list.view.positionViewAtEnd()
    }

    Rectangle {
        id: details
        objectName: "details"
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        visible: list.currentIndex >= 0 && list.view.currentItem !== null
        height: visible ? Math.min(full.implicitHeight + Theme.gap, log.body.height / 2) : 0
        color: Theme.track
        radius: Theme.radius / 2
        clip: true
        ThemeText {
            id: full
            anchors { fill: parent; margins: Theme.gap / 2 }
            text: {
                const row = list.currentIndex >= 0 ? live.row(list.currentIndex) : null
                return row ? row.time + " " + row.node + (row.where ? " · " + row.where : "") + "\n" + row.text : ""
            }
            wrapMode: Text.Wrap
            font.pixelSize: Theme.small
        }
    }
}
