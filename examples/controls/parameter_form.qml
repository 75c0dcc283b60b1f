import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 440 * Theme.size; height: 260 * Theme.size
    visible: true
    title: "ParameterForm"
    color: Theme.background
    Component.onCompleted: Ros2.init("parameter_form")

    ParameterForm {
        anchors { fill: parent; margins: Theme.gap }
        nodeName: "/robot"
    }
}
