// A small button on the title of a panel; its sign is drawn, as not every font has one.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import RosControls 1.0

T.AbstractButton {
    id: button

    // "maximize", "restore", "detach", "back" or "menu".
    property string sign
    property string name

    readonly property color ink_: hovered || down || visualFocus ? Theme.text : Theme.dim
    readonly property real unit_: Math.max(1, Math.round(Theme.size))

    implicitWidth: Math.round(24 * Theme.size)
    implicitHeight: Math.round(24 * Theme.size)
    focusPolicy: Qt.NoFocus
    hoverEnabled: true
    Accessible.role: Accessible.Button
    Accessible.name: name
    Accessible.onPressAction: clicked()

    contentItem: Item {
        Item {
            anchors.centerIn: parent
            width: 10 * button.unit_
            height: width
            // The window behind, of "restore" and "detach".
            Rectangle {
                visible: button.sign === "restore" || button.sign === "detach" || button.sign === "back"
                x: button.sign === "back" ? 0 : 3 * button.unit_
                y: button.sign === "back" ? 3 * button.unit_ : 0
                width: 7 * button.unit_
                height: width
                color: "transparent"
                border { color: button.ink_; width: button.unit_ }
            }
            Rectangle {
                visible: button.sign !== "menu"
                x: button.sign === "back" ? 3 * button.unit_ : 0
                y: button.sign === "restore" || button.sign === "detach" ? 3 * button.unit_ : 0
                width: (button.sign === "maximize" ? 10 : 7) * button.unit_
                height: width
                // Solid: where the panel goes.
                color: button.sign === "detach" || button.sign === "back" ? button.ink_ : Theme.panel
                border { color: button.ink_; width: button.unit_ }
            }
            Repeater {
                model: button.sign === "menu" ? 3 : 0
                Rectangle {
                    x: 4 * button.unit_
                    y: 4 * index * button.unit_
                    width: 2 * button.unit_
                    height: width
                    color: button.ink_
                }
            }
        }
    }
    background: Rectangle {
        radius: Theme.radius / 2
        color: button.hovered || button.down ? Theme.track : "transparent"
    }
}
