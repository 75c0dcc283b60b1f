// How fast the robot says it goes, and why it can't be driven when it can't.
import QtQuick

Rectangle {
    id: speed

    required property var odom
    required property var drive
    readonly property real forward: odom.received ? odom.message.twist.twist.linear.x : 0
    readonly property real turn: odom.received ? odom.message.twist.twist.angular.z : 0
    // The widest it may be.
    property real room: 400
    readonly property bool refused: drive.held && !drive.active

    width: refused ? Math.min(room, Math.max(200, text.implicitWidth + 40)) : Math.min(room, 200)
    height: 54
    radius: 12
    color: refused ? "#e0400812" : Theme.shade
    border { width: 1; color: refused ? Theme.bad : Theme.panelEdge }

    Row {
        anchors.centerIn: parent
        spacing: 22
        visible: !speed.refused
        scale: Math.min(1, speed.width / 180)
        opacity: speed.odom.fresh ? 1 : 0.28
        component Reading: Column {
            property string value
            property string unit
            Text {
                anchors.horizontalCenter: parent.horizontalCenter
                textFormat: Text.PlainText
                text: parent.value
                color: Theme.text
                font { pixelSize: 22; weight: Font.DemiBold }
            }
            Text {
                anchors.horizontalCenter: parent.horizontalCenter
                textFormat: Text.PlainText
                text: parent.unit
                color: Theme.dim
                font.pixelSize: 10
            }
        }
        Reading {
            width: 70
            value: speed.odom.received ? speed.forward.toFixed(2) : "–"
            unit: "m/s"
        }
        Reading {
            width: 70
            value: speed.odom.received ? (speed.turn * 180 / Math.PI).toFixed(0) : "–"
            unit: "°/s"
        }
    }
    Text {
        id: text
        anchors.centerIn: parent
        visible: speed.refused
        width: Math.min(implicitWidth, speed.width - 16)
        horizontalAlignment: Text.AlignHCenter
        wrapMode: Text.Wrap
        maximumLineCount: 2
        elide: Text.ElideRight
        textFormat: Text.PlainText
        text: "NOT DRIVING: " + (speed.drive.problem || speed.drive.obstacle || "let go first")
        color: Theme.text
        font { pixelSize: Theme.normal; weight: Font.Bold }
    }
}
