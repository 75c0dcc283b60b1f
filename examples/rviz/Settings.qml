// Settings of the robot, as it reports them.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros 1.0

Column {
    id: settings
    spacing: 10
    property bool live
    // ROS 1 keeps parameters on the master: they exist without the robot.
    readonly property bool known: speed.ready && live

    Parameter {
        id: speed
        nodeName: "/robot"; name: "max_speed"
        onRejected: refused.text = reason
    }
    Request { id: request }
    Subscriber { id: lamp; topic: "/flashlight/state"; messageType: "std_msgs/Bool"; timeout: 2000 }

    Text {
        textFormat: Text.PlainText
        text: "Highest speed   " + (known ? Number(speed.value).toFixed(2) + " m/s" : "unknown")
        color: known ? Theme.text : Theme.bad
        font.pixelSize: 12
    }
    Slider {
        id: slider
        objectName: "speed"
        width: parent.width; height: 24
        enabled: settings.known
        from: 0.1; to: 1.2
        value: speed.value || 0
        opacity: enabled ? 1 : 0.3
        onPressedChanged: if (pressed) refused.text = ""; else speed.value = value
        background: Rectangle {
            y: (parent.height - height) / 2
            width: parent.width; height: 6; radius: 3
            color: Theme.button
            Rectangle {
                width: slider.handle.x + 8; height: parent.height; radius: 3
                color: Theme.accent
            }
        }
        handle: Rectangle {
            x: slider.visualPosition * (slider.width - width)
            y: (slider.height - height) / 2
            width: 18; height: 18; radius: 9
            color: slider.pressed ? Theme.accent : Theme.text
        }
    }
    Push {
        objectName: "flashlight"
        width: parent.width
        text: lamp.stale ? "Flashlight: unknown" : lamp.message.data ? "Flashlight is on" : "Flashlight is off"
        checked: !lamp.stale && lamp.message.data
        tint: Theme.warn
        onClicked: request.ask("Flashlight", "/flashlight/set", "std_srvs/SetBool", {data: !checked})
    }
    Text {
        width: parent.width
        wrapMode: Text.Wrap
        maximumLineCount: 8
        elide: Text.ElideRight
        textFormat: Text.PlainText
        text: request.note
        color: request.failed ? Theme.bad : Theme.dim
        font.pixelSize: 11
    }
    Text { textFormat: Text.PlainText; id: refused; width: parent.width; wrapMode: Text.Wrap; maximumLineCount: 8; elide: Text.ElideRight; color: Theme.bad; font.pixelSize: 11 }
}
