// The emergency stop. It shows what the robot confirms, not the click; a request is repeated until
// it is confirmed. A press stops at once; only a long press releases. A release names the number that
// the robot's counter had then: the robot refuses it if it comes late, or after another stop.
// With the keyboard focus (Tab, shown by a white frame), Space stops, and Enter held releases.
import QtQuick 2.15
import Ros 1.0

Rectangle {
    id: stop
    objectName: "emergency stop"
    property var publisher: Ros.advertise("std_msgs/Bool", "/emergency_stop", 1)
    property var releasePublisher: Ros.advertise("std_msgs/UInt32", "/emergency_stop/release", Ros.CommandQoS())
    // The operator's request: true, false, or null for none.
    property var wanted: null
    // The number that a release names.
    property var named
    readonly property bool known: state_.message !== undefined && !state_.stale
    readonly property bool stopped: known && state_.message.data
    readonly property bool pending: wanted !== null && (!known || stopped !== wanted)

    activeFocusOnTab: true
    onActiveFocusChanged: if (!activeFocus) cancelHold()

    Keys.onPressed: function (event) {
        event.accepted = true
        if (event.key === Qt.Key_Space)
            want(true)
        else if (event.key !== Qt.Key_Return && event.key !== Qt.Key_Enter)
            event.accepted = false
        else if (lifted.running)
            lifted.stop()
        else if (!event.isAutoRepeat && stopped && !pending)
            hold.restart()
    }
    Keys.onReleased: function (event) {
        if (!event.isAutoRepeat && (event.key === Qt.Key_Return || event.key === Qt.Key_Enter))
            lifted.restart()
    }
    // X11 repeats a held key as releases and presses: a release counts if no press follows.
    Timer { id: lifted; interval: 50; onTriggered: stop.cancelHold() }

    function cancelHold() {
        hold.stop()
        hold.progress = 0
    }

    function want(stopped) {
        if (stopped)
            cancelHold()
        wanted = stopped
        if (stopped)
            publisher.publish({data: true})
        else if (named !== undefined)
            releasePublisher.publish({data: named})
    }

    radius: 8
    color: !known ? "#4a4a1c" : stopped ? "#8c0010" : "#d3122a"
    border { color: !known || pending ? "#ffe24a" : stopped ? "#ff8a94" : "#ff6b78"; width: 3 }

    Subscriber { id: state_; topic: "/emergency_stop/state"; messageType: "std_msgs/Bool"; timeout: 1000 }
    Subscriber { id: counter; topic: "/emergency_stop/counter"; messageType: "std_msgs/UInt32"; timeout: 1000 }
    Timer {
        interval: 100; repeat: true
        running: stop.pending
        onTriggered: stop.want(stop.wanted)
    }
    // A stop never times out; a release does, here and (sooner) at the robot.
    Timer {
        interval: 3000
        running: stop.wanted === false
        onTriggered: stop.wanted = null
    }

    Rectangle {
        objectName: "focus ring"
        anchors { fill: parent; margins: 3 }
        visible: stop.activeFocus
        radius: 6
        color: "transparent"
        border { color: "white"; width: 2 }
    }
    Column {
        anchors.centerIn: parent
        spacing: 4
        Text {
            anchors.horizontalCenter: parent.horizontalCenter
            textFormat: Text.PlainText
            text: stop.stopped ? "STOPPED" : "STOP"
            color: "white"
            font { pixelSize: stop.stopped ? 25 : 36; weight: Font.Black; letterSpacing: 1 }
        }
        Text {
            anchors.horizontalCenter: parent.horizontalCenter
            textFormat: Text.PlainText
            text: !stop.known && !stop.pending ? "STATE UNKNOWN" : stop.pending ? "NOT CONFIRMED"
                : stop.stopped ? (stop.activeFocus ? "hold, or Enter, to release" : "hold to release") : "emergency stop"
            color: !stop.known || stop.pending ? "#ffe24a" : "#ffd9dc"
            font { pixelSize: 12; weight: Font.DemiBold }
        }
    }
    Rectangle {
        anchors { left: parent.left; bottom: parent.bottom; margins: 5 }
        width: (parent.width - 10) * hold.progress
        height: 5; radius: 2
        color: "white"
    }
    NumberAnimation {
        id: hold
        property real progress: 0
        target: hold; property: "progress"
        from: 0; to: 1; duration: 700
        onFinished: {
            progress = 0
            stop.named = counter.stale || !counter.message ? undefined : counter.message.data
            stop.want(false)
        }
    }
    MouseArea {
        anchors.fill: parent
        onPressed: {
            stop.forceActiveFocus()
            if (stop.stopped && !stop.pending)
                hold.restart()
            else
                stop.want(true)
        }
        onReleased: stop.cancelHold()
        onCanceled: stop.cancelHold()
    }
}
