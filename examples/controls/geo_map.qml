import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 480 * Theme.size; height: 360 * Theme.size
    visible: true
    title: "GeoMap"
    color: Theme.background
    Component.onCompleted: Ros2.init("geo_map")

    GeoMap {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/fix"
        // A folder with z/x/y.png, or an MBTiles file; without one, degrees are shown.
        tiles: ""
    }
}
