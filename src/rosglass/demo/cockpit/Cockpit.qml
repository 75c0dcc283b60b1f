// The operator's cockpit: everything on one screen, usable with mouse, fingers or keyboard.
import QtQuick
import Ros2 1.0
import RosControls 1.0

Item {
    id: cockpit; objectName: "cockpit"

    readonly property bool inFront: Window.active
    readonly property bool wide: width > 1.15 * height
    // True if the panels have room; a smaller window shows only the image, the stick and the stop.
    readonly property bool roomy: wide ? width >= 620 && height >= 400
                                       : width >= 440 && height >= (cramped ? 640 : 520)
    readonly property real tall: height - bar.height - 2 * Theme.gap
    // The width beside an image of 4:3 in full height.
    readonly property real sideWidth: Math.max(280, Math.min(420, width - 3 * Theme.gap - tall * 4 / 3))
    readonly property real cameraWidth: width - 2 * Theme.gap
        - (wide && roomy ? sideWidth + Theme.gap : 0)
    // On an image this small the controls would hide one another: they go below it.
    readonly property bool cramped: width - 2 * Theme.gap - (wide ? sideWidth + Theme.gap : 0) < 520
    readonly property real strip: cramped && roomy ? 140 : 0
    readonly property real cameraTall: !roomy || wide && !cramped ? tall
        : Math.min(cameraWidth * 0.75, tall - strip - (wide ? 0 : Math.max(200, tall * 0.36) + Theme.gap))
    readonly property real control: strip > 0 ? strip - 20
        : Math.min(width * 0.36, tall * 0.6, Math.max(110, Math.min(170, cameraTall * 0.24)))
    // Distance of the controls from the image's lower edge, where its clock is.
    readonly property real rim: camera.height - camera.imageRect.y - camera.imageRect.height
        + camera.imageRect.height * 26 / 480 + 12
    readonly property real margin: cramped ? 6 : 22
    // Where the controls' lower edges are.
    readonly property real floor: strip > 0
        ? camera.y + cameraTall + (wide ? (tall - cameraTall + control) / 2 : control + 10)
        : camera.y + cameraTall - rim

    // Whether the robot is there: judged by what it sends, not by what the middleware believes.
    LiveTopic {
        id: link; objectName: "link"
        readonly property bool alive: !stale
        readonly property string text: alive ? (problem ? "CHECK THE ROBOT" : "CONNECTED")
            : age >= 0 ? "ROBOT LOST " + age.toFixed(0) + " s AGO" : "WAITING FOR THE ROBOT"
        // Why there is nothing to see.
        readonly property string reason: alive ? ""
            : Ros2.connectionState === "connected"
                ? "the " + Ros2.connectionDetail + " answers, the robot does not" : Ros2.connectionDetail
        topic: "/odom"; types: ["nav_msgs/msg/Odometry"]; timeout: 700; throttleRate: 30
    }
    TwistCommand {
        id: drive; objectName: "drive"; topic: "/cmd_vel"; maxSpeed: 0.9; maxTurn: 1.2
        reachable: link.alive
        obstacle: stop.blocks ? "emergency stop" : !camera.live ? "no live image" : !link.alive ? "no robot" : ""
    }
    DriveKeys {
        objectName: "keys"; command: drive; keycaps: false
    }
    WindowKeys {
        keys: [Qt.Key_L, Qt.Key_R, Qt.Key_F, Qt.Key_T, Qt.Key_G]
        onPressed: function (key) {
            if (key === Qt.Key_L)
                lamp.toggle()
            else if (key === Qt.Key_R || key === Qt.Key_F)
                flippers.nudge(key === Qt.Key_R ? 0.2 : -0.2, 0)
            else
                flippers.nudge(0, key === Qt.Key_T ? 0.2 : -0.2)
        }
    }

    TopBar {
        id: bar; width: parent.width
        link: link
        camera: camera
    }
    CameraView {
        id: camera; objectName: "camera"; x: Theme.gap; y: bar.height + Theme.gap
        width: cockpit.cameraWidth; height: cockpit.cameraTall
        topic: "/camera/image_raw"; title: "front camera"; transport: "raw"
        problem: link.reason
        tools: false
        // The figures of `rosglass demo` are read from the pixels of the image.
        fullResolution: true
    }
    // What is live may still not be what the operator takes it for.
    Rectangle {
        objectName: "warning"; visible: link.alive && link.problem !== ""
        anchors { horizontalCenter: camera.horizontalCenter; top: camera.top; topMargin: 48 }
        width: Math.min(camera.width - 24, warning.implicitWidth + 32)
        height: warning.height + 16; radius: Theme.radius; color: Theme.panel
        border { color: Theme.warn; width: 2 }
        ThemeText {
            id: warning; objectName: "warningText"
            anchors.centerIn: parent
            width: Math.min(implicitWidth, camera.width - 56); text: link.problem
            color: Theme.warn
            wrapMode: Text.Wrap
            maximumLineCount: 8
            horizontalAlignment: Text.AlignHCenter
            font.weight: Font.DemiBold
        }
    }
    Item {
        id: side; objectName: "side"; visible: cockpit.roomy
        x: cockpit.wide ? parent.width - width - Theme.gap : Theme.gap
        y: cockpit.wide ? camera.y : camera.y + cockpit.cameraTall + cockpit.strip + Theme.gap
        width: cockpit.wide ? cockpit.sideWidth : cockpit.width - 2 * Theme.gap
        height: cockpit.wide ? cockpit.tall : cockpit.height - y - Theme.gap
        // Whole pixels: a fraction hides the lower edge of a panel.
        readonly property real half: Math.floor((width - Theme.gap) / 2)
        readonly property real second: half + Theme.gap
        readonly property real mapTall: Math.floor(cockpit.wide
            ? Math.min(width * 0.86, height * (height < 560 ? 0.32 : 0.42)) : height - listTall - Theme.gap)
        readonly property real rowTall: Math.floor(cockpit.wide
            ? (height - mapTall - 3 * Theme.gap - listTall) / 2 : (height - Theme.gap) / 2)
        readonly property real listTall: Math.floor(Math.max(80, Math.min(148, height * (cockpit.wide ? 0.2 : 0.4))))

        MapView {
            id: map; objectName: "map"
            width: cockpit.wide ? parent.width : parent.half
            height: side.mapTall; topic: "/map"; scans: ["/scan"]
            tools: false
        }
        Attitude {
            id: attitude; objectName: "attitude"
            x: cockpit.wide ? 0 : side.second
            y: cockpit.wide ? side.mapTall + Theme.gap : 0
            width: cockpit.wide ? side.half : (side.half - Theme.gap) / 2
            height: side.rowTall; topic: "/imu"
            note: isNaN(roll) ? "" : Math.round(pitch) + "° / " + Math.round(roll) + "°"
        }
        Battery {
            objectName: "battery"; x: attitude.x + attitude.width + Theme.gap
            y: attitude.y; width: attitude.width; height: side.rowTall
            topic: "/battery_state"
        }
        Flippers {
            id: flippers; objectName: "flippers"; x: attitude.x
            y: attitude.y + side.rowTall + Theme.gap
            width: cockpit.wide ? side.width : side.half
            height: side.rowTall
        }
        DiagnosticsView {
            objectName: "diagnostics"; y: side.height - height
            width: cockpit.wide ? side.width : side.half
            height: side.listTall; topic: "/diagnostics"
        }
    }

    Rectangle {
        anchors { fill: speed; margins: -6 }
        visible: speed.visible; radius: Theme.radius; color: Theme.shade
    }
    Speed {
        id: speed; objectName: "speed"; framed: false
        anchors { horizontalCenter: camera.horizontalCenter; bottom: camera.bottom; bottomMargin: cockpit.rim }
        // On a small image it would hide the reason for a missing one.
        visible: cockpit.roomy && (camera.live || refusal !== "" || cockpit.strip === 0)
        width: Math.min(implicitWidth, camera.width - 20 - (cockpit.strip > 0 ? 0 : 2 * cockpit.control + 100))
        topic: "/odom"; command: drive
    }
    DriveStick {
        id: stick; objectName: "stick"; command: drive; width: cockpit.control
        height: width; x: camera.x + cockpit.margin; y: cockpit.floor - height
    }
    LampSwitch {
        id: lamp; objectName: "lamp"
        anchors { right: stop.left; bottom: stop.bottom; rightMargin: Math.min(14, cockpit.margin) }
        visible: cockpit.roomy
    }
    // Whatever else finds no room: this is inside the window, and on top.
    EmergencyStop {
        id: stop; objectName: "stop"; z: 1000; topic: "/emergency_stop"
        stopKeys: ["Space", "Escape"]; width: cockpit.control; height: width
        x: Math.max(0, camera.x + camera.width - cockpit.margin - width)
        y: Math.max(0, Math.min(cockpit.height - height, cockpit.floor - height))
    }
}
