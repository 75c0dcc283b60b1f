// How fast the robot drives and turns, from nav_msgs/Odometry or a Twist; and why it does not.
import QtQuick 2.15
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: control

    // The topic; without one, the first nav_msgs/Odometry.
    property string topic
    property string ns
    // "m/s" or "km/h".
    property string unit: "m/s"
    // "°/s" or "rad/s".
    property string turnUnit: "°/s"
    // A TwistCommand, to say why it does not drive while an input steers it; or null.
    property var command: null

    // Metres per second along x and y of the robot, radians per second about z; NaN while unknown.
    readonly property real speed: twist_ ? twist_.linear.x : NaN
    readonly property real sideways: twist_ ? twist_.linear.y : NaN
    readonly property real turn: twist_ ? twist_.angular.z : NaN
    // Why a steered robot does not drive, in words; empty if it does, or is not steered.
    readonly property string refusal: command ? command.refusal : ""
    readonly property var message: live.message

    readonly property var twist_: !message ? null : live.messageType === "geometry_msgs/msg/Twist" ? message
        : live.messageType === "geometry_msgs/msg/TwistStamped" ? message.twist : message.twist.twist
    readonly property real factor_: unit === "km/h" ? 3.6 : 1
    readonly property string fault_: unit !== "m/s" && unit !== "km/h" ? qsTr("unit is \"m/s\" or \"km/h\", not \"%1\"").arg(unit)
        : turnUnit !== "°/s" && turnUnit !== "rad/s" ? qsTr("turnUnit is \"°/s\" or \"rad/s\", not \"%1\"").arg(turnUnit)
        : !twist_ ? ""
        : isNaN(speed) ? qsTr("linear.x is not a number")
        : isNaN(sideways) ? qsTr("linear.y is not a number")
        : isNaN(turn) ? qsTr("angular.z is not a number") : ""

    function shown_(value, decimals) {
        return isNaN(value) ? qsTr("?") : !isFinite(value) ? (value > 0 ? "∞" : "−∞")
            : Math.abs(value) >= 1e5 ? value.toExponential(1)
            // Adding zero turns minus zero into zero.
            : (Number(value.toFixed(decimals)) + 0).toFixed(decimals)
    }

    title: qsTr("Speed")
    source: live
    problem: live.problem || fault_
    contentHeight: Theme.large * 1.5 + Theme.small * 1.5
    Accessible.description: refusal ? qsTr("not driving: %1").arg(refusal) : status
        || speed_.value + " " + speed_.unit + ", " + turn_.value + " " + turn_.unit

    LiveTopic {
        id: live
        topic: control.topic
        ns: control.ns
        // By type alone, a command would be taken for a speed.
        types: control.topic ? ["nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped",
                              "geometry_msgs/msg/TwistWithCovarianceStamped"] : ["nav_msgs/msg/Odometry"]
    }

    component Reading: Column {
        property alias value: value.text
        property alias unit: unit.text
        ThemeText {
            id: value
            anchors.horizontalCenter: parent.horizontalCenter
            font { pixelSize: Theme.large * 1.1; weight: Font.DemiBold }
        }
        ThemeText {
            id: unit
            anchors.horizontalCenter: parent.horizontalCenter
            color: Theme.dim
            font.pixelSize: Theme.small
        }
    }

    Row {
        id: row
        objectName: "readings"
        anchors.centerIn: parent
        visible: !control.refusal
        spacing: Theme.gap * 1.5
        scale: Math.min(1, parent.width / Math.max(1, width))

        Reading {
            id: speed_
            objectName: "forward"
            value: control.shown_(control.speed * control.factor_, control.unit === "km/h" ? 1 : 2)
            unit: control.unit
        }
        Reading {
            objectName: "sideways"
            visible: Math.abs(control.sideways) >= 0.005
            value: control.shown_(Math.abs(control.sideways) * control.factor_, control.unit === "km/h" ? 1 : 2)
            unit: control.sideways < 0 ? qsTr("%1 right").arg(control.unit) : qsTr("%1 left").arg(control.unit)
        }
        Reading {
            id: turn_
            objectName: "turn"
            value: control.turnUnit === "rad/s" ? control.shown_(control.turn, 2) : control.shown_(control.turn * 180 / Math.PI, 0)
            unit: control.turnUnit
        }
    }
    ThemeText {
        objectName: "refusal"
        anchors.centerIn: parent
        visible: control.refusal !== ""
        width: parent.width
        horizontalAlignment: Text.AlignHCenter
        wrapMode: Text.Wrap
        maximumLineCount: 3
        text: qsTr("NOT DRIVING: %1").arg(Fields.bounded(control.refusal))
        color: Theme.bad
        font.weight: Font.Bold
    }
}
