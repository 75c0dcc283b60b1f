// A line of text to enter.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

T.TextField {
    id: field

    // Why its text cannot be used; empty if it can.
    property string problem

    implicitWidth: 140 * Theme.size
    implicitHeight: Theme.touch
    leftPadding: Theme.gap
    rightPadding: Theme.gap
    verticalAlignment: TextInput.AlignVCenter
    color: enabled ? Theme.text : Theme.faint
    selectionColor: Theme.accent
    selectedTextColor: Theme.onAccent
    placeholderTextColor: Theme.dim
    selectByMouse: true
    font.pixelSize: Theme.normal
    Accessible.role: Accessible.EditableText
    Accessible.name: placeholderText
    Accessible.description: problem

    background: Rectangle {
        radius: Theme.radius
        color: Theme.track
        border { color: field.problem ? Theme.bad : field.activeFocus ? Theme.accent : Theme.edge; width: field.activeFocus ? 2 : 1 }
    }

    ThemeText {
        anchors { fill: parent; leftMargin: field.leftPadding; rightMargin: field.rightPadding }
        visible: field.length === 0 && field.preeditText === ""
        text: field.placeholderText
        color: field.placeholderTextColor
        font: field.font
        verticalAlignment: Text.AlignVCenter
    }
}
