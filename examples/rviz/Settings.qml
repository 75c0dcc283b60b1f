// Settings of the robot, as it has them.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros 1.0

Column {
    id: settings
    spacing: 10
    property bool live
    property string failure
    // ROS keeps parameters on the master: they are there when the robot is not.
    readonly property bool known: speed.ready && live

    Parameter {
        id: speed
        nodeName: "/robot"; name: "max_speed"
        onRejected: settings.failure = reason
    }
    Subscriber { id: lamp; topic: "/flashlight/state"; messageType: "std_msgs/Bool"; timeout: 2000 }

    Text {
        text: "Highest speed   " + (known ? Number(speed.value).toFixed(2) + " m/s" : "unknown")
        color: known ? Theme.text : Theme.bad
        font.pixelSize: 12
    }
    Slider {
        objectName: "speed"
        width: parent.width; height: 24
        enabled: settings.known
        from: 0.1; to: 1.2
        value: speed.value || 0
        onPressedChanged: if (!pressed) speed.value = value
    }
    Push {
        objectName: "flashlight"
        width: parent.width
        text: lamp.stale ? "Flashlight: unknown" : lamp.message.data ? "Flashlight is on" : "Flashlight is off"
        checked: !lamp.stale && lamp.message.data
        tint: Theme.warn
        onClicked: Service.callAsync("/flashlight/set", "std_srvs/SetBool", {data: !checked}, function (response) {
            settings.failure = response && response.success ? "" : "the robot did not answer"
        })
    }
    Text { width: parent.width; wrapMode: Text.Wrap; text: settings.failure; color: Theme.bad; font.pixelSize: 11 }
}
