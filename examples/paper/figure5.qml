// The paper's Figure 5: a demonstrator for a humanoid robot.
// Start first: python examples/paper/humanoid.py
import QtQuick 2.15
import QtQuick.Controls 2.15
import QtQuick.Layouts 1.15
import Ros2 1.0

Rectangle {
    id: root
    implicitWidth: 860; implicitHeight: 560
    color: "#f2f4f7"
    property string title: "Humanoid"
    property var gestures: ["wave", "nod", "bow", "point"]
    property var speech: Ros2.createPublisher("/humanoid/say", "std_msgs/msg/String", 1)
    property var gesture: Ros2.createPublisher("/humanoid/gesture", "std_msgs/msg/String", 1)
    property var stand: Ros2.createServiceClient("/humanoid/stand", "std_srvs/srv/SetBool")
    readonly property string state_: posture.message ? posture.message.data : "unknown"
    Component.onCompleted: Ros2.init("humanoid_demonstrator")

    function standUp(up) {
        stand.call({data: up}).then(found => note.text = found.success ? "" : found.message,
                                    error => note.text = error.message)
    }

    Subscription { id: posture; topic: "/humanoid/state"; qos: Ros2.QoS().reliable().transient_local() }
    Subscription { id: spoken; topic: "/humanoid/spoken"; qos: Ros2.QoS().reliable().transient_local() }
    Subscription { id: joints; topic: "/humanoid/joints"; timeout: 1000 }
    Subscription { id: heat; topic: "/humanoid/heat"; timeout: 1000; throttleRate: 5 }
    Subscription { id: sonar; topic: "/humanoid/sonar"; timeout: 1000; throttleRate: 10 }

    component Panel: Rectangle {
        property string name
        property bool old: false
        default property alias inner: content.data
        radius: 8; color: "white"
        border.color: old ? "#d03030" : "#d0d6de"; border.width: old ? 3 : 1
        Layout.fillWidth: true; Layout.fillHeight: true
        Label { x: 12; y: 8; font.bold: true; textFormat: Text.PlainText; text: parent.name + (parent.old ? "  (OLD)" : "") }
        Item { id: content; anchors { fill: parent; margins: 12; topMargin: 34 } opacity: parent.old ? 0.4 : 1 }
    }
    component Gauge: Column {
        property string name
        property var value
        property real full: 1
        property string unit
        width: parent ? parent.width : 0
        Label { textFormat: Text.PlainText; text: name + ": " + (value === undefined ? "unknown" : value.toFixed(1) + " " + unit) }
        ProgressBar { width: parent.width; value: (parent.value || 0) / parent.full }
    }

    GridLayout {
        anchors { fill: parent; margins: 12 }
        columns: 2

        Panel {
            name: "State"
            old: posture.stale
            Column {
                spacing: 10
                Label { textFormat: Text.PlainText; text: root.state_; font.pixelSize: 28 }
                Row {
                    spacing: 8
                    Button { text: "Stand up"; enabled: stand.ready; onClicked: standUp(true) }
                    Button { text: "Sit down"; enabled: stand.ready; onClicked: standUp(false) }
                }
                Label { textFormat: Text.PlainText; id: note; color: "#d03030" }
            }
        }
        Panel {
            name: "Gestures"
            Flow {
                anchors.fill: parent
                spacing: 8
                Repeater {
                    model: root.gestures
                    Button {
                        text: modelData
                        contentItem: Label { textFormat: Text.PlainText; text: modelData }
                        enabled: root.state_ === "standing" && !posture.stale
                        highlighted: root.state_ === modelData
                        onClicked: gesture.publish({data: modelData})
                    }
                }
            }
        }
        Panel {
            name: "Speech"
            old: spoken.stale && !!spoken.message
            Column {
                width: parent.width
                spacing: 8
                Row {
                    spacing: 8
                    TextField {
                        id: text
                        placeholderText: "What shall it say?"
                        onAccepted: say()
                        function say() {
                            if (speech.publish({data: text.text})) text.clear()
                        }
                    }
                    Button { text: "Say"; enabled: text.text !== ""; onClicked: text.say() }
                }
                Label { textFormat: Text.PlainText; text: spoken.message ? "said: " + spoken.message.data : "" }
            }
        }
        Panel {
            name: "Sensors"
            old: heat.stale || sonar.stale
            Column {
                width: parent.width
                spacing: 8
                Gauge { name: "temperature"; unit: "°C"; full: 90; value: heat.message ? heat.message.temperature : undefined }
                Gauge { name: "distance"; unit: "m"; full: 4; value: sonar.message ? sonar.message.range : undefined }
            }
        }
        Panel {
            name: "Motors"
            old: joints.stale
            Layout.columnSpan: 2
            Grid {
                width: parent.width
                columns: 3; columnSpacing: 16; rowSpacing: 6
                Repeater {
                    model: joints.message ? joints.message.name.length : 0
                    Column {
                        width: (parent.width - 32) / 3
                        Label {
                            textFormat: Text.PlainText
                            text: joints.message.name.at(index) + "  "
                                  + (joints.message.position.at(index) * 180 / Math.PI).toFixed(0) + "°"
                        }
                        ProgressBar { width: parent.width; to: 25; value: joints.message.effort.at(index) }
                    }
                }
            }
        }
    }
}
