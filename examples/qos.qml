// QoS profiles: what a topic offers, what is requested, and whether they match.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 180; padding: 20; spacing: 8
    property string title: "Profiles (QoS)"
    Component.onCompleted: Ros2.init("qos_example")

    // Latched: late subscribers receive the last message, too.
    Subscription { id: map; topic: "/map"; qos: Ros2.QoS().reliable().transient_local() }
    // The laser offers best effort only: scan.problem would report a request for reliable().
    Subscription { id: scan; topic: "/scan"; qos: Ros2.SensorDataQoS() }

    property string mapOffer: ""
    property string scanOffer: ""
    Connections {
        target: Ros2
        function onGraphChanged() { mapOffer = offered(map.topic); scanOffer = offered(scan.topic) }
    }
    function offered(topic) {
        return Ros2.getPublishersInfo(topic).map(function (one) {
            return one.qos.reliability + ", " + one.qos.durability
        }).join("; ")
    }

    Label { textFormat: Text.PlainText; text: map.topic + " offers " + mapOffer; font.bold: true }
    Label { textFormat: Text.PlainText; text: map.message ? map.message.info.width + " x " + map.message.info.height + " cells" : "no map yet"; color: map.stale ? "red" : "black" }
    Label { textFormat: Text.PlainText; text: scan.topic + " offers " + scanOffer; font.bold: true }
    Label { textFormat: Text.PlainText; text: scan.problem || (scan.message ? scan.frequency.toFixed(0) + " Hz" : "nothing yet") }
}
