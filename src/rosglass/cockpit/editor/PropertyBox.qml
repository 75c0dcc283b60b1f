// The form of the selected panel.
import QtQuick 2.15
import RosControls 1.0
import ".."

FocusScope {
    id: box

    // Gives the keyboard to the title.
    function find() { title.forceActiveFocus(Qt.TabFocusReason) }

    Accessible.role: Accessible.Pane
    Accessible.name: qsTr("The selected panel")

    Rectangle {
        anchors.fill: parent
        color: Theme.panel
        border { color: Theme.edge; width: 1 }
    }
    ThemeField {
        id: title
        objectName: "panelTitle"
        anchors { left: parent.left; right: remove.left; top: parent.top; margins: Theme.gap }
        placeholderText: qsTr("Title of the panel")
        text: program.selectedTitle
        onEditingFinished: if (text !== program.selectedTitle) program.rename(text)
    }
    ThemeButton {
        id: remove
        objectName: "remove"
        anchors { right: parent.right; top: parent.top; margins: Theme.gap }
        text: qsTr("Remove")
        tint: Theme.bad
        onClicked: program.run("remove")
    }
    PropertyForm {
        objectName: "form"
        anchors { left: parent.left; right: parent.right; top: title.bottom; bottom: parent.bottom; margins: Theme.gap }
        model: program.form
        onHelpRequested: function(page) { program.help(page) }
    }
}
