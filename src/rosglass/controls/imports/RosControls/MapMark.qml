// An arrow at a pose on a map; a part of the maps.
import QtQuick 2.15
import RosControls 1.0

MapArrow {
    id: mark

    // The MapCamera that sees it.
    property var camera: null
    // {x, y, yaw} in metres and radians.
    property var pose: null
    property string label
    // Whether it has no heading.
    property bool isDot: false

    readonly property point at_: camera && camera.scale && camera.rotation < 1e9 && camera.width + camera.height + camera.centerX + camera.centerY < 1e12 && pose ? camera.toScreen(pose.x, pose.y) : Qt.point(-100, -100)

    width: 26 * Theme.size
    height: width
    x: at_.x - width / 2
    y: at_.y - height / 2
    rotation: camera && pose ? -(pose.yaw + camera.rotation) * 180 / Math.PI : 0
    edgeColor: Theme.panel
    round: isDot

    Item {
        anchors.centerIn: parent
        rotation: -mark.rotation

        ThemeText {
            x: mark.width / 2
            y: -mark.height / 2 - height / 2
            text: mark.label
            font.weight: Font.Bold
            style: Text.Outline
            styleColor: Theme.panel
        }
    }
}
