// The stick on the screen, for mouse and fingers.
import QtQuick

Item {
    id: stick

    required property var drive
    readonly property real reach: width / 2 - knob.width / 2

    implicitWidth: 170
    implicitHeight: 170

    // Steer as if the knob was pulled to a place; x right, y down, from the middle, -1 to 1.
    function pull(x, y) {
        const far = Math.max(1, Math.hypot(x, y))
        // A few pixels of play around the middle of each axis: straight ahead should be straight.
        const play = v => Math.abs(v) < 0.08 ? 0 : v
        drive.steer(play(-y / far), play(-x / far))
    }

    function letGo() {
        drive.release()
    }

    Rectangle {
        anchors.fill: parent
        radius: width / 2
        color: Theme.shade
        border {
            width: 2
            color: !stick.drive.held ? Theme.faint
                : stick.drive.active ? Theme.accent : Theme.bad
        }
    }
    Repeater {
        model: 4
        Text {
            required property int index
            x: stick.width / 2 - width / 2 + Math.sin(index * Math.PI / 2) * (stick.width / 2 - 15)
            y: stick.height / 2 - height / 2 - Math.cos(index * Math.PI / 2) * (stick.height / 2 - 15)
            text: "▲"
            rotation: index * 90
            color: Theme.dim
            font.pixelSize: 11
        }
    }
    Rectangle {
        anchors.centerIn: parent
        width: parent.width * 0.52
        height: width
        radius: width / 2
        color: "transparent"
        border { color: Theme.faint; width: 1 }
    }
    Rectangle {
        id: knob
        width: stick.width * 0.38
        height: width
        radius: width / 2
        // Animated in units of the stick, so that the knob does not lag behind when it is laid out.
        property real leftwards: stick.drive.left
        property real forwards: stick.drive.forward
        x: stick.width / 2 - width / 2 - leftwards * stick.reach
        y: stick.height / 2 - height / 2 - forwards * stick.reach
        border { color: Qt.lighter(base, 1.5); width: 1 }
        readonly property color base: !stick.drive.held ? "#4b5d6d"
            : stick.drive.active ? Theme.accent : Theme.bad
        gradient: Gradient {
            GradientStop { position: 0; color: Qt.lighter(knob.base, 1.25) }
            GradientStop { position: 1; color: Qt.darker(knob.base, 1.5) }
        }
        Behavior on leftwards { enabled: !stick.drive.held; NumberAnimation { duration: 90 } }
        Behavior on forwards { enabled: !stick.drive.held; NumberAnimation { duration: 90 } }
    }
    MultiPointTouchArea {
        anchors.fill: parent
        maximumTouchPoints: 1
        function follow(points) {
            const point = points[0]
            stick.pull((point.x - width / 2) / stick.reach, (point.y - height / 2) / stick.reach)
        }
        onPressed: function (points) { follow(points) }
        onUpdated: function (points) { follow(points) }
        onReleased: stick.letGo()
        onCanceled: stick.letGo()
    }
    onVisibleChanged: if (!visible) letGo()
}
