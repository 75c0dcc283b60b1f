// The position of RViz's camera, and whether it follows the robot.
import QtQuick 2.15
import RosControls 1.0

LiveFrame {
    id: panel
    property bool live
    property string failure

    title: "View"
    // A silent robot is not followed: RViz keeps showing its last position.
    problem: !live || failure || rviz.view.problem ? "NO ROBOT" : ""
    note: rviz.view.trackedFrame ? "following" : ""
    contentHeight: grid.height

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
    Grid {
        id: grid
        width: parent.width
        columns: 3
        spacing: Theme.gap / 2
        component Choice: ThemeButton { width: (grid.width - 2 * grid.spacing) / 3 }
        Choice { text: "Behind"; onClicked: look([-3.0, 0, 2.5]) }
        Choice { text: "Above"; onClicked: look([-0.4, 0, 7]) }
        Choice { text: "Front"; onClicked: look([3.2, 0, 1.4]) }
        Choice {
            text: "2D"
            selected: rviz.view.mode === rviz.view.MODE_2D
            onClicked: rviz.view.setMode(rviz.view.MODE_2D)
        }
        Choice {
            text: "3D"
            selected: rviz.view.mode === rviz.view.MODE_3D
            onClicked: rviz.view.setMode(rviz.view.MODE_3D)
        }
        Choice {
            text: "Follow"
            selected: rviz.view.trackedFrame !== ""
            onClicked: {
                panel.failure = ""
                try {
                    rviz.view.track(selected ? "" : "base_link")
                } catch (error) {
                    panel.failure = error.message
                }
            }
        }
    }
}
