// A kiosk: the state of a robot on a screen that visitors touch. Nothing here commands it.
import QtQuick 2.15
import QtQuick.Layouts 1.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 1080 * Theme.automaticScale; height: 720 * Theme.automaticScale
    visible: true
    title: "Our robot"
    color: Theme.background
    Component.onCompleted: {
        // Large and bright; rosglass run --kiosk fills the screen and cannot be closed.
        Theme.mode = "bright"
        Theme.scale = 1.6 * Theme.automaticScale
        Ros2.init("kiosk")
    }

    GridLayout {
        anchors { fill: parent; margins: Theme.gap }
        columns: 3
        columnSpacing: Theme.gap
        rowSpacing: Theme.gap

        MapView {
            Layout.columnSpan: 3
            Layout.fillWidth: true
            Layout.fillHeight: true
            tools: false
            follow: true
        }
        Battery { Layout.fillWidth: true; Layout.preferredHeight: 110 * Theme.size }
        Speed { Layout.fillWidth: true; Layout.preferredHeight: 110 * Theme.size }
        Compass { Layout.fillWidth: true; Layout.preferredHeight: 110 * Theme.size; note: "" }
    }
}
