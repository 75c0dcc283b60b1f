// A titled frame that shows by itself when what is in it is out of date: dimmed, with a red edge, and
// in words. Every control is one.
import QtQuick 2.15
import Ros2 1.0
import "fields.js" as Fields

Item {
    id: frame

    // Text of the title.
    property string title
    // What it shows: a LiveTopic, Subscription, TfTransform ..., or anything with `stale` and `age`.
    property var source: null
    // Whether what is shown is out of date, or nothing has been received.
    property bool stale: source ? source.stale : false
    // Seconds since what is shown was received; negative for never.
    property real age: source && source.age !== undefined ? source.age : 0
    // Why nothing is received, or it cannot be shown; empty without a problem.
    property string problem: source && source.problem ? source.problem : ""
    // Whether it is of no use without a connection to the robot; its status says so then.
    property bool needsRobot: source !== null || stale
    // Whether there is something to see, even if it is old.
    property bool filled: age >= 0 && !(source && "message" in source && !source.message)
    // A short text beside the title, while nothing is wrong.
    property string note
    // Whether title and edge are drawn.
    property bool framed: true
    // Pixels that the content wants, for layouts.
    property real contentWidth: 160 * Theme.size
    property real contentHeight: 60 * Theme.size
    // What is wrong, in words; empty if nothing is.
    readonly property string status: reason_ ? reason_
        : !stale ? ""
        : age < 0 ? qsTr("NO DATA YET")
        : old_

    default property alias content: body.data
    readonly property alias body: body

    implicitWidth: contentWidth + 2 * inset
    implicitHeight: top_ + contentHeight + inset

    // What shows title, edge and status in its place: the Panel of a layout that it fills.
    property Item shell_: null
    readonly property bool drawn_: framed && shell_ === null
    readonly property string aside_: dated_ ? old_ + " · " + status : status || note
    readonly property real top_: drawn_ ? Theme.small * 1.5 + Theme.gap * 1.1 : framed ? Theme.gap / 2 : 0
    readonly property real inset: framed ? Theme.gap : 0
    readonly property string old_: qsTr("OLD: %1 s").arg(age < 10 ? age.toFixed(1) : age.toFixed(0))
    // Data that is shown, but old, has its age before the reason, of which the end may be cut.
    readonly property bool dated_: reason_ !== "" && stale && age > 0 && filled
    readonly property bool wrong: stale || reason_ !== ""
    // "No such topic yet" would be a guess without a connection.
    readonly property string reason_: (needsRobot && Fields.unconnected(Ros2.connectionState, Ros2.connectionDetail)) || problem

    Accessible.role: Accessible.Grouping
    Accessible.name: title
    Accessible.description: status

    Rectangle {
        anchors.fill: parent
        visible: frame.drawn_
        color: Theme.panel
        radius: Theme.radius
        border { color: frame.wrong ? Theme.bad : Theme.edge; width: frame.wrong ? 2 : 1 }
    }
    ThemeText {
        id: heading
        visible: frame.drawn_
        anchors { left: parent.left; top: parent.top; leftMargin: Theme.gap; topMargin: Theme.gap * 0.6 }
        width: Math.min(implicitWidth, Math.max(0, frame.width - 2 * Theme.gap - (aside.text ? Math.min(aside.implicitWidth, frame.width / 2) + Theme.gap : 0)))
        text: frame.title
        color: Theme.dim
        font { pixelSize: Theme.small; weight: Font.DemiBold; letterSpacing: 0.8; capitalization: Font.AllUppercase }
    }
    ThemeReason {
        id: aside
        anchors { right: parent.right; rightMargin: Theme.gap; top: parent.top; topMargin: Theme.gap * 0.6 }
        width: Math.min(implicitWidth, Math.max(0, frame.width - 2 * Theme.gap - (frame.framed && frame.title ? Math.min(heading.implicitWidth, frame.width / 2) + Theme.gap : 0)))
        z: 1
        objectName: "aside"
        visible: frame.drawn_ || !frame.framed
        text: frame.aside_
        color: frame.wrong ? Theme.bad : Theme.dim
        font.weight: frame.wrong ? Font.Bold : Font.Normal
        horizontalAlignment: Text.AlignRight
    }
    Item {
        id: body
        anchors { top: parent.top; topMargin: frame.top_; left: parent.left; right: parent.right; bottom: parent.bottom; leftMargin: frame.inset; rightMargin: frame.inset; bottomMargin: frame.inset }
        opacity: frame.stale ? 0.35 : 1
    }
    // Where there is nothing else to show, what the heading has no room for.
    ThemeReason {
        objectName: "wholeProblem"
        anchors { fill: body; margins: frame.framed ? 0 : Theme.gap }
        visible: (frame.framed && frame.shell_ ? frame.shell_.cut_ : aside.truncated) && frame.reason_ !== "" && frame.stale && !frame.filled
        text: frame.reason_
        color: Theme.bad
        wrapMode: Text.Wrap
        verticalAlignment: Text.AlignVCenter
        horizontalAlignment: Text.AlignHCenter
        Accessible.ignored: true
        Rectangle { z: -1; anchors.fill: parent; color: Theme.panel; opacity: 0.85 }
    }
}
