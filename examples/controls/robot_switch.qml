import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 320 * Theme.size; height: 250 * Theme.size
    visible: true
    title: "RobotSwitch"
    color: Theme.background
    Component.onCompleted: Ros2.init("robot_switch")

    TwistCommand {
        id: drive
        ns: robots.current
    }
    Column {
        anchors { fill: parent; margins: Theme.gap }
        spacing: Theme.gap

        RobotSwitch {
            id: robots
            width: parent.width
            namespaces: ["/", "/anna", "/bert"]
            command: drive
        }
        Battery {
            width: parent.width
            ns: robots.current
        }
    }
}
