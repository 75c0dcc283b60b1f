import QtQuick 2.15
import QtQuick.Controls 2.15
import QtQuick.Layouts 1.15

// A clock, tool buttons and a map's legend at the top, a dashboard at the bottom.
Item {
    id: root

    property bool animated: false
    property real turn: 0

    NumberAnimation on turn { from: 0; to: 1; duration: 2000; loops: -1; running: root.animated }

    component Panel: Rectangle { color: "#c0202830"; radius: 8; border.color: "#406080" }
    component Label: Text { color: "#d0e0f0"; font.pixelSize: 14 }

    Panel {
        x: 20; y: 20; width: 150; height: 44
        Label { anchors.centerIn: parent; text: "12:34:56"; font.pixelSize: 24 }
    }

    Row {
        anchors { top: parent.top; horizontalCenter: parent.horizontalCenter; topMargin: 20 }
        spacing: 8
        Repeater {
            model: ["Move", "Select", "Measure", "Goal", "Pose"]
            Button { text: modelData; width: 88; height: 36 }
        }
    }

    Panel {
        anchors { right: parent.right; top: parent.top; margins: 20 }
        width: 200; height: 150
        Column {
            anchors { fill: parent; margins: 12 }
            spacing: 6
            Repeater {
                model: ["Obstacles", "Free space", "Unknown", "Planned path", "Victims"]
                Row {
                    spacing: 8
                    Rectangle { width: 16; height: 16; color: Qt.hsva(index / 5, 0.7, 0.9, 1) }
                    Label { text: modelData }
                }
            }
        }
    }

    Panel {
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom; margins: 12 }
        height: 150
        RowLayout {
            anchors { fill: parent; margins: 12 }
            spacing: 16
            Button { text: "STOP"; Layout.preferredWidth: 120; Layout.fillHeight: true }
            Item {
                Layout.preferredWidth: 126; Layout.fillHeight: true
                Rectangle {
                    anchors.centerIn: parent
                    width: 120; height: 120; radius: 60
                    color: "#102030"; border.color: "#80a0c0"; border.width: 2
                }
                Rectangle {
                    anchors.centerIn: parent
                    width: 100; height: 4; color: "#ff8000"; antialiasing: true
                    rotation: 360 * root.turn
                }
            }
            Column {
                Layout.fillWidth: true
                spacing: 8
                Repeater {
                    model: ["Battery", "Signal", "Temperature", "Speed"]
                    Row {
                        spacing: 8
                        Label { text: modelData; width: 100 }
                        Rectangle {
                            width: 180; height: 14; color: "#405060"
                            Rectangle {
                                width: parent.width * (0.3 + 0.2 * index * (1 - root.turn)); height: 14
                                color: "#40c080"
                            }
                        }
                        Label { text: (10 * index + 5 * root.turn).toFixed(2) }
                    }
                }
            }
            Rectangle { Layout.preferredWidth: 168; Layout.fillHeight: true; color: "#304860" }
            Rectangle { Layout.preferredWidth: 168; Layout.fillHeight: true; color: "#486030" }
        }
    }
}
