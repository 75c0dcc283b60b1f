// Sends goals to an action of any type: shows progress, result and why a goal was refused or lost, and cancels it.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: panel

    // Name of the action.
    property string action
    property string ns
    // Type of the action; empty for the server's.
    property string type
    // The goal's fields; without one, the operator fills in a form.
    property var goal: undefined
    // Goals to choose from, each a {text, goal} with a button of its own, instead of `goal` or a form.
    property var goals: []
    // Text of the button that sends.
    property string sendText: qsTr("Send")
    // Whether a goal is sent only after the button has been held down, for `holdTime` seconds.
    property bool hold: false
    // Seconds for which the button is held down.
    property real holdTime: 1
    // Milliseconds for a server to accept a goal.
    property int timeout: 10000
    // Why goals cannot be sent now; empty if they can.
    property string obstacle
    // Returns the progress, 0 to 1, of a feedback; by default, of the fields that commonly have it.
    property var progressOf: null
    // Returns the text shown for a feedback or a result; by default, its first fields.
    property var describe: null
    // Returns why a result means failure although the goal succeeded; by default, of `success` or `ok`.
    property var refusalOf: null

    // Whether a server is available, and whether a goal is under way.
    readonly property bool ready: client_ !== null && client_.ready
    readonly property bool busy: handle_ !== null
    // "", "sent", "running", "canceling", "succeeded", "canceled", "refused", "aborted" or "unknown".
    readonly property string outcome: outcome_
    // What is shown of the goal.
    readonly property string state_: busy && !ready ? qsTr("NO CONTACT: it may still be running")
        : outcome_ === "" ? (ready ? qsTr("ready") : "")
        : outcome_ === "sent" ? qsTr("sent, not accepted yet")
        : outcome_ === "running" ? (stale ? qsTr("it may still be running") : qsTr("running"))
        : outcome_ === "canceling" ? qsTr("canceling ...")
        : outcome_ === "succeeded" ? qsTr("done")
        : outcome_ === "canceled" ? qsTr("CANCELLED")
        : outcome_ === "refused" ? qsTr("REFUSED")
        : outcome_ === "aborted" ? qsTr("FAILED")
        : qsTr("OUTCOME UNKNOWN: it may still be running")
    // 0 to 1; NaN while unknown.
    readonly property real progress: progress_
    readonly property var feedback: feedback_
    readonly property var result: result_
    // Seconds since the goal was sent.
    readonly property real elapsed: elapsed_

    // A goal has ended; `outcome` says how, `reason` why there is no result.
    signal finished(string outcome, var result, string reason)

    readonly property string name_: Fields.resolve(ns, action)
    readonly property string key_: name_ + " " + type
    property var client_: null
    property var handle_: null
    property string outcome_
    property string said_
    property string cancelProblem_
    property string wrong_
    property real progress_: NaN
    property real furthest_: 0
    property bool percent_: false
    property var feedback_
    property var result_
    property real elapsed_: 0
    property double sentAt_: 0
    // Seconds since the last feedback.
    property double fedAt_: 0
    property real silence_: 0
    // The type of the form, and what is wrong with it.
    property string formType_
    property string formProblem_
    readonly property Item fields_: formLoader.item
    readonly property bool form_: (goal === undefined || goal === null) && !goals.length
    readonly property bool sendable_: ready && !busy && obstacle === ""
    // The text of the goal's button.
    property string chosen_
    readonly property string of_: chosen_ && outcome_ !== "" ? qsTr("%1: ").arg(chosen_) : ""

    title: action
    stale: !ready
    age: 0
    problem: wrong_ ? wrong_
        : obstacle ? obstacle
        : !ready ? qsTr("NOT AVAILABLE: %1").arg(client_ && client_.problem ? Fields.bounded(client_.problem, 120) : qsTr("no server of %1 yet").arg(name_))
        : ""
    note: busy ? qsTr("%1 s").arg(elapsed.toFixed(0)) : ""
    contentWidth: 240 * Theme.size
    contentHeight: column.implicitHeight
    Accessible.description: status || state_ + " " + said_

    // Sends a goal: `given`, or `goal`, or the form's. The panel has one goal at a time.
    function send(given) {
        send_(given, "")
    }

    function send_(given, name) {
        if (handle_ || !client_)
            return
        chosen_ = Fields.bounded(name, 60)
        if (obstacle) {
            outcome_ = "refused"
            said_ = Fields.bounded(obstacle)
            return
        }
        let value = given !== undefined ? given : goal
        if (value === undefined || value === null) {
            value = readForm_()
            if (value === null)
                return
        }
        const number = ++number_, self = panel
        outcome_ = "sent"
        said_ = cancelProblem_ = formProblem_ = ""
        progress_ = NaN
        furthest_ = elapsed_ = 0
        percent_ = false
        feedback_ = result_ = undefined
        sentAt_ = fedAt_ = Date.now()
        silence_ = 0
        client_.connectionTimeout = timeout > 0 ? timeout : 10000
        const mine = () => self && number === self.number_
        let rejected = false
        try {
            handle_ = client_.sendGoalAsync(value, {
                onGoalResponse: function (handle) { rejected = !handle },
                onFeedback: function (handle, message) { if (mine()) self.take_(message) },
                onResult: function (end) { if (mine()) self.end_(end, rejected) }
            })
        } catch (error) {
            outcome_ = "refused"
            said_ = formProblem_ = Fields.bounded(error.message)
        }
    }

    // Asks the server to cancel the goal.
    function cancel() {
        if (!handle_)
            return
        cancelProblem_ = ""
        if (outcome_ !== "sent")
            outcome_ = "canceling"
        handle_.cancel()
    }

    property int number_: 0

    function describe_(message) {
        try {
            return Fields.bounded(describe ? describe(message) : Fields.summary(message, 6))
        } catch (error) {
            return qsTr("it could not be shown: %1").arg(error.message)
        }
    }

    function take_(message) {
        feedback_ = message
        fedAt_ = Date.now()
        silence_ = 0
        said_ = describe_(message)
        let value = NaN
        try {
            value = progressOf ? Number(progressOf(message)) : guess_(message)
        } catch (error) {
            said_ = qsTr("progressOf failed: %1").arg(error.message)
        }
        progress_ = isNaN(value) ? NaN : Math.max(0, Math.min(1, value))
    }

    function guess_(message) {
        const names = Object.keys(message)
        for (const name of ["progress", "percent_complete", "percentage", "percent"]) {
            if (names.indexOf(name) >= 0 && typeof message[name] === "number") {
                percent_ = percent_ || name !== "progress" || message[name] > 1
                return percent_ ? message[name] / 100 : message[name]
            }
        }
        for (const name of ["remaining", "distance_remaining", "distance_to_goal"]) {
            if (names.indexOf(name) >= 0 && typeof message[name] === "number") {
                furthest_ = Math.max(furthest_, Math.abs(message[name]) || 0)
                return furthest_ > 0 ? 1 - Math.abs(message[name]) / furthest_ : NaN
            }
        }
        return NaN
    }

    function end_(end, rejected) {
        handle_ = null
        elapsed_ = (Date.now() - sentAt_) / 1000
        const hasResult = Object.keys(end.result).length > 0
        let reason = end.reason || ""
        if (end.code === ActionGoalStatus.Succeeded) {
            let why = ""
            try {
                why = refusalOf ? String(refusalOf(end.result) || "") : Fields.refusal(end.result)
            } catch (error) {
                why = qsTr("its result could not be judged: %1").arg(error.message)
            }
            outcome_ = why ? "aborted" : "succeeded"
            reason = why || reason
            progress_ = why ? progress_ : isNaN(progress_) ? NaN : 1
        } else {
            outcome_ = end.code === ActionGoalStatus.Canceled ? "canceled"
                : end.code !== ActionGoalStatus.Aborted ? "unknown" : rejected ? "refused" : "aborted"
        }
        result_ = hasResult ? end.result : undefined
        said_ = [Fields.bounded(reason), hasResult ? describe_(end.result) : ""].filter(part => part !== "").join(" · ")
        finished(outcome_, result_, reason)
    }

    // The form.

    function readForm_() {
        const filled = fields_ && fields_.ready ? fields_.message() : undefined
        if (filled === undefined)
            formProblem_ = fields_ && fields_.problem ? Fields.bounded(fields_.problem) : qsTr("the fields of the goal are not known yet")
        else
            fields_.remember()
        return filled === undefined ? null : filled
    }

    function fillForm_() {
        if (form_ && ready && name_)
            formType_ = type || Ros2.getActionTypes(name_)[0] || formType_
    }

    function connect_() {
        if (handle_) {
            ++number_
            handle_.cancel()
            handle_ = null
            outcome_ = "unknown"
            said_ = qsTr("the action was changed before the goal ended")
        } else {
            outcome_ = said_ = ""
        }
        client_ = null
        wrong_ = formType_ = formProblem_ = ""
        if (!action) {
            wrong_ = qsTr("no action is given")
            return
        }
        try {
            client_ = Ros2.createActionClient(name_, type)
        } catch (error) {
            wrong_ = Fields.bounded(error.message)
        }
        fillForm_()
    }

    onKey_Changed: connect_()
    onReadyChanged: fillForm_()
    onForm_Changed: fillForm_()
    Component.onCompleted: if (!client_) connect_()

    // The type may still be on its way from the robot.
    Timer {
        interval: 1000
        repeat: true
        running: panel.form_ && panel.formType_ === "" && panel.ready
        onTriggered: panel.fillForm_()
    }
    Connections {
        target: panel.handle_
        function onStatusChanged() {
            if (panel.handle_ && panel.outcome_ !== "canceling" || panel.handle_ && panel.handle_.status === ActionGoalStatus.Canceling)
                panel.outcome_ = panel.handle_.status === ActionGoalStatus.Canceling ? "canceling"
                    : panel.handle_.status === ActionGoalStatus.Unknown ? "sent" : "running"
        }
        function onCancelFailed(reason) {
            panel.cancelProblem_ = qsTr("NOT CANCELLED: %1").arg(Fields.bounded(reason))
            if (panel.outcome_ === "canceling")
                panel.outcome_ = "running"
        }
    }
    Timer {
        interval: 200
        repeat: true
        running: panel.busy
        // They grow even when the clock is set back.
        onTriggered: {
            panel.elapsed_ = Math.max(panel.elapsed_, (Date.now() - panel.sentAt_) / 1000)
            panel.silence_ = Math.max(panel.silence_, (Date.now() - panel.fedAt_) / 1000)
        }
    }

    Flickable {
        id: scroll
        anchors.fill: parent
        contentHeight: column.implicitHeight
        interactive: contentHeight > height
        clip: interactive
        boundsBehavior: Flickable.StopAtBounds

        Column {
            id: column
            width: parent.width
            spacing: Theme.gap / 2

            Loader {
                id: formLoader
                width: parent.width
                active: panel.form_
                visible: active
                sourceComponent: MessageForm {
                    objectName: "form"
                    width: column.width
                    height: implicitHeight
                    type: panel.formType_
                    scrolls: false
                    enabled: !panel.busy
                    onEdited: panel.formProblem_ = ""
                    onAccepted: if (!panel.hold) panel.send()
                }
            }
            Grid {
                width: parent.width
                columns: 2
                spacing: panel.goals.length ? Theme.gap / 2 : Theme.gap
                readonly property real half: (width - spacing) / 2

                Repeater {
                    model: panel.hold ? [] : panel.goals
                    ThemeButton {
                        objectName: "goal" + index
                        width: parent.half
                        text: modelData.text
                        enabled: panel.sendable_
                        onClicked: panel.send_(panel.goals[index].goal, modelData.text)
                    }
                }
                Repeater {
                    model: panel.hold ? panel.goals : []
                    ThemeHoldButton {
                        objectName: "holdGoal" + index
                        width: parent.half
                        text: modelData.text
                        delay: Math.round(1000 * (panel.holdTime > 0 ? panel.holdTime : 1))
                        enabled: panel.sendable_
                        onActivated: panel.send_(panel.goals[index].goal, modelData.text)
                    }
                }
                ThemeButton {
                    objectName: "send"
                    width: parent.half
                    visible: !panel.hold && !panel.goals.length
                    text: panel.sendText
                    enabled: panel.sendable_ && (!panel.form_ || (panel.fields_ !== null && panel.fields_.valid))
                    onClicked: panel.send()
                }
                ThemeHoldButton {
                    objectName: "holdSend"
                    width: parent.half
                    visible: panel.hold && !panel.goals.length
                    text: panel.sendText
                    delay: Math.round(1000 * (panel.holdTime > 0 ? panel.holdTime : 1))
                    enabled: panel.sendable_ && (!panel.form_ || (panel.fields_ !== null && panel.fields_.valid))
                    onActivated: panel.send()
                }
                ThemeButton {
                    objectName: "cancel"
                    width: parent.half
                    text: qsTr("Cancel")
                    tint: Theme.bad
                    enabled: panel.busy
                    onClicked: panel.cancel()
                }
            }
            Rectangle {
                width: parent.width
                height: Theme.gap
                radius: height / 2
                color: Theme.track
                visible: panel.busy || !isNaN(panel.progress)
                Accessible.role: Accessible.ProgressBar
                Accessible.name: qsTr("Progress")
                Accessible.description: isNaN(panel.progress) ? qsTr("unknown") : qsTr("%1 %").arg((100 * panel.progress).toFixed(0))
                Rectangle {
                    objectName: "bar"
                    width: isNaN(panel.progress) ? 0 : parent.width * panel.progress
                    height: parent.height
                    radius: height / 2
                    color: Theme.accent
                }
            }
            ThemeText {
                objectName: "state"
                width: parent.width
                visible: text !== ""
                text: {
                    if (panel.cancelProblem_ || panel.formProblem_)
                        return panel.cancelProblem_ || panel.formProblem_
                    const parts = [panel.of_ + panel.state_]
                    if (panel.busy && panel.ready && !isNaN(panel.progress))
                        parts.push(qsTr("%1 %").arg((100 * panel.progress).toFixed(0)))
                    if (panel.busy && panel.feedback !== undefined && panel.silence_ > 3)
                        parts.push(qsTr("last feedback %1 s ago").arg(panel.silence_.toFixed(0)))
                    return parts.filter(part => part !== "").join(", ")
                }
                color: panel.cancelProblem_ || panel.formProblem_ || (panel.busy && !panel.ready) ? Theme.bad
                    : panel.outcome === "succeeded" ? Theme.good
                    : panel.outcome === "refused" || panel.outcome === "aborted" || panel.outcome === "unknown" ? Theme.bad
                    : panel.outcome === "canceled" || panel.outcome === "canceling" ? Theme.warn : Theme.dim
                font.weight: Font.DemiBold
            }
            ThemeText {
                objectName: "said"
                width: parent.width
                visible: text !== ""
                text: panel.said_
                color: Theme.dim
                wrapMode: Text.Wrap
                maximumLineCount: 4
                font.pixelSize: Theme.small
            }
        }
    }
}
