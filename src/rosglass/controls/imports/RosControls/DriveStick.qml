// A stick to steer a robot with, for mouse, fingers, and the arrow keys. It always springs back.
import QtQuick 2.15
import RosControls 1.0

Item {
    id: stick

    objectName: "DriveStick"

    // What it steers; without one, a TwistCommand of its own on `topic`.
    property var command: own_
    // Topic of its own TwistCommand.
    property string topic: "cmd_vel"
    property string ns
    // Whether left and right move to the sides, for robots that can, instead of turning.
    property bool slides: false
    // Share of the way around the middle of each axis that counts as the middle: straight ahead is straight.
    property real deadZone: 0.08
    // Share of full deflection for the arrow keys.
    property real keyShare: 0.8

    // Whether it is held, and whether that steers the robot.
    readonly property bool held: touch.held_ || keys.held.length > 0
    readonly property bool active: held && steers_
    // Where the thumb is, from -1 to 1: forward, and to the left.
    readonly property real forward: touch.held_ ? thumb_.y : arrow_(Qt.Key_Up) - arrow_(Qt.Key_Down)
    readonly property real leftward: touch.held_ ? thumb_.x : arrow_(Qt.Key_Left) - arrow_(Qt.Key_Right)

    property point thumb_: Qt.point(0, 0)
    property bool steers_: false
    // It is round, whatever its shape.
    readonly property real side_: Math.min(width, height)
    readonly property real reach_: Math.max(1, (side_ - knob.width) / 2)
    readonly property color tint_: !held ? Theme.faint : active ? Theme.accent : Theme.bad

    implicitWidth: 170 * Theme.size
    implicitHeight: implicitWidth
    activeFocusOnTab: true
    Accessible.role: Accessible.Slider
    Accessible.name: qsTr("Drive stick")
    Accessible.description: held && !active && command ? command.problem : qsTr("Drag it, or hold the arrow keys")
    Accessible.focusable: true

    function arrow_(key) {
        return keys.held.indexOf(key) >= 0 ? keyShare : 0
    }

    function apply_() {
        if (!command)
            return
        if (held)
            steers_ = command.steer(stick, forward, slides ? 0 : leftward, slides ? leftward : 0)
        else
            command.release(stick)
    }

    // x right, y down, from the middle, in units of the stick's reach.
    function pull_(x, y) {
        const far = Math.max(1, Math.hypot(x, y))
        const middle = v => Math.abs(v) < deadZone ? 0 : v
        thumb_ = Qt.point(middle(-x / far), middle(-y / far))
    }

    onHeldChanged: apply_()
    onForwardChanged: if (held) apply_()
    onLeftwardChanged: if (held) apply_()

    TwistCommand {
        id: own_
        topic: stick.command === own_ ? stick.topic : ""
        ns: stick.ns
    }
    // Reports to the command that it is still held.
    Timer {
        interval: 40
        repeat: true
        running: stick.held
        onTriggered: stick.apply_()
    }
    WindowKeys {
        id: keys
        // The focus stays with an item that is hidden.
        enabled: stick.activeFocus && stick.visible && !touch.held_
        keys: [Qt.Key_Up, Qt.Key_Down, Qt.Key_Left, Qt.Key_Right]
    }

    Rectangle {
        anchors.centerIn: parent
        width: stick.side_
        height: width
        radius: width / 2
        color: Theme.shade
        border { width: 2; color: stick.tint_ }
        FocusRing { item: parent; radius: width / 2; visible: stick.activeFocus }
    }
    Repeater {
        model: 4
        Text {
            x: stick.width / 2 - width / 2 + Math.sin(index * Math.PI / 2) * (stick.side_ / 2 - height)
            y: stick.height / 2 - height / 2 - Math.cos(index * Math.PI / 2) * (stick.side_ / 2 - height)
            text: "▲"
            rotation: index * 90
            color: Theme.dim
            font.pixelSize: Theme.small
        }
    }
    Rectangle {
        anchors.centerIn: parent
        width: stick.side_ * 0.52
        height: width
        radius: width / 2
        color: "transparent"
        border { color: Theme.faint; width: 1 }
    }
    Rectangle {
        id: knob
        objectName: "knob"
        // Animated in units of the stick, so that it does not lag behind when it is laid out.
        property real leftwards: stick.held ? stick.leftward : 0
        property real forwards: stick.held ? stick.forward : 0
        width: stick.side_ * 0.38
        height: width
        radius: width / 2
        x: (stick.width - width) / 2 - leftwards * stick.reach_
        y: (stick.height - height) / 2 - forwards * stick.reach_
        border { color: Qt.lighter(stick.tint_, 1.5); width: 1 }
        gradient: Gradient {
            GradientStop { position: 0; color: Qt.lighter(stick.tint_, 1.25) }
            GradientStop { position: 1; color: Qt.darker(stick.tint_, 1.5) }
        }
        Behavior on leftwards { enabled: !stick.held; NumberAnimation { duration: 90 } }
        Behavior on forwards { enabled: !stick.held; NumberAnimation { duration: 90 } }
    }
    ThemeText {
        objectName: "reason"
        anchors { horizontalCenter: parent.horizontalCenter; bottom: parent.bottom; bottomMargin: (parent.height - stick.side_) / 2 + stick.side_ * 0.14 }
        width: Math.min(implicitWidth, stick.side_ * 0.8)
        visible: stick.held && !stick.active
        text: stick.command ? stick.command.problem : ""
        color: Theme.bad
        font { pixelSize: Theme.small; weight: Font.DemiBold }
    }
    MultiPointTouchArea {
        id: touch
        objectName: "touch"
        property bool held_: false
        anchors.fill: parent
        maximumTouchPoints: 1
        function follow_(points) {
            stick.pull_((points[0].x - width / 2) / stick.reach_, (points[0].y - height / 2) / stick.reach_)
        }
        onPressed: function (points) { follow_(points); held_ = true }
        onUpdated: function (points) { follow_(points) }
        onReleased: held_ = false
        onCanceled: held_ = false
        onVisibleChanged: held_ = false
        onEnabledChanged: held_ = false
    }
}
