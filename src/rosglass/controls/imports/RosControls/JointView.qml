// The joints of a robot and how near they are to their limits, of sensor_msgs/JointState and URDF.
import QtQuick 2.15
import Ros2 1.0
import RosControls 1.0

LiveFrame {
    id: joints

    // The topic; without one, the first of this type.
    property string topic
    property string ns
    // The topic of the robot's description; in ROS 1, the parameter robot_description is read too.
    property string descriptionTopic: "robot_description"
    // The robot's description itself, URDF; empty to receive it.
    property string description
    // "limit" for the joints nearest to a limit first, "name", or "message".
    property alias sort: live.sort
    // "deg" or "rad", for angles.
    property string unit: "deg"
    // Share of the range from a limit at which a joint is shown as near to it.
    property real near: 0.05
    // Share of the greatest effort and velocity at which they are shown as high.
    property real high: 0.9
    // Seconds without a report after which a joint counts as silent.
    property alias silentAfter: live.silentAfter
    readonly property alias total: live.total
    // Joints at or beyond a limit.
    readonly property alias beyond: live.beyond

    readonly property string fault_: unit === "deg" || unit === "rad" ? "" : qsTr("unit is \"deg\" or \"rad\", not \"%1\"").arg(unit)

    // Without a description, a joint may turn or slide: its numbers have no unit.
    function angular_(type) { return type === "revolute" || type === "continuous" }

    function number_(value, type, decimals) {
        if (isNaN(value))
            return qsTr("?")
        const shown = angular_(type) && unit === "deg" ? value * 180 / Math.PI : value
        const digits = angular_(type) && unit === "deg" ? decimals - 1 : decimals + 1
        return !isFinite(shown) ? (shown > 0 ? "∞" : "−∞") : Math.abs(shown) >= 1e6 ? shown.toExponential(1)
            : (Number(shown.toFixed(digits)) + 0).toFixed(digits)
    }

    function unit_(type) { return angular_(type) ? (unit === "deg" ? "°" : " rad") : type === "prismatic" ? " m" : "" }

    title: qsTr("Joints")
    source: live
    problem: live.problem || fault_
    contentWidth: 280 * Theme.size
    contentHeight: 120 * Theme.size
    note: !total ? "" : beyond ? qsTr("%1 at the limit").arg(beyond)
        : live.silent ? qsTr("%1 silent").arg(live.silent) : qsTr("%1 joints").arg(total)

    JointTopic {
        id: live
        topic: joints.topic
        ns: joints.ns
        description: joints.description || (urdf.message ? urdf.message.data : "")
    }
    LiveTopic {
        id: urdf
        enabled: !joints.description
        topic: joints.descriptionTopic
        ns: joints.ns
        types: ["std_msgs/msg/String"]
        qos: Ros2.BestAvailableQoS()
        timeout: 0
    }

    ThemeList {
        id: list
        objectName: "list"
        anchors.fill: parent
        name: joints.title
        model: live.rows
        moreTint: Theme.warn
        more: {
            const parts = []
            if (joints.total && live.limitsProblem)
                parts.push(qsTr("limits: %1").arg(live.limitsProblem))
            else if (live.limited < joints.total)
                parts.push(qsTr("%1 without limits").arg(joints.total - live.limited))
            if (live.omitted)
                parts.push(qsTr("%1 further joints not shown").arg(live.omitted))
            return parts.join(" · ")
        }
        delegate: Item {
            id: row
            readonly property bool over: model.nearness <= 0
            readonly property color tint: model.silent >= 0 ? Theme.dim : over ? Theme.bad
                : model.nearness <= joints.near ? Theme.warn : Theme.accent
            // Why the row cannot be taken as it is; empty if it can.
            readonly property string fault: model.silent >= 0 ? qsTr("silent for %1 s").arg(model.silent)
                : model.fault ? model.fault : isNaN(model.position) ? qsTr("no position") : ""
            readonly property bool strained: Math.abs(model.effort) >= joints.high * model.maxEffort && model.maxEffort > 0
            readonly property bool fast: Math.abs(model.velocity) >= joints.high * model.maxVelocity && model.maxVelocity > 0
            width: ListView.view.width
            height: Math.round(Theme.normal * 2.5)
            opacity: model.silent >= 0 ? 0.5 : 1

            Accessible.role: Accessible.ListItem
            Accessible.name: model.name + ": " + (fault || position.text) + (over ? ", " + qsTr("at the limit")
                : model.nearness <= joints.near ? ", " + qsTr("near the limit") : "")

            Rectangle {
                anchors.fill: parent
                visible: row.ListView.isCurrentItem
                color: Theme.track
                radius: 3
            }
            ThemeText {
                id: jointName
                anchors { left: parent.left; leftMargin: 2; top: parent.top; topMargin: 1 }
                width: Math.min(implicitWidth, row.width * 0.45)
                text: model.name
                color: row.over ? Theme.bad : Theme.text
            }
            ThemeText {
                anchors { left: jointName.right; leftMargin: Theme.gap; right: position.left; rightMargin: Theme.gap; baseline: jointName.baseline }
                text: row.fault || [isNaN(model.effort) ? "" : (model.type === "prismatic" ? qsTr("%1 N") : joints.angular_(model.type) ? qsTr("%1 Nm") : qsTr("effort %1")).arg(Math.abs(model.effort) >= 1e6 ? model.effort.toExponential(1) : model.effort.toFixed(1)),
                       isNaN(model.velocity) ? "" : joints.number_(model.velocity, model.type, 1) + joints.unit_(model.type) + "/s"].filter(function(part) { return part }).join(" · ")
                color: row.fault || row.strained || row.fast ? Theme.warn : Theme.dim
                font.pixelSize: Theme.small
            }
            ThemeText {
                id: position
                objectName: "position"
                anchors { right: parent.right; rightMargin: Theme.gap; baseline: jointName.baseline }
                text: joints.number_(model.position, model.type, 2) + joints.unit_(model.type)
                color: row.tint === Theme.accent ? Theme.text : row.tint
            }
            Rectangle {
                anchors { left: parent.left; right: parent.right; rightMargin: Theme.gap; bottom: parent.bottom; bottomMargin: 4 }
                height: Math.max(3, Theme.gap * 0.5)
                radius: height / 2
                color: Theme.track
                visible: !isNaN(model.lower)
                Rectangle {
                    readonly property real at: isNaN(model.share) ? -1 : Math.max(0, Math.min(1, model.share))
                    visible: at >= 0
                    x: Math.max(0, at) * (parent.width - width)
                    y: -2
                    width: Math.max(6, Theme.gap * 0.8)
                    height: parent.height + 4
                    radius: 2
                    color: row.tint
                }
            }
        }
    }
}
