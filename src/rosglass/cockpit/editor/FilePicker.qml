// Qt's file dialog, for the commands that need a file.
import QtQuick 2.15
import QtQuick.Dialogs

FileDialog {
    id: dialog

    property string purpose_

    function ask(purpose) {
        purpose_ = purpose
        fileMode = purpose === "save as" ? FileDialog.SaveFile : FileDialog.OpenFile
        title = purpose === "save as" ? qsTr("Save the layout") : purpose === "open recording" ? qsTr("Open a recording") : qsTr("Open a layout")
        nameFilters = purpose === "open recording" ? [qsTr("Recordings (*.mcap *.bag *.db3 *.yaml)"), qsTr("All files (*)")]
            : purpose === "save as" ? [qsTr("Layouts (*.qml)")]
            : [qsTr("Layouts (*.qml *.json)"), qsTr("All files (*)")]
        defaultSuffix = purpose === "save as" ? "qml" : ""
        currentFolder = program.folder
        open()
    }
    onAccepted: program.useFile(purpose_, selectedFile)
}
