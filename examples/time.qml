// Times and durations, exact to the nanosecond.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Time"
    property var now: Ros2.now()
    Component.onCompleted: Ros2.init("time_example")
    Timer { interval: 100; repeat: true; running: true; onTriggered: now = Ros2.now() }

    Subscription { id: odom; topic: "/odom" }

    Label { textFormat: Text.PlainText; text: "now: " + now.toJSDate().toLocaleTimeString() }
    Label { textFormat: Text.PlainText; text: "seconds: " + now.seconds().toFixed(3) }
    Label {
        textFormat: Text.PlainText
        text: odom.message ? "the odometry's stamp: "
                             + odom.message.header.stamp.toJSDate().toLocaleTimeString()
                           : "no odometry yet"
        color: odom.stale ? "red" : "black"
    }
}
