import QtQuick
import QtQuick.Controls.Fusion

// The context menu of an interactive marker.
Menu {
    id: menu

    // Each with id, title and children.
    property var entries: []
    // Where it opens in its parent.
    property point place

    // An entry was chosen, by its id.
    signal picked(real id)

    popupType: Popup.Item
    delegate: Entry { }
    Component.onCompleted: {
        fill(menu, entries)
        popup(place.x, place.y)
    }

    function fill(target, entries) {
        for (const entry of entries) {
            if (entry.children.length > 0) {
                const inner = branch.createObject(target, { title: entry.title })
                fill(inner, entry.children)
                target.addMenu(inner)
            } else {
                target.addItem(leaf.createObject(target.contentItem, { text: entry.title, number: entry.id }))
            }
        }
    }

    // Titles come from the robot: they are text, never HTML.
    component Entry: MenuItem {
        id: item
        contentItem: Label {
            text: item.text
            textFormat: Text.PlainText
            color: item.highlighted ? item.palette.highlightedText : item.palette.text
            rightPadding: 16
            elide: Text.ElideRight
            verticalAlignment: Text.AlignVCenter
        }
    }
    Component {
        id: leaf
        Entry {
            property real number
            onTriggered: menu.picked(number)
        }
    }
    Component {
        id: branch
        Menu { popupType: Popup.Item; delegate: Entry { } }
    }
}
