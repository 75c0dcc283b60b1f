// The module Ros 1.0, with the names of ROS 1. The same file works with ROS 1 and ROS 2 robots.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros 1.0

Row {
    padding: 20; spacing: 20
    property string title: "Ros 1.0"
    property var velocity: Ros.advertise("geometry_msgs/Twist", "/cmd_vel", Ros.CommandQoS())
    Component.onCompleted: Ros.init("panel")

    ImageItem {
        width: 320; height: 240
        source: ImageTransportSubscriber { id: camera; topic: "/camera/image_raw" }
    }
    Column {
        width: 220; spacing: 8
        Subscriber { id: odom; topic: "/odom"; queueSize: 1; timeout: 1000 }
        Label {
            readonly property var at: odom.message ? odom.message.pose.pose.position : null
            textFormat: Text.PlainText
            text: at ? "x " + at.x.toFixed(2) + " m, y " + at.y.toFixed(2) + " m" : "nothing yet"
            color: odom.stale ? "red" : "black"
        }
        Label { textFormat: Text.PlainText; text: odom.message ? "stamp " + odom.message.header.stamp.toSec().toFixed(2) + " s" : ""; color: odom.stale ? "red" : "black" }
        Label { textFormat: Text.PlainText; id: clock }
        Timer {
            interval: 100; repeat: true; running: true
            onTriggered: clock.text = "now " + Time.now().toSec().toFixed(2) + " s"
        }
        Button { text: "Stop"; onClicked: stopping.left = 400 }
        Timer {
            id: stopping
            property int left: 0  // for 2 s, or for 20 s while the robot is lost
            interval: 50; repeat: true; triggeredOnStart: true; running: left > 0
            onTriggered: { left -= odom.stale ? 1 : 10; velocity.publish({}) }
        }
        Button {
            text: "Flashlight"
            onClicked: Service.callAsync("/flashlight/set", "std_srvs/SetBool", {data: true},
                                         function (response) { Ros.info(response ? response.message : "no answer") })
        }
    }
}
