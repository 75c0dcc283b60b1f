// What the operator wants the robot to do, as a stream of geometry_msgs/msg/Twist.
//
// Sends 20 times a second while a stick or key is held; several zeros when it is let go, however
// that happens, and for as long as the robot is lost; nothing otherwise, so that others may drive.
// Once blocked (emergency stop, no live image, window not in front) it stays off until everything was
// let go.
import QtQuick
import Ros2 1.0

QtObject {
    id: drive

    property string topic: "/cmd_vel"
    property real maxSpeed: 0.9
    property real maxTurn: 1.2
    // Why driving is not allowed now; empty when it is.
    property string obstacle
    // Wanted motion, each from -1 to 1: forwards, and to the left.
    property real forward: 0
    property real left: 0
    property bool held: false
    property bool armed: false
    readonly property bool active: held && armed
    property string problem
    // Whether the robot is there: before it is, zeros may not arrive.
    property bool reachable: true

    property var publisher: null
    Component.onCompleted: publisher = Ros2.createPublisher(topic, "geometry_msgs/msg/Twist", Ros2.CommandQoS())
    // Zeros to send while the robot is there, and in all. The former take a second: longer than it
    // takes to notice an outage, in which all zeros until then would have been dropped.
    property int zeros: 0
    property int attempts: 0

    // Take or change what is wanted; the stick and the keys call this.
    function steer(forward, left) {
        if (!held) {
            held = true
            armed = obstacle === ""
        }
        drive.forward = Math.max(-1, Math.min(1, forward))
        drive.left = Math.max(-1, Math.min(1, left))
        if (armed && !timer.running) {
            send()
            timer.start()
        }
    }

    // Released: send the stop more than once, in case a message is lost.
    function release() {
        const was = active
        held = armed = false
        forward = left = 0
        if (was)
            halt()
    }

    function halt() {
        zeros = 20
        attempts = 1200
        send()
        timer.start()
    }

    function send() {
        try {
            const sent = publisher.publish({
                linear: { x: active ? maxSpeed * forward : 0 },
                angular: { z: active ? maxTurn * left : 0 }
            })
            problem = sent ? "" : publisher.problem || "command not sent: no connection"
        } catch (error) {
            problem = String(error.message || error)
        }
    }

    onObstacleChanged: {
        if (obstacle !== "" && armed) {
            armed = false
            halt()
        }
    }

    property Timer timer: Timer {
        interval: 50
        repeat: true
        onTriggered: {
            if (!drive.active) {
                drive.attempts -= 1
                if (drive.reachable)
                    drive.zeros -= 1
                if (drive.zeros <= 0 || drive.attempts <= 0)
                    stop()
            }
            drive.send()
        }
    }
}
