import QtQuick 2.15
import Ros2 1.0

// What a VideoOutput shows where Qt's software renderer draws, which leaves video out. It is below
// the VideoOutput's own children.
ImageItem {
    // Qt 6 turns VideoOutputs clockwise, Qt 5 the other way.
    property bool clockwise: true
    readonly property int turn: parent ? parent.orientation : 0

    z: -1
    anchors.centerIn: parent
    width: parent ? turn % 180 ? parent.height : parent.width : 0
    height: parent ? turn % 180 ? parent.width : parent.height : 0
    rotation: clockwise ? turn : -turn
    fillMode: parent ? parent.fillMode : ImageItem.PreserveAspectFit
}
