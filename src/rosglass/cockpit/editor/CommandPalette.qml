// Ctrl+P: every command, found by typing a part of its name.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import RosControls 1.0

T.Popup {
    id: palette

    readonly property var found: program.commands(field.text)

    function carryOut(index) {
        if (index < 0 || index >= found.length)
            return
        const one = found[index]
        close()
        if (one.file)
            files.ask(one.name)
        else if (one.name !== "palette")
            program.run(one.name)
    }

    parent: T.Overlay.overlay
    x: parent ? (parent.width - width) / 2 : 0
    y: 60
    width: parent ? Math.min(640 * Theme.size, parent.width - 2 * Theme.gap) : 100
    height: Math.min(420 * Theme.size, (parent ? parent.height : 600) - 120)
    modal: true
    focus: true
    padding: Theme.gap
    onAboutToShow: program.halt()
    onOpened: { field.clear(); field.forceActiveFocus(); list.currentIndex = 0 }

    background: Rectangle {
        color: Theme.panel
        radius: Theme.radius
        border { color: Theme.accent; width: 1 }
    }
    contentItem: FocusScope {
        ThemeField {
            id: field
            objectName: "paletteField"
            anchors { left: parent.left; right: parent.right; top: parent.top }
            focus: true
            placeholderText: qsTr("Type a command")
            onTextChanged: list.currentIndex = 0
            Keys.onDownPressed: list.incrementCurrentIndex()
            Keys.onUpPressed: list.decrementCurrentIndex()
            onAccepted: palette.carryOut(list.currentIndex)
        }
        ListView {
            id: list
            objectName: "paletteList"
            anchors { left: parent.left; right: parent.right; top: field.bottom; bottom: parent.bottom; topMargin: Theme.gap }
            clip: true
            model: palette.found
            Accessible.role: Accessible.List
            Accessible.name: qsTr("Commands")
            delegate: Rectangle {
                width: list.width
                height: Theme.touch
                radius: Theme.radius
                color: ListView.isCurrentItem ? Theme.track : "transparent"
                Accessible.role: Accessible.ListItem
                Accessible.name: modelData.text
                Accessible.onPressAction: palette.carryOut(index)
                ThemeText {
                    anchors { left: parent.left; right: keys.left; margins: Theme.gap; verticalCenter: parent.verticalCenter }
                    text: modelData.text
                }
                ThemeText {
                    id: keys
                    anchors { right: parent.right; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                    text: modelData.shown
                    color: Theme.dim
                }
                MouseArea { anchors.fill: parent; onClicked: palette.carryOut(index) }
            }
            ThemeText {
                anchors.centerIn: parent
                visible: list.count === 0
                text: qsTr("No command has this name.")
                color: Theme.dim
            }
            T.ScrollBar.vertical: ThemeScrollBar {}
        }
    }
}
