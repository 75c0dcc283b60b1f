// A service call with its state for the operator: pending, or failed.
import QtQuick 2.15
import Ros 1.0

Item {
    id: request
    property string note
    readonly property bool failed: note !== "" && !waiting
    property bool waiting: false
    property int count: 0

    function ask(what, name, type, fields) {
        var mine = ++count
        waiting = true
        note = what + " …"
        late.what = what
        late.restart()
        Service.callAsync(name, type, fields, function (response) {
            if (mine !== count)
                return
            late.stop()
            waiting = false
            note = !response ? what + ": NO ANSWER" : response.success ? "" : what + ": " + response.message
        })
    }
    Timer {
        id: late
        property string what
        interval: 2000
        onTriggered: {
            request.waiting = false
            request.note = what + ": NO ANSWER YET"
        }
    }
}
