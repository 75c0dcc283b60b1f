import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 420 * Theme.size; height: 240 * Theme.size
    visible: true
    title: "DiagnosticsView"
    color: Theme.background
    Component.onCompleted: Ros2.init("diagnostics_view")

    DiagnosticsView {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/diagnostics"
    }
}
