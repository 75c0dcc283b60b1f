// Who we are connected to and how well.
import QtQuick
import RosControls 1.0

Rectangle {
    id: bar

    required property var link
    required property var camera
    height: 44; color: Theme.panel

    ThemeText {
        id: brand
        anchors { left: parent.left; leftMargin: 16; verticalCenter: parent.verticalCenter }
        text: bar.width >= 600 ? "◇ rosglass" : "◇"
        font { pixelSize: 18; weight: Font.DemiBold }
    }
    Rectangle {
        objectName: "linkPill"
        anchors.verticalCenter: parent.verticalCenter
        x: Math.max(brand.x + brand.width + 10,
                    Math.min((parent.width - width) / 2, figures.x - width - 10))
        width: state_.implicitWidth + 44; height: 28; radius: 14; color: Theme.track
        border { color: !bar.link.alive ? Theme.bad : bar.link.problem ? Theme.warn : Theme.good; width: 1 }
        ThemeText {
            id: state_; objectName: "linkText"
            anchors.centerIn: parent
            text: "● " + bar.link.text; color: parent.border.color
            font.weight: Font.DemiBold
        }
    }
    component Figure: ThemeText {
        property string value
        property string label
        text: value + "\n" + label
        horizontalAlignment: Text.AlignRight
        font { pixelSize: Theme.small; weight: Font.DemiBold }
    }
    Row {
        id: figures; visible: bar.width >= 400
        anchors { right: parent.right; rightMargin: 16; verticalCenter: parent.verticalCenter }
        spacing: 18
        Figure {
            objectName: "cameraRate"; label: "camera"
            value: bar.camera.live && bar.camera.framerate >= 0 ? bar.camera.framerate.toFixed(0) + " Hz" : "–"
        }
        Figure {
            label: "latency"
            value: bar.camera.live && bar.camera.latency >= 0 ? bar.camera.latency.toFixed(0) + " ms" : "–"
        }
        Figure {
            visible: bar.width >= 560; label: "time"
            Timer {
                interval: 250; running: true; repeat: true; triggeredOnStart: true
                onTriggered: parent.value = Qt.formatTime(new Date(), "HH:mm:ss")
            }
        }
    }
}
