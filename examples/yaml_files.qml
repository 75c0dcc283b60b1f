// Saves the operator's settings: a YAML file is read at the start and written at the end.
import QtQuick 2.15
import QtQuick.Controls 2.15
import Ros2 1.0

Column {
    width: 480; height: 180; padding: 20; spacing: 8
    property string title: "YAML files"
    readonly property string file: "/tmp/rosglass_example.yaml"
    property var settings: ({speed: 0.5, seen: 0})
    Component.onCompleted: {
        Ros2.init("yaml_example")
        save()                                      // false if it cannot be written
        settings = Ros2.io.readYaml(file) || settings
    }
    function save() { return Ros2.io.writeYaml(file, {speed: slider.value, opened: Ros2.now()}) }

    Slider { id: slider; value: settings.speed; onMoved: note.text = save() ? "saved" : "NOT SAVED" }
    Label { textFormat: Text.PlainText; text: "speed " + slider.value.toFixed(2) + " m/s, in " + file }
    Label { textFormat: Text.PlainText; text: settings.opened ? "opened at " + settings.opened.toJSDate().toLocaleTimeString() : "" }
    Label { textFormat: Text.PlainText; id: note }
}
