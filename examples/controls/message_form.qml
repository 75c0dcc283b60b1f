import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 460; height: 560
    visible: true
    title: "Message form"
    color: Theme.background
    Component.onCompleted: Ros2.init("message_form")

    MessageForm {
        id: form
        anchors { fill: parent; margins: Theme.gap; bottomMargin: Theme.touch + 2 * Theme.gap }
        type: "geometry_msgs/msg/PoseStamped"
    }
    ThemeButton {
        anchors { left: parent.left; bottom: parent.bottom; margins: Theme.gap }
        text: "Print"
        enabled: form.valid
        onClicked: console.log(JSON.stringify(form.message()))
    }
}
