// The robot from the side with its flippers as they are, and sliders for where they should go.
import QtQuick
import Ros2 1.0

Panel {
    id: panel
    title: "Flippers"
    fresh: joints.fresh
    age: joints.age
    note: joints.received ? degrees(front) + " / " + degrees(rear) : ""

    // Radians, positive up; the mean of left and right.
    property real front: 0
    property real rear: 0
    readonly property real reach: 1.2
    // Where the operator wants them; NaN for "as they are".
    property real wantedFront: NaN
    property real wantedRear: NaN
    property var publisher: null
    Component.onCompleted: publisher = Ros2.createPublisher("/flipper_controller/commands",
                                                            "std_msgs/msg/Float64MultiArray", Ros2.CommandQoS())

    // A restarted robot does not have the last command.
    onFreshChanged: if (!fresh) wantedFront = wantedRear = NaN

    function degrees(angle) { return (angle * 180 / Math.PI).toFixed(0) + "°" }

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

    property Feed joints: Feed {
        topic: "/joint_states"
        messageType: "sensor_msgs/msg/JointState"
        onArrived: function (message) {
            const angles = {}
            for (let i = 0; i < message.name.length; ++i)
                angles[message.name[i]] = message.position[i]
            panel.front = (angles.flipper_front_left + angles.flipper_front_right) / 2
            panel.rear = (angles.flipper_rear_left + angles.flipper_rear_right) / 2
        }
    }
    // At most ten commands a second, however fast the slider moves.
    property Timer sender: Timer {
        interval: 100
        onTriggered: {
            panel.publisher.publish({ data: [panel.wantedFront, panel.wantedFront,
                                             panel.wantedRear, panel.wantedRear] })
        }
    }

    component Outline: Rectangle {
        id: outline
        property real angle
        x: -7; y: -7
        width: 56; height: 14; radius: 7
        transform: Rotation { origin.x: 7; origin.y: 7; angle: -outline.angle * 180 / Math.PI }
    }
    component Flipper: Item {
        id: flipper
        property real angle
        property real wanted: NaN
        width: 0
        height: 0
        Outline {
            visible: !isNaN(flipper.wanted)
            angle: isNaN(flipper.wanted) ? 0 : flipper.wanted
            color: "transparent"
            border { color: Theme.accent; width: 1 }
        }
        Outline {
            angle: flipper.angle
            color: "#9fb2c2"
            border { color: "#dbe7f0"; width: 1 }
        }
    }
    component Slider: Item {
        id: slider
        property real value
        property real wanted
        signal moved(real value)
        width: 34
        Rectangle {
            anchors.horizontalCenter: parent.horizontalCenter
            width: 4
            height: parent.height
            radius: 2
            color: Theme.faint
        }
        Rectangle {
            anchors.horizontalCenter: parent.horizontalCenter
            y: (1 - (slider.value / panel.reach + 1) / 2) * parent.height - 1
            width: 16; height: 2
            color: Theme.text
        }
        Rectangle {
            anchors.horizontalCenter: parent.horizontalCenter
            readonly property real shown: isNaN(slider.wanted) ? slider.value : slider.wanted
            y: (1 - (shown / panel.reach + 1) / 2) * parent.height - height / 2
            width: 26; height: 12; radius: 6
            color: Theme.accent
        }
        MultiPointTouchArea {
            anchors.fill: parent
            maximumTouchPoints: 1
            function follow(points) {
                slider.moved((1 - 2 * points[0].y / height) * panel.reach)
            }
            onPressed: function (points) { follow(points) }
            onUpdated: function (points) { follow(points) }
        }
    }

    Slider {
        objectName: "rearSlider"
        anchors { left: parent.left; top: parent.top; bottom: parent.bottom; margins: 6 }
        value: panel.rear
        wanted: panel.wantedRear
        onMoved: function (value) { panel.command(isNaN(panel.wantedFront) ? panel.front : panel.wantedFront, value) }
    }
    Slider {
        objectName: "frontSlider"
        anchors { right: parent.right; top: parent.top; bottom: parent.bottom; margins: 6 }
        value: panel.front
        wanted: panel.wantedFront
        onMoved: function (value) { panel.command(value, isNaN(panel.wantedRear) ? panel.rear : panel.wantedRear) }
    }
    Item {
        anchors.centerIn: parent
        // With both flippers up or down it is 100 high, stretched out 170 wide, beside the sliders.
        scale: Math.max(0, Math.min(1, parent.height / 100, (parent.width - 80) / 170))
        Rectangle {
            x: -44; y: -12; width: 88; height: 24; radius: 12
            color: "#2a3743"
            border { color: "#5a6d7d"; width: 2 }
        }
        Rectangle {
            x: -30; y: -26; width: 52; height: 15; radius: 4
            color: "#d97a2b"
        }
        Rectangle {
            x: 6; y: -40; width: 4; height: 16
            color: "#5a6d7d"
        }
        Rectangle {
            x: 2; y: -46; width: 18; height: 9; radius: 3
            color: "#9fb2c2"
        }
        Flipper { x: 32; angle: panel.front; wanted: panel.wantedFront }
        Item {
            x: -32
            transform: Scale { xScale: -1 }
            Flipper { angle: panel.rear; wanted: panel.wantedRear }
        }
    }
}
