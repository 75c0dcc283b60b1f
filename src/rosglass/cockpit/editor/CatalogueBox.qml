// The panels that can be added: those that suit the robot first, then all, by group, with a search.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import RosControls 1.0

FocusScope {
    id: box

    // Gives the keyboard to the search.
    function find() { field.forceActiveFocus(Qt.TabFocusReason) }

    Accessible.role: Accessible.Pane
    Accessible.name: qsTr("Panels to add")

    Rectangle {
        anchors.fill: parent
        color: Theme.panel
        border { color: Theme.edge; width: 1 }
    }
    ThemeField {
        id: field
        objectName: "catalogueSearch"
        anchors { left: parent.left; right: parent.right; top: parent.top; margins: Theme.gap }
        placeholderText: qsTr("Search panels")
        onTextChanged: program.searchCatalogue(text)
        Keys.onDownPressed: list.forceActiveFocus()
        onAccepted: if (list.count) program.add(program.catalogue[0].index)
    }
    ListView {
        id: list
        objectName: "catalogueList"
        anchors { left: parent.left; right: parent.right; top: field.bottom; bottom: parent.bottom; margins: Theme.gap }
        clip: true
        model: program.catalogue
        keyNavigationEnabled: true
        activeFocusOnTab: true
        spacing: 2
        Accessible.role: Accessible.List
        Accessible.name: qsTr("Panels")
        Keys.onReturnPressed: if (currentIndex >= 0) program.add(program.catalogue[currentIndex].index)
        delegate: Rectangle {
            width: list.width
            height: texts.height + Theme.gap
            radius: Theme.radius
            color: area.containsMouse || ListView.isCurrentItem && list.activeFocus ? Theme.track : "transparent"
            Accessible.role: Accessible.ListItem
            Accessible.name: modelData.title + ". " + modelData.line
            Accessible.onPressAction: program.add(modelData.index)
            Rectangle {
                id: icon
                x: Theme.gap / 2
                anchors.verticalCenter: parent.verticalCenter
                width: 26 * Theme.size; height: width
                radius: Theme.radius
                color: modelData.fits ? Theme.accent : Theme.track
                ThemeText {
                    anchors.centerIn: parent
                    text: modelData.icon
                    color: modelData.fits ? Theme.onAccent : Theme.dim
                    font.weight: Font.Bold
                }
            }
            Column {
                id: texts
                anchors { left: icon.right; right: parent.right; leftMargin: Theme.gap / 2; verticalCenter: parent.verticalCenter }
                ThemeText { width: parent.width; text: modelData.title; font.weight: Font.DemiBold }
                ThemeText { width: parent.width; text: modelData.line; color: Theme.dim; font.pixelSize: Theme.small; wrapMode: Text.Wrap; maximumLineCount: 2 }
            }
            MouseArea {
                id: area
                anchors.fill: parent
                hoverEnabled: true
                onClicked: program.add(modelData.index)
            }
        }
        ThemeText {
            anchors.centerIn: parent
            width: parent.width - 2 * Theme.gap
            visible: list.count === 0
            text: qsTr("No panel has this name.")
            wrapMode: Text.Wrap
            horizontalAlignment: Text.AlignHCenter
            color: Theme.dim
        }
        T.ScrollBar.vertical: ThemeScrollBar {}
    }
}
