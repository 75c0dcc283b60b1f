// A field to search; `text` follows, in small letters, once typing has paused.
import QtQuick
import QtQuick.Controls
import QtQuick.Layouts
import RQml.Fonts

RowLayout {
    id: bar

    property string placeholderText: qsTr("Search...")
    // Milliseconds of the pause.
    property int debounceInterval: 200
    property bool showNavigation: true
    readonly property bool searchFocused: field.activeFocus
    readonly property string text: text_
    property string text_

    signal nextRequested()
    signal previousRequested()

    function focusSearch() { field.forceActiveFocus() }
    function commitSearchText() {
        pause.stop()
        text_ = field.text.toLowerCase()
    }
    function clear() {
        field.clear()
        commitSearchText()
    }

    spacing: 4

    TextField {
        id: field
        objectName: "searchBarTextField"
        Layout.fillWidth: true
        placeholderText: bar.placeholderText
        leftPadding: 28
        rightPadding: erase.visible ? 28 : 8
        selectByMouse: true
        Accessible.name: bar.placeholderText
        onTextChanged: pause.restart()
        Keys.onEscapePressed: bar.clear()
        Keys.onReturnPressed: event => {
            bar.commitSearchText()
            if (event.modifiers & Qt.ShiftModifier)
                bar.previousRequested()
            else
                bar.nextRequested()
        }

        Label {
            textFormat: Text.PlainText
            anchors { left: parent.left; leftMargin: 8; verticalCenter: parent.verticalCenter }
            text: IconFont.iconSearch
            font { family: IconFont.name; pixelSize: 12 }
            opacity: 0.6
        }
        Label {
            id: erase
            textFormat: Text.PlainText
            anchors { right: parent.right; rightMargin: 8; verticalCenter: parent.verticalCenter }
            visible: field.text !== ""
            text: IconFont.iconClose
            font { family: IconFont.name; pixelSize: 12 }
            Accessible.role: Accessible.Button
            Accessible.name: qsTr("Clear")
            TapHandler { onTapped: bar.clear() }
        }
    }
    IconButton {
        visible: bar.showNavigation
        text: IconFont.iconChevronUp
        tooltipText: qsTr("Last match (Shift+Enter)")
        onClicked: bar.previousRequested()
    }
    IconButton {
        visible: bar.showNavigation
        text: IconFont.iconChevronDown
        tooltipText: qsTr("Next match (Enter)")
        onClicked: bar.nextRequested()
    }
    Timer {
        id: pause
        interval: bar.debounceInterval
        onTriggered: bar.commitSearchText()
    }
}
