// The emergency stop. It shows what the robot confirms, not what was clicked: a stop that is not
// confirmed is sent again and again, and said to be unconfirmed after half a second. A stop pressed
// here stays wanted until it is released here, even when the robot forgets it (a restart).
//
// A release names the number that the robot's counter had when it was requested: if it comes late, or
// after another operator's stop, the robot refuses it, however often it is repeated.
import QtQuick
import Ros2 1.0

Item {
    id: stop

    property string topic: "/emergency_stop"
    // True: wants the robot stopped; false: wants it released; null: content with what it is.
    property var wanted: null
    readonly property bool known: state_.fresh
    readonly property bool stopped: known && state_.message.data
    // The number that a release names; null if there was none. It is not looked up later: that
    // number may be of the time after another operator's stop.
    property var named: null
    readonly property bool pending: wanted !== null && (!known || stopped !== wanted)
    property bool overdue: false
    // Released here, and stopped again at once: another operator holds it.
    property bool contested: false
    property int sent: 0
    property string problem
    // For others: whether driving makes sense.
    readonly property bool blocks: wanted === true || stopped

    property var publisher: null
    property var releasePublisher: null
    Component.onCompleted: {
        publisher = Ros2.createPublisher(topic, "std_msgs/msg/Bool", 10)
        releasePublisher = Ros2.createPublisher(topic + "/release", "std_msgs/msg/UInt32", Ros2.CommandQoS())
    }

    // By Tab; the keys that stop and release count wherever the focus is.
    activeFocusOnTab: true

    implicitWidth: 168
    implicitHeight: 168

    function press() {
        cancelHold()
        wanted = true
        begin()
    }

    function release() {
        wanted = false
        named = counter.fresh ? counter.message.data : null
        sinceRelease.restart()
        begin()
    }

    // Releasing takes a deliberate long press, of the finger or of the key.
    function beginHold() {
        if (blocks)
            hold.restart()
    }

    function cancelHold() {
        hold.stop()
        unlock.progress = 0
    }

    function begin() {
        overdue = false
        deadline.restart()
        send()
        settle()
    }

    function send() {
        if (wanted === false && named === null) {
            problem = "the robot's counter was unknown"
            return
        }
        const to = wanted ? publisher : releasePublisher
        try {
            if (to.publish({ data: wanted || named })) {
                sent += 1
                problem = ""
            } else {
                problem = to.problem || "no connection"
            }
        } catch (error) {
            problem = String(error.message || error)
        }
    }

    function settle() {
        if (!pending) {
            overdue = false
            deadline.stop()
            if (wanted === false)
                wanted = null
        } else if (!deadline.running) {
            deadline.restart()
        }
    }

    onStoppedChanged: contested = stopped && wanted !== true && sinceRelease.running
    // Not at once: it may change what this is computed from.
    onPendingChanged: Qt.callLater(settle)

    property Feed state_: Feed {
        topic: stop.topic + "/state"
        messageType: "std_msgs/msg/Bool"
        urgent: true
    }
    property Feed counter: Feed {
        topic: stop.topic + "/counter"
        messageType: "std_msgs/msg/UInt32"
        urgent: true
    }
    Timer {
        interval: 100
        repeat: true
        running: stop.pending
        onTriggered: stop.send()
    }
    Timer {
        id: deadline
        interval: 500
        onTriggered: stop.overdue = stop.pending
    }
    Timer {
        id: sinceRelease
        // A held stop is repeated ten times a second.
        interval: 1000
    }
    // A stop never times out. A release does, here and (sooner) at the robot.
    Timer {
        interval: 3000
        running: stop.wanted === false
        onTriggered: stop.wanted = null
    }

    FocusRing {
        item: stop
        radius: width / 2
    }
    Rectangle {
        id: collar
        anchors.fill: parent
        radius: width / 2
        color: "#e8c21c"
        border { color: "#20000000"; width: 3 }
        Rectangle {
            anchors { fill: parent; margins: 6 }
            radius: width / 2
            color: "transparent"
            border { color: "#40000000"; width: 1 }
        }
    }
    Rectangle {
        id: mushroom
        objectName: "mushroom"
        anchors.centerIn: parent
        width: parent.width * (stop.blocks ? 0.76 : 0.82)
        height: width
        radius: width / 2
        border { color: "#5a0008"; width: 3 }
        gradient: Gradient {
            GradientStop { position: 0; color: stop.blocks ? "#b4000f" : "#ff4a55" }
            GradientStop { position: 1; color: stop.blocks ? "#5a0008" : "#b20012" }
        }
        Column {
            anchors.centerIn: parent
            Text {
                anchors.horizontalCenter: parent.horizontalCenter
                textFormat: Text.PlainText
                text: stop.stopped ? "STOPPED" : "STOP"
                color: "white"
                font { pixelSize: stop.width * (stop.stopped ? 0.125 : 0.2); weight: Font.Black; letterSpacing: 1 }
            }
            Text {
                objectName: "confirmation"
                anchors.horizontalCenter: parent.horizontalCenter
                horizontalAlignment: Text.AlignHCenter
                textFormat: Text.PlainText
                text: stop.overdue ? "NOT CONFIRMED\n" + (stop.problem ? "not sent" : "sending…")
                    : stop.pending ? "sending…"
                    : stop.stopped ? (stop.wanted ? "confirmed"
                        : stop.contested ? "held by someone else" : "by someone else")
                    : stop.known ? "space bar" : "state unknown"
                color: stop.overdue ? "#ffe24a" : "#ffd9dc"
                font { pixelSize: Math.max(8, stop.width * 0.07); weight: stop.overdue ? Font.Black : Font.Medium }
            }
        }
    }
    SequentialAnimation {
        running: stop.overdue
        loops: Animation.Infinite
        onStopped: collar.color = "#e8c21c"
        ColorAnimation { target: collar; property: "color"; to: "#ff1028"; duration: 160 }
        ColorAnimation { target: collar; property: "color"; to: "#fff04a"; duration: 160 }
    }
    // Acts on touch-down, with any finger: a release may come late in an emergency.
    MultiPointTouchArea {
        anchors.fill: parent
        onPressed: stop.press()
    }

    Rectangle {
        id: unlock
        objectName: "unlock"
        anchors { horizontalCenter: parent.horizontalCenter; bottom: parent.top; bottomMargin: 10 }
        visible: stop.blocks
        width: Math.min(190, stop.width + 24)
        height: 34
        radius: 17
        color: Theme.shade
        border { color: Theme.warn; width: 1 }
        property real progress: 0
        clip: true
        Rectangle {
            height: parent.height
            radius: parent.radius
            width: parent.width * unlock.progress
            color: Theme.warn
            opacity: 0.5
        }
        Text {
            objectName: "unlockText"
            anchors { fill: parent; leftMargin: 8; rightMargin: 8 }
            horizontalAlignment: Text.AlignHCenter
            verticalAlignment: Text.AlignVCenter
            text: "hold, or Enter, to release"
            color: Theme.text
            fontSizeMode: Text.HorizontalFit
            minimumPixelSize: 8
            font { pixelSize: Theme.normal; weight: Font.DemiBold }
        }
        NumberAnimation {
            id: hold
            target: unlock
            property: "progress"
            from: 0
            to: 1
            duration: 700
            onFinished: {
                unlock.progress = 0
                stop.release()
            }
        }
        MultiPointTouchArea {
            anchors.fill: parent
            maximumTouchPoints: 1
            onPressed: stop.beginHold()
            onReleased: stop.cancelHold()
            onCanceled: stop.cancelHold()
        }
    }
}
