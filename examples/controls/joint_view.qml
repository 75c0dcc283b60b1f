import QtQuick 2.15
import QtQuick.Window 2.15
import Ros2 1.0
import RosControls 1.0

Window {
    width: 340 * Theme.size; height: 220 * Theme.size
    visible: true
    title: "JointView"
    color: Theme.background
    Component.onCompleted: Ros2.init("joint_view")

    JointView {
        anchors { fill: parent; margins: Theme.gap }
        topic: "/joint_states"
        // Without it, the description is received on /robot_description.
        description: "<robot name='r'>" + ["front_left", "front_right", "rear_left", "rear_right"].map(function(name) {
            return "<joint name='flipper_" + name + "' type='revolute'>"
                + "<limit lower='-1.5' upper='1.5' effort='40' velocity='1'/></joint>"
        }).join("") + "</robot>"
    }
}
