// The paper's Figure 1: an operator station over RViz's 3D view.
//   rosglass rviz figure1.rviz --overlay Dashboard.qml --bare
// The same without RViz, for ROS 1 and ROS 2:
//   rosglass view figure1.rviz --overlay Dashboard.qml --kiosk
import QtQuick 2.15
import QtQuick.Layouts 1.15
import Ros 1.0

Item {
    id: dashboard
    Component.onCompleted: Ros.init("dashboard")

    Contact { id: contact }
    Clock { x: Theme.gap; y: Theme.gap }
    ToolButtons { x: Theme.gap; y: 62 }
    Notices {
        contact: contact
        anchors { horizontalCenter: parent.horizontalCenter; top: parent.top; topMargin: Theme.gap }
    }

    Rectangle {
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        height: Math.max(Math.min(250, parent.height * 0.45), Math.min(parent.height / 3, 420))
        // Opaque: blending is slow without a graphics card.
        color: Theme.bar

        RowLayout {
            anchors { fill: parent; margins: Theme.gap }
            spacing: Theme.gap

            ColumnLayout {
                Layout.preferredWidth: 158; Layout.fillWidth: false; Layout.fillHeight: true
                spacing: Theme.gap
                ViewControls { live: contact.live; Layout.fillWidth: true; Layout.preferredHeight: 98 }
                EmergencyStop { Layout.fillWidth: true; Layout.fillHeight: true }
            }
            // Beside panels there is room for what drives the robot, and one camera.
            ColumnLayout {
                visible: dashboard.width >= 800
                Layout.preferredWidth: 216; Layout.fillWidth: false; Layout.fillHeight: true
                spacing: Theme.gap
                Posture { Layout.fillWidth: true; Layout.fillHeight: true }
                RowLayout {
                    Layout.fillWidth: true; Layout.fillHeight: false; Layout.preferredHeight: 106
                    spacing: Theme.gap
                    OperatingMode { Layout.fillWidth: true; Layout.fillHeight: true }
                    Battery { Layout.preferredWidth: 92; Layout.fillHeight: true }
                }
            }
            MultiCamera {
                Layout.fillWidth: true; Layout.preferredWidth: 300; Layout.fillHeight: true
                selected: 0
            }
            MultiCamera {
                visible: dashboard.width >= 1000
                Layout.fillWidth: true; Layout.preferredWidth: 300; Layout.fillHeight: true
                selected: 1
            }
            Tabs { live: contact.live; Layout.preferredWidth: 236; Layout.fillHeight: true }
        }
    }
}
