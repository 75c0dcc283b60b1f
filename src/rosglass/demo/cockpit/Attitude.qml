// Artificial horizon: how the robot leans, from its inertial measurement unit.
import QtQuick
import Ros2 1.0

Panel {
    id: panel
    title: "Attitude"
    fresh: imu.fresh
    age: imu.age

    // Degrees; roll positive with the left side up, pitch positive with the nose down (REP 103).
    property real roll: 0
    property real pitch: 0
    readonly property bool steep: Math.max(Math.abs(roll), Math.abs(pitch)) > 12
    // Adding zero turns minus zero into zero.
    note: (Math.round(-pitch) + 0) + "° / " + (Math.round(roll) + 0) + "°"

    property Feed imu: Feed {
        topic: "/imu"
        messageType: "sensor_msgs/msg/Imu"
        onArrived: function (message) {
            const q = message.orientation
            const degrees = 180 / Math.PI
            panel.roll = degrees * Math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x * q.x + q.y * q.y))
            const s = 2 * (q.w * q.y - q.z * q.x)
            panel.pitch = degrees * Math.asin(Math.max(-1, Math.min(1, s)))
        }
    }

    Rectangle {
        id: glass
        anchors.centerIn: parent
        width: Math.min(parent.width, parent.height)
        height: width
        radius: 3
        clip: true
        color: "#123"
        readonly property real perDegree: height / 56

        Item {
            anchors.centerIn: parent
            width: parent.width
            height: parent.height
            rotation: panel.roll
            Item {
                y: -panel.pitch * glass.perDegree
                width: parent.width
                height: parent.height
                Rectangle {
                    x: -parent.width
                    width: parent.width * 3
                    height: parent.height * 2
                    y: parent.height / 2 - height
                    gradient: Gradient {
                        GradientStop { position: 0.4; color: "#173d66" }
                        GradientStop { position: 1; color: "#3f86bd" }
                    }
                }
                Rectangle {
                    x: -parent.width
                    width: parent.width * 3
                    height: parent.height * 2
                    y: parent.height / 2
                    gradient: Gradient {
                        GradientStop { position: 0; color: "#7a5632" }
                        GradientStop { position: 0.5; color: "#3a2816" }
                    }
                }
                Rectangle {
                    x: -parent.width
                    width: parent.width * 3
                    y: parent.height / 2 - 1
                    height: 2
                    color: "#e8f2fa"
                }
                Repeater {
                    model: [-20, -10, 10, 20]
                    Rectangle {
                        required property int modelData
                        anchors.horizontalCenter: parent.horizontalCenter
                        y: glass.height / 2 - modelData * glass.perDegree
                        width: glass.width * (modelData % 20 === 0 ? 0.34 : 0.22)
                        height: 1
                        color: "#b0e8f2fa"
                        Text {
                            anchors { right: parent.left; rightMargin: 4; verticalCenter: parent.verticalCenter }
                            textFormat: Text.PlainText
                            text: Math.abs(parent.modelData)
                            color: "#b0e8f2fa"
                            font.pixelSize: 9
                            // The window's native text does not turn well.
                            renderType: Text.QtRendering
                        }
                    }
                }
            }
        }
        // The robot, seen from behind.
        Repeater {
            model: [-1, 1]
            Rectangle {
                required property int modelData
                x: glass.width / 2 + (modelData < 0 ? -0.36 * glass.width : 0.16 * glass.width)
                y: glass.height / 2 - 2
                width: 0.2 * glass.width
                height: 4
                radius: 2
                color: panel.steep ? Theme.bad : Theme.warn
            }
        }
        Rectangle {
            anchors.centerIn: parent
            width: 6; height: 6; radius: 3
            color: panel.steep ? Theme.bad : Theme.warn
        }
        Rectangle {
            anchors.fill: parent
            radius: parent.radius
            color: "transparent"
            border { color: panel.steep ? Theme.bad : Theme.panelEdge; width: panel.steep ? 3 : 2 }
        }
    }
}
