// Switches the robot's lamp; lit when the robot says it is.
import QtQuick
import Ros2 1.0

Rectangle {
    id: lamp

    readonly property bool on: state_.fresh && state_.message.data
    property var publisher: null
    Component.onCompleted: publisher = Ros2.createPublisher("/flashlight", "std_msgs/msg/Bool", 1)

    function toggle() {
        publisher.publish({ data: !on })
    }

    property Feed state_: Feed {
        topic: "/flashlight/state"
        messageType: "std_msgs/msg/Bool"
        urgent: true
    }

    activeFocusOnTab: true
    Keys.onReturnPressed: function (event) { if (!event.isAutoRepeat) toggle() }
    Keys.onEnterPressed: function (event) { if (!event.isAutoRepeat) toggle() }

    width: 54
    height: 54
    radius: 27
    color: on ? "#fff2b8" : Theme.shade
    border { color: on ? Theme.warn : Theme.faint; width: 2 }
    opacity: state_.fresh ? 1 : 0.4

    FocusRing {
        item: lamp
        radius: width / 2
    }
    Rectangle {
        anchors { horizontalCenter: parent.horizontalCenter; top: parent.top; topMargin: 13 }
        width: 16; height: 16; radius: 8
        color: lamp.on ? Theme.warn : "transparent"
        border { color: lamp.on ? "#8a5a00" : Theme.dim; width: 2 }
    }
    Rectangle {
        anchors { horizontalCenter: parent.horizontalCenter; top: parent.top; topMargin: 30 }
        width: 8; height: 9; radius: 2
        color: lamp.on ? "#8a5a00" : Theme.dim
    }
    MultiPointTouchArea {
        anchors.fill: parent
        maximumTouchPoints: 1
        onPressed: lamp.toggle()
    }
}
