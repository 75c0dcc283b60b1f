// One of several cameras.
import QtQuick 2.15
import QtQuick.Layouts 1.15
import RosControls 1.0

Item {
    id: panel
    property var cameras: [
        {name: "Front", topic: "/camera/image_raw"}, {name: "Rear", topic: "/rear_camera/image_raw"},
        {name: "Left", topic: "/left_camera/image_raw"}, {name: "Right", topic: "/right_camera/image_raw"},
        {name: "Thermal", topic: "/thermal_camera/image_raw"}
    ]
    property int selected: 0

    CameraView {
        anchors { left: parent.left; right: parent.right; top: parent.top; bottom: choice.top; bottomMargin: Theme.gap / 2 }
        topic: panel.cameras[panel.selected].topic
        title: panel.cameras[panel.selected].name + " camera"
        transport: "raw"
        timeout: 1000
        tools: false
    }
    RowLayout {
        id: choice
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        spacing: Theme.gap / 2
        Repeater {
            model: panel.cameras
            ThemeButton {
                objectName: "camera " + modelData.name
                Layout.fillWidth: true
                text: modelData.name
                selected: index === panel.selected
                onClicked: panel.selected = index
            }
        }
    }
}
