// A recording instead of a robot: the same elements, and a time slider.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    id: root
    width: 480; height: 340; padding: 20; spacing: 8
    property string title: "Replay"
    Component.onCompleted: Ros2.init("replay_example")

    // Set to empty, the interface connects to the robot again.
    Replay { id: replay; file: Qt.resolvedUrl("drive.mcap"); loop: true }

    // The track drawn so far is of another time.
    Connections { target: Ros2; function onUrlChanged() { trail.points = [] } }
    Subscription {
        topic: "/odom"
        onNewMessage: function (message) {
            const at = message.pose.pose.position
            trail.points = trail.points.concat([Qt.point(at.x, at.y)]).slice(-400)
            trail.requestPaint()
        }
    }

    Canvas {
        id: trail
        property var points: []
        width: 440; height: 220
        onPaint: {
            const pen = getContext("2d")
            pen.fillStyle = "#202830"
            pen.fillRect(0, 0, width, height)
            const last = points[points.length - 1]
            if (!last)
                return
            pen.fillStyle = "lightskyblue"
            for (const p of points)      // 100 pixels per metre; the robot in the middle, x upwards
                pen.fillRect(width / 2 - 100 * (p.y - last.y), height / 2 - 100 * (p.x - last.x), 3, 3)
        }
    }
    Slider {
        width: 440
        to: replay.duration
        value: replay.position
        onMoved: replay.seek(value)
    }
    Row {
        spacing: 8
        Button { text: replay.playing ? "Pause" : "Play"; onClicked: replay.playing = !replay.playing }
        Button { text: replay.rate + " x"; onClicked: replay.rate = replay.rate === 1 ? 4 : 1 }
        Label {
            textFormat: Text.PlainText
            text: replay.position.toFixed(1) + " of " + replay.duration.toFixed(1) + " s  " + replay.problem
        }
    }
}
