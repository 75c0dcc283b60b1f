// The robot's attitude, from behind and from the side, with the positions of its flippers.
import QtQuick 2.15
import RosControls 1.0

LiveFrame {
    id: panel
    title: "Posture"
    source: imu.stale || !joints.stale ? imu : joints

    // Radians; roll positive with the left side up, pitch positive with the nose down (REP 103).
    property real roll: 0
    property real pitch: 0
    property var angles: ({})
    readonly property bool steep: Math.max(Math.abs(roll), Math.abs(pitch)) > 0.26

    function degrees(angle) { return (Math.round(angle * 180 / Math.PI) + 0) + "°" }

    LiveTopic {
        id: imu
        topic: "/imu"; types: ["sensor_msgs/msg/Imu"]; timeout: 1000
        onNewMessage: function (message) {
            var q = message.orientation
            panel.roll = Math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x * q.x + q.y * q.y))
            panel.pitch = Math.asin(Math.max(-1, Math.min(1, 2 * (q.w * q.y - q.z * q.x))))
        }
    }
    LiveTopic {
        id: joints
        topic: "/joint_states"; types: ["sensor_msgs/msg/JointState"]; timeout: 1000
        onNewMessage: function (message) {
            var found = {}
            for (var i = 0; i < message.name.length; ++i)
                found[message.name.at(i)] = message.position.at(i)
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
            color: Theme.dim
            border.color: Theme.text
            transform: Rotation { origin.x: 5; origin.y: 5; angle: -flipper.angle * 180 / Math.PI }
        }
    }
    component View: Item {
        property real lean: 0
        property string label
        default property alias content: turned.data
        width: parent.width; height: parent.height / 2
        // With flippers up it is 60 high, stretched out 120 wide, above the label.
        readonly property real fit: Math.max(0.3, Math.min(height / 72, width / 120, 2))
        Rectangle { y: parent.height * 0.6; width: parent.width; height: 1; color: Theme.edge }
        Item {
            id: turned
            x: parent.width / 2; y: parent.height * 0.6
            rotation: lean * 180 / Math.PI
            scale: parent.fit
        }
        ThemeText {
            anchors.bottom: parent.bottom
            text: label
            color: panel.steep ? Theme.warn : Theme.dim
            font.pixelSize: Theme.small
        }
    }

    Column {
        anchors.fill: parent
        View {
            lean: panel.roll
            label: "roll " + panel.degrees(panel.roll)
            Rectangle { x: -24; y: -12; width: 48; height: 17; radius: 3; color: Theme.series[7] }
            Rectangle { x: -2; y: -34; width: 4; height: 22; color: Theme.faint }
            Rectangle { x: -9; y: -40; width: 18; height: 9; radius: 3; color: Theme.dim }
            Rectangle { x: -36; y: -10; width: 13; height: 24; radius: 4; color: Theme.faint }
            Rectangle { x: 23; y: -10; width: 13; height: 24; radius: 4; color: Theme.faint }
        }
        View {
            lean: panel.pitch
            label: "pitch " + panel.degrees(-panel.pitch)
            Rectangle { x: -22; y: -20; width: 42; height: 12; radius: 3; color: Theme.series[7] }
            Rectangle { x: -34; y: -10; width: 68; height: 20; radius: 10; color: Theme.track; border.color: Theme.faint }
            Flipper { angle: panel.angles.flipper_front_right || 0; opacity: 0.5 }
            Flipper { angle: panel.angles.flipper_front_left || 0 }
            Flipper { front: false; angle: panel.angles.flipper_rear_right || 0; opacity: 0.5 }
            Flipper { front: false; angle: panel.angles.flipper_rear_left || 0 }
        }
    }
}
