// A question with its answers, over the window.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import RosControls 1.0

T.Popup {
    id: box

    property string text
    property var answers: []
    // The answer that Return takes.
    property int first: 0
    signal answered(int index)

    function first_() {
        if (choices.count)
            choices.itemAt(first).forceActiveFocus(Qt.TabFocusReason)
    }

    function choose(index) {
        close()
        answered(index)
    }

    parent: T.Overlay.overlay
    anchors.centerIn: parent
    width: parent ? Math.min(560 * Theme.size, parent.width - 2 * Theme.gap) : 100
    implicitHeight: implicitContentHeight + topPadding + bottomPadding
    modal: true
    focus: true
    padding: 2 * Theme.gap
    // Return answers once it is seen: not before the window is shown.
    onOpened: first_()
    onAnswersChanged: if (opened) Qt.callLater(first_)
    closePolicy: T.Popup.NoAutoClose

    T.Overlay.modal: Rectangle { color: Theme.shade; opacity: 0.7 }
    background: Rectangle {
        color: Theme.panel
        radius: Theme.radius
        border { color: Theme.warn; width: 1 }
    }
    contentItem: Column {
        spacing: 2 * Theme.gap
        ThemeText {
            width: parent.width
            text: box.text
            wrapMode: Text.Wrap
            Accessible.role: Accessible.AlertMessage
            Accessible.name: text
        }
        Flow {
            width: parent.width
            spacing: Theme.gap
            Repeater {
                id: choices
                model: box.answers
                delegate: ThemeButton {
                    text: modelData
                    objectName: "answer" + index
                    onClicked: box.choose(index)
                }
            }
        }
    }
}
