// Asks for a file by Qt's dialog, which is loaded when it is first needed.
import QtQuick 2.15

Loader {
    id: box

    property string purpose_

    function ask(purpose) {
        // Loading the dialog takes its time.
        program.halt()
        purpose_ = purpose
        active = true
        if (item)
            item.ask(purpose)
    }
    active: false
    source: "FilePicker.qml"
    onLoaded: item.ask(purpose_)
}
