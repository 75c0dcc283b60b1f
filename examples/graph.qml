// The ROS graph: topics, services and actions, updated as they change.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 320; padding: 20; spacing: 4
    property string title: "Graph"
    property var topics: []
    function look() {
        const known = Ros2.getTopicNamesAndTypes()
        topics = Object.keys(known).map(function (name) { return name + "  " + known[name] })
    }
    Component.onCompleted: Ros2.init("graph_example")
    Connections { target: Ros2; function onGraphChanged() { look() } }

    Label { textFormat: Text.PlainText; text: "Nodes: " + (topics.length ? Ros2.queryNodes().join(", ") : ""); font.bold: true }
    Label { textFormat: Text.PlainText; text: "Actions: " + (topics.length ? Ros2.queryActions().join(", ") : "") }
    Repeater { model: topics; Label { textFormat: Text.PlainText; text: modelData } }
}
