// Who we are connected to and how well.
import QtQuick
import Ros2 1.0

Rectangle {
    id: bar

    required property var link
    // Whether the camera's figures are about now.
    property bool live: false
    property real framerate: -1
    property real latency: -1
    height: 44
    color: Theme.panel

    Rectangle {
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        height: 1
        color: Theme.panelEdge
    }
    Row {
        id: brand
        anchors { left: parent.left; leftMargin: 16; verticalCenter: parent.verticalCenter }
        spacing: 10
        Rectangle {
            anchors.verticalCenter: parent.verticalCenter
            width: 20; height: 20; radius: 5
            rotation: 45
            color: "transparent"
            border { color: Theme.accent; width: 2 }
            Rectangle {
                anchors.centerIn: parent
                width: 7; height: 7; radius: 2
                color: Theme.accent
            }
        }
        Text {
            anchors.verticalCenter: parent.verticalCenter
            visible: bar.width >= 600
            text: "rosglass"
            color: Theme.text
            font { pixelSize: 18; weight: Font.DemiBold; letterSpacing: 0.5 }
        }
    }
    Rectangle {
        objectName: "linkPill"
        anchors.verticalCenter: parent.verticalCenter
        x: Math.max(brand.x + brand.width + 10,
                    Math.min((parent.width - width) / 2, figures.x - width - 10))
        width: state_.width + 44
        height: 28
        radius: 14
        readonly property color tint: !bar.link.alive ? Theme.bad : bar.link.problem ? Theme.warn : Theme.good
        color: !bar.link.alive ? "#33060c" : bar.link.problem ? "#33270a" : "#12291f"
        border { color: tint; width: 1 }
        Row {
            id: state_
            anchors.centerIn: parent
            spacing: 8
            Rectangle {
                anchors.verticalCenter: parent.verticalCenter
                width: 9; height: 9; radius: 5
                color: state_.parent.tint
            }
            Text {
                objectName: "linkText"
                anchors.verticalCenter: parent.verticalCenter
                textFormat: Text.PlainText
                text: bar.link.text
                color: bar.link.alive ? Theme.text : Theme.bad
                font { pixelSize: Theme.normal; weight: Font.DemiBold }
            }
        }
    }
    Row {
        id: figures
        visible: bar.width >= 400
        anchors { right: parent.right; rightMargin: 16; verticalCenter: parent.verticalCenter }
        spacing: 18
        component Figure: Column {
            property string value
            property string label
            Text {
                anchors.right: parent.right
                textFormat: Text.PlainText
                text: parent.value
                color: Theme.text
                font { pixelSize: Theme.normal; weight: Font.DemiBold }
            }
            Text {
                anchors.right: parent.right
                textFormat: Text.PlainText
                text: parent.label
                color: Theme.dim
                font.pixelSize: 9
            }
        }
        Figure {
            objectName: "cameraRate"
            label: "camera"
            value: bar.live && bar.framerate >= 0 ? bar.framerate.toFixed(0) + " Hz" : "–"
        }
        Figure {
            label: "latency"
            value: bar.live && bar.latency >= 0 ? bar.latency.toFixed(0) + " ms" : "–"
        }
        Figure {
            visible: bar.width >= 560
            label: "time"
            value: clock.text
            Timer {
                id: clock
                property string text: Qt.formatTime(new Date(), "HH:mm:ss")
                interval: 250
                running: true
                repeat: true
                onTriggered: text = Qt.formatTime(new Date(), "HH:mm:ss")
            }
        }
    }
}
