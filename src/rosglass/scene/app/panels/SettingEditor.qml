import QtQuick
import QtQuick.Controls.Fusion
import QtQuick.Layouts

// The value of a setting, as its kind is edited: a check box, a list, a color, or a text.
RowLayout {
    id: editor

    property string kind: ""
    property var value: ""
    // Of enumerations, and names of frames and topics.
    property var choices: []
    // The same; a list that is open is not made anew by one that is equal.
    property var names: []
    // What an empty value means.
    property string placeholder: ""
    readonly property bool isName: kind === "frame" || kind === "topic"
    readonly property bool isList: kind === "enum" || isName && choices.length > 0
    readonly property bool isText: isName && choices.length === 0
                                 || ["int", "float", "string", "path", "color", "vector", "quaternion"].indexOf(kind) >= 0

    // The user has entered a value.
    signal edited(var value)
    // The user wants a dialog for the color.
    signal colorAsked(color before)

    onChoicesChanged: if (String(choices) !== String(names)) names = choices
    visible: kind === "bool" || isList || isText
    spacing: 4
    Layout.fillWidth: kind !== "bool"

    Rectangle {
        objectName: "swatch"
        visible: editor.kind === "color"
        Layout.preferredWidth: 16
        Layout.preferredHeight: 16
        color: editor.kind === "color" ? editor.value : "transparent"
        border.color: palette.mid
        MouseArea { anchors { fill: parent; margins: -4 } onClicked: editor.colorAsked(parent.color) }
    }
    CheckBox {
        visible: editor.kind === "bool"
        checked: editor.kind === "bool" && editor.value === true
        onToggled: editor.edited(checked)
    }
    PlainComboBox {
        visible: editor.isList
        Layout.fillWidth: true
        Layout.preferredWidth: 150
        Layout.preferredHeight: 22
        model: editor.names
        editable: editor.kind !== "enum"
        currentIndex: editor.names.indexOf(String(editor.value))
        displayText: currentText || editor.placeholder
        // What is set may be none of the choices, e.g. a frame that is not there yet.
        readonly property string given: String(editor.value)
        function showGiven() { if (editable) editText = given }
        function commit() {
            if (!editable || editText === given) return
            editor.edited(editText)
            // What was refused is not left standing.
            showGiven()
        }
        onGivenChanged: showGiven()
        onModelChanged: Qt.callLater(showGiven)
        Component.onCompleted: showGiven()
        onActivated: editor.edited(currentText)
        onAccepted: commit()
        onActiveFocusChanged: if (!activeFocus) commit()
    }
    TextField {
        visible: editor.isText
        Layout.fillWidth: true
        Layout.preferredWidth: 150
        Layout.preferredHeight: 22
        text: editor.kind === "bool" ? "" : String(editor.value)
        placeholderText: editor.placeholder
        selectByMouse: true
        onEditingFinished: {
            if (text === String(editor.value)) return
            editor.edited(text)
            // What was refused is not left standing.
            text = Qt.binding(() => editor.kind === "bool" ? "" : String(editor.value))
        }
    }
}
