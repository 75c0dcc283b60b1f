// Artificial horizon: how the robot leans, from sensor_msgs/Imu or nav_msgs/Odometry.
import QtQuick 2.15
import RosControls 1.0
import "orientation.js" as Orientation
import "fields.js" as Fields

LiveFrame {
    id: attitude

    // The topic; without one, the first of these types.
    property string topic
    property string ns
    // The axes of the orientation: "ENU" (x forward, y left, z up: REP 103) or "NED" (x forward, y
    // right, z down).
    property string convention: "ENU"
    // Degrees from level beyond which the robot is shown as leaning too far.
    property real limit: 20

    // Degrees, positive with the right side down; NaN while unknown.
    readonly property real roll: known_ ? turns_.roll : NaN
    // Degrees, positive with the nose up; NaN while unknown.
    readonly property real pitch: known_ ? (convention === "NED" ? turns_.pitch : -turns_.pitch) : NaN
    readonly property bool steep: known_ && Math.max(Math.abs(roll), Math.abs(pitch)) > limit
    readonly property var message: live.message

    readonly property var turns_: Orientation.read(message, live.messageType)
    readonly property string fault_: Orientation.unknown(convention) || turns_.fault
    readonly property bool known_: !fault_ && turns_.roll !== undefined
    readonly property color mark_: steep ? Theme.bad : Theme.warn

    title: qsTr("Attitude")
    source: live
    problem: live.problem || fault_
    contentHeight: 140 * Theme.size
    note: known_ ? Fields.fill(qsTr("pitch %1° roll %2°"), [Orientation.whole(pitch), Orientation.whole(roll)]) : ""
    Accessible.description: status || !known_ ? status
        : (pitch < 0 ? qsTr("nose down %1°") : qsTr("nose up %1°")).arg(Orientation.whole(Math.abs(pitch))) + ", "
          + (roll < 0 ? qsTr("left side down %1°") : qsTr("right side down %1°")).arg(Orientation.whole(Math.abs(roll)))
          + (steep ? ", " + qsTr("leans too far") : "")

    LiveTopic {
        id: live
        topic: attitude.topic
        ns: attitude.ns
        types: ["sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry"]
    }

    Rectangle {
        id: glass
        objectName: "glass"
        anchors.centerIn: parent
        width: Math.max(0, Math.min(parent.width, parent.height))
        height: width
        clip: true
        color: Theme.track
        readonly property real perDegree: height / 56

        Item {
            anchors.centerIn: parent
            width: parent.width
            height: parent.height
            visible: attitude.known_
            // Seen from behind, the horizon turns against the robot.
            rotation: attitude.known_ ? -attitude.roll : 0
            Item {
                y: attitude.known_ ? attitude.pitch * glass.perDegree : 0
                width: parent.width
                height: parent.height
                Rectangle {
                    x: -parent.width
                    width: parent.width * 3
                    height: parent.height * 4
                    y: parent.height / 2 - height
                    gradient: Gradient {
                        GradientStop { position: 0.8; color: Qt.darker(Theme.sky, 1.3) }
                        GradientStop { position: 1; color: Qt.lighter(Theme.sky, 1.25) }
                    }
                }
                Rectangle {
                    x: -parent.width
                    width: parent.width * 3
                    height: parent.height * 4
                    y: parent.height / 2
                    gradient: Gradient {
                        GradientStop { position: 0; color: Qt.lighter(Theme.ground, 1.2) }
                        GradientStop { position: 0.2; color: Qt.darker(Theme.ground, 1.3) }
                    }
                }
                Rectangle {
                    x: -parent.width
                    width: parent.width * 3
                    y: parent.height / 2 - 1
                    height: 2
                    color: Theme.text
                }
                Repeater {
                    model: [-80, -70, -60, -50, -40, -30, -20, -10, 10, 20, 30, 40, 50, 60, 70, 80]
                    Rectangle {
                        anchors.horizontalCenter: parent.horizontalCenter
                        y: glass.height / 2 - modelData * glass.perDegree
                        width: glass.width * (modelData % 20 === 0 ? 0.34 : 0.22)
                        height: 1
                        color: Theme.text
                        opacity: 0.75
                        ThemeText {
                            anchors { right: parent.left; rightMargin: 4; verticalCenter: parent.verticalCenter }
                            text: Math.abs(modelData)
                            font.pixelSize: Theme.small * 0.85
                            // The window's native text does not turn well.
                            renderType: Text.QtRendering
                        }
                    }
                }
            }
        }
        // The robot, seen from behind.
        Repeater {
            model: [-0.36, 0.16]
            Rectangle {
                x: glass.width * (0.5 + modelData)
                y: glass.height / 2 - 2
                width: 0.2 * glass.width
                height: 4
                radius: 2
                color: attitude.mark_
            }
        }
        Rectangle {
            anchors.centerIn: parent
            width: 6; height: 6; radius: 3
            color: attitude.mark_
        }
        Rectangle {
            anchors.fill: parent
            color: "transparent"
            border { color: attitude.steep ? Theme.bad : Theme.edge; width: attitude.steep ? 3 : 1 }
        }
    }
    // Beside the ladder, where there is room; else on a ground of its own, as the ladder turns.
    Rectangle {
        objectName: "convention"
        anchors { left: beside_ ? parent.left : glass.left; bottom: glass.bottom; margins: 1 }
        readonly property bool beside_: (parent.width - glass.width) / 2 >= width + Theme.gap / 2
        width: axes.width + Theme.gap * 0.6
        height: axes.height + 2
        color: Theme.panel
        ThemeText {
            id: axes
            anchors.centerIn: parent
            text: attitude.convention.slice(0, 8)
            color: Theme.dim
            font.pixelSize: Theme.small * 0.85
        }
    }
}
