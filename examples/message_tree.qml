// The messages of any topic as a tree.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Messages of any type"
    Component.onCompleted: Ros2.init("tree_example")

    Subscription { id: battery; topic: "/battery_state" }
    MessageItemModel { id: tree; message: battery.message; messageType: battery.messageType }

    Label { textFormat: Text.PlainText; text: battery.topic + " [" + battery.messageType + "]"; font.bold: true }
    Repeater {
        model: tree
        Label { textFormat: Text.PlainText; text: model.display + ": " + tree.data(tree.index(index, 1)) }
    }
}
