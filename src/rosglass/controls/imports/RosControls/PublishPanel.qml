// Publishes messages of any type on a topic, filled in by hand: once, or again and again at a rate.
import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: panel

    // The topic; without one, the operator enters it.
    property string topic
    property string ns
    // Type of the messages; empty for the topic's.
    property string type
    // Messages per second when it repeats, from 0.1 to 100.
    property real rate: 10
    // Why nothing is published now; empty if it can be.
    property string obstacle

    // Whether it publishes again and again.
    readonly property bool repeating: repeating_
    // Messages that were sent since the topic was set.
    readonly property int sent: sent_
    // Whether the topic moves a robot, so that a button has to be held down to publish once.
    readonly property bool moves: ["geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped", "ackermann_msgs/msg/AckermannDrive",
        "ackermann_msgs/msg/AckermannDriveStamped"].indexOf(type_) >= 0

    // A message was published.
    signal published(var message)

    property string entered_
    property string found_
    property bool repeating_: false
    property int sent_: 0
    property string said_
    property bool failed_: false
    property var publisher_: null
    readonly property string name_: Fields.resolve(ns, topic || entered_)
    readonly property string type_: full_(type) || found_
    readonly property real rate_: rate >= 0.1 && rate <= 100 ? rate : 10
    readonly property bool usable_: name_ !== "" && form.ready && form.valid && obstacle === ""

    // Publishes the message once.
    function publish() { send_() }
    // Publishes again and again, until stop(), or until the panel is hidden, disabled, or set to another topic.
    function start() {
        if (!usable_ || repeating_)
            return
        if (moves) {
            fail_(qsTr("%1 is not repeated: steer by a TwistCommand, which stops when it is let go").arg(type_))
            return
        }
        if (send_()) {
            form.remember()
            repeating_ = true
        }
    }
    function stop() {
        if (repeating_) {
            repeating_ = false
            said_ = qsTr("stopped after %1").arg(sent_)
        }
    }
    function halt() { stop() }

    function full_(name) { return name.replace(/^(\w+)\/(\w+)$/, "$1/msg/$2") }
    function fail_(reason) {
        repeating_ = false
        failed_ = true
        said_ = Fields.bounded(reason)
    }
    function find_() {
        found_ = ""
        look_()
        advertise_()
    }
    function look_() { found_ = name_ && !type ? (Ros2.getTopicTypes(name_)[0] || found_) : "" }
    function advertise_() {
        stop()
        publisher_ = null
        sent_ = 0
        failed_ = false
        said_ = ""
        if (!name_ || !type_)
            return
        try {
            publisher_ = Ros2.createPublisher(name_, type_)
        } catch (error) {
            fail_(error.message)
        }
    }
    function send_() {
        const message = usable_ ? form.message() : undefined
        if (message === undefined || !publisher_) {
            fail_(obstacle || form.problem || (publisher_ ? qsTr("the message is not complete") : qsTr("no topic of a known type is given")))
            return false
        }
        if (!publisher_.publish(message)) {
            fail_(qsTr("NOT SENT: %1").arg(publisher_.problem || qsTr("the robot is not connected")))
            return false
        }
        ++sent_
        failed_ = false
        const subscribers = publisher_.getSubscriptionCount()
        said_ = subscribers === 1 ? qsTr("sent to 1 subscriber") : subscribers > 1 ? qsTr("sent to %1 subscribers").arg(subscribers)
            : publisher_.isAdvertised ? qsTr("sent; there is no subscriber") : qsTr("being sent")
        published(message)
        return true
    }
    function once_() {
        if (send_())
            form.remember()
    }
    function suggest_(typed) {
        const all = Ros2.getTopicNamesAndTypes()
        return Object.keys(all).filter(name => name.indexOf(typed) >= 0).slice(0, 50).map(name => ({ text: name, detail: all[name].join(", "), suits: true }))
    }

    title: topic ? qsTr("Publish %1").arg(name_) : qsTr("Publish")
    source: null
    stale: false
    age: 0
    problem: obstacle || (publisher_ && publisher_.problem ? Fields.bounded(publisher_.problem, 120) : "")
    note: repeating ? Fields.fill(qsTr("PUBLISHING %1 Hz · %2"), [rate_, sent]) : sent > 0 ? qsTr("%1 sent").arg(sent) : ""
    contentWidth: 340 * Theme.size
    contentHeight: 320 * Theme.size

    // It must not go on unseen, nor to another robot.
    onVisibleChanged: if (!visible) stop()
    onEnabledChanged: if (!enabled) stop()
    onWindowChanged: stop()
    onParentChanged: stop()
    onObstacleChanged: if (obstacle) stop()
    onName_Changed: {
        stop()
        publisher_ = null
        Qt.callLater(find_)
    }
    onType_Changed: {
        stop()
        publisher_ = null
        Qt.callLater(advertise_)
    }
    Component.onCompleted: find_()
    Component.onDestruction: repeating_ = false

    Connections {
        target: Ros2
        function onGraphChanged() { panel.look_() }
        function onInitialized() { panel.look_() }
    }
    Connections {
        target: panel.Window.window
        ignoreUnknownSignals: true
        function onVisibilityChanged() {
            if (!panel.Window.window || !panel.Window.window.visible || panel.Window.window.visibility === Window.Minimized)
                panel.stop()
        }
    }
    Timer {
        interval: Math.round(1000 / panel.rate_)
        repeat: true
        running: panel.repeating_
        onTriggered: {
            if (!panel.usable_)
                panel.fail_(qsTr("STOPPED: %1").arg(panel.obstacle || form.problem || qsTr("the message is not complete")))
            else
                panel.send_()
        }
    }

    ThemeSuggest {
        id: topicField
        objectName: "topic"
        width: parent.width
        visible: panel.topic === ""
        placeholderText: qsTr("topic")
        Accessible.name: qsTr("Topic")
        suggest: panel.suggest_
        onChosen: function(text) { panel.entered_ = text.trim() }
    }
    ThemeText {
        id: kind
        objectName: "kind"
        anchors { left: parent.left; right: parent.right; top: topicField.visible ? topicField.bottom : parent.top }
        topPadding: topicField.visible ? Theme.gap / 2 : 0
        text: panel.type_ ? panel.type_ : panel.name_ ? qsTr("the type of %1 is not known yet: set `type`").arg(panel.name_) : qsTr("Enter a topic, or set `topic`.")
        color: Theme.dim
        font.pixelSize: Theme.small
    }
    MessageForm {
        id: form
        objectName: "form"
        anchors { left: parent.left; right: parent.right; top: kind.bottom; topMargin: Theme.gap / 2; bottom: foot.top; bottomMargin: Theme.gap / 2 }
        type: panel.type_
    }
    Column {
        id: foot
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        spacing: Theme.gap / 2

        ThemeText {
            objectName: "moves"
            width: parent.width
            visible: panel.moves
            text: qsTr("This moves the robot, and nothing stops it again. To drive, use a TwistCommand (DriveStick, DriveKeys).")
            color: Theme.warn
            font.pixelSize: Theme.small
            wrapMode: Text.Wrap
            maximumLineCount: 3
        }
        Row {
            spacing: Theme.gap
            ThemeButton {
                objectName: "publish"
                visible: !panel.moves
                text: qsTr("Publish once")
                enabled: panel.usable_ && !panel.repeating
                onClicked: panel.once_()
            }
            ThemeHoldButton {
                objectName: "holdPublish"
                visible: panel.moves
                text: qsTr("Hold to publish once")
                tint: Theme.warn
                enabled: panel.usable_
                onActivated: panel.once_()
            }
            ThemeButton {
                objectName: "repeat"
                visible: !panel.moves
                text: panel.repeating ? qsTr("STOP") : qsTr("Repeat at %1 Hz").arg(panel.rate_)
                tint: panel.repeating ? Theme.bad : Theme.accent
                selected: panel.repeating
                enabled: panel.repeating || panel.usable_
                onClicked: panel.repeating ? panel.stop() : panel.start()
            }
        }
        ThemeText {
            objectName: "said"
            width: parent.width
            visible: text !== ""
            text: panel.said_
            color: panel.failed_ ? Theme.bad : panel.repeating ? Theme.warn : Theme.dim
            font.pixelSize: Theme.small
            wrapMode: Text.Wrap
            maximumLineCount: 3
        }
    }
    Rectangle {
        anchors { fill: parent; margins: -Theme.gap / 2 }
        visible: panel.repeating
        color: "transparent"
        radius: Theme.radius
        border { color: Theme.warn; width: 3 }
    }
}
