// Whether the robot is there: judged by what it sends, not by what the middleware believes.
import QtQuick
import Ros2 1.0

QtObject {
    id: link

    // The feed that beats fastest.
    required property var pulse
    readonly property bool alive: pulse.fresh
    // Why what is shown may be another robot's.
    readonly property string problem: pulse.subscription.problem
    readonly property string text: alive ? (problem ? "CHECK THE ROBOT" : "CONNECTED")
        : pulse.received ? "ROBOT LOST " + pulse.age.toFixed(0) + " s AGO" : "WAITING FOR THE ROBOT"
    // Why there is nothing to see, for the places that have room for it.
    readonly property string reason: alive ? ""
        : Ros2.connectionState === "connected"
            ? "the " + Ros2.connectionDetail + " answers, the robot does not" : Ros2.connectionDetail
}
