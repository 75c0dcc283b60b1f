// The robot's attitude, from behind and from the side, with the positions of its flippers.
import QtQuick 2.15
import Ros 1.0

Panel {
    id: panel
    title: "Posture"
    stale: imu.stale || joints.stale

    // Radians; roll positive with the left side up, pitch positive with the nose down (REP 103).
    property real roll: 0
    property real pitch: 0
    property var angles: ({})
    readonly property bool steep: Math.max(Math.abs(roll), Math.abs(pitch)) > 0.26

    function degrees(angle) { return (Math.round(angle * 180 / Math.PI) + 0) + "°" }

    Subscriber {
        id: imu
        topic: "/imu"; messageType: "sensor_msgs/Imu"; timeout: 1000
        onNewMessage: function (message) {
            var q = message.orientation
            panel.roll = Math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x * q.x + q.y * q.y))
            panel.pitch = Math.asin(Math.max(-1, Math.min(1, 2 * (q.w * q.y - q.z * q.x))))
        }
    }
    Subscriber {
        id: joints
        topic: "/joint_states"; messageType: "sensor_msgs/JointState"; timeout: 1000
        onNewMessage: function (message) {
            var found = {}
            for (var i = 0; i < message.name.length; ++i)
                found[message.name[i]] = message.position[i]
            panel.angles = found
        }
    }

    // Seen from the right side, nose to the right; its angle is positive upwards.
    component Flipper: Item {
        id: flipper
        property real angle: 0
        property bool front: true
        x: front ? 24 : -24
        transform: Scale { xScale: flipper.front ? 1 : -1 }
        Rectangle {
            x: -5; y: -5
            width: 36; height: 10; radius: 5
            color: "#9fb2c2"
            border.color: "#dbe7f0"
            transform: Rotation { origin.x: 5; origin.y: 5; angle: -flipper.angle * 180 / Math.PI }
        }
    }
    component View: Item {
        property real lean: 0
        property string label
        width: parent.width / 2; height: parent.height
        default property alias content: body.data
        Rectangle { anchors.centerIn: parent; width: parent.width - 12; height: 1; color: Theme.edge }
        Item { id: body; x: parent.width / 2; y: parent.height / 2; rotation: lean * 180 / Math.PI }
        Text {
            anchors { horizontalCenter: parent.horizontalCenter; bottom: parent.bottom }
            textFormat: Text.PlainText
            text: label
            color: panel.steep ? Theme.warn : Theme.dim
            font.pixelSize: 10
        }
    }

    Row {
        anchors.fill: parent
        View {
            lean: panel.roll
            label: "roll " + panel.degrees(panel.roll)
            Rectangle { x: -24; y: -12; width: 48; height: 17; radius: 3; color: "#d97a2b" }
            Rectangle { x: -2; y: -34; width: 4; height: 22; color: "#5a6d7d" }
            Rectangle { x: -9; y: -40; width: 18; height: 9; radius: 3; color: "#9fb2c2" }
            Rectangle { x: -36; y: -10; width: 13; height: 24; radius: 4; color: "#3a4a59" }
            Rectangle { x: 23; y: -10; width: 13; height: 24; radius: 4; color: "#3a4a59" }
        }
        View {
            lean: panel.pitch
            label: "pitch " + panel.degrees(-panel.pitch)
            Rectangle { x: -22; y: -20; width: 42; height: 12; radius: 3; color: "#d97a2b" }
            Rectangle { x: -34; y: -10; width: 68; height: 20; radius: 10; color: "#2a3743"; border.color: "#5a6d7d" }
            Flipper { angle: panel.angles.flipper_front_right || 0; opacity: 0.5 }
            Flipper { angle: panel.angles.flipper_front_left || 0 }
            Flipper { front: false; angle: panel.angles.flipper_rear_right || 0; opacity: 0.5 }
            Flipper { front: false; angle: panel.angles.flipper_rear_left || 0 }
        }
    }
}
