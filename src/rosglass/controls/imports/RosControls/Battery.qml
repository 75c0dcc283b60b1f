// How much is left in a battery, and for how long, of sensor_msgs/BatteryState.
import QtQuick 2.15
import RosControls 1.0
import "fields.js" as Fields

LiveFrame {
    id: battery

    // The topic; without one, the first of this type.
    property string topic
    property string ns
    // Shares of the capacity from 0 to 1 below which it is shown as low and as empty.
    property real low: 0.3
    property real empty: 0.15

    // From 0 to 1; NaN while unknown.
    readonly property real percentage: message && message.percentage >= 0 ? Math.min(1, message.percentage)
        : message && message.charge >= 0 && message.capacity > 0 ? Math.min(1, message.charge / message.capacity) : NaN
    readonly property bool charging: !!message && (message.power_supply_status === 1 || message.power_supply_status === 4)
    // Seconds until it is empty, or full while it is charged; NaN while unknown.
    readonly property real timeLeft: {
        if (!message || !(message.charge >= 0) || !(Math.abs(message.current) > 0.01))
            return NaN
        const rest = charging ? message.capacity - message.charge : message.charge
        return rest >= 0 ? 3600 * rest / Math.abs(message.current) : NaN
    }
    readonly property var message: live.message

    readonly property color tint: isNaN(percentage) ? Theme.dim : percentage < empty ? Theme.bad
        : percentage < low ? Theme.warn : Theme.good

    function duration_(seconds) {
        const minutes = Math.round(seconds / 60)
        return minutes < 60 ? qsTr("%1 min").arg(minutes) : Fields.fill(qsTr("%1 h %2 min"), [Math.floor(minutes / 60), minutes % 60])
    }

    title: qsTr("Battery")
    source: live
    contentHeight: column.height
    note: message && message.voltage > 0 ? qsTr("%1 V").arg(message.voltage.toFixed(1)) : ""
    Accessible.description: status || share.text + (charging ? " " + qsTr("charging") : "")

    LiveTopic {
        id: live
        topic: battery.topic
        ns: battery.ns
        types: ["sensor_msgs/msg/BatteryState"]
    }

    Column {
        id: column
        width: parent.width
        spacing: Theme.gap / 2

        ThemeText {
            id: share
            objectName: "share"
            text: isNaN(battery.percentage) ? qsTr("? %") : qsTr("%1 %").arg((100 * battery.percentage).toFixed(0))
            color: battery.tint
            font { pixelSize: Theme.large * 1.4; weight: Font.Light }
        }
        Rectangle {
            width: parent.width
            height: Theme.gap
            radius: height / 2
            color: Theme.track
            Rectangle {
                width: isNaN(battery.percentage) ? 0 : parent.width * battery.percentage
                height: parent.height
                radius: height / 2
                color: battery.tint
            }
        }
        ThemeText {
            width: parent.width
            text: {
                const parts = []
                if (battery.charging)
                    parts.push(qsTr("charging"))
                if (battery.message && Math.abs(battery.message.current) >= 0)
                    parts.push(qsTr("%1 A").arg(Math.abs(battery.message.current).toFixed(1)))
                if (!isNaN(battery.timeLeft))
                    parts.push(battery.charging ? qsTr("full in %1").arg(battery.duration_(battery.timeLeft))
                               : qsTr("%1 left").arg(battery.duration_(battery.timeLeft)))
                return parts.join(" · ")
            }
            color: battery.charging ? Theme.good : Theme.dim
            wrapMode: Text.Wrap
            maximumLineCount: 2
            font.pixelSize: Theme.small
        }
    }
}
