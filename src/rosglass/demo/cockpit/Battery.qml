// How much is left in the battery, and whether it fills or empties.
import QtQuick
import Ros2 1.0

Panel {
    id: panel
    title: "Battery"
    fresh: state_.fresh
    age: state_.age
    note: state_.received ? state_.message.voltage.toFixed(1) + " V" : ""

    readonly property real share: state_.received ? state_.message.percentage : 0
    readonly property bool charging: state_.received && (state_.message.power_supply_status === 1
                                                         || state_.message.power_supply_status === 4)
    readonly property color tint: share < 0.15 ? Theme.bad : share < 0.3 ? Theme.warn : Theme.good

    property Feed state_: Feed {
        topic: "/battery_state"
        messageType: "sensor_msgs/msg/BatteryState"
        limit: 1.5
    }

    Column {
        id: column
        anchors.centerIn: parent
        // Not a scale: the window's native text does not shrink well.
        readonly property real part: Math.max(0.2, Math.min(1, parent.width / 128, parent.height / 105))
        width: 128 * part
        spacing: 8 * part
        Row {
            anchors.horizontalCenter: parent.horizontalCenter
            Text {
                objectName: "charge"
                textFormat: Text.PlainText
                text: panel.state_.received ? (100 * panel.share).toFixed(1) : "–"
                color: panel.tint
                font { pixelSize: Math.round(36 * column.part); weight: Font.Light }
            }
            Text {
                text: " %"
                y: 16 * column.part
                color: Theme.dim
                font.pixelSize: Math.round(16 * column.part)
            }
        }
        Item {
            anchors.horizontalCenter: parent.horizontalCenter
            width: parent.width
            height: 26 * column.part
            Rectangle {
                anchors { fill: parent; rightMargin: 6 * column.part }
                radius: 5
                color: "transparent"
                border { color: Theme.faint; width: 2 }
                Row {
                    anchors { fill: parent; margins: 5 * column.part }
                    spacing: 3 * column.part
                    Repeater {
                        model: 10
                        Rectangle {
                            required property int index
                            width: (parent.width - 9 * parent.spacing) / 10
                            height: parent.height
                            radius: 2
                            color: panel.share * 10 > index + 0.25 ? panel.tint : "#16202a"
                        }
                    }
                }
            }
            Rectangle {
                anchors { right: parent.right; verticalCenter: parent.verticalCenter }
                width: 4 * column.part; height: 12 * column.part; radius: 2
                color: Theme.faint
            }
        }
        Text {
            anchors.horizontalCenter: parent.horizontalCenter
            textFormat: Text.PlainText
            text: !panel.state_.received ? ""
                : (panel.charging ? "charging " : "") + Math.abs(panel.state_.message.current).toFixed(1) + " A"
            color: panel.charging ? Theme.good : Theme.dim
            font.pixelSize: Math.max(9, Math.round(Theme.normal * column.part))
        }
    }
}
