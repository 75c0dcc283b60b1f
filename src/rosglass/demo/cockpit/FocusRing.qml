// Shows which control has the keyboard.
import QtQuick

Rectangle {
    required property Item item

    objectName: "focusRing"
    anchors { fill: parent; margins: -6 }
    visible: item.activeFocus
    color: "transparent"
    border { color: Theme.accent; width: 3 }
}
