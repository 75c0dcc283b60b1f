// A cockpit: camera, map, driving, emergency stop, a plot, and the states of one robot.
import QtQuick 2.15
import QtQuick.Layouts 1.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    id: window
    width: 1280 * Theme.size; height: 752 * Theme.size
    visible: true
    title: "Cockpit"
    color: Theme.background
    Component.onCompleted: Ros2.init("cockpit")

    // On small screens, what is needed to drive comes first.
    readonly property bool low: height < 700 * Theme.size

    // All that drives goes through this: it stops when a hand leaves, or the window.
    TwistCommand {
        id: drive
        topic: "cmd_vel"
        maxSpeed: 0.5 // m/s
        maxTurn: 1.0 // rad/s
        obstacle: stop.blocks ? "emergency stop" : ""
    }

    RowLayout {
        anchors { fill: parent; margins: Theme.gap }
        spacing: Theme.gap

        ColumnLayout {
            spacing: Theme.gap

            CameraView {
                Layout.fillWidth: true
                Layout.fillHeight: true
                Layout.preferredHeight: 3
            }
            RowLayout {
                Layout.fillHeight: true
                Layout.preferredHeight: 2
                spacing: Theme.gap

                MapView {
                    Layout.fillWidth: true
                    Layout.fillHeight: true
                    Layout.preferredWidth: 1
                }
                Plot {
                    Layout.fillWidth: true
                    Layout.fillHeight: true
                    Layout.preferredWidth: 1
                    paths: ["/odom:twist.twist.linear.x", "/odom:twist.twist.angular.z"]
                }
            }
        }
        ColumnLayout {
            Layout.fillWidth: false
            Layout.preferredWidth: 260 * Theme.size
            spacing: Theme.gap

            EmergencyStop {
                id: stop
                Layout.fillWidth: true
                Layout.preferredHeight: 150 * Theme.size
                topic: "emergency_stop"
            }
            Battery { Layout.fillWidth: true }
            Speed { Layout.fillWidth: true; command: drive; visible: !window.low }
            DiagnosticsView {
                visible: !window.low
                Layout.fillWidth: true
                Layout.fillHeight: true
            }
            DriveKeys {
                Layout.alignment: Qt.AlignHCenter
                command: drive
                keycaps: !window.low // the keys work all the same
            }
            DriveStick {
                Layout.alignment: Qt.AlignHCenter
                command: drive
            }
        }
    }
}
