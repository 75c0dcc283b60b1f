import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 680 * Theme.size; height: 620 * Theme.size
    visible: true
    title: "RobotTiles"
    color: Theme.background
    Component.onCompleted: Ros2.init("robot_tiles")

    TwistCommand {
        id: drive
        ns: robots.selected
    }
    RobotTiles {
        id: robots
        anchors { left: parent.left; right: parent.right; top: parent.top; bottom: battery.top; margins: Theme.gap }
        command: drive
    }
    Battery {
        id: battery
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom; margins: Theme.gap }
        ns: robots.selected
    }
}
