import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 340 * Theme.size; height: 220 * Theme.size
    visible: true
    title: "ActionPanel"
    color: Theme.background
    Component.onCompleted: Ros2.init("action_panel")

    ActionPanel {
        id: panel
        anchors { fill: parent; margins: Theme.gap }
        action: "/turn"
        title: "Turn to a heading (rad)"
        onReadyChanged: if (ready) send({ theta: 3 })
    }
}
