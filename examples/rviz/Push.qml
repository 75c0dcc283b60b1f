// A button in the style of this interface.
import QtQuick 2.15

Rectangle {
    id: push
    property string text
    property url icon
    property bool checked: false
    // Icon and text at the left, for buttons in a column.
    property bool leading: false
    property int size: 11
    property color tint: Theme.accent
    signal clicked()

    implicitWidth: label.implicitWidth + 18
    implicitHeight: 26
    radius: 5
    opacity: enabled ? 1 : 0.4
    color: checked ? Qt.darker(tint, 2.2) : area.pressed ? "#2b3a4a" : Theme.button
    border { color: activeFocus ? "white" : checked ? tint : area.containsMouse ? Theme.dim : Theme.edge; width: activeFocus ? 2 : 1 }
    activeFocusOnTab: true
    Keys.onPressed: function (event) {
        event.accepted = [Qt.Key_Space, Qt.Key_Return, Qt.Key_Enter].indexOf(event.key) >= 0
        if (event.accepted && !event.isAutoRepeat && !lifted.running)
            clicked()
    }
    Keys.onReleased: lifted.restart()
    // X11 repeats a held key as releases and presses.
    Timer { id: lifted; interval: 50 }
    Row {
        id: label
        x: push.leading ? 9 : (push.width - width) / 2
        anchors.verticalCenter: parent.verticalCenter
        spacing: 6
        Image {
            anchors.verticalCenter: parent.verticalCenter
            visible: push.icon != ""
            source: push.icon
            sourceSize { width: 18; height: 18 }
        }
        Text {
            anchors.verticalCenter: parent.verticalCenter
            textFormat: Text.PlainText
            text: push.text
            color: push.checked ? "white" : Theme.text
            font.pixelSize: push.size
        }
    }
    MouseArea {
        id: area
        anchors.fill: parent
        hoverEnabled: true
        onClicked: push.clicked()
    }
}
