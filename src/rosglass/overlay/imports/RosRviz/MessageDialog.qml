import QtQuick 2.15
import QtQuick.Controls 2.15

// A text with buttons, in the middle of the view; emits `accepted` or `rejected`.
Dialog {
    property alias text: label.text

    parent: Overlay.overlay
    anchors.centerIn: parent
    modal: true
    // Above popups that open later, which must not hide the question.
    z: 1
    focus: true
    standardButtons: Dialog.Ok
    closePolicy: Popup.CloseOnEscape

    Label {
        id: label

        width: Math.min(implicitWidth, 400)
        textFormat: Text.PlainText
        wrapMode: Text.Wrap
        maximumLineCount: 20
        elide: Text.ElideRight
    }
}
