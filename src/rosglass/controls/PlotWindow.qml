// The window of `rosglass plot`.
import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    id: window

    readonly property var options: JSON.parse(Qt.application.arguments[1])

    width: 960 * Theme.size; height: 540 * Theme.size
    visible: true
    title: qsTr("Plot of %1").arg(options.paths.join(", ").slice(0, 200))
    color: Theme.background
    Component.onCompleted: Ros2.init("rosglass_plot")

    Plot {
        id: plot
        anchors { fill: parent; margins: Theme.gap }
        paths: window.options.paths
        window: window.options.window
        history: window.options.history
        folder: window.options.folder
        title: qsTr("Plot")
        onSaved: function(file) { console.info(qsTr("%1 was written").arg(file)) }
        onSaveFailed: function(reason) { console.error(reason) }
    }
}
