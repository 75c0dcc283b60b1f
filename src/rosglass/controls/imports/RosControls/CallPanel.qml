// Calls a service of any type, with a request that is filled in by hand, and shows the whole response.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: panel

    // The service; without one, the operator enters it.
    property string service
    property string ns
    // Type of the service; empty for the server's.
    property string type
    // Whether it is called only after the button has been held down.
    property bool hold: false
    // Milliseconds to wait for the answer.
    property int timeout: 10000
    // Why it is not called now; empty if it can be.
    property string obstacle

    // Whether a server is available, and whether it has been called and has not answered yet.
    readonly property bool ready: button.ready
    readonly property bool busy: button.busy
    // "" before the first call, then "done", "refused" or "failed".
    readonly property string outcome: button.outcome
    // The last response; undefined without one.
    readonly property var response: button.response

    property string entered_
    property string found_
    readonly property string name_: Fields.resolve(ns, service || entered_)
    readonly property string type_: type.replace(/^(\w+)\/(\w+)$/, "$1/srv/$2") || found_

    // Calls the service with the request in the form.
    function call() {
        const request = form.message()
        if (request === undefined || obstacle || busy)
            return
        button.request = request
        form.remember()
        button.call()
    }

    function find_() {
        found_ = ""
        look_()
    }
    function look_() { found_ = name_ && !type ? (Ros2.getServiceTypes(name_)[0] || found_) : "" }
    function suggest_(typed) {
        const all = Ros2.getServiceNamesAndTypes()
        return Object.keys(all).filter(name => name.indexOf(typed) >= 0).slice(0, 50).map(name => ({ text: name, detail: all[name].join(", "), suits: true }))
    }
    function lines_(value) {
        const found = []
        const left = Fields.walk(value, (path, one) => found.push(Fields.fill(qsTr("%1: %2"), [path, Fields.shown(one)])), 60)
        return found.concat(left > 0 ? [qsTr("and %1 more fields").arg(left)] : []).join("\n")
    }

    title: service ? qsTr("Call %1").arg(name_) : qsTr("Call")
    source: null
    stale: name_ !== "" && !ready
    age: 0
    problem: obstacle || (name_ !== "" && !ready ? button.status : "")
    contentWidth: 340 * Theme.size
    contentHeight: 300 * Theme.size
    Accessible.description: status || button.status

    onName_Changed: Qt.callLater(find_)
    Component.onCompleted: find_()

    Connections {
        target: Ros2
        function onGraphChanged() { panel.look_() }
        function onInitialized() { panel.look_() }
    }
    ThemeSuggest {
        id: serviceField
        objectName: "service"
        width: parent.width
        visible: panel.service === ""
        placeholderText: qsTr("service")
        Accessible.name: qsTr("Service")
        suggest: panel.suggest_
        onChosen: function(text) { panel.entered_ = text.trim() }
    }
    ThemeText {
        id: kind
        anchors { left: parent.left; right: parent.right; top: serviceField.visible ? serviceField.bottom : parent.top }
        topPadding: serviceField.visible ? Theme.gap / 2 : 0
        text: panel.type_ ? panel.type_ : panel.name_ ? qsTr("the type of %1 is not known yet").arg(panel.name_) : qsTr("Enter a service, or set `service`.")
        color: Theme.dim
        font.pixelSize: Theme.small
    }
    MessageForm {
        id: form
        objectName: "form"
        anchors { left: parent.left; right: parent.right; top: kind.bottom; topMargin: Theme.gap / 2; bottom: foot.top; bottomMargin: Theme.gap / 2 }
        type: panel.type_
        enabled: !panel.busy
    }
    Column {
        id: foot
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        spacing: Theme.gap / 2

        // It knows the client; its buttons are replaced by those below, which send the form's request.
        ServiceButton {
            id: button
            visible: false
            service: panel.service || panel.entered_
            ns: panel.ns
            type: panel.type
            timeout: panel.timeout
        }
        ThemeButton {
            objectName: "call"
            visible: !panel.hold
            text: panel.busy ? qsTr("calling ...") : qsTr("Call")
            enabled: panel.ready && !panel.busy && form.valid && panel.obstacle === ""
            onClicked: panel.call()
        }
        ThemeHoldButton {
            objectName: "holdCall"
            visible: panel.hold
            text: panel.busy ? qsTr("calling ...") : qsTr("Hold to call")
            tint: Theme.warn
            enabled: panel.ready && !panel.busy && form.valid && panel.obstacle === ""
            onActivated: panel.call()
        }
        ThemeText {
            objectName: "state"
            width: parent.width
            visible: text !== ""
            text: panel.ready || panel.outcome === "failed" ? button.status : ""
            color: panel.outcome === "done" ? Theme.good : panel.outcome === "" || panel.busy ? Theme.dim : Theme.bad
            font.pixelSize: Theme.small
            wrapMode: Text.Wrap
            maximumLineCount: 3
        }
        Flickable {
            id: answer
            width: parent.width
            height: visible ? Math.min(contentHeight, 110 * Theme.size) : 0
            visible: panel.response !== undefined
            contentHeight: responseText.implicitHeight
            clip: true
            boundsBehavior: Flickable.StopAtBounds
            ThemeText {
                id: responseText
                objectName: "response"
                width: answer.width
                text: panel.response !== undefined ? panel.lines_(panel.response) : ""
                wrapMode: Text.Wrap
                maximumLineCount: 70
            }
        }
    }
}
