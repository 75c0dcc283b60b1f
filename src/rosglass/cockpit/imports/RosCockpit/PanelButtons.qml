// The buttons of a panel, on its title or its tab: they exist while the pointer or the keyboard is there.
import QtQuick 2.15
import RosControls 1.0

Loader {
    id: buttons

    property Item panel: null
    property bool hovered: false

    active: panel !== null && (hovered || panel.current_)
    width: active ? implicitWidth : 0
    sourceComponent: Row {
        PanelButton {
            objectName: "detach"
            sign: buttons.panel.detached ? "back" : "detach"
            name: buttons.panel.detached ? qsTr("Put the panel back") : qsTr("Show the panel in a window of its own")
            onClicked: buttons.panel.toggleDetached()
        }
        PanelButton {
            objectName: "maximize"
            visible: !buttons.panel.detached
            sign: buttons.panel.isMaximized_ ? "restore" : "maximize"
            name: buttons.panel.isMaximized_ ? qsTr("Restore the panel (F11)") : qsTr("Maximise the panel (F11)")
            onClicked: buttons.panel.toggleMaximized()
        }
        PanelButton {
            objectName: "menu"
            sign: "menu"
            name: qsTr("Menu of the panel (Shift+F10)")
            onClicked: buttons.panel.openMenu()
        }
    }
}
