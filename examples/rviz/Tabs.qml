// Mission, behaviours, settings.
import QtQuick 2.15
import QtQuick.Layouts 1.15
import RosControls 1.0

Item {
    id: tabs
    property bool live
    property int current: 0
    readonly property var names: ["Mission", "Behaviours", "Settings"]

    RowLayout {
        id: bar
        width: parent.width
        spacing: Theme.gap / 2
        Repeater {
            model: tabs.names
            ThemeButton {
                objectName: "tab " + modelData
                Layout.fillWidth: true
                text: modelData
                selected: index === tabs.current
                onClicked: tabs.current = index
            }
        }
    }
    Item {
        anchors { fill: parent; topMargin: bar.height + Theme.gap / 2 }
        Mission { live: tabs.live; anchors.fill: parent; visible: tabs.current === 0 }
        Behaviours { live: tabs.live; anchors.fill: parent; visible: tabs.current === 1 }
        Settings { live: tabs.live; anchors.fill: parent; visible: tabs.current === 2 }
    }
}
