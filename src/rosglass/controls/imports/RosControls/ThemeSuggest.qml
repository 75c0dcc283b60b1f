// A line of text with suggestions that open below it: Down walks through them, Enter takes one.
import QtQuick 2.15
import QtQuick.Templates 2.15 as T

ThemeField {
    id: field

    // Returns the suggestions for what was typed: a list of {text, detail, suits}.
    property var suggest: null
    // Whether all suggestions are shown, whatever the text is; until it is edited.
    property bool all_: true
    property var found_: []

    // The text is complete, by Enter or by a suggestion.
    signal chosen(string text)

    function open_() {
        found_ = suggest ? suggest(all_ ? "" : text) : []
        list.currentIndex = -1
        found_.length ? popup.open() : popup.close()
    }
    function take_(index) {
        text = found_[index].text
        popup.close()
        chosen(text)
    }

    Accessible.role: Accessible.ComboBox
    onActiveFocusChanged: {
        all_ = true
        if (!activeFocus)
            popup.close()
    }
    onPressed: open_()
    onTextEdited: {
        all_ = false
        open_()
    }
    onAccepted: popup.visible && list.currentIndex >= 0 ? take_(list.currentIndex) : chosen(text)
    Keys.onDownPressed: {
        if (!popup.visible)
            open_()
        list.currentIndex = Math.min(list.count - 1, list.currentIndex + 1)
    }
    Keys.onUpPressed: list.currentIndex = Math.max(-1, list.currentIndex - 1)
    Keys.onPressed: function(event) {
        if (event.key === Qt.Key_Escape && popup.visible) {
            popup.close()
            event.accepted = true
        }
    }

    T.Popup {
        id: popup
        objectName: "suggestions"
        y: field.height
        width: Math.max(field.width, Math.min(420 * Theme.size, field.width * 2))
        implicitHeight: Math.min(list.contentHeight + 2, 8 * Theme.touch)
        padding: 1
        // The keyboard stays with the text.
        focus: false
        closePolicy: T.Popup.CloseOnPressOutsideParent
        contentItem: ListView {
            id: list
            clip: true
            model: field.found_
            currentIndex: -1
            boundsBehavior: Flickable.StopAtBounds
            T.ScrollBar.vertical: ThemeScrollBar {}
            delegate: Rectangle {
                width: list.width
                height: Math.round(Theme.touch * 0.8)
                color: ListView.isCurrentItem ? Theme.accent : over.containsMouse ? Theme.track : "transparent"
                Accessible.role: Accessible.ListItem
                Accessible.name: modelData.detail ? modelData.text + ", " + modelData.detail : modelData.text
                Accessible.onPressAction: field.take_(index)
                ThemeText {
                    id: name
                    anchors { left: parent.left; leftMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                    width: Math.min(implicitWidth, parent.width - 2 * Theme.gap - (kind.text ? Math.min(kind.implicitWidth, parent.width / 2) + Theme.gap : 0))
                    text: modelData.text
                    elide: Text.ElideMiddle
                    color: parent.ListView.isCurrentItem ? Theme.onAccent : modelData.suits === false ? Theme.dim : Theme.text
                }
                ThemeText {
                    id: kind
                    anchors { right: parent.right; rightMargin: Theme.gap; verticalCenter: parent.verticalCenter }
                    width: Math.min(implicitWidth, parent.width / 2)
                    text: modelData.detail || ""
                    color: parent.ListView.isCurrentItem ? Theme.onAccent : Theme.dim
                    font.pixelSize: Theme.small
                }
                MouseArea {
                    id: over
                    anchors.fill: parent
                    hoverEnabled: true
                    onClicked: field.take_(index)
                }
            }
        }
        background: Rectangle {
            radius: Theme.radius
            color: Theme.panel
            border { color: Theme.accent; width: 1 }
        }
    }
}
