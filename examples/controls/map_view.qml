import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 560 * Theme.size; height: 420 * Theme.size
    visible: true
    title: "MapView"
    color: Theme.background
    Component.onCompleted: Ros2.init("map_view")

    MapView {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/map"
    }
}
