// An operator's screen: camera, map, plot, battery, service button, emergency stop, stick and keys.
import QtQuick 2.15
import QtQuick.Layouts 1.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 1200 * Theme.size; height: 720 * Theme.size; visible: true; color: Theme.background
    title: "Operator screen"
    Component.onCompleted: Ros2.init("operator_screen")

    TwistCommand {
        id: drive; maxSpeed: 0.5; maxTurn: 1.0
        obstacle: stop.blocks ? "emergency stop" : camera.live ? "" : "no live image"
    }
    RowLayout {
        anchors { fill: parent; margins: Theme.gap }
        GridLayout {
            columns: 2
            CameraView {
                id: camera; Layout.fillWidth: true; Layout.fillHeight: true; Layout.preferredHeight: 3; Layout.columnSpan: 2
            }
            MapView { Layout.fillWidth: true; Layout.fillHeight: true; Layout.preferredHeight: 2; Layout.preferredWidth: 1 }
            Plot {
                Layout.fillWidth: true; Layout.fillHeight: true; Layout.preferredHeight: 2; Layout.preferredWidth: 1
                paths: ["/odom:twist.twist.linear.x"]
            }
        }
        ColumnLayout {
            Layout.maximumWidth: 240 * Theme.size
            EmergencyStop { id: stop; Layout.fillWidth: true; Layout.fillHeight: true }
            Battery { Layout.fillWidth: true }
            ServiceButton { Layout.fillWidth: true; service: "/flashlight/set"; request: ({ data: true }); text: "Light" }
            DriveKeys { command: drive; Layout.alignment: Qt.AlignHCenter }
            DriveStick { command: drive; Layout.alignment: Qt.AlignHCenter }
        }
    }
}
