// RViz's tools: the highlighted one receives the mouse in the 3D view.
import QtQuick 2.15

Column {
    spacing: 4
    Repeater {
        model: rviz.toolManager.tools
        Push {
            objectName: "tool " + modelData.name
            width: 118; height: 28
            leading: true
            text: modelData.name
            icon: modelData.iconSource
            checked: modelData.isSelected
            onClicked: rviz.toolManager.currentTool = modelData
        }
    }
}
