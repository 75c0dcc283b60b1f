// The heading, from sensor_msgs/Imu or nav_msgs/Odometry, and what it is measured from.
import QtQuick 2.15
import RosControls 1.0
import "orientation.js" as Orientation

LiveFrame {
    id: compass

    // The topic; without one, the first of these types.
    property string topic
    property string ns
    // The axes of the orientation: "ENU" (yaw 0 is east, counterclockwise) or "NED" (yaw 0 is north,
    // clockwise).
    property string convention: "ENU"
    // What the heading is measured from: "magnetic" or "true" north, or "frame", the x axis of the
    // message's frame; empty for "magnetic" with an Imu and "frame" with an Odometry.
    property string reference
    // Degrees from true north to magnetic north, positive to the east; with it, a magnetic heading is
    // shown from true north.
    property real declination: 0

    // Degrees, clockwise from north from 0 to 360; or from -180 to 180 about the frame's z axis. NaN
    // while unknown.
    readonly property real heading: !known_ ? NaN : north ? wrapped_(clockwise_)
        : Orientation.whole(turns_.yaw) === -180 ? 180 : turns_.yaw
    // Whether it is measured from north.
    readonly property bool north: from_ !== "frame"
    // What it is measured from, in words.
    readonly property string origin: !message ? ""
        : from_ === "frame" ? qsTr("from x of %1").arg(frame_)
        : from_ === "magnetic" && !declination ? qsTr("magnetic north") : qsTr("true north")
    readonly property var message: live.message

    readonly property var turns_: Orientation.read(message, live.messageType)
    readonly property string fault_: Orientation.unknown(convention)
        || (["", "magnetic", "true", "frame"].includes(reference) ? ""
            : qsTr("reference is \"magnetic\", \"true\" or \"frame\", not \"%1\"").arg(reference))
        || turns_.fault
    readonly property bool known_: !fault_ && turns_.yaw !== undefined
    readonly property string from_: reference || (live.messageType === "nav_msgs/msg/Odometry" ? "frame" : "magnetic")
    readonly property string frame_: message ? (Orientation.word(message.header.frame_id) || qsTr("a frame without a name")) : ""
    // Degrees clockwise from the top of the rose.
    readonly property real clockwise_: !known_ ? 0
        : (convention === "NED" ? turns_.yaw : north ? 90 - turns_.yaw : -turns_.yaw)
          + (from_ === "magnetic" ? declination : 0)
    readonly property var letters_: north ? [qsTr("N"), qsTr("E"), qsTr("S"), qsTr("W")]
        : convention === "NED" ? ["x", "y", "−x", "−y"] : ["x", "−y", "−x", "y"]

    function wrapped_(degrees) { return ((degrees % 360) + 360) % 360 }

    function point_(degrees) {
        return [qsTr("N"), qsTr("NE"), qsTr("E"), qsTr("SE"), qsTr("S"), qsTr("SW"), qsTr("W"), qsTr("NW")][Math.round(degrees / 45) % 8] || ""
    }

    title: qsTr("Compass")
    source: live
    problem: live.problem || fault_
    contentHeight: 140 * Theme.size
    note: origin ? origin + " · " + convention : ""
    Accessible.description: status || value.text + " " + origin

    LiveTopic {
        id: live
        topic: compass.topic
        ns: compass.ns
        types: ["sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry"]
    }

    Item {
        id: dial
        anchors.centerIn: parent
        width: Math.max(0, Math.min(parent.width, parent.height))
        height: width

        Rectangle {
            anchors.fill: parent
            radius: width / 2
            color: Theme.track
            border { color: Theme.edge; width: 1 }
        }
        Item {
            objectName: "rose"
            anchors.fill: parent
            visible: compass.known_
            rotation: -compass.clockwise_
            Repeater {
                model: 36
                Item {
                    anchors.fill: parent
                    rotation: 10 * index
                    Rectangle {
                        anchors { top: parent.top; topMargin: 2; horizontalCenter: parent.horizontalCenter }
                        width: index % 9 ? 1 : 2
                        height: dial.width * (index % 3 ? 0.03 : 0.055)
                        color: index % 9 ? Theme.dim : Theme.text
                    }
                }
            }
            Repeater {
                model: compass.letters_
                Item {
                    anchors.fill: parent
                    rotation: 90 * index
                    ThemeText {
                        anchors { top: parent.top; topMargin: dial.width * 0.075; horizontalCenter: parent.horizontalCenter }
                        text: modelData
                        color: index ? Theme.text : Theme.bad
                        font { pixelSize: Math.max(8, dial.width * 0.11); weight: Font.DemiBold }
                        renderType: Text.QtRendering
                        rotation: compass.clockwise_ - 90 * index
                    }
                }
            }
        }
        // The robot's nose.
        Rectangle {
            anchors { top: parent.top; topMargin: -2; horizontalCenter: parent.horizontalCenter }
            width: 4
            height: dial.width * 0.09
            radius: 2
            color: Theme.accent
        }
        ThemeText {
            id: value
            objectName: "value"
            anchors { centerIn: parent; verticalCenterOffset: compass.north && compass.known_ ? -Theme.small * 0.6 : 0 }
            text: !compass.known_ ? qsTr("?")
                : qsTr("%1°").arg(Orientation.whole(compass.heading) % (compass.north ? 360 : 361))
            font { pixelSize: Math.max(Theme.small, Math.min(Theme.large * 1.3, dial.width * 0.2)); weight: Font.DemiBold }
        }
        ThemeText {
            anchors { top: value.bottom; horizontalCenter: parent.horizontalCenter }
            visible: compass.north && compass.known_
            text: compass.point_(compass.heading)
            color: Theme.dim
            font.pixelSize: Theme.small
        }
    }
}
