// The emergency stop: latched, and it shows what the robot confirms, not what was clicked. A stop that
// is not confirmed is sent again and again, and said to be unconfirmed after half a second. A stop
// pressed here stays wanted until it is released here, even when the robot forgets it (a restart).
//
// Where the robot has a counter, a release names the number that it had when the release was requested:
// if it comes late, or after another operator's stop, the robot refuses it, however often it is repeated.
import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields
import "stops.js" as Stops

Item {
    id: stop

    // std_msgs/Bool: true stops.
    property string topic: "emergency_stop"
    property string ns
    // std_msgs/Bool: whether the robot is stopped; empty if a service confirms.
    property string stateTopic: service ? "" : topic + "/state"
    // std_msgs/UInt32: where the robot has it, numbers of which a release names the last.
    property string counterTopic: topic + "/counter"
    // Where such a number is sent; a robot without a counter gets false on `topic`.
    property string releaseTopic: topic + "/release"
    // std_srvs/SetBool or std_srvs/Trigger: stops by a service instead of a topic.
    property string service
    // What releases; empty for `service`, if that is a SetBool.
    property string releaseService
    // Type of the services, where the robot does not announce it (ROS 1).
    property string serviceType
    // Milliseconds after which a state that the robot repeats is out of date.
    property int timeout: 1000
    // Keys that stop, wherever the focus is (except in a text field).
    property var stopKeys: ["Space"]
    // Whether Enter releases, when it is held down.
    property bool releaseByEnter: true

    // True: wants the robot stopped; false: wants it released; null: content with what it is.
    property var wanted: null
    // Whether the robot's state is known; and what it is.
    readonly property bool known: service && !stateTopic ? confirmed_ !== null && serving_ && connected_ : !state_.stale
    readonly property bool stopped: known && (stateTopic ? !!state_.message && state_.message.data === true : confirmed_)
    readonly property bool pending: wanted !== null && (!known || stopped !== wanted)
    // A command has not been confirmed for half a second.
    property bool overdue: false
    // Released here, and stopped again at once: another operator holds it.
    property bool contested: false
    // How often the present command was sent.
    property int sent: 0
    // Why it was not sent, or not obeyed; empty without a problem.
    property string problem
    // Whether driving makes no sense.
    readonly property bool blocks: wanted === true || stopped
    readonly property bool stale: !known

    // The number that a release names; null if there was none. It is not looked up later: that number
    // may be of the time after another operator's stop.
    property var named_: null
    property var publisher_: null
    property var releasePublisher_: null
    property var clients_: ({})
    // What a service has confirmed; null while unknown.
    property var confirmed_: null
    // The client that confirmed; without its server, nothing is known any more.
    property var client_: null
    readonly property bool serving_: client_ !== null && client_.ready
    readonly property bool connected_: Ros2.connectionState === "connected"
    // Number of the present call, and when it was made.
    property int call_: 0
    property real calledAt_: 0
    // The robot sends its state again and again, so that silence means something.
    property bool repeats_: false
    property var lastState_: undefined
    property real lastStateAt_: 0
    property string target_
    property bool complete_: false

    activeFocusOnTab: true
    implicitWidth: 168 * Theme.size
    implicitHeight: implicitWidth + 44 * Theme.size

    Accessible.role: Accessible.Button
    Accessible.name: qsTr("Emergency stop")
    Accessible.description: face.text + " " + confirmation.text
    Accessible.onPressAction: press()

    function press() {
        cancelHold()
        wanted = true
        begin_()
    }

    function release() {
        wanted = false
        named_ = counter_.stale ? null : counter_.message.data
        sinceRelease.restart()
        begin_()
    }

    // The hand that stops may hold Shift or another modifier; a Shortcut takes each for a key of its own.
    function sequences_() {
        let made = []
        for (const key of stopKeys) {
            const plain = typeof key === "string" && (key === "+" || key.indexOf("+") < 0)
            for (const modifier of plain ? ["", "Shift+", "Ctrl+", "Ctrl+Shift+", "Alt+", "Meta+"] : [""])
                made.push(modifier ? modifier + key : key)
        }
        return made
    }

    // Releasing takes a deliberate long press, of the finger or of the key.
    function beginHold() {
        unlock.progress = 0
        if (blocks)
            hold.restart()
    }

    function cancelHold() {
        hold.stop()
        unlock.progress = 0
    }

    function begin_() {
        overdue = false
        sent = 0
        calledAt_ = 0
        deadline.restart()
        send_()
        settle_()
    }

    function send_() {
        try {
            if (service)
                callService_()
            else
                publish_()
        } catch (error) {
            problem = String(error.message || error)
        }
    }

    function publish_() {
        let to = publisher_, data = wanted
        if (wanted === false && (counter_.message !== undefined || Ros2.getPublishersInfo(Fields.resolve(ns, counterTopic)).length > 0)) {
            if (named_ === null) {
                problem = qsTr("the robot's counter was unknown")
                return
            }
            to = releasePublisher_
            data = named_
        }
        if (to !== null && to.publish({ data: data })) {
            sent += 1
            problem = ""
        } else {
            problem = (to && to.problem) || qsTr("no connection")
        }
    }

    function callService_() {
        // An answer that is late is not waited for.
        if (Date.now() - calledAt_ >= 0 && Date.now() - calledAt_ < 500)
            return
        const name = Fields.resolve(ns, wanted || !releaseService ? service : releaseService)
        const known = Ros2.getServiceTypes(name)
        const type = serviceType || known[0] || (releaseService ? "std_srvs/srv/Trigger" : "std_srvs/srv/SetBool")
        const switches = type.endsWith("/SetBool")
        if (!switches && !type.endsWith("/Trigger")) {
            problem = Fields.fill(qsTr("%1 has the type %2, which is not Trigger or SetBool"), [name, type])
            return
        }
        if (!switches && !wanted && !releaseService) {
            problem = qsTr("no service releases")
            return
        }
        const key = name + " " + type
        if (!clients_[key]) {
            clients_[key] = Ros2.createServiceClient(name, type)
            clients_[key].connectionTimeout = 2000
        }
        const client = clients_[key], number = ++call_, asked = wanted
        if (client.pendingRequests > 4)
            client.cancelRequests()
        calledAt_ = Date.now()
        sent += 1
        client.call(switches ? { data: asked } : {}).then(
            function(answer) { if (stop) stop.answered_(client, number, asked, answer.success === true, answer.message) },
            function(error) { if (stop && number === stop.call_) stop.problem = String(error.message || error) })
    }

    function answered_(client, number, asked, success, text) {
        if (number !== call_)
            return
        calledAt_ = 0
        if (success) {
            problem = ""
            client_ = client
            confirmed_ = asked
            return
        }
        problem = text ? qsTr("refused: %1").arg(text) : qsTr("refused")
        if (!asked)
            wanted = null
    }

    function settle_() {
        if (!pending) {
            overdue = false
            deadline.stop()
            if (wanted === false)
                wanted = null
        } else if (!deadline.running) {
            deadline.restart()
        }
    }

    // Commands go to the robot whose names these are, and to no other.
    function retarget_() {
        const target = [ns, topic, releaseTopic, service, releaseService].join(" ")
        if (!complete_ || target === target_)
            return
        const lost = pending && wanted === true && target_ !== ""
        target_ = target
        wanted = null
        named_ = confirmed_ = null
        client_ = null
        contested = repeats_ = false
        lastState_ = undefined
        call_ += 1
        clients_ = ({})
        problem = lost ? qsTr("the stop of the last robot was not confirmed") : ""
        publisher_ = service ? null : Ros2.createPublisher(Fields.resolve(ns, topic), "std_msgs/msg/Bool", 10)
        releasePublisher_ = service ? null : Ros2.createPublisher(Fields.resolve(ns, releaseTopic), "std_msgs/msg/UInt32", Ros2.CommandQoS())
    }

    Component.onCompleted: {
        complete_ = true
        Stops.add(stop)
        retarget_()
    }
    Component.onDestruction: Stops.remove(stop)
    onNsChanged: retarget_()
    onTopicChanged: retarget_()
    onReleaseTopicChanged: retarget_()
    onServiceChanged: retarget_()
    onReleaseServiceChanged: retarget_()
    onStoppedChanged: contested = stopped && wanted !== true && sinceRelease.running
    // Not at once: it may change what this is computed from.
    onPendingChanged: Qt.callLater(settle_)

    LiveTopic {
        id: state_
        topic: stop.stateTopic
        enabled: stop.stateTopic !== ""
        ns: stop.ns
        types: ["std_msgs/msg/Bool"]
        // With the last one, where the robot keeps it for those who come late.
        qos: Ros2.BestAvailableQoS()
        throttleRate: 60
        timeout: stop.repeats_ ? stop.timeout : 0
        onNewMessage: function(message) {
            const now = Date.now()
            if (message.data === stop.lastState_ && now - stop.lastStateAt_ < stop.timeout)
                stop.repeats_ = true
            stop.lastState_ = message.data
            stop.lastStateAt_ = now
        }
    }
    LiveTopic {
        id: counter_
        topic: stop.counterTopic
        enabled: stop.service === "" && stop.counterTopic !== ""
        ns: stop.ns
        types: ["std_msgs/msg/UInt32"]
        throttleRate: 60
        timeout: 700
    }
    Timer {
        interval: 100
        repeat: true
        running: stop.pending
        onTriggered: stop.send_()
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

    // -- keys: not by Keys, which depends on the focus; and Shortcut knows no release --

    Shortcut {
        sequences: stop.sequences_()
        context: Qt.ApplicationShortcut
        autoRepeat: false
        onActivated: Stops.press()
        onActivatedAmbiguously: Stops.press()
    }
    WindowKeys {
        // A button that was reached by Tab keeps its Enter.
        keys: stop.blocks && stop.visible && stop.releaseByEnter && (stop.activeFocus
            || Stops.all.length === 1 && !(stop.Window.activeFocusItem && stop.Window.activeFocusItem.activeFocusOnTab))
            ? [Qt.Key_Return, Qt.Key_Enter] : []
        onPressed: stop.beginHold()
        onReleased: stop.cancelHold()
    }

    // -- what is seen --

    readonly property real diameter_: Math.max(0, Math.min(width, height))

    onDiameter_Changed: unlock.place()
    onYChanged: unlock.place()

    FocusRing {
        item: collar
        visible: stop.activeFocus
        radius: width / 2
    }
    Rectangle {
        id: collar
        anchors { horizontalCenter: parent.horizontalCenter; bottom: parent.bottom }
        width: stop.diameter_
        height: width
        radius: width / 2
        color: Theme.emergencyCollar
        border { color: Qt.darker(Theme.emergencyCollar, 1.2); width: 3 }
        Rectangle {
            anchors { fill: parent; margins: 6 }
            radius: width / 2
            color: "transparent"
            border { color: Qt.darker(Theme.emergencyCollar, 1.3); width: 1 }
        }
        Rectangle {
            id: mushroom
            objectName: "mushroom"
            anchors.centerIn: parent
            width: parent.width * (stop.blocks ? 0.76 : 0.82)
            height: width
            radius: width / 2
            border { color: Qt.darker(Theme.emergency, 2.4); width: 3 }
            gradient: Gradient {
                GradientStop { position: 0; color: stop.blocks ? Qt.darker(Theme.emergency, 1.25) : Qt.lighter(Theme.emergency, 1.3) }
                GradientStop { position: 1; color: stop.blocks ? Qt.darker(Theme.emergency, 2.4) : Qt.darker(Theme.emergency, 1.25) }
            }
            Column {
                anchors.centerIn: parent
                width: parent.width * 0.9
                ThemeText {
                    id: face
                    width: parent.width
                    horizontalAlignment: Text.AlignHCenter
                    text: stop.stopped ? qsTr("STOPPED") : qsTr("STOP")
                    color: Theme.emergencyText
                    elide: Text.ElideNone
                    fontSizeMode: Text.HorizontalFit
                    minimumPixelSize: 6
                    font { pixelSize: Math.max(6, stop.diameter_ * (stop.stopped ? 0.125 : 0.2)); weight: Font.Black; letterSpacing: 1 }
                }
                ThemeText {
                    id: confirmation
                    objectName: "confirmation"
                    width: parent.width
                    horizontalAlignment: Text.AlignHCenter
                    wrapMode: Text.Wrap
                    maximumLineCount: 3
                    text: stop.overdue ? qsTr("NOT CONFIRMED") + "\n" + (stop.problem || (stop.connected_ ? qsTr("sending…") : qsTr("not connected")))
                        : stop.pending ? qsTr("sending…")
                        : stop.stopped ? (stop.wanted ? qsTr("confirmed")
                            : stop.contested ? qsTr("held by someone else") : stop.service && !stop.stateTopic ? qsTr("confirmed") : qsTr("by someone else"))
                        : stop.problem ? stop.problem
                        : !stop.known && !stop.connected_ ? qsTr("not connected")
                        : stop.known || stop.service && !stop.stateTopic && stop.connected_ ? (stop.stopKeys.length ? stop.keyName_() : qsTr("press"))
                        : qsTr("state unknown")
                    color: stop.overdue ? Qt.lighter(Theme.emergencyCollar, 1.3) : Theme.emergencyText
                    font { pixelSize: Math.max(8, stop.diameter_ * 0.07); weight: stop.overdue ? Font.Black : Font.Medium }
                }
            }
        }
        SequentialAnimation {
            running: stop.overdue
            loops: Animation.Infinite
            onStopped: collar.color = Qt.binding(function() { return Theme.emergencyCollar })
            ColorAnimation { target: collar; property: "color"; to: Theme.emergency; duration: 160 }
            ColorAnimation { target: collar; property: "color"; to: Theme.emergencyCollar; duration: 160 }
        }
        // Acts on touch-down, with any finger: a release may come late in an emergency.
        MultiPointTouchArea {
            anchors.fill: parent
            onPressed: stop.press()
        }
    }

    function keyName_() {
        return stopKeys[0] === "Space" ? qsTr("space bar") : String(stopKeys[0])
    }

    Rectangle {
        id: unlock
        objectName: "unlock"
        anchors { horizontalCenter: parent.horizontalCenter; bottom: collar.top; bottomMargin: beyond ? -height : Theme.gap }
        visible: stop.blocks
        // Whether the room above the button is outside the window, where no finger reaches it.
        property bool beyond: false
        function place() {
            beyond = stop.mapToItem(null, 0, stop.height - stop.diameter_ - Theme.gap - height).y < 0
        }
        onVisibleChanged: place()
        width: Math.min(190 * Theme.size, stop.width)
        height: 34 * Theme.size
        radius: height / 2
        color: Theme.shade
        border { color: Theme.warn; width: 1 }
        clip: true
        property real progress: 0

        Accessible.role: Accessible.Button
        Accessible.name: qsTr("Release the emergency stop")
        Accessible.onPressAction: stop.beginHold()

        Rectangle {
            height: parent.height
            radius: parent.radius
            width: parent.width * unlock.progress
            color: Theme.warn
            opacity: 0.5
        }
        ThemeText {
            objectName: "unlockText"
            anchors { fill: parent; leftMargin: 8; rightMargin: 8 }
            horizontalAlignment: Text.AlignHCenter
            verticalAlignment: Text.AlignVCenter
            text: stop.releaseByEnter ? qsTr("hold, or Enter, to release") : qsTr("hold to release")
            elide: Text.ElideNone
            fontSizeMode: Text.HorizontalFit
            minimumPixelSize: 8
            font.weight: Font.DemiBold
        }
        // By the clock, but at most 100 ms a step: after a screen that stood still, a release that waits is handled first.
        Timer {
            id: hold
            property real last: 0
            interval: 35
            repeat: true
            onRunningChanged: last = Date.now()
            onTriggered: {
                const now = Date.now()
                unlock.progress += Math.max(0, Math.min(100, now - last)) / 700
                last = now
                if (unlock.progress < 0.999)
                    return
                stop.cancelHold()
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
