// The robot from the side with its flippers as they are, and sliders for where they should go.
import QtQuick
import Ros2 1.0
import RosControls 1.0

LiveFrame {
    id: panel; title: "Flippers"; source: joints
    note: joints.message ? degrees(front) + " / " + degrees(rear) : ""

    // Radians, positive up; the mean of left and right.
    readonly property real front: mean("front")
    readonly property real rear: mean("rear")
    readonly property real reach: 1.2
    // Where the operator wants them; NaN for "as they are".
    property real wantedFront: NaN
    property real wantedRear: NaN
    property var publisher: null
    Component.onCompleted: publisher = Ros2.createPublisher("/flipper_controller/commands",
                                                            "std_msgs/msg/Float64MultiArray", Ros2.CommandQoS())

    // A restarted robot does not have the last command.
    onStaleChanged: if (stale) wantedFront = wantedRear = NaN

    function degrees(angle) { return (angle * 180 / Math.PI).toFixed(0) + "°" }

    function mean(which) {
        const names = joints.message ? joints.message.name.toArray() : []
        const angles = ["left", "right"].map((side) => joints.message
            ? joints.message.position.at(names.indexOf("flipper_" + which + "_" + side)) : 0)
        return (angles[0] + angles[1]) / 2
    }

    function command(front, rear) {
        wantedFront = Math.max(-reach, Math.min(reach, front))
        wantedRear = Math.max(-reach, Math.min(reach, rear))
        if (!sender.running)
            sender.start()
    }

    function nudge(front, rear) {
        command((isNaN(wantedFront) ? panel.front : wantedFront) + front,
                (isNaN(wantedRear) ? panel.rear : wantedRear) + rear)
    }

    LiveTopic {
        id: joints; topic: "/joint_states"; types: ["sensor_msgs/msg/JointState"]
        timeout: 700
    }
    // At most ten commands a second, however fast the slider moves.
    Timer {
        id: sender; interval: 100
        onTriggered: panel.publisher.publish({ data: [panel.wantedFront, panel.wantedFront,
                                                      panel.wantedRear, panel.wantedRear] })
    }

    component Flipper: Rectangle {
        id: flipper
        property real angle
        x: -7; y: -7; width: 56; height: 14; radius: 7; visible: !isNaN(angle)
        color: Theme.dim
        border { color: Theme.text; width: 1 }
        transform: Rotation { origin.x: 7; origin.y: 7; angle: isNaN(flipper.angle) ? 0 : -flipper.angle * 180 / Math.PI }
    }
    component Wanted: Flipper { color: "transparent"; border.color: Theme.accent }
    component Lever: ThemeSlider {
        property real angle
        property real wanted
        orientation: Qt.Vertical; from: -panel.reach; to: panel.reach
        value: isNaN(wanted) ? angle : wanted
        height: parent.height
    }
    Lever {
        objectName: "rearSlider"; name: "rear flippers"; angle: panel.rear
        wanted: panel.wantedRear
        onMoved: panel.command(isNaN(panel.wantedFront) ? panel.front : panel.wantedFront, value)
    }
    Lever {
        objectName: "frontSlider"; name: "front flippers"
        anchors.right: parent.right
        angle: panel.front; wanted: panel.wantedFront
        onMoved: panel.command(value, isNaN(panel.wantedRear) ? panel.rear : panel.wantedRear)
    }
    Item {
        anchors.centerIn: parent
        // With both flippers up or down it is 100 high, stretched out 170 wide, beside the sliders.
        scale: Math.max(0, Math.min(1, parent.height / 100, (parent.width - 80) / 170))
        Rectangle { x: -44; y: -12; width: 88; height: 24; radius: 12; color: Theme.faint; border { color: Theme.dim; width: 2 } }
        Rectangle { x: -30; y: -26; width: 52; height: 15; radius: 4; color: Theme.warn }
        Rectangle { x: 6; y: -46; width: 8; height: 22; radius: 3; color: Theme.dim }
        Item {
            x: 32
            Wanted { angle: panel.wantedFront }
            Flipper { angle: panel.front }
        }
        Item {
            x: -32
            transform: Scale { xScale: -1 }
            Wanted { angle: panel.wantedRear }
            Flipper { angle: panel.rear }
        }
    }
}
