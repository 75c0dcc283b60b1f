// The ring around the control that has the keyboard.
import QtQuick 2.15

Rectangle {
    // The item that it surrounds.
    property Item item: parent

    anchors { fill: item; margins: -3 }
    visible: item !== null && item.activeFocus
    radius: Theme.radius + 3
    color: "transparent"
    border { color: Theme.accent; width: 2 }
}
