// A button over a map; a part of the maps.
import QtQuick 2.15

ThemeButton {
    id: button

    implicitHeight: Theme.touch * 0.8

    Rectangle {
        anchors.fill: parent
        z: -2
        radius: Theme.radius
        color: Theme.shade
    }
}
