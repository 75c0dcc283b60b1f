// A field with a list of proposals, which is searched by some letters of a name.
import QtQuick
import QtQuick.Controls
import RQml.Fonts
import RQml.Utils

FocusScope {
    id: selector

    property string text
    property alias editText: selector.text
    property string placeholderText
    // Texts to choose from.
    property var model: []
    // Index of the text in the model; -1 if it is another one.
    property int currentIndex: -1
    readonly property string currentText: items_[currentIndex] ?? ""
    // Whether another text than those of the model may be typed.
    property bool editable: true
    // What is listed: texts that match come first, the best before others.
    readonly property var filteredItems: {
        if (!text || all_)
            return ranked_().concat(items_.filter(item => FuzzySearch.score(item, text) < 0 || !text).sort())
        return ranked_()
    }
    readonly property var items_: model ? Array.from(model, String) : []
    property bool all_: false

    // The text was confirmed by the Enter key.
    signal accepted(string text)

    function ranked_() {
        if (!text)
            return []
        return items_.map(item => [FuzzySearch.score(item, text), item]).filter(pair => pair[0] >= 0)
            .sort((a, b) => b[0] - a[0] || (a[1] < b[1] ? -1 : 1)).map(pair => pair[1])
    }

    function open_(all) {
        all_ = all
        if (filteredItems.length && !list.visible)
            list.open()
    }

    function choose_(item) {
        list.close()
        text = item
    }

    implicitWidth: field.implicitWidth
    implicitHeight: field.implicitHeight
    onTextChanged: {
        if (field.text !== text)
            field.text = text
        currentIndex = items_.indexOf(text)
    }
    onItems_Changed: currentIndex = items_.indexOf(text)
    onCurrentIndexChanged: if (items_[currentIndex] !== undefined) text = items_[currentIndex]
    onFilteredItemsChanged: if (!filteredItems.length) list.close()

    TextField {
        id: field
        anchors.fill: parent
        focus: true
        placeholderText: selector.placeholderText
        readOnly: !selector.editable
        selectByMouse: true
        rightPadding: arrow.width + 14
        Accessible.role: Accessible.ComboBox
        Accessible.name: selector.placeholderText || selector.text
        onTextEdited: {
            selector.text = text
            selector.open_(false)
            rows.currentIndex = -1
        }
        onPressed: if (!selector.editable) selector.open_(true)
        Keys.onDownPressed: {
            if (list.visible)
                rows.incrementCurrentIndex()
            else
                selector.open_(true)
        }
        Keys.onUpPressed: rows.decrementCurrentIndex()
        Keys.onEscapePressed: event => {
            event.accepted = list.visible
            list.close()
        }
        Keys.onReturnPressed: {
            const item = list.visible ? selector.filteredItems[rows.currentIndex] : undefined
            list.close()
            if (item !== undefined)
                selector.text = item
            selector.accepted(selector.text)
        }

        Label {
            id: arrow
            textFormat: Text.PlainText
            anchors { right: parent.right; rightMargin: 8; verticalCenter: parent.verticalCenter }
            text: IconFont.iconChevronDown
            font { family: IconFont.name; pixelSize: 12 }
            Accessible.ignored: true

            MouseArea {
                anchors { fill: parent; margins: -8 }
                cursorShape: Qt.PointingHandCursor
                onClicked: {
                    const was = list.visible
                    field.forceActiveFocus()
                    if (was)
                        list.close()
                    else
                        selector.open_(true)
                }
            }
        }
    }
    Popup {
        id: list
        y: selector.height
        width: selector.width
        padding: 1
        closePolicy: Popup.CloseOnEscape | Popup.CloseOnPressOutsideParent
        onOpened: rows.currentIndex = -1
        onClosed: selector.all_ = false
        contentItem: ListView {
            id: rows
            implicitHeight: Math.min(contentHeight, 300)
            clip: true
            model: list.visible ? selector.filteredItems : []
            boundsBehavior: Flickable.StopAtBounds
            ScrollBar.vertical: ScrollBar {}
            delegate: ItemDelegate {
                required property string modelData
                required property int index
                width: rows.width
                contentItem: Label {
                    text: modelData
                    textFormat: Text.PlainText
                    elide: Text.ElideRight
                }
                Accessible.name: modelData
                highlighted: index === rows.currentIndex
                onClicked: {
                    selector.choose_(modelData)
                    field.forceActiveFocus()
                }
            }
        }
    }
}
