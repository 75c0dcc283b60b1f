// A button that calls a service of any type, and shows how the call ended.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

Item {
    id: control

    // Name of the service.
    property string service
    property string ns
    // Type of the service; empty for the server's.
    property string type
    // The request's fields; those left out have their defaults.
    property var request: ({})
    // Text of the button.
    property string text: service
    // Whether it is called only after the button has been held down, for `holdTime` seconds.
    property bool hold: false
    // Seconds for which the button is held down.
    property real holdTime: 1
    // Milliseconds to wait for the answer; a call from code waits as long for a server.
    property int timeout: 10000
    // Whether `status` is shown below the button; several buttons may have one line in common.
    property bool showStatus: true
    // Colour of the button.
    property color tint: hold ? Theme.warn : Theme.accent
    // Returns why the server refused, by its response; empty if it did not.
    property var refusalOf: null

    // Whether a server is available, and whether it has been called and has not answered yet.
    readonly property bool ready: client_ !== null && client_.ready
    readonly property bool busy: busy_
    // "" before the first call, then "done", "refused" or "failed".
    readonly property string outcome: outcome_
    // What is shown below the button.
    readonly property string status: wrong_ ? wrong_
        : busy ? (ready ? qsTr("calling ...") : qsTr("waiting for %1 ...").arg(name_))
        // Also without a server: the robot may have done it before its answer was lost.
        : outcome_ === "failed" ? qsTr("FAILED: %1").arg(said_)
        : !ready ? unconnected_ || qsTr("NOT AVAILABLE: %1").arg(client_ && client_.problem ? Fields.bounded(client_.problem) : qsTr("no server of %1 yet").arg(name_))
        : outcome_ === "refused" ? qsTr("REFUSED: %1").arg(said_)
        : outcome_ === "done" ? (said_ ? qsTr("done: %1").arg(said_) : qsTr("done"))
        : ""
    // The last response; undefined without one.
    readonly property var response: response_

    // The server has answered, or there is no answer for this reason.
    signal answered(var response)
    signal failed(string reason)

    readonly property string unconnected_: Fields.unconnected(Ros2.connectionState, Ros2.connectionDetail)
    readonly property string name_: Fields.resolve(ns, service)
    readonly property string key_: name_ + " " + type
    property var client_: null
    property bool busy_: false
    property string outcome_
    property string said_
    property string wrong_
    property var response_
    // Of the call whose answer is awaited; later answers of earlier calls do not count.
    property int number_: 0

    implicitWidth: Math.max(button_.implicitWidth, 160 * Theme.size)
    implicitHeight: Theme.touch + (showStatus ? Theme.small * 1.5 : 0)
    Accessible.role: Accessible.Grouping
    Accessible.name: text
    Accessible.description: status

    // Calls the service, unless it is being called already.
    function call() {
        if (busy_ || !client_)
            return
        const number = ++number_, self = control
        busy_ = true
        outcome_ = said_ = ""
        response_ = undefined
        limit.restart()
        client_.connectionTimeout = limit_
        let promise
        try {
            promise = client_.call(request === undefined || request === null ? {} : request)
        } catch (error) {
            fail_(error.message)
            return
        }
        promise.then(
            function (response) { if (self && number === self.number_) self.take_(response) },
            function (error) { if (self && number === self.number_) self.fail_(error.message) })
    }

    readonly property int limit_: timeout > 0 ? timeout : 10000

    function take_(response) {
        end_()
        response_ = response
        let why = ""
        try {
            why = refusalOf ? String(refusalOf(response) || "") : Fields.refusal(response)
        } catch (error) {
            why = qsTr("its answer could not be judged: %1").arg(error.message)
        }
        outcome_ = why ? "refused" : "done"
        said_ = Fields.bounded(why || Fields.answer(response))
        answered(response)
    }

    function fail_(reason) {
        end_()
        outcome_ = "failed"
        said_ = Fields.bounded(reason)
        failed(reason)
    }

    function end_() {
        ++number_
        busy_ = false
        limit.stop()
    }

    function connect_() {
        if (busy_)
            fail_(qsTr("the service was changed before it answered"))
        client_ = null
        outcome_ = said_ = wrong_ = ""
        if (!service) {
            wrong_ = qsTr("no service is given")
            return
        }
        try {
            client_ = Ros2.createServiceClient(name_, type)
        } catch (error) {
            wrong_ = Fields.bounded(error.message)
        }
    }

    onKey_Changed: connect_()
    Component.onCompleted: if (!client_) connect_()

    Timer {
        id: limit
        interval: control.limit_
        onTriggered: {
            const was = control.ready
            const reason = was ? qsTr("no answer within %1 s; the robot may still do it").arg(control.limit_ / 1000)
                : Fields.fill(qsTr("no server of %1 within %2 s"), [control.name_, control.limit_ / 1000])
            // Before the requests are cancelled, which reports another reason.
            control.fail_(reason)
            control.client_.cancelRequests()
        }
    }

    readonly property Item button_: hold ? holdButton : button

    ThemeButton {
        id: button
        objectName: "button"
        anchors { left: parent.left; right: parent.right }
        visible: !control.hold
        text: control.busy ? qsTr("%1 ...").arg(control.text) : control.text
        tint: control.tint
        enabled: control.ready && !control.busy
        Accessible.description: control.status
        onClicked: control.call()
    }
    ThemeHoldButton {
        id: holdButton
        objectName: "holdButton"
        anchors { left: parent.left; right: parent.right }
        visible: control.hold
        text: control.busy ? qsTr("%1 ...").arg(control.text) : control.text
        tint: control.tint
        delay: Math.round(1000 * (control.holdTime > 0 ? control.holdTime : 1))
        enabled: control.ready && !control.busy
        onActivated: control.call()
    }
    ThemeReason {
        objectName: "status"
        visible: control.showStatus
        anchors { left: parent.left; right: parent.right; top: button.bottom; topMargin: 2 }
        wrapMode: Text.Wrap
        maximumLineCount: Math.max(1, Math.floor((control.height - y) / (Theme.small * 1.4)))
        text: control.status
        color: control.busy ? Theme.dim : !control.ready || control.outcome === "refused" || control.outcome === "failed" ? Theme.bad
            : control.outcome === "done" ? Theme.good : Theme.dim
    }
}
