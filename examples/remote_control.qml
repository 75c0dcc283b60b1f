import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Item {
    Component.onCompleted: Ros2.init("remote_control")
    ImageTransportSubscription { id: camera; topic: "/camera/image_raw"; timeout: 1000 }
    VideoOutput { anchors.fill: parent; source: camera }
    Rectangle {
        anchors { horizontalCenter: parent.horizontalCenter; bottom: parent.bottom }
        width: 120; height: 120; radius: 60; color: "#aaaaaa"
        MouseArea {
            id: stick; anchors.fill: parent
            property var pub: Ros2.createPublisher("/cmd_vel", "geometry_msgs/msg/Twist", Ros2.CommandQoS())
            property int stops: 0
            function axis(at, size) { return Math.max(-1, Math.min(1, 1 - 2 * at / size)) }
            onPressedChanged: stops = 400  // for 2 s, or for 20 s while there is no image
            Component.onDestruction: if (pressed) pub.publish({})
            Timer {
                interval: 50; repeat: true; triggeredOnStart: true; running: stick.pressed || stick.stops > 0
                onTriggered: {
                    stick.stops -= camera.stale ? 1 : 10
                    stick.pub.publish(!stick.pressed || camera.stale ? {} :
                        {linear: {x: stick.axis(stick.mouseY, stick.height)},
                         angular: {z: stick.axis(stick.mouseX, stick.width)}})
                }
            }
        }
    }
    Button {
        anchors.bottom: parent.bottom
        property var pub: Ros2.createPublisher("/flashlight", "std_msgs/msg/Bool", 1)
        property bool isOn: false
        text: "Flashlight: " + (isOn ? "On" : "Off")
        onClicked: pub.publish({data: (isOn = !isOn)})
    }
    Label {
        textFormat: Text.PlainText; color: "red"
        text: !camera.stale ? "" : Ros2.connectionState !== "connected" ? "NO IMAGE: " + Ros2.connectionDetail
            : "NO IMAGE on " + camera.topic + ". " + camera.problem
    }
}
