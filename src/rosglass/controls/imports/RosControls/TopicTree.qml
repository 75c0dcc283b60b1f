// All topics of the robot as a tree, with types, publishers, subscribers, rates, and what does not match.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "units.js" as Units
import "fields.js" as Fields

LiveFrame {
    id: view

    // Text that names or types of topics contain.
    property alias filter: field.text
    // Namespace of the topics; empty for all.
    property string ns
    // Whether hidden topics are included, such as those of actions.
    property bool showHidden: false
    // Whether rate and size of unfolded topics are measured, for which they are received.
    property bool measures: true
    // The topic of the current row; empty for a namespace.
    readonly property string selected: topics.rows && tree.current && tree.current.charAt(tree.current.length - 1) !== "/" ? tree.current : ""

    // Enter, or a double click on a topic.
    signal activated(string topic)


    title: qsTr("Topics")
    source: topics
    note: topics.count === topics.total ? qsTr("%1 topics").arg(topics.total)
        : Fields.fill(qsTr("%1 of %2 topics"), [topics.count, topics.total])
    contentWidth: 360 * Theme.size
    contentHeight: 300 * Theme.size

    TopicRows {
        id: topics
        ns: view.ns
        showHidden: view.showHidden
        filter: view.filter
    }
    ThemeField {
        id: field
        objectName: "filter"
        width: parent.width
        placeholderText: qsTr("Filter by name or type")
        Keys.onDownPressed: tree.forceActiveFocus()
    }
    ThemeTree {
        id: tree
        objectName: "tree"
        anchors { top: field.bottom; topMargin: Theme.gap / 2; left: parent.left; right: parent.right; bottom: parent.bottom }
        name: view.title
        model: topics.rows
        delegate: rowOf
        onToggled: function(key) { topics.toggle(key) }
        onActivated: function(key) { if (view.selected === key) view.activated(key) }
        onCopied: function(key) { topics.copy(key) }
    }
    ThemeText {
        anchors.centerIn: tree
        width: tree.width
        horizontalAlignment: Text.AlignHCenter
        wrapMode: Text.Wrap
        visible: !topics.stale && topics.count === 0
        color: Theme.dim
        text: topics.total === 0 ? qsTr("There are no topics yet.") : qsTr("No topic matches the filter.")
    }

    Component {
        id: rowOf

        Column {
            id: shown

            readonly property string label: row.isTopic ? Fields.fill(qsTr("%1, %2"), [row.topic, row.conflict || row.type]) : row.name

            width: parent ? parent.width : 0

            Item {
                width: parent.width
                height: Math.round(Theme.touch * 0.7)
                ThemeText {
                    id: name
                    height: parent.height
                    width: Math.min(implicitWidth, parent.width - counts.width - Theme.gap)
                    verticalAlignment: Text.AlignVCenter
                    text: row.name
                    color: row.conflict ? Theme.bad : row.isTopic ? Theme.text : Theme.dim
                }
                ThemeText {
                    anchors { left: name.right; leftMargin: Theme.gap; right: counts.left; rightMargin: Theme.gap }
                    height: parent.height
                    verticalAlignment: Text.AlignVCenter
                    text: row.type
                    color: Theme.dim
                    font.pixelSize: Theme.small
                }
                ThemeText {
                    id: counts
                    anchors.right: parent.right
                    height: parent.height
                    verticalAlignment: Text.AlignVCenter
                    text: row.isTopic ? Fields.fill(qsTr("%1 → %2"), [row.publishers, row.subscribers])
                        : row.topics === 1 ? qsTr("1 topic") : row.topics > 1 ? qsTr("%1 topics").arg(row.topics) : ""
                    color: row.isTopic && row.publishers === 0 ? Theme.warn : Theme.dim
                    font.pixelSize: Theme.small
                }
            }
            Loader {
                width: parent.width
                active: row.isTopic && row.open
                visible: active
                property var entry: row
                sourceComponent: details
            }
            ThemeText {
                width: parent.width
                visible: text !== ""
                bottomPadding: Theme.gap / 2
                text: row.conflict
                color: Theme.bad
                wrapMode: Text.Wrap
                font.pixelSize: Theme.small
            }
        }
    }
    Component {
        id: details

        Column {
            width: parent ? parent.width : 0
            bottomPadding: Theme.gap / 2

            Subscription {
                id: measured
                topic: entry.topic
                enabled: view.measures && !view.stale
                throttleRate: 1
                timeout: 0
                qos: Ros2.QoS().best_available()
            }
            Repeater {
                model: [
                    entry.publishers > 0 ? qsTr("from %1").arg(entry.publishedBy) : qsTr("no publisher"),
                    entry.subscribers > 0 ? qsTr("to %1").arg(entry.subscribedBy) : qsTr("no subscriber"),
                ]
                ThemeText {
                    width: parent.width
                    text: modelData
                    color: Theme.dim
                    wrapMode: Text.Wrap
                    font.pixelSize: Theme.small
                }
            }
            ThemeText {
                objectName: "measured"
                width: parent.width
                visible: view.measures
                text: measured.problem ? measured.problem
                    : measured.frequency > 0 ? Fields.fill(qsTr("%1 Hz, %2/s, %3 each"), [measured.frequency.toPrecision(3), Units.bytes(measured.bandwidth), Units.bytes(measured.bandwidth / measured.frequency)])
                    : qsTr("nothing received in the last seconds")
                color: measured.problem ? Theme.warn : Theme.dim
                wrapMode: Text.Wrap
                font.pixelSize: Theme.small
            }
        }
    }
}
