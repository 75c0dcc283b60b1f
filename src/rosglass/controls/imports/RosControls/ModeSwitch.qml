// The robot's mode: shows the one that the robot confirms, and requests another; by topics
// (std_msgs/String or an integer), or of a ROS 2 lifecycle node.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: modeSwitch

    // Topic on which a mode is requested.
    property string topic: "mode"
    // Topic on which the robot says which mode it is in.
    property string stateTopic: topic + "/state"
    property string ns
    // Services (std_srvs/Trigger) that request the modes, with %1 for the mode, instead of `topic`.
    property string service
    // A lifecycle node, instead of topics.
    property string nodeName
    // What there is to choose from: texts, or {value, text}; a lifecycle node's are known.
    property var modes: []
    // Type of `topic`; empty for what its subscribers have, or std_msgs/String.
    property string type
    // Milliseconds until a request is said to be unconfirmed.
    property int timeout: 2000
    // Milliseconds after which a mode that the robot repeats is out of date; 0 for one that it does not repeat.
    property int stateTimeout: 0
    // Why modes cannot be changed now; empty if they can.
    property string obstacle

    // The mode that the robot confirms; undefined while unknown.
    readonly property var confirmed: nodeName ? state_ : live.message !== undefined ? live.message.data : undefined
    // The mode that was requested and is not confirmed yet; undefined without one.
    property var requested: undefined
    readonly property bool pending: requested !== undefined
    // Why the last request had no effect; empty if it had.
    property string refusal

    readonly property var integers_: ["std_msgs/msg/UInt8", "std_msgs/msg/Int8", "std_msgs/msg/UInt16", "std_msgs/msg/Int16", "std_msgs/msg/UInt32", "std_msgs/msg/Int32"]
    readonly property var lifecycle_: [
        { value: "unconfigured", text: qsTr("unconfigured") }, { value: "inactive", text: qsTr("inactive") },
        { value: "active", text: qsTr("active") }, { value: "finalized", text: qsTr("finalized") }]
    // State -> wanted state -> id and state of the next transition.
    readonly property var steps_: ({
        unconfigured: { inactive: [1, "inactive"], active: [1, "inactive"], finalized: [5, "finalized"] },
        inactive: { unconfigured: [2, "unconfigured"], active: [3, "active"], finalized: [6, "finalized"] },
        active: { inactive: [4, "inactive"], unconfigured: [4, "inactive"], finalized: [7, "finalized"] }
    })
    readonly property var choices_: (nodeName ? lifecycle_ : modes).map(function(one) {
        return one !== null && typeof one === "object" ? { value: one.value, text: String(one.text === undefined ? one.value : one.text) }
            : { value: one, text: String(one) }
    })
    property var state_: undefined
    property real stateAt_: 0
    property real age_: -1
    property string unreachable_
    property var publisher_: null
    property string published_
    property var clients_: ({})
    property var getState_: null
    property var changeState_: null
    // A number that makes answers to earlier requests, or of another robot, void.
    property int turn_: 0
    property bool asking_: false
    property bool again_: false
    property bool complete_: false

    title: qsTr("Mode")
    source: nodeName ? null : live
    stale: nodeName ? state_ === undefined || age_ > 3.5 : live.stale
    age: nodeName ? age_ : live.age
    problem: nodeName ? unreachable_ : live.problem
    note: confirmed === undefined ? "" : text_(confirmed)
    contentWidth: 240 * Theme.size
    contentHeight: column.height
    // A reason in the middle would cover the buttons.
    filled: true
    Accessible.description: status || qsTr("confirmed: %1").arg(note) + (outcome.text ? "; " + outcome.text : "")

    function text_(value) {
        const one = choices_.find(function(one) { return one.value === value })
        return one ? one.text : Fields.bounded(value, 60)
    }

    // Request a mode; what is shown changes when the robot confirms it.
    function request(value) {
        if (obstacle) {
            refusal = obstacle
            return
        }
        turn_ += 1
        refusal = ""
        requested = value
        late.restart()
        try {
            if (nodeName)
                step_()
            else if (service)
                call_(value)
            else
                publish_(value)
        } catch (error) {
            refuse_(String(error.message || error))
        }
        settle_()
    }

    function refuse_(why) {
        requested = undefined
        late.stop()
        refusal = why
    }

    function settle_() {
        if (pending && confirmed === requested && !stale) {
            requested = undefined
            late.stop()
        }
    }

    function publish_(value) {
        const topic = Fields.resolve(ns, modeSwitch.topic)
        const announced = Ros2.getSubscriptionsInfo(topic).map(function(one) { return one.type })
        const known = [type, announced[0], live.messageType].find(function(one) { return one })
        const kind = known || (typeof value === "number" ? "std_msgs/msg/Int32" : "std_msgs/msg/String")
        if (kind !== "std_msgs/msg/String" && integers_.indexOf(kind.replace(/^(\w+)\/(\w+)$/, "$1/msg/$2")) < 0) {
            refuse_(Fields.fill(qsTr("%1 has the type %2, which is not a String or an integer"), [topic, kind]))
            return
        }
        if (publisher_ === null || published_ !== topic + " " + kind) {
            published_ = topic + " " + kind
            publisher_ = Ros2.createPublisher(topic, kind, Ros2.CommandQoS())
        }
        if (!publisher_.publish({ data: value }))
            refuse_(publisher_.problem || qsTr("not sent: no connection"))
    }

    function call_(value) {
        const name = Fields.resolve(ns, service.arg(value)), turn = turn_
        if (!clients_[name]) {
            clients_[name] = Ros2.createServiceClient(name, "std_srvs/srv/Trigger")
            clients_[name].connectionTimeout = 0
        }
        clients_[name].call({}).then(function(answer) {
            if (modeSwitch && turn === modeSwitch.turn_ && !answer.success)
                modeSwitch.refuse_(answer.message ? qsTr("refused: %1").arg(answer.message) : qsTr("refused"))
        }, function(error) {
            if (modeSwitch && turn === modeSwitch.turn_)
                modeSwitch.refuse_(String(error.message || error))
        })
    }

    // -- a lifecycle node --

    function connect_() {
        if (!complete_)
            return
        turn_ += 1
        requested = state_ = undefined
        asking_ = again_ = false
        age_ = -1
        refusal = unreachable_ = ""
        publisher_ = null
        clients_ = ({})
        late.stop()
        getState_ = nodeName ? Ros2.createServiceClient(Fields.resolve(ns, nodeName) + "/get_state", "lifecycle_msgs/srv/GetState") : null
        changeState_ = nodeName ? Ros2.createServiceClient(Fields.resolve(ns, nodeName) + "/change_state", "lifecycle_msgs/srv/ChangeState") : null
        if (getState_)
            getState_.connectionTimeout = 1500
        if (changeState_)
            changeState_.connectionTimeout = 0
        ask_()
    }

    function ask_() {
        again_ = asking_
        if (!getState_ || asking_)
            return
        const client = getState_
        asking_ = true
        client.call({}).then(function(answer) {
            if (!modeSwitch || client !== modeSwitch.getState_)
                return
            modeSwitch.asking_ = false
            modeSwitch.unreachable_ = ""
            // It may be of the time before a transition.
            if (modeSwitch.again_)
                modeSwitch.ask_()
            else
                modeSwitch.take_(answer.current_state.label)
        }, function(error) {
            if (!modeSwitch || client !== modeSwitch.getState_)
                return
            modeSwitch.asking_ = false
            modeSwitch.unreachable_ = String(error.message || error)
        })
    }

    function take_(state) {
        state_ = state
        stateAt_ = Date.now()
        age_ = 0
        settle_()
    }

    function step_() {
        const next = steps_[state_] ? steps_[state_][requested] : undefined
        if (state_ === requested)
            return
        if (!next) {
            refuse_(state_ === undefined ? qsTr("the node's state is unknown")
                : Fields.fill(qsTr("no transition leads from %1 to %2"), [text_(state_), text_(requested)]))
            return
        }
        const turn = turn_, client = changeState_
        client.call({ transition: { id: next[0] } }).then(function(answer) {
            if (!modeSwitch || client !== modeSwitch.changeState_)
                return
            modeSwitch.ask_()
            if (turn !== modeSwitch.turn_)
                return
            if (!answer.success)
                modeSwitch.refuse_(Fields.fill(qsTr("refused: %1 did not become %2"), [modeSwitch.nodeName, next[1]]))
            else if (modeSwitch.requested !== undefined && next[1] !== modeSwitch.requested) {
                modeSwitch.take_(next[1])
                modeSwitch.step_()
            }
        }, function(error) {
            if (modeSwitch && turn === modeSwitch.turn_ && client === modeSwitch.changeState_)
                modeSwitch.refuse_(String(error.message || error))
        })
    }

    Component.onCompleted: {
        complete_ = true
        connect_()
    }
    onNodeNameChanged: connect_()
    onNsChanged: connect_()
    onTopicChanged: connect_()
    onServiceChanged: connect_()
    onConfirmedChanged: settle_()
    onStaleChanged: settle_()

    LiveTopic {
        id: live
        enabled: modeSwitch.nodeName === ""
        topic: modeSwitch.stateTopic
        ns: modeSwitch.ns
        types: ["std_msgs/msg/String"].concat(modeSwitch.integers_)
        qos: Ros2.BestAvailableQoS()
        timeout: modeSwitch.stateTimeout
    }
    LiveTopic {
        enabled: modeSwitch.nodeName !== ""
        topic: modeSwitch.nodeName + "/transition_event"
        ns: modeSwitch.ns
        types: ["lifecycle_msgs/msg/TransitionEvent"]
        onMessageChanged: modeSwitch.ask_()
    }
    Timer {
        interval: 1000
        repeat: true
        running: modeSwitch.nodeName !== ""
        onTriggered: {
            if (modeSwitch.stateAt_ > 0 && modeSwitch.state_ !== undefined)
                modeSwitch.age_ = Math.max(0, (Date.now() - modeSwitch.stateAt_) / 1000)
            modeSwitch.ask_()
        }
    }
    Timer {
        id: late
        interval: modeSwitch.timeout
        onTriggered: modeSwitch.refuse_(Fields.fill(qsTr("%1 was requested, and not confirmed within %2 s"), [modeSwitch.text_(modeSwitch.requested), (modeSwitch.timeout / 1000).toFixed(1)]))
    }

    // What was refused is said in full colour.
    body.opacity: 1

    Column {
        id: column
        width: parent.width
        spacing: Theme.gap / 2
        Flow {
            id: flow
            opacity: modeSwitch.stale ? 0.35 : 1
            width: parent.width
            spacing: Theme.gap / 2
            Repeater {
                id: buttons
                model: modeSwitch.choices_
                ThemeButton {
                    objectName: "mode" + index
                    readonly property bool confirmed: modeSwitch.confirmed === modelData.value && !modeSwitch.stale
                    readonly property bool requested: modeSwitch.pending && modeSwitch.requested === modelData.value
                    text: modelData.text + (requested ? " …" : "")
                    width: Math.min(implicitWidth, flow.width)
                    checkable: false
                    down: pressed || confirmed
                    tint: requested ? Theme.warn : Theme.accent
                    Accessible.role: Accessible.RadioButton
                    Accessible.name: modelData.text
                    Accessible.description: confirmed ? qsTr("confirmed") : requested ? qsTr("requested") : ""
                    Accessible.checked: confirmed
                    onClicked: modeSwitch.request(modelData.value)
                    Keys.onRightPressed: modeSwitch.focus_(index + 1)
                    Keys.onLeftPressed: modeSwitch.focus_(index - 1)
                }
            }
        }
        ThemeText {
            id: outcome
            objectName: "outcome"
            width: parent.width
            visible: text !== ""
            wrapMode: Text.Wrap
            maximumLineCount: 3
            text: modeSwitch.pending ? qsTr("%1 requested, not confirmed yet").arg(modeSwitch.text_(modeSwitch.requested)) : modeSwitch.refusal
            color: modeSwitch.pending ? Theme.warn : Theme.bad
            font.pixelSize: Theme.small
        }
    }

    function focus_(index) {
        const item = buttons.itemAt((index + buttons.count) % buttons.count)
        if (item)
            item.forceActiveFocus(Qt.TabFocusReason)
    }
}
