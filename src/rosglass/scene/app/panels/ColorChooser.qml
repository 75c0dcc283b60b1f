import QtQuick
import QtQuick.Dialogs

// A dialog for the color of a setting, which has each color while one is looked for.
ColorDialog {
    id: chooser

    property color before
    property bool asking: false

    // The setting gets this color.
    signal tried(color value)

    function ask(color, label) {
        title = label
        before = selectedColor = color
        asking = true
        open()
    }
    onSelectedColorChanged: if (asking) tried(selectedColor)
    onAccepted: { tried(selectedColor); asking = false }
    onRejected: { tried(before); asking = false }
}
