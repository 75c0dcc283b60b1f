import QtQuick 2.15
import QtQuick.Controls 2.15

// Something of everything that an interface over RViz can have.
Item {
    id: root

    property var speed: rviz.registerFloatProperty("Speed", 1.5, "m/s", { min: 0, max: 2 })
    property var mode: rviz.registerEnumProperty("Mode", "a", ["a", "b"])
    property var tracker: rviz.createPositionTracker(1, 2, 0)
    property var view: rviz.view
    property string frame: rviz.fixedFrame

    Component.onCompleted: rviz.config = { opened: true }

    Rectangle {
        x: 40; y: 40
        width: 240; height: 120
        color: "#0080ff"
        Text { text: root.speed.value + " " + root.frame + " " + rviz.statusText }
    }

    Column {
        x: 40; y: 180
        Repeater {
            model: rviz.displays
            Text { text: modelData.name }
        }
        Repeater {
            model: rviz.toolManager.tools
            Button { text: modelData.name }
        }
    }

    ComboBox { x: 300; y: 40; model: 20 }
    Popup {
        x: 300; y: 100
        visible: true
        Label { text: "popup" }
    }
}
