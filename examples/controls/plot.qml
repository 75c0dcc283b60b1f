import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 640 * Theme.size; height: 360 * Theme.size
    visible: true
    title: "Plot"
    color: Theme.background
    Component.onCompleted: Ros2.init("plot")

    Plot {
        anchors { fill: parent; margins: Theme.gap }
        window: 4
        paths: ["/scan:ranges[0]", "/scan:ranges[90]", "/scan:ranges[180]"]
        PlotSeries { path: "/battery_state:voltage"; label: "battery"; axis: "right" }
    }
}
