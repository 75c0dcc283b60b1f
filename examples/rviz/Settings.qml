// Settings of the robot, as it reports them.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0

LiveFrame {
    id: settings
    property bool live
    readonly property bool lit: !lamp.stale && lamp.message.data

    title: "Settings"
    stale: !live
    // ROS 1 keeps parameters on the master: they exist without the robot.
    problem: live ? "" : "ROBOT SILENT"

    ParameterForm {
        objectName: "speed"
        anchors { left: parent.left; right: parent.right; top: parent.top; bottom: flashlight.top }
        framed: false; note: ""
        nodeName: "/robot"; filter: "max_speed"
        ranges: ({max_speed: [0.1, 1.2]})
        editable: settings.live
    }
    LiveTopic { id: lamp; topic: "/flashlight/state"; types: ["std_msgs/msg/Bool"]; timeout: 2000 }
    ServiceButton {
        id: flashlight
        objectName: "flashlight"
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        text: lamp.stale ? "Flashlight: unknown" : settings.lit ? "Flashlight is on" : "Flashlight is off"
        service: "/flashlight/set"; request: ({data: !settings.lit}); timeout: 2000
        tint: settings.lit ? Theme.warn : Theme.accent
    }
}
