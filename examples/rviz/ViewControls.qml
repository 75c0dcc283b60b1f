// The position of RViz's camera, and whether it follows the robot.
import QtQuick 2.15
import QtQuick.Layouts 1.15

Panel {
    id: panel
    title: "View"
    property bool live
    property string failure
    // A silent robot is not followed: RViz keeps showing its last position.
    stale: !live
    dims: false
    alarming: note === "NO ROBOT"
    note: failure || rviz.view.problem ? "NO ROBOT" : rviz.view.trackedFrame ? "following" : ""

    function look(eye) {
        failure = ""
        try {
            rviz.view.track("base_link")
            rviz.view.moveEyeAndFocus(eye, [0, 0, 0.2], {frame: "base_link"})
        } catch (error) {
            panel.failure = error.message
        }
    }

    // Behind the robot, as soon as it appears.
    Timer {
        interval: 500; repeat: true; running: true
        onTriggered: {
            look([-3.0, 0, 2.5])
            running = panel.failure !== ""
        }
    }
    GridLayout {
        anchors.fill: parent
        columns: 3
        rowSpacing: 5; columnSpacing: 5
        Push { Layout.fillWidth: true; Layout.fillHeight: true; text: "Behind"; onClicked: look([-3.0, 0, 2.5]) }
        Push { Layout.fillWidth: true; Layout.fillHeight: true; text: "Above"; onClicked: look([-0.4, 0, 7]) }
        Push { Layout.fillWidth: true; Layout.fillHeight: true; text: "Front"; onClicked: look([3.2, 0, 1.4]) }
        Push {
            Layout.fillWidth: true; Layout.fillHeight: true
            text: "2D"
            checked: rviz.view.mode === rviz.view.MODE_2D
            onClicked: rviz.view.setMode(rviz.view.MODE_2D)
        }
        Push {
            Layout.fillWidth: true; Layout.fillHeight: true
            text: "3D"
            checked: rviz.view.mode === rviz.view.MODE_3D
            onClicked: rviz.view.setMode(rviz.view.MODE_3D)
        }
        Push {
            Layout.fillWidth: true; Layout.fillHeight: true
            text: "Follow"
            checked: rviz.view.trackedFrame !== ""
            onClicked: {
                panel.failure = ""
                try {
                    rviz.view.track(checked ? "" : "base_link")
                } catch (error) {
                    panel.failure = error.message
                }
            }
        }
    }
}
