// A choice among texts, from a list that opens.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

T.ComboBox {
    id: choice

    // What is chosen by it, for screen readers.
    property string name

    implicitWidth: 140 * Theme.size
    implicitHeight: Theme.touch
    leftPadding: Theme.gap
    rightPadding: Theme.gap * 2
    focusPolicy: Qt.StrongFocus
    hoverEnabled: true
    Accessible.role: Accessible.ComboBox
    Accessible.name: name ? name + ": " + displayText : displayText
    Accessible.onPressAction: toggle_()
    Keys.onReturnPressed: toggle_()

    function toggle_() { popup.visible ? popup.close() : popup.open() }

    contentItem: ThemeText {
        text: choice.displayText
        color: choice.enabled ? Theme.text : Theme.faint
        verticalAlignment: Text.AlignVCenter
    }
    indicator: ThemeText {
        x: choice.width - width - Theme.gap
        height: choice.height
        text: "▾"
        color: choice.enabled ? Theme.accent : Theme.faint
        verticalAlignment: Text.AlignVCenter
    }
    background: Rectangle {
        radius: Theme.radius
        color: Theme.track
        border { color: choice.activeFocus ? Theme.accent : Theme.edge; width: choice.activeFocus ? 2 : 1 }
    }
    delegate: T.ItemDelegate {
        id: entry
        width: ListView.view ? ListView.view.width : 0
        implicitHeight: Theme.touch
        leftPadding: Theme.gap
        rightPadding: Theme.gap
        text: choice.textAt(index)
        highlighted: choice.highlightedIndex === index
        Accessible.role: Accessible.ListItem
        Accessible.name: text
        contentItem: ThemeText {
            text: entry.text
            color: entry.highlighted ? Theme.onAccent : Theme.text
            verticalAlignment: Text.AlignVCenter
        }
        background: Rectangle { color: entry.highlighted ? Theme.accent : "transparent" }
    }
    popup: T.Popup {
        y: choice.height
        width: choice.width
        implicitHeight: Math.min(contentItem.implicitHeight + 2, 10 * Theme.touch)
        padding: 1
        contentItem: ListView {
            clip: true
            implicitHeight: contentHeight
            model: choice.delegateModel
            currentIndex: choice.highlightedIndex
            T.ScrollBar.vertical: ThemeScrollBar {}
        }
        background: Rectangle {
            radius: Theme.radius
            color: Theme.panel
            border { color: Theme.accent; width: 1 }
        }
    }
}
