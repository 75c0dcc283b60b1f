// The state of the battery.
import QtQuick 2.15
import Ros 1.0

Panel {
    id: panel
    title: "Battery"
    stale: battery.stale
    readonly property real share: battery.message ? battery.message.percentage : 0
    readonly property color tint: share < 0.15 ? Theme.bad : share < 0.3 ? Theme.warn : Theme.good

    Subscriber { id: battery; topic: "/battery_state"; messageType: "sensor_msgs/BatteryState"; timeout: 2000 }
    Text {
        anchors.horizontalCenter: parent.horizontalCenter
        textFormat: Text.PlainText
        text: battery.message ? (100 * panel.share).toFixed(0) + " %" : "–"
        color: panel.tint
        font { pixelSize: 22; weight: Font.Light }
    }
    Rectangle {
        y: 32; width: parent.width; height: 9; radius: 3
        color: "#16202a"
        Rectangle { width: parent.width * panel.share; height: parent.height; radius: 3; color: panel.tint }
    }
    Text {
        y: 47; anchors.horizontalCenter: parent.horizontalCenter
        textFormat: Text.PlainText
        text: battery.stale ? "" : battery.message.voltage.toFixed(1) + " V"
        color: Theme.dim
        font.pixelSize: 10
    }
}
