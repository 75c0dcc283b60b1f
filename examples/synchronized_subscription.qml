// Synchronizes two topics by their time stamps: where was the robot at the time of the scan?
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 180; padding: 20; spacing: 8
    property string title: "Synchronized subscription"
    property real nearest: 0
    property real speed: 0
    property real apart: 0
    Component.onCompleted: Ros2.init("synchronized_example")

    SynchronizedSubscription {
        id: pair
        topics: ["/scan", "/odom"]
        slop: 50                            // maximum distance of the stamps in ms
        onNewMessages: function (messages) {
            const scan = messages[0], odom = messages[1]
            nearest = Math.min.apply(null, scan.ranges.toArray())
            speed = odom.twist.twist.linear.x
            apart = scan.header.stamp.subtract(odom.header.stamp).toJSDuration()
        }
    }

    Label { textFormat: Text.PlainText; text: "nearest obstacle: " + nearest.toFixed(2) + " m" }
    Label { textFormat: Text.PlainText; text: "at a speed of " + speed.toFixed(2) + " m/s" }
    Label { textFormat: Text.PlainText; text: "the stamps are " + Math.abs(apart).toFixed(1) + " ms apart" }
    Label {
        textFormat: Text.PlainText
        text: pair.stale ? "NO PAIRS " + pair.problem : pair.frequency.toFixed(0) + " pairs per second"
        color: pair.stale ? "red" : "green"
    }
}
