// A robot's parameter on a slider: the range and the description come from the robot.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 320; padding: 20; spacing: 8
    property string title: "Parameter"
    Component.onCompleted: Ros2.init("parameter_example")

    Parameter { id: speed; nodeName: "/robot"; name: "max_speed"; onRejected: function (reason) { note.text = reason } }

    Label { textFormat: Text.PlainText; text: speed.description || speed.name }
    Slider {
        enabled: speed.ready
        from: speed.minimum || 0
        to: speed.maximum || 1
        value: speed.value || 0
        onMoved: speed.value = value
    }
    Label { textFormat: Text.PlainText; text: speed.ready ? Number(speed.value).toFixed(2) + " m/s" : "waiting for " + speed.nodeName }
    Label { textFormat: Text.PlainText; id: note; color: "red" }
}
