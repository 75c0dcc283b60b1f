// The bar of a Cockpit: a button for each page.
import QtQuick 2.15
import RosControls 1.0

Rectangle {
    id: bar

    property Item cockpit: null
    // Windows that were closed.
    readonly property var closed_: cockpit ? cockpit.windows.filter(one => !one.open) : []

    implicitHeight: Theme.touch + 1
    color: Theme.panel
    Accessible.role: Accessible.PageTabList
    Accessible.name: qsTr("Pages")

    // The page whose button is under a point of this item; null without one.
    function pageAt(x, y) {
        const button = row.childAt(x - row.x, y - row.y)
        return button && button.page_ !== undefined ? button.page_ : null
    }

    Rectangle {
        anchors { left: parent.left; right: parent.right; bottom: parent.bottom }
        height: 1
        color: Theme.edge
    }
    Row {
        id: row
        anchors { left: parent.left; leftMargin: Theme.gap / 2; top: parent.top; bottom: parent.bottom; bottomMargin: 1 }
        Repeater {
            model: bar.cockpit ? bar.cockpit.pages : []
            TabButton {
                readonly property Item page_: modelData
                objectName: "page" + index
                height: row.height
                width: Math.min(implicitWidth, (bar.width - Theme.gap - more.width) / Math.max(1, bar.cockpit.pages.length))
                text: page_ && page_.title ? page_.title : qsTr("Page %1").arg(index + 1)
                hint: index < 9 ? qsTr("Ctrl+%1").arg(index + 1) : ""
                selected: bar.cockpit.page === page_
                onClicked: bar.cockpit.showPage(index)
                Keys.onPressed: function(event) {
                    if (edit.item)
                        event.accepted = edit.item.key(event)
                }
                Loader {
                    id: edit
                    anchors.fill: parent
                    active: bar.cockpit !== null && bar.cockpit.editing
                    source: "PageEdit.qml"
                    onLoaded: {
                        item.bar = bar
                        item.page = parent.page_
                        item.index = index
                    }
                }
            }
        }
    }
    Row {
        anchors { right: parent.right; rightMargin: Theme.gap / 2; top: parent.top; bottom: parent.bottom; bottomMargin: 1 }
        Repeater {
            model: bar.closed_
            TabButton {
                objectName: "window" + index
                height: row.height
                text: modelData.title || qsTr("Window")
                name: qsTr("Show the window %1 again").arg(modelData.title)
                onClicked: modelData.open = true
            }
        }
    }
    Loader {
        id: more
        anchors { left: row.right; top: parent.top; bottom: parent.bottom }
        active: bar.cockpit !== null && bar.cockpit.editing
        width: active ? Theme.touch : 0
        sourceComponent: TabButton {
            objectName: "addPage"
            text: "+"
            name: qsTr("Add a page")
            onClicked: bar.cockpit.pageAdded()
        }
    }
}
