import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 320 * Theme.size; height: 130 * Theme.size
    visible: true
    title: "ServiceButton"
    color: Theme.background
    Component.onCompleted: Ros2.init("service_button")

    Column {
        anchors { fill: parent; margins: Theme.gap }
        spacing: Theme.gap

        ServiceButton {
            width: parent.width
            service: "/flashlight/set"
            request: ({ data: true })
            text: "Light on"
            Component.onCompleted: call()
        }
        ServiceButton {
            width: parent.width
            service: "/flashlight/set"
            request: ({ data: false })
            text: "Light off (hold)"
            hold: true
        }
    }
}
