// The map with the robot, its track and what its laser sees now.
import QtQuick
import QtQuick.Shapes
import Ros2 1.0
import RosglassDemo 1.0

Panel {
    id: panel
    title: "Map"
    fresh: odom.fresh && !scan.stale && map.received
    age: !map.received ? -1 : Math.max(odom.age, scan.age)
    note: odom.received ? driven.toFixed(1) + " m driven" : ""

    property alias odom: odom
    property alias scan: scan
    property alias map: map
    property real robotX: 0
    property real robotY: 0
    property real robotYaw: 0
    // Where the robot was when it looked around; it moves on until the next scan.
    property url scanSource
    property real scanX: 0
    property real scanY: 0
    property real scanYaw: 0
    property real driven: 0
    property var track: []

    Feed {
        id: odom
        topic: "/odom"
        messageType: "nav_msgs/msg/Odometry"
        limit: 0.7
        onArrived: function (message) {
            const pose = message.pose.pose
            const q = pose.orientation
            panel.place(pose.position.x, pose.position.y,
                        Math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z)))
        }
    }
    MapPicture {
        id: map
        topic: "/map"
    }
    ScanPicture {
        id: scan
        topic: "/scan"
        limit: 0.7
    }
    Connections {
        target: Beat
        function onTick() {
            if (panel.scanSource === scan.source)
                return
            panel.scanSource = scan.source
            panel.scanX = panel.robotX
            panel.scanY = panel.robotY
            panel.scanYaw = panel.robotYaw
        }
    }

    function place(x, y, yaw) {
        robotX = x
        robotY = y
        robotYaw = yaw
        const last = track.length ? track[track.length - 1] : null
        const step = last === null ? 0 : Math.hypot(x - last.x, y - last.y)
        // A jump means another robot, or this one restarted: begin a new track.
        if (last === null || step > 1) {
            track = [Qt.point(x, y)]
            driven = 0
        } else if (step > 0.08) {
            driven += step
            track = (track.length > 600 ? track.slice(100) : track).concat([Qt.point(x, y)])
        }
    }

    Item {
        id: plane
        anchors.fill: parent
        clip: true
        // Pixels per metre that show the whole map.
        readonly property real scale_: map.received
            ? Math.min(width / map.metresWide, height / map.metresHigh) : 20
        readonly property real originX: width / 2 - (map.received ? map.left + map.metresWide / 2 : 0) * scale_
        readonly property real originY: height / 2 + (map.received ? map.bottom + map.metresHigh / 2 : 0) * scale_

        Image {
            source: map.source
            x: plane.originX + map.left * plane.scale_
            y: plane.originY - (map.bottom + map.metresHigh) * plane.scale_
            width: map.metresWide * plane.scale_
            height: map.metresHigh * plane.scale_
            cache: false
            smooth: true
        }
        Image {
            source: panel.scanSource
            readonly property real size: scan.metres * plane.scale_
            x: plane.originX + panel.scanX * plane.scale_ - size / 2
            y: plane.originY - panel.scanY * plane.scale_ - size / 2
            width: size
            height: size
            rotation: -panel.scanYaw * 180 / Math.PI
            cache: false
            opacity: panel.fresh ? 1 : 0
        }
        Shape {
            id: line
            ShapePath {
                strokeColor: Theme.accent
                strokeWidth: 1.6
                fillColor: "transparent"
                joinStyle: ShapePath.RoundJoin
                capStyle: ShapePath.RoundCap
                PathPolyline {
                    path: panel.track.map(p => Qt.point(plane.originX + p.x * plane.scale_,
                                                        plane.originY - p.y * plane.scale_))
                }
            }
            preferredRendererType: Shape.CurveRenderer
        }
        Shape {
            x: plane.originX + panel.robotX * plane.scale_
            y: plane.originY - panel.robotY * plane.scale_
            rotation: -panel.robotYaw * 180 / Math.PI
            visible: odom.received
            width: 0
            height: 0
            preferredRendererType: Shape.CurveRenderer
            ShapePath {
                strokeColor: "#ffffff"
                strokeWidth: 1.2
                fillColor: panel.fresh ? Theme.warn : Theme.bad
                startX: 12; startY: 0
                PathLine { x: -8; y: -8 }
                PathLine { x: -4; y: 0 }
                PathLine { x: -8; y: 8 }
                PathLine { x: 12; y: 0 }
            }
        }
        Text {
            anchors.centerIn: parent
            visible: !map.received
            textFormat: Text.PlainText
            text: map.problem || "waiting for the map"
            color: Theme.dim
            font.pixelSize: Theme.normal
        }
        // Scale.
        Row {
            anchors { right: parent.right; bottom: parent.bottom }
            spacing: 5
            Text { text: "2 m"; color: Theme.dim; font.pixelSize: 10 }
            Rectangle {
                anchors.verticalCenter: parent.verticalCenter
                width: 2 * plane.scale_; height: 2
                color: Theme.dim
            }
        }
    }
}
