// The message of any topic as a tree of fields with their units; edited, it can be published.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: view

    // The topic, e.g. TopicTree.selected.
    property string topic
    property string ns
    // Whether the message can be edited and published.
    property bool editable: false
    // Updates per second at most.
    property int maxRate: 10
    // Path of the current row, as Plot takes it: "/odom:twist.twist.linear.x"; empty if it has no number.
    readonly property string path: tree.current && messages.rows ? messages.rows.value(messages.rows.find(tree.current), "path") || "" : ""
    readonly property bool editing: messages.editing
    // Full name of the type.
    readonly property string type: messages.messageType

    property var publisher_: null
    property string editingKey_
    property string sent_

    // The item that covers the window, so that what is dragged can leave the list.
    function top_() {
        let item = view
        while (item.parent)
            item = item.parent
        return item
    }
    function edit_() {
        if (messages.edit()) {
            sent_ = ""
            publisher_ = Ros2.createPublisher(messages.topic, messages.messageType)
        }
    }
    function leave_() {
        editingKey_ = ""
        sent_ = ""
        publisher_ = null
        messages.cancel()
        tree.forceActiveFocus()
    }
    function publish_() {
        const message = messages.edited()
        if (message === undefined || !publisher_)
            return
        const subscribers = publisher_.getSubscriptionCount()
        sent_ = !publisher_.publish(message) ? qsTr("Not sent: %1").arg(publisher_.problem || qsTr("the robot is not connected"))
            : !publisher_.isAdvertised ? qsTr("Being sent.")
            : subscribers === 0 ? qsTr("Sent; there is no subscriber.") : qsTr("Sent to %1 subscribers.").arg(subscribers)
    }

    title: qsTr("Message")
    source: messages
    problem: topic === "" ? "" : messages.problem
    stale: !editing && topic !== "" && messages.stale
    note: editing ? qsTr("EDITED") : messages.frequency > 0 ? qsTr("%1 Hz").arg(messages.frequency.toPrecision(3)) : ""
    contentWidth: 360 * Theme.size
    contentHeight: 300 * Theme.size
    onTopicChanged: if (editing) leave_()

    MessageRows {
        id: messages
        topic: view.topic
        ns: view.ns
        throttleRate: Math.max(1, view.maxRate)
        onEditingChanged: if (!editing) view.publisher_ = null
    }
    ThemeText {
        id: heading
        objectName: "heading"
        width: parent.width
        text: view.topic === "" ? qsTr("No topic is selected.")
            : view.type ? Fields.fill(qsTr("%1  %2"), [messages.topic, view.type]) : messages.topic
        color: Theme.dim
        font.pixelSize: Theme.small
    }
    ThemeTree {
        id: tree
        objectName: "tree"
        anchors { top: heading.bottom; topMargin: Theme.gap / 2; left: parent.left; right: parent.right; bottom: footer.top }
        name: view.title
        model: messages.rows
        delegate: rowOf
        onToggled: function(key) { messages.toggle(key) }
        onCopied: function(key) { messages.copy(key) }
        onActivated: function(key) {
            if (messages.rows.value(messages.rows.find(key), "editable"))
                view.editingKey_ = key
        }
    }
    Column {
        id: footer
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        spacing: Theme.gap / 2

        ThemeText {
            objectName: "refusal"
            width: parent.width
            visible: text !== ""
            topPadding: Theme.gap / 2
            text: messages.refusal || view.sent_ || (view.publisher_ && view.publisher_.problem) || ""
            color: messages.refusal ? Theme.bad : Theme.dim
            wrapMode: Text.Wrap
            maximumLineCount: 3
            font.pixelSize: Theme.small
        }
        Row {
            visible: view.editable
            topPadding: Theme.gap / 2
            spacing: Theme.gap
            ThemeButton {
                objectName: "edit"
                visible: !view.editing
                enabled: messages.rows !== null && messages.rows.count > 0
                text: qsTr("Edit")
                onClicked: view.edit_()
            }
            ThemeButton {
                objectName: "publish"
                visible: view.editing
                text: qsTr("Publish once")
                tint: Theme.warn
                onClicked: view.publish_()
            }
            ThemeButton {
                objectName: "cancel"
                visible: view.editing
                text: qsTr("Cancel")
                onClicked: view.leave_()
            }
        }
    }

    Component {
        id: rowOf

        Item {
            id: shown

            readonly property string label: Fields.fill(qsTr("%1: %2 %3"), [row.name, row.value || row.type, row.unit])
            readonly property bool isEdited: view.editingKey_ === row.key && row.editable

            width: parent ? parent.width : 0
            height: Math.round(Theme.touch * (isEdited ? 1 : 0.7))

            ThemeText {
                id: name
                height: parent.height
                width: Math.min(implicitWidth, parent.width * 0.5)
                verticalAlignment: Text.AlignVCenter
                text: row.name
                color: Theme.dim
            }
            ThemeText {
                visible: !shown.isEdited
                anchors { left: name.right; leftMargin: Theme.gap; right: kind.left; rightMargin: Theme.gap }
                height: parent.height
                verticalAlignment: Text.AlignVCenter
                text: row.unit && row.value ? Fields.fill(qsTr("%1 %2"), [row.value, row.unit]) : row.value
                color: row.editable ? Theme.accent : Theme.text
            }
            Loader {
                anchors { left: name.right; leftMargin: Theme.gap; right: kind.left; rightMargin: Theme.gap }
                height: parent.height
                active: shown.isEdited
                sourceComponent: ThemeField {
                    objectName: "value"
                    placeholderText: row.type
                    maximumLength: 20000
                    problem: messages.refusal
                    Component.onCompleted: {
                        text = row.text
                        forceActiveFocus()
                        selectAll()
                    }
                    onAccepted: {
                        if (messages.setText(row.key, text)) {
                            view.editingKey_ = ""
                            tree.forceActiveFocus()
                        }
                    }
                    Keys.onEscapePressed: {
                        view.editingKey_ = ""
                        tree.forceActiveFocus()
                    }
                }
            }
            ThemeText {
                id: kind
                anchors { right: grip.left; rightMargin: Theme.gap / 2 }
                width: Math.min(implicitWidth, parent.width * 0.3)
                height: parent.height
                verticalAlignment: Text.AlignVCenter
                text: row.type
                color: Theme.dim
                font.pixelSize: Theme.small
            }
            Item {
                id: grip
                anchors { right: parent.right; verticalCenter: parent.verticalCenter }
                width: Theme.gap * 1.6
                height: parent.height
                visible: row.path !== ""

                Column {
                    anchors.centerIn: parent
                    spacing: Math.max(2, Theme.gap * 0.25)
                    Repeater {
                        model: 3
                        Rectangle {
                            width: Theme.gap
                            height: Math.max(1, Theme.size)
                            color: hand.containsMouse ? Theme.accent : Theme.faint
                        }
                    }
                }
                // What is dropped on a Plot, a Gauge or a Lamp.
                Item {
                    id: dragged
                    objectName: "dragged"
                    property string path: row.path
                    width: grip.width
                    height: grip.height
                    Drag.active: hand.drag.active
                    Drag.keys: ["rosglass/path"]
                    Drag.hotSpot.x: width / 2
                    Drag.hotSpot.y: height / 2
                    states: State {
                        when: hand.drag.active
                        ParentChange { target: dragged; parent: view.top_() }
                    }
                    Rectangle {
                        visible: hand.drag.active
                        width: dragLabel.implicitWidth + 2 * Theme.gap
                        height: Theme.touch * 0.7
                        radius: Theme.radius
                        color: Theme.accent
                        ThemeText {
                            id: dragLabel
                            anchors.centerIn: parent
                            text: dragged.path
                            color: Theme.onAccent
                        }
                    }
                }
                MouseArea {
                    id: hand
                    objectName: "hand"
                    anchors.fill: parent
                    hoverEnabled: true
                    preventStealing: true
                    cursorShape: Qt.OpenHandCursor
                    drag.target: dragged
                    drag.threshold: 4
                    // What is under the pointer is where it is dropped, however it got there.
                    drag.smoothed: false
                    onReleased: {
                        dragged.Drag.drop()
                        dragged.x = 0
                        dragged.y = 0
                    }
                    onCanceled: {
                        dragged.Drag.cancel()
                        dragged.x = 0
                        dragged.y = 0
                    }
                }
            }
        }
    }
}
