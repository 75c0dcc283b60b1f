// A fleet: the battery of each robot; camera, driving and stop of the one that is selected.
import QtQuick 2.15
import QtQuick.Layouts 1.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    id: window
    width: 1200 * Theme.size; height: 720 * Theme.size
    visible: true
    title: "Fleet"
    color: Theme.background
    Component.onCompleted: Ros2.init("fleet")

    // Selecting another robot halts this one first.
    TwistCommand {
        id: drive
        ns: robots.current
        maxSpeed: 0.5 // m/s
        maxTurn: 1.0 // rad/s
        obstacle: stop.blocks ? "emergency stop" : ""
    }

    RowLayout {
        anchors { fill: parent; margins: Theme.gap }
        spacing: Theme.gap

        ColumnLayout {
            Layout.fillWidth: false
            Layout.preferredWidth: 280 * Theme.size
            spacing: Theme.gap

            RobotSwitch {
                id: robots
                Layout.fillWidth: true
                command: drive
                // Without names, the robots are found by their cmd_vel:
                // namespaces: ["/anna", "/bert"]
            }
            Repeater {
                model: robots.found
                Battery {
                    Layout.fillWidth: true
                    title: modelData.ns === "/" ? "Battery" : modelData.ns
                    ns: modelData.ns
                }
            }
            Item { Layout.fillHeight: true }
        }
        ColumnLayout {
            spacing: Theme.gap

            CameraView {
                Layout.fillWidth: true
                Layout.fillHeight: true
                ns: robots.current
            }
            RowLayout {
                spacing: Theme.gap

                EmergencyStop {
                    id: stop
                    ns: robots.current
                    topic: "emergency_stop"
                }
                Speed {
                    Layout.preferredWidth: 200 * Theme.size
                    visible: window.width >= 1000 * Theme.size
                    ns: robots.current
                    command: drive
                }
                Item { Layout.fillWidth: true }
                DriveKeys { command: drive }
                DriveStick { command: drive }
            }
        }
    }
}
