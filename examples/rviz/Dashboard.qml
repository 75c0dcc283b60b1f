// The paper's Figure 1: an operator station over RViz's 3D view.
//   rosglass rviz figure1.rviz --overlay Dashboard.qml --bare
// The same without RViz, for ROS 1 and ROS 2:
//   rosglass view figure1.rviz --overlay Dashboard.qml --kiosk
import QtQuick 2.15
import QtQuick.Layouts 1.15
import Ros2 1.0
import RosControls 1.0

Item {
    id: dashboard
    Component.onCompleted: Ros2.init("dashboard")

    // Dense on a small screen, larger on a large one.
    Binding { target: Theme; property: "scale"; value: Math.max(0.85, Math.min(2, dashboard.height / 940, dashboard.width / 1500)) }

    Contact { id: contact }
    Column {
        x: Theme.gap; y: Theme.gap
        spacing: Theme.gap
        Clock {}
        ToolButtons {}
    }
    ViewControls {
        anchors { right: parent.right; top: parent.top; margins: Theme.gap }
        width: 226 * Theme.size
        live: contact.live
    }
    Notices {
        contact: contact
        anchors { horizontalCenter: parent.horizontalCenter; top: parent.top; topMargin: Theme.gap }
    }

    Rectangle {
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        height: Math.max(Math.min(250, parent.height * 0.45), Math.min(parent.height / 3, 420))
        // Opaque: blending is slow without a graphics card.
        color: Theme.background

        RowLayout {
            anchors { fill: parent; margins: Theme.gap }
            spacing: Theme.gap

            EmergencyStop {
                objectName: "emergency stop"
                topic: "/emergency_stop"
                Layout.preferredWidth: 186 * Theme.size; Layout.fillHeight: true
            }
            // Beside panels there is room for what drives the robot, and one camera.
            ColumnLayout {
                visible: dashboard.width >= 1050 * Theme.size
                Layout.preferredWidth: 312 * Theme.size; Layout.fillWidth: false; Layout.fillHeight: true
                spacing: Theme.gap
                RowLayout {
                    Layout.fillWidth: true; Layout.fillHeight: true
                    spacing: Theme.gap
                    Posture { Layout.fillWidth: true; Layout.fillHeight: true }
                    Battery {
                        topic: "/battery_state"
                        Layout.preferredWidth: 136 * Theme.size; Layout.fillHeight: true
                    }
                }
                ModeSwitch {
                    objectName: "mode"
                    stateTopic: "/mode"; service: "/mode/%1"; stateTimeout: 2000
                    modes: ["autonomous", "supervised", "safe"]
                    Layout.fillWidth: true; Layout.preferredHeight: implicitHeight
                }
            }
            MultiCamera {
                Layout.fillWidth: true; Layout.preferredWidth: 300; Layout.fillHeight: true
                selected: 0
            }
            MultiCamera {
                visible: dashboard.width >= 1340 * Theme.size
                Layout.fillWidth: true; Layout.preferredWidth: 300; Layout.fillHeight: true
                selected: 1
            }
            Tabs { live: contact.live; Layout.preferredWidth: 296 * Theme.size; Layout.fillHeight: true }
        }
    }
}
