// Mission, behaviours, settings.
import QtQuick 2.15

Panel {
    id: panel
    property bool live
    property int current: 0
    readonly property var names: ["Mission", "Behaviours", "Settings"]

    Row {
        y: -18
        width: parent.width
        spacing: 4
        Repeater {
            model: panel.names
            Push {
                objectName: "tab " + modelData
                width: (panel.width - 24) / 3; height: 24
                text: modelData
                checked: index === panel.current
                onClicked: panel.current = index
            }
        }
    }
    Item {
        anchors { fill: parent; topMargin: 14 }
        Mission { live: panel.live; anchors.fill: parent; visible: panel.current === 0 }
        Behaviours { live: panel.live; anchors.fill: parent; visible: panel.current === 1 }
        Settings { live: panel.live; anchors.fill: parent; visible: panel.current === 2 }
    }
}
