// The frames of the robot as a tree, with the age and rate of each transform, and what is wrong with it.
import QtQuick 2.15
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: view

    // Namespace of the topics tf and tf_static; empty for "/".
    property string ns
    // Text that names of frames contain.
    property alias filter: field.text
    // Milliseconds after which a transform that is not static is old; 0 for never.
    property int timeout: 3000
    // The frame of the current row.
    readonly property string selected: tree.current

    // Enter, or a double click on a frame.
    signal activated(string frame)

    title: qsTr("Transforms")
    source: frames
    age: frames.total > 0 ? 0 : -1
    note: {
        const parts = [frames.count === frames.total ? qsTr("%1 frames").arg(frames.total)
                                                     : Fields.fill(qsTr("%1 of %2 frames"), [frames.count, frames.total])]
        if (frames.faults > 0)
            parts.push(qsTr("%1 wrong").arg(frames.faults))
        if (frames.old > 0)
            parts.push(qsTr("%1 old").arg(frames.old))
        return parts.join(" · ")
    }
    contentWidth: 360 * Theme.size
    contentHeight: 300 * Theme.size

    TfRows {
        id: frames
        ns: view.ns
        filter: view.filter
        timeout: Math.max(0, view.timeout)
    }
    ThemeField {
        id: field
        objectName: "filter"
        width: parent.width
        placeholderText: qsTr("Filter by name")
        Keys.onDownPressed: tree.forceActiveFocus()
    }
    ThemeTree {
        id: tree
        objectName: "tree"
        anchors { top: field.bottom; topMargin: Theme.gap / 2; left: parent.left; right: parent.right; bottom: parent.bottom }
        name: view.title
        model: frames.rows
        delegate: rowOf
        onToggled: function(key) { frames.toggle(key) }
        onCopied: function(key) { frames.copy(key) }
        onActivated: function(key) { view.activated(key) }
    }
    ThemeText {
        anchors.centerIn: tree
        width: tree.width
        horizontalAlignment: Text.AlignHCenter
        wrapMode: Text.Wrap
        visible: frames.total > 0 && frames.count === 0
        color: Theme.dim
        text: qsTr("No frame matches the filter.")
    }

    Component {
        id: rowOf

        Column {
            id: shown

            readonly property string state_: row.fault ? row.fault
                : row.parentFrame === "" ? "" : row.isStatic ? qsTr("static")
                : row.isOld ? qsTr("OLD: %1 s").arg(row.age.toFixed(row.age < 10 ? 1 : 0))
                : row.rate > 0 ? Fields.fill(qsTr("%1 Hz · %2 s"), [row.rate, row.age.toFixed(1)]) : qsTr("%1 s").arg(row.age.toFixed(1))
            readonly property string label: row.name + ", " + state_

            width: parent ? parent.width : 0

            Item {
                width: parent.width
                height: Math.round(Theme.touch * 0.7)
                ThemeText {
                    id: name
                    height: parent.height
                    width: Math.min(implicitWidth, parent.width * 0.6)
                    verticalAlignment: Text.AlignVCenter
                    text: row.name
                    color: row.fault || row.isOld ? Theme.bad : Theme.text
                }
                ThemeText {
                    anchors { left: name.right; leftMargin: Theme.gap; right: timing.left; rightMargin: Theme.gap }
                    height: parent.height
                    verticalAlignment: Text.AlignVCenter
                    text: row.authority
                    color: Theme.faint
                    font.pixelSize: Theme.small
                }
                ThemeText {
                    id: timing
                    anchors.right: parent.right
                    width: Math.min(implicitWidth, parent.width * 0.4)
                    height: parent.height
                    verticalAlignment: Text.AlignVCenter
                    text: row.fault ? qsTr("WRONG") : shown.state_
                    color: row.fault || row.isOld ? Theme.bad : Theme.dim
                    font.pixelSize: Theme.small
                }
            }
            ThemeText {
                width: parent.width
                visible: row.fault !== ""
                bottomPadding: Theme.gap / 2
                text: row.fault
                color: Theme.bad
                wrapMode: Text.Wrap
                font.pixelSize: Theme.small
            }
        }
    }
}
