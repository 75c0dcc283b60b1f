// The messages of a topic, and whether they are live.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Subscription"
    Component.onCompleted: Ros2.init("subscription_example")

    Subscription { id: odom; topic: "/odom" }

    Label { textFormat: Text.PlainText; text: odom.topic + " [" + odom.messageType + "]"; font.bold: true }
    Label {
        readonly property var at: odom.message ? odom.message.pose.pose.position : null
        textFormat: Text.PlainText
        text: at ? "x " + at.x.toFixed(2) + " m, y " + at.y.toFixed(2) + " m" : "nothing yet"
    }
    Label { textFormat: Text.PlainText; text: odom.frequency.toFixed(0) + " Hz, " + (odom.bandwidth / 1024).toFixed(1) + " KiB/s" }
    Label {
        textFormat: Text.PlainText
        text: odom.stale ? "OLD: " + odom.problem : "live, " + (odom.age * 1000).toFixed(0) + " ms old"
        color: odom.stale ? "red" : "green"
    }
}
