// A number of any topic on a dial or a bar, with thresholds.
import QtQuick 2.15
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: gauge

    // Topic and field: "/odom:twist.twist.linear.x", "battery_state:cell_voltage[0]".
    property string path
    property string ns
    // The range that is drawn, in the unit shown.
    property real from: 0
    property real to: 1
    // Unit of the number that is shown.
    property string unit
    // What the number is multiplied by: 100 for a share in percent.
    property real factor: 1
    // Digits behind the point.
    property int decimals: 1
    // Values from which on, upwards or downwards, it is shown as a warning or as bad; NaN for none.
    property real warnAbove: NaN
    property real badAbove: NaN
    property real warnBelow: NaN
    property real badBelow: NaN
    // How far behind a threshold the value has to be until it counts as left, in the unit.
    property real hysteresis: Math.abs(to - from) / 50
    // "dial" or "bar".
    property string style: "dial"

    // In the unit; NaN while unknown.
    readonly property real value: live.number * factor
    // 0 while good, 1 for a warning, 2 for bad.
    readonly property int level: level_

    property int level_: 0
    readonly property color tint: isNaN(value) ? Theme.dim : tint_(level)
    readonly property real share_: share_of_(value)
    readonly property real zero_: from < 0 && to > 0 ? share_of_(0) : 0

    function tint_(level) { return level === 2 ? Theme.bad : level === 1 ? Theme.warn : Theme.accent }

    function share_of_(value) { return isNaN(value) ? NaN : Math.max(0, Math.min(1, (value - from) / (to - from))) }

    // Whether a value is in the zone of two thresholds; NaN compares as false.
    function beyond_(value, above, below, slack) { return value >= above - slack || value <= below + slack }

    function zone_(value, held) {
        return beyond_(value, badAbove, badBelow, held === 2 ? hysteresis : 0) ? 2
            : beyond_(value, warnAbove, warnBelow, held >= 1 ? hysteresis : 0) ? 1 : 0
    }

    function judge_() { level_ = zone_(value, level_) }

    function shown_(value) {
        return isNaN(value) ? qsTr("?") : !isFinite(value) ? (value > 0 ? "∞" : "−∞")
            : Math.abs(value) >= 1e7 ? value.toExponential(2) : value.toFixed(Math.max(0, Math.min(9, decimals)))
    }

    onValueChanged: judge_()
    onWarnAboveChanged: judge_()
    onWarnBelowChanged: judge_()
    onBadAboveChanged: judge_()
    onBadBelowChanged: judge_()

    title: path.slice(path.lastIndexOf(".") + 1).slice(path.lastIndexOf(":") < path.lastIndexOf(".") ? 0 : path.lastIndexOf(":") + 1).slice(0, 60)
    source: live
    filled: !isNaN(value)
    problem: live.problem
        || (!path ? qsTr("set path: \"topic:field\", or drop a field here") : "")
        || (from < to ? "" : Fields.fill(qsTr("from %1 is not less than to %2"), [from, to]))
        || (style === "dial" || style === "bar" ? "" : qsTr("style is \"dial\" or \"bar\", not \"%1\"").arg(style))
        || (live.message !== undefined && isNaN(live.number) ? qsTr("not a number") : "")
    note: isNaN(value) ? "" : value > to ? qsTr("above %1").arg(shown_(to)) : value < from ? qsTr("below %1").arg(shown_(from)) : ""
    contentHeight: style === "bar" ? Theme.large * 1.5 + Theme.gap : 110 * Theme.size
    Accessible.role: Accessible.ProgressBar
    Accessible.description: status || digits.text + " " + unit + (level === 2 ? ", " + qsTr("bad") : level === 1 ? ", " + qsTr("warning") : "")

    LiveValue {
        id: live
        path: gauge.path
        ns: gauge.ns
    }

    Item {
        id: dial
        objectName: "dial"
        visible: gauge.style !== "bar"
        anchors.horizontalCenter: parent.horizontalCenter
        readonly property real foot: Theme.small * 1.4
        width: Math.max(0, Math.min(parent.width, (parent.height - foot) / 0.76))
        height: width * 0.76 + foot
        Repeater {
            model: dial.visible ? 49 : 0
            Item {
                readonly property real at: index / 48
                readonly property bool lit: !isNaN(gauge.share_) && at >= Math.min(gauge.zero_, gauge.share_) - 0.0001
                    && at <= Math.max(gauge.zero_, gauge.share_) + 0.0001
                width: dial.width
                height: dial.width
                rotation: 240 * at - 120
                Rectangle {
                    anchors { top: parent.top; horizontalCenter: parent.horizontalCenter }
                    width: Math.max(2, dial.width * 0.022)
                    height: dial.width * (index % 12 ? 0.09 : 0.13)
                    radius: width / 2
                    color: lit ? gauge.tint : gauge.tint_(gauge.zone_(gauge.from + at * (gauge.to - gauge.from), 0))
                    opacity: lit ? 1 : 0.25
                    antialiasing: true
                }
            }
        }
        ThemeText {
            anchors { left: parent.left; leftMargin: dial.width * 0.03; bottom: parent.bottom }
            text: gauge.shown_(gauge.from)
            color: Theme.dim
            font.pixelSize: Theme.small
        }
        ThemeText {
            anchors { right: parent.right; rightMargin: dial.width * 0.03; bottom: parent.bottom }
            text: gauge.shown_(gauge.to)
            color: Theme.dim
            font.pixelSize: Theme.small
        }
    }
    Column {
        id: reading
        visible: gauge.style !== "bar"
        anchors.horizontalCenter: dial.horizontalCenter
        y: dial.width * 0.5 - digits.height * 0.6
        ThemeText {
            id: digits
            objectName: "digits"
            anchors.horizontalCenter: parent.horizontalCenter
            width: Math.min(implicitWidth, dial.width * 0.72)
            text: gauge.shown_(gauge.value)
            color: gauge.level ? gauge.tint : Theme.text
            font { pixelSize: Math.max(Theme.small, Math.min(Theme.large * 1.5, dial.width * 0.19)); weight: Font.DemiBold }
        }
        ThemeText {
            anchors.horizontalCenter: parent.horizontalCenter
            width: Math.min(implicitWidth, dial.width * 0.6)
            text: gauge.unit
            color: Theme.dim
            font.pixelSize: Theme.small
        }
    }
    Column {
        visible: gauge.style === "bar"
        width: parent.width
        spacing: Theme.gap / 2
        Row {
            spacing: Theme.gap / 2
            ThemeText {
                text: digits.text
                color: digits.color
                font { pixelSize: Theme.large; weight: Font.DemiBold }
            }
            ThemeText {
                anchors.bottom: parent.bottom
                bottomPadding: 3
                text: gauge.unit
                color: Theme.dim
                font.pixelSize: Theme.small
            }
        }
        Rectangle {
            id: bar
            width: parent.width
            height: Theme.gap
            radius: height / 2
            color: Theme.track
            Rectangle {
                x: isNaN(gauge.share_) ? 0 : parent.width * Math.min(gauge.zero_, gauge.share_)
                width: isNaN(gauge.share_) ? 0 : parent.width * Math.abs(gauge.share_ - gauge.zero_)
                height: parent.height
                radius: height / 2
                color: gauge.tint
            }
            Repeater {
                model: [gauge.warnAbove, gauge.badAbove, gauge.warnBelow, gauge.badBelow]
                Rectangle {
                    visible: modelData > gauge.from && modelData < gauge.to
                    x: visible ? bar.width * gauge.share_of_(modelData) - 1 : 0
                    y: -2
                    width: 2
                    height: bar.height + 4
                    color: index % 2 ? Theme.bad : Theme.warn
                }
            }
        }
    }
    PathDrop {
        anchors.fill: parent
        onTaken: function(path) { gauge.path = path }
    }
}
