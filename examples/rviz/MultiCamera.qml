// One of several cameras. An image that is not live is marked.
import QtQuick 2.15
import Ros 1.0

Panel {
    id: panel
    property var cameras: [
        {name: "Front", topic: "/camera/image_raw"}, {name: "Rear", topic: "/rear_camera/image_raw"},
        {name: "Left", topic: "/left_camera/image_raw"}, {name: "Right", topic: "/right_camera/image_raw"},
        {name: "Thermal", topic: "/thermal_camera/image_raw"}
    ]
    property int selected: 0
    title: cameras[selected].name + " camera"
    stale: camera.stale
    dims: false
    note: camera.framerate.toFixed(0) + " Hz   " + Math.max(0, camera.latency).toFixed(0) + " ms"

    ImageTransportSubscriber {
        id: camera
        topic: panel.cameras[panel.selected].topic
        defaultTransport: "raw"
        timeout: 1000
    }
    ImageItem {
        anchors { fill: parent; bottomMargin: choice.height + 5 }
        source: camera
    }
    Text {
        anchors { centerIn: parent; verticalCenterOffset: -choice.height / 2 }
        visible: camera.stale
        text: "NO IMAGE"
        color: Theme.bad
        font { pixelSize: 20; weight: Font.Black }
    }
    Flow {
        id: choice
        anchors { bottom: parent.bottom; horizontalCenter: parent.horizontalCenter }
        // In one row if there is room.
        width: Math.min(parent.width, 243)
        spacing: 3
        Repeater {
            model: panel.cameras
            Push {
                objectName: "camera " + modelData.name
                height: 21; size: 10
                text: modelData.name
                checked: index === panel.selected
                onClicked: panel.selected = index
            }
        }
    }
}
