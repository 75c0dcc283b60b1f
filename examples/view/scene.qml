// A window with a 3D view of the robot; scene.py adds displays to it.
//   python examples/view/scene.py zenoh://127.0.0.1:7447
import QtQuick
import QtQuick.Controls
import Ros2 1.0
import RosScene 1.0

ApplicationWindow {
    width: 800
    height: 600
    visible: true
    title: "Robot"
    Component.onCompleted: Ros2.init("robot_view")

    SceneView {
        id: view
        objectName: "view"
        anchors.fill: parent
        focus: true // Keys select tools.
        fixedFrame: "map"
        GridDisplay {}
        RobotModelDisplay {}
    }
    Label {
        anchors.centerIn: parent
        width: Math.min(implicitWidth, parent.width - 40)
        visible: text !== ""
        text: view.problem
        textFormat: Text.PlainText
        wrapMode: Text.Wrap
        maximumLineCount: 8
        elide: Text.ElideRight
        color: "white"
        background: Rectangle { color: "#c62818" }
    }
}
