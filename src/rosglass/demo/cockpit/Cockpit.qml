// The operator's cockpit: everything on one screen, usable with mouse, fingers or keyboard.
import QtQuick
import Ros2 1.0

Item {
    id: cockpit
    objectName: "cockpit"

    property alias drive: drive
    property alias stick: stick
    property alias stop: stop
    property alias camera: camera
    property alias map: map
    property alias link: link
    property alias battery: battery
    property alias attitude: attitude
    property alias flippers: flippers
    property alias diagnostics: diagnostics
    // Whether the window is the one that gets the keys.
    property bool inFront: true
    readonly property bool wide: width > 1.15 * height
    // How far the controls stay above the picture's lower edge, where its clock is.
    readonly property real rim: camera.height - camera.pictureRect.y - camera.pictureRect.height
        + camera.pictureRect.height * 26 / 480 + 12

    focus: true

    onInFrontChanged: if (!inFront) letGo()
    onActiveFocusChanged: if (!activeFocus) letGo()

    // Whatever was held down: its release may never be seen.
    function letGo() {
        keyboard.clear()
        keys.clear()
        drive.release()
    }

    Keys.onPressed: function (event) {
        event.accepted = true
        if (event.key === Qt.Key_Space || event.key === Qt.Key_Escape)
            stop.press()
        else if (event.modifiers & (Qt.ControlModifier | Qt.AltModifier))
            event.accepted = event.isAutoRepeat
        else if (event.isAutoRepeat || !keyboard.press(event.key))
            return
        else if (keys.press(event.key))
            return
        else if (event.key === Qt.Key_L)
            lamp.toggle()
        else if (event.key === Qt.Key_R || event.key === Qt.Key_F)
            flippers.nudge(event.key === Qt.Key_R ? 0.2 : -0.2, 0)
        else if (event.key === Qt.Key_T || event.key === Qt.Key_G)
            flippers.nudge(0, event.key === Qt.Key_T ? 0.2 : -0.2)
        else
            event.accepted = false
    }
    Keys.onReleased: function (event) {
        if (!event.isAutoRepeat)
            keyboard.lift(event.key)
    }

    Link {
        id: link
        objectName: "link"
        pulse: map.odom
    }
    Drive {
        id: drive
        objectName: "drive"
        obstacle: stop.blocks ? "emergency stop"
            : !camera.live ? "no live picture"
            : !link.alive ? "no robot"
            : !cockpit.inFront ? "window not in front" : ""
    }
    DriveKeys {
        id: keys
        drive: drive
    }
    Keyboard {
        id: keyboard
        onLifted: function (key) { keys.lift(key) }
    }

    TopBar {
        id: bar
        width: parent.width
        link: link
        framerate: camera.framerate
        latency: camera.latency
    }
    CameraView {
        id: camera
        objectName: "camera"
        anchors { left: parent.left; top: bar.bottom; margins: Theme.gap }
        width: cockpit.wide ? side.x - 2 * Theme.gap : parent.width - 2 * Theme.gap
        height: cockpit.wide ? parent.height - bar.height - 2 * Theme.gap
                             : Math.min(width * 0.75, parent.height * 0.6)
        reason: link.reason
    }
    Item {
        id: side
        readonly property real tall: cockpit.wide ? cockpit.height - bar.height - 2 * Theme.gap
            : cockpit.height - camera.y - camera.height - 2 * Theme.gap
        x: cockpit.wide ? parent.width - width - Theme.gap : Theme.gap
        y: cockpit.wide ? bar.height + Theme.gap : camera.y + camera.height + Theme.gap
        // What a picture of 4:3 in full height leaves over.
        width: !cockpit.wide ? cockpit.width - 2 * Theme.gap
            : Math.max(280, Math.min(420, cockpit.width - 3 * Theme.gap - camera.height * 4 / 3))
        height: tall
        readonly property real half: (width - Theme.gap) / 2
        readonly property real mapTall: cockpit.wide ? Math.min(width * 0.86, tall * 0.42) : tall
        readonly property real rowTall: cockpit.wide ? (tall - mapTall - 3 * Theme.gap - listTall) / 2
            : (tall - Theme.gap) / 2
        readonly property real listTall: Math.max(90, Math.min(148, tall * 0.2))

        MapView {
            id: map
        objectName: "map"
            width: cockpit.wide ? parent.width : parent.half
            height: side.mapTall
        }
        Attitude {
            id: attitude
        objectName: "attitude"
            x: cockpit.wide ? 0 : side.half + Theme.gap
            y: cockpit.wide ? side.mapTall + Theme.gap : 0
            width: cockpit.wide ? side.half : (side.half - Theme.gap) / 2
            height: side.rowTall
        }
        Battery {
            id: battery
        objectName: "battery"
            x: cockpit.wide ? side.half + Theme.gap : attitude.x + attitude.width + Theme.gap
            y: attitude.y
            width: attitude.width
            height: side.rowTall
        }
        Flippers {
            id: flippers
        objectName: "flippers"
            x: attitude.x
            y: attitude.y + side.rowTall + Theme.gap
            width: cockpit.wide ? side.width : attitude.width
            height: side.rowTall
        }
        Diagnostics {
            id: diagnostics
        objectName: "diagnostics"
            x: cockpit.wide ? 0 : battery.x
            y: cockpit.wide ? flippers.y + side.rowTall + Theme.gap : flippers.y
            width: cockpit.wide ? side.width : battery.width
            height: cockpit.wide ? side.listTall : side.rowTall
        }
    }

    Speed {
        id: speed
        objectName: "speed"
        anchors { horizontalCenter: camera.horizontalCenter; bottom: camera.bottom; bottomMargin: cockpit.rim }
        odom: map.odom
        drive: drive
    }
    DriveStick {
        id: stick
        objectName: "stick"
        drive: drive
        width: Math.max(110, Math.min(180, camera.height * 0.25))
        height: width
        anchors { left: camera.left; bottom: camera.bottom; leftMargin: 22; bottomMargin: cockpit.rim }
    }
    Lamp {
        id: lamp
        objectName: "lamp"
        anchors { right: stop.left; bottom: stop.bottom; rightMargin: 14 }
    }
    EmergencyStop {
        id: stop
        objectName: "stop"
        z: 1000
        width: Math.max(110, Math.min(170, camera.height * 0.24))
        height: width
        anchors { right: camera.right; bottom: camera.bottom; rightMargin: 22; bottomMargin: cockpit.rim }
    }
}
