// A lamp for a boolean of any topic, or for a number beyond a threshold; lit, dark or unknown, in words as well.
import QtQuick 2.15
import RosControls 1.0

LiveFrame {
    id: lamp

    // Topic and field: "/emergency_stop/state:data", "/battery_state:voltage".
    property string path
    property string ns
    // Values from which on, upwards or downwards, it is lit; NaN for none. With neither, it is lit for true and for every number but 0.
    property real above: NaN
    property real below: NaN
    // How far behind a threshold the value has to be until the lamp goes out.
    property real hysteresis: 0
    // Colour while it is lit.
    property color tint: Theme.good
    // Text while it is lit.
    property string onText: qsTr("ON")
    // Text while it is dark.
    property string offText: qsTr("OFF")

    // The value; NaN while unknown.
    readonly property real value: live.number
    // Whether it is lit; false while unknown.
    readonly property bool lit: lit_

    property bool lit_: false
    readonly property bool known_: !isNaN(value)
    readonly property string text_: !known_ ? qsTr("?") : lit ? onText : offText

    function judge_() {
        const slack = lit_ ? Math.max(0, hysteresis) : 0
        lit_ = !isNaN(value) && (isNaN(above) && isNaN(below) ? value !== 0 : value >= above - slack || value <= below + slack)
    }

    onValueChanged: judge_()
    onAboveChanged: judge_()
    onBelowChanged: judge_()

    title: path.slice(Math.max(path.lastIndexOf("."), path.lastIndexOf(":")) + 1).slice(0, 60)
    source: live
    problem: live.problem
        || (!path ? qsTr("set path: \"topic:field\", or drop a field here") : "")
        || (live.message !== undefined && !known_ ? qsTr("not a number") : "")
    contentWidth: 100 * Theme.size
    contentHeight: 48 * Theme.size
    Accessible.role: Accessible.Indicator
    Accessible.description: status || text_

    LiveValue {
        id: live
        path: lamp.path
        ns: lamp.ns
    }
    Rectangle {
        id: bulb
        objectName: "bulb"
        readonly property real most: Math.min(parent.height, parent.width / 3, 80 * Theme.size)
        anchors { left: parent.left; verticalCenter: parent.verticalCenter }
        width: Math.max(0, most)
        height: width
        radius: width / 2
        color: lamp.lit ? lamp.tint : Theme.track
        border { color: lamp.lit ? lamp.tint : Theme.faint; width: Math.max(2, width * 0.06) }
    }
    ThemeText {
        objectName: "text"
        anchors { left: bulb.right; leftMargin: Theme.gap; right: parent.right; verticalCenter: parent.verticalCenter }
        text: lamp.text_
        color: lamp.lit ? lamp.tint : Theme.text
        fontSizeMode: Text.HorizontalFit
        minimumPixelSize: Theme.small
        font { pixelSize: Theme.large; weight: Font.DemiBold }
    }
    PathDrop {
        objectName: "drop"
        anchors.fill: parent
        onTaken: function(path) { lamp.path = path }
    }
}
