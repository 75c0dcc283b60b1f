// The system's file dialog, or Qt's own, for the commands that need a file.
import QtQuick 2.15
import QtQuick.Dialogs

FileDialog {
    id: dialog

    property string purpose_
    // Where the name is typed: Qt's own dialog neither has it focused nor accepts it by Return.
    property QtObject nameField_: null
    property bool byReturn_: false

    function ask(purpose) {
        purpose_ = purpose
        byReturn_ = false
        fileMode = purpose === "save as" ? FileDialog.SaveFile : FileDialog.OpenFile
        title = purpose === "save as" ? qsTr("Save the layout") : purpose === "open recording" ? qsTr("Open a recording") : qsTr("Open a layout")
        nameFilters = purpose === "open recording" ? [qsTr("Recordings (*.mcap *.bag *.db3 *.yaml)"), qsTr("All files (*)")]
            : purpose === "save as" ? [qsTr("Layouts (*.qml)")]
            : [qsTr("Layouts (*.qml *.json *.rqml)"), qsTr("All files (*)")]
        defaultSuffix = purpose === "save as" ? "qml" : ""
        currentFolder = program.folder
        if (purpose === "save as")
            selectedFile = program.proposedFile()
        open()
        Qt.callLater(focusName_)
    }
    function focusName_() {
        const field = program.findNameField()
        if (field === null)
            return
        if (field !== nameField_) {
            nameField_ = field
            field.accepted.connect(acceptName_)
        }
        field.forceActiveFocus()
        field.selectAll()
    }
    function acceptName_() {
        if (nameField_.text.trim() === "")
            return
        byReturn_ = true
        accept()
    }
    onAccepted: program.useFile(purpose_, selectedFile, byReturn_)
}
