// RViz's tools: the highlighted one receives the mouse in the 3D view.
import QtQuick 2.15
import RosControls 1.0

Column {
    spacing: Theme.gap / 2
    Repeater {
        model: rviz.toolManager.tools
        ThemeButton {
            objectName: "tool " + modelData.name
            width: 150 * Theme.size
            leftPadding: 36 * Theme.size
            text: modelData.name
            selected: modelData.isSelected
            onClicked: rviz.toolManager.currentTool = modelData
            Component.onCompleted: contentItem.horizontalAlignment = Text.AlignLeft
            Rectangle {
                z: -1
                anchors.fill: parent
                radius: Theme.radius
                color: Theme.panel
            }
            Image {
                x: Theme.gap; anchors.verticalCenter: parent.verticalCenter
                source: modelData.iconSource
                sourceSize { width: 20 * Theme.size; height: 20 * Theme.size }
            }
        }
    }
}
