// The bar of the editor: file, undo and redo, edit mode, and the robot's connection.
import QtQuick 2.15
import RosControls 1.0

Rectangle {
    id: bar

    // Seconds that have been recorded; negative while nothing is.
    property real recordedSeconds: -1
    // For the tour.
    readonly property Item robotButton: robot
    readonly property Item editButton: edit
    readonly property Item commandsButton: commands

    signal paletteWanted()
    signal fileWanted(string purpose)
    signal helpWanted()

    implicitHeight: Theme.touch + 2 * Theme.gap / 2
    color: Theme.panel
    Accessible.role: Accessible.ToolBar
    Accessible.name: qsTr("Tools")

    Row {
        id: tools
        anchors { left: parent.left; leftMargin: Theme.gap; verticalCenter: parent.verticalCenter }
        spacing: Theme.gap / 2

        ThemeButton { text: qsTr("Home"); visible: program.opened; objectName: "home"; onClicked: program.run("home") }
        ThemeButton { text: qsTr("Open"); objectName: "open"; onClicked: bar.fileWanted("open") }
        ThemeButton {
            objectName: "save"
            text: program.modified ? qsTr("Save •") : qsTr("Save")
            enabled: program.opened && program.modified
            Accessible.name: qsTr("Save")
            onClicked: program.path ? program.save("") : bar.fileWanted("save as")
        }
        ThemeButton {
            id: edit
            objectName: "edit"
            text: program.editing ? qsTr("Done") : qsTr("Edit")
            visible: program.opened
            selected: program.editing
            onClicked: program.run("edit")
        }
        ThemeButton {
            objectName: "undo"
            text: qsTr("Undo")
            visible: program.editing && program.opened
            enabled: program.undoText !== ""
            Accessible.description: program.undoText
            onClicked: program.undo()
        }
        ThemeButton {
            objectName: "redo"
            text: qsTr("Redo")
            visible: program.editing && program.opened
            enabled: program.redoText !== ""
            Accessible.description: program.redoText
            onClicked: program.redo()
        }
        ThemeButton {
            objectName: "recordButton"
            visible: program.opened && program.recording === ""
            text: bar.recordedSeconds < 0 ? qsTr("Record") : qsTr("● Stop recording, %1 s").arg(bar.recordedSeconds.toFixed(0))
            selected: bar.recordedSeconds >= 0
            tint: Theme.bad
            onClicked: program.run("record")
        }
        ThemeButton { id: commands; text: qsTr("Commands …"); objectName: "commands"; onClicked: bar.paletteWanted() }
    }
    ThemeText {
        anchors { left: tools.right; right: robot.left; margins: Theme.gap; verticalCenter: parent.verticalCenter }
        horizontalAlignment: Text.AlignRight
        color: program.connected ? Theme.dim : Theme.warn
        text: program.connection
        Accessible.role: Accessible.StaticText
        Accessible.name: text
    }
    ThemeButton {
        id: robot
        objectName: "robot"
        anchors { right: parent.right; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
        visible: program.opened
        text: program.recording !== "" ? qsTr("Close recording") : program.connected ? qsTr("Robot") : qsTr("Find robot")
        tint: program.connected ? Theme.good : Theme.warn
        onClicked: program.run(program.recording !== "" ? "close recording" : "home")
    }
}
