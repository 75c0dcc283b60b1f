// The bar of Tabs: a button for each of its panels, and the buttons of the one that is shown.
import QtQuick 2.15
import RosControls 1.0

Rectangle {
    id: bar

    property Item tabs: null
    readonly property Item panel_: tabs && tabs.currentItem && tabs.currentItem.element_ === "panel" ? tabs.currentItem : null

    height: Math.round(26 * Theme.size)
    color: Theme.panel
    radius: Theme.radius / 2
    Accessible.role: Accessible.PageTabList
    Accessible.name: qsTr("Tabs")

    // See Tabs.tabAt(); behind the last tab is its far side.
    function tabAt(x, y) {
        const last = row.children[tabs.count - 1]
        const button = x >= row.width ? last : row.childAt(x, y)
        if (!button || button.number_ === undefined)
            return null
        const after = x > button.x + button.width / 2
        return { item: button.element_, edge: after ? "after" : "before", rect: Qt.rect(button.x + (after ? button.width : 0) - 2, 0, 4, height) }
    }

    HoverHandler { id: hover }
    Row {
        id: row
        anchors { left: parent.left; top: parent.top; bottom: parent.bottom }
        Repeater {
            model: bar.tabs ? bar.tabs.elements_ : []
            TabButton {
                id: tab
                readonly property int number_: index
                readonly property Item element_: modelData
                objectName: "tab" + index
                height: row.height
                width: Math.min(implicitWidth, (bar.width - buttons.width) / Math.max(1, bar.tabs.count))
                text: element_ && element_.title_ ? element_.title_ : qsTr("Tab %1").arg(index + 1)
                hint: element_ !== null && element_.status_ ? element_.status_ : ""
                wrong: element_ !== null && element_.wrong_ === true
                selected: bar.tabs.currentItem === element_
                onClicked: bar.tabs.show(index)
                PanelGrip {
                    anchors.fill: parent
                    panel: tab.element_ && tab.element_.element_ === "panel" ? tab.element_ : null
                    onClicked: bar.tabs.show(tab.number_)
                }
            }
        }
    }
    PanelStatus {
        anchors { right: buttons.left; rightMargin: Theme.gap * 0.8; verticalCenter: parent.verticalCenter }
        width: Math.max(0, Math.min(implicitWidth, bar.width - buttons.width - row.width - 2 * Theme.gap))
        panel: bar.panel_
    }
    PanelButtons {
        id: buttons
        anchors { right: parent.right; top: parent.top; bottom: parent.bottom }
        panel: bar.panel_
        hovered: hover.hovered
    }
}
