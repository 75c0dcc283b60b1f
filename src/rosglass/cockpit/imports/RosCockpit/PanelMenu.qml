// The menu of a panel.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T
import RosControls 1.0

T.Popup {
    id: menu

    property Item panel: null
    readonly property Item cockpit_: panel ? panel.cockpit_ : null
    readonly property bool editing_: cockpit_ !== null && cockpit_.editing
    // Name, text and key of each entry.
    readonly property var entries_: {
        if (!panel)
            return []
        let all = []
        if (!panel.detached)
            all.push(["maximize", panel.isMaximized_ ? qsTr("Restore") : qsTr("Maximise"), "F11"])
        all.push(["detach", panel.detached ? qsTr("Put back") : qsTr("Own window"), ""])
        if (editing_)
            all.push(["rename", qsTr("Rename"), "F2"], ["resize", qsTr("Resize by keys"), "F8"],
                ["left", qsTr("Move left"), qsTr("Ctrl+Shift+←")], ["right", qsTr("Move right"), qsTr("Ctrl+Shift+→")],
                ["top", qsTr("Move up"), qsTr("Ctrl+Shift+↑")], ["bottom", qsTr("Move down"), qsTr("Ctrl+Shift+↓")])
        if (editing_ && cockpit_.pages.length > 1)
            for (const page of cockpit_.pages)
                if (page !== cockpit_.page)
                    all.push(["page", qsTr("Move to %1").arg(page.title), "", page])
        if (cockpit_)
            for (const one of cockpit_.panelActions)
                all.push([one.name, one.text, one.keys || ""])
        if (editing_)
            all.push(["remove", qsTr("Remove"), qsTr("Del")])
        all.push(["help", qsTr("Help"), "F1"])
        return all
    }

    function choose_(entry) {
        close()
        const name = entry[0]
        if (name === "maximize")
            panel.toggleMaximized()
        else if (name === "detach")
            panel.toggleDetached()
        else if (name === "help")
            cockpit_.helpRequested(panel)
        else if (name === "rename")
            panel.rename()
        else if (name === "remove")
            cockpit_.removed(panel)
        else if (name === "page")
            cockpit_.moved(panel, entry[3], "center")
        else if (name === "resize")
            cockpit_.drag_.beginResize(panel)
        else if (["left", "right", "top", "bottom"].indexOf(name) >= 0)
            cockpit_.drag_.moveBeside(panel, name)
        else
            cockpit_.actionChosen(panel, name)
    }

    parent: panel ? panel.frame_ : null
    x: parent ? Math.max(0, parent.width - width) : 0
    y: Math.round(24 * Theme.size)
    margins: 4
    padding: Theme.gap / 2
    focus: true
    closePolicy: T.Popup.CloseOnEscape | T.Popup.CloseOnPressOutside
    implicitWidth: contentWidth + 2 * padding
    implicitHeight: contentHeight + 2 * padding
    contentWidth: rows.implicitWidth
    contentHeight: rows.implicitHeight
    onOpened: rows.step(0, 1)
    onClosed: if (panel) panel.focusTitle()

    background: Rectangle {
        color: Theme.panel
        radius: Theme.radius
        border { color: Theme.edge; width: 1 }
    }
    contentItem: FocusScope {
        focus: true
        Accessible.role: Accessible.PopupMenu
        Accessible.name: qsTr("Menu of %1").arg(menu.panel ? menu.panel.title_ : "")
        Column {
            id: rows
            function step(from, by) {
                const count = repeater.count
                if (count)
                    repeater.itemAt((from + count) % count).forceActiveFocus(by > 0 ? Qt.TabFocusReason : Qt.BacktabFocusReason)
            }
            Repeater {
                id: repeater
                model: menu.entries_
                T.AbstractButton {
                    id: row
                    objectName: "menu_" + modelData[0]
                    implicitWidth: label.implicitWidth + keys.implicitWidth + 4 * Theme.gap
                    width: Math.max(implicitWidth, menu.contentItem.width)
                    implicitHeight: Math.round(30 * Theme.size)
                    hoverEnabled: true
                    focusPolicy: Qt.StrongFocus
                    Accessible.role: Accessible.MenuItem
                    Accessible.name: modelData[1]
                    Accessible.onPressAction: clicked()
                    onClicked: menu.choose_(modelData)
                    Keys.onReturnPressed: clicked()
                    Keys.onEnterPressed: clicked()
                    Keys.onDownPressed: rows.step(index + 1, 1)
                    Keys.onUpPressed: rows.step(index - 1, -1)
                    background: Rectangle {
                        radius: Theme.radius / 2
                        color: row.hovered || row.activeFocus ? Theme.track : "transparent"
                    }
                    contentItem: Item {
                        ThemeText {
                            id: label
                            anchors { left: parent.left; leftMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                            text: modelData[1]
                        }
                        ThemeText {
                            id: keys
                            anchors { right: parent.right; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                            text: modelData[2]
                            color: Theme.dim
                            font.pixelSize: Theme.small
                        }
                    }
                }
            }
        }
    }
}
